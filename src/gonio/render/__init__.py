"""Render scenes: prepare a render, run it, and write checkpoints and picture files."""

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

    scene          a folder or .json file of a scene, a Mitsuba .xml file, or a material, as for `go.material`, which is
                   shown on a ball. Options below that are None have the values in the scene
    output         file to write: .exr, .hdr, .png or .npz; None writes no file
    spp            samples per pixel
    size           width and height of the film, pixels
    integrator     "direct", "path", "caustics", "light", "whitted", "normal", ..., or a class, "ao.py:Occlusion"
    max_depth      maximum path length in segments, for the integrators "path", "caustics" and "light"
    sampler        source of the random numbers, such as "sobol"
    seed           seed of the random numbers; equal seeds give bit-identical pictures
    device         "cpu", "cuda" or "auto"
    spectral       whether to trace wavelengths instead of red, green and blue: glass disperses, lamps have spectra
    threads        number of CPU cores to use; None uses all
    timeout        time in seconds after which the render stops and the unfinished picture is returned
    denoise        whether to denoise the picture with Open Image Denoise
    exposure       exposure of a .png file in stops; "auto" derives it from the luminance of the picture
    allow_outside  whether the scene may read files outside its folder
    allow_code     whether the scene may run materials in Python files, such as "ward.py:Ward", and native Mitsuba
                   plugins in its folder `plugins`
    overrides      values by their paths in the scene, as in `gonio study`; a value may be a material
    checkpoint     file for the accumulated samples, written every few seconds. If it exists, the render continues from
                   it, with bit-identical results. None writes one next to the output after a minute of rendering
    until_error    render until the estimated relMSE of the picture is below this value, with at most `spp` samples per
                   pixel (65,536 if None); a warning is issued if these do not suffice
    gradient       paths of numbers and colors of materials ("....albedo.r" is one channel). The result then contains
                   the picture and its derivatives, (1 + paths, height, width, 3). Equal materials count as one
    Warns (GonioWarning) about suspicious scenes, about clipping in a .png, and if the render continues from a
    checkpoint. Raises InputError for an invalid scene or option, MachineError if this machine cannot render it.
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
    """The path of a scene and None, or the name of a material and the material. The argument may be a string."""
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
    """Continue a render from its checkpoint. The picture is bit-identical to that of an uninterrupted `go.render`.

        picture = go.resume("phong.exr.checkpoint", spp=1024)

    output      file to write. None writes the output file named in the original request, if any. If this file is not in
                the folder of the checkpoint, a file of the same name next to the checkpoint is written instead, with a
                warning
    spp         total number of samples per pixel; None uses the number in the original request
    threads     number of CPU cores to use; None uses all
    timeout     time in seconds after which the render stops and the unfinished picture is returned
    allow_code  whether the scene may run the Python files that it names
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
    """Render the picture, write it if the request names an output, and issue warnings at stack level `level`."""
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
