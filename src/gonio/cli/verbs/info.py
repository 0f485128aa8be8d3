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
    path: Annotated[str, Argument(metavar="FILE", help="Measured values, or a baked folder or tables.npz.")],
    as_json: Json = False,
) -> None:
    """Say what a file holds: a measured material, or baked tables.

    Of measurements: dimensions, ranges, what is invalid or negative, the albedo over the angle, energy and reciprocity.

    \b
    Examples:
      gonio info gold.binary
      gonio info merl.npz:chrome
      gonio info tables
    """
    from ...measure import SAMPLE, names_table

    if path == SAMPLE or names_table(path) or (path.lower().endswith(".npz") and not _is_baked(path)):
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


def _is_baked(path: str) -> bool:
    """Whether a .npz is what `gonio bake` writes, or nothing that can be opened."""
    import zipfile

    try:
        with zipfile.ZipFile(path) as file:
            return not any("/" in name for name in file.namelist())
    except (OSError, ValueError, zipfile.BadZipFile):
        return True
