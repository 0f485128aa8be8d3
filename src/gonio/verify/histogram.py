"""Pearson's chi-square test of a model's samples against its pdf, in cells that follow the samples.

A lobe of width .005 fills a hundred-thousandth of the sphere: fixed cells would hold it in one, or number millions. So
a first, small draw (the pilot) places the edges, and a second, independent one is counted: 100 rows a side of the
surface and 200 columns a row, at quantiles of the pilot, at equal steps, and at growing distances from its middle for
the tails. The coordinates are (1 - |z|, a pseudo-angle of (x, y)): equal areas, no transcendental function, and no
cancellation near the pole. Sampling, binning and counting are one kernel, in which nothing is stored but the counts.

What fails, is a delta sample, or lands where no cell is, is counted too: its expectation is 1 - int pdf.

    grid = place(subject, wo, seed)
    outcome = compare(expect(subject, grid, tolerance), count(subject, grid, log_samples, seed), row)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol, TypeAlias

import numpy as np

from ..energy.albedo.cells import Seen, product, rim, step_aside
from ..ops import backend
from ..ops.backend import Array, Types
from ..transport.sampler import mix, unit
from . import directions, statistics
from .subject import Subject, guarded

CELLS = (100, 200)  # rows and columns a side of the surface
COARSE = (10, 10)  # rows and columns that are joined for the coarse test, which sees small errors of broad lobes
PILOT = 1 << 15  # samples for CELLS; fewer cells need fewer
DEPTH = 9  # divisions of a cell; a step such as total reflection's divides those that it runs through to the last
BESIDE = 1.1  # times: a step of a tenth next to the edges of a ring of cells is 1e-4 of all
LARGEST = 400_000  # cells of one round, some 10 M directions
LEAST = 10.0  # expectation of a pooled cell: Pearson's statistic then follows its limit well within the noise

Density: TypeAlias = Callable[[np.ndarray, np.ndarray], np.ndarray]  # of rows (wo, wi), (N, 3) each: (N,)


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


FINEST = 3e-5  # of an azimuth: 120 of the steps that float32 directions have


class Expectation(NamedTuple):
    """Probability of each cell (N, sides, rows, columns), the integral of the pdf over all (N,), and how far that may
    be off where cells were still to be divided."""

    cells: np.ndarray
    total: np.ndarray
    error: np.ndarray


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


def place_around(pilot: Sequence[np.ndarray], wo: np.ndarray, pdf: Density, cells: tuple[int, int] = CELLS) -> Grid:
    """Cells around some samples (n, 3) of each wo, on the sides where there are any, or where the pdf claims some.

    A wo is left out whose samples lie so close together that float32 directions are a visible raster.
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
            height, turn = _height(mine), _turn(mine)
            order = np.argsort(height)
            height, turn = height[order], turn[order]
            rows[i, j] = _edges(height, 0.0, 1.0, many_rows)
            for r, (a, b) in enumerate(zip(rows[i, j][:-1], rows[i, j][1:], strict=True)):
                first, last = np.searchsorted(height, [a, b])
                more = max(300 - (last - first), 0) // 2  # neighbours say where a row with few samples has its own
                columns[i, j, r] = _edges(turn[max(first - more, 0) : last + more], 0.0, 4.0, many_columns)
    return Grid(wo, sides, rows, columns)


