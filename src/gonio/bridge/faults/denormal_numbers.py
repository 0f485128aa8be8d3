"""Dr.Jit 1.5: kernels keep denormal numbers with one thread, and round them to 0 with two or more.

    dr.set_thread_count(1)
    dr.opaque(mi.Float, 1e-30, 1 << 20) * dr.opaque(mi.Float, 1e-10)  # 1e-40; with two threads 0

The threads of the pool are configured to round; the calling thread, which computes alone if there is no other or if the
arrays are short, is not. Products of small densities pass through such numbers, so that a dark pixel had different bits
with `--threads 1`.

Workaround: make the calling thread round as well, with the C library on Linux, whose `fenv_t` is known. Elsewhere,
pictures rendered with one thread may differ.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import platform
from collections.abc import Iterator

# (offset in `fenv_t` in bytes, bits): flush results and operands to zero, in MXCSR and in FPCR
CONTROL = {"x86_64": (28, 1 << 15 | 1 << 6), "aarch64": (0, 1 << 24)}
ROOM = 256  # bytes, more than any fenv_t


@contextlib.contextmanager
def denormals_rounded() -> Iterator[None]:
    """Round denormal numbers to 0 on the calling thread inside the block."""
    if (access := _access()) is None:
        yield
        return
    library, offset, bits = access
    before, rounding = ctypes.create_string_buffer(ROOM), ctypes.create_string_buffer(ROOM)
    library.fegetenv(before)
    ctypes.memmove(rounding, before, ROOM)
    ctypes.c_uint32.from_buffer(rounding, offset).value |= bits
    library.fesetenv(rounding)
    try:
        yield
    finally:
        library.fesetenv(before)


@functools.lru_cache
def _access() -> tuple[ctypes.CDLL, int, int] | None:
    """The C library with `fesetenv`, and the offset and value of the bits in its argument; None on unknown systems."""
    if platform.libc_ver()[0] != "glibc" or platform.machine() not in CONTROL:
        return None
    return ctypes.CDLL("libm.so.6"), *CONTROL[platform.machine()]
