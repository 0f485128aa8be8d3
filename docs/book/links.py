"""Links to files outside docs/, rewritten to the pages of the book that show these files."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

LINK = re.compile(r"(?<!!)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s#:]+)(#[^)\s]*)?\)")
ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
CARDS = ("report-cards/README", "report-cards/engines/README")
PAGES = {"README.md": "index.md", "CONTRIBUTING.md": "project/contributing.md", "CHANGELOG.md": "project/changelog.md"}


def rewrite(app: Any, name: str, source: list[str]) -> None:
    """Handler of Sphinx's event source-read: rewrites the links of a page to the pages of the book."""
    folder = (DOCS / name).parent
    source[0] = LINK.sub(lambda link: _led(link, origin(name), folder), source[0])
    if name in CARDS:  # on GitHub, these pages need no table of contents
        source[0] += "\n:::{toctree}\n:hidden:\n:glob:\n\n*\n:::\n"


def origin(name: str) -> Path:
    """The folder to which a page's links are relative: that of the original file if the page is a copy."""
    kind, _, rest = name.partition("/")
    if kind == "project":
        return ROOT
    if kind == "gallery" and (ROOT / "examples" / rest).is_dir():
        return ROOT / "examples" / rest
    return (DOCS / name).parent


def target(path: Path) -> str | None:
    """The page of the book, relative to docs/, that shows a file or folder of the repository; None if none does."""
    inside = path.relative_to(ROOT).as_posix() if path.is_relative_to(ROOT) else ""
    if inside in PAGES:
        return PAGES[inside]
    parts = inside.split("/")
    if inside == "docs/models":
        return "reference/models/index.md"
    if parts[:2] == ["docs", "models"]:
        return f"reference/models/{parts[2]}"
    if inside in ("examples", "examples/README.md"):
        return "gallery/index.md"
    if parts[0] == "examples" and len(parts) > 1 and (len(parts) == 2 or parts[2] == "README.md"):
        return f"gallery/{parts[1]}.md" if (ROOT / "examples" / parts[1]).is_dir() else None
    if inside.startswith("docs/") and path.is_dir() and (path / "README.md").exists():
        return inside.removeprefix("docs/") + "/README.md"
    return None


def _led(link: re.Match[str], start: Path, folder: Path) -> str:
    text, there, anchor = link[1], link[2], link[3] or ""
    path = Path(os.path.normpath(start / there))
    page = target(path)
    if page is None:
        if not path.exists():  # a generated page, or an error that Sphinx reports
            return link[0]
        if path.is_dir() or not path.is_relative_to(DOCS):
            return f"{text} (`{path.relative_to(ROOT).as_posix()}`)" if path.is_relative_to(ROOT) else link[0]
        page = path.relative_to(DOCS).as_posix()
    return f"[{text}]({os.path.relpath(DOCS / page, folder)}{anchor})"
