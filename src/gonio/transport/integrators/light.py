"""Particle tracing."""

from __future__ import annotations

from types import ModuleType
from typing import ClassVar

import drjit as dr
import numpy as np

from ...bridge.types import Mask, Point, Radiance, Record, Scene, Sensor, SurfaceInteraction, UInt, Vector
from ...errors import InputError
from .. import sampler
from ..lights.sources import INFINITE, POINT, SURFACE, UNMET, Particle
from .base import Settings
from .particles import FIRST_VERTEX, LENS, VERTEX_DIMENSIONS, Flight, Particles
from .sums import Sums
from .transport import Transport

CAMERAS = ("PerspectiveCamera", "ThinLensCamera")  # of Mitsuba's: those that a point in the scene can be seen by

# A splat is counted in units of 2^-32 of the largest radiance that a lamp has: no picture is brighter on the mean, so
# that 2^30 samples fit a word of 64 bits, and a thousandth of a unit is lost nowhere, since chance rounds.
BITS = 32
PROBED = 4096  # points of the lamps, to find that radiance
LARGEST = 58  # bits of one splat; a larger one is left out and counted as no number
DITHER = 0xD1B54A32
NEAREST = 1e-2  # of the scene's size: how near to a lamp that is a point brightness still has a bound


class Light(Transport):
    """Particle tracing from the lamps, seen by the camera at each vertex: the referee of `path`.

    What mirrors and smooth glass show is missing: no particle leaves them toward the camera but by chance. A sample of
    the picture is as many particles as it has pixels. Splats are added up as whole numbers, whose sum does not
    depend on the order.
    """

    name = "light"
    takes_depth = True
    splats: ClassVar[bool] = True

    @classmethod
    def depth(cls, settings: Settings) -> int:
        return settings.max_depth

    def __init__(self, mi: ModuleType, scene: Scene, sensor: Sensor, settings: Settings, aovs: bool):
        super().__init__(mi, scene, sensor, settings, aovs)
        where = f"integrator {self.name}"
        if aovs:
            raise InputError("it has no features for the denoiser", where, "leave out --denoise, or use path")
        if self.ambient is not None:
            raise InputError("ambient light comes from no lamp", where, "leave ambient out, or use path")
        if sensor.class_name() not in CAMERAS:
            what = f"a camera of the kind {sensor.class_name()}, which no point of the scene is connected to"
            raise InputError(what, where, "use a perspective camera, or path")
        if any(value[0] for name, value in mi.traverse(sensor) if name.startswith("principal_point_offset")):
            what = "a camera with a principal point that is not in the middle, which Mitsuba does not project by"
            raise InputError(what, where, "leave it out, or use path")
        self.particles = Particles(self)
        size = sensor.film().crop_size()
        self.pixels = dr.opaque(mi.UInt32, int(size[0]) * int(size[1]))
        self.height = dr.opaque(mi.UInt32, int(size[1]))
        self.far = dr.opaque(mi.Float, 0.5 * float(sensor.far_clip()))
        self.clips = [dr.opaque(mi.Float, float(clip)) for clip in (sensor.near_clip(), sensor.far_clip())]
        self.eye = mi.Point3f(sensor.world_transform() @ mi.Point3f(0.0))
        self.ahead = dr.normalize(mi.Vector3f(sensor.world_transform() @ mi.Vector3f(0.0, 0.0, 1.0)))
        self.unit = 1.0 if not self.lights.count else self._brightest() * 2.0**-BITS
        self.per_unit = dr.opaque(mi.Float64, 1.0 / self.unit)

    def _brightest(self) -> float:
        """A power of two above the largest radiance, of what can be probed of the lamps."""
        mi, sources = self.mi, self.particles.sources
        low = dr.arange(mi.UInt32, PROBED)
        particle, _ = self.particles.leave(self.particles.key(mi.UInt32(0)), low, mi.Bool(True))
        size = dr.square(NEAREST * sources.radius)
        bright = dr.select(particle.kind == POINT, particle.flux / size, particle.flux * particle.density)
        bright = dr.select((particle.kind == INFINITE) & (particle.density >= UNMET), particle.flux, bright)
        values = np.array(dr.max(bright), np.float64)
        values = values[np.isfinite(values)]
        largest = float(values.max()) if len(values) else 0.0
        return float(2.0 ** np.ceil(np.log2(largest))) if largest > 0 else 1.0

    def accumulate(self, pixel: UInt, key: UInt, first: UInt, last: UInt, sums: Sums) -> Sums:
        """Add the splats of samples [first, last) of every lane's particles."""
        mi, particles = self.mi, self.particles
        if not self.lights.count:
            return sums

        def step(index: UInt, invalid: UInt) -> tuple[UInt, UInt]:
            number = mi.UInt64(index) * mi.UInt64(self.pixels) + mi.UInt64(pixel)
            low, key = mi.UInt32(number), particles.key(mi.UInt32(number >> 32))
            particle, flight = particles.leave(key, low, mi.Bool(True))
            invalid += self._see_lamp(key, low, particle, sums)

            def vertex(flight: Flight, invalid: UInt) -> tuple[Flight, UInt]:
                si, bsdf, crossing = particles.arrive(flight)
                bs, weight = particles.scatter(key, low, flight, si, bsdf, crossing)
                at = flight.depth * VERTEX_DIMENSIONS + (FIRST_VERTEX - VERTEX_DIMENSIONS)
                ds, importance = self._camera(key, low, at, si, flight.active)
                toward = si.to_local(ds.d)
                value = particles.sent(si, bsdf, toward, flight.active) * importance
                if crossing is not None:
                    side = dr.select(si.wi.z * toward.z < 0.0, crossing.beyond, crossing.here)
                    value *= self.media.transmitted(side, si, ds.dist) & crossing.surface
                value *= flight.flux * flight.share
                found = self._splat(key, low, sums, ds.uv, value, si, ds.p, flight.active)
                flight = particles.go_on(key, low, flight, si, crossing, bs, weight, flight.active)
                return flight, invalid + found

            state = (flight, invalid)
            state = dr.while_loop(state, lambda f, _: f.active, vertex, mode="symbolic", label="vertices")
            return index + 1, state[1]

        state = (first + dr.zeros(mi.UInt32, dr.width(pixel)), sums.invalid)
        _, invalid = dr.while_loop(state, lambda i, _: i < last, step, mode="symbolic", label="particles")
        return Sums(sums.radiance, sums.features, invalid, sums.splats)

    def _see_lamp(self, key: UInt, low: UInt, particle: Particle, sums: Sums) -> UInt:
        """The lamp itself, as the camera sees it from the point where a particle leaves it."""
        mi = self.mi
        found = mi.UInt32(0)
        if SURFACE in self.particles.sources.known:
            si, here = mi.SurfaceInteraction3f(particle.place), particle.kind == SURFACE
            ds, importance = self._camera(key, low, FIRST_VERTEX - VERTEX_DIMENSIONS, si, here)
            si.wi = si.to_local(ds.d)
            value = particle.emitter.eval(si, here) * particle.seen * importance * abs(si.wi.z)
            found += self._splat(key, low, sums, ds.uv, value, si, ds.p, here)
        if INFINITE in self.particles.sources.known:
            si, here = dr.zeros(mi.SurfaceInteraction3f), particle.kind == INFINITE
            si.p = self.eye - particle.direction * self.far
            si.wavelengths = particle.place.wavelengths
            ds, importance = self._camera(key, low, FIRST_VERTEX - VERTEX_DIMENSIONS, si, here)
            value = particle.seen * importance * dr.square(ds.dist)
            si.p = ds.p  # from the camera into the distance, where no surface is
            found += self._splat(key, low, sums, ds.uv, value, si, None, here, -ds.d)
        return found

    def _camera(self, key: UInt, low: UInt, at: UInt, si: SurfaceInteraction, active: Mask) -> tuple[Record, Radiance]:
        """The way from a point to the camera, and its share of what is sent there."""
        lens = self.mi.Point2f(0.5)
        if self.sensor.needs_aperture_sample():
            lens = self.mi.Point2f(*self.pair(key, low, at + LENS))
        ds, importance = self.sensor.sample_direction(si, lens, active)
        return ds, dr.maximum(importance, 0)  # to Mitsuba's thin lens what is behind it sends less than nothing

    def _splat(
        self,
        key: UInt,
        low: UInt,
        sums: Sums,
        uv: Point,
        value: Radiance,
        si: SurfaceInteraction,
        eye: Point | None,
        active: Mask,
        away: Vector | None = None,
    ) -> UInt:
        """Add to the pixel at `uv` what arrives there; 1 where that is no number.

        eye   what `si` must see; None where it must see the infinite, in the direction `away`
        """
        mi = self.mi
        x, y = mi.Int32(dr.floor(uv.x)), mi.Int32(dr.floor(uv.y))
        active = active & (x >= 0) & (y >= 0) & (x < mi.Int32(self.width)) & (y < mi.Int32(self.height))
        active &= dr.any(value != 0)
        near, far = self.clips
        if eye is not None:
            depth = dr.dot(si.p - eye, self.ahead)
            active &= (depth >= near) & (depth <= far)
            active = self.unoccluded(si, eye + (si.p - eye) * (near / depth), active)
        else:
            ahead = dr.maximum(dr.dot(away, self.ahead), 1e-6)
            ray = mi.Ray3f(si.p + away * (near / ahead), away)
            ray.maxt = (far - near) / ahead
            active &= ~self.surfaces.blocked(ray, active)
        place = mi.UInt32(y) * self.width + mi.UInt32(x)
        dither = mi.Float64(sampler.independent_pair(key, low, place ^ DITHER)[0])
        colour = [mi.Float64(v) * self.per_unit for v in self.rgb(value, si.wavelengths)]
        countable = abs(colour[0]) + abs(colour[1]) + abs(colour[2]) < 2.0**LARGEST  # nor is it so for NaN
        for target, v in zip(sums.splats, colour, strict=True):
            dr.scatter_add(target, mi.Int64(dr.floor(v + dither)), place, active & countable)
        return dr.select(active & ~countable, mi.UInt32(1), 0)
