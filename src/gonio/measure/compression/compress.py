"""Compress measurement files and report the resulting error: `gonio compress`."""

from __future__ import annotations

import os
import time
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from ... import files
from ...arguments import renamed
from ...errors import InputError
from .. import parted, read
from ..compare import difference
from ..formats.own import Own
from . import sphere
from .base import Method

SIZE = 16384  # bytes per material
LEAST = 1024


@dataclass(frozen=True)
class Compressed:
    """A compressed material.

    path     the file, followed by the name of the material if the file contains several
    kind     kind of the table in the file
    method   compression method
    size     bytes per material; the mean if the file contains several
    before   size of the original values in bytes
    error    relative error of f cos theta_i, E |new - old| / E |old|, as reported by `gonio convert`
    sphere   mean relative error of the pixels of a sphere under a lamp and a sky
    seconds  computing time per material, s
    """

    path: str
    kind: str
    method: str
    size: int
    before: int
    error: float
    sphere: float
    seconds: float

    def as_dict(self) -> dict[str, object]:
        return dict(vars(self))


@renamed(method="codec")
def compress(
    source: str | os.PathLike[str] | Iterable[str | os.PathLike[str]],
    output: str | os.PathLike[str],
    codec: str = "log",
    bytes: int = SIZE,
) -> list[Compressed]:
    """Compress measured materials into a `.gonio` file, and measure the errors of the written file.

    source  one file or several, as for `go.Measured`. Several files are written to one file, whose materials are named
            OUT.gonio:NAME
    output  the file to write
    codec   log (quantized logarithms), lowrank (shared factors), rgl (without `vndf`), network (675 weights)
    bytes   size per material, for the codecs log and lowrank
    Raises InputError if a file cannot be read, or if the codec cannot be applied to it.
    """
    one = Method.family.get(codec, "codec")
    if not isinstance(bytes, int) or bytes < LEAST:
        raise InputError(f"{bytes} bytes given, a whole number from {LEAST} expected", "bytes")
    path = files.check_file(Path(output))
    if path.suffix.lower() not in Own.suffixes:
        raise InputError(f"'{path.suffix}' given, a .gonio file expected", str(output), "such as materials.gonio")
    sources = [source] if isinstance(source, str | os.PathLike) else list(source)
    if not sources:
        raise InputError("no file given", "FILE")
    tables = {_name(file): read(file) for file in sources}
    if len(tables) < len(sources):
        raise InputError("two files have the same name", "FILE", "names of materials in one file must differ")
    start = time.perf_counter()
    made = one.compress(list(tables.values()), bytes)
    seconds = (time.perf_counter() - start) / len(made)
    own = Own()
    data = own.write(made[0]) if len(made) == 1 else own.write_several(dict(zip(tables, made, strict=True)))
    results = []
    for name, table in tables.items():
        item = name if len(made) > 1 else ""
        new = own.read(data, str(path), item)
        results.append(
            Compressed(
                f"{output}:{item}" if item else str(output), new.name, codec, round(len(data) / len(made)),
                sum(array.nbytes for array in table.arrays().values()), difference(table, new),
                sphere.error(sphere.picture(table.rgb), sphere.picture(new.rgb)), seconds,
            )
        )  # fmt: skip
    files.write_whole(path, data)
    return results


def _name(file: str | os.PathLike[str]) -> str:
    path, item = parted(os.fspath(file))
    return item or Path(path).stem
