"""Evaluation of recorded operations in NumPy float64."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from .table import fetch_in_numpy, read_in_numpy
from .types import Value

NUMPY: dict[str, Callable] = {
    "add": np.add,
    "sub": np.subtract,
    "mul": np.multiply,
    "div": np.divide,
    "neg": np.negative,
    "lt": np.less,
    "le": np.less_equal,
    "gt": np.greater,
    "ge": np.greater_equal,
    "eq": np.equal,
    "ne": np.not_equal,
    "and": np.logical_and,
    "or": np.logical_or,
    "not": np.logical_not,
    "where": np.where,
    "sqrt": np.sqrt,
    "abs": np.abs,
    "minimum": np.minimum,
    "maximum": np.maximum,
    "exp": np.exp,
    "log": np.log,
    "pow": np.power,
    "sin": np.sin,
    "cos": np.cos,
    "atan2": np.arctan2,
    "floor": np.floor,
    "erf": np.vectorize(math.erf, otypes=[float]),
    "copysign": np.copysign,
    "isfinite": np.isfinite,
    "dot": lambda a, b: sum(a[i] * b[i] for i in range(len(a))),
    "mean": lambda a: np.mean(a, axis=0),
    "max_component": lambda a: np.max(a, axis=0),
    # used by the logarithm and the exponential in shaders
    "exponent": lambda x: np.frexp(x)[1] - 1.0,
    "scaled": lambda x, e: np.ldexp(x, np.asarray(e, int)),
}


def operate(op: str, static: Value, args: list[Value]) -> Value:
    """The result of one operation on NumPy values."""
    if op == "component":
        return args[0][static]
    if op == "vector":
        # one column if all components are constants, so that the result multiplies numbers of any count
        return np.stack(np.broadcast_arrays(*[np.atleast_1d(np.asarray(a, float)) for a in args]))
    if op in ("lookup", "fetch"):
        table, channel = static
        return (read_in_numpy if op == "lookup" else fetch_in_numpy)(table, *args)[channel]
    return NUMPY[op](*args)
