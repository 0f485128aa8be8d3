"""Calls of a material's methods by users, with NumPy arrays, lists or Dr.Jit vectors as arguments and results.

`method` wraps the formulas of a material. If the parameters are bound (in calls by another formula, a renderer or a
recording), the formula runs unchanged; otherwise the material is bound, and the arguments and the result are converted.
"""

from __future__ import annotations

import functools
import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeAlias, TypeVar, overload

import numpy as np
from numpy.typing import ArrayLike

from .. import ops
from ..arguments import shown
from ..errors import InputError
from ..ops import Direction, Mode, Precision, Scalar, Spectrum, Vector3, backend
from ..owner import COMPUTING
from . import binding, blocks, requests, tensors, tree
from .parameters import Material
from .sample import Floats, Sample, SampleArrays, checked

MODES = ("radiance", "importance")

V3 = TypeVar("V3", bound="Vector3[DrJit]")
S = TypeVar("S")
M = TypeVar("M", bound=Material)
T = TypeVar("T", bound="tuple[object, ...]")
T_co = TypeVar("T_co", bound="tuple[object, ...]", covariant=True)

Given: TypeAlias = Any  # directions as callers pass them: arrays, lists, Dr.Jit vectors
DrJit: TypeAlias = Any  # a Dr.Jit value, whose type is not expressible


MISSING: Any = object()
EXTRAS = ("derivatives", "wavelengths", "parameters")  # arguments of eval and pdf; sample has the last only


class EvalMethod(Protocol):
    """The signature of `eval` for callers: it returns one spectrum per ray, (N, 3)."""

    @overload
    def __call__(self, wo: Direction, wi: Direction, mode: Mode = ...) -> Spectrum: ...
    @overload
    def __call__(self, wo: V3, wi: V3, mode: Mode = ..., precision: Precision | None = ...) -> V3: ...
    @overload
    def __call__(
        self,
        wo: ArrayLike,
        wi: ArrayLike,
        mode: Mode = ...,
        precision: Precision | None = ...,
        *,
        derivatives: Sequence[str] = ...,
        wavelengths: ArrayLike | None = ...,
    ) -> Floats: ...
    @overload
    def __call__(
        self,
        wo: tensors.Tensor,
        wi: tensors.Tensor,
        mode: Mode = ...,
        precision: Precision | None = ...,
        *,
        parameters: Mapping[str, tensors.Tensor] = ...,
    ) -> tensors.Tensor: ...


class PdfMethod(Protocol):
    """The signature of `pdf` for callers: it returns one number per ray, (N,)."""

    @overload
    def __call__(self, wo: Vector3[S], wi: Vector3[S], *, precision: Precision | None = ...) -> S: ...
    @overload
    def __call__(
        self,
        wo: ArrayLike,
        wi: ArrayLike,
        *,
        precision: Precision | None = ...,
        derivatives: Sequence[str] = ...,
        wavelengths: ArrayLike | None = ...,
    ) -> Floats: ...
    @overload
    def __call__(
        self,
        wo: tensors.Tensor,
        wi: tensors.Tensor,
        *,
        precision: Precision | None = ...,
        parameters: Mapping[str, tensors.Tensor] = ...,
    ) -> tensors.Tensor: ...


class SampleMethod(Protocol):
    """The signature of `sample` for callers."""

    @overload
    def __call__(self, wo: Direction, u: Direction, mode: Mode = ...) -> Sample: ...
    @overload
    def __call__(
        self, wo: V3, u: Vector3[S], mode: Mode = ..., precision: Precision | None = ...
    ) -> Sample[V3, V3, S, DrJit]: ...
    @overload
    def __call__(
        self, wo: ArrayLike, u: ArrayLike, mode: Mode = ..., precision: Precision | None = ...
    ) -> SampleArrays: ...
    @overload
    def __call__(
        self,
        wo: tensors.Tensor,
        u: tensors.Tensor,
        mode: Mode = ...,
        precision: Precision | None = ...,
        *,
        parameters: Mapping[str, tensors.Tensor] = ...,
    ) -> Sample[tensors.Tensor, tensors.Tensor, tensors.Tensor, tensors.Tensor]: ...


