"""`gonio render`."""

from __future__ import annotations

import json
import os
import shlex
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Option

from ..options import Checkpoint, Crew, Json, Material, Rendering, SceneFile
from ..output import Bar, print_warnings
from ..signals import exit_code, words
from .base import PICTURES, verb

if TYPE_CHECKING:
    from ...pictures.exposures import Exposure
    from ...render.finish import Result
    from ...render.request import Request


@verb(PICTURES, place=1)
def render(
    scene: SceneFile,
    *,
    output: Annotated[Path | None, Option("-o", "--output", metavar="FILE", help=".exr, .hdr, .png or .npz.")] = None,
    made: Material,
    how: Rendering,
    timeout: Annotated[
        float | None, Option(metavar="S", help="Stop after S seconds and keep the picture so far.")
    ] = None,
    until_error: Annotated[
        float | None,
        Option(metavar="E", help="Stop when relMSE is estimated to be below E; --spp is then the most, else 65536."),
    ] = None,
    checkpoint: Checkpoint = None,
    crew: Crew,
    as_json: Json = False,
) -> None:
    """Render a scene, or a material on a ball, to a picture.

    Without -o the picture gets the name that the scene gives it, in the current folder.
    Ctrl-C ends after the pass (half a second or so) and keeps the picture so far; a second one ends at once. So do
    SIGTERM and SIGHUP, which batch systems and closing terminals send. A render of over a minute has a checkpoint
    beside the picture, from which `gonio resume`, or the same command again, goes on.

    \b
    Examples:
      gonio render examples/phong
      gonio render examples/phong -o phong.exr --spp 256 --size 640x480
      gonio render examples/phong -o phong.png --exposure auto
      gonio render ward.py:Ward -p alpha=.1,.4 -o ward.png
      gonio render kulla-conty -p base=conductor -p base.alpha=.35 -o rough.png
      gonio render gold.json -o fitted.png
      gonio render examples/phong --until-error .001 -o quiet.exr
      gonio render scene.xml --integrator path --max-depth 5 --denoise
    """
    from ...catalog import notation

    named = made.instead_of(scene, how.allow_code)
    request = how.request(scene, output, timeout, named and notation.build(named), checkpoint)
    request = replace(request, until_error=until_error)
    carry_out(request, Path(scene).name, as_json, crew)


def carry_out(request: Request, title: str, as_json: bool, crew: Crew) -> None:
    """Render with a bar, and say what came of it."""
    from ...render.finish import render_to_file

    with Bar(title) as bar, crew.working():
        result = render_to_file(request, report=bar.update, notice=bar.stopping, tell=bar.tell)
    try:
        if as_json:
            print(json.dumps(result.as_dict()))
        else:
            _print(result, request.exposure)
        sys.stdout.flush()
    except OSError:
        if not result.signal:  # else it is the terminal, which has closed; the picture is written
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
        text += f"; {why}, {result.wanted_spp} spp were asked for"
    print(text)
    if result.stopped and result.checkpoint is not None:
        print(f"go on with: gonio resume {shlex.quote(str(result.checkpoint))}")
