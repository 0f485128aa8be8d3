"""Images that a scene names: bounded, decoded to linear float32, and handed to Mitsuba as textures."""

from __future__ import annotations

import struct
from pathlib import Path
from types import ModuleType

import numpy as np

from ...errors import InputError
from .. import images
from ..images import RGB
from ..types import PluginDict

MAX_BYTES = 2**30  # of an image file
MAX_PIXELS = 2**28  # 3 GiB as float32 RGB

_MAGIC = {b"\x89PNG\r\n\x1a\n": ".png", b"\xff\xd8\xff": ".jpg", b"\x76\x2f\x31\x01": ".exr", b"#?": ".hdr"}
_FORMATS = {".png": "PNG", ".jpg": "JPEG", ".exr": "OpenEXR", ".hdr": "RGBE"}


def load_image(mi: ModuleType, path: Path, where: str, *, srgb: bool = False) -> RGB:
    """The image as float32 (height, width, 1 or 3), row 0 on top; 8-bit values as v/255, decoded where `srgb`.

    Raises InputError where the file is no image, claims more pixels than it can hold, or holds NaN.
    """
    name = path.name
    if path.stat().st_size > MAX_BYTES:
        raise InputError(f"'{name}' is larger than {MAX_BYTES // 2**20} MiB", where, "scale it down")
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"'{name}' cannot be read: {error.strerror or error}", where, "check the file") from None
    kind = next((suffix for magic, suffix in _MAGIC.items() if content.startswith(magic)), None)
    size = _size(content, kind) if kind else None
    if kind is None or size is None:
        raise InputError(f"'{name}' is no image that can be read", where, "use " + ", ".join(_FORMATS))
    width, height = size
    # The densest of these codings, DEFLATE, holds 1032 bytes in one, and a byte holds 8 pixels at most.
    if width < 1 or height < 1 or width * height > min(MAX_PIXELS, 1032 * 8 * len(content)):
        raise InputError(
            f"'{name}' claims {width} x {height} pixels in {len(content)} bytes",
            where,
            f"the file is damaged, or over the limit of {MAX_PIXELS // 2**20} Mi pixels",
        )
    try:
        values = np.array(mi.Bitmap(str(path), getattr(mi.Bitmap.FileFormat, _FORMATS[kind])))
    except RuntimeError as error:
        raise InputError(f"'{name}' cannot be decoded: {_last_line(error)}", where, "save it again") from None
    values = values if values.ndim == 3 else values[..., None]
    values = values[..., :3] if values.shape[2] >= 3 else values[..., :1]  # without alpha
    if values.dtype.kind in "ui":
        values = values.astype(np.float32) / np.float32(np.iinfo(values.dtype).max)
        if srgb:
            values = images.from_screen(values)
    values = np.ascontiguousarray(values, np.float32)
    if not np.isfinite(values).all():
        row, column = np.argwhere(~np.isfinite(values))[0][:2]
        raise InputError(f"'{name}' is not finite at row {row}, column {column}", where, "mend the image")
    return values


def _size(content: bytes, kind: str) -> tuple[int, int] | None:
    """Width and height by the header; None where it is cut short."""
    try:
        if kind == ".jpg":
            return _jpeg_size(content)
        return images._claimed_size(content, kind)
    except (struct.error, IndexError):
        return None


def _jpeg_size(content: bytes) -> tuple[int, int] | None:
    """From the first start-of-frame segment (ITU T.81, B.2.2)."""
    at = 2
    while at + 9 < len(content):
        if content[at] != 0xFF:
            return None
        marker = content[at + 1]
        if marker == 0xFF:  # fill byte
            at += 1
            continue
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            height, width = struct.unpack(">HH", content[at + 5 : at + 9])
            return width, height
        at += 2 + struct.unpack(">H", content[at + 2 : at + 4])[0]
    return None


def _last_line(error: Exception) -> str:
    return str(error).strip().splitlines()[-1][:200]


def bitmap(mi: ModuleType, values: RGB, filter_type: str, wrap: str) -> PluginDict:
    """A Mitsuba texture of values that are linear already. v = 0 is the top row there too."""
    # With `raw` a colour reaches the material as it stands; spectral variants must make a spectrum of it.
    raw = values.shape[2] == 1 or not mi.variant().endswith("spectral")
    return {
        "type": "bitmap",
        "bitmap": mi.Bitmap(np.array(values, np.float32, order="C")),
        "raw": raw,
        "filter_type": filter_type,
        "wrap_mode": wrap,
    }


def environment(mi: ModuleType, values: RGB) -> PluginDict:
    """An environment from an image in which direction (sin t sin p, cos t, sin t cos p) is u = p/2pi, v = t/pi.

    Mitsuba's `envmap` differs in two ways. It runs the other way round, (sin p, -cos p): mirrored left to right, and
    turned by half a turn. And its rows lie at v = j/(h - 1), the poles included, not at (j + .5)/h: the rows are laid
    out at twice the density, row 2j + 1 being row j, those between them means. A mean lies on the line between its
    neighbours, so that linear interpolation is unchanged.
    """
    values = np.broadcast_to(values, (*values.shape[:2], 3))
    rows = np.empty((2 * values.shape[0] + 1, values.shape[1], 3), np.float32)
    rows[1::2] = values
    rows[2:-1:2] = (values[1:] + values[:-1]) / 2
    rows[0], rows[-1] = values[0], values[-1]
    return {
        "type": "envmap",
        "bitmap": mi.Bitmap(np.array(np.maximum(rows[:, ::-1], 0), order="C")),
        "to_world": mi.ScalarTransform4f().rotate([0, 1, 0], 180.0),
    }
