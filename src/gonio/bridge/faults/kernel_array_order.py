"""Dr.Jit 1.5: kernels with loops and calls depend on the order in which the arrays that they read were created.

This was observed with the photon maps of `caustics`: the kernel was compiled again if a map was created before the
accumulated samples instead of after them; tests/render/test_transport.py counts the kernels. No short reproduction is
known, so there is no canary test.

Workaround: copy all arrays of an object, one after another, immediately before a kernel reads them.
"""

from __future__ import annotations

import drjit as dr

from .borrowed_memory import own


def copy_arrays(thing: object) -> None:
    """Replace every attribute of `thing` that is an array with a copy."""
    for name, value in vars(thing).items():
        if dr.is_array_v(value):
            setattr(thing, name, own(type(value), value))
