"""Find a libLLVM that Dr.Jit can use, and read its version before Dr.Jit loads it.

Dr.Jit ships no LLVM and loads the first it finds. With LLVM 14, 15 and 16 Mitsuba 3.9 aborts the whole
process ("Cannot select fminimum"), and an abort cannot be caught, so the version is read from the file,
without loading it: every libLLVM carries its version as a symbol-version string such as `LLVM_19.1`.
"""

from __future__ import annotations

import ctypes.util
import mmap
import os
import re
import sys
import warnings
from dataclasses import dataclass
from pathlib import Path

from ..errors import GonioWarning, MachineError

OLDEST_USABLE = 17  # 14, 15 and 16 measured to abort under Mitsuba 3.9; 19.1 and 23.1 measured to work
VARIABLE = "DRJIT_LIBLLVM_PATH"

_SYSTEM_FOLDERS = (
    "/usr/lib/x86_64-linux-gnu",
    "/usr/lib/aarch64-linux-gnu",
    "/usr/lib64",
    "/usr/lib",
    "/usr/local/lib",
    "/opt/homebrew/opt/llvm/lib",
    "/usr/local/opt/llvm/lib",
)


@dataclass(frozen=True)
class Library:
    """A libLLVM: where it is, its version ("" where the file names none) and who provided it."""

    path: Path
    version: str
    source: str  # "environment", "wheel" or "system"

    @property
    def usable(self) -> bool:
        return bool(self.version) and int(self.version.split(".")[0]) >= OLDEST_USABLE


def read_version(path: Path) -> str:
    """The version of the libLLVM at `path`, "" where it is none; the file is read, not loaded."""
    try:
        with open(path, "rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as text:
            match = re.search(rb"\0LLVM_(\d+(?:\.\d+)?)\0", text)
            if match:
                return match[1].decode()
    except (OSError, ValueError):  # missing, unreadable or empty
        return ""
    # macOS and Windows builds carry no version nodes; their file names do.
    match_name = re.search(r"LLVM[-.](?:so\.|C\.)?(\d+(?:\.\d+)?)", path.resolve().name)
    return match_name[1] if match_name else ""


def _candidates() -> list[tuple[Path, str]]:
    found: list[tuple[Path, str]] = []
    given = os.environ.get(VARIABLE)
    if given:
        found.append((Path(given), "environment"))
    for prefix in dict.fromkeys((sys.prefix, sys.base_prefix)):
        for folder, pattern in (("lib", "libLLVM*.so*"), ("lib", "libLLVM*.dylib"), ("bin", "LLVM-C*.dll")):
            found += [(path, "wheel") for path in sorted(Path(prefix, folder).glob(pattern))]
    for folder in _SYSTEM_FOLDERS:
        for pattern in ("libLLVM*.so*", "libLLVM*.dylib"):
            found += [(path, "system") for path in sorted(Path(folder).glob(pattern))]
    found += [(path, "system") for path in sorted(Path("/usr/lib").glob("llvm-*/lib/libLLVM*.so*"))]
    by_linker = ctypes.util.find_library("LLVM")
    if by_linker and os.path.isabs(by_linker):
        found.append((Path(by_linker), "system"))
    return found


def libraries() -> list[Library]:
    """Every libLLVM in reach, one entry a file: environment first, then the wheel, then the system's, newest first."""
    seen: dict[Path, Library] = {}
    for path, source in _candidates():
        real = path.resolve()
        if real not in seen:
            seen[real] = Library(real, read_version(real), source)
    order = {"environment": 0, "wheel": 1, "system": 2}

    def rank(library: Library) -> tuple[int, float]:
        return order[library.source], -float(library.version or 0)

    return sorted(seen.values(), key=rank)


def _loaded() -> Library | None:
    """The libLLVM that this process has loaded (Linux; elsewhere None)."""
    try:
        lines = Path("/proc/self/maps").read_text().splitlines()
    except OSError:
        return None
    for line in lines:
        path = line.split()[-1]
        if "/libLLVM" in path:
            return Library(Path(path), read_version(Path(path)), "loaded")
    return None


def use() -> Library:
    """Choose the first usable libLLVM and hand it to Dr.Jit; call before Dr.Jit starts its LLVM backend.

    Dr.Jit loads its libLLVM when it is imported, so a program that imports it before Gonio has chosen already: that
    choice is checked, for an LLVM that is too old would abort the process later.
    Where the environment names one that cannot be used, the next is taken, with a warning. Raises MachineError where
    nothing fits.
    """
    loaded = _loaded() if "drjit" in sys.modules else None
    if loaded is not None:
        if loaded.usable:
            return loaded
        what = f"Dr.Jit was imported before Gonio and loaded LLVM {loaded.version}, which aborts the process"
        raise MachineError(what, "LLVM", f"import gonio before drjit and mitsuba, or set {VARIABLE}")
    found = libraries()
    install = "pip install karellen-llvm-core (Linux x86-64), or apt-get install libllvm19, or any LLVM >= 17"
    named = found[0] if found and found[0].source == "environment" and not found[0].usable else None
    for library in found:
        if library.usable:
            if named is not None:
                said = f"LLVM {named.version}, which aborts the process" if named.version else "no libLLVM"
                text = f"{VARIABLE} names {said}; LLVM {library.version} at {library.path} is used instead"
                warnings.warn(text, GonioWarning, stacklevel=2)
            os.environ[VARIABLE] = str(library.path)
            return library
    too_old = ", ".join(f"{x.version} at {x.path}" for x in found if x.version)
    what = f"no LLVM {OLDEST_USABLE} or newer found" + (f" (too old: {too_old})" if too_old else "")
    raise MachineError(what, "LLVM", install)
