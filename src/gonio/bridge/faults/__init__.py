"""Defects of Mitsuba and Dr.Jit, one file each: the defect, the version, a reproduction, and the workaround.

`tests/bridge/test_faults.py` has a canary for each, except for `kernel_array_order`, of which no short reproduction is
known: the canary fails once upstream has fixed the defect, so the file can go.
"""
