"""The probabilities against SciPy's, and that p-values of true hypotheses are uniform."""

from __future__ import annotations

import numpy as np
import pytest
from gonio.verify import statistics
from scipy import special, stats


@pytest.mark.parametrize("degrees", [1, 2, 7, 100, 3_000, 30_000])
def test_the_chi_square_tail_is_scipys(degrees: int) -> None:
    for z in (-5.0, -2.0, 0.0, 2.0, 6.0):
        x = max(degrees + z * np.sqrt(2.0 * degrees), 0.01)
        assert statistics.chi_square_tail(x, degrees) == pytest.approx(stats.chi2.sf(x, degrees), rel=1e-7, abs=1e-15)


def test_the_incomplete_gamma_function_is_scipys_at_its_ends() -> None:
    for a, x in [(0.5, 0.0), (0.5, 1e-12), (0.5, 700.0), (1e-3, 1.0), (5.0, 5.0), (5.0, 6.0), (2.0, np.inf)]:
        assert statistics.gamma_tail(a, x) == pytest.approx(special.gammaincc(a, x), rel=1e-10, abs=1e-300)


def test_poisson_and_binomial_tails_are_scipys() -> None:
    assert statistics.poisson_tail(7, 3.2) == pytest.approx(stats.poisson.sf(6, 3.2), rel=1e-10)
    assert statistics.poisson_tail(0, 3.2) == 1.0
    n, p, count = 100_000, 0.3, 30_400
    exact = stats.binomtest(count, n, p).pvalue
    assert statistics.binomial_two_sided(count, n, p) == pytest.approx(exact, rel=0.02)
    assert statistics.binomial_two_sided(20, n, 1e-4) < 0.02
    assert statistics.binomial_two_sided(n, n, 1.0) == 1.0
    assert statistics.binomial_two_sided(n - 9, n, 1.0) == 0.0


def test_sidaks_correction_keeps_the_whole_at_its_level() -> None:
    each = statistics.sidak(0.01, 250)
    assert 1.0 - (1.0 - each) ** 250 == pytest.approx(0.01, rel=1e-10)
    assert statistics.sidak(0.01, 1) == pytest.approx(0.01)


def test_uniformity_is_scipys_test_of_kolmogorov_and_smirnov() -> None:
    rng = np.random.default_rng(3)
    for values in (rng.random(100), rng.random(400) ** 1.3, np.linspace(0.005, 0.995, 100)):
        assert statistics.uniformity(values) == pytest.approx(stats.kstest(values, "uniform").pvalue, abs=0.01)
