"""Check the files to which a Mitsuba scene refers: pictures, meshes and volumes, which Mitsuba opens itself."""

from __future__ import annotations

import itertools
import re
import struct
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np

from .formats import Unreadable, check, decode, kind_of, mitsuba_path

MAX_BYTES = 1 << 30  # maximum size of a file


def check_file(path: Path) -> None:
    """Raise Unreadable if a file of a known kind, which Mitsuba will open, is damaged."""
    if path.stat().st_size > MAX_BYTES:
        raise Unreadable(f"it is larger than {MAX_BYTES >> 20} MiB")
    mitsuba_path(path)
    content = path.read_bytes()
    kind = kind_of(content)
    if kind is None:
        for starts, checked in _PLAIN:
            if starts(path, content):
                try:
                    checked(content)
                except (struct.error, IndexError):
                    raise Unreadable("it is truncated in its header") from None
        return
    if kind in ("RGBE", "OpenEXR"):  # while a scene is loaded, an unreadable EXR may end the process
        decode(path, content, kind)
    else:
        check(content, kind)


def _fits(content: bytes, at: int, needed: int) -> None:
    if not 0 <= at <= len(content) or not 0 < needed <= len(content) - at:
        raise Unreadable("it claims more pixels than it contains")


def _plain_text(content: bytes) -> None:
    """Check a PPM or PFM file: a text header, then the values."""
    header = re.match(rb"P([6Ff])\s(\d{1,6})\s(\d{1,6})\s([-+.\d]{1,20})\s", content)
    if header is None:
        raise Unreadable("its header is damaged")
    kind, width, height = header[1], int(header[2]), int(header[3])
    if kind == b"6" and header[4] not in (b"255", b"65535"):
        raise Unreadable("its largest value is neither 255 nor 65535")
    each = {b"6": 3 if header[4] == b"255" else 6, b"F": 12, b"f": 4}[kind]
    _fits(content, header.end(), width * height * each)


def _bmp(content: bytes) -> None:
    start, size, width, height, planes, depth, packed = struct.unpack("<IIiiHHI", content[10:34])
    if size < 40 or planes != 1 or depth not in (1, 8, 16, 24, 32) or packed or width <= 0 or height == 0:
        raise Unreadable("it is compressed, or its header is damaged: save it as PNG")
    colors = struct.unpack("<I", content[46:50])[0] or (1 << depth if depth <= 8 else 0)
    if colors > 256 or start < 14 + size + 4 * colors:
        raise Unreadable("its header is damaged")
    _fits(content, start, (depth * width + 31) // 32 * 4 * abs(height))


def _tga(content: bytes) -> None:
    text, table, kind, width, height, depth = struct.unpack("<BBB9xHHB", content[:17])
    if table or kind not in (2, 3) or depth not in (8, 16, 24, 32):
        raise Unreadable("it is compressed or has a color table, which is not supported: save it as PNG")
    _fits(content, 18 + text, width * height * depth // 8)


# flags of a serialized mesh: the number of values per vertex of each optional attribute, and double precision
_ATTRIBUTES = {0x1: 3, 0x2: 2, 0x8: 3}
_DOUBLE = 0x2000
_MAX_NAME = 1 << 16
_CHUNK = 1 << 20


def _serialized(content: bytes) -> None:
    """Check a file of Mitsuba's serialized meshes.

    Each mesh consists of an uncompressed header and a zlib stream; the offsets of the meshes are at the end of the
    file.
    """
    version = struct.unpack_from("<H", content, 2)[0]
    if version not in (3, 4):
        raise Unreadable(f"it is of version {version}, 3 or 4 expected")
    count = struct.unpack_from("<I", content, len(content) - 4)[0]
    wide = 8 if version == 4 else 4
    end = len(content) - 4 - wide * count
    if count == 0 or end < 8:
        raise Unreadable(f"it claims to contain {count} meshes")
    begins = np.frombuffer(content, f"<u{wide}", count, end).tolist()
    if begins[0] != 0 or any(a >= b for a, b in itertools.pairwise([*begins, end])):
        raise Unreadable("its list of offsets is damaged")
    for begin, after in itertools.pairwise([*begins, end]):
        if content[begin : begin + 4] != content[:4]:
            raise Unreadable(f"there is no mesh at byte {begin}")
        _serialized_mesh(content[begin + 4 : after], named=version == 4)


def _serialized_mesh(packed: bytes, named: bool) -> None:
    stream = _Inflated(packed)
    flags = struct.unpack("<I", stream.take(4))[0]
    if named:
        for _ in range(_MAX_NAME):
            if stream.take(1) == b"\0":
                break
        else:
            raise Unreadable("the name of a mesh is not terminated")
    vertices, faces = struct.unpack("<QQ", stream.take(16))
    if not 0 < vertices < 1 << 32 or not 0 < faces < 1 << 32:
        raise Unreadable(f"a mesh claims {vertices} vertices and {faces} faces")
    numbers = 3 + sum(each for flag, each in _ATTRIBUTES.items() if flags & flag)
    stream.skip(vertices * numbers * (8 if flags & _DOUBLE else 4))
    for first in range(0, faces, _CHUNK):
        corners = np.frombuffer(stream.take(12 * min(_CHUNK, faces - first)), "<u4")
        if corners.max() >= vertices:
            raise Unreadable(f"a face refers to vertex {corners.max()} of {vertices}")


class _Inflated:
    """A zlib stream that is decompressed in pieces, so that no memory is allocated for wrongly stated sizes."""

    def __init__(self, packed: bytes) -> None:
        self.zlib, self.packed, self.ready = zlib.decompressobj(), packed, b""

    def take(self, count: int) -> bytes:
        while len(self.ready) < count:
            try:
                more = self.zlib.decompress(self.packed, max(count - len(self.ready), 4096))
            except zlib.error as error:
                raise Unreadable(f"it cannot be decompressed: {error}") from None
            self.packed = self.zlib.unconsumed_tail
            if not more:
                raise Unreadable("it claims more vertices or faces than it contains")
            self.ready += more
        result, self.ready = self.ready[:count], self.ready[count:]
        return result

    def skip(self, count: int) -> None:
        while count > 0:
            count -= len(self.take(min(count, _CHUNK)))


def _volume(content: bytes) -> None:
    """Check a volume: a grid of float32 values."""
    version, kind, x, y, z, channels = struct.unpack_from("<Biiiii", content, 3)
    if version != 3 or kind != 1 or min(x, y, z) <= 0 or channels not in (1, 3, 6):
        raise Unreadable("it is not a grid of 32-bit values with 1, 3 or 6 channels")
    _fits(content, 48, 4 * x * y * z * channels)


# pairs (whether a file has this format, the check of its content)
_PLAIN: tuple[tuple[Callable[[Path, bytes], bool], Callable[[bytes], None]], ...] = (
    (lambda path, content: content[:2] in (b"P6", b"PF", b"Pf"), _plain_text),
    (lambda path, content: content[:2] == b"BM", _bmp),
    (lambda path, content: content[:2] == b"\x1c\x04", _serialized),
    (lambda path, content: content[:3] == b"VOL", _volume),
    (lambda path, content: path.suffix.lower() == ".tga" or content[-18:-2] == b"TRUEVISION-XFILE", _tga),
)
