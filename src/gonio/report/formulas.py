"""Formulas in the text of a report, $f = k_d / \\pi$ or $$...$$ for display, typeset by Matplotlib as SVG."""

from __future__ import annotations

import io
from base64 import b64encode
from html import escape
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from ..viewer.figures import load_matplotlib

if TYPE_CHECKING:
    from markdown_it import MarkdownIt

_SIZE = 12.0  # font size in the SVG, in points; the page scales the SVG to the size of its text


def plugin(markdown: MarkdownIt) -> None:
    """Make a Markdown parser recognize formulas."""
    markdown.inline.ruler.before("escape", "formula", _rule)
    markdown.add_render_rule("formula", lambda renderer, tokens, index, options, env: _html(tokens[index], env))


def _rule(state: Any, silent: bool) -> bool:
    """Parse $$...$$, or $...$ without spaces next to the dollar signs, so that prices are not parsed as formulas."""
    text, start = state.src, state.pos
    if text[start] != "$":
        return False
    mark = "$$" if text.startswith("$$", start) else "$"
    end = text.find(mark, start + len(mark))
    content = text[start + len(mark) : end]
    if end < 0 or not content.strip() or (mark == "$" and (content != content.strip() or "\n" in content)):
        return False
    if not silent:
        token = state.push("formula", "math", 0)
        token.content, token.markup = content.strip(), mark
    state.pos = end + len(mark)
    return True


def _html(token: Any, env: dict[str, Any]) -> str:
    formula = " ".join(token.content.split())
    load_matplotlib()
    from matplotlib import mathtext, rc_context
    from matplotlib.font_manager import FontProperties

    stream = io.BytesIO()
    with rc_context({"mathtext.fontset": "stix", "svg.fonttype": "path", "svg.hashsalt": "gonio"}):
        try:
            properties = FontProperties(size=_SIZE)
            _, height, depth, *_ = mathtext.MathTextParser("path").parse(f"${formula}$", 72, properties)
            mathtext.math_to_image(f"${formula}$", stream, prop=properties, dpi=72, format="svg")
        except ValueError as error:
            reason = str(error).strip().splitlines()[-1]
            hint = "Matplotlib's mathtext has no environments such as align: give one formula per line"
            raise InputError(f"the formula '{formula}' cannot be set: {reason}", env["location"], hint) from None
    kind = "display" if token.markup == "$$" else "inline"
    scale = (1.25 if kind == "display" else 1.0) / _SIZE
    style = f"height:{(height + depth) * scale:.3f}em;vertical-align:{-depth * scale:.3f}em"
    data = b64encode(stream.getvalue()).decode()
    return f'<img class="{kind}" style="{style}" alt="{escape(formula)}" src="data:image/svg+xml;base64,{data}">'
