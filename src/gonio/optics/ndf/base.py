"""What every distribution of normals offers: `NDF`, and `Stretched` for those that are one surface of width 1."""

from __future__ import annotations

from typing import ClassVar

from ... import ops
from ...members import Family, instances_of
from ...ops import Direction, Pair, Scalar, abs, dot, function, maximum, normalize, safe_div, sincos, vec3, where


class NDF:
    """Distribution of microfacet normals with widths alpha = (alpha_x, alpha_y).

    A member that is one surface, stretched, derives from `Stretched`. Any other must give `D`, `Lambda` and `sample`;
    all else has a default. All methods take unit vectors of the local frame. m lies above the surface (m.z > 0); a
    direction v may lie on either side, Smith's terms depend on |v.z|. The first line of a member's docstring is its
    title in the manual.

    long_tailed  whether Lambda falls off so slowly with the cosine, as 1 / cos^2, that something is masked at any angle
                 (GGX); False: a few alpha from grazing nothing is. Tables of what single scattering misses choose their
                 axes by it, and err by 1e-4; with the wrong one by 2e-3 (long) to 8e-3
    """

    name: ClassVar[str] = ""
    family: ClassVar[Family[NDF]]
    long_tailed: ClassVar[bool] = False

    def D(self, m: Direction, alpha: Pair) -> Scalar:
        """Density of normals, 1/sr: its integral over D(m) m.z is 1."""
        raise NotImplementedError(f"{type(self).__name__} has no `D`")

    def sample(self, u1: Scalar, u2: Scalar, alpha: Pair) -> Direction:
        """A normal with density D(m) m.z."""
        raise NotImplementedError(f"{type(self).__name__} has no `sample`")

    def pdf(self, m: Direction, alpha: Pair) -> Scalar:
        """Density of `sample`, D(m) m.z."""
        return self.D(m, alpha) * maximum(m.z, 0.0)

    # ------------------------------------------------------------------ Smith's terms

    def Lambda(self, v: Direction, alpha: Pair) -> Scalar:
        """Smith's Lambda, exact: masked over visible projected area (Heitz2014)."""
        raise NotImplementedError(f"{type(self).__name__} has no `Lambda`")

    def G1(self, v: Direction, alpha: Pair) -> Scalar:
        """Smith's masking of one direction, 1 / (1 + Lambda)."""
        return 1.0 / (1.0 + self.Lambda(v, alpha))

    def G1_customary(self, v: Direction, alpha: Pair) -> Scalar:
        """G1 as `smith-separable` means it; the exact one unless the field customarily uses a fit."""
        return self.G1(v, alpha)

    # ------------------------------------------------------------------ normals as a direction sees them

    def sample_visible(self, v: Direction, u1: Scalar, u2: Scalar, alpha: Pair) -> Direction:
        """A normal as v (v.z >= 0) sees them; without a routine of its own, all normals instead."""
        return self.sample(u1, u2, alpha)

    def pdf_visible(self, v: Direction, m: Direction, alpha: Pair) -> Scalar:
        """Density of `sample_visible`."""
        return abs(dot(v, m)) * self.visible_per_cosine(v, m, alpha)

    def visible_per_cosine(self, v: Direction, m: Direction, alpha: Pair) -> Scalar:
        """`pdf_visible` over |v.m|: the cosine cancels in the density of what is mirrored at m (Walter2007, eq. 14)."""
        return safe_div(self.pdf(m, alpha), abs(dot(v, m)))

    def sample_bounded(self, v: Direction, u1: Scalar, u2: Scalar, alpha: Pair) -> Direction:
        """A visible normal whose reflection is less likely to fall below the surface; else `sample_visible`."""
        return self.sample_visible(v, u1, u2, alpha)

    def bounded_per_cosine(self, v: Direction, m: Direction, alpha: Pair) -> Scalar:
        """Density of `sample_bounded` over |v.m|."""
        return self.visible_per_cosine(v, m, alpha)


NDF.family = Family("microfacet distribution", "gonio.distributions", (__package__,), instances_of(NDF), "ndf")


