"""Gonio's own format, `.gonio`, for any kind of table, with axes and units."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError, did_you_mean
from ..tables.base import Measurement, finite
from .base import Format
from .npz import arrays, written

VERSION = 1  # version of a file with one material
SEVERAL = 2  # version of a file with several materials
MANIFEST = "manifest"
BESIDE = ("error", "first")  # keys of `Measurement.beside`

Arrays = Mapping[str, NDArray[np.generic]]


class Own(Format):
    """Gonio table: a .npz file of plain arrays and a JSON manifest (version, kind, title, source, axes with units).

    Values are f in 1/sr (those of adaptive tables are as in the RGL format), angles are in radians, wavelengths in nm.
    Arrays are neither compressed nor pickled. Every kind of table is stored unchanged. If an instrument measured them,
    the file also contains the standard error of each value (`error`) and its single-bounce part (`first`).

    A file of version 2 contains several materials. Its manifest contains the manifest of each material under its name.
    Arrays of one material are called NAME/ARRAY; all other arrays are shared by all materials.
    """

    name: ClassVar[str] = "gonio"
    suffixes: ClassVar[tuple[str, ...]] = (".gonio",)
    writes: ClassVar[str] = "any"

    def items(self, data: bytes, where: str) -> list[str]:
        return list(self._parts(data, where)[1])

    def read(self, data: bytes, where: str, item: str = "") -> Measurement:
        parts, several = self._parts(data, where)
        manifest = several.get(item)
        if several and manifest is None:
            what = f"no material '{item}' in this file" if item else f"it has {len(several)} materials, one expected"
            names = list(several)
            hint = did_you_mean(item, names) if item else f"give {where}:{names[0]}, or another of " + ", ".join(names)
            raise InputError(what, where, hint)
        if manifest is not None:
            own = {name.removeprefix(f"{item}/"): part for name, part in parts.items() if name.startswith(f"{item}/")}
            parts = {**{name: part for name, part in parts.items() if "/" not in name}, **own}
        elif item:
            raise InputError(f"no material '{item}' in this file", where, "it holds a single material: give no name")
        else:
            manifest = self._manifest(parts, where)
        parts.pop(MANIFEST)
        try:
            kind, title = str(manifest["kind"]), str(manifest.get("title", ""))
            source = {str(key): str(value) for key, value in dict(manifest.get("source", {})).items()}
        except Exception:  # JSON of any structure
            raise _no_manifest(where) from None
        cls = Measurement.family.get(kind, where)
        for name, part in parts.items():
            if part.size == 0:  # such as an axis without entries, which no table has
                raise InputError(f"the array {name} of shape {part.shape} is empty", where, "the file is damaged")
        nm = parts.pop("wavelengths", None)
        extra = {name: finite(parts.pop(name), name, where) for name in BESIDE if name in parts}
        try:
            about = {"where": where, "title": title, "source": source, "wavelengths": nm}
            table = cls.from_arrays(parts, **about)
        except (KeyError, IndexError, TypeError, ValueError) as error:
            if isinstance(error, InputError):
                raise
            what = f"its arrays are not those of a {kind} table: {type(error).__name__}: {str(error)[:100]}"
            raise InputError(what, where, "the file is damaged") from None
        shape = tuple(table.shape.values())
        for name, array in extra.items():
            if array.shape != shape:
                raise InputError(f"{name} has shape {array.shape}, the values have {shape}", where)
        table.beside.update(extra)
        return table

    def _parts(self, data: bytes, where: str) -> tuple[dict[str, NDArray[np.generic]], dict[str, Any]]:
        """The arrays, and the manifest of each material if the file contains several."""
        parts = arrays(data, where)
        manifest = self._manifest(parts, where)
        if manifest["version"] != SEVERAL:
            return parts, {}
        several = manifest.get("materials")
        if not isinstance(several, dict) or not several or not all(isinstance(one, dict) for one in several.values()):
            raise _no_manifest(where)
        return parts, several

    def _manifest(self, parts: Arrays, where: str) -> dict[str, Any]:
        try:
            manifest = json.loads(parts[MANIFEST].astype(np.uint8).tobytes().decode())
            version = manifest["version"] = int(manifest["version"])
        except Exception:  # JSON of any structure
            raise _no_manifest(where) from None
        if version not in (VERSION, SEVERAL):
            what = f"version {version} of Gonio's tables, {VERSION} or {SEVERAL} expected"
            raise InputError(what, where, "is Gonio up to date?")
        checked: dict[str, Any] = manifest
        return checked

    def write(self, table: Measurement) -> bytes:
        about = {"title": table.title, "source": table.source, "wavelengths": table.wavelengths}
        extra = {name: np.asarray(array, np.float32) for name, array in table.beside.items()}
        return self.file_of(type(table), {**table.arrays(), **extra}, about)

    def file_of(self, kind: type[Measurement], parts: Arrays, about: Mapping[str, Any]) -> bytes:
        """The bytes of a file with a table of a given kind, from arrays and metadata (title, source, wavelengths)."""
        nm = about.get("wavelengths")
        more = {} if nm is None else {"wavelengths": nm}
        return written({MANIFEST: _text({"version": VERSION, **_about(kind, about)}), **parts, **more})

    def write_several(self, tables: Mapping[str, Measurement]) -> bytes:
        """The bytes of a file with several tables, by name. Arrays that all of them share are stored once."""
        manifests = {
            name: _about(type(table), {"title": table.title, "source": table.source}) for name, table in tables.items()
        }
        each = {
            name: {
                **table.arrays(),
                **({} if table.wavelengths is None else {"wavelengths": np.asarray(table.wavelengths)}),
            }
            for name, table in tables.items()
        }
        first = next(iter(each.values()))
        common = {key for key in first if all(one.get(key) is first[key] for one in each.values()) and len(each) > 1}
        parts: dict[str, NDArray[np.generic]] = {
            MANIFEST: _text({"version": SEVERAL, "materials": manifests}),
            **{key: array for key, array in first.items() if key in common},
        }
        for name, own in each.items():
            parts |= {f"{name}/{key}": array for key, array in own.items() if key not in common}
        return written(parts)

    def resampled(self, source: Measurement) -> Measurement:
        """The table itself."""
        return source


def _about(kind: type[Measurement], about: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "kind": kind.name,
        "title": about.get("title", ""),
        "source": about.get("source", {}),
        "axes": dict(kind.axes),
        "units": "radians, nm; values in 1/sr",
    }


def _text(manifest: Mapping[str, Any]) -> NDArray[np.uint8]:
    return np.frombuffer(json.dumps(manifest, indent=1).encode(), np.uint8)


def _no_manifest(where: str) -> InputError:
    return InputError("this file has no manifest of a Gonio table", where, "gonio convert IN OUT.gonio writes one")
