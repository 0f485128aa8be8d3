"""Torrance and Sparrow's V-grooves."""

from __future__ import annotations

from ...ops import Direction, Pair, Scalar, abs, dot, function, maximum, minimum, safe_div
from ..ndf import NDF
from .base import Masking


class VGroove(Masking):
    """V-grooves (Torrance1967): every facet masks the one opposite.

    G1 = min(1, 2 (n.m) (n.v) / (v.m)), which knows no width: the facet that masks has the seen one's slope.
    """

    name = "v-groove"

    def reflected(self, ndf: NDF, wo: Direction, wi: Direction, m: Direction, alpha: Pair) -> Scalar:
        """min(G1(wo), G1(wi)): the two stand on the same groove (Cook1982; Torrance1967)."""
        return v_groove(wo, wi, m)

    def transmitted(self, ndf: NDF, wo: Direction, wi: Direction, m: Direction, alpha: Pair) -> Scalar:
        """max(0, G1(wo) + G1(wi) - 1): what one leaves of the facet, the other masks from below (Heitz2014b)."""
        return maximum(_seen(wo, m) + _seen(wi, m) - 1.0, 0.0)


@function
def v_groove(wo: Direction, wi: Direction, m: Direction) -> Scalar:
    """min(1, 2 (n.m) (n.o) / (o.m), 2 (n.m) (n.i) / (i.m)) (Cook1982)."""
    return minimum(_seen(wo, m), _seen(wi, m))


@function
def _seen(v: Direction, m: Direction) -> Scalar:
    """The share of a facet of normal m that v sees past the other side of its groove."""
    return minimum(1.0, safe_div(2.0 * m.z * abs(v.z), abs(dot(v, m))))
