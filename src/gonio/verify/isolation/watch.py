"""A time limit for the code of a BSDF, so that an endless loop does not stop the run."""

from __future__ import annotations

import contextlib
import functools
import math
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any

LIMIT = float(os.environ.get("GONIO_VERIFY_LIMIT", "300"))  # seconds per law; the slowest takes about ten
GRACE = 20.0  # further seconds until the process ends, because a signal does not interrupt a loop inside a kernel
watched = False  # whether a parent monitors this process and ends it if the signal has no effect
# context around each call of a BSDF, by model and method, in which a monitored process announces the call
calling: Callable[[Any, str], contextlib.AbstractContextManager[None]] | None = None


def words(seconds: float) -> str:
    """The message for a law that did not end within a number of seconds."""
    return f"not finished after {seconds:g} s: does `sample` loop until a condition that may never hold?"


@contextlib.contextmanager
def limited(what: str, seconds: float | None = None) -> Iterator[None]:
    """A context that raises TimeoutError in its block after a number of seconds.

    what  name of the law, for the error
    A loop in Python is interrupted. A loop in a compiled kernel cannot be: the process then prints an error and exits
    with code 2, unless a parent monitors it (`gonio.verify.isolation.child`). The same applies outside the main thread
    and on platforms without SIGALRM.
    """
    seconds = seconds or LIMIT
    text = words(seconds)

    def ring(number: int, frame: FrameType | None) -> None:
        raise TimeoutError(text)

    def give_up() -> None:
        print(f"error: {what}: {text}\n hint: the loop runs inside a kernel and cannot be stopped", file=sys.stderr)
        sys.stderr.flush()
        os._exit(2)

    by_signal = hasattr(signal, "SIGALRM") and threading.current_thread() is threading.main_thread()
    if not watched:
        _watchdog().add(give_up, seconds + GRACE)
    if by_signal:
        before = signal.signal(signal.SIGALRM, ring)
        signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        if by_signal:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, before)
        if not watched:
            _watchdog().remove(give_up)


class _Watchdog(threading.Thread):
    """A thread that calls functions at their deadlines. All share one thread, because starting one takes longer than
    testing many of the laws."""

    def __init__(self) -> None:
        super().__init__(name="gonio watchdog", daemon=True)
        self.deadlines: dict[Callable[[], None], float] = {}
        self.wakes = math.inf
        self.changed = threading.Condition()

    def add(self, function: Callable[[], None], seconds: float) -> None:
        with self.changed:
            self.deadlines[function] = time.monotonic() + seconds
            if self.deadlines[function] < self.wakes:
                self.changed.notify()

    def remove(self, function: Callable[[], None]) -> None:
        with self.changed:
            self.deadlines.pop(function, None)

    def run(self) -> None:
        with self.changed:
            while True:
                for function in [one for one, end in self.deadlines.items() if end <= time.monotonic()]:
                    del self.deadlines[function]
                    function()
                self.wakes = min(self.deadlines.values(), default=math.inf)
                self.changed.wait(min(self.wakes - time.monotonic(), threading.TIMEOUT_MAX))


@functools.cache
def _watchdog() -> _Watchdog:
    watchdog = _Watchdog()
    watchdog.start()
    return watchdog
