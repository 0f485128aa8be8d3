"""The loop of a render: passes of about half a second, progress, Ctrl-C, time limit.

The size of the passes follows the clock; the picture does not, to the bit: `integrators.Render` numbers its samples and
sums them in order. A Mitsuba scene under its own integrator has no such numbering, so its passes are of one size,
which follows from the film alone; there the passes also keep memory flat as samples grow.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

PASS_SECONDS = 0.5  # long enough that a pass's start-up (some 10 ms) is small, short enough for Ctrl-C

FIRST_PASS = 1 << 18  # samples: some 50 ms of work, and a first picture soon after the kernel is compiled

# What ends a render: Ctrl-C, what batch systems send, and what a closing terminal sends; Windows lacks some.
ENDING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


class Renders(Protocol):
    """What `run` can drive: `gonio.transport.integrators.Render`, `mitsuba_render.MitsubaRender`."""

    @property
    def done(self) -> int: ...

    def advance(self, count: int) -> None: ...

    def image(self) -> NDArray[np.float32]: ...

    def aov(self) -> dict[str, NDArray[np.float32]]: ...

    def state(self) -> dict[str, NDArray[Any]]: ...

    def restore(self, done: int, state: Mapping[str, NDArray[Any]]) -> None: ...


@dataclass(frozen=True)
class Progress:
    """Where a render stands: samples per pixel done and wanted, samples per second, seconds left (by the rate)."""

    done: int
    wanted: int
    rate: float
    remaining: float


def run(
    render: Renders,
    spp: int | Callable[[], int],
    pixels: int,
    *,
    timeout: float | None = None,
    first: int = 0,
    report: Callable[[Progress], None] = lambda progress: None,
    interrupted: Callable[[], object] = lambda: False,
    clock: Callable[[], float] = time.perf_counter,
) -> str:
    """Advance `render` to `spp` samples per pixel; why it ended: "" (done), "interrupt" or "timeout".

    At least one pass is made where samples are missing, so that there is always a picture. Both wishes to stop are
    looked at between passes; near the time limit the passes shrink to what still fits.

    spp    asked after each pass where it is a function: no pass goes beyond what it has said
    first  samples per pixel of the first pass, where the rate is known; 0 begins with a short one
    """
    begin = clock()
    fixed = getattr(render, "pass_size", None)  # a Mitsuba scene's passes are of one size
    count = first or power_of_two(FIRST_PASS / pixels)
    compiled, counted_samples, counted_seconds = False, 0, 0.0
    goal = spp if callable(spp) else lambda: spp
    wanted = goal()
    while render.done < wanted:
        if fixed:
            count = fixed
        before, started = render.done, clock()
        render.advance(min(count, wanted - render.done))
        wanted = goal()
        elapsed, samples = max(clock() - started, 1e-9), (render.done - before) * pixels
        # The first pass also compiles; it says nothing about the rate unless it stays the only one.
        if compiled or render.done >= wanted:
            counted_samples, counted_seconds = counted_samples + samples, counted_seconds + elapsed
        rate = counted_samples / counted_seconds if counted_seconds else samples / elapsed
        remaining = max(wanted - render.done, 0) * pixels / rate
        report(Progress(render.done, wanted, rate, remaining))
        if render.done >= wanted:
            return ""
        if interrupted():
            return "interrupt"
        left = timeout - (clock() - begin) if timeout is not None else float("inf")
        if left <= 0:
            return "timeout"
        if not fixed:
            count = _next_count(count, elapsed, compiled)
            if timeout is not None:
                count = min(count, max(1, int(left * rate / pixels)))
        compiled = True
    return ""


def _next_count(count: int, elapsed: float, compiled: bool) -> int:
    """Samples per pixel of the next pass: what should take PASS_SECONDS, at most 8 times more than last time."""
    if not compiled and elapsed > PASS_SECONDS:  # compiling, most likely
        return count
    return max(1, round(count * min(PASS_SECONDS / elapsed, 8)))


def power_of_two(x: float) -> int:
    """The largest power of two not above x, at least 1."""
    return 1 << max(int(x).bit_length() - 1, 0)


class Interrupts:
    """While it is open, the first signal that would end the process sets `asked`, its number, and Ctrl-C after that
    ends the process at once. SIGTERM and SIGHUP may come together, as systemd sends them: no second one of them does.

    A signal handler of Python runs only between two of its instructions, and a pass is one long call. So the
    signal's byte is taken from the wake-up socket by a thread of its own, which runs while the pass does.
    """

    def __init__(self, notice: Callable[[], None] = lambda: None) -> None:
        self.asked = 0
        self._notice = notice

    def __enter__(self) -> Interrupts:
        # Signals belong to the main thread; a shell that ignores Ctrl-C for a background job has its reasons, and so
        # has nohup for SIGHUP.
        in_main = threading.current_thread() is threading.main_thread()
        numbers = [number for number in ENDING if in_main and signal.getsignal(number) is not signal.SIG_IGN]
        self._old = {number: signal.signal(number, lambda number, frame: None) for number in numbers}
        if self._old:
            self._listen, self._wake = socket.socketpair()
            self._wake.setblocking(False)
            self._old_wake = signal.set_wakeup_fd(self._wake.fileno(), warn_on_full_buffer=False)
            threading.Thread(target=self._watch, daemon=True).start()
        return self

    def check(self) -> None:
        """End by the signal that came, if one did: for work that has nothing to keep yet."""
        if self.asked:
            self.__exit__()
            signal.raise_signal(self.asked)
            raise KeyboardInterrupt  # where the signal's own handler does nothing

    def __exit__(self, *exc: object) -> None:
        if self._old:
            signal.set_wakeup_fd(self._old_wake)
            for number, handler in self._old.items():
                signal.signal(number, handler)
            self._wake.close()  # ends the thread
            self._old = {}

    def _watch(self) -> None:
        with contextlib.suppress(OSError), self._listen:
            while numbers := self._listen.recv(16):
                for number in numbers:
                    if number not in self._old:
                        continue
                    if self.asked and number == signal.SIGINT:
                        if sys.stderr.isatty():
                            os.write(2, b"\x1b[?25h\n")  # the progress bar had hidden the cursor
                        os._exit(128 + number)
                    if not self.asked:
                        self.asked = number
                        self._notice()
