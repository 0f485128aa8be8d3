"""Dr.Jit arrays: which array types to use, and the way in and out of NumPy.

Dr.Jit starts here and nowhere else outside `render`.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from contextvars import ContextVar
from functools import lru_cache
from types import ModuleType
from typing import NamedTuple, TypeAlias, TypeGuard, get_args

import numpy as np

from .. import llvm
from ..errors import InputError
from .types import Precision, Value

# A Dr.Jit array. Dr.Jit's stubs describe one device and precision, our code is written for all.
Array: TypeAlias = Value

PRECISIONS = get_args(Precision)
_precision: Precision = "float32"


class Types(NamedTuple):
    """Dr.Jit's array types of one device and precision, for values that have one entry a ray."""

    float: type
    bool: type
    vec2: type
    vec3: type
    vec4: type
    module: ModuleType


def set_precision(precision: Precision) -> None:
    """Set the precision of evaluations on NumPy arrays: "float32" (default) or "float64", the oracle."""
    global _precision
    if not isinstance(precision, str) or precision not in PRECISIONS:
        raise InputError(f"unknown precision '{precision}'", "set_precision", 'give "float32" or "float64"')
    _precision = precision


def get_precision() -> Precision:
    return _precision


@lru_cache
def drjit() -> ModuleType:
    """Dr.Jit, loaded when something is first computed."""
    import drjit as dr

    return dr


@lru_cache
def _types(backend: str, double: bool) -> Types:
    dr = drjit()
    if backend == "llvm":
        llvm.use()  # where none was found, or one that would abort, that is an error here
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
    """The types for a precision; the one that is set where `precision` is None. CPU: small arrays live there."""
    precision = _precision if precision is None else precision
    if not isinstance(precision, str) or precision not in PRECISIONS:
        raise InputError(f"unknown precision '{precision}'", "precision", 'give "float32" or "float64"')
    return _types("llvm", precision == "float64")


def types_like(kind: type) -> Types:
    """The types that go with a Dr.Jit array type: same device, same precision."""
    dr = drjit()
    backend = "cuda" if dr.backend_v(kind) == dr.JitBackend.CUDA else "llvm"
    return _types(backend, dr.itemsize_v(kind) == 8 and not dr.is_mask_v(kind))


def is_drjit(value: object) -> TypeGuard[Array]:
    """Whether a value is a Dr.Jit array (asked without loading Dr.Jit)."""
    dr = sys.modules.get("drjit")
    is_array = getattr(dr, "is_array_v", None)  # not there yet while another thread imports Dr.Jit
    return is_array is not None and is_array(value)


_formula: ContextVar[type | None] = ContextVar("formula", default=None)  # type of the directions it runs on


@contextlib.contextmanager
def formula_of(directions: object) -> Iterator[None]:
    """A formula runs on these directions meanwhile."""
    before = _formula.set(type(directions))
    try:
        yield
    finally:
        _formula.reset(before)


def in_formula(number: float) -> Array:
    """A plain number with as many bits as the formula that is running has; itself where none is."""
    kind = _formula.get()
    return number if kind is None or not drjit().is_array_v(kind) else types_like(kind).float(number)


def float_of(value: object, kind: Types) -> Array:
    """A number or an array of shape (N,) as a Dr.Jit float.

    A number becomes an evaluated array of one entry a literal: a literal would be baked into the kernel,
    and every new value would compile it again.
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

    Dr.Jit takes NumPy's memory as it lies and writes its alignment into the kernel: arrays that NumPy puts now here,
    now there would compile the same code again and again.
    """
    size = array.size * np.dtype(dtype).itemsize
    raw = np.empty(size + 64, np.uint8)
    start = -raw.ctypes.data % 64
    aligned = raw[start : start + size].view(dtype)
    aligned[:] = array
    return aligned


def vector_of(value: object, size: int, kind: Types) -> Array:
    """Rows of shape (N, size) or one of shape (size,) as a Dr.Jit vector of `size` components."""
    if is_drjit(value):
        return value
    array = np.asarray(value, dtype=np.float64)
    vector = (kind.vec2, kind.vec3, kind.vec4)[size - 2]
    return vector(*[float_of(array[..., i], kind) for i in range(size)])


def to_numpy(value: Array, count: int) -> np.ndarray:
    """A Dr.Jit float as (count,), a vector as (count, size); what is uniform is repeated `count` times."""
    dr = drjit()
    if not dr.is_array_v(value):
        return np.full(count, value)
    if dr.is_vector_v(value):
        # component by component: Dr.Jit would join them in a kernel that has the number of rows in it as a literal
        dr.eval(value)
        parts = [np.asarray(component.numpy()) for component in value]
        count = max(count, *(part.shape[-1] for part in parts))  # parameters may have more rows than the directions
        return np.stack([np.broadcast_to(part, (count,)) for part in parts], axis=-1)
    array = np.asarray(value.numpy())
    count = max(count, array.shape[-1])
    return np.ascontiguousarray(np.broadcast_to(array, (count,)))
