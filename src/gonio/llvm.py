"""Select a libLLVM that Dr.Jit can use, before Dr.Jit searches for one.

Dr.Jit does not ship LLVM. When imported, it loads the library named by DRJIT_LIBLLVM_PATH, or else the first one that
it finds. With LLVM 14, 15 and 16, Mitsuba 3.9 aborts the process ("Cannot select fminimum"), and an abort cannot be
caught. Therefore `import gonio` selects a version that works. Versions are read from the files without loading them:
every libLLVM contains its version as a symbol-version string such as `LLVM_19.1`.
"""

from __future__ import annotations

import mmap
import os
import re
import sys
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from .errors import GonioWarning, MachineError

if TYPE_CHECKING:
    from collections.abc import Iterator

OLDEST_USABLE = 17  # Mitsuba 3.9 aborted with 14, 15 and 16 in tests, and worked with 19.1 and 23.1
VARIABLE = "DRJIT_LIBLLVM_PATH"

_SYMBOL = b"\0LLVM_"

_SYSTEM_FOLDERS = (
    "/usr/lib/x86_64-linux-gnu",
    "/usr/lib/aarch64-linux-gnu",
    "/usr/lib64",
    "/usr/lib",
    "/usr/local/lib",
    "/opt/homebrew/opt/llvm/lib",
    "/usr/local/opt/llvm/lib",
)

# Mitsuba's classes that Dr.Jit registers; `jit_registry_id_bound` tells whether any instance is alive.
_REGISTERED = ("BSDF", "Emitter", "Medium", "Mesh", "PhaseFunction", "Sensor", "Shape", "Texture")


class Library(NamedTuple):
    """A libLLVM: its path, its version ("" if the file names none) and its source."""

    path: Path
    version: str
    source: str  # "environment", "wheel" or "system"

    @property
    def usable(self) -> bool:
        return bool(self.version) and int(self.version.split(".")[0]) >= OLDEST_USABLE