class TermsMethod(Protocol[T_co]):
    """The signature of `terms` for callers: it returns a NamedTuple, whose fields are arrays (N,) or (N, 3) outside
    formulas."""

    @overload
    def __call__(self, wo: Direction, wi: Direction, *, precision: None = ...) -> T_co: ...
    @overload
    def __call__(self, wo: ArrayLike, wi: ArrayLike, *, precision: Precision | None = ...) -> DrJit: ...


@overload
def method(formula: Callable[[M, Direction, Direction, Mode], Spectrum], /) -> _Eval: ...
@overload
def method(formula: Callable[[M, Direction, Direction], Scalar], /) -> _Pdf: ...
@overload
def method(formula: Callable[[M, Direction, Direction, Mode], Sample], /) -> _Sampler: ...
@overload
def method(formula: Callable[[M, Direction, Direction], T], /) -> _Terms[T]: ...
def method(formula: Callable[..., object], /) -> object:
    """Decorate `eval`, `pdf`, `sample` or `terms` of a material, so that editors show the types for callers, who may
    pass NumPy arrays, lists or Dr.Jit vectors. Methods of these names are wrapped even without the decorator."""
    if hasattr(formula, "__wrapped__"):
        return formula
    inner = ops.function(formula)
    takes_mode = "mode" in inspect.signature(formula).parameters
    second = "u" if formula.__name__ == "sample" else "wi"

    @functools.wraps(formula)
    def enter(
        self: Material,
        wo: Given,
        other: Given | None = MISSING,
        mode: Mode = "radiance",
        precision: Precision | None = None,
        **named: Given,
    ) -> object:
        if other is MISSING:
            other = named.pop(second, MISSING)
        extras = {"eval": EXTRAS, "pdf": EXTRAS, "sample": EXTRAS[2:]}.get(formula.__name__, ())
        extra = {key: named.pop(key) for key in extras if key in named}
        if other is MISSING or named:
            what = f"has no argument '{next(iter(named))}'" if named else f"lacks its argument '{second}'"
            raise TypeError(f"{type(self).__name__}.{formula.__name__} {what}: wo, {second}, precision and mode")
        args = (mode,) if takes_mode else ()
        if self.is_bound:
            with backend.formula_of(wo):
                result = inner(self, wo, other, *args)
            return checked(result, f"{type(self).__name__}.sample") if second == "u" else result
        if not isinstance(mode, str) or mode not in MODES:
            where = f"{type(self).__name__}.{formula.__name__}"
            raise InputError(f"unknown mode {shown(mode)}", where, " or ".join(MODES))
        given = extra.pop("parameters", {})
        kind = tensors.library(wo, other, *given.values())
        if kind or given:
            return _on_tensors(self, formula.__name__, (wo, other, mode, precision), kind, given, extra)
        with COMPUTING:
            if extra:
                return _on_request(self, formula.__name__, enter, (wo, other, mode, precision), **extra)
            if backend.is_drjit(wo):
                return enter(binding.bind_to(self, backend.types_like(type(wo))), wo, other, mode)
            return _on_numpy(self, formula.__name__, enter, wo, other, mode, precision)

    return enter


if TYPE_CHECKING:

    class _Eval:
        def __get__(self, owner: object, cls: type | None = None) -> EvalMethod: ...

    class _Pdf:
        def __get__(self, owner: object, cls: type | None = None) -> PdfMethod: ...

    class _Sampler:
        def __get__(self, owner: object, cls: type | None = None) -> SampleMethod: ...

    class _Terms(Generic[T_co]):
        def __get__(self, owner: object, cls: type | None = None) -> TermsMethod[T_co]: ...


