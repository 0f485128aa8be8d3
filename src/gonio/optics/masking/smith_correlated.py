"""Smith's height-correlated masking."""

from __future__ import annotations

from ...ops import Direction, Pair, Scalar
from ..ndf import NDF
from ..special import beta
from .base import Masking


class SmithCorrelated(Masking):
    """Height-correlated Smith masking (Heitz2014).

    Masking and shadowing depend on the height of the same facet. A high facet is likely to be visible from above, but a
    low facet from below. In transmission, G is therefore Euler's beta function B(1 + Lambda(wo), 1 + Lambda(wi))
    instead of 1 / (1 + Lambda(wo) + Lambda(wi)).
    """

    name = "smith-correlated"

    def reflected(self, ndf: NDF, wo: Direction, wi: Direction, m: Direction, alpha: Pair) -> Scalar:
        """1 / (1 + Lambda(wo) + Lambda(wi)) (Heitz2014, eq. 99)."""
        return 1.0 / (1.0 + ndf.Lambda(wo, alpha) + ndf.Lambda(wi, alpha))

    def transmitted(self, ndf: NDF, wo: Direction, wi: Direction, m: Direction, alpha: Pair) -> Scalar:
        """B(1 + Lambda(wo), 1 + Lambda(wi)) (Heitz2016)."""
        return beta(1.0 + ndf.Lambda(wo, alpha), 1.0 + ndf.Lambda(wi, alpha))
