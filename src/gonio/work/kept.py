"""Files of metadata ("facts") and arrays that are written atomically and detect damage.

    "gonio kept 1\\n"   magic number
    8 bytes            length of the header, little-endian
    header             JSON: {"facts": ..., "arrays": [[name, dtype, shape], ...]}
    arrays             one after the other, little-endian, in C order
    4 bytes            CRC-32 of all preceding bytes

The header determines the length, which reveals a truncated file, and the checksum reveals damage. The previous version
of the file is kept beside it as NAME.previous, in case the newest one is damaged. Files never contain code that would
be executed.
"""

from __future__ import annotations

import contextlib
import glob
import json
import math
import os
import struct
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .. import files
from ..errors import InputError

Facts: TypeAlias = dict[str, Any]  # anything that JSON can hold
Arrays: TypeAlias = dict[str, NDArray[Any]]

_MAGIC = b"gonio kept 1\n"
_TYPES = ("float64", "float32", "int64", "uint32", "uint8", "bool")
_CHUNK = 1 << 24  # bytes written at a time, so that computing the checksum does not need a second copy


class Kept(NamedTuple):
    """The facts and arrays in a file."""

    facts: Facts
    arrays: Arrays


def write(
    path: Path, facts: Facts, arrays: Mapping[str, NDArray[Any]], previous: bool = False, durable: bool = True
) -> None:
    """Write a file atomically: at any time, either the old or the new version exists.

    previous  whether to keep the existing file as NAME.previous
    durable   whether to flush the file to the disk
    Raises MachineError if the disk is full, TypeError for an array of a type that cannot be stored.
    """
    parts = {name: np.ascontiguousarray(array) for name, array in arrays.items()}
    for name, array in parts.items():
        if array.dtype.name not in _TYPES:
            raise TypeError(f"array '{name}' is {array.dtype}, expected one of {', '.join(_TYPES)}")
    listed = [[name, array.dtype.name, [*array.shape]] for name, array in parts.items()]
    header = json.dumps({"facts": facts, "arrays": listed}).encode()

    def fill(part: Path) -> None:
        total = 0
        with open(part, "wb") as file:
            begin = _MAGIC + struct.pack("<Q", len(header)) + header
            for piece in (memoryview(begin), *(_bytes(array) for array in parts.values())):
                for at in range(0, len(piece), _CHUNK):
                    total = zlib.crc32(piece[at : at + _CHUNK], total)
                file.write(piece)
            file.write(struct.pack("<I", total))

    if not previous:
        files.write_whole(path, fill, rescue=False, durable=durable)
        return
    newest = files.with_ending(path, ".next")
    files.write_whole(newest, fill, rescue=False, durable=durable)
    if path.exists():
        os.replace(path, _previous(path))
    os.replace(newest, path)  # if the process ends just before this, NAME.previous remains


def _bytes(array: NDArray[Any]) -> memoryview:
    little = array.astype(array.dtype.newbyteorder("<"), copy=False)
    return little.reshape(-1).view(np.uint8).data if little.size else memoryview(b"")


def _previous(path: Path) -> Path:
    return files.with_ending(path, ".previous")


def remove(path: Path) -> None:
    """Remove a file, its NAME.previous, and unfinished versions of it."""
    newest = files.with_ending(path, ".next")
    left = path.parent.glob(
        f".{glob.escape(newest.name)}.*.part.next"
    )  # left by a process that was killed while it wrote
    for name in (path, _previous(path), newest, *left):
        name.unlink(missing_ok=True)


def exists(path: Path) -> bool:
    """Whether a file or its NAME.previous exists."""
    return os.path.isfile(path) or os.path.isfile(_previous(path))


def remove_damaged(path: Path) -> None:
    """Remove a damaged file if NAME.previous exists, because the next `write` would replace the latter with it."""
    with contextlib.suppress(OSError):
        try:
            _read(path)
        except InputError:
            if _previous(path).exists():
                path.unlink(missing_ok=True)


def read(path: Path) -> Kept:
    """Read a file, or NAME.previous if the file is damaged. Raises InputError if neither can be used."""
    problem = None
    for name in (path, _previous(path)):
        try:
            return _read(name)
        except InputError as error:
            problem = problem or error
    assert problem is not None
    raise problem


def _read(path: Path) -> Kept:
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}", str(path), "check the name") from None
    damaged = InputError("this file is damaged or was cut short", str(path), "remove it, and start again")
    start = len(_MAGIC) + 8
    if content[: len(_MAGIC)] != _MAGIC:
        raise InputError("this is not a checkpoint of Gonio", str(path), "give a file that --checkpoint has written")
    if len(content) < start + 4:
        raise damaged
    (length,) = struct.unpack("<Q", content[len(_MAGIC) : start])
    body = memoryview(content)[:-4]
    if start + length > len(body) or zlib.crc32(body) != struct.unpack("<I", content[-4:])[0]:
        raise damaged
    try:
        header = json.loads(bytes(body[start : start + length]))
        at, arrays = start + length, {}
        for name, kind, shape in header["arrays"]:
            if kind not in _TYPES or any(not isinstance(n, int) or n < 0 for n in shape):
                raise damaged
            dtype = np.dtype(kind).newbyteorder("<")
            count = math.prod(shape)
            if count * dtype.itemsize > len(body) - at:
                raise damaged
            values = np.frombuffer(body, dtype, count, at).reshape(shape)
            arrays[str(name)] = values.astype(np.dtype(kind), copy=False)
            at += count * dtype.itemsize
        facts = header["facts"]
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise error if isinstance(error, InputError) else damaged from None
    if at != len(body) or not isinstance(facts, dict):
        raise damaged
    return Kept(facts, arrays)
