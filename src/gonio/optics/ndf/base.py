"""The base classes of distributions of normals: `NDF` for all, `Stretched` for stretch-invariant ones."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ... import ops
from ...errors import InputError
from ...members import Family, instances_of
from ...ops import (
    Direction,
    Pair,
    Scalar,
    abs,
    backend,
    dot,
    function,
    maximum,
    norm,
    normalize,
    safe_div,
    safe_sqrt,
    sincos,
    vec3,
    where,
)
from ..part import GUIDE, Part
from . import tabulated


class NDF(Part):
    """Distribution of microfacet normals with widths alpha = (alpha_x, alpha_y).

    A subclass must define `D`; one that is stretch-invariant derives from `Stretched`. Without closed forms, `Lambda`,
    `sample` and visible normals are read from tables computed once from D (`tabulated`), with 1 + Lambda accurate to
    1e-4. The tables require a D that is isotropic at equal widths and, at unequal widths, is either stretch-invariant
    or independent of alpha.y. All methods take unit vectors of the local frame. m lies above the surface (m.z > 0); a
    direction v may lie on either side, because Smith's terms depend on |v.z|. The first line of a subclass's docstring
    is its title in the manual.

    long_tailed  whether Lambda falls off so slowly with the cosine, as 1 / cos^2, that masking is noticeable at all
                 angles (GGX); if not, masking is confined to cosines below a few alpha. The axes of energy-compensation
                 tables depend on this: their error is 1e-4, but 2e-3 if it is wrongly True and 8e-3 if wrongly False
    """

    name: ClassVar[str] = ""
    family: ClassVar[Family[NDF]]
    long_tailed: ClassVar[bool] = False
    formulas: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "D": ("vec3", "vec2", "float"),
        "Lambda": ("vec3", "vec2", "float"),
        "sample": ("float", "float", "vec2", "vec3"),
        "sample_visible": ("vec3", "float", "float", "vec2", "vec3"),
        "visible_per_cosine": ("vec3", "vec3", "vec2", "float"),
    }

    def missing(self) -> str:
        return "" if type(self).D is not NDF.D else "D(self, m, alpha)"

    def check_widths(self, alpha: object, where: str = "alpha") -> None:
        """Raise InputError for widths given by the user, one or a pair, that `Lambda` or `sample` does not support.

        If these are tabulated, the tables are computed here, before Dr.Jit records a loop.

        where  the place of the widths, for errors
        """
        if not (self.tabulated or self._tabulates_area):
            return
        widths = tabulated.tables_of(self).widths
        x, y = alpha if isinstance(alpha, tuple | list) else (alpha, alpha)
        if widths != "equal" or x is y or backend.is_drjit(x) or backend.is_drjit(y):
            return
        if not np.array_equal(np.asarray(x), np.asarray(y)):
            what = f"two widths given, but D of {type(self).__name__} neither stretches one surface nor ignores alpha.y"
            hint = f"give one width, or write Lambda(self, v, alpha) and sample(self, u1, u2, alpha); see {GUIDE}"
            raise InputError(what, where, hint)

    def D(self, m: Direction, alpha: Pair) -> Scalar:
        """Density of normals, 1/sr. The integral of D(m) m.z is 1."""
        raise self.lacks("no `D`", "D(self, m, alpha)")

    @function
    def sample(self, u1: Scalar, u2: Scalar, alpha: Pair) -> Direction:
        """A normal with density D(m) m.z; by default, from a table of the inverse of its integral."""
        s, c = sincos((2.0 * ops.pi) * u2)
        return self._sloped(tabulated.ALL, u1, c, s, alpha)

    def pdf(self, m: Direction, alpha: Pair) -> Scalar:
        """Density of `sample`: D(m) m.z."""
        return self.D(m, alpha) * maximum(m.z, 0.0)

    # ------------------------------------------------------------------ Smith's terms

    @function
    def Lambda(self, v: Direction, alpha: Pair) -> Scalar:
        """Smith's Lambda, the ratio of masked to visible projected area (Heitz2014); by default from a table."""
        return self._visible_area(v, alpha) / maximum(abs(v.z), 1e-15) - 1.0

    def _visible_area(self, v: Direction, alpha: Pair) -> Scalar:
        """Projected area of the facets that face v, from a table; at least that of the surface, |v.z|."""
        tables = tabulated.tables_of(self)
        stretched = stretch(v, tables.pair(alpha))
        length = norm(stretched)
        level2 = stretched.x * stretched.x + stretched.y * stretched.y
        place = safe_sqrt(level2 / (length * (length + abs(v.z))))
        area = length * tables.read(tabulated.AREA, alpha, place)
        return maximum(area, abs(v.z))

    def G1(self, v: Direction, alpha: Pair) -> Scalar:
        """Smith's masking of one direction, 1 / (1 + Lambda)."""
        return 1.0 / (1.0 + self.Lambda(v, alpha))

    def G1_customary(self, v: Direction, alpha: Pair) -> Scalar:
        """The G1 that `smith-separable` uses: exact, unless a fit is customary."""
        return self.G1(v, alpha)

    # ------------------------------------------------------------------ visible normals

    @property
    def tabulated(self) -> bool:
        """Whether normals are sampled from tables computed from D, because `sample` is not defined."""
        return type(self).sample is NDF.sample

    @property
    def falls_slowly(self) -> bool:
        """`long_tailed` or, if Lambda is tabulated, the same property of the table."""
        return self.long_tailed or (self._tabulates_area and tabulated.tables_of(self).long_tailed)

    @property
    def _tabulates_area(self) -> bool:
        return type(self).Lambda is NDF.Lambda

    def sample_visible(self, v: Direction, u1: Scalar, u2: Scalar, alpha: Pair) -> Direction:
        """A normal visible from v (v.z >= 0), sampled from tables. If `sample` is defined but this method is not, a
        normal from `sample`, which need not be visible."""
        return self._visible(v, u1, u2, alpha) if self.tabulated else self.sample(u1, u2, alpha)

    @function
    def _visible(self, v: Direction, u1: Scalar, u2: Scalar, alpha: Pair) -> Direction:
        """A visible normal, by v.m = v.z m.z + v_h.m_h, where the index h denotes components along the surface.

        A fraction of the samples has the density D m.z, the others D max(0, v_h.m_h), the limit for grazing v. Where
        v_h.m_h < 0, the sum exceeds the visible area, so that up to a sixth of the samples fail.
        """
        stretched = stretch(v, tabulated.tables_of(self).pair(alpha))
        level = safe_sqrt(stretched.x * stretched.x + stretched.y * stretched.y)
        share = 0.5 * level / (v.z + 0.5 * level)
        grazing = u1 < share
        u1 = where(grazing, safe_div(u1, share), safe_div(u1 - share, 1.0 - share))
        s, c = sincos((2.0 * ops.pi) * u2)
        across = 2.0 * u2 - 1.0
        toward = safe_sqrt(1.0 - across * across)
        x, y = safe_div(stretched.x, level), safe_div(stretched.y, level)
        steep = self._sloped(tabulated.GRAZING, u1, x * toward - y * across, y * toward + x * across, alpha)
        return where(grazing, steep, self._sloped(tabulated.ALL, u1, c, s, alpha))

    def _sloped(self, column: int, u: Scalar, c: Scalar, s: Scalar, alpha: Pair) -> Direction:
        """The normal of the unstretched surface at the azimuth (c, s) whose slope is the quantile u, then stretched."""
        tables = tabulated.tables_of(self)
        low, high = safe_sqrt(u), safe_sqrt(1.0 - u)
        tau = tables.read(column, alpha, low / (low + high))
        slope = tau / maximum(1.0 - tau, 1e-7)
        pair = tables.pair(alpha)
        return normalize(vec3(pair.x * slope * c, pair.y * slope * s, 1.0 + 0.0 * slope))

    def pdf_visible(self, v: Direction, m: Direction, alpha: Pair) -> Scalar:
        """Density of `sample_visible`."""
        return abs(dot(v, m)) * self.visible_per_cosine(v, m, alpha)

    def visible_per_cosine(self, v: Direction, m: Direction, alpha: Pair) -> Scalar:
        """`pdf_visible` divided by |v.m|, which cancels in the density of mirrored directions (Walter2007, eq. 14)."""
        density = self._visible_pdf(v, m, alpha) if self.tabulated else self.pdf(m, alpha)
        return safe_div(density, abs(dot(v, m)))

    @function
    def _visible_pdf(self, v: Direction, m: Direction, alpha: Pair) -> Scalar:
        """Density of `_visible`."""
        stretched = stretch(v, tabulated.tables_of(self).pair(alpha))
        level = safe_sqrt(stretched.x * stretched.x + stretched.y * stretched.y)
        upward = where(v.z < 0.0, -1.0, 1.0)
        facing = abs(v.z) * m.z + maximum(upward * (v.x * m.x + v.y * m.y), 0.0)
        return where(m.z > 0.0, self.D(m, alpha) * facing / (abs(v.z) + 0.5 * level), 0.0)

    def sample_bounded(self, v: Direction, u1: Scalar, u2: Scalar, alpha: Pair) -> Direction:
        """A visible normal whose reflection is less likely to fall below the surface; by default `sample_visible`."""
        return self.sample_visible(v, u1, u2, alpha)

    def bounded_per_cosine(self, v: Direction, m: Direction, alpha: Pair) -> Scalar:
        """Density of `sample_bounded` divided by |v.m|."""
        return self.visible_per_cosine(v, m, alpha)


