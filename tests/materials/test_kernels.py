"""A changed value compiles nothing, wherever NumPy happens to put its arrays."""

from __future__ import annotations

import gonio as go
import numpy as np
import pytest
from gonio.material import binding
from gonio.ops import backend

from materials import SMALL
from sphere import random_directions


@pytest.mark.sample(8)
@pytest.mark.parametrize("material", SMALL.values(), ids=SMALL)
def test_more_directions_compile_no_kernel(material: go.BSDF) -> None:
    """Dr.Jit's mean over channels once wrote the number of lanes into the kernel."""
    dr = backend.drjit()
    compiled = []
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        for count in (65, 66):
            dr.kernel_history_clear()
            wo, wi = random_directions(count, 1), random_directions(count, 2)
            assert np.isfinite(material.eval(wo, wi)).all()
            assert np.isfinite(material.pdf(wo, wi)).all()
            assert np.isfinite(material.sample(wo, np.full((count, 3), 0.3, np.float32)).weight).all()
            compiled.append(sum(not k["cache_hit"] for k in dr.kernel_history([dr.KernelType.JIT])))
    assert compiled[1] == 0, compiled


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


@pytest.mark.parametrize(
    "material",
    [
        go.KullaConty(go.Conductor.preset("Au", alpha=0.3)),
        go.KullaConty(go.Conductor.preset("Au", alpha=(0.1, 0.3))),
        go.KullaConty(go.Dielectric(1.5, 0.3)),
        go.Turquin(go.Conductor.preset("Au", alpha=0.3)),
        go.FdezAguera(go.Conductor.preset("Au", alpha=0.3)),
    ],
    ids=["metal", "two widths", "glass", "turquin", "fdez-aguera"],
)
def test_what_parameters_derive_is_computed_once_and_is_no_part_of_a_kernel(material: go.BSDF) -> None:
    dr = backend.drjit()
    types = backend.types("float32")
    arrays = list(binding._arrays(material.bind(types).derived))
    assert arrays and all(
        part.state == dr.VarState.Evaluated for a in arrays for part in (a if dr.is_vector_v(a) else [a])
    )
    assert material.bind(types).derived is material.bind(types).derived
