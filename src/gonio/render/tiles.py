"""Render a picture on several workers: each part of the job consists of all samples of a range of lanes.

A lane is one of the array entries that a kernel processes in parallel. Lanes are independent, and every part begins at
a multiple of the processor's vector width, so the same rays are traced together, and the accumulated samples are
bit-identical to those of a single process. A worker loads the scene from copies of its files, which are sent once and
identified by a hash of their content.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import GonioError, InputError, in_user_code, out_of_loop
from ..transport import passes
from ..transport.integrators import Render
from ..transport.integrators.progressive import LANES
from ..transport.passes import Progress
from ..transport.polarizer import PolarizedRender
from ..work import executor, facts
from ..work.kept import Arrays, Facts
from .prepare import Prepared, prepare
from .request import Request
from .request_json import described, request_of

ALIGNED = 64  # lanes: a multiple of the vector width of all processors and of the camera's tiles of rays
MAX_SAMPLES = 1 << 25  # samples per part, which take some seconds on one machine
MIN_SAMPLES = 1 << 21  # samples per part; for fewer, sending the part would take too long in comparison
SAMPLES_PER_SUBMISSION = 1 << 17  # samples that a worker traces while one part is submitted
MAX_PASS = 2.0  # seconds per pass: long, because workers do not react to Ctrl-C, and each pass takes 15 ms in Python
PARTS = 20  # minimum number of parts per worker, so that no worker is idle for long at the end


class Gathered:
    """The accumulated samples received from workers, with the interface of a render, for `checkpoints.Keeper`."""

    def __init__(self, render: Render, wanted: int) -> None:
        self._render, self._wanted = render, wanted
        state = render.state()
        lanes = len(state["invalid"])
        self.arrays = {name: np.array(values) for name, values in state.items()}
        self.arrays.setdefault(LANES, np.full(lanes, render.done, np.uint32))

    @property
    def done(self) -> int:
        return int(self.arrays[LANES].min())

    @property
    def samples(self) -> int:
        """The number of samples so far, summed over all lanes."""
        return int(self.arrays[LANES].sum(dtype=np.int64))

    @property
    def pixels(self) -> int:
        return len(self.arrays[LANES])

    def samples_in(self, lanes: slice) -> int:
        """The number of samples so far, summed over the given lanes."""
        return int(self.arrays[LANES][lanes].sum(dtype=np.int64))

    def put(self, lanes: slice, arrays: Arrays) -> None:
        """Store the accumulated samples of a finished part."""
        for name, values in arrays.items():
            self.arrays[name][lanes] = values
        self.arrays[LANES][lanes] = self._wanted

    def state(self) -> Arrays:
        return {name: values.copy() for name, values in self.arrays.items()}

    def give(self) -> None:
        """Copy the accumulated samples into the render."""
        self._render.restore(self.done, self.arrays)

    def advance(self, count: int) -> None:
        raise NotImplementedError("workers advance it")

    def restore(self, done: int, state: Mapping[str, NDArray[Any]]) -> None:
        raise NotImplementedError("restore the render instead")

    def image(self) -> NDArray[np.float32]:
        self.give()
        return self._render.image()

    def aov(self) -> dict[str, NDArray[np.float32]]:
        self.give()
        return self._render.aov()


def advance(
    jobs: Sequence[tuple[Prepared, Gathered]],
    *,
    report: Callable[[Progress], None],
    interrupted: Callable[[], object],
    timeout: float | None = None,
    finished: Callable[[int], None] = lambda index: None,
    clock: Callable[[], float] = time.perf_counter,
) -> str:
    """Advance several renders to their sample counts on the workers.

    Returns the reason why they ended, as `passes.run` does.

    report       called after each part with the progress of all renders together
    interrupted  called after each part; if the result is true, the renders end
    timeout      time limit in the unit of `clock` (s); None for no limit
    finished     called with the index of a render when its last part has arrived
    """
    begin, parts, arguments = clock(), [], []
    files: dict[str, Path] = {}
    total = sum(prepared.spp * gathered.pixels for prepared, gathered in jobs)
    pixels = sum(gathered.pixels for _, gathered in jobs)
    left = []
    for number, (prepared, gathered) in enumerate(jobs):
        spec, named = travelling(prepared)
        files |= named
        done = gathered.arrays[LANES]
        cuts = _cut(done, prepared.spp, part_size(total, executor.current().size))
        left.append(len(cuts))
        for lanes in cuts:
            first = int(done[lanes.start])
            start = {name: a[lanes] for name, a in gathered.arrays.items() if name != LANES} if first else None
            arguments.append((spec, lanes.start, lanes.stop, first, prepared.spp, start))
            parts.append((number, lanes))
    before = now = sum(gathered.samples for _, gathered in jobs)
    with contextlib.closing(executor.each(part, arguments, files=files)) as results:
        for index, arrays in results:
            if index >= 0:
                number, lanes = parts[index]
                now += arguments[index][4] * (lanes.stop - lanes.start) - jobs[number][1].samples_in(lanes)
                jobs[number][1].put(lanes, arrays)
                rate = max(now - before, 1) / max(clock() - begin, 1e-9)
                report(Progress(now // pixels, total // pixels, rate, (total - now) / rate))
                left[number] -= 1
                if left[number] == 0:
                    finished(number)
            if not any(left):
                return ""
            if interrupted():
                return "interrupt"
            if timeout is not None and clock() - begin > timeout:
                return "timeout"
    return ""


def part_size(total: int, workers: int) -> int:
    """The number of samples per part for `total` samples.

    It is small enough to occupy all workers, and large enough that submitting the parts, which takes about 10 ms each,
    is not slower than the workers (`benchmarks/cluster.py`).
    """
    return min(max(total // (PARTS * workers), MIN_SAMPLES, workers * SAMPLES_PER_SUBMISSION), MAX_SAMPLES)


def _cut(done: NDArray[np.uint32], wanted: int, samples: int) -> list[slice]:
    """Ranges of lanes that still need samples, about `samples` per range.

    All lanes of a range have the same number of samples so far.
    """
    pixels = len(done)
    step = max(samples // wanted // ALIGNED, 1) * ALIGNED
    edges = sorted({*range(0, pixels, step), *(np.flatnonzero(np.diff(done)) + 1).tolist(), pixels})
    ranges = [slice(a, b) for a, b in itertools.pairwise(edges)]
    return [lanes for lanes in ranges if done[lanes.start] < wanted]


def travelling(prepared: Prepared) -> tuple[str, dict[str, Path]]:
    """A string from which a worker can rebuild a prepared render, and the files that it needs, by content hash.

    Raises InputError for a render that cannot be distributed.
    """
    request, where = prepared.request, "cluster"
    if not isinstance(prepared.render, Render):
        what, instead = "Mitsuba's own integrator renders on only one machine", "add --integrator path (or direct), or "
        if isinstance(prepared.render, PolarizedRender):
            what, instead = "a scene with a polarizer is rendered by Mitsuba's own integrator, on only one machine", ""
        raise InputError(what, where, f"{instead}leave --workers, or the cluster, out")
    if prepared.render.settings.program.splats:
        what = f"{prepared.render.settings.integrator} adds to the whole picture, but workers render parts of it"
        raise InputError(what, where, "render on one machine, or use path")
    named = dict(prepared.sources.files)
    folder = ""
    if request.material is None:
        root = request.scene.resolve()
        file = root / "scene.json" if root.is_dir() else root
        folder = str(file.parent)
        named[file.name] = file
        for name, path in named.items():
            if not path.resolve().is_relative_to(folder):
                raise InputError(f"'{name}' lies outside the scene's folder", where, "copy it there: workers need it")
    places = {str(path.resolve()): facts.file_hash(path) for path in named.values()}
    payload = {"request": described(replace(request, output=None, threads=None)), "folder": folder}
    text = json.dumps({**payload, "files": places}, sort_keys=True)
    return text, {content: Path(path) for path, content in places.items()}


# ---------------------------------------------------------------------- on the worker

# the loaded scene, which consecutive parts share
_last: dict[str, tuple[Prepared, tempfile.TemporaryDirectory[str]]] = {}
_copies: dict[str, Path] = {}  # copies of the scene's files, by their paths on the submitting machine
_rates: dict[str, float] = {}  # samples per second of the scene's last part


def part(spec: str, begin: int, end: int, first: int, last: int, start: Arrays | None) -> Arrays:
    """Render samples [first, last) of lanes [begin, end), and return the accumulated samples.

    spec   the render, as returned by `travelling`
    start  the accumulated samples before `first`; None if there are none
    """
    with _places_as_given():
        render = _prepared(spec).render
        assert isinstance(render, Render)
        render.select(slice(begin, end))
        if start is not None:
            render.restore(first, start)
        lanes = end - begin

        def remember(progress: Progress) -> None:
            _rates[spec] = progress.rate

        passes.run(render, last, lanes, first=int(_rates.get(spec, 0.0) * MAX_PASS / lanes), report=remember)
        return {name: np.array(values) for name, values in render.state().items()}


@contextlib.contextmanager
def _places_as_given() -> Iterator[None]:
    """Inside the `with` block, errors name the files on the submitting machine instead of their copies here."""
    try:
        yield
    except Exception as error:
        cause = out_of_loop(error)
        located = cause if isinstance(cause, GonioError) else in_user_code(cause)
        if located is None:
            raise
        for path, copy in _copies.items():
            located.where = located.where.replace(str(copy), path)
        raise type(located)(located.what, located.where, located.hint) from error


def _prepared(spec: str) -> Prepared:
    if spec not in _last:
        _last.clear()
        _copies.clear()
        _rates.clear()
        folder = tempfile.TemporaryDirectory(prefix="gonio-scene-")
        known: Facts = json.loads(spec)
        _last[spec] = (
            prepare(replace(_unpacked(known, Path(folder.name)), output=Path(folder.name, "a.exr"))),
            folder,
        )
    return _last[spec][0]


def _unpacked(known: Facts, folder: Path) -> Request:
    """The request, whose files are copied to a folder on this machine."""
    text = json.dumps(known["request"])
    for path, content in known["files"].items():
        # the same layout of folders, so that Python files can import modules from their own folder
        inside = os.path.relpath(path, known["folder"] or Path(path).anchor)
        target = folder / inside
        _copies[path] = target
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(executor.file(content), target)
        text = text.replace(json.dumps(path)[1:-1] + ":", json.dumps(str(target))[1:-1] + ":")  # FILE.py:CLASS
    known_request = json.loads(text)
    if known["folder"]:
        known_request["scene"] = str(folder / os.path.relpath(known_request["scene"], known["folder"]))
    return request_of(known_request, "cluster", allow_code=True)  # the submitting machine has allowed it
