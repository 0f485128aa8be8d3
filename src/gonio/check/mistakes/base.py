"""Types and functions shared by all families of mistakes."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ...material import BSDF
from ..finding import Mistake

Values: TypeAlias = NDArray[np.float64]


class Variant(NamedTuple):
    """A mistake, and the values of f that it produces, (N, 3)."""

    mistake: Mistake
    values: Values


def f_of(material: BSDF, wo: np.ndarray, wi: np.ndarray) -> Values:
    """f of a material, (N, 3) in 1/sr; 0 where the cosine of wi is 0."""
    value = np.asarray(material.eval(wo, wi, precision="float64"), float)
    cosine = np.abs(wi[:, 2:])
    return np.divide(value, cosine, out=np.zeros_like(value), where=cosine > 0.0)


def above(wo: np.ndarray, wi: np.ndarray) -> np.ndarray:
    """Whether wo and wi are both above the surface, (N, 1)."""
    return (wo[:, 2:] > 0.0) & (wi[:, 2:] > 0.0)


def color(value: object) -> Values:
    """The value of a parameter as a row of three channels, (1, 3)."""
    return np.broadcast_to(np.asarray(value, float), (3,))[None]
