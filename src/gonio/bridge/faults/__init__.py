"""Workarounds for bugs in Mitsuba and Dr.Jit, one file per bug, with its version and a reproduction.

The bugs were observed with Mitsuba 3.9.1 and Dr.Jit 1.5. The reproductions require

    from gonio.bridge import engine
    mi = engine.load()
    import drjit as dr, numpy as np

`tests/bridge/test_faults.py` contains a canary test for each bug except `kernel_array_order`, for which no short
reproduction is known. The test fails once the bug is fixed upstream. When the oldest version that Gonio supports has
the fix, the file, its uses and the test can be deleted. Some files only detect a bug, and the code that imports them
avoids it.

General precautions, and checks of files before Mitsuba reads them, are in the modules to which they apply: `gonio.llvm`
(choice of LLVM), `gonio.garbage` (no garbage collection while a kernel is recorded), `bridge.plugin_search` (no native
code from the current folder), `pictures` and `scene` (files that would crash Mitsuba's readers).
"""
