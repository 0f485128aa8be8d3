"""`gonio convert`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from ..options import Exposure, Json
from ..output import print_warnings
from .base import PICTURES, verb


@verb(PICTURES, place=5)
def convert(
    source: Annotated[str, Argument(metavar="IN", help="A picture, measured values, or a material.")],
    output: Annotated[Path, Argument(metavar="OUT", help="The file to write, in the format of its suffix.")],
    exposure: Exposure = "0",
    phi: Annotated[
        int | None,
        Option("--phi", metavar="180|360", help="Cells of phi_d in a .binary; 360 keep what is not reciprocal."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Write a picture, a measured material, or another program's material in another format.

    A picture is brought to the screen without rendering it again. Measured values are written as they are where both
    formats have the same kind of table; else they are resampled, and the error is measured and said. A material of a
    glTF or MaterialX file becomes JSON as scenes hold it, and an openpbr in JSON a MaterialX file.

    \b
    Examples:
      gonio convert ball.exr ball.png --exposure -3
      gonio convert ball.exr ball.png --exposure auto
      gonio convert ball.exr ball.hdr
      gonio convert gold.binary gold.bsdf
      gonio convert paint.bsdf paint.binary --phi 360
      gonio convert paint.mtlx paint.json
    """
    from ...catalog import documents, operands
    from ...catalog.operands import Kind

    kind = operands.kind_of(source, {Kind.PICTURE, Kind.TABLE, Kind.DOCUMENT}, "IN")
    if kind is Kind.DOCUMENT:
        notices = documents.convert(source, output)
        if as_json:
            print(json.dumps({"output": str(output), "notices": notices}))
            return
        print_warnings(notices)
        print(output)
        return
    if kind is Kind.TABLE:
        from ...measure import compare

        made = compare.convert(source, output, phi)
        if as_json:
            print(json.dumps(made.as_dict()))
            return
        how = "resampled" if made.resampled else "the same values"
        print(f"{made.path}  {made.size / 1e6:.2f} MB, {made.kind}, {how}: {100.0 * made.error:.2g} % off on average")
        if made.reciprocity:
            lost, coarse = 100.0 * made.reciprocity, 100.0 * made.resolution
            hint = "; --phi 360 keeps it" if output.suffix == ".binary" else ""
            print(f"  of it {coarse:.2g} % by resolution, {lost:.2g} % since the table is not reciprocal{hint}")
        return
    from ...pictures import exposures, images

    shown = images.convert(Path(source), output, exposures.parse(exposure))
    if as_json:
        print(json.dumps({"output": str(output), "exposure": shown.exposure, "notice": shown.notice}))
        return
    print_warnings((shown.notice,) if shown.notice else ())
    print(output if shown.exposure is None else f"{output}  exposure {shown.exposure:+g} EV")
