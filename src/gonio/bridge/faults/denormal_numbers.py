"""Dr.Jit 1.5: kernels preserve denormal numbers with one thread, but flush them to 0 with two or more threads.

    dr.set_thread_count(1)
    dr.opaque(mi.Float, 1e-30, 1 << 20) * dr.opaque(mi.Float, 1e-10)  # 1e-40; with two threads 0

The threads of the pool are configured to flush denormal numbers to 0, but the calling thread is not. It computes alone
if there is no other thread or if the arrays are short. Products of small densities can be denormal, so dark pixels were
not bit-identical with `--threads 1`.

Workaround: configure the calling thread as well, by functions of the C library on Linux, where the layout of `fenv_t`
is known. On other systems, pictures rendered with one thread may differ.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import platform
from collections.abc import Iterator

# (offset in `fenv_t` in bytes, bits that flush results and operands to zero), in MXCSR and in FPCR
CONTROL = {"x86_64": (28, 1 << 15 | 1 << 6), "aarch64": (0, 1 << 24)}
ROOM = 256  # bytes, more than the size of any `fenv_t`


@contextlib.contextmanager
def denormals_rounded() -> Iterator[None]:
    """Flush denormal numbers to 0 on the calling thread inside the `with` block."""
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
    """The C library with `fesetenv`, and the offset and the bits to set in its argument; None on unknown systems."""
    if platform.libc_ver()[0] != "glibc" or platform.machine() not in CONTROL:
        return None
    return ctypes.CDLL("libm.so.6"), *CONTROL[platform.machine()]