def _spread(wi: np.ndarray) -> float:
    """How far the middle half of directions spreads in azimuth; infinite where there are too few to say."""
    if len(wi) < 20:
        return float("inf")
    first, last = np.percentile(_turn(wi), [25.0, 75.0])
    return float(last - first)


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
    even, far = count // 4 - 2, count // 4
    own = np.sort(inside)[np.linspace(0, len(inside) - 1, count - 1 - even - far).astype(int)]
    first, middle, last = own[len(own) // 4], own[len(own) // 2], own[3 * len(own) // 4]
    tails = [
        middle + sign * _growing(reach, high - low, far // 2)
        for sign, reach in ((1, last - middle), (-1, middle - first))
    ]
    # a density that ends with a step does so just beyond the outermost samples
    beyond = [own[-1] + (own[-1] - own[-2]), own[0] - (own[1] - own[0])]
    spread = np.concatenate([own, beyond, np.linspace(low, high, even + 2)[1:-1], *tails])
    edges = np.sort(np.clip(spread, low, high))
    # clipped tails leave several edges at an end: cells of no width, which count nothing and expect nothing
    edges = np.concatenate([[low], edges, np.full(max(count - len(edges), 0), high)])[: count + 1]
    edges[-1] = high
    return edges.astype(np.float32)


def _growing(first: float, last: float, count: int) -> np.ndarray:
    """Distances in equal ratios, by 1e4 at least: a lobe of width 1e-4 has its tail a million of its heights away."""
    first = max(first, 1e-10)
    return first * max(last / first, 1e4) ** (np.arange(count) / max(count - 1, 1))


# --------------------------------------------------------------------------- what the pdf expects


def expect(pdf: Density | Subject, grid: Grid, tolerance: float) -> Expectation:
    """The pdf's integral over every cell; cells whose value is off by more than their noise allows are divided.

    pdf        of a subject, or a function of rows
    tolerance  error allowed in a cell, as a share of the square root of its expected count at `1 / tolerance^2` samples
    """
    shape = grid.shape
    look: _Look = _InKernel(pdf, grid.wo) if isinstance(pdf, Subject) else _ByRows(pdf, grid.wo)
    a = np.repeat(grid.rows[..., :-1].astype(float)[..., None], shape[3], axis=-1).ravel()
    b = np.repeat(grid.rows[..., 1:].astype(float)[..., None], shape[3], axis=-1).ravel()
    azimuth = _azimuth(grid.columns.astype(float))
    c, d = azimuth[..., :-1].ravel(), azimuth[..., 1:].ravel()
    row, side, _, _ = np.unravel_index(np.arange(len(a)), shape)
    side = np.array(grid.sides)[side]
    cells = np.zeros(len(a))
    owner = np.flatnonzero((b > a) & (d > c))
    box = np.stack([a, b, c, d], -1)[owner]
    unsettled = np.zeros(len(grid.wo))
    for depth in range(DEPTH):
        place = row[owner], side[owner], box
        two, three, seen = (look(*place, *_GAUSS[order]) for order in (2, 3, 4))
        four = seen.integral
        # the error of four nodes is far below the difference from two: for smooth cells its square, over the value.
        # Where a step runs through the middle, two and four agree by chance, and three does not.
        rough = np.abs(four - three.integral)
        off = np.maximum(0.3 * np.abs(four - two.integral), rough)
        allowed = tolerance * np.sqrt(np.maximum(four, tolerance**2)) * 0.5**depth
        area = (box[:, 1] - box[:, 0]) * (box[:, 3] - box[:, 2])
        aside = area * step_aside(seen, look(*place, *_RIM), BESIDE)
        divide = (off > allowed) | (aside > allowed) | ((seen.most <= 0.0) & (aside > 0.0))
        divide &= depth < DEPTH - 1
        if 4 * divide.sum() > LARGEST:  # a pdf that is rough everywhere: the roughest cells, and the rest as it is
            worst = np.argsort(-np.where(divide, off / allowed, 0.0))
            divide[worst[LARGEST // 4 :]] = False
        np.add.at(unsettled, row[owner[~divide]], np.maximum(rough, aside)[~divide])
        np.add.at(cells, owner[~divide], four[~divide])
        if not divide.any():
            break
        box, owner = box[divide], np.repeat(owner[divide], 4)
        lo_a, hi_a, lo_c, hi_c = box.T
        # a narrow lobe's heights span decades: those are halved in ratio
        m = np.where(hi_a > 4.0 * lo_a, np.maximum(np.sqrt(lo_a * hi_a), hi_a / 64.0), 0.5 * (lo_a + hi_a))
        q = 0.5 * (lo_c + hi_c)
        parts = [(lo_a, m, lo_c, q), (m, hi_a, lo_c, q), (lo_a, m, q, hi_c), (m, hi_a, q, hi_c)]
        box = np.stack([np.stack(p, -1) for p in parts], 1).reshape(-1, 4)
    shaped = cells.reshape(shape)
    return Expectation(shaped, shaped.sum((1, 2, 3)), unsettled)


_GAUSS = {order: product(order) for order in (2, 3, 4)}
_RIM = rim(1e-4)


class _Look(Protocol):
    """The pdf at nodes of boxes [a, b] x [c, d] of (1 - |z|, azimuth), which are areas on the sphere."""

    def __call__(
        self, row: np.ndarray, side: np.ndarray, box: np.ndarray, s: np.ndarray, t: np.ndarray, weight: np.ndarray
    ) -> Seen: ...


CHUNK = 1 << 22  # directions at a time


class _ByRows:
    """Of a function of rows (wo, wi)."""

    def __init__(self, pdf: Density, wo: np.ndarray) -> None:
        self.pdf, self.wo = pdf, wo

    def __call__(
        self, row: np.ndarray, side: np.ndarray, box: np.ndarray, s: np.ndarray, t: np.ndarray, weight: np.ndarray
    ) -> Seen:
        values = np.empty((len(box), len(s)))
        for start in range(0, len(box), CHUNK // len(s)):
            part = slice(start, start + CHUNK // len(s))
            a, b, c, d = box[part].T[..., None]
            height, phi = a + (b - a) * s, c + (d - c) * t
            r = np.sqrt(height * (2.0 - height))
            wi = np.stack([r * np.cos(phi), r * np.sin(phi), (1.0 - height) * side[part, None]], -1).reshape(-1, 3)
            values[part] = self.pdf(np.repeat(self.wo[row[part]], len(s), axis=0), wi).reshape(-1, len(s))
        a, b, c, d = box.T
        return Seen(values @ weight * (b - a) * (d - c), values.min(1), values.max(1))


class _InKernel:
    """Of a subject, its directions made in the kernel that asks it."""

    def __init__(self, subject: Subject, wo: np.ndarray) -> None:
        self.subject = subject
        self.precision = subject.best
        self.model = subject.bound(self.precision)
        self.wo = wo

    def __call__(
        self, row: np.ndarray, side: np.ndarray, box: np.ndarray, s: np.ndarray, t: np.ndarray, weight: np.ndarray
    ) -> Seen:
        parts = [
            self._part(row[i : i + n], side[i : i + n], box[i : i + n], s, t, weight)
            for n in [CHUNK // len(s)]
            for i in range(0, len(box), n)
        ]
        if not parts:
            return Seen(*np.empty((3, 0)))
        return Seen(*[np.concatenate(column) for column in zip(*parts, strict=True)])

    def _part(
        self, row: np.ndarray, side: np.ndarray, box: np.ndarray, s: np.ndarray, t: np.ndarray, weight: np.ndarray
    ) -> Seen:
        dr = backend.drjit()
        exact, own = backend.types("float64"), backend.types(self.precision)
        UInt = exact.module.UInt32
        index = dr.arange(UInt, len(box) * len(s))
        cell, node = index // len(s), index % len(s)

        def of_cell(column: np.ndarray) -> Array:
            return dr.gather(exact.float, backend.float_of(column, exact), cell)

        def of_node(column: np.ndarray) -> Array:
            return dr.gather(exact.float, backend.float_of(column, exact), node)

        a, b, c, d = (of_cell(column) for column in box.T)
        height, phi = a + (b - a) * of_node(s), c + (d - c) * of_node(t)
        r = dr.sqrt(height * (2.0 - height))
        sin, cos = dr.sincos(phi)
        wi = own.vec3(r * cos, r * sin, (1.0 - height) * of_cell(side))
        wo = own.vec3(*[of_cell(column) for column in self.wo[row].T])
        pdf = guarded(self.subject.model, "pdf", lambda: self.model.pdf(wo, wi))
        value = exact.float(pdf) + dr.zeros(exact.float, len(index))
        integral = dr.block_sum(value * of_node(weight) * (b - a) * (d - c), len(s))
        least, most = (dr.block_reduce(op, value, len(s)) for op in (dr.ReduceOp.Min, dr.ReduceOp.Max))
        dr.eval(integral, least, most)
        return Seen(integral.numpy(), least.numpy(), most.numpy())


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


def compare(expected: Expectation, counts: Counts, row: int, grid: Grid | None = None) -> Outcome:
    """p-values of one wo.

    grid  the cells: where some are hardly larger than the steps of float32 directions, so many samples more or less
          lie in them by rounding alone
    """
    n = counts.drawn
    e, o = expected.cells[row] * n, counts.cells[row]
    sides, rows, columns = e.shape
    coarse = (sides, rows // COARSE[0], COARSE[0], columns // COARSE[1], COARSE[1])
    fine = _pearson(e.ravel(), o.ravel(), n, None if grid is None else _rounding(grid, row).ravel())
    broad = _pearson(e.reshape(coarse).sum((2, 4)).ravel(), o.reshape(coarse).sum((2, 4)).ravel(), n)
    return Outcome(
        fine, broad, _others(float(expected.total[row]), float(expected.error[row]), int(counts.others[row]), n)
    )


STEP = 2.0**-24  # of a component of a float32 direction, half a unit of its last digit


def _rounding(grid: Grid, row: int) -> np.ndarray:
    """Share of a cell's samples that lie in the next one by rounding, (sides, rows, columns): a step of the coordinates
    over the cell's width, along both. A step of a component moves 1 - |z| by sin theta, and the azimuth by 1 / sin."""
    edges = grid.rows[row].astype(float)
    heights, middle = np.diff(edges, axis=-1), 0.5 * (edges[..., 1:] + edges[..., :-1])
    sin = np.sqrt(np.maximum(middle * (2.0 - middle), STEP))
    turns = np.diff(grid.columns[row].astype(float), axis=-1)
    across = STEP * sin / np.maximum(heights, STEP * sin)
    along = STEP / sin
    return np.asarray(across[..., None] + along[..., None] / np.maximum(turns, along[..., None]))


def _pearson(expected: np.ndarray, observed: np.ndarray, drawn: int, rounding: np.ndarray | None = None) -> float:
    """Chi-square of cells, small ones pooled; conditional on how many lie in any cell, which `_others` judges."""
    inside, seen = expected.sum(), observed.sum()
    if seen < LEAST or inside <= 0.0:
        return 1.0 if abs(seen - inside) < 6.0 * np.sqrt(max(seen, inside, 1.0)) else 0.0
    expected = expected * (seen / inside)
    order = np.argsort(expected, kind="stable")
    e, o = expected[order], observed[order]
    # what rounding moves adds to the variance, as much as it moves squared; pooled cells are wide
    more = np.zeros(len(e)) if rounding is None else (rounding[order] * e) ** 2
    cumulative = np.cumsum(e)
    # one pool for all that is below the least expectation: its cells are many and their sum is what they tell
    small = np.searchsorted(e, LEAST)
    while small < len(e) and small and cumulative[small - 1] < LEAST:
        small += 1
    if small:
        e = np.concatenate([[cumulative[small - 1]], e[small:]])
        o = np.concatenate([[o[:small].sum()], o[small:]])
        more = np.concatenate([[0.0], more[small:]])
    if len(e) < 2:
        return 1.0
    if e[0] <= 0.0:
        return 0.0 if o[0] else 1.0
    return statistics.chi_square_tail(float(np.sum((o - e) ** 2 / (e + more))), len(e) - 1)


QUADRATURE = 3e-5  # what float32 pdfs summed over thousands of cells may be off by


def _others(total: float, error: float, others: int, drawn: int) -> float:
    """p-value of how many samples lie in no cell, expected 1 - int pdf.

    The integral is known to `QUADRATURE` and its own error: the expectation nearest to what was seen within that
    counts.
    """
    known = QUADRATURE + error
    share = float(np.clip(others / drawn, 1.0 - total - known, 1.0 - total + known))
    if share <= 0.0:
        return 1.0 if others == 0 else 0.0
    return statistics.binomial_two_sided(others, drawn, min(share, 1.0))
