"""The delta lobes of a BSDF, determined from its samples: their directions, carried light and probabilities.

`eval` is 0 for a delta lobe, but `sample` determines it completely: the direction, the probability (`pdf` of a delta
sample), and the light that it carries, weight x pdf, which does not depend on how the lobe is selected.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..ops import Mode, Precision
from . import directions
from .subject import Subject

DRAWN = 256  # samples per wo, in equal steps of the random number that selects the lobe
ENDS = (1e-7, 1e-5, 1e-4, 1e-3)  # further values near its ends, which select lobes of small probability
MAX_LOBES = 6  # per wo
NEAR = 1e-3  # directions that differ by less belong to one lobe


class Lobes(NamedTuple):
    """L lobes for each of N directions wo.

    valid   whether a direction has the lobe, (N, L)
    wi      direction of the lobe, (N, L, 3)
    weight  weight of its samples, (N, L, channels)
    pdf     its probability, as given by the samples, (N, L)
    eta     index on wi's side divided by that on wo's side, as given by the samples, (N, L)
    share   observed fraction of the samples, accurate to about 0.01, (N, L)
    """

    valid: np.ndarray
    wi: np.ndarray
    weight: np.ndarray
    pdf: np.ndarray
    eta: np.ndarray
    share: np.ndarray

    @property
    def carried(self) -> np.ndarray:
        """Light carried by each lobe, weight x pdf, (N, L, channels)."""
        return self.weight * self.pdf[..., None]

    def through(self, wo: np.ndarray) -> np.ndarray:
        """Whether each lobe is transmitted, (N, L)."""
        return self.valid & (self.wi[..., 2] * wo[:, None, 2] < 0.0)


def chosen(count: int, seed: int) -> np.ndarray:
    """Random numbers (n, 3) that select every lobe of one wo: the first number increases in `count` equal steps, and is
    then near both ends.

    seed  seed of the other two numbers
    """
    first = np.concatenate([(np.arange(count) + 0.5) / count, ENDS, 1.0 - np.array(ENDS)])
    u = directions.numbers(np.random.default_rng([seed, 31]), len(first))
    u[:, 0] = np.minimum(first, 0.99999994)
    return directions.single(u)


def of(
    subject: Subject, wo: np.ndarray, seed: int, mode: Mode = "radiance", precision: Precision | None = None
) -> Lobes:
    """The delta lobes for each wo (N, 3).

    seed       seed of the samples
    mode       as in `BSDF.sample`
    precision  precision of the samples; None for the highest
    """
    u = chosen(DRAWN, seed)
    n, k = len(wo), len(u)
    s = subject.sample(np.repeat(wo, k, axis=0), np.tile(u, (n, 1)), mode, precision)
    wi, weight = s.wi.reshape(n, k, 3), s.weight.reshape(n, k, -1)
    pdf, eta = s.pdf.reshape(n, k), s.eta.reshape(n, k)
    even = np.arange(k) < DRAWN  # samples in equal steps, whose fractions are probabilities
    left = s.delta.reshape(n, k) & (pdf > 0.0) & np.all(np.isfinite(wi), axis=2)
    rows = np.arange(n)
    parts: list[tuple[np.ndarray, ...]] = []
    while left.any() and len(parts) < MAX_LOBES:
        first = np.argmax(left, axis=1)
        there = left[rows, first]
        direction = wi[rows, first]
        # two orders of a grating may have the same direction; their probabilities distinguish them
        mine = (np.abs(wi - direction[:, None]).max(2) <= NEAR) & (
            np.abs(pdf - pdf[rows, first][:, None]) <= 1e-5 * pdf[rows, first][:, None]
        )
        share = np.mean((mine & left)[:, even], axis=1)
        parts.append((there, direction, weight[rows, first], pdf[rows, first], eta[rows, first], share))
        left &= ~mine & there[:, None]
    if not parts:
        empty = np.zeros((n, 0))
        return Lobes(empty.astype(bool), np.zeros((n, 0, 3)), np.zeros((n, 0, weight.shape[2])), empty, empty, empty)
    return Lobes(*[np.stack(part, axis=1) for part in zip(*parts, strict=True)])


def along(lobes: Lobes, wi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The total light, (N, channels), of the lobes along wi (N, 3), and whether there are any such lobes, (N,)."""
    mine = lobes.valid & (np.abs(lobes.wi - wi[:, None]).max(2) < NEAR)
    return np.sum(lobes.carried * mine[..., None], axis=1), mine.any(1)


def rows_of(lobes: Lobes, rows: np.ndarray) -> Lobes:
    """The lobes of the wo with the given indices."""
    return Lobes(*[part[rows] for part in lobes])
