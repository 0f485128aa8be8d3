"""Schlick's approximation with a second given value near grazing incidence: the F82 model of Adobe Standard
Material."""

from __future__ import annotations

from ...ops import Scalar, Spectrum, function, maximum, minimum, sqr, where, zeros_like
from . import exact
from .base import Fresnel, R, cos_transmitted, r0_conductor, r0_dielectric
from .schlick import schlick

GRAZING = 1.0 / 7.0  # the cosine of about 82 degrees: the maximum of x (1 - x)^6
GREATEST = GRAZING * (1.0 - GRAZING) ** 6


class F82(Fresnel):
    """Schlick's approximation, corrected to match the exact values at 0 and 82 degrees (Kutz2021)."""

    name = "f82"

    def conductor(self, cos_i: Scalar | float, eta: Spectrum, k: Spectrum) -> Spectrum:
        """The curve through the exact reflectances of a metal."""
        return f82(cos_i, r0_conductor(eta, k), exact.conductor(GRAZING, eta, k))

    def dielectric(self, cos_i: Scalar, cos_t: Scalar, eta: Scalar) -> Scalar:
        """The curve through the exact reflectances of a dielectric; from the denser side, at the transmitted angle."""
        mu = where(eta < 1.0, cos_t, cos_i)
        return where(cos_t > 0.0, f82(mu, r0_dielectric(eta), _edge(eta)), 1.0)


def _edge(eta: Scalar) -> Scalar:
    """The exact reflectance of a dielectric at 82 degrees from its less dense side."""
    eta = maximum(eta, 1.0 / eta)
    cos = GRAZING + zeros_like(eta)
    return exact.dielectric(cos, cos_transmitted(cos, eta), eta)


@function
def f82(cos_i: Scalar | float, r0: R, edge: R) -> R:
    """Schlick's curve for r0, minus c x (1 - x)^6 with x = cos_i; c makes the value at x = 1/7 equal to `edge`
    (Kutz2021).

    It is clamped to >= 0, because a dark edge with a dark r0 would make it negative.
    """
    x = minimum(maximum(cos_i, 0.0), 1.0)
    dip = x * sqr(1.0 - x) * sqr(sqr(1.0 - x)) * (1.0 / GREATEST)
    # with the arguments of `maximum` in this order, the gradient at r0 = 0 exists
    return maximum(0.0, schlick(x, r0) - (schlick(GRAZING, r0) - edge) * dip)
