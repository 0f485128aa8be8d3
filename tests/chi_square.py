"""The verifier's chi-square test (`gonio.verify.histogram`) of samples that a test has drawn itself."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from gonio.verify import cells, expectation, histogram, statistics

SUITE = 400  # chi-square tests in the whole suite: Sidak's correction keeps the chance of one false alarm at 1 %
SIGNIFICANCE = statistics.sidak(0.01, SUITE)


def p_value(samples: np.ndarray, valid: np.ndarray, density: Callable[[np.ndarray], np.ndarray]) -> tuple[float, float]:
    """How likely counts as far off as these are, and the density's integral.

    samples  directions (n, 3), each with whether it is `valid`; half of them place the cells, the others are counted
    density  pdf over directions (n, 3)
    """
    pilot, counted = samples[::2][valid[::2]], samples[1::2][valid[1::2]]
    drawn = len(valid[1::2])

    def pdf(_: np.ndarray, wi: np.ndarray) -> np.ndarray:
        return density(wi)

    grid = cells.place_around([pilot], np.array([[0.0, 0.0, 1.0]]), pdf)
    expected = expectation.expect(pdf, grid, 0.1 * drawn**-0.5)
    outcome = histogram.compare(expected, histogram.count_given(counted, drawn, grid), 0)
    lowest = min(outcome)
    return 1.0 - (1.0 - lowest) ** len(outcome), float(expected.total[0])
