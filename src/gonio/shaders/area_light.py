"""Light from quadrilaterals as shader code, with the tables of linearly transformed cosines that it reads."""

from __future__ import annotations

from ..energy.tables import area_light as formulas
from ..energy.tables.baked import Baked
from ..ops import Direction, Scalar, Spectrum, Table, function, lookup, vec3
from .bundle import Bundle
from .functions import functions_bundle
from .placement import Placement

TITLE = """Light that a surface reflects from a convex quadrilateral of uniform radiance 1, by linearly transformed
cosines (Heitz2016a).

wo and the corners are vectors from the shaded point, in its local frame, in which +z is the shading normal; wo has unit
length. The corners are given in clockwise or counterclockwise order; for a one-sided light, test its orientation before
the call. The part of the light below the horizon is clipped. The tables are read over the roughness and
sqrt(1 - cos theta)."""


def area_light(baked: Baked, lang: str, placement: Placement | None = None) -> Bundle:
    """The function `area_light` as shader code, with the tables of `energy.tables.ltc`.

    The function has the argument `roughness` if the tables have this axis, and `f0` if they apply to any reflectance
    F0.
    """
    inverse, norm = (Table(name, baked.arrays[name]) for name in ("ltc_inverse", "ltc_norm"))
    anisotropic, colored = inverse.channels == 8, norm.channels == 3
    swept = len(inverse.shape) == 2 + anisotropic

    @function
    def area_light(
        f0: Spectrum | None, roughness: Scalar, wo: Direction, a: Direction, b: Direction, c: Direction, d: Direction
    ) -> Spectrum:
        """Radiance reflected toward wo from a light of radiance 1 with the corners a, b, c, d."""
        place = (formulas.turned_coordinates if anisotropic else formulas.coordinates)(inverse, roughness, wo)
        covered = (formulas.turned_quad if anisotropic else formulas.quad)(lookup(inverse, *place), wo, (a, b, c, d))
        albedo = lookup(norm, *place)
        if f0 is None:
            color: Spectrum = vec3(*albedo) * covered  # type: ignore[assignment]  # three channels in a shader
            return color
        return (f0 * (albedo[0] - albedo[1]) + albedo[1]) * covered

    optional = {"f0": None if colored else "vec3", "roughness": "float" if swept else None}
    types = {**optional, "wo": "vec3", **dict.fromkeys("abcd", "vec3")}
    return functions_bundle([(area_light, types)], lang, TITLE, placement)
