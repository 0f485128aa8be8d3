"""report.html: the text of a report with its pictures and tables, in a single file that needs no network."""

from __future__ import annotations

import csv
import itertools
from base64 import b64encode
from collections.abc import Sequence
from html import escape
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

from ..errors import InputError
from .words import PICTURES, WORDS_FILE, local, parser

if TYPE_CHECKING:
    from markdown_it import MarkdownIt
    from markdown_it.token import Token

MAX_BYTES = 64 << 20  # total size of the pictures of a page
MAX_ROWS = 2000  # rows of a table; browsers are slow with more, and such tables are not readable
_HEAD = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<title>{title}</title>
<style>
{style}</style>
<main>
"""


def page(text: str, folder: Path, allow_outside: bool = False) -> str:
    """The page for the text of a report, which is Markdown. HTML in the text is displayed literally.

    folder  the folder of report.md, to which the paths of pictures and tables are relative
    Raises InputError, with file and line, for a picture or table that cannot be shown.
    """
    markdown = parser()
    tokens = markdown.parse(text)
    reader = _Reader(markdown, folder, allow_outside)
    body = reader.html(tokens)
    title = next((after.content for token, after in itertools.pairwise(tokens) if token.tag == "h1"), "Report")
    style = resources.files(__package__).joinpath("style.css").read_text(encoding="utf-8")
    return _HEAD.format(title=escape(title), style=style) + body + "</main>\n</html>\n"


class _Reader:
    """Converts tokens to HTML. A paragraph that consists only of a picture, or of a link to a .csv file, becomes a
    figure."""

    def __init__(self, markdown: MarkdownIt, folder: Path, allow_outside: bool) -> None:
        self.markdown, self.folder, self.allow_outside = markdown, folder, allow_outside
        self.left = MAX_BYTES

    def html(self, tokens: Sequence[Token]) -> str:
        output, index = [], 0
        while index < len(tokens):
            token = tokens[index]
            figure = self._figure(tokens[index + 1]) if token.type == "paragraph_open" else ""
            if figure:
                output.append(figure)
                index += 3
                continue
            location = self._location(token)
            for child in token.children or ():
                if child.type == "image":
                    child.attrs["src"] = self._data(str(child.attrs["src"]), location)
            env = {"location": location}
            output.append(self.markdown.renderer.render([token], self.markdown.options, env))
            index += 1
        return "".join(output)

    def _location(self, token: Token) -> str:
        return f"{self.folder / WORDS_FILE}:{token.map[0] + 1}" if token.map else str(self.folder / WORDS_FILE)

    def _figure(self, inline: Token) -> str:
        """A figure with its caption, or "" for a paragraph of text."""
        location, children = self._location(inline), inline.children or []
        first = children[0] if children else None
        if first is None:
            return ""
        if len(children) == 1 and first.type == "image":
            data = self._data(str(first.attrs["src"]), location)
            caption = self._words(first.children or [], location)
            return (
                f'<figure><img src="{data}" alt="{escape(first.content)}"><figcaption>{caption}</figcaption></figure>\n'
            )
        target = str(first.attrs.get("href", "")) if first.type == "link_open" else ""
        if target.lower().endswith(".csv") and children[-1].type == "link_close":
            caption = self._words(children[1:-1], location)
            table = self._table(unquote(target), location)
            return f'<figure class="table"><figcaption>{caption}</figcaption>{table}</figure>\n'
        return ""

    def _words(self, children: Sequence[Token], location: str) -> str:
        renderer: Any = self.markdown.renderer  # its protocol lacks this method
        options: Any = self.markdown.options
        return str(renderer.renderInline(children, options, {"location": location}))

    def _data(self, target: str, location: str) -> str:
        """A picture as a data URI."""
        path = local(self.folder, unquote(target), location, self.allow_outside)
        content = path.read_bytes()
        self.left -= len(content)
        if self.left < 0:
            what = f"the pictures exceed {MAX_BYTES >> 20} MiB together"
            raise InputError(what, location, "show fewer, or smaller ones: --size")
        kind = PICTURES.get(path.suffix.lower())
        if kind is None:
            raise InputError(f"'{target}' is not a picture", location, "show a table by a link: [caption](FILE.csv)")
        return f"data:image/{kind};base64,{b64encode(content).decode()}"

    def _table(self, target: str, location: str) -> str:
        path = local(self.folder, target, location, self.allow_outside)
        try:
            with path.open(encoding="utf-8-sig", newline="") as file:
                rows = [row for row, _ in zip(csv.reader(file), range(MAX_ROWS + 1), strict=False)]
        except (UnicodeDecodeError, csv.Error) as error:
            raise InputError(f"'{target}' is not a table: {error}", location, "save it as .csv in UTF-8") from None
        if len(rows) > MAX_ROWS:
            raise InputError(f"'{target}' has more than {MAX_ROWS} rows", location, "show a part of it, or a plot")
        head, *body = rows or [[]]
        lines = ["".join(f"<th>{escape(cell)}</th>" for cell in head)]
        lines += ["".join(f"<td>{_cell(cell)}</td>" for cell in row) for row in body]
        return "<table>" + "".join(f"<tr>{line}</tr>" for line in lines) + "</table>"


def _cell(text: str) -> str:
    return f"<code>{escape(text)}</code>" if text.startswith("gonio ") else escape(text)
