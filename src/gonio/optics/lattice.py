"""Low-discrepancy points: the R sequence, whose steps are inverse powers of the root of x^(d + 1) = x + 1 (Roberts
2018)."""

from __future__ import annotations

import numpy as np

ROOTS = {3: 1.2207440846057596, 4: 1.1673039782614187}  # roots of x^4 = x + 1 and x^5 = x + 1


def r_steps(dimensions: int) -> np.ndarray:
    """The steps of the sequence in each of its 3 or 4 dimensions."""
    return ROOTS[dimensions] ** -np.arange(1.0, dimensions + 1.0)


def r_sequence(count: int, dimensions: int, shift: float = 0.0) -> np.ndarray:
    """Points 1 to `count` of the sequence, shifted by `shift` modulo 1, (count, dimensions)."""
    return (np.arange(1, count + 1)[:, None] * r_steps(dimensions) + shift) % 1.0
