"""Tables as KTX 2.0 textures, a container format that engines load into Vulkan, WebGPU and WebGL."""

from __future__ import annotations

import struct

import numpy as np
from numpy.typing import NDArray

from .._version import __version__

IDENTIFIER = b"\xabKTX 20\xbb\r\n\x1a\n"
# VkFormat by the bytes and the number of channels: R16_SFLOAT, R16G16_SFLOAT, ... (Vulkan specification, VkFormat)
FORMATS = {(2, 1): 76, (2, 2): 83, (2, 4): 97, (4, 1): 100, (4, 2): 103, (4, 4): 109}
CHANNELS = (0, 1, 2, 15)  # red, green, blue, alpha of the color model RGBSDA
SIGNED_FLOAT = 0x80 | 0x40  # qualifiers of a sample
RGBSDA, UNSPECIFIED, LINEAR = 1, 0, 1  # color model; primaries (a table has no colors); transfer function
HEAD = 12 + 9 * 4 + 4 * 4 + 2 * 8 + 3 * 8  # identifier, header, index, and the index of one level


def ktx2(texels: NDArray[np.floating]) -> bytes:
    """An uncompressed KTX 2.0 file from (rows, columns, channels) or (layers, rows, columns, channels) float32 or
    float16, with 1, 2 or 4 channels: a 2D or 3D texture with one level.

    Sources: "KTX File Format Specification 2.0" and, for the descriptor, "Khronos Data Format Specification 1.3",
    khronos.org.
    """
    *depth, height, width, count = texels.shape
    channel = texels.dtype.itemsize
    descriptor = _descriptor(channel, count)
    values = _pairs({"KTXorientation": "rdi" if depth else "rd", "KTXwriter": f"Gonio {__version__}"})
    values_at = HEAD + len(descriptor)
    end = values_at + len(values)
    data = end + -end % max(4, channel * count)  # levels are aligned to 4 bytes and to texels
    size = texels.size * channel
    header = struct.pack("<9I", FORMATS[channel, count], channel, width, height, *(depth or [0]), 0, 1, 1, 0)
    index = struct.pack("<4I2Q", HEAD, len(descriptor), values_at, len(values), 0, 0)
    level = struct.pack("<3Q", data, size, size)
    text = IDENTIFIER + header + index + level + descriptor + values
    return text.ljust(data, b"\0") + texels.astype(texels.dtype.newbyteorder("<")).tobytes()


def _descriptor(channel: int, count: int) -> bytes:
    """The data format descriptor: one basic block, with one sample per channel from -1 to 1."""
    block = struct.pack("<I2H", 0, 2, 24 + 16 * count)  # vendor and type, version 1.3, size
    block += struct.pack("<4B", RGBSDA, UNSPECIFIED, LINEAR, 0)
    block += struct.pack("<4B8B", 0, 0, 0, 0, channel * count, *[0] * 7)  # texel block of 1 x 1 x 1; one plane
    for place, name in enumerate(CHANNELS[:count]):
        bits = 8 * channel
        block += struct.pack("<H2B4B2f", bits * place, bits - 1, name | SIGNED_FLOAT, 0, 0, 0, 0, -1.0, 1.0)
    return struct.pack("<I", 4 + len(block)) + block


def _pairs(values: dict[str, str]) -> bytes:
    """Key/value data, in the order of the keys."""
    data = b""
    for key, value in sorted(values.items()):
        pair = key.encode() + b"\0" + value.encode() + b"\0"
        data += struct.pack("<I", len(pair)) + pair + b"\0" * (-len(pair) % 4)
    return data
