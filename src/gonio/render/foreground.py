"""Surfaces without their background: radiance and coverage, for comparing with a picture that a GPU draws.

    >>> render = Foreground(balls, Settings("direct"), lights=lamps)
    >>> render.advance(16)
    >>> render.image()              # (height, width, 4): light of the surfaces alone, and the share of the pixel

The lights may stand in a scene of their own. Then each point of a surface sees all of them with nothing in between: no
shadow ray is traced, and no surface lights another. That is what a shader computes that knows one point, and it is
physically what would be seen if every surface stood alone and were convex.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import drjit as dr
import numpy as np

from ..errors import InputError
from .integrators import Render, Settings, Transport
from .lights import Lights


class Foreground(Render):
    """A render whose camera sees surfaces only, neither lights nor environment.

    scene   the surfaces
    lights  a scene that holds the lights alone; None where they stand among the surfaces, with all shadows
    """

    features = 1

    def __init__(self, scene: Any, settings: Settings, sensor: Any = None, lights: Any = None):
        if settings.integrator in ("normal", "uv"):
            raise InputError(f"'{settings.integrator}' shows no light", "integrator", "give one that does")
        if lights is not None and settings.integrator == "path":
            raise InputError("paths meet other surfaces", "integrator", "give direct, or put the lights in the scene")
        self._lights = lights
        super().__init__(scene, settings, sensor)

    def _program(self, mi: Any) -> Transport:
        return _Foreground(mi, self.scene, self.sensor, self.settings, self._lights)

    def image(self) -> np.ndarray:
        """(height, width, 4) float32: linear RGB, averaged over the whole pixel, and coverage; row 0 on top."""
        sums = self._sums
        nothing = [np.zeros(1)]
        return self._mean([*sums.near[0:3], sums.near[3]], [*sums.far, *nothing])


class _Foreground(Transport):
    """The program of `Foreground`."""

    def __init__(self, mi: Any, scene: Any, sensor: Any, settings: Settings, lights: Any):
        super().__init__(mi, scene, sensor, settings, aovs=False)
        self.alone = lights is not None
        if self.alone:
            self.lights = _Transparent(mi, lights)

    def begin(self, pixel: Any, key: Any, index: Any) -> tuple[Any, list[Any]]:
        """As the base's, for lanes that meet a surface; the feature is 1 there."""
        path = self.first(pixel, key, index)
        met = path.hit.is_valid()
        path = self.extend(dataclasses.replace(path, active=met), key, [])
        return path, [*self.rgb(path.radiance, path.ray.wavelengths), dr.select(met, self.mi.Float(1), 0)]

    def unoccluded(self, si: Any, point: Any, active: Any) -> Any:
        """All lights are in sight where they stand apart."""
        return active if self.alone else super().unoccluded(si, point, active)


class _Transparent(Lights):
    """Lights that do not hide each other: a ray meets every lamp on its way, and the environment behind them.

    Light sampling traces no shadow ray here, so what a sampled direction finds must not be hidden either.
    """

    def last_hit(self, ray: Any, solid_angle: Any, active: Any, weigh: Callable[[Any, Any], Any]) -> Any:
        """The sum over all lights on the ray, each weighed with its own density."""
        if self.rectangle is not None or self.count == 0:
            return super().last_hit(ray, solid_angle, active, weigh)
        mi, origin = self.mi, ray.o
        found, still = mi.Spectrum(0), active
        for _ in self.scene.shapes():
            si = self.scene.ray_intersect(ray, mi.RayFlags.All, False, still)
            still = still & si.is_valid()
            found += self._arriving(origin, si, solid_angle, still, weigh)
            ray = si.spawn_ray(ray.d)
        if self.has_environment:
            beyond = dr.zeros(mi.SurfaceInteraction3f)
            beyond.t, beyond.wi, beyond.wavelengths = dr.inf, -ray.d, ray.wavelengths
            found += self._arriving(origin, beyond, solid_angle, active, weigh)
        return found

    def _arriving(self, origin: Any, si: Any, solid_angle: Any, active: Any, weigh: Callable[[Any, Any], Any]) -> Any:
        radiance = dr.select(active, self.emitted(si, active), 0)
        pdf = self.pdf(origin, solid_angle, si, active & dr.any(radiance != 0))
        return dr.select(active, weigh(radiance, pdf), 0)
