"""Pearson's chi-square test of a model's samples against its pdf, in cells that follow the samples.

A lobe of width .005 fills a hundred-thousandth of the sphere: fixed cells would hold it in one, or number millions. So
a first, small draw (the pilot) places the edges, and a second, independent one is counted: 100 rows a side of the
surface and 200 columns a row, at quantiles of the pilot, at equal steps, and at growing distances from its middle for
the tails. The coordinates are (1 - |z|, a pseudo-angle of (x, y)): equal areas, no transcendental function, and no
cancellation near the pole. Sampling, binning and counting are one kernel, in which nothing is stored but the counts.

What fails, is a delta sample, or lands where no cell is, is counted too: its expectation is 1 - int pdf.

    grid = place(subject, wo, seed)
    outcome = compare(expect(subject.pdf, grid, tolerance), count(subject, grid, log_samples, seed), row)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from ..ops import backend
from ..ops.backend import Array, Types
from ..render.sampler import mix, unit
from . import directions, statistics
from .subject import Subject, guarded

CELLS = (100, 200)  # rows and columns a side of the surface
COARSE = (10, 10)  # rows and columns that are joined for the coarse test, which sees small errors of broad lobes
PILOT = 1 << 15  # samples for CELLS; fewer cells need fewer
LEAST = 10.0  # expectation of a pooled cell: Pearson's statistic then follows its limit well within the noise

Density: TypeAlias = Callable[[np.ndarray, np.ndarray], np.ndarray]  # of rows (wo, wi), (N, 3) each: (N,)

_NODES = {n: np.polynomial.legendre.leggauss(n) for n in (2, 3, 4)}


class Grid(NamedTuple):
    """Cells of several wo.

    wo     (N, 3)
    sides  which sides of the surface have cells
    rows   edges of 1 - |z|, (N, sides, rows + 1), float32
    columns  edges of the pseudo-angle, (N, sides, rows, columns + 1), float32
    """

    wo: np.ndarray
    sides: tuple[int, ...]
    rows: np.ndarray
    columns: np.ndarray

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """(N, sides, rows, columns)."""
        n, sides, rows, edges = self.columns.shape
        return n, sides, rows, edges - 1


class Expectation(NamedTuple):
    """Probability of each cell (N, sides, rows, columns), and the integral of the pdf over all (N,)."""

    cells: np.ndarray
    total: np.ndarray


class Counts(NamedTuple):
    """Samples in each cell (N, sides, rows, columns), all others (N,), and how many were drawn for each wo."""

    cells: np.ndarray
    others: np.ndarray
    drawn: int


class Outcome(NamedTuple):
    """p-values of one wo: of all cells, of coarse ones, and of the number of samples that are in none."""

    fine: float
    coarse: float
    others: float


# --------------------------------------------------------------------------- the cells


def place(subject: Subject, wo: np.ndarray, seed: int, cells: tuple[int, int] = CELLS) -> Grid | None:
    """Cells where the pilot's samples are; None where there is no sample with a density."""
    rng = np.random.default_rng([seed, 11])
    pilot = max(1 << 12, PILOT * cells[0] * cells[1] // (CELLS[0] * CELLS[1]))
    many = np.repeat(wo, pilot, axis=0)
    drawn = subject.sample(many, directions.numbers(rng, len(many)), precision="float32")
    good = (drawn.pdf > 0.0) & ~drawn.delta & np.all(np.isfinite(drawn.wi), axis=1)
    if not good.any():
        return None
    rows = zip(drawn.wi.reshape(len(wo), pilot, 3), good.reshape(len(wo), pilot), strict=True)
    return place_around([wi[kept] for wi, kept in rows], wo, lambda o, i: subject.pdf(o, i, "float32"), cells)


def place_around(
    pilot: Sequence[np.ndarray], wo: np.ndarray, pdf: Density, cells: tuple[int, int] = CELLS
) -> Grid:
    """Cells around some samples (n, 3) of each wo, on the sides where there are any, or where the pdf claims some."""
    sides = tuple(s for s in (1, -1) if any(np.any(s * wi[:, 2] > 0.0) for wi in pilot) or _claims(pdf, wo, s))
    many_rows, many_columns = cells
    rows = np.empty((len(wo), len(sides), many_rows + 1), np.float32)
    columns = np.empty((len(wo), len(sides), many_rows, many_columns + 1), np.float32)
    for i, wi in enumerate(pilot):
        for j, side in enumerate(sides):
            mine = wi[side * wi[:, 2] > 0.0]
            height, turn = _height(mine), _turn(mine)
            order = np.argsort(height)
            height, turn = height[order], turn[order]
            rows[i, j] = _edges(height, 0.0, 1.0, many_rows)
            for r, (a, b) in enumerate(zip(rows[i, j][:-1], rows[i, j][1:], strict=True)):
                first, last = np.searchsorted(height, [a, b])
                more = max(300 - (last - first), 0) // 2  # neighbours say where a row with few samples has its own
                columns[i, j, r] = _edges(turn[max(first - more, 0) : last + more], 0.0, 4.0, many_columns)
    return Grid(wo, sides, rows, columns)


def _claims(pdf: Density, wo: np.ndarray, side: int) -> bool:
    """Whether the pdf claims anything on that side."""
    rng = np.random.default_rng(3)
    wi = directions.on_side(directions.uniform(rng, 256 * len(wo)), side)
    return bool(np.any(pdf(np.repeat(wo, 256, axis=0), wi) > 0.0))


def _height(w: np.ndarray) -> np.ndarray:
    """1 - |z|, from x and y: nothing cancels near the pole."""
    return (w[:, 0] ** 2 + w[:, 1] ** 2) / (1.0 + np.abs(w[:, 2]))


def _turn(w: np.ndarray) -> np.ndarray:
    """Pseudo-angle in [0, 4]: monotone in the azimuth, y / (|x| + |y|) in the first quarter."""
    reach = np.abs(w[:, 0]) + np.abs(w[:, 1])
    t = w[:, 1] / np.where(reach > 0, reach, 1.0)
    return np.where(w[:, 0] < 0, 2.0 - t, np.where(w[:, 1] < 0, 4.0 + t, t))


def _azimuth(turn: np.ndarray) -> np.ndarray:
    """The azimuth in [0, 2 pi] of a pseudo-angle in [0, 4]."""
    quarter = np.minimum(np.floor(turn), 3.0)
    t = turn - quarter
    return 0.5 * np.pi * quarter + np.arctan2(t, 1.0 - t)


def _edges(values: np.ndarray, low: float, high: float, count: int) -> np.ndarray:
    """count + 1 edges over [low, high]: half at quantiles, a quarter evenly, a quarter at growing distances."""
    inside = values[(values > low) & (values < high)]
    if not len(inside):
        return np.linspace(low, high, count + 1).astype(np.float32)
    even, far = count // 4, count // 4
    own = np.quantile(inside, np.linspace(0.0, 1.0, count + 1 - even - far))
    first, middle, last = own[len(own) // 4], own[len(own) // 2], own[3 * len(own) // 4]
    tails = [middle + sign * _growing(reach, high - low, far // 2) for sign, reach in ((1, last - middle), (-1, middle - first))]
    spread = np.concatenate([own, np.linspace(low, high, even + 2)[1:-1], *tails])
    edges = np.sort(np.clip(spread, low, high))
    # clipped tails leave several edges at an end: cells of no width, which count nothing and expect nothing
    edges = np.concatenate([[low], edges, np.full(max(count - len(edges), 0), high)])[: count + 1]
    edges[-1] = high
    return edges.astype(np.float32)


def _growing(first: float, last: float, count: int) -> np.ndarray:
    """Distances in equal ratios, by 1e4 at least: a lobe of width 1e-4 has its tail a million of its heights away."""
    first = max(first, 1e-10)
    return np.geomspace(first, max(last, 1e4 * first), count)


# --------------------------------------------------------------------------- what the pdf expects


def expect(pdf: Density, grid: Grid, tolerance: float) -> Expectation:
    """The pdf's integral over every cell; cells whose value is off by more than their noise allows are divided.

    tolerance  error allowed in a cell, as a share of the square root of its expected count at `1 / tolerance^2` samples
    """
    shape = grid.shape
    a = np.repeat(grid.rows[..., :-1].astype(float)[..., None], shape[3], axis=-1).ravel()
    b = np.repeat(grid.rows[..., 1:].astype(float)[..., None], shape[3], axis=-1).ravel()
    azimuth = _azimuth(grid.columns.astype(float))
    c, d = azimuth[..., :-1].ravel(), azimuth[..., 1:].ravel()
    row, side, _, _ = np.unravel_index(np.arange(len(a)), shape)
    side = np.array(grid.sides)[side]
    cells = np.zeros(len(a))
    owner = np.flatnonzero((b > a) & (d > c))
    box = np.stack([a, b, c, d], -1)[owner]
    for depth in range(9):
        place = pdf, grid.wo[row[owner]], side[owner], box
        (two, *_), (three, *_), (four, low, high) = (_gauss(*place, order) for order in (2, 3, 4))
        # the error of four nodes is far below the difference from two: for smooth cells its square, over the value.
        # Where a step runs through the middle, two and four agree by chance, and three does not.
        off = np.maximum(0.3 * np.abs(four - two), np.abs(four - three))
        allowed = tolerance * np.sqrt(np.maximum(four, tolerance**2)) * 0.5**depth
        divide = (off > allowed) | _has_a_step_aside(*place, low, high, allowed)
        divide &= depth < 8
        np.add.at(cells, owner[~divide], four[~divide])
        if not divide.any():
            break
        box, owner = box[divide], np.repeat(owner[divide], 4)
        m, q = 0.5 * (box[:, 0] + box[:, 1]), 0.5 * (box[:, 2] + box[:, 3])
        lo_a, hi_a, lo_c, hi_c = box.T
        parts = [(lo_a, m, lo_c, q), (m, hi_a, lo_c, q), (lo_a, m, q, hi_c), (m, hi_a, q, hi_c)]
        box = np.stack([np.stack(p, -1) for p in parts], 1).reshape(-1, 4)
    shaped = cells.reshape(shape)
    return Expectation(shaped, shaped.sum((1, 2, 3)))


# just inside a cell's corners and the middles of its sides, as shares of its width
_OUTSIDE = 0.07  # the share of a cell's width beyond the first of four nodes
_RIM = np.array([(a, b) for a in (1e-4, 0.5, 0.9999) for b in (1e-4, 0.5, 0.9999) if (a, b) != (0.5, 0.5)])


def _has_a_step_aside(
    pdf: Density,
    wo: np.ndarray,
    side: np.ndarray,
    box: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    allowed: np.ndarray,
) -> np.ndarray:
    """Whether the pdf on the rim of cells is quite another than at all their nodes, whose values span [low, high].

    Total reflection and the horizon end a density with a step; what lies between a cell's rim and its nodes would be
    lost, or taken for lit. A dark cell is divided at any light; others where what may be wrong is not allowed.
    """
    value = pdf(np.repeat(wo, len(_RIM), axis=0), _directions(side, box, _RIM[:, 0], _RIM[:, 1]))
    value = value.reshape(len(box), -1)
    most, least = value.max(1), value.min(1)
    a, b, c, d = box.T
    strip = _OUTSIDE * (b - a) * (d - c)
    above, below = most > 4.0 * high, 4.0 * least < low
    matters = (above & (strip * (most - high) > allowed)) | (below & (strip * (low - least) > allowed))
    return np.where(high <= 0.0, most > 0.0, matters)


def _directions(side: np.ndarray, box: np.ndarray, s: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Unit vectors at places (s, t) in [0, 1]^2 of each box [a, b] x [c, d] of (1 - |z|, azimuth), row by row."""
    a, b, c, d = box.T[..., None]
    height, phi = a + (b - a) * s, c + (d - c) * t
    r = np.sqrt(height * (2.0 - height))
    return np.stack([r * np.cos(phi), r * np.sin(phi), (1.0 - height) * side[:, None]], -1).reshape(-1, 3)


def _gauss(
    pdf: Density, wo: np.ndarray, side: np.ndarray, box: np.ndarray, order: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """int pdf over boxes [a, b] x [c, d] of (1 - |z|, azimuth), which are areas on the sphere; least and most pdf."""
    x, w = _NODES[order]
    x, w = 0.5 * (x + 1.0), 0.5 * w
    s, t = np.meshgrid(x, x, indexing="ij")
    weights = np.outer(w, w).ravel()
    result, low, high = (np.empty(len(box)) for _ in range(3))
    chunk = (1 << 22) // order**2
    for start in range(0, len(box), chunk):
        part = slice(start, start + chunk)
        wi = _directions(side[part], box[part], s.ravel(), t.ravel())
        value = pdf(np.repeat(wo[part], order**2, axis=0), wi).reshape(-1, order**2)
        a, b, c, d = box[part].T
        result[part] = value @ weights * (b - a) * (d - c)
        low[part], high[part] = value.min(1), value.max(1)
    return result, low, high


# --------------------------------------------------------------------------- what the samples say


def count(subject: Subject, grid: Grid, log_samples: int, seed: int) -> Counts:
    """Draw 2^log_samples for each wo and count them, in one kernel."""
    dr = backend.drjit()
    kind = backend.types("float32")
    UInt = kind.module.UInt32
    model = subject.bound()
    index = dr.arange(UInt, len(grid.wo) << log_samples)
    which = index >> dr.opaque(UInt, log_samples)
    table = [kind.float(np.ascontiguousarray(c)) for c in grid.wo.T]
    wo = kind.vec3(*[dr.gather(kind.float, c, which) for c in table])
    u = random_numbers(kind, index, seed)
    s = guarded(subject.model, "sample", lambda: model.sample(wo, u))
    return _counted(grid, which, s[0], (s[2] > 0.0) & ~kind.bool(s[3]), 1 << log_samples)


def count_given(samples: np.ndarray, drawn: int, grid: Grid) -> Counts:
    """As `count`, of samples (n, 3) that are there already, for the only wo of a grid; the others failed."""
    kind = backend.types("float32")
    wi = backend.vector_of(samples, 3, kind)
    return _counted(grid, kind.module.UInt32(0), wi, kind.bool(True), drawn)


def _counted(grid: Grid, which: Array, wi: Array, valid: Array, drawn: int) -> Counts:
    """How many directions, each for the wo of a number, lie in each cell; those that are not valid lie in none."""
    dr = backend.drjit()
    kind = backend.types("float32")
    UInt = kind.module.UInt32
    n, sides, rows, columns = grid.shape
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
    counts = dr.zeros(UInt, n * sides * rows * columns)
    dr.scatter_reduce(dr.ReduceOp.Add, counts, UInt(1), line * columns + column, inside & valid)
    dr.eval(counts)
    cells = counts.numpy().astype(np.int64).reshape(grid.shape)
    return Counts(cells, drawn - cells.sum((1, 2, 3)), drawn)


def random_numbers(kind: Types, index: Array, seed: int) -> Array:
    """Three independent numbers in [0, 1) for each index: counters hashed, no state; another seed, another stream."""
    dr = backend.drjit()
    UInt = kind.module.UInt32
    key = mix(mix(index, dr.opaque(UInt, seed & 0xFFFFFFFF)), UInt(0x9E3779B9))
    return kind.vec3(*[unit(mix(key, UInt(word))) for word in (0x51633E2D, 0x68BC21EB, 0x02E5BE93)])


def _find(kind: Types, edges: Array, start: Array, cells: int, value: Array) -> Array:
    """The cell of a value: the last whose lower edge is not above it."""
    dr = backend.drjit()
    return dr.binary_search(0, cells - 1, lambda i: dr.gather(kind.float, edges, start + i + 1) <= value)


# --------------------------------------------------------------------------- the two compared


def compare(expected: Expectation, counts: Counts, row: int) -> Outcome:
    """p-values of one wo."""
    n = counts.drawn
    e, o = expected.cells[row] * n, counts.cells[row]
    sides, rows, columns = e.shape
    coarse = (sides, rows // COARSE[0], COARSE[0], columns // COARSE[1], COARSE[1])
    fine = _pearson(e.ravel(), o.ravel(), n)
    broad = _pearson(e.reshape(coarse).sum((2, 4)).ravel(), o.reshape(coarse).sum((2, 4)).ravel(), n)
    return Outcome(fine, broad, _others(float(expected.total[row]), int(counts.others[row]), n))


def _pearson(expected: np.ndarray, observed: np.ndarray, drawn: int) -> float:
    """Chi-square of cells, small ones pooled; conditional on how many lie in any cell, which `_others` judges."""
    inside, seen = expected.sum(), observed.sum()
    if seen < LEAST or inside <= 0.0:
        return 1.0 if abs(seen - inside) < 6.0 * np.sqrt(max(seen, inside, 1.0)) else 0.0
    expected = expected * (seen / inside)
    order = np.argsort(expected, kind="stable")
    e, o = expected[order], observed[order]
    cumulative = np.cumsum(e)
    # one pool for all that is below the least expectation: its cells are many and their sum is what they tell
    small = np.searchsorted(e, LEAST)
    while small < len(e) and small and cumulative[small - 1] < LEAST:
        small += 1
    if small:
        e = np.concatenate([[cumulative[small - 1]], e[small:]])
        o = np.concatenate([[o[:small].sum()], o[small:]])
    if len(e) < 2:
        return 1.0
    if e[0] <= 0.0:
        return 0.0 if o[0] else 1.0
    return statistics.chi_square_tail(float(np.sum((o - e) ** 2 / e)), len(e) - 1)


QUADRATURE = 3e-5  # what float32 pdfs summed over thousands of cells may be off by


def _others(total: float, others: int, drawn: int) -> float:
    """p-value of how many samples lie in no cell, expected 1 - int pdf.

    The integral is known to `QUADRATURE` only: the expectation nearest to what was seen within that counts.
    """
    share = float(np.clip(others / drawn, 1.0 - total - QUADRATURE, 1.0 - total + QUADRATURE))
    if share <= 0.0:
        return 1.0 if others == 0 else 0.0
    return statistics.binomial_two_sided(others, drawn, min(share, 1.0))
