"""SPIR-V's arithmetic on scalars, vectors and matrices, in terms of `gonio.ops`.

FLOATS, INTEGERS and LOGIC contain functions of scalars, which are applied to each component; WHOLE contains functions
of whole values.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from functools import reduce

import numpy as np

from .. import ops
from .bits import flipped, joined, masked, shifted_left, shifted_right
from .values import Bits, Undefined, Value, both, either, folded, lost, negated, numeric, refuse, select, static


def elementwise(function: Callable[..., Value], *values: Value) -> Value:
    """Apply a function of scalars to each component; scalars are broadcast."""
    sizes = {len(value) for value in values if isinstance(value, tuple)}
    if not sizes:
        return function(*values)
    if len(sizes) > 1:
        raise ValueError(f"vectors of {sorted(sizes)} components")
    rows = [value if isinstance(value, tuple) else (value,) * min(sizes) for value in values]
    return tuple(elementwise(function, *row) for row in zip(*rows, strict=True))


def passing(function: Callable[..., Value]) -> Callable[..., Value]:
    """The function of scalars, extended to return the first undefined argument, if there is one."""

    def passed(*scalars: Value) -> Value:
        undefined = lost(scalars)
        return function(*scalars) if undefined is None else undefined

    return passed


def _float(plain: Callable[..., object], on_values: Callable[..., Value]) -> Callable[..., Value]:
    """A function of floats, folded by NumPy if all arguments are constant."""

    def function(*values: Value) -> Value:
        if (undefined := lost(values)) is not None:
            return undefined
        floats = [numeric(value) for value in values]
        if all(map(static, floats)):
            return folded(plain, *floats)
        return on_values(*floats)

    return function


def _compare(on_values: Callable[[Value, Value], Value]) -> Callable[..., Value]:
    return lambda a, b: on_values(numeric(a), numeric(b))


add = _float(np.add, operator.add)
subtract = _float(np.subtract, operator.sub)
multiply = _float(np.multiply, operator.mul)
divide = _float(np.divide, operator.truediv)
negate = _float(np.negative, operator.neg)
floor = _float(np.floor, ops.floor)
minimum = _float(np.minimum, ops.minimum)
maximum = _float(np.maximum, ops.maximum)


def truncated(x: Value) -> Value:
    """x rounded toward 0."""
    if static(x):
        return folded(np.trunc, numeric(x))
    return ops.where(x < 0.0, -ops.floor(-x), ops.floor(x))


def floor_modulo(x: Value, y: Value) -> Value:
    """x - y floor(x / y): GLSL's mod."""
    return subtract(x, multiply(y, floor(divide(x, y))))


def remainder(x: Value, y: Value) -> Value:
    """x - y trunc(x / y): HLSL's fmod."""
    return subtract(x, multiply(y, truncated(divide(x, y))))


def _differ(a: Value, b: Value) -> Value:
    """a != b, which is true for NaN, although it is false in Dr.Jit's LLVM backend."""
    return negated(a == b)


FLOATS: dict[str, Callable[..., Value]] = {
    "FNegate": negate, "FAdd": add, "FSub": subtract, "FMul": multiply, "FDiv": divide, "FMod": floor_modulo,
    "FRem": remainder,
    "VectorTimesScalar": multiply, "MatrixTimesScalar": multiply,
    "FOrdEqual": _compare(operator.eq), "FUnordEqual": _compare(operator.eq),
    "FOrdNotEqual": _compare(_differ), "FUnordNotEqual": _compare(_differ),
    "FOrdLess": _compare(operator.lt), "FUnordLess": _compare(operator.lt),
    "FOrdGreater": _compare(operator.gt), "FUnordGreater": _compare(operator.gt),
    "FOrdLessEqual": _compare(operator.le), "FUnordLessEqual": _compare(operator.le),
    "FOrdGreaterEqual": _compare(operator.ge), "FUnordGreaterEqual": _compare(operator.ge),
    "IsNan": lambda x: is_nan(numeric(x)), "IsInf": lambda x: is_infinite(numeric(x)),
    "ConvertIToF": numeric,
}  # fmt: skip


def is_infinite(x: Value) -> Value:
    """Whether a float is infinite; False for NaN."""
    if static(x):
        return bool(np.isinf(x))
    return both(negated(ops.isfinite(x)), negated(is_nan(x)))


def is_nan(x: Value) -> Value:
    """Whether a float is NaN, determined by comparisons, which are false for NaN."""
    if static(x):
        return bool(np.isnan(x))
    return negated(either(x <= 0.0, x > 0.0))


# --------------------------------------------------------------------------- integers


def _as_integer(x: Value) -> Value:
    """An integer: a plain integer, or a float with an integer value."""
    return int(x) if static(x) else x


def _integer(plain: Callable[..., int], on_values: Callable[..., Value] | None) -> Callable[..., Value]:
    def function(*values: Value) -> Value:
        integers = [_as_integer(value) for value in values]
        if all(map(static, integers)):
            return plain(*integers)
        if on_values is None:
            raise refuse("bit operations on varying integers are not supported", "compute with floats")
        return on_values(*map(numeric, integers))

    return function


