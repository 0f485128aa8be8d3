"""Smith's separable masking with the exact Lambda."""

from __future__ import annotations

from ...ops import Direction, Pair, Scalar
from ..ndf import NDF
from .base import Masking


class SmithSeparableExact(Masking):
    """Separable Smith masking, G1(wo) G1(wi), with the exact Lambda."""

    name = "smith-separable-exact"

    def reflected(self, ndf: NDF, wo: Direction, wi: Direction, m: Direction, alpha: Pair) -> Scalar:
        """G1(wo) G1(wi) (Walter2007, eq. 23)."""
        return ndf.G1(wo, alpha) * ndf.G1(wi, alpha)
