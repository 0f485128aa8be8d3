"""Read and write pictures: .exr, .hdr, .png and .npz files, with the settings with which they were rendered.

Files are written completely or not at all. A picture in memory is linear RGB, float32, of shape (H, W, 3), with row 0
on top. For a PNG file, values are multiplied by 2^exposure, clamped, sRGB-encoded and rounded to 8 bits. The settings
are stored in EXR attributes, PNG text chunks, comment lines of the Radiance header, or an array named `metadata` in an
.npz file.
"""

from __future__ import annotations

import json
import os
import re
import struct
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from .. import archives, files
from ..bridge import engine
from ..bridge.faults.exr_threads import file_threads
from ..catalog.operands import PICTURE_SUFFIXES
from ..errors import InputError, MachineError, did_you_mean, encodable, summary
from ..owner import exclusive
from . import exposures, formats, openexr

Value = str | int | float
RGB = NDArray[np.float32]
Number = TypeVar("Number", bound=np.generic)
Metadata = Mapping[str, Value]

SUFFIXES = PICTURE_SUFFIXES
_PREFIX = "gonio."  # distinguishes Gonio's attributes from those of the format

_KINDS = {".exr": "OpenEXR", ".hdr": "RGBE", ".png": "PNG"}


@dataclass(frozen=True)
class Picture:
    """A picture read from a file.

    path  the file
    hdr   whether the file contains linear radiance; False for the sRGB-encoded values of a .png
    """

    pixels: RGB
    path: Path
    hdr: bool = True
    metadata: dict[str, Value] = field(default_factory=dict)


# --- writing -------------------------------------------------------------------------------------------


def check_writable(path: str | Path) -> Path:
    """The file to be written, with symbolic links resolved. Raises InputError if it cannot be written.

    This is called before a render, so that no time is lost.
    """
    _suffix(path)
    return files.check_file(path)


def _suffix(path: str | Path) -> str:
    """The suffix of a picture file in lower case. Raises InputError for an unknown suffix."""
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        hint = did_you_mean(suffix, SUFFIXES) if suffix else "add " + " or ".join(SUFFIXES)
        raise InputError(f"unknown picture format '{Path(path).suffix}'", str(path), hint)
    return suffix


@exclusive
def write(path: str | Path, pixels: RGB, metadata: Metadata | None = None, exposure: float = 0.0) -> Path:
    """Write a picture in the format of the file's suffix, completely or not at all. Returns the path of the file.

    metadata  the settings with which the picture was rendered, to be stored in the file
    exposure  exposure in stops, for PNG only; the other formats store radiance unchanged
    Raises InputError for an invalid picture or file name. If the file cannot be written, raises InputError or
    MachineError, which names the file in which the picture was saved instead.
    """
    suffix = _suffix(path)
    if np.iscomplexobj(pixels):
        raise InputError("complex numbers given, an RGB picture expected", str(path))
    picture = np.ascontiguousarray(pixels, dtype=np.float32)
    if picture.ndim != 3 or picture.shape[2] != 3 or picture.size == 0:
        raise InputError(f"expected an RGB picture of shape (H, W, 3), got {picture.shape}", str(path))
    # On some systems, file names are arbitrary bytes; no format can store those that are not valid text.
    settings = {key: encodable(value) if isinstance(value, str) else value for key, value in (metadata or {}).items()}
    try:
        content = _encoded(suffix, picture, settings, exposure)
    except Exception as error:  # of any type, because the picture must not be lost
        array = _npz_bytes(picture, {})
        rescued = files.keep_elsewhere(Path(path).with_suffix(".npz"), lambda file: file.write_bytes(array))
        hint = "nothing was written" if rescued is None else f"it is kept as {rescued}: `gonio convert` reads that"
        raise MachineError(f"cannot be written as {suffix}: {summary(error)}", str(path), hint) from error
    return files.write_whole(path, content)


