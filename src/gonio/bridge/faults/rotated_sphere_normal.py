"""Mitsuba 3.9: `sample_position` of a rotated sphere returns the normal of the unrotated one.

    sphere = mi.load_dict({"type": "sphere", "to_world": mi.ScalarTransform4f().rotate([1, 0, 0], 90)})
    ps = sphere.sample_position(0.0, mi.Point2f(0.1, 0.2))
    dr.dot(ps.n, ps.p)                                     # 1 expected, as the center is the origin

Workaround: compute the normal from the position, the center and the radius.
"""

from __future__ import annotations

from types import ModuleType

import drjit as dr

from ..types import Float, PositionSample


def with_radial_normal(mi: ModuleType, ps: PositionSample, sphere: Float) -> PositionSample:
    """The position sample with the correct normal; `sphere` is (center, signed radius), or 0 for other shapes."""
    ps.n = dr.select(sphere.w != 0.0, mi.Normal3f((ps.p - mi.Point3f(sphere.xyz)) / sphere.w), ps.n)
    return ps
