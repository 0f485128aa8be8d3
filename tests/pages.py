"""The pages of the documentation, for the tests of what they say."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
COPIES = ("reference", "gallery", "project")  # folders of docs/ that building the book makes
PAGES = [
    page
    for page in sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("examples/*/*.md")])
    if page.relative_to(ROOT).parts[1:2] not in [(copy,) for copy in COPIES]
]
LISTING = re.compile(r"^```(\w*) ?([\w.-]*)\n(.*?)^```$|(?:^    \S[^\n]*\n(?:\n(?=    ))?)+", re.DOTALL | re.MULTILINE)


class Listing(NamedTuple):
    """A block of code: its language, empty where it is indented; the file that it is to be stored in; its text."""

    language: str
    file: str
    text: str


def name(page: Path) -> str:
    """A test's id: the page's path, shortened."""
    return page.relative_to(ROOT).with_suffix("").as_posix().removeprefix("docs/").removesuffix("/README")


def listings(text: str) -> Iterator[Listing]:
    """The blocks of code of a page, fenced or indented by four columns."""
    for block in LISTING.finditer(text):
        if block[3] is not None:
            yield Listing(block[1], block[2], block[3])
        else:
            yield Listing("", "", block[0])


def without_listings(text: str) -> str:
    """The page's prose, tables and headings."""
    return LISTING.sub("\n", text)
