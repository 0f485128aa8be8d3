"""Dr.Jit 1.5: on processors with AVX-512, all kernels have 16 lanes, so a double-precision value takes two registers.

    x = dr.arange(mi.Float64, 16)
    dr.eval(x * x)                                         # a register holds 8 values

The derivatives of OpenPBR in double precision, 76,000 operations, take 122 s to compile, but only 19 s with 8 lanes.
With 16 lanes, LLVM takes several times as long to allocate registers, and the kernel runs no faster. There is no public
Python function that sets the number of lanes, but libdrjit-core exports one.

Workaround: inside a `with` block, `narrow` compiles with 8 lanes. It is used for large double-precision kernels that
run once.
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
    """Compile kernels in the `with` block for at most 8 lanes. The last bits of results may differ."""
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
    dr.eval(dr.opaque(dr.llvm.Float, 1.0))  # the first array initializes the backend
    core = ctypes.CDLL(str(path))
    names = ("_Z21jit_llvm_vector_widthv", "_Z19jit_llvm_target_cpuv", "_Z24jit_llvm_target_featuresv")
    return core if all(hasattr(core, name) for name in (*names, "_Z19jit_llvm_set_targetPKcS0_j")) else None
