"""One render from a scene's file to a picture on disk: passes, progress, Ctrl-C, time limit.

A render goes in passes of about half a second, so that Ctrl-C is answered soon. The size of the passes follows
the clock; the picture does not, to the bit: `Render` numbers its samples and sums them in order. A Mitsuba scene
under its own integrator has no such numbering, so its passes are of one size, which follows from the film alone;
there the passes also keep memory flat as samples grow.
"""

from __future__ import annotations

import contextlib
import os
import re
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import TYPE_CHECKING, Any, Protocol
from xml.etree import ElementTree

import numpy as np

from .. import __version__
from ..errors import InputError, did_you_mean
from . import denoise, engine, images

if TYPE_CHECKING:
    from . import integrators

PASS_SECONDS = 0.5  # long enough that a pass's start-up (some 10 ms) is small, short enough for Ctrl-C

FIRST_PASS = 1 << 18  # samples: some 50 ms of work, and a first picture soon after the kernel is compiled

# Samples in flight of Mitsuba's own integrators, which hold one in each lane: half a second or so on a CPU.
WAVEFRONT = 1 << 21
# Per pixel: 9 sums in float64, twice (before and after a pass), lane order, picture as float64 and float32, the
# file's bytes. It is the estimate by which a film is refused as too large.
BYTES_PER_PIXEL = 250

INTERRUPTED = 130  # the exit code of a shell for a program that Ctrl-C ended, 128 + SIGINT


class Renders(Protocol):
    """What `run` can drive: `gonio.render.integrators.Render`, `MitsubaRender`."""

    @property
    def done(self) -> int: ...

    def advance(self, count: int) -> None: ...

    def image(self) -> np.ndarray: ...

    def aov(self) -> dict[str, np.ndarray]: ...


# --- the loop ------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Progress:
    """Where a render stands: samples per pixel done and wanted, samples per second, seconds left (by the rate)."""

    done: int
    wanted: int
    rate: float
    remaining: float


def run(
    render: Renders,
    spp: int,
    pixels: int,
    *,
    timeout: float | None = None,
    report: Callable[[Progress], None] = lambda progress: None,
    interrupted: Callable[[], bool] = lambda: False,
    clock: Callable[[], float] = time.perf_counter,
) -> str:
    """Advance `render` to `spp` samples per pixel; why it ended: "" (done), "interrupt" or "timeout".

    At least one pass is made, so that there is always a picture. Both wishes to stop are looked at between
    passes; near the time limit the passes shrink to what still fits.
    """
    begin = clock()
    fixed = getattr(render, "pass_size", None)  # a Mitsuba scene's passes are of one size
    count = _power_of_two(FIRST_PASS / pixels)
    compiled, counted_samples, counted_seconds = False, 0, 0.0
    while True:
        if fixed:
            count = fixed
        before, started = render.done, clock()
        render.advance(min(count, spp - render.done))
        elapsed, samples = max(clock() - started, 1e-9), (render.done - before) * pixels
        # The first pass also compiles; it says nothing about the rate unless it stays the only one.
        if compiled or render.done >= spp:
            counted_samples, counted_seconds = counted_samples + samples, counted_seconds + elapsed
        rate = counted_samples / counted_seconds if counted_seconds else samples / elapsed
        remaining = max(spp - render.done, 0) * pixels / rate
        report(Progress(render.done, spp, rate, remaining))
        if render.done >= spp:
            return ""
        if interrupted():
            return "interrupt"
        left = timeout - (clock() - begin) if timeout is not None else float("inf")
        if left <= 0:
            return "timeout"
        if not fixed:
            count = _next_count(count, elapsed, compiled)
            if timeout is not None:
                count = min(count, max(1, int(left * rate / pixels)))
        compiled = True


def _next_count(count: int, elapsed: float, compiled: bool) -> int:
    """Samples per pixel of the next pass: what should take PASS_SECONDS, at most 8 times more than last time."""
    if not compiled and elapsed > PASS_SECONDS:  # compiling, most likely
        return count
    return max(1, round(count * min(PASS_SECONDS / elapsed, 8)))


