"""Textures as tables, read by `ops.lookup` and `ops.fetch` with the filter and the wrap mode of a sampler."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import ops
from ..ops.table import fetch_in_numpy
from .arithmetic import floor, multiply
from .standard import fract
from .values import Undefined, Value, leaves, lost, numeric, refuse, static, where

WRAPS = ("clamp", "repeat")
FILTERS = ("linear", "nearest")


@dataclass(frozen=True)
class Texture:
    """A texture: its table, (rows, columns, channels), with row 0 at v = 0; None if no file was given.

    wrap        "clamp" to the edge, or "repeat"
    filter      "linear" between texel centers, or "nearest"
    dimensions  number of coordinates in the shader's declaration, 0 if unknown
    declared    a description of the declared kind if it is not supported, else ""
    """

    name: str
    table: ops.Table | None
    wrap: str = "clamp"
    filter: str = "linear"
    dimensions: int = 0
    declared: str = ""

    def texels(self) -> ops.Table:
        """The table. Raises InputError if there is none, or if the declared kind is not supported or is different."""
        if self.declared:
            raise refuse(f"'{self.name}' is {self.declared}", "tables are textures of one, two or three dimensions")
        if self.table is not None and self.dimensions not in (0, len(self.table.shape)):
            what = f"the texture '{self.name}' has {self.dimensions} dimensions, its table has {len(self.table.shape)}"
            raise refuse(what, "give an .npy file with one axis per dimension and one for the channels")
        if self.table is None:
            raise refuse(f"the texture '{self.name}' has no file", f"[textures] {self.name} = 'FILE' in the adapter")
        return self.table


def sampled(name: str, values: list[Value]) -> Value:
    """The result of an instruction on textures."""
    texture = values[0]
    if isinstance(texture, Undefined):
        raise texture.error()
    if not isinstance(texture, Texture):
        raise TypeError("no texture")
    if name in ("SampledImage", "Image"):
        return texture
    table = texture.texels()
    if name == "ImageQuerySize":
        return tuple(reversed(table.shape))
    if (undefined := lost(leaves(values[1]))) is not None:
        return (undefined,) * 4
    places = [numeric(leaf) for leaf in leaves(values[1])][: len(table.shape)]
    if len(places) != len(table.shape):
        raise refuse(f"{len(places)} coordinates of the texture '{texture.name}' of shape {table.shape}")
    places = places[::-1]  # u runs along a row, the last axis
    places = _varying(places)
    if name == "ImageFetch":
        return _four(_fetched(table, places))
    if texture.filter == "nearest":
        at = [_wrapped(x, texture.wrap) for x in places]
        return _four(_fetched(table, [floor(multiply(x, float(n))) for x, n in zip(at, table.shape, strict=True)]))
    if texture.wrap == "clamp":
        return _four(ops.lookup(table, *places))
    padded = _padded(table)
    inner = [(fract(x) * float(n) + 1.0) / float(n + 2) for x, n in zip(places, table.shape, strict=True)]
    return _four(ops.lookup(padded, *inner))


def _fetched(table: ops.Table, places: list[Value]) -> tuple[Value, ...]:
    """The channels of a texel; plain numbers if its coordinates are plain numbers."""
    if all(map(static, places)):
        return tuple(float(channel) for channel in fetch_in_numpy(table, *places))
    return ops.fetch(table, *places)


def _varying(places: list[Value]) -> list[Value]:
    """The coordinates; if one of them is not a plain number, none is."""
    known = next((x for x in places if not static(x)), None)
    if known is None:
        return [where(True, x, x) if not static(x) else x for x in places]
    return [x + 0.0 * known if static(x) else x for x in places]


def _wrapped(x: Value, wrap: str) -> Value:
    return fract(x) if wrap == "repeat" else x


def _four(channels: tuple[Value, ...]) -> Value:
    """Red, green, blue and alpha; missing channels have the values that a sampler returns."""
    parts = [float(c) if isinstance(c, np.ndarray) and c.ndim == 0 else c for c in channels]
    return (*parts[:4], *(0.0, 0.0, 0.0, 1.0)[len(parts) :])


_padded_tables: dict[int, tuple[ops.Table, ops.Table]] = {}


def _padded(table: ops.Table) -> ops.Table:
    """The table, surrounded by copies of its opposite edges, for the wrap mode "repeat"."""
    if id(table) not in _padded_tables:
        axes = [(1, 1)] * len(table.shape) + [(0, 0)]
        _padded_tables[id(table)] = table, ops.Table(f"{table.name}_repeated", np.pad(table.values, axes, "wrap"))
    return _padded_tables[id(table)][1]
