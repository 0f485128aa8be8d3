"""The properties of this installation that may change the bits of a result: the version and code of Gonio, and the
processor."""

from __future__ import annotations

import hashlib
import platform
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from .._version import __version__

PACKAGES = (  # the packages of Gonio whose code affects results
    "bridge", "catalog", "energy", "material", "materials", "measure", "ops", "optics", "pictures", "render", "scene",
    "transport", "work",
)  # fmt: skip


def versions() -> str:
    """The versions of Gonio, Mitsuba and Dr.Jit."""
    return ", ".join([f"gonio {__version__}", *(f"{name} {_version(name)}" for name in ("mitsuba", "drjit"))])


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "none"


@lru_cache
def code() -> str:
    """A hash of the code that affects results, because the code in a checkout changes between versions."""
    package = Path(__file__).parent.parent
    digest = hashlib.sha256()
    for path in sorted(p for name in PACKAGES for p in (package / name).rglob("*.py")):
        digest.update(str(path.relative_to(package)).encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def processor() -> str:
    """The properties of the processor that affect rounding, and the version of LLVM, which compiles the kernels."""
    import drjit as dr

    llvm = ".".join(map(str, dr.detail.llvm_version()))
    return f"LLVM {llvm}, {platform.machine()} {_vectors()}".strip()


@lru_cache
def _vectors() -> str:
    """The vector instructions of this processor, if the system reports them."""
    try:
        flags = set(Path("/proc/cpuinfo").read_text().partition("flags")[2].partition("\n")[0].split())
    except OSError:
        return platform.processor()
    return " ".join(name for name in ("avx2", "fma", "avx512f") if name in flags)


def file_hash(path: Path) -> str:
    """The SHA-256 hash of a file's content; "missing" if the file cannot be read."""
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return "missing"
