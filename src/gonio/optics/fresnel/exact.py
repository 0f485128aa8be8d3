"""The Fresnel equations."""

from __future__ import annotations

from ... import ops
from ...ops import Scalar, Spectrum, fma, function, rsqrt, sqr, sqrt
from .base import Fresnel, r0_conductor, r0_dielectric


class Exact(Fresnel):
    """The Fresnel equations (Born1999)."""

    name = "exact"

    def conductor(self, cos_i: Scalar | float, eta: Spectrum, k: Spectrum) -> Spectrum:
        """Mean of R_s and R_p at a complex index."""
        return conductor(cos_i, eta, k)

    def dielectric(self, cos_i: Scalar, cos_t: Scalar, eta: Scalar) -> Scalar:
        """Mean of R_s and R_p at a real index."""
        return dielectric(cos_i, cos_t, eta)

    def conductor_normal(self, eta: Spectrum, k: Spectrum) -> Spectrum:
        """|n - 1|^2 / |n + 1|^2."""
        return r0_conductor(eta, k)

    def dielectric_normal(self, eta: Scalar) -> Scalar:
        """((eta - 1) / (eta + 1))^2."""
        return r0_dielectric(eta)


@function
def dielectric(cos_i: Scalar, cos_t: Scalar, eta: Scalar) -> Scalar:
    """Exact reflectance of a dielectric: mean of the s and p polarized ones; 1 where cos_t = 0 (total reflection).

    With q = eta cos_t:  r_s = (cos_i - q) / (cos_i + q),  r_p = (eta^2 cos_i - q) / (eta^2 cos_i + q), both multiplied
    above and below by the denominator: by Snell's law (cos_i - q)(cos_i + q) = 1 - eta^2, which keeps its digits where
    eta is near 1, and likewise (eta^2 cos_i - q)(eta^2 cos_i + q) = (eta^2 - 1)((eta^2 + 1) cos_i^2 - 1).
    """
    q, eta2 = eta * cos_t, sqr(eta)
    under_s, under_p = cos_i + q, fma(eta2, cos_i, q)
    # one division for both; with cos_t over 1e-15 the product stays far above float32's smallest number
    over = 1.0 / (under_s * under_p)
    contrast = (eta - 1.0) * (eta + 1.0)
    r_s = contrast * sqr(under_p * over)
    r_p = contrast * fma(eta2 + 1.0, sqr(cos_i), -1.0) * sqr(under_s * over)
    return ops.where(cos_t > 1e-15, 0.5 * fma(r_s, r_s, sqr(r_p)), 1.0)


@function
def conductor(cos_i: Scalar | float, eta: Spectrum, k: Spectrum) -> Spectrum:
    """Exact reflectance of a conductor with complex index eta + i k (Born1999, ch. 14).

    With n = eta + i k, sin^2 = s, cos^2 = c and w = a + i b = sqrt(n^2 - s):  t = eta^2 - k^2 - s,
    a^2 + b^2 = sqrt(t^2 + 4 eta^2 k^2),  a b = eta k,  max(a^2, b^2) = (a^2 + b^2 + |t|) / 2: the other would cancel,
    R_s = |cos - w|^2 / |cos + w|^2 = |n^2 - 1|^2 / |cos + w|^4, as cos^2 - w^2 = 1 - n^2: nothing cancels,
    R_p / R_s = (c (a^2 + b^2) + s^2 - 2 a cos s) / (c (a^2 + b^2) + s^2 + 2 a cos s).
    """
    cos2 = cos_i * cos_i
    sin2 = 1.0 - cos2
    t = sqr(eta) - sqr(k) - sin2
    eta_k = eta * k
    a2_b2 = sqrt(ops.maximum(fma(t, t, 4.0 * sqr(eta_k)), 1e-30))
    larger = ops.maximum(0.5 * (a2_b2 + ops.abs(t)), 1e-24)  # the gradient of rsqrt, its cube, must stay in float32
    a = rsqrt(larger) * ops.where(t > 0.0, larger, eta_k)
    sum2 = fma(2.0 * cos_i, a, a2_b2 + cos2)
    contrast = fma(eta - 1.0, eta - 1.0, sqr(k)) * fma(eta + 1.0, eta + 1.0, sqr(k))
    p1 = fma(cos2, a2_b2, sin2 * sin2)
    p2 = 2.0 * cos_i * sin2 * a
    # one division for both: R_s (1 + R_p / R_s) / 2; 0/0 is index 0 at normal incidence, which reflects all
    return fma(contrast, p1, VANISHING) / fma(sqr(sum2), p1 + p2, VANISHING)


# Makes 0/0 a 1. Index 1e-4 has 1e-8 below, so it is lost beside any other value; its inverse squared, in the gradient,
# stays in float32 times the peak of D.
VANISHING = 1e-15
