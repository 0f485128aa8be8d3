"""Files in the root of the repository that are chapters of the book."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).parents[2]


def pages() -> dict[str, str | bytes]:
    """Unchanged copies of CONTRIBUTING.md and CHANGELOG.md."""
    return {
        f"project/{name.lower()}.md": (ROOT / f"{name}.md").read_text(encoding="utf-8")
        for name in ("CONTRIBUTING", "CHANGELOG")
    }
