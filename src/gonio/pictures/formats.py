"""Decoding of untrusted picture files.

The header of a file (sizes, chunks, attributes) is checked against its length before a C++ library reads it. Radiance
files are decoded here, since Mitsuba's reader writes past its buffer if run lengths are wrong.

    kind = formats.kind_of(content)
    values, integers = formats.decode(path, content, kind)      # (H, W, channels)
"""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..bridge import engine
from ..bridge.faults.exr_threads import file_threads

# DEFLATE, the densest compression here, expands a byte to at most 1032. A file that claims more is rejected.
MAX_EXPANSION = 1032
MAX_PIXELS = 1 << 28  # 16384 x 16384: 3 GiB as float32 RGB
MAX_SIDE = 1 << 20  # limit of libpng
MAX_CHANNELS = 1024  # of an OpenEXR file: some have one per object

_MAGIC = {
    b"\x89PNG\r\n\x1a\n": "PNG",
    b"\xff\xd8\xff": "JPEG",
    b"\x76\x2f\x31\x01": "OpenEXR",
    b"#?": "RGBE",
}


class Unreadable(ValueError):
    """A picture that is damaged or contradicts itself; the text is the reason."""


class Claimed(NamedTuple):
    """Claims of a header: pixels, and the smallest number of uncompressed bits per pixel."""

    width: int
    height: int
    bits: int


def kind_of(content: bytes) -> str | None:
    """ "PNG", "JPEG", "OpenEXR" or "RGBE", by its first bytes; None for any other format."""
    return next((kind for magic, kind in _MAGIC.items() if content.startswith(magic)), None)


def check(content: bytes, kind: str) -> Claimed:
    """Raise Unreadable if a file contradicts itself, or claims more than it can contain."""
    try:
        claimed = _HEADERS[kind](content)
    except (struct.error, IndexError):
        raise Unreadable("it is cut off in its header") from None
    if not (0 < claimed.width <= MAX_SIDE and 0 < claimed.height <= MAX_SIDE):
        raise Unreadable(f"it claims {claimed.width} x {claimed.height} pixels")
    pixels = claimed.width * claimed.height
    if pixels * claimed.bits > MAX_EXPANSION * 8 * len(content):
        claim = f"{claimed.width} x {claimed.height} pixels"
        raise Unreadable(f"it claims {claim}, which {len(content)} bytes cannot contain")
    if pixels > MAX_PIXELS:
        raise Unreadable(f"its {claimed.width} x {claimed.height} pixels are more than {MAX_PIXELS >> 20} Mi")
    return claimed


class Decoded(NamedTuple):
    """Values (H, W, channels), row 0 on top; integer formats (`integers`) are scaled to [0, 1]."""

    values: NDArray[np.float32]
    integers: bool


def decode(path: Path, content: bytes, kind: str) -> Decoded:
    """The values of a file with that content. Raises Unreadable."""
    claimed = check(content, kind)
    if kind == "RGBE":
        return Decoded(_radiance(content, claimed), False)
    mi = engine.load()
    try:
        # By file instead of a stream of its content: Mitsuba's memory streams read beyond their end.
        with file_threads():
            values = np.array(mi.Bitmap(mitsuba_path(path), getattr(mi.Bitmap.FileFormat, kind)))
    except (RuntimeError, ValueError) as error:  # UnicodeDecodeError among them
        raise Unreadable(_reason(error)) from None
    values = values if values.ndim == 3 else values[..., None]
    if values.dtype.kind == "f":
        return Decoded(values.astype(np.float32, copy=False), False)
    return Decoded(values.astype(np.float32) / np.float32(np.iinfo(values.dtype).max), True)


def mitsuba_path(path: Path) -> str:
    """The path of a file for Mitsuba. Raises Unreadable if it is not UTF-8."""
    try:
        str(path).encode()
    except UnicodeEncodeError:
        raise Unreadable("its name is not UTF-8, which Mitsuba needs: rename the file") from None
    return str(path)


def _reason(error: Exception) -> str:
    """Mitsuba's message without the class and the name of the stream."""
    return re.sub(r'^\s*(\[[^\]]*\]\s*)?("[^"]*":\s*)?', "", str(error).strip().splitlines()[-1])[:200]


# ---------------------------------------------------------------------- headers


def _png(content: bytes) -> Claimed:
    kind, width, height, depth, color = struct.unpack(">4sIIBB", content[12:26])
    channels = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}.get(color)
    if kind != b"IHDR" or channels is None or depth not in (1, 2, 4, 8, 16):
        raise Unreadable("its header is damaged")
    for _ in png_chunks(content):
        pass
    return Claimed(width, height, depth * channels)


