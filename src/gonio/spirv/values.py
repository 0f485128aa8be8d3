"""Values while a module runs: plain numbers if they are constant, else Dr.Jit values or symbols; composites are tuples.

Plain numbers are folded, so that loops with a counter are unrolled and a branch on a constant has no cost. An integer
that is not constant is represented by a float with an integer value.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Final

import numpy as np

from .. import ops
from ..errors import InputError
from ..ops import graph
from ..ops.backend import in_formula

Value = Any  # bool, int, float, a Dr.Jit value, a symbol, or a tuple of values


class Undefined:
    """A scalar without a value. It is propagated by arithmetic and rejected if it determines a branch, an index or a
    result, so that a formula is rejected only if it depends on such a scalar.

    firm  whether it remains undefined where lanes are merged, as for an input without a value. It does not for a local
          variable before its first store: lanes that do not read the variable may have any value.
    """

    __slots__ = ("firm", "hint", "what", "where")

    def __init__(self, what: str, hint: str = "", firm: bool = False, where: str = "") -> None:
        self.what, self.hint, self.firm, self.where = what, hint, firm, where

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Undefined) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def _key(self) -> tuple[str, str, bool, str]:
        return self.what, self.hint, self.firm, self.where

    def at(self, where: str) -> Undefined:
        """The same scalar with the file and line at which it is read, unless it already has them."""
        return self if self.where else Undefined(self.what, self.hint, self.firm, where)

    def error(self) -> InputError:
        """The error that a use of the scalar causes."""
        return InputError(self.what, self.where, self.hint)


class Bits:
    """The bits, as an integer, of a float that is not constant: `number`, or the power of two with a biased exponent.

    part  "magnitude" if the sign bit is known to be 0, "sign" if only the sign of `number` remains
    """

    __slots__ = ("exponent", "number", "part")

    def __init__(self, number: Value, exponent: Value, part: str = "") -> None:
        self.number, self.exponent, self.part = number, exponent, part

    def __parts__(self) -> dict[str, Value]:
        return {"number": self.number, "exponent": self.exponent, "part": self.part}

    def __with_parts__(self, parts: Mapping[str, Value]) -> Bits:
        return Bits(**parts)


UNDEFINED: Final = Undefined("a value that is never computed")


def refuse(what: str, hint: str = "", where: str = "") -> InputError:
    """The error for an unsupported construct, to which the machine adds file and line."""
    return InputError(what, where, hint)


def static(value: Value) -> bool:
    """Whether a scalar is a plain number."""
    return isinstance(value, bool | int | float)


def numeric(value: Value) -> Value:
    """A scalar for arithmetic on floats; constant integers become floats. Raises InputError if it is undefined."""
    if isinstance(value, Undefined):
        raise value.error()
    if isinstance(value, Bits):
        raise refuse("bit operations on varying integers are not supported", "compute with floats")
    if not _computes(value):
        raise refuse(f"a {type(value).__name__.lower()} in place of a number", "compile it again")
    return float(value) if isinstance(value, int) else value


def truth(value: Value) -> Value:
    """A scalar used as a condition. Raises InputError if it is undefined."""
    if isinstance(value, Undefined):
        raise value.error()
    return value


def lost(values: Iterable[Value]) -> Undefined | None:
    """The first undefined scalar; None if all are defined."""
    return next((value for value in values if isinstance(value, Undefined)), None)


def both(a: Value, b: Value) -> Value:
    """a and b."""
    if static(a):
        return b if a else False
    if static(b):
        return a if b else False
    return lost((a, b)) or a & b


def either(a: Value, b: Value) -> Value:
    """a or b."""
    if static(a):
        return True if a else b
    if static(b):
        return True if b else a
    return lost((a, b)) or a | b


def negated(a: Value) -> Value:
    """not a."""
    return not a if static(a) else a if isinstance(a, Undefined) else ~a


def select(mask: Value, a: Value, b: Value) -> Value:
    """`a` where the mask is true, else `b`, for each part of a composite; an undefined part is replaced by the other
    value, unless it is firm."""
    if static(mask):
        return a if mask else b
    if isinstance(a, Undefined) or isinstance(b, Undefined):
        return _merged(a, b)
    if a is b:
        return a
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


def _merged(a: Value, b: Value) -> Value:
    """The merged value of two values, at least one of which is undefined."""
    if not isinstance(a, Undefined):
        a, b = b, a
    if isinstance(b, tuple):
        return tuple(_merged(a, part) for part in b)
    return a if a.firm else b


def where(mask: Value, a: Value, b: Value) -> Value:
    """ops.where on scalars; plain numbers have the precision of the formula."""
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
    """The result of a NumPy function of plain numbers, in double precision; infinities and NaN are as on a GPU."""
    with np.errstate(all="ignore"):
        return float(function(*[np.float64(value) for value in values]))


def wrapped(value: int, signed: bool) -> int:
    """An integer wrapped to 32 bits."""
    value &= 0xFFFFFFFF
    return value - (1 << 32) if signed and value >= 1 << 31 else value
