"""Untrusted NumPy .npz files.

arrays = archives.read(path)                # every array by name; raises Unreadable
arrays = archives.read(path, ["values"])    # those of the named arrays that exist; the others are not unpacked
"""

from __future__ import annotations

import math
import zipfile
from collections.abc import Collection
from pathlib import Path

import numpy as np

# A file that unpacks to more than this is treated as a decompression bomb: 64 MiB plus 100 bytes per byte of the file.
# DEFLATE reaches a factor of 1000, but measured or rendered numbers shrink by a factor of 2 at most.
MIN_LIMIT, MAX_EXPANSION = 1 << 26, 100
MAX_ENTRIES = 1000


class Unreadable(ValueError):
    """Raised if a file is not an .npz archive, is damaged, or unpacks to an implausible size."""


def read(path: Path, names: Collection[str] | None = None) -> dict[str, np.ndarray]:
    """The arrays in a file by name: all, or those of `names` that exist. Pickled objects are never loaded.

    Raises Unreadable if the file is not an .npz archive, is damaged or unpacks to an implausible size, and OSError if
    it cannot be opened.
    """
    with open(path, "rb") as file:
        try:
            with zipfile.ZipFile(file) as archive:
                entries = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
                if len(entries) > MAX_ENTRIES:
                    raise Unreadable(f"it has {len(entries)} entries, at most {MAX_ENTRIES} expected")
                wanted = {name: info for name, info in entries.items() if names is None or name in names}
                limit = MIN_LIMIT + MAX_EXPANSION * path.stat().st_size
                size = sum(info.file_size for info in wanted.values())
                if size > limit:
                    raise Unreadable(f"it unpacks to {size >> 20} MiB, at most {limit >> 20} MiB expected")
                return {name: _array(archive, info) for name, info in wanted.items()}
        except Unreadable:
            raise
        except Exception as error:  # zipfile, zlib and NumPy's header parser raise exceptions of different types
            raise Unreadable(str(error) or type(error).__name__) from error


def _array(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> np.ndarray:
    with archive.open(info) as file:
        version = np.lib.format.read_magic(file)
        header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, fortran, dtype = header(file)
        if dtype.hasobject:
            raise Unreadable(f"'{info.filename}' holds pickled objects, which are never loaded")
        if min(shape, default=1) < 0 or math.prod(shape) * dtype.itemsize != info.file_size - file.tell():
            raise Unreadable(f"'{info.filename}' claims the shape {shape}, which does not match its size")
        # `read` returns the bytes that exist, regardless of the size in the directory
        values = np.frombuffer(bytearray(file.read(info.file_size)), dtype, math.prod(shape))
    return values.reshape(shape[::-1]).T if fortran else values.reshape(shape)
