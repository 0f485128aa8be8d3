"""A run in separate processes, which reports on a BSDF even if it loops forever, crashes, prints or exhausts memory.

    trial(Task((Item("glass.py:Glass"),), "quick", seed=1), jobs=2)

Each process (`worker`) tests one card at a time and announces every step and every call of the BSDF. If it crashes, or
exceeds its time or memory limit, a new process tests the card again without the call that was in progress; the laws
that need this call fail. If no call was in progress, the law is omitted. The threshold of a statistical test depends on
the number of tests in the report, which is known only after all cards. A card is therefore evaluated with the number of
its own tests, and again if the final number changes a verdict, so that the report does not depend on the number of
processes.

This module does not import NumPy or other modules of Gonio at the top, because the first process starts before this
one loads the rest.
"""

from __future__ import annotations

import contextlib
import dataclasses
import os
import pickle
import queue
import sys
import time
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import psutil

from ...errors import GonioWarning, InputError, MachineError
from . import watch
from .process import BETWEEN, LOADING, STARTING, Call, Process

if TYPE_CHECKING:
    from ..report import Report
    from ..verdict import Card, Unread

ISOLATED = "isolated"  # location of the error about a material that cannot be sent
OTHERS = "*"  # key that stands for all parameter values except the given ones
LOOK = 0.05  # seconds between two checks of time and memory
STRIKES = 3  # crashes in a method after which it is called only at the given values; also crashes outside any call

Progress = Callable[[int, int, str], None]
Tell = Callable[[str], None]


class Item(NamedTuple):
    """A target of a run.

    target    its name, or a pickled material
    settings  values of its parameters, each "alpha=0.3"
    sweep     values of one parameter, in the form of `vary` of `targets.resolve`
    """

    target: str | bytes
    settings: tuple[str, ...] = ()
    sweep: str = ""

    @property
    def cards(self) -> int:
        """The largest number of cards that may result from it."""
        return 1 if not self.sweep else 5 if ".." in self.sweep else self.sweep.count(",") + 1


class Task(NamedTuple):
    """The task of a run.

    items   the targets
    effort  name of the effort
    seed    seed of all random numbers
    laws    names of the laws; None for all
    """

    items: list[Item]
    effort: str
    seed: int
    laws: list[str] | None = None


def item_of(material: Any) -> Item:
    """A material in a form that another process can load. Raises InputError if there is none."""
    from ...catalog import notation, outside
    from ...material import BSDF, tree

    if not isinstance(material, BSDF):
        material = getattr(material, "model", material)
    if isinstance(material, BSDF):
        classes: list[type] = [type(inner) for _, inner in tree.walk(material)]
        parts = (leaf.parameter.portable(leaf.value) for leaf in tree.leaves(material) if not leaf.parameter.numeric)
        classes += [part if isinstance(part, type) else type(part) for part in parts]  # distributions and their like
        if any(outside.is_outside(cls) for cls in classes):
            values = notation.settings(material).items()
            settings = [f"{name}={notation.setting(material, name, value)}" for name, value in values]
            return Item(notation.spelled(type(material)), tuple(settings))
        with contextlib.suppress(Exception):
            if not any(cls.__module__ == "__main__" for cls in classes):
                return Item(pickle.dumps(material))
    what = f"{type(material).__name__} cannot be sent to another process"
    raise InputError(what, ISOLATED, "put the class into a file and name it FILE.py:CLASS")


