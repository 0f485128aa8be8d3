"""From scene to picture: prepare a render, run it, write checkpoints and image files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

from ..owner import public
from .options import RenderKeywords, takes_render_options

if TYPE_CHECKING:
    from ..catalog.material import MaterialLike
    from ..material import BSDF
    from ..pictures.exposures import RGB
    from .request import Request


@public
@takes_render_options
def render(
    scene: MaterialLike,
    *,
    output: str | Path | None = None,
    timeout: float | None = None,
    overrides: Mapping[str, object] | None = None,
    checkpoint: str | Path | None = None,
    until_error: float | None = None,
    gradient: Sequence[str] = (),
    **options: Unpack[RenderKeywords],
) -> RGB:
    """Render a scene, or a material on a ball, to a (height, width, 3) float32 picture: linear radiance, row 0 on top.

        picture = go.render("examples/phong", spp=64, overrides={"shapes.1.material.p": 16})
        picture = go.render("gold.json")        # the result of a fit, on a ball
        picture, slope = go.render("examples/conductor-ggx", gradient=["shapes.0.material.alpha"])

    scene          a scene's folder or .json, a Mitsuba .xml, or a material, as `go.material` takes it, which is shown
                   on a ball; an option below that is None has the scene's value
    output         file to write: .exr, .hdr, .png or .npz; None writes nothing
    spp            samples per pixel
    size           width and height of the film, pixels
    integrator     "direct", "path", "caustics", "light", "whitted", "normal", ...
    max_depth      maximum path length in segments, for the integrators "path", "caustics" and "light"
    sampler        source of the random numbers, such as "sobol"
    seed           seed of the random numbers; the same seed gives a bit-identical picture
    device         "cpu", "cuda" or "auto"
    spectral       trace wavelengths instead of red, green and blue: glass disperses, and lamps have their spectra
    threads        CPU cores to use; None uses all
    timeout        seconds after which the render stops and returns the picture so far
    denoise        denoise the result with Open Image Denoise
    exposure       brightness of a .png in stops; "auto" chooses it from the picture's luminance
    allow_outside  allow the scene to read files outside its folder
    allow_code     allow the scene to run materials in Python files, "ward.py:Ward", and native Mitsuba plugins in its
                   folder `plugins`
    overrides      values by their paths in the scene, as in `gonio study`; a value may be a material
    checkpoint     file for the sums so far, written every few seconds; if it exists, the render continues from it, with
                   bit-identical results. None writes one next to the output if the render takes more than a minute
    until_error    render until the estimated relMSE of the picture is below this value, using at most `spp` samples per
                   pixel (65,536 if None); warns if these do not suffice
    gradient       paths of numbers and colors of materials ("....albedo.r" is one channel); the result is the picture
                   and its derivatives, (1 + paths, height, width, 3). Equal materials are differentiated together
    Warns (GonioWarning) about suspicious scenes, about a .png that clips, and when it continues from a checkpoint.
    Raises InputError for an invalid scene or option, MachineError if this machine cannot render it.
    """
    from .request import Request

    path, material = _shown(scene, options.get("allow_code", False))
    request = Request(
        path,
        output=_path(output),
        timeout=timeout,
        overrides=overrides or {},
        material=material,
        checkpoint=_path(checkpoint),
        until_error=until_error,
        gradient=tuple(gradient),
        **options,
    )
    return _picture(request, level=5)  # past the checks and the lock


def _path(named: str | Path | None) -> Path | None:
    return None if named is None else Path(named)


def _shown(scene: MaterialLike, allow_code: bool) -> tuple[Path, BSDF | None]:
    """(path of a scene, None), or (name of a material, the material), which may be given as a string."""
    from ..catalog import notation, operands
    from ..catalog.material import material

    if isinstance(scene, str | Path):
        accepted = {operands.Kind.SCENE, *operands.MATERIALS}
        if operands.kind_of(scene, accepted, "render: scene") is operands.Kind.SCENE:
            return Path(scene), None
        shown = notation.named(str(scene), allow_code=allow_code)[0]
    else:
        shown = material(scene)
    return Path(shown.name), shown


@public
def resume(
    checkpoint: str | Path,
    *,
    output: str | Path | None = None,
    spp: int | None = None,
    threads: int | None = None,
    timeout: float | None = None,
    allow_code: bool = False,
) -> RGB:
    """Continue a render from its checkpoint; the picture is bit-identical to that of an uninterrupted `go.render`.

        picture = go.resume("phong.exr.checkpoint", spp=1024)

    output      file to write. None writes to the output of the original request, if it named one, provided that this
                file is in the checkpoint's folder; otherwise to a file of that name next to the checkpoint, with a
                warning
    spp         samples per pixel in total; None uses the number of the original request
    threads     CPU cores to use; None uses all
    timeout     seconds after which the render stops and returns the picture so far
    allow_code  allow the scene to run the Python files that it names
    Raises InputError if the checkpoint is damaged or if anything that the picture depends on has changed.
    """
    from . import checkpoints
    from .request import Request

    change = Request(
        Path(),
        output=_path(output),
        spp=spp,
        threads=threads,
        timeout=timeout,
    )
    change.check()
    request, notice = checkpoints.asked_again(Path(checkpoint), change, allow_code)
    return _picture(request, 5, notice)


def _picture(request: Request, level: int, notice: str = "") -> RGB:
    """Render the picture, write it if an output is named, and issue all warnings at the caller `level` frames up."""
    import warnings

    from ..bridge import engine
    from ..errors import GonioWarning
    from ..pictures import images
    from . import checkpoints, finish
    from .execute import execute
    from .prepare import prepare

    notices = [notice] if notice else []
    output, exposure = request.output, request.exposure
    with engine.put_back():
        prepared = prepare(request)
        notices += prepared.warnings
        checkpoint = None if output is None else checkpoints.default_path(output)
        stopped, keeper = execute(prepared, temporary=checkpoint, tell=notices.append)
        picture = finish.picture_of(prepared.render, request.denoise, output)
        error, unmet = finish.estimated(prepared)
        notices += filter(None, [unmet])
        if output is not None:
            settings = prepared.settings | {"spp": prepared.render.done}
            settings |= {} if error is None else {"estimated_error": error}
            notices += filter(None, [images.write_exposed(output, picture, settings, exposure).notice])
    if not stopped:
        keeper.remove()
    if keeper.error:
        notices.append(f"no checkpoint was written: {keeper.error.what}")
    for notice in notices:
        warnings.warn(notice, GonioWarning, stacklevel=level)
    return picture if not request.gradient else finish.with_slopes(prepared, picture)
