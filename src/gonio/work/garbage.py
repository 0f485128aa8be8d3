"""No garbage is collected where that would crash.

Python collects cycles wherever it happens to be. Where one holds a scene, Mitsuba takes its objects off Dr.Jit's
lists: in the middle of a kernel that is being traced, or in another thread, that is a segmentation fault now and then.
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
    """Collect nothing until `resume` has been called as often."""
    global _pauses, _was_on
    with _lock:
        if _pauses == 0:
            _was_on = gc.isenabled()
            gc.disable()
        _pauses += 1


def resume() -> None:
    """Collect again, if it was so before."""
    global _pauses
    with _lock:
        _pauses -= 1
        if _pauses == 0 and _was_on:
            gc.enable()


@contextlib.contextmanager
def kept() -> Iterator[None]:
    """Nothing is collected inside."""
    pause()
    try:
        yield
    finally:
        resume()