def _encoded(suffix: str, picture: RGB, settings: Metadata, exposure: float) -> bytes:
    if suffix == ".png":
        return png_bytes(to_screen(picture, exposure), settings)
    if suffix == ".npz":
        return _npz_bytes(picture, settings)
    if suffix == ".hdr":
        return _with_comments(_bitmap_bytes(_half_a_step_up(picture), {}, "RGBE"), settings)
    return _bitmap_bytes(picture, settings, "OpenEXR")


class Shown(NamedTuple):
    """The result of writing a picture.

    exposure  exposure of a .png in stops; None for other formats
    notice    a notice for the user, or ""
    """

    exposure: float | None
    notice: str


def write_exposed(
    path: str | Path, pixels: RGB, metadata: Metadata | None = None, exposure: exposures.Exposure = 0.0
) -> Shown:
    """Write a picture as `write` does. The exposure may be "auto"; a notice in the result reports clipping."""
    if Path(path).suffix.lower() != ".png":
        write(path, pixels, metadata)
        notice = f"{Path(path).suffix} stores radiance: --exposure applies to .png"
        return Shown(None, "" if exposure == 0 else notice)
    chosen = exposures.stops(exposure, pixels)
    write(path, pixels, {**(metadata or {}), "exposure": chosen}, chosen)
    return Shown(chosen, exposures.clipping(chosen, pixels, automatic=exposure == "auto"))


def convert(source: str | Path, output: str | Path, exposure: exposures.Exposure = 0.0) -> Shown:
    """Convert a picture, with its settings, to the format of the output's suffix.

    exposure  exposure of a .png output in stops
    A .png source is decoded from sRGB; clipped values remain clipped. Raises the same errors as `read` and `write`.
    """
    check_writable(output)
    picture = read(source)
    metadata = {key: value for key, value in picture.metadata.items() if key != "exposure"}
    return write_exposed(output, picture.pixels, metadata, exposure)


def to_screen(pixels: RGB, exposure: float = 0.0) -> NDArray[np.uint8]:
    """Convert linear radiance to 8-bit values: multiplied by 2^exposure, clamped and sRGB-encoded (IEC 61966-2-1)."""
    x = np.clip(np.nan_to_num(pixels, nan=0.0, posinf=1.0) * np.float32(2.0**exposure), 0, 1)
    encoded = np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.power(x, 1 / 2.4) - 0.055)
    return (encoded * 255 + 0.5).astype(np.uint8)


def from_screen(values: NDArray[np.floating]) -> RGB:
    """Convert sRGB-encoded values in [0, 1] to linear values, the inverse of `to_screen` at exposure 0."""
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4).astype(np.float32)


def png_bytes(values: NDArray[np.uint8] | NDArray[np.uint16], metadata: Metadata | None = None) -> bytes:
    """The bytes of an RGB PNG file (ISO 15948) with values (H, W, 3), and with the metadata in text chunks.

    The file has 16 bits per channel if the values are uint16.
    """
    height, width = values.shape[:2]
    bits = 8 * values.dtype.itemsize
    rows = np.frombuffer(values.astype(f">u{bits // 8}").tobytes(), np.uint8).reshape(height, -1)
    # Filter 2 (difference from the row above, modulo 256) halves the size of smooth pictures.
    difference = np.diff(rows, axis=0, prepend=np.uint8(0))
    filtered = np.concatenate([np.full((height, 1), 2, np.uint8), difference], axis=1)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    def text(key: str, value: str) -> bytes:
        if (key + value).isascii():
            return chunk(b"tEXt", key.encode() + b"\0" + value.encode())
        return chunk(b"iTXt", key.encode() + b"\0\0\0\0\0" + value.encode("utf-8"))

    return b"".join(
        [
            b"\x89PNG\r\n\x1a\n",
            chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, 2, 0, 0, 0)),
            *([chunk(b"sRGB", b"\0")] if bits == 8 else []),  # 16-bit pictures contain values measured by a camera
            *(text(_PREFIX + key, _one_line(value)) for key, value in (metadata or {}).items()),
            chunk(b"IDAT", zlib.compress(filtered.tobytes(), 6)),
            chunk(b"IEND", b""),
        ]
    )


