"""Render surfaces without a background, as radiance and coverage, for comparison with a picture drawn by a GPU.

    >>> render = Foreground(balls, Settings("direct"), lights=lamps)
    >>> render.advance(16)
    >>> render.image()              # (height, width, 4): light from the surfaces only, and coverage

The lights may be in a separate scene. In this case, every point of a surface is lit by all lights without occlusion: no
shadow rays are traced, and surfaces do not illuminate each other. A fragment shader computes the same. The result is
physically correct if there is only one surface and it is convex.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from ..bridge.types import Float, Hit, Mask, Point, Radiance, Ray, Scene, Sensor, SurfaceInteraction
from ..errors import InputError
from .integrators import Integrator, LightTransport, Render, Settings
from .lights.lights import Lights
from .scene_data import SceneData


class Foreground(Render):
    """A render in which the camera sees only surfaces, but neither lights nor the environment.

    scene   scene with the surfaces
    lights  scene with only the lights; None if the lights are in `scene`, where surfaces cast shadows
    """

    features = 1

    def __init__(self, scene: Scene, settings: Settings, sensor: Sensor | None = None, lights: Scene | None = None):
        program = settings.program
        if not issubclass(program, LightTransport):
            raise InputError(f"'{settings.integrator}' computes no light", "integrator", "use path or direct")
        if lights is not None and program.depth(settings) > 2:
            hint = "use direct, or put the lights in the scene"
            raise InputError("separate lights need paths of one vertex", "integrator", hint)
        self._lights = lights
        super().__init__(scene, settings, sensor)

    def _integrator_of(self, data: Callable[..., SceneData] = SceneData) -> Integrator:
        return super()._integrator_of(_SurfacesOnly if self._lights is None else partial(_LightsApart, self._lights))

    def image(self) -> NDArray[np.float32]:
        """The picture: linear RGB, averaged over the whole pixel, and coverage, (height, width, 4), float32.

        Row 0 is on top.
        """
        return self._mean([*self._sums.radiance, *self._sums.features])


class _SurfacesOnly(SceneData):
    """A scene in which paths begin only at surfaces. The feature is the coverage, 1 if a surface is hit."""

    def begins_path(self, hit: Hit) -> Mask:
        return hit.is_valid()

    def features(self, throughput: Radiance, si: SurfaceInteraction, alive: Mask, active: Mask) -> list[Float]:
        return [dr.select(alive, self.mi.Float(1), 0)]


class _LightsApart(_SurfacesOnly):
    """A scene in which paths begin only at surfaces, lit without occlusion by the lights of another scene, `apart`."""

    def __init__(self, apart: Scene, *parts: Any, **options: Any) -> None:
        super().__init__(*parts, **options)
        self.apart = apart

    @cached_property
    def lights(self) -> Lights:
        return _Transparent(self.mi, self.apart)

    def visible(self, si: SurfaceInteraction, point: Point, active: Mask) -> Mask:
        return active


class _Transparent(Lights):
    """Lights that do not occlude each other: a ray collects the light of all lamps along it and of the environment.

    Light sampling traces no shadow rays here, so lights that a BSDF sample hits must not be occluded either.
    """

    def along(self, ray: Ray, solid_angle: Float, active: Mask) -> list[tuple[Radiance, Float]]:
        """All lights along the ray, each with its density."""
        if self.shortens_last_ray or self.count == 0:
            return super().along(ray, solid_angle, active)
        mi, origin = self.mi, ray.o
        result, still = [], active
        for _ in self.scene.shapes():
            si = self.scene.ray_intersect(ray, mi.RayFlags.All, False, still)
            still = still & si.is_valid()
            result.append(self._arriving(origin, si, solid_angle, still))
            ray = self.surfaces.offsets.ray(si, ray.d)
        if self.has_environment:
            beyond = dr.zeros(mi.SurfaceInteraction3f)
            beyond.t, beyond.wi, beyond.wavelengths = dr.inf, -ray.d, ray.wavelengths
            result.append(self._arriving(origin, beyond, solid_angle, active))
        return result

    def _arriving(
        self, origin: Point, si: SurfaceInteraction, solid_angle: Float, active: Mask
    ) -> tuple[Radiance, Float]:
        radiance = dr.select(active, self.emitted(si, active), 0)
        return radiance, self.pdf(origin, solid_angle, si, active & dr.any(radiance != 0))
