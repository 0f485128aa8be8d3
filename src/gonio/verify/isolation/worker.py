"""The process in which a BSDF is judged, as `child` starts it: it may loop, crash, print, or eat memory.

Orders come pickled on standard input, answers leave pickled by a copy of standard output; what the BSDF itself prints
goes to a file. An order is ("judge", card, skip, forbidden) or ("card", card, threshold); before each step an answer
says what is next, and a file says which method is being called, so that the parent knows what it was that never came
back.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import mmap
import os
import pickle
import signal
import sys
import threading
import time
import traceback
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

from ...catalog import notation, outside
from ...errors import GonioError, GonioWarning, InputError
from ...material import BSDF
from .. import run, targets
from ..laws import chosen
from ..subject import Described, Fault, Subject, of
from ..verdict import Card
from . import watch
from .child import CALLING, ISOLATED, LOADING, OTHERS, PRINTED, Item


def main(folder: str) -> None:
    """Judge what the parent orders until it closes the pipe. The folder is for what is printed, and what is called."""
    orders, answers = _pipes()
    _end_with(os.getppid())
    printed = _Printed(Path(folder, PRINTED))
    calls = _Calls(Path(folder, CALLING))
    task, limit = pickle.load(orders)
    watch.watched, watch.LIMIT, watch.calling = True, limit, calls
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
                order, card, *what = pickle.load(orders)
            except EOFError:
                break
            before = printed.size()

            def begin(step: str, card: int = card) -> None:
                say("begin", card, step)

            if order == "judge":
                skip, forbidden = what
                calls.judge(subjects[card].model, forbidden)
                held[card] = run.judged(subjects[card], laws, task.effort, task.seed, begin, skip)
                lines[card] = printed.since(before)
                say("judged", card, held[card].tests, held[card].lowest)
            else:
                made = held[card].card(what[0], task.seed, task.effort, begin)
                say("card", card, _plain(made), lines[card] + printed.since(before))
    except GonioError as error:
        say("error", error)
    except (_Stuck, Fault) as error:  # a fault here is that of a test's repetition
        say("lost", str(error))
    except (KeyboardInterrupt, SystemExit, GeneratorExit, TimeoutError, MemoryError, RecursionError) as error:
        # Ctrl-C does not come here: this is the BSDF's doing, outside of what `guarded` sees
        say("lost", f"{type(error).__name__} ended the thread that judges it")
    except BaseException as error:
        place = _outside(error)
        if place:
            say("lost", f"{type(error).__name__}: {error} ({place})")
        else:
            say("fault", f"{type(error).__name__}: {error}", traceback.format_exc())
    sys.stdout.flush()
    os._exit(0)  # whatever threads and handlers the BSDF has left behind


def _outside(error: BaseException) -> str:
    """file:line where an exception came from a file of the user's, in no call that `guarded` sees; else ""."""
    files = {getattr(module, "__file__", "") for name, module in sys.modules.items() if name.startswith(outside.PREFIX)}
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if frame.filename in files]
    return f"{Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else ""


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

    def __init__(self, log: Path) -> None:
        self._log = log
        file = os.open(log, os.O_WRONLY | os.O_APPEND)
        for stream in (1, 2):
            os.dup2(file, stream)
        os.close(file)
        if isinstance(sys.stdout, io.TextIOWrapper):
            sys.stdout.reconfigure(line_buffering=True)  # else the last words of a process that aborts die with it

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


class _Stuck(BaseException):
    """A call that did not end in time. Past every law: the parent starts anew, and that call is not made again."""


class _Calls:
    """Which method of which material is being called, kept in a file that outlives this process.

    forbidden   by method and values, why it must not be called again
    given       the key of the values that the material was given
    """

    def __init__(self, file: Path) -> None:
        with file.open("r+b") as opened:
            self._memory = mmap.mmap(opened.fileno(), 0)
        self.forbidden: dict[tuple[str, str], str] = {}
        self.given = ""
        self._keys: dict[int, tuple[Any, str, str]] = {}

    def judge(self, model: Any, forbidden: dict[tuple[str, str], str]) -> None:
        self.given, self.forbidden = self._values(model)[0], forbidden

    @contextlib.contextmanager
    def __call__(self, model: Any, method: str) -> Iterator[None]:
        key, words = self._values(model)
        why = self.forbidden.get((method, key)) or (key != self.given and self.forbidden.get((method, OTHERS)))
        if why:
            raise Fault(why)
        text = f"{method}\t{key}\t{words}\n".encode()
        self._memory[: len(text)] = text
        try:
            yield
        except TimeoutError as error:
            raise _Stuck(str(error)) from error  # and the file still says what was called
        except BaseException as error:
            self._memory[:1] = b"\n"
            if isinstance(error, KeyboardInterrupt):  # the BSDF's doing: Ctrl-C does not come here
                raise Fault(f"KeyboardInterrupt in {method}") from error
            raise
        self._memory[:1] = b"\n"

    def _values(self, model: Any) -> tuple[str, str]:
        """The values of a material's parameters as a key, the same in every process, and in words."""
        known = self._keys.get(id(model))
        if known is None or known[0] is not model:  # the model is kept, so that no other gets its id
            key = words = ""
            if isinstance(model, BSDF):
                with contextlib.suppress(Exception):
                    settings = notation.settings(model)
                    key = hashlib.sha256(repr(settings).encode()).hexdigest()[:16]
                    words = ", ".join(f"{name} = {notation.written(value)}" for name, value in settings.items())
            known = self._keys[id(model)] = model, key, " ".join(words.split())[:160]
        return known[1], known[2]


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
        try:
            return [of(pickle.loads(item.target))]
        except Exception as error:  # of a module that can be imported in the other process alone
            what = f"the material cannot be sent to another process: {error}"
            raise InputError(what, ISOLATED, "put the class into a file and name it FILE.py:CLASS") from error
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
