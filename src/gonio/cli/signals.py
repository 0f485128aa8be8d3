"""How the command ends on a signal: by Ctrl-C, from batch systems and from closing terminals.

A render stores its picture and handles signals itself (`render.passes.Interrupts`). All else ends with one line.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
from collections.abc import Iterator
from types import FrameType

# SIGTERM comes from batch systems and `kill`, SIGHUP from a terminal that closes; Windows lacks some.
ENDING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


def words(number: int) -> str:
    """The usual name of the signal."""
    return "Ctrl-C" if number == signal.SIGINT else signal.Signals(number).name


def exit_code(number: int) -> int:
    """The exit code that shells report for a program ended by the signal."""
    return 128 + number


class Ended:
    """The signal that has ended the command; 0 while none has."""

    number = 0

    @property
    def line(self) -> str:
        files = sys.modules.get("gonio.files")  # what has not been imported has written nothing
        written = ", ".join(str(path) for path in files.written) if files else ""
        what = f"written before: {written}" if written else "nothing was written"
        return f"ended by {words(self.number or signal.SIGINT)}; {what}"

    @property
    def code(self) -> int:
        return exit_code(self.number or signal.SIGINT)


@contextlib.contextmanager
def at_once() -> Iterator[None]:
    """Inside, a signal ends the process with one line: an import that an exception cuts in two can crash, or is taken
    for a module that is missing."""

    def end(number: int, frame: FrameType | None) -> None:
        with contextlib.suppress(OSError):
            os.write(2, f"ended by {words(number)}; nothing was written\n".encode())
        os._exit(exit_code(number))

    with _handled(end):
        yield


@contextlib.contextmanager
def as_exceptions() -> Iterator[Ended]:
    """Inside, a signal is a KeyboardInterrupt, so that files that were begun are removed and children ended."""
    ended = Ended()

    def end(number: int, frame: FrameType | None) -> None:
        ended.number = number
        raise KeyboardInterrupt

    with _handled(end):
        yield ended


@contextlib.contextmanager
def _handled(end: signal._HANDLER) -> Iterator[None]:
    """With this handler; what is ignored, as under nohup and in a shell's background, stays ignored."""
    before = {}
    try:
        for number in ENDING:
            if signal.getsignal(number) is not signal.SIG_IGN:
                before[number] = signal.signal(number, end)
    except ValueError:  # not in the main thread, which is where signals arrive
        pass
    try:
        yield
    finally:
        for number, old in before.items():
            signal.signal(number, old)
