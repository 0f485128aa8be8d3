"""`gonio convert`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

from typer import Argument

from ..options import Exposure, Json
from ..output import print_warnings
from .base import PICTURES, verb


@verb(PICTURES, place=5)
def convert(
    source: Annotated[Path, Argument(metavar="IN", help="A picture: .exr, .hdr, .png or .npz.")],
    output: Annotated[Path, Argument(metavar="OUT", help="The picture to write, in the format of its suffix.")],
    exposure: Exposure = "0",
    as_json: Json = False,
) -> None:
    """Write a picture in another format, and bring it to the screen without rendering it again.

    \b
    Examples:
      gonio convert ball.exr ball.png --exposure -3
      gonio convert ball.exr ball.png --exposure auto
      gonio convert ball.exr ball.hdr
    """
    from ...render import exposures, images

    shown = images.convert(source, output, exposures.parse(exposure))
    if as_json:
        print(json.dumps({"output": str(output), "exposure": shown.exposure, "notice": shown.notice}))
        return
    print_warnings((shown.notice,) if shown.notice else ())
    print(output if shown.exposure is None else f"{output}  exposure {shown.exposure:+g} EV")
