"""Operators, their precedence, and number literals, which all languages share."""

from __future__ import annotations

import numpy as np

# precedence of expressions, lowest first
CHOICE, OR, AND, EQUAL, ORDER, SUM, PRODUCT, SIGN, ATOM = range(9)

OPERATORS = {
    "or": ("||", OR),
    "and": ("&&", AND),
    "eq": ("==", EQUAL),
    "ne": ("!=", EQUAL),
    "lt": ("<", ORDER),
    "le": ("<=", ORDER),
    "gt": (">", ORDER),
    "ge": (">=", ORDER),
    "add": ("+", SUM),
    "sub": ("-", SUM),
    "mul": ("*", PRODUCT),
    "div": ("/", PRODUCT),
}


def literal(number: float) -> str:
    """The shortest decimal that rounds to the same float32."""
    text = repr(number)
    short = np.format_float_positional(np.float32(number), unique=True, trim="0")
    if len(text) > 9 and np.float32(float(text)) == np.float32(number):
        text = short if 1e-4 <= abs(number) < 1e7 else np.format_float_scientific(np.float32(number), trim="0")
    mantissa, e, exponent = text.partition("e")
    if "." not in mantissa:
        mantissa += ".0"
    return mantissa + (f"e{int(exponent)}" if e else "")
