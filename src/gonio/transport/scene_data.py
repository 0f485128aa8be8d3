"""The scene data for the kernels of a render, in one object that is passed to the integrator."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from types import ModuleType

import drjit as dr

from ..bridge.adapter.variant import DISPERSES
from ..bridge.faults.shadow_ray_gap import shadow_ray_to
from ..bridge.types import (
    Color,
    Float,
    Hit,
    Mask,
    Point,
    Radiance,
    Ray,
    Scene,
    Sensor,
    Shape,
    SurfaceInteraction,
    Texture,
    UInt,
)
from . import sampler
from .camera import Camera
from .lights.lights import Lights
from .media import Media
from .scattering import Scattering, Vertex
from .surfaces import Surfaces

# The integral of the CIE 1931 luminosity curve, as tabulated by Mitsuba (nm). Dividing by it gives a white of radiance
# 1 the luminance Y = 1.
CIE_Y_INTEGRAL = 106.7502593994140625


class SceneData:
    """The parts of a scene that integrators use. Lights and media are prepared on first use.

    pair, direction_pair  functions of the sampler that return two numbers in [0, 1) for (key, index, dimension): `pair`
                          for positions on pixels and lamps, `direction_pair` for directions
    camera      generates rays through pixels
    surfaces    intersects rays with surfaces
    media       absorption between surfaces
    lights      the light sources
    scattering  evaluates and samples BSDFs
    aovs        whether the albedo and the normal of the first hit are needed for the denoiser

    sampler_name      a name in `sampler.SAMPLERS`, or "default"
    ambient_color     ambient radiance of the scene; None or 0 for no ambient light
    mis_compensation  whether BSDFs are sampled too, so that the density of an environment map can omit its uniform part
    """

    def __init__(
        self,
        mi: ModuleType,
        scene: Scene,
        sensor: Sensor,
        sampler_name: str = "default",
        ambient_color: Sequence[float] | None = None,
        mis_compensation: bool = True,
        aovs: bool = False,
    ) -> None:
        self.mi, self.scene, self.sensor, self.aovs = mi, scene, sensor, aovs
        self._ambient_color, self._mis_compensation = ambient_color, mis_compensation
        names = sampler.DEFAULT if sampler_name == "default" else [sampler_name] * 2
        self.pair, self.direction_pair = (sampler.PAIRS[name] for name in names)
        self.surfaces = Surfaces(mi, scene)
        self.camera = Camera(mi, sensor, self.pair)

    @cached_property
    def media(self) -> Media:
        return Media(self.mi, self.scene)

    @cached_property
    def scattering(self) -> Scattering:
        return Scattering(self.mi, self.media)

    @cached_property
    def lights(self) -> Lights:
        return Lights(self.mi, self.scene, self.surfaces, self._mis_compensation)

    @cached_property
    def ambient(self) -> Texture | None:
        """The ambient radiance as a texture; None if no BSDF has the attribute "ambient", its ambient reflectance."""
        color = self._ambient_color
        if color is None or not any(color):
            return None
        if not any(dr.any(shape.bsdf().has_attribute("ambient")) for shape in self.scene.shapes()):
            return None
        # An rgb texture is a reflectance, clamped to 1. Multiplied by d65, it is a radiance, also in spectral variants.
        scale = max(color)
        tint = {"type": "rgb", "value": [c / scale for c in color]}
        return self.mi.load_dict({"type": "d65", "color": tint, "scale": scale})

    @cached_property
    def smooth(self) -> list[Shape]:
        """The shapes that have a delta lobe, such as mirrors and smooth glass."""
        mi = self.mi
        return [shape for shape in self.scene.shapes() if mi.has_flag(shape.bsdf().flags(), mi.BSDFFlags.Delta)]

    @cached_property
    def disperses(self) -> bool:
        """Whether the index of refraction of a material depends on the wavelength."""
        return any(shape.bsdf().flags() & DISPERSES for shape in self.scene.shapes())

    @cached_property
    def media_at_camera(self) -> UInt:
        """The media in which camera rays begin, in the encoding of `Media`."""
        mi = self.mi
        if not self.media.known:
            return mi.UInt32(0)
        return self.media.containing(mi.Point3f(self.sensor.world_transform() @ mi.Point3f(0.0)))

    # ------------------------------------------------------------------ used by integrators

    def first_hit(
        self, pixel: UInt, key: UInt, index: UInt, active: Mask = True, wavelength: Float | None = None
    ) -> tuple[Ray, Radiance, Hit]:
        """The camera ray of a sample, its weight, and its first hit."""
        ray, weight = self.camera.ray(pixel, key, index, wavelength)
        ray = self.mi.Ray3f(ray)
        return ray, weight, self.surfaces.nearest(ray, active)

    def begins_path(self, hit: Hit) -> Mask:
        """Whether a camera ray that ends at `hit` begins a path. This is always true except in `foreground.py`."""
        return self.mi.Bool(True)

    def vertex(self, hit: Hit, ray: Ray, inside: UInt, throughput: Radiance, active: Mask) -> tuple[Vertex, Radiance]:
        """The surface at a hit, and the throughput there after absorption by the media that contain the ray."""
        si = self.surfaces.interaction(hit, ray, active)
        vertex = Vertex(si, si.bsdf(ray))
        if self.media.known:
            here = active & si.is_valid()
            throughput = dr.select(here, throughput * self.media.transmitted(inside, si, si.t), throughput)
            vertex.crossing = self.media.crossing(si, vertex.bsdf, inside, here)
            # passes the index of refraction outside to `bridge.adapter.plugin`, which has no other access to the media
            si.duv_dx = self.mi.Vector2f(vertex.crossing.outer - 1.0, 0.0)
        return vertex, throughput

    def visible(self, si: SurfaceInteraction, point: Point, active: Mask) -> Mask:
        """Whether `point`, which must not lie on a surface, is visible from `si`; False on inactive lanes."""
        return active & ~self.surfaces.blocked(shadow_ray_to(self.surfaces.offsets, si, point), active)

    def features(self, throughput: Radiance, si: SurfaceInteraction, alive: Mask, active: Mask) -> list[Float]:
        """The features at the first vertex of a sample, which are averaged like its color: albedo and normal if needed.

        throughput  throughput of the ray that the BSDF has sampled at the vertex
        alive       lanes with a path
        active      lanes whose path has hit a surface at the vertex
        """
        if not self.aovs:
            return []
        values = (*self.rgb(throughput, si.wavelengths), *si.sh_frame.n)
        return [dr.select(active, value, 0) for value in values]

    def rgb(self, radiance: Radiance, wavelengths: Sequence[Float]) -> Color:
        """Convert radiance at the wavelengths of a sample to linear RGB."""
        mi = self.mi
        if mi.is_spectral:
            responses = [mi.cie1931_xyz(wavelength) * r for wavelength, r in zip(wavelengths, radiance, strict=True)]
            return mi.xyz_to_srgb(sum(responses) / (len(responses) * CIE_Y_INTEGRAL))
        if mi.is_monochromatic:
            return mi.Color3f(radiance[0])
        return radiance
