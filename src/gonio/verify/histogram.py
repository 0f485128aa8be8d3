"""Pearson's chi-square test of a model's samples against its pdf, in cells that follow the samples.

A second draw, independent of the pilot that placed the cells, is counted: sampling, binning and counting are one
kernel, in which only the counts are stored. Failed samples, delta samples and those outside all cells are counted too:
their expectation is 1 - int pdf.

    grid = cells.place(subject, wo, seed)
    outcome = compare(expect(subject, grid, tolerance), count(subject, grid, log_samples, seed), row)
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from ..energy.albedo.cells import Seen, product, rim, step_aside
from ..energy.albedo.cubature import UNSEEN
from ..ops import backend
from ..ops.backend import Array, Types
from ..transport.sampler import mix, unit
from . import statistics
from .cells import Density, Grid, boxes, direction, height
from .subject import Subject, guarded

COARSE = (10, 10)  # rows and columns per cell of the coarse test, which detects small errors of broad lobes
DEPTH = 9  # divisions of a cell; cells with a step, such as that of total reflection, are divided to the last
ASIDE = 1.1  # ratio: a step of a tenth at the edges of a ring of cells is 1e-4 of the total
MAX_CELLS = 400_000  # of one round, some 10 M directions
MIN_EXPECTED = 10.0  # of a pooled cell: Pearson's statistic then follows its limit well within the noise


class Expectation(NamedTuple):
    """Probability of each cell (N, sides, rows, columns), the integral of the pdf over all (N,), and its error from
    cells that were not fully divided."""

    cells: np.ndarray
    total: np.ndarray
    error: np.ndarray


class Counts(NamedTuple):
    """Samples in each cell (N, sides, rows, columns), all others (N,), and samples drawn per wo."""

    cells: np.ndarray
    others: np.ndarray
    drawn: int


class Outcome(NamedTuple):
    """p-values of one wo: of all cells, of coarse ones, and of the number of samples outside of all cells."""

    fine: float
    coarse: float
    others: float


# --------------------------------------------------------------------------- the expectation by the pdf


def expect(pdf: Density | Subject, grid: Grid, tolerance: float) -> Expectation:
    """The pdf's integral over every cell; cells whose error exceeds what their noise allows are divided.

    pdf        of a subject, or a function of rows
    tolerance  error allowed in a cell, as a share of the square root of its expected count at `1 / tolerance^2` samples
    """
    shape = grid.shape
    look: _Look = _InKernel(pdf, grid.wo) if isinstance(pdf, Subject) else _ByRows(pdf, grid.wo)
    a, b, c, d = (edge.ravel() for edge in boxes(grid.rows, grid.columns))
    row, side, _, _ = np.unravel_index(np.arange(len(a)), shape)
    side = np.array(grid.sides)[side]
    integral = np.zeros(len(a))
    owner = np.flatnonzero((b > a) & (d > c))
    box = np.stack([a, b, c, d], -1)[owner]
    unresolved = np.zeros(len(grid.wo))
    points = _Points.of(pdf, grid, owner)
    for depth in range(DEPTH):
        place = row[owner], side[owner], box
        two, three, last = (look(*place, *_GAUSS[order]) for order in (2, 3, 4))
        four = last.integral
        # The error of four nodes is far below the difference from two: for smooth cells its square, over the value.
        # With a step through the middle, two and four agree by chance, and three does not.
        rough = np.abs(four - three.integral)
        off = np.maximum(0.3 * np.abs(four - two.integral), rough)
        allowed = tolerance * np.sqrt(np.maximum(four, tolerance**2)) * 0.5**depth
        area = (box[:, 1] - box[:, 0]) * (box[:, 3] - box[:, 2])
        aside = area * step_aside(last, look(*place, *_RIM), ASIDE)
        missed = points.missed_by(area, last.most)
        aside = np.maximum(aside, missed)
        divide = (off > allowed) | (aside > allowed) | ((last.most <= 0.0) & (aside > 0.0))
        divide &= depth < DEPTH - 1
        if 4 * divide.sum() > MAX_CELLS:  # a pdf that is rough everywhere: only the roughest cells
            worst = np.argsort(-np.where(divide, np.maximum(off, missed) / allowed, 0.0))
            divide[worst[MAX_CELLS // 4 :]] = False
        np.add.at(unresolved, row[owner[~divide]], np.maximum(rough, aside)[~divide])
        np.add.at(integral, owner[~divide], four[~divide])
        if not divide.any():
            break
        which = divide
        box, owner = box[divide], np.repeat(owner[divide], 4)
        lo_a, hi_a, lo_c, hi_c = box.T
        # the heights of a narrow lobe span decades: they are halved in ratio
        m = np.where(hi_a > 4.0 * lo_a, np.maximum(np.sqrt(lo_a * hi_a), hi_a / 64.0), 0.5 * (lo_a + hi_a))
        q = 0.5 * (lo_c + hi_c)
        points = points.within(which, m, q)
        parts = [(lo_a, m, lo_c, q), (m, hi_a, lo_c, q), (lo_a, m, q, hi_c), (m, hi_a, q, hi_c)]
        box = np.stack([np.stack(p, -1) for p in parts], 1).reshape(-1, 4)
    shaped = integral.reshape(shape)
    return Expectation(shaped, shaped.sum((1, 2, 3)), unresolved)


class _Points(NamedTuple):
    """The pilot's samples inside boxes: the box's number, 1 - |z| and azimuth, the pdf, and the sample's share of all."""

    box: np.ndarray
    height: np.ndarray
    azimuth: np.ndarray
    value: np.ndarray
    share: np.ndarray

    @classmethod
    def of(cls, pdf: Density | Subject, grid: Grid, owner: np.ndarray) -> _Points:
        """The samples that placed a grid's cells, in the boxes of the cells `owner`."""
        box_of = np.full(int(np.prod(grid.shape)), -1)
        box_of[owner] = np.arange(len(owner))
        columns = []
        for i, samples in enumerate(grid.pilot):
            for j, side in enumerate(grid.sides):
                w = samples[side * samples[:, 2] > 0.0]
                box = box_of[grid.cell_of(i, j, w)]
                w, box = w[box >= 0], box[box >= 0]
                wo = np.repeat(grid.wo[i : i + 1], len(w), axis=0)
                value = pdf.pdf(wo, w) if isinstance(pdf, Subject) else pdf(wo, w)
                turn = np.arctan2(w[:, 1], w[:, 0]) % (2.0 * np.pi)
                columns.append((box, height(w), turn, value, np.full(len(w), 1.0 / max(len(samples), 1))))
        return cls(*[np.concatenate(column) for column in zip(*columns, strict=True)])

    def missed_by(self, area: np.ndarray, most: np.ndarray) -> np.ndarray:
        """The share of samples in each box whose nodes, with the largest value `most`, are all dark beside one of the
        samples, else 0: the lobe is narrower than the box."""
        bright = np.zeros(len(most))
        np.maximum.at(bright, self.box, self.value)
        share = np.bincount(self.box, self.share, len(most))
        return np.where(most < UNSEEN * bright, np.minimum(bright * area, share), 0.0)

    def within(self, divided: np.ndarray, height: np.ndarray, azimuth: np.ndarray) -> _Points:
        """The points in divided boxes, numbered by the quarters, which meet at these heights and azimuths."""
        kept = _Points(*[column[divided[self.box]] for column in self])
        box = (np.cumsum(divided) - 1)[kept.box]
        return kept._replace(box=4 * box + (kept.height > height[box]) + 2 * (kept.azimuth > azimuth[box]))


