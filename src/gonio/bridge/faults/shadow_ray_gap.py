"""Mitsuba 3.9: rays from `spawn_ray_to` end before the target point, by a thousandth of the distance.

    si = dr.zeros(mi.SurfaceInteraction3f)
    si.spawn_ray_to(mi.Point3f(0, 0, 1)).maxt              # 0.999: 1 - ShadowEpsilon

An occluder in this gap in front of a lamp does not cast a shadow.

Workaround: end the ray at the point, except for float32 rounding. The point must not lie on a surface.
"""

from __future__ import annotations

import drjit as dr

from ..types import Point, Ray, SurfaceInteraction
from .ray_offset import Offsets

RELATIVE_GAP = 1e-6  # fraction of the distance, which float32 resolves


def shadow_ray_to(offsets: Offsets, si: SurfaceInteraction, point: Point) -> Ray:
    """A ray from a surface to a point that does not lie on a surface."""
    ray = offsets.ray(si, point - si.p)
    away = point - ray.o
    distance = dr.norm(away)
    ray.d, ray.maxt = away / distance, distance * (1 - RELATIVE_GAP)
    return ray
