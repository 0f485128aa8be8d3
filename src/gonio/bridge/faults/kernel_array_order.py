"""Dr.Jit 1.5: kernels are told apart by the order in which the arrays that they read were made.

    a, b = mi.Float([1, 2]), mi.Float([3, 4]); dr.eval(a - b)
    b, a = mi.Float([3, 4]), mi.Float([1, 2]); dr.eval(a - b)      # compiles a second kernel

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
