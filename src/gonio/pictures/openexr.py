"""Check the layout of untrusted OpenEXR files: header, offset table and blocks ("OpenEXR File Layout", openexr.com).

The OpenEXR library allocates the sizes that a file states before it reads the data. All sizes are therefore compared to
the length of the file.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

MAX_CHANNELS = 1024  # some files have one channel per object


class Unreadable(ValueError):
    """Raised if a picture is damaged or inconsistent; the message states the reason."""


class Claimed(NamedTuple):
    """The data that a header states: the size in pixels, and the smallest number of uncompressed bits per pixel."""

    width: int
    height: int
    bits: int


_HALF_FLOAT = (32, 16, 32)  # numbers of bits of UINT, HALF and FLOAT


def claimed(content: bytes) -> Claimed:
    """The size stated in the header of a file. Raises Unreadable if the header is inconsistent."""
    attributes = {name: value for name, _, value in attributes_of(content)}
    try:
        width, height = _window(attributes)
        channels = attributes["channels"]
        for name in ("compression", "displayWindow", "lineOrder", "pixelAspectRatio", "screenWindowCenter"):
            attributes[name]
    except KeyError as error:
        raise Unreadable(f"its header lacks '{error.args[0]}'") from None
    at, count, bits = 0, 0, 0
    while channels[at]:  # name, then type, linear and reserved, sampling along x and y
        end = channels.find(b"\0", at)
        if end < 0:
            raise Unreadable("its list of channels is damaged")
        at = end + 1
        kind, _, along_x, along_y = struct.unpack("<iIii", channels[at : at + 16])
        if not 0 <= kind < 3:
            raise Unreadable(f"it has a channel of unknown type {kind}")
        if along_x != 1 or along_y != 1:
            raise Unreadable("it has a channel with fewer pixels than the others, which is not supported")
        at, count, bits = at + 16, count + 1, bits + _HALF_FLOAT[kind]
    if not 0 < count <= MAX_CHANNELS:
        raise Unreadable(f"it has {count} channels")
    return Claimed(width, height, bits)


# Sizes of attribute types in bytes (OpenEXR, "File layout"). The library reads this number of bytes, regardless of the
# size that the file states, and would then interpret misaligned data as names and as sizes of blocks to allocate.
_EXR_BYTES = {
    kind: size
    for size, kinds in {
        1: "compression envmap lineOrder",
        4: "float int",
        8: "double rational timecode v2f v2i",
        9: "tiledesc",
        12: "v3f v3i",
        16: "box2f box2i v2d",
        24: "v3d",
        28: "keycode",
        32: "chromaticities",
        36: "m33f",
        64: "m44f",
        72: "m33d",
        128: "m44d",
    }.items()
    for kind in kinds.split()
}


def attributes_of(content: bytes) -> Iterator[tuple[str, str, bytes]]:
    """The name, type and value of each attribute in the first header of an OpenEXR file.

    Raises Unreadable if the header is damaged.
    """
    version = _version(content)
    if version & ~0x1EFF:
        raise Unreadable(f"it is of an unknown version of OpenEXR, {version:#x}")
    if version & 0x800:
        raise Unreadable("it contains deep data, which is not supported")
    for name, kind, value, _ in _header(content, 8):
        yield name, kind, value


def _version(content: bytes) -> int:
    version: int = struct.unpack("<I", content[4:8])[0]
    if version & 0xFF != 2:
        raise Unreadable(f"it is of an unknown version of OpenEXR, {version:#x}")
    return version


def _header(content: bytes, at: int) -> Iterator[tuple[str, str, bytes, int]]:
    """The name, type and value of each attribute of the header at `at`, and the position of the next attribute."""
    while content[at]:
        texts = []
        for _ in range(2):  # name and type
            end = content.find(b"\0", at, at + 256)
            if end < 0:
                raise Unreadable("its header is damaged")
            texts.append(content[at:end].decode("utf-8", "replace"))
            at = end + 1
        size = struct.unpack("<i", content[at : at + 4])[0]
        if not 0 <= size <= len(content) - at - 4:
            raise Unreadable(f"its attribute '{texts[0]}' is longer than the file")
        if size != _EXR_BYTES.get(texts[1], size):
            raise Unreadable(f"its attribute '{texts[0]}' has {size} bytes, {texts[1]} has {_EXR_BYTES[texts[1]]}")
        value = content[at + 4 : at + 4 + size]
        if texts[1] == "preview" and (size < 8 or size != 8 + 4 * math.prod(struct.unpack("<II", value[:8]))):
            raise Unreadable(f"its attribute '{texts[0]}' is not a preview of the stated size")
        at += 4 + size
        yield texts[0], texts[1], value, at


# ---------------------------------------------------------------------- blocks

_LINES = (1, 1, 1, 16, 32, 16, 32, 32, 32, 256)  # number of lines in a block, by compression
MIN_BLOCK = 1 << 19  # pixels that a block may have in a picture of any size; the library holds a dozen blocks


def check_blocks(content: bytes) -> None:
    """Raise Unreadable if an offset table, or a block of the stated size, extends beyond the end of the file."""
    version, at = _version(content), 8
    several = bool(version & 0x1000)
    parts: list[dict[str, bytes]] = []  # attributes of each part
    while not parts or (several and content[at]):
        entries = list(_header(content, at))
        parts.append({name: value for name, _, value, _ in entries})
        at = entries[-1][3] + 1  # after the empty name that ends a header
    at += several
    for attributes in parts:
        tiled = "tiles" in attributes if several else bool(version & 0x200)
        count = _tiles(attributes) if tiled else _line_blocks(attributes)
        if count > (len(content) - at) // 8:
            raise Unreadable("it is truncated in its table of blocks")
        before = (4 if several else 0) + (16 if tiled else 4)  # bytes of the part number and the position of a block
        offsets = struct.unpack(f"<{count}Q", content[at : at + 8 * count])
        at += 8 * count
        for offset in offsets:
            start = offset + before + 4
            if not at <= offset <= len(content) - before - 4:
                raise Unreadable("its table of blocks is damaged")
            if not 0 <= struct.unpack("<i", content[start - 4 : start])[0] <= len(content) - start:
                raise Unreadable("it is truncated, or states a block that is longer than the file")


def _window(attributes: dict[str, bytes]) -> tuple[int, int]:
    left, top, right, bottom = struct.unpack("<iiii", attributes["dataWindow"])
    return right - left + 1, bottom - top + 1


def _line_blocks(attributes: dict[str, bytes]) -> int:
    compression = attributes["compression"][0]
    if compression >= len(_LINES):
        raise Unreadable(f"its compression {compression} is unknown")
    (width, height), lines = _window(attributes), _LINES[compression]
    if width * lines > max(MIN_BLOCK, width * height):
        raise Unreadable(f"its {width} x {height} pixels are fewer than a block of {lines} lines has")
    return -(-height // lines)


def _tiles(attributes: dict[str, bytes]) -> int:
    """The number of tiles of all levels."""
    width, height = _window(attributes)
    across, along, mode = struct.unpack("<IIB", attributes["tiles"])
    if not across or not along or across * along > max(MIN_BLOCK, width * height):
        raise Unreadable(f"it has tiles of {across} x {along} pixels")
    up, kind = mode >> 4 & 1, mode & 0xF

    def sides(size: int, levels: int) -> list[int]:
        return [max(1, size + up * ((1 << level) - 1) >> level) for level in range(levels)]

    def levels(size: int) -> int:
        return 1 + ((size - 1).bit_length() if up else size.bit_length() - 1)

    if kind == 0:
        pairs = [(width, height)]
    elif kind == 1:  # mipmap levels
        both = levels(max(width, height))
        pairs = list(zip(sides(width, both), sides(height, both), strict=True))
    else:  # ripmap levels: every combination of a horizontal and a vertical level
        pairs = list(product(sides(width, levels(width)), sides(height, levels(height))))
    return sum(-(-w // across) * -(-h // along) for w, h in pairs)
