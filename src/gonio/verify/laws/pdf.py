"""The pdf: the density of the samples."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from .. import directions, estimators, expectation, histogram, severity
from ..cells import place
from ..effort import Effort
from ..figures import SampleCells
from ..forensics import crowding, misplaced, mixture, rounded
from ..forensics.causes import nothing_below
from ..forensics.ratio import Cause
from ..subject import Subject
from ..verdict import Finding, Trial
from .base import Law, angles, pair_in_words, pairs, where_found

# The cosines and squared sines of these angles are not simple fractions. Steps of a material often lie at simple
# fractions, where the two precisions may take different sides.
ABOVE = (
    (0.0, 0.0),
    (12.0, 20.0),
    (31.0, 110.0),
    (44.0, 200.0),
    (61.0, 300.0),
    (76.0, 45.0),
    (85.0, 160.0),
    (89.5, 250.0),
)
BELOW = ((180.0, 0.0), (155.0, 70.0), (139.0, 190.0), (124.0, 280.0), (100.0, 15.0))  # 138.2 is glass's critical angle
OBLIQUE = ((50.0, 200.0), (75.0, 200.0))  # the second for the Fresnel term
FEW = Effort("cause", 0, 17, 0, 0, 1e-3)  # enough samples for an accuracy of one percent
PAIRS = 1 << 13  # pairs of directions used to find a cause
EXCESS = 1e-3  # tolerated excess of int pdf above 1
SUPPORT = 1e-4  # tolerated fraction of light where the pdf is 0
MIN_LIGHT = 1e-3  # smallest mean value relative to which that fraction is measured


class Pdf(Law):
    """int pdf dwi = 1 - the fraction of failed samples, pdf > 0 where eval > 0, and samples are distributed according
    to the pdf (chi-square test)."""

    number = 4
    samples = True
    name = "pdf"
    title = "pdf integrates to 1, covers eval, and is the density of the samples"
    meaning = "Multiple importance sampling weights samples incorrectly: energy is lost or gained, or noise persists."

    def judge(self, subject: Subject, effort: Effort, seed: int) -> Finding:
        parts: list[tuple[dict[str, object], Subject]] = [({}, subject)]
        parts += [({"alpha": width}, subject.replace(alpha=width)) for width in _widths(subject, effort)]
        finding = Finding(
            figure=0.0,
            tolerance=EXCESS,
            reason="the integral of the pdf is accurate to 1e-4; failed samples can only make it less than 1",
            allowed=f"{1.0 + EXCESS:g}",
        )
        lowest, misplaced, largest = 2.0, 0.0, ""
        for settings, part in parts:
            name = ", ".join(f"{k} = {v:g}" for k, v in settings.items())
            if not part.has_density:
                continue
            for tested in _chi_square(part, effort, seed):
                wo, cells = tested.wo, tested.cells
                where = f"{name + ', ' if name else ''}wo at {angles(wo)} degrees"
                for kind, p in tested.outcome._asdict().items():
                    finding.trials.append(Trial(p, f"{_KINDS[kind]}, {where}", _Repeat(part, wo, kind, effort, seed)))
                    # among several p-values of 0, the one with the most misplaced samples
                    off = float(np.abs((cells.expected - cells.observed).sum((1, 2))).max()) / cells.drawn
                    if p < lowest or (p == lowest == 0.0 and off > misplaced):
                        lowest, misplaced, finding.evidence = p, off, cells
                        finding.settings, finding.worst = settings, where
                for side, e, o in zip(tested.sides, cells.expected, cells.observed, strict=True):
                    claimed = float(e.sum()) / cells.drawn
                    if claimed > EXCESS and not o.any():
                        word = "above" if side > 0 else "below"
                        text = f"{UNUSED} {claimed:.2g} {word} the surface, where no samples are generated; {where}"
                        finding.notes[:] = finding.notes or [text]
                excess = max(tested.total - tested.error - 1.0, 0.0)
                if excess > finding.figure:
                    finding.figure = excess
                    largest = f"integral of the pdf = {tested.total:.4g} for {where}"
        finding.shown = (
            "delta lobes only" if lowest > 1.0 else f"lowest of {len(finding.trials)} p-values: {lowest:.2g}"
        )
        if finding.figure > EXCESS:
            finding.shown = largest
        _support(subject, finding, effort, seed)
        return finding

    def bias(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> severity.Bias:
        there = where_found(subject, finding)
        bias = estimators.sampling_bias(there, "pdf")
        held = crowding.blocks(finding.evidence) if isinstance(finding.evidence, SampleCells) else None
        crowd = crowding.crowd(there, held) if held is not None else ""
        if bias.grade is severity.Grade.INVISIBLE:
            where = crowding.unsampled(there) or crowd or "less than 0.1 % of all samples are misplaced"
            return dataclasses.replace(bias, kind="noise", where=where)
        return dataclasses.replace(bias, where=f"{bias.where}; {crowd}" if crowd else bias.where)

    def ratios(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> Iterator[Cause]:
        there = where_found(subject, finding)
        if not there.has_density:
            return
        wo, wi = pairs(there, PAIRS, seed)
        unsampled = nothing_below("eval", "pdf", wo, wi, there.eval(wo, wi), there.pdf(wo, wi)[:, None])
        if unsampled is not None:
            yield unsampled
        if there.stochastic or not isinstance(finding.evidence, SampleCells):
            return
        steps = rounded.named(there)
        if steps is not None:
            yield steps
        # at an oblique wo all cosines differ; at the normal (o.m) and cos_m are equal
        views = [view for side, view in (*((1, a) for a in OBLIQUE), (-1, BELOW[1])) if side in there.sides]
        oblique = directions.single(np.array([directions.at(*pair) for pair in views]).reshape(-1, 3))
        for view in oblique[oblique[:, 2] > 0.0][:, None]:
            if _reused(there, view, seed):
                yield Cause(
                    "does u.x select both the lobe and its direction, without being remapped to [0, 1) in between?",
                    "u.x twice",
                )
        oblique_tests = _chi_square(there, FEW, seed, oblique)
        for explain in (crowding.named, mixture.named, misplaced.named):
            for tested in oblique_tests:
                held = crowding.blocks(tested.cells)
                cause = explain(there, tested.cells, held, seed) if held is not None else None
                if cause is not None:
                    yield cause
        yield from _from_below(there, oblique_tests, seed)
        above = oblique[oblique[:, 2] > 0.0]
        for view in above[:, None]:
            clamped = _clamped(there, view, seed)
            if clamped:
                guess = "a clamped random number, which the pdf does not account for"
                yield Cause(f"{clamped}; possible mistake: {guess}", "u clamped")
        for note in finding.notes:
            if note.startswith(UNUSED):
                yield Cause(note, "pdf where no samples are generated")


UNUSED = "the pdf integrates to"  # start of the note about a side that is never sampled
ALL, LACKING = 0.995, 0.03  # least fraction of samples that do not fail, and of samples that the pdf lacks
MISSING = 0.01  # largest fraction of samples that the pdf predicts but that do not occur
STEEP = 0.7  # largest ratio of the pdf's deficit near the normal to its deficit at an oblique view


def _from_below(subject: Subject, tests: list[_Tested], seed: int) -> Iterator[Cause]:
    """Yield a cause if no sample fails, and the pdf predicts too few samples for some views and too many for none, by a
    deficit that increases with the angle of the view."""
    above = [tested for tested in tests if tested.wo[2] > 0.0]
    if len(above) < 2 or min(tested.cells.observed.sum() / tested.cells.drawn for tested in above) < ALL:
        return
    lacking = [1.0 - tested.total for tested in above]
    if lacking[-1] < max(LACKING, lacking[0]) or max(_missing(tested.cells) for tested in above) > MISSING:
        return
    near = _chi_square(subject, FEW, seed, directions.single(directions.at(np.array([ABOVE[1][0]]), ABOVE[1][1])))
    if near and 1.0 - near[0].total < STEEP * lacking[-1]:
        shares = ", ".join(f"{share:.2g} for wo at {angles(one.wo)}" for share, one in zip(lacking, above, strict=True))
        words = f"no sample fails, but the integral of the pdf is less than 1 (by {shares} degrees)"
        guess = "directions below the horizon that are mirrored or clamped instead of failing"
        yield Cause(f"{words}; possible mistake: {guess}", "samples from below")


def _missing(cells: SampleCells) -> float:
    """The fraction of samples that the pdf predicts in excess of those observed, where the excess is significant."""
    held = crowding.blocks(cells)
    if held is None:
        return 1.0
    expected = held.joined(held.expected)
    return float(np.maximum(expected - held.observed - 4.0 * np.sqrt(expected), 0.0).sum() / held.drawn)


SWEEP = 512  # values of one random number
TRIALS = 32  # values of the other two
JUMP = 0.2  # change of a direction from one value to the next that means another lobe
STILL = 1e-7  # change of a direction that counts as none


def _swept(subject: Subject, wo: np.ndarray, dimension: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Sampled directions (TRIALS, SWEEP, 3) for values of one random number in [0, 1), and whether each has a density.

    dimension  index of the random number that varies
    """
    u = np.repeat(directions.numbers(np.random.default_rng([seed, 45]), TRIALS), SWEEP, axis=0)
    u[:, dimension] = np.tile((np.arange(SWEEP) + 0.5) / SWEEP, TRIALS)
    s = subject.sample(np.repeat(wo, len(u), axis=0), u)
    return s.wi.reshape(TRIALS, SWEEP, 3), ((s.pdf > 0.0) & ~s.delta).reshape(TRIALS, SWEEP)


