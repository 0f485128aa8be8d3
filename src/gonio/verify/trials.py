"""A trial in parts, one a target: each is kept once it is done, and a crew may do them.

How strict a statistical test must be depends on how many the whole report holds, which is known only at the end. A part
therefore guesses by its own tests, and says the smallest p-value that it met: where none lies below the threshold, or
the guess, the card is the same by both. The others are judged again by the right one.
"""

from __future__ import annotations

import pickle
import shutil
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..catalog import outside
from ..work import crew, facts, parts
from ..work.kept import Arrays
from . import statistics
from .isolation import child
from .report import SIGNIFICANCE, Report

if TYPE_CHECKING:
    from collections.abc import Mapping

    from .isolation.child import Item, Progress, Task
    from .verdict import Card


def trial(
    task: Task,
    *,
    jobs: int = 1,
    limit: float | None = None,
    memory: float | None = None,
    progress: Progress | None = None,
) -> Report:
    """As `child.trial`, by whoever does parts at present."""
    alone = crew.current().size == 1
    # Several processes here share the targets; quick looks are over before anything could be lost.
    if alone and (len(task.items) < 2 or jobs > 1 or task.effort == "quick"):
        return child.trial(task, jobs=jobs, limit=limit, memory=memory, progress=progress)
    began = time.perf_counter()
    names = {str(path): path for item in task.items for path in _files(item)}
    hashes = {name: facts.file_hash(path) for name, path in names.items()}
    with parts.job("verify", task, sorted(hashes.items()), facts.code()) as job:
        if job.found and progress:
            progress(0, len(task.items), f"goes on with a trial that was begun: {job.found} parts of it are done")
        made = _judged(task, list(range(len(task.items))), None, limit, memory, hashes, progress)
        tests = sum(count for _, count, _ in made.values())
        threshold = statistics.sidak(SIGNIFICANCE, tests) if tests else SIGNIFICANCE
        doubtful = [
            index
            for index, (_, count, lowest) in made.items()
            if lowest < max(threshold, statistics.sidak(SIGNIFICANCE, count) if count else SIGNIFICANCE)
        ]
        made |= _judged(task, doubtful, threshold, limit, memory, hashes, progress)
    cards = [card for index in sorted(made) for card in made[index][0]]
    return Report(cards, task.seed, task.effort, tests, threshold, time.perf_counter() - began)


def _judged(
    task: Task,
    numbers: list[int],
    threshold: float | None,
    limit: float | None,
    memory: float | None,
    hashes: Mapping[str, str],
    progress: Progress | None,
) -> dict[int, tuple[list[Card], int, float]]:
    """Cards, tests and smallest p-value of some targets."""
    ones = [task._replace(items=[task.items[number]]) for number in numbers]
    arguments = [(one, threshold, limit, memory, dict(hashes)) for one in ones]
    keys = [parts.key_of(one, threshold, sorted(hashes.items()), facts.code(), facts.versions()) for one in ones]
    files = {content: Path(name) for name, content in hashes.items()}
    found: dict[int, tuple[list[Card], int, float]] = {}
    for index, arrays in crew.each(part, arguments, keys, files):
        if index >= 0:
            # in the user's own folder, or from a worker that runs what it is sent anyway
            found[numbers[index]] = pickle.loads(arrays["cards"].tobytes())
            if progress:
                target = task.items[numbers[index]].target
                progress(len(found), len(numbers), target if isinstance(target, str) else "")
    return found


def _files(item: Item) -> list[Path]:
    """The files that a target names."""
    if not isinstance(item.target, str):
        return []
    found = [*outside.files_in(item.target), *(path for text in item.settings for path in outside.files_in(text))]
    plain = Path(item.target)
    return [path for path in [*found, plain] if path.suffix in (".py", ".xml", ".json") and path.is_file()]


def part(
    task: Task, threshold: float | None, limit: float | None, memory: float | None, hashes: dict[str, str]
) -> Arrays:
    """One target's cards, judged in a process of their own."""
    with tempfile.TemporaryDirectory(prefix="gonio-verify-") as folder:
        (item,) = task.items
        for name, content in hashes.items():
            if facts.file_hash(Path(name)) != content and isinstance(item.target, str):  # on another machine
                copy = Path(folder, Path(name).name)
                shutil.copyfile(crew.file(content), copy)
                settings = tuple(text.replace(name, str(copy)) for text in item.settings)
                item = item._replace(target=item.target.replace(name, str(copy)), settings=settings)
        lowest: list[float] = []
        made = child.trial(task._replace(items=[item]), limit=limit, memory=memory, threshold=threshold, lowest=lowest)
    answer = made.cards, made.tests, min(lowest, default=1.0)
    return {"cards": np.frombuffer(pickle.dumps(answer), np.uint8)}
