"""The camera for particle tracing: connects points of the scene to pixels, and adds their light to these pixels."""

from __future__ import annotations

from typing import NamedTuple

import drjit as dr
import numpy as np

from ..bridge.faults.thin_lens_importance import camera_sample
from ..bridge.types import Mask, Point, Radiance, Record, SurfaceInteraction, UInt, Vector
from ..errors import InputError
from . import sampler
from .lights.sources import DELTA_DENSITY, INFINITE, POINT, SURFACE, Particle
from .particles import FIRST_VERTEX, LENS, VERTEX_DIMENSIONS, Particles
from .scene_data import SceneData
from .sums import Sums

CAMERAS = ("PerspectiveCamera", "ThinLensCamera")  # Mitsuba's cameras to which points of the scene can be connected

# The unit of splats is 2^-32 of the largest radiance of a lamp. No picture is brighter on average, so 2^30 samples fit
# into a 64-bit integer; random rounding makes the sum unbiased.
BITS = 32
PROBED = 4096  # number of points on the lamps at which this radiance is estimated
MAX_BITS = 58  # number of bits of a splat; a larger splat is skipped and counted as invalid
DITHER = 0xD1B54A32
NEAREST = 1e-2  # smallest distance from a point light, relative to the scene's size, which bounds its brightness
AT_LAMP = FIRST_VERTEX - VERTEX_DIMENSIONS  # dimension of the connection from the lamp itself


class Splat(NamedTuple):
    """The light that reaches the camera from a point of the scene.

    uv     position on the film, pixels
    value  radiance
    si     the point from which the light comes
    eye    the point that must be visible from `si`; None for a point at infinity in the direction `away`
    """

    uv: Point
    value: Radiance
    si: SurfaceInteraction
    eye: Point | None
    away: Vector | None = None


