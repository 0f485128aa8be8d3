"""Delta lobes: mirrors and smooth glass obey Snell's law, Fresnel's equations and reciprocity."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .. import directions, estimators, lobe_checks, lobes, severity, statistics
from ..effort import Effort
from ..forensics.ratio import Cause
from ..lobe_checks import Miss, Probe
from ..lobes import Lobes
from ..subject import Subject
from ..verdict import DoesNotApply, Finding, Trial
from .base import Law, angles

EXACT = 1e-6
CHECKS = (
    lobe_checks.direction,
    lobe_checks.indices,
    lobe_checks.modes,
    lobe_checks.way_back,
    lobe_checks.fresnel,
    lobe_checks.rotation,
    lobe_checks.tint,
)
CHECKS64 = (lobe_checks.float32, lobe_checks.derivatives)  # for models with float64


class DeltaLobes(Law):
    """A delta lobe lies in the mirror direction or follows Snell's law, has the factor (eta_o / eta_i)^2 in radiance,
    reflects by Fresnel's equations for its own index, is reciprocal, and is sampled with the stated probability."""

    number = 10
    samples = True
    name = "delta"
    title = "delta lobes obey Snell's law, Fresnel's equations and reciprocity"
    meaning = "Mirror images and views through glass are displaced, too bright or too dark."

    def judge(self, subject: Subject, effort: Effort, seed: int) -> Finding:
        wo = _views(subject, effort, seed)
        radiance = lobes.of(subject, wo, seed)
        power = lobes.of(subject, wo, seed, "importance") if subject.transmits else radiance
        if not radiance.valid.any() and not power.valid.any():
            raise DoesNotApply("the material has no delta lobes")
        if subject.perturbs_normal:
            raise DoesNotApply("the material perturbs the normal, but the law refers to the surface normal")
        exact = subject.best == "float64"
        tolerance = EXACT if exact else lobe_checks.SINGLE
        finding = Finding(
            figure=0.0,
            tolerance=tolerance,
            reason="a few rounding errors" if exact else "a few rounding errors of float32",
            shown=_count(radiance),
        )
        probe = Probe(subject, wo, radiance, power, seed)
        misses: list[Miss] = []
        finding.details = misses
        for check in (*CHECKS, *(CHECKS64 if exact else ())):
            miss = max(check(probe), key=lambda one: one.size, default=None)
            if miss is None or not miss.size > tolerance:
                continue
            misses.append(miss)
            finding.problems.append(f"{miss.text} ({_pair(miss)})")
        if misses:
            worst = max(misses, key=lambda miss: miss.size)
            finding.figure = worst.size
            finding.shown = f"error {worst.size:.2g}" if np.isfinite(worst.size) else "a lobe is missing"
            finding.worst = _pair(worst)
        finding.trials += _frequencies(subject, effort, seed)
        return finding

    def bias(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> severity.Bias:
        """The fraction of a lobe's light that goes in a wrong direction, is in excess, or is missing."""
        misses: list[Miss] = finding.details  # type: ignore[assignment]
        if not misses:
            return estimators.sampling_bias(subject)  # chosen more or less often than stated
        worst = max(misses, key=lambda miss: miss.average)
        where = f"wo at {angles(worst.wo)} degrees, in the delta lobe"
        size, average = min(worst.size, 1.0), min(worst.average, 1.0)
        return severity.Bias(size, average, worst.share, where, "bias")

    def ratios(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> Iterator[Cause]:
        for miss in finding.details:  # type: ignore[attr-defined]
            if miss.cause:
                yield Cause(miss.cause, miss.cause)
        power = lobes.of(subject, _views(subject, effort, seed), seed, "importance")
        words = _choice(power.share[power.valid], power.pdf[power.valid], power.carried[power.valid])
        if words:
            yield Cause(words, words)


def _choice(share: np.ndarray, pdf: np.ndarray, carried: np.ndarray) -> str:
    """The mistake in the frequency of lobes, in their stated probability or in their weight; "" if none is evident."""
    sampled = (share > 0.02) & (pdf > 0.0)
    if sampled.sum() < 8:
        return ""
    share, pdf, weight = share[sampled], pdf[sampled], (carried[sampled] / pdf[sampled][:, None]).max(1)
    if np.all(np.abs(pdf - 1.0) < 1e-6) and np.mean(share < 0.97) > 0.2:
        words = "the pdf of delta samples is 1, but only some samples are delta samples"
        return f"{words}; possible mistake: the probability of the lobe is missing"
    factor = weight / pdf
    if np.ptp(pdf) > 0.1 and np.ptp(factor) < 1e-3 * factor.mean():
        words = "the weight of delta samples is proportional to the probability of the lobe"
        return f"{words}; possible mistake: the division by this probability is missing"
    off = np.abs(share - pdf)
    if np.mean(off > 0.03) > 0.2:
        row = int(np.argmax(off))
        words = f"a lobe is chosen with probability {share[row]:.2g}, but its pdf is {pdf[row]:.2g}"
        clamped = off > 0.03
        one = float(np.median(share[clamped]))
        if np.abs(share[clamped] - one).max() < 0.02 or np.abs(share[clamped] - 1.0 + one).max() < 0.02:
            return f"{words}: is the probability clamped in one of the two?"
        return f"{words}; possible mistake: two different formulas for the probability"
    return ""


def _count(part: Lobes) -> str:
    most = int(part.valid.sum(1).max(initial=0))
    return "1 lobe" if most == 1 else f"{most} lobes"


def _pair(miss: Miss) -> str:
    return f"wo at {angles(miss.wo)}, wi at {angles(miss.wi)} degrees"


def _views(subject: Subject, effort: Effort, seed: int) -> np.ndarray:
    """Directions wo, from the normal to 89 degrees, on each side of the surface that reflects or transmits."""
    rng = np.random.default_rng([seed, 91])
    count = 48 if effort.full else 16
    mu = np.concatenate([[1.0], (np.arange(count) + rng.uniform(size=count)) / count])
    theta = np.degrees(np.arccos(np.clip(mu, np.cos(np.radians(89.0)), 1.0)))
    sides = subject.sides or (1, -1)
    return directions.single(
        np.concatenate(
            [directions.at(theta if s > 0 else 180.0 - theta, 360.0 * rng.uniform(size=len(theta))) for s in sides]
        )
    )


def _frequencies(subject: Subject, effort: Effort, seed: int) -> list[Trial]:
    """Tests of whether each lobe is sampled with the probability that its pdf states."""
    views = [(25.0, 40.0), (70.0, 200.0)] if effort.full else [(50.0, 100.0)]
    wo = np.concatenate(
        [[directions.at(t if side > 0 else 180.0 - t, p) for t, p in views] for side in subject.sides or (1,)]
    )
    wo = directions.single(wo)
    count = min(effort.furnace_samples, 1 << 16)
    known = lobes.of(subject, wo, seed, precision="float32")
    # lobes that coincide at some parameter values are sampled as one, twice as often as each states
    times = np.ones(known.pdf.shape)
    if not effort.full:
        times = np.where(known.share > 0.05, np.round(known.share / np.maximum(known.pdf, 0.01)), 1.0)
        times = np.maximum(times, 1.0)
    trials = []

    def p_value(row: int, lobe: int, seed: int) -> float:
        u = directions.numbers(np.random.default_rng([seed, 21, row]), count)
        s = subject.sample(np.tile(wo[row], (count, 1)), u, precision="float32")
        mine = s.delta & (s.pdf > 0.0) & (np.abs(s.wi - known.wi[row, lobe]).max(1) < lobes.NEAR)
        here = known.valid[row] & (np.abs(known.wi[row] - known.wi[row, lobe]).max(1) < lobes.NEAR)
        probability = float(np.sum(known.pdf[row] * times[row] * here))
        return statistics.binomial_two_sided(int(mine.sum()), count, min(max(probability, 0.0), 1.0))

    for row, lobe in np.argwhere(known.valid):

        def repeat(row: int = int(row), lobe: int = int(lobe)) -> float:
            return p_value(row, lobe, seed + 7919)

        text = f"frequency of the lobe at wi = {angles(known.wi[row, lobe])}, wo at {angles(wo[row])} degrees"
        trials.append(Trial(p_value(int(row), int(lobe), seed), text, repeat))
    return trials


__all__ = ["DeltaLobes"]
