"""The command `gonio convert`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from ..options import Exposure, Json, output_option
from ..output import print_warnings
from .base import PICTURES, verb


@verb(PICTURES, place=5)
def convert(
    source: Annotated[str, Argument(metavar="IN", help="Picture, measured values, or material.")],
    *,
    output: Annotated[Path, output_option("FILE", "File to write; its suffix selects the format.")],
    exposure: Exposure = "0.0",
    phi: Annotated[
        int | None,
        Option("--phi", metavar="DEG", help="Range of phi_d in a .binary file: 180, or 360 for nonreciprocal values."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Convert a picture, a measured material, or another program's material to another format.

    A picture is tone-mapped without rendering the scene again. Measured values are copied if both formats have the same
    kind of table; otherwise, they are resampled, and the resulting error is reported. A material from a glTF or
    MaterialX file is converted to JSON for use in scenes, and an openpbr material is converted to a MaterialX file.

    \b
    Examples:
      gonio convert ball.exr -o ball.png --exposure -3
      gonio convert ball.exr -o ball.png --exposure auto
      gonio convert ball.exr -o ball.hdr
      gonio convert gold.binary -o gold.bsdf
      gonio convert paint.bsdf -o paint.binary --phi 360
      gonio convert paint.mtlx -o paint.json
      gonio convert "openpbr(base_metalness=1)" -o metal.mtlx
    """
    from ...pictures import exposures
    from ...viewer.conversion import converted

    result = converted(source, output, exposures.parse(exposure), phi, "IN")
    if as_json:
        print(json.dumps(result.as_dict()))
        return
    print_warnings(result.notices)
    print(result)
