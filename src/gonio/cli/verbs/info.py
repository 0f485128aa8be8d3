"""`gonio info`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

from typer import Argument

from ..options import Json
from ..output import listing, print_rich, print_tables
from .base import MATERIALS, verb


@verb(MATERIALS, place=7)
def info(
    path: Annotated[str, Argument(metavar="FILE", help="Measured values, materials, or a baked folder.")],
    as_json: Json = False,
) -> None:
    """Say what a file holds: a measured material, described ones (.json of a fit, .gltf, .mtlx), or baked tables.

    Of measurements: dimensions, ranges, what is invalid or negative, the albedo over the angle, energy and reciprocity.

    \b
    Examples:
      gonio info gold.binary
      gonio info merl.npz:chrome
      gonio info gold.json
      gonio info tables
    """
    from ...catalog import operands
    from ...catalog.operands import Kind

    kind = operands.kind_of(path, {Kind.TABLE, Kind.DOCUMENT, Kind.TABLES}, "FILE")
    if kind is Kind.DOCUMENT:
        from ...catalog import documents, texts

        notations = documents.described(path)
        if as_json:
            print(json.dumps({"path": path, "materials": notations}))
            return
        print(path)
        table = listing("material", "")
        for name, notation in notations.items():
            table.add_row(name, texts.as_text(notation))
        print_rich(table)
        return
    if kind is Kind.TABLE:
        from ...measure import report

        about = report.describe(path)
        if as_json:
            print(json.dumps(about))
            return
        print(about["path"])
        table = listing("", "")
        for row in report.lines(about):
            table.add_row(*row)
        print_rich(table)
        return
    from ...render import tables

    print_tables(tables.describe(path), Path(path), as_json)
