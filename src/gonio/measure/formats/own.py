"""Gonio's own tables, `.gonio`: any kind, with its axes and units inside."""

from __future__ import annotations

import json
from typing import ClassVar

import numpy as np

from ...errors import InputError
from ..tables.base import Measurement, finite
from .base import Format
from .npz import arrays, written

VERSION = 1
MANIFEST = "manifest"
BESIDE = ("error", "first")  # of `Measurement.beside`


class Own(Format):
    """Gonio table: a .npz of plain arrays and a manifest in JSON (version, kind, title, source, axes with units).

    Values are f in 1/sr (of adaptive tables what the RGL's format means by them), angles are radians, wavelengths nm.
    Nothing is compressed and nothing is pickled. Every kind of table is kept as it is, with the standard error of each
    value (`error`) and its part of one bounce (`first`) where an instrument found them.
    """

    name: ClassVar[str] = "gonio"
    suffixes: ClassVar[tuple[str, ...]] = (".gonio",)
    writes: ClassVar[str] = "any"

    def read(self, data: bytes, where: str, item: str = "") -> Measurement:
        parts = arrays(data, where)
        try:
            manifest = json.loads(parts.pop(MANIFEST).astype(np.uint8).tobytes().decode())
            version, kind = int(manifest["version"]), str(manifest["kind"])
            title = str(manifest.get("title", ""))
            source = {str(key): str(value) for key, value in dict(manifest.get("source", {})).items()}
        except Exception:  # JSON of any shape
            raise InputError(
                "no manifest of a Gonio table in it", where, "gonio convert IN OUT.gonio writes one"
            ) from None
        if version != VERSION:
            raise InputError(f"version {version} of Gonio's tables, {VERSION} expected", where, "is Gonio up to date?")
        cls = Measurement.family.get(kind, where)
        nm = parts.pop("wavelengths", None)
        beside = {name: finite(parts.pop(name), name, where) for name in BESIDE if name in parts}
        try:
            about = {"where": where, "title": title, "source": source, "wavelengths": nm}
            table = cls.from_arrays(parts, **about)
        except (KeyError, IndexError, TypeError, ValueError) as error:
            if isinstance(error, InputError):
                raise
            what = f"its arrays are not those of a {kind} table: {type(error).__name__}: {str(error)[:100]}"
            raise InputError(what, where, "the file is damaged") from None
        shape = tuple(table.shape.values())
        for name, array in beside.items():
            if array.shape != shape:
                raise InputError(f"{name} has shape {array.shape}, the values have {shape}", where)
        table.beside.update(beside)
        return table

    def write(self, table: Measurement) -> bytes:
        manifest = {
            "version": VERSION,
            "kind": table.name,
            "title": table.title,
            "source": table.source,
            "axes": dict(table.axes),
            "units": "radians, nm; values in 1/sr",
        }
        text = np.frombuffer(json.dumps(manifest, indent=1).encode(), np.uint8)
        nm = {} if table.wavelengths is None else {"wavelengths": table.wavelengths}
        beside = {name: np.asarray(array, np.float32) for name, array in table.beside.items()}
        return written({MANIFEST: text, **table.arrays(), **nm, **beside})

    def resampled(self, source: Measurement) -> Measurement:
        """The table itself."""
        return source
