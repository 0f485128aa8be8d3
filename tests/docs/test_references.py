"""Every citation in the source is in the bibliography, and every entry of the bibliography is cited."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
MODELS = {"Disney2015"}  # that are called as a citation is
KEY = re.compile(r"\b(?:[A-Z][A-Za-z]+(?:19|20)\d{2}[a-z]?|PBRT4|SchottBK7)\b")


def cited() -> dict[str, str]:
    found: dict[str, str] = {}
    for folder, pattern in (("src", "*.py"), ("docs", "*.md")):
        for path in (ROOT / folder).rglob(pattern):
            if path.is_relative_to(ROOT / "docs/reference"):  # made from the code, where a book has been built
                continue
            for key in set(KEY.findall(path.read_text(encoding="utf-8"))) - MODELS:
                found[key] = str(path.relative_to(ROOT))
    return found


def known() -> set[str]:
    return set(re.findall(r"@\w+\{(\w+),", (ROOT / "docs/references.bib").read_text(encoding="utf-8")))


def test_every_citation_is_in_the_bibliography() -> None:
    assert {key: place for key, place in cited().items() if key not in known()} == {}


def test_every_entry_of_the_bibliography_is_cited() -> None:
    assert known() - set(cited()) == set()


def test_the_manual_pages_are_what_the_docstrings_say() -> None:
    done = subprocess.run([sys.executable, ROOT / "docs/make_pages.py", "--check"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
