"""The findings of laws on a subject, and the verdicts and cards derived from them.

A law returns a `Finding`: a measured value, and the p-values of its statistical tests. `gonio.verify.run` evaluates the
tests when their number in the whole report is known.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ..material import KnownViolation
from .quality import Quality
from .severity import Bias, Grade
from .subject import Subject

PASS, FAIL, DECLARED, NOT_APPLICABLE = ("pass", "fail", "breaks as declared", "does not apply")
KNOWN = "known"  # a failure that the baseline already contains
CONSEQUENCE = "a consequence of the failure"  # how the cause of a failure begins that follows from another failure
NOT_TRIED = "not tried"  # a program or package that the law needs is not installed
TOLERATED = "tolerated"  # a failure whose effect on pictures the user tolerates


class Evidence(Protocol):
    """The data of a law from which the report draws a figure."""

    def draw(self) -> tuple[str, str]:
        """Draw the figure; returns its SVG and its caption."""


@dataclasses.dataclass
class Trial:
    """A statistical test.

    p       its p-value
    where   description of the tested case
    repeat  function that repeats the test with another seed and returns the p-value
    second  p-value of the repetition; None if it was not repeated
    """

    p: float
    where: str
    repeat: Callable[[], float]
    second: float | None = None


@dataclasses.dataclass
class Finding:
    """The result of a law.

    figure     measured size of the violation, which is compared with `tolerance`
    tolerance  largest size that passes
    reason     justification of the tolerance
    shown      the size as text, if a number alone would be unclear
    allowed    the tolerance in the unit of `shown`
    worst      description of the worst case
    at         pair of directions of the worst case, for the command that repeats it
    settings   parameter values of the worst case, if they differ from the given ones
    trials     statistical tests
    problems   violations that fail the law regardless of the size
    untried    the reason why part of the law could not be tested, in which case it cannot pass; "" otherwise
    notes      further information
    breach     size to compare with a declared violation, if it differs from `figure`
    known      the declared violation of the tested variant, such as the lossless one, if it differs from the subject's
    evidence   data for the figure in the report
    details    data for the methods `bias` and `ratios` of the law
    """

    figure: float
    tolerance: float
    reason: str
    shown: str = ""
    allowed: str = ""
    worst: str = ""
    at: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None
    settings: dict[str, object] = dataclasses.field(default_factory=dict)
    trials: list[Trial] = dataclasses.field(default_factory=list)
    problems: list[str] = dataclasses.field(default_factory=list)
    untried: str = ""
    notes: list[str] = dataclasses.field(default_factory=list)
    breach: float | None = None
    known: KnownViolation | None = None
    evidence: Evidence | None = None
    details: object = None


class DoesNotApply(Exception):
    """Raised by a law that does not apply to a subject; its message is the reason."""


@dataclasses.dataclass
class Verdict:
    """The verdict of a law on one subject. For fields that are not listed, see `Finding` and `Law`.

    law      name of the law
    status   "pass", "fail" or another status
    p        smallest p-value of its statistical tests; None if there are none
    command  command line that repeats the test
    why      the reasons for a failure
    seconds  time taken by the law
    places   number of parameter settings at which the law was tested, including the given one
    bias     effect of a failure or a declared violation on a picture; None if unknown
    grade    severity of that effect; None if unknown
    cause    probable cause of a failure; "" if unknown
    reproduction  for a failure of a Mitsuba plugin, a program that reproduces it without Gonio
    """

    number: int
    law: str
    title: str
    status: str
    figure: float | None = None
    shown: str = ""
    tolerance: float | None = None
    reason: str = ""
    p: float | None = None
    worst: str = ""
    command: str = ""
    meaning: str = ""
    why: list[str] = dataclasses.field(default_factory=list)
    notes: list[str] = dataclasses.field(default_factory=list)
    seconds: float = 0.0
    places: int = 1
    bias: Bias | None = None
    grade: Grade | None = None
    cause: str = ""
    reproduction: str = ""
    evidence: Evidence | None = dataclasses.field(default=None, repr=False)

    @property
    def failed(self) -> bool:
        return self.status == FAIL

    @property
    def cause_in_words(self) -> str:
        """The probable cause of a failure, or the statement that it is unknown."""
        unknown = self.failed and self.figure is not None  # an exception needs no explanation
        return self.cause or ("unknown; none of the known mistakes matches" if unknown else "")

    @property
    def excused(self) -> bool:
        """Whether the law is violated but does not fail the report."""
        return self.status in (KNOWN, TOLERATED)

    def as_dict(self) -> dict[str, object]:
        """All fields except the evidence, for JSON; numbers that are not finite become null."""
        names = [field.name for field in dataclasses.fields(self) if field.name != "evidence"]
        return {name: _plain(getattr(self, name)) for name in names}


class Unread(NamedTuple):
    """One of several targets that could not be read and was therefore not tested.

    target             its name
    what, where, hint  the error: its message, its place (file and line), and a suggestion
    """

    target: str
    what: str
    where: str
    hint: str

    def words(self) -> str:
        """The error in one line."""
        place = f"{self.where}: " if self.where else ""
        return f"{place}{self.what}" + (f" ({self.hint})" if self.hint else "")


@dataclasses.dataclass
class Card:
    """All verdicts on one subject.

    covered    description of the parameter values at which it was tested
    notes      remarks on its behavior, such as printed output or a crash of its process
    quality    quality of its sampling; None if it could not be measured
    p_values   p-values of its statistical tests
    threshold  p-value below which a test rejected
    """

    subject: Subject
    verdicts: list[Verdict]
    covered: str = ""
    notes: list[str] = dataclasses.field(default_factory=list)
    quality: Quality | None = None
    p_values: list[float] = dataclasses.field(default_factory=list, repr=False)
    threshold: float = 0.0

    def decided_by(self, threshold: float) -> bool:
        """Whether the verdicts are the same for another threshold, that is, no p-value lies between the two."""
        low, high = sorted((self.threshold, threshold))
        return not any(low <= p < high for p in self.p_values)

    @property
    def title(self) -> str:
        return self.subject.title

    @property
    def passed(self) -> bool:
        return not any(verdict.failed for verdict in self.verdicts)

    def __getitem__(self, law: str) -> Verdict:
        for verdict in self.verdicts:
            if verdict.law == law:
                return verdict
        raise KeyError(law)

    def as_dict(self) -> dict[str, object]:
        settings = {name: str(value) for name, value in self.subject.settings.items()}
        return {
            "title": self.title,
            "target": self.subject.target,
            "settings": settings,
            "covered": self.covered,
            "notes": list(self.notes),
            "quality": self.quality.as_dict() if self.quality else None,
            "passed": self.passed,
            "verdicts": [verdict.as_dict() for verdict in self.verdicts],
        }


def _plain(value: object) -> object:
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, Bias):
        return {name: _plain(part) for name, part in dataclasses.asdict(value).items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    return value
