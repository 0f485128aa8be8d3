"""Special functions for optics, written in the vocabulary of `gonio.ops`."""

from __future__ import annotations

from functools import lru_cache
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from .. import ops
from ..ops import Scalar, Spectrum, abs, clamp, erf, exp, fma, function, is_short, log, minimum, sqr, sqrt, where

V = TypeVar("V", Scalar, Spectrum)

# Giles2010, the single-precision polynomial: coefficients in descending powers.
# fmt: off
_CENTER = (
    2.81022636e-08, 3.43273939e-07, -3.5233877e-06, -4.39150654e-06, 0.00021858087,
    -0.00125372503, -0.00417768164, 0.246640727, 1.50140941,
)
_TAIL = (
    -0.000200214257, 0.000100950558, 0.00134934322, -0.00367342844, 0.00573950773,
    -0.0076224613, 0.00943887047, 1.00167406, 2.83297682,
)
# fmt: on
SQRT_PI = ops.pi**0.5
_RAMP_OVER = (1.0, 1.73967429, 1.25322189, 0.54497537, 0.22630499, 0.08571726, 0.03586975)
_RAMP_UNDER = (3.54490742, -0.11616595, 1.10290261, 0.09772537, 0.10158618, 0.03505152)


@lru_cache
def gauss(count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Nodes and weights of the Gauss-Legendre rule on [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(count)
    return 0.5 * (x + 1.0), 0.5 * w


@function
def erfinv(x: Scalar) -> Scalar:
    """Inverse error function on (-1, 1) by the polynomial of Giles2010, with a relative error of about 4e-7.

    This is the precision of float32; in float64, a Newton step reduces the error to 1e-12 up to |x| = 1 - 1e-7.
    """
    w = -log((1.0 - x) * (1.0 + x))
    center = w < 5.0
    t = where(center, w - 2.5, sqrt(ops.maximum(w, 5.0)) - 3.0)
    # outside a formula, `where` between two plain numbers returns float32, so it selects between sums
    value = where(center, _CENTER[0] * t + _CENTER[1], _TAIL[0] * t + _TAIL[1])
    for a, b in zip(_CENTER[2:], _TAIL[2:], strict=True):
        value = where(center, value * t + a, value * t + b)
    y = value * x
    if is_short(x):
        return y
    # exp(y^2) magnifies the rounding error of erf; for a larger |y|, the polynomial is more accurate
    return where(abs(y) < 4.5, y - (erf(y) - x) * exp(sqr(y)) * (0.5 * SQRT_PI), y)


@function
def gaussian_ramp(a: Scalar) -> Scalar:
    """int_-inf^a (a - x) exp(-x^2) dx / sqrt(pi) = a (1 + erf a) / 2 + exp(-a^2) / (2 sqrt(pi)), for a >= 0.

    This is an integral over Gaussian slopes below a. In float32, it is computed by a rational function with an error of
    8e-8; with erf and exp, Beckmann's pdf would take 1.8 times as long. The coefficients were fitted for Gonio by least
    squares of the relative error at 4000 Chebyshev points, reweighted toward the largest error; for a >= 4, the value
    is a to within 2e-10.
    """
    if not is_short(a):
        return 0.5 * a * (1.0 + erf(a)) + (0.5 / SQRT_PI) * exp(-sqr(a))
    return where(a < 4.0, _horner(a, _RAMP_OVER) / _horner(a, _RAMP_UNDER), a)


def _horner(x: Scalar, coefficients: tuple[float, ...]) -> Scalar:
    """The polynomial with these coefficients, in ascending powers, at x."""
    value = fma(x, coefficients[-1], coefficients[-2])
    for c in reversed(coefficients[:-2]):
        value = fma(value, x, c)
    return value


@function
def power_of_cosine(cos_theta: Scalar, sin2: Scalar, p: Scalar) -> Scalar:
    """cos(theta)^p. Where the squared sine is below 0.1, the power is computed from it, because a cosine near 1 is
    rounded too coarsely for a large p.

    log cos^2 = log(1 - sin^2) = 2 atanh(sin^2 / (sin^2 - 2)); the first omitted term is below 1e-18.
    """
    t = minimum(sin2, 0.1)
    z = t / (t - 2.0)
    z2 = sqr(z)
    tail = 1 / 7 + z2 * (1 / 9 + z2 * (1 / 11 + z2 * (1 / 13)))
    series = 1.0 + z2 * (1 / 3 + z2 * (1 / 5 + z2 * tail))
    return where((sin2 < 0.1) & (cos_theta > 0.0), exp(p * z * series), ops.pow(cos_theta, p))


@function
def exprel(x: V) -> V:
    """(e^x - 1) / x, and 1 at x = 0. Up to |x| = 1/2, it is computed from its series, whose first omitted term is less
    than 2e-17 of the sum."""
    t = clamp(x, -0.5, 0.5)
    series = 1.0 + t * (1.0 / 13.0)
    for n in range(12, 1, -1):
        series = 1.0 + t * (1.0 / n) * series
    small = abs(x) < 0.5
    return where(small, series, (exp(x) - 1.0) / where(small, 1.0, x))


@function
def logrel(x: Scalar) -> Scalar:
    """log(1 + x) / x for x > -1, and 1 at x = 0. Up to |x| = 1/4, it is computed by 2 atanh(x / (2 + x)), with a
    relative error below 1e-17."""
    t = clamp(x, -0.25, 0.25)
    z2 = sqr(t / (2.0 + t))
    series = 1 / 17 + z2 * (1 / 19)
    for odd in range(15, 0, -2):
        series = series * z2 + 1.0 / odd
    small = abs(x) < 0.25
    return where(small, 2.0 * series / (2.0 + t), log(where(small, 1.0, 1.0 + x)) / where(small, 1.0, x))


@function
def power_integral(log_t: Scalar, q: Scalar) -> Scalar:
    """int_1^t s^(q - 1) ds = (t^q - 1) / q, given log t; at q = 0, it is log t."""
    return log_t * exprel(q * log_t)


@function
def power_quantile(area: Scalar, q: Scalar) -> Scalar:
    """log t at which `power_integral` equals `area`: the inverse distribution function of a power law."""
    return area * logrel(q * area)


@function
def log_share(q: Scalar, p: Scalar) -> Scalar:
    """log q of a fraction q, where p = 1 - q is given as well. For p <= 1/2, it is computed from p by the series of
    2 atanh(p / (p - 2)), because the logarithm of a rounded q near 1 is inaccurate.

    The first omitted term of the series is less than 4e-10 of the sum.
    """
    t = minimum(p, 0.5)
    z = t / (t - 2.0)
    z2 = sqr(z)
    series = 1 / 15 + z2 * (1 / 17)
    for odd in range(13, 0, -2):
        series = series * z2 + 1.0 / odd
    return where(p <= 0.5, 2.0 * z * series, log(ops.maximum(q, 1e-30)))


@function
def _stirling(x: Scalar) -> Scalar:
    """Stirling's series of log Gamma without its leading terms; the first omitted term is less than 2e-9 at x = 4."""
    r = 1.0 / x
    r2 = sqr(r)
    series = 1 / 12 - r2 * (1 / 360 - r2 * (1 / 1260 - r2 * (1 / 1680 - r2 * (1 / 1188))))
    return r * series


@function
def beta(a: Scalar, b: Scalar) -> Scalar:
    """Euler's beta function B(a, b) for a, b >= 1, without the cancellation of three log-gammas.

    Both arguments are increased by three with B(a, b) = B(a + 1, b) (a + b) / a; Stirling's series is then used, with
    its leading terms combined into ratios. The relative error is below 1e-8 in float64 and about 1e-6 in float32.
    Arguments above 1e8 are treated as 1e8, because their fourth power must not overflow float32.
    """
    a, b = minimum(a, 1e8), minimum(b, 1e8)
    ratio: Scalar | float = 1.0
    s = a + b
    for j in range(3):
        ratio = ratio * ((s + (2.0 * j)) * (s + (2.0 * j + 1.0))) / ((a + float(j)) * (b + float(j)))
    a3, b3 = a + 3.0, b + 3.0
    s3 = a3 + b3
    share_a, share_b = a3 / s3, b3 / s3
    leading = (a3 - 0.5) * log_share(share_a, share_b) + (b3 - 0.5) * log_share(share_b, share_a)
    leading = leading - 0.5 * log(s3 * (0.5 * ops.inv_pi))
    return ratio * exp(leading + _stirling(a3) + _stirling(b3) - _stirling(s3))
