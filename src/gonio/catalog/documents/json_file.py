"""JSON files that describe materials: in Gonio's notation, or as the result of a fit, a capture or a compression.

{"type": "gonio-conductor", "alpha": 0.3}             written by `gonio convert`
{"fits": [{"notation": {"type": ...}}, ...]}          `gonio fit`: the best fit, or gold.json:2 for the second
[{"file": "gold.binary", "fits": [...]}, ...]         `gonio fit` of several files: all.json:gold.binary
{"notations": {"shapes.0.material": {"type": ...}}}   `gonio fit --from`
{"fit": {"notation": {"type": ...}}}                  `gonio capture`
{"path": "gold.gonio", "kind": "log", ...}            `gonio compress --json`, a list for several files
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import ClassVar, TypeAlias

from ...errors import InputError
from ...material import tree
from .. import outside
from . import Described, Document, Notation, from_scenes

Json: TypeAlias = "dict[str, Json] | list[Json] | str | float | bool | None"
LARGEST = 64 << 20  # maximum size in bytes; a fit of a thousand files has less than ten million

_read: dict[Path, tuple[tuple[int, int], dict[str, Json] | None]] = {}
CACHED = 8  # number of most recently used files that stay in memory


class JsonFile(Document):
    """Gonio's own JSON (.json): materials in the notation, and the results of fits, captures and compressions."""

    name: ClassVar[str] = "json"
    suffixes: ClassVar[tuple[str, ...]] = (".json",)

    def holds(self, path: Path) -> bool:
        return _entries(path) is not None

    def materials(self, path: Path) -> list[str]:
        return list(_entries(path) or {})

    def ranked(self, path: Path) -> bool:
        return list(_entries(path) or {})[:1] == ["1"]

    def read(self, path: Path, name: str) -> Described:
        entry = (_entries(path) or {})[name]
        if isinstance(entry, str):  # written by an earlier version, or a class without a file
            hint = f"name the material itself: '{entry}'"
            raise InputError("it holds the material only as a string, which is not read from files", str(path), hint)
        if not isinstance(entry, dict) or not isinstance(entry.get("type"), str):
            raise InputError('a material is an object with a "type"', str(path), 'such as {"type": "openpbr", ...}')
        return Described(from_scenes(_located(entry, path.parent, str(path))), ())


def _entries(path: Path) -> dict[str, Json] | None:
    """The description of each material in a file, by name; None if the file is missing or contains other data."""
    try:
        about = path.stat()
        stamp = (about.st_mtime_ns, about.st_size)
        if path in _read and _read[path][0] == stamp:
            return _read[path][1]
        if not path.is_file() or about.st_size > LARGEST:
            return None
        entries = dict(_materials_in(json.loads(path.read_bytes())))
    except (OSError, ValueError, RecursionError):
        return None
    while len(_read) >= CACHED:
        _read.pop(next(iter(_read)))
    _read[path] = stamp, entries or None
    return entries or None


def _materials_in(content: Json) -> Iterator[tuple[str, Json]]:
    """The name and description of each material; empty for other content, such as a scene."""
    if isinstance(content, list):
        rows = [row for row in content if isinstance(row, dict)]
        names = [str(row.get("file") or row.get("path")) for row in rows]
        short = [Path(name).name for name in names]
        for name, row in zip(names if len(set(short)) < len(short) else short, rows, strict=True):
            for _, entry in [*_materials_in(row)][:1]:
                yield name, entry
        return
    if not isinstance(content, dict):
        return
    fits, fit, notations = content.get("fits"), content.get("fit"), content.get("notations")
    if isinstance(content.get("type"), str):
        yield "1", content
    elif isinstance(fits, list):
        for rank, one in enumerate(fits, 1):
            if isinstance(one, dict):
                yield str(rank), one.get("notation") or one.get("material")
    elif isinstance(fit, dict):
        yield "1", fit.get("notation") or fit.get("material")
    elif isinstance(notations, dict) and isinstance(texts := content.get("materials"), dict):
        yield from ((path, one or texts.get(path)) for path, one in notations.items())
    elif isinstance(content.get("kind"), str):
        file = content.get("path") or content.get("output")
        if isinstance(file, str):
            yield "1", {"type": "measured", "file": file}


def _located(notation: Mapping[str, object], folder: Path, where: str, depth: int = 0) -> Notation:
    """The notation, in which file paths relative to a folder are converted to absolute ones.

    Raises InputError for a document inside a document, and for too many nested materials.
    """
    if depth > tree.MAX_MATERIALS:
        raise InputError(f"more than {tree.MAX_MATERIALS} nested materials", where, "mix fewer materials")
    located: Notation = {}
    for key, value in notation.items():
        if isinstance(value, dict):
            located[key] = _located(value, folder, where, depth + 1)
        elif key == "type" and from_scenes({key: value})[key] in Document.family.all():
            raise InputError(f"it has a material of type '{value}', which is in another file", where, "name that file")
        elif isinstance(value, str) and (key == "file" or outside.names_code(value)):
            located[key] = str(folder / Path(os.path.expanduser(value)))
        else:
            located[key] = value
    return located
