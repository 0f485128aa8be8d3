"""Direct illumination by light and BSDF sampling."""

from __future__ import annotations

from dataclasses import replace

import drjit as dr

from ...bridge.types import Float, Mask, UInt
from ..sums import Sums
from .light_transport import LightTransport, PathState


class Direct(LightTransport):
    """Direct illumination by light and BSDF sampling (multiple importance sampling)."""

    name = "direct"

    def accumulate(self, pixel: UInt, key: UInt, first: UInt, last: UInt, sums: Sums) -> Sums:
        """Add samples [first, last) of every pixel to the sums."""

        def step(index: UInt, sums: Sums) -> tuple[UInt, Sums]:
            path, features = self.bounce(self.camera_path(pixel, key, index), key)
            every: Mask = self.mi.Bool(True)
            sums = sums.add([*self.data.rgb(path.radiance, path.ray.wavelengths)], every, features, every)
            return index + 1, sums

        state = (first + dr.zeros(self.mi.UInt32, dr.width(pixel)), sums)
        return dr.while_loop(state, lambda index, _: index < last, step, mode="symbolic", label="samples")[1]

    def bounce(self, path: PathState, key: UInt) -> tuple[PathState, list[Float]]:
        """Add the emission of the surface that the camera ray has hit, and the direct light that it reflects."""
        vertex, throughput = self.intersect(path)
        radiance = path.radiance + throughput * self.emitted(path, vertex)
        active = path.active & vertex.si.is_valid()
        throughput, hero_only = self.keep_hero(path, vertex, throughput, active)

        # Light sampling; the same call of the BSDF also samples a direction.
        u = self.numbers(path, key)
        light = self.sample_light(vertex, u, active) if self.samples_lights else None
        value, bsdf_pdf, bs, weight = self.sample_bsdf(vertex, light, u, active)
        radiance = radiance + throughput * self.direct_light(vertex, light, value, bsdf_pdf, active)
        if self.ambient is not None:
            radiance = radiance + throughput * self.ambient_light(vertex, active)

        # BSDF sampling: the light in the sampled direction.
        throughput = throughput * weight
        features = self.data.features(throughput, vertex.si, path.active, active)
        path = replace(path, throughput=throughput, radiance=radiance, hero_only=hero_only)
        path = self.spawn(path, vertex, bs, light, active)
        radiance = path.radiance + self.light_along(path, path.active)
        return replace(path, radiance=radiance, active=self.mi.Bool(False)), features
