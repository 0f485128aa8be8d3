"""Bytes of a picture that nobody vouches for, to numbers; and what else Mitsuba reads, held against its header.

What stands in a file's header is held against the file before a library in C++ sees a byte of it: sizes, chunks,
attributes. Radiance is read here altogether, since Mitsuba's reader writes past its buffer where run lengths are wrong.

    kind = formats.kind_of(content)
    values, whole = formats.decode(path, content, kind)      # (H, W, channels)
"""

from __future__ import annotations

import itertools
import math
import re
import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..bridge import engine
from ..bridge.faults.exr_threads import file_threads

# DEFLATE, the densest coding here, makes at most 1032 bytes of one. A file that claims more is not allocated.
DENSEST = 1032
MOST_BYTES = 1 << 30  # of a file
MOST_PIXELS = 1 << 28  # 16384 x 16384: 3 GiB as float32 RGB
LARGEST_SIDE = 1 << 20  # what libpng takes at most
MOST_CHANNELS = 1024  # of an OpenEXR file: some have one for every object

_MAGIC = {
    b"\x89PNG\r\n\x1a\n": "PNG",
    b"\xff\xd8\xff": "JPEG",
    b"\x76\x2f\x31\x01": "OpenEXR",
    b"#?": "RGBE",
}


class Unreadable(ValueError):
    """A picture that is damaged, or claims what cannot be; the text is the reason."""


class Claimed(NamedTuple):
    """What a header says: pixels, and bits of the least that a pixel takes before it is compressed."""

    width: int
    height: int
    bits: int


def kind_of(content: bytes) -> str | None:
    """ "PNG", "JPEG", "OpenEXR" or "RGBE", by its first bytes; None where it is none of them."""
    return next((kind for magic, kind in _MAGIC.items() if content.startswith(magic)), None)


def check(content: bytes, kind: str) -> Claimed:
    """Raise Unreadable where a file contradicts itself, or claims more than it can hold."""
    try:
        claimed = _HEADERS[kind](content)
    except (struct.error, IndexError):
        raise Unreadable("it is cut off in its header") from None
    if not (0 < claimed.width <= LARGEST_SIDE and 0 < claimed.height <= LARGEST_SIDE):
        raise Unreadable(f"it claims {claimed.width} x {claimed.height} pixels")
    pixels = claimed.width * claimed.height
    if pixels * claimed.bits > DENSEST * 8 * len(content):
        claim = f"{claimed.width} x {claimed.height} pixels"
        raise Unreadable(f"it claims {claim}, which {len(content)} bytes cannot hold")
    if pixels > MOST_PIXELS:
        raise Unreadable(f"its {claimed.width} x {claimed.height} pixels are more than {MOST_PIXELS >> 20} Mi")
    return claimed


class Decoded(NamedTuple):
    """Values (H, W, channels), row 0 on top; those of a file of whole numbers (`whole`) are shares of the largest."""

    values: NDArray[np.float32]
    whole: bool


def decode(path: Path, content: bytes, kind: str) -> Decoded:
    """What a file with that content holds. Raises Unreadable."""
    claimed = check(content, kind)
    if kind == "RGBE":
        return Decoded(_radiance(content, claimed), False)
    mi = engine.load()
    try:
        # The file again, not its content as a stream: Mitsuba's streams in memory read on behind their end.
        with file_threads():
            values = np.array(mi.Bitmap(mitsuba_path(path), getattr(mi.Bitmap.FileFormat, kind)))
    except (RuntimeError, ValueError) as error:  # UnicodeDecodeError among them
        raise Unreadable(_reason(error)) from None
    values = values if values.ndim == 3 else values[..., None]
    if values.dtype.kind == "f":
        return Decoded(values.astype(np.float32, copy=False), False)
    return Decoded(values.astype(np.float32) / np.float32(np.iinfo(values.dtype).max), True)


