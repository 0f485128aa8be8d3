"""Detection of a cosine that is rounded to few bits, so that values change in equal steps of it.

In half precision, 1 - cos^2 has few correct digits if cos is close to 1, and the peak of a narrow lobe becomes a disk
with rings. Along a line on which the cosine decreases evenly, the values of such a lobe are constant except for jumps
at equal distances.
"""

from __future__ import annotations

import numpy as np

from .. import directions
from ..subject import Subject
from .ratio import Cause

ALONG = 1 << 13  # directions along the line
RANGE = 0.02  # of the cosine, from 1 down: 11 degrees
LEAST = 5  # smallest number of jumps
SHARP = 30.0  # ratio of a jump to the median change from one direction to the next
STEPPED = 0.8  # smallest fraction of the total change that occurs in jumps
EQUAL = 0.1  # largest relative spread of the distances between jumps


def named(subject: Subject) -> Cause | None:
    """A cause that names the rounded cosine; None if values change smoothly, or in unequal steps."""
    wo = directions.at(np.array([30.0]), 20.0)[0]
    cos = 1.0 - RANGE * (np.arange(ALONG) + 0.5) / ALONG
    axes = {
        "the half vector's cosine": np.array([0.0, 0.0, 1.0]),
        "the cosine to the mirror direction": wo * [-1, -1, 1],
    }
    for name, axis in axes.items():
        across = np.cross(wo, [0.0, 0.0, 1.0])
        across /= np.linalg.norm(across)
        line = cos[:, None] * axis + np.sqrt(1.0 - cos**2)[:, None] * across
        wi = 2.0 * np.sum(line * wo, axis=1, keepdims=True) * line - wo if "half" in name else line
        value = subject.eval(np.broadcast_to(wo, wi.shape), wi).mean(1)
        if not np.all(value > 0.0):
            continue
        change = np.abs(np.diff(np.log(value)))
        jumps = np.flatnonzero(change > SHARP * max(float(np.median(change)), 1e-12))
        distances = np.diff(cos[jumps])
        if len(jumps) < LEAST or change[jumps].sum() < STEPPED * change.sum():
            continue
        step = float(-np.mean(distances))
        if np.std(distances) < EQUAL * step:
            words = f"values change only in steps of {step:.2g} of {name}"
            return Cause(f"{words}: is it rounded to {np.log2(1.0 / step):.0f} bits, as in half precision?", "rounded")
    return None
