"""Render a scene with one of Mitsuba's own integrators, in passes."""

from __future__ import annotations

from collections.abc import Mapping
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import garbage
from ..bridge.faults.denormal_numbers import denormals_rounded
from ..bridge.types import Plugin, Scene
from ..errors import InputError
from .passes import power_of_two

# Samples per pass of Mitsuba's own integrators, which process one sample per lane; a pass takes about 0.5 s on a CPU.
WAVEFRONT = 1 << 21


class MitsubaRender:
    """A render with one of Mitsuba's integrators, in passes of `pass_size` samples, each with its own seed.

    The picture depends on the seed and the film, but not on timing, except for its last bits: Mitsuba accumulates the
    film with atomic operations in arbitrary order. A sampler that requires a square number of samples (stratified,
    multijitter) rounds this number up in each pass; `done` is the number of samples actually taken.
    """

    def __init__(
        self,
        mi: ModuleType,
        scene: Scene,
        spp: int,
        seed: int = 0,
        integrator: Plugin = None,
        wavefront: int | None = None,
    ) -> None:
        self._mi, self._scene, self._seed = mi, scene, seed
        self._integrator = scene.integrator() if integrator is None else integrator
        self._sensor = scene.sensors()[0]
        width, height = self._sensor.film().crop_size()
        self._largest_pass = power_of_two(max(1, (wavefront or WAVEFRONT) // (int(width) * int(height))))
        self.pass_size = min(spp, self._largest_pass)
        self._sum: NDArray[np.float64] | None = None
        self._passes = 0
        self.done = 0

    def advance(self, count: int) -> None:
        seed = (self._seed + self._passes * 0x9E3779B9) & 0xFFFFFFFF  # differs from those of passes of adjacent seeds
        picture = self._render(self._integrator, count, seed)
        samples = int(self._sensor.sampler().sample_count())
        # in float64, because a float32 sum over thousands of passes would lose digits
        weighted = picture.astype(np.float64) * samples
        if self._sum is not None and self._sum.shape != weighted.shape:
            what = f"the picture has {weighted.shape[2]} channels, but the checkpoint has {self._sum.shape[2]}"
            raise InputError(what, "checkpoint", "render again without it")
        self._sum = weighted if self._sum is None else self._sum + weighted  # a new array: `state` returns the old one
        self._passes += 1
        self.done += samples

    def state(self) -> dict[str, NDArray[Any]]:
        """The accumulated samples, with the number and the size of the passes."""
        assert self._sum is not None, "advance() comes first"
        return {"sum": self._sum, "passes": np.array([self._passes, self.pass_size], np.int64)}

    def restore(self, done: int, state: Mapping[str, NDArray[Any]]) -> None:
        """Continue with the next pass. Only the last bits of the picture may differ.

        Raises ValueError or KeyError if the state is that of another film.
        """
        width, height = self._sensor.film().crop_size()
        total, passes = state["sum"], state["passes"]
        fits = total.ndim == 3 and total.shape[:2] == (int(height), int(width)) and total.shape[2] > 0
        if not (fits and total.dtype == np.float64 and passes.dtype == np.int64 and passes.shape == (2,)):
            raise ValueError("no sum of this film")
        if not (done > 0 and passes[0] >= 0 and 0 < passes[1] <= self._largest_pass):
            raise ValueError("no count of passes")
        self._sum, (self._passes, self.pass_size) = total, map(int, passes)
        self.done = done

    def _render(self, integrator: Plugin, spp: int, seed: int) -> NDArray[np.float32]:
        with garbage.paused(), denormals_rounded():
            tensor = self._mi.render(self._scene, integrator=integrator, spp=spp, seed=seed)
            return np.array(tensor, dtype=np.float32)

    def image(self) -> NDArray[np.float32]:
        assert self._sum is not None, "advance() comes first"
        mean = (self._sum / self.done).astype(np.float32)
        return np.repeat(mean[..., :1], 3, axis=2) if mean.shape[2] < 3 else mean[..., :3]

    def aov(self) -> dict[str, NDArray[np.float32]]:
        """The features for the denoiser, with 16 samples per pixel, which suffice for all edges."""
        aovs = self._mi.load_dict({"type": "aov", "aovs": "albedo:albedo,normal:sh_normal"})
        channels = self._render(aovs, 16, self._seed)[..., -6:]
        return {"albedo": channels[..., :3], "normal": channels[..., 3:]}
