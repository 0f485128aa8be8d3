"""Dr.Jit 1.5: an array made from a NumPy array shares its memory, and the alignment becomes part of the kernel.

    a = mi.Float(np.zeros(64, np.float32))                 # compiles one of two kernels, depending on the alignment

The alignment of NumPy arrays is arbitrary, so kernels that are already in the cache may be compiled again.

Workaround: copy the values into memory that Dr.Jit allocates.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from ...ops import backend
from ..types import OfVariant


def own(kind: OfVariant, values: NDArray[Any]) -> OfVariant:
    """A Dr.Jit array of type `kind` with these values, in its own memory.

    The copy is computed as a product with 1, which preserves every bit, including the sign of a zero.
    """
    if isinstance(values, np.ndarray):
        values = backend.aligned(values, values.dtype.type)
    copied = kind(values) * dr.opaque(kind, 1)
    dr.eval(copied)
    dr.sync_thread()  # before NumPy's memory is freed
    return copied
