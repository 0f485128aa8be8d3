"""The split sum of image-based lighting (Karis2013): E = F0 A + B for Schlick's F. `prefilter` computes the maps.

    light reflected ~ (F0 A(mu, roughness) + B(mu, roughness)) * prefiltered radiance (reflected direction, roughness)

A + B is E at F = 1, and B is the albedo at F = (1 - o.m)^5.
"""

from __future__ import annotations

import numpy as np

from ...material import Microsurface
from ...ops import Direction, Scalar, Spectrum, Table, inset, lookup, maximum, sqrt
from ...optics.roughness import widths
from .. import cache
from ..albedo import quadrature

SIZE = 128  # the error of bilinear interpolation is 3e-4 for roughness >= 0.1


@cache.of_members
def schlick_table(ndf: str, masking: str) -> Table:
    """The table of B over (roughness, sqrt(mu)), with nodes at both ends of each axis."""

    def build() -> np.ndarray:
        ends = np.linspace(0.0, 1.0, SIZE)
        return quadrature.moments(ndf, masking, ends**2, ends[:, None] ** 2).schlick[..., None]

    key = ("split-sum", ndf, masking, *cache.origin(ndf, masking), SIZE)
    return Table(f"schlick_{ndf}_{masking}".replace("-", "_"), cache.remember(key, build))


def reflected(surface: Microsurface, f0: Spectrum, E: Scalar, wo: Direction) -> Spectrum:
    """F0 A + B at wo.

    surface  the microsurface
    f0       F0
    E        E(mu) at F = 1, which is A + B
    """
    alpha, _ = widths(surface.alpha)
    row, column = inset(sqrt(sqrt(alpha.x * alpha.y)), SIZE), inset(sqrt(maximum(wo.z, 1e-6)), SIZE)
    (b,) = lookup(schlick_table(surface.ndf, surface.masking), row, column)
    return f0 * maximum(E - b, 0.0) + b
