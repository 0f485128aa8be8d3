"""The loop of a render: passes of about half a second, with progress reports, Ctrl-C and a time limit.

The size of the passes depends on timing, but the picture does not, because `integrators.Render` numbers its samples and
accumulates them in order. Mitsuba's own integrators do not number samples, so their passes have a fixed size, which
depends only on the film. This size also bounds the memory, which grows with the number of samples in a pass.
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

PASS_SECONDS = 0.5  # long compared to the overhead of a pass (about 10 ms), but short enough to react to Ctrl-C

FIRST_PASS = 1 << 18  # number of samples, which take about 50 ms, for a first picture soon after compilation

# The signals that end a render: Ctrl-C, termination by a batch system, and a closed terminal; Windows lacks some.
ENDING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


class Renders(Protocol):
    """The interface of renders that `run` advances, such as `integrators.Render` and `mitsuba_render.MitsubaRender`."""

    @property
    def done(self) -> int: ...

    def advance(self, count: int) -> None: ...

    def image(self) -> NDArray[np.float32]: ...

    def aov(self) -> dict[str, NDArray[np.float32]]: ...

    def state(self) -> dict[str, NDArray[Any]]: ...

    def restore(self, done: int, state: Mapping[str, NDArray[Any]]) -> None: ...


@dataclass(frozen=True)
class Progress:
    """The progress of a render: finished and requested samples per pixel, samples per second, and remaining seconds."""

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
    """Advance a render to `spp` samples per pixel. Returns why it ended: "" (done), "interrupt" or "timeout".

    If samples are missing, at least one pass is rendered, so there is always a picture. Interrupts and the time limit
    are checked between passes; near the time limit, passes become shorter.

    spp          a number, or a function that is called after each pass; no pass exceeds its latest value
    pixels       number of pixels of the picture
    timeout      time limit in the unit of `clock` (s); None for no limit
    first        samples per pixel of the first pass, if the speed is known; 0 for a short first pass
    report       called with the progress after each pass
    interrupted  called after each pass; if the result is true, the render ends
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
        # The first pass includes the compilation, so its speed is used only if it is the only pass.
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
    """The number of samples per pixel for a pass of about PASS_SECONDS, at most 8 times that of the last pass."""
    if not compiled and elapsed > PASS_SECONDS:  # probably because of the compilation
        return count
    return max(1, round(count * min(PASS_SECONDS / elapsed, 8)))


def power_of_two(x: float) -> int:
    """The largest power of two that does not exceed x; at least 1."""
    return 1 << max(int(x).bit_length() - 1, 0)


class Interrupts:
    """A context manager that catches signals which would end the process.

    The first signal sets `asked` to its number. A later Ctrl-C ends the process at once, but a later SIGTERM or SIGHUP
    does not, because systemd sends the two together.

    Python runs signal handlers only between two bytecode instructions, and a pass is one long call. A separate thread
    therefore reads the signal from the wake-up socket while the pass runs.
    """

    def __init__(self, notice: Callable[[], None] = lambda: None) -> None:
        self.asked = 0
        self._notice = notice

    def __enter__(self) -> Interrupts:
        # Only the main thread may set signal handlers. Shells ignore Ctrl-C for background jobs, and nohup ignores
        # SIGHUP; these signals remain ignored.
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
        """End the process if a signal has arrived; called if there is nothing to save."""
        if self.asked:
            self.__exit__()
            signal.raise_signal(self.asked)
            raise KeyboardInterrupt  # if the handler of the signal has returned

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
