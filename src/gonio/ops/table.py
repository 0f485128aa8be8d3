"""Tables, and the one rule by which everybody reads them.

    table = Table("E", values)              # float64, shape (rows, columns, channels)
    e, = lookup(table, roughness, mu)

Coordinates run over [0, 1]; texel j of an axis of n stands at (j + 1/2) / n; between texels values are linear in each
coordinate, outside the first and last centre they are held. This is a GPU's texture with clamped edges, so baker,
Dr.Jit and shader agree. To put nodes on both ends of an axis, use `inset`.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from . import graph
from .backend import Array, Types, drjit, is_drjit, types_like
from .interpolation import read_in_numpy
from .types import Scalar


class Table:
    """Numbers on a grid of one to three axes, with channels last; compared by identity, never changed.

    name    what it holds, as shader code and manifests call it
    values  shape (axis, ..., channels), float64
    """

    def __init__(self, name: str, values: np.ndarray) -> None:
        self.name = name
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
        """The values as an evaluated Dr.Jit array, made once a type: new contents compile no kernel."""
        if kind.float not in self._arrays:
            array = kind.float(self.values.ravel())
            drjit().make_opaque(array)
            self._arrays[kind.float] = array
        return self._arrays[kind.float]


def inset(x: Array, count: int) -> Array:
    """The coordinate at which an axis of `count` texels has its first node at x = 0 and its last at x = 1."""
    return x * ((count - 1) / count) + 0.5 / count


def lookup(table: Table, *coordinates: Scalar) -> tuple[Scalar, ...]:
    """Every channel of a table at a point, linear between texel centres (see the module)."""
    if any(isinstance(x, graph.Node) for x in coordinates):
        symbols: list[Array] = [
            graph.emit("lookup", "float", *coordinates, static=(table, c)) for c in range(table.channels)
        ]
        return tuple(symbols)
    if not any(is_drjit(x) for x in coordinates):
        values = read_in_numpy(table, *coordinates)
        return tuple(values[c] for c in range(table.channels))
    dr = drjit()
    kind = types_like(type(next(x for x in coordinates if is_drjit(x))))
    UInt = kind.module.UInt32
    array = table.array(kind)
    cells, places = [], []
    for x, count in zip(coordinates, table.shape, strict=True):
        at = dr.clip(kind.float(x) * float(count) - 0.5, 0.0, count - 1.0)
        cell = dr.minimum(UInt(at), max(count - 2, 0))
        cells.append(cell)
        places.append(at - kind.float(cell))
    # four channels come in one fetch
    width = 4 if table.channels % 4 == 0 else 1
    fetched = kind.vec4 if width == 4 else kind.float
    result: list[Array] = [0.0] * table.channels
    for corner in product((0, 1), repeat=len(cells)):
        weight: Array = 1.0
        index: Array = UInt(0)
        for cell, place, step, count in zip(cells, places, corner, table.shape, strict=True):
            index = index * count + (cell + min(step, count - 1))
            weight = weight * (place if step else 1.0 - place)
        for first in range(0, table.channels, width):
            texel = dr.gather(fetched, array, index * (table.channels // width) + first // width)
            for c in range(width):
                result[first + c] = result[first + c] + weight * (texel[c] if width == 4 else texel)
    return tuple(result)
