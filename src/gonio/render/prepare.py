"""Prepare a render: read the scene of a request, load Mitsuba, and create the integrator."""

from __future__ import annotations

import inspect
import os
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from .. import garbage
from .._version import __version__
from ..bridge import engine
from ..errors import InputError, did_you_mean
from ..material import user_code
from ..pictures import denoise, images
from ..scene import mitsuba_scene
from ..scene.film_size import check_film
from ..transport.mitsuba_render import MitsubaRender
from ..transport.passes import Renders
from ..work import facts
from .identity import Sources
from .request import MAX_SPP_UNTIL, Request

if TYPE_CHECKING:
    from ..bridge.types import Scene
    from ..transport import integrators, until
    from ..transport.integrators import Settings


@dataclass(frozen=True)
class Prepared:
    """A render that is ready to start, with its loaded scene and settings."""

    request: Request
    render: Renders
    spp: int
    size: tuple[int, int]
    output: Path
    settings: dict[str, images.Value]
    sources: Sources
    warnings: tuple[str, ...] = ()


def prepare(request: Request, writes: bool = False) -> Prepared:
    """Read the scene, load Mitsuba and create the render. Raises InputError or MachineError.

    writes  whether the picture will be written to a file: the one in the request, or else the one that the scene names
    """
    request.check()
    if request.material is None and not os.path.exists(request.scene):
        raise InputError("no such scene", str(request.scene), _nearby(request.scene))
    mi = engine.load(request.device, request.spectral, request.threads)
    with garbage.paused():
        if request.is_mitsuba:
            prepared = _prepare_mitsuba(request, mi)
        else:
            prepared = _prepare_lab(request, mi, names_output=writes and request.output is None)
    if writes:
        images.check_writable(prepared.output)
    return prepared


def _nearby(path: Path) -> str:
    parent = path.parent
    if not os.path.isdir(parent):  # unlike Path.is_dir, False for a name that is too long
        return f"the folder '{parent}' does not exist"
    try:
        near = [x.name for x in parent.iterdir() if x.suffix in (".json", ".xml") or (x / "scene.json").is_file()]
    except OSError:  # no permission to list the folder
        near = []
    return did_you_mean(path.name, near) if near and len(near) <= 20 else "give a folder, a .json or a .xml"