def trial(
    task: Task,
    *,
    jobs: int = 1,
    limit: float | None = None,
    memory: float | None = None,
    progress: Progress | None = None,
    tell: Tell | None = None,
    threshold: float | None = None,
) -> Report:
    """The report of a task.

    jobs       number of processes that run at a time
    limit      seconds per law; None means GONIO_VERIFY_LIMIT or 300
    memory     GB per process; None means half of the machine's memory for all processes together
    progress   function that is called with the number of completed steps, the number of all steps, and the next step
    tell       function that is called with the result of each law (if there are several cards, of each card) as soon as
               the result is known
    threshold  p-value below which a test rejects, if the task is part of a larger one
    """
    if jobs < 1:
        raise InputError(f"{jobs} workers requested", "--workers", "give 1 or more")
    limit = watch.LIMIT if limit is None else limit
    for name, value in (("--timeout", limit), ("--memory", memory)):
        if value is not None and value <= 0.0:
            raise InputError(f"a limit of {value:g} given", name, "give more than 0")
    jobs = min(jobs, sum(item.cards for item in task.items))
    most = 0.5 * _machine_memory() / max(jobs, 1) if memory is None else memory * 1e9
    started = time.perf_counter()
    pool = _Pool(task, jobs, limit, most, progress, tell)
    try:
        from ..report import Report, significance  # while the first process loads what it needs

        pool.judge(threshold)
        tests = sum(len(card.p_values) for card in pool.cards)
        if threshold is None:
            threshold = significance(tests)
            pool.judge(threshold, [number for number, card in enumerate(pool.cards) if not card.decided_by(threshold)])
        seconds = time.perf_counter() - started
        return Report(pool.cards, task.seed, task.effort, tests, threshold, seconds, unread=pool.unread)
    finally:
        for worker in pool.workers:
            worker.close()


@dataclasses.dataclass
class _State:
    """The state of a card that is being tested.

    skip       laws that must not be tested again, with the reasons
    forbidden  methods, with the parameter values for which they must not be called again, and the reasons
    strikes    number of crashes outside any call
    """

    title: str
    skip: dict[str, str] = dataclasses.field(default_factory=dict)
    forbidden: dict[tuple[str, str], str] = dataclasses.field(default_factory=dict)
    notes: dict[str, None] = dataclasses.field(default_factory=dict)
    strikes: int = 0
    card: Card | None = None

    def avoid(self, laws: list[str], step: str, call: Call | None, reason: str) -> None:
        """Exclude the call in progress from the next attempt or, if there was none, the law."""
        if call is not None and call[:2] not in self.forbidden:
            method, key, values = call
            self.forbidden[method, key] = f"{reason} (in {method}{', at ' if values else ''}{values})"
            reasons = [text for (name, _), text in self.forbidden.items() if name == method]
            if len(reasons) >= STRIKES:
                others = f"not called at these values, because {reasons[0]}; likewise at other values"
                self.forbidden.setdefault((method, OTHERS), others)
            return
        self.strikes += step == BETWEEN
        if step in self.skip or self.strikes >= STRIKES:
            if all(law in self.skip for law in laws):
                raise MachineError(f"the test process crashes at every step: {reason}", self.title)
            self.skip = dict.fromkeys(laws, reason) | self.skip
        elif step != BETWEEN:
            self.skip[step] = reason
            if step not in laws:
                self.notes[f"{step}: {reason}"] = None


