"""The expectation of the chi-square test: the integral of a pdf over every cell.

Cells are divided until their error is below a tolerance, which depends on the noise of their counts. The samples from
which the cells were placed also cause divisions, because a lobe may be narrower than a cell.

    expected = expect(subject, grid, tolerance)
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from ..energy.albedo.cells import FAINT, Points, Seen, product, rim, step_aside
from ..ops import backend
from ..ops.backend import Array
from .cells import Density, Grid, boxes, cell_of, direction, height
from .subject import Subject, guarded

DEPTH = 9  # divisions of a cell; cells with a step, such as that of total reflection, are divided to the last level
ASIDE = 1.1  # ratio: a step of a tenth at the edges of a ring of cells is 1e-4 of the total
MAX_CELLS = 400_000  # cells per round, about 10 M directions


class Expectation(NamedTuple):
    """The integral of a pdf over cells, for N directions wo.

    cells   probability of each cell, (N, sides, rows, columns)
    total   integral of the pdf over all cells, (N,)
    error   error of `total` due to cells that are not fully divided, (N,)
    unseen  estimate of the probability that is missing from each cell because no sample of the pilot has hit a lobe
            (see `cubature`), (N, sides, rows, columns)
    """

    cells: np.ndarray
    total: np.ndarray
    error: np.ndarray
    unseen: np.ndarray


def expect(pdf: Density | Subject, grid: Grid, tolerance: float) -> Expectation:
    """Integrate a pdf over every cell.

    pdf        the subject with this pdf, or a function (wo, wi) of NumPy arrays
    grid       the cells
    tolerance  allowed error of a cell with probability p, divided by sqrt(p); 1 / sqrt(n) is the noise of n samples
    """
    look: _Look = _InKernel(pdf, grid.wo) if isinstance(pdf, Subject) else _ByRows(pdf, grid.wo)
    a, b, c, d = (edge.ravel() for edge in boxes(grid.rows, grid.columns))
    row, side, _, _ = np.unravel_index(np.arange(len(a)), grid.shape)
    side = np.array(grid.sides)[side]
    integral, unseen = np.zeros(len(a)), np.zeros(len(a))
    unresolved = np.zeros(len(grid.wo))
    owner = np.flatnonzero((b > a) & (d > c))
    box = np.stack([a, b, c, d], -1)[owner]
    points, shown = _points(look, grid, owner), np.zeros(len(owner), bool)  # shown by a single sample
    for depth in range(DEPTH):
        place = row[owner], side[owner], box
        two, three, last = (look(*place, *_GAUSS[order]) for order in (2, 3, 4))
        four = last.integral
        # The error of four nodes is far below their difference from two nodes: for smooth cells about its square
        # divided by the value. With a step through the middle, two and four agree by chance, but three does not.
        rough = np.abs(four - three.integral)
        off = np.maximum(0.3 * np.abs(four - two.integral), rough)
        allowed = tolerance * np.sqrt(np.maximum(four, tolerance**2)) * 0.5**depth
        area = (box[:, 1] - box[:, 0]) * (box[:, 3] - box[:, 2])
        aside = area * step_aside(last, look(*place, *_RIM), ASIDE)
        missed = points.missed_by(area, area * last.most)
        by_samples = (missed > allowed) & (off < FAINT * missed)
        left = shown & ~by_samples & points.single(len(box))
        np.add.at(unseen, owner[left], points.light_in(len(box))[left])
        shown = by_samples & points.single(len(box))
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
        owner, shown = np.repeat(owner[divide], 4), np.repeat(shown[divide], 4)
        box, middle = _quarters(box[divide])
        points = _within(points, divide, middle)
    shaped, left = integral.reshape(grid.shape), unseen.reshape(grid.shape)
    return Expectation(shaped, shaped.sum((1, 2, 3)), unresolved + left.sum((1, 2, 3)), left)


def _quarters(box: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The quarters of boxes (N, 4) as (4 N, 4), and the height and azimuth at which the quarters of each box meet,
    (N, 2)."""
    a, b, c, d = box.T
    # the heights of a narrow lobe span decades: they are halved geometrically
    m = np.where(b > 4.0 * a, np.maximum(np.sqrt(a * b), b / 64.0), 0.5 * (a + b))
    q = 0.5 * (c + d)
    parts = [(a, m, c, q), (m, b, c, q), (a, m, q, d), (m, b, q, d)]
    return np.stack([np.stack(part, -1) for part in parts], 1).reshape(-1, 4), np.stack([m, q], -1)


