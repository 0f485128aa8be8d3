"""Densities on the unit square, tabulated on a grid, with an exact sampling method and its exact inverse.

    warp = Warp("normals", values)                   # (slices, rows, columns), >= 0, nodes on the square's edges
    place, pdf = warp.sample(slices, u, v)
    place, pdf = warp.invert(slices, x, y)           # the numbers for which `sample` returns (x, y)

The density is bilinear between nodes. A slice is one density, with integral 1. A mixture of slices, such as those of
the two nearest viewing angles, is given as pairs (slice, weight), whose weights sum to 1. It is sampled with the mixed
cumulative sums, so `sample` and `invert` are exact inverses of each other (Dupuy2018, sec. 4.3).

First y is sampled from its marginal density, then x from the mixed row. Both densities are piecewise linear, and their
cumulative sums are quadratic; the root is computed in a form that is also valid for a constant density.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import ops
from ..ops import Scalar, Table, fetch, function, where

Slices = Sequence[tuple[Scalar, Scalar]]  # pairs (slice, weight)


class Place(NamedTuple):
    """A point of the unit square, and the density at this point."""

    x: Scalar
    y: Scalar
    pdf: Scalar


def named(stem: str, values: NDArray[np.float64]) -> Table:
    """A table with a unique name, because a shader may contain two measured materials."""
    values = np.ascontiguousarray(values, dtype=np.float64)
    return Table(f"{stem}_{hashlib.sha256(values.tobytes()).hexdigest()[:8]}", values)


class Warp:
    """Bilinear densities over the unit square, one per slice.

    values  (slices, rows, columns), not negative, with at least 2 x 2 nodes; a slice of zeros is treated as uniform
    """

    def __init__(self, stem: str, values: NDArray[np.floating]) -> None:
        values = np.maximum(np.asarray(values, dtype=np.float64), 0.0)
        count, self.rows, self.columns = values.shape
        black = values.reshape(count, -1).max(axis=1) <= 0.0
        values[black] = 1.0
        along_x = np.zeros_like(values)
        along_x[:, :, 1:] = np.cumsum(0.5 * (values[:, :, 1:] + values[:, :, :-1]), axis=2) / (self.columns - 1)
        of_rows = along_x[:, :, -1]
        along_y = np.zeros_like(of_rows)
        along_y[:, 1:] = np.cumsum(0.5 * (of_rows[:, 1:] + of_rows[:, :-1]), axis=1) / (self.rows - 1)
        total = along_y[:, -1]
        self.density = named(f"{stem}_density", np.stack([values, along_x], -1) / total[:, None, None, None])
        self.marginal = named(f"{stem}_marginal", along_y[..., None] / total[:, None, None])

    # ------------------------------------------------------------------ reading

    @function
    def _mixed(self, slices: Slices, row: Scalar, column: Scalar) -> tuple[Scalar, Scalar]:
        """The density at a node, and its integral along x up to this node."""
        density: ops.Value = 0.0
        below: ops.Value = 0.0
        for one, weight in slices:
            d, b = fetch(self.density, one, row, column)
            density, below = density + weight * d, below + weight * b
        return density, below

    @function
    def _marginal(self, slices: Slices, row: Scalar) -> Scalar:
        below: ops.Value = 0.0
        for one, weight in slices:
            below = below + weight * fetch(self.marginal, one, row)[0]
        return below

    @function
    def pdf(self, slices: Slices, x: Scalar, y: Scalar) -> Scalar:
        """The density at a point; outside the square, the density at the nearest point of its edge."""
        row, ty = _cell(y, self.rows)
        column, tx = _cell(x, self.columns)
        near, far = (
            _mix(self._mixed(slices, row, column + step)[0], self._mixed(slices, row + 1.0, column + step)[0], ty)
            for step in (0.0, 1.0)
        )
        return _mix(near, far, tx)

    # ------------------------------------------------------------------ warping

    @function
    def sample(self, slices: Slices, u: Scalar, v: Scalar) -> Place:
        """The point for two uniform random numbers, and its density."""
        row = search(lambda at: self._marginal(slices, at), self.rows, v)
        r0 = self._mixed(slices, row, self._last(row))[1]
        r1 = self._mixed(slices, row + 1.0, self._last(row))[1]
        y = _root((v - self._marginal(slices, row)) * (self.rows - 1.0), r0, r1)

        def below(at: Scalar) -> Scalar:
            return _mix(self._mixed(slices, row, at)[1], self._mixed(slices, row + 1.0, at)[1], y)

        wanted = u * _mix(r0, r1, y)
        column = search(below, self.columns, wanted)
        c0, c1 = (
            _mix(self._mixed(slices, row, column + step)[0], self._mixed(slices, row + 1.0, column + step)[0], y)
            for step in (0.0, 1.0)
        )
        x = _root((wanted - below(column)) * (self.columns - 1.0), c0, c1)
        return Place((column + x) / (self.columns - 1.0), (row + y) / (self.rows - 1.0), _mix(c0, c1, x))

    @function
    def invert(self, slices: Slices, x: Scalar, y: Scalar) -> Place:
        """The two numbers for which `sample` returns this point, and the density at the point."""
        row, ty = _cell(y, self.rows)
        column, tx = _cell(x, self.columns)
        (d00, b0), (d10, b1) = (self._mixed(slices, row + step, column) for step in (0.0, 1.0))
        d01, d11 = (self._mixed(slices, row + step, column + 1.0)[0] for step in (0.0, 1.0))
        c0, c1 = _mix(d00, d10, ty), _mix(d01, d11, ty)
        r0, r1 = (self._mixed(slices, row + step, self._last(row))[1] for step in (0.0, 1.0))
        below = _mix(b0, b1, ty) + tx * (c0 + 0.5 * tx * (c1 - c0)) * (1.0 / (self.columns - 1.0))
        v = self._marginal(slices, row) + ty * (r0 + 0.5 * ty * (r1 - r0)) * (1.0 / (self.rows - 1.0))
        return Place(ops.safe_div(below, _mix(r0, r1, ty)), v, _mix(c0, c1, tx))

    def _last(self, like: Scalar) -> Scalar:
        return like * 0.0 + (self.columns - 1.0)


def search(below: Callable[[Scalar], Scalar], count: int, wanted: Scalar) -> Scalar:
    """Find by bisection the last of the nodes 0 .. count - 2 at which a monotonically increasing sum is <= `wanted`."""
    index = wanted * 0.0
    step = 1 << max((count - 2).bit_length() - 1, 0)
    while step and count > 2:
        at = index + float(step)
        index = where((at <= count - 2.0) & (below(ops.minimum(at, count - 2.0)) <= wanted), at, index)
        step >>= 1
    return index


@function
def _root(rest: Scalar, low: Scalar, high: Scalar) -> Scalar:
    """The root t in [0, 1] of t low + t^2 (high - low) / 2 = rest."""
    root = ops.safe_sqrt(low * low + 2.0 * rest * (high - low))
    return ops.clamp(ops.safe_div(2.0 * rest, low + root), 0.0, 1.0)


def _cell(x: Scalar, count: int) -> tuple[Scalar, Scalar]:
    """The node before a coordinate in [0, 1], and the fraction of the distance to the next node."""
    at = ops.clamp(x, 0.0, 1.0) * (count - 1.0)
    cell = ops.minimum(ops.floor(at), count - 2.0)
    return cell, at - cell


@function
def _mix(low: Scalar, high: Scalar, t: Scalar) -> Scalar:
    """low (1 - t) + high t."""
    return low * (1.0 - t) + high * t


class Nodes:
    """An axis with unevenly spaced nodes: at least two, or a single node for all coordinates."""

    def __init__(self, stem: str, nodes: NDArray[np.floating]) -> None:
        self.count = len(nodes)
        self.table = named(stem, np.asarray(nodes, np.float64)[:, None])

    def at(self, node: Scalar) -> Scalar:
        """The coordinate of a node."""
        return fetch(self.table, node)[0]

    def find(self, x: Scalar) -> tuple[Scalar, Scalar]:
        """The node before a coordinate, and the fraction of the distance to the next node, clamped to [0, 1]."""
        if self.count == 1:
            return x * 0.0, x * 0.0
        cell = search(self.at, self.count, x)
        low, high = self.at(cell), self.at(cell + 1.0)
        return cell, ops.clamp((x - low) / (high - low), 0.0, 1.0)
