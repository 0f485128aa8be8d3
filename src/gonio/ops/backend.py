"""Dr.Jit arrays: the array types in use, and conversion from and to NumPy.

Dr.Jit is imported here and, outside `render`, nowhere else.
"""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from contextvars import ContextVar
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import NamedTuple, TypeAlias, TypeGuard, get_args

import numpy as np

from .. import files, llvm
from ..errors import InputError, MachineError
from .types import Precision, Value

# A Dr.Jit array. Dr.Jit's stubs describe one device and precision; Gonio's code is used for all.
Array: TypeAlias = Value

PRECISIONS = get_args(Precision)
_precision: Precision = "float32"


class Types(NamedTuple):
    """Dr.Jit's array types of one device and precision, for values with one entry per ray."""

    float: type
    bool: type
    vec2: type
    vec3: type
    vec4: type
    module: ModuleType


def set_precision(precision: Precision) -> None:
    """Set the precision of evaluations on NumPy arrays: "float32" (default), or "float64" for reference values."""
    global _precision
    if not isinstance(precision, str) or precision not in PRECISIONS:
        raise InputError(f"unknown precision '{precision}'", "set_precision", 'give "float32" or "float64"')
    _precision = precision


def get_precision() -> Precision:
    return _precision


@lru_cache
def drjit() -> ModuleType:
    """The Dr.Jit module, imported on first use."""
    import drjit as dr

    return dr


def check_kernels() -> None:
    """Raise MachineError if other users may change the folder of compiled kernels, which Dr.Jit runs."""
    named, home = os.environ.get("DRJIT_CACHE_DIR"), os.environ.get("HOME")
    if not (named or home):
        return  # without a home directory, Dr.Jit stores no kernels
    folder = Path(named) if named else Path(str(home), ".drjit")
    if folder.is_dir() and files.changeable_by_others(folder):
        hint = f"chmod go-w '{folder}', or set DRJIT_CACHE_DIR to a folder of your own"
        raise MachineError("other users may change the kernels that Dr.Jit caches and runs", str(folder), hint)


@lru_cache
def _types(backend: str, double: bool) -> Types:
    dr = drjit()
    if backend == "llvm":
        check_kernels()
        llvm.use()  # raises if no usable libLLVM exists
    module: ModuleType = getattr(dr, backend).ad
    end = "64" if double else ""
    return Types(
        getattr(module, "Float" + end),
        module.Bool,
        getattr(module, "Array2f" + end),
        getattr(module, "Array3f" + end),
        getattr(module, "Array4f" + end),
        module,
    )


def types(precision: Precision | None = None) -> Types:
    """The CPU types of a precision, or of the current one if it is None; small arrays are computed on the CPU."""
    precision = _precision if precision is None else precision
    if not isinstance(precision, str) or precision not in PRECISIONS:
        raise InputError(f"unknown precision '{precision}'", "precision", 'give "float32" or "float64"')
    return _types("llvm", precision == "float64")


def types_like(kind: type) -> Types:
    """The types with the device and precision of a Dr.Jit array type."""
    dr = drjit()
    backend = "cuda" if dr.backend_v(kind) == dr.JitBackend.CUDA else "llvm"
    return _types(backend, dr.itemsize_v(kind) == 8 and not dr.is_mask_v(kind))


def is_drjit(value: object) -> TypeGuard[Array]:
    """Whether a value is a Dr.Jit array. This function does not load Dr.Jit."""
    dr = sys.modules.get("drjit")
    is_array = getattr(dr, "is_array_v", None)  # missing while another thread is still importing Dr.Jit
    return is_array is not None and is_array(value)


_formula: ContextVar[type | None] = ContextVar("formula", default=None)  # type of the running formula's directions


@contextlib.contextmanager
def formula_of(directions: object) -> Iterator[None]:
    """Declare the directions for which the formula inside the `with` block is evaluated."""
    before = _formula.set(type(directions))
    try:
        yield
    finally:
        _formula.reset(before)


def in_formula(number: float) -> Array:
    """A plain number in the precision of the running formula; unchanged outside a formula."""
    kind = _formula.get()
    return number if kind is None or not drjit().is_array_v(kind) else types_like(kind).float(number)


def float_of(value: object, kind: Types) -> Array:
    """A number or an array of shape (N,) as a Dr.Jit float.

    A number becomes an evaluated array of one entry instead of a literal, which would be compiled into the kernel and
    recompile it for every new value.
    """
    dr = drjit()
    if is_drjit(value):
        return value
    array = np.asarray(value, dtype=np.float64)
    if array.ndim == 0:
        return dr.opaque(kind.float, float(array))
    if array.ndim != 1:
        raise InputError(f"a value of shape {array.shape}, expected a number or (N,)", "parameter")
    return kind.float(aligned(array, np.float64 if kind.float.__name__.endswith("64") else np.float32))


def aligned(array: np.ndarray, dtype: type[np.generic]) -> np.ndarray:
    """A copy at an address that is a multiple of 64.

    Dr.Jit uses NumPy's memory without copying and compiles its alignment into the kernel. Arrays at varying addresses
    would compile the same code repeatedly.
    """
    size = array.size * np.dtype(dtype).itemsize
    raw = np.empty(size + 64, np.uint8)
    start = -raw.ctypes.data % 64
    aligned = raw[start : start + size].view(dtype)
    aligned[:] = array
    return aligned


def vector_of(value: object, size: int, kind: Types) -> Array:
    """An array of shape (N, size) or (size,) as a Dr.Jit vector of `size` components."""
    if is_drjit(value):
        return value
    array = np.asarray(value, dtype=np.float64)
    vector = (kind.vec2, kind.vec3, kind.vec4)[size - 2]
    return vector(*[float_of(array[..., i], kind) for i in range(size)])


def to_numpy(value: Array, count: int) -> np.ndarray:
    """A Dr.Jit float as (count,), a vector as (count, size); a uniform value is repeated `count` times."""
    dr = drjit()
    if not dr.is_array_v(value):
        return np.full(count, value)
    if dr.is_vector_v(value):
        # one component at a time: Dr.Jit would join them in a kernel that contains the number of rows as a literal
        dr.eval(value)
        parts = [np.asarray(component.numpy()) for component in value]
        count = max(count, *(part.shape[-1] for part in parts))  # parameters may have more rows than the directions
        return np.stack([np.broadcast_to(part, (count,)) for part in parts], axis=-1)
    array = np.asarray(value.numpy())
    count = max(count, array.shape[-1])
    return np.ascontiguousarray(np.broadcast_to(array, (count,)))
