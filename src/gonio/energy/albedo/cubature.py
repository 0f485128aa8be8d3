"""Integrals over the sphere of wi, for many wo at once, by adaptive cubature.

A cell is a rectangle in (theta, phi), where theta is measured from the nearer pole, so that no cell crosses the
horizon. Cells are first divided where the model's samples are dense and around the mirror direction, so that a lobe
with a width of a thousandth of a radian is resolved. Then cells are divided wherever the Gauss-Legendre value of a cell
differs from the sum over its quarters, until the error of the integral, which follows from these differences, is below
the tolerance. The differences are errors of the coarser values, so the reported error is conservative.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from ...ops import Direction, Scalar, backend
from .cells import FAINT, Nodes, Points, Seen, product, rimmed, step_aside

ORDER = 4  # nodes per side of a cell: exact for polynomials of degree 7, and less expensive than dividing the cell
ALMOST_ONE = np.float32(1.0) - np.float32(2.0**-24)
FIRST = (8, 16)  # cells per side of the surface, in theta and phi
FIRST_SIZE = np.array([0.5, 2.0]) * np.pi / FIRST
DEPTH = 21  # halvings of pi/16, down to 1e-7: at 89.9 degrees, a lobe of width 2e-4 is that narrow
SEEDED = 17  # maximum number of halvings around samples
SAMPLES = (1 << 10, 1 << 13, 1 << 16)  # samples per wo; the larger numbers are used if the smaller ones miss light
CROWD = 1 / 32  # fraction of the samples in a cell above which it is divided before the integrand is evaluated
BUDGET = 0.5  # fraction of the tolerance; an integral is finished once its error is smaller
OFF = 1e-3  # difference from unit length above which a sampled direction is not used
UP = np.array([0.0, 0.0, 1.0])
MAX_CELLS = 600_000  # cells evaluated per round, about 10 M directions


_GAUSS, _RIMMED = product(ORDER), rimmed(1e-3)

Integrand: TypeAlias = Callable[[Direction, Direction], Iterable[Scalar]]  # function of float64 Dr.Jit vectors
# (wo, u), (N, 3) each, -> a Sample of arrays; determines where cells are divided first
Sampler: TypeAlias = Callable[[np.ndarray, np.ndarray], Any]


def of_rows(function: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Integrand:
    """The integrand for a function of NumPy arrays, (N, 3) and (N, 3) -> (N, channels); about ten times slower than a
    function of Dr.Jit vectors."""
    types = backend.types("float64")

    def integrand(wo: Direction, wi: Direction) -> list[Scalar]:
        count = backend.drjit().width(wi)
        value = function(backend.to_numpy(wo, count), backend.to_numpy(wi, count))
        return [backend.float_of(column, types) for column in value.T]

    return integrand


# ways to divide a cell into four: parts along (theta, phi), and the positions of the parts in units of their size
QUADRANTS, ALONG_THETA, ALONG_PHI = 0, 1, 2
WAYS = np.array([(2, 2), (4, 1), (1, 4)])
PLACES = np.array([[(0, 0), (1, 0), (0, 1), (1, 1)], [(k, 0) for k in range(4)], [(0, k) for k in range(4)]])
ONE_WAY = 0.05  # if the values vary along one coordinate by less than this fraction of the other, only that is divided


class Integral(NamedTuple):
    """Integrals and their estimated errors, (directions, channels) each."""

    value: np.ndarray
    error: np.ndarray


class _Cells(NamedTuple):
    """Cells in (theta, phi).

    row   index of wo
    side  side of the surface: 1 above, -1 below
    low   lower corner
    size  size
    """

    row: np.ndarray
    side: np.ndarray
    low: np.ndarray
    size: np.ndarray

    @property
    def area(self) -> np.ndarray:
        """Area of each cell, in (theta, phi)."""
        return np.asarray(self.size.prod(1))

    def take(self, which: np.ndarray) -> _Cells:
        return _Cells(*[part[which] for part in self])

    def quarters(self, way: np.ndarray | None = None) -> _Cells:
        """The four quarters of each cell, which are adjacent in the result.

        way  way to divide each cell, an index in WAYS; None divides all into QUADRANTS
        """
        way = np.zeros(len(self.row), int) if way is None else way
        size = self.size / WAYS[way]
        low = (self.low[:, None, :] + size[:, None, :] * PLACES[way]).reshape(-1, 2)
        return _Cells(np.repeat(self.row, 4), np.repeat(self.side, 4), low, np.repeat(size, 4, axis=0))


def integrate(
    sample: Sampler,
    integrand: Integrand,
    wo: np.ndarray,
    tolerance: float = 1e-5,
    seed: int = 0,
    attempts: int = len(SAMPLES),
) -> Integral:
    """int integrand(wo, wi) dwi over the sphere, for each row of wo (N, 3).

    sample     the `sample` method of the model, which reveals its lobes
    integrand  function of float64 Dr.Jit vectors wo and wi that returns one value per channel; it runs inside a kernel
    tolerance  absolute error of an integral up to 1, relative error of a larger one; if cells or samples run out, the
               reported error is larger
    seed       seed of the samples
    attempts   how many of the numbers in `SAMPLES` are tried; light that remains undetected is part of the reported
               error
    """
    per, *more = SAMPLES[:attempts]
    value, error, unseen = _integrate(sample, integrand, wo, tolerance, seed, per)
    for per in more:
        dark = unseen > tolerance * np.maximum(np.abs(value).max(1), 1.0)
        if not dark.any():
            break
        value[dark], error[dark], unseen[dark] = _integrate(sample, integrand, wo[dark], tolerance, seed, per)
    return Integral(value, error + unseen[:, None])


def _integrate(
    sample: Sampler, integrand: Integrand, wo: np.ndarray, tolerance: float, seed: int, per: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Values and errors of integrals whose first cells are derived from `per` samples for each wo, and an estimate,
    (N,), of the light in lobes that are narrower than the cells and that no sample has hit.

    Along a streak that is a thousand times as long as wide, a cell between two samples is as dark at its nodes as a
    cell next to the streak. The missing light is estimated by the light of the samples that are the only ones in their
    cell and caused its division (Good1953: if N_1 of N draws are the only ones of their kind, kinds not yet seen have
    the probability N_1 / N).
    """
    cells, points = _seeded(sample, integrand, wo, seed, per)
    (first,), way = _values(integrand, wo, cells, _GAUSS)
    way[points.missed_by(cells.area, first.most) > 0.0] = QUADRANTS
    coarse = first.integral
    channels = coarse.shape[1]
    unseen, shown = np.zeros(len(wo)), np.zeros(len(cells.row), bool)  # lobe revealed by a single sample
    value, errors = np.zeros((len(wo), channels)), _Errors(len(wo), channels)
    for depth in range(DEPTH):
        fine_cells = cells.quarters(way)
        (inner, other), ways = _values(integrand, wo, fine_cells, _GAUSS, _RIMMED)
        fine = _joined(inner.integral)
        so_far = [value + _by_row(cells.row, part, len(wo)) for part in (coarse, fine)]
        # an integral of a thousand does not need an accuracy of 1e-5; light that only one of the two rules hits does
        # not count
        scale = np.maximum(np.minimum(*[np.abs(total).max(1) for total in so_far]), 1.0)
        allowed = (tolerance / 400.0 * scale)[cells.row]  # several hundred cells contribute to the error
        # a step that crosses many cells, such as the rim of a cone about the normal, may cause the same error of a rule
        # in all of them, and in all Gauss rules if the step is close to the rims of the cells
        signed = np.stack([coarse, _joined(other.integral)]) - fine
        difference = np.maximum(*np.abs(signed))
        difference += 0.02 * _joined(step_aside(inner, other)[:, None])  # errors at steps cancel in part
        small = errors.with_cells(cells.row, signed, difference).total().max(1) < BUDGET * tolerance * scale
        divide = (difference.max(1) > allowed) & ~small[cells.row]
        missed = points.missed_by(cells.area, 4.0 * inner.most.reshape(-1, 4).max(1))
        single = points.single(len(missed))
        by_samples = (missed > allowed) & (difference.max(1) < FAINT * missed)
        done = shown & single & ~by_samples
        unseen += np.bincount(cells.row[done], points.light_in(len(done))[done], len(wo))
        shown = by_samples & single
        difference += missed[:, None]
        divide |= missed > allowed
        if depth == DEPTH - 1 or 16 * divide.sum() > MAX_CELLS:
            divide[:] = False
        done = ~divide
        value += _by_row(cells.row[done], fine[done], len(wo))
        errors = errors.with_cells(cells.row[done], signed[:, done], difference[done])
        if not divide.any():
            break
        points = _within(points, cells, divide, way)
        next_ = np.repeat(divide, 4)
        cells, way = fine_cells.take(next_), ways[next_]
        way[points.missed_by(cells.area, inner.most[next_]) > 0.0] = QUADRANTS
        shown = np.repeat(shown[divide], 4)
        coarse = inner.integral[next_]
    return value, errors.total(), unseen


