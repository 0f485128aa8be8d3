"""The files of tables in an output folder: raw numbers, OpenEXR, KTX 2.0."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .ktx2 import ktx2
from .openexr import openexr

Texels = NDArray[np.floating]  # x varies fastest, channels last


class TableFormat(NamedTuple):
    """The format of a table's file.

    suffix  suffix of the file's name
    write   returns the contents of the file for an array (rows, columns, channels) or (layers, rows, columns,
            channels) of float32 or float16
    """

    suffix: str
    write: Callable[[Texels], bytes]


def _raw(texels: Texels) -> bytes:
    """Little-endian numbers without a header."""
    return texels.astype(texels.dtype.newbyteorder("<")).tobytes()


def _rows(texels: Texels) -> Texels:
    """The layers stacked vertically, because an image has no third axis."""
    return texels.reshape(-1, *texels.shape[-2:])


def _picture(texels: Texels) -> bytes:
    return openexr(_rows(texels))


def _mirrored(texels: Texels) -> bytes:
    """An image whose rows are repeated in reverse order, because renderers differ in which row has t = 0."""
    rows = _rows(texels)
    return openexr(np.concatenate([rows, rows[::-1]]))


FORMATS = {
    "raw": TableFormat(".f32", _raw),  # .f16 in half precision
    "exr": TableFormat(".exr", _picture),
    "ktx2": TableFormat(".ktx2", ktx2),
    "exr-mirrored": TableFormat(".exr", _mirrored),  # for OSL
}
CHOICES = ("raw", "exr", "ktx2")  # the formats that users can select
