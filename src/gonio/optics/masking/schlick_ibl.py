"""Schlick's rational form of Smith's masking, for image-based lighting."""

from __future__ import annotations

from ...ops import Direction, Pair, Scalar, abs, function, sqrt
from ..ndf import NDF
from .base import Masking


@function
def schlick_g1(v: Direction, k: Scalar) -> Scalar:
    """n.v / (n.v (1 - k) + k), Schlick's rational form of Smith's G1 (Schlick1994)."""
    c = abs(v.z)
    return c / (c * (1.0 - k) + k)


class SchlickIBL(Masking):
    """Schlick's approximation of Smith's G1 with k = alpha / 2 (Karis2013)."""

    name = "schlick-ibl"
    smith = False

    def reflected(self, ndf: NDF, wo: Direction, wi: Direction, m: Direction, alpha: Pair) -> Scalar:
        """G1(wo) G1(wi); the width of an anisotropic surface is sqrt(alpha_x alpha_y)."""
        k = self.k(sqrt(alpha.x * alpha.y))
        return schlick_g1(wo, k) * schlick_g1(wi, k)

    def onset(self, alpha: Scalar) -> Scalar:
        """2 k, the cosine at which G1 is 2/3 for small k."""
        return 2.0 * self.k(alpha)

    def k(self, alpha: Scalar) -> Scalar:
        """alpha / 2 (Karis2013, image-based lighting)."""
        return 0.5 * alpha
