"""Samplers of the environment, which use Mitsuba's method or the density of `sky.py`."""

from __future__ import annotations

import drjit as dr

from ...bridge.types import Emitter, Float, Mask, Point, Radiance, SurfaceInteraction, UInt
from ..surfaces import Surfaces
from .base import LightHit, LightSample, LightSampler, with_shadow_target
from .sky import Sky


class Environment(LightSampler):
    """The environment, which rays hit if they leave the scene, sampled by Mitsuba."""

    def __init__(self, surfaces: Surfaces, emitter: Emitter) -> None:
        self.mi, self.surfaces, self.emitter = surfaces.mi, surfaces, emitter

    def owns(self, si: SurfaceInteraction) -> Mask:
        return ~si.is_valid()

    def emitted(self, si: SurfaceInteraction, active: Mask) -> Radiance:
        return self.emitter.eval(si, active)

    def sample(self, si: SurfaceInteraction, u: Point, index: UInt, active: Mask) -> LightSample:
        return with_shadow_target(self.surfaces.offsets, si, *self.emitter.sample_direction(si, u, active))

    def pdf(self, hit: LightHit, index: UInt, active: Mask) -> Float:
        return self.emitter.pdf_direction(hit.it, hit.ds, active)


class VaryingEnvironment(Environment):
    """An environment map that is sampled according to its luminance."""

    def __init__(self, surfaces: Surfaces, emitter: Emitter, sky: Sky) -> None:
        super().__init__(surfaces, emitter)
        self.sky = sky

    def sample(self, si: SurfaceInteraction, u: Point, index: UInt, active: Mask) -> LightSample:
        mi = self.mi
        ds = dr.zeros(mi.DirectionSample3f, dr.width(si.p))
        ds.d, ds.p, ds.pdf, radiance = self.sky.sample(si, u, active)
        ds.dist, ds.n, ds.time, ds.delta = dr.norm(ds.p - si.p), mi.Normal3f(-ds.d), si.time, mi.Bool(False)
        return LightSample(ds, ds.p, dr.select(ds.pdf > 0, radiance / ds.pdf, 0), mi.Bool(False), mi.Float(0))

    def pdf(self, hit: LightHit, index: UInt, active: Mask) -> Float:
        return self.sky.pdf(hit.ds.d)


def environment(surfaces: Surfaces, emitter: Emitter, mis_compensation: bool) -> Environment:
    """The sampler of an environment.

    mis_compensation  whether BSDFs are sampled too, so that the density of a map can omit its uniform part (Karlik2019)
    """
    if "data" in dict(surfaces.mi.traverse(emitter)):
        sky = Sky(surfaces.mi, surfaces.scene, emitter, mis_compensation)
        if sky.known:
            return VaryingEnvironment(surfaces, emitter, sky)
    return Environment(surfaces, emitter)
