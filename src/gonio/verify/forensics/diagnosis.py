"""Failures explained: what each does to a picture, what it probably comes from, and which of them come first.

It runs after all laws were asked, and only for those that fail; a report in which all holds costs nothing more.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

from ...errors import GonioError, GonioWarning
from ..effort import Effort
from ..isolation.watch import limited
from ..laws import Law
from ..severity import Grade
from ..subject import Fault, Subject
from ..verdict import DECLARED, FAIL, Finding, Verdict
from . import causes, reproduction
from .ratio import Cause, Ratio

if TYPE_CHECKING:
    from ..severity import Bias

# What breaks these comes first: a NaN spoils every figure, a weight spoils the pdf's and the energy's.
ORDER = ("positivity", "calls", "delta", "weight", "pdf", "reciprocity", "energy")
AFTER = ("isotropy", "linearity", "precision", "gradients")
# Failures that another one brings along: the quadrature and the samples of the energy disagree where weights are wrong.
FOLLOWS = {"energy": ("calls", "delta", "weight", "pdf"), "pdf": ("calls", "weight")}
LIMIT = 60.0  # seconds a law; it takes less than one unless the BSDF loops


class Answer(NamedTuple):
    """A law's verdict, where it was found, and what was found there."""

    law: Law
    verdict: Verdict
    subject: Subject
    finding: Finding | None


def explain(answers: Sequence[Answer], effort: Effort, seed: int, judge: Callable[[Law, Subject], Verdict]) -> None:
    """Set `bias`, `grade` and `cause` of the verdicts of one card that fail, or break as declared.

    judge  asks a law of another subject, at less cost
    """
    failed = [answer for answer in answers if answer.verdict.status in (FAIL, DECLARED)]
    rank = {name: k for k, name in enumerate(ORDER + AFTER)}
    named: dict[str, str] = {}  # a cause's key, and the law that named it
    nan = False  # whether values are no numbers at more than single directions: every other figure suffers
    felt: set[str] = set()  # laws whose failure changes a picture
    for law, verdict, subject, finding in sorted(failed, key=lambda a: rank.get(a.law.name, len(rank))):
        if finding is None:
            continue  # an exception, or no end: the verdict says so
        if verdict.status == DECLARED and effort.name == "quick":
            continue  # what is known needs no half second of a first look
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", GonioWarning)
            _measure(law, verdict, subject, finding, effort, seed)
            verdict.reproduction = reproduction.script(law.name, subject, finding)
            if verdict.status == DECLARED:
                continue
            foreign = _convention(law, subject, judge)
            if foreign is not None:
                verdict.grade, verdict.cause = foreign
                continue
            cause = _cause(law, subject, finding, effort, seed)
        leader = named.get(cause.key) if cause is not None else None
        if law.name == "energy" and "reciprocity" in named.values():
            leader = "reciprocity"  # a cosine too many or too few changes what is reflected, by a constant maybe
        if leader is None:
            # a disagreement of two estimates; a gain of eval itself follows from nothing
            follows = FOLLOWS.get(law.name, ()) if cause is None and finding.figure <= finding.tolerance else ()
            leader = next((name for name in follows if name in felt), None)
            if cause is None and nan:
                leader = "positivity"
        if verdict.grade is Grade.NAN and verdict.bias is not None and verdict.bias.average > 0.0:
            nan = True
        if verdict.grade not in (None, Grade.INVISIBLE, Grade.NOISE):
            felt.add(law.name)
        if leader is not None:
            verdict.cause = f"follows from {leader.upper()}'s"
        elif cause is not None:
            verdict.cause = cause.words
            named[cause.key] = law.name


def in_order(verdicts: Sequence[Verdict]) -> list[Verdict]:
    """The failures, those that others follow from first."""
    rank = {name: k for k, name in enumerate(ORDER + AFTER)}
    failed = [verdict for verdict in verdicts if verdict.failed]
    return sorted(failed, key=lambda v: (v.cause.startswith("follows"), rank.get(v.law, len(rank))))


# What goes wrong in a BSDF that failed a law already is no reason to lose the report.
_SICK = (Fault, GonioError, TimeoutError, ArithmeticError, ValueError, IndexError, KeyError, MemoryError)


UNSTEADY = Cause(
    "asked again, or among other rays, it answers otherwise: state, chance, or a sum over all rays?", "unsteady"
)


def _measure(law: Law, verdict: Verdict, subject: Subject, finding: Finding, effort: Effort, seed: int) -> None:
    try:
        with limited(law.name, LIMIT):
            bias: Bias | None = law.bias(subject, finding, effort, seed)
    except _SICK as error:
        verdict.notes.append(f"what it does to a picture could not be measured: {error}")
        return
    if bias is not None:
        verdict.bias, verdict.grade = bias, bias.grade


def _cause(law: Law, subject: Subject, finding: Finding, effort: Effort, seed: int) -> Cause | None:
    try:
        with limited(law.name, LIMIT):
            if not (subject.stochastic or subject.steady):
                return UNSTEADY  # and no ratio of two calls means anything
            for one in law.ratios(subject, finding, effort, seed):
                cause = causes.named(one) if isinstance(one, Ratio) else one
                if cause is not None:
                    return cause
    except _SICK:
        pass
    return None


def _convention(law: Law, subject: Subject, judge: Callable[[Law, Subject], Verdict]) -> tuple[Grade, str] | None:
    """Whether a law is broken by what a material is meant to be, or by what it holds."""
    reason = subject.by_nature.get(law.name)
    if reason:
        return Grade.BY_NATURE, reason
    held = subject.inner
    if not held:
        return None
    wrong = [one.target for one in held if judge(law, one).status == FAIL]
    sound = subject.around_sound() if wrong else None
    if sound is None or judge(law, sound).status == FAIL:
        return None
    return (
        Grade.INNER,
        f"{' and '.join(dict.fromkeys(wrong))} inside fails this law alone; around a sound one it holds",
    )
