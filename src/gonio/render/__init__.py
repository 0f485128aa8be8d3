"""Scenes to pictures: the machine, Mitsuba, the lab's scene format, integrators, image files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from .._callable import make_callable

if TYPE_CHECKING:
    import numpy as np


def render(scene: str | Path, *, denoise: bool = False, **options: Any) -> np.ndarray:
    """Render a scene file and return the picture; nothing is written.

    scene    the lab's folder or .json, or a Mitsuba .xml
    denoise  run Open Image Denoise over the result
    options  spp, size (width, height), integrator, max_depth, sampler, seed, device, threads, timeout, allow_outside,
             and overrides {"shapes.0.material.p": 16}: as `gonio render` and `gonio study` take them
    Returns (height, width, 3) float32, linear radiance, row 0 on top. Raises InputError, MachineError.
    """
    from . import run

    request = run.Request(Path(scene), denoise=denoise, **options)
    prepared = run.prepare(request)
    width, height = prepared.size
    run.run(prepared.render, prepared.spp, width * height, timeout=request.timeout)
    return run.finished(prepared.render, denoise)


make_callable(__name__, render)
