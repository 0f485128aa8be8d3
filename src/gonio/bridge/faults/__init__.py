"""Faults of Mitsuba and Dr.Jit, one file each: the fault, the version, a reproduction, and what the workaround is.

The faults were observed with Mitsuba 3.9.1 and Dr.Jit 1.5. A reproduction runs after

    from gonio.bridge import engine
    mi = engine.load()
    import drjit as dr, numpy as np

`tests/bridge/test_faults.py` has a canary for each, except for `kernel_array_order`, of which no short reproduction is
known. A canary fails once the fault is fixed upstream; when the oldest version that Gonio accepts has the fix, the
file, its uses and the canary go. Some files only recognize a fault; code that imports them avoids it.

Policies, and checks of files before Mitsuba reads them, are where they apply: `gonio.llvm` (which LLVM),
`gonio.garbage` (no collection while a kernel is recorded), `bridge.plugin_search` (no native code from the current
folder), `pictures` and `scene` (files that would crash Mitsuba's readers).
"""
