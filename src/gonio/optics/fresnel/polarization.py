"""The effect of a smooth interface on polarization, in real numbers: its Mueller matrix divided by its first entry.

In the frame of the plane of incidence, with Q = s minus p, it is ((1, d, 0, 0), (d, 1, 0, 0), (0, 0, c, -s),
(0, 0, s, c)) with d^2 + c^2 + s^2 = 1. `gonio.optics.fresnel.waves` computes the underlying amplitudes.
"""

from __future__ import annotations

from typing import Generic, NamedTuple, TypeVar

from ...ops import Scalar, Spectrum, abs, fma, function, maximum, safe_sqrt, sqr, sqrt, where, zeros_like

V = TypeVar("V", Scalar, Spectrum)


class Diattenuation(NamedTuple, Generic[V]):
    """The effect of an interface on the two polarizations, s and p.

    d  (R_s - R_p) / (R_s + R_p); for refracted light, with T in place of R
    c  cosine of the phase difference between s and p, times 2 sqrt(R_s R_p) / (R_s + R_p)
    s  sine of this phase difference, times the same factor
    """

    d: V
    c: V
    s: V


@function
def reflected_by_metal(cos_i: Scalar, eta: Spectrum, k: Spectrum) -> Diattenuation[Spectrum]:
    """Reflection at a metal of index n = eta + i k: with w = sqrt(n^2 - sin^2) = a + i b,
    r_p / r_s = -(cos w - sin^2) / (cos w + sin^2)."""
    sin2 = 1.0 - sqr(cos_i)
    t, product = sqr(eta) - sqr(k) - sin2, eta * k  # a^2 - b^2 and a b
    w2 = sqrt(maximum(fma(t, t, 4.0 * sqr(product)), 1e-30))
    larger = sqrt(maximum(0.5 * (w2 + abs(t)), 1e-24))  # the larger of a and b; the smaller would cancel
    other = product / larger
    return _reflected(cos_i, w2, where(t > 0.0, larger, other), where(t > 0.0, other, larger))


@function
def reflected_by_glass(cos_i: Scalar, eta: Scalar) -> Diattenuation[Scalar]:
    """Reflection at an interface with a real index, from either side. Beyond the critical angle, the s and p components
    differ only in phase."""
    t = fma(cos_i, cos_i, (eta - 1.0) * (eta + 1.0))
    return _reflected(cos_i, abs(t), safe_sqrt(t), safe_sqrt(-t))


def _reflected(cos_i: Scalar, w2: V, a: V, b: V) -> Diattenuation[V]:
    """Reflection at a surface with w = a + i b and w2 = |w|^2."""
    sin2 = 1.0 - sqr(cos_i)
    p = maximum(sqr(cos_i) * w2 + sqr(sin2), 1e-30)
    twice = 2.0 * cos_i * sin2
    return Diattenuation(twice * a / p, (sqr(sin2) - sqr(cos_i) * w2) / p, twice * b / p)


@function
def refracted(cos_i: Scalar, cos_t: Scalar, eta: Scalar) -> Diattenuation[Scalar]:
    """Refraction into glass: T_p / T_s = 1 / cos^2(theta_i - theta_t), with no phase difference between s and p."""
    g = cos_i * cos_t + (1.0 - sqr(cos_i)) / eta
    both = 1.0 / (1.0 + sqr(g))
    return Diattenuation((sqr(g) - 1.0) * both, 2.0 * g * both, zeros_like(g))
