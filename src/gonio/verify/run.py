"""A run of `gonio verify`: every law is tested on every subject, independently of the results of other laws."""

from __future__ import annotations

import contextlib
import json
import sys
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple, TypeAlias, cast

from .. import members
from ..arguments import renamed
from ..catalog.material import MaterialLike, material
from ..errors import GonioWarning, InputError
from ..material import BSDF
from ..owner import public
from . import box, directions, quality, subject
from .box import Place
from .ci.outputs import Outputs
from .effort import EFFORTS, ELSEWHERE, Effort
from .forensics import diagnosis
from .isolation.watch import limited
from .laws import Law, chosen
from .report import Report, significance
from .subject import Fault, Subject
from .verdict import DECLARED, FAIL, NOT_APPLICABLE, NOT_TRIED, PASS, Card, DoesNotApply, Finding, Verdict

DEFAULT_SEED = 1
# steps of a run other than the laws
PLACES, QUALITY = "other values", "sampling quality"
GUIDES = 2  # other values at which laws that test sampling are applied to a guide; each takes seconds
CONFIRMATION = 0.001  # p-value with a second seed below which a rejection is confirmed
Target: TypeAlias = "MaterialLike | Subject"
Begin = Callable[[str], None]


@renamed(sweep="vary", report="output", jobs="workers", limit="timeout")
@public
def verify(
    target: Target | Sequence[Target],
    *,
    vary: str = "",
    quick: bool = False,
    deep: bool = False,
    seed: int | None = None,
    law: str | Sequence[str] | None = None,
    output: str | Path | None = None,
    junit: str | Path | None = None,
    sarif: str | Path | None = None,
    baseline: str | Path | None = None,
    write_baseline: str | Path | None = None,
    tolerate: str = "",
    progress: Callable[[int, int, str], None] | None = None,
    isolated: bool | None = None,
    workers: int = 1,
    timeout: float | None = None,
    memory: float | None = None,
) -> Report:
    """Test a BSDF, or several, against the laws.

        go.verify(go.Conductor.preset("Au", alpha=0.3)).passed

    target    anything that `go.material` accepts, the name of a target as for `gonio verify`, or a list of these
    vary      values of one parameter of a target given by name, "alpha=0.01..1" (five) or "alpha=0.1,0.5"; a card each
    quick     whether to run only a fast first check; `deep` uses more samples, directions and widths
    seed      seed of all random numbers, 1 if None; the same seed gives the same report
    law       name of a law, or a list of names; None selects all laws
    output    folder for report.html and report.json
    junit     file for output as JUnit XML; `sarif` is a file for output as SARIF
    baseline  file of known failures, which do not fail the report; the failures are written to `write_baseline`
    tolerate  "invisible", "small" or "visible": failures of this or a less severe grade do not fail the report
    progress  called with the number of completed steps, the number of all steps, and the name of the next step
    isolated  whether each BSDF is tested in a separate process, in case it crashes; None: only if it is given by name
    workers   number of such processes that run at a time; the results do not depend on it
    timeout   seconds per law in such a process; None means 300
    memory    GB per process; None means half of the machine's memory for all processes together
    Returns a Report with `.passed`, `["reciprocity"]` and `.as_dict()`; `print` shows it as in the terminal.
    Raises InputError for unknown laws and targets. An error inside a BSDF is not raised; it fails the law.
    """
    seed = DEFAULT_SEED if seed is None else seed
    if seed < 0:
        raise InputError(f"seed {seed} given, 0 or more expected", "--seed")
    effort = _effort(quick, deep)
    outputs = Outputs(output, junit, sarif, baseline, write_baseline, tolerate)
    known = outputs.check()
    names = None if law is None else [law] if isinstance(law, str) else list(law)
    all_ = [_target(one) for one in (target if isinstance(target, list | tuple) else [cast(Target, target)])]
    if isolated or (isolated is None and _isolable(all_)):
        from . import trials
        from .isolation import child

        items = [child.Item(one, (), vary) if isinstance(one, str) else child.item_of(one) for one in all_]
        task = child.Task(items, effort, seed, names)
        result = trials.trial(task, jobs=workers, limit=timeout, memory=memory, progress=progress)
    else:
        result = _here(_subjects(all_, vary), chosen(names), effort, seed, progress)
    outputs.write(result, known)
    return result


