"""Faults of Mitsuba and Dr.Jit, one file each: what is wrong, in which version, a reproduction, and the workaround.

`tests/bridge/test_faults.py` has a canary for each: it fails once the fault is mended upstream, and the file can go.
"""
