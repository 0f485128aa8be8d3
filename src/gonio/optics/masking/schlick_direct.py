"""Schlick's rational form of Smith's masking, for punctual lights."""

from __future__ import annotations

from ...ops import Scalar, sqr, sqrt
from .schlick_ibl import SchlickIBL


class SchlickDirect(SchlickIBL):
    """Schlick's approximation of Smith's G1 with k = (roughness + 1)^2 / 8 (Karis2013).

    G does not tend to 1 as alpha -> 0. The term is intended for point lights and simple shading, not for compensation.
    """

    name = "schlick-direct"

    def k(self, alpha: Scalar) -> Scalar:
        """(roughness + 1)^2 / 8 with roughness = sqrt(alpha) (Karis2013, analytic lights)."""
        return sqr(sqrt(alpha) + 1.0) * 0.125
