"""Pearson's chi-square test of samples on the sphere against a density, in cells that follow the samples.

A lobe of width .01 fills a millionth of the sphere, so fixed cells either miss it or number millions. Here half of
the draws, a training set, places the cells' edges (in the cosine, then in azimuth row by row), the other half is
counted. Edges never cross the horizon, where densities jump.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import stats

from sphere import joined

ROWS, COLUMNS, POINTS = 48, 48, 5
SUITE = 400  # chi-square tests in the whole suite: Sidak's correction keeps the chance of one false alarm at 1 %
SIGNIFICANCE = 1.0 - (1.0 - 0.01) ** (1.0 / SUITE)

_X, _W = np.polynomial.legendre.leggauss(POINTS)


def _edges(values: np.ndarray, low: float, high: float, count: int) -> np.ndarray:
    """Edges of cells over [low, high]: at quantiles of `values`, at equal steps, and at doubling distances from the
    middle of the values, so that in a power's tail a density changes by a bounded factor over a cell.
    """
    even = np.linspace(low, high, count // 3 + 1)
    inside = values[(values > low) & (values < high)]
    if len(inside) > 20:
        own = np.quantile(inside, np.linspace(0.0, 1.0, 2 * count // 3 + 1))
        first, middle, last = np.quantile(inside, [0.25, 0.5, 0.75])
        steps = max((last - first) / 4, 1e-7) * 1.7 ** np.arange(40)
        edges = np.concatenate([even, own, middle + steps, middle - steps, first + steps, last - steps])
        edges = np.unique(edges[(edges >= low) & (edges <= high)])
    else:
        edges = even
    edges = edges[np.concatenate([[True], np.diff(edges) > 1e-12])]
    edges[0], edges[-1] = low, high
    return edges


def _split(edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Legendre points and weights in every cell, (cells, POINTS)."""
    half = 0.5 * np.diff(edges)[:, None]
    return edges[:-1, None] + half * (1.0 + _X), half * _W


def p_value(samples: np.ndarray, valid: np.ndarray, density: Callable[[np.ndarray], np.ndarray]) -> tuple[float, float]:
    """How likely counts as far off as these are, and the density's integral.

    samples  directions (n, 3), each with whether it is `valid`; those that failed form a cell of their own
    density  pdf over directions (n, 3)
    """
    # near the pole float32's z has few levels: x and y tell more
    upright = np.sqrt(np.maximum(1.0 - samples[:, 0] ** 2 - samples[:, 1] ** 2, 0.0))
    z = np.where(np.abs(samples[:, 2]) > 0.7, np.copysign(upright, samples[:, 2]), samples[:, 2])
    samples = np.stack([samples[:, 0], samples[:, 1], z], -1)
    train, counted = samples[::2][valid[::2]], samples[1::2][valid[1::2]]
    drawn = len(valid[1::2])
    failed = drawn - len(counted)
    phi = [np.arctan2(s[:, 1], s[:, 0]) for s in (train, counted)]
    observed = []
    points, weights, shapes = [], [], []
    rows = np.concatenate([_edges(train[:, 2], -1.0, 0.0, ROWS), _edges(train[:, 2], 0.0, 1.0, ROWS)[1:]])
    row_points, row_weights = _split(rows)
    for i in range(len(rows) - 1):
        there = [(s[:, 2] >= rows[i]) & (s[:, 2] < rows[i + 1]) for s in (train, counted)]
        columns = _edges(phi[0][there[0]], -np.pi, np.pi, COLUMNS)
        column_points, column_weights = _split(columns)
        mu, azimuth = np.broadcast_arrays(row_points[i][None, :, None], column_points[:, None, :])
        points.append(joined(mu, azimuth).reshape(-1, 3))
        weights.append((row_weights[i][None, :, None] * column_weights[:, None, :]).ravel())
        shapes.append(len(columns) - 1)
        observed.append(np.histogram(phi[1][there[1]], columns)[0])
    values = density(np.concatenate(points)) * np.concatenate(weights)
    cells = np.add.reduceat(values, np.arange(0, len(values), POINTS * POINTS))
    expected_counts, counts = cells * drawn, np.concatenate(observed)
    integral = float(cells.sum())
    # cells of little expectation are joined, smallest first, as the test's distribution asks for
    order = np.argsort(expected_counts)
    expected, observed = [], []
    pool_e = pool_o = 0.0
    for e, o in zip(expected_counts[order], counts[order], strict=True):
        pool_e, pool_o = pool_e + e, pool_o + o
        if pool_e >= 40.0:
            expected.append(pool_e)
            observed.append(pool_o)
            pool_e = pool_o = 0.0
    expected_failed = max(drawn * (1.0 - integral), 0.0)
    expected.append(expected_failed + pool_e)
    observed.append(failed + pool_o)
    e, o = np.array(expected), np.array(observed)
    if e[-1] < 5.0:  # too few failures for a cell: a surplus of them is judged by Poisson's law
        surplus = stats.poisson.sf(o[-1] - 1, e[-1] + 1e-3 * np.sqrt(drawn)) if o[-1] else 1.0
        e, o = e[:-1], o[:-1]
    else:
        surplus = 1.0
    statistic = float(np.sum((o - e) ** 2 / e))
    return min(float(stats.chi2.sf(statistic, max(len(e) - 1, 1))), float(surplus)), integral