def _target(given: Target) -> BSDF | Subject | str:
    """A target as a string, which may name a plugin, or as a material."""
    if isinstance(given, str | Path | Subject):
        return given if isinstance(given, Subject) else str(given)
    if isinstance(given, Mapping):
        with contextlib.suppress(TypeError):  # it contains materials, or arrays
            return json.dumps(given)
    return material(given)


def _effort(quick: bool, deep: bool) -> str:
    """The key of the effort in `EFFORTS`."""
    if quick and deep:
        raise InputError("both quick and deep given", "--quick", "give one of them")
    return "quick" if quick else "deep" if deep else "default"


def _isolable(targets: Sequence[BSDF | Subject | str]) -> bool:
    """Whether another process can load the targets by their names, without classes that this program registered."""
    if not all(isinstance(one, str) for one in targets) or not sys.executable:
        return False
    return not any(name in str(one) for one in targets for name in members.registered)


def _here(
    subjects: list[Subject], laws: list[Law], effort: str, seed: int, progress: Callable[[int, int, str], None] | None
) -> Report:
    """Test the subjects in this process."""
    started = time.perf_counter()
    steps, done = len(subjects) * len(laws), 0
    results = []
    for one in subjects:

        def begin(what: str, title: str = one.title) -> None:
            nonlocal done
            if progress:
                progress(min(done, steps), steps, f"{title}: {what}")
            done += what not in (PLACES, QUALITY)

        results.append(judged(one, laws, effort, seed, begin))
    tests = sum(len(one.p_values) for one in results)
    threshold = significance(tests)
    cards = [one.card(threshold, seed, effort) for one in results]
    return Report(cards, seed, effort, tests, threshold, time.perf_counter() - started)


class Judged(NamedTuple):
    """The findings on a subject, before the number of statistical tests in the whole report is known.

    subject  the subject with the given parameter values
    others   the other parameter values at which it was tested
    laws     each law with its results at all places
    quality  quality of the sampling; None if it was not measured
    """

    subject: Subject
    others: list[Place]
    laws: list[tuple[Law, list[Asked]]]
    quality: quality.Quality | None

    @property
    def p_values(self) -> list[float]:
        """The p-values of its statistical tests."""
        findings = [asked.what for _, all_ in self.laws for asked in all_ if isinstance(asked.what, Finding)]
        return [trial.p for finding in findings for trial in finding.trials]

    def card(self, threshold: float | None, seed: int, effort: str, begin: Begin = lambda what: None) -> Card:
        """The verdicts, with the severity and the cause of each failure, for which the BSDF is called again.

        threshold  p-value below which a test rejects; None for that of a report on this subject alone
        begin      function that is called with the name of each law before its verdict
        """
        threshold = significance(len(self.p_values)) if threshold is None else threshold
        answers = []
        for law, all_ in self.laws:
            begin(law.name)
            verdict, asked = _joined(law, all_, threshold, seed)
            finding = asked.what if isinstance(asked.what, Finding) else None
            answers.append(diagnosis.Answer(law, verdict, asked.place.subject, finding))

        def judge(law: Law, other: Subject) -> Verdict:
            what = _judge(law, other, EFFORTS[effort], seed)
            return what if isinstance(what, Verdict) else decide(law, other, what, threshold, seed)

        diagnosis.explain(answers, EFFORTS[effort], seed, judge)
        verdicts = [answer.verdict for answer in answers]
        covered = box.covered(self.subject, self.others)
        return Card(self.subject, verdicts, covered, [], self.quality, self.p_values, threshold)


