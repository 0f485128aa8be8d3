"""Probabilities of the statistical tests. SciPy, which computes them, is loaded when it is first needed."""

from __future__ import annotations

import math


def chi_square_tail(statistic: float, degrees: int) -> float:
    """P(X >= statistic) of the chi-square distribution."""
    from scipy import special

    return float(special.chdtrc(degrees, statistic))


def normal_two_sided(z: float) -> float:
    """P(|Z| >= |z|) of the standard normal distribution."""
    return math.erfc(abs(z) / math.sqrt(2.0))


def binomial_two_sided(count: int, trials: int, probability: float) -> float:
    """Probability of a count as far from its expectation, on either side: twice the smaller tail."""
    from scipy import special

    at_most = special.bdtr(count, trials, probability)
    at_least = special.bdtrc(count - 1, trials, probability) if count > 0 else 1.0
    return min(1.0, 2.0 * float(min(at_most, at_least)))


def sidak(significance: float, tests: int) -> float:
    """Significance per test, such that the probability of a false alarm in all tests is the given one."""
    return -math.expm1(math.log1p(-significance) / max(tests, 1))
