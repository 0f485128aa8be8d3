"""A run in parts, one per target. Each part is stored when it is complete, and may be computed by another process or
machine.

The threshold of a statistical test depends on the number of tests in the whole report, which is known only at the end.
A part is therefore evaluated first with the number of its own tests, and again if the final number changes a verdict.
"""

from __future__ import annotations

import contextlib
import pickle
import shutil
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..catalog import outside, shaders
from ..errors import InputError
from ..work import executor, facts, parts
from ..work.kept import Arrays
from .isolation import child
from .report import Report, significance
from .verdict import Unread

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

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
    """The same as `child.trial`, with the same arguments, but computed by the current executor of parts."""
    # Several local processes divide the targets themselves; quick runs are too short to be worth storing.
    if not executor.current().remote and (len(task.items) < 2 or jobs > 1 or task.effort == "quick"):
        return child.trial(task, jobs=jobs, limit=limit, memory=memory, progress=progress)
    began = time.perf_counter()
    names = {str(path): path for item in task.items for path in _files(item)}
    hashes = {name: facts.file_hash(path) for name, path in names.items()}
    with parts.job("verify", task, sorted(hashes.items()), facts.code()) as job:
        if job.found and progress:
            progress(0, len(task.items), f"resuming a run; {job.found} parts are complete")
        judged = _judged(task, range(len(task.items)), None, limit, memory, hashes, progress)
        tests = sum(len(card.p_values) for cards in judged.values() for card in _cards(cards))
        threshold = significance(tests)
        unread = [one for ones in judged.values() for one in ones if isinstance(one, Unread)]
        if len(unread) == len(judged):
            raise InputError(unread[-1].what, unread[-1].where, unread[-1].hint)
        doubtful = [
            number for number, cards in judged.items() if not all(one.decided_by(threshold) for one in _cards(cards))
        ]
        judged |= _judged(task, doubtful, threshold, limit, memory, hashes, progress)
    cards = [card for number in sorted(judged) for card in _cards(judged[number])]
    return Report(cards, task.seed, task.effort, tests, threshold, time.perf_counter() - began, unread=unread)


def _cards(judged: Sequence[Card | Unread]) -> list[Card]:
    return [one for one in judged if not isinstance(one, Unread)]


def _judged(
    task: Task,
    numbers: Sequence[int],
    threshold: float | None,
    limit: float | None,
    memory: float | None,
    hashes: Mapping[str, str],
    progress: Progress | None,
) -> dict[int, list[Card | Unread]]:
    """The cards of some targets, by number; for a shader that cannot be read, the error.

    numbers  indices of the targets in the task
    hashes   file name -> hash of its content, for the files that targets name
    """
    ones = [task._replace(items=[task.items[number]]) for number in numbers]
    arguments = [(one, threshold, limit, memory, dict(hashes)) for one in ones]
    keys = [parts.key_of(one, threshold, sorted(hashes.items()), facts.code(), facts.versions()) for one in ones]
    files = {content: Path(name) for name, content in hashes.items()}
    judged: dict[int, list[Card | Unread]] = {}
    for index, arrays in executor.each(part, arguments, keys, files):
        if index >= 0:
            # trusted: from the user's own folder, or from a worker that executes any code that it receives
            judged[numbers[index]] = pickle.loads(arrays["cards"].tobytes())
            if progress:
                target = task.items[numbers[index]].target
                progress(len(judged), len(numbers), target if isinstance(target, str) else "")
    return judged


def _files(item: Item) -> list[Path]:
    """The files that a target and its settings name."""
    if not isinstance(item.target, str):
        return []
    paths = [path for text in (item.target, *item.settings) for path in outside.files_in(text)]
    if (shader := shaders.file_in(item.target)) is not None and shader.is_file():
        with contextlib.suppress(InputError):  # its part reports it
            shaders.class_of(shaders.head_in(item.target))
        return sorted({*paths, *shaders.files_read(shader)})
    return [path for path in [*paths, Path(item.target)] if path.suffix in (".py", ".xml", ".json") and path.is_file()]


def part(
    task: Task, threshold: float | None, limit: float | None, memory: float | None, hashes: dict[str, str]
) -> Arrays:
    """Compute the cards of the only target of a task in a separate process. For the arguments, see `_judged`."""
    with tempfile.TemporaryDirectory(prefix="gonio-verify-") as folder:
        (item,) = task.items
        for name, content in hashes.items():
            if facts.file_hash(Path(name)) != content and isinstance(item.target, str):  # on another machine
                copy = Path(folder, Path(name).name)
                shutil.copyfile(executor.file(content), copy)
                settings = tuple(text.replace(name, str(copy)) for text in item.settings)
                item = item._replace(target=item.target.replace(name, str(copy)), settings=settings)
        cards: list[Card | Unread]
        try:
            report = child.trial(task._replace(items=[item]), limit=limit, memory=memory, threshold=threshold)
            cards = [*report.cards]
        except InputError as error:
            if not isinstance(item.target, str) or not shaders.head_in(item.target):
                raise
            cards = [Unread(item.target, error.what, error.where, error.hint)]
    return {"cards": np.frombuffer(pickle.dumps(cards), np.uint8)}
