"""Decode untrusted picture files.

Before a C++ library reads a file, its header (sizes, chunks, attributes) is checked against the length of the file.
Radiance files are decoded by this module, because Mitsuba's reader writes beyond its buffer if run lengths are wrong.

    kind = formats.kind_of(content)
    values, integers = formats.decode(path, content, kind)      # (H, W, channels)
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..bridge import engine
from ..bridge.faults.exr_threads import file_threads
from . import openexr
from .openexr import Claimed, Unreadable

# DEFLATE, the most effective compression of these formats, expands a byte to at most 1032 bytes. If a header states a
# larger size, the file is rejected.
MAX_EXPANSION = 1032
MAX_PIXELS = 1 << 28  # 16384 x 16384: 3 GiB as float32 RGB
MAX_SIDE = 1 << 20  # limit of libpng

_MAGIC = {
    b"\x89PNG\r\n\x1a\n": "PNG",
    b"\xff\xd8\xff": "JPEG",
    b"\x76\x2f\x31\x01": "OpenEXR",
    b"#?": "RGBE",
}


def kind_of(content: bytes) -> str | None:
    """The format of a file, from its first bytes: "PNG", "JPEG", "OpenEXR" or "RGBE"; None for other formats."""
    return next((kind for magic, kind in _MAGIC.items() if content.startswith(magic)), None)


def check(content: bytes, kind: str) -> Claimed:
    """Raise Unreadable if a file is inconsistent, or if its header states more pixels than it can contain."""
    try:
        claimed = _HEADERS[kind](content)
        _check_size(claimed, len(content))
        if kind == "OpenEXR":
            openexr.check_blocks(content)
    except (struct.error, IndexError):
        raise Unreadable("it is truncated in its header") from None
    return claimed


def _check_size(claimed: Claimed, length: int) -> None:
    if not (0 < claimed.width <= MAX_SIDE and 0 < claimed.height <= MAX_SIDE):
        raise Unreadable(f"it claims {claimed.width} x {claimed.height} pixels")
    pixels = claimed.width * claimed.height
    if pixels * claimed.bits > MAX_EXPANSION * 8 * length:
        raise Unreadable(f"it claims {claimed.width} x {claimed.height} pixels, which {length} bytes cannot contain")
    if pixels > MAX_PIXELS:
        raise Unreadable(f"its {claimed.width} x {claimed.height} pixels are more than {MAX_PIXELS >> 20} Mi")


class Decoded(NamedTuple):
    """The values of a file, (H, W, channels), with row 0 on top.

    integers  whether the format stores integers; their values are scaled to [0, 1]
    """

    values: NDArray[np.float32]
    integers: bool


def decode(path: Path, content: bytes, kind: str) -> Decoded:
    """Decode a file with the given content and format. Raises Unreadable if it is damaged."""
    claimed = check(content, kind)
    if kind == "RGBE":
        return Decoded(_radiance(content, claimed), False)
    mi = engine.load()
    try:
        # Read from the file instead of a memory stream, because Mitsuba's memory streams read beyond their end.
        with file_threads():
            values = np.array(mi.Bitmap(mitsuba_path(path), getattr(mi.Bitmap.FileFormat, kind)))
    except (RuntimeError, ValueError) as error:  # including UnicodeDecodeError
        raise Unreadable(_reason(error)) from None
    values = values if values.ndim == 3 else values[..., None]
    if values.dtype.kind == "f":
        return Decoded(values.astype(np.float32, copy=False), False)
    return Decoded(values.astype(np.float32) / np.float32(np.iinfo(values.dtype).max), True)


def mitsuba_path(path: Path) -> str:
    """The path of a file in the form that Mitsuba requires. Raises Unreadable if it is not valid UTF-8."""
    try:
        str(path).encode()
    except UnicodeEncodeError:
        raise Unreadable("its name is not UTF-8, which Mitsuba needs: rename the file") from None
    return str(path)


def _reason(error: Exception) -> str:
    """The message of an error of Mitsuba, without the class and the name of the stream."""
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
    """The type and data of each chunk up to IEND (ISO 15948, 5.3). Raises Unreadable if the file ends before IEND."""
    at, kind = 8, b""
    while kind != b"IEND":
        if at + 12 > len(content):
            raise Unreadable("it is truncated")
        length, kind = struct.unpack(">I4s", content[at : at + 8])
        if length > len(content) - at - 12:
            raise Unreadable("it is truncated")
        yield kind, content[at + 8 : at + 8 + length]
        at += 12 + length


def _jpeg(content: bytes) -> Claimed:
    """The size stated in the first start-of-frame segment (ITU T.81, B.2.2)."""
    at = 2
    while content[at] == 0xFF:
        marker = content[at + 1]
        if marker == 0xFF:  # fill byte
            at += 1
            continue
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            height, width = struct.unpack(">HH", content[at + 5 : at + 9])
            # Huffman codes take at least one bit per block of 64 pixels, 1/16 of the limit for DEFLATE
            return Claimed(width, height, 16 if marker < 0xC8 else 1)
        at += 2 + struct.unpack(">H", content[at + 2 : at + 4])[0]
    raise Unreadable("its header is damaged")


_RESOLUTION = re.compile(rb"\n\n-Y (\d{1,9}) \+X (\d{1,9})\n")
_MAX_HEADER = 1 << 16  # bytes


def _resolution(content: bytes) -> re.Match[bytes] | None:
    """The resolution line of a Radiance file, which follows the first empty line.

    Mitsuba uses the first line of this form anywhere in the file. A file with another such line in its header is
    therefore rejected, even if only Mitsuba would accept that line.
    """
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
    # a run of 127 equal bytes takes two bytes
    return Claimed(int(resolution[2]), int(resolution[1]), 1)


# ---------------------------------------------------------------------- Radiance


def _radiance(content: bytes, claimed: Claimed) -> NDArray[np.float32]:
    """Decode a Radiance picture, whose red, green and blue are mantissas with a shared exponent [Ward's `color.c`]."""
    resolution = _resolution(content)
    assert resolution is not None, "`check` has verified it"
    width, height = claimed.width, claimed.height
    data = memoryview(content)[resolution.end() :]
    if 8 <= width < 1 << 15 and len(data) >= 4 and data[0] == 2 and data[1] == 2 and data[2] < 128:
        rgbe = _runs(data, width, height)
    elif len(data) >= 4 * width * height:
        rgbe = np.frombuffer(data, np.uint8, 4 * width * height).reshape(height, width, 4)
        if np.any(np.all(rgbe[:, :, :3] == 1, axis=2)):  # the marker of an old-style run
            raise Unreadable("it has old-style run lengths, which are not supported")
    else:
        raise Unreadable("it is truncated")
    scale = np.ldexp(np.float32(1.0), rgbe[..., 3].astype(np.int32) - (128 + 8))
    scale[rgbe[..., 3] == 0] = 0.0
    return np.multiply(rgbe[..., :3], scale[..., None], dtype=np.float32)


def _runs(data: memoryview, width: int, height: int) -> NDArray[np.uint8]:
    """Decode run-length encoded scanlines of four planes.

    A count above 128 repeats the next byte count - 128 times; any other count copies the next count bytes.
    """
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
        raise error if isinstance(error, Unreadable) else Unreadable("it is truncated") from None
    return lines.reshape(height, 4, width).transpose(0, 2, 1)


_HEADERS = {"PNG": _png, "JPEG": _jpeg, "OpenEXR": openexr.claimed, "RGBE": _rgbe}
