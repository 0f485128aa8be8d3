"""A trial: every law on every subject, none hidden by the failure of another."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from .. import files
from ..errors import GonioWarning, InputError
from ..models import BSDF
from . import box, diagnosis, directions, page, statistics, subject
from .box import Place
from .effort import EFFORTS, ELSEWHERE, Effort
from .laws import Law, chosen
from .report import SIGNIFICANCE, Report
from .subject import Fault, Subject
from .verdict import DECLARED, FAIL, NOT_APPLICABLE, PASS, Card, DoesNotApply, Finding, Verdict
from .watch import limited

DEFAULT_SEED = 1
CONFIRMATION = 0.001  # of the second seed's test: a real error shows there as well, chance does not
Target = BSDF | Subject | str


def verify(
    target: Target | Sequence[Target],
    *,
    sweep: str = "",
    quick: bool = False,
    deep: bool = False,
    seed: int = DEFAULT_SEED,
    law: str | Sequence[str] | None = None,
    report: str | Path | None = None,
    progress: Callable[[int, int, str], None] | None = None,
) -> Report:
    """Put a BSDF, or several, on trial.

        go.verify(go.Conductor.preset("Au", alpha=0.3)).passed

    target    a material; or a target's name as `gonio verify` takes it; or a list of either
    sweep     of a target's name: "alpha=0.01..1", a card for each of five values, or "alpha=0.1,0.5"
    quick     a first look, in seconds
    deep      more samples, more directions, more widths
    seed      of all random numbers; same seed, same report
    law       a law's name, or several; all where None
    report    folder for report.html and report.json; None writes nothing
    progress  called with steps done, steps in all, and what is next
    Returns a Report: `.passed`, `["reciprocity"]`, `.as_dict()`; printed, it is the terminal's table.
    Raises InputError for unknown laws and targets. A failing BSDF raises nothing: the law fails.
    """
    if quick and deep:
        raise InputError("quick and deep together", "--quick", "give one of them")
    if report is not None:
        files.check_folder(report)
    effort = "quick" if quick else "deep" if deep else "default"
    asked = chosen([law] if isinstance(law, str) else law)
    subjects = _subjects(target, sweep)
    started = time.perf_counter()
    steps = len(subjects) * len(asked)
    held: list[tuple[Subject, list[Place], Law, list[Asked]]] = []
    for one in subjects:
        others = _places(one, effort, seed)
        for each in asked:
            if progress:
                progress(len(held), steps, f"{one.title}: {each.name}")
            held.append((one, others, each, _everywhere(each, one, others, effort, seed)))
    tests = sum(len(it.what.trials) for _, _, _, all_ in held for it in all_ if isinstance(it.what, Finding))
    threshold = statistics.sidak(SIGNIFICANCE, tests)
    cards: dict[int, Card] = {}
    answers: dict[int, list[diagnosis.Answer]] = {}
    for one, others, each, all_ in held:
        verdicts = [_verdict(each, it, threshold, seed) for it in all_]
        verdict = _joined(verdicts, all_)
        card = cards.setdefault(id(one), Card(one, [], box.covered(one, others)))
        card.verdicts.append(verdict)
        place, what, _ = next(it for it, v in zip(all_, verdicts, strict=True) if v is verdict)
        found = what if isinstance(what, Finding) else None
        answers.setdefault(id(one), []).append(diagnosis.Answer(each, verdict, place.subject, found))

    def judged(law: Law, other: Subject) -> Verdict:
        what = _judge(law, other, ELSEWHERE[effort], seed)
        return what if isinstance(what, Verdict) else decide(law, other, what, threshold, seed)

    for asked_of_one in answers.values():
        diagnosis.explain(asked_of_one, EFFORTS[effort], seed, judged)
    made = Report(list(cards.values()), seed, effort, tests, threshold, time.perf_counter() - started)
    if report is not None:
        page.write(made, Path(report))
    return made


class Asked(NamedTuple):
    """A law asked of a subject at a place: what it found, and how long that took."""

    place: Place
    what: Finding | Verdict
    seconds: float


def _places(one: Subject, effort: str, seed: int) -> list[Place]:
    """The other values to try; none where the BSDF fails already at being asked, which the laws will report."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", GonioWarning)  # the box goes to the ends of the ranges on purpose
        try:
            return box.places(one, EFFORTS[effort], seed)
        except Fault:
            return []


