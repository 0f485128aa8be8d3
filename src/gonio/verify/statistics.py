"""Probabilities of chance: chi-square, normal, binomial; Sidak's correction; Kolmogorov and Smirnov's distance."""

from __future__ import annotations

import math

import numpy as np


def chi_square_tail(statistic: float, degrees: int) -> float:
    """P(X >= statistic) of the chi-square distribution: Q(degrees / 2, statistic / 2)."""
    return gamma_tail(0.5 * degrees, 0.5 * statistic)


def gamma_tail(a: float, x: float) -> float:
    """Regularised upper incomplete gamma function Q(a, x), a > 0, to about 1e-12 (NumericalRecipes2007, sec. 6.2).

    Below x = a + 1 the series of 1 - Q, above it the continued fraction by Lentz's method. Both need some sqrt(a)
    steps next to the peak, so their number is bounded by that.
    """
    if not x > 0.0:
        return 1.0
    if math.isinf(x):
        return 0.0
    scale = math.exp(a * math.log(x) - x - math.lgamma(a))
    steps = int(20.0 * math.sqrt(a)) + 400
    if x < a + 1.0:
        term = total = 1.0 / a
        for n in range(1, steps):
            term *= x / (a + n)
            total += term
            if term < total * 1e-15:
                break
        return min(max(1.0 - total * scale, 0.0), 1.0)
    tiny = 1e-300
    b = x + 1.0 - a
    c, d = 1.0 / tiny, 1.0 / b
    h = d
    for n in range(1, steps):
        an = -n * (n - a)
        b += 2.0
        d = an * d + b
        d = 1.0 / (d if abs(d) > tiny else tiny)
        c = b + an / c
        c = c if abs(c) > tiny else tiny
        h *= d * c
        if abs(d * c - 1.0) < 1e-15:
            break
    return min(max(h * scale, 0.0), 1.0)


def normal_two_sided(z: float) -> float:
    """P(|Z| >= |z|) of the standard normal distribution."""
    return math.erfc(abs(z) / math.sqrt(2.0))


def poisson_tail(count: float, mean: float) -> float:
    """P(X >= count) of the Poisson distribution: 1 - Q(count, mean)."""
    return 1.0 if count <= 0 else 1.0 - gamma_tail(count, mean)


def binomial_two_sided(count: float, trials: float, probability: float) -> float:
    """How likely a count as far from its expectation is: normal where both outcomes are many, else Poisson."""
    mean = trials * probability
    rest = trials - mean
    if min(mean, rest) >= 25.0:
        return normal_two_sided((count - mean) / math.sqrt(mean * (1.0 - probability)))
    if mean > rest:
        count, mean = trials - count, max(rest, 0.0)
    upper = poisson_tail(count, mean)
    lower = gamma_tail(count + 1.0, mean)  # P(X <= count)
    return min(1.0, 2.0 * min(upper, lower))


def sidak(significance: float, tests: int) -> float:
    """Significance of each of that many tests, such that one false alarm in all has the given probability."""
    return -math.expm1(math.log1p(-significance) / max(tests, 1))


def uniformity(values: np.ndarray) -> float:
    """p-value of Kolmogorov and Smirnov's test of values in [0, 1] against the uniform distribution.

    The asymptotic series 2 sum (-1)^(k-1) exp(-2 k^2 t^2), t = (sqrt(n) + .12 + .11 / sqrt(n)) D (Stephens1970).
    """
    x = np.sort(np.asarray(values, float))
    n = len(x)
    steps = np.arange(n + 1) / n
    distance = max(np.max(steps[1:] - x), np.max(x - steps[:-1]))
    t = (math.sqrt(n) + 0.12 + 0.11 / math.sqrt(n)) * distance
    if t < 0.2:
        return 1.0
    k = np.arange(1, 101)
    return float(min(max(2.0 * np.sum((-1.0) ** (k - 1) * np.exp(-2.0 * (k * t) ** 2)), 0.0), 1.0))