def _prepare_lab(request: Request, mi: ModuleType, names_output: bool) -> Prepared:
    from .. import scene
    from ..transport import integrators, polarizer

    overrides: dict[str, object] = dict(request.overrides)
    if request.size is not None:
        overrides["/camera/film/size"] = [*request.size]
    if request.material is not None:
        description = scene.of_material(request.material, overrides)
    else:
        description = scene.read(
            request.scene,
            allow_outside=request.allow_outside,
            allow_code=request.allow_code,
            overrides=overrides,
            names_output=names_output,
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
    spp, degrees, how = _most(request, description.spp), description.camera.polarizer, _own(settings)
    if degrees is not None:
        polarizer.check(settings, description.where("/camera/polarizer"))
        if request.until_error is not None or request.gradient:
            what = "scenes with a polarizer are rendered by Mitsuba, without error estimate and derivatives"
            option = "gradient" if request.gradient else "--until-error"
            raise InputError(what, option, "leave the polarizer out")
        mi.set_variant(engine.polarized(str(mi.variant())))
        how |= {"integrator": "mitsuba:stokes", "sampler": "mitsuba:independent", "polarizer": degrees}
    built = scene.built(description, mi, merge_materials=not request.gradient)
    render: Renders
    if request.gradient:
        from ..scene.derivatives import along
        from ..transport.gradients import Gradients

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
    """Create a render with one of Gonio's own integrators."""
    from ..transport import integrators, until

    if request.until_error is None:
        return integrators.Render(built, settings, aovs=request.denoise)
    return until.Until(built, settings, request.until_error, _most(request, 0), aovs=request.denoise)


def _most(request: Request, spp: int) -> int:
    """The number of samples per pixel: that of the request or the scene, or the limit for a render until an error."""
    return request.spp or (spp if request.until_error is None else MAX_SPP_UNTIL)


def _advice(render: Renders) -> list[str]:
    """Notices about the chosen integrator."""
    text = getattr(render, "advice", "")
    return [text] if text else []


def _how(settings: Settings | None, request: Request, **more: images.Value) -> str:
    """The settings on which a picture depends, as a string."""
    ours = {} if settings is None else {**asdict(settings), "program": _code_of(settings.program)}
    others: dict[str, images.Value] = {**more, "features": request.denoise}
    if request.until_error is not None:
        others["until_error"] = request.until_error
    if request.gradient:
        others["gradient"] = ", ".join(request.gradient)
    return ", ".join(f"{name} {value}" for name, value in {**ours, **others}.items())


def _code_of(program: type) -> str:
    """A hash of the source file of a user's integrator; the name of an integrator that is Gonio's or has no file."""
    if program.__module__.startswith("gonio."):
        return program.__name__
    try:
        return facts.file_hash(Path(inspect.getsourcefile(program) or ""))
    except TypeError:
        return program.__qualname__


def _settings(scene: Settings, request: Request) -> Settings:
    """The settings of the scene, overridden by those of the request."""
    from ..transport.integrators.base import Integrator, check_sampler

    chosen = user_code.option(request.integrator, "--integrator", Integrator.family)
    if chosen is not None:
        Integrator.family.get(chosen, "--integrator")
    if request.sampler is not None:
        check_sampler(request.sampler, "--sampler")
    integrator = chosen or scene.integrator
    if request.max_depth is not None and not (family := Integrator.family).get(integrator).takes_depth:
        deep = ", ".join(name for name, member in family.all().items() if member.takes_depth)
        what = f"integrator '{integrator}' has no maximum depth"
        raise InputError(what, "--max-depth", f"leave it out, or choose one of {deep}")
    return replace(
        scene,
        integrator=integrator,
        max_depth=request.max_depth or scene.max_depth,
        sampler=request.sampler or scene.sampler,
        seed=scene.seed if request.seed is None else request.seed,
    )


def _own(settings: Settings) -> dict[str, images.Value]:
    """The metadata of a picture rendered with one of Gonio's own integrators."""
    from ..transport import sampler

    metadata: dict[str, images.Value] = {
        "integrator": settings.integrator,
        "sampler": " and ".join(sampler.DEFAULT) if settings.sampler == "default" else settings.sampler,
        "seed": settings.seed,
    }
    return metadata | ({"max_depth": settings.max_depth} if settings.program.takes_depth else {})


def _metadata(request: Request, mi: ModuleType, **how: images.Value) -> dict[str, images.Value]:
    """The metadata that record how a picture was rendered."""
    metadata: dict[str, images.Value] = {
        "scene": str(request.scene),
        **how,
        "variant": str(mi.variant()),
        "version": f"gonio {__version__}, mitsuba {mi.__version__}",
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    if request.until_error is not None:
        metadata["until_error"] = request.until_error
    if request.denoise:
        metadata["denoised"] = f"OIDN, pyoidn {denoise.available()}"
    return metadata


def _prepare_mitsuba(request: Request, mi: ModuleType) -> Prepared:
    from ..bridge import adapter
    from ..transport import integrators
    from ..transport.lights import lights

    if request.integrator is None:
        options = {"--max-depth": request.max_depth, "--sampler": request.sampler}
        for option, value in {**options, "--until-error": request.until_error}.items():
            if value is not None:
                what = "a Mitsuba scene's own integrator does not take this option"
                raise InputError(what, option, "add --integrator path (or direct), or change it in the .xml")
    if request.gradient:
        what = "derivatives of a Mitsuba scene are not supported, only those of scenes in Gonio's format"
        raise InputError(what, "gradient", "give a folder or a .json")
    adapter.register(mi)
    lights.register(mi)
    text = mitsuba_scene.read(request.scene, request.overrides, request.allow_outside, request.allow_code)
    scene = mitsuba_scene.load(mi, request.scene, text, size=request.size, own_integrator=request.integrator is None)
    output = request.output or Path(request.scene.stem + ".exr")
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
        render = MitsubaRender(mi, scene, spp, seed)
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
