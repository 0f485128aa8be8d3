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
    """NVIDIA's driver library if it is installed and can be initialized, else None; does not start Dr.Jit."""
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
    """Name of the first device and the CUDA version of the driver; "none" without a device."""
    driver, name, version = _driver(), ctypes.create_string_buffer(256), ctypes.c_int(0)
    if driver is None or driver.cuDeviceGetName(name, len(name), 0) or driver.cuDriverGetVersion(ctypes.byref(version)):
        return "none"
    return f"{name.value.decode(errors='replace')}, CUDA {version.value // 1000}.{version.value % 1000 // 10}"


def variant_for(device: str = "cpu", spectral: bool = False) -> str:
    """Mitsuba's variant for a device: "cpu" (LLVM), "cuda", or "auto" (CUDA if available)."""
    if device not in DEVICES:
        raise InputError(f"unknown device '{device}'", "--device", "one of " + ", ".join(DEVICES))
    has_cuda = cuda_available() if device != "cpu" else False
    if device == "cuda" and not has_cuda:
        raise MachineError("no CUDA device found", "--device cuda", "use --device cpu, or install an NVIDIA driver")
    return ("cuda_ad_" if has_cuda else "llvm_ad_") + ("spectral" if spectral else "rgb")


def polarized(variant: str) -> str:
    """The polarized spectral variant on the same device as another variant."""
    return "_".join([*variant.split("_")[:2], "spectral_polarized"])


@exclusive
def load(device: str | None = None, spectral: bool = False, threads: int | None = None) -> ModuleType:
    """Import Mitsuba and set a variant: the current one if `device` is None and one is set, else that of `variant_for`.

    threads  number of cores to use; None keeps Dr.Jit's default (all)
    Raises MachineError if no usable LLVM or no GPU is found, or if other users may change the kernels; InputError if
    the current folder has been deleted.
    """
    if "mitsuba" not in sys.modules:
        files.check_current_folder()  # without one, importing Mitsuba ends the process
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
    """Guard the variant, which is shared by all threads, against changes while another thread computes, and prevent
    plugins from being loaded from the current folder. Returns the number of threads that Dr.Jit had at first."""
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
    """Use a variant inside the block, whatever another thread has set, and restore the previous one."""
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
    """Restore the variant and the number of threads after the block. If no variant was set before, a spectral one is
    replaced by RGB on the same device, since the rest of a program expects three colors. If Mitsuba was not loaded
    before, the number of threads becomes Dr.Jit's default: with one, Mitsuba can read no OpenEXR, see
    `faults.exr_threads`."""
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
