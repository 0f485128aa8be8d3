"""Images of a scene: they are checked for size, decoded to linear float32, and passed to Mitsuba as textures."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType

import numpy as np

from ..bridge.types import PluginDict
from ..catalog import documents
from ..errors import InputError
from ..pictures import formats, images, scene_files
from ..pictures.images import RGB


def load_image(path: Path, where: str, *, srgb: bool = False, channel: str | None = None, inside: str = "") -> RGB:
    """Load an image as float32, (height, width, 1 or 3), with row 0 on top. 8-bit values are divided by 255.

    where    location in the scene, for errors
    srgb     whether to decode sRGB values to linear ones
    channel  the single channel to read, "r", "g", "b" or "a"; alpha is never decoded, and is 1 if the image has no
    alpha inside   number of the image in a document that contains several images
    Raises InputError if the file is not an image, states more pixels than it can contain, or contains NaN.
    """
    name = path.name
    if path.stat().st_size > scene_files.MAX_BYTES:
        raise InputError(f"'{name}' is larger than {scene_files.MAX_BYTES >> 20} MiB", where, "scale it down")
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"'{name}' cannot be read: {error.strerror or error}", where, "check the file") from None
    with ExitStack() as stack:
        if inside:
            name, content = f"{name}#{inside}", _inside(path, inside)
            path = Path(stack.enter_context(TemporaryDirectory())) / "image"  # Mitsuba can only read files
            path.write_bytes(content)
        values, integers = _decoded(path, content, name, where)
    if channel == "a":
        values = values[..., -1:] if values.shape[2] in (2, 4) else np.ones_like(values[..., :1])
    else:
        values = values[..., :3] if values.shape[2] >= 3 else values[..., :1]  # drops alpha
        if integers and srgb:
            values = images.from_screen(values)
        if channel is not None and values.shape[2] == 3:
            values = values[..., ["rgb".index(channel)]]
    values = np.ascontiguousarray(values, np.float32)
    if not np.isfinite(values).all():
        row, column = np.argwhere(~np.isfinite(values))[0][:2]
        raise InputError(f"'{name}' is not finite at row {row}, column {column}", where, "correct the image")
    return values


def _inside(path: Path, index: str) -> bytes:
    document = documents.parted(str(path))
    assert document is not None, "the name says so"
    return document[0].image(path, index)


def _decoded(path: Path, content: bytes, name: str, where: str) -> formats.Decoded:
    kind = formats.kind_of(content)
    if kind is None:
        raise InputError(f"'{name}' is not a readable image", where, "use .png, .jpg, .exr or .hdr")
    try:
        return formats.decode(path, content, kind)
    except formats.Unreadable as error:
        raise InputError(f"'{name}' cannot be decoded: {error}", where, "save it again") from None


def bitmap(mi: ModuleType, values: RGB, filter_type: str, wrap: str) -> PluginDict:
    """A Mitsuba texture from values that are already linear; v = 0 is the top row, as in Mitsuba."""
    # With `raw`, colors are passed to the material unchanged, but spectral variants must convert them to spectra.
    raw = values.shape[2] == 1 or not mi.variant().endswith("spectral")
    return {
        "type": "bitmap",
        "bitmap": mi.Bitmap(np.array(values, np.float32, order="C")),
        "raw": raw,
        "filter_type": filter_type,
        "wrap_mode": wrap,
    }


def environment(mi: ModuleType, values: RGB) -> PluginDict:
    """An environment from an image in which the direction (sin t sin p, cos t, sin t cos p) has u = p/2pi, v = t/pi.

    Mitsuba's `envmap` differs in two respects. Its azimuth increases in the opposite direction, (sin p, -cos p), so the
    image is mirrored left to right and rotated by half a turn. Its rows are at v = j/(h - 1), including the poles,
    instead of (j + 0.5)/h, so the number of rows is doubled: row 2j + 1 is row j of the image, and each row between two
    of these is their mean, which leaves the linear interpolation unchanged.
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
