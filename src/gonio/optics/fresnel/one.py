"""Total reflection at every angle."""

from __future__ import annotations

from ...ops import Scalar, Spectrum, ones_like
from .base import Fresnel


class One(Fresnel):
    """F = 1, a perfect mirror, for furnace tests and tables."""

    name = "one"
    white = True

    def conductor(self, cos_i: Scalar | float, eta: Spectrum, k: Spectrum) -> Spectrum:
        """1 at every angle: all light is reflected."""
        return ones_like(eta)

    def dielectric(self, cos_i: Scalar, cos_t: Scalar, eta: Scalar) -> Scalar:
        """1 at every angle: nothing is transmitted."""
        return ones_like(eta)

    def conductor_average(self, eta: Spectrum, k: Spectrum) -> Spectrum:
        """1, the mean of F = 1."""
        return ones_like(eta)

    def dielectric_average(self, eta: Scalar) -> Scalar:
        """1, the mean of F = 1."""
        return ones_like(eta)
