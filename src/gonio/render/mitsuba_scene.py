"""A Mitsuba scene: its file, read with the same care as the lab's, and its passes under its own integrator."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..work import garbage
from . import engine, formats
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


def load(request: Request, mi: ModuleType) -> Scene:
    """The scene of a Mitsuba XML file; the request's overrides are its `$parameters`."""
    where = str(request.scene)
    check_files(request.scene, request.overrides, request.allow_outside)
    try:
        # one after the other, and none merged: else the order of shapes, and with it the last bit, is left to chance
        with engine.file_threads():
            # In parallel a file that cannot be read ends the process: the error has a thread of its own.
            values = {key: _as_xml(value) for key, value in request.overrides.items()}
            scene = mi.load_file(where, parallel=False, optimize=False, **values)
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
        raise InputError(_mitsuba_text(error), where, "mend it there; the texts are Mitsuba's") from error
    return scene


def _as_xml(value: object) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _mitsuba_text(error: Exception) -> str:
    """Mitsuba's message without places in its C++ source and without a Python traceback of ours."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    ours = [line for line in lines if re.match(r"\w*(Error|Exception): ", line)]
    text = lines[0] if lines else type(error).__name__
    if ours:  # an error of a Gonio material, raised within Mitsuba's parser
        text = text.removesuffix("Traceback (most recent call last):")
        text += ours[-1].split(": ", 1)[1] if text != lines[0] else ""
    elif len(lines) > 1:
        text += " " + "; ".join(lines[1:4])
    return re.sub(r"\[\w+\.(cpp|h):\d+\] ", "", text)


def sources(file: Path, parameters: Mapping[str, object]) -> tuple[Callable[[], str], dict[str, Path]]:
    """What tells the text of a scene and all that it includes; and the files that it names, by their names in it."""
    texts, named = [repr(sorted((key, _as_xml(value)) for key, value in parameters.items()))], {}
    texts.append(file.read_text(encoding="utf-8", errors="surrogateescape"))
    for _, name, target, included in _named(file, parameters):
        named[name] = target
        if included:
            texts.append(target.read_text(encoding="utf-8", errors="surrogateescape"))
    return lambda: "\n".join(texts), named


def check_files(file: Path, parameters: Mapping[str, object], allow_outside: bool = False) -> None:
    """Raise InputError where a Mitsuba scene, or a file it includes, names a file that must not be opened: one outside
    the scene's folder, or a picture that contradicts itself, by which a library in C++ could be corrupted."""
    folder = file.parent.resolve()
    from .scene import meshes

    for current, name, target, _ in _named(file, parameters):
        if not allow_outside and not target.is_relative_to(folder):
            what = f"'{name}' lies outside the scene's folder {folder}"
            raise InputError(what, str(current), "copy it there, or use --allow-outside")
        try:
            formats.check_file(target)
            if target.suffix.lower() == ".ply" or meshes.is_ply(target):  # Mitsuba's reader believes counts and indices
                meshes.read_mesh(target, str(current), ".ply")
        except formats.Unreadable as error:
            raise InputError(f"'{name}' cannot be used: {error}", str(current), "save it again") from None
        except OSError as error:
            raise InputError(f"'{name}' cannot be read: {error.strerror}", str(current), "check the file") from None


def _named(file: Path, parameters: Mapping[str, object]) -> Iterator[tuple[Path, str, Path, bool]]:
    """Each file that exists and is named by a Mitsuba scene, or by a file that it includes: (where, its name there,
    the file, whether it is included)."""
    folder, seen, waiting = file.parent.resolve(), set(), [file.resolve()]
    while waiting:
        current = waiting.pop()
        if current in seen:
            continue
        seen.add(current)
        try:
            root = ElementTree.parse(current).getroot()
        except (ElementTree.ParseError, OSError, ValueError, LookupError) as error:
            raise InputError(f"not well-formed XML: {error}", str(current), "mend it there") from error
        values = {x.get("name", ""): x.get("value", "") for x in root.iter("default")}
        values |= {name: _as_xml(value) for name, value in parameters.items()}
        for element in root.iter():
            name = element.get("filename") or (element.get("value") if element.tag in ("string", "path") else None)
            if not name:
                continue
            for key in sorted(values, key=len, reverse=True):
                name = name.replace("$" + key, values[key])
            try:
                target = (folder / name).resolve()
                exists = target.is_file()
            except (OSError, ValueError, RuntimeError):  # no file's name, such as a long or odd string, or a loop
                continue
            if exists:
                yield current, name, target, element.tag == "include"
                if element.tag == "include":
                    waiting.append(target)