def _everywhere(law: Law, one: Subject, others: list[Place], effort: str, seed: int) -> list[Asked]:
    """The law at the given values, and elsewhere unless it failed there already."""
    found = []
    for place in [Place({}, "given", one), *(others if law.everywhere else [])]:
        began = time.perf_counter()
        spend = EFFORTS[effort] if place.why == "given" else ELSEWHERE[effort]
        what = _judge(law, place.subject, spend, seed)
        found.append(Asked(place, what, time.perf_counter() - began))
        if isinstance(what, Verdict) and what.failed:
            break  # an exception, or no end: it would be the same, or take for ever
    return found


def _verdict(law: Law, asked: Asked, threshold: float, seed: int) -> Verdict:
    began = time.perf_counter()
    what, place = asked.what, asked.place
    verdict = what if isinstance(what, Verdict) else decide(law, place.subject, what, threshold, seed, place)
    verdict.seconds = asked.seconds + time.perf_counter() - began
    return verdict


def _joined(verdicts: list[Verdict], all_: list[Asked]) -> Verdict:
    """One verdict of those at all places: the given one, unless the law holds there and fails elsewhere."""
    first = verdicts[0]
    failed = [(v, it.place) for v, it in zip(verdicts, all_, strict=True) if v.failed]
    answer = first
    if failed and not first.failed:
        answer, place = failed[0]
        answer.why = [f"at {place.words}: {line}" for line in answer.why]
        answer.notes.insert(0, f"at the given values: {first.status}")
    if len(failed) > 1:
        where = "; ".join(place.words for _, place in failed[1:4] if place.words)
        if where:
            answer.notes.append(f"fails at {len(failed)} of {len(all_)} places, also at {where}")
    answer.places = len(all_)
    answer.seconds = sum(v.seconds for v in verdicts)
    return answer


def _judge(law: Law, one: Subject, effort: Effort, seed: int) -> Finding | Verdict:
    """A law's finding; what goes wrong inside the BSDF is a failure of the law, and of this law only."""

    def verdict(status: str, why: str) -> Verdict:
        command = one.command("--law", law.name)
        return Verdict(law.number, law.name, law.title, status, why=[why], command=command, meaning=law.meaning)

    try:
        with warnings.catch_warnings(), limited(law.name):
            warnings.simplefilter("ignore", GonioWarning)  # variants go to the ends of the ranges on purpose
            return law.judge(one, effort, seed)
    except DoesNotApply as reason:
        return verdict(NOT_APPLICABLE, str(reason))
    except (Fault, TimeoutError) as fault:
        return verdict(FAIL, str(fault))


def decide(
    law: Law, one: Subject, finding: Finding, threshold: float, seed: int, place: Place | None = None
) -> Verdict:
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
    breach = one.breaches.get(law.name)
    if breach is not None:
        size = finding.figure if finding.breach is None else finding.breach
        if why or statistical:
            pass
        elif not over:
            if breach.certain and (place is None or place.why == "given"):
                status, why = FAIL, ["it is declared to be broken, and is not: " + breach.reason]
        elif size <= breach.size * (1.0 + 1e-6) + finding.tolerance:
            status = DECLARED
            finding.notes.insert(0, f"declared: {breach.reason} (at most {breach.size:.4g})")
        else:
            why.append(f"{size:.4g} is more than the declared {breach.size:.4g}: {breach.reason}")
    elif over:
        why.append(f"{finding.shown or f'{finding.figure:.3g}'} where at most {finding.tolerance:.3g} is allowed")
    why += statistical
    settings = Subject(one.model, one.target, {**one.settings, **finding.settings})
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
        evidence=finding.evidence,
    )


def _subjects(target: Target | Sequence[Target], sweep: str) -> list[Subject]:
    if isinstance(target, list | tuple):
        return [one for item in target for one in _subjects(item, sweep)]
    if isinstance(target, str):
        from .targets import resolve

        return resolve(target, sweep=sweep)
    if sweep:
        raise InputError("a sweep of an object", "--sweep", "name the target, such as 'conductor(preset=Au)'")
    return [subject.of(target)]
