"""Schlick's approximation."""

from __future__ import annotations

from ...ops import Scalar, Spectrum, function, maximum, sqr
from .base import Fresnel, R, r0_conductor, r0_dielectric


class Schlick(Fresnel):
    """Schlick's approximation (Schlick1994) with R0 from the exact equations at normal incidence."""

    name = "schlick"

    def curve(self, cos_i: Scalar | float, r0: R) -> R:
        """R0 + (1 - R0) (1 - cos)^5."""
        return schlick(cos_i, r0)

    def conductor_average(self, eta: Spectrum, k: Spectrum) -> Spectrum:
        """F_avg, the integral of the curve."""
        return schlick_average(r0_conductor(eta, k))

    def dielectric_average(self, eta: Scalar) -> Scalar:
        """F_avg, the integral of the curve."""
        return schlick_average(r0_dielectric(eta))


@function
def schlick(cos_i: Scalar | float, r0: R) -> R:
    """R0 + (1 - R0) (1 - cos)^5 (Schlick1994; course sheet, eq. 10)."""
    c = maximum(1.0 - cos_i, 0.0)
    c5 = sqr(sqr(c)) * c
    return r0 + (1.0 - r0) * c5


def schlick_average(r0: R) -> R:
    """R0 + (1 - R0) / 21, which is 2 int F mu dmu of Schlick's curve."""
    return r0 + (1.0 - r0) * (1.0 / 21.0)
