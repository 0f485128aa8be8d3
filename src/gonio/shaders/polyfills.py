"""Functions of `gonio.ops` that shader languages lack or compute too inaccurately, written with other functions of
`gonio.ops`.

They are recorded like a model's functions, so one source suffices for all languages. The accuracy that the languages
guarantee is low: GLSL ES 3.00 and WGSL allow an absolute error of 2^-11, or several units in the last place, for sin,
cos, exp, log and atan. Later operations cannot correct such errors.
"""

from __future__ import annotations

from collections.abc import Callable

from .. import ops
from ..ops import Mask, Scalar, Spectrum, abs, floor, graph, maximum, sqr, where
from ..ops.types import Value

# pi / 2 as the sum of a float32 and a remainder, so that whole quarter turns can be subtracted without rounding error
QUARTER_TURN = 1.5707964
QUARTER_REST = -4.371139e-8


def _channels(c: Spectrum) -> Value:
    r, g, b = (graph.emit("component", "float", c, static=i) for i in range(3))
    return r, g, b


def mean(c: Spectrum) -> Scalar:
    """Mean over the channels."""
    r, g, b = _channels(c)
    return (r + g + b) * (1.0 / 3.0)


def max_component(c: Spectrum) -> Scalar:
    """Largest channel."""
    r, g, b = _channels(c)
    return maximum(maximum(r, g), b)


def copysign(size: Scalar, other: Scalar) -> Scalar:
    """|size| with the sign of `other`."""
    return where(other < 0.0, -abs(size), abs(size))


def isfinite(x: Scalar) -> Mask:
    """Whether x is neither infinite nor NaN."""
    return abs(x) <= 3.4028234e38


# Least-squares fits, reweighted toward the largest error: of erf(x) / x in x^2 for |x| < 1 (error 1e-9), and of
# -log(1 - erf(x)) in x for 0.9 <= x <= 4 (error of erf 2e-9); beyond 4 erf is 1 in float32.
_ERF_CENTER = (1.1283791, -0.37612626, 0.11283585, -0.026853811, 0.0051883273, -0.00080101914, 7.8538527e-05)
_ERF_TAIL = (0.00017747548, 1.1277497, 0.63705957, 0.104037508, -0.022277163, 0.0030556284, -0.00019718401)


def erf(x: Scalar) -> Scalar:
    """Error function: a polynomial near 0, 1 - exp of a polynomial elsewhere; error below 1e-7."""
    size = ops.minimum(abs(x), 4.0)
    center = size < 1.0
    value = where(center, x * _horner(sqr(x), _ERF_CENTER), 1.0 - ops.exp(-_horner(size, _ERF_TAIL)))
    return where(center | (x > 0.0), value, -value)


def _horner(x: Scalar, coefficients: tuple[float, ...]) -> Scalar:
    total: Value = coefficients[-1]
    for c in reversed(coefficients[:-1]):
        total = total * x + c
    return total


def sine_quarters(x: Scalar, quarters: float) -> Scalar:
    """sin(x + quarters pi / 2) by Taylor series within an eighth of a turn; error 1e-7 (up to 5e-4 for a GPU's sin)."""
    count = floor(x * (2.0 / ops.pi) + 0.5)  # whole quarter turns
    r = (x - count * QUARTER_TURN) - count * QUARTER_REST
    r2 = sqr(r)
    odd_series = r + r * r2 * (-1 / 6 + r2 * (1 / 120 + r2 * (-1 / 5040 + r2 * (1 / 362880))))
    even_series = 1.0 + r2 * (-1 / 2 + r2 * (1 / 24 + r2 * (-1 / 720 + r2 * (1 / 40320))))
    turns = count + quarters
    quadrant = turns - 4.0 * floor(0.25 * turns)
    odd = (quadrant == 1.0) | (quadrant == 3.0)
    value = where(odd, even_series, odd_series)
    return where(quadrant >= 2.0, -value, value)


def exponent(x: Scalar) -> Value:
    """e of x = m 2^e, 1 <= m < 2, for x > 0, from the bits of x."""
    return graph.emit("exponent", "float", x)


def scaled(x: Scalar, e: Scalar) -> Value:
    """x 2^e for a whole e in [-126, 127]."""
    return graph.emit("scaled", "float", x, e)


def log(x: Scalar) -> Scalar:
    """Natural logarithm of a normal float32 > 0; relative error 1e-7, even near 1, where that of a GPU is at best 5e-7.

    For x = m 2^e with m in [1/sqrt(2), sqrt(2)): e log 2 + 2 atanh((m - 1) / (m + 1)). Colors are computed per channel.
    """
    if isinstance(x, graph.Node) and x.type != "float":
        value: Value = graph.emit("vector", x.type, *(ops.log(channel) for channel in _channels(x)))
        return value
    e = exponent(x)
    m = scaled(x, -e)
    high = m > SQRT_2
    m, e = where(high, 0.5 * m, m), where(high, e + 1.0, e)
    z = (m - 1.0) / (m + 1.0)
    z2 = sqr(z)
    series = 1.0 + z2 * (1 / 3 + z2 * (1 / 5 + z2 * (1 / 7 + z2 * (1 / 9))))
    return e * LOG_2 + (e * LOG_2_REST + 2.0 * z * series)


SQRT_2 = 1.4142135
LOG_2 = 0.693359375  # log 2 rounded to few bits, so that e LOG_2 is exact
LOG_2_REST = -0.00021219444

_SINE_QUARTERS = ops.function(sine_quarters)


def sin(x: Scalar) -> Scalar:
    """Sine of an angle in radians."""
    return _SINE_QUARTERS(x, 0.0)


def cos(x: Scalar) -> Scalar:
    """Cosine of an angle in radians."""
    return _SINE_QUARTERS(x, 1.0)


POLYFILLS: dict[str, Callable] = {
    "mean": mean,
    "max_component": max_component,
    "copysign": copysign,
    "isfinite": isfinite,
    "sin": sin,
    "cos": cos,
    "erf": erf,
    "log": log,
}
