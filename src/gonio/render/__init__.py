"""Scenes to pictures: the machine, Mitsuba, the lab's scene format, integrators, image files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

from ..owner import public
from .options import RenderKeywords, takes_render_options

if TYPE_CHECKING:
    from ..material import BSDF
    from ..pictures.exposures import RGB
    from .request import Request


@public
@takes_render_options
def render(
    scene: str | Path | BSDF,
    *,
    output: str | Path | None = None,
    timeout: float | None = None,
    overrides: Mapping[str, object] | None = None,
    checkpoint: str | Path | None = None,
    until_error: float | None = None,
    gradient: Sequence[str] = (),
    **options: Unpack[RenderKeywords],
) -> RGB:
    """Render a scene, or a material on a ball: the picture, (height, width, 3) float32, linear radiance, row 0 on top.

        picture = go.render("examples/phong", spp=64, overrides={"shapes.1.material.p": 16})
        picture = go.render("gold.json")        # what a fit found, on a ball
        picture, slope = go.render("examples/conductor-ggx", gradient=["shapes.0.material.alpha"])

    scene          the lab's folder or .json, a Mitsuba .xml, or a material or its text, which is shown on a ball; what
                   is None below is as the scene says
    output         file to write, .exr, .hdr, .png or .npz; None writes nothing
    spp            samples per pixel
    size           width and height of the film, pixels
    integrator     "direct", "path", "caustics", "light", "whitted", "normal", ...
    max_depth      longest path, segments, for the integrators "path", "caustics" and "light"
    sampler        where random numbers come from, such as "sobol"
    seed           same seed, same picture, to the bit
    device         "cpu", "cuda" or "auto"
    spectral       light as wavelengths in place of red, green and blue: glass disperses, lamps have their spectra
    threads        CPU cores to use, all where None
    timeout        seconds, after which the picture so far is the picture
    denoise        run Open Image Denoise over the result
    exposure       of a .png: stops, or "auto" for one chosen by the picture's luminance
    allow_outside  let the scene read files outside its folder
    allow_code     let the scene name materials in Python files, "ward.py:Ward", and native plugins of Mitsuba in its
                   folder `plugins`, which then run
    overrides      values by their path in the scene, as `gonio study` varies them; materials too
    checkpoint     file for the sums so far, written every few seconds; where it is there, the render goes on from it,
                   to the same bits. None: beside the output, where the render takes over a minute
    until_error    render until the picture's relMSE is estimated to be below this, within `spp` samples per pixel, or
                   65,536; warns where that was too few
    gradient       paths of numbers and colours of materials: what is returned is then (1 + paths, height, width, 3):
                   the picture, and its derivative along each; of a colour along all three channels together, as
                   "....albedo.r" along one. Materials that are equal are one, and move together
    Warns (GonioWarning) of odd scenes, of a .png that clips, and where it goes on. Raises InputError, MachineError.
    """
    from ..catalog import notation, operands
    from ..material import BSDF
    from .request import Request

    if not isinstance(scene, BSDF):
        accepted = {operands.Kind.SCENE, *operands.MATERIALS}
        if operands.kind_of(scene, accepted, "render: scene") is not operands.Kind.SCENE:
            scene = notation.named(str(scene), allow_code=options.get("allow_code", False))[0]
    request = Request(
        Path(scene.name) if isinstance(scene, BSDF) else Path(scene),
        output=None if output is None else Path(output),
        timeout=timeout,
        overrides=overrides or {},
        material=scene if isinstance(scene, BSDF) else None,
        checkpoint=None if checkpoint is None else Path(checkpoint),
        until_error=until_error,
        gradient=tuple(gradient),
        **options,
    )
    return _picture(request, level=5)  # past the checks and the lock


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
    """Go on with a render from its checkpoint: the picture, as `go.render` would have given it, to the bit.

        picture = go.resume("phong.exr.checkpoint", spp=1024)

    output      file to write; None is the one that was asked for, if one was: in the checkpoint's folder, or under its
                name beside the checkpoint, with a warning
    spp         samples per pixel in all; None is what was asked for
    allow_code  let it run Python files that its scene names
    Raises InputError where the checkpoint is damaged, and where anything that the picture depends on has changed.
    """
    from . import checkpoints
    from .request import Request

    change = Request(
        Path(),
        output=None if output is None else Path(output),
        spp=spp,
        threads=threads,
        timeout=timeout,
    )
    change.check()
    request, notice = checkpoints.asked_again(Path(checkpoint), change, allow_code)
    return _picture(request, 5, notice)


def _picture(request: Request, level: int, notice: str = "") -> RGB:
    """Render it, write it where an output is named, and warn of what is to be known, at the caller `level` calls up."""
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
            notices += filter(None, [images.show(output, picture, settings, exposure).notice])
    if not stopped:
        keeper.remove()
    if keeper.error:
        notices.append(f"no checkpoint was written: {keeper.error.what}")
    for notice in notices:
        warnings.warn(notice, GonioWarning, stacklevel=level)
    return picture if not request.gradient else finish.with_slopes(prepared, picture)