def png_chunks(content: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Kind and data of each chunk (ISO 15948, 5.3), up to IEND. Raises Unreadable if the file ends before it."""
    at, kind = 8, b""
    while kind != b"IEND":
        if at + 12 > len(content):
            raise Unreadable("it is cut off")
        length, kind = struct.unpack(">I4s", content[at : at + 8])
        if length > len(content) - at - 12:
            raise Unreadable("it is cut off")
        yield kind, content[at + 8 : at + 8 + length]
        at += 12 + length


def _jpeg(content: bytes) -> Claimed:
    """The size from the first start-of-frame segment (ITU T.81, B.2.2)."""
    at = 2
    while content[at] == 0xFF:
        marker = content[at + 1]
        if marker == 0xFF:  # fill byte
            at += 1
            continue
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            height, width = struct.unpack(">HH", content[at + 5 : at + 9])
            return Claimed(width, height, 1)  # a block of 64 equal pixels takes a few bits
        at += 2 + struct.unpack(">H", content[at + 2 : at + 4])[0]
    raise Unreadable("its header is damaged")


_HALF_FLOAT = (32, 16, 32)  # bits of UINT, HALF and FLOAT


def _exr(content: bytes) -> Claimed:
    attributes = {name: value for name, _, value in exr_attributes(content)}
    try:
        left, top, right, bottom = struct.unpack("<iiii", attributes["dataWindow"])
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
    return Claimed(right - left + 1, bottom - top + 1, bits)


# Sizes of attribute types in bytes (OpenEXR, "File layout"). The library reads that many whatever size the file states,
# and interprets the misaligned rest as names and sizes of blocks to allocate.
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


def exr_attributes(content: bytes) -> Iterator[tuple[str, str, bytes]]:
    """Name, type and value of each attribute of an OpenEXR file's (first) header. Raises Unreadable."""
    version = struct.unpack("<I", content[4:8])[0]
    if version & 0xFF != 2 or version & ~0x1EFF:
        raise Unreadable(f"it is of an unknown version of OpenEXR, {version:#x}")
    if version & 0x800:
        raise Unreadable("it contains deep data, which is not supported")
    at = 8
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
        yield texts[0], texts[1], value
        at += 4 + size


_RESOLUTION = re.compile(rb"\n\n-Y (\d{1,9}) \+X (\d{1,9})\n")
_MAX_HEADER = 1 << 16  # bytes


def _resolution(content: bytes) -> re.Match[bytes] | None:
    """The resolution line after the first empty line. Mitsuba uses the first such line anywhere in the file: a file
    with another one in its header, including one that only Mitsuba accepts, is rejected."""
    empty = content.find(b"\n\n", 0, _MAX_HEADER)
    if empty < 0 or re.search(rb"-Y[^\n]*\+X", content[:empty]):
        return None
    return _RESOLUTION.match(content, empty)


def _rgbe(content: bytes) -> Claimed:
    resolution = _resolution(content)
    if resolution is None:
        raise Unreadable("it has no line '-Y height +X width' after its header")
    if b"FORMAT=32-bit_rle_xyze" in content[: resolution.start()]:
        raise Unreadable("its colors are XYZ, which is not supported")
    # a run of 127 equal bytes takes two
    return Claimed(int(resolution[2]), int(resolution[1]), 1)


# ---------------------------------------------------------------------- Radiance


def _radiance(content: bytes, claimed: Claimed) -> NDArray[np.float32]:
    """Red, green, blue of a Radiance picture [Ward's `color.c`]: three mantissas with a shared exponent."""
    resolution = _resolution(content)
    assert resolution is not None, "`check` has verified it"
    width, height = claimed.width, claimed.height
    data = memoryview(content)[resolution.end() :]
    if 8 <= width < 1 << 15 and len(data) >= 4 and data[0] == 2 and data[1] == 2 and data[2] < 128:
        rgbe = _runs(data, width, height)
    elif len(data) >= 4 * width * height:
        rgbe = np.frombuffer(data, np.uint8, 4 * width * height).reshape(height, width, 4)
        if np.any(np.all(rgbe[:, :, :3] == 1, axis=2)):  # marks a run of the old style
            raise Unreadable("it has old-style run lengths, which are not supported")
    else:
        raise Unreadable("it is cut off")
    scale = np.ldexp(np.float32(1.0), rgbe[..., 3].astype(np.int32) - (128 + 8))
    scale[rgbe[..., 3] == 0] = 0.0
    return np.multiply(rgbe[..., :3], scale[..., None], dtype=np.float32)


def _runs(data: memoryview, width: int, height: int) -> NDArray[np.uint8]:
    """Run-length coded scanlines of four planes: a count above 128 repeats the next byte, another copies as many
    bytes."""
    lines = np.empty((height, 4 * width), np.uint8)
    start = bytes((2, 2, width >> 8, width & 255))
    at = 0
    try:
        for row in lines:
            if data[at : at + 4] != start:
                raise Unreadable("a scanline has a wrong header")
            at, filled, end, line = at + 4, 0, 0, row.data
            for _ in range(4):
                end += width
                while filled < end:
                    count = data[at]
                    if count > 128:
                        count -= 128
                        if filled + count > end:
                            raise Unreadable("a run is longer than its scanline")
                        line[filled : filled + count] = bytes((data[at + 1],)) * count
                        at += 2
                    else:
                        if count == 0 or filled + count > end:
                            raise Unreadable("a run is empty, or longer than its scanline")
                        line[filled : filled + count] = data[at + 1 : at + 1 + count]
                        at += 1 + count
                    filled += count
    except (IndexError, ValueError) as error:
        raise error if isinstance(error, Unreadable) else Unreadable("it is cut off") from None
    return lines.reshape(height, 4, width).transpose(0, 2, 1)


_HEADERS = {"PNG": _png, "JPEG": _jpeg, "OpenEXR": _exr, "RGBE": _rgbe}
