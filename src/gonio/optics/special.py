"""Special functions that the optics needs, built from the vocabulary alone."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import ops
from ..ops import exp, function, log, minimum, sqr, sqrt, where

# Giles2010, the single-precision polynomial: coefficients in falling powers.
# fmt: off
_CENTRE = (
    2.81022636e-08, 3.43273939e-07, -3.5233877e-06, -4.39150654e-06, 0.00021858087,
    -0.00125372503, -0.00417768164, 0.246640727, 1.50140941,
)
_TAIL = (
    -0.000200214257, 0.000100950558, 0.00134934322, -0.00367342844, 0.00573950773,
    -0.0076224613, 0.00943887047, 1.00167406, 2.83297682,
)
# fmt: on


@lru_cache
def gauss(count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Nodes and weights of Gauss-Legendre on [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(count)
    return 0.5 * (x + 1.0), 0.5 * w


@function
def erfinv(x: Any) -> Any:
    """Inverse error function on (-1, 1): Giles2010's polynomial, relative error about 4e-7."""
    w = -log((1.0 - x) * (1.0 + x))
    centre = w < 5.0
    t = where(centre, w - 2.5, sqrt(ops.maximum(w, 5.0)) - 3.0)
    # a choice between two plain numbers would have 32 bits in any precision, so the sums are chosen from
    value = where(centre, _CENTRE[0] * t + _CENTRE[1], _TAIL[0] * t + _TAIL[1])
    for a, b in zip(_CENTRE[2:], _TAIL[2:], strict=True):
        value = where(centre, value * t + a, value * t + b)
    return value * x


@function
def power_of_cosine(cos_theta: Any, sin2: Any, p: Any) -> Any:
    """cos(theta)^p, from the squared sine where that is under 0.1: near 1 a cosine is rounded too coarsely for large p.

    log cos^2 = log(1 - sin^2) = 2 atanh(sin^2 / (sin^2 - 2)), whose next term is under 1e-18.
    """
    t = minimum(sin2, 0.1)
    z = t / (t - 2.0)
    z2 = sqr(z)
    tail = 1 / 7 + z2 * (1 / 9 + z2 * (1 / 11 + z2 * (1 / 13)))
    series = 1.0 + z2 * (1 / 3 + z2 * (1 / 5 + z2 * tail))
    return where((sin2 < 0.1) & (cos_theta > 0.0), exp(p * z * series), ops.pow(cos_theta, p))


@function
def log_share(q: Any, p: Any) -> Any:
    """log q of a share, p = 1 - q given beside it: by 2 atanh(p / (p - 2)) for p <= 1/2, where log would cancel.

    The next term of the series is under 4e-10 of its value.
    """
    t = minimum(p, 0.5)
    z = t / (t - 2.0)
    z2 = sqr(z)
    series: Any = 1 / 17
    for odd in range(15, 0, -2):
        series = series * z2 + 1.0 / odd
    return where(p <= 0.5, 2.0 * z * series, log(ops.maximum(q, 1e-30)))


@function
def _stirling(x: Any) -> Any:
    """The series of log Gamma beyond its leading terms; the next term is under 2e-9 at x = 4."""
    r = 1.0 / x
    r2 = sqr(r)
    series = 1 / 12 - r2 * (1 / 360 - r2 * (1 / 1260 - r2 * (1 / 1680 - r2 * (1 / 1188))))
    return r * series


@function
def beta(a: Any, b: Any) -> Any:
    """Euler's beta function B(a, b) for a, b >= 1, without the cancellation of three log-gammas.

    Both arguments are moved up by three with B(a, b) = B(a + 1, b) (a + b) / a, then Stirling's series is taken with
    its leading terms joined into ratios. Relative error under 1e-8 in float64, about 1e-6 in float32. Arguments over
    1e8 count as 1e8: the fourth power of one must stay a float32.
    """
    a, b = minimum(a, 1e8), minimum(b, 1e8)
    ratio: Any = 1.0
    s = a + b
    for j in range(3):
        ratio = ratio * ((s + (2.0 * j)) * (s + (2.0 * j + 1.0))) / ((a + float(j)) * (b + float(j)))
    a3, b3 = a + 3.0, b + 3.0
    s3 = a3 + b3
    share_a, share_b = a3 / s3, b3 / s3
    leading = (a3 - 0.5) * log_share(share_a, share_b) + (b3 - 0.5) * log_share(share_b, share_a)
    leading = leading - 0.5 * log(s3 * (0.5 * ops.inv_pi))
    return ratio * exp(leading + _stirling(a3) + _stirling(b3) - _stirling(s3))
