"""Suspend garbage collection where it could cause a crash or would only take time.

Python may collect reference cycles at any allocation. If a cycle contains a scene, Mitsuba removes its objects from
Dr.Jit's registry. While a kernel is being traced, or in another thread, this occasionally causes a segmentation fault.
"""

from __future__ import annotations

import contextlib
import gc
import threading
from collections.abc import Iterator

_lock = threading.Lock()
_pauses = 0
_was_on = False


def pause() -> None:
    """Suspend collection until `resume` has been called as often as `pause`."""
    global _pauses, _was_on
    with _lock:
        if _pauses == 0:
            _was_on = gc.isenabled()
            gc.disable()
        _pauses += 1


def resume() -> None:
    """Undo one call of `pause`; the last call restores the former state."""
    global _pauses
    with _lock:
        _pauses -= 1
        if _pauses == 0 and _was_on:
            gc.enable()


@contextlib.contextmanager
def paused() -> Iterator[None]:
    """Suspend garbage collection inside the `with` block."""
    pause()
    try:
        yield
    finally:
        resume()
