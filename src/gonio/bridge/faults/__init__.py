"""Faults of Mitsuba and Dr.Jit, one file each: the fault, its version, a reproduction, and the workaround.

The faults were observed with Mitsuba 3.9.1 and Dr.Jit 1.5. A reproduction runs after

    from gonio.bridge import engine
    mi = engine.load()
    import drjit as dr, numpy as np

`tests/bridge/test_faults.py` has a canary for each, except for `kernel_array_order`, for which no short reproduction is
known. A canary fails once the fault is fixed upstream; when the oldest version that Gonio accepts has the fix, the
file, its uses and the canary can be deleted. Some files only recognize a fault; code that imports them avoids it.

Policies, and checks of files before Mitsuba reads them, are in the modules that they apply to: `gonio.llvm` (which
LLVM), `gonio.garbage` (no collection while a kernel is recorded), `bridge.plugin_search` (no native code from the
current folder), `pictures` and `scene` (files that would crash Mitsuba's readers).
"""
