"""Mitsuba 3.9: rays begin at a distance of (1 + max |p|) RayEpsilon from a surface, regardless of the scene's size.

    si = dr.zeros(mi.SurfaceInteraction3f)
    si.n = mi.Normal3f(0, 0, 1)
    si.spawn_ray(mi.Vector3f(0, 0, 1)).o                   # [0, 0, 8.9e-05]

If a scene is scaled down by a factor of a thousand, rays miss everything that is closer than this distance: surfaces of
glass objects disappear, and shadows are detached from the objects that cast them.

Workaround: in scenes smaller than 32 units, replace the 1 by a fraction of the size of the scene. The factor
RayEpsilon, 1,500 ulps of float32, is unchanged, because the error of a position is proportional to its coordinates. In
larger scenes, the 1 is unchanged too: a ground plane of a thousand units must not increase the offset for small objects
on it.
"""

from __future__ import annotations

from types import ModuleType

import drjit as dr

from ..types import Float, Point, Ray, Scene, SurfaceInteraction, Vector

SHARE = 1 / 32  # fraction of the longest side of the scene's bounding box; leaves 47 ulps of the largest coordinates


class Offsets:
    """The distances from surfaces at which rays begin and end, RayEpsilon (unit + max |p|).

    unit  a fraction of the size that the scene has when this object is constructed, at most 1
    """

    def __init__(self, mi: ModuleType, scene: Scene) -> None:
        self.mi = mi
        box = scene.bbox()
        self.unit = min(SHARE * float(dr.max(box.extents())), 1.0) if box.valid() else 1.0
        self._unit = dr.opaque(mi.Float, self.unit)  # a literal would cause a new kernel for each scene size

    def at(self, p: Point) -> Float:
        """The offset of a ray that begins at a point of a surface."""
        return dr.detach(self.mi.math.RayEpsilon * (self._unit + dr.max(dr.abs(p))))

    def between(self, p: Point, q: Point) -> Float:
        """The offset at both ends of a ray between two points."""
        return dr.maximum(self.at(p), self.at(q))

    def origin(self, si: SurfaceInteraction, direction: Vector) -> Point:
        """The origin of a ray from a surface, on the side of the surface to which the ray points."""
        offset = dr.mulsign(self.at(si.p), dr.detach(dr.dot(si.n, direction)))
        return self.mi.Point3f(dr.fma(offset, si.n, si.p))

    def ray(self, si: SurfaceInteraction, direction: Vector) -> Ray:
        """A ray of unlimited length from a surface."""
        return self.mi.Ray3f(self.origin(si, direction), direction, dr.largest(self.mi.Float), si.time, si.wavelengths)