def mitsuba_path(path: Path) -> str:
    """The file's name as Mitsuba takes one. Raises Unreadable where it is no text."""
    try:
        str(path).encode()
    except UnicodeEncodeError:
        raise Unreadable("its name is not UTF-8, which Mitsuba needs: rename the file") from None
    return str(path)


def check_file(path: Path) -> None:
    """Raise Unreadable for a file that Mitsuba will open by itself, where it is of a kind known here."""
    if path.stat().st_size > MOST_BYTES:
        raise Unreadable(f"it is larger than {MOST_BYTES >> 20} MiB")
    mitsuba_path(path)
    content = path.read_bytes()
    kind = kind_of(content)
    if kind is None:
        for starts, checked in _PLAIN:
            if starts(path, content):
                try:
                    checked(content)
                except (struct.error, IndexError):
                    raise Unreadable("it is cut off in its header") from None
        return
    if kind in ("RGBE", "OpenEXR"):  # within a scene, an EXR that cannot be read may end the process; alone it raises
        decode(path, content, kind)
    else:
        check(content, kind)


def _reason(error: Exception) -> str:
    """Mitsuba's message without its class and the stream's name."""
    return re.sub(r'^\s*(\[[^\]]*\]\s*)?("[^"]*":\s*)?', "", str(error).strip().splitlines()[-1])[:200]


# ---------------------------------------------------------------------- headers


def _png(content: bytes) -> Claimed:
    kind, width, height, depth, colour = struct.unpack(">4sIIBB", content[12:26])
    channels = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}.get(colour)
    if kind != b"IHDR" or channels is None or depth not in (1, 2, 4, 8, 16):
        raise Unreadable("its header is damaged")
    for _ in png_chunks(content):
        pass
    return Claimed(width, height, depth * channels)


