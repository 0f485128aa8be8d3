"""Scenes with a single rectangular lamp, like most scenes of the lab.

No light needs to be selected, and the kernel does not call an emitter: the rectangle is sampled uniformly in solid
angle, both for `gonio_area` and for Mitsuba's one-sided `area`. For the last ray of a path, an intersection test with
one rectangle and a shadow ray replace the search for the nearest surface.
"""

from __future__ import annotations

from collections.abc import Sequence

import drjit as dr

from ...bridge.types import Emitter, Float, Mask, Point, Radiance, Ray, SurfaceInteraction, UInt
from ..lights.base import LightHit, LightSample, with_shadow_target
from ..lights.directions import direction_sample
from ..lights.lamps import Lamps
from ..lights.solid_angles import Rectangle, SphericalRectangle
from ..surfaces import Surfaces
from .lamp_table import has_known_sides, rectangle_of


class RectangleLight(Lamps):
    """A rectangle that is the only light of a scene."""

    rectangle: Rectangle

    @classmethod
    def of(
        cls, surfaces: Surfaces, emitters: Sequence[Emitter], scene_indices: UInt, environment: int
    ) -> RectangleLight | None:
        """The light of a scene; None if there are several lights or the light is not a rectangle."""
        rectangle = rectangle_of(surfaces.mi, emitters[0].get_shape()) if has_known_sides(emitters[0]) else None
        if rectangle is None:
            return None
        dr.make_opaque(rectangle)
        light = cls(surfaces, emitters, scene_indices, environment)
        light.rectangle = rectangle
        return light

    def sample(self, si: SurfaceInteraction, u: Point, index: UInt, active: Mask) -> LightSample:
        view = SphericalRectangle(self.rectangle, si.p)
        ds = direction_sample(self.mi, view, u, si)
        light = with_shadow_target(self.surfaces.offsets, si, ds, self.sent(self.emitters[0], ds, si, active) / ds.pdf)
        light.solid_angle = dr.select(view.uniform, view.solid_angle, 0)
        return light

    def pdf(self, hit: LightHit, index: UInt, active: Mask) -> Float:
        away = hit.si.p - hit.origin
        distance = dr.norm(away)
        return self.rectangle.pdf(hit.solid_angle, distance, dr.abs(dr.dot(away, hit.si.n)) / distance)

    def along(self, ray: Ray, solid_angle: Float, active: Mask) -> tuple[Radiance, Float]:
        """The radiance that arrives along a ray, and the density of `sample` for the direction of the ray."""
        mi = self.mi
        distance, uv, hit = self.rectangle.hit(ray.o, ray.d)
        active = active & hit & (distance < ray.maxt)
        ds = dr.zeros(mi.DirectionSample3f)
        ds.n, ds.d, ds.uv = mi.Normal3f(self.rectangle.normal), ray.d, mi.Point2f(*uv)
        at_light = mi.SurfaceInteraction3f(ds, ray.wavelengths)
        at_light.wi = at_light.to_local(-ray.d)
        radiance = self.emitters[0].eval(at_light, active)
        shadow = mi.Ray3f(ray)
        shadow.maxt = distance - self.surfaces.offsets.between(ray.o, ray(distance))
        active &= dr.any(radiance != 0)
        active &= ~self.surfaces.blocked(shadow, active)
        pdf = self.rectangle.pdf(solid_angle, distance, dr.abs(dr.dot(ray.d, self.rectangle.normal)))
        return dr.select(active, radiance, 0), pdf
