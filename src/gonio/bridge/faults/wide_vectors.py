"""Dr.Jit 1.5: on processors with AVX-512 all kernels work on 16 lanes, which for 64-bit values are two registers each.

    dr.eval(dr.grad(model.eval(wo, wi)))     # OpenPBR, 64 bits, 76,000 operations: 122 s to compile, 19 s for 8 lanes

LLVM then needs several times as long to assign registers; 32-bit kernels too compile in half the time for 8 lanes, and
take the same time to run. No public function of Python sets the number; libdrjit-core exports one.

Workaround: `narrow` sets 8 lanes in processes that compile much and run it once, such as those of `gonio verify`.
"""

from __future__ import annotations

import ctypes
from pathlib import Path

LANES = 8


def lanes() -> int:
    """The number of values per vector; 0 if it is unknown."""
    core = _core()
    return int(core._Z21jit_llvm_vector_widthv()) if core is not None else 0


def narrow() -> None:
    """Compile the following kernels of this process for 8 lanes, if they would have more; bits do not change."""
    core = _core()
    if core is None or lanes() <= LANES:
        return
    core._Z19jit_llvm_target_cpuv.restype = core._Z24jit_llvm_target_featuresv.restype = ctypes.c_char_p
    cpu, features = core._Z19jit_llvm_target_cpuv(), core._Z24jit_llvm_target_featuresv()
    core._Z19jit_llvm_set_targetPKcS0_j(cpu, features, LANES)


def _core() -> ctypes.CDLL | None:
    """The library, if it exports these functions by their names on Linux."""
    from ...ops import backend

    dr = backend.drjit()
    path = Path(str(dr.__file__)).parent / "libdrjit-core.so"
    if not path.is_file() or not dr.has_backend(dr.JitBackend.LLVM):
        return None
    backend.drjit().eval(dr.opaque(dr.llvm.Float, 1.0))  # the backend starts with the first array
    core = ctypes.CDLL(str(path))
    names = ("_Z21jit_llvm_vector_widthv", "_Z19jit_llvm_target_cpuv", "_Z24jit_llvm_target_featuresv")
    return core if all(hasattr(core, name) for name in (*names, "_Z19jit_llvm_set_targetPKcS0_j")) else None
