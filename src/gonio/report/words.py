"""report.md: the text of a report, with references to its figures.

Gonio writes the file once and afterwards only reads it. The author edits the file.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple
from urllib.parse import unquote

from ..errors import InputError
from . import formulas
from .entries import Figure

if TYPE_CHECKING:
    from markdown_it import MarkdownIt

WORDS_FILE, FOLDER, SETTINGS = "report.md", "figures", "settings.csv"
PICTURES = {".png": "png", ".jpg": "jpeg", ".jpeg": "jpeg", ".gif": "gif", ".webp": "webp", ".svg": "svg+xml"}


class Reference(NamedTuple):
    """A reference to a picture or table in the text."""

    line: int
    target: str


def first_words(title: str, author: str, figures: Sequence[tuple[str, Figure]]) -> str:
    """The text of a new report.md.

    figures  file name and figure, in order
    """
    blocks = [f"# {title}", author or "*Your name, the date*"]
    if not any(figure.text for _, figure in figures):
        blocks.append("*Summarize the assignment and your work in a few sentences.*")
    for name, figure in figures:
        blocks += [
            f"## {figure.heading or figure.title()}",
            figure.text.strip() or "*What does the figure show, and why?*",
            inclusion(name, figure),
        ]
    blocks += ["## Commands for the figures", f"[Each figure with its command]({FOLDER}/{SETTINGS})"]
    return "\n\n".join(blocks) + "\n"


def inclusion(file: str, figure: Figure) -> str:
    """The line of report.md that includes a figure."""
    caption = figure.caption.strip() or re.sub(r"([][*_`$\\])", r"\\\1", figure.description())
    return f"{'' if file.endswith('.csv') else '!'}[{' '.join(caption.split())}]({FOLDER}/{file})"


def parser() -> MarkdownIt:
    """A Markdown parser with support for tables and formulas. HTML is treated as text."""
    from markdown_it import MarkdownIt

    markdown = MarkdownIt("commonmark", {"html": False}).enable(["table", "strikethrough"])
    formulas.plugin(markdown)
    return markdown


def references(text: str) -> Iterator[Reference]:
    """The references to pictures and tables in the text, with their line numbers."""
    for token in parser().parse(text):
        for child in token.children or ():
            target = str(child.attrs.get("src" if child.type == "image" else "href", ""))
            if child.type == "image" or (child.type == "link_open" and target.lower().endswith(".csv")):
                yield Reference(token.map[0] + 1 if token.map else 1, unquote(target))


def check_references(text: str, folder: Path, made: Collection[str], allow_outside: bool) -> None:
    """Raise InputError for a referenced picture or table that neither exists nor will be created.

    made           files in the folder `figures` that are created from the list
    allow_outside  allow files outside the folder
    """
    for line, target in references(text):
        if target not in {f"{FOLDER}/{name}" for name in made}:
            local(folder, target, f"{folder / WORDS_FILE}:{line}", allow_outside)


def local(folder: Path, target: str, location: str, allow_outside: bool) -> Path:
    """The path of a picture or table to which the text refers. Raises InputError with the given `location` if the file
    cannot be used."""
    if re.match(r"[a-zA-Z][a-zA-Z+.-]+:", target):
        raise InputError(f"'{target}' is not a file", location, "save it in the report's folder, and name it there")
    path = folder / target
    if path.suffix.lower() not in (*PICTURES, ".csv"):
        raise InputError(f"'{target}' is not a picture", location, f"give {', '.join(PICTURES)} or .csv")
    if not path.is_file():
        hint = f"the list has no such figure: add it there, or remove it from {WORDS_FILE}"
        raise InputError(f"no file '{target}'", location, hint)
    if not allow_outside and not path.resolve().is_relative_to(folder.resolve()):
        raise InputError(
            f"'{target}' is outside the report's folder", location, "copy it there, or add --allow-outside"
        )
    return path