class SplatCamera:
    """The camera of a picture that consists of splats.

    unit  radiance that corresponds to an increment of 1, because splats are added as integers
    """

    def __init__(self, data: SceneData, particles: Particles) -> None:
        mi, sensor = data.mi, data.sensor
        self.mi, self.data, self.sensor, self.particles = mi, data, sensor, particles
        size = sensor.film().crop_size()
        self.pixels = dr.opaque(mi.UInt32, int(size[0]) * int(size[1]))
        self.width, self.height = data.camera.width, dr.opaque(mi.UInt32, int(size[1]))
        self.far = dr.opaque(mi.Float, 0.5 * float(sensor.far_clip()))
        self.clips = [dr.opaque(mi.Float, float(clip)) for clip in (sensor.near_clip(), sensor.far_clip())]
        self.eye = mi.Point3f(sensor.world_transform() @ mi.Point3f(0.0))
        self.ahead = dr.normalize(mi.Vector3f(sensor.world_transform() @ mi.Vector3f(0.0, 0.0, 1.0)))
        self.unit = 1.0 if not data.lights.count else self._brightest() * 2.0**-BITS
        self.per_unit = dr.opaque(mi.Float64, 1.0 / self.unit)

    @staticmethod
    def check(data: SceneData, location: str) -> None:
        """Raise InputError, which names `location`, if particle tracing cannot render the requested picture."""
        sensor = data.sensor
        if data.aovs:
            hint = "leave out --denoise, or use path"
            raise InputError("this integrator has no features for the denoiser", location, hint)
        if data.ambient is not None:
            raise InputError("ambient light is not emitted by a lamp", location, "leave ambient out, or use path")
        if sensor.class_name() not in CAMERAS:
            what = f"particles cannot be connected to a camera of type {sensor.class_name()}"
            raise InputError(what, location, "use a perspective camera, or path")
        if any(value[0] for name, value in data.mi.traverse(sensor) if name.startswith("principal_point_offset")):
            what = "the camera has a principal point offset, which Mitsuba does not support for particles"
            raise InputError(what, location, "leave it out, or use path")

    def _brightest(self) -> float:
        """A power of two that exceeds the radiance at all sampled points of the lamps."""
        mi, sources = self.mi, self.particles.sources
        low = dr.arange(mi.UInt32, PROBED)
        particle, _ = self.particles.leave(self.particles.key(mi.UInt32(0)), low)
        size = dr.square(NEAREST * sources.radius)
        bright = dr.select(particle.kind == POINT, particle.flux / size, particle.flux * particle.density)
        bright = dr.select((particle.kind == INFINITE) & (particle.density >= DELTA_DENSITY), particle.flux, bright)
        values = np.array(dr.max(bright), np.float64)
        values = values[np.isfinite(values)]
        largest = float(values.max()) if len(values) else 0.0
        return float(2.0 ** np.ceil(np.log2(largest))) if largest > 0 else 1.0

    def see_lamp(self, key: UInt, low: UInt, particle: Particle, sums: Sums) -> UInt:
        """Add the light that the lamp sends directly to the camera from the point where a particle leaves it.

        Returns the result of `splat`.
        """
        mi = self.mi
        invalid = mi.UInt32(0)
        if SURFACE in self.particles.sources.known:
            si, here = mi.SurfaceInteraction3f(particle.place), particle.kind == SURFACE
            ds, importance = self.sample_direction(key, low, AT_LAMP, si, here)
            si.wi = si.to_local(ds.d)
            value = particle.emitter.eval(si, here) * particle.direct_weight * importance * abs(si.wi.z)
            invalid += self.splat(key, low, sums, Splat(ds.uv, value, si, ds.p), here)
        if INFINITE in self.particles.sources.known:
            si, here = dr.zeros(mi.SurfaceInteraction3f), particle.kind == INFINITE
            si.p = self.eye - particle.direction * self.far
            si.wavelengths = particle.place.wavelengths
            ds, importance = self.sample_direction(key, low, AT_LAMP, si, here)
            value = particle.direct_weight * importance * dr.square(ds.dist)
            si.p = ds.p  # the shadow ray runs from the camera to infinity
            invalid += self.splat(key, low, sums, Splat(ds.uv, value, si, None, -ds.d), here)
        return invalid

    def sample_direction(
        self, key: UInt, low: UInt, dimension: UInt | int, si: SurfaceInteraction, active: Mask
    ) -> tuple[Record, Radiance]:
        """A direction sample from a point to the camera, and its importance."""
        lens = self.mi.Point2f(0.5)
        if self.sensor.needs_aperture_sample():
            lens = self.mi.Point2f(*self.data.pair(key, low, dimension + LENS))
        return camera_sample(self.sensor, si, lens, active)

    def splat(self, key: UInt, low: UInt, sums: Sums, light: Splat, active: Mask) -> UInt:
        """Add light to its pixel. Returns 1 if its value is not finite or too large, otherwise 0."""
        mi, si, eye = self.mi, light.si, light.eye
        x, y = mi.Int32(dr.floor(light.uv.x)), mi.Int32(dr.floor(light.uv.y))
        active = active & (x >= 0) & (y >= 0) & (x < mi.Int32(self.width)) & (y < mi.Int32(self.height))
        active &= dr.any(light.value != 0)
        near, far = self.clips
        if eye is not None:
            depth = dr.dot(si.p - eye, self.ahead)
            active &= (depth >= near) & (depth <= far)
            active = self.data.visible(si, eye + (si.p - eye) * (near / depth), active)
        else:
            assert light.away is not None, "given without an eye"
            ahead = dr.maximum(dr.dot(light.away, self.ahead), 1e-6)
            ray = mi.Ray3f(si.p + light.away * (near / ahead), light.away)
            ray.maxt = (far - near) / ahead
            active &= ~self.data.surfaces.blocked(ray, active)
        place = mi.UInt32(y) * self.width + mi.UInt32(x)
        dither = mi.Float64(sampler.independent_pair(key, low, place ^ DITHER)[0])
        color = [mi.Float64(v) * self.per_unit for v in self.data.rgb(light.value, si.wavelengths)]
        countable = abs(color[0]) + abs(color[1]) + abs(color[2]) < 2.0**MAX_BITS  # False for NaN as well
        for target, v in zip(sums.splats, color, strict=True):
            dr.scatter_add(target, mi.Int64(dr.floor(v + dither)), place, active & countable)
        return dr.select(active & ~countable, mi.UInt32(1), 0)
