"""Write docs/models/NAME.md for every model: the page that `gonio explain` prints, in Markdown.

python docs/make_pages.py [--check]      --check writes nothing and fails where a page is out of date
"""

from __future__ import annotations

import math
import re
import sys
from pathlib import Path

import gonio as go
from gonio.verify import quality
from gonio.viewer import manual

FOLDER = Path(__file__).parent / "models"
NUMBER = re.compile(r"\d*\.?\d+")


def main() -> int:
    """Write or check the pages; returns the exit code."""
    check = "--check" in sys.argv[1:]
    same = _alike if check else str.__eq__
    sampling = quality.of_models()
    pages = {
        FOLDER / f"{name}.md": manual.page(model).markdown() + _sampling(*sampling[name])
        for name, model in go.models().items()
    }
    stale = [path for path, text in pages.items() if not (path.exists() and same(path.read_text(), text))]
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


def _alike(old: str, new: str) -> bool:
    """Whether two pages are the same, up to 10 % in the figures of sampling, which vary with the processor."""
    *lines, last = old.splitlines()
    *new_lines, new_last = new.splitlines()
    figures = [float(number) for number in NUMBER.findall(last)]
    new_figures = [float(number) for number in NUMBER.findall(new_last)]
    return (
        lines == new_lines
        and NUMBER.sub("", last) == NUMBER.sub("", new_last)
        and all(math.isclose(a, b, rel_tol=0.1) for a, b in zip(figures, new_figures, strict=True))
    )


def _sampling(title: str, found: quality.Quality | None) -> str:
    """A paragraph on how well a material samples itself."""
    if found is None:
        return ""
    return f"\nSampling of `{title}`: {found.words.removeprefix('sampling: ')} ([what that is](../verify.md)).\n"


if __name__ == "__main__":
    sys.exit(main())
