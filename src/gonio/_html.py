"""Markup: HTML tables for notebooks, and the ids of SVG drawings."""

from __future__ import annotations

import re
from collections.abc import Iterable
from html import escape


def table(rows: Iterable[Iterable[object]], headings: Iterable[str] = (), title: str = "") -> str:
    """An HTML table of the given cells; special characters are escaped."""
    head = "".join(f"<th>{escape(text)}</th>" for text in headings)
    lines = ["".join(f"<td>{escape(str(cell))}</td>" for cell in row) for row in rows]
    body = "".join(f"<tr>{line}</tr>" for line in [*([head] if head else []), *lines])
    return (f"<b>{escape(title)}</b>" if title else "") + f"<table>{body}</table>"


_ID = re.compile(r'(id="|url\(#|href="#)([A-Za-z]+[0-9a-f]{10})(?=["\)])')


def numbered_ids(svg: str) -> str:
    """A Matplotlib SVG with its ids renumbered in order of appearance, since some derive from memory addresses."""
    numbers: dict[str, int] = {}
    return _ID.sub(lambda id: f"{id[1]}i{numbers.setdefault(id[2], len(numbers))}", svg)
