"""`gonio info` and `go.info`: the contents of a file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..catalog import documents, operands
from ..catalog.operands import Kind
from ..measure import report
from ..owner import public
from ..render import tables

ACCEPTED = frozenset({Kind.TABLE, Kind.DOCUMENT, Kind.TABLES})


@public
def info(path: str | Path) -> dict[str, Any]:
    """Describe a file of measured values, a file with materials, or a folder of baked tables, as a dictionary for JSON.

        go.info("gold.binary")["albedo"]
        go.info("chest.gltf")["materials"]      # name -> notation

    path  a file of measured values, a .json, .gltf or .mtlx with materials, or a folder of baked tables
    Raises InputError if the file cannot be read or has another content.
    """
    return described(str(path), "path")[1]


def described(path: str, location: str) -> tuple[Kind, dict[str, Any]]:
    """The kind of a file, and its contents. Errors about the path are reported at `location`."""
    kind = operands.kind_of(path, ACCEPTED, location)
    if kind is Kind.DOCUMENT:
        return kind, {"path": path, "materials": documents.described(path)}
    if kind is Kind.TABLE:
        return kind, report.describe(path)
    return kind, {"path": str(Path(path)), **tables.describe(path)}