def _parts(wi: np.ndarray) -> list[slice]:
    """The parts of a sweep between values at which most directions jump because another lobe is chosen."""
    jumps = (np.abs(np.diff(wi, axis=1)).max(2) > JUMP).mean(0) > 0.7
    ends = [0, *(np.flatnonzero(jumps) + 1), wi.shape[1]]
    return [slice(first, last) for first, last in itertools.pairwise(ends)]


def _clamped(subject: Subject, wo: np.ndarray, seed: int) -> str:
    """A description of the ends of [0, 1), or of a lobe's part of it, near which a random number does not change the
    direction although it does elsewhere; "" if there are none."""
    for dimension, name in enumerate(("first", "second", "third")):
        wi, fine = _swept(subject, wo, dimension, seed)
        for part in _parts(wi):
            inside, usable = wi[:, part], fine[:, part]
            moves = np.abs(np.diff(inside, axis=1)).max(2) > STILL
            both = usable[:, 1:] & usable[:, :-1]
            if not both.size or both.mean() < 0.5 or (moves & both).sum() < 0.5 * both.sum():
                continue
            still = np.all(~moves | ~both, axis=0)  # for all values of the other two
            low = int(np.argmin(still)) if still[0] else 0
            high = int(np.argmin(still[::-1])) if still[-1] else 0
            below, above = low > 1 and both[:, :low].any(), high > 1 and both[:, -high:].any()
            if below or above:
                ends = [f"below {(part.start + low) / SWEEP:.2g}"] if below else []
                ends += [f"above {(part.stop - high) / SWEEP:.3g}"] if above else []
                return f"sampled directions do not change while the {name} random number is {' and '.join(ends)}"
    return ""


