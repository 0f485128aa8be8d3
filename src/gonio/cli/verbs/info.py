"""The command `gonio info`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

from typer import Argument

from ..options import Json
from ..output import listing, print_rich, print_tables
from .base import MATERIALS, verb


@verb(MATERIALS, place=7)
def info(
    path: Annotated[
        str, Argument(metavar="FILE", help="File of measured values or materials, or folder of baked tables.")
    ],
    as_json: Json = False,
) -> None:
    """Describe a file of measured values, a folder of baked tables, or the materials in a .gltf, .mtlx or .json file.

    For measured values, the output lists the dimensions, ranges, invalid and negative values, albedo by angle, energy
    and reciprocity.

    \b
    Examples:
      gonio info gold.binary
      gonio info merl.npz:chrome
      gonio info gold.json
      gonio info tables
    """
    from ...catalog.operands import Kind
    from ...viewer.description import described

    kind, about = described(path, "FILE")
    if as_json:
        print(json.dumps(about))
    elif kind is Kind.TABLES:
        print_tables(about, Path(path), as_json=False)
    else:
        _print(kind is Kind.DOCUMENT, about)


def _print(is_document: bool, about: dict[str, Any]) -> None:
    """Print a table of the materials, or of the properties of measured values."""
    from ...catalog import texts
    from ...measure import report

    rows = (
        [(name, texts.as_text(notation)) for name, notation in about["materials"].items()]
        if is_document
        else report.lines(about)
    )
    print(about["path"])
    table = listing("material" if is_document else "", "")
    for row in rows:
        table.add_row(*row)
    print_rich(table)
