"""GGX (Trowbridge-Reitz)."""

from __future__ import annotations

from typing import Any

from ... import ops
from ...ops import (
    abs,
    clamp,
    dot,
    fma,
    function,
    maximum,
    minimum,
    normalize,
    safe_div,
    safe_sqrt,
    sincos,
    sqr,
    sqrt,
    vec2,
    vec3,
    where,
)
from ..frame import sin2
from .base import NDF


@function
def slant2(v: Any, alpha: Any) -> Any:
    """(alpha_x v_x)^2 + (alpha_y v_y)^2: squared sine, stretched by the widths."""
    slant = vec2(alpha.x * v.x, alpha.y * v.y)
    return dot(slant, slant)


class GGX(NDF):
    """GGX (Trowbridge-Reitz).

    D = 1 / (pi alpha_x alpha_y (m_x^2 / alpha_x^2 + m_y^2 / alpha_y^2 + m_z^2)^2).

    Heitz2014; isotropic: Walter2007, eq. 33.
    """

    name = "ggx"
    long_tailed = True

    @function
    def D(self, m: Any, alpha: Any) -> Any:
        """GGX density of normals, 1/sr. Written in m_x, m_y: the form in m_z alone cancels at the peak.

        Multiplied through by (alpha_x alpha_y)^2, so that one division is left; squared after it, or the gradient's
        powers of a narrow alpha leave float32.
        """
        area = alpha.x * alpha.y
        stretched = vec3(m.x * alpha.y, m.y * alpha.x, m.z * area)
        return where(m.z > 0.0, sqr(area / dot(stretched, stretched)) * area * ops.inv_pi, 0.0)

    @function
    def Lambda(self, v: Any, alpha: Any) -> Any:
        """(-1 + sqrt(1 + alpha^2 tan^2)) / 2 (Heitz2014, eq. 72), as t / (2 (1 + sqrt(1 + t))): no cancellation."""
        t = slant2(v, alpha) / maximum(sqr(v.z), 1e-30)
        return 0.5 * t / (1.0 + sqrt(1.0 + t))

    @function
    def G1(self, v: Any, alpha: Any) -> Any:
        """2 |v.z| / (|v.z| + sqrt(v.z^2 + slant^2)) (Walter2007, eq. 34), without a tangent."""
        z = abs(v.z)
        return safe_div(2.0 * z, z + sqrt(fma(z, z, slant2(v, alpha))))

    @function
    def sample(self, u1: Any, u2: Any, alpha: Any) -> Any:
        """A normal with density D(m) m.z: a disk's slopes, stretched (Walter2007, eq. 35)."""
        r = sqrt(u1 / (1.0 - u1))
        phi = (2.0 * ops.pi) * u2
        s, c = sincos(phi)
        return normalize(vec3(r * c * alpha.x, r * s * alpha.y, 1.0 + 0.0 * r))

    @function
    def sample_visible(self, v: Any, u1: Any, u2: Any, alpha: Any) -> Any:
        """A visible normal: the half vector with a uniform point of a spherical cap (Dupuy2023)."""
        stretched = normalize(vec3(alpha.x * v.x, alpha.y * v.y, v.z))
        return self._from_cap(stretched, stretched.z, u1, u2, alpha)

    def _from_cap(self, stretched: Any, depth: Any, u1: Any, u2: Any, alpha: Any) -> Any:
        # the cap reaches down to z = -depth; heights are counted from there, so that nothing cancels at its rim
        height = 1.0 + depth
        lift = (1.0 - u2) * height
        r = safe_sqrt((height - lift) * (1.0 - depth + lift))
        phi = (2.0 * ops.pi) * u1
        s, c = sincos(phi)
        h = vec3(r * c + stretched.x, r * s + stretched.y, lift + (stretched.z - depth))
        # grazing view and the lowest point of the cap add up to zero length; any facet upright then
        return normalize(vec3(alpha.x * h.x, alpha.y * h.y, maximum(h.z, 1e-12)))

    @function
    def visible_per_cosine(self, v: Any, m: Any, alpha: Any) -> Any:
        """Density of visible normals over |v.m|, G1 D / |v.z|, with |v.z| cancelled: finite at grazing."""
        z = abs(v.z)
        return 2.0 * self.D(m, alpha) / maximum(z + sqrt(fma(z, z, slant2(v, alpha))), 1e-30)

    @function
    def sample_bounded(self, v: Any, u1: Any, u2: Any, alpha: Any) -> Any:
        """A visible normal from the part of the cap whose reflections can lie above the surface (Eto2023)."""
        stretched = normalize(vec3(alpha.x * v.x, alpha.y * v.y, v.z))
        return self._from_cap(stretched, self._bound(v, alpha) * stretched.z, u1, u2, alpha)

    @function
    def bounded_per_cosine(self, v: Any, m: Any, alpha: Any) -> Any:
        """Density of `sample_bounded` over |v.m|: 2 D / (k |v.z| + sqrt(v.z^2 + slant^2)) (Eto2023)."""
        z = abs(v.z)
        root = sqrt(fma(z, z, slant2(v, alpha)))
        return 2.0 * self.D(m, alpha) / maximum(self._bound(v, alpha) * z + root, 1e-30)

    def _bound(self, v: Any, alpha: Any) -> Any:
        """k: how far the cap reaches down, as a share of the full depth (Eto2023)."""
        a2 = sqr(clamp(minimum(alpha.x, alpha.y), 0.0, 1.0))
        reach2 = sqr(1.0 + sqrt(sin2(v)))
        return (1.0 - a2) * reach2 / (reach2 + a2 * sqr(v.z))