def _joined(quarters: np.ndarray) -> np.ndarray:
    """The sums (M, C) of values (4 M, C) over the four quarters of each cell, ten times as fast as with `sum`."""
    return quarters[0::4] + quarters[1::4] + quarters[2::4] + quarters[3::4]


def _by_row(row: np.ndarray, values: np.ndarray, count: int) -> np.ndarray:
    """The sums (count, C) of the values (M, C) of cells, by the index (M,) of their wo."""
    return np.stack([np.bincount(row, column, count) for column in values.T], -1)


class _Errors:
    """The errors of the cells that are not divided, summed per integral and channel, (N, C).

    Along a discontinuity, the errors of the cells have both signs and mostly cancel, so the estimate contains three
    standard errors of their sum. If the discontinuity is parallel to the edges of the cells, it causes the same error
    in all of them, so the estimate also contains the sum itself, from the rule for which it is larger.
    """

    def __init__(self, count: int, channels: int) -> None:
        self.sums = np.zeros((2, count, channels))
        self.squares = np.zeros((count, channels))

    def with_cells(self, row: np.ndarray, signed: np.ndarray, size: np.ndarray) -> _Errors:
        """The sums after M more cells have been added.

        row     index of wo, (M,)
        signed  differences of the two rules, (2, M, C)
        size    size of the error, (M, C)
        """
        count, channels = self.squares.shape
        more = _Errors(count, channels)
        for k in range(channels):
            more.squares[:, k] = self.squares[:, k] + np.bincount(row, size[:, k] ** 2, count)
            for rule in range(2):
                more.sums[rule, :, k] = self.sums[rule, :, k] + np.bincount(row, signed[rule, :, k], count)
        return more

    def total(self) -> np.ndarray:
        return np.asarray(np.abs(self.sums).max(0) + 3.0 * np.sqrt(self.squares))


