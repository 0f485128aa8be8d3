"""Lobes that are selected by a random number: their weights in the pdf compared with those of the samples.

A sweep finds the number that selects a lobe: the sampled direction jumps at one value of this number, regardless of the
other numbers. Samples below and above this value give histograms of two lobes, a(wi) and b(wi), and the expectation
by the pdf in the same blocks of cells is compared with

    x a + y b + ...                  constant weights
    s(wi) a + (1 - s(wi)) b          the probability s of the first lobe, evaluated at the sampled direction
"""

from __future__ import annotations

import numpy as np

from .. import directions
from ..cells import height, pseudo_angle
from ..figures import SampleCells
from ..subject import Subject
from .crowding import Blocks
from .ratio import Cause, written

SWEEP = 512  # values of the number that may select
TRIALS = 24  # values of the other two
JUMP = 0.15  # change of a direction from one value to the next that means another lobe
MOST = 4  # largest number of jumps
COMMON = 0.75  # fraction of the trials that must jump at the same value
SAMPLES = 1 << 18
EFFECT = 0.03  # largest RMS of the relative difference that is left
SHARE = 0.01  # smallest difference of two weights that counts
VIEWS = (2.0, 20.0, 35.0, 50.0, 60.0, 70.0, 78.0, 84.0, 88.0)  # degrees at which s is measured


def named(subject: Subject, cells: SampleCells, held: Blocks, seed: int) -> Cause | None:
    """The mistake in the weights of the lobes; None if there is only one lobe, or if weights do not explain it.

    cells  the cells of the chi-square test for one wo
    held   the same cells, combined into blocks
    seed   seed of the samples
    """
    choice = _choice(subject, held.wo, seed)
    if choice is None:
        return None
    dimension, ends = choice
    shares = np.diff([0.0, *ends, 1.0])
    u = directions.numbers(np.random.default_rng([seed, 46]), SAMPLES)
    s = subject.sample(np.repeat(held.wo[None], SAMPLES, axis=0), u)
    drawn = (s.pdf > 0.0) & ~s.delta & np.isfinite(s.wi).all(1)
    number = np.searchsorted(ends, u[:, dimension], side="right")
    place = _blocks_of(s.wi, cells, held)
    lobes = np.stack(
        [
            np.bincount(place[drawn & (place >= 0) & (number == k)], minlength=len(held.observed)) / (SAMPLES * share)
            for k, share in enumerate(shares)
        ]
    )
    expected = held.joined(held.expected) / held.drawn
    weights = _weights(lobes, expected)
    off = float(np.abs(weights - shares).max())
    if off > SHARE and _effect(weights @ lobes, expected) < EFFECT:
        return _of_weights(weights, shares)
    if len(shares) != 2 or off < SHARE or not subject.isotropic or subject.transmits:
        return None
    other = _share_at(subject, held.wi, dimension, seed)
    if other is None or np.ptp(other) < SHARE:
        return None
    mean = held.joined(other * held.expected) / np.maximum(held.joined(held.expected), 1e-30)
    if _effect(mean * lobes[0] + (1.0 - mean) * lobes[1], expected) < 2.0 * EFFECT:
        words = "the pdf weights the two lobes by the probability that the samples have for wo = wi"
        guess = "the probability of a lobe is evaluated at wi in the pdf, but at wo in sample"
        return Cause(f"{words}; possible mistake: {guess}", "share of wi")
    return None


