"""The chi-square test: uniform p-values where the hypothesis holds, small ones where it does not."""

from __future__ import annotations

import gonio as go
import numpy as np
import pytest
from gonio.verify import cells, directions, expectation, histogram, statistics, subject, verify
from scipy import stats

WO = directions.single(directions.at(np.array([0.0, 45.0, 89.5]), np.array([0.0, 20.0, 200.0])))


def outcomes(
    model: go.BSDF, log_samples: int, seed: int, wo: np.ndarray = WO, size: tuple[int, int] = cells.CELLS
) -> list[histogram.Outcome]:
    one = subject.of(model)
    grid = cells.place(one, wo, seed, size)
    assert grid is not None
    expected = expectation.expect(one, grid, 0.1 * 2.0 ** (-0.5 * log_samples))
    counts = histogram.count(one, grid, log_samples, seed)
    assert np.all(counts.cells.sum((1, 2, 3)) + counts.others == counts.drawn)
    return [histogram.compare(expected, counts, row) for row in range(len(wo))]


@pytest.mark.sample(1)
@pytest.mark.parametrize("alpha", [0.005, 0.1, 1.0])
def test_a_right_model_is_not_rejected_at_any_width(alpha: float) -> None:
    lowest = min(min(o) for o in outcomes(go.Conductor.preset("Au", alpha=alpha), 20, 4))
    assert lowest > statistics.sidak(0.001, 9)


@pytest.mark.slow
def test_a_streak_that_is_narrower_than_cells_is_expected_where_the_samples_are() -> None:
    streak = go.Conductor(alpha=(0.0003, 0.2), ndf="beckmann")
    wo = directions.single(directions.at(np.array([61.0]), 300.0))
    assert min(min(o) for o in outcomes(streak, 16, 1, wo, (50, 100))) > statistics.sidak(0.001, 2)


def test_there_are_as_many_cells_as_promised() -> None:
    one = subject.of(go.Lambert(0.5))
    grid = cells.place(one, WO, 1)
    assert grid is not None
    assert grid.rows.shape[2] - 1 >= 100 and grid.columns.shape[3] - 1 >= 200


def test_the_kernel_counts_where_numpy_counts() -> None:
    one = subject.of(go.Conductor(alpha=0.3))
    grid = cells.place(one, WO[1:2], 1)
    assert grid is not None
    counts = histogram.count(one, grid, 14, 5)
    from gonio.ops import backend

    kind = backend.types("float32")
    index = backend.drjit().arange(kind.module.UInt32, 1 << 14)
    u = np.array(histogram.random_numbers(kind, index, 5).numpy()).T
    s = one.sample(np.repeat(WO[1:2], len(u), 0), u, precision="float32")
    wi = s.wi[s.pdf > 0].astype(np.float32)
    height, turn = cells.height(wi), cells.pseudo_angle(wi)
    row = np.clip(np.searchsorted(grid.rows[0, 0], height, "right") - 1, 0, cells.CELLS[0] - 1)
    expected = np.bincount(row, minlength=cells.CELLS[0])
    # a sample on an edge may be rounded to either side
    assert np.abs(counts.cells[0, 0].sum(1) - expected).sum() <= 6
    assert turn.min() >= 0 and turn.max() <= 4


@pytest.mark.slow
def test_p_values_over_a_hundred_seeds_are_uniform() -> None:
    found: list[list[float]] = [[], []]
    for seed in range(100):
        for o in outcomes(go.Conductor.preset("Au", alpha=0.2), 17, seed, WO[1:2]):
            found[0].append(o.fine)
            found[1].append(o.coarse)
    for values in found:
        assert stats.kstest(values, "uniform").pvalue > 0.01


@pytest.mark.slow
def test_rounding_of_directions_counts_for_nothing_in_cells_of_their_steps() -> None:
    narrow = go.Conductor(alpha=2.5e-4, ndf="beckmann")
    assert verify(narrow, law="pdf", seed=1).passed


@pytest.mark.sample(1)
@pytest.mark.parametrize("place", [0.03, 0.97])
def test_a_step_beside_the_edges_of_a_ring_of_cells_is_found(place: float) -> None:
    """The density of half of all directions is twice the others'; where it changes no cell's nodes lie beyond."""
    rng = np.random.default_rng(1)
    pilot = directions.on_side(directions.uniform(rng, 40_000), 1)
    wo = np.array([[0.0, 0.0, 1.0]])
    grid = cells.place_around([pilot], wo, lambda _, wi: np.ones(len(wi)))
    low, high = grid.rows[0, 0, 50:52].astype(float)
    edge = low + place * (high - low)

    def density(_: np.ndarray, wi: np.ndarray) -> np.ndarray:
        return np.where(1.0 - np.abs(wi[:, 2]) < edge, 2.0, 1.0) / (2.0 * np.pi * (1.0 + edge)) * (wi[:, 2] > 0.0)

    expected = expectation.expect(density, grid, 0.1 * 2.0**-10)
    assert expected.total[0] == pytest.approx(1.0, abs=3e-5)


def test_what_no_sample_has_shown_of_a_cell_adds_to_its_variance() -> None:
    """A cell with five times the expected samples fails, unless as much is known to be unseen."""
    cell = np.full((1, 1, 20, 40), 1.0 / 800.0)
    drawn = np.random.default_rng(1).multinomial(80_000, cell.ravel()).reshape(cell.shape)
    counts = histogram.Counts(drawn, np.zeros(1, int), 80_000)
    lacking, unseen = cell.copy(), np.zeros_like(cell)
    lacking[0, 0, 3, 7] = 0.2 / 800.0
    unseen[0, 0, 3, 7] = 0.8 / 800.0
    total = lacking.sum((1, 2, 3))
    without, known = (
        histogram.compare(expectation.Expectation(lacking, total, 1.0 - total, one), counts, 0)
        for one in (np.zeros_like(cell), unseen)
    )
    assert without.fine < 1e-6
    assert known.fine > 0.01
