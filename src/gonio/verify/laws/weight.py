"""The weight: what `sample` hands out is what `eval` and `pdf` say."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...ops import Precision
from .. import directions, estimators, severity, statistics
from ..effort import Effort
from ..forensics.ratio import Cause, Ratio
from ..subject import Subject
from ..verdict import Finding, Trial
from .base import Law, pair_in_words, relative, rounding, worst_of

EXACT = 1e-10
SINGLE = 2e-3
LOBE = 1e4  # 1/sr; a value or a density that is larger is a lobe's, one of a degree at most
ASIDE = 3e-5  # radians: a tenth of the narrowest lobe, and hundreds of roundings
PAIRS = 1 << 13  # samples whose ratios are looked at for a cause


class Weight(Law):
    """weight = eval / pdf at the very wi that was sampled; declared deltas have neither value nor pdf."""

    number = 5
    name = "weight"
    title = "weight = eval / pdf at the sampled wi; deltas declared"
    meaning = "Brightness depends on the integrator: BSDF sampling and light sampling converge to different pictures."

    def judge(self, subject: Subject, effort: Effort, seed: int) -> Finding:
        wo, u = _drawn(subject, effort.pairs, seed)
        problems: list[str] = []
        figures = []
        for precision in subject.precisions:
            figures.append(self._at(subject, wo, u, precision, problems))
        size, row, wi = figures[-1]
        exact = subject.best == "float64"
        # the worst over all precisions, each in units of what its own rounding allows
        if exact and figures[0][0] > SINGLE:
            problems.append(f"float32: {figures[0][0]:.2e} where {SINGLE:.0e} is allowed")
        finding = Finding(
            figure=size,
            tolerance=EXACT if exact else SINGLE,
            reason="float64: both sides are the same formula, a few roundings apart"
            if exact
            else "float32: beyond 8 roundings of wi, which the narrow lobe magnifies, the rest is the model's own sums",
            worst=pair_in_words(wo[row], wi),
            at=(wo[row], wi),
            problems=problems,
        )
        if exact:
            finding.notes.append(f"float32: {figures[0][0]:.2e}")
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
            if _grey(s.weight[rows]) and not _grey(value):
                yield Cause("the weight is grey where eval has a colour: a mean, or one channel of it?", "grey weight")
            yield Ratio(f"weight x pdf{suffix}", "eval", o, i, s.weight[rows] * claimed, value, subject, Subject.eval)
        for problem in finding.problems:
            _, _, convention = problem.partition(": ")
            if "is allowed" not in convention:  # a figure says no more than the verdict does
                yield Cause(convention, convention)

    def _at(
        self, subject: Subject, wo: np.ndarray, u: np.ndarray, precision: Precision, problems: list[str]
    ) -> tuple[float, int, np.ndarray]:
        modes = ("radiance", "importance") if subject.transmits else ("radiance",)
        worst, where, wi = 0.0, 0, wo[0]
        for mode in modes:
            s = subject.sample(wo, u, mode, precision)
            _conventions(s, problems, precision)
            unit = np.abs(np.linalg.norm(s.wi, axis=1) - 1.0) < 1e-2  # no other direction can be asked for a value
            s = s._replace(wi=np.where(unit[:, None], s.wi, [0.0, 0.0, 1.0]))
            density = (s.pdf > 0.0) & ~s.delta & unit
            value = subject.eval(wo, s.wi, mode, precision)
            pdf = subject.pdf(wo, s.wi, precision)
            delta = s.delta & (s.pdf > 0.0) & (np.abs(s.wi[:, 2]) > 0.1) & unit
            if delta.any():
                aside = s.wi[delta] + ASIDE * np.roll(s.wi[delta], 1, axis=1)
                aside /= np.linalg.norm(aside, axis=1, keepdims=True)
                peak = np.maximum(value[delta].max(1), pdf[delta])
                beside = np.maximum(
                    subject.eval(wo[delta], aside, mode, precision).max(1), subject.pdf(wo[delta], aside, precision)
                )
                # a narrow lobe about it is as bright so close beside it, or, narrower yet, far brighter than any
                # probability; the delta itself must not show
                alone = getattr(subject.model, "delta", "maybe") == "always"
                shows = peak > (0.0 if alone else 1e-3 + 3.0 * beside)
                if np.any(shows & (alone | (peak < LOBE))):
                    problems.append(f"{precision}: a delta sample's direction has a finite value or pdf")
            rows = np.flatnonzero(density)
            if subject.stochastic or not len(rows):
                continue
            a, b = s.weight[rows] * s.pdf[rows, None], value[rows]
            c, d = s.pdf[rows, None], pdf[rows, None]
            scale = np.maximum(s.pdf[rows, None] * np.abs(s.weight[rows]).max(initial=1.0), 0.0)
            floor = 1e-6 * scale
            if precision == "float64":
                noise_value: np.ndarray | float = 0.0
                noise_pdf: np.ndarray | float = 0.0
            else:
                noise_value = rounding(lambda o, i, m=mode: subject.eval(o, i, m, precision), wo[rows], s.wi[rows])  # type: ignore[misc]
                noise_pdf = rounding(lambda o, i: subject.pdf(o, i, precision)[:, None], wo[rows], s.wi[rows])
            error = np.maximum(
                relative(a, b, noise_value, floor).max(1),
                relative(c, d, noise_pdf, 1e-6 * scale.max(1, keepdims=True))[:, 0],
            )
            if precision == "float32":
                # a direction that rounding carries over an edge (the horizon, total reflection) is no error
                error = np.where(_on_edge(subject, wo[rows], s.wi[rows], precision), 0.0, error)
            row, size = worst_of(error)
            if size > worst or not np.isfinite(size):
                worst, where, wi = size, int(rows[row]), s.wi[rows[row]]
        return worst, where, wi


def _on_edge(subject: Subject, wo: np.ndarray, wi: np.ndarray, precision: Precision) -> np.ndarray:
    """Whether a turn of a few roundings makes the value or the pdf vanish, or appear."""
    rng = np.random.default_rng(8)
    lit = [subject.pdf(wo, wi, precision) > 0.0]
    for _ in range(6):
        turned = wi + 2.0**-21 * rng.uniform(-1.0, 1.0, wi.shape)
        lit.append(subject.pdf(wo, turned, precision) > 0.0)
        lit.append(np.any(subject.eval(wo, turned, precision=precision) > 0.0, axis=1))
    return np.any(lit, axis=0) & ~np.all(lit, axis=0)


def _grey(values: np.ndarray) -> bool:
    """Whether all channels are one, within a per cent of most rows."""
    return not len(values) or bool(np.mean(np.ptp(values, axis=1) > 0.01 * values.max(1)) < 0.05)


def _drawn(subject: Subject, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng([seed, 5])
    wo = directions.uniform(rng, count)
    wo[:, 2] = np.abs(wo[:, 2]) * rng.choice(np.array(subject.sides or (1,)), count)
    return directions.single(wo), directions.numbers(rng, count)


def _conventions(s: object, problems: list[str], precision: Precision) -> None:
    """Failed samples weigh nothing; the others have unit directions and finite weights; probabilities are at most 1."""
    pdf, weight, wi, delta = s.pdf, s.weight, s.wi, s.delta  # type: ignore[attr-defined]
    good = pdf > 0.0
    found = []
    if np.any(weight[~good] != 0.0):
        found.append("a failed sample (pdf 0) has a weight")
    if np.any(np.abs(np.linalg.norm(wi[good], axis=1) - 1.0) > 1e-5):  # wo itself is rounded to float32
        found.append("a sampled direction is no unit vector")
    if np.any(pdf[good & delta] > 1.0 + 1e-6):
        found.append("a delta sample's pdf, which is a probability, exceeds 1")
    for what in found:
        if f"{precision}: {what}" not in problems:
            problems.append(f"{precision}: {what}")


def _expected(subject: Subject, finding: Finding, seed: int, effort: Effort) -> Finding:
    """A stochastic model: E[weight g(wi)] under `sample` against E[eval g(wi) / pdf] at the same directions."""

    def p_value(seed: int) -> float:
        wo, u = _drawn(subject, 16 * effort.pairs, seed)
        s = subject.sample(wo, u)
        good = (s.pdf > 0.0) & ~s.delta
        value = subject.eval(wo[good], s.wi[good]).mean(1)
        difference = s.weight[good].mean(1) - value / s.pdf[good]
        if not len(difference):
            return 1.0
        # where both draw the same number, all that is left is rounding
        noise = float(np.hypot(difference.std() / np.sqrt(len(difference)), 1e-6 * s.weight[good].mean()))
        return statistics.normal_two_sided(difference.mean() / noise) if noise > 0.0 else 1.0

    finding.tolerance = np.inf
    finding.reason = "the model is stochastic: expectations are compared, by their p-values"
    finding.shown = "expectations"
    finding.trials.append(Trial(p_value(seed), "mean weight against mean eval / pdf", lambda: p_value(seed + 7919)))
    return finding