def _of_weights(weights: np.ndarray, shares: np.ndarray) -> Cause | None:
    """The mistake that the weights of the lobes in the pdf suggest, given the lobes' fractions of the samples."""
    given, chosen = (", ".join(f"{w:.3g}" for w in part) for part in (weights, shares))
    words = f"the pdf weights the lobes by {given}, but they are sampled with probabilities {chosen}"
    if np.abs(weights[::-1] - shares).max() < SHARE:
        guess = "exchanged weights"
    elif abs(weights.sum() - 1.0) < SHARE:
        guess = "different probabilities in pdf and sample"
    else:
        ratios = weights / shares
        wrong = np.flatnonzero(np.abs(weights - shares) > 0.5 * SHARE)
        if len(wrong) != 1 or ratios[wrong[0]] < 0.05:
            return None
        number = wrong[0] + 1
        words += (
            f"; the density of lobe {number} is {written(float(ratios[wrong[0]]), 0.004)} times that of its samples"
        )
        return Cause(f"{words}: is its normalization or its probability missing, or squared?", "weights of lobes")
    return Cause(f"{words}; possible mistake: {guess}", "weights of lobes")


def _choice(subject: Subject, wo: np.ndarray, seed: int) -> tuple[int, np.ndarray] | None:
    """The index (0, 1 or 2) of the random number that selects one of several lobes, and the values at which the next
    lobe begins."""
    for dimension in range(3):
        u = np.repeat(directions.numbers(np.random.default_rng([seed, 47]), TRIALS), SWEEP, axis=0)
        u[:, dimension] = np.tile((np.arange(SWEEP) + 0.5) / SWEEP, TRIALS)
        s = subject.sample(np.repeat(wo[None], len(u), axis=0), u)
        wi = np.where((s.pdf > 0.0)[:, None], s.wi, 0.0).reshape(TRIALS, SWEEP, 3)
        jumps = np.mean(np.abs(np.diff(wi, axis=1)).max(2) > JUMP, axis=0)
        at = np.flatnonzero(jumps > COMMON)
        if 0 < len(at) <= MOST:
            return dimension, (at + 1.0) / SWEEP
    return None


def _share_at(subject: Subject, wi: np.ndarray, dimension: int, seed: int) -> np.ndarray | None:
    """The probability of the first lobe of an isotropic material for wo = wi, (C,); None if no selection is found."""
    shares = []
    for theta in VIEWS:
        choice = _choice(subject, directions.single(directions.at(np.array([theta]), 30.0))[0], seed)
        if choice is None or choice[0] != dimension or len(choice[1]) != 1:
            return None
        shares.append(float(choice[1][0]))
    theta = np.degrees(np.arccos(np.clip(np.abs(wi[:, 2]), 0.0, 1.0)))
    return np.asarray(np.interp(theta, VIEWS, shares))


def _blocks_of(wi: np.ndarray, cells: SampleCells, held: Blocks) -> np.ndarray:
    """The index of each direction's block, (N,); -1 outside all cells."""
    place = np.full(len(wi), -1)
    _, rows, columns = cells.expected.shape
    for side, sign in enumerate(cells.sides):
        on = np.flatnonzero(wi[:, 2] * sign > 0.0)
        row = np.searchsorted(cells.rows[side], height(wi[on]), side="right") - 1
        turn = pseudo_angle(wi[on])
        for number in range(rows):
            mine = on[row == number]
            column = np.searchsorted(cells.columns[side][number], turn[row == number], side="right") - 1
            inside = (column >= 0) & (column < columns)
            place[mine[inside]] = held.block[(side * rows + number) * columns + column[inside]]
    return place


def _weights(lobes: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """The weights (K,) with which the lobes (K, B) sum to the expectation (B,), by noise-weighted least squares."""
    scale = 1.0 / np.sqrt(np.maximum(expected, 1e-6))
    return np.asarray(np.linalg.lstsq((lobes * scale).T, expected * scale, rcond=None)[0])


def _effect(fitted: np.ndarray, expected: np.ndarray) -> float:
    """The RMS of fitted / expected - 1 over well-filled blocks, in excess of the noise of `fitted`."""
    filled = expected * SAMPLES > 100.0
    if not filled.any():
        return np.inf
    off = np.sum((fitted - expected)[filled] ** 2 / expected[filled]) - 2.0 * filled.sum() / SAMPLES
    return float(np.sqrt(max(off, 0.0) / max(float(expected[filled].sum()), 1e-30)))