def _within(points: Points, cells: _Cells, divided: np.ndarray, way: np.ndarray) -> Points:
    """The points in divided cells, with the indices of the quarters of these cells."""
    inside = divided[points.cell]
    cell, at = points.cell[inside], points.at[inside]
    parts = WAYS[way[cell]]
    place = np.floor((at - cells.low[cell]) / cells.size[cell] * parts).astype(int).clip(0, parts - 1)
    quarter = 4 * (np.cumsum(divided) - 1)[cell] + place[:, 0] + parts[:, 0] % 4 * place[:, 1]
    return Points(quarter, at, points.density[inside], points.light[inside])


def _seeded(sample: Sampler, integrand: Integrand, wo: np.ndarray, seed: int, per: int) -> tuple[_Cells, Points]:
    """The initial cells, which are divided around the mirror direction, around wo, and around those of `per` samples
    for each wo that carry light; and these samples in the cells."""
    n_theta, n_phi = FIRST
    corner = np.stack(np.meshgrid(np.arange(n_theta), np.arange(n_phi), indexing="ij"), -1).reshape(-1, 2) * FIRST_SIZE
    row, side, cell = np.meshgrid(np.arange(len(wo)), [1.0, -1.0], np.arange(len(corner)), indexing="ij")
    cells = _Cells(row.ravel(), side.ravel(), corner[cell.ravel()], np.broadcast_to(FIRST_SIZE, (row.size, 2)).copy())
    rng = np.random.default_rng([seed, 77])
    many = np.repeat(wo, per, axis=0)
    drawn = sample(many, rng.random((len(many), 3)).astype(np.float32).clip(max=ALMOST_ONE).astype(float))
    good = (drawn.pdf > 0.0) & ~drawn.delta & (np.abs(np.linalg.norm(drawn.wi, axis=1) - 1.0) < OFF)
    value = _summed(integrand, many, np.where(good[:, None], drawn.wi, UP))
    good &= value > 0.0
    value, light = value[good], value[good] / (drawn.pdf[good] * per)
    mirror = wo * np.array([-1.0, -1.0, 1.0])
    likely = np.concatenate([drawn.wi[good], mirror, wo, -wo])
    owner = np.concatenate([np.repeat(np.arange(len(wo)), per)[good], *([np.arange(len(wo))] * 3)])
    angles = np.stack(
        [np.arctan2(np.hypot(likely[:, 0], likely[:, 1]), np.abs(likely[:, 2])),
         np.arctan2(likely[:, 1], likely[:, 0]) % (2.0 * np.pi)], -1
    )  # fmt: skip
    below = (likely[:, 2] < 0.0).astype(int)
    crowd = np.where(np.arange(len(likely)) < len(value), 1.0, CROWD * per)  # each other direction divides its cell
    homes, first = np.zeros(len(likely), int), 0
    left = np.arange(len(likely))  # points in cells that are not accepted yet
    accepted: list[_Cells] = []
    for level in range(SEEDED):
        # one integer identifies the cell of a point: row, side, and the two coordinates of the cell
        most = np.array(FIRST) * 2**level
        point = _key(owner[left], below[left], angles[left] / FIRST_SIZE * 2**level, most)
        mine = _key(cells.row, (cells.side < 0).astype(int), np.round(cells.low / cells.size), most)
        order = np.argsort(mine)
        cell = order[np.searchsorted(mine[order], point)]
        crowded = np.bincount(cell, crowd[left], len(mine)) > CROWD * per - 0.5
        crowded &= level < SEEDED - 1
        homes[left] = first + (np.cumsum(~crowded) - 1)[cell]
        accepted.append(cells.take(~crowded))
        first += len(accepted[-1].row)
        left = left[crowded[cell]]
        cells = cells.take(crowded).quarters()
        if not len(left):
            break
    at = angles[: len(value)]
    points = Points(homes[: len(value)], at, value * np.sin(at[:, 0]), light)
    return _Cells(*[np.concatenate(parts) for parts in zip(*accepted, strict=True)]), points


