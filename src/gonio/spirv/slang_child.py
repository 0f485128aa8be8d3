"""Compilation of Slang to SPIR-V through the compiler's C interface: the child process of `slang`.

    python slang_child.py LIBRARY SOURCE OUTPUT

Writes the module, or prints the compiler's messages and ends with exit code 1. It imports no module of Gonio.
"""

from __future__ import annotations

import ctypes
import sys
from pathlib import Path

SPIRV, SLANG, COMPUTE, STANDARD = 6, 1, 6, 2  # constants of slang.h: target, source language, stage, debug information


def compile_file(library: str, source: str, output: str) -> int:
    """Returns 0, or 1 after printing the messages. Optimization is off, because it would inline all functions."""
    slang, pointer, text = ctypes.CDLL(library), ctypes.c_void_p, ctypes.c_char_p
    for name in ("spCreateSession", "spCreateCompileRequest", "spGetEntryPointCode"):
        getattr(slang, name).restype = pointer
    slang.spGetDiagnosticOutput.restype = text
    request = pointer(slang.spCreateCompileRequest(pointer(slang.spCreateSession(None))))
    slang.spAddCodeGenTarget(request, SPIRV)
    slang.spSetOptimizationLevel(request, 0)
    slang.spSetDebugInfoLevel(request, STANDARD)
    unit = slang.spAddTranslationUnit(request, SLANG, text(b"shader"))
    slang.spAddTranslationUnitSourceString(request, unit, text(b"shader.slang"), text(Path(source).read_bytes()))
    entry = slang.spAddEntryPoint(request, unit, text(b"gonio_entry"), COMPUTE)
    failed = slang.spCompile(request) != 0
    if failed:
        sys.stdout.write((slang.spGetDiagnosticOutput(request) or b"").decode("utf-8", "replace"))
        return 1
    size = ctypes.c_size_t()
    code = slang.spGetEntryPointCode(request, entry, ctypes.byref(size))
    Path(output).write_bytes(ctypes.string_at(code, size.value))
    return 0


if __name__ == "__main__":
    sys.exit(compile_file(*sys.argv[1:4]))
