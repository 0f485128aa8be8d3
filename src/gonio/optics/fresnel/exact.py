"""The Fresnel equations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...ops import Scalar, Spectrum, abs, fma, function, maximum, rsqrt, sqr, sqrt, where
from .base import Fresnel, average


class Exact(Fresnel):
    """The Fresnel equations (Born1999)."""

    name = "exact"

    def conductor(self, cos_i: Scalar | float, eta: Spectrum, k: Spectrum) -> Spectrum:
        """Mean of R_s and R_p at a complex index."""
        return conductor(cos_i, eta, k)

    def dielectric(self, cos_i: Scalar, cos_t: Scalar, eta: Scalar) -> Scalar:
        """Mean of R_s and R_p at a real index."""
        return dielectric(cos_i, cos_t, eta)

    def conductor_average(self, eta: Spectrum, k: Spectrum) -> Spectrum:
        """F_avg by the default quadrature, which is a separate function in shaders."""
        return conductor_average(eta, k)


@function
def dielectric(cos_i: Scalar, cos_t: Scalar, eta: Scalar) -> Scalar:
    """Exact reflectance of a dielectric, the mean of R_s and R_p; 1 for cos_t = 0 (total reflection).

    r_s = (cos_i - eta cos_t) / (cos_i + eta cos_t),  r_p = (eta cos_i - cos_t) / (eta cos_i + cos_t). The differences
    would cancel near eta = 1, so numerator and denominator are multiplied by the denominator; by Snell's law,
    cos_i^2 - eta^2 cos_t^2 = 1 - eta^2,  eta^2 cos_i^2 - cos_t^2 = (eta^2 - 1) ((eta^2 + 1) cos_i^2 - 1) / eta^2.
    """
    minus_r_s, r_p = amplitudes(cos_i, cos_t, eta)
    return where(cos_t > 1e-15, 0.5 * (sqr(minus_r_s) + sqr(r_p)), 1.0)


def amplitudes(cos_i: Scalar, cos_t: Scalar, eta: Scalar) -> tuple[Scalar, Scalar]:
    """(-r_s, r_p) of a dielectric, without total reflection; see `dielectric`."""
    contrast = (eta - 1.0) * (eta + 1.0)
    minus_r_s = contrast / sqr(cos_i + eta * cos_t)
    r_p = contrast * ((sqr(eta) + 1.0) * sqr(cos_i) - 1.0) / sqr(eta * (eta * cos_i + cos_t))
    return minus_r_s, r_p


def transmittance(cos_i: Scalar, cos_t: Scalar, eta: Scalar) -> Scalar:
    """1 - R of a dielectric, computed as the mean of T_s and T_p, because the difference would lose all digits at
    grazing angles."""
    across, along = cos_i + eta * cos_t, eta * cos_i + cos_t
    return 2.0 * eta * cos_i * cos_t * (1.0 / sqr(across) + 1.0 / sqr(along))


def dielectric_array(cos_i: NDArray[np.floating], eta: float) -> NDArray[np.floating]:
    """`dielectric` for NumPy arrays, from the less dense side, in the textbook form, the mean of r_s^2 and r_p^2."""
    cos_t = np.sqrt(1.0 - (1.0 - cos_i**2) / eta**2)
    r_s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t)
    r_p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t)
    reflectance: NDArray[np.floating] = 0.5 * (r_s**2 + r_p**2)
    return reflectance


@function
def conductor(cos_i: Scalar | float, eta: Spectrum, k: Spectrum) -> Spectrum:
    """Exact reflectance of a conductor with complex index n = eta + i k, the mean of R_s and R_p (Born1999, ch. 14).

    This is the mean of the textbook form in `polarized`, as one quotient. With w = sqrt(n^2 - sin^2) = a + i b:
    R_s = |cos - w|^2 / |cos + w|^2 = |n^2 - 1|^2 / |cos + w|^4, because cos^2 - w^2 = 1 - n^2, so nothing cancels;
    R_p = R_s (p - q) / (p + q),  p = cos^2 |w|^2 + sin^4,  q = 2 a cos sin^2.  Their mean is R_s p / (p + q).
    """
    # computing R_s, R_p and their mean, as in `polarized`, slows a conductor's eval by 17 % and its sample by 5 %
    cos2, sin2 = cos_i * cos_i, 1.0 - cos_i * cos_i
    w2, a = _refracted(sin2, eta, k)
    contrast = fma(eta - 1.0, eta - 1.0, sqr(k)) * fma(eta + 1.0, eta + 1.0, sqr(k))
    sum2 = fma(2.0 * cos_i, a, w2 + cos2)
    p, q = fma(cos2, w2, sin2 * sin2), 2.0 * cos_i * sin2 * a
    return fma(contrast, p, VANISHING) / fma(sqr(sum2), p + q, VANISHING)


# Makes 0/0 equal 1 for index 0 at normal incidence, where all light is reflected. At index 1e-4, it is negligible
# compared with the other terms, 1e-8; its inverse square, which occurs in the gradient, times the peak of D does not
# overflow float32.
VANISHING = 1e-15


def polarized(cos_i: Scalar | float, eta: Spectrum, k: Spectrum) -> tuple[Spectrum, Spectrum]:
    """(R_s, R_p) of a conductor with complex index n = eta + i k, in the textbook form (Born1999, ch. 14).

    With w = sqrt(n^2 - sin^2):  R_s = |cos - w|^2 / |cos + w|^2,  R_p = R_s |cos w - sin^2|^2 / |cos w + sin^2|^2.
    """
    cos2, sin2 = cos_i * cos_i, 1.0 - cos_i * cos_i
    w2, a = _refracted(sin2, eta, k)
    R_s = (cos2 + w2 - 2.0 * a * cos_i) / (cos2 + w2 + 2.0 * a * cos_i)
    p, q = cos2 * w2 + sin2 * sin2, 2.0 * a * cos_i * sin2
    return R_s, R_s * (p - q) / (p + q)


def _refracted(sin2: Scalar | float, eta: Spectrum, k: Spectrum) -> tuple[Spectrum, Spectrum]:
    """(|w|^2, Re w) of w = a + i b = sqrt(n^2 - sin^2), which is n times the complex cosine of the refracted wave."""
    t, eta_k = sqr(eta) - sqr(k) - sin2, eta * k  # a^2 - b^2 and a b
    w2 = sqrt(maximum(fma(t, t, 4.0 * sqr(eta_k)), 1e-30))
    # the larger of a^2 and b^2; the smaller would cancel. The gradient of rsqrt, its cube, must not overflow float32
    larger = maximum(0.5 * (w2 + abs(t)), 1e-24)
    return w2, rsqrt(larger) * where(t > 0.0, larger, eta_k)


@function
def conductor_average(eta: Spectrum, k: Spectrum) -> Spectrum:
    """F_avg = 2 int F mu dmu of a conductor, by Gauss-Legendre quadrature in sqrt(mu) with an error of 2e-7."""
    return average(lambda mu: conductor(mu, eta, k))
