"""The vocabulary in which a material is written.

The words below take Dr.Jit arrays (32 or 64 bit, with autodiff) and compute, or take symbols and are recorded as a
typed graph (`gonio.ops.graph`). The same lines of a model therefore serve a render, a gradient, the float64 oracle
and shader code. Two rules follow: no Python `if` on a value (`where` instead), and no loop whose length is a value.

    from gonio import ops
    ops.where(x > 0, ops.sqrt(x), 0.0)
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any, TypeVar

from . import graph
from .backend import (
    drjit,
    get_precision,
    is_drjit,
    set_precision,
    types_like,
)
from .graph import Graph, Node, RecordingError, record
from .table import Table, inset, lookup

__all__ = [
    "Graph",
    "Node",
    "RecordingError",
    "Table",
    "abs",
    "atan2",
    "clamp",
    "copysign",
    "cos",
    "dot",
    "erf",
    "exp",
    "floor",
    "fma",
    "function",
    "get_precision",
    "inset",
    "is_short",
    "is_single",
    "isfinite",
    "log",
    "lookup",
    "max_component",
    "maximum",
    "mean",
    "minimum",
    "norm",
    "normalize",
    "pi",
    "pow",
    "record",
    "rsqrt",
    "safe_div",
    "safe_sqrt",
    "set_precision",
    "sin",
    "sincos",
    "sqr",
    "sqrt",
    "vec2",
    "vec3",
    "where",
]

pi = math.pi
inv_pi = 1.0 / math.pi

F = TypeVar("F", bound=Callable)


def function(python_function: F) -> F:
    """Mark a function of the vocabulary: it stays a function of its own, by name and docstring, when recorded."""

    @functools.wraps(python_function)
    def wrapper(*args: Any, **kwargs: Any) -> Any:
        if graph._stack and graph.recording((*args, *kwargs.values())):
            return graph.call(python_function, args, kwargs)
        return python_function(*args, **kwargs)

    return wrapper  # type: ignore[return-value]


def _unary(name: str, drjit_name: str | None = None) -> Callable[[Any], Any]:
    def word(x: Any) -> Any:
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


def _binary(name: str, drjit_name: str, python: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    def word(a: Any, b: Any) -> Any:
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


def where(mask: Any, a: Any, b: Any) -> Any:
    """`a` where `mask` holds, else `b`; both are computed."""
    if isinstance(mask, Node) or isinstance(a, Node) or isinstance(b, Node):
        if isinstance(mask, bool):
            return a if mask else b
        return graph.emit("where", graph.widest(a, b), mask, a, b)
    if is_drjit(mask):
        return drjit().select(mask, a, b)
    return a if mask else b


@function
def pow(x: Any, y: Any) -> Any:
    """x ** y for x > 0; 0 where x <= 0, so that no power of unknown sign reaches a shader or a gradient."""
    positive = x > 0.0
    return where(positive, exp(y * log(where(positive, x, 1.0))), 0.0)


def isfinite(x: Any) -> Any:
    """True where x is neither infinite nor NaN."""
    if isinstance(x, Node):
        return graph.emit("isfinite", "bool", x)
    return drjit().isfinite(x)


def is_single(x: Any) -> bool:
    """Whether x is a Dr.Jit value in float32."""
    return is_drjit(x) and drjit().itemsize_v(x) == 4


def is_short(x: Any) -> bool:
    """Whether x is computed in 32 bits, by Dr.Jit or a shader, so that steps below its last digits can be left out."""
    if isinstance(x, Node):
        return graph._stack[-1][0].single
    return is_single(x)


def sincos(x: Any) -> tuple[Any, Any]:
    """(sin x, cos x)."""
    if is_drjit(x):
        return drjit().sincos(x)
    return sin(x), cos(x)


def fma(a: Any, b: Any, c: Any) -> Any:
    """a b + c, in float32 in one operation and rounded once; float64, the oracle, rounds both as NumPy does."""
    return drjit().fma(a, b, c) if is_single(a) or is_single(b) or is_single(c) else a * b + c


@function
def sqr(x: Any) -> Any:
    """x * x."""
    return x * x


@function
def clamp(x: Any, low: Any, high: Any) -> Any:
    """x held in [low, high]."""
    return minimum(maximum(x, low), high)


def rsqrt(x: Any) -> Any:
    """1 / sqrt(x); in float32 by the processor's estimate and a step of Newton's method, within 2 units."""
    return drjit().rsqrt(x) if is_single(x) else 1.0 / sqrt(x)


def _guarded(mask: Any, x: Any) -> Any:
    """x where the mask holds, else 1: what a branch that is not chosen may take the gradient of."""
    return where(mask, x, 1.0) if not is_drjit(x) or drjit().grad_enabled(x) else x


@function
def safe_sqrt(x: Any) -> Any:
    """sqrt(max(x, 0)), with gradient 0 instead of infinity where x <= 0."""
    positive = x > 0.0
    return where(positive, sqrt(_guarded(positive, x)), 0.0)


@function
def safe_div(a: Any, b: Any) -> Any:
    """a / b, and 0 where b = 0."""
    some = b != 0.0
    return where(some, a / _guarded(some, b), 0.0)


def vec2(x: Any, y: Any) -> Any:
    """A vector of two components."""
    if isinstance(x, Node) or isinstance(y, Node):
        return graph.emit("vector", "vec2", x, y)
    return types_like(type(x if is_drjit(x) else y)).vec2(x, y)


def vec3(x: Any, y: Any, z: Any) -> Any:
    """A vector of three components."""
    if isinstance(x, Node) or isinstance(y, Node) or isinstance(z, Node):
        return graph.emit("vector", "vec3", x, y, z)
    known = next(v for v in (x, y, z) if is_drjit(v))
    return types_like(type(known)).vec3(x, y, z)


def dot(a: Any, b: Any) -> Any:
    """Scalar product."""
    if isinstance(a, Node):
        return graph.emit("dot", "float", a, b)
    if is_single(a):
        return drjit().dot(a, b)
    # float64 is the oracle: every product rounded, so that NumPy, reading the recorded graph, gets the same bits
    total = a[0] * b[0]
    for i in range(1, len(a)):
        total = total + a[i] * b[i]
    return total


def norm(v: Any) -> Any:
    """Length of a vector."""
    return sqrt(dot(v, v))


@function
def normalize(v: Any) -> Any:
    """v / |v|; v must not be 0."""
    return v * rsqrt(dot(v, v))


def mean(spectrum: Any) -> Any:
    """Mean over the channels of a spectrum, as a float."""
    if isinstance(spectrum, Node):
        return graph.emit("mean", "float", spectrum)
    return drjit().mean(spectrum, axis=0)


def max_component(spectrum: Any) -> Any:
    """Largest channel of a spectrum, as a float."""
    if isinstance(spectrum, Node):
        return graph.emit("max_component", "float", spectrum)
    return drjit().max(spectrum, axis=0)
