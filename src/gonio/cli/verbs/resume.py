"""`gonio resume`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from ..options import Code, Crew, Json
from ..output import print_warnings
from .base import PICTURES, verb
from .render import carry_out


@verb(PICTURES, place=1)
def resume(
    checkpoint: Annotated[Path, Argument(metavar="FILE", help="A checkpoint of `gonio render`.")],
    *,
    output: Annotated[
        Path | None, Option("-o", "--output", metavar="FILE", help="Another picture than was asked for.")
    ] = None,
    spp: Annotated[int | None, Option(metavar="N", help="Samples per pixel in all.")] = None,
    timeout: Annotated[
        float | None, Option(metavar="S", help="Stop after S seconds and keep the picture so far.")
    ] = None,
    threads: Annotated[int | None, Option(metavar="N", help="CPU cores to use; all if not given.")] = None,
    allow_code: Code = False,
    crew: Crew,
    as_json: Json = False,
) -> None:
    """Go on with a render that was stopped, or that needs more samples, from its checkpoint.

    The picture is that of a render which was never stopped, to the bit. A checkpoint whose scene, files, settings,
    device or version have changed is refused. Without -o the picture is written where the checkpoint says if that is
    in the checkpoint's folder, else beside the checkpoint.

    \b
    Examples:
      gonio resume phong.exr.checkpoint
      gonio resume night.checkpoint --spp 4096 -o night.exr
    """
    from ...render import checkpoints
    from ...render.request import Request

    change = Request(checkpoint, output=output, spp=spp, timeout=timeout, threads=threads)
    change.check()
    request, notice = checkpoints.asked_again(checkpoint, change, allow_code, writes=True)
    print_warnings((notice,) if notice else ())
    carry_out(request, checkpoint.name, as_json, crew)
