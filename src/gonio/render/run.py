"""One render from a scene's file to a picture on disk."""

from __future__ import annotations

import inspect
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .._version import __version__
from ..errors import InputError, did_you_mean
from ..work import crew, facts, garbage
from . import checkpoints, denoise, engine, images, mitsuba_scene
from .checkpoints import Keeper, Sources
from .passes import Interrupts, Progress, Renders, run
from .request import UNTIL_MOST, Request, check_film, parse_size

if TYPE_CHECKING:
    from . import integrators, until
    from .integrators import Settings
    from .types import Scene

__all__ = ["Prepared", "Request", "Result", "finished", "parse_size", "prepare", "render", "run"]


@dataclass(frozen=True)
class Prepared:
    """A scene loaded and ready to advance."""

    request: Request
    render: Renders
    spp: int
    size: tuple[int, int]
    output: Path
    settings: dict[str, images.Value]
    sources: Sources
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class Result:
    """What came of a render; `stopped` is "", "interrupt" or "timeout", `spp` what was done, `exposure` a .png's.

    error       relMSE of the picture as it is estimated, where it was rendered until an error
    signal      the number of the signal that interrupted it, 0 where none did
    checkpoint  file from which it goes on, None where there is none
    """

    output: Path
    spp: int
    wanted_spp: int
    size: tuple[int, int]
    seconds: float
    stopped: str
    settings: dict[str, images.Value]
    warnings: tuple[str, ...]
    exposure: float | None = None
    signal: int = 0
    checkpoint: Path | None = None
    error: float | None = None

    def as_dict(self) -> dict[str, object]:
        checkpoint = None if self.checkpoint is None else str(self.checkpoint)
        return {**asdict(self), "output": str(self.output), "checkpoint": checkpoint}


def prepare(request: Request) -> Prepared:
    """Read the scene, start Mitsuba, make the render; raises InputError or MachineError."""
    request.check()
    if request.material is None and not request.scene.exists():
        raise InputError("no such scene", str(request.scene), _nearby(request.scene))
    mi = engine.load(request.device, request.spectral, request.threads)
    with garbage.kept():
        if request.material is None and request.scene.suffix.lower() == ".xml" and request.scene.is_file():
            return _prepare_mitsuba(request, mi)
        return _prepare_lab(request, mi)


def _nearby(path: Path) -> str:
    parent = path.parent
    if not parent.is_dir():
        return f"the folder '{parent}' does not exist"
    near = [x.name for x in parent.iterdir() if x.suffix in (".json", ".xml") or (x / "scene.json").is_file()]
    return did_you_mean(path.name, near) if near and len(near) <= 20 else "give a folder, a .json or a .xml"


def _prepare_lab(request: Request, mi: ModuleType) -> Prepared:
    from . import integrators, polarizer, scene

    overrides: dict[str, object] = dict(request.overrides)
    if request.size is not None:
        overrides["/camera/film/size"] = [*request.size]
    if request.material is not None:
        description = scene.of_material(request.material, overrides)
    else:
        description = scene.read(
            request.scene, allow_outside=request.allow_outside, allow_code=request.allow_code, overrides=overrides
        )
    of_scene = integrators.Settings(
        integrator=description.integrator.type,
        max_depth=description.integrator.max_depth or integrators.Settings.max_depth,
        sampler=description.sampler.preference,
        seed=description.seed or 0,
        ambient=description.ambient,
    )
    settings = _settings(of_scene, request)
    output = request.output or Path(description.output.filename)
    images.check_writable(output)
    spp, degrees, how = _most(request, description.spp), description.camera.polarizer, _own(settings)
    if degrees is not None:
        polarizer.check(settings, description.where("/camera/polarizer"))
        if request.until_error is not None or request.gradient:
            what = "a picture through a polarizer is by Mitsuba's path tracer, which tells no error and no derivative"
            option = "gradient" if request.gradient else "--until-error"
            raise InputError(what, option, "leave the polarizer out")
        mi.set_variant(engine.polarized(str(mi.variant())))
        how |= {"integrator": "mitsuba:stokes", "sampler": "mitsuba:independent", "polarizer": degrees}
    built = scene.built(description, mi, gathers=not request.gradient)
    render: Renders
    if request.gradient:
        from .gradients import Gradients, along

        render = Gradients(built.scene, settings, [along(description, built, path) for path in request.gradient])
    elif degrees is None:
        render = _drawing(built.scene, settings, request)
    else:
        render = polarizer.PolarizedRender(mi, built.scene, spp, settings, degrees)
    return Prepared(
        request,
        render,
        spp,
        description.camera.film.size,
        output,
        _metadata(request, mi, **how),
        Sources.of(mi, *scene.sources(description), _how(settings, request)),
        (*description.warnings, *_advice(render)),
    )


