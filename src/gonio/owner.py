"""Dr.Jit and Mitsuba have one owner at a time.

Both are imported step by step, have one variant for all threads, and order kernels within a thread only; our recorder
has one stack. So every public call that computes holds `COMPUTING` until its values are there: calls from several
threads, or by `asyncio.to_thread`, wait for each other. Who uses Dr.Jit or Mitsuba in threads beside Gonio
holds it too:

    from gonio.owner import COMPUTING
    with COMPUTING:
        mi.set_variant("llvm_ad_spectral")
"""

from __future__ import annotations

import functools
import os
import sys
import threading
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from .arguments import checked
from .errors import out_of_loop

P = ParamSpec("P")
R = TypeVar("R")

# Plain, and taken by `with`: a lock written in Python could be left behind by a Ctrl-C between two of its lines.
COMPUTING = threading.RLock()

if hasattr(os, "register_at_fork"):  # not on Windows; who held it may be a thread that the child has not
    os.register_at_fork(after_in_child=lambda: COMPUTING._at_fork_reinit())  # type: ignore[attr-defined]


def settle() -> None:
    """Wait for this thread's kernels: another thread's would not wait for them."""
    dr = sys.modules.get("drjit")
    if dr is not None and hasattr(dr, "sync_thread"):
        dr.sync_thread()


def alone(call: Callable[P, R]) -> Callable[P, R]:
    """The function, run while no other thread computes."""

    @functools.wraps(call)
    def held(*args: P.args, **kwargs: P.kwargs) -> R:
        with COMPUTING:
            try:
                return call(*args, **kwargs)
            except RuntimeError as error:
                cause = out_of_loop(error)
                if cause is error:
                    raise
                forget_frames(error)
                raise cause from error
            finally:
                settle()

    return held


def forget_frames(error: BaseException) -> None:
    """Drop the tracebacks of an exception and of its causes, and with them what Gonio's functions held.

    A notebook keeps its last exception, and would keep the scene: Dr.Jit's virtual calls go to every BSDF that is
    alive, so that each later render would run into the same error. GONIO_DEBUG=1 keeps them for a debugger.
    """
    chain: BaseException | None = None if os.environ.get("GONIO_DEBUG") else error
    while chain is not None:
        chain.__traceback__ = None
        chain = chain.__cause__ or chain.__context__


def public(call: Callable[P, R]) -> Callable[P, R]:
    """A function of Gonio's that users call: its arguments are `checked`, and it runs `alone`."""
    return alone(checked(call))
