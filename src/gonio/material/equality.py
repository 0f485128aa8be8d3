"""Comparison and hashing of the values of parameters."""

from __future__ import annotations

import numpy as np

from ..ops import backend
from .parameters import Material, Value


def alike(x: object, y: object) -> bool:
    return x is y or bool(np.array_equal(np.asarray(x, float), np.asarray(y, float)))


def same(a: Value, b: Value) -> bool:
    if isinstance(a, Material) or isinstance(b, Material):
        return bool(a == b)
    if backend.is_drjit(a) or backend.is_drjit(b):
        return a is b
    try:
        return type(a) is type(b) and bool(np.array_equal(np.asarray(a), np.asarray(b)))
    except ValueError:  # a ragged tuple of widths
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))


def hashable(value: Value) -> object:
    if isinstance(value, tuple | list):
        return tuple(map(hashable, value))
    if backend.is_drjit(value):
        return id(value)
    return value.tobytes() if isinstance(value, np.ndarray) else value
