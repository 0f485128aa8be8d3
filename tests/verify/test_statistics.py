"""Probabilities against exact ones."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from gonio.verify import statistics
from scipy import stats


@pytest.mark.parametrize(("count", "trials", "probability"), [(30_400, 100_000, 0.3), (7, 32, 0.1), (0, 500, 0.01)])
def test_a_binomial_p_value_is_twice_the_smaller_exact_tail(count: int, trials: int, probability: float) -> None:
    law = stats.binom(trials, probability)
    exact = min(1.0, 2.0 * min(law.cdf(count), law.sf(count - 1)))
    assert statistics.binomial_two_sided(count, trials, probability) == pytest.approx(exact, rel=1e-8)


def test_what_is_certain_has_probability_one_and_what_cannot_be_none() -> None:
    assert statistics.binomial_two_sided(1000, 1000, 1.0) == 1.0
    assert statistics.binomial_two_sided(991, 1000, 1.0) == 0.0
    assert statistics.binomial_two_sided(0, 1000, 0.0) == 1.0
    assert statistics.chi_square_tail(0.0, 3) == 1.0


def test_sidaks_correction_keeps_the_whole_at_its_level() -> None:
    each = statistics.sidak(0.01, 250)
    assert 1.0 - (1.0 - each) ** 250 == pytest.approx(0.01, rel=1e-10)
    assert statistics.sidak(0.01, 1) == pytest.approx(0.01)


def test_scipy_waits_until_a_law_asks() -> None:
    code = "import sys, gonio.verify.run; sys.exit('scipy.special' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


@pytest.mark.parametrize("degrees", [1, 2, 59, 20_001])
def test_chi_square_tails_are_scipys(degrees: int) -> None:
    for off in (-5.0, -0.5, 0.0, 0.5, 5.0, 20.0):
        statistic = max(degrees + off * np.sqrt(2.0 * degrees), 0.01)
        assert statistics.chi_square_tail(statistic, degrees) == pytest.approx(
            stats.chi2.sf(statistic, degrees), rel=1e-9
        )
    assert statistics.chi_square_tail(np.inf, degrees) == 0.0


@pytest.mark.parametrize("trials", [7, 1 << 14, 1 << 23])
@pytest.mark.parametrize("probability", [1e-6, 0.3, 0.9999])
def test_binomial_tails_are_scipys(trials: int, probability: float) -> None:
    law = stats.binom(trials, probability)
    for off in (-6.0, -1.0, 0.0, 1.0, 6.0):
        count = int(np.clip(law.mean() + off * law.std(), 0, trials))
        exact = min(1.0, 2.0 * min(law.cdf(count), law.sf(count - 1)))
        assert statistics.binomial_two_sided(count, trials, probability) == pytest.approx(exact, rel=1e-6)
