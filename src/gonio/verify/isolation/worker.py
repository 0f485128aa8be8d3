"""The process in which a BSDF is tested, started by `child`. It may loop forever, crash, print, or exhaust memory.

Orders arrive pickled on standard input. Answers are sent pickled through a copy of standard output, and the output of
the BSDF goes to the file to which standard error is redirected. An order is (card, skip, forbidden, threshold). Each
step is announced by an answer, and each call of the BSDF is described in a file, so that the parent can tell what was
in progress if the process ends.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import os
import pickle
import signal
import sys
import threading
import traceback
import warnings
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import IO, Any, cast

from ...catalog import notation, outside, shaders
from ...errors import GonioError, GonioWarning, InputError, MachineError
from ...material import BSDF
from .. import run, targets
from ..laws import chosen
from ..subject import Described, Fault, Subject, of
from ..verdict import Card, Unread
from . import watch
from .child import ISOLATED, LOADING, OTHERS, Item, Task

Say = Callable[..., None]


def main() -> None:
    """Execute the orders of the parent until it closes the pipe."""
    orders, say = _pipes()
    _end_with(os.getppid())
    warnings.showwarning = lambda message, category, *more, **options: (
        say("warning", str(message)) if issubclass(category, GonioWarning) else None
    )
    warnings.simplefilter("always", GonioWarning)
    try:
        _work(orders, say)
    except GonioError as error:
        say("error", error)
    except (_Stuck, Fault) as error:  # here, a fault comes from a repeated test
        say("lost", str(error))
    except (KeyboardInterrupt, SystemExit, GeneratorExit, TimeoutError, MemoryError, RecursionError) as error:
        # Ctrl-C does not reach this process: the BSDF raised it, outside the calls that `guarded` watches
        say("lost", f"{type(error).__name__} ended the thread that tests it")
    except BaseException as error:
        place, what = _outside(error), f"{type(error).__name__}: {error}"
        if place:
            say("lost", f"{what} ({place})")
        else:
            internal = GonioError(f"the verifier raised {what}", "", "run `gonio --debug ...` and report its output")
            internal.code = MachineError.code
            say("error", internal, traceback.format_exc())
    os._exit(0)  # regardless of threads and handlers that the BSDF has left behind


def _work(orders: IO[bytes], say: Say) -> None:
    chosen(None)  # loads the laws in advance, while the parent may not know the task yet
    try:
        task, limit, in_progress = cast(tuple[Task, float, str], pickle.load(orders))
    except EOFError:  # the parent has none
        return
    calls = _Calls(in_progress)
    watch.watched, watch.LIMIT, watch.calling = True, limit, calls
    say("step", -1, LOADING)
    subjects, unread = _loaded(task.items)
    laws = chosen(task.laws)
    say("loaded", [one.title for one in subjects], [law.name for law in laws], unread)
    while True:
        try:
            number, skip, forbidden, threshold = pickle.load(orders)
        except EOFError:
            return

        def begin(step: str, number: int = number) -> None:
            say("step", number, step)

        def result(law: str, text: str, number: int = number) -> None:
            say("result", number, law, text)

        calls.judge(subjects[number].model, forbidden)
        judged = run.judged(subjects[number], laws, task.effort, task.seed, begin, skip, result)
        say("card", number, _plain(judged.card(threshold, task.seed, task.effort, begin)))


def _loaded(items: Sequence[Item]) -> tuple[list[Subject], list[Unread]]:
    """The subjects of the targets, and the shaders that could not be read, although other targets could."""
    subjects: list[Subject] = []
    unread: list[Unread] = []
    for item in items:
        try:
            subjects += _subjects(item)
        except InputError as error:
            is_shader = isinstance(item.target, str) and shaders.head_in(item.target)
            if not is_shader or (item is items[-1] and not subjects):
                raise
            unread.append(Unread(str(item.target), error.what, error.where, error.hint))
    return subjects, unread


def _outside(error: BaseException) -> str:
    """FILE:LINE of an exception in a user's file, outside `guarded` calls; else ""."""
    files = {getattr(module, "__file__", "") for name, module in sys.modules.items() if name.startswith(outside.PREFIX)}
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if frame.filename in files]
    return f"{Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else ""


