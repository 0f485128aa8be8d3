"""Verdicts, cards and reports: what a law found, what that means, and how it is written down.

A law returns a `Finding`: figures, and the p-values of its statistical tests. A `Report` decides: statistical tests are
corrected (Sidak) over the whole report, and a rejection counts only when a second, independent seed confirms it.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from . import directions, statistics
from .subject import Subject

SCHEMA = "gonio-verify/1"
SIGNIFICANCE = 0.01  # of one false rejection in a whole report
CONFIRMATION = 0.001  # of the second seed's test: a real error shows there as well, chance does not

PASS, FAIL, DECLARED, NOT_APPLICABLE = "pass", "fail", "breaks as declared", "does not apply"


@dataclasses.dataclass
class Trial:
    """One statistical test: its p-value, what it was about, and how to repeat it with another seed."""

    p: float
    where: str
    again: Callable[[], float]
    second: float | None = None


@dataclasses.dataclass
class Finding:
    """What a law found.

    figure     the measured size of the violation; compared with `tolerance`
    tolerance  the largest figure that passes, and `reason`, why that one
    shown      the figure in words, where a number alone says little
    worst      where it was found, in words; `at` the pair of directions, for the command that shows it again
    problems   what fails the law whatever the figure
    notes      what else is worth knowing
    breach     the size to hold against a declared breach, where that is not the figure
    data       arrays for the pictures
    """

    figure: float
    tolerance: float
    reason: str
    shown: str = ""
    worst: str = ""
    at: tuple[np.ndarray, np.ndarray] | None = None
    settings: dict[str, Any] = dataclasses.field(default_factory=dict)
    trials: list[Trial] = dataclasses.field(default_factory=list)
    problems: list[str] = dataclasses.field(default_factory=list)
    notes: list[str] = dataclasses.field(default_factory=list)
    breach: float | None = None
    data: dict[str, Any] = dataclasses.field(default_factory=dict)


class DoesNotApply(Exception):
    """Raised by a law that cannot be asked of a subject; the text says why."""


@dataclasses.dataclass
class Verdict:
    """A law's word on one subject."""

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
    data: dict[str, Any] = dataclasses.field(default_factory=dict, repr=False)

    @property
    def failed(self) -> bool:
        return self.status == FAIL

    def as_dict(self) -> dict[str, Any]:
        """All but the arrays for pictures; numbers that JSON does not know become null."""
        found = {f.name: getattr(self, f.name) for f in dataclasses.fields(self) if f.name != "data"}
        return {key: _plain(value) for key, value in found.items()}


@dataclasses.dataclass
class Card:
    """All verdicts on one subject."""

    subject: Subject
    verdicts: list[Verdict]

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

    def as_dict(self) -> dict[str, Any]:
        settings = {name: str(value) for name, value in self.subject.settings.items()}
        return {
            "title": self.title,
            "target": self.subject.target,
            "settings": settings,
            "passed": self.passed,
            "verdicts": [verdict.as_dict() for verdict in self.verdicts],
        }


@dataclasses.dataclass
class Report:
    """The cards of a run.

    tests      statistical tests in the whole report
    threshold  p-value below which one of them rejects, by Sidak's correction
    """

    cards: list[Card]
    seed: int
    effort: str
    tests: int
    threshold: float
    seconds: float = 0.0

    @property
    def passed(self) -> bool:
        return all(card.passed for card in self.cards)

    @property
    def exit_code(self) -> int:
        return 0 if self.passed else 1

    @property
    def failures(self) -> list[Verdict]:
        return [verdict for card in self.cards for verdict in card.verdicts if verdict.failed]

    def __getitem__(self, law: str) -> Verdict:
        """The first failing verdict of that law, else the first."""
        found = [card[law] for card in self.cards]
        return next((verdict for verdict in found if verdict.failed), found[0])

    def as_dict(self) -> dict[str, Any]:
        """What `report.json` holds."""
        from .. import __version__

        return {
            "schema": SCHEMA,
            "gonio": __version__,
            "passed": self.passed,
            "seed": self.seed,
            "effort": self.effort,
            "significance": SIGNIFICANCE,
            "tests": self.tests,
            "threshold": self.threshold,
            "seconds": round(self.seconds, 3),
            "cards": [card.as_dict() for card in self.cards],
        }

    def __str__(self) -> str:
        from . import terminal

        return terminal.text(self)


def decide(law: Any, subject: Subject, finding: Finding, threshold: float, seed: int) -> Verdict:
    """The verdict on a finding, once it is known how many statistical tests the report holds."""
    why = list(finding.problems)
    statistical: list[str] = []
    lowest = min(finding.trials, key=lambda trial: trial.p, default=None)
    for trial in sorted(finding.trials, key=lambda trial: trial.p):
        if not trial.p < threshold or len(statistical) >= 3:
            break  # three confirmed rejections say enough
        trial.second = trial.again()
        if trial.second < CONFIRMATION:
            statistical.append(f"{trial.where}: p = {trial.p:.2g}, and with a second seed {trial.second:.2g}")
        else:
            text = f"{trial.where}: p = {trial.p:.2g} was chance: {trial.second:.2g} with a second seed"
            finding.notes.append(text)
    over = not finding.figure <= finding.tolerance
    status = FAIL if why or statistical or over else PASS
    breach = subject.breaches.get(law.name)
    if breach is not None:
        size = finding.figure if finding.breach is None else finding.breach
        if why or statistical:
            pass
        elif not over:
            if breach.certain:
                status, why = FAIL, ["it is declared to be broken, and is not: " + breach.reason]
        elif size <= breach.size * (1.0 + 1e-6) + finding.tolerance:
            status = DECLARED
            finding.notes.insert(0, f"declared: {breach.reason} (at most {breach.size:.4g})")
        else:
            why.append(f"{size:.4g} is more than the declared {breach.size:.4g}: {breach.reason}")
    elif over:
        why.append(f"{finding.shown or f'{finding.figure:.3g}'} where at most {finding.tolerance:.3g} is allowed")
    why += statistical
    settings = Subject(subject.model, subject.target, {**subject.settings, **finding.settings})
    more = ["--at", "/".join(directions.text(w) for w in finding.at)] if finding.at is not None else []
    if finding.at is None:
        more = ["--law", law.name, "--seed", str(seed)]
    return Verdict(
        number=law.number,
        law=law.name,
        title=law.title,
        status=status,
        figure=finding.figure,
        shown=finding.shown or f"{finding.figure:.2e}",
        tolerance=finding.tolerance,
        reason=finding.reason,
        p=lowest.p if lowest else None,
        worst=finding.worst,
        command=settings.command(*more),
        meaning=law.meaning,
        why=why,
        notes=finding.notes,
        data=finding.data,
    )


def threshold(tests: int) -> float:
    """p-value below which one of that many tests rejects."""
    return statistics.sidak(SIGNIFICANCE, tests)


def _plain(value: Any) -> Any:
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    return value
