"""A Mitsuba scene: its file, read with the same care as the lab's, and its passes under its own integrator."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..work import garbage
from . import engine, mitsuba_xml, plugin_search
from .mitsuba_xml import SceneText
from .passes import power_of_two
from .request import Request
from .types import Plugin, Scene

# Samples in flight of Mitsuba's own integrators, which hold one in each lane: half a second or so on a CPU.
WAVEFRONT = 1 << 21


class MitsubaRender:
    """A Mitsuba scene by one of Mitsuba's integrators, in passes of `pass_size` samples with a seed each.

    The picture depends on the seed and the film, not on the clock, up to the last bit: Mitsuba's film adds up with
    atomics, in an order of their own. A sampler that needs a square number of
    samples (stratified, multijitter) rounds each pass up; `done` counts what was really taken.
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
        self.pass_size = min(spp, power_of_two(max(1, (wavefront or WAVEFRONT) // (int(width) * int(height)))))
        self._sum: NDArray[np.float64] | None = None
        self._passes = 0
        self.done = 0

    def advance(self, count: int) -> None:
        seed = (self._seed + self._passes * 0x9E3779B9) & 0xFFFFFFFF  # apart from the passes of the next seeds
        picture = self._render(self._integrator, count, seed)
        taken = int(self._sensor.sampler().sample_count())
        # In float64: a sum of thousands of float32 passes would lose digits.
        weighted = picture.astype(np.float64) * taken
        self._sum = weighted if self._sum is None else self._sum + weighted  # a new one: `state` is of the old
        self._passes += 1
        self.done += taken

    def state(self) -> dict[str, NDArray[Any]]:
        """The sum so far, and which passes it is of."""
        assert self._sum is not None, "advance() comes first"
        return {"sum": self._sum, "passes": np.array([self._passes, self.pass_size], np.int64)}

    def restore(self, done: int, state: Mapping[str, NDArray[Any]]) -> None:
        """Go on with the next pass: the same picture up to Mitsuba's own last bit. ValueError for another film."""
        width, height = self._sensor.film().crop_size()
        if "sum" not in state or "passes" not in state or state["sum"].shape[:2] != (int(height), int(width)):
            raise ValueError("no sum of this film")
        self._sum, (self._passes, self.pass_size) = state["sum"], map(int, state["passes"])
        self.done = done

    def _render(self, integrator: Plugin, spp: int, seed: int) -> NDArray[np.float32]:
        with garbage.kept():
            tensor = self._mi.render(self._scene, integrator=integrator, spp=spp, seed=seed)
            return np.array(tensor, dtype=np.float32)

    def image(self) -> NDArray[np.float32]:
        assert self._sum is not None, "advance() comes first"
        mean = (self._sum / self.done).astype(np.float32)
        return np.repeat(mean[..., :1], 3, axis=2) if mean.shape[2] < 3 else mean[..., :3]

    def aov(self) -> dict[str, NDArray[np.float32]]:
        """Guides for the denoiser: 16 samples see every surface of a pixel that matters to an edge."""
        aovs = self._mi.load_dict({"type": "aov", "aovs": "albedo:albedo,normal:sh_normal"})
        channels = self._render(aovs, 16, self._seed)[..., -6:]
        return {"albedo": channels[..., :3], "normal": channels[..., 3:]}


def read(request: Request) -> SceneText:
    """The text of a Mitsuba XML file; the request's overrides are its `$parameters`."""
    values = {key: _as_xml(value) for key, value in request.overrides.items()}
    return mitsuba_xml.read(request.scene, values, request.allow_outside, request.allow_code)


def load(request: Request, text: SceneText, mi: ModuleType) -> Scene:
    """The scene of a Mitsuba XML file that was `read`."""
    where = str(request.scene)
    try:
        scene = instantiated(text, request.scene.parent, mi)
        if not isinstance(scene, mi.Scene):
            raise InputError("this file holds no <scene>", where, "give a Mitsuba scene, a folder or a .json")
        if not scene.sensors():
            raise InputError("the scene has no <sensor>", where, "add one: it holds the camera and the film")
        if scene.integrator() is None and request.integrator is None:
            raise InputError("the scene has no <integrator>", where, "add one, or give --integrator path")
        if request.size is not None:
            parameters = mi.traverse(scene.sensors()[0])
            parameters["film.size"] = list(request.size)
            parameters.update()
    except InputError:
        raise
    except (RuntimeError, ValueError, TypeError, KeyError) as error:
        raise InputError(_mitsuba_text(error, text), where, "mend it there; the texts are Mitsuba's") from error
    return scene


def instantiated(text: SceneText, folder: Path, mi: ModuleType) -> Plugin:
    """What Mitsuba makes of a scene's text; its errors are raised as they come."""
    allowed = [folder.resolve()] if text.runs_code else []
    # one after the other, and none merged: else the order of shapes, and with it the last bit, is left to chance;
    # and in parallel a file that cannot be read ends the process: the error has a thread of its own
    with engine.file_threads(), plugin_search.searching(mi, *allowed):
        return mi.load_string(text.text, parallel=False, optimize=False)


def _as_xml(value: object) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _mitsuba_text(error: Exception, scene: SceneText) -> str:
    """Mitsuba's message without places in its C++ source and without a Python traceback of ours."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    ours = [line for line in lines if re.match(r"\w*(Error|Exception): ", line)]
    text = lines[0] if lines else type(error).__name__
    if ours:  # an error of a Gonio material, raised within Mitsuba's parser
        text = text.removesuffix("Traceback (most recent call last):")
        text += ours[-1].split(": ", 1)[1] if text != lines[0] else ""
    elif len(lines) > 1:
        text += " " + "; ".join(lines[1:4])
    return scene.located(re.sub(r"\[\w+\.(cpp|h):\d+\] ", "", text))


def sources(text: SceneText, parameters: Mapping[str, object]) -> tuple[Callable[[], str], dict[str, Path]]:
    """What tells the text of a scene and all that it includes; and the files that it names, by their names in it."""
    given = repr(sorted((key, _as_xml(value)) for key, value in parameters.items()))
    return lambda: "\n".join([given, *text.sources]), text.files