def _drawing(built: Scene, settings: Settings, request: Request) -> integrators.Render | until.Until:
    """A render by one of Gonio's own integrators."""
    from . import integrators, until

    if request.until_error is None:
        return integrators.Render(built, settings, aovs=request.denoise)
    return until.Until(built, settings, request.until_error, _most(request, 0), aovs=request.denoise)


def _most(request: Request, spp: int) -> int:
    """Samples per pixel: those asked for, those of the scene, or a bound where the error says how many."""
    return request.spp or (spp if request.until_error is None else UNTIL_MOST)


def estimated(prepared: Prepared) -> tuple[float | None, str]:
    """The relMSE of the picture so far, where it is rendered until an error, and what is to be known of it."""
    wanted = prepared.request.until_error
    if wanted is None:
        return None, ""
    error = prepared.render.estimate()  # type: ignore[attr-defined]  # of an Until
    if error <= wanted:
        return error, ""
    if not math.isfinite(error):
        return None, "too few samples to tell the relMSE"
    done = f"{prepared.render.done} samples per pixel"
    return error, f"relMSE is estimated to be {error:.3g} after {done}, {wanted:g} was asked for"


def _advice(render: Renders) -> list[str]:
    """What to tell of the integrator that was chosen."""
    text = getattr(render, "advice", "")
    return [text] if text else []


def _how(settings: Settings | None, request: Request, **more: images.Value) -> str:
    """The settings that a picture depends on, in words."""
    ours = {} if settings is None else {**asdict(settings), "program": _code_of(settings.program)}
    others: dict[str, images.Value] = {**more, "features": request.denoise}
    if request.until_error is not None:
        others["until_error"] = request.until_error
    if request.gradient:
        others["gradient"] = ", ".join(request.gradient)
    return ", ".join(f"{name} {value}" for name, value in {**ours, **others}.items())


def _code_of(program: type) -> str:
    """A hash of the file of an integrator that is not Gonio's, its name where it is or where there is no file."""
    if program.__module__.startswith("gonio."):
        return program.__name__
    try:
        return facts.file_hash(Path(inspect.getsourcefile(program) or ""))
    except TypeError:
        return program.__qualname__


def _settings(scene: Settings, request: Request) -> Settings:
    """The command line's wishes over the scene's."""
    from .integrators.base import Integrator, check_sampler

    if request.integrator is not None:
        Integrator.family.get(request.integrator, "--integrator")
    if request.sampler is not None:
        check_sampler(request.sampler, "--sampler")
    return replace(
        scene,
        integrator=request.integrator or scene.integrator,
        max_depth=request.max_depth or scene.max_depth,
        sampler=request.sampler or scene.sampler,
        seed=scene.seed if request.seed is None else request.seed,
    )


def _own(settings: Settings) -> dict[str, images.Value]:
    """What a picture says about one of our own integrators."""
    from . import sampler

    found: dict[str, images.Value] = {
        "integrator": settings.integrator,
        "sampler": " and ".join(sampler.DEFAULT) if settings.sampler == "default" else settings.sampler,
        "seed": settings.seed,
    }
    return found | ({"max_depth": settings.max_depth} if settings.program.takes_depth else {})