def _reused(subject: Subject, wo: np.ndarray, seed: int) -> bool:
    """Whether u.x chooses a lobe and then, without being remapped to [0, 1), also its direction. If so, within the
    lobe's part of [0, 1), the azimuth covers less than 2 pi, or the polar angle does not reach the middle of the lobe,
    which is at one end of [0, 1)."""
    wi, fine = _swept(subject, wo, 0, seed)
    if _misses_the_middle(wo[0], wi, fine):
        return True
    phi = np.arctan2(wi[..., 1], wi[..., 0])
    short = 0
    for row in range(TRIALS):
        jumps = np.flatnonzero((np.abs(np.diff(wi[row], axis=0)).max(1) > JUMP) | ~fine[row, 1:] | ~fine[row, :-1]) + 1
        for part in np.split(np.arange(SWEEP), jumps):
            length = len(part) / SWEEP
            covered = abs(np.sum((np.diff(phi[row, part]) + np.pi) % (2.0 * np.pi) - np.pi)) / (2.0 * np.pi)
            if 0.1 < length < 0.9 and abs(covered - length) < 0.02 and len(part) < SWEEP:
                short += 1
                break
    return short > 0.8 * TRIALS


ASIDE = np.cos(np.radians(8.0))  # cosine of the angle beyond which a direction is not near the middle of a lobe
MOVED = np.radians(10.0)  # smallest change of the polar angle over a part