class _Pool:
    """The processes of a run, and the state of each card."""

    def __init__(
        self, task: Task, jobs: int, limit: float, memory: float, progress: Progress | None, tell: Tell | None
    ) -> None:
        self.task, self.jobs, self.limit, self.memory = task, jobs, limit, memory
        self.progress, self.tell = progress, tell
        self.answers: queue.Queue[tuple[Process, Any]] = queue.Queue()
        self.workers = [Process(task, limit, self.answers) for _ in range(jobs)]
        self.states: list[_State] | None = None  # once a process has loaded the targets
        self.waiting: list[int] = []  # numbers of the cards that have no process yet
        self.laws: list[str] = []
        self.unread: list[Unread] = []
        self.begun: set[tuple[int, str]] = set()
        self.told: set[tuple[int, str]] = set()
        self.warned: set[str] = set()

    @property
    def cards(self) -> list[Card]:
        return [one.card for one in self.states or () if one.card]

    def judge(self, threshold: float | None, repeat: Sequence[int] = ()) -> None:
        """Test all cards, or some of them again.

        threshold  p-value below which a test rejects; None for that of a report on each card alone
        repeat     indices of the cards to test again; empty for all cards
        """
        self.waiting = list(repeat)
        for number in repeat:
            assert self.states is not None
            self.states[number].card = None
        while self.jobs and (self.states is None or len(self.cards) < len(self.states)):
            self._distribute(threshold)
            self._listen()

    def _distribute(self, threshold: float | None) -> None:
        """Give each idle process a card, and replace processes that ended."""
        for worker in self.workers:
            if self.waiting and not worker.busy and self.states:
                number = self.waiting.pop(0)
                worker.busy = True
                worker.begins(number, BETWEEN)
                worker.order(number, self.states[number].skip, self.states[number].forbidden, threshold)
        loading = sum(worker.card < 0 for worker in self.workers)
        for _ in range(min(len(self.waiting) - loading, self.jobs - len(self.workers))):
            self.workers.append(Process(self.task, self.limit, self.answers))

    def _listen(self) -> None:
        """Handle the answers that arrive within a short time, and end processes that exceed their limits."""
        with contextlib.suppress(queue.Empty):
            timeout = LOOK
            while True:
                worker, answer = self.answers.get(timeout=timeout)
                timeout = 0.0
                if worker in self.workers:
                    name, *what = answer or ("lost", worker.why())
                    getattr(self, f"_{name}")(worker, *what)
        for worker in self.workers:
            over = worker.over(self.limit, self.memory)
            if over:
                worker.end(over)  # which ends its answers

    # ------------------------------------------------------------------ the answers of a process, by their names

    def _step(self, worker: Process, card: int, step: str) -> None:
        worker.begins(card, step)
        if self.progress and self.states:
            steps = len(self.states) * len(self.laws)
            self.progress(min(len(self.begun), steps), steps, f"{self.states[card].title}: {step}")
        if step in self.laws:
            self.begun.add((card, step))

    def _result(self, worker: Process, card: int, law: str, result: str) -> None:
        assert self.states is not None
        if len(self.states) == 1:
            self._tell(card, f"{law}: {result}")

    def _tell(self, card: int, text: str) -> None:
        if self.tell and (card, text) not in self.told:  # a card may be tested twice
            self.told.add((card, text))
            self.tell(text)

    def _loaded(self, worker: Process, titles: list[str], laws: list[str], unread: list[Unread]) -> None:
        self.unread = unread
        if self.states is None:
            self.laws, self.states = laws, [_State(title) for title in titles]
            self.waiting = list(range(len(titles)))
        worker.busy = False
        worker.begins(0, BETWEEN)
        worker.lines()  # printed while it loaded

    def _card(self, worker: Process, number: int, card: Card) -> None:
        assert self.states is not None
        worker.busy = False
        printed = worker.lines()
        if printed:
            card.notes.append(f"it printed {printed} {'line' if printed == 1 else 'lines'} during the tests")
        card.notes += self.states[number].notes
        self.states[number].card = card
        if len(self.states) > 1:
            failed = [one.law for one in card.verdicts if one.failed]
            self._tell(number, f"{card.title}: {'fails ' + ', '.join(failed) if failed else 'holds'}")

    def _warning(self, worker: Process, text: str) -> None:
        if text not in self.warned:
            self.warned.add(text)
            warnings.warn(text, GonioWarning, stacklevel=2)

    def _error(self, worker: Process, error: Exception, trace: str = "") -> None:
        if trace and os.environ.get("GONIO_DEBUG"):
            print(trace, file=sys.stderr)
        raise error

    def _lost(self, worker: Process, reason: str) -> None:
        """Handle the end of a process, whose card is tested again without the step or the call in progress."""
        last, call = worker.last_line(), worker.call
        worker.close()
        self.workers.remove(worker)
        words = f"{reason}; the last line that it printed: {last}" if last else reason
        if worker.step == STARTING:
            raise MachineError(f"the test process did not start: {words}", "", "see `gonio doctor`")
        if worker.step == LOADING or self.states is None:
            names = ", ".join(item.target for item in self.task.items if isinstance(item.target, str))
            raise InputError(f"{LOADING}: {words}", names, "a BSDF must load before it can be tested")
        if worker.busy:
            one = self.states[worker.card]
            if last:
                one.notes[f"the last line that it printed before it ended: {last}"] = None
            one.avoid(self.laws, worker.step, call, reason)
            self.waiting.insert(0, worker.card)


def _machine_memory() -> float:
    """The memory in bytes of this machine or of its container, whose limit psutil ignores."""
    sizes = [float(psutil.virtual_memory().total)]
    for path in ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"):
        with contextlib.suppress(ValueError, OSError):
            sizes.append(float(Path(path).read_text()))  # "max" is not a number
    return min(sizes)


__all__ = ["Item", "Task", "item_of", "trial"]
