"""The process in which a BSDF is judged, as `gonio.verify.child` starts it: it may loop, crash, print, or eat memory.

Orders come pickled on standard input, answers leave pickled by a copy of standard output; what the BSDF itself prints
goes to a file. An order is ("judge", card, skip) or ("card", card, threshold); before each step an answer says what is
next, so that the parent knows what it was that never came back.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import sys
import threading
import time
import warnings
from pathlib import Path
from typing import IO

from ..errors import GonioError, GonioWarning
from . import run, targets, watch
from .child import LOADING, Item, Task
from .laws import chosen
from .subject import Described, Subject, of
from .verdict import Card


def main(log: str) -> None:
    """Judge what the parent orders until it closes the pipe; what is printed goes to the file `log`."""
    orders, answers = _pipes()
    _end_with(os.getppid())
    printed = _Printed(log)
    task, limit = pickle.load(orders)
    watch.watched, watch.LIMIT = True, limit
    say = _Answers(answers)
    warnings.showwarning = say.warning
    warnings.simplefilter("always", GonioWarning)
    try:
        say("begin", -1, LOADING)
        subjects = [one for item in task.items for one in _subjects(item)]
        laws = chosen(task.laws)
        say("loaded", [one.title for one in subjects], [law.name for law in laws])
        held: dict[int, run.Held] = {}
        lines: dict[int, int] = {}
        while True:
            try:
                order, card, what = pickle.load(orders)
            except EOFError:
                break
            before = printed.size()

            def begin(step: str, card: int = card) -> None:
                say("begin", card, step)

            if order == "judge":
                held[card] = run.judged(subjects[card], laws, task.effort, task.seed, begin, what)
                lines[card] = printed.since(before)
                say("judged", card, held[card].tests)
            else:
                made = held[card].card(what, task.seed, begin)
                say("card", card, _plain(made), lines[card] + printed.since(before))
    except GonioError as error:
        say("error", error)
    except (KeyboardInterrupt, SystemExit, GeneratorExit, TimeoutError, MemoryError, RecursionError) as error:
        # Ctrl-C does not come here: this is the BSDF's doing, outside of what `guarded` sees
        say("lost", f"{type(error).__name__} ended the thread that judges it")
    except BaseException as error:
        import traceback

        say("fault", f"{type(error).__name__}: {error}", traceback.format_exc())
    sys.stdout.flush()
    os._exit(0)  # whatever threads and handlers the BSDF has left behind


class _Answers:
    """What goes to the parent, each whole."""

    def __init__(self, pipe: IO[bytes]) -> None:
        self._pipe, self._lock = pipe, threading.Lock()

    def __call__(self, *answer: object) -> None:
        text = pickle.dumps(answer)
        with self._lock, contextlib.suppress(BrokenPipeError):
            self._pipe.write(text)
            self._pipe.flush()

    def warning(self, message: Warning | str, category: type[Warning], *place: object, **more: object) -> None:
        if issubclass(category, GonioWarning):
            self("warning", str(message))


def _pipes() -> tuple[IO[bytes], IO[bytes]]:
    """Both ends, out of the way of whoever reads standard input or prints."""
    orders, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    return orders, answers


class _Printed:
    """Standard output and error, which end in a file from here on."""

    def __init__(self, log: str) -> None:
        self._log = Path(log)
        file = os.open(log, os.O_WRONLY | os.O_APPEND)
        for stream in (1, 2):
            os.dup2(file, stream)
        os.close(file)

    def size(self) -> int:
        """Bytes so far."""
        with contextlib.suppress(Exception):  # the BSDF may have closed them
            sys.stdout.flush()
            sys.stderr.flush()
        return self._log.stat().st_size

    def since(self, before: int) -> int:
        """Lines since it held so many bytes."""
        if self.size() <= before:
            return 0
        with self._log.open("rb") as file:
            file.seek(before)
            text = file.read()
        return text.count(b"\n") + (not text.endswith(b"\n"))


def _end_with(parent: int) -> None:
    """End this process when its parent is gone, be it killed."""
    if sys.platform == "linux":
        import ctypes

        with contextlib.suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG

    def look() -> None:
        while os.getppid() == parent:
            time.sleep(1.0)
        os._exit(2)

    threading.Thread(target=look, daemon=True).start()


def _subjects(item: Item) -> list[Subject]:
    if isinstance(item.target, bytes):
        return [of(pickle.loads(item.target))]
    return targets.resolve(item.target, item.settings, item.sweep)


def _plain(card: Card) -> Card:
    """The card without its model, and without evidence that cannot leave this process."""
    card.subject = Described.of(card.subject)
    for verdict in card.verdicts:
        try:
            pickle.dumps(verdict.evidence)
        except Exception:  # of a law in a package of somebody else's
            verdict.evidence = None
    return card