def _summed(integrand: Integrand, wo: np.ndarray, wi: np.ndarray) -> np.ndarray:
    """The sum of the integrand's channels at pairs of directions, (N,); 0 where it is not finite."""
    types = backend.types("float64")
    values = list(integrand(backend.vector_of(wo, 3, types), backend.vector_of(wi, 3, types)))
    backend.drjit().eval(values)
    return np.nan_to_num(np.sum([backend.to_numpy(value, len(wi)) for value in values], axis=0), posinf=0.0)


def _key(row: np.ndarray, below: np.ndarray, at: np.ndarray, most: np.ndarray) -> np.ndarray:
    """The index of a cell among those of one size, from the index of wo, the side, and the integer position `at`,
    (M, 2), which is below `most`."""
    a, b = np.minimum(at.astype(np.int64), most - 1).T
    return np.asarray(((row.astype(np.int64) * 2 + below) * most[0] + a) * most[1] + b)


def _values(integrand: Integrand, wo: np.ndarray, cells: _Cells, *rules: Nodes) -> tuple[list[Seen], np.ndarray]:
    """The values of the integrand at the nodes of every cell, for each of several rules with ORDER^2 nodes, evaluated
    in one kernel; and the way to divide each cell, according to the first rule."""
    dr = backend.drjit()
    types = backend.types("float64")
    nodes = [backend.float_of(np.concatenate(column), types) for column in zip(*rules, strict=True)]
    each = len(rules[0].s)
    many = each * len(rules)
    parts = []
    chunk = (1 << 22) // many
    for start in range(0, len(cells.row), chunk):
        part = cells.take(np.arange(start, min(start + chunk, len(cells.row))))
        index = dr.arange(types.module.UInt32, len(part.row) * many)
        cell = index // many

        def of_cell(column: np.ndarray, cell: Scalar = cell) -> Scalar:
            return dr.gather(types.float, backend.float_of(column, types), cell)

        s, t, weight = (dr.gather(types.float, column, index % many) for column in nodes)
        width, height = of_cell(part.size[:, 0]), of_cell(part.size[:, 1])
        (sin, cos), (sin_phi, cos_phi) = (
            dr.sincos(of_cell(part.low[:, k]) + step * share) for k, step, share in ((0, width, s), (1, height, t))
        )
        wi = types.vec3(sin * cos_phi, sin * sin_phi, cos * of_cell(part.side))
        value = list(integrand(types.vec3(*[of_cell(column) for column in wo[part.row].T]), wi))
        area = sin * width * height
        weighed = [channel * (area * weight) for channel in value]
        summed = sum(value[1:], start=value[0]) * area
        dr.eval(weighed, summed)  # in one call, because each reduction would otherwise evaluate the integrand again
        sums = [dr.block_sum(channel, each) for channel in weighed]
        ends = [dr.block_reduce(op, summed, each) for op in (dr.ReduceOp.Min, dr.ReduceOp.Max)]
        # nodes are stored in rows of equal theta; the range along theta requires columns
        columns_first = dr.gather(
            types.float, summed, index - index % each + index % ORDER * ORDER + index % each // ORDER
        )
        ranges = [_range(along) for along in (columns_first, summed)]
        dr.eval(sums, ends, ranges)
        parts.append((np.stack([one.numpy() for one in sums], -1), *[one.numpy() for one in (*ends, *ranges)]))
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    per_rule = [Seen(*[column[number :: len(rules)] for column in columns[:3]]) for number in range(len(rules))]
    theta, phi = (column[:: len(rules)] for column in columns[3:])
    return per_rule, np.select([phi < ONE_WAY * theta, theta < ONE_WAY * phi], [ALONG_THETA, ALONG_PHI], QUADRANTS)


def _range(value: Scalar) -> Scalar:
    """The largest difference within groups of ORDER values, for each cell."""
    dr = backend.drjit()
    most, least = (dr.block_reduce(op, value, ORDER) for op in (dr.ReduceOp.Max, dr.ReduceOp.Min))
    return dr.block_reduce(dr.ReduceOp.Max, most - least, ORDER)
