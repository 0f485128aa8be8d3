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
    """The contents of a file, as a dictionary for JSON: measured values, described materials, or baked tables.

        go.info("gold.binary")["albedo"]
        go.info("chest.gltf")["materials"]      # name -> notation

    path  a file of measured values, a .json, .gltf or .mtlx with materials, or a baked folder
    Raises InputError if the file cannot be read or holds none of these.
    """
    return described(str(path), "path")[1]


def described(path: str, location: str) -> tuple[Kind, dict[str, Any]]:
    """The kind of a file, and its contents; errors about the path name `location`."""
    kind = operands.kind_of(path, ACCEPTED, location)
    if kind is Kind.DOCUMENT:
        return kind, {"path": path, "materials": documents.described(path)}
    if kind is Kind.TABLE:
        return kind, report.describe(path)
    return kind, {"path": str(Path(path)), **tables.describe(path)}
