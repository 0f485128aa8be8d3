"""Select Mitsuba's variant, and load Mitsuba."""

from __future__ import annotations

import contextlib
import ctypes
import functools
import sys
from collections.abc import Iterator
from types import ModuleType

from .. import files, llvm
from ..errors import InputError, MachineError
from ..ops import backend
from ..owner import COMPUTING, exclusive
from . import plugin_search

DEVICES = ("auto", "cpu", "cuda")


def _driver() -> ctypes.CDLL | None:
    """NVIDIA's driver library if it is installed and can be initialized, else None. Does not initialize Dr.Jit."""
    for name in ("libcuda.so.1", "nvcuda.dll"):
        with contextlib.suppress(OSError):
            driver = ctypes.CDLL(name)
            return driver if driver.cuInit(0) == 0 else None
    return None


def cuda_available() -> bool:
    """Whether there is a working NVIDIA driver with at least one device."""
    driver, count = _driver(), ctypes.c_int(0)
    return driver is not None and driver.cuDeviceGetCount(ctypes.byref(count)) == 0 and count.value > 0


def cuda_device() -> str:
    """The name of the first device and the CUDA version of the driver; "none" if there is no device."""
    driver, name, version = _driver(), ctypes.create_string_buffer(256), ctypes.c_int(0)
    if driver is None or driver.cuDeviceGetName(name, len(name), 0) or driver.cuDriverGetVersion(ctypes.byref(version)):
        return "none"
    return f"{name.value.decode(errors='replace')}, CUDA {version.value // 1000}.{version.value % 1000 // 10}"


def variant_for(device: str = "cpu", spectral: bool = False) -> str:
    """The name of Mitsuba's variant for a device: "cpu" (LLVM), "cuda", or "auto" (CUDA if available)."""
    if device not in DEVICES:
        raise InputError(f"unknown device '{device}'", "--device", "one of " + ", ".join(DEVICES))
    has_cuda = cuda_available() if device != "cpu" else False
    if device == "cuda" and not has_cuda:
        raise MachineError("no CUDA device found", "--device cuda", "use --device cpu, or install an NVIDIA driver")
    return ("cuda_ad_" if has_cuda else "llvm_ad_") + ("spectral" if spectral else "rgb")


def polarized(variant: str) -> str:
    """The polarized spectral variant for the same device as the given variant."""
    return "_".join([*variant.split("_")[:2], "spectral_polarized"])


@exclusive
def load(device: str | None = None, spectral: bool = False, threads: int | None = None) -> ModuleType:
    """Import Mitsuba and set a variant. If `device` is None and a variant is set, it is not changed.

    device    "cpu", "cuda" or "auto", see `variant_for`; None selects "cpu" if no variant is set
    spectral  whether to use a spectral variant
    threads   number of cores to use; None uses Dr.Jit's default (all)
    Raises MachineError if no usable LLVM or no GPU is found, or if other users may change the compiled kernels, and
    InputError if the current folder has been deleted.
    """
    if "mitsuba" not in sys.modules:
        files.check_current_folder()  # if it has been deleted, importing Mitsuba ends the process
        backend.check_kernels()
    import mitsuba as mi

    _own(mi)
    variant = mi.variant()
    if device is not None or variant is None:
        variant = variant_for(device or "cpu", spectral)
    if variant.startswith("llvm_"):
        llvm.use()
    if mi.variant() != variant:
        mi.set_variant(variant)
    if threads is not None:
        import drjit as dr

        if threads < 1:
            raise InputError(f"{threads} threads requested", "--threads", "give 1 or more")
        dr.set_thread_count(threads)
    return mi


@functools.lru_cache
def _own(mi: ModuleType) -> int:
    """Prevent changes of the variant while another thread computes, and loading of plugins from the current folder.

    All threads share the variant. Returns the initial number of threads of Dr.Jit.
    """
    import drjit as dr

    plugin_search.confine(mi)
    change = mi.set_variant

    @functools.wraps(change)
    def set_variant(*names: str) -> None:
        with COMPUTING:
            change(*names)

    vars(mi)["set_variant"] = set_variant
    return int(dr.thread_count())


@contextlib.contextmanager
def using(variant: str) -> Iterator[None]:
    """Use a variant inside the `with` block, regardless of other threads, and restore the previous one afterward."""
    import mitsuba as mi

    with COMPUTING:
        before = mi.variant()
        if before == variant:
            yield
            return
        mi.set_variant(variant)
        try:
            yield
        finally:
            mi.set_variant(before)


@contextlib.contextmanager
def put_back() -> Iterator[None]:
    """Restore the variant and the number of threads after the `with` block.

    If no variant was set before, a spectral variant is replaced by the RGB variant for the same device, because the
    rest of a program expects three channels. If Mitsuba was not loaded before, the number of threads is set to Dr.Jit's
    default, because Mitsuba cannot read OpenEXR files with one thread (see `faults.exr_threads`).
    """
    loaded = sys.modules.get("mitsuba")
    before = None if loaded is None else loaded.variant()
    threads = None if loaded is None else sys.modules["drjit"].thread_count()
    try:
        yield
    finally:
        mi = sys.modules.get("mitsuba")
        now = mi and mi.variant()
        if mi and now:
            sys.modules["drjit"].set_thread_count(threads or _own(mi))
        if mi and now and now != before and (before or "spectral" in now):
            mi.set_variant(before or "_".join([*now.split("_")[:2], "rgb"]))
