"""Dr.Jit 1.5: on processors with AVX-512 all kernels have 16 lanes, which take two registers per 64-bit value.

    x = dr.arange(mi.Float64, 16)
    dr.eval(x * x)                                         # a register has 8

The derivatives of OpenPBR in 64 bits, 76,000 operations, take 122 s to compile, but 19 s with 8 lanes: LLVM needs
several times as long to allocate registers, and the kernel runs no faster. No public Python function sets the number of
lanes; libdrjit-core exports one.

Workaround: `narrow` compiles with 8 lanes inside a `with` block, for large kernels of 64-bit values that run once.
"""

from __future__ import annotations

import contextlib
import ctypes
from collections.abc import Iterator
from pathlib import Path

from ...ops import backend

LANES = 8


def lanes() -> int:
    """The number of values per vector; 0 if unknown."""
    core = _core()
    return int(core._Z21jit_llvm_vector_widthv()) if core is not None else 0


@contextlib.contextmanager
def narrow() -> Iterator[None]:
    """Compile the kernels of the block for 8 lanes if they would have more. The last bits of results may differ."""
    core = _core()
    before = lanes()
    if core is None or before <= LANES:
        yield
        return
    core._Z19jit_llvm_target_cpuv.restype = core._Z24jit_llvm_target_featuresv.restype = ctypes.c_char_p
    target = core._Z19jit_llvm_target_cpuv(), core._Z24jit_llvm_target_featuresv()
    core._Z19jit_llvm_set_targetPKcS0_j(*target, LANES)
    try:
        yield
    finally:
        core._Z19jit_llvm_set_targetPKcS0_j(*target, before)


def _core() -> ctypes.CDLL | None:
    """libdrjit-core, if it exports these functions under their Linux names; else None."""
    dr = backend.drjit()
    path = Path(str(dr.__file__)).parent / "libdrjit-core.so"
    if not path.is_file() or not dr.has_backend(dr.JitBackend.LLVM):
        return None
    dr.eval(dr.opaque(dr.llvm.Float, 1.0))  # the backend starts with the first array
    core = ctypes.CDLL(str(path))
    names = ("_Z21jit_llvm_vector_widthv", "_Z19jit_llvm_target_cpuv", "_Z24jit_llvm_target_featuresv")
    return core if all(hasattr(core, name) for name in (*names, "_Z19jit_llvm_set_targetPKcS0_j")) else None