def _points(look: _Look, grid: Grid, owner: np.ndarray) -> Points:
    """The samples from which the cells of a grid were placed, at (1 - |z|, azimuth) in the boxes of the cells `owner`.
    The light of a sample is its fraction of all samples."""
    dr = backend.drjit()
    kind = backend.types("float32")
    which = np.repeat(np.arange(len(grid.wo)), [len(samples) for samples in grid.pilot])
    wi = np.concatenate(grid.pilot)
    index, inside = cell_of(grid, kind.module.UInt32(which), backend.vector_of(wi, 3, kind))
    dr.eval(index, inside)
    box_of = np.full(int(np.prod(grid.shape)), -1)
    box_of[owner] = np.arange(len(owner))
    box = np.where(inside.numpy(), box_of[index.numpy()], -1)
    which, wi, box = which[box >= 0], wi[box >= 0], box[box >= 0]
    fraction = 1.0 / np.maximum([len(samples) for samples in grid.pilot], 1)
    azimuth = np.arctan2(wi[:, 1], wi[:, 0]) % (2.0 * np.pi)
    return Points(box, np.stack([height(wi), azimuth], -1), look.at(which, wi), fraction[which])


def _within(points: Points, divided: np.ndarray, middle: np.ndarray) -> Points:
    """The points in divided boxes, with the indices of the boxes' quarters, which meet at `middle` (boxes, 2)."""
    inside = Points(*[column[divided[points.cell]] for column in points])
    box = (np.cumsum(divided) - 1)[inside.cell]
    return inside._replace(cell=4 * box + (inside.at > middle[box]) @ [1, 2])


_GAUSS = {order: product(order) for order in (2, 3, 4)}
_RIM = rim(1e-4)


class _Look(Protocol):
    """The pdf at the nodes of boxes [a, b] x [c, d] in (1 - |z|, azimuth), in which areas equal those on the sphere."""

    def __call__(
        self, row: np.ndarray, side: np.ndarray, box: np.ndarray, s: np.ndarray, t: np.ndarray, weight: np.ndarray
    ) -> Seen: ...

    def at(self, row: np.ndarray, wi: np.ndarray) -> np.ndarray:
        """The pdf at directions wi (M, 3), for the wo with the indices `row`."""


CHUNK = 1 << 22  # directions at a time


class _ByRows:
    """The pdf as a function (wo, wi) of NumPy arrays."""

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

    def at(self, row: np.ndarray, wi: np.ndarray) -> np.ndarray:
        return self.pdf(self.wo[row], wi)


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
        weighed = value * of_node(weight) * (b - a) * (d - c)
        dr.eval(value, weighed)  # together: each reduction would evaluate the pdf again
        integral = dr.block_sum(weighed, len(s))
        least, most = (dr.block_reduce(op, value, len(s)) for op in (dr.ReduceOp.Min, dr.ReduceOp.Max))
        dr.eval(integral, least, most)
        return Seen(integral.numpy(), least.numpy(), most.numpy())

    def at(self, row: np.ndarray, wi: np.ndarray) -> np.ndarray:
        dr, own = backend.drjit(), backend.types(self.precision)
        number = own.module.UInt32(row)
        wo = own.vec3(*[dr.gather(own.float, backend.float_of(column, own), number) for column in self.wo.T])
        i = backend.vector_of(wi, 3, own)
        return backend.to_numpy(guarded(self.subject.model, "pdf", lambda: self.model.pdf(wo, i)), len(row))
