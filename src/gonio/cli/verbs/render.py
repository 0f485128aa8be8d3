"""The command `gonio render`."""

from __future__ import annotations

import json
import os
import shlex
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Option

from ..options import Checkpoint, Executor, Json, Material, Options, Rendering, SceneFile, Timeout, output_option
from ..output import Bar, print_warnings
from ..signals import exit_code, words
from .base import PICTURES, verb

if TYPE_CHECKING:
    from ...pictures.exposures import Exposure
    from ...render.finish import Result
    from ...render.request import Request


class Until(Options):
    """Options that determine when a render stops, and where its state is stored."""

    timeout: Timeout = None
    until_error: Annotated[
        float | None,
        Option(metavar="E", help="Estimated relMSE at which to stop; --spp is then the maximum, 65536 by default."),
    ] = None
    checkpoint: Checkpoint = None


@verb(PICTURES, place=1)
def render(
    scene: SceneFile,
    *,
    output: Annotated[Path | None, output_option("FILE", "File for the picture: .exr, .hdr, .png or .npz.")] = None,
    made: Material,
    how: Rendering,
    until: Until,
    executor: Executor,
    as_json: Json = False,
) -> None:
    """Render a picture of a scene, or of a material on a ball.

    Without -o, the picture is written to the current folder under the file name specified in the scene.
    Ctrl-C ends the render after the current pass (about half a second) and writes the current picture; a second Ctrl-C
    ends it immediately. SIGTERM and SIGHUP have the same effect. A render that takes more than a minute stores a
    checkpoint next to the picture. To continue from it, use `gonio resume` or run the same command again.

    \b
    Examples:
      gonio render examples/phong
      gonio render examples/phong -o phong.exr --spp 256 --size 640x480
      gonio render examples/phong -o phong.png --exposure auto
      gonio render ward.py:Ward -p alpha=0.1,0.4 -o ward.png
      gonio render kulla-conty -p base=conductor -p base.alpha=0.35 -o rough.png
      gonio render gold.json -o fitted.png
      gonio render examples/phong --until-error 0.001 -o quiet.exr
      gonio render scene.xml --integrator path --max-depth 5 --denoise
    """
    from ...catalog import notation

    named = made.instead_of(scene, how.allow_code)
    request = how.request(scene, output, until.timeout, named and notation.build(named), until.checkpoint)
    request = replace(request, until_error=until.until_error)
    carry_out(request, Path(scene).name, as_json, executor)


def carry_out(request: Request, title: str, as_json: bool, executor: Executor) -> None:
    """Render with a progress bar, and print the result."""
    from ...render.finish import render_to_file

    with Bar(title) as bar, executor.running():
        result = render_to_file(request, report=bar.update, notice=bar.stopping, tell=bar.tell)
    try:
        if as_json:
            print(json.dumps(result.as_dict()))
        else:
            _print(result, request.exposure)
        sys.stdout.flush()
    except OSError:
        if not result.signal:  # after a signal, the terminal has closed; the picture is written
            raise
        os._exit(exit_code(result.signal))
    if result.stopped == "interrupt":
        sys.exit(exit_code(result.signal))


def _print(result: Result, exposure: Exposure) -> None:
    width, height = result.size
    text = f"{result.output}  {width}x{height}, {result.spp} spp, {result.seconds:.1f} s"
    if exposure == "auto" and result.exposure is not None:
        text += f", exposure {result.exposure:+g} EV"
    if result.error is not None:
        text += f", relMSE estimated at {result.error:.3g}"
    print_warnings(result.warnings)
    if result.stopped:
        why = f"stopped by {words(result.signal)}" if result.stopped == "interrupt" else "stopped at the time limit"
        text += f"; {why}, {result.wanted_spp} spp were requested"
    print(text)
    if result.stopped and result.checkpoint is not None:
        print(f"resume with: gonio resume {shlex.quote(str(result.checkpoint))}")