def _pipes() -> tuple[IO[bytes], Say]:
    """The stream of orders, and the function that sends an answer. Both are separate from the input and output of the
    BSDF."""
    orders, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(line_buffering=True)  # otherwise a process that aborts loses its last lines
    lock = threading.Lock()

    def say(*answer: object) -> None:
        text = pickle.dumps(answer)
        with contextlib.suppress(Exception):  # the BSDF may have closed them
            sys.stdout.flush()
            sys.stderr.flush()
        with lock, contextlib.suppress(BrokenPipeError):
            answers.write(text)
            answers.flush()

    return orders, say


class _Stuck(BaseException):
    """A call did not end in time. No law catches this exception, because a new process starts without repeating
    the call."""


class _Calls:
    """Record each call of the BSDF in a file for the parent, and reject calls that ended an earlier process.

    in_progress  path of the file
    forbidden    (method, parameter values) -> the reason why this call must not be repeated
    given        key of the material's given parameter values
    """

    def __init__(self, in_progress: str) -> None:
        self.file = os.open(in_progress, os.O_CREAT | os.O_WRONLY, 0o600)
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
        self._note(method, key, words)
        try:
            yield
        except TimeoutError as error:
            raise _Stuck(str(error)) from error  # the file still describes the call
        except BaseException as error:
            self._note()
            if isinstance(error, KeyboardInterrupt):  # raised by the BSDF: Ctrl-C does not reach this process
                raise Fault(f"KeyboardInterrupt in {method}") from error
            raise
        self._note()

    def _note(self, *call: str) -> None:
        with contextlib.suppress(Exception):  # the BSDF may have closed it
            sys.stdout.flush()  # an abort would lose buffered output
        with contextlib.suppress(OSError):
            os.lseek(self.file, 0, os.SEEK_SET)
            os.write(self.file, pickle.dumps(call))

    def _values(self, model: Any) -> tuple[str, str]:
        """The parameter values of a material as a key, which is the same in every process, and as text."""
        known = self._keys.get(id(model))
        if known is None or known[0] is not model:  # the model is stored, so that no other object gets its id
            key = words = ""
            if isinstance(model, BSDF):
                with contextlib.suppress(Exception):
                    settings = notation.settings(model)
                    key = hashlib.sha256(repr(settings).encode()).hexdigest()[:16]
                    words = ", ".join(f"{name} = {notation.written(value)}" for name, value in settings.items())
            known = self._keys[id(model)] = model, key, " ".join(words.split())[:160]
        return known[1], known[2]


def _end_with(parent: int) -> None:
    """End this process when its parent ends, even if it is killed."""
    if sys.platform == "linux":
        import ctypes

        with contextlib.suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG, which a loop inside a kernel cannot delay
            return
    import psutil

    def wait() -> None:
        with contextlib.suppress(psutil.Error):
            psutil.Process(parent).wait()
        os._exit(2)

    threading.Thread(target=wait, daemon=True).start()


def _subjects(item: Item) -> list[Subject]:
    if isinstance(item.target, str):
        return targets.resolve(item.target, item.settings, item.sweep)
    try:
        return [of(pickle.loads(item.target))]
    except Exception as error:  # for example, if only the other process can import a module
        what = f"the material cannot be sent to another process: {error}"
        raise InputError(what, ISOLATED, "put the class into a file and name it FILE.py:CLASS") from error


def _plain(card: Card) -> Card:
    """The card without its model, and without evidence that cannot be sent to another process."""
    card.subject = Described.of(card.subject)
    for verdict in card.verdicts:
        try:
            pickle.dumps(verdict.evidence)
        except Exception:  # of a law from another package
            verdict.evidence = None
    return card
