"""`gonio compress`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from ..options import Json
from ..output import listing, print_rich
from .base import MATERIALS, verb


@verb(MATERIALS, place=10)
def compress(
    files: Annotated[list[str], Argument(metavar="FILE...", help="Measured values; of several one file is made.")],
    *,
    output: Annotated[Path, Option("-o", "--output", metavar="OUT.gonio", help="The file to write.")],
    method: Annotated[str, Option(metavar="NAME", help="log, lowrank, rgl or network.")] = "log",
    size: Annotated[int, Option("--bytes", metavar="N", help="A material, for log and lowrank.")] = 16384,
    as_json: Json = False,
) -> None:
    """Write measured materials in fewer bytes, and say how far off that is.

    log keeps logarithms as rounded cosines, lowrank factors of low rank that several materials share, rgl an RGL table
    without its visible normals, network 675 weights that are trained here. The result stands wherever a file can.

    \b
    Examples:
      gonio compress gold.binary -o gold.gonio
      gonio compress gold.binary silk.bsdf --method lowrank --bytes 8192 -o both.gonio
      gonio compress paint.bsdf --method rgl -o paint.gonio
      gonio compress gold.binary --method network -o gold.gonio
    """
    from ...catalog import operands
    from ...measure.compression.compress import compress as compressed

    for file in files:
        operands.kind_of(file, {operands.Kind.TABLE}, "FILE")

    rows = compressed(files, output, method, size)
    if as_json:
        print(json.dumps([row.as_dict() for row in rows] if len(rows) > 1 else rows[0].as_dict()))
        return
    table = listing("", "bytes", "of", "off on average", "on a sphere")
    for row in rows:
        table.add_row(
            row.path, f"{row.size:,}", f"{row.before:,}", f"{100.0 * row.error:.2g} %", f"{100.0 * row.sphere:.2g} %"
        )
    print_rich(table)
