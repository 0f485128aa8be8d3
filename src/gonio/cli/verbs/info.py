"""`gonio info`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument

from ..options import Json
from ..output import print_tables
from .base import MATERIALS, verb


@verb(MATERIALS, place=7)
def info(
    path: Annotated[Path, Argument(metavar="DIR", help="A baked folder or tables.npz.")], as_json: Json = False
) -> None:
    """Read baked tables back: what they hold, how they were made, how far they err.

    \b
    Example:
      gonio info tables
    """
    from ...render import tables

    print_tables(tables.describe(path), path, as_json)
