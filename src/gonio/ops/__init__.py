"""The vocabulary in which a material is written.

The functions below operate on Dr.Jit arrays, in single or double precision and with automatic differentiation, or
record a typed graph if they are given symbols (`gonio.ops.graph`). The same lines of a model are therefore used for
renders, gradients, float64 reference values and shader code. Two rules follow: no Python `if` on a value (use `where`),
and no loop whose length depends on a value.

    from gonio import ops
    ops.where(x > 0, ops.sqrt(x), 0.0)
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Protocol, TypeVar, overload

from ..errors import InputError, did_you_mean
from . import graph
from .backend import drjit, get_precision, in_formula, is_drjit, set_precision, types_like
from .graph import ForbiddenOperator, Graph, Node, RecordingError, record
from .interpolation import fetch, inset, lookup
from .table import Table
from .types import Direction, Mask, Mode, Pair, Precision, Scalar, Spectrum, Value, Vector, Vector3

__all__ = [
    "Direction", "ForbiddenOperator", "Graph", "Mask", "Mode", "Node", "Pair", "Precision", "RecordingError", "Scalar",
    "Spectrum", "Table", "Vector", "Vector3", "abs", "atan2", "channels", "clamp", "copysign", "cos", "dot", "erf",
    "exp",
    "fetch", "floor", "fma", "function", "get_precision", "inset", "inv_pi", "is_short", "is_single", "isfinite", "log",
    "lookup", "max_component", "maximum", "mean", "minimum", "norm", "normalize", "of_channels", "ones_like", "pi",
    "pow", "record", "rsqrt", "safe_div", "safe_sqrt", "set_precision", "sin", "sincos", "sqr", "sqrt", "vec2", "vec3",
    "where", "zeros_like",
]  # fmt: skip

pi = math.pi
inv_pi = 1.0 / math.pi

F = TypeVar("F", bound=Callable)
V = TypeVar("V", bound=Vector)
T = TypeVar("T", float, Scalar, Pair, Direction, Spectrum)  # argument and result of an elementwise function


def function(python_function: F) -> F:
    """Mark a function so that a recording defines it once, with its name and docstring, and records calls of it."""

    @functools.wraps(python_function)
    def wrapper(*args: object, **kwargs: object) -> object:
        if graph._stack and graph.recording((*args, *kwargs.values())):
            return graph.call(python_function, args, kwargs)
        return python_function(*args, **kwargs)

    return wrapper  # type: ignore[return-value]


class _Unary(Protocol):
    def __call__(self, x: T, /) -> T: ...


class _Binary(Protocol):
    @overload
    def __call__(self, a: float, b: float, /) -> float: ...  # type: ignore[overload-overlap]
    @overload
    def __call__(self, a: Scalar | float, b: Scalar | float, /) -> Scalar: ...
    @overload
    def __call__(self, a: V, b: V | Scalar | float, /) -> V: ...
    @overload
    def __call__(self, a: Scalar | float, b: V, /) -> V: ...


def _unary(name: str, drjit_name: str | None = None) -> _Unary:
    def word(x: Value) -> Value:
        if isinstance(x, Node):
            return graph.emit(name, x.type, x)
        if is_drjit(x):
            return getattr(drjit(), drjit_name or name)(x)
        return getattr(math, "fabs" if name == "abs" else name)(x)

    word.__name__ = name
    word.__doc__ = f"{name} of each component."
    return word


sqrt = _unary("sqrt")
exp = _unary("exp")
log = _unary("log")
sin = _unary("sin")
cos = _unary("cos")
erf = _unary("erf")
floor = _unary("floor")
abs = _unary("abs")


def _binary(name: str, drjit_name: str, python: Callable[[Value, Value], Value]) -> _Binary:
    def word(a: Value, b: Value) -> Value:
        if isinstance(a, Node) or isinstance(b, Node):
            return graph.arithmetic(name, a, b)
        if is_drjit(a) or is_drjit(b):
            return getattr(drjit(), drjit_name)(a, b)
        return python(a, b)

    word.__name__ = name
    return word


minimum = _binary("minimum", "minimum", min)
maximum = _binary("maximum", "maximum", max)
atan2 = _binary("atan2", "atan2", math.atan2)
copysign = _binary("copysign", "copysign", math.copysign)


@overload
def where(mask: Mask | bool, a: V, b: V | Scalar | float) -> V: ...
@overload
def where(mask: Mask | bool, a: Scalar | float, b: V) -> V: ...
@overload
def where(mask: Mask | bool, a: Scalar | float, b: Scalar | float) -> Scalar: ...
@overload
def where(mask: Mask | bool, a: Mask, b: Mask) -> Mask: ...
def where(mask: Value, a: Value, b: Value) -> Value:
    """`a` where `mask` is true, else `b`; both are computed. Plain numbers take the precision of the running
    formula."""
    if isinstance(mask, Node) or isinstance(a, Node) or isinstance(b, Node):
        if isinstance(mask, bool):
            return a if mask else b
        return graph.emit("where", graph.widest(a, b), mask, a, b)
    if is_drjit(mask):
        plain = type(a) in (int, float) and type(b) in (int, float) and float in (type(a), type(b))
        return drjit().select(mask, in_formula(a) if plain else a, b)
    return a if mask else b


@function
def pow(x: Scalar, y: Scalar | float) -> Scalar:
    """x ** y for x > 0; 0 for x <= 0, so that neither shaders nor gradients contain a power of a negative number."""
    positive = x > 0.0
    return where(positive, exp(y * log(where(positive, x, 1.0))), 0.0)


def isfinite(x: Scalar | Vector) -> Mask:
    """True where x is neither infinite nor NaN."""
    if isinstance(x, Node):
        mask: Value = graph.emit("isfinite", "bool", x)
        return mask
    return drjit().isfinite(x)


def is_single(x: Value) -> bool:
    """Whether x is a Dr.Jit value in float32."""
    return is_drjit(x) and drjit().itemsize_v(x) == 4


def is_short(x: Value) -> bool:
    """Whether x is computed in float32, by Dr.Jit or a shader, so that steps beyond this precision can be omitted."""
    if isinstance(x, Node):
        return graph._stack[-1][0].single
    return is_single(x)


def sincos(x: Scalar) -> tuple[Scalar, Scalar]:
    """(sin x, cos x)."""
    if is_drjit(x):
        return drjit().sincos(x)
    return sin(x), cos(x)


@overload
def fma(a: Scalar | float, b: Scalar | float, c: Scalar | float) -> Scalar: ...
@overload
def fma(a: V, b: V | Scalar | float, c: V | Scalar | float) -> V: ...
@overload
def fma(a: Scalar | float, b: V, c: V | Scalar | float) -> V: ...
@overload
def fma(a: Scalar | float, b: Scalar | float, c: V) -> V: ...
def fma(a: Value, b: Value, c: Value) -> Value:
    """a b + c. In float32, it is fused and rounded once; in float64, the reference, product and sum are rounded as in
    NumPy."""
    return drjit().fma(a, b, c) if is_single(a) or is_single(b) or is_single(c) else a * b + c


@function
def sqr(x: T) -> T:
    """The square of x, as one product."""
    return x * x


@function
def clamp(x: T, low: T | float, high: T | float) -> T:
    """x clamped to [low, high]."""
    return minimum(maximum(x, low), high)


def rsqrt(x: T) -> T:
    """1 / sqrt(x). In float32, it is computed from the processor's estimate and one Newton step, to within 2 ulp."""
    return drjit().rsqrt(x) if is_single(x) else 1.0 / sqrt(x)