def _on_numpy(
    material: Material,
    name: str,
    enter: Callable[..., object],
    wo: Given,
    other: Given,
    mode: Mode,
    precision: Precision | None,
) -> object:
    types = backend.types(precision)
    first, second, shape = _rows(wo, other, name)
    count = math.prod(shape)
    _check_rows(material, count)
    bound = binding.bind_to(material, types)
    if count == 0:  # Dr.Jit cannot broadcast empty arrays with arrays of one entry
        first = second = np.array([0.0, 0.0, 1.0])
    many = count >= blocks.MANY
    if many:
        a, b = blocks.vector_of(first, count, types), blocks.vector_of(second, count, types)
    else:
        a, b = backend.vector_of(first, 3, types), backend.vector_of(second, 3, types)
    result = enter(bound, a, b, mode)
    parts = list(result) if isinstance(result, tuple) else [result]
    if many:
        valid = [
            (blocks.is_unit, "wo", a),
            (blocks.is_random, "u", b) if name == "sample" else (blocks.is_unit, "wi", b),
        ]
        arrays, passed = blocks.to_numpy(parts, shape, [check(vector) for check, _, vector in valid])
        for (_, label, _), array, ok in zip(valid, (first, second), passed, strict=True):
            if not ok:
                _check_values(array, label, f"{name}: {label}")
    else:
        backend.drjit().eval(parts)  # in one kernel, because the parts share computations
        arrays = [backend.to_numpy(value, max(count, 1))[: count or None] for value in parts]
        arrays = [array[:0] for array in arrays] if count == 0 else arrays
    if len(shape) != 1 and not many:
        arrays = [array.reshape(*shape, *array.shape[1:]) for array in arrays]
    return type(result)(*arrays) if isinstance(result, tuple) else arrays[0]  # a NamedTuple


def _on_tensors(
    material: Material,
    name: str,
    arguments: tuple[Given, Given, Mode, Precision | None],
    kind: str,
    parameters: Mapping[str, Given],
    extra: Mapping[str, Given],
) -> object:
    """The result of `eval`, `pdf` or `sample` for tensors of PyTorch or JAX."""
    wo, other, mode, precision = arguments
    if not kind:
        hint = "give the values to the material: go.Conductor(alpha=0.2)"
        raise InputError("parameters given without tensors of PyTorch or JAX", f"{name}: parameters", hint)
    if name not in ("eval", "pdf", "sample") or extra:
        what = f"tensors of PyTorch or JAX in {name}" + (f" with {next(iter(extra))}" if extra else "")
        raise InputError(what, name, "give NumPy arrays; eval, f, pdf and sample take tensors")
    double = any("float64" in str(getattr(x, "dtype", "")) for x in (wo, other, *parameters.values()))
    precision = precision or ("float64" if double else backend.get_precision())
    call = tensors.Call(material, name, tuple(parameters), mode, precision, _rows)
    return tensors.called(call, kind, wo, other, parameters)


def _on_request(
    material: Material,
    name: str,
    enter: Callable[..., object],
    given: tuple[Given, Given, Mode, Precision | None],
    derivatives: Sequence[str] = (),
    wavelengths: ArrayLike | None = None,
) -> Floats:
    """Values with their derivatives, or values at wavelengths, for arrays."""
    wo, other, mode, precision = given
    if backend.is_drjit(wo):
        what = "derivatives or wavelengths requested for Dr.Jit values"
        hint = "use dr.enable_grad on a parameter, or give arrays"
        raise InputError(what, name, hint)
    if len(derivatives) and wavelengths is not None:
        raise InputError("both derivatives and wavelengths given", name, "give one of them")
    types = backend.types(precision)
    first, second, shape = _rows(wo, other, name)
    count = math.prod(shape)
    _check_rows(material, count)
    for label, array in (("wo", first), ("wi", second)):
        _check_values(array, label, f"{name}: {label}")
    a, b = backend.vector_of(first, 3, types), backend.vector_of(second, 3, types)

    def formula(bound: Material) -> DrJit:
        return enter(bound, a, b, mode)

    if wavelengths is None:
        paths = [derivatives] if isinstance(derivatives, str) else derivatives
        rows = [backend.to_numpy(value, count) for value in requests.slopes(material, paths, formula, types)]
        return np.stack([row.reshape(*shape, *row.shape[1:]) for row in rows])
    columns = []
    for value in requests.at_wavelengths(material, wavelengths, formula, types):
        row = backend.to_numpy(value, count)
        columns.append((row[:, 0] if row.ndim == 2 else row).reshape(shape))
    return np.stack(columns, axis=-1)


