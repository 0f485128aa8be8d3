"""Conversion of docstrings to Markdown: prose, listings, displayed formulas and tables of arguments."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

ROW = re.compile(r"^(\S+(?:,? \S+)*?)  +(\S.*)$")
FORMULA = re.compile(r"^\S+(?:\(.*?\))? = |^\S{1,8}(?:, \S{1,8})* = |^\(.*= ")
SPECIAL = re.compile(r"([\\*_<>|$\[\]#])")
QUOTED = re.compile(r"(`+[^`]+`+)")


def markdown(doc: str) -> str:
    """A docstring, without its indentation, as Markdown."""
    return "\n\n".join(block for paragraph in re.split(r"\n\s*\n", doc.strip("\n")) for block in _blocks(paragraph))


def _blocks(paragraph: str) -> Iterator[str]:
    lines = [line for line in paragraph.split("\n") if line.strip() != "\\b"]
    if not lines:
        return
    if all(line.startswith("  ") for line in lines):
        yield fenced("\n".join(line.removeprefix("    ").removeprefix("  ") for line in lines))
    elif any(ROW.match(line) for line in lines):
        yield from _rows(lines)
    elif any(FORMULA.match(line) for line in lines[1:]):
        yield fenced("\n".join(lines))
    else:
        yield escaped(" ".join(line.strip() for line in lines))


def _rows(lines: Sequence[str]) -> Iterator[str]:
    """Lines of the form "name  meaning" as a table, with the lines before and after them as prose."""
    before: list[str] = []
    rows: list[list[str]] = []
    after: list[str] = []
    for line in lines:
        if (row := ROW.match(line)) and not after:
            rows.append([row[1], row[2]])
        elif rows and line.startswith("  ") and not after:
            rows[-1][1] += " " + line.strip()
        else:
            (after if rows else before).append(line.strip())
    if before:
        yield escaped(" ".join(before))
    yield table(("name", "meaning"), ((f"`{name}`", escaped(text)) for name, text in rows))
    if after:
        yield escaped(" ".join(after))


def table(head: Sequence[str], rows: Iterator[Sequence[str]] | Sequence[Sequence[str]]) -> str:
    """A table in Markdown; the cells are given as Markdown."""
    lines = [" | ".join(head), " | ".join("---" for _ in head), *(" | ".join(row) for row in rows)]
    return "\n".join(f"| {line} |" for line in lines)


def escaped(text: str) -> str:
    """Plain text escaped as Markdown; `code` in backquotes remains code."""
    return "".join(part if part.startswith("`") else SPECIAL.sub(r"\\\1", part) for part in QUOTED.split(text))


def cell(text: str) -> str:
    """Markdown for a single cell of a table."""
    return re.sub(r"\s+", " ", text).replace("|", "\\|").strip()


def fenced(text: str, language: str = "text") -> str:
    """A fenced listing."""
    fence = "`" * max(3, max((len(run) for run in re.findall(r"`+", text)), default=0) + 1)
    return f"{fence}{language}\n{text.strip(chr(10))}\n{fence}"
