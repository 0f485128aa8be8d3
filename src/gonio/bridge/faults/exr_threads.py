"""Mitsuba 3.9: reading or writing OpenEXR hangs where Dr.Jit has fewer than two threads.

    dr.set_thread_count(1)
    mi.Bitmap("picture.exr")                               # waits for ever

Its OpenEXR hands blocks to Dr.Jit's threads and waits for them, of which there is none beside the one that waits.

Workaround: a second thread for as long as Mitsuba reads or writes a file.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator


@contextlib.contextmanager
def file_threads() -> Iterator[None]:
    """Inside, Mitsuba may read and write files whatever the number of threads."""
    import drjit as dr  # here, since readers of pictures are loaded without it

    count = dr.thread_count()
    if count >= 2:
        yield
        return
    dr.set_thread_count(2)
    try:
        yield
    finally:
        dr.set_thread_count(count)
