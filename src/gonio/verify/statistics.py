"""Probabilities of the statistical tests. SciPy, which computes them, is loaded when it is first needed."""

from __future__ import annotations

import math

import numpy as np


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


# --------------------------------------------------------------------------- values of several bounces

STEPS = (0.0, 0.15, 0.3, 0.45, 0.6, 0.75, 0.9)


def is_power_series(rows: np.ndarray, noise: float, first_power: bool = True) -> bool:
    """Whether values are a sum of powers of an albedo with no negative factor: light that is reflected once, twice, and
    so on. A color that is decoded, or multiplied twice, has no first power.

    rows         values at the albedos STEPS, (7, N)
    noise        of the values, relative
    first_power  whether it must occur; light that crosses five panes has none
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


LAYERS = 4  # times that light may pass a layer


def is_dimmed(rows: np.ndarray, noise: float) -> bool:
    """Whether values are a + b r + sum c_k (1 - r)^k of a reflectance r, a + b r and all c_k >= 0: light of a layer,
    and light below that passes the layer several times. A color that is multiplied twice, r^2, has a < 0.

    rows   values at the reflectances STEPS, (7, N)
    noise  of the values, relative
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
