"""Tables as OpenEXR images, for OSL and for engines, written without Mitsuba, because shaders do not require it."""

from __future__ import annotations

import struct

import numpy as np
from numpy.typing import NDArray

CHANNELS = {1: "Y", 2: "RG", 4: "RGBA"}
TYPES = {2: 1, 4: 2}  # type of a channel by its size in bytes: half, float


def openexr(pixels: NDArray[np.floating]) -> bytes:
    """An uncompressed OpenEXR file from (rows, columns, channels) float32 or float16, with 1, 2 or 4 channels.

    Source: "OpenEXR File Layout", openexr.com.
    """
    height, width, count = pixels.shape
    order = sorted(zip(CHANNELS[count], range(count), strict=True))  # channels are in alphabetical order
    kind = struct.pack("<iIii", TYPES[pixels.dtype.itemsize], 0, 1, 1)
    channels = b"".join(name.encode() + b"\0" + kind for name, _ in order) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    attributes = {
        ("channels", "chlist"): channels,
        ("compression", "compression"): b"\0",
        ("dataWindow", "box2i"): window,
        ("displayWindow", "box2i"): window,
        ("lineOrder", "lineOrder"): b"\0",
        ("pixelAspectRatio", "float"): struct.pack("<f", 1.0),
        ("screenWindowCenter", "v2f"): struct.pack("<2f", 0.0, 0.0),
        ("screenWindowWidth", "float"): struct.pack("<f", 1.0),
    }
    header = struct.pack("<2I", 20000630, 2)  # the magic number and the version
    for (name, type_), value in attributes.items():
        header += name.encode() + b"\0" + type_.encode() + b"\0" + struct.pack("<i", len(value)) + value
    header += b"\0"
    size = pixels.dtype.itemsize * width * count  # bytes of a row
    first = len(header) + 8 * height
    offsets = first + (8 + size) * np.arange(height, dtype="<u8")
    rows = (
        pixels[..., [place for _, place in order]].transpose(0, 2, 1).astype(pixels.dtype.newbyteorder("<"))
    )  # one channel after another
    lines = [struct.pack("<2i", y, size) + row.tobytes() for y, row in enumerate(rows)]
    return header + offsets.tobytes() + b"".join(lines)
