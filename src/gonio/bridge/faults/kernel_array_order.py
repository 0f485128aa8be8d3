"""Dr.Jit 1.5: kernels with loops and calls are told apart by the order in which the arrays that they read were made.

Seen with the maps of `caustics`, whose kernel was compiled anew where a map was made before the sums, not after them;
tests/render/test_transport.py counts the kernels. No short reproduction is known, hence no canary.

Workaround: copy all arrays of an object, one after the other, right before a kernel reads them.
"""

from __future__ import annotations

import drjit as dr

from .borrowed_memory import own


def copy_arrays(thing: object) -> None:
    """Put a copy in the place of every array that is an attribute of `thing`."""
    for name, value in vars(thing).items():
        if dr.is_array_v(value):
            setattr(thing, name, own(type(value), value))
