"""The parent's view of one process of a run: its card and step, their starting time, and the call in progress.

This module does not import NumPy or other modules of Gonio at the top, because the first process starts before this
one loads the rest.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import queue
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import psutil

from . import watch

STARTING, LOADING, BETWEEN = "starting", "loading the target", "nothing"
GRACE = 1.0  # seconds beyond the limit, in which the alarm inside the process may stop a loop in Python
LOAD = 20.0  # smallest limit in seconds for starting and loading: Mitsuba alone may take several
MAX_PRINTED = 256 << 20  # bytes; a process that prints more is stopped before it fills the disk

Call = tuple[str, str, str]  # a method, and the material's parameter values as a key and as text


class _Started(NamedTuple):
    """A process that waits for its task, its folder, and the file in this folder that receives its output."""

    folder: tempfile.TemporaryDirectory[str]
    log: Path
    process: psutil.Popen


_ahead: list[_Started] = []


@contextlib.contextmanager
def started_ahead() -> Iterator[None]:
    """Start the first process before its task is known, so that it loads while the command line is parsed. A process
    that receives no task ends with the block."""
    _ahead.append(_start())
    try:
        yield
    finally:
        while _ahead:
            unused = _ahead.pop()
            unused.process.kill()
            unused.process.communicate()
            unused.folder.cleanup()


def _start() -> _Started:
    folder = tempfile.TemporaryDirectory(prefix="gonio-verify-", ignore_cleanup_errors=True)
    printed = Path(folder.name, "printed")
    start = "from gonio.verify.isolation import worker; worker.main()"
    code = f"import sys; sys.path[:] = {sys.path!r}; {start}"
    with printed.open("ab") as log:
        process = psutil.Popen(
            [sys.executable, "-P", "-c", code],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=log,
            start_new_session=True,  # Ctrl-C is for the parent; processes started by the BSDF end with the session
        )
    return _Started(folder, printed, process)


class Process:
    """One process of a run: its card and step, their starting time, and the call in progress."""

    def __init__(self, task: object, limit: float, answers: queue.Queue[tuple[Process, Any]]) -> None:
        self.folder, self.log, self.process = _ahead.pop() if _ahead else _start()
        self.in_progress = Path(self.folder.name, "call")  # written by the process: faster than one answer per call
        self.counted = 0  # bytes of the log whose lines have been counted
        self.busy, self.reason = True, ""
        self.begins(-1, STARTING)
        self.order(task, limit, str(self.in_progress))
        threading.Thread(target=self._read, args=(answers,), daemon=True).start()

    def order(self, *order: object) -> None:
        """Send an order. If the process has ended, the end of its answers shows this."""
        assert self.process.stdin is not None
        with contextlib.suppress(BrokenPipeError):
            self.process.stdin.write(pickle.dumps(order))
            self.process.stdin.flush()

    def begins(self, card: int, step: str) -> None:
        self.card, self.step, self.since = card, step, time.monotonic()

    @property
    def call(self) -> Call | None:
        """The call that was in progress when the process ended; None if there was none."""
        try:
            return pickle.loads(self.in_progress.read_bytes()) or None
        except Exception:  # before the first call, or after an end in the middle of writing
            return None

    def over(self, limit: float, memory: float) -> str:
        """The limit that the process exceeds, as text; "" if none.

        limit   seconds per law
        memory  bytes
        """
        limit, grace = (limit, GRACE) if self.card >= 0 else (max(limit, LOAD), 0.0)
        if self.busy and time.monotonic() - self.since > limit + grace:
            return watch.words(limit) if self.card >= 0 else f"not finished after {limit:g} s"
        with contextlib.suppress(psutil.Error, OSError):
            if self.process.memory_info().rss > memory:
                return f"more than {memory / 1e9:.3g} GB of memory"
            if self.log.stat().st_size > MAX_PRINTED:
                return f"it printed more than {MAX_PRINTED >> 20} MB"
        return ""

    def end(self, reason: str = "") -> None:
        """Kill the process and all processes that it has started.

        reason  the reason, which `why` then returns
        """
        self.reason = self.reason or reason
        with contextlib.suppress(ProcessLookupError, PermissionError):
            if hasattr(os, "killpg"):
                os.killpg(self.process.pid, signal.SIGKILL)
            else:
                self.process.kill()
        self.process.wait()

    def why(self) -> str:
        """The reason why no more answers arrive."""
        try:
            code = self.process.wait(timeout=1.0)
        except psutil.TimeoutExpired:
            code = None
        if self.reason or code is None:
            return self.reason or "it closed the pipe to the process that monitors it"
        if code >= 0:
            return f"the process exited with code {code}"
        return f"the process crashed: {getattr(code, 'name', code)}"

    def lines(self) -> int:
        """The number of lines that it printed since the previous call of this method."""
        with self.log.open("rb") as file:
            file.seek(self.counted)
            text = file.read()
        self.counted += len(text)
        return text.count(b"\n") + bool(text and not text.endswith(b"\n"))

    def last_line(self) -> str:
        """The last line that it printed."""
        with contextlib.suppress(OSError):
            lines = self.log.read_bytes()[-4096:].decode(errors="replace").strip().splitlines()
            return lines[-1].strip()[:200] if lines else ""
        return ""

    def close(self) -> None:
        """End the process and remove its files."""
        self.end()
        for stream in (self.process.stdin, self.process.stdout):
            with contextlib.suppress(OSError):
                stream.close()  # type: ignore[union-attr]
        self.folder.cleanup()

    def _read(self, answers: queue.Queue[tuple[Process, Any]]) -> None:
        assert self.process.stdout is not None
        try:
            while True:
                answers.put((self, pickle.load(self.process.stdout)))
        except Exception:  # the end, or bytes that the BSDF wrote into the pipe
            answers.put((self, None))
