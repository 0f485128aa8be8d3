"""Scenes to pictures: the machine, Mitsuba, the lab's scene format, integrators, image files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from .._callable import make_callable
from ..owner import public

if TYPE_CHECKING:
    from ..models import BSDF
    from .exposures import RGB, Exposure


@public
def render(
    scene: str | Path | BSDF,
    *,
    output: str | Path | None = None,
    spp: int | None = None,
    size: tuple[int, int] | None = None,
    integrator: str | None = None,
    max_depth: int | None = None,
    sampler: str | None = None,
    seed: int | None = None,
    device: str = "cpu",
    threads: int | None = None,
    timeout: float | None = None,
    denoise: bool = False,
    exposure: Exposure = 0.0,
    allow_outside: bool = False,
    allow_code: bool = False,
    overrides: Mapping[str, object] | None = None,
) -> RGB:
    """Render a scene, or a material on a ball: the picture, (height, width, 3) float32, linear radiance, row 0 on top.

        picture = go.render("examples/phong", spp=64, overrides={"shapes.1.material.p": 16})

    scene          the lab's folder or .json, a Mitsuba .xml, or a material, which is shown on a ball; what is None
                   below is as the scene says
    output         file to write, .exr, .hdr, .png or .npz; None writes nothing
    spp            samples per pixel
    size           width and height of the film, pixels
    integrator     "direct", "path", "whitted", "normal", ...
    max_depth      longest path, segments, for the integrator "path"
    sampler        where random numbers come from, such as "sobol"
    seed           same seed, same picture, to the bit
    device         "cpu", "cuda" or "auto"
    threads        CPU cores to use, all where None
    timeout        seconds, after which the picture so far is the picture
    denoise        run Open Image Denoise over the result
    exposure       of a .png: stops, or "auto" for one chosen by the picture's luminance
    allow_outside  let the scene read files outside its folder
    allow_code     let the scene name materials in Python files, "ward.py:Ward", which then run
    overrides      values by their path in the scene, as `gonio study` varies them; materials too
    Warns (GonioWarning) of odd scenes and of a .png that clips. Raises InputError, MachineError.
    """
    import warnings

    from ..errors import GonioWarning
    from ..models import BSDF
    from . import images, run

    request = run.Request(
        Path(scene.name) if isinstance(scene, BSDF) else Path(scene),
        output=None if output is None else Path(output),
        spp=spp,
        size=size,
        integrator=integrator,
        max_depth=max_depth,
        sampler=sampler,
        seed=seed,
        device=device,
        threads=threads,
        timeout=timeout,
        denoise=denoise,
        exposure=exposure,
        allow_outside=allow_outside,
        allow_code=allow_code,
        overrides=overrides or {},
        material=scene if isinstance(scene, BSDF) else None,
    )
    prepared = run.prepare(request)
    width, height = prepared.size
    run.run(prepared.render, prepared.spp, width * height, timeout=timeout)
    picture = run.finished(prepared.render, denoise)
    notices = list(prepared.warnings)
    if output is not None:
        settings = prepared.settings | {"spp": prepared.render.done}
        notices += filter(None, [images.show(output, picture, settings, exposure).notice])
    for notice in notices:
        warnings.warn(notice, GonioWarning, stacklevel=5)  # past the checks, the lock and the call of the module
    return picture


make_callable(__name__, render)