NDF.family = Family("microfacet distribution", "gonio.distributions", (__package__,), instances_of(NDF), "ndf")


@function
def stretch(w: Direction, alpha: Pair) -> Direction:
    """The vector (alpha_x w_x, alpha_y w_y, w_z), which is not normalized."""
    return vec3(alpha.x * w.x, alpha.y * w.y, w.z)


class Stretched(NDF):
    """A stretch-invariant distribution: the slopes of a surface of width 1 are scaled by alpha (Heitz2014, sec. 5.3).

    A subclass describes the surface of width 1 by `density` and, if there are closed forms, `area`, `slope` and
    `visible_normal`; otherwise, tables are used as for any `NDF`. `density` and `area` are called with vectors of any
    length: as D = P(slope) / n_z^4 and int D(m) max(0, v.m) dm, they are homogeneous of degree -4 and 1, so that
    stretching is a linear map without a Jacobian.
    """

    name: ClassVar[str] = ""
    formulas: ClassVar[Mapping[str, tuple[str, ...]]] = {
        **NDF.formulas,
        "density": ("vec3", "float"),
        "area": ("vec3", "float"),
        "slope": ("float", "float"),
        "visible_normal": ("vec3", "float", "float", "vec3"),
    }

    def missing(self) -> str:
        own = type(self).density is not Stretched.density or type(self).D is not Stretched.D
        return "" if own else "density(self, n)"

    def density(self, n: Direction) -> Scalar:
        """D at width 1, times |n|^-4: the density of the slopes (-n_x / n_z, -n_y / n_z) divided by n_z^4."""
        raise self.lacks("no `density`", "density(self, n)")

    def area(self, v: Direction) -> Scalar:
        """Projected area at width 1 of the facets that face v (or, for v below the surface, -v), times |v|."""
        raise self.lacks("no `area`", "area(self, v)")

    def slope(self, u: Scalar) -> Scalar:
        """The slope tan(theta_m), at width 1, below which a fraction u of the surface lies."""
        raise self.lacks("no `slope`", "slope(self, u)")

    def visible_normal(self, v: Direction, u1: Scalar, u2: Scalar) -> Direction:
        """A visible normal at width 1, of any length, from v (unit, v.z >= 0); optional."""
        raise NotImplementedError

    @property
    def tabulated(self) -> bool:
        return type(self).sample is Stretched.sample and type(self).slope is Stretched.slope

    @property
    def _tabulates_area(self) -> bool:
        return type(self).Lambda is Stretched.Lambda and type(self).area is Stretched.area

    @property
    def _has_visible(self) -> bool:
        return type(self).visible_normal is not Stretched.visible_normal

    @function
    def D(self, m: Direction, alpha: Pair) -> Scalar:
        """Density of normals, 1/sr, from that of the surface with alpha = 1."""
        over = 1.0 / (alpha.x * alpha.y)
        n = vec3(m.x * (alpha.y * over), m.y * (alpha.x * over), m.z)
        return where(m.z > 0.0, self.density(n) * over, 0.0)

    @function
    def projected_area(self, v: Direction, alpha: Pair) -> Scalar:
        """Projected area of the facets that face v: int D(m) max(0, v.m) dm = |v.z| (1 + Lambda) (Heitz2014)."""
        return self._visible_area(v, alpha) if self._tabulates_area else self.area(stretch(v, alpha))

    @function
    def Lambda(self, v: Direction, alpha: Pair) -> Scalar:
        """Smith's Lambda, the ratio of masked to visible projected area (Heitz2014); 0 up to rounding at the normal."""
        return self.projected_area(v, alpha) / maximum(abs(v.z), 1e-15) - 1.0

    @function
    def G1(self, v: Direction, alpha: Pair) -> Scalar:
        """Smith's masking of one direction, 1 / (1 + Lambda), the visible fraction of the area that faces v."""
        return abs(v.z) / self.projected_area(v, alpha)

    @function
    def sample(self, u1: Scalar, u2: Scalar, alpha: Pair) -> Direction:
        """A normal with density D(m) m.z: a slope of the surface of width 1 at a uniform azimuth, stretched."""
        if self.tabulated:
            return super().sample(u1, u2, alpha)
        r = self.slope(u1)
        s, c = sincos((2.0 * ops.pi) * u2)
        return normalize(vec3(r * c * alpha.x, r * s * alpha.y, ops.ones_like(r)))

    @function
    def sample_visible(self, v: Direction, u1: Scalar, u2: Scalar, alpha: Pair) -> Direction:
        """A visible normal: sampled for the stretched v on the surface of width 1, then stretched (Heitz2014b)."""
        if not self._has_visible:
            return super().sample_visible(v, u1, u2, alpha)
        return normalize(stretch(self.visible_normal(normalize(stretch(v, alpha)), u1, u2), alpha))

    @function
    def visible_per_cosine(self, v: Direction, m: Direction, alpha: Pair) -> Scalar:
        """Density of visible normals divided by |v.m|: D divided by the area visible from v (Heitz2014b). It is finite
        at grazing angles."""
        if not self._has_visible:
            return super().visible_per_cosine(v, m, alpha)
        return self.D(m, alpha) / self.projected_area(v, alpha)