def _rows(wo: Given, other: Given, name: str) -> tuple[np.ndarray, np.ndarray, tuple[int, ...]]:
    """Two arguments as arrays of shape (N, 3) or (3,), and the shape of the results: (N,), or for arrays with more
    axes, their shape without the last axis. The values of large arrays are checked later, together with the results."""
    arrays = []
    for label, value in (("wo", wo), ("u" if name == "sample" else "wi", other)):
        where = f"{name}: {label}"
        try:
            array = np.asarray(value)
            if np.ma.is_masked(value):
                raise InputError("masked values given", where, "give only the unmasked rows")
            if np.iscomplexobj(array):
                raise InputError("complex numbers given, real ones expected", where)
            array = array if array.dtype in (np.float32, np.float64) else array.astype(np.float64)
        except InputError:
            raise
        except (TypeError, ValueError):
            array = np.empty(0)
        if array.ndim == 0 or array.shape[-1] != 3:
            raise InputError(f"an array of shape {array.shape}, expected (N, 3) or (..., 3)", where)
        if array.size < 3 * blocks.MANY:
            _check_values(array, label, where)
        arrays.append(array)
    first, second = arrays
    if max(first.ndim, second.ndim) <= 2:
        sizes = sorted({len(x) for x in arrays if x.ndim == 2 and len(x) != 1}) or [1]
        if len(sizes) > 1:
            raise InputError(f"{sizes[0]} and {sizes[1]} rows given, the same number expected", name)
        return first, second, (sizes[0],)
    try:
        shape = np.broadcast_shapes(first.shape, second.shape)
    except ValueError:
        what = f"arrays of shapes {first.shape} and {second.shape}, which do not broadcast"
        raise InputError(what, name, "give the same number of rows on every axis, or 1") from None
    first, second = (np.broadcast_to(x, shape).reshape(-1, 3) for x in arrays)
    return first, second, shape[:-1]


def _check_values(array: np.ndarray, label: str, where: str) -> None:
    """Raise InputError for directions that are not unit vectors and for random numbers outside [0, 1]."""
    if label != "u":
        _check_unit(array, where)
    elif not np.all((array >= 0.0) & (array <= 1.0)):  # NaN compares false
        raise InputError("random numbers outside [0, 1]", where, "give rng.random((N, 3))")


def _check_unit(array: np.ndarray, location: str) -> None:
    array = array.astype(np.float64, copy=False)
    length = np.sqrt(np.einsum("...i,...i->...", array, array))
    off = ~(np.abs(length - 1.0) <= blocks.UNIT)  # NaN compares false
    if np.any(off):
        row = int(np.argmax(off))
        what = f"row {row} has length {np.ravel(length)[row]:.4g}, unit vectors expected"
        raise InputError(
            what, location, "divide directions by their length: w / np.linalg.norm(w, axis=-1, keepdims=True)"
        )


def _check_rows(material: Material, count: int) -> None:
    """Raise InputError if a parameter has one value per ray, but for a different number of rays."""
    if count == 1:
        return
    for leaf in tree.leaves(material):
        if leaf.parameter.numeric and not isinstance(leaf.value, int | float):
            rows = leaf.parameter.rows(leaf.value)
            if rows not in (1, count):
                where = f"{type(leaf.owner).__name__}.{leaf.parameter.name}"
                raise InputError(f"{rows} rows given for {count} directions, the same number expected", where)
