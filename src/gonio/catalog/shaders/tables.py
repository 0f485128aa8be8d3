"""Read the files of a shader's textures: .npy, and numbers without a header, as `gonio emit` writes them."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...ops.table import Table
from ...spirv.images import Texture

MAX_TABLE = 1 << 28  # maximum size of a file in bytes
MAX_NUMBERS = 1 << 26
_RAW: dict[str, np.dtype[Any]] = {".f32": np.dtype("<f4"), ".f16": np.dtype("<f2")}


def texture(name: str, about: Mapping[str, Any], path: Path, stated: str = "") -> Texture:
    """Read a texture from a file, with the edge rule and filter given by the adapter's entry `about`.

    name    name of the texture in the shader
    stated  name of the adapter in errors
    Raises InputError if the file is not a table of finite numbers, or if it contains more than `MAX_NUMBERS`, which are
    not allocated.
    """
    where = f"{stated}: textures.{name}" if stated else f"textures.{name}"
    try:
        if path.stat().st_size > MAX_TABLE:
            raise InputError(f"'{path.name}' is larger than {MAX_TABLE >> 20} MB", where)
        values = _raw(path, about) if path.suffix.lower() in _RAW else _npy(path)
    except (OSError, ValueError, EOFError, MemoryError) as error:
        what = f"'{about['file']}' is not a table: {error}"
        raise InputError(what[:200], where, "give an .npy of numbers, (rows, columns, channels)") from None
    if values.ndim not in (2, 3, 4) or values.shape[-1] > 4 or values.size == 0 or not np.all(np.isfinite(values)):
        what = f"'{about['file']}' of shape {values.shape}, finite numbers of 1 to 4 channels last expected"
        raise InputError(what, where, "write it by numpy.save(FILE, array), shape (rows, columns, channels)")
    return Texture(name, Table(name, values), about.get("wrap", "clamp"), about.get("filter", "linear"))


def _npy(path: Path) -> NDArray[np.float64]:
    with path.open("rb") as file:
        version = np.lib.format.read_magic(file)
        header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _, dtype = header(file)
        if dtype.kind not in "fiu":
            raise ValueError(f"it holds {dtype}, real numbers expected")
        claimed = math.prod(shape) * dtype.itemsize
        if claimed > os.fstat(file.fileno()).st_size - file.tell() or math.prod(shape) > MAX_NUMBERS:
            raise ValueError(f"its header claims {math.prod(shape)} numbers, more than it has or than are allowed")
    return np.asarray(np.load(path, allow_pickle=False), np.float64)


def _raw(path: Path, about: Mapping[str, Any]) -> NDArray[np.float64]:
    if "shape" not in about:
        raise ValueError("it has no header; give shape = [rows, columns, channels]")
    values: NDArray[np.floating] = np.frombuffer(path.read_bytes(), _RAW[path.suffix.lower()])
    if values.size != math.prod(about["shape"]):
        raise ValueError(f"it holds {values.size} numbers, {math.prod(about['shape'])} expected for {about['shape']}")
    return values.astype(np.float64).reshape(about["shape"])
