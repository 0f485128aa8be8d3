"""Values while a module runs: plain numbers where they are known, else Dr.Jit values or symbols; composites are tuples.

A plain number is folded, so that loops over a counter unroll and a branch on a constant costs nothing. An integer that
varies is held as a float with a whole value.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from .. import ops
from ..errors import InputError
from ..ops import graph
from ..ops.backend import in_formula

Value = Any  # bool, int, float, a Dr.Jit value, a symbol, or a tuple of values


class Undefined:
    """The value of a variable before its first store: any value serves."""

    def __repr__(self) -> str:
        return "undefined"


class Bits:
    """The bits of a float that varies as an integer: of `number`, or of the power of two with a biased exponent.

    part  "magnitude" if the sign is known to be 0, "sign" if only the sign of `number` is left
    """

    __slots__ = ("exponent", "number", "part")

    def __init__(self, number: Value, exponent: Value, part: str = "") -> None:
        self.number, self.exponent, self.part = number, exponent, part


UNDEFINED: Final = Undefined()


def refuse(what: str, hint: str = "", where: str = "") -> InputError:
    """The error for a construct that is not read; the machine adds file and line."""
    return InputError(what, where, hint)


def static(value: Value) -> bool:
    """Whether a scalar is a plain number."""
    return isinstance(value, bool | int | float)


def numeric(value: Value) -> Value:
    """A scalar for arithmetic on floats: whole numbers that are known become floats, undefined ones 0."""
    if value is UNDEFINED:
        return 0.0
    if isinstance(value, Bits):
        raise refuse("a bit operation on an integer that varies", "compute with floats")
    if not _computes(value):
        raise refuse(f"a {type(value).__name__.lower()} in place of a number", "compile it again")
    return float(value) if isinstance(value, int) else value


def truth(value: Value) -> Value:
    """A scalar for logic: undefined ones are false."""
    return False if value is UNDEFINED else value


def both(a: Value, b: Value) -> Value:
    """a and b."""
    if static(a):
        return b if a else False
    if static(b):
        return a if b else False
    return a & b


def either(a: Value, b: Value) -> Value:
    """a or b."""
    if static(a):
        return True if a else b
    if static(b):
        return True if b else a
    return a | b


def negated(a: Value) -> Value:
    """not a."""
    return not a if static(a) else ~a


def select(mask: Value, a: Value, b: Value) -> Value:
    """`a` where the mask holds, else `b`, part by part of composites; undefined parts take the other value."""
    if static(mask):
        return a if mask else b
    if a is b or b is UNDEFINED:
        return a
    if a is UNDEFINED:
        return b
    if isinstance(a, tuple) or isinstance(b, tuple):
        if not isinstance(a, tuple) or not isinstance(b, tuple) or len(a) != len(b):
            raise refuse("a selection between values of two types")
        return tuple(select(mask, x, y) for x, y in zip(a, b, strict=True))
    if static(a) and static(b) and type(a) is type(b) and (a == b or (a != a and b != b)):
        return a
    if isinstance(a, bool) or isinstance(b, bool):
        return either(both(mask, a), both(negated(mask), b))
    if not _computes(a) or not _computes(b):
        raise refuse("a selection between two textures or pointers", "sample both, and select between the colors")
    return where(mask, numeric(a), numeric(b))


def where(mask: Value, a: Value, b: Value) -> Value:
    """ops.where on scalars, with a plain number in the precision of the formula."""
    if static(a) and static(b) and not isinstance(mask, graph.Node):
        a = in_formula(a)
    return ops.where(mask, a, b)


def _computes(value: Value) -> bool:
    return static(value) or isinstance(value, graph.Node) or ops.backend.is_drjit(value)


def leaves(value: Value) -> list[Value]:
    """The scalars of a value, in order."""
    if isinstance(value, tuple):
        return [leaf for part in value for leaf in leaves(part)]
    return [value]


def folded(function: Any, *values: float) -> float:
    """A NumPy function of plain numbers, in 64 bits; infinities and NaN as a GPU returns them."""
    with np.errstate(all="ignore"):
        return float(function(*[np.float64(value) for value in values]))


def wrapped(value: int, signed: bool) -> int:
    """A whole number in 32 bits."""
    value &= 0xFFFFFFFF
    return value - (1 << 32) if signed and value >= 1 << 31 else value
