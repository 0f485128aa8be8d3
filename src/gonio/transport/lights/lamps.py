"""The sampler of all lights except the environment, which calls Mitsuba's emitters from the kernel."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TypeVar

import drjit as dr
import numpy as np

from ...bridge.faults.borrowed_memory import own
from ...bridge.faults.rotated_sphere_normal import with_radial_normal
from ...bridge.faults.textured_area_light import must_sample_by_area
from ...bridge.types import (
    DirectionSample,
    Emitter,
    Float,
    Mask,
    OfVariant,
    Point,
    PositionSample,
    Radiance,
    Shape,
    SurfaceInteraction,
    UInt,
)
from ..placement import placement_reader
from ..surfaces import Surfaces
from .base import LightHit, LightSample, LightSampler, with_shadow_target
from .directions import area_density, area_sample, per_steradian
from .solid_angles import is_sphere

Answer = TypeVar("Answer")


class Lamps(LightSampler):
    """Lights with a surface, point lights and beams, sampled by Mitsuba.

    emitters       all lights of the scene, in the order of `Lights`
    scene_indices  positions of the lights in `scene.emitters()`
    environment    position of the environment in `emitters`; -1 if there is none
    """

    def __init__(self, surfaces: Surfaces, emitters: Sequence[Emitter], scene_indices: UInt, environment: int) -> None:
        self.mi, self.scene, self.surfaces = surfaces.mi, surfaces.scene, surfaces
        mi = self.mi
        self.emitters, self.scene_indices = emitters, scene_indices
        lamps = [emitter for i, emitter in enumerate(emitters) if i != environment]
        self.lone = lamps[0] if len(lamps) == 1 else None
        shape = emitters[0].get_shape() if len(emitters) == 1 else None
        # This is kernel data too, because the numbers of shapes depend on other scenes that exist.
        self.lone_shape = None if shape is None else dr.reinterpret_array(mi.UInt32, mi.ShapePtr(shape))
        dr.make_opaque(self.lone_shape)
        by_area = [must_sample_by_area(mi, emitter) for emitter in emitters]
        self.by_area = mi.Bool(by_area) if any(by_area) else None
        dr.make_opaque(self.by_area)

    def emitter(self, index: UInt, active: Mask) -> Emitter:
        """The emitter with this index. A single lamp is called directly, which is faster than through a pointer."""
        if self.lone is not None:
            return self.lone
        place = dr.gather(self.mi.UInt32, self.scene_indices, index, active)
        return dr.gather(self.mi.EmitterPtr, self.scene.emitters_dr(), place, active)

    def owns(self, si: SurfaceInteraction) -> Mask:
        return si.is_valid()

    def emitted(self, si: SurfaceInteraction, active: Mask) -> Radiance:
        if len(self.emitters) > 1:
            return si.emitter(self.scene, active).eval(si, active)
        if self.lone_shape is None:
            return self.mi.Spectrum(0)
        here = active & (dr.reinterpret_array(self.mi.UInt32, si.shape) == self.lone_shape)
        return dr.select(here, self.emitters[0].eval(si, here), 0)

    def sample(self, si: SurfaceInteraction, u: Point, index: UInt, active: Mask) -> LightSample:
        emitter = self.emitter(index, active)
        return with_shadow_target(self.surfaces.offsets, si, *self._asked(emitter, index, si, u, active))

    def _asked(
        self, emitter: Emitter, index: UInt, si: SurfaceInteraction, u: Point, active: Mask
    ) -> tuple[DirectionSample, Radiance]:
        """Mitsuba's own sample of a light, or a point sampled uniformly by area if Mitsuba's method is incorrect."""
        if self.by_area is None:
            own: tuple[DirectionSample, Radiance] = emitter.sample_direction(si, u, active)
            return own
        here = dr.gather(self.mi.Bool, self.by_area, index, active)
        ds, weight = emitter.sample_direction(si, u, active & ~here)
        near = area_sample(self.mi, self.on_area(emitter, index, u, here), si)
        near.emitter = ds.emitter = emitter
        sent = self.sent(emitter, near, si, here)
        return dr.select(here, near, ds), dr.select(here & (near.pdf > 0), sent / near.pdf, weight & ~here)

    def sent(self, emitter: Emitter, ds: DirectionSample, si: SurfaceInteraction, active: Mask) -> Radiance:
        """The radiance of a lamp toward `si`, from a point on the lamp."""
        at_light = self.mi.SurfaceInteraction3f(ds, si.wavelengths)
        at_light.wi = at_light.to_local(-ds.d)
        return emitter.eval(at_light, active)

    def pdf(self, hit: LightHit, index: UInt, active: Mask) -> Float:
        emitter = self.emitters[0] if len(self.emitters) == 1 else hit.ds.emitter
        here = self.mi.Bool(False) if self.by_area is None else dr.gather(self.mi.Bool, self.by_area, index, active)
        density = emitter.pdf_direction(hit.it, hit.ds, active & ~here)
        if self.by_area is None:
            return density
        area = self.of_shape(emitter, index, area_density, self.mi.Float(0), hit.ds, here)
        return dr.select(here, per_steradian(area, hit.ds), density)

    # ------------------------------------------------------------------ points on a lamp

    def on_area(self, emitter: Emitter, index: UInt, u: Point, active: Mask) -> PositionSample:
        """Sample a point on a lamp uniformly by area, with two random numbers in [0, 1)."""
        mi = self.mi
        nothing: PositionSample = dr.zeros(mi.PositionSample3f)
        ps = self.of_shape(emitter, index, lambda shape, *args: shape.sample_position(0.0, *args), nothing, u, active)
        if self.spheres is not None:
            ps = with_radial_normal(mi, ps, dr.gather(mi.Vector4f, self.spheres, index, active))
        return ps

    def of_shape(
        self, emitter: Emitter, index: UInt, ask: Callable[..., Answer], nothing: Answer, *args: OfVariant
    ) -> Answer:
        """`ask(shape, *args)` for the shape of a lamp; `nothing` for a lamp without a shape."""
        if len(self.emitters) == 1 or not self.has_instances:
            return ask(self.emitters[0].get_shape() if len(self.emitters) == 1 else emitter.get_shape(), *args)

        # An instance has no area, but a call from the kernel would include it.
        def answer(shape: Shape | None) -> Callable[..., Answer]:
            return lambda *args: nothing if shape is None else ask(shape, *args)

        result: Answer = dr.switch(index, [answer(one.get_shape()) for one in self.emitters], *args)
        return result

    @cached_property
    def has_instances(self) -> bool:
        return any(shape.class_name() == "Instance" for shape in self.scene.shapes())

    @cached_property
    def spheres(self) -> Float | None:
        """The center and radius of each lamp that is a sphere; 0 for other lamps, and None if no lamp is a sphere.

        A negative radius means that the normal points inward.
        """
        mi = self.mi
        rows, read = np.zeros((len(self.emitters), 4)), placement_reader(mi)
        for row, emitter in zip(rows, self.emitters, strict=True):
            shape = emitter.get_shape() if mi.has_flag(emitter.flags(), mi.EmitterFlags.Surface) else None
            if shape is not None and is_sphere(mi, shape):
                to_world = np.array(read(shape)).reshape(4, 4)
                radius = np.linalg.norm(to_world[:3, 0])
                row[:] = *to_world[:3, 3], -radius if shape.has_flipped_normals() else radius
        return own(mi.Float, rows.astype(np.float32).ravel()) if np.any(rows[:, 3]) else None
