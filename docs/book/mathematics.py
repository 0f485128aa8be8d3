"""Formulas as MathML, which browsers draw by themselves: no script and no font has to come along."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.util import logging

log = logging.getLogger(__name__)
UNKNOWN = re.compile(r">\\[a-zA-Z]+<")  # a command that the converter does not know stays as text


def inline(self: Any, node: Any) -> None:
    """Sphinx's visitor of a formula in a line."""
    self.body.append(mathml(node.astext(), "inline", node))
    raise nodes.SkipNode


def block(self: Any, node: Any) -> None:
    """Sphinx's visitor of a formula in a line of its own."""
    self.body.append(f'<div class="math">{mathml(node.astext(), "block", node)}</div>\n')
    raise nodes.SkipNode


def mathml(latex: str, display: str, node: Any = None) -> str:
    """The formula as a <math> element; a warning, which fails the build, for LaTeX that cannot be converted."""
    try:
        text = str(convert(latex.strip(), display=display))
    except Exception as error:
        log.warning("formula cannot be set: %s: %s", latex, error, location=node)
        return ""
    if unknown := UNKNOWN.search(text):
        log.warning("formula has an unknown command %s: %s", unknown[0][1:-1], latex, location=node)
    return text
