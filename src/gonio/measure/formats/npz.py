"""Read untrusted NumPy .npz files: everything that a header states is checked before it is used."""

from __future__ import annotations

import ast
import io
import struct
import zipfile
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError

MEMBERS = 4096
HEADER = 4096  # maximum length of an array's header
LARGEST = 1 << 28  # maximum total size of compressed arrays in bytes: DEFLATE compresses zeros by a factor of 1000


def arrays(data: bytes, where: str) -> dict[str, NDArray[np.generic]]:
    """The arrays in a file, by name.

    where  name of the file in errors
    Raises InputError if the file is not a zip file, is damaged, or contains pickled objects.
    """
    if data[-22:-18] != b"PK\5\6":  # the end of an archive without a comment
        raise InputError("it does not end like a .npz file", where, "the file is truncated, longer, or not a .npz")
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as file:
            members = file.infolist()
            if len(members) > MEMBERS:
                raise InputError(f"{len(members)} arrays, at most {MEMBERS} expected", where)
            limit = max(4 * len(data), min(LARGEST, 1032 * len(data)))
            if sum(one.file_size for one in members) > limit:
                size = sum(one.file_size for one in members)
                raise InputError(f"{len(data)} bytes claim to hold {size}", where, "such a file is not unpacked")
            entries: dict[str, NDArray[np.generic]] = {}
            total = 0
            for member in members:
                name = member.filename.removesuffix(".npy")
                if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED) or member.flag_bits & 1:
                    raise InputError(f"'{name[:80]}' is compressed in an unusual way", where, "use numpy.savez")
                if name in entries:
                    raise InputError(f"'{name[:80]}' occurs twice", where)
                with file.open(member) as part:
                    content = part.read(member.file_size + 1)  # content longer than claimed is rejected
                total += len(content)
                if len(content) != member.file_size or total > limit:
                    raise InputError(f"'{name[:80]}' is longer than it claims", where)
                entries[name] = _array(content, name, where)
            return entries
    except InputError:
        raise
    except Exception as error:  # for damaged content, zipfile and zlib raise exceptions of their own types
        what = f"no arrays can be read from it: {type(error).__name__}: {str(error)[:120]}"
        raise InputError(what, where, "the file is damaged, or not a .npz") from None


def _array(content: bytes, name: str, where: str) -> NDArray[np.generic]:
    place = f"{where}: {name[:80]}"
    if content[:6] != b"\x93NUMPY" or len(content) < 12:
        raise InputError("not a NumPy array", place)
    wide = content[6] >= 2
    start = 12 if wide else 10
    (length,) = struct.unpack_from("<I" if wide else "<H", content, 8)
    if length > HEADER or start + length > len(content):
        raise InputError(f"a header of {length} characters", place, "the file is damaged")
    try:
        header = ast.literal_eval(content[start : start + length].decode("latin-1").strip())
        dtype, shape, fortran = np.dtype(header["descr"]), tuple(header["shape"]), bool(header["fortran_order"])
        sound = all(isinstance(side, int) and side >= 0 for side in shape) and len(shape) <= 8
    except Exception:
        raise InputError("its header cannot be read", place, "the file is damaged") from None
    if dtype.kind not in "fiubU" or dtype.hasobject:
        raise InputError(f"values of type {dtype}, plain numbers expected", place, "pickled objects are never loaded")
    size = dtype.itemsize
    for side in shape if sound else (-1,):
        size *= side
    if not sound or size != len(content) - start - length:
        what = f"a header of {' x '.join(map(str, shape))} values, {len(content) - start - length} bytes follow"
        raise InputError(what[:200], place, "the file is damaged")
    if size == 0:
        return np.zeros(shape, dtype)
    return np.frombuffer(content, dtype, offset=start + length).reshape(shape, order="F" if fortran else "C")


def written(parts: Mapping[str, NDArray[np.generic]]) -> bytes:
    """The bytes of an uncompressed .npz file with the given arrays. Equal arrays give identical bytes."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_STORED) as file:
        for name, array in parts.items():
            part = io.BytesIO()
            np.save(part, np.ascontiguousarray(array), allow_pickle=False)
            file.writestr(zipfile.ZipInfo(f"{name}.npy", (1980, 1, 1, 0, 0, 0)), part.getvalue())
    return stream.getvalue()
