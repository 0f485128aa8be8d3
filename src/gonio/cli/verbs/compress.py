"""The command `gonio compress`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from ..options import Json, output_option
from ..output import listing, print_rich
from .base import MATERIALS, verb


@verb(MATERIALS, place=10)
def compress(
    files: Annotated[
        list[str], Argument(metavar="FILE...", help="Files of measured values; several are written to one file.")
    ],
    *,
    output: Annotated[Path, output_option("FILE", "File to write, with the suffix .gonio.")],
    codec: Annotated[str, Option(metavar="NAME", help="Compression method: log, lowrank, rgl or network.")] = "log",
    bytes: Annotated[int, Option(metavar="N", help="Size per material in bytes, for log and lowrank.")] = 16384,
    as_json: Json = False,
) -> None:
    """Compress measured materials, and report the error.

    The codec log stores the logarithms as rounded cosine coefficients; lowrank stores low-rank factors, which several
    materials can share; rgl stores an RGL table without its density of visible normals; and network trains a neural
    network and stores its 675 weights. The compressed file can be used like any other file of measured values.

    \b
    Examples:
      gonio compress gold.binary -o gold.gonio
      gonio compress gold.binary silk.bsdf --codec lowrank --bytes 8192 -o both.gonio
      gonio compress paint.bsdf --codec rgl -o paint.gonio
      gonio compress gold.binary --codec network -o gold.gonio
    """
    from ...catalog import operands
    from ...measure.compression.compress import compress as compressed

    for file in files:
        operands.kind_of(file, {operands.Kind.TABLE}, "FILE")

    rows = compressed(files, output, codec, bytes)
    if as_json:
        print(json.dumps([row.as_dict() for row in rows] if len(rows) > 1 else rows[0].as_dict()))
        return
    table = listing("file", "bytes", "original bytes", "mean error", "error on a sphere")
    for row in rows:
        table.add_row(
            row.path, f"{row.size:,}", f"{row.before:,}", f"{100.0 * row.error:.2g} %", f"{100.0 * row.sphere:.2g} %"
        )
    print_rich(table)
