"""Parameters that vary over the surface: their effect on the light, and the slices of a guide along them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import ops
from ..ops import Scalar, fetch
from . import tree
from .guide import Axis
from .guide_charts import MIN_LIGHT, Chart, Slices, named
from .guide_probe import Guided
from .parameters import Parameter, Value, pair_of

MIDDLING = 0.01  # q0 at which lobes of any width are compared
DIFFERENT = 0.05  # fraction of the light that must be redistributed for a varying parameter to get its own slices
SMALLEST = 1.0 / 64.0  # lower limit of the range of a varying width, relative to its upper limit


@dataclass(frozen=True)
class _Varying:
    """A parameter that varies over the surface: its path, its kind, and its range.

    low, high  smallest and largest value as a number: the mean of a color, the geometric mean of two widths
    """

    path: str
    kind: str
    low: float
    high: float

    def value(self, share: float) -> float:
        """The value at a position from 0 to 1, along which the square root of a width increases linearly."""
        return self.low + (self.high - self.low) * (share * share if self.kind == "alpha" else share)

    def axis(self, count: int) -> Axis:
        """The axis along which slices for this parameter are stored.

        count  number of slices
        """
        ends = named("ends", np.array([[self.low, 1.0 / (self.high - self.low)]]))

        def read(material: Any) -> Scalar:
            given = tree.value_at(material, self.path)
            if self.kind == "alpha":
                given = ops.sqrt(given.x * given.y)
            elif self.kind == "spectrum":
                given = ops.mean(given)
            low, scale = fetch(ends, 0.0 * given)
            share = ops.clamp((given - low) * scale, 0.0, 1.0)
            return ops.sqrt(share) if self.kind == "alpha" else share

        return Axis(read, count)


def _ends(parameter: Parameter, value: Value) -> tuple[float, float] | None:
    """The range (low, high) of a value that varies from ray to ray, as in `_Varying`; None if it does not vary."""
    if not parameter.numeric or value is None or parameter.rows(value) <= 1:
        return None
    if parameter.kind == "alpha":
        x, y = (np.asarray(v, float).ravel() for v in pair_of(value))
        values = np.sqrt(x * y)
    elif parameter.kind == "spectrum":
        values = np.asarray(value, float).mean(-1)
    else:
        values = np.asarray(value, float).ravel()
    low, high = float(values.min()), float(values.max())
    if parameter.kind == "alpha":
        low = max(low, SMALLEST * high)
    return (low, high) if high > low else (low, low)


def version(material: Any, places: dict[_Varying, float]) -> Any:
    """The material with uniform values: the given parameters at positions from 0 to 1, other varying ones at the middle
    of their ranges."""
    values: dict[str, Value] = {}
    for leaf in tree.leaves(material):
        ends = _ends(leaf.parameter, leaf.value)
        if ends is not None:
            values[leaf.path] = 0.5 * (ends[0] + ends[1])
    values |= {one.path: one.value(share) for one, share in places.items()}
    return tree.replace(material, values) if values else material


def varying_parameters(material: Any) -> list[_Varying]:
    """The varying parameters with the largest effect on the distribution of the light, at most two."""
    moved: list[tuple[float, _Varying]] = []
    for leaf in tree.leaves(material):
        ends = _ends(leaf.parameter, leaf.value)
        if ends is None or ends[0] == ends[1] or leaf.parameter.kind == "angle":
            continue
        one = _Varying(leaf.path, leaf.parameter.kind, *ends)
        low, high = (version(material, {one: share}) for share in (0.15, 1.0))
        share = _moved(low, high)
        if share > DIFFERENT:
            moved.append((share, one))
    moved.sort(key=lambda pair: -pair[0])
    return [one for _, one in moved[:2]]


def _moved(one: Guided, other: Guided) -> float:
    """The fraction of the light that two materials scatter in different directions."""
    weights = []
    chart = Chart("half", False, MIDDLING)
    for material in (one, other):
        light = Slices([material], 1, [1.0]).fine(chart, material, np.array([0.7]), 0.0, 1.0).light
        weights.append(light / max(float(light.sum()), MIN_LIGHT))
    return 0.5 * float(np.abs(weights[0] - weights[1]).sum())
