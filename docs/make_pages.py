"""Write docs/models/NAME.md for every model: the page that `gonio explain` prints, in Markdown.

python docs/make_pages.py [--check]      --check writes nothing and fails where a page is out of date
"""

from __future__ import annotations

import sys
from pathlib import Path

import gonio as go
from gonio.verify import quality
from gonio.viewer import manual

FOLDER = Path(__file__).parent / "models"


def main() -> int:
    """Write or check the pages; returns the exit code."""
    check = "--check" in sys.argv[1:]
    sampling = quality.of_models()
    pages = {
        FOLDER / f"{name}.md": manual.page(model).markdown() + _sampling(*sampling[name])
        for name, model in go.models().items()
    }
    stale = [path for path, text in pages.items() if not path.exists() or path.read_text() != text]
    stale += [path for path in FOLDER.glob("*.md") if path not in pages]
    if check:
        for path in stale:
            print(f"out of date: {path}; run `make docs`")
        return 1 if stale else 0
    FOLDER.mkdir(exist_ok=True)
    for path in stale:
        if path in pages:
            path.write_text(pages[path])
        else:
            path.unlink()
    print(f"{len(pages)} pages, {len(stale)} written")
    return 0


def _sampling(title: str, found: quality.Quality | None) -> str:
    """A paragraph on how well a material samples itself."""
    if found is None:
        return ""
    return f"\nSampling of `{title}`: {found.words.removeprefix('sampling: ')} ([what that is](../verify.md)).\n"


if __name__ == "__main__":
    sys.exit(main())