def _metadata(request: Request, mi: ModuleType, **how: images.Value) -> dict[str, images.Value]:
    """What a picture says about how it was made."""
    found: dict[str, images.Value] = {
        "scene": str(request.scene),
        **how,
        "variant": str(mi.variant()),
        "version": f"gonio {__version__}, mitsuba {mi.__version__}",
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    if request.until_error is not None:
        found["until_error"] = request.until_error
    if request.denoise:
        found["denoised"] = f"OIDN, pyoidn {denoise.available()}"
    return found


def _prepare_mitsuba(request: Request, mi: ModuleType) -> Prepared:
    from . import adapter, integrators, lights

    if request.integrator is None:
        options = {"--max-depth": request.max_depth, "--sampler": request.sampler}
        for option, value in {**options, "--until-error": request.until_error}.items():
            if value is not None:
                what = "a Mitsuba scene's own integrator does not take this option"
                raise InputError(what, option, "add --integrator path (or direct), or change it in the .xml")
    if request.gradient:
        what = "a Mitsuba scene, and derivatives are along values of a scene of Gonio's format"
        raise InputError(what, "gradient", "give a folder or a .json")
    adapter.register(mi)
    lights.register(mi)
    text = mitsuba_scene.read(request)
    scene = mitsuba_scene.load(request, text, mi)
    output = request.output or Path(request.scene.stem + ".exr")
    images.check_writable(output)
    sensor = scene.sensors()[0]
    files = mitsuba_scene.sources(text, request.overrides)
    spp = _most(request, int(sensor.sampler().sample_count()))
    width, height = (int(n) for n in sensor.film().crop_size())
    check_film((width, height), str(request.scene))
    if request.integrator is not None:
        settings = _settings(integrators.Settings(), request)
        render: Renders = _drawing(scene, settings, request)
        how, all_ = _own(settings), _how(settings, request)
    else:
        seed = request.seed or 0
        render = mitsuba_scene.MitsubaRender(mi, scene, spp, seed)
        how = {
            "integrator": f"mitsuba:{scene.integrator().class_name()}",
            "sampler": f"mitsuba:{sensor.sampler().class_name()}",
            "seed": seed,
        }
        all_ = _how(None, request, **how)
    all_ += f", size {width}x{height}"
    sources = Sources.of(mi, *files, all_)
    about = _metadata(request, mi, **how)
    return Prepared(request, render, spp, (width, height), output, about, sources, tuple(_advice(render)))


def work(
    prepared: Prepared,
    *,
    temporary: Path | None = None,
    long: float | None = None,
    report: Callable[[Progress], None] = lambda progress: None,
    interrupted: Callable[[], object] = lambda: False,
    tell: Callable[[str], None] = lambda text: None,
) -> tuple[str, Keeper]:
    """Advance a render to its samples, from where an earlier run left it: why it ended, as `run` has it, and the keeper
    of its checkpoints, which is told when the picture is written.

    temporary  the checkpoint of a long job whose request names none
    long       seconds that such a job must take; a minute where None
    tell       called at the start with what was found
    """
    from . import integrators, tiles, until

    request, (width, height) = prepared.request, prepared.size
    path = request.checkpoint or temporary
    unasked = request.checkpoint is None
    if path is not None:
        found, unasked = checkpoints.earlier(path, prepared, unasked)
        if found:
            tell(found)
    gathered = None
    goal: int | Callable[[], int] = prepared.spp
    if isinstance(prepared.render, until.Until):
        drawing = prepared.render
        goal = lambda: drawing.goal  # noqa: E731
        if crew.current().size > 1:
            what = "workers render parts of a picture, and its error is that of the whole"
            raise InputError(what, "--until-error", "leave --workers or the cluster out, or give --spp in its place")
    elif crew.current().size > 1 and prepared.render.done < prepared.spp:
        tiles.travelling(prepared)  # what cannot travel is said before anything is written
        assert isinstance(prepared.render, integrators.Render)
        gathered = tiles.Gathered(prepared.render, prepared.spp)
    keeper = Keeper(path, prepared if gathered is None else replace(prepared, render=gathered), unasked, long)

    def after(progress: Progress) -> None:
        keeper.after_pass(progress)
        report(progress)

    try:
        if gathered is not None:
            stopped = tiles.advance(
                [(prepared, gathered)], report=after, interrupted=interrupted, timeout=request.timeout
            )
            gathered.give()
        else:
            stopped = run(
                prepared.render,
                goal,
                width * height,
                timeout=request.timeout,
                report=after,
                interrupted=interrupted,
            )
        keeper.end(bool(stopped))
    finally:
        keeper.close()
    return stopped, keeper


def by_crew(
    prepared: Sequence[Prepared],
    *,
    interrupted: Callable[[], object] = lambda: False,
    finished: Callable[[int], None] = lambda index: None,
) -> str:
    """Have the crew do several renders at once; `finished` is called with the number of each that is done."""
    from . import integrators, tiles

    jobs = []
    for one in prepared:
        tiles.travelling(one)
        assert isinstance(one.render, integrators.Render)
        jobs.append((one, tiles.Gathered(one.render, one.spp)))

    def give(number: int) -> None:
        jobs[number][1].give()
        finished(number)

    return tiles.advance(jobs, report=lambda progress: None, interrupted=interrupted, finished=give)


def render(
    request: Request,
    report: Callable[[Progress], None] = lambda progress: None,
    notice: Callable[[], None] = lambda: None,
    tell: Callable[[str], None] = lambda text: None,
) -> Result:
    """Render a scene to a file; on Ctrl-C, SIGTERM and SIGHUP or at the time limit, the picture so far.

    report  called after each pass
    notice  called at the first of these signals, from another thread
    tell    called at the start with what an earlier run has left
    """
    started = time.perf_counter()
    with Interrupts(notice) as interrupts:  # from here on: an import that is interrupted half-way can crash
        prepared = prepare(request)
        interrupts.check()
        beside = checkpoints.beside(prepared.output)
        stopped, keeper = work(
            prepared, temporary=beside, report=report, interrupted=lambda: interrupts.asked, tell=tell
        )
        picture = finished(prepared.render, request.denoise)
        settings = prepared.settings | {"spp": prepared.render.done}
        error, unmet = estimated(prepared)
        if error is not None:
            settings |= {"estimated_error": round(error, 12)}
        if stopped:
            settings |= {"stopped": stopped, "wanted_spp": prepared.spp}
        seconds = time.perf_counter() - started
        shown = images.show(prepared.output, picture, settings | {"seconds": round(seconds, 2)}, request.exposure)
        if not stopped:
            keeper.remove()
    failed = f"no checkpoint was written: {keeper.error.what}" if keeper.error else ""
    return Result(
        prepared.output,
        prepared.render.done,
        prepared.spp,
        prepared.size,
        seconds,
        stopped,
        settings,
        (*prepared.warnings, *filter(None, [unmet, shown.notice, failed])),
        shown.exposure,
        interrupts.asked if stopped == "interrupt" else 0,
        keeper.path if keeper.written else None,
        error,
    )


def with_slopes(prepared: Prepared, picture: NDArray[np.float32]) -> NDArray[np.float32]:
    """The picture, and its derivatives below it: (1 + paths, height, width, 3)."""
    return np.stack([picture, *prepared.render.slopes()])  # type: ignore[attr-defined]  # of Gradients


def finished(render: Renders, denoised: bool) -> NDArray[np.float32]:
    """The picture, denoised where asked."""
    picture = render.image()
    if not denoised:
        return picture
    guides = render.aov()
    return denoise.denoise(picture, guides.get("albedo"), guides.get("normal"))
