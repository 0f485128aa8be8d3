"""Cells of the sphere that follow a BSDF's samples, for the chi-square test.

A lobe of width 0.005 covers a hundred-thousandth of the sphere: fixed cells would either contain the whole lobe in one
cell, or number millions. A small first set of samples (the pilot) therefore determines the edges of 100 rows per side
of the surface and of 200 columns per row. The edges lie at quantiles of the pilot, at equal steps, and, for the tails,
at increasing distances from its median. The coordinates are 1 - |z|, in which equal steps have equal areas, and a
pseudo-angle of (x, y). They need no transcendental function and are computed without cancellation near the pole.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from ..ops import backend
from ..ops.backend import Array, Types
from . import directions
from .subject import Subject

CELLS = (100, 200)  # rows and columns per side of the surface
PILOT = 1 << 15  # samples for CELLS; fewer cells need fewer
FINEST = 3e-5  # smallest spread of the azimuth that is tested: 120 times the spacing of float32 directions

Density: TypeAlias = Callable[[np.ndarray, np.ndarray], np.ndarray]  # maps rows (wo, wi), (N, 3) each, to (N,)


class Grid(NamedTuple):
    """The cells for several directions wo.

    wo       directions, (N, 3)
    sides    the sides of the surface that have cells: 1 above, -1 below
    rows     edges of 1 - |z|, (N, sides, rows + 1), float32
    columns  edges of the pseudo-angle, (N, sides, rows, columns + 1), float32
    pilot    the samples from which the cells were placed, (n, 3) for each wo
    """

    wo: np.ndarray
    sides: tuple[int, ...]
    rows: np.ndarray
    columns: np.ndarray
    pilot: list[np.ndarray]

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """(N, sides, rows, columns)."""
        n, sides, rows, edges = self.columns.shape
        return n, sides, rows, edges - 1


def place(subject: Subject, wo: np.ndarray, seed: int, cells: tuple[int, int] = CELLS) -> Grid | None:
    """Place cells according to a subject's samples for each wo, (N, 3). Returns None if no sample has a density.

    seed   seed of the samples
    cells  numbers of rows and columns per side of the surface
    """
    rng = np.random.default_rng([seed, 11])
    pilot = max(1 << 12, PILOT * cells[0] * cells[1] // (CELLS[0] * CELLS[1]))
    many = np.repeat(wo, pilot, axis=0)
    drawn = subject.sample(many, directions.numbers(rng, len(many)), precision="float32")
    good = (drawn.pdf > 0.0) & ~drawn.delta & np.all(np.isfinite(drawn.wi), axis=1)
    if not good.any():
        return None
    rows = zip(drawn.wi.reshape(len(wo), pilot, 3), good.reshape(len(wo), pilot), strict=True)
    return place_around([wi[valid] for wi, valid in rows], wo, lambda o, i: subject.pdf(o, i, "float32"), cells)


def place_around(pilot: Sequence[np.ndarray], wo: np.ndarray, pdf: Density, cells: tuple[int, int] = CELLS) -> Grid:
    """Place cells according to given samples, on the sides of the surface with samples or with a positive pdf.

    pilot  samples (n, 3) for each wo
    pdf    function (wo, wi) that returns the density
    cells  numbers of rows and columns per side
    A wo is omitted if its samples are so close together that the rounding of float32 directions matters.
    """
    sides = tuple(s for s in (1, -1) if any(np.any(s * wi[:, 2] > 0.0) for wi in pilot) or _claims(pdf, wo, s))
    resolved = [i for i, wi in enumerate(pilot) if _spread(wi) > FINEST]
    pilot, wo = [pilot[i] for i in resolved], wo[resolved]
    many_rows, many_columns = cells
    rows = np.empty((len(wo), len(sides), many_rows + 1), np.float32)
    columns = np.empty((len(wo), len(sides), many_rows, many_columns + 1), np.float32)
    for i, wi in enumerate(pilot):
        for j, side in enumerate(sides):
            mine = wi[side * wi[:, 2] > 0.0]
            heights, turns = height(mine), pseudo_angle(mine)
            order = np.argsort(heights)
            heights, turns = heights[order], turns[order]
            rows[i, j] = _edges([heights], 0.0, 1.0, many_rows)[0]
            first, last = np.searchsorted(heights, [rows[i, j][:-1], rows[i, j][1:]])
            more = np.maximum(300 - (last - first), 0) // 2  # a row with few samples also uses those of its neighbors
            parts = zip(np.maximum(first - more, 0), last + more, strict=True)
            columns[i, j] = _edges([turns[slice(*part)] for part in parts], 0.0, 4.0, many_columns)
    return Grid(wo, sides, rows, columns, pilot)


def _spread(wi: np.ndarray) -> float:
    """Interquartile range of the pseudo-angles of directions; infinite for fewer than 20."""
    if len(wi) < 20:
        return float("inf")
    first, last = np.percentile(pseudo_angle(wi), [25.0, 75.0])
    return float(last - first)


def _claims(pdf: Density, wo: np.ndarray, side: int) -> bool:
    """Whether the pdf is positive on a side of the surface, at any of 256 random wi per wo."""
    rng = np.random.default_rng(3)
    wi = directions.on_side(directions.uniform(rng, 256 * len(wo)), side)
    return bool(np.any(pdf(np.repeat(wo, 256, axis=0), wi) > 0.0))


def height(w: np.ndarray) -> np.ndarray:
    """1 - |z| of directions (N, 3), computed from x and y to avoid cancellation near the pole."""
    return (w[:, 0] ** 2 + w[:, 1] ** 2) / (1.0 + np.abs(w[:, 2]))


def pseudo_angle(w: np.ndarray) -> np.ndarray:
    """The pseudo-angle in [0, 4], which increases with the azimuth and is y / (|x| + |y|) in the first quadrant."""
    reach = np.abs(w[:, 0]) + np.abs(w[:, 1])
    t = w[:, 1] / np.where(reach > 0, reach, 1.0)
    return np.where(w[:, 0] < 0, 2.0 - t, np.where(w[:, 1] < 0, 4.0 + t, t))


def azimuth(turn: np.ndarray) -> np.ndarray:
    """The azimuth in [0, 2 pi] of a pseudo-angle in [0, 4]."""
    quarter = np.minimum(np.floor(turn), 3.0)
    t = turn - quarter
    return 0.5 * np.pi * quarter + np.arctan2(t, 1.0 - t)


def _edges(groups: Sequence[np.ndarray], low: float, high: float, count: int) -> np.ndarray:
    """count + 1 edges on [low, high] for the values of each group, (groups, count + 1): half of them at quantiles, a
    quarter evenly spaced, and a quarter at increasing distances."""
    inside = [np.sort(values[(values > low) & (values < high)]) for values in groups]
    sizes = np.array([len(values) for values in inside])
    even, far = count // 4 - 2, count // 4
    many = count - 1 - even - far
    quantiles = np.arange(many) * np.maximum(sizes - 1, 0)[:, None] // (many - 1)
    # a group without values reads those of another; its edges are replaced below
    place = (np.cumsum(sizes) - sizes)[:, None] + quantiles
    own = np.append(np.concatenate(inside), low)[place]
    first, middle, last = own[:, many // 4], own[:, many // 2], own[:, 3 * many // 4]
    edges = np.full((len(groups), count + 1), high)
    edges[:, :many] = own
    # a density that ends in a step has that step just beyond the outermost samples
    edges[:, many] = own[:, -1] + (own[:, -1] - own[:, -2])
    edges[:, many + 1] = own[:, 0] - (own[:, 1] - own[:, 0])
    edges[:, many + 2 : many + 2 + even] = low + (high - low) / (even + 1) * np.arange(1, even + 1)
    tail = many + 2 + even
    for sign, reach in ((1, last - middle), (-1, middle - first)):
        edges[:, tail : tail + far // 2] = middle[:, None] + sign * _growing(reach, high - low, far // 2)
        tail += far // 2
    # clipped tails leave several equal edges at an end: cells of zero width, with no samples and none expected
    edges = np.sort(edges.clip(low, high), axis=1)
    edges[:, 0], edges[:, -1] = low, high
    edges[sizes == 0] = np.linspace(low, high, count + 1)
    return edges.astype(np.float32)


def _growing(first: np.ndarray, last: float, count: int) -> np.ndarray:
    """Distances in geometric progression, (groups, count), up to a ratio of at least 1e4, because the tail of a lobe
    of width 1e-4 extends to a million times its height."""
    first = np.maximum(first, 1e-10)[:, None]
    return np.asarray(first * np.maximum(last / first, 1e4) ** (np.arange(count) / max(count - 1, 1)))


def boxes(rows: np.ndarray, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The bounds (a, b, c, d), (..., rows, columns) each, of the cells [a, b] x [c, d] in (1 - |z|, azimuth).

    rows     edges of 1 - |z|, (..., rows + 1)
    columns  edges of the pseudo-angle, (..., rows, columns + 1)
    """
    turn = azimuth(columns.astype(float))
    c, d = turn[..., :-1], turn[..., 1:]
    heights = rows.astype(float)[..., None]
    a, b = (np.broadcast_to(edge, c.shape) for edge in (heights[..., :-1, :], heights[..., 1:, :]))
    return a, b, c, d


