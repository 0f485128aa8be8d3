"""Fresnel reflectance of unpolarized light, exact and by Schlick.

`eta` is the index on the far side over the index on the side of the incident direction; for conductors eta and k are
those of the metal over the index of the dielectric outside. Cosines, >= 0, are to the facet's normal.
"""

from __future__ import annotations

from typing import Any

from .. import ops
from ..ops import function, safe_sqrt, sqr, sqrt

KINDS = {
    "exact": "the Fresnel equations (Born1999)",
    "schlick": "Schlick's approximation (Schlick1994) with R0 of the exact equations at normal incidence",
    "one": "F = 1: a perfect mirror, for furnaces and tables",
}


@function
def cos_transmitted(cos_i: Any, eta: Any) -> Any:
    """Cosine of the refracted direction by Snell's law; 0 at and beyond the critical angle."""
    return safe_sqrt(1.0 - (1.0 - sqr(cos_i)) / sqr(eta))


@function
def dielectric(cos_i: Any, cos_t: Any, eta: Any) -> Any:
    """Exact reflectance of a dielectric: mean of the s and p polarized ones; 1 where cos_t = 0 (total reflection)."""
    s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t)
    p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t)
    reflectance = 0.5 * (sqr(s) + sqr(p))
    # cos_i = cos_t = 0 is grazing: 0/0 above
    return ops.where(cos_t > 0.0, reflectance, 1.0)


@function
def conductor(cos_i: Any, eta: Any, k: Any) -> Any:
    """Exact reflectance of a conductor with complex index eta + i k (Born1999, ch. 14).

    With sin^2 = s, cos^2 = c:  t = eta^2 - k^2 - s,  a^2 + b^2 = sqrt(t^2 + 4 eta^2 k^2),  a^2 = (a^2 + b^2 + t) / 2,
    R_s = (a^2 + b^2 + c - 2 a cos) / (a^2 + b^2 + c + 2 a cos),
    R_p = R_s (c (a^2 + b^2) + s^2 - 2 a cos s) / (c (a^2 + b^2) + s^2 + 2 a cos s).
    """
    cos2 = sqr(cos_i)
    sin2 = 1.0 - cos2
    t = sqr(eta) - sqr(k) - sin2
    a2_b2 = sqrt(sqr(t) + 4.0 * sqr(eta * k))
    a = safe_sqrt(0.5 * (a2_b2 + t))
    s1 = a2_b2 + cos2
    s2 = 2.0 * cos_i * a
    p1 = cos2 * a2_b2 + sqr(sin2)
    p2 = s2 * sin2
    # one division for both: R_s (1 + R_p / R_s) / 2; 0/0 is index 0 at normal incidence, which reflects all
    below = (s1 + s2) * (p1 + p2)
    return ops.where(below > 0.0, (s1 - s2) * p1 / ops.where(below > 0.0, below, 1.0), 1.0)


@function
def r0_dielectric(eta: Any) -> Any:
    """Reflectance at normal incidence, ((eta - 1) / (eta + 1))^2 (course sheet, eq. 12)."""
    return sqr((eta - 1.0) / (eta + 1.0))


@function
def r0_conductor(eta: Any, k: Any) -> Any:
    """Reflectance at normal incidence, ((eta - 1)^2 + k^2) / ((eta + 1)^2 + k^2) (course sheet, eq. 11)."""
    return (sqr(eta - 1.0) + sqr(k)) / (sqr(eta + 1.0) + sqr(k))


@function
def schlick(cos_i: Any, r0: Any) -> Any:
    """R0 + (1 - R0) (1 - cos)^5 (Schlick1994; course sheet, eq. 10)."""
    c = ops.maximum(1.0 - cos_i, 0.0)
    c5 = sqr(sqr(c)) * c
    return r0 + (1.0 - r0) * c5
