"""The last step of scripts that write one page: write the page, or compare it."""

from __future__ import annotations

import sys
from pathlib import Path


def written(page: Path, text: str, remedy: str = "run `make docs`") -> int:
    """Write the page; with `--check` on the command line, compare it instead. Returns the exit code: 1 if it is out of
    date."""
    if "--check" in sys.argv[1:]:
        stale = not page.exists() or page.read_text(encoding="utf-8") != text
        print(f"out of date: {page}; {remedy}" if stale else f"{page} is up to date")
        return int(stale)
    page.write_text(text, encoding="utf-8")
    print(page)
    return 0
