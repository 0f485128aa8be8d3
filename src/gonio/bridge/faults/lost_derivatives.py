"""Dr.Jit 1.5: in forward mode a variable that others were computed from loses its derivative on traversal.

    x = mi.Float(1); dr.enable_grad(x)
    y = x * 2; z = y + 1
    dr.set_grad(x, 1); dr.enqueue(dr.ADMode.Forward, x); dr.traverse(dr.ADMode.Forward, dr.ADFlag.ClearInterior)
    dr.grad(y)                                             # 0, as y is interior; dr.grad(z) is 2

Workaround: ask for the derivative of a copy, of which nothing else is computed.
"""

from __future__ import annotations

import drjit as dr

from ..types import Mask, Radiance


def own_variable(value: Radiance, active: Mask) -> Radiance:
    """The value on active lanes, else 0, with a place of its own in Dr.Jit's graph of derivatives."""
    return dr.select(active, value, 0)
