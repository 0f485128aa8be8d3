"""Widths of the microfacet distribution, and below which width a surface is smooth."""

from __future__ import annotations

from ..ops import Mask, Pair, maximum, vec2

# Below this width a facet's tilt, about alpha, is no more than a thousand roundings of a float32 direction (6e-8), and
# D's peak, 1 / (pi alpha^2), passes 3e7: the lobe can no longer be resolved and is taken as a mirror's.
SMOOTH = 1e-4


def widths(alpha: Pair) -> tuple[Pair, Mask]:
    """(alpha held above `SMOOTH`, whether the surface is smooth)."""
    smooth = (alpha.x < SMOOTH) & (alpha.y < SMOOTH)
    return vec2(maximum(alpha.x, SMOOTH), maximum(alpha.y, SMOOTH)), smooth
