"""Torrance and Sparrow's V-grooves."""

from __future__ import annotations

from ...ops import Direction, Pair, Scalar, abs, dot, function, maximum, minimum, safe_div
from ..ndf import NDF
from .base import Masking


class VGroove(Masking):
    """V-grooves, in which every facet masks the opposite one (Torrance1967).

    G1 = min(1, 2 (n.m) (n.v) / (v.m)) does not depend on the width, because the masking facet has the same slope as the
    visible one.
    """

    name = "v-groove"

    def reflected(self, ndf: NDF, wo: Direction, wi: Direction, m: Direction, alpha: Pair) -> Scalar:
        """min(G1(wo), G1(wi)): both directions are masked by the same groove (Cook1982; Torrance1967)."""
        return v_groove(wo, wi, m)

    def transmitted(self, ndf: NDF, wo: Direction, wi: Direction, m: Direction, alpha: Pair) -> Scalar:
        """max(0, G1(wo) + G1(wi) - 1): the top of a facet is visible from one direction, its bottom from the other
        (Heitz2014b)."""
        a, b = _visible_fraction(wo, m), _visible_fraction(wi, m)
        # subtracted in this order, since the smaller one would lose its digits in a sum with 1
        return maximum(minimum(a, b) - (1.0 - maximum(a, b)), 0.0)


@function
def v_groove(wo: Direction, wi: Direction, m: Direction) -> Scalar:
    """min(1, 2 (n.m) (n.o) / (o.m), 2 (n.m) (n.i) / (i.m)) (Cook1982)."""
    return minimum(_visible_fraction(wo, m), _visible_fraction(wi, m))


@function
def _visible_fraction(v: Direction, m: Direction) -> Scalar:
    """The fraction of a facet with normal m that is visible from v past the opposite side of the groove."""
    return minimum(1.0, safe_div(2.0 * m.z * abs(v.z), abs(dot(v, m))))