def zeros_like(x: T) -> T:
    """0 with the type and lanes of x; recorded as 0 x."""
    return 0.0 * x


def ones_like(x: T) -> T:
    """1 with the type and lanes of x; recorded as 1 + 0 x."""
    return 1.0 + 0.0 * x


def _guarded(mask: Value, x: Value) -> Value:
    """x where the mask is true, else 1, so that the gradient of the unused branch is finite."""
    return where(mask, x, 1.0) if not is_drjit(x) or drjit().grad_enabled(x) else x


@function
def safe_sqrt(x: T) -> T:
    """sqrt(max(x, 0)), with gradient 0 instead of infinity where x <= 0."""
    positive = x > 0.0
    root: Value = where(positive, sqrt(_guarded(positive, x)), 0.0)
    return root


@overload
def safe_div(a: Scalar | float, b: Scalar) -> Scalar: ...
@overload
def safe_div(a: V, b: V | Scalar) -> V: ...
@overload
def safe_div(a: Scalar | float, b: V) -> V: ...
@function
def safe_div(a: Value, b: Value) -> Value:
    """a / b, and 0 where b = 0."""
    some = b != 0.0
    return where(some, a / _guarded(some, b), 0.0)


def vec2(x: Scalar | float, y: Scalar | float) -> Pair:
    """A vector of two components."""
    return _vector("vec2", x, y)


