"""Interpolation in a table by the rule of `gonio.ops.table`, and texel access, in Dr.Jit or as symbols."""

from __future__ import annotations

from itertools import product

from . import graph
from .backend import Array, drjit, in_formula, is_drjit, types_like
from .table import Table, fetch_in_numpy, read_in_numpy
from .types import Scalar


def inset(x: Array, count: int) -> Array:
    """x scaled so that 0 and 1 fall on the first and last texel centers of an axis of `count` texels."""
    return x * ((count - 1) / count) + 0.5 / count


def lookup(table: Table, *coordinates: Scalar) -> tuple[Scalar, ...]:
    """Every channel of a table at a point, linear between texel centers (see `gonio.ops.table`)."""
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
    # one fetch reads four channels
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


def fetch(table: Table, *places: Scalar | float) -> tuple[Scalar, ...]:
    """Every channel of the texel at integer coordinates, one per axis; outside the table, the nearest texel is used.

    It is intended for grids whose axes are not simply [0, 1], such as periodic angles, unevenly spaced nodes and
    cumulative sums. Coordinates given as plain numbers, such as the index of a network's weight, are constants in a
    shader.
    """
    if not any(isinstance(x, graph.Node) for x in places):
        places = tuple(in_formula(x) if isinstance(x, float) else x for x in places)
    if any(isinstance(x, graph.Node) for x in places):
        symbols: list[Array] = [graph.emit("fetch", "float", *places, static=(table, c)) for c in range(table.channels)]
        return tuple(symbols)
    if not any(is_drjit(x) for x in places):
        values = fetch_in_numpy(table, *places)
        constants: list[Array] = [float(value) if value.ndim == 0 else value for value in values]
        return tuple(constants)
    dr = drjit()
    kind = types_like(type(next(x for x in places if is_drjit(x))))
    UInt = kind.module.UInt32
    index: Array = UInt(0)
    for x, count in zip(places, table.shape, strict=True):
        # clamped again as an integer: the conversion of NaN differs by processor and may lie far outside the table
        index = index * count + dr.minimum(UInt(dr.clip(kind.float(x), 0.0, count - 1.0)), count - 1)
    array = table.array(kind)
    width = 4 if table.channels % 4 == 0 else 1
    fetched = kind.vec4 if width == 4 else kind.float
    channels: list[Array] = []
    for first in range(0, table.channels, width):
        texel = dr.gather(fetched, array, index * (table.channels // width) + first // width)
        channels += list(texel) if width == 4 else [texel]
    return tuple(channels)