def judged(
    one: Subject,
    laws: list[Law],
    effort: str,
    seed: int,
    begin: Begin = lambda what: None,
    skip: Mapping[str, str] = MappingProxyType({}),
    result: Callable[[str, str], None] = lambda law, text: None,
) -> Judged:
    """The findings of the laws on a subject.

    begin   function that is called with the name of the next law or other step
    skip    steps to skip, each with the reason: the BSDF crashed the process there, or did not return
    result  function that is called with the name of a law and its preliminary result, without size and cause, which the
            verdict adds
    """
    begin(PLACES)
    others = [] if PLACES in skip else _places(one, effort, seed)
    results: list[tuple[Law, list[Asked]]] = []
    for law in laws:
        if law.name in skip:
            results.append((law, [Asked(Place({}, "given", one), _failed(law, one, skip[law.name]), 0.0)]))
            continue
        begin(law.name)
        results.append((law, _everywhere(law, one, others, effort, seed)))
        result(law.name, _preliminary(results[-1][1], law.name in one.breaches))
    begin(QUALITY)
    return Judged(one, others, results, None if QUALITY in skip else quality.of(one, seed))


class Asked(NamedTuple):
    """The result of a law for a subject at one place, and the time taken in seconds."""

    place: Place
    what: Finding | Verdict
    seconds: float


def _preliminary(all_: list[Asked], declared: bool) -> str:
    """A law's result at all places as text, before its statistical tests are evaluated: their threshold depends on all
    laws.

    declared  whether a violation of the law is declared; the verdict then compares its size
    """
    verdicts = [asked.what for asked in all_ if isinstance(asked.what, Verdict)]
    findings = [asked.what for asked in all_ if isinstance(asked.what, Finding)]
    if any(one.failed for one in verdicts) or any(one.problems or not one.figure <= one.tolerance for one in findings):
        return "does not hold, as declared" if declared else "does not hold"
    if not findings:
        return "does not apply" if all(one.status == NOT_APPLICABLE for one in verdicts) else "not tried"
    tests = sum(len(one.trials) for one in findings)
    places = f"{len(findings)} {'setting' if len(findings) == 1 else 'settings'}"
    return (
        f"{tests} statistical {'test' if tests == 1 else 'tests'} at {places} pending"
        if tests
        else f"holds at {places}"
    )


def _places(one: Subject, effort: str, seed: int) -> list[Place]:
    """The other parameter values at which to test; none if the BSDF fails while they are being chosen. The laws then
    report the failure."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", GonioWarning)  # values at the ends of the ranges are intended
        try:
            return box.places(one, EFFORTS[effort], seed)
        except Fault:
            return []


def _everywhere(law: Law, one: Subject, others: list[Place], effort: str, seed: int) -> list[Asked]:
    """A law's results at the given parameter values and, unless it fails there, at the others."""
    results = []
    if law.samples and one.guided:
        others = others[:GUIDES]
    for place in [Place({}, "given", one), *(others if law.everywhere else [])]:
        began = time.perf_counter()
        place = place if law.at_ends else place.inside()
        spend = EFFORTS[effort] if place.why == "given" else ELSEWHERE[effort]
        what = _judge(law, place.subject, spend, seed)
        results.append(Asked(place, what, time.perf_counter() - began))
        if isinstance(what, Verdict) and what.failed:
            break  # an exception or a timeout, which would repeat
        if isinstance(what, Finding) and place.why == "given" and (what.problems or not what.figure <= what.tolerance):
            break  # it fails, or is violated as declared, at the given values
    return results


def _verdict(law: Law, asked: Asked, threshold: float, seed: int) -> Verdict:
    began = time.perf_counter()
    what, place = asked.what, asked.place
    verdict = what if isinstance(what, Verdict) else decide(law, place.subject, what, threshold, seed, place)
    verdict.seconds = asked.seconds + time.perf_counter() - began
    return verdict


def _joined(law: Law, all_: list[Asked], threshold: float, seed: int) -> tuple[Verdict, Asked]:
    """The verdict over all places, and the result on which it is based: that at the given values, unless the law holds
    there and fails elsewhere. After three failures, the remaining places are skipped."""
    first = _verdict(law, all_[0], threshold, seed)
    answer, where = first, all_[0]
    failed: list[Asked] = []
    for asked in all_[1:] if not first.failed else ():
        verdict = _verdict(law, asked, threshold, seed)
        if not verdict.failed:
            continue
        if not failed:
            answer, where = verdict, asked
            answer.why = [f"at {asked.place.words}: {line}" for line in answer.why]
            answer.notes.insert(0, f"verdict at the given parameter values: {first.status}")
        failed.append(asked)
        if len(failed) == 3:
            break
    if len(failed) > 1:
        answer.notes.append(f"also fails at {'; '.join(asked.place.words for asked in failed[1:])}")
    answer.places = len(all_)
    answer.seconds += sum(asked.seconds for asked in all_ if asked is not where)
    return answer, where


