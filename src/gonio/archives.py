"""NumPy's .npz files that nobody vouches for.

arrays = archives.read(path)                # every array by name, or Unreadable
arrays = archives.read(path, ["values"])    # those that are there, the others are not unpacked
"""

from __future__ import annotations

import math
import zipfile
from collections.abc import Collection
from pathlib import Path

import numpy as np

# What unpacks to more than this is taken for an attack on the memory: 64 MiB, and 100 bytes of one. DEFLATE could make
# a thousand of one, but numbers that somebody measured or rendered shrink to a half at most.
LEAST_LIMIT, DENSEST = 1 << 26, 100
MOST_ENTRIES = 1000


class Unreadable(ValueError):
    """A file that is no .npz, is damaged, or unpacks to more than it can hold; the text is the reason."""


def read(path: Path, names: Collection[str] | None = None) -> dict[str, np.ndarray]:
    """The arrays in a file by name, all or those of `names` that it has. Objects (pickles) are never loaded.

    Raises Unreadable, and OSError where the file cannot be opened.
    """
    with open(path, "rb") as file:
        try:
            with zipfile.ZipFile(file) as archive:
                entries = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
                if len(entries) > MOST_ENTRIES:
                    raise Unreadable(f"it has {len(entries)} entries, {MOST_ENTRIES} at most are expected")
                wanted = {name: info for name, info in entries.items() if names is None or name in names}
                limit = LEAST_LIMIT + DENSEST * path.stat().st_size
                size = sum(info.file_size for info in wanted.values())
                if size > limit:
                    raise Unreadable(f"it unpacks to {size >> 20} MiB, {limit >> 20} MiB at most are expected")
                return {name: _array(archive, info) for name, info in wanted.items()}
        except Unreadable:
            raise
        except Exception as error:  # of any content: zip, zlib, NumPy's header each have their own ways to fail
            raise Unreadable(str(error) or type(error).__name__) from error


def _array(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> np.ndarray:
    with archive.open(info) as file:
        version = np.lib.format.read_magic(file)
        header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, fortran, dtype = header(file)
        if dtype.hasobject:
            raise Unreadable(f"'{info.filename}' holds objects (a pickle), which are never loaded")
        if min(shape, default=1) < 0 or math.prod(shape) * dtype.itemsize != info.file_size - file.tell():
            raise Unreadable(f"'{info.filename}' claims the shape {shape}, which its bytes are not")
        # `read` gives what is there, whatever the directory says of the size
        values = np.frombuffer(bytearray(file.read(info.file_size)), dtype, math.prod(shape))
    return values.reshape(shape[::-1]).T if fortran else values.reshape(shape)
