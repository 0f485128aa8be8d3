"""Smith's separable masking, as it is customarily computed."""

from __future__ import annotations

from ...ops import Direction, Pair, Scalar
from ..ndf import NDF
from .base import Masking


class SmithSeparable(Masking):
    """Smith G1 G1 (Walter2007); Beckmann by its rational fit.

    The course sheet's and Mitsuba's: G1 is the distribution's customary one, for Beckmann eq. 8 of the sheet.
    """

    name = "smith-separable"

    def reflected(self, ndf: NDF, wo: Direction, wi: Direction, m: Direction, alpha: Pair) -> Scalar:
        """G1(wo) G1(wi) (Walter2007, eq. 23)."""
        return ndf.G1_customary(wo, alpha) * ndf.G1_customary(wi, alpha)
