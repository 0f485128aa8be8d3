"""A changed value compiles nothing, wherever NumPy happens to put its arrays."""

from __future__ import annotations

import gonio as go
import numpy as np
from gonio.ops import backend

from sphere import random_directions


def test_a_changed_width_compiles_no_kernel() -> None:
    dr = backend.drjit()
    wo, wi = random_directions(65, 1), random_directions(65, 2)
    compiled = []
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        for alpha in (0.11, 0.2, 0.3, 0.4, 0.5):
            dr.kernel_history_clear()
            value = go.Conductor.preset("Cu", alpha=alpha, ndf="student-t").eval(wo.copy(), wi.copy())
            compiled.append(sum(not k["cache_hit"] for k in dr.kernel_history([dr.KernelType.JIT])))
            assert np.isfinite(value).all()
    assert sum(compiled[1:]) == 0, compiled
