"""Pearson's chi-square test of a model's samples against its pdf, in cells that adapt to the samples.

The counts come from a second draw, independent of the pilot that placed the cells: sampling, binning and counting are
one kernel, which stores only the counts. Failed samples, delta samples and samples outside all cells are counted too:
their expected fraction is 1 - int pdf.

    grid = cells.place(subject, wo, seed)
    outcome = compare(expect(subject, grid, tolerance), count(subject, grid, log_samples, seed), row)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..ops import backend
from ..ops.backend import Array, Types
from ..transport.sampler import mix, unit
from . import statistics
from .cells import Grid, cell_of
from .expectation import Expectation
from .subject import Subject, guarded

COARSE = (10, 10)  # rows and columns that the coarse test merges into one cell, to detect small errors of broad lobes
MIN_EXPECTED = 10.0  # samples in a pooled cell, so that Pearson's statistic is close to its limiting distribution


class Counts(NamedTuple):
    """The number of samples in each cell, (N, sides, rows, columns); the number outside all cells, (N,); and the number
    of samples drawn per wo."""

    cells: np.ndarray
    others: np.ndarray
    drawn: int


class Outcome(NamedTuple):
    """The p-values for one wo: of all cells, of coarse cells, and of the number of samples outside all cells."""

    fine: float
    coarse: float
    others: float


# --------------------------------------------------------------------------- the counts of samples


def count(subject: Subject, grid: Grid, log_samples: int, seed: int) -> Counts:
    """Draw 2^log_samples samples for each wo and count them, in one kernel.

    seed  seed of the samples
    """
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
    """Count given samples (n, 3) in a grid with a single wo. The rest of the `drawn` samples count as failed."""
    kind = backend.types("float32")
    wi = backend.vector_of(samples, 3, kind)
    return _counted(grid, kind.module.UInt32(0), wi, kind.bool(True), drawn)


def _counted(grid: Grid, which: Array, wi: Array, valid: Array, drawn: int) -> Counts:
    """The number of valid directions in each cell, and that of all others.

    which  index of each direction's wo
    drawn  number of samples drawn per wo
    """
    dr = backend.drjit()
    UInt = backend.types("float32").module.UInt32
    cell, inside = cell_of(grid, which, wi)
    counts = dr.zeros(UInt, int(np.prod(grid.shape)))
    dr.scatter_reduce(dr.ReduceOp.Add, counts, UInt(1), cell, inside & valid)
    dr.eval(counts)
    cells = counts.numpy().astype(np.int64).reshape(grid.shape)
    return Counts(cells, drawn - cells.sum((1, 2, 3)), drawn)


def random_numbers(kind: Types, index: Array, seed: int) -> Array:
    """Three independent random numbers in [0, 1) for each index, by hashing without a state. Each seed gives another
    stream."""
    dr = backend.drjit()
    UInt = kind.module.UInt32
    key = mix(mix(index, dr.opaque(UInt, seed & 0xFFFFFFFF)), UInt(0x9E3779B9))
    return kind.vec3(*[unit(mix(key, UInt(word))) for word in (0x51633E2D, 0x68BC21EB, 0x02E5BE93)])


# --------------------------------------------------------------------------- the comparison


def compare(expected: Expectation, counts: Counts, row: int, grid: Grid | None = None) -> Outcome:
    """The p-values for one wo.

    row   index of wo
    grid  the cells, to allow for rounding: cells barely larger than the spacing of float32 directions gain or lose
          samples by rounding alone; None to ignore rounding
    """
    n = counts.drawn
    e, o = expected.cells[row] * n, counts.cells[row]
    sides, rows, columns = e.shape
    coarse = (sides, rows // COARSE[0], COARSE[0], columns // COARSE[1], COARSE[1])
    unseen = expected.unseen[row] * n
    rounded = np.zeros_like(e) if grid is None else _rounding(grid, row) * e
    fine = _pearson(e.ravel(), o.ravel(), unseen.ravel(), rounded.ravel())
    broad = _pearson(*[one.reshape(coarse).sum((2, 4)).ravel() for one in (e, o, unseen)])
    return Outcome(
        fine, broad, _others(float(expected.total[row]), float(expected.error[row]), int(counts.others[row]), n)
    )


STEP = 2.0**-24  # rounding error of a component of a float32 direction, half a unit in the last place


def _rounding(grid: Grid, row: int) -> np.ndarray:
    """The fraction of a cell's samples that rounding moves to the next cell, (sides, rows, columns): the rounding error
    of a coordinate divided by the width of the cell, summed over the two coordinates. An error of a component of a
    direction changes 1 - |z| by sin theta times as much, and the azimuth by 1 / sin theta times as much."""
    edges = grid.rows[row].astype(float)
    heights, middle = np.diff(edges, axis=-1), 0.5 * (edges[..., 1:] + edges[..., :-1])
    sin = np.sqrt(np.maximum(middle * (2.0 - middle), STEP))
    turns = np.diff(grid.columns[row].astype(float), axis=-1)
    across = STEP * sin / np.maximum(heights, STEP * sin)
    along = STEP / sin
    return np.asarray(across[..., None] + along[..., None] / np.maximum(turns, along[..., None]))


def _pearson(
    expected: np.ndarray, observed: np.ndarray, unseen: np.ndarray, rounded: np.ndarray | float = 0.0
) -> float:
    """The p-value of the chi-square test over cells, with small ones pooled, conditional on their total number of
    samples, which `_others` tests.

    unseen   number of samples that the expectation of each cell may lack; its square adds to the variance
    rounded  number of samples that rounding may move to the next cell; its square also adds to the variance, except for
             pooled cells, which are wide
    """
    inside, total = expected.sum(), observed.sum()
    if total < MIN_EXPECTED or inside <= 0.0:
        return 1.0 if abs(total - inside) < 6.0 * np.sqrt(max(total, inside, 1.0)) else 0.0
    expected = expected * (total / inside)
    order = np.argsort(expected, kind="stable")
    e, o, unseen = expected[order], observed[order], unseen[order]
    off = np.hypot(unseen, np.broadcast_to(rounded, order.shape)[order])
    cumulative = np.cumsum(e)
    # one pool for all cells below the minimum expectation
    small = np.searchsorted(e, MIN_EXPECTED)
    while small < len(e) and small and cumulative[small - 1] < MIN_EXPECTED:
        small += 1
    if small:
        e = np.concatenate([[cumulative[small - 1]], e[small:]])
        o = np.concatenate([[o[:small].sum()], o[small:]])
        off = np.concatenate([[unseen[:small].sum()], off[small:]])
    if len(e) < 2:
        return 1.0
    if e[0] <= 0.0 and off[0] <= 0.0:
        return 0.0 if o[0] else 1.0
    return statistics.chi_square_tail(float(np.sum((o - e) ** 2 / (e + off**2))), len(e) - 1)


QUADRATURE = 3e-5  # error of float32 pdfs summed over thousands of cells


def _others(total: float, error: float, others: int, drawn: int) -> float:
    """The p-value of the number of samples outside all cells, whose expected fraction is 1 - int pdf.

    The integral is known to within `QUADRATURE` plus its own error; the expectation in this interval that is nearest to
    the observation is used.
    """
    known = QUADRATURE + error
    share = float(np.clip(others / drawn, 1.0 - total - known, 1.0 - total + known))
    if share <= 0.0:
        return 1.0 if others == 0 else 0.0
    return statistics.binomial_two_sided(others, drawn, min(share, 1.0))
