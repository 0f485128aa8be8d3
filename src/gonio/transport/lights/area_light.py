"""The Mitsuba plugin `gonio_area`: a light that emits from both sides of any shape."""

from __future__ import annotations

from types import ModuleType

import drjit as dr

from ...bridge import plugin_search
from ...bridge.faults.missing_texture import emissive_texture
from ...bridge.types import (
    DirectionSample,
    Float,
    Interaction,
    Mask,
    OfVariant,
    Plugin,
    Point,
    Properties,
    Radiance,
    Record,
    SurfaceInteraction,
    TraversalCallback,
)
from .directions import area_density, area_sample, direction_sample, per_steradian
from .solid_angles import Ball, Rectangle, SphericalCap, SphericalRectangle, is_rectangle, is_sphere


def register(mi: ModuleType) -> None:
    """Register `gonio_area` with the current variant of Mitsuba. Calling it again has no effect.

    The plugin is used as the `emitter` of any shape:

        {"type": "rectangle", "emitter": {"type": "gonio_area", "radiance": {"type": "rgb", "value": [50, 50, 50]}}}

    radiance  emitted radiance, W/(m^2 sr), which is the same in all directions on **both** sides: an rgb, a spectrum or
              a texture

    tag       an arbitrary string. Mitsuba's loader merges Python plugins with equal properties, and then rejects an
              emitter that belongs to two shapes. Lamps with equal radiance therefore require different tags, or
              `load_dict(..., optimize=False)`

    Rectangles and spheres are sampled by solid angle, other shapes by area. The plugin does not support light tracing,
    because `sample_ray` is missing.
    """
    if mi.variant() not in _registered:
        _registered.add(mi.variant())
        plugin_search.register(mi.register_emitter, "gonio_area", _light_class(mi))


def _light_class(mi: ModuleType) -> OfVariant:
    """The emitter class for the current variant."""
    base: Plugin = mi.Emitter

    class TwoSidedAreaLight(base):
        two_sided = True

        def __init__(self, properties: Properties):
            base.__init__(self, properties)
            self.radiance = emissive_texture(properties, "radiance", "gonio_area.radiance")
            properties.get("tag", "")
            varying = mi.EmitterFlags.SpatiallyVarying if self.radiance.is_spatially_varying() else 0
            self.m_flags = mi.EmitterFlags.Surface | varying

        def eval(self, si: SurfaceInteraction, active: Mask = True) -> Radiance:
            return dr.select(active, self.radiance.eval(si, active), 0)

        def sample_direction(
            self, it: Interaction, sample: Point, active: Mask = True
        ) -> tuple[DirectionSample, Radiance]:
            shape = self.get_shape()
            if is_rectangle(mi, shape):
                ds = direction_sample(mi, SphericalRectangle(Rectangle.of(mi, shape), it.p), sample, it)
            elif is_sphere(mi, shape):  # Mitsuba's samples have a wrong uv and are too bright for small spheres
                ds = direction_sample(mi, SphericalCap(mi, Ball.of(mi, shape), it.p), sample, it)
            else:  # Mitsuba's sampling of meshes omits points whose normals face away
                ds = area_sample(mi, shape.sample_position(it.time, sample, active), it)
            active = mi.Bool(active) & (ds.pdf > 0)
            ds.emitter = mi.EmitterPtr(self)
            si = mi.SurfaceInteraction3f(ds, it.wavelengths)
            return ds, dr.select(active, self.radiance.eval(si, active) / ds.pdf, 0)

        def pdf_direction(self, it: Interaction, ds: DirectionSample, active: Mask = True) -> Float:
            shape = self.get_shape()
            cosine = dr.abs(dr.dot(ds.d, ds.n))
            if is_rectangle(mi, shape):
                pdf = SphericalRectangle(Rectangle.of(mi, shape), it.p).pdf(ds.dist, cosine)
            elif is_sphere(mi, shape):
                pdf = SphericalCap(mi, Ball.of(mi, shape), it.p).pdf(ds.dist, cosine)
            else:
                pdf = per_steradian(area_density(shape, ds, active), ds)
            return dr.select(active & (cosine > 0), pdf, 0)

        def eval_direction(self, it: Interaction, ds: DirectionSample, active: Mask = True) -> Radiance:
            return self.radiance.eval(mi.SurfaceInteraction3f(ds, it.wavelengths), active)

        def bbox(self) -> Record:
            return self.get_shape().bbox()

        def traverse(self, callback: TraversalCallback) -> None:
            callback.put("radiance", self.radiance, mi.ParamFlags.Differentiable)

        def to_string(self) -> str:
            return f"TwoSidedAreaLight[radiance = {self.radiance}]"

    return TwoSidedAreaLight


_registered: set[str] = set()
