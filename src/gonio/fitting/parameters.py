"""Free parameters of a fit: numbers of a material, each with bounds and a linear or logarithmic scale."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, did_you_mean
from ..material import BSDF, Parameter, tree
from ..material.parameters import pair_of
from ..ops import backend

CHANNELS = 3
NAMES = ("r", "g", "b")
WIDE = 30.0  # ratio of bounds above which a range has a logarithmic scale
SMALLEST = 1e-3  # lower bound of parameters with a logarithmic scale whose range begins at 0
M = TypeVar("M", bound=BSDF)


@dataclass(frozen=True)
class Free:
    """A free parameter.

    path       path in the tree of materials
    kind       "float", "spectrum" or "alpha"
    low, high  bounds of its range
    ratio      whether the solver varies the logarithm of the parameter
    """

    path: str
    kind: str
    low: float
    high: float
    ratio: bool

    @property
    def count(self) -> int:
        """Number of scalar values: 3 for a spectrum, else 1."""
        return CHANNELS if self.kind == "spectrum" else 1

    @property
    def names(self) -> list[str]:
        """Names of its scalar values."""
        return [f"{self.path}.{c}" for c in NAMES] if self.count > 1 else [self.path]


def free_of(material: BSDF, fixed: Mapping[str, object], free: tuple[str, ...] = ()) -> list[Free]:
    """The parameters of a material that a fit may change.

    fixed  paths of parameters that stay fixed
    free   paths of parameters that are fixed by default: scale factors of 1, such as the albedo of a conductor
    Raises InputError for an unknown path, and if no parameter remains.
    """
    leaves = [leaf for leaf in tree.surface(material) if leaf.parameter.numeric]
    known = [leaf.path for leaf in leaves]
    for path in (*fixed, *free):
        if path not in [leaf.path for leaf in tree.leaves(material)]:
            raise InputError(f"no parameter '{path}'", type(material).__name__, did_you_mean(path, known))
    moving = []
    for leaf in leaves:
        parameter = leaf.parameter
        factor = parameter.high == 1.0 and parameter.default == 1.0 and not leaf.owner.fits_factors
        if leaf.path in fixed or (factor and leaf.path not in free) or parameter.kind == "angle":
            continue
        moving.append(_free(leaf.path, parameter))
    if not moving:
        raise InputError("no parameter is left to fit", type(material).__name__, "fix fewer parameters")
    return moving


def _free(path: str, parameter: Parameter) -> Free:
    low = parameter.low if np.isfinite(parameter.low) else -1e6
    high = parameter.high if np.isfinite(parameter.high) else 1e6
    ratio = low >= 0.0 and parameter.kind != "spectrum" and (parameter.kind == "alpha" or high > WIDE * max(low, 1.0))
    return Free(path, parameter.kind, max(low, SMALLEST) if ratio else low, high, ratio)


def start_of(material: BSDF, free: list[Free]) -> NDArray[np.float64]:
    """Current values of the free parameters, clamped to their ranges."""
    values: list[float] = []
    for one in free:
        value = tree.value_at(material, one.path)
        if one.kind == "alpha":
            value = np.sqrt(np.prod([float(np.mean(w)) for w in pair_of(value)]))
        numbers = np.broadcast_to(np.asarray(value, float), (one.count,))
        values += list(np.clip(numbers, one.low, one.high))
    return np.array(values)


def inner_of(free: list[Free], numbers: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values inside all ranges, none of them at an end and no two equal; close to `numbers` if a range is wide."""
    low, high, _ = ranges(free)
    reach = np.minimum(high - low, WIDE)
    begin = np.clip(numbers - 0.5 * reach, low, high - reach)
    return np.asarray(begin + reach * np.random.default_rng(3).uniform(0.2, 0.8, len(numbers)))


def ranges(free: list[Free]) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """(lower bounds, upper bounds, whether logarithmic) of all numbers, (K,) each."""
    many = [(one.low, one.high, one.ratio) for one in free for _ in range(one.count)]
    low, high, ratio = zip(*many, strict=True)
    return np.array(low), np.array(high), np.array(ratio)


def with_values(material: M, free: list[Free], numbers: NDArray[np.float64]) -> M:
    """The material with new values of its free parameters."""
    values: dict[str, object] = {}
    at = 0
    for one in free:
        part = numbers[at : at + one.count]
        at += one.count
        values[one.path] = float(part[0]) if one.count == 1 else tuple(map(float, part))
    return tree.replace(material, values)


def with_drjit(material: M, free: list[Free], numbers: list[backend.Array], types: backend.Types) -> M:
    """The material with Dr.Jit arrays of one entry as its free parameters."""
    values: dict[str, object] = {}
    at = 0
    for one in free:
        part = numbers[at : at + one.count]
        at += one.count
        if one.kind == "spectrum":
            values[one.path] = types.vec3(*part)
        elif one.kind == "alpha":
            values[one.path] = types.vec2(part[0], part[0])
        else:
            values[one.path] = part[0]
    return tree.replace(material, values)
