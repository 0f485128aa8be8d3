"""Smith's separable masking in its customary form."""

from __future__ import annotations

from ...ops import Direction, Pair, Scalar
from ..ndf import NDF
from .base import Masking


class SmithSeparable(Masking):
    """Separable Smith masking, G1(wo) G1(wi) (Walter2007), with Walter's rational fit for Beckmann.

    As in the course sheet and in Mitsuba, G1 is the customary form for the distribution; for Beckmann, this is eq. 8 of
    the sheet.
    """

    name = "smith-separable"

    def reflected(self, ndf: NDF, wo: Direction, wi: Direction, m: Direction, alpha: Pair) -> Scalar:
        """G1(wo) G1(wi) (Walter2007, eq. 23)."""
        return ndf.G1_customary(wo, alpha) * ndf.G1_customary(wi, alpha)
