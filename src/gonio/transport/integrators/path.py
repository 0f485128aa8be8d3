"""Path tracing."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import drjit as dr

from ...bridge.types import Float, UInt
from .. import advice
from ..scene_data import SceneData
from ..sums import Sums
from .base import Settings
from .light_transport import LightTransport, PathState


class Path(LightTransport):
    """Path tracing with light and BSDF sampling at every vertex (max_depth - 1 shaded vertices)."""

    name = "path"
    takes_depth = True
    plays_roulette: ClassVar[bool] = True

    def __init__(self, data: SceneData, settings: Settings) -> None:
        super().__init__(data, settings)
        depth = self.depth(settings)
        # The last ray can only contribute emission. If there is only one bounce, or if the only lamp is a rectangle,
        # the vertex before it adds this light (`light_along`). Otherwise, media may attenuate it, or any of several
        # lights may be the first hit, and it is treated like the other rays; a separate case would add a second ray and
        # its surface to each vertex.
        self.last_ray_apart = not self.media.known and (depth <= 2 or self.lights.shortens_last_ray)
        # paths with one vertex do not need a loop over vertices; `Integrator.accumulate` loops only over samples
        self.one_bounce = (depth <= 2 and self.last_ray_apart) or not (self.samples_lobes or self.smooth)

    @classmethod
    def depth(cls, settings: Settings) -> int:
        return settings.max_depth

    def advice(self) -> str:
        return advice.on_small_lights(self.data) if self.settings.max_depth > 2 else ""

    def accumulate(self, pixel: UInt, key: UInt, first: UInt, last: UInt, sums: Sums) -> Sums:
        """Add samples [first, last) of every pixel to the sums, in a single loop over the vertices of all samples.

        If a path ends, its lane starts the next path at once instead of waiting until the longest of the 16 paths in
        the vector has ended.
        """
        if self.one_bounce:
            return super().accumulate(pixel, key, first, last, sums)

        def step(index: UInt, path: PathState, sums: Sums) -> tuple[UInt, PathState, Sums]:
            begins = ~path.active
            path = dr.select(begins, self.camera_path(pixel, key, index, begins), path)
            path, features = self.bounce(path, key)
            ended = ~path.active
            sums = sums.add([*self.data.rgb(path.radiance, path.ray.wavelengths)], ended, features, begins)
            return index + dr.select(ended, self.mi.UInt32(1), 0), path, sums

        state = (first + dr.zeros(self.mi.UInt32, dr.width(pixel)), self.idle_path(), sums)
        return dr.while_loop(state, lambda index, *_: index < last, step, mode="symbolic", label="vertices")[2]

    def bounce(self, path: PathState, key: UInt) -> tuple[PathState, list[Float]]:
        """Add the emission of the surface that the ray has hit and its direct illumination, and trace the next ray."""
        vertex, throughput = self.intersect(path)
        radiance = path.radiance + throughput * self.emitted(path, vertex)
        active = path.active & vertex.si.is_valid() & (path.depth + 1 < self.max_depth)
        throughput, hero_only = self.keep_hero(path, vertex, throughput, active)

        # Light sampling. `sample_bsdf` evaluates the BSDF toward the light and samples the next direction in one call.
        u = self.numbers(path, key)
        light = self.sample_light(vertex, u, active)
        value, bsdf_pdf, bs, weight = self.sample_bsdf(vertex, light, u, active)
        radiance = radiance + throughput * self.direct_light(vertex, light, value, bsdf_pdf, active)
        if self.ambient is not None:
            radiance = radiance + throughput * self.ambient_light(vertex, active)

        # The next ray, in the sampled direction. The next vertex adds the emission along it.
        throughput = throughput * weight
        features = self.data.features(throughput, vertex.si, path.active, active)
        path = replace(path, throughput=throughput, radiance=radiance, hero_only=hero_only)
        path = self.spawn(path, vertex, bs, light, active)
        if self.plays_roulette:
            path = self.roulette(path, u)
        if self.last_ray_apart:
            last = path.depth + 1 >= self.max_depth
            radiance = path.radiance + self.light_along(path, path.active & last)
            path = replace(path, radiance=radiance, active=path.active & ~last)
        return self.trace(path), features
