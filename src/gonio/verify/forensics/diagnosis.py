"""The explanation of failures: their effect on a picture, their probable cause, and their dependence on one another.

Failures are explained after all laws have been tested. A report without failures takes no additional time.
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

from ...errors import GonioError, GonioWarning
from ..effort import Effort
from ..isolation.watch import limited
from ..laws import Law
from ..severity import Grade
from ..subject import Fault, Subject
from ..verdict import CONSEQUENCE, DECLARED, FAIL, Finding, Verdict
from . import causes, reproduction
from .ratio import Cause, Ratio

if TYPE_CHECKING:
    from ..severity import Bias

# These come first: a NaN affects every measured value, and weights affect the values of pdf and energy.
ORDER = ("positivity", "calls", "delta", "weight", "pdf", "reciprocity", "energy")
AFTER = ("isotropy", "linearity", "precision", "gradients")
# Failures that follow from others: for example, quadrature and sampling disagree on the energy where weights are wrong.
FOLLOWS = {"energy": ("calls", "delta", "weight", "pdf"), "pdf": ("calls", "weight")}
LIMIT = 60.0  # seconds per law; the explanation takes less than one second unless the BSDF loops


class Answer(NamedTuple):
    """A law's verdict, with the subject and the finding on which it is based."""

    law: Law
    verdict: Verdict
    subject: Subject
    finding: Finding | None


def explain(answers: Sequence[Answer], effort: Effort, seed: int, judge: Callable[[Law, Subject], Verdict]) -> None:
    """Set `bias`, `grade` and `cause` of the verdicts of one card that fail, or are violated as declared.

    answers  the verdicts of the card
    judge    function (law, subject) that tests another subject and returns the verdict
    """
    failed = [answer for answer in answers if answer.verdict.status in (FAIL, DECLARED)]
    rank = {name: k for k, name in enumerate(ORDER + AFTER)}
    named: dict[str, str] = {}  # a cause's key, and the law that named it
    faults: dict[str, str] = {}  # an exception without its numbers, and the first law in which it occurred
    nan = False  # whether values are NaN at more than single directions, which affects every other measured value
    infinite = False  # whether some value is infinite
    visible: set[str] = set()  # laws whose failure changes a picture
    for law, verdict, subject, finding in sorted(failed, key=lambda a: rank.get(a.law.name, len(rank))):
        if finding is None:
            # an exception or a timeout; the same one in several laws counts as one failure
            first = faults.setdefault(re.sub(r"\d+", "", verdict.why[0]), law.name)
            if first != law.name:
                verdict.cause = f"{CONSEQUENCE} of the {first} law"
            continue
        if verdict.status == DECLARED and effort.name == "quick":
            continue  # a quick check spends no time on declared violations
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
            leader = "reciprocity"  # an extra or missing cosine changes the reflected light, possibly by a constant
        if leader is None:
            # the disagreement of two estimates; a gain of eval itself follows from no other law
            follows = FOLLOWS.get(law.name, ()) if cause is None and finding.figure <= finding.tolerance else ()
            leader = next((name for name in follows if name in visible), None)
        # a measured value that is NaN, or among values that are, has no other cause
        if nan or (infinite and not math.isfinite(finding.figure)):
            leader = leader or "positivity"
        if verdict.grade is Grade.NAN:
            infinite = True
            nan = nan or (verdict.bias is not None and verdict.bias.average > 0.0)
        if verdict.grade not in (None, Grade.INVISIBLE, Grade.NOISE, Grade.INTERFACE):
            visible.add(law.name)
        if leader is not None:
            verdict.cause = f"{CONSEQUENCE} of the {leader} law"
        elif cause is not None:
            # rounding that is invisible in pictures does not explain visible failures
            aside = law.name == "precision" and verdict.grade in (None, Grade.INVISIBLE) and visible
            verdict.cause = f"unrelated to the other failures: {cause.words}" if aside else cause.words
            named[cause.key] = law.name


def in_order(verdicts: Sequence[Verdict]) -> list[Verdict]:
    """The failed verdicts, ordered so that those from which others follow come first."""
    rank = {name: k for k, name in enumerate(ORDER + AFTER)}
    failed = [verdict for verdict in verdicts if verdict.failed]
    return sorted(failed, key=lambda v: (v.cause.startswith("follows"), rank.get(v.law, len(rank))))


# The report must not be lost because of an error in a BSDF that has already failed a law.
_ERRORS = (Fault, GonioError, TimeoutError, ArithmeticError, ValueError, IndexError, KeyError, MemoryError)


UNSTEADY = Cause(
    "results change if a call is repeated or other rays are added: is there state, a random value or a sum over rays?",
    "unsteady",
)


def _measure(law: Law, verdict: Verdict, subject: Subject, finding: Finding, effort: Effort, seed: int) -> None:
    try:
        with limited(law.name, LIMIT):
            bias: Bias | None = law.bias(subject, finding, effort, seed)
    except _ERRORS as error:
        verdict.notes.append(f"the effect on a picture could not be measured: {error}")
        return
    if bias is not None:
        verdict.bias, verdict.grade = bias, bias.grade


def _cause(law: Law, subject: Subject, finding: Finding, effort: Effort, seed: int) -> Cause | None:
    try:
        with limited(law.name, LIMIT):
            if not (subject.stochastic or subject.steady):
                return UNSTEADY  # a ratio of two calls has no meaning
            for one in law.ratios(subject, finding, effort, seed):
                cause = causes.named(one) if isinstance(one, Ratio) else one
                if cause is not None:
                    return cause
    except _ERRORS:
        pass
    return None


def _convention(law: Law, subject: Subject, judge: Callable[[Law, Subject], Verdict]) -> tuple[Grade, str] | None:
    """The grade and the reason if a material inherently violates a law, or an inner material violates it; else None."""
    reason = subject.by_nature.get(law.name)
    if reason:
        return Grade.BY_NATURE, reason
    inner = subject.inner
    if not inner:
        return None
    wrong = [one.target for one in inner if judge(law, one).status == FAIL]
    try:
        sound = subject.with_sound_inside() if wrong else None
    except GonioError:  # it does not accept a diffuse material
        return None
    if sound is None or judge(law, sound).status == FAIL:
        return None
    return (
        Grade.INNER,
        f"{' and '.join(dict.fromkeys(wrong))} violates this law by itself; with a correct material in its place, "
        "the law holds",
    )