_GAUSS = {order: product(order) for order in (2, 3, 4)}
_RIM = rim(1e-4)


class _Look(Protocol):
    """The pdf at nodes of boxes [a, b] x [c, d] of (1 - |z|, azimuth), which are areas on the sphere."""

    def __call__(
        self, row: np.ndarray, side: np.ndarray, box: np.ndarray, s: np.ndarray, t: np.ndarray, weight: np.ndarray
    ) -> Seen: ...


CHUNK = 1 << 22  # directions at a time


class _ByRows:
    """The pdf as a function of rows (wo, wi)."""

    def __init__(self, pdf: Density, wo: np.ndarray) -> None:
        self.pdf, self.wo = pdf, wo

    def __call__(
        self, row: np.ndarray, side: np.ndarray, box: np.ndarray, s: np.ndarray, t: np.ndarray, weight: np.ndarray
    ) -> Seen:
        values = np.empty((len(box), len(s)))
        for start in range(0, len(box), CHUNK // len(s)):
            part = slice(start, start + CHUNK // len(s))
            a, b, c, d = box[part].T[..., None]
            wi = direction(a + (b - a) * s, c + (d - c) * t, side[part, None]).reshape(-1, 3)
            values[part] = self.pdf(np.repeat(self.wo[row[part]], len(s), axis=0), wi).reshape(-1, len(s))
        a, b, c, d = box.T
        return Seen(values @ weight * (b - a) * (d - c), values.min(1), values.max(1))


class _InKernel:
    """The pdf of a subject, with directions generated in its kernel."""

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


# --------------------------------------------------------------------------- the counts of samples


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
    """As `count`, for given samples (n, 3) of a grid's only wo; the other samples failed."""
    kind = backend.types("float32")
    wi = backend.vector_of(samples, 3, kind)
    return _counted(grid, kind.module.UInt32(0), wi, kind.bool(True), drawn)


def _counted(grid: Grid, which: Array, wi: Array, valid: Array, drawn: int) -> Counts:
    """Count of valid directions in each cell; `which` is the number of each direction's wo."""
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
    """Three independent numbers in [0, 1) for each index by hashing, without state; each seed gives another stream."""
    dr = backend.drjit()
    UInt = kind.module.UInt32
    key = mix(mix(index, dr.opaque(UInt, seed & 0xFFFFFFFF)), UInt(0x9E3779B9))
    return kind.vec3(*[unit(mix(key, UInt(word))) for word in (0x51633E2D, 0x68BC21EB, 0x02E5BE93)])


def _find(kind: Types, edges: Array, start: Array, cells: int, value: Array) -> Array:
    """The cell of a value: the last whose lower edge is not above it."""
    dr = backend.drjit()
    return dr.binary_search(0, cells - 1, lambda i: dr.gather(kind.float, edges, start + i + 1) <= value)


# --------------------------------------------------------------------------- the comparison


def compare(expected: Expectation, counts: Counts, row: int, grid: Grid | None = None) -> Outcome:
    """p-values of one wo.

    grid  the cells, to allow for rounding: cells hardly larger than the spacing of float32 directions gain or lose
          samples by rounding alone
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
    """Share of a cell's samples that rounding moves to the next one, (sides, rows, columns): a step of the coordinates
    over the cell's width, along both. A step of a component moves 1 - |z| by sin theta, and the azimuth by 1 / sin."""
    edges = grid.rows[row].astype(float)
    heights, middle = np.diff(edges, axis=-1), 0.5 * (edges[..., 1:] + edges[..., :-1])
    sin = np.sqrt(np.maximum(middle * (2.0 - middle), STEP))
    turns = np.diff(grid.columns[row].astype(float), axis=-1)
    across = STEP * sin / np.maximum(heights, STEP * sin)
    along = STEP / sin
    return np.asarray(across[..., None] + along[..., None] / np.maximum(turns, along[..., None]))


def _pearson(expected: np.ndarray, observed: np.ndarray, drawn: int, rounding: np.ndarray | None = None) -> float:
    """Chi-square of cells, small ones pooled; conditional on the number of samples in them, which `_others` tests."""
    inside, total = expected.sum(), observed.sum()
    if total < MIN_EXPECTED or inside <= 0.0:
        return 1.0 if abs(total - inside) < 6.0 * np.sqrt(max(total, inside, 1.0)) else 0.0
    expected = expected * (total / inside)
    order = np.argsort(expected, kind="stable")
    e, o = expected[order], observed[order]
    # the number of samples that rounding moves, squared, adds to the variance; pooled cells are wide
    more = np.zeros(len(e)) if rounding is None else (rounding[order] * e) ** 2
    cumulative = np.cumsum(e)
    # one pool for all cells below the least expectation
    small = np.searchsorted(e, MIN_EXPECTED)
    while small < len(e) and small and cumulative[small - 1] < MIN_EXPECTED:
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


QUADRATURE = 3e-5  # error of float32 pdfs summed over thousands of cells


def _others(total: float, error: float, others: int, drawn: int) -> float:
    """p-value of the number of samples outside of all cells, expected 1 - int pdf.

    The integral is known to `QUADRATURE` and its own error; of the expectations within these, the nearest to the
    observation counts.
    """
    known = QUADRATURE + error
    share = float(np.clip(others / drawn, 1.0 - total - known, 1.0 - total + known))
    if share <= 0.0:
        return 1.0 if others == 0 else 0.0
    return statistics.binomial_two_sided(others, drawn, min(share, 1.0))
