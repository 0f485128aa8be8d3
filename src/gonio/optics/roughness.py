"""Widths of the microfacet distribution, and the width below which a surface is smooth."""

from __future__ import annotations

from ..ops import Mask, Pair, maximum, vec2

# Below this width, the tilt of facets, about alpha, is less than 2000 times the rounding error of a float32 direction
# (6e-8), and the peak of D, 1 / (pi alpha^2), exceeds 3e7: the lobe cannot be resolved and is replaced by a mirror.
SMOOTH = 1e-4


def widths(alpha: Pair) -> tuple[Pair, Mask]:
    """alpha clamped to at least `SMOOTH`, and whether the surface is smooth."""
    smooth = (alpha.x < SMOOTH) & (alpha.y < SMOOTH)
    return vec2(maximum(alpha.x, SMOOTH), maximum(alpha.y, SMOOTH)), smooth
