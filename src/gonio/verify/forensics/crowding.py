"""The difference between samples and pdf: its location, its size, and the factor that would remove it.

The samples are the reference: the cells of the chi-square test contain their counts, and the expectation by the pdf is
multiplied by each factor of the table. The first factor that leaves no difference, in the cells of one wo and in int
pdf for all others, is the cause.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from ...energy.albedo import cubature
from .. import directions, estimators, severity
from ..cells import boxes, direction
from ..figures import SampleCells
from . import factors
from .factors import Factor, Field
from .ratio import NUMBERS, Cause, written

if TYPE_CHECKING:
    from ..subject import Subject

BLOCK = 10  # rows and columns of cells per block: differences stand out from noise in few, well-filled blocks
FULL = 25.0  # smallest expectation of a block
EFFECT = 0.02  # RMS of the relative difference of samples and expectation below which they agree
KNOWN = 0.004  # tolerance of a known number; 2^17 samples determine a scale to a third of a percent
DRAWN, LOST = 1 << 14, 0.02  # samples, and the accuracy of the fraction of them that fail
OVER = "the ratio of samples to pdf is"
BEFORE = 0.08  # smallest difference whose cause is determined


@dataclasses.dataclass(frozen=True)
class Blocks:
    """Blocks of cells of one wo.

    observed  number of samples in each block, (B,)
    wi        centers of the cells, (C, 3)
    area      their solid angles, (C,)
    expected  expected number of samples in each cell, (C,)
    block     index of each cell's block, (C,)
    """

    wo: np.ndarray
    observed: np.ndarray
    drawn: int
    wi: np.ndarray
    area: np.ndarray
    expected: np.ndarray
    block: np.ndarray

    def joined(self, values: np.ndarray) -> np.ndarray:
        """The sum of the cells' values (C,) over each block, (B,)."""
        return np.bincount(self.block, values, len(self.observed))