def _power_of_two(x: float) -> int:
    """The largest power of two not above x, at least 1."""
    return 1 << max(int(x).bit_length() - 1, 0)


class Interrupts:
    """While it is open, the first Ctrl-C sets `asked`, and a second one ends the process at once.

    A signal handler of Python runs only between two of its instructions, and a pass is one long call. So the
    signal's byte is taken from the wake-up socket by a thread of its own, which runs while the pass does.
    """

    def __init__(self, notice: Callable[[], None] = lambda: None) -> None:
        self.asked = False
        self._notice = notice

    def __enter__(self) -> Interrupts:
        # Signals belong to the main thread; a shell that ignores Ctrl-C for a background job has its reasons.
        in_main = threading.current_thread() is threading.main_thread()
        self._active = in_main and signal.getsignal(signal.SIGINT) is not signal.SIG_IGN
        if self._active:
            self._listen, self._wake = socket.socketpair()
            self._wake.setblocking(False)
            self._old_handler = signal.signal(signal.SIGINT, lambda number, frame: None)
            self._old_wake = signal.set_wakeup_fd(self._wake.fileno(), warn_on_full_buffer=False)
            threading.Thread(target=self._watch, daemon=True).start()
        return self

    def check(self) -> None:
        """Raise KeyboardInterrupt where it was asked for: for work that has nothing to keep yet."""
        if self.asked:
            raise KeyboardInterrupt

    def __exit__(self, *exc: object) -> None:
        if self._active:
            signal.set_wakeup_fd(self._old_wake)
            signal.signal(signal.SIGINT, self._old_handler)
            self._wake.close()  # ends the thread
            self._active = False

    def _watch(self) -> None:
        with contextlib.suppress(OSError), self._listen:
            while numbers := self._listen.recv(16):
                for number in numbers:
                    if number != signal.SIGINT:
                        continue
                    if self.asked:
                        if sys.stderr.isatty():
                            os.write(2, b"\x1b[?25h\n")  # the progress bar had hidden the cursor
                        os._exit(INTERRUPTED)
                    self.asked = True
                    self._notice()


# --- Mitsuba's own scenes --------------------------------------------------------------------------------


