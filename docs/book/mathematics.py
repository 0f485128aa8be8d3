"""Formulas as MathML, which browsers render without additional scripts or fonts."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.util import logging

log = logging.getLogger(__name__)
UNKNOWN = re.compile(r">\\[a-zA-Z]+<")  # the converter leaves unknown commands as text


def inline(self: Any, node: Any) -> None:
    """Sphinx visitor for an inline formula."""
    self.body.append(mathml(node.astext(), "inline", node))
    raise nodes.SkipNode


def block(self: Any, node: Any) -> None:
    """Sphinx visitor for a displayed formula."""
    self.body.append(f'<div class="math">{mathml(node.astext(), "block", node)}</div>\n')
    raise nodes.SkipNode


def mathml(latex: str, display: str, node: Any = None) -> str:
    """The formula as a <math> element; LaTeX that cannot be converted causes a warning, which fails the build."""
    try:
        text = str(convert(latex.strip(), display=display))
    except Exception as error:
        log.warning("formula cannot be typeset: %s: %s", latex, error, location=node)
        return ""
    if unknown := UNKNOWN.search(text):
        log.warning("formula has an unknown command %s: %s", unknown[0][1:-1], latex, location=node)
    return text
