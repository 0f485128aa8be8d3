"""Particle tracing."""

from __future__ import annotations

from typing import ClassVar

import drjit as dr

from ...bridge.types import UInt
from ..particles import Flight, Particles
from ..scene_data import SceneData
from ..splats import Splat, SplatCamera
from ..sums import Sums
from .base import Settings
from .light_transport import LightTransport


class Light(LightTransport):
    """Particle tracing from the lamps, with every vertex connected to the camera: a reference for `path`.

    Light that leaves mirrors and smooth glass toward the camera is missing, because their vertices cannot be connected
    to the camera. One sample per pixel means as many particles as the picture has pixels. Splats are accumulated as
    integers, so the sum does not depend on their order.
    """

    name = "light"
    takes_depth = True
    splats: ClassVar[bool] = True

    def __init__(self, data: SceneData, settings: Settings) -> None:
        super().__init__(data, settings)
        SplatCamera.check(data, f"integrator {self.name}")
        self.particles = Particles(data, settings.seed, self.max_depth)
        self.camera = SplatCamera(data, self.particles)
        self.unit = self.camera.unit

    @classmethod
    def depth(cls, settings: Settings) -> int:
        return settings.max_depth

    def accumulate(self, pixel: UInt, key: UInt, first: UInt, last: UInt, sums: Sums) -> Sums:
        """Trace samples [first, last), which are particles, on every lane, and add their splats."""
        if not self.lights.count:
            return sums

        def sample(index: UInt, invalid: UInt) -> tuple[UInt, UInt]:
            """Trace one particle per lane, from its lamp to the end of its path."""
            key, low = self.particles.number(index, pixel, self.camera.pixels)
            particle, flight = self.particles.leave(key, low)
            invalid += self.camera.see_lamp(key, low, particle, sums)
            state = dr.while_loop(
                (flight, invalid),
                lambda flight, _: flight.active,
                lambda flight, invalid: self.step(flight, invalid, key, low, sums),
                mode="symbolic",
                label="vertices",
            )
            return index + 1, state[1]

        state = (first + dr.zeros(self.mi.UInt32, dr.width(pixel)), sums.invalid)
        _, invalid = dr.while_loop(state, lambda i, _: i < last, sample, mode="symbolic", label="particles")
        return Sums(sums.radiance, sums.features, invalid, sums.splats)

    def step(self, flight: Flight, invalid: UInt, key: UInt, low: UInt, sums: Sums) -> tuple[Flight, UInt]:
        """Process one vertex of a particle: connect it to the camera, then continue to the next surface."""
        particles, camera, active = self.particles, self.camera, flight.active
        vertex = particles.intersect(flight)
        bs, weight = particles.sample_bsdf(key, low, flight, vertex)

        # The connection to the camera
        ds, importance = camera.sample_direction(key, low, flight.dimension, vertex.si, active)
        value = particles.eval_bsdf(vertex, vertex.si.to_local(ds.d), active) * importance
        value = particles.through_media(vertex, value, ds)
        value *= flight.flux * flight.throughput
        result = camera.splat(key, low, sums, Splat(ds.uv, value, vertex.si, ds.p), active)

        # The next surface in the sampled direction
        return particles.follow(key, low, flight, vertex, bs, weight, active), invalid + result
