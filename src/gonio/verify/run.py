"""A trial: every law on every subject, none hidden by the failure of another."""

from __future__ import annotations

import dataclasses
import time
import warnings
from collections.abc import Callable, Sequence
from typing import Any

from ..errors import GonioWarning, InputError, did_you_mean
from . import laws, report, subject
from .report import Card, DoesNotApply, Finding, Report, Verdict
from .subject import Fault, Subject
from .watch import limited

DEFAULT_SEED = 1


@dataclasses.dataclass(frozen=True)
class Effort:
    """How much is spent.

    pairs            pairs of directions for the pointwise laws
    log_samples      binary logarithm of the samples of the chi-square test, for each direction
    furnace          directions of the furnace's curve
    furnace_samples  of `sample`, for each of them
    accuracy         of integrals
    widths           widths of microfacet distributions that sampling is also tried at
    """

    name: str
    pairs: int
    log_samples: int
    furnace: int
    furnace_samples: int
    accuracy: float
    widths: tuple[float, ...] = ()


EFFORTS = {
    "quick": Effort("quick", 1 << 13, 18, 12, 1 << 15, 1e-4),
    "default": Effort("default", 1 << 16, 20, 32, 1 << 17, 3e-5, (0.005, 1.0)),
    "deep": Effort("deep", 1 << 19, 23, 64, 1 << 20, 1e-5, (0.005, 0.02, 0.05, 0.2, 0.5, 1.0)),
}


def verify(
    target: Any,
    *,
    effort: str = "default",
    seed: int = DEFAULT_SEED,
    laws: Sequence[str] | None = None,
    progress: Callable[[int, int, str], None] | None = None,
) -> Report:
    """Put a BSDF, or several, on trial.

        go.verify(go.Conductor.preset("Au", alpha=0.3)).passed

    target    a material; or a target's name as `gonio verify` takes it; or a list of either
    effort    "quick", "default" or "deep"
    seed      of all random numbers; same seed, same report
    laws      names of the laws to ask, all where None
    progress  called with steps done, steps in all, and what is next
    Returns a Report: `.passed`, `["reciprocity"]`, `.as_dict()`; printed, it is the terminal's table.
    Raises InputError for unknown efforts, laws and targets. A failing BSDF raises nothing: the law fails.
    """
    if effort not in EFFORTS:
        raise InputError(f"unknown effort '{effort}'", "verify: effort", did_you_mean(str(effort), list(EFFORTS)))
    chosen = _laws(laws)
    subjects = _subjects(target)
    started = time.perf_counter()
    steps = len(subjects) * len(chosen)
    found: list[tuple[Subject, Any, Finding | Verdict, float]] = []
    for one in subjects:
        for law in chosen:
            if progress:
                progress(len(found), steps, f"{one.title}: {law.name}")
            began = time.perf_counter()
            found.append((one, law, _judge(law, one, EFFORTS[effort], seed), time.perf_counter() - began))
    tests = sum(len(what.trials) for _, _, what, _ in found if isinstance(what, Finding))
    threshold = report.threshold(tests)
    cards: dict[int, Card] = {}
    for one, law, what, seconds in found:
        began = time.perf_counter()
        verdict = report.decide(law, one, what, threshold, seed) if isinstance(what, Finding) else what
        verdict.seconds = seconds + time.perf_counter() - began
        cards.setdefault(id(one), Card(one, [])).verdicts.append(verdict)
    return Report(list(cards.values()), seed, effort, tests, threshold, time.perf_counter() - started)


def _judge(law: Any, one: Subject, effort: Effort, seed: int) -> Finding | Verdict:
    """A law's finding; what goes wrong inside the BSDF is a failure of the law, and of this law only."""

    def verdict(status: str, why: str) -> Verdict:
        command = one.command("--law", law.name)
        return Verdict(law.number, law.name, law.title, status, why=[why], command=command, meaning=law.meaning)

    try:
        with warnings.catch_warnings(), limited(law.name):
            warnings.simplefilter("ignore", GonioWarning)  # variants go to the ends of the ranges on purpose
            return law.judge(one, effort, seed)
    except DoesNotApply as reason:
        return verdict(report.NOT_APPLICABLE, str(reason))
    except (Fault, TimeoutError) as fault:
        return verdict(report.FAIL, str(fault))


def _laws(names: Sequence[str] | None) -> list[Any]:
    known = laws.laws()
    if names is None:
        return list(known.values())
    for name in names:
        if name not in known:
            raise InputError(f"unknown law '{name}'", "verify: laws", did_you_mean(name, list(known)))
    return [law for name, law in known.items() if name in names]


def _subjects(target: Any) -> list[Subject]:
    if isinstance(target, list | tuple):
        return [one for item in target for one in _subjects(item)]
    if isinstance(target, str):
        from .targets import resolve

        return resolve(target)
    return [subject.of(target)]