def read_version(path: Path) -> str:
    """The version of the libLLVM at `path`; "" if the file is not a libLLVM. The file is read but not loaded."""
    try:
        with open(path, "rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as text:
            at = text.find(_SYMBOL)  # faster than a regular expression; this runs at every start
            while at >= 0:
                start = at + len(_SYMBOL)
                version = text[start : text.find(b"\0", start)]
                if version.replace(b".", b"", 1).isdigit():
                    return version.decode()
                at = text.find(_SYMBOL, start)
    except (OSError, ValueError):  # missing, unreadable or empty
        return ""
    # macOS and Windows builds have no version symbols; their file names contain the version.
    match_name = re.search(r"LLVM[-.](?:so\.|C\.)?(\d+(?:\.\d+)?)", path.resolve().name)
    return match_name[1] if match_name else ""


def _wheel() -> list[Path]:
    """The libLLVM files in installed Python packages."""
    places = (("lib", "libLLVM*.so*"), ("lib", "libLLVM*.dylib"), ("bin", "LLVM-C*.dll"))
    prefixes = dict.fromkeys((sys.prefix, sys.base_prefix))
    return [path for prefix in prefixes for folder, name in places for path in sorted(Path(prefix, folder).glob(name))]


def _system() -> list[Path]:
    """The libLLVM files installed on the system."""
    from ctypes.util import find_library

    names = ("libLLVM*.so*", "libLLVM*.dylib")
    paths = [path for folder in _SYSTEM_FOLDERS for name in names for path in sorted(Path(folder).glob(name))]
    paths += sorted(Path("/usr/lib").glob("llvm-*/lib/libLLVM*.so*"))
    by_linker = find_library("LLVM")
    return [*paths, Path(by_linker)] if by_linker and os.path.isabs(by_linker) else paths


def _ranked(paths: list[Path], source: str) -> list[Library]:
    """One entry per file, newest first."""
    files = dict.fromkeys(path.resolve() for path in paths)
    ranked = [Library(path, read_version(path), source) for path in files]
    return sorted(ranked, key=lambda library: -float(library.version or 0))


def _in_order() -> Iterator[Library]:
    """Libraries in the order of preference: the environment's, those of installed packages, the system's.

    Each source is searched only when it is needed.
    """
    given = os.environ.get(VARIABLE)
    if given:
        yield from _ranked([Path(given)], "environment")
    yield from _ranked(_wheel(), "wheel")
    yield from _ranked(_system(), "system")


def libraries() -> list[Library]:
    """Every available libLLVM, one entry per file, in the order in which they are tried."""
    unique: dict[Path, Library] = {}
    for library in _in_order():
        # `use` writes the path of a package's library into the environment; its source is still the package
        first = unique.setdefault(library.path, library)
        unique[library.path] = first._replace(source=library.source)
    return list(unique.values())


def use() -> Library:
    """Choose the first usable libLLVM and make Dr.Jit use it; called by `import gonio`.

    Dr.Jit loads its libLLVM when it is imported. If it was imported before Gonio and loaded one that is too old, it is
    restarted with another, provided that nothing has been computed and no Mitsuba object is alive. If the environment
    names an unusable library, the next one is used, with a warning. Raises MachineError if no usable library exists.
    """
    loaded = _loaded()
    if loaded is not None and loaded.usable:
        return loaded
    tried: list[Library] = []
    for library in _in_order():
        if library.usable:
            if tried and tried[0].source == "environment":
                said = f"LLVM {tried[0].version}, which aborts the process" if tried[0].version else "no libLLVM"
                text = f"{VARIABLE} names {said}; LLVM {library.version} at {library.path} is used instead"
                warnings.warn(text, GonioWarning, stacklevel=2)
            os.environ[VARIABLE] = str(library.path)
            if loaded is not None and not _exchange():
                old = f"loaded LLVM {loaded.version}, which aborts the process" if loaded.version else "found no LLVM"
                hint = f"import gonio before drjit and mitsuba, or set {VARIABLE}={library.path} before Python starts"
                raise MachineError(f"Dr.Jit was imported before Gonio and {old}", "LLVM", hint)
            return library
        tried.append(library)
    too_old = ", ".join(dict.fromkeys(f"{x.version} at {x.path}" for x in tried if x.version))
    what = f"no LLVM {OLDEST_USABLE} or newer found" + (f" (too old: {too_old})" if too_old else "")
    install = "pip install karellen-llvm-core (Linux x86-64), or apt-get install libllvm19, or any LLVM >= 17"
    raise MachineError(what, "LLVM", install)


def _loaded() -> Library | None:
    """The libLLVM that Dr.Jit has loaded, with version "" if it found none; None if Dr.Jit is not imported."""
    dr = sys.modules.get("drjit")
    if dr is None:
        return None
    version = ".".join(map(str, dr.detail.llvm_version()[:2])) if dr.has_backend(dr.JitBackend.LLVM) else ""
    return Library(Path(os.environ.get(VARIABLE, "")), version, "loaded")


def _exchange() -> bool:
    """Restart Dr.Jit with the libLLVM that the environment now names; returns whether it was restarted.

    Dr.Jit is not restarted if kernels have run, a GPU holds values, or Mitsuba objects are alive: these would be lost.
    The functions for a restart are available only in C++, under the mangled names that Linux and macOS give to
    `jit_shutdown(int)` and others. If Dr.Jit found no libLLVM when it was imported, it does not search again.
    """
    import ctypes

    dr, mi = sys.modules["drjit"], sys.modules.get("mitsuba")
    report = dr.whos(as_string=True)
    launches = re.search(r"Kernel launches *: (\d+)", report)
    if launches is None or launches[1] != "0" or "CUDA" in report:
        return False
    try:
        core = ctypes.CDLL(str(next(Path(str(dr.__file__)).parent.glob("*drjit-core.*"))))
        shutdown, start, alive = core._Z12jit_shutdowni, core._Z8jit_initj, core._Z21jit_registry_id_boundPKcS0_
    except (AttributeError, OSError, StopIteration):  # Windows, or a different Dr.Jit
        return False
    variants = mi.variants() if mi else ()
    if any(alive(variant.encode(), kind.encode()) for variant in variants for kind in _REGISTERED):
        return False
    threads = dr.thread_count()
    dr.detail.clear_registry()
    shutdown(0)
    start(1 << dr.JitBackend.CUDA.value | 1 << dr.JitBackend.LLVM.value)
    dr.set_thread_count(threads)
    loaded = _loaded()
    return loaded is not None and loaded.usable
