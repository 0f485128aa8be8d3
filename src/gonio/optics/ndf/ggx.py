"""GGX (Trowbridge-Reitz)."""

from __future__ import annotations

from ... import ops
from ...ops import (
    Direction,
    Pair,
    Scalar,
    abs,
    clamp,
    dot,
    function,
    maximum,
    minimum,
    norm,
    normalize,
    safe_sqrt,
    sincos,
    sqr,
    sqrt,
    vec3,
)
from ..frame import sin2
from .base import Stretched, stretch


class GGX(Stretched):
    """GGX (Trowbridge-Reitz).

    D = 1 / (pi alpha_x alpha_y (m_x^2 / alpha_x^2 + m_y^2 / alpha_y^2 + m_z^2)^2) (Heitz2014; isotropic: Walter2007,
    eq. 33). At width 1, the surface is a hemisphere, on which all normals are equally frequent.
    """

    name = "ggx"
    long_tailed = True

    @function
    def density(self, n: Direction) -> Scalar:
        """1 / (pi |n|^4), the density of a hemisphere, computed from all three components, because n_z alone would
        cancel at the peak."""
        return ops.inv_pi / sqr(dot(n, n))

    @function
    def area(self, v: Direction) -> Scalar:
        """(|v.z| + |v|) / 2: half the projected base of a hemisphere plus half a disk (Heitz2014, eq. 72)."""
        return 0.5 * (abs(v.z) + norm(v))

    @function
    def slope(self, u: Scalar) -> Scalar:
        """tan theta with sin^2 theta = u (Walter2007, eq. 35)."""
        return sqrt(u / (1.0 - u))

    @function
    def visible_normal(self, v: Direction, u1: Scalar, u2: Scalar) -> Direction:
        """The half vector of v and a uniformly distributed point on a spherical cap (Dupuy2023)."""
        return self._from_cap(v, v.z, u1, u2)

    def _from_cap(self, v: Direction, depth: Scalar, u1: Scalar, u2: Scalar) -> Direction:
        # the cap reaches down to z = -depth; heights are measured from there, so that nothing cancels at its rim
        height = 1.0 + depth
        lift = (1.0 - u2) * height
        r = safe_sqrt((height - lift) * (1.0 - depth + lift))
        phi = (2.0 * ops.pi) * u1
        s, c = sincos(phi)
        # at a grazing view and the lowest point of the cap, the sum has length 0; any facet with z > 0 is valid
        return vec3(r * c + v.x, r * s + v.y, maximum(lift + (v.z - depth), 1e-12))

    @function
    def sample_bounded(self, v: Direction, u1: Scalar, u2: Scalar, alpha: Pair) -> Direction:
        """A visible normal from the part of the cap whose reflections can lie above the surface (Eto2023)."""
        stretched = normalize(stretch(v, alpha))
        return normalize(stretch(self._from_cap(stretched, self._bound(v, alpha) * stretched.z, u1, u2), alpha))

    @function
    def bounded_per_cosine(self, v: Direction, m: Direction, alpha: Pair) -> Scalar:
        """Density of `sample_bounded` divided by |v.m|: D divided by the area of this part of the cap (Eto2023)."""
        stretched = stretch(v, alpha)
        depth = self._bound(v, alpha) * abs(v.z)
        return self.D(m, alpha) / (0.5 * (depth + norm(stretched)))

    def _bound(self, v: Direction, alpha: Pair) -> Scalar:
        """k, the depth to which the cap extends downward, relative to its full depth (Eto2023)."""
        a2 = sqr(clamp(minimum(alpha.x, alpha.y), 0.0, 1.0))
        reach2 = sqr(1.0 + sqrt(sin2(v)))
        return (1.0 - a2) * reach2 / (reach2 + a2 * sqr(v.z))
