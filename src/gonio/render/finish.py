"""Render to a file: run the render, denoise the picture if requested, and write it."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import MachineError, summary
from ..owner import exclusive
from ..pictures import denoise, images
from ..transport.passes import Interrupts, Progress, Renders
from . import checkpoints
from .execute import execute
from .prepare import Prepared, prepare
from .request import Request


@dataclass(frozen=True)
class Result:
    """The result of a render to a file.

    spp         number of samples per pixel that were rendered
    stopped     the reason why the render ended early, "interrupt" or "timeout"; "" if it was completed
    exposure    exposure of a .png, in stops
    error       estimated relMSE of the picture, if it was rendered until an error was reached
    signal      number of the signal that interrupted the render; 0 if there was none
    checkpoint  file from which the render can be continued; None if there is none
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


def estimated(prepared: Prepared) -> tuple[float | None, str]:
    """The estimated relMSE of a render until an error, and a warning if it exceeds this error."""
    wanted = prepared.request.until_error
    if wanted is None:
        return None, ""
    error = prepared.render.estimate()  # type: ignore[attr-defined]  # of an Until
    if error <= wanted:
        return error, ""
    if not math.isfinite(error):
        return None, "too few samples to estimate the relMSE"
    done = f"{prepared.render.done} samples per pixel"
    return error, f"relMSE is estimated to be {error:.3g} after {done}, {wanted:g} was requested"


@exclusive
def render_to_file(
    request: Request,
    report: Callable[[Progress], None] = lambda progress: None,
    notice: Callable[[], None] = lambda: None,
    tell: Callable[[str], None] = lambda text: None,
) -> Result:
    """Render a scene to a file. After Ctrl-C, SIGTERM, SIGHUP or the time limit, the unfinished picture is written.

    report  called with the progress after each pass
    notice  called from another thread when the first of these signals arrives
    tell    called at the start with a notice if an earlier run has left a checkpoint
    """
    started = time.perf_counter()
    with Interrupts(notice) as interrupts:  # before the imports, because an interrupted import can crash
        prepared = prepare(request, writes=True)
        interrupts.check()
        checkpoint = checkpoints.default_path(prepared.output)
        stopped, keeper = execute(
            prepared, temporary=checkpoint, report=report, interrupted=lambda: interrupts.asked, tell=tell
        )
        picture = picture_of(prepared.render, request.denoise, prepared.output)
        settings = prepared.settings | {"spp": prepared.render.done}
        error, unmet = estimated(prepared)
        if error is not None:
            settings |= {"estimated_error": round(error, 12)}
        if stopped:
            settings |= {"stopped": stopped, "wanted_spp": prepared.spp}
        seconds = time.perf_counter() - started
        shown = images.write_exposed(
            prepared.output, picture, settings | {"seconds": round(seconds, 2)}, request.exposure
        )
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
    """The picture followed by its derivatives, (1 + paths, height, width, 3)."""
    return np.stack([picture, *prepared.render.slopes()])  # type: ignore[attr-defined]  # of Gradients


def picture_of(render: Renders, denoised: bool, output: Path | None = None) -> NDArray[np.float32]:
    """The picture of a render, denoised if requested.

    If denoising fails, the noisy picture is written to `output`, and MachineError is raised.
    """
    picture = render.image()
    if not denoised:
        return picture
    try:
        guides = render.aov()
        return denoise.denoise(picture, guides.get("albedo"), guides.get("normal"))
    except Exception as error:
        if output is None:
            raise
        images.write(output, picture)
        hint = "that file contains the noisy picture; leave --denoise out"
        raise MachineError(f"the picture was not denoised: {summary(error)}", str(output), hint) from error
