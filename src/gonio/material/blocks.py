"""Transfer of large arrays between NumPy and Dr.Jit, in the kernel that computes the results.

The rows of an array are interleaved, x y z x y z. NumPy takes ten times as long to separate and convert their
components, and to check that they are unit vectors, as the kernel takes to evaluate a metal; here, the kernel does all
of this, on all threads. This kernel must be compiled separately from the one for small arrays, so it is worthwhile only
for large arrays. Results consist of separate components, because a kernel would take three times as long to write
interleaved rows.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..ops import backend

MANY = 1 << 20  # smallest number of rows for which this module is used
UNIT = 1e-2  # tolerance of a direction's length, for rounding errors and values typed by hand


def vector_of(rows: np.ndarray, count: int, types: backend.Types) -> backend.Array:
    """An array as a Dr.Jit vector of `count` entries; the kernel that uses the vector reads the array's memory.

    rows  (N, 3), (1, 3) or (3,), float32 or float64
    """
    if rows.size == 3:
        return backend.vector_of(rows.reshape(3), 3, types)
    dr = backend.drjit()
    if rows.flags.f_contiguous:  # a result of these functions
        return backend.vector_of(rows, 3, types)
    kind = types.module.Float64 if rows.dtype == np.float64 else types.module.Float
    flat = kind(np.ascontiguousarray(rows).reshape(-1))
    first = 3 * dr.arange(types.module.UInt32, count)
    return types.vec3(*[types.float(dr.gather(kind, flat, first + k)) for k in range(3)])


def is_unit(w: backend.Array) -> backend.Array:
    """Whether each direction is a unit vector; false for NaN."""
    dr = backend.drjit()
    return dr.abs(dr.sqrt(w.x * w.x + w.y * w.y + w.z * w.z) - 1.0) <= UNIT


def is_random(u: backend.Array) -> backend.Array:
    """Whether all three numbers of each row are in [0, 1]; false for NaN."""
    return (u.x >= 0.0) & (u.x <= 1.0) & (u.y >= 0.0) & (u.y <= 1.0) & (u.z >= 0.0) & (u.z <= 1.0)


def to_numpy(
    values: Sequence[backend.Array], shape: tuple[int, ...], checks: Sequence[backend.Array]
) -> tuple[list[np.ndarray], list[bool]]:
    """Evaluate values and checks in one kernel.

    Returns two lists: one array of the given shape per value, (*shape, size) for a vector; and, for each check, whether
    it holds in all rows. The array of a vector is a view of separate components, as Dr.Jit stores them.
    """
    dr = backend.drjit()
    dr.eval(values, checks)
    return [_joined(value, shape) for value in values], [bool(dr.all(check)) for check in checks]


def _joined(value: backend.Array, shape: tuple[int, ...]) -> np.ndarray:
    dr = backend.drjit()
    if not dr.is_array_v(value):
        return np.full(shape, value)
    parts = [np.asarray(one.numpy()) for one in (value if dr.is_vector_v(value) else [value])]
    planes = np.empty((len(parts), *shape), parts[0].dtype)
    for plane, part in zip(planes, parts, strict=True):
        plane[...] = part.reshape(shape) if part.size > 1 else part
    return np.moveaxis(planes, 0, -1) if dr.is_vector_v(value) else planes[0]