def _bitmap_bytes(picture: RGB, metadata: Metadata, file_format: str) -> bytes:
    mi = engine.load()
    bitmap = mi.Bitmap(picture)
    for key, value in metadata.items():
        bitmap.metadata()[_PREFIX + key] = value
    stream = mi.MemoryStream()
    with file_threads():
        bitmap.write(stream, getattr(mi.Bitmap.FileFormat, file_format))
    return stream.raw_buffer()


def _half_a_step_up(picture: RGB) -> RGB:
    """Add half a quantization step of RGBE, so that Mitsuba, which truncates, rounds the values. 0 remains 0."""
    largest = picture.max(axis=2, keepdims=True)
    exponent = np.frexp(largest)[1]
    exponent = np.frexp(largest + np.ldexp(np.float32(0.5), exponent - 8))[1]  # rounding may reach the next power of 2
    return np.where((picture > 0.0) & (largest > 1e-32), picture + np.ldexp(np.float32(0.5), exponent - 8), picture)


def _with_comments(radiance: bytes, metadata: Metadata) -> bytes:
    """Insert the settings into a Radiance file, as comment lines after its first line."""
    rest = radiance.split(b"\n", 1)[1]  # Mitsuba writes "#?RGBE", which not every reader accepts
    lines = [f"# {_PREFIX}{key}={_one_line(value)}".encode() for key, value in metadata.items()]
    return b"\n".join([b"#?RADIANCE", *lines, rest])


def _npz_bytes(picture: RGB, metadata: Metadata) -> bytes:
    import io

    stream = io.BytesIO()
    np.savez_compressed(stream, radiance=picture, metadata=np.array(json.dumps(dict(metadata))))
    return stream.getvalue()


def _one_line(value: Value) -> str:
    return re.sub(r"[\0\r\n]+", " ", value) if isinstance(value, str) else json.dumps(value)


# --- reading -------------------------------------------------------------------------------------------


ENCODINGS = ("srgb", "linear")


@exclusive
def read(path: str | Path, encoding: str = "srgb") -> Picture:
    """Read a picture as linear RGB, with the settings that Gonio has stored in it.

    encoding  encoding of a .png: "srgb" for pictures, or "linear" for data such as tables, which are not decoded
    An .npz file must contain an array named `radiance` or only a single array. Gray pictures are converted to three
    equal channels.
    Raises InputError for a file that is missing, empty, damaged, or of another format, and for a file whose header
    states more pixels than the file can contain.
    """
    if encoding not in ENCODINGS:
        raise InputError(f"unknown encoding '{encoding}'", "--encoding", did_you_mean(encoding, ENCODINGS))
    source = Path(os.path.expanduser(path))
    suffix = source.suffix.lower()
    if suffix not in SUFFIXES:
        what = f"unknown picture format '{source.suffix}'"
        raise InputError(what, str(path), "use one of " + ", ".join(SUFFIXES))
    try:
        content = source.read_bytes()
    except OSError as error:
        raise InputError(f"cannot read this picture: {error.strerror}", str(path), _nearby(source)) from error
    if not content:
        raise InputError("this picture is an empty file", str(path), "render it again")
    if suffix == ".npz":
        pixels, metadata = _read_npz(source)
    else:
        pixels, metadata = _read_bitmap(source, content, suffix, encoding)
    return Picture(pixels, source, suffix != ".png", metadata)


def _nearby(source: Path) -> str:
    if not source.parent.is_dir():
        return f"the folder '{source.parent}' does not exist"
    near = [entry.name for entry in source.parent.iterdir() if entry.suffix.lower() in SUFFIXES]
    return did_you_mean(source.name, near) if near and len(near) <= 20 else "check the name"


