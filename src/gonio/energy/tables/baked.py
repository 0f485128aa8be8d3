"""Baked tables: arrays with a manifest that describes them, their file format, and the homework's pictures."""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ... import _html, archives
from ...errors import InputError
from ..cache import content_hash


@dataclass(frozen=True)
class Baked:
    """Arrays by name, including the axes, and the manifest that describes them."""

    arrays: dict[str, NDArray[np.float64]]
    manifest: dict[str, Any]

    def _repr_html_(self) -> str:
        return _html.table(rows(self.manifest), headings(self.manifest), title(self.manifest))

    def npz(self) -> bytes:
        """The bytes of tables.npz, which includes the manifest and its hash. Equal content yields equal bytes."""
        text = json.dumps(self.manifest)
        texts = {"manifest": np.array(text), "seal": np.array(_seal(text))}
        stream = io.BytesIO()
        with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as file:
            for name, array in {**self.arrays, **texts}.items():
                part = io.BytesIO()
                np.save(part, array, allow_pickle=False)
                file.writestr(zipfile.ZipInfo(f"{name}.npy", (1980, 1, 1, 0, 0, 0)), part.getvalue())
        return stream.getvalue()


def headings(manifest: Mapping[str, Any]) -> tuple[str, ...]:
    """The column headings of `rows`."""
    return ("table", "shape", "max error", "rms", "between", *_more(manifest))


def _more(manifest: Mapping[str, Any]) -> list[str]:
    """The names of errors that only some tables have."""
    return [name for name in ("mean", "split sum") if any(name in error for error in manifest["error"].values())]


def title(manifest: Mapping[str, Any]) -> str:
    """A one-line description of the tables and the method."""
    facts = [manifest["ndf"], manifest["masking"], manifest["method"], f"{manifest['layout']} axes"]
    facts += [f"alpha_y / alpha_x = {manifest['aspect']:g}"] if "aspect" in manifest else []
    return ", ".join(filter(None, facts))


def rows(manifest: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """For each table, its name, its shape along named axes and its errors, in the columns of `headings`."""
    tables, more = [], _more(manifest)
    for name, shape in manifest["tables"].items():
        error = manifest["error"].get(name, {})
        figures = [f"{error[key]:.1e}" if key in error else "" for key in ("max", "rms", "interpolation", *more)]
        dims = [*manifest["dims"][name], ""]
        along = " x ".join(f"{n} {axis}".strip() for n, axis in zip(shape, dims, strict=False))
        tables.append((name, along, *figures))
    return tables


def _seal(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def read(path: Path) -> Baked:
    """The tables in a file. Raises ValueError with the reason if the file is damaged, altered or foreign."""
    try:
        arrays = archives.read(path)
        text, seal = str(arrays.pop("manifest")), str(arrays.pop("seal"))
        manifest = json.loads(text)
        hashes = dict(manifest["hash"])
    except Exception as error:  # invalid content may raise any exception
        raise ValueError("damaged, or not written by gonio bake") from error
    altered = ["manifest"] if seal != _seal(text) else []
    altered += [name for name, value in hashes.items() if name not in arrays or content_hash(arrays[name]) != value]
    altered += [name for name in arrays if name not in hashes]
    if altered:
        raise ValueError(f"altered: '{altered[0]}' does not match the manifest")
    return Baked(arrays, manifest)


def load(path: str | Path) -> Baked:
    """The tables in a folder, or in a file tables.npz. Raises InputError if there are none, or if they are damaged or
    altered."""
    path = Path(path)
    file_path = path / "tables.npz" if path.is_dir() else path
    hint = "gonio bake ggx -o DIR writes one"
    if not file_path.is_file():
        raise InputError("no tables.npz here", str(path), hint)
    if file_path.suffix.lower() != ".npz":
        raise InputError(f"a '{file_path.suffix}' given, a folder or a tables.npz expected", str(path), hint)
    try:
        return read(file_path)
    except ValueError as error:
        raise InputError(str(error), str(file_path), "bake it again") from error


def homework_pictures(baked: Baked, store: str = "E", flip: bool = True, wrap: bool = False) -> dict[str, np.ndarray]:
    """E, E_avg and dfg as pictures in the homework's form: (N, N, 3), 8 bits, with n.v along x. E and E_avg have three
    equal channels, and E_avg is constant along a row; dfg has A in red and B in green.

    store  the stored values of E and E_avg: "E" or "1-E"
    flip   whether the lowest roughness is the bottom row; else it is the top row
    wrap   whether to convert to bytes as the homework's program does: rounded down, with 256 wrapped to 0
    """
    if store not in ("E", "1-E"):
        raise InputError(f"unknown form '{store}'", "--store", "give E or 1-E")
    size = baked.manifest["size"]
    pictures: dict[str, np.ndarray] = {}
    for name in ("E", "E_avg"):
        if name not in baked.arrays:
            continue
        value = baked.arrays[name]
        value = np.broadcast_to(value[:, None], (size, size)) if value.ndim == 1 else value
        value = 1.0 - value if store == "1-E" else value
        pictures[name] = np.repeat(_bytes(value[::-1] if flip else value, wrap)[..., None], 3, axis=-1)
    if "dfg" in baked.arrays:
        value = baked.arrays["dfg"][::-1] if flip else baked.arrays["dfg"]
        pictures["dfg"] = _bytes(np.dstack([value, np.zeros((size, size))]), wrap)
    return pictures


def _bytes(value: np.ndarray, wrap: bool) -> np.ndarray:
    """Values from 0 to 1 as 8 bits; with `wrap`, they are rounded down and taken modulo 256 instead of clipped."""
    if wrap:
        return (np.floor(value * 255.0).astype(np.int64) % 256).astype(np.uint8)
    return np.round(np.clip(value, 0.0, 1.0) * 255.0).astype(np.uint8)