class MitsubaRender:
    """A Mitsuba scene by one of Mitsuba's integrators, in passes of `pass_size` samples with a seed each.

    The picture depends on the seed and the film, not on the clock. A sampler that needs a square number of
    samples (stratified, multijitter) rounds each pass up; `done` counts what was really taken.
    """

    def __init__(self, mi: ModuleType, scene: Any, spp: int, seed: int = 0, integrator: Any = None) -> None:
        self._mi, self._scene, self._integrator, self._seed = mi, scene, integrator or scene.integrator(), seed
        self._sensor = scene.sensors()[0]
        width, height = self._sensor.film().crop_size()
        self.pass_size = min(spp, _power_of_two(max(1, WAVEFRONT // (int(width) * int(height)))))
        self._sum: np.ndarray | None = None
        self._passes = 0
        self._done = 0

    @property
    def done(self) -> int:
        return self._done

    def advance(self, count: int) -> None:
        seed = (self._seed + self._passes * 0x9E3779B9) & 0xFFFFFFFF  # apart from the passes of the next seeds
        picture = self._render(self._integrator, count, seed)
        taken = int(self._sensor.sampler().sample_count())
        # In float64: a sum of thousands of float32 passes would lose digits.
        weighted = picture.astype(np.float64) * taken
        self._sum = weighted if self._sum is None else self._sum + weighted
        self._passes += 1
        self._done += taken

    def _render(self, integrator: Any, spp: int, seed: int) -> np.ndarray:
        tensor = self._mi.render(self._scene, integrator=integrator, spp=spp, seed=seed)
        return np.array(tensor, dtype=np.float32)

    def image(self) -> np.ndarray:
        assert self._sum is not None, "advance() comes first"
        mean = (self._sum / self._done).astype(np.float32)
        return np.repeat(mean[..., :1], 3, axis=2) if mean.shape[2] < 3 else mean[..., :3]

    def aov(self) -> dict[str, np.ndarray]:
        """Guides for the denoiser: 16 samples see every surface of a pixel that matters to an edge."""
        aovs = self._mi.load_dict({"type": "aov", "aovs": "albedo:albedo,normal:sh_normal"})
        channels = self._render(aovs, 16, self._seed)[..., -6:]
        return {"albedo": channels[..., :3], "normal": channels[..., 3:]}


# --- from file to picture --------------------------------------------------------------------------------


@dataclass(frozen=True)
class Request:
    """What to render and how; None means: as the scene says."""

    scene: Path
    output: Path | None = None
    spp: int | None = None
    size: tuple[int, int] | None = None
    integrator: str | None = None
    max_depth: int | None = None
    sampler: str | None = None
    seed: int | None = None
    device: str = "cpu"
    threads: int | None = None
    timeout: float | None = None
    denoise: bool = False
    exposure: float = 0.0
    allow_outside: bool = False
    overrides: dict[str, Any] = field(default_factory=dict)

    def check(self) -> None:
        """Raise InputError for an option that cannot be, before anything is loaded."""
        if self.spp is not None and self.spp < 1:
            raise InputError(f"{self.spp} samples per pixel", "--spp", "give 1 or more")
        if self.max_depth is not None and self.max_depth < 1:
            raise InputError(f"depth {self.max_depth}", "--max-depth", "give 1 or more")
        if self.seed is not None and not 0 <= self.seed < 1 << 32:
            raise InputError(f"seed {self.seed} is out of range", "--seed", "give 0 to 4294967295")
        if self.threads is not None and self.threads < 1:
            raise InputError(f"{self.threads} threads asked for", "--threads", "give 1 or more")
        if self.timeout is not None and not self.timeout > 0:
            raise InputError(f"a time limit of {self.timeout:g} seconds", "--timeout", "give more than 0")
        if not abs(self.exposure) <= 100:
            raise InputError(f"{self.exposure:g} stops", "--exposure", "give -100 to 100; 1 doubles the brightness")
        if self.size is not None:
            check_film(self.size, "--size")
        if self.denoise:
            denoise.require()
        if self.output is not None:
            images.check_writable(self.output)


@dataclass(frozen=True)
class Prepared:
    """A scene loaded and ready to advance."""

    render: Renders
    spp: int
    size: tuple[int, int]
    output: Path
    settings: dict[str, images.Value]
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class Result:
    """What came of a render; `stopped` is "", "interrupt" or "timeout", and `spp` what was done."""

    output: Path
    spp: int
    wanted_spp: int
    size: tuple[int, int]
    seconds: float
    stopped: str
    settings: dict[str, images.Value]
    warnings: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        return {**asdict(self), "output": str(self.output)}


def parse_size(text: str) -> tuple[int, int]:
    """(width, height) of "640x480"."""
    match = re.fullmatch(r"\s*(\d{1,9})\s*[xX×]\s*(\d{1,9})\s*", text)  # noqa: RUF001 - people paste it
    if not match:
        raise InputError(f"'{text}' is no size", "--size", "give width x height in pixels, such as 640x480")
    return int(match[1]), int(match[2])


def check_film(size: tuple[int, int], where: str) -> None:
    """Raise InputError for a film without pixels, or one that one sample per pixel would not fit the memory."""
    width, height = size
    if width < 1 or height < 1:
        raise InputError(f"a film of {width}x{height} has no pixels", where, "give 1x1 or more")
    needed = width * height * BYTES_PER_PIXEL
    if needed > memory():
        gib = 1 << 30
        what = f"a film of {width}x{height} needs about {needed / gib:.0f} GiB"
        raise InputError(f"{what}, this machine has {memory() / gib:.0f} GiB", where, "give a smaller size")


def memory() -> int:
    """Bytes of memory in this machine; a guess of 8 GiB where the system does not tell."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return 8 << 30


def prepare(request: Request) -> Prepared:
    """Read the scene, start Mitsuba, make the render; raises InputError or MachineError."""
    request.check()
    if not request.scene.exists():
        raise InputError("no such scene", str(request.scene), _nearby(request.scene))
    # First of all: whatever imports Dr.Jit before the engine has chosen an LLVM makes it load the wrong one.
    mi = engine.load(request.device, threads=request.threads)
    if request.scene.suffix.lower() == ".xml" and request.scene.is_file():
        return _prepare_mitsuba(request, mi)
    return _prepare_lab(request, mi)


def _nearby(path: Path) -> str:
    parent = path.parent
    if not parent.is_dir():
        return f"the folder '{parent}' does not exist"
    near = [x.name for x in parent.iterdir() if x.suffix in (".json", ".xml") or (x / "scene.json").is_file()]
    return did_you_mean(path.name, near) if near and len(near) <= 20 else "give a folder, a .json or a .xml"


def _prepare_lab(request: Request, mi: ModuleType) -> Prepared:
    from . import integrators, scene

    overrides = dict(request.overrides)
    if request.size is not None:
        overrides["/camera/film/size"] = list(request.size)
    description = scene.read(request.scene, allow_outside=request.allow_outside, overrides=overrides)
    settings = _settings(
        request,
        integrator=description.integrator.type,
        max_depth=description.integrator.max_depth,
        sampler=description.sampler.preference,
        seed=description.seed,
        ambient=description.ambient,
    )
    output = request.output or Path(description.output.filename)
    images.check_writable(output)
    render = integrators.Render(scene.build(description, mi), settings, aovs=request.denoise)
    return Prepared(
        render,
        request.spp or description.spp,
        (render.width, render.height),
        output,
        _metadata(request, mi, settings),
        tuple(description.warnings),
    )


def _settings(
    request: Request,
    integrator: str,
    max_depth: int | None,
    sampler: str,
    seed: int | None,
    ambient: tuple[float, float, float] | None = None,
) -> integrators.Settings:
    """The command line's wishes over the scene's."""
    from . import integrators

    for option, name, known in (
        ("--integrator", request.integrator, integrators.INTEGRATORS),
        ("--sampler", request.sampler, integrators.SAMPLERS),
    ):
        if name is not None and name not in known:
            raise InputError(f"unknown {option[2:]} '{name}'", option, did_you_mean(name, list(known)))
    return integrators.Settings(
        integrator=request.integrator or integrator,
        max_depth=request.max_depth or max_depth or integrators.Settings.max_depth,
        sampler=request.sampler or sampler,
        seed=_first(request.seed, seed, 0),
        ambient=ambient,
    )


def _first(*values: int | None) -> int:
    return next(value for value in values if value is not None)


def _metadata(request: Request, mi: ModuleType, settings: Any) -> dict[str, images.Value]:
    """What a picture says about how it was made."""
    from . import sampler

    found: dict[str, images.Value] = {
        "scene": str(request.scene),
        "integrator": settings.integrator,
        "sampler": sampler.DEFAULT if settings.sampler == "default" else settings.sampler,
        "seed": settings.seed,
        "variant": str(mi.variant()),
        "version": f"gonio {__version__}, mitsuba {mi.__version__}",
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    if settings.integrator == "path":
        found["max_depth"] = settings.max_depth
    if request.denoise:
        found["denoised"] = f"OIDN, pyoidn {denoise.available()}"
    return found


def _prepare_mitsuba(request: Request, mi: ModuleType) -> Prepared:
    from . import adapter, integrators, lights

    if request.integrator is None:
        for option, value in (("--max-depth", request.max_depth), ("--sampler", request.sampler)):
            if value is not None:
                what = "a Mitsuba scene's own integrator does not take this option"
                raise InputError(what, option, "add --integrator path (or direct), or change it in the .xml")
    adapter.register(mi)
    lights.register(mi)
    scene = _load_xml(request, mi)
    output = request.output or Path(request.scene.stem + ".exr")
    images.check_writable(output)
    sensor = scene.sensors()[0]
    spp = request.spp or int(sensor.sampler().sample_count())
    size = tuple(int(n) for n in sensor.film().crop_size())
    if request.integrator is not None:
        settings = _settings(request, "path", None, "default", None)
        render: Renders = integrators.Render(scene, settings, aovs=request.denoise)
        metadata = _metadata(request, mi, settings)
    else:
        seed = _first(request.seed, 0)
        render = MitsubaRender(mi, scene, spp, seed)
        own = SimpleNamespace(
            integrator=f"mitsuba:{_class_name(scene.integrator())}",
            sampler=f"mitsuba:{_class_name(sensor.sampler())}",
            seed=seed,
        )
        metadata = _metadata(request, mi, own)
    return Prepared(render, spp, (size[0], size[1]), output, metadata)


def _class_name(plugin: Any) -> str:
    return str(plugin.class_name())


def _load_xml(request: Request, mi: ModuleType) -> Any:
    """The scene of a Mitsuba XML file; overrides are its `$parameters`."""
    where = str(request.scene)
    if not request.allow_outside:
        _check_inside(request.scene, request.overrides)
    try:
        scene = mi.load_file(where, **{key: _as_xml(value) for key, value in request.overrides.items()})
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
    width, height = scene.sensors()[0].film().crop_size()
    check_film((int(width), int(height)), where)
    return scene


def _as_xml(value: Any) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _mitsuba_text(error: Exception) -> str:
    """Mitsuba's message without places in its C++ source and without a Python traceback of ours."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    ours = [line for line in lines if re.match(r"\w*(Error|Exception): ", line)]
    text = lines[0] if lines else type(error).__name__
    if ours:  # an error of a Gonio material, raised within Mitsuba's parser
        text = re.sub(r"Traceback \(most recent call last\):$", ours[-1].split(": ", 1)[1], text)
    elif len(lines) > 1:
        text += " " + "; ".join(lines[1:4])
    return re.sub(r"\[\w+\.(cpp|h):\d+\] ", "", text)


def _check_inside(file: Path, parameters: dict[str, Any]) -> None:
    """Raise InputError where a Mitsuba scene, or a file it includes, names a file outside the scene's folder."""
    folder, seen, waiting = file.parent.resolve(), set(), [file.resolve()]
    while waiting:
        current = waiting.pop()
        if current in seen:
            continue
        seen.add(current)
        try:
            root = ElementTree.parse(current).getroot()
        except (ElementTree.ParseError, OSError, ValueError) as error:
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
                exists = target.exists()
            except (OSError, ValueError):  # no file's name, such as a long or odd string
                continue
            if exists and not target.is_relative_to(folder):
                what = f"'{name}' lies outside the scene's folder {folder}"
                raise InputError(what, str(current), "copy it there, or use --allow-outside")
            if element.tag == "include" and exists:
                waiting.append(target)


def render(
    request: Request,
    report: Callable[[Progress], None] = lambda progress: None,
    notice: Callable[[], None] = lambda: None,
) -> Result:
    """Render a scene to a file; on Ctrl-C or at the time limit, the picture so far.

    report  called after each pass
    notice  called at the first Ctrl-C, from another thread
    """
    started = time.perf_counter()
    with Interrupts(notice) as interrupts:  # from here on: an import that is interrupted half-way can crash
        prepared = prepare(request)
        interrupts.check()
        width, height = prepared.size
        stopped = run(
            prepared.render,
            prepared.spp,
            width * height,
            timeout=request.timeout,
            report=report,
            interrupted=lambda: interrupts.asked,
        )
    picture = finished(prepared.render, request.denoise)
    settings = prepared.settings | {"spp": prepared.render.done}
    if stopped:
        settings |= {"stopped": stopped, "wanted_spp": prepared.spp}
    seconds = time.perf_counter() - started
    images.write(prepared.output, picture, settings | {"seconds": round(seconds, 2)}, request.exposure)
    return Result(
        prepared.output,
        prepared.render.done,
        prepared.spp,
        prepared.size,
        seconds,
        stopped,
        settings,
        prepared.warnings,
    )


def finished(render: Renders, denoised: bool) -> np.ndarray:
    """The picture, denoised where asked."""
    picture = render.image()
    if not denoised:
        return picture
    guides = render.aov()
    return denoise.denoise(picture, guides.get("albedo"), guides.get("normal"))
