"""Beckmann: Gaussian slopes."""

from __future__ import annotations

from typing import Any

from ... import ops
from ...ops import (
    abs,
    atan2,
    clamp,
    dot,
    erf,
    exp,
    fma,
    function,
    is_short,
    log,
    maximum,
    minimum,
    normalize,
    pow,
    rsqrt,
    safe_div,
    safe_sqrt,
    sincos,
    sqr,
    sqrt,
    vec2,
    vec3,
    where,
)
from ..special import erfinv
from .base import NDF
from .ggx import slant2

_INV_SQRT_PI = ops.pi**-0.5
STEPS = 2  # of Newton's method: the cumulated density is then met to 3e-8

# G1 = a N(a) / M(a) for a = 1 / (alpha tan) < 4 (1 - G1 is 2e-10 there), rising powers: our own fit of the exact G1, by
# least squares of the relative error, reweighted toward the largest at 4000 Chebyshev points.
_G1_OVER = (3.54490742, -0.11616595, 1.10290261, 0.09772537, 0.10158618, 0.03505152)
_G1_UNDER = (1.0, 1.73967429, 1.25322189, 0.54497537, 0.22630499, 0.08571726, 0.03586975)


def _horner(x: Any, coefficients: tuple[float, ...]) -> Any:
    """The polynomial with these coefficients, in rising powers."""
    value: Any = coefficients[-1]
    for c in reversed(coefficients[:-1]):
        value = fma(value, x, c)
    return value


