"""The display of materials in notebooks: an HTML table of their parameters."""

from __future__ import annotations

import html
from collections.abc import Iterable

import numpy as np

from .tree import Leaf, M


def table(title: str, leaves: Iterable[Leaf[M]]) -> str:
    """The HTML of a table with the value and documentation of every parameter.

    title   heading of the table
    leaves  the parameters
    """
    rows = "".join(
        f"<tr><td><code>{html.escape(leaf.path)}</code></td><td>{html.escape(_short(leaf.value))}</td>"
        f"<td style='text-align:left'>{html.escape(leaf.parameter.doc)}</td></tr>"
        for leaf in leaves
    )
    return f"<b>{html.escape(title)}</b><table>{rows}</table>"


def _short(value: object) -> str:
    if isinstance(value, tuple | list | np.ndarray):
        values = [_short(v) for v in list(value)[:6]]
        return ", ".join(values) + (", ..." if len(value) > 6 else "")
    return f"{value:.6g}" if isinstance(value, float | np.floating) else str(value)
