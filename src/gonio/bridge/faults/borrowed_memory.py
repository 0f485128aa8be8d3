"""Dr.Jit 1.5: an array made of NumPy's borrows its memory, and the alignment of that becomes part of the kernel.

    a = mi.Float(np.zeros(64, np.float32))                 # compiles one of two kernels, by where NumPy has put it

Which one is left to chance: kernels are compiled again that were in the cache.

Workaround: copy the values into memory of Dr.Jit's own.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from ...ops import backend
from ..types import OfVariant


def own(kind: OfVariant, values: NDArray[Any]) -> OfVariant:
    """An array of Dr.Jit's of type `kind` with these values, in memory of its own.

    Times one, which keeps every bit, also the sign of a zero.
    """
    if isinstance(values, np.ndarray):
        values = backend.aligned(values, values.dtype.type)
    copied = kind(values) * dr.opaque(kind, 1)
    dr.eval(copied)
    dr.sync_thread()  # while NumPy's memory is there
    return copied
