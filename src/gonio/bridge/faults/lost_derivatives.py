"""Dr.Jit 1.5: forward-mode traversal clears the derivative of a variable on which other variables depend.

    x = mi.Float(1); dr.enable_grad(x)
    y = x * 2; z = y + 1
    dr.set_grad(x, 1); dr.enqueue(dr.ADMode.Forward, x); dr.traverse(dr.ADMode.Forward, dr.ADFlag.ClearInterior)
    dr.grad(y)                                             # 0, as y is interior; dr.grad(z) is 2

Workaround: read the derivative of a copy on which no other variable depends.
"""

from __future__ import annotations

import drjit as dr

from ..types import Mask, Radiance


def own_variable(value: Radiance, active: Mask) -> Radiance:
    """The value on active lanes and 0 on others, as a separate variable in the AD graph of Dr.Jit."""
    return dr.select(active, value, 0)
