"""Mitsuba 3.9: reading or writing an OpenEXR file hangs if Dr.Jit has fewer than two threads.

    dr.set_thread_count(1)
    mi.Bitmap("picture.exr")                               # never returns

Mitsuba's OpenEXR library submits blocks to Dr.Jit's threads and waits for them, but the waiting thread may be the only
one.

Workaround: use a second thread while Mitsuba reads or writes a file.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator


@contextlib.contextmanager
def file_threads() -> Iterator[None]:
    """Allow Mitsuba to read and write files inside the `with` block with any number of threads."""
    import drjit as dr  # imported here, so that importing this module does not load Dr.Jit

    count = dr.thread_count()
    if count >= 2:
        yield
        return
    dr.set_thread_count(2)
    try:
        yield
    finally:
        dr.set_thread_count(count)