def png_chunks(content: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Kind and data of each chunk (ISO 15948, 5.3), up to IEND. Raises Unreadable where the file ends before it."""
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
    """From the first start-of-frame segment (ITU T.81, B.2.2)."""
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
    if not 0 < count <= MOST_CHANNELS:
        raise Unreadable(f"it has {count} channels")
    return Claimed(right - left + 1, bottom - top + 1, bits)


# Bytes of an attribute's type (OpenEXR, "File layout"). The library reads as many whatever the file says, and takes
# what follows, at the wrong place, for names and sizes of blocks to allocate.
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
        raise Unreadable("it holds deep data, which is not supported")
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
            raise Unreadable(f"its attribute '{texts[0]}' is no preview of the size that it says")
        yield texts[0], texts[1], value
        at += 4 + size


_RESOLUTION = re.compile(rb"\n\n-Y (\d{1,9}) \+X (\d{1,9})\n")
_FURTHEST = 1 << 16  # a header is no longer than this


def _resolution(content: bytes) -> re.Match[bytes] | None:
    """Of the line behind the first empty one. Mitsuba takes the first such line in the file, wherever it stands: a file
    with one in its header too, or with one that only Mitsuba can read there, is refused."""
    empty = content.find(b"\n\n", 0, _FURTHEST)
    if empty < 0 or re.search(rb"-Y[^\n]*\+X", content[:empty]):
        return None
    return _RESOLUTION.match(content, empty)


def _rgbe(content: bytes) -> Claimed:
    found = _resolution(content)
    if found is None:
        raise Unreadable("it has no line '-Y height +X width' behind its header")
    if b"FORMAT=32-bit_rle_xyze" in content[: found.start()]:
        raise Unreadable("its colours are XYZ, which is not supported")
    # a run of 127 equal bytes takes two
    return Claimed(int(found[2]), int(found[1]), 1)


# ---------------------------------------------------------------------- Radiance


def _radiance(content: bytes, claimed: Claimed) -> NDArray[np.float32]:
    """Red, green, blue of a Radiance picture [Ward's `color.c`]: three mantissas with one exponent."""
    found = _resolution(content)
    assert found is not None, "`check` found it"
    width, height = claimed.width, claimed.height
    data = memoryview(content)[found.end() :]
    if 8 <= width < 1 << 15 and len(data) >= 4 and data[0] == 2 and data[1] == 2 and data[2] < 128:
        rgbe = _runs(data, width, height)
    elif len(data) >= 4 * width * height:
        rgbe = np.frombuffer(data, np.uint8, 4 * width * height).reshape(height, width, 4)
        if np.any(np.all(rgbe[:, :, :3] == 1, axis=2)):  # a colour that no program writes: it repeats the one before
            raise Unreadable("it is packed in the way of the 1980s, which is not supported")
    else:
        raise Unreadable("it is cut off")
    scale = np.ldexp(np.float32(1.0), rgbe[..., 3].astype(np.int32) - (128 + 8))
    scale[rgbe[..., 3] == 0] = 0.0
    return np.multiply(rgbe[..., :3], scale[..., None], dtype=np.float32)


def _runs(data: memoryview, width: int, height: int) -> NDArray[np.uint8]:
    """Scanlines of four planes, each of runs: a count above 128 repeats the byte behind it, another copies as many."""
    lines = np.empty((height, 4 * width), np.uint8)
    start = bytes((2, 2, width >> 8, width & 255))
    at = 0
    try:
        for row in lines:
            if data[at : at + 4] != start:
                raise Unreadable("a scanline does not begin as one")
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


# ---------------------------------------------------------------------- formats that only Mitsuba's scenes name


def _fits(content: bytes, at: int, needed: int) -> None:
    if not 0 <= at <= len(content) or not 0 < needed <= len(content) - at:
        raise Unreadable("it claims more pixels than it holds")


def _plain_text(content: bytes) -> None:
    """PPM and PFM: numbers in letters, then the values."""
    found = re.match(rb"P([6Ff])\s(\d{1,6})\s(\d{1,6})\s([-+.\d]{1,20})\s", content)
    if found is None:
        raise Unreadable("its header is damaged")
    kind, width, height = found[1], int(found[2]), int(found[3])
    if kind == b"6" and found[4] not in (b"255", b"65535"):
        raise Unreadable("its values go neither to 255 nor to 65535")
    each = {b"6": 3 if found[4] == b"255" else 6, b"F": 12, b"f": 4}[kind]
    _fits(content, found.end(), width * height * each)


def _bmp(content: bytes) -> None:
    start, size, width, height, planes, depth, packed = struct.unpack("<IIiiHHI", content[10:34])
    if size < 40 or planes != 1 or depth not in (1, 8, 16, 24, 32) or packed or width <= 0 or height == 0:
        raise Unreadable("it is packed, or its header is damaged: save it as PNG")
    colours = struct.unpack("<I", content[46:50])[0] or (1 << depth if depth <= 8 else 0)
    if colours > 256 or start < 14 + size + 4 * colours:
        raise Unreadable("its header is damaged")
    _fits(content, start, (depth * width + 31) // 32 * 4 * abs(height))


def _tga(content: bytes) -> None:
    text, table, kind, width, height, depth = struct.unpack("<BBB9xHHB", content[:17])
    if table or kind not in (2, 3) or depth not in (8, 16, 24, 32):
        raise Unreadable("it is packed or has a table of colours, which is not supported: save it as PNG")
    _fits(content, 18 + text, width * height * depth // 8)


# Flags of a serialized mesh: what stands beside the vertices, numbers of each; and that numbers have 64 bits
_BESIDE = {0x1: 3, 0x2: 2, 0x8: 3}
_DOUBLE = 0x2000
_LONGEST_NAME = 1 << 16
_CHUNK = 1 << 20


def _serialized(content: bytes) -> None:
    """Mitsuba's own meshes, each an unpacked head and zlib's stream; where they begin stands at the end."""
    version = struct.unpack_from("<H", content, 2)[0]
    if version not in (3, 4):
        raise Unreadable(f"it is of version {version}, 3 or 4 expected")
    count = struct.unpack_from("<I", content, len(content) - 4)[0]
    wide = 8 if version == 4 else 4
    end = len(content) - 4 - wide * count
    if count == 0 or end < 8:
        raise Unreadable(f"it claims to hold {count} meshes")
    begins = np.frombuffer(content, f"<u{wide}", count, end).tolist()
    if begins[0] != 0 or any(a >= b for a, b in itertools.pairwise([*begins, end])):
        raise Unreadable("where its meshes begin is damaged")
    for begin, after in itertools.pairwise([*begins, end]):
        if content[begin : begin + 4] != content[:4]:
            raise Unreadable(f"no mesh begins at byte {begin}")
        _serialized_mesh(content[begin + 4 : after], named=version == 4)


def _serialized_mesh(packed: bytes, named: bool) -> None:
    stream = _Inflated(packed)
    flags = struct.unpack("<I", stream.take(4))[0]
    if named:
        for _ in range(_LONGEST_NAME):
            if stream.take(1) == b"\0":
                break
        else:
            raise Unreadable("the name of a mesh does not end")
    vertices, faces = struct.unpack("<QQ", stream.take(16))
    if not 0 < vertices < 1 << 32 or not 0 < faces < 1 << 32:
        raise Unreadable(f"a mesh claims {vertices} vertices and {faces} faces")
    numbers = 3 + sum(each for flag, each in _BESIDE.items() if flags & flag)
    stream.skip(vertices * numbers * (8 if flags & _DOUBLE else 4))
    for first in range(0, faces, _CHUNK):
        corners = np.frombuffer(stream.take(12 * min(_CHUNK, faces - first)), "<u4")
        if corners.max() >= vertices:
            raise Unreadable(f"a face names vertex {corners.max()} of {vertices}")


class _Inflated:
    """What zlib makes of some bytes, a piece at a time, so that a claim is not believed before it is met."""

    def __init__(self, packed: bytes) -> None:
        self.zlib, self.packed, self.ready = zlib.decompressobj(), packed, b""

    def take(self, count: int) -> bytes:
        while len(self.ready) < count:
            try:
                more = self.zlib.decompress(self.packed, max(count - len(self.ready), 4096))
            except zlib.error as error:
                raise Unreadable(f"it cannot be unpacked: {error}") from None
            self.packed = self.zlib.unconsumed_tail
            if not more:
                raise Unreadable("it claims more vertices or faces than it holds")
            self.ready += more
        found, self.ready = self.ready[:count], self.ready[count:]
        return found

    def skip(self, count: int) -> None:
        while count > 0:
            count -= len(self.take(min(count, _CHUNK)))


def _volume(content: bytes) -> None:
    """A grid of float32 values."""
    version, kind, x, y, z, channels = struct.unpack_from("<Biiiii", content, 3)
    if version != 3 or kind != 1 or min(x, y, z) <= 0 or channels not in (1, 3, 6):
        raise Unreadable("it is no grid of 32-bit values with 1, 3 or 6 channels")
    _fits(content, 48, 4 * x * y * z * channels)


# how each begins, and what is asked of it
_PLAIN: tuple[tuple[Callable[[Path, bytes], bool], Callable[[bytes], None]], ...] = (
    (lambda path, content: content[:2] in (b"P6", b"PF", b"Pf"), _plain_text),
    (lambda path, content: content[:2] == b"BM", _bmp),
    (lambda path, content: content[:2] == b"\x1c\x04", _serialized),
    (lambda path, content: content[:3] == b"VOL", _volume),
    (lambda path, content: path.suffix.lower() == ".tga" or content[-18:-2] == b"TRUEVISION-XFILE", _tga),
)

_HEADERS = {"PNG": _png, "JPEG": _jpeg, "OpenEXR": _exr, "RGBE": _rgbe}
