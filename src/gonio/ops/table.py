"""Tables, and the one interpolation rule for all of them.

    table = Table("E", values)              # float64, shape (rows, columns, channels)
    e, = lookup(table, roughness, mu)

Coordinates lie in [0, 1]; texel j of an axis of n has its center at (j + 1/2) / n. Values are linear in each coordinate
between centers and constant beyond the first and last. This is the rule of a GPU texture with clamped edges, so bakes,
Dr.Jit and shaders agree. To put nodes on the two ends of an axis, use `inset`.
"""

from __future__ import annotations

import re
from functools import reduce
from itertools import product

import numpy as np

from .backend import Array, Types, drjit


class Table:
    """Numbers on a grid of one to three axes, channels last; compared by identity.

    name    its name in shader code and manifests; characters that identifiers do not allow become _
    values  shape (axis, ..., channels), float64
    """

    def __init__(self, name: str, values: np.ndarray) -> None:
        self.name = re.sub(r"\W", "_", name)
        self.values = np.array(values, dtype=np.float64, order="C")
        self.values.setflags(write=False)
        self._arrays: dict[type, Array] = {}

    @property
    def shape(self) -> tuple[int, ...]:
        """Texels along each axis."""
        return self.values.shape[:-1]

    @property
    def channels(self) -> int:
        return self.values.shape[-1]

    def __repr__(self) -> str:
        return f"Table({self.name!r}, {' x '.join(map(str, self.shape))}, {self.channels} channels)"

    def array(self, kind: Types) -> Array:
        """The values as an evaluated Dr.Jit array, cached per type, so that new contents require no compilation."""
        if kind.float not in self._arrays:
            array = kind.float(self.values.ravel())
            drjit().make_opaque(array)
            self._arrays[kind.float] = array
        return self._arrays[kind.float]


def read_in_numpy(table: Table, *coordinates: object) -> np.ndarray:
    """Every channel at a point, channels first: the interpolation rule in NumPy float64."""
    points = np.broadcast_arrays(*[np.asarray(x, dtype=float) for x in coordinates])
    cells, places = [], []
    for x, count in zip(points, table.shape, strict=True):
        at = np.clip(x * count - 0.5, 0.0, count - 1.0)
        cell = np.minimum(np.nan_to_num(at).astype(int), max(count - 2, 0))  # NaN stays in `at`: the value is NaN
        cells.append(cell)
        places.append(at - cell)
    total = np.zeros((*points[0].shape, table.channels))
    for corner in product((0, 1), repeat=len(cells)):
        index = tuple(
            np.minimum(cell + step, count - 1) for cell, step, count in zip(cells, corner, table.shape, strict=True)
        )
        weight = reduce(
            np.multiply, [place if step else 1.0 - place for place, step in zip(places, corner, strict=True)]
        )
        total += weight[..., None] * table.values[index]
    return np.moveaxis(total, -1, 0)


def fetch_in_numpy(table: Table, *places: object) -> np.ndarray:
    """Every channel, channels first, of the texels at integer coordinates: `ops.fetch` in NumPy float64."""
    points = np.broadcast_arrays(*[np.asarray(x, dtype=float) for x in places])
    index = tuple(np.nan_to_num(np.clip(x, 0, n - 1)).astype(int) for x, n in zip(points, table.shape, strict=True))
    return np.moveaxis(table.values[index], -1, 0)