def _quotient(a: int, b: int) -> int:
    return 0 if b == 0 else int(abs(a) // abs(b)) * (1 if (a < 0) == (b < 0) else -1)


def to_integer(x: Value) -> Value:
    """A float rounded toward 0, as an integer; clamped to the range of integers."""
    if static(x):
        x = numeric(x)
        return int(min(max(x, -(2.0**31)), 2.0**32 - 1.0)) if x == x else 0
    return truncated(numeric(x))


def _shift(a: int, b: int, left: bool) -> int:
    return (a << (b & 31)) if left else (a >> (b & 31))


def _bitwise(plain: Callable[..., int], on_bits: Callable[..., Value]) -> Callable[..., Value]:
    """An operation on constant integers, or on the bits of floats."""
    integers = _integer(plain, None)
    return lambda a, b: on_bits(a, b) if isinstance(a, Bits) or isinstance(b, Bits) else integers(a, b)


def _reversed(a: int) -> int:
    return int(f"{a & 0xFFFFFFFF:032b}"[::-1], 2)


def _field(base: int, offset: int, count: int, signed: bool) -> int:
    """`count` bits of an integer, starting at bit `offset`."""
    bits = (base >> offset) & ((1 << count) - 1)
    return bits - (1 << count) if signed and count and bits >> (count - 1) else bits


def _with_field(base: int, insert: int, offset: int, count: int) -> int:
    """An integer in which `count` bits, starting at bit `offset`, are replaced by the low bits of `insert`."""
    mask = ((1 << count) - 1) << offset
    return (base & ~mask) | ((insert << offset) & mask)


_shift_left = _integer(lambda a, b: _shift(a, b, True), None)
_shift_right = _integer(lambda a, b: _shift(a, b, False), None)
INTEGERS: dict[str, Callable[..., Value]] = {
    "SNegate": _integer(operator.neg, operator.neg),
    "IAdd": _integer(operator.add, operator.add),
    "ISub": _integer(operator.sub, operator.sub),
    "IMul": _integer(operator.mul, operator.mul),
    "SDiv": _integer(_quotient, lambda a, b: truncated(divide(a, b))),
    "UDiv": _integer(_quotient, lambda a, b: truncated(divide(a, b))),
    "UMod": _integer(lambda a, b: a % b if b else 0, floor_modulo),
    "SMod": _integer(lambda a, b: a % b if b else 0, floor_modulo),
    "SRem": _integer(lambda a, b: a - b * _quotient(a, b), remainder),
    "ShiftLeft": lambda a, b: shifted_left(a, b) if not static(a) and static(b) else _shift_left(a, b),
    "ShiftRightArithmetic": lambda a, b: shifted_right(a, b) if isinstance(a, Bits) else _shift_right(a, b),
    "ShiftRightLogical": lambda a, b: (
        shifted_right(a, b) if isinstance(a, Bits) else _shift_right(a & 0xFFFFFFFF if static(a) else a, b)
    ),
    "BitwiseOr": _bitwise(operator.or_, joined),
    "BitwiseXor": _bitwise(operator.xor, flipped),
    "BitwiseAnd": _bitwise(operator.and_, masked),
    "Not": _integer(operator.invert, None),
    "BitReverse": _integer(_reversed, None),
    "BitCount": _integer(lambda a: (a & 0xFFFFFFFF).bit_count(), None),
    "BitFieldInsert": _integer(_with_field, None),
    "BitFieldSExtract": _integer(lambda a, offset, count: _field(a, offset, count, True), None),
    "BitFieldUExtract": _integer(lambda a, offset, count: _field(a & 0xFFFFFFFF, offset, count, False), None),
    "ConvertFToI": to_integer,
}
COMPARED: dict[str, Callable[..., Value]] = {
    "IEqual": _compare(operator.eq),
    "INotEqual": _compare(operator.ne),
    "IGreater": _compare(operator.gt),
    "IGreaterEqual": _compare(operator.ge),
    "ILess": _compare(operator.lt),
    "ILessEqual": _compare(operator.le),
}
LOGIC: dict[str, Callable[..., Value]] = {
    "LogicalOr": either,
    "LogicalAnd": both,
    "LogicalNot": negated,
    "LogicalEqual": lambda a, b: _same(a, b),
    "LogicalNotEqual": lambda a, b: negated(_same(a, b)),
}


def _same(a: Value, b: Value) -> Value:
    return either(both(a, b), both(negated(a), negated(b)))


# --------------------------------------------------------------------------- vectors and matrices


def dot(a: tuple[Value, ...], b: tuple[Value, ...]) -> Value:
    """Dot product; terms with a constant factor 0, such as a component of an axis of the frame, are omitted."""
    terms = [
        y if _is(x, 1.0) else x if _is(y, 1.0) else multiply(x, y)
        for x, y in zip(a, b, strict=True)
        if not _is(x, 0.0) and not _is(y, 0.0)
    ]
    return reduce(add, terms) if terms else 0.0


def _is(x: Value, number: float) -> bool:
    return static(x) and x == number


def transpose(matrix: tuple[Value, ...]) -> Value:
    """The transpose of a matrix."""
    return tuple(zip(*matrix, strict=True))


def matrix_vector(matrix: tuple[Value, ...], vector: tuple[Value, ...]) -> Value:
    """M v, for a matrix given by its columns."""
    return tuple(dot(row, vector) for row in transpose(matrix))


def choose(mask: Value, a: Value, b: Value) -> Value:
    """OpSelect with one mask, or with one mask per component."""
    if isinstance(mask, tuple):
        return tuple(choose(m, x, y) for m, x, y in zip(mask, a, b, strict=True))
    if isinstance(mask, Undefined):
        return elementwise(lambda x, y: mask, a, b)
    return select(mask, a, b)


WHOLE: dict[str, Callable[..., Value]] = {
    "Dot": dot,
    "Any": lambda v: reduce(either, v),
    "All": lambda v: reduce(both, v),
    "Transpose": transpose,
    "MatrixTimesVector": matrix_vector,
    "VectorTimesMatrix": lambda v, m: tuple(dot(v, column) for column in m),
    "MatrixTimesMatrix": lambda a, b: tuple(matrix_vector(a, column) for column in b),
    "OuterProduct": lambda a, b: tuple(tuple(multiply(x, y) for x in a) for y in b),
    "Select": choose,
    "CopyObject": lambda value: value,
}
