"""The Sphinx extension that builds the book: generated pages, formulas as MathML, and links to files outside docs/."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from . import generate, links, listings, mathematics

DOCS = Path(__file__).parents[1]


def setup(app: Any) -> dict[str, Any]:
    """Register the handlers of the extension; called by Sphinx."""
    app.connect("config-inited", lambda app, config: generate.write_all(DOCS))
    app.connect("source-read", links.rewrite)
    app.connect("doctree-read", listings.color)
    app.add_html_math_renderer("mathml", (mathematics.inline, None), (mathematics.block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