def blocks(cells: SampleCells) -> Blocks | None:
    """The cells of a chi-square test, combined into blocks; None if their wo is unknown."""
    if cells.wo is None:
        return None
    a, b, c, d = boxes(cells.rows, cells.columns)
    side = np.array(cells.sides, float)[:, None, None]
    wi = direction(0.5 * (a + b), 0.5 * (c + d), side).reshape(-1, 3)
    sides, rows, columns = c.shape
    number = np.arange(sides * (rows // BLOCK) * (columns // BLOCK)).reshape(sides, rows // BLOCK, columns // BLOCK)
    block = number.repeat(BLOCK, 1).repeat(BLOCK, 2).ravel()
    observed = np.bincount(block, cells.observed.ravel(), number.size)
    area = ((b - a) * (d - c)).ravel()
    return Blocks(cells.wo, observed, cells.drawn, wi, area, cells.expected.ravel(), block)


def crowd(subject: Subject, held: Blocks) -> str:
    """The largest difference of one sign between samples and pdf, its location, and the light in its cells, as text."""
    expected = held.joined(held.expected)
    off = (held.observed - expected) / np.sqrt(np.maximum(expected, FULL))
    sign = 1.0 if np.sum(np.maximum(off, 0.0) ** 2) >= np.sum(np.minimum(off, 0.0) ** 2) else -1.0
    rows = off * sign > 4.0
    if not rows.any():
        return ""
    e, o = float(expected[rows].sum()), float(held.observed[rows].sum())
    many = np.tile(held.wo, (len(held.wi), 1))
    light = np.nan_to_num(subject.eval(many, held.wi).mean(1), posinf=0.0, neginf=0.0) * held.area
    share = float(held.joined(light)[rows].sum() / max(light.sum(), 1e-30))
    worst = int(np.argmax(off * sign))
    inside = held.block == worst
    middle = np.average(held.wi[inside], axis=0, weights=held.expected[inside] + 1e-12 * held.area[inside])
    theta, phi = directions.angles(middle)
    if not e or o / e > 2.0:
        amount = f"{o / e:.2g} times as many samples as the pdf predicts" if e else "samples where the pdf is 0"
    else:
        amount = f"{severity.percent(abs(o / e - 1.0))} {'more' if o > e else 'fewer'} samples than the pdf predicts"
    cells = f"in cells with {severity.percent(share)} of the light"
    theta_o, phi_o = directions.angles(held.wo)
    return f"{amount} near wi at {theta:.3g}, {phi:.3g} degrees, {cells}, for wo at {theta_o:.3g}, {phi_o:.3g} degrees"


# --------------------------------------------------------------------------- the factor that would remove it


def named(subject: Subject, cells: SampleCells, held: Blocks, seed: int) -> Cause | None:
    """The factor by which samples and pdf differ, as a cause; None if none fits. For the arguments, see
    `mixture.named`."""
    light = estimators.of_subject(subject)
    total = float(held.observed.sum())
    for formula, guess, field, of_wo in _factors(subject):
        weighed = held.expected * field(np.broadcast_to(held.wo, held.wi.shape), held.wi)
        expected = held.joined(np.nan_to_num(weighed, posinf=0.0, neginf=0.0))
        inside = float(expected.sum())
        if inside <= 0.0 or total < 1000.0:
            return None
        scale = total / inside
        left = effect(expected * scale, held.observed)
        if formula == "1":
            before = float(np.hypot(left, np.log(scale)))
            if before < BEFORE:
                return None  # too small: any smooth factor would fit
            if abs(np.log(scale)) < 0.01:
                continue
        if left > EFFECT or left > 0.1 * before:
            continue
        if of_wo:
            words = f"{OVER} {formula} times a factor that depends only on wo, within {max(left, 1e-3):.0e}"
            return Cause(f"{words}; possible mistake: {guess}", f"samples {guess}")
        text = written(scale, KNOWN)
        text = text if text in NUMBERS else f"{scale:.3g}"
        plain = abs(scale - 1.0) < 0.01
        if not plain and formula != "1" and text not in NUMBERS:
            continue
        known = NUMBERS.get(text, 1.0 if plain else scale)
        if not _normalizes(subject, light, field, known):
            if formula == "1":
                return _number_of_wo(subject, held, scale)
            continue
        result = formula if plain else text if formula == "1" else f"{text} times {formula}"
        if text.startswith("1 / ") and formula.startswith("1 / "):
            result = f"1 / ({text[4:]} {formula[4:]})"
        agree = f"{OVER} {result}, within {max(left, 1e-3):.0e}, in the cells and in the integral of the pdf for all wo"
        return Cause(f"{agree}; possible mistake: {guess}", f"samples {result}")
    return _sides(held)


def _number_of_wo(subject: Subject, held: Blocks, scale: float) -> Cause:
    """The probable cause if samples follow the distribution of the pdf, but their number differs from the expectation
    by a factor that depends on wo."""
    agree = f"{OVER} {scale:.3g} for all wi, but has another value for other wo"
    u = directions.numbers(np.random.default_rng(46), DRAWN)
    s = subject.sample(np.broadcast_to(held.wo, (DRAWN, 3)), u)
    failed, lacking = float(np.mean(~(s.pdf > 0.0))), 1.0 - float(held.expected.sum()) / held.drawn
    if failed > max(lacking, 0.0) + LOST and not s.delta.any():
        share = f"{failed:.0%} of the samples fail, but the integral of the pdf is only {max(lacking, 0.0):.0%} below 1"
        guess = "are normals that face away from wo sampled, or directions below the horizon"
        return Cause(f"{agree}; {share}: {guess}?", "samples that fail")
    return Cause(f"{agree}; possible mistake: a wrong probability of choosing a lobe", "samples a number of wo")


def _normalizes(subject: Subject, light: estimators.Estimates, field: Field, scale: float) -> bool:
    """Whether the pdf times a factor integrates to the fraction of valid samples for every wo."""

    def weighed(o: np.ndarray, i: np.ndarray) -> np.ndarray:
        value = np.nan_to_num(subject.pdf(o, i) * field(o, i) * scale, posinf=0.0, neginf=0.0)
        return value[:, None]

    total = cubature.integrate(subject.sample, cubature.of_rows(weighed), light.wo, 1e-2).value[:, 0]
    return not np.any(np.abs(total - light.drawn) > 0.02 + 0.02 * light.drawn)


def _sides(held: Blocks) -> Cause | None:
    """A cause if samples and pdf agree within each side of the surface, but not on the fractions of the two sides."""
    expected = held.joined(held.expected)
    sides = held.joined(held.wi[:, 2] * held.area) > 0.0
    if sides.all() or not sides.any():
        return None
    scaled, shares = np.zeros_like(expected), []
    for side in (sides, ~sides):
        e, o = float(expected[side].sum()), float(held.observed[side].sum())
        if e <= 0.0 or o < 1000.0:
            return None
        scaled[side] = expected[side] * (o / e)
        shares.append(o / e)
    if effect(scaled, held.observed) > EFFECT or abs(np.log(shares[0] / shares[1])) < BEFORE:
        return None
    above, below = shares
    agree = f"{OVER} {above:.3g} above the surface and {below:.3g} below it, for all wi on each side"
    return Cause(f"{agree}; possible mistake: a wrong probability of reflection", "samples choose the side")


def effect(expected: np.ndarray, observed: np.ndarray) -> float:
    """The RMS of observed / expected - 1 in excess of the noise of the counts."""
    order = np.argsort(expected)
    low = expected[order] < FULL
    e = np.append(expected[order][~low], expected[order][low].sum())
    o = np.append(observed[order][~low], observed[order][low].sum())
    filled = e > 0.0
    if np.any(o[~filled] > 0.0):
        return np.inf
    square = float(np.sum((o[filled] - e[filled]) ** 2 / e[filled])) - filled.sum()
    return float(np.sqrt(max(square, 0.0) / max(observed.sum(), 1.0)))


def _factors(subject: Subject) -> Iterator[Factor]:
    """The candidate factors: constants, other sampling densities, and factors of the table, the simplest first."""

    def over_pdf(o: np.ndarray, i: np.ndarray, value: Callable[[np.ndarray, np.ndarray], Any]) -> np.ndarray:
        pdf = subject.pdf(o, i)
        return np.divide(value(o, i), pdf, out=np.zeros(len(o)), where=pdf > 0.0)

    densities: list[tuple[str, str, Callable[[np.ndarray, np.ndarray], Any]]] = [
        ("1 / pdf", "samples are uniform, but the pdf is not", lambda o, i: 1.0),
        ("cos_i / pdf", "samples are proportional to the cosine, but the pdf is not", lambda o, i: np.abs(i[:, 2])),
    ]
    yield Factor("1", "a constant of the pdf, or the probability of choosing a lobe", lambda o, i: np.ones(len(o)))
    for formula, guess, value in densities:
        yield Factor(formula, guess, functools.partial(over_pdf, value=value))
    if not subject.transmits:
        yield from factors.cosines(("(o.m)", "cos_m", "cos_i", "sin_i"))
    yield from factors.indices(subject, (2, -2, 4, -4), "eta^2 of the Jacobian of refraction", [*factors.SIDES])
    for text, guess, other in factors.widths(subject):
        yield Factor(f"(pdf with {text}) / pdf", guess, functools.partial(over_pdf, value=other.pdf))
    if not subject.transmits:
        yield from factors.distributions(subject)
    yield from factors.normals(subject)


def unsampled(subject: Subject) -> str:
    """A description of the views for which int pdf exceeds the fraction of valid samples; "" if there are none."""
    light = estimators.of_subject(subject)
    excess = light.claimed - light.drawn
    row = int(np.argmax(excess))
    theta = float(directions.angles(light.wo[row])[0])
    if excess[row] < 1e-3:
        return ""
    share = severity.percent(float(excess[row]))
    view = f"wo at {severity.degrees(theta)}"
    return f"the integral of the pdf exceeds the fraction of valid samples by {share} for {view}"
