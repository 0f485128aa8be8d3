"""Let only one thread at a time use Dr.Jit and Mitsuba.

Dr.Jit and Mitsuba are imported lazily, have one variant for all threads, and order kernels only within a thread; all
threads share one recording stack. Every public function that computes therefore holds the lock `COMPUTING` until its
values are available, so calls from several threads, or through `asyncio.to_thread`, run one after another. Code that
uses Dr.Jit or Mitsuba in other threads must hold the lock too:

    from gonio.owner import COMPUTING
    with COMPUTING:
        mi.set_variant("llvm_ad_spectral")
"""

from __future__ import annotations

import functools
import gc
import os
import sys
import threading
import traceback
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from .arguments import checked
from .errors import GonioError, InputError, out_of_loop, user_line

P = ParamSpec("P")
R = TypeVar("R")

# An RLock used with `with`: a lock implemented in Python could stay locked after a Ctrl-C between two of its lines.
COMPUTING = threading.RLock()

# A thread that does not exist in the child process may hold the lock. The function is missing on Windows.
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=lambda: COMPUTING._at_fork_reinit())  # type: ignore[attr-defined]


def settle() -> None:
    """Wait for the kernels of this thread, because Dr.Jit does not make other threads wait for them."""
    dr = sys.modules.get("drjit")
    if dr is not None and hasattr(dr, "sync_thread"):
        dr.sync_thread()


def exclusive(call: Callable[P, R]) -> Callable[P, R]:
    """Wrap a function so that it holds the lock `COMPUTING` while it runs."""

    @functools.wraps(call)
    def held(*args: P.args, **kwargs: P.kwargs) -> R:
        with COMPUTING:
            try:
                return call(*args, **kwargs)
            except BaseException as error:
                cause = out_of_loop(error)
                forget_frames(error, names_line=isinstance(cause, GonioError))
                if cause is error:
                    raise
                # raise the inner error without the outer one: two errors that cause each other form an endless chain
                raise cause from (error if isinstance(cause, InputError) else None)
            finally:
                settle()

    return held


def forget_frames(error: BaseException, names_line: bool = True) -> None:
    """Release the local variables of the frames in the tracebacks of an exception and its causes.

    A notebook stores its last exception and thereby keeps the scene alive. Virtual calls in Dr.Jit include every BSDF
    that is alive, so each later render would raise the same error. Exceptions that Dr.Jit wraps lose their tracebacks
    too, because a cleared frame still holds its closure from Python 3.12 on. GONIO_DEBUG=1 preserves everything for a
    debugger.

    names_line  whether the message already names the line of user code; otherwise tracebacks that contain it are kept
    """
    if os.environ.get("GONIO_DEBUG"):
        return
    waiting, causes = [error], []
    while waiting:
        one = waiting.pop()
        traceback.clear_frames(one.__traceback__)
        causes.append(one)
        waiting += [x for x in (one.__cause__, one.__context__) if x is not None and x not in causes]
    wrapped = [one for one in causes if isinstance(one, RuntimeError) and (one is not error or len(causes) > 1)]
    for one in wrapped:
        if names_line or not user_line(one):
            one.__traceback__ = None
    if wrapped:
        gc.collect()  # a scene is part of cycles


def public(call: Callable[P, R]) -> Callable[P, R]:
    """Decorate a public function: its arguments are checked (`checked`), and it holds the lock (`exclusive`)."""
    return exclusive(checked(call))
