"""Dr.Jit 1.5: Ctrl-C while a symbolic loop is being recorded becomes a RuntimeError.

    def body(i):
        raise KeyboardInterrupt
    dr.while_loop((mi.UInt32(0),), lambda i: i < 3, body, mode="symbolic")       # RuntimeError

Workaround: search for the KeyboardInterrupt among the causes of the error.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator


@contextlib.contextmanager
def interruptible() -> Iterator[None]:
    """Make a KeyboardInterrupt inside the `with` block leave it as a KeyboardInterrupt."""
    try:
        yield
    except RuntimeError as error:
        cause: BaseException | None = error
        while cause is not None and not isinstance(cause, KeyboardInterrupt):
            cause = cause.__cause__ or cause.__context__
        if cause is None:
            raise
        raise KeyboardInterrupt from error
