"""Render a scene as seen through a polarizer: Mitsuba's path tracer with Mueller matrices, and the polarizer."""

from __future__ import annotations

from collections.abc import Mapping
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..bridge import engine
from ..bridge.types import Scene
from ..errors import InputError
from .integrators import Settings
from .mitsuba_render import MitsubaRender

# samples per pass; at a vertex, two matrices of 4 x 4 spectra are multiplied, so a sample takes 16 times as much memory
WAVEFRONT = 1 << 19

TRACED = ("path", "direct")  # the integrators that Mitsuba's path tracer can replace


class PolarizedRender(MitsubaRender):
    """A render of the light that passes through a linear polarizer.

    It accumulates the Stokes vector of each pixel, where Q > 0 means horizontal polarization in the picture, and U > 0
    polarization at 45 degrees. A polarizer at the angle theta transmits (I + Q cos 2 theta + U sin 2 theta) / 2
    (Born1999).

    degrees  direction of the transmitted polarization, counterclockwise from the horizontal of the picture
    """

    def __init__(self, mi: ModuleType, scene: Scene, spp: int, settings: Settings, degrees: float) -> None:
        depth = settings.program.depth(settings)  # type: ignore[attr-defined]  # of all in TRACED
        stokes = {"type": "stokes", "nested": {"type": "path", "max_depth": depth}}
        super().__init__(mi, scene, spp, settings.seed, mi.load_dict(stokes), WAVEFRONT)
        self._variant, self._angle = str(mi.variant()), np.radians(degrees)

    def advance(self, count: int) -> None:
        with engine.using(self._variant):
            super().advance(count)

    def image(self) -> NDArray[np.float32]:
        intensity, Q, U = (self.stokes[..., part, :] for part in range(3))
        transmitted = 0.5 * (intensity + np.cos(2.0 * self._angle) * Q + np.sin(2.0 * self._angle) * U)
        return transmitted.astype(np.float32)

    @property
    def stokes(self) -> NDArray[np.float64]:
        """The Stokes parameters I, Q, U and V of each pixel in linear RGB, (height, width, 4, 3)."""
        assert self._sum is not None, "advance() comes first"
        mean = self._sum / self.done
        return mean[..., 3:15].reshape(*mean.shape[:2], 4, 3)  # after the channels of the picture

    def aov(self) -> dict[str, NDArray[np.float32]]:
        with engine.using(self._variant):
            return super().aov()

    def restore(self, done: int, state: Mapping[str, NDArray[Any]]) -> None:
        super().restore(done, state)
        if self._sum is not None and self._sum.shape[2] != 15:
            raise ValueError("no sum of Stokes vectors")


def check(settings: Settings, location: str) -> None:
    """Raise InputError, which names `location`, if the settings cannot be combined with a polarizer."""
    if settings.integrator not in TRACED:
        what = f"the scene has a polarizer, but '{settings.integrator}' does not trace polarized light"
        raise InputError(what, location, "use " + " or ".join(TRACED))
    if settings.ambient is not None and any(settings.ambient):
        raise InputError("a polarizer with ambient light, which has no polarization", location, "remove one of them")
