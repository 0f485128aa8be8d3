"""Tail probabilities for the statistical tests.

`scipy.special` has these functions too, but takes 0.4 s to import, a tenth of the time of a quick run. Tests
compare the two.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

ROUNDING, TINY = 2.0**-50, 1e-300


def chi_square_tail(statistic: float, degrees: int) -> float:
    """P(X >= statistic) for the chi-square distribution, by the incomplete gamma function
    Q(degrees / 2, statistic / 2)."""
    a, x = 0.5 * degrees, 0.5 * statistic
    if not math.isfinite(x) or x <= 0.0:
        return 0.0 if x > 0.0 else math.nan if math.isnan(x) else 1.0
    scale = math.exp(a * math.log(x) - x - math.lgamma(a))
    if x < a + 1.0:  # DLMF 8.7.1
        term = total = 1.0 / a
        n = a
        while term > ROUNDING * total:
            n += 1.0
            term *= x / n
            total += term
        return 1.0 - scale * total
    # DLMF 8.9.2: the continued fraction's even part
    return scale * _fraction(x + 1.0 - a, lambda n: (n * (a - n), x + 2.0 * n + 1.0 - a))


def normal_two_sided(z: float) -> float:
    """P(|Z| >= |z|) for the standard normal distribution."""
    return math.erfc(abs(z) / math.sqrt(2.0))


def binomial_two_sided(count: int, trials: int, probability: float) -> float:
    """The two-sided p-value of a binomial count: twice the probability of the smaller tail, at most 1.

    trials       number of trials
    probability  probability of success in each trial
    """
    at_least = _beta(count, trials - count + 1, probability) if count > 0 else 1.0
    at_most = _beta(trials - count, count + 1, 1.0 - probability) if count < trials else 1.0
    return min(1.0, 2.0 * min(at_most, at_least))


def _beta(a: float, b: float, x: float) -> float:
    """The regularized incomplete beta function I_x(a, b)."""
    if x <= 0.0 or x >= 1.0:
        return float(x >= 1.0)
    if x > (a + 1.0) / (a + b + 2.0):  # where the fraction converges slowly
        return 1.0 - _beta(b, a, 1.0 - x)
    scale = math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b) + a * math.log(x) + b * math.log1p(-x)

    def terms(n: int) -> tuple[float, float]:  # DLMF 8.17.22
        m = n // 2
        if n % 2:
            return -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1)), 1.0
        return m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m)), 1.0

    return math.exp(scale) / a * _fraction(1.0, terms)


def _fraction(first: float, terms: Callable[[int], tuple[float, float]]) -> float:
    """1 / (first + a_1 / (b_1 + a_2 / (b_2 + ...))) with (a_n, b_n) = terms(n), by Lentz's method as modified by
    Thompson and Barnett, "Coulomb and Bessel functions of complex arguments and order", J. Comput. Phys. 64, 1986."""
    value = c = first or TINY
    d, change, n = 0.0, 2.0, 0
    while abs(change - 1.0) > ROUNDING:  # false for NaN
        n += 1
        a, b = terms(n)
        d = 1.0 / ((b + a * d) or TINY)
        c = (b + a / c) or TINY
        change = c * d
        value *= change
    return 1.0 / value


def sidak(significance: float, tests: int) -> float:
    """The significance of each of a number of tests for which `significance` is the probability of a false rejection in
    any of them."""
    return -math.expm1(math.log1p(-significance) / max(tests, 1))


# --------------------------------------------------------------------------- values of several bounces

STEPS = (0.0, 0.15, 0.3, 0.45, 0.6, 0.75, 0.9)


def is_power_series(rows: np.ndarray, noise: float, first_power: bool = True) -> bool:
    """Whether values are a power series in an albedo without negative coefficients, as for light that is reflected
    once, twice, and so on. A color that is gamma-decoded, or multiplied twice, gives a series without a first power.

    rows         values at the albedos STEPS, (7, N)
    noise        relative noise of the values
    first_power  whether the first power must occur; it does not in light that crosses five panes
    """
    moved = rows[-1] > rows[0] * (1.0 + 1e-6) + 1e-9 * rows.max(initial=0.0)
    if not moved.any():
        return False
    rows = rows[:, moved] / rows[-1, moved]
    first = rows[1] - rows[0]
    differences = rows
    for order in range(1, len(STEPS) - 1):  # all differences of such a sum are positive
        differences = np.diff(differences, axis=0)
        if np.mean((differences < -noise * 2.0**order).any(0)) > 1e-3:
            return False
    if not first_power:
        return True
    if not np.any(first > 0.0):
        return False
    # with powers of 1.1 and more, the first step is negligible
    return bool(np.median(first[first > 0.0] / (rows[2] - rows[1])[first > 0.0]) > 0.5)


LAYERS = 4  # maximum number of times that light passes a layer


def is_dimmed(rows: np.ndarray, noise: float) -> bool:
    """Whether values are a + b r + sum c_k (1 - r)^k for a reflectance r, with a + b r and all c_k >= 0, as for
    light that a layer reflects, plus light from below that passes through the layer several times. A color that is
    applied twice by mistake gives r^2, for which a < 0.

    rows   values at the reflectances STEPS, (7, N)
    noise  relative noise of the values
    """
    size = rows.max(0)
    rows = rows[:, size > 1e-6 * rows.max(initial=0.0)]
    if not rows.size:
        return False
    rows = rows / rows.max(0)
    r = np.asarray(STEPS)
    columns = np.stack([np.ones_like(r), r, *((1.0 - r) ** k for k in range(2, LAYERS + 1))], axis=1)
    solved = np.linalg.lstsq(columns, rows, rcond=None)[0]
    allowed = 100.0 * noise + 1e-9
    off = np.abs(columns @ solved - rows).max(0) > allowed
    negative = np.min([solved[0], solved[0] + solved[1], *solved[2:]], axis=0) < -100.0 * allowed
    return bool(np.mean(off | negative) < 1e-3)
