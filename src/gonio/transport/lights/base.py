"""The interface of light samplers: emitted radiance, samples, and the density of samples."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from types import ModuleType

import drjit as dr

from ...bridge.faults.ray_offset import Offsets
from ...bridge.types import DirectionSample, Float, Interaction, Mask, Point, Radiance, Scene, SurfaceInteraction, UInt


@dataclass
class LightSample:
    """A sample of the light that arrives at a point.

    ds           Mitsuba's direction sample: direction, distance, and density in 1/sr
    target       end point of the shadow ray
    weight       radiance divided by density
    delta        whether the light is a point light or a parallel beam, which no BSDF sample can hit
    solid_angle  solid angle of a rectangle that is sampled uniformly in solid angle; otherwise 0
    """

    ds: DirectionSample
    target: Point
    weight: Radiance
    delta: Mask
    solid_angle: Float


class LightHit:
    """A hit of a light at `si` by a ray from `origin`.

    solid_angle  `LightSample.solid_angle` of the light sample taken at the origin
    """

    def __init__(self, mi: ModuleType, scene: Scene, origin: Point, solid_angle: Float, si: SurfaceInteraction) -> None:
        self.mi, self.scene, self.origin, self.solid_angle, self.si = mi, scene, origin, solid_angle, si

    @cached_property
    def it(self) -> Interaction:
        """The origin as an interaction, which Mitsuba's emitters require."""
        it = dr.zeros(self.mi.SurfaceInteraction3f)
        it.p = self.origin
        return it

    @cached_property
    def ds(self) -> DirectionSample:
        """The direction sample from the origin to the light."""
        return self.mi.DirectionSample3f(self.scene, self.si, self.it)


class LightSampler:
    """The sampler of one or more lights of a scene that are sampled by the same method.

    index  position of a light in `Lights.emitters`
    """

    def owns(self, si: SurfaceInteraction) -> Mask:
        """Whether a ray that ended at `si` may have hit one of these lights."""
        raise NotImplementedError

    def emitted(self, si: SurfaceInteraction, active: Mask) -> Radiance:
        """The radiance that the light at `si` emits back along the ray."""
        raise NotImplementedError

    def sample(self, si: SurfaceInteraction, u: Point, index: UInt, active: Mask) -> LightSample:
        """Sample a direction from `si` toward light `index` with two random numbers in [0, 1)."""
        raise NotImplementedError

    def pdf(self, hit: LightHit, index: UInt, active: Mask) -> Float:
        """The density (1/sr) with which `sample` generates the direction of `hit`."""
        raise NotImplementedError


def with_shadow_target(offsets: Offsets, si: SurfaceInteraction, ds: DirectionSample, weight: Radiance) -> LightSample:
    """A light sample whose shadow ray ends at an offset from the surface of the lamp.

    The offset is as large as the one with which the ray begins at the surface of `si`. If the ray ended on the surface
    of the lamp, a round lamp would occlude its own edge. At distances shorter than the offset, positions are dominated
    by rounding errors, so the weight is 0.
    """
    mi, offset = offsets.mi, offsets.between(si.p, ds.p)
    normal = dr.select(dr.any(ds.n != 0), ds.n, -ds.d)  # a point light has no normal
    target = mi.Point3f(ds.p - normal * dr.mulsign(offset, dr.dot(normal, ds.d)))
    weight = dr.select(ds.delta | (ds.dist > offset), weight, 0)
    return LightSample(ds, target, weight, mi.Bool(ds.delta), mi.Float(0))
