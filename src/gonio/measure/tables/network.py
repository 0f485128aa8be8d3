"""Small neural networks in place of tables (Sztrajman2021)."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ... import ops
from ...errors import InputError
from ...ops import Direction, Scalar, Spectrum, maximum, vec3, where
from ..angles import half_difference_vectors
from ..warp import named
from .base import Measurement, finite
from .guided import Guided

SHAPES = {"kernel0": (6, 21), "bias0": (21,), "kernel1": (21, 21), "bias1": (21,), "kernel2": (21, 3), "bias2": (3,)}


class Network(Guided, Measurement):
    """A neural network: f = exp(network(half vector, difference vector)) - 1.

    The network has 6 inputs, two hidden layers of 21 units with ReLU activation, and 3 outputs: 675 weights in total.
    The half vector is rotated into the x-z plane. The difference vector is wi in the frame of the half vector, mirrored
    to y >= 0, so f is reciprocal. Negative values of f are replaced by 0. Renders and shaders evaluate the network
    itself, not a table.
    """

    name = "network"
    reciprocal = True
    axes: ClassVar[Mapping[str, str]] = {
        "kernel0, bias0": "from (hx, hy, hz, dx, dy, dz) to 21 units",
        "kernel1, bias1": "to 21 units",
        "kernel2, bias2": "to log(1 + f) in red, green and blue",
    }

    def __init__(
        self,
        weights: Mapping[str, NDArray[np.generic]],
        where: str = "",
        title: str = "",
        source: Mapping[str, str] | None = None,
        wavelengths: NDArray[np.float64] | None = None,
    ) -> None:
        """A network with given weights.

        weights  float32 arrays, by the names in `SHAPES`
        where    name of the file in errors
        """
        super().__init__(title, source)
        self.weights: dict[str, NDArray[np.float32]] = {}
        for part, shape in SHAPES.items():
            array = weights.get(part)
            if array is None or array.shape != shape or array.dtype.kind != "f":
                given = "is missing" if array is None else f"has shape {array.shape} of {array.dtype}"
                raise InputError(f"{part} {given}, {shape} of floats expected", where)
            self.weights[part] = finite(array, part, where).astype(np.float32)

    # ------------------------------------------------------------------ as formulas

    @cached_property
    def _table(self) -> ops.Table:
        """All weights as one array: the bias and the kernel of each unit, layer by layer."""
        rows = [
            np.concatenate([self.weights[f"bias{layer}"][None], self.weights[f"kernel{layer}"]]).T.ravel()
            for layer in range(3)
        ]
        return named("network", np.concatenate(rows)[:, None].astype(np.float64))

    @ops.function
    def value(self, wo: Direction, wi: Direction) -> Spectrum:
        """max(0, exp(network) - 1) cos theta_i."""
        h, d = half_difference_vectors(wo, wi)
        flip = where(d.y < 0.0, -1.0, 1.0)
        units: list[Scalar] = [h.x, h.y, h.z, d.x * flip, d.y * flip, d.z]
        place = 0
        for layer, (_, count) in enumerate(SHAPES[f"kernel{layer}"] for layer in range(3)):
            following = []
            for _ in range(count):
                (total,) = ops.fetch(self._table, float(place))
                for step, unit in enumerate(units, 1):
                    total = ops.fma(unit, ops.fetch(self._table, float(place + step))[0], total)
                place += 1 + len(units)
                following.append(maximum(total, 0.0) if layer < 2 else total)
            units = following
        r, g, b = (maximum(ops.exp(unit) - 1.0, 0.0) for unit in units)
        colour: ops.Value = vec3(r, g, b)
        return colour * wi.z

    # ------------------------------------------------------------------ as numbers

    def arrays(self) -> dict[str, NDArray[np.generic]]:
        return dict(self.weights)

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[np.generic]], **about: ops.Value) -> Network:
        return cls(arrays, **about)

    @property
    def shape(self) -> dict[str, int]:
        return {"weight": sum(array.size for array in self.weights.values())}

    @property
    def range(self) -> tuple[float, float]:
        return min(float(a.min()) for a in self.weights.values()), max(float(a.max()) for a in self.weights.values())
