"""The bibliography, with links to the pages of the book and the names of the files that cite each entry."""

from __future__ import annotations

import re
import unicodedata
from functools import cache
from pathlib import Path

from .text import escaped

ROOT = Path(__file__).parents[2]
KEY = re.compile(r"\b(?:[A-Z][A-Za-z]+(?:19|20)\d{2}[a-z]?|PBRT4|SchottBK7)\b")
ENTRY = re.compile(r"@(\w+)\{(\w+), (.*)\}$", re.MULTILINE)
FIELD = re.compile(r"(\w+) = (?:\{((?:[^{}]|\{(?:[^{}]|\{[^{}]*\})*\})*)\}|(\d+))")
ACCENT = re.compile(r"\\(?:([\"'`^~=.])\s*\{?\\?([A-Za-z])\}?|([uvHcr])(?:\s+|\{)([A-Za-z])\}?)")
COMBINING = dict(
    zip("\"'`^~=.uvHcr", "\u0308\u0301\u0300\u0302\u0303\u0304\u0307\u0306\u030c\u030b\u0327\u030a", strict=True)
)
LETTERS = {"AA": "Å", "aa": "å", "O": "Ø", "o": "ø", "L": "Ł", "l": "ł", "ss": "ß", "ae": "æ"}
LETTER = re.compile(r"\\(AA|aa|ae|ss|O|o|L|l)(?![A-Za-z])\s*")


@cache
def known() -> dict[str, dict[str, str]]:
    """The entries of docs/references.bib: key -> field -> text."""
    text = (ROOT / "docs/references.bib").read_text(encoding="utf-8")
    return {
        entry[2]: {field[1]: plain(field[2] or field[3]) for field in FIELD.finditer(entry[3])}
        for entry in ENTRY.finditer(text)
    }


def plain(text: str) -> str:
    """BibTeX text converted to Unicode."""

    def accented(found: re.Match[str]) -> str:
        mark, letter = (found[1], found[2]) if found[1] else (found[3], found[4])
        return unicodedata.normalize("NFC", letter + COMBINING[mark])

    text = text.replace("$\\mu$", "\N{GREEK SMALL LETTER MU}")
    text = LETTER.sub(lambda found: LETTERS[found[1]], ACCENT.sub(accented, text))
    return re.sub(r"[{}]|\\(?=[%&_])", "", text).replace("--", "\N{EN DASH}")


def citation(key: str) -> str:
    """An entry as one line of Markdown."""
    entry = known()[key]
    authors = entry.get("author", "").split(" and ")
    names = ", ".join(authors[:3]) + (" and others" if len(authors) > 3 else "")
    where = ("journal", "booktitle", "institution", "publisher", "howpublished", "note")
    places = ", ".join(entry[field] for field in where if field in entry)
    return f"**{key}**: {escaped(names)}: {escaped(entry.get('title', ''))}. {escaped(places)}, {entry.get('year', '')}"


def pages() -> dict[str, str | bytes]:
    """The bibliography page."""
    lines = ["# Bibliography", "", "Each entry is followed by the pages and source files that cite it.", ""]
    for key in sorted(known()):
        lines += [f"({key.lower()})=", f"- {citation(key)}. Cited by {_uses(key)}.", ""]
    return {"reference/bibliography/index.md": "\n".join(lines)}


@cache
def _citing() -> dict[str, list[str]]:
    uses: dict[str, list[str]] = {}
    for pattern in ("docs/*.md", "src/gonio/**/*.py"):
        for path in sorted(ROOT.glob(pattern)):
            name = path.relative_to(ROOT).as_posix()
            for key in set(KEY.findall(path.read_text(encoding="utf-8"))):
                uses.setdefault(key, []).append(name)
    return uses


def _uses(key: str) -> str:
    found = [
        f"[{Path(name).stem}](../../{name.removeprefix('docs/')})" if name.startswith("docs/") else f"`{name}`"
        for name in _citing().get(key, ())
    ]
    return ", ".join(found) or "data files only"
