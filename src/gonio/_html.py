"""Tables for notebooks."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape


def table(rows: Iterable[Iterable[object]], headings: Iterable[str] = (), title: str = "") -> str:
    """An HTML table of texts; their special characters are escaped."""
    head = "".join(f"<th>{escape(text)}</th>" for text in headings)
    lines = ["".join(f"<td>{escape(str(cell))}</td>" for cell in row) for row in rows]
    body = "".join(f"<tr>{line}</tr>" for line in [*([head] if head else []), *lines])
    return (f"<b>{escape(title)}</b>" if title else "") + f"<table>{body}</table>"