def _read_bitmap(source: Path, content: bytes, suffix: str, encoding: str) -> tuple[RGB, dict[str, Value]]:
    kind, location = _KINDS[suffix], str(source)
    if formats.kind_of(content) != kind:
        raise InputError(f"this is not a {suffix[1:].upper()} picture", location, "check the file or its suffix")
    try:
        values, _ = formats.decode(source, content, kind)
        metadata = _metadata(content, suffix)
    except formats.Unreadable as error:
        raise InputError(f"this picture is damaged: {error}", location, "render or copy it again") from error
    if suffix == ".png" and encoding == "srgb":  # decoded here, because Mitsuba would read a 16-bit PNG as linear
        pixels = from_screen(_three_channels(values, location))
    else:
        pixels = _three_channels(values, location)
    return np.ascontiguousarray(pixels, np.float32), metadata


def _three_channels(values: NDArray[Number], path: str | Path) -> NDArray[Number]:
    pixels = values if values.ndim == 3 else values[..., None]
    if pixels.shape[2] in (1, 2):  # gray, with or without alpha
        return np.repeat(pixels[..., :1], 3, axis=2)
    if pixels.shape[2] in (3, 4):
        return pixels[..., :3]
    raise InputError(f"{pixels.shape[2]} channels, expected RGB", str(path), "keep one layer only")


def _metadata(content: bytes, suffix: str) -> dict[str, Value]:
    values: Iterator[tuple[str, Value]]
    if suffix == ".exr":
        values = _exr_values(content)
    elif suffix == ".hdr":
        lines = content.split(b"\n\n", 1)[0].decode("utf-8", "replace").splitlines()
        ours = (line[2:].partition("=") for line in lines if line.startswith(f"# {_PREFIX}"))
        values = (_parsed(key, value) for key, _, value in ours)
    else:
        values = _png_texts(content)
    return {key.removeprefix(_PREFIX): value for key, value in values if key.startswith(_PREFIX)}


def _exr_values(content: bytes) -> Iterator[tuple[str, Value]]:
    """The strings and numbers among the attributes of an OpenEXR file (file layout, "Predefined attribute types")."""
    numbers = {"int": "<i", "float": "<f", "double": "<d"}
    for name, kind, value in openexr.attributes_of(content):
        if kind == "string":
            yield name, value.decode("utf-8", "replace")
        elif kind in numbers and len(value) == struct.calcsize(numbers[kind]):
            yield name, struct.unpack(numbers[kind], value)[0]


def _png_texts(content: bytes) -> Iterator[tuple[str, Value]]:
    for kind, data in formats.png_chunks(content):
        key, _, value = data.partition(b"\0")
        if kind == b"tEXt":
            yield _parsed(key.decode("latin-1"), value.decode("latin-1"))
        elif kind == b"iTXt" and value[:2] == b"\0\0":  # not compressed
            yield _parsed(key.decode("latin-1"), value[2:].split(b"\0", 2)[-1].decode("utf-8", "replace"))


def _parsed(key: str, value: str) -> tuple[str, Value]:
    """A metadata entry, whose text is converted to a number if possible."""
    try:
        return key, int(value)
    except ValueError:
        try:
            return key, float(value)
        except ValueError:
            return key, value


def _read_npz(source: Path) -> tuple[RGB, dict[str, Value]]:
    location = str(source)
    try:
        arrays = archives.read(source)
        metadata = json.loads(str(arrays.pop("metadata", "{}")))
    except (ValueError, OSError, RecursionError) as error:
        raise InputError(f"this .npz cannot be read: {error}", location, "save it with np.savez(...)") from error
    name = "radiance" if "radiance" in arrays else next(iter(arrays), "") if len(arrays) == 1 else ""
    if not name:
        hint = "save it with np.savez(path, radiance=picture); it contains " + ", ".join(arrays)
        raise InputError("no array named 'radiance'", location, hint)
    array = arrays[name]
    if array.ndim not in (2, 3) or array.dtype.kind not in "fiu" or array.size == 0:
        what = f"'{name}' is {array.dtype} of shape {array.shape}, expected (H, W, 3) numbers"
        raise InputError(what, location)
    return _three_channels(array.astype(np.float32), location), metadata if isinstance(metadata, dict) else {}
