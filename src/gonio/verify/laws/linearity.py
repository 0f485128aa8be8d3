"""Linearity: values are affine in albedos."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias

import numpy as np

from ...material import BSDF, models
from .. import directions, severity, statistics
from ..effort import Effort
from ..forensics import channels
from ..forensics.ratio import SPREAD, Cause
from ..subject import Subject
from ..verdict import DoesNotApply, Finding
from .base import Law, pair_in_words, pairs, relative, worst_of

EXACT, SINGLE = 1e-9, 1e-4
GRAYS = (0.125, 0.3125, 0.5, 0.875)  # colors at which values are compared
MIXED = "a mix with another material"  # the case "mix" in the list of tested cases
POWERS = np.geomspace(0.2, 6.0, 4001)  # exponents of a color that values may follow


class Linearity(Law):
    """`eval` is affine in each albedo, eval(c a + (1-c) b) = c eval(a) + (1-c) eval(b), and mixtures of materials mix
    their values.

    An albedo is a spectrum that is declared to lie in [0, 1].
    """

    number = 7
    name = "linearity"
    title = "eval is linear in albedos and in the weight of a mix of materials"
    meaning = "Textures that are filtered or blended before shading do not look like the average of their colors."

    def judge(self, subject: Subject, effort: Effort, seed: int) -> Finding:
        if not subject.has_density:
            raise DoesNotApply("all lobes are delta lobes, which have no values to compare")
        if subject.stochastic:
            raise DoesNotApply("the material is stochastic: individual values are random")
        wo, wi = pairs(subject, effort.pairs // 4, seed)
        cases = [(name.partition(":")[0], name, *pair(wo, wi)) for name, pair in _pairs(subject).items()]
        if not cases:
            raise DoesNotApply("the material has no albedo, and only Gonio materials can be mixed")
        exact = subject.best == "float64"
        tried = list(dict.fromkeys(label for label, *_ in cases))
        dead = [label for label in tried if label != "mix" and effort.full and _is_dead(subject, label, wo, wi)]
        tested = ", ".join(MIXED if label == "mix" else label for label in tried)
        worst, place, name, notes = -1.0, 0, "", [f"tested: {tested}"]
        tolerance = EXACT if exact else SINGLE
        for label, case, a, b in cases:
            row, size = worst_of(relative(a, b, 0.0, 1e-9 * float(np.max(np.abs(b), initial=0.0))))
            if size > tolerance and case != label:
                # for example if one layer attenuates another by its brightest channel
                notes.append(f"between two colors, eval is nonlinear in {label} (error {size:.2g})")
                continue
            if size > tolerance and label != "mix" and _bounces(subject, label, wo, wi, effort.full):
                notes.append(f"eval is nonlinear in {label}, as expected for multiple reflections (error {size:.2g})")
                continue
            if size > worst:
                worst, place, name = size, row, case
        return Finding(
            figure=max(worst, 0.0),
            tolerance=tolerance,
            reason="a few rounding errors" if exact else "a few rounding errors of float32, some with cancellation",
            worst=f"{name}: {pair_in_words(wo[place], wi[place])}",
            at=(wo[place], wi[place]),
            problems=[f"{name} has no effect" for name in dead],
            notes=list(dict.fromkeys(notes)),
            details=name,
        )

    def bias(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> severity.Bias | None:
        name = str(finding.details)
        pair = _pairs(subject)[name]

        def expected_first(wo: np.ndarray, wi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            value, expected = pair(wo, wi)
            return expected, value

        return severity.between(
            subject, expected_first, f", for {MIXED if name == 'mix' else f'an interpolation of {name}'}"
        )

    def ratios(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> Iterator[Cause]:
        name = finding.worst.partition(":")[0]
        if name == "mix":
            return
        wo, wi = pairs(subject, 4096, seed)
        power = _power_of(np.stack([subject.replace(**{name: x}).eval(wo, wi).mean(1) for x in GRAYS]))
        if power is not None:
            text = f"values vary as {name}^{power:.3g}, within 1e-3: is a color gamma-decoded, or multiplied twice?"
            yield Cause(text, f"{name}^{power:.3g}")
        mix = channels.mixed(subject, wo, wi)
        if mix is not None:
            yield mix


def _power_of(rows: np.ndarray) -> float | None:
    """The exponent p != 1 for which the values of all pairs are a + b x^p; None if there is none.

    rows  values at the albedos GRAYS, (4, N)
    a and b, which differ from pair to pair, cancel in the ratio of two differences of values.
    """
    first, *inner, last = rows
    lit = np.abs(last - first) > 1e-6 * np.abs(rows).max()
    if lit.sum() < 64:
        return None
    begin, *between, end = np.power.outer(np.asarray(GRAYS), POWERS)
    powers = []
    for row, ratio in zip(inner, ((x - begin) / (end - begin) for x in between), strict=True):  # they decrease with p
        powers.append(np.interp((first - row)[lit] / (last - first)[lit], -ratio, POWERS))
    power = float(np.median(powers[0]))
    same = all(np.percentile(np.abs(each / power - 1.0), 97.0) < SPREAD for each in powers)
    return power if same and abs(power - 1.0) > 0.01 else None


def _pairs(subject: Subject) -> dict[str, severity.Pair]:
    """Pairs of values that should be equal: eval at an albedo between two others, or of a mixture of two materials,
    and the interpolation of the two values."""

    def between(name: str, a: Value, b: Value) -> severity.Pair:
        low, high = subject.replace(**{name: a}), subject.replace(**{name: b})
        mean = 0.75 * np.asarray(a) + 0.25 * np.asarray(b)
        middle = subject.replace(**{name: tuple(mean.tolist()) if mean.ndim else float(mean)})
        return lambda wo, wi: (middle.eval(wo, wi), 0.75 * low.eval(wo, wi) + 0.25 * high.eval(wo, wi))

    names = [name for name, p in subject.parameters.items() if p.kind == "spectrum" and p.high == 1.0]
    cases = {name: between(name, 0.125, 0.875) for name in names}
    # a mean of the channels, or a difference of two, is linear in gray values: only colors reveal it
    cases |= {f"{name}: saturated colors": between(name, *COLORS) for name in names}
    if isinstance(subject.model, BSDF):
        other = models()["lambert"]((0.2, 0.5, 0.8))  # type: ignore[call-arg]
        mixed = Subject(models()["mix"](subject.model, other, 0.25), "mix")  # type: ignore[call-arg]
        plain = Subject(other, "lambert")
        cases["mix"] = lambda wo, wi: (mixed.eval(wo, wi), 0.75 * subject.eval(wo, wi) + 0.25 * plain.eval(wo, wi))
    return cases


Value: TypeAlias = "float | tuple[float, float, float]"
COLORS = (0.125, 0.5, 0.875), (0.875, 0.25, 0.0)


def _bounces(subject: Subject, name: str, wo: np.ndarray, wi: np.ndarray, given: bool) -> bool:
    """Whether light is reflected with this albedo once, twice, and so on, or passes a layer with this reflectance
    several times; see `statistics.is_power_series` and `is_dimmed`.

    name   path of the albedo
    given  whether the other colors have their given values; if not, the first power may be absent, because light
           that hits a black part once is lost
    """
    rows = np.stack([subject.replace(**{name: v}).eval(wo[:2048], wi[:2048]).mean(1) for v in statistics.STEPS])
    noise = 1e-9 if subject.best == "float64" else 1e-4
    return statistics.is_power_series(rows, noise, first_power=given) or statistics.is_dimmed(rows, noise)


def _is_dead(subject: Subject, name: str, wo: np.ndarray, wi: np.ndarray) -> bool:
    """Whether an albedo has no effect on any value, as if a cache ignored it or the parameter were never read."""
    low, high = (subject.replace(**{name: v}) for v in (0.125, 0.875))
    first, second = low.eval(wo, wi), high.eval(wo, wi)
    if not np.array_equal(first, second) or not np.any(first > 0.0):
        return False
    u = directions.numbers(np.random.default_rng(17), len(wo))  # it may belong to a delta lobe, which has no values
    if not np.array_equal(low.sample(wo, u).weight, high.sample(wo, u).weight):
        return False
    # it may belong to a part of weight 0: try again with all weights at one half
    known = subject.parameters.items()
    shares = {path: getattr(subject.model, path) for path, one in known if one.high == 1.0 and not one.inside}
    some = {path: 0.5 for path, value in shares.items() if isinstance(value, int | float) and value == 0.0}
    return not some or _is_dead(subject.replace(**some), name, wo, wi)