def _judge(law: Law, one: Subject, effort: Effort, seed: int) -> Finding | Verdict:
    """The finding of a law. An error inside the BSDF is a failure of this law only."""
    try:
        with warnings.catch_warnings(), limited(law.name):
            warnings.simplefilter("ignore", GonioWarning)  # values at the ends of the ranges are intended
            return law.judge(one, effort, seed)
    except DoesNotApply as reason:
        return _failed(law, one, str(reason), NOT_APPLICABLE)
    except (Fault, TimeoutError, InputError) as fault:  # a direction that is not a unit vector is rejected as bad input
        return _failed(law, one, str(fault))


def _failed(law: Law, one: Subject, why: str, status: str = FAIL) -> Verdict:
    """A verdict without a measured value."""
    command = one.command("--law", law.name)
    return Verdict(law.number, law.name, law.title, status, why=[why], command=command, meaning=law.meaning)


def decide(
    law: Law, one: Subject, finding: Finding, threshold: float, seed: int, place: Place | None = None
) -> Verdict:
    """The verdict on a finding at a `place`, None for the given values; tests reject p-values below `threshold`."""
    why = list(finding.problems)
    statistical: list[str] = []
    lowest = min(finding.trials, key=lambda trial: trial.p, default=None)
    for trial in sorted(finding.trials, key=lambda trial: trial.p):
        if not trial.p < threshold or len(statistical) >= 3:
            break  # three confirmed rejections are enough
        trial.second = trial.repeat()
        if trial.second < CONFIRMATION:
            statistical.append(f"{trial.where}: p = {trial.p:.2g}, and p = {trial.second:.2g} with a second seed")
        else:
            text = f"{trial.where}: p = {trial.p:.2g} was due to chance (p = {trial.second:.2g} with a second seed)"
            finding.notes.append(text)
    over = not finding.figure <= finding.tolerance
    status = FAIL if why or statistical or over else PASS
    breach = finding.known or one.breaches.get(law.name)
    if breach is not None:
        size = finding.figure if finding.breach is None else finding.breach
        if why or statistical:
            pass
        elif not over:
            if breach.certain and (place is None or place.why == "given"):
                status, why = (FAIL, ["a violation is declared, but the law holds: " + breach.reason])
        elif size <= breach.size * (1.0 + 1e-6) + finding.tolerance:
            status = DECLARED
            bound = "no declared bound" if breach.size == float("inf") else f"declared bound: {breach.size:.4g}"
            finding.notes.insert(0, f"declared violation: {breach.reason}; {bound}")
        else:
            why.append(f"the violation of {size:.4g} exceeds the declared bound of {breach.size:.4g}: {breach.reason}")
    elif over:
        why += _exceeds(finding, law.name in getattr(one.model, "known_violations", {}))
    why += statistical
    if status == PASS and finding.untried:
        status, why = NOT_TRIED, [finding.untried]
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


def _exceeds(finding: Finding, declared: bool) -> list[str]:
    """A description of a measured value above its tolerance.

    declared  whether a violation is declared for other parameters
    """
    figure = finding.shown or f"{finding.figure:.3g}"
    allowed = finding.allowed or (f"{finding.tolerance:.3g}" if finding.tolerance else "")
    measured = figure if " " in figure else f"measured value {figure}"
    words = [f"{measured}; {f'at most {allowed}' if allowed else 'none'} is allowed"]
    return words + ["a violation is declared, but with size 0 for these parameter values"] * declared


def _subjects(targets: Sequence[BSDF | Subject | str], vary: str) -> list[Subject]:
    subjects: list[Subject] = []
    for target in targets:
        if isinstance(target, str):
            from .targets import resolve

            subjects += resolve(target, vary=vary)
        elif vary:
            raise InputError("a sweep of a Python object", "--vary", "name the target, such as 'conductor(preset=Au)'")
        else:
            subjects.append(subject.of(target))
    return subjects
