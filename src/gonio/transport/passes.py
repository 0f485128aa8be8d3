"""The loop of a render: passes of about half a second, progress, Ctrl-C, time limit.

The size of the passes depends on timing, but the picture does not: `integrators.Render` numbers its samples and sums
them in order. A Mitsuba scene with its own integrator has no such numbering, so its passes have a fixed size that
depends on the film only; it also bounds the memory, which there grows with the samples of a pass.
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

PASS_SECONDS = 0.5  # long compared with a pass's overhead (about 10 ms), short enough to react to Ctrl-C

FIRST_PASS = 1 << 18  # samples: about 50 ms, for a first picture soon after compilation

# Signals that end a render: that of Ctrl-C, those of batch systems, that of a closing terminal; Windows lacks some.
ENDING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


class Renders(Protocol):
    """A render that `run` can drive: `gonio.transport.integrators.Render`, `mitsuba_render.MitsubaRender`."""

    @property
    def done(self) -> int: ...

    def advance(self, count: int) -> None: ...

    def image(self) -> NDArray[np.float32]: ...

    def aov(self) -> dict[str, NDArray[np.float32]]: ...

    def state(self) -> dict[str, NDArray[Any]]: ...

    def restore(self, done: int, state: Mapping[str, NDArray[Any]]) -> None: ...


@dataclass(frozen=True)
class Progress:
    """The progress of a render: samples per pixel done and wanted, samples per second, estimated seconds left."""

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
    """Advance `render` to `spp` samples per pixel; return why it ended: "" (done), "interrupt" or "timeout".

    At least one pass is made if samples are missing, so that there is always a picture. Interrupts and the time limit
    are checked between passes; near the time limit the passes shrink to fit.

    spp          a number, or a function that is called after each pass; no pass goes beyond its latest value
    pixels       number of pixels of the picture
    timeout      time limit, in the unit of `clock` (s); None: none
    first        samples per pixel of the first pass, if the rate is known; with 0, the first pass is short
    report       called with the progress after each pass
    interrupted  called after each pass; a true result ends the render
    """
    begin = clock()
    fixed = getattr(render, "pass_size", None)  # passes of a Mitsuba scene have a fixed size
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
        # The first pass also compiles; it does not measure the rate unless it is the only one.
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
    """Samples per pixel for a pass of about PASS_SECONDS, at most 8 times as many as in the last one."""
    if not compiled and elapsed > PASS_SECONDS:  # probably the compilation
        return count
    return max(1, round(count * min(PASS_SECONDS / elapsed, 8)))


def power_of_two(x: float) -> int:
    """The largest power of two not above x, at least 1."""
    return 1 << max(int(x).bit_length() - 1, 0)


class Interrupts:
    """While entered, the first signal that would end the process sets `asked` to its number, and a later Ctrl-C ends
    the process at once. A later SIGTERM or SIGHUP does not, since systemd sends the two together.

    A Python signal handler runs only between two instructions of Python, and a pass is one long call. Therefore a
    separate thread reads the signal from the wake-up socket while the pass runs.
    """

    def __init__(self, notice: Callable[[], None] = lambda: None) -> None:
        self.asked = 0
        self._notice = notice

    def __enter__(self) -> Interrupts:
        # Only the main thread may set signal handlers. A shell ignores Ctrl-C for background jobs, and nohup ignores
        # SIGHUP: such signals stay ignored.
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
        """End the process by the signal that has arrived, if any; for work that has nothing to save yet."""
        if self.asked:
            self.__exit__()
            signal.raise_signal(self.asked)
            raise KeyboardInterrupt  # if the signal's handler returned

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
                            os.write(2, b"\x1b[?25h\n")  # show the cursor, which the progress bar has hidden
                        os._exit(128 + number)
                    if not self.asked:
                        self.asked = number
                        self._notice()