def vec3(x: Scalar | float, y: Scalar | float, z: Scalar | float) -> Direction:
    """A vector of three components."""
    return _vector("vec3", x, y, z)


def _vector(kind: str, *parts: Value) -> Value:
    """A vector of symbols or Dr.Jit values; plain numbers take the type of the running formula."""
    if not any(is_drjit(part) for part in parts):
        parts = (in_formula(parts[0]), *parts[1:])
    for part in parts:
        if is_drjit(part):
            return getattr(types_like(type(part)), kind)(*parts)
    if graph._stack:
        return graph.emit("vector", kind, *parts)
    raise InputError(f"{kind} of plain numbers, outside a formula", kind, "use NumPy, or give a Dr.Jit value")


def dot(a: V, b: V) -> Scalar:
    """Scalar product."""
    if isinstance(a, Node):
        return graph.emit("dot", "float", a, b)
    if is_single(a):
        return drjit().dot(a, b)
    # float64 is the reference: each product is rounded, so that NumPy computes identical bits from the recorded graph
    total = a[0] * b[0]
    for i in range(1, len(a)):
        total = total + a[i] * b[i]
    return total


def norm(v: Vector) -> Scalar:
    """Length of a vector."""
    return sqrt(dot(v, v))


@function
def normalize(v: V) -> V:
    """v / |v|; v must not be 0."""
    return v * rsqrt(dot(v, v))


def channels(spectrum: Spectrum) -> tuple[Scalar, ...]:
    """The channels of a spectrum: three in a recording."""
    if isinstance(spectrum, Node):
        return tuple(graph.emit("component", "float", spectrum, static=place) for place in range(3))
    return tuple(spectrum)


def of_channels(like: Spectrum, values: Sequence[Scalar]) -> Spectrum:
    """A spectrum with these channels, as many as `like` has."""
    if isinstance(like, Node) or any(isinstance(value, Node) for value in values):
        return graph.emit("vector", "spectrum", *values)  # type: ignore[return-value]
    made: Value = type(like)(*values)
    return made


def mean(spectrum: Spectrum) -> Scalar:
    """Mean over the channels of a spectrum, as a float."""
    if isinstance(spectrum, Node):
        return graph.emit("mean", "float", spectrum)
    # not Dr.Jit's mean, which writes the number of lanes into the kernel and would recompile it for every array size
    return drjit().sum(spectrum, axis=0) * (1.0 / len(spectrum))


def max_component(spectrum: Spectrum) -> Scalar:
    """Largest channel of a spectrum, as a float."""
    if isinstance(spectrum, Node):
        return graph.emit("max_component", "float", spectrum)
    return drjit().max(spectrum, axis=0)


if not TYPE_CHECKING:  # a type checker would accept every misspelled name
    # names of these functions in shaders and NumPy
    _ELSEWHERE = {"max": "maximum", "min": "minimum", "select": "where", "length": "norm", "clip": "clamp"}

    def __getattr__(name: str) -> object:
        if name.startswith("_"):
            raise AttributeError(name)
        hint = f"it is '{_ELSEWHERE[name]}' here" if name in _ELSEWHERE else did_you_mean(name, __all__)
        raise AttributeError(f"gonio.ops has no '{name}'; {hint}")
