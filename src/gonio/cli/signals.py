"""End the command on a signal: on Ctrl-C, or on a signal from a batch system or a closing terminal.

A render handles signals itself and stores its picture (`render.passes.Interrupts`). All other commands print one line
and end.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
from collections.abc import Iterator
from types import FrameType

# SIGTERM is sent by batch systems and `kill`, SIGHUP by a closing terminal; Windows lacks some of these signals.
ENDING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


def words(number: int) -> str:
    """The usual name of the signal."""
    return "Ctrl-C" if number == signal.SIGINT else signal.Signals(number).name


def exit_code(number: int) -> int:
    """The exit code that shells report for a program ended by the signal."""
    return 128 + number


class Ended:
    """The signal that ended the command; 0 if none has."""

    number = 0

    @property
    def line(self) -> str:
        files = sys.modules.get("gonio.files")  # if this module is not imported, nothing has been written
        written = ", ".join(str(path) for path in files.written) if files else ""
        what = f"written before: {written}" if written else "nothing was written"
        return f"ended by {words(self.number or signal.SIGINT)}; {what}"

    @property
    def code(self) -> int:
        return exit_code(self.number or signal.SIGINT)


@contextlib.contextmanager
def at_once() -> Iterator[None]:
    """Make signals end the process with one line inside the `with` block: an import that is interrupted by an exception
    can crash or appear as a missing module."""

    def end(number: int, frame: FrameType | None) -> None:
        with contextlib.suppress(OSError):
            os.write(2, f"ended by {words(number)}; nothing was written\n".encode())
        os._exit(exit_code(number))

    with _handled(end):
        yield


@contextlib.contextmanager
def as_exceptions() -> Iterator[Ended]:
    """Make signals raise KeyboardInterrupt inside the `with` block, so that partial files are removed and child
    processes end."""
    ended = Ended()

    def end(number: int, frame: FrameType | None) -> None:
        ended.number = number
        raise KeyboardInterrupt

    with _handled(end):
        yield ended


@contextlib.contextmanager
def _handled(end: signal._HANDLER) -> Iterator[None]:
    """Handle signals with `end` inside the `with` block. Signals that are ignored, as under nohup, remain ignored."""
    before = {}
    try:
        for number in ENDING:
            if signal.getsignal(number) is not signal.SIG_IGN:
                before[number] = signal.signal(number, end)
    except ValueError:  # not the main thread, which is the only thread that receives signals
        pass
    try:
        yield
    finally:
        for number, old in before.items():
            signal.signal(number, old)
