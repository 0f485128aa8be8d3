"""One render from a scene's file to a picture on disk."""

from __future__ import annotations

import os
import re
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import __version__
from ..errors import InputError, did_you_mean
from . import denoise, engine, exposures, images, mitsuba_scene
from .passes import Interrupts, Progress, Renders, run

if TYPE_CHECKING:
    from . import integrators

# Per pixel: 9 sums in float64, twice (before and after a pass), lane order, picture as float64 and float32, the
# file's bytes. It is the estimate by which a film is refused as too large.
BYTES_PER_PIXEL = 250


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
    exposure: exposures.Exposure = 0.0
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
        exposures.check(self.exposure)
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
    """What came of a render; `stopped` is "", "interrupt" or "timeout", `spp` what was done, `exposure` a .png's."""

    output: Path
    spp: int
    wanted_spp: int
    size: tuple[int, int]
    seconds: float
    stopped: str
    settings: dict[str, images.Value]
    warnings: tuple[str, ...]
    exposure: float | None = None

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
    scene = mitsuba_scene.load(request, mi)
    output = request.output or Path(request.scene.stem + ".exr")
    images.check_writable(output)
    sensor = scene.sensors()[0]
    spp = request.spp or int(sensor.sampler().sample_count())
    width, height = (int(n) for n in sensor.film().crop_size())
    check_film((width, height), str(request.scene))
    if request.integrator is not None:
        settings = _settings(request, "path", None, "default", None)
        render: Renders = integrators.Render(scene, settings, aovs=request.denoise)
        metadata = _metadata(request, mi, settings)
    else:
        seed = _first(request.seed, 0)
        render = mitsuba_scene.MitsubaRender(mi, scene, spp, seed)
        own = SimpleNamespace(
            integrator=f"mitsuba:{scene.integrator().class_name()}",
            sampler=f"mitsuba:{sensor.sampler().class_name()}",
            seed=seed,
        )
        metadata = _metadata(request, mi, own)
    return Prepared(render, spp, (width, height), output, metadata)


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
    shown = images.show(prepared.output, picture, settings | {"seconds": round(seconds, 2)}, request.exposure)
    return Result(
        prepared.output,
        prepared.render.done,
        prepared.spp,
        prepared.size,
        seconds,
        stopped,
        settings,
        (*prepared.warnings, *filter(None, [shown.notice])),
        shown.exposure,
    )


def finished(render: Renders, denoised: bool) -> np.ndarray:
    """The picture, denoised where asked."""
    picture = render.image()
    if not denoised:
        return picture
    guides = render.aov()
    return denoise.denoise(picture, guides.get("albedo"), guides.get("normal"))
