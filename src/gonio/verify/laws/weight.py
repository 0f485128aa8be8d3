"""The weight of a sample equals eval / pdf."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np

from ...ops import Mode, Precision
from .. import directions, estimators, severity, statistics
from ..effort import Effort
from ..forensics.ratio import Cause, Ratio
from ..subject import Subject
from ..verdict import Finding, Trial
from .base import Law, beyond_rounding, pair_in_words, relative, worst_of

EXACT = 1e-10
SINGLE = 2e-3
LOBE = 1e4  # 1/sr; larger values and densities are those of a lobe no wider than a degree
ENDS = (0.0, 1.0 - 2.0**-24)  # of a random number
EVERY = 64  # samples, one of which has a given random number at a given end
ASIDE = 3e-5  # radians: a tenth of the width of the narrowest lobe, and hundreds of float32 ulps
PAIRS = 1 << 13  # samples used to find a cause


class Weight(Law):
    """weight = eval / pdf at the sampled wi; for declared delta samples, `eval` and `pdf` are 0."""

    number = 5
    samples = True
    name = "weight"
    title = "weight = eval / pdf at the sampled wi; delta samples are declared"
    meaning = "Brightness depends on the integrator: BSDF sampling and light sampling converge to different pictures."

    def judge(self, subject: Subject, effort: Effort, seed: int) -> Finding:
        wo, u = _drawn(subject, effort.pairs, seed)
        problems: list[str] = []
        figures = []
        for precision in subject.precisions:
            figures.append(self._at(subject, wo, u, precision, problems))
        size, row, wi = figures[-1]
        exact = subject.best == "float64"
        if exact and figures[0][0] > SINGLE:
            problems.append(f"float32: {figures[0][0]:.2e}; at most {SINGLE:.0e} is allowed")
        finding = Finding(
            figure=size,
            tolerance=EXACT if exact else SINGLE,
            reason="in float64, both sides are the same formula and differ only by a few rounding errors"
            if exact
            else "beyond the effect of changing both directions by 8 ulps, only the model's own rounding errors remain",
            worst=pair_in_words(wo[row], wi),
            at=(wo[row], wi),
            problems=problems,
        )
        if exact:
            finding.notes.append(f"error in float32: {figures[0][0]:.2e}")
        if subject.stochastic:
            return _expected(subject, finding, seed, effort)
        return finding

    def bias(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> severity.Bias:
        return estimators.sampling_bias(subject, "weights")

    def ratios(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> Iterator[Ratio | Cause]:
        if subject.stochastic:
            return
        wo, u = _drawn(subject, PAIRS, seed)
        for mode in ("radiance", "importance") if subject.transmits else ("radiance",):
            s = subject.sample(wo, u, mode)
            rows = np.flatnonzero((s.pdf > 0.0) & ~s.delta & np.all(np.isfinite(s.wi), axis=1))
            o, i, claimed = wo[rows], s.wi[rows], s.pdf[rows, None]
            pdf = subject.pdf(o, i)[:, None]
            suffix = "" if mode == "radiance" else f" in mode {mode}"
            if mode == "radiance":
                yield Ratio(
                    "the pdf of samples",
                    "pdf(wo, wi)",
                    o,
                    i,
                    claimed,
                    pdf,
                    subject,
                    lambda b, x, y, m: b.pdf(x, y)[:, None],
                )
            value = subject.eval(o, i, mode)
            if _gray(s.weight[rows]) and not _gray(value):
                yield Cause(
                    "the weight is gray but eval is colored; possible mistake: a mean of the channels, or a single one",
                    "gray weight",
                )
            clamped = _clamped(s.weight[rows], value / np.maximum(pdf, 1e-30), "eval / pdf")
            if clamped:
                yield Cause(f"the weight is {clamped}", "clamped weight")
            largest = value.max(1, keepdims=True), s.weight[rows].max(1, keepdims=True)
            lit = (largest[0] > 0.0) & (largest[1] > 0.0)
            divisor = _clamped((largest[0] / np.where(lit, largest[1], 1.0))[lit[:, 0]], pdf[lit[:, 0]], "pdf")
            if divisor:
                yield Cause(f"eval divided by the weight is {divisor}", "clamped weight")
            yield Ratio(f"weight x pdf{suffix}", "eval", o, i, s.weight[rows] * claimed, value, subject, Subject.eval)
        for problem in finding.problems:
            _, _, convention = problem.partition(": ")
            if "is allowed" not in convention:  # the verdict already states the measured value
                yield Cause(convention, convention)

    def _at(
        self, subject: Subject, wo: np.ndarray, u: np.ndarray, precision: Precision, problems: list[str]
    ) -> tuple[float, int, np.ndarray]:
        modes: tuple[Mode, ...] = ("radiance", "importance") if subject.transmits else ("radiance",)
        worst, where, wi = 0.0, 0, wo[0]
        for mode in modes:
            s = subject.sample(wo, u, mode, precision)
            # at the ends of the random numbers, a density may underflow to 0 in float32, but not a quotient of two
            inner = np.all((u > ENDS[0]) & (u < ENDS[1]), axis=1) | (precision == "float64")
            _conventions(s, inner, problems, precision)
            unit = np.abs(np.linalg.norm(s.wi, axis=1) - 1.0) < 1e-2  # other directions are rejected
            s = s._replace(wi=np.where(unit[:, None], s.wi, [0.0, 0.0, 1.0]))
            density = (s.pdf > 0.0) & ~s.delta & unit
            value = subject.eval(wo, s.wi, mode, precision)
            pdf = subject.pdf(wo, s.wi, precision)
            delta = s.delta & (s.pdf > 0.0) & (np.abs(s.wi[:, 2]) > 0.1) & unit
            if delta.any():
                aside = s.wi[delta] + ASIDE * np.roll(s.wi[delta], 1, axis=1)
                aside /= np.linalg.norm(aside, axis=1, keepdims=True)
                peak = np.maximum(value[delta].max(1), pdf[delta])
                next_to = np.maximum(
                    subject.eval(wo[delta], aside, mode, precision).max(1), subject.pdf(wo[delta], aside, precision)
                )
                # a narrow lobe around it is as bright that close to it, or, if even narrower, far brighter than any
                # probability; the delta lobe itself must not show
                only_delta = getattr(subject.model, "delta", "maybe") == "always"
                shows = peak > (0.0 if only_delta else 1e-3 + 3.0 * next_to)
                if np.any(shows & (only_delta | (peak < LOBE))):
                    problems.append(f"{precision}: eval or pdf is positive in the direction of a delta sample")
            rows = np.flatnonzero(density)
            if subject.stochastic or not len(rows):
                continue
            a, b = s.weight[rows] * s.pdf[rows, None], value[rows]
            c, d = s.pdf[rows, None], pdf[rows, None]
            scale = np.maximum(s.pdf[rows, None] * np.abs(s.weight[rows]).max(initial=1.0), 0.0)
            floor = 1e-6 * scale
            least = 1e-6 * scale.max(1, keepdims=True)
            if precision == "float64":
                of_value, of_pdf = relative(a, b, 0.0, floor), relative(c, d, 0.0, least)
            else:
                o, i = wo[rows], s.wi[rows]

                def evaluate(o: np.ndarray, i: np.ndarray, mode: Mode = mode) -> np.ndarray:
                    return subject.eval(o, i, mode, precision)

                of_value = beyond_rounding(a, b, evaluate, o, i, floor, SINGLE)
                of_pdf = beyond_rounding(c, d, lambda o, i: subject.pdf(o, i, precision)[:, None], o, i, least, SINGLE)
            error = np.maximum(of_value.max(1), of_pdf[:, 0])
            if precision == "float32" and not error.max() <= SINGLE:
                # a direction that rounding moves over an edge (the horizon, total reflection) is not an error
                error = np.where(_on_edge(subject, wo[rows], s.wi[rows], precision), 0.0, error)
            row, size = worst_of(error)
            if size > worst or not np.isfinite(size):
                worst, where, wi = size, int(rows[row]), s.wi[rows[row]]
        return worst, where, wi


def _on_edge(subject: Subject, wo: np.ndarray, wi: np.ndarray, precision: Precision) -> np.ndarray:
    """Whether a change of wi by a few float32 ulps makes the value or the pdf zero or nonzero."""
    rng = np.random.default_rng(8)
    moved = np.concatenate([wi + 2.0**-21 * rng.uniform(-1.0, 1.0, wi.shape) for _ in range(6)])
    many = np.tile(wo, (6, 1))
    values = np.any(subject.eval(many, moved, precision=precision) > 0.0, axis=1).reshape(6, -1)
    densities = (subject.pdf(many, moved, precision) > 0.0).reshape(6, -1)
    lit = np.concatenate([subject.pdf(wo, wi, precision)[None] > 0.0, densities, values])
    return np.any(lit, axis=0) & ~np.all(lit, axis=0)


def _clamped(weight: np.ndarray, right: np.ndarray, name: str) -> str:
    """A description such as "1 wherever eval / pdf is larger; ..." if all weights that differ from the correct ones
    have the same value; otherwise "".

    weight, right  the weights and the correct weights, (N, channels) each
    name           name of the correct weights
    """
    if not len(weight):
        return ""
    off = np.abs(weight - right) > 0.01 * np.maximum(weight, right)
    share = off.mean(0)  # a constant channel is not clamped
    if off.sum() < 64 or not np.any((share > 0.01) & (share < 0.97)) or np.any(share >= 0.97):
        return ""
    values = weight[off]
    most = float(np.median(values))
    if most <= 0.0 or np.mean(np.abs(values / most - 1.0) < 1e-4) < 0.99:
        return ""
    rest = weight[~off]  # within the same bound
    if np.all(right[off] > values) and np.all(rest <= most * 1.001):
        return f"{most:.4g} wherever {name} is larger; possible mistake: clamping to at most {most:.4g}"
    if np.all(right[off] < values) and np.all(rest >= most * 0.999):
        return f"{most:.4g} wherever {name} is smaller; possible mistake: clamping to at least {most:.4g}"
    return ""


def _gray(values: np.ndarray) -> bool:
    """Whether all channels are equal, within a percent for most samples."""
    return not len(values) or bool(np.mean(np.ptp(values, axis=1) > 0.01 * values.max(1)) < 0.05)


def _drawn(subject: Subject, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng([seed, 5])
    wo = directions.uniform(rng, count)
    wo[:, 2] = np.abs(wo[:, 2]) * rng.choice(np.array(subject.sides or (1,)), count)
    u = directions.numbers(rng, count)
    for number, (which, end) in enumerate(itertools.product(range(3), ENDS)):  # where inversions may divide by 0
        u[number::EVERY, which] = end
    return directions.single(wo), u


def _conventions(s: object, inner: np.ndarray, problems: list[str], precision: Precision) -> None:
    """Check that failed samples have weight 0, for the samples in the mask `inner`, that the others have unit
    directions, and that probabilities are at most 1."""
    pdf, weight, wi, delta = s.pdf, s.weight, s.wi, s.delta  # type: ignore[attr-defined]
    good = pdf > 0.0
    wrong = []
    if np.any(weight[~good & inner] != 0.0):
        wrong.append("the weight of a failed sample (pdf = 0) is not 0")
    if np.any(np.abs(np.linalg.norm(wi[good], axis=1) - 1.0) > 1e-5):  # wo itself is rounded to float32
        wrong.append("a sampled direction is not a unit vector")
    if np.any(pdf[good & delta] > 1.0 + 1e-6):
        wrong.append("the pdf of a delta sample is a probability but exceeds 1")
    for what in wrong:
        if f"{precision}: {what}" not in problems:
            problems.append(f"{precision}: {what}")


def _expected(subject: Subject, finding: Finding, seed: int, effort: Effort) -> Finding:
    """The finding for a stochastic model, from the mean weight of `sample` and the mean of eval / pdf at the same
    directions."""

    def p_value(seed: int) -> float:
        wo, u = _drawn(subject, 16 * effort.pairs, seed)
        s = subject.sample(wo, u)
        good = (s.pdf > 0.0) & ~s.delta
        value = subject.eval(wo[good], s.wi[good]).mean(1)
        difference = s.weight[good].mean(1) - value / s.pdf[good]
        if not len(difference):
            return 1.0
        # where both use the same random number, only rounding error is left
        noise = float(np.hypot(difference.std() / np.sqrt(len(difference)), 1e-6 * s.weight[good].mean()))
        return statistics.normal_two_sided(difference.mean() / noise) if noise > 0.0 else 1.0

    finding.tolerance = np.inf
    finding.reason = "the material is stochastic: expectations are compared by p-values"
    finding.shown = "expectations compared"
    finding.trials.append(
        Trial(p_value(seed), "mean weight compared with mean eval / pdf", lambda: p_value(seed + 7919))
    )
    return finding
