"""The Beckmann distribution, whose slopes are Gaussian."""

from __future__ import annotations

from ... import ops
from ...ops import (
    Direction,
    Pair,
    Scalar,
    abs,
    atan2,
    clamp,
    erf,
    exp,
    function,
    log,
    maximum,
    minimum,
    pow,
    safe_sqrt,
    sqr,
    sqrt,
    vec3,
    where,
)
from ..frame import sin2
from ..special import SQRT_PI, erfinv, gaussian_ramp
from .base import Stretched, stretch

B_LIMIT = 0.99999988  # the second-largest float32 below 1


class Beckmann(Stretched):
    """Beckmann, with Gaussian slopes.

    D = exp(-(m_x^2 / alpha_x^2 + m_y^2 / alpha_y^2) / m_z^2) / (pi alpha_x alpha_y m_z^4) (Heitz2014; isotropic:
    Walter2007, eq. 25).
    """

    name = "beckmann"

    @function
    def density(self, n: Direction) -> Scalar:
        """exp(-tan^2) / (pi n_z^4)."""
        # beyond tan^2 = 1000, exp is 0 even in float64, and n_z^4 underflows in float32
        over = 1.0 / maximum(sqr(n.z), 1e-3 * sin2(n))
        return exp(-sin2(n) * over) * sqr(over) * ops.inv_pi

    @function
    def area(self, v: Direction) -> Scalar:
        """|v.z| (1 + erf a) / 2 + sin exp(-a^2) / (2 sqrt(pi)), a = cot, as sin times `gaussian_ramp` (Heitz2014)."""
        sin, a = _sine_and_cotangent(v)
        return sin * gaussian_ramp(a)

    @function
    def G1_customary(self, v: Direction, alpha: Pair) -> Scalar:
        """Rational fit of G1 for a = 1 / (alpha tan) < 1.6, else 1 (Walter2007, eq. 27; course sheet, eq. 8)."""
        _, a = _sine_and_cotangent(stretch(v, alpha))
        fit = a * (3.535 + 2.181 * a) / (1.0 + a * (2.276 + 2.577 * a))
        return where(a < 1.6, fit, 1.0)

    @function
    def slope(self, u: Scalar) -> Scalar:
        """sqrt(-log(1 - u)), by Box and Muller's method (Walter2007, eq. 28)."""
        return safe_sqrt(-log(1.0 - u))

    @function
    def visible_normal(self, v: Direction, u1: Scalar, u2: Scalar) -> Direction:
        """Sample the visible slopes of a Gaussian of unit width (Heitz2014b, secs. 3 and 5).

        Along v, the slope x <= cot theta has the cumulative distribution, up to a factor,
        c(x) = (1 + erf x) / 2 + tan theta exp(-x^2) / (2 sqrt(pi)). It is inverted from an initial guess by a
        Halley step in b = erf x and a Newton step in x, with an error of 5e-8 (Jakob2014). Perpendicular to v, the
        slope is Gaussian.
        """
        sin_v, cos_v = sqrt(sin2(v)), maximum(v.z, 1e-6)
        tan_v = sin_v / cos_v
        at_normal = sin_v < 1e-6
        cos_phi = where(at_normal, 1.0, v.x / where(at_normal, 1.0, sin_v))
        sin_phi = where(at_normal, 0.0, v.y / where(at_normal, 1.0, sin_v))

        # the slope is below cot; erf(4) is 1 in float32
        cot = minimum(1.0 / maximum(tan_v, 1e-6), 4.0)
        b_high, b_low = erf(cot), -B_LIMIT
        target = u1 * (0.5 * (1.0 + b_high) + tan_v * exp(-sqr(cot)) * (0.5 / SQRT_PI))
        # approximate root, to a few percent: Jakob2014's fit in the angle of incidence
        theta = atan2(sin_v, cos_v)
        exponent = 1.0 + theta * (-0.876 + theta * (0.4265 - 0.0594 * theta))
        b = clamp(b_high - (1.0 + b_high) * pow(1.0 - u1, exponent), b_low, b_high)

        # Halley's step in b, where c has the derivatives (1 - x tan) / 2 and -tan sqrt(pi) exp(x^2) / 4
        x = erfinv(b)
        gauss, facing = exp(-sqr(x)), 1.0 - x * tan_v
        move = (0.5 * (1.0 + b) + tan_v * gauss * (0.5 / SQRT_PI) - target) / maximum(0.5 * facing, 1e-4)
        curvature = -0.25 * SQRT_PI * tan_v / maximum(gauss, 1e-12)
        b = clamp(b - move / clamp(1.0 - move * curvature / maximum(facing, 2e-4), 0.5, 2.0), b_low, b_high)

        # Newton's step in x with erf x = b; far in the tail and at the cotangent, where c is flat, it is rounding error
        x = erfinv(b)
        gauss = exp(-sqr(x)) * (1.0 / SQRT_PI)
        facing = 1.0 - x * tan_v
        rise = gauss * facing
        x = where(rise > 1e-3, x - (0.5 * (1.0 + b) + 0.5 * tan_v * gauss - target) / maximum(rise, 1e-3), x)
        y = erfinv(clamp(2.0 * u2 - 1.0, -B_LIMIT, B_LIMIT))
        return vec3(sin_phi * y - cos_phi * x, -sin_phi * x - cos_phi * y, ops.ones_like(x))


def _sine_and_cotangent(v: Direction) -> tuple[Scalar, Scalar]:
    """sin times |v|, and |cot|, of a vector of any length; the cotangent is limited to 1e9 at the normal."""
    sin = sqrt(maximum(sin2(v), 1e-18))
    return sin, abs(v.z) / sin
