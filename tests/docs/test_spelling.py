"""Words in code on the pages are spelt as elsewhere: a rare word one letter from a common one is a slip."""

from __future__ import annotations

import functools
import re
import string
from collections import Counter
from pathlib import Path

import pytest

import pages
from pages import PAGES, ROOT

WORD = re.compile(r"[a-z]{4,}")
FOLDERS = ("benchmarks", "docs", "examples", "src", "tests", "tools")
RARE, COMMON = 2, 8  # occurrences in the tree; a command may stand on the page of the other language, too

OWN = {"maker", "reuses"}  # rare words that are meant: neither "marker" nor "refuses"


@functools.cache
def occurrences() -> Counter[str]:
    """How often each word stands in programs, pages and scenes."""
    files = [path for folder in FOLDERS for path in (ROOT / folder).rglob("*") if path.suffix in (".py", ".md")]
    files += [*ROOT.glob("*.md"), *ROOT.glob("examples/*/*.json"), ROOT / "Makefile", ROOT / "pyproject.toml"]
    found: Counter[str] = Counter()
    for file in files:
        found.update(WORD.findall(file.read_text(encoding="utf-8").lower()))
    return found


def slip(word: str, found: Counter[str]) -> str:
    """The common word that this one is with a letter doubled, left out or exchanged with the next; or empty."""
    tried = [word[:i] + letter + word[i:] for i in range(1, len(word)) for letter in string.ascii_lowercase]
    for i in range(1, len(word) - 1):
        if word[i] == word[i - 1]:
            tried.append(word[:i] + word[i + 1 :])
        if word[i] != word[i + 1]:
            tried.append(word[:i] + word[i + 1] + word[i] + word[i + 2 :])
    return next((other for other in tried if found[other] >= COMMON), "")


def code(page: Path) -> str:
    """What stands in listings and in backquotes."""
    text = page.read_text(encoding="utf-8")
    return " ".join(
        [one.text for one in pages.listings(text)] + re.findall(r"`([^`\n]+)`", pages.without_listings(text))
    )


def test_no_word_of_code_is_a_slip() -> None:
    found = occurrences()
    words = {(word, pages.name(page)) for page in PAGES for word in WORD.findall(code(page).lower())}
    rare = {(word, page) for word, page in words if found[word] <= RARE and word not in OWN and page != "CHANGELOG"}
    assert len(rare) > 20
    assert [(word, page, slip(word, found)) for word, page in sorted(rare) if slip(word, found)] == []


@pytest.mark.parametrize("word", ["materrial", "materal", "mateiral"])
def test_a_slip_is_found(word: str) -> None:
    assert slip(word, occurrences()) == "material"