class Beckmann(NDF):
    """Beckmann: Gaussian slopes.

    D = exp(-(m_x^2 / alpha_x^2 + m_y^2 / alpha_y^2) / m_z^2) / (pi alpha_x alpha_y m_z^4).

    Heitz2014; isotropic: Walter2007, eq. 25.
    """

    name = "beckmann"

    @function
    def D(self, m: Any, alpha: Any) -> Any:
        """Beckmann density of normals, 1/sr."""
        area = alpha.x * alpha.y
        z2 = sqr(m.z)
        across = vec2(m.x * alpha.y, m.y * alpha.x)
        across2 = dot(across, across)
        # tan^2 / alpha^2 over 700 leaves exp under 1e-304; there z^4 may vanish in float32, and its gradient sooner
        lit = (m.z > 0.0) & (across2 < 700.0 * sqr(area) * z2)
        # one division, 1 / (area z^2), serves the exponent and the factor before it
        q = where(lit, 1.0 / where(lit, area * z2, 1.0), 0.0)
        return exp(-across2 * z2 * sqr(q)) * sqr(q) * (area * ops.inv_pi)

    def _cotangent(self, v: Any, alpha: Any) -> Any:
        """|v.z| / slant = 1 / (alpha tan), held below 1e9."""
        return abs(v.z) / maximum(sqrt(slant2(v, alpha)), 1e-9)

    @function
    def Lambda(self, v: Any, alpha: Any) -> Any:
        """(erf(a) - 1) / 2 + exp(-a^2) / (2 a sqrt(pi)), a = 1 / (alpha tan) (Heitz2014)."""
        a = maximum(self._cotangent(v, alpha), 1e-15)
        return maximum(0.5 * (erf(a) - 1.0) + exp(-sqr(a)) * (0.5 * _INV_SQRT_PI) / a, 0.0)

    @function
    def G1(self, v: Any, alpha: Any) -> Any:
        """1 / (1 + Lambda); in float32 by a rational function, within 8e-8 of it, at half the cost of erf and exp."""
        if not is_short(v.z):
            return 1.0 / (1.0 + self.Lambda(v, alpha))
        a = self._cotangent(v, alpha)
        return where(a < 4.0, a * _horner(a, _G1_OVER) / _horner(a, _G1_UNDER), 1.0)

    @function
    def G1_customary(self, v: Any, alpha: Any) -> Any:
        """Rational fit of G1 for a = 1 / (alpha tan) < 1.6, else 1 (Walter2007, eq. 27; course sheet, eq. 8)."""
        a = self._cotangent(v, alpha)
        fit = a * (3.535 + 2.181 * a) / (1.0 + a * (2.276 + 2.577 * a))
        return where(a < 1.6, fit, 1.0)

    @function
    def sample(self, u1: Any, u2: Any, alpha: Any) -> Any:
        """A normal with density D(m) m.z: Gaussian slopes by Box-Muller (Walter2007, eq. 28)."""
        r = safe_sqrt(-log(1.0 - u1))
        phi = (2.0 * ops.pi) * u2
        s, c = sincos(phi)
        return normalize(vec3(r * c * alpha.x, r * s * alpha.y, 1.0 + 0.0 * r))

    @function
    def sample_visible(self, v: Any, u1: Any, u2: Any, alpha: Any) -> Any:
        """A visible normal: slopes of the unit Gaussian as seen from the stretched v (Heitz2014b, sec. 3 and 5).

        Along v the slope x has the cumulated density c(x) ~ (1 + erf x) / 2 + tan exp(-x^2) / (2 sqrt(pi)) up to
        x = cot; Newton's method in b = erf x, where its derivative is (1 - x tan) / 2, held by a bracket (Jakob2014).
        Across v the slope is Gaussian.
        """
        stretched = normalize(vec3(alpha.x * v.x, alpha.y * v.y, v.z))
        sin_v = sqrt(sqr(stretched.x) + sqr(stretched.y))
        cos_v = maximum(stretched.z, 1e-6)
        tan_v = sin_v / cos_v
        upright = sin_v < 1e-6
        cos_phi = where(upright, 1.0, stretched.x / where(upright, 1.0, sin_v))
        sin_phi = where(upright, 0.0, stretched.y / where(upright, 1.0, sin_v))

        # the slope is below cot; erf(4) is 1 within float32
        cot = minimum(1.0 / maximum(tan_v, 1e-6), 4.0)
        high = erf(cot)
        low = -0.99999988 + 0.0 * high
        total = 0.5 * (1.0 + high) + tan_v * exp(-sqr(cot)) * (0.5 * _INV_SQRT_PI)
        target = u1 * total
        # where the root lies, to a few percent: Jakob2014's fit in the angle of incidence
        theta = atan2(sin_v, cos_v)
        exponent = 1.0 + theta * (-0.876 + theta * (0.4265 - 0.0594 * theta))
        b = high - (1.0 + high) * pow(1.0 - u1, exponent)
        for _ in range(STEPS):
            b = clamp(b, low, high)
            x = erfinv(b)
            excess = 0.5 * (1.0 + b) + tan_v * exp(-sqr(x)) * (0.5 * _INV_SQRT_PI) - target
            b = b - excess / maximum(0.5 * (1.0 - x * tan_v), 1e-4)
        b = clamp(b, low, high)
        slope_x, slope_y = erfinv(b), erfinv(clamp(2.0 * u2 - 1.0, -0.99999988, 0.99999988))
        if not is_short(u1):
            slope_x, slope_y = self._polish(slope_x, tan_v, target), self._polish(slope_y, 0.0 * u2, u2)
        x = (cos_phi * slope_x - sin_phi * slope_y) * alpha.x
        y = (sin_phi * slope_x + cos_phi * slope_y) * alpha.y
        return normalize(vec3(-x, -y, 1.0 + 0.0 * x))

    @function
    def _polish(self, x: Any, tan_v: Any, target: Any) -> Any:
        """One step of Newton's method in x on c(x) = target: takes the 3e-7 of `erfinv` out of the float64 twin.

        In float32 `erfinv` is exact to the last digits, and the step would be rounding.
        """
        gauss = exp(-sqr(x)) * _INV_SQRT_PI
        excess = 0.5 * (1.0 + erf(x)) + 0.5 * tan_v * gauss - target
        slope = gauss * (1.0 - x * tan_v)
        # far in the tail and at the cot, where c is flat, the step is all rounding
        return where(slope > 1e-3, x - excess / maximum(slope, 1e-3), x)

    @function
    def visible_per_cosine(self, v: Any, m: Any, alpha: Any) -> Any:
        """Density of visible normals over |v.m|, G1 D / |v.z| (Heitz2014b); in float32 G1 / |v.z| as one quotient."""
        if not is_short(v.z):
            return safe_div(self.G1(v, alpha) * self.D(m, alpha), abs(v.z))
        z = abs(v.z)
        over = rsqrt(maximum(slant2(v, alpha), 1e-18))
        a = z * over
        near = a < 4.0
        return self.D(m, alpha) * where(near, over * _horner(a, _G1_OVER), 1.0) / where(near, _horner(a, _G1_UNDER), z)
