"""The bibliography, with a link to every page of the book and every file that cites an entry."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

from .text import escaped

ROOT = Path(__file__).parents[2]
KEY = re.compile(r"\b(?:[A-Z][A-Za-z]+(?:19|20)\d{2}[a-z]?|PBRT4|SchottBK7)\b")
ENTRY = re.compile(r"@(\w+)\{(\w+), (.*)\}$", re.MULTILINE)
FIELD = re.compile(r"(\w+) = (?:\{((?:[^{}]|\{(?:[^{}]|\{[^{}]*\})*\})*)\}|(\d+))")
ACCENTS = {
    **{'"' + a: b for a, b in zip("aouAOU", "äöüÄÖÜ", strict=True)},
    **{"'" + a: b for a, b in zip("aeiouc", "áéíóúć", strict=True)},
    **{"`" + a: b for a, b in zip("aeo", "àèò", strict=True)},
    "r{A}": "Å", "AA ": "Å", "AA": "Å", "aa": "å", "v s": "š", "v{s}": "š", "v{c}": "č", "vs": "š",
    "^i": "î", "^o": "ô", "~n": "ñ",
}  # fmt: skip


@cache
def known() -> dict[str, dict[str, str]]:
    """key -> field -> text of docs/references.bib."""
    text = (ROOT / "docs/references.bib").read_text(encoding="utf-8")
    return {
        entry[2]: {field[1]: plain(field[2] or field[3]) for field in FIELD.finditer(entry[3])}
        for entry in ENTRY.finditer(text)
    }


def plain(text: str) -> str:
    """BibTeX's text in Unicode."""
    for spelled, letter in ACCENTS.items():
        text = text.replace("{\\" + spelled + "}", letter).replace("\\" + spelled, letter)
    return re.sub(r"[{}]|\\(?=[%&_])", "", text).replace("--", "\N{EN DASH}")


def citation(key: str) -> str:
    """An entry in one line of Markdown."""
    entry = known()[key]
    authors = entry.get("author", "").split(" and ")
    names = ", ".join(authors[:3]) + (" and others" if len(authors) > 3 else "")
    where = ("journal", "booktitle", "institution", "publisher", "howpublished", "note")
    places = ", ".join(entry[field] for field in where if field in entry)
    return f"**{key}**: {escaped(names)}: {escaped(entry.get('title', ''))}. {escaped(places)}, {entry.get('year', '')}"


def pages() -> dict[str, str | bytes]:
    """The page of the bibliography."""
    lines = ["# Bibliography", "", "Each entry with the pages and source files that cite it.", ""]
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
