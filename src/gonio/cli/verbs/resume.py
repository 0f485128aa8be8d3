"""The command `gonio resume`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument

from ..options import Code, Executor, Json, Spp, Threads, Timeout, output_option
from ..output import print_warnings
from .base import PICTURES, verb
from .render import carry_out


@verb(PICTURES, place=1)
def resume(
    checkpoint: Annotated[Path, Argument(metavar="FILE", help="Checkpoint written by `gonio render`.")],
    *,
    output: Annotated[
        Path | None, output_option("FILE", "File for the picture; by default, that of the original render.")
    ] = None,
    spp: Spp = None,
    timeout: Timeout = None,
    threads: Threads = None,
    allow_code: Code = False,
    executor: Executor,
    as_json: Json = False,
) -> None:
    """Continue a render from its checkpoint, after an interruption or to add samples.

    The picture is bit-identical to that of an uninterrupted render. --spp sets the total number of samples. A
    checkpoint is rejected if the scene, its files, the settings, the device or the version has changed. Without -o, the
    picture is written to the path stored in the checkpoint if this path is in the checkpoint's folder, and next to the
    checkpoint otherwise.

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
    carry_out(request, checkpoint.name, as_json, executor)
