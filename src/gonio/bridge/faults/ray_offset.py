"""Mitsuba 3.9: rays begin (1 + max |p|) RayEpsilon off their surface, whatever the size of the scene.

    si = dr.zeros(mi.SurfaceInteraction3f)
    si.n = mi.Normal3f(0, 0, 1)
    si.spawn_ray(mi.Vector3f(0, 0, 1)).o                   # [0, 0, 8.9e-05]

In a scene a thousandth as large, rays miss everything nearer than that: glass loses its sides, and shadows are detached
from the objects that cast them.

Workaround: in scenes smaller than 32 units, use a fraction of their size instead of 1. The rest is the same: RayEpsilon
is 1,500 ulps of float32, and the error of positions is proportional to their coordinates. In larger scenes 1 remains: a
ground plane of a thousand units must not increase the offset for the small objects on it.
"""

from __future__ import annotations

from types import ModuleType

import drjit as dr

from ..types import Float, Point, Ray, Scene, SurfaceInteraction, Vector

SHARE = 1 / 32  # fraction of the longest side of the scene's bounding box: 47 ulps of the largest coordinates remain


class Offsets:
    """Distances from surfaces at which rays begin and end: RayEpsilon (unit + max |p|).

    unit  a fraction of the scene's size at construction time, at most 1
    """

    def __init__(self, mi: ModuleType, scene: Scene) -> None:
        self.mi = mi
        box = scene.bbox()
        self.unit = min(SHARE * float(dr.max(box.extents())), 1.0) if box.valid() else 1.0
        self._unit = dr.opaque(mi.Float, self.unit)  # kernel data: a literal would give a kernel per scene size

    def at(self, p: Point) -> Float:
        """The offset of a ray from a point of a surface."""
        return dr.detach(self.mi.math.RayEpsilon * (self._unit + dr.max(dr.abs(p))))

    def between(self, p: Point, q: Point) -> Float:
        """The offset of a ray between two points."""
        return dr.maximum(self.at(p), self.at(q))

    def origin(self, si: SurfaceInteraction, direction: Vector) -> Point:
        """The origin of a ray from a surface, on the side of its direction."""
        offset = dr.mulsign(self.at(si.p), dr.detach(dr.dot(si.n, direction)))
        return self.mi.Point3f(dr.fma(offset, si.n, si.p))

    def ray(self, si: SurfaceInteraction, direction: Vector) -> Ray:
        """A ray from a surface, of unlimited length."""
        return self.mi.Ray3f(self.origin(si, direction), direction, dr.largest(self.mi.Float), si.time, si.wavelengths)
