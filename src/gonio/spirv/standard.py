"""The functions of GLSL.std.450, SPIR-V's standard library, by number.

Powers, roots and inverse functions are composed of functions of `gonio.ops`; outside their domains, they return NaN, as
on a GPU.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from .. import ops
from .arithmetic import (
    add,
    divide,
    dot,
    elementwise,
    floor,
    maximum,
    minimum,
    multiply,
    negate,
    subtract,
    transpose,
    truncated,
)
from .values import Value, folded, numeric, select, static, where

LOG2 = math.log(2.0)


def _function(plain: Callable[..., object], on_values: Callable[..., Value]) -> Callable[..., Value]:
    def function(*values: Value) -> Value:
        floats = [numeric(value) for value in values]
        return folded(plain, *floats) if all(map(static, floats)) else on_values(*floats)

    return function


sqrt = _function(np.sqrt, ops.sqrt)
exp = _function(np.exp, ops.exp)
log = _function(np.log, ops.log)
sin = _function(np.sin, ops.sin)
cos = _function(np.cos, ops.cos)
absolute = _function(np.abs, ops.abs)


def _varying(x: Value, like: Value) -> Value:
    """The value with as many lanes as `like`."""
    return x + 0.0 * like if static(x) else x


def _atan2(y: Value, x: Value) -> Value:
    return ops.atan2(_varying(y, x), _varying(x, y))


atan2 = _function(np.arctan2, _atan2)


def _power(x: Value, y: Value) -> Value:
    """exp(y log x); 0 at x = 0 for y > 0, NaN where x < 0."""
    if static(x):
        if x > 0.0:
            return ops.exp(y * math.log(x))
        return where(y > 0.0, 0.0 if x == 0.0 else math.nan, math.nan)
    positive = x > 0.0
    value = ops.exp(y * ops.log(ops.where(positive, x, 1.0)))
    # 0, or NaN where x < 0, by a root: unlike 0 / 0, it is not simplified in emitted text, and its gradient is finite
    domain = ops.sqrt(ops.where(x < 0.0, x, 0.0))
    if static(y) and y <= 0.0:
        return ops.where(positive, value, 1.0 / domain if y < 0.0 else value)
    return ops.where(positive, value, domain)


power = _function(np.power, _power)


def _asin(x: Value) -> Value:
    return ops.atan2(x, ops.sqrt((1.0 - x) * (1.0 + x)))


def _acos(x: Value) -> Value:
    return ops.atan2(ops.sqrt((1.0 - x) * (1.0 + x)), x)


def _sinh(x: Value) -> Value:
    return 0.5 * (ops.exp(x) - ops.exp(-x))


def _cosh(x: Value) -> Value:
    return 0.5 * (ops.exp(x) + ops.exp(-x))


def _tanh(x: Value) -> Value:
    e = ops.exp(-2.0 * ops.abs(x))
    return ops.copysign((1.0 - e) / (1.0 + e), x)


def sign(x: Value) -> Value:
    """-1, 0 or 1."""
    return _function(np.sign, lambda v: ops.where(v > 0.0, 1.0, ops.where(v < 0.0, -1.0, 0.0 * v)))(x)


def round_even(x: Value) -> Value:
    """The nearest integer; halves are rounded to the even one."""
    if static(x):
        return folded(np.round, numeric(x))
    below = ops.floor(x)
    rest = x - below
    odd = below - 2.0 * ops.floor(0.5 * below)
    return ops.where(rest > 0.5, below + 1.0, ops.where(rest < 0.5, below, below + odd))


def fract(x: Value) -> Value:
    """x - floor(x)."""
    return subtract(x, floor(x))


def clamp(x: Value, low: Value, high: Value) -> Value:
    """x clamped to [low, high]."""
    return minimum(maximum(x, low), high)


def mix(a: Value, b: Value, t: Value) -> Value:
    """a (1 - t) + b t."""
    return add(multiply(a, subtract(1.0, t)), multiply(b, t))


def step(edge: Value, x: Value) -> Value:
    """0 where x < edge, else 1."""
    return select(numeric(x) < numeric(edge), 0.0, 1.0)


def smoothstep(low: Value, high: Value, x: Value) -> Value:
    """3 t^2 - 2 t^3, where t increases from 0 at `low` to 1 at `high`."""
    t = clamp(divide(subtract(x, low), subtract(high, low)), 0.0, 1.0)
    return multiply(multiply(t, t), subtract(3.0, multiply(2.0, t)))


def scaled(x: Value, exponent: Value) -> Value:
    """x 2^exponent."""
    return multiply(x, 2.0 ** int(exponent) if static(exponent) else exp(multiply(exponent, LOG2)))


def parts(x: Value) -> tuple[Value, Value]:
    """The fractional and the integral part of x, both with the sign of x."""
    integral = elementwise(truncated, x)
    return elementwise(subtract, x, integral), integral


def length(v: Value) -> Value:
    """|v|."""
    return sqrt(dot(v, v)) if isinstance(v, tuple) else absolute(v)


def normalize(v: Value) -> Value:
    """v (1 / |v|), as computed by GPUs and by `gonio.ops`."""
    return elementwise(multiply, v, divide(1.0, length(v)))


def cross(a: tuple[Value, ...], b: tuple[Value, ...]) -> Value:
    """Cross product."""
    return tuple(subtract(multiply(a[i], b[j]), multiply(a[j], b[i])) for i, j in ((1, 2), (2, 0), (0, 1)))


def reflect(i: Value, n: Value) -> Value:
    """i - 2 (n.i) n."""
    return elementwise(subtract, i, elementwise(multiply, n, multiply(2.0, dot(n, i))))


def refract(i: Value, n: Value, eta: Value) -> Value:
    """The refracted direction; 0 for total internal reflection."""
    cosine = dot(n, i)
    k = subtract(1.0, multiply(multiply(eta, eta), subtract(1.0, multiply(cosine, cosine))))
    inside = numeric(k) < 0.0
    root = sqrt(select(inside, 0.0, k))
    bent = elementwise(
        subtract, elementwise(multiply, i, eta), elementwise(multiply, n, add(multiply(eta, cosine), root))
    )
    return elementwise(lambda part: select(inside, 0.0, part), bent)


def face_forward(n: Value, i: Value, reference: Value) -> Value:
    """n where reference.i < 0, else -n."""
    toward = numeric(dot(reference, i)) < 0.0
    return elementwise(lambda part: select(toward, part, negate(part)), n)


def determinant(m: tuple[Value, ...]) -> Value:
    """The determinant, by expansion along the first column."""
    if len(m) == 1:
        return m[0][0]
    total: Value = 0.0
    for row, factor in enumerate(m[0]):
        minor = tuple(column[:row] + column[row + 1 :] for column in m[1:])
        term = multiply(factor, determinant(minor))
        total = add(total, term) if row % 2 == 0 else subtract(total, term)
    return total


def inverse(m: tuple[Value, ...]) -> Value:
    """The inverse, by cofactors."""
    volume = determinant(m)

    def cofactor(c: int, r: int) -> Value:
        minor = tuple(column[:r] + column[r + 1 :] for i, column in enumerate(m) if i != c)
        value = determinant(minor)
        return divide(value if (c + r) % 2 == 0 else negate(value), volume)

    places = range(len(m))
    return transpose(tuple(tuple(cofactor(c, r) for r in places) for c in places))


# functions of scalars, which are applied to each component, by number
ELEMENTWISE: dict[int, Callable[..., Value]] = {
    1: round_even, 2: round_even, 3: truncated, 4: absolute, 6: sign, 8: floor, 9: lambda x: negate(floor(negate(x))),
    10: fract, 11: lambda x: multiply(x, math.pi / 180.0), 12: lambda x: multiply(x, 180.0 / math.pi), 13: sin,
    14: cos, 15: lambda x: divide(sin(x), cos(x)), 16: _function(np.arcsin, _asin), 17: _function(np.arccos, _acos),
    18: lambda x: atan2(x, 1.0), 19: _function(np.sinh, _sinh), 20: _function(np.cosh, _cosh),
    21: _function(np.tanh, _tanh),
    22: _function(np.arcsinh, lambda x: ops.copysign(ops.log(ops.abs(x) + ops.sqrt(x * x + 1.0)), x)),
    23: _function(np.arccosh, lambda x: ops.log(x + ops.sqrt(x * x - 1.0))),
    24: _function(np.arctanh, lambda x: 0.5 * ops.log((1.0 + x) / (1.0 - x))), 25: atan2, 26: power, 27: exp, 28: log,
    29: lambda x: exp(multiply(x, LOG2)), 30: lambda x: multiply(log(x), 1.0 / LOG2), 31: sqrt,
    32: lambda x: divide(1.0, sqrt(x)), 37: minimum, 40: maximum, 43: clamp, 46: mix, 48: step, 49: smoothstep,
    50: lambda a, b, c: add(multiply(a, b), c), 53: scaled, 79: minimum,
    80: maximum, 81: clamp,
}  # fmt: skip
# functions of integers
WHOLE_NUMBERS: dict[int, Callable[..., Value]] = {
    5: absolute, 7: sign, 38: minimum, 39: minimum, 41: maximum, 42: maximum, 44: clamp, 45: clamp,
}  # fmt: skip
# functions of vectors and matrices
GEOMETRIC: dict[int, Callable[..., Value]] = {
    33: determinant, 34: inverse, 66: length, 67: lambda a, b: length(elementwise(subtract, a, b)), 68: cross,
    36: parts, 69: normalize, 70: face_forward, 71: reflect, 72: refract,
}  # fmt: skip
MODF = 35  # its second argument is a pointer, to which the machine writes the integral part
REFUSED_FUNCTIONS = {
    **dict.fromkeys((51, 52), "frexp"),
    **dict.fromkeys(range(54, 66), "packing of numbers into bits, or unpacking"),
    **dict.fromkeys(range(73, 76), "a search for the lowest or highest bit (findLSB, findMSB)"),
    **dict.fromkeys(range(76, 79), "interpolation of a fragment's input"),
}