def _misses_the_middle(wo: np.ndarray, wi: np.ndarray, fine: np.ndarray) -> bool:
    """Whether u.x changes the polar angle of a lobe over its part of [0, 1), but the direction never comes near the
    lobe's middle: the normal, the mirror direction, the normal as the half vector, or wo."""
    m = wi + wo
    m = m / np.maximum(np.linalg.norm(m, axis=-1, keepdims=True), 1e-9)
    cosines = [wi[..., 2], np.sum(wi * wo * [-1.0, -1.0, 1.0], axis=-1), np.abs(m[..., 2]), np.sum(wi * wo, axis=-1)]
    for part in _parts(wi):
        length = (part.stop - part.start) / SWEEP
        usable = fine[:, part].mean(1) > 0.5
        if not 0.1 < length < 0.9 or usable.sum() < TRIALS // 2:
            continue
        angles = [np.arccos(np.clip(cosine[usable, part], -1.0, 1.0)) for cosine in cosines]
        polar = [a for a in angles if np.mean(np.std(a, axis=0)) < 0.01 and np.ptp(a.mean(0)) > MOVED]
        if polar and all(np.cos(a.min()) < ASIDE for a in polar):
            return True
    return False


_KINDS = {
    "fine": "chi-square test",
    "coarse": "chi-square test with coarse cells",
    "others": "binomial test of the fraction of samples outside all histogram cells",
}


class _Repeat:
    """Repeats a test with another seed, which gives other cells and other samples."""

    def __init__(self, subject: Subject, wo: np.ndarray, kind: str, effort: Effort, seed: int) -> None:
        self.subject, self.wo, self.kind, self.effort, self.seed = (subject, wo, kind, effort, seed)

    def __call__(self) -> float:
        tested = _chi_square(self.subject, self.effort, self.seed + 7919, self.wo[None])
        return min((getattr(one.outcome, self.kind) for one in tested), default=1.0)


def _widths(subject: Subject, effort: Effort) -> list[float]:
    """The other values of alpha to test; none if there is no such parameter."""
    parameter = subject.parameters.get("alpha")
    if parameter is None or parameter.kind not in ("alpha", "float"):
        return []
    return [width for width in effort.widths if parameter.low <= width <= parameter.high]


class _Tested(NamedTuple):
    """The chi-square test of one wo: its p-values, int pdf and its error, and its cells on each side of the surface."""

    wo: np.ndarray
    outcome: histogram.Outcome
    total: float
    error: float
    cells: SampleCells
    sides: tuple[int, ...]


def _chi_square(subject: Subject, effort: Effort, seed: int, wo: np.ndarray | None = None) -> list[_Tested]:
    if wo is None:
        above, below = (ABOVE, BELOW) if effort.full else (ABOVE[:6:2], BELOW[1:4])
        views = [*(above if 1 in subject.sides else ()), *(below if -1 in subject.sides else ())]
        wo = directions.single(np.array([directions.at(*view) for view in views]).reshape(-1, 3))
    if not len(wo):
        return []
    grid = place(subject, wo, seed, effort.cells)
    if grid is None or not len(grid.wo):
        return []
    expected = expectation.expect(subject, grid, 0.1 * 2.0 ** (-0.5 * effort.log_samples))
    counts = histogram.count(subject, grid, effort.log_samples, seed)
    tested = []
    for i in range(len(grid.wo)):
        predicted = expected.cells[i] * counts.drawn
        cells = SampleCells(
            predicted, counts.cells[i], grid.rows[i], grid.columns[i], counts.drawn, grid.wo[i], grid.sides
        )
        outcome = histogram.compare(expected, counts, i, grid)
        tested.append(
            _Tested(grid.wo[i], outcome, float(expected.total[i]), float(expected.error[i]), cells, grid.sides)
        )
    return tested


def _support(subject: Subject, finding: Finding, effort: Effort, seed: int) -> None:
    """Check that pdf > 0 where eval > 0; otherwise, sampling misses this light."""
    if not subject.has_density:
        return
    wo, wi = pairs(subject, effort.pairs, seed)
    value, pdf = (subject.eval(wo, wi, precision=subject.best).max(1), subject.pdf(wo, wi, precision=subject.best))
    wanting = (value > 0.0) & ~(pdf > 0.0)
    total = float(np.sum(value[np.isfinite(value)]))
    # a density of a millionth is negligible compared with a delta lobe, which carries the light
    total = max(total, MIN_LIGHT * len(value))
    share = float(np.sum(value[wanting & np.isfinite(value)])) / total
    if np.any(pdf < 0.0):
        row = int(np.argmin(pdf))
        finding.problems.append(f"pdf is negative ({pdf[row]:.3g}); {pair_in_words(wo[row], wi[row])}")
    if share > SUPPORT:
        row = int(np.argmax(np.where(wanting, value, 0.0)))
        finding.problems.append(
            f"eval > 0 where pdf = 0, for {share:.2%} of the light; {pair_in_words(wo[row], wi[row])}"
        )
        finding.at = (wo[row], wi[row])