def direction(height: np.ndarray, azimuth: np.ndarray, side: np.ndarray | float) -> np.ndarray:
    """Unit vectors (..., 3) with the given height 1 - |z| and azimuth, on a side of the surface."""
    r = np.sqrt(height * (2.0 - height))
    return np.stack([r * np.cos(azimuth), r * np.sin(azimuth), (1.0 - height) * side], -1)


def cell_of(grid: Grid, which: Array, wi: Array) -> tuple[Array, Array]:
    """The index of each direction's cell, and whether the direction is on a side that has cells."""
    dr = backend.drjit()
    kind = backend.types("float32")
    UInt = kind.module.UInt32
    _, sides, rows, columns = grid.shape
    reach = dr.abs(wi.x) + dr.abs(wi.y)
    turn = wi.y / dr.select(reach > 0.0, reach, 1.0)
    turn = dr.select(wi.x < 0.0, 2.0 - turn, dr.select(wi.y < 0.0, 4.0 + turn, turn))
    height = (wi.x * wi.x + wi.y * wi.y) / (1.0 + dr.abs(wi.z))
    above = wi.z > 0.0
    if sides == 2:
        group = which * 2 + dr.select(above, UInt(0), UInt(1))
        inside = wi.z != 0.0
    else:
        group = which
        inside = above if grid.sides[0] > 0 else wi.z < 0.0
    row_edges, column_edges = (kind.float(np.ascontiguousarray(e.ravel())) for e in (grid.rows, grid.columns))
    row = _find(kind, row_edges, group * (rows + 1), rows, height)
    line = group * rows + row
    column = _find(kind, column_edges, line * (columns + 1), columns, turn)
    return line * columns + column, inside


def _find(kind: Types, edges: Array, start: Array, cells: int, value: Array) -> Array:
    """The index of the cell that contains a value: the last one whose lower edge is not above it."""
    dr = backend.drjit()
    return dr.binary_search(0, cells - 1, lambda i: dr.gather(kind.float, edges, start + i + 1) <= value)
