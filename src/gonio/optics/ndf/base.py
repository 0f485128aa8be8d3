"""What every distribution of normals offers: `NDF`, and `Stretched` for those that are one surface of width 1."""

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

    A member must give `D`; a member that is one surface, stretched, derives from `Stretched`. Without closed forms
    `Lambda`, `sample` and visible normals come from tables that are found from D once (`tabulated`), 1 + Lambda within
    1e-4. They hold for a D that at equal widths looks the same from all sides; at unequal ones it must be the
    stretched surface, or ignore alpha.y. All methods take unit vectors of the local frame. m lies above the surface
    (m.z > 0); a direction v may lie on either side, Smith's terms depend on |v.z|. The first line of a member's
    docstring is its title in the manual.

    long_tailed  whether Lambda falls off so slowly with the cosine, as 1 / cos^2, that something is masked at any angle
                 (GGX); False: a few alpha from grazing nothing is. Tables of what single scattering misses choose their
                 axes by it, and err by 1e-4; with the wrong one by 2e-3 (long) to 8e-3
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
        """Raise InputError for widths as a user gives them, (alpha_x, alpha_y), that Lambda or `sample` cannot have.

        Where these are tabulated, the tables are found here, before a loop of Dr.Jit's is recorded.
        """
        if not (self.tabulated or self._tabulates_area):
            return
        widths = tabulated.tables_of(self).widths
        x, y = alpha if isinstance(alpha, tuple | list) else (alpha, alpha)
        if widths != "equal" or x is y or backend.is_drjit(x) or backend.is_drjit(y):
            return
        if not np.array_equal(np.asarray(x), np.asarray(y)):
            what = (
                f"two widths, at which D of {type(self).__name__} is neither one surface stretched nor free of alpha.y"
            )
            hint = f"give one, or write Lambda(self, v, alpha) and sample(self, u1, u2, alpha); see {GUIDE}"
            raise InputError(what, where, hint)

    def D(self, m: Direction, alpha: Pair) -> Scalar:
        """Density of normals, 1/sr: its integral over D(m) m.z is 1."""
        raise self.lacks("no `D`", "D(self, m, alpha)")

    @function
    def sample(self, u1: Scalar, u2: Scalar, alpha: Pair) -> Direction:
        """A normal with density D(m) m.z; by a table of the inverse of its integral where no closed form is given."""
        s, c = sincos((2.0 * ops.pi) * u2)
        return self._sloped(tabulated.ALL, u1, c, s, alpha)

    def pdf(self, m: Direction, alpha: Pair) -> Scalar:
        """Density of `sample`, D(m) m.z."""
        return self.D(m, alpha) * maximum(m.z, 0.0)

    # ------------------------------------------------------------------ Smith's terms

    @function
    def Lambda(self, v: Direction, alpha: Pair) -> Scalar:
        """Smith's Lambda, masked over visible projected area (Heitz2014); by a table where no closed form is given."""
        return self._area_seen(v, alpha) / maximum(abs(v.z), 1e-15) - 1.0

    def _area_seen(self, v: Direction, alpha: Pair) -> Scalar:
        """Area of the facets that face v, seen from there, from a table; never less than the surface's."""
        tables = tabulated.tables_of(self)
        seen = stretch(v, tables.pair(alpha))
        length = norm(seen)
        level2 = seen.x * seen.x + seen.y * seen.y
        place = safe_sqrt(level2 / (length * (length + abs(v.z))))
        area = length * tables.read(tabulated.AREA, alpha, place)
        return maximum(area, abs(v.z))

    def G1(self, v: Direction, alpha: Pair) -> Scalar:
        """Smith's masking of one direction, 1 / (1 + Lambda)."""
        return 1.0 / (1.0 + self.Lambda(v, alpha))

    def G1_customary(self, v: Direction, alpha: Pair) -> Scalar:
        """G1 as `smith-separable` means it; the exact one unless the field customarily uses a fit."""
        return self.G1(v, alpha)

    # ------------------------------------------------------------------ normals as a direction sees them

    @property
    def tabulated(self) -> bool:
        """Whether normals are drawn by tables found from D: no `sample` is given."""
        return type(self).sample is NDF.sample

    @property
    def falls_slowly(self) -> bool:
        """`long_tailed`, or what the table says where Lambda is tabulated."""
        return self.long_tailed or (self._tabulates_area and tabulated.tables_of(self).long_tailed)

    @property
    def _tabulates_area(self) -> bool:
        return type(self).Lambda is NDF.Lambda

    def sample_visible(self, v: Direction, u1: Scalar, u2: Scalar, alpha: Pair) -> Direction:
        """A normal as v (v.z >= 0) sees them, from tables; where a `sample` is given without this, all normals
        instead."""
        return self._visible(v, u1, u2, alpha) if self.tabulated else self.sample(u1, u2, alpha)

    @function
    def _visible(self, v: Direction, u1: Scalar, u2: Scalar, alpha: Pair) -> Direction:
        """A normal as v sees them, by v.m = v.z m.z + v_h.m_h with h the part along the surface.

        A share of the samples has the density D m.z, the others D max(0, v_h.m_h), as a grazing direction sees them.
        Where v_h.m_h < 0 that is more than v sees, so that up to a sixth of the samples fail.
        """
        seen = stretch(v, tabulated.tables_of(self).pair(alpha))
        level = safe_sqrt(seen.x * seen.x + seen.y * seen.y)
        share = 0.5 * level / (v.z + 0.5 * level)
        grazing = u1 < share
        u1 = where(grazing, safe_div(u1, share), safe_div(u1 - share, 1.0 - share))
        s, c = sincos((2.0 * ops.pi) * u2)
        across = 2.0 * u2 - 1.0
        toward = safe_sqrt(1.0 - across * across)
        x, y = safe_div(seen.x, level), safe_div(seen.y, level)
        steep = self._sloped(tabulated.GRAZING, u1, x * toward - y * across, y * toward + x * across, alpha)
        return where(grazing, steep, self._sloped(tabulated.ALL, u1, c, s, alpha))

    def _sloped(self, column: int, u: Scalar, c: Scalar, s: Scalar, alpha: Pair) -> Direction:
        """The normal in the azimuth (c, s) of the unstretched surface whose slope a share u stays below."""
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
        """`pdf_visible` over |v.m|: the cosine cancels in the density of what is mirrored at m (Walter2007, eq. 14)."""
        density = self._visible_pdf(v, m, alpha) if self.tabulated else self.pdf(m, alpha)
        return safe_div(density, abs(dot(v, m)))

    @function
    def _visible_pdf(self, v: Direction, m: Direction, alpha: Pair) -> Scalar:
        """Density of `_visible`."""
        seen = stretch(v, tabulated.tables_of(self).pair(alpha))
        level = safe_sqrt(seen.x * seen.x + seen.y * seen.y)
        upward = where(v.z < 0.0, -1.0, 1.0)
        facing = abs(v.z) * m.z + maximum(upward * (v.x * m.x + v.y * m.y), 0.0)
        return where(m.z > 0.0, self.D(m, alpha) * facing / (abs(v.z) + 0.5 * level), 0.0)

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

    A member describes the surface of width 1, by `density` and, where there are closed forms, `area`, `slope` and
    `visible_normal`; without, tables serve as for any `NDF`.
    `density` and `area` are asked of vectors of any length: with D = P(slope) / n_z^4 and int D(m) max(0, v.m) dm they
    are homogeneous, of degree -4 and 1, so a linear map is all that stretching is, without a Jacobian.
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
        """D at width 1, times |n|^-4: density of the slopes (-n_x / n_z, -n_y / n_z) over n_z^4."""
        raise self.lacks("no `density`", "density(self, n)")

    def area(self, v: Direction) -> Scalar:
        """Projected area at width 1 of the facets that face v (or, for v below the surface, -v), times |v|."""
        raise self.lacks("no `area`", "area(self, v)")

    def slope(self, u: Scalar) -> Scalar:
        """The length of slope, at width 1, that a share u of the surface stays below."""
        raise self.lacks("no `slope`", "slope(self, u)")

    def visible_normal(self, v: Direction, u1: Scalar, u2: Scalar) -> Direction:
        """A normal at width 1, of any length, as v (unit, v.z >= 0) sees them; optional."""
        raise NotImplementedError

    @property
    def tabulated(self) -> bool:
        return type(self).sample is Stretched.sample and type(self).slope is Stretched.slope

    @property
    def _tabulates_area(self) -> bool:
        return type(self).Lambda is Stretched.Lambda and type(self).area is Stretched.area

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
        return self._area_seen(v, alpha) if self._tabulates_area else self.area(stretch(v, alpha))

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
        if self.tabulated:
            return super().sample(u1, u2, alpha)
        r = self.slope(u1)
        s, c = sincos((2.0 * ops.pi) * u2)
        return normalize(vec3(r * c * alpha.x, r * s * alpha.y, ops.ones_like(r)))

    @function
    def sample_visible(self, v: Direction, u1: Scalar, u2: Scalar, alpha: Pair) -> Direction:
        """A visible normal: what the stretched v sees on the surface of width 1, stretched (Heitz2014b)."""
        if not self._sees:
            return super().sample_visible(v, u1, u2, alpha)
        return normalize(stretch(self.visible_normal(normalize(stretch(v, alpha)), u1, u2), alpha))

    @function
    def visible_per_cosine(self, v: Direction, m: Direction, alpha: Pair) -> Scalar:
        """Density of visible normals over |v.m|: D over the area that v sees (Heitz2014b), finite at grazing."""
        if not self._sees:
            return super().visible_per_cosine(v, m, alpha)
        return self.D(m, alpha) / self.projected_area(v, alpha)
