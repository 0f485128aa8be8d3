"""The rule by which tables are read, in NumPy: for the graph's own evaluation and as the oracle of the others."""

from __future__ import annotations

from functools import reduce
from itertools import product
from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class Grid(Protocol):
    """What a table is to its reader; see `gonio.ops.table`."""

    values: NDArray[np.float64]

    @property
    def shape(self) -> tuple[int, ...]: ...

    @property
    def channels(self) -> int: ...


def read_in_numpy(table: Grid, *coordinates: object) -> NDArray[np.float64]:
    """Every channel, channels first: the rule in NumPy float64."""
    points = np.broadcast_arrays(*[np.asarray(x, dtype=float) for x in coordinates])
    cells, places = [], []
    for x, count in zip(points, table.shape, strict=True):
        at = np.clip(x * count - 0.5, 0.0, count - 1.0)
        cell = np.minimum(at.astype(int), max(count - 2, 0))
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