@function
def stretch(w: Direction, alpha: Pair) -> Direction:
    """(alpha_x w_x, alpha_y w_y, w_z), not unit."""
    return vec3(alpha.x * w.x, alpha.y * w.y, w.z)


class Stretched(NDF):
    """An isotropic surface of width 1, whose slopes alpha multiplies along x and y (Heitz2014, sec. 5.3).

    A member describes the surface of width 1, by `density`, `area`, `slope` and, where it has one, `visible_normal`.
    `density` and `area` are asked of vectors of any length: with D = P(slope) / n_z^4 and int D(m) max(0, v.m) dm they
    are homogeneous, of degree -4 and 1, so a linear map is all that stretching is, without a Jacobian.
    """

    def density(self, n: Direction) -> Scalar:
        """D at width 1, times |n|^-4: density of the slopes (-n_x / n_z, -n_y / n_z) over n_z^4."""
        raise NotImplementedError(f"{type(self).__name__} has no `density`")

    def area(self, v: Direction) -> Scalar:
        """Projected area at width 1 of the facets that face v (or, for v below the surface, -v), times |v|."""
        raise NotImplementedError(f"{type(self).__name__} has no `area`")

    def slope(self, u: Scalar) -> Scalar:
        """The length of slope, at width 1, that a share u of the surface stays below."""
        raise NotImplementedError(f"{type(self).__name__} has no `slope`")

    def visible_normal(self, v: Direction, u1: Scalar, u2: Scalar) -> Direction:
        """A normal at width 1, of any length, as v (unit, v.z >= 0) sees them; optional."""
        raise NotImplementedError

    @property
    def _sees(self) -> bool:
        return type(self).visible_normal is not Stretched.visible_normal

    @function
    def D(self, m: Direction, alpha: Pair) -> Scalar:
        """Density of normals, 1/sr: that of the normal on the surface of width 1."""
        over = 1.0 / (alpha.x * alpha.y)
        n = vec3(m.x * (alpha.y * over), m.y * (alpha.x * over), m.z)
        return where(m.z > 0.0, self.density(n) * over, 0.0)

    @function
    def projected_area(self, v: Direction, alpha: Pair) -> Scalar:
        """Area of the facets that face v, seen from there: int D(m) max(0, v.m) dm = |v.z| (1 + Lambda) (Heitz2014)."""
        return self.area(stretch(v, alpha))

    @function
    def Lambda(self, v: Direction, alpha: Pair) -> Scalar:
        """Smith's Lambda: masked over visible projected area (Heitz2014); at the normal 0, rounded either way."""
        return self.projected_area(v, alpha) / maximum(abs(v.z), 1e-15) - 1.0

    @function
    def G1(self, v: Direction, alpha: Pair) -> Scalar:
        """Smith's masking of one direction, 1 / (1 + Lambda): visible over all area that faces v."""
        return abs(v.z) / self.projected_area(v, alpha)

    @function
    def sample(self, u1: Scalar, u2: Scalar, alpha: Pair) -> Direction:
        """A normal with density D(m) m.z: a slope in any direction, stretched."""
        r = self.slope(u1)
        s, c = sincos((2.0 * ops.pi) * u2)
        return normalize(vec3(r * c * alpha.x, r * s * alpha.y, ops.ones_like(r)))

    @function
    def sample_visible(self, v: Direction, u1: Scalar, u2: Scalar, alpha: Pair) -> Direction:
        """A visible normal: what the stretched v sees on the surface of width 1, stretched (Heitz2014b)."""
        if not self._sees:
            return self.sample(u1, u2, alpha)
        return normalize(stretch(self.visible_normal(normalize(stretch(v, alpha)), u1, u2), alpha))

    @function
    def visible_per_cosine(self, v: Direction, m: Direction, alpha: Pair) -> Scalar:
        """Density of visible normals over |v.m|: D over the area that v sees (Heitz2014b), finite at grazing."""
        if not self._sees:
            return super().visible_per_cosine(v, m, alpha)
        return self.D(m, alpha) / self.projected_area(v, alpha)
