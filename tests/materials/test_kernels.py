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


@pytest.mark.parametrize("method", ["eval", "pdf", "sample"])
def test_all_parts_of_an_answer_are_one_kernel(method: str) -> None:
    """A sample has five parts; a kernel for each would compute the half vector five times."""
    dr = backend.drjit()
    wo, other = random_directions(65, 1), random_directions(65, 2) if method != "sample" else np.full((65, 3), 0.3)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        getattr(go.Conductor(alpha=0.3), method)(wo, other)
        assert len(dr.kernel_history([dr.KernelType.JIT])) == 1


def test_an_integral_evaluates_its_integrand_once_for_all_channels() -> None:
    from gonio.energy.albedo import cubature
    from gonio.verify import subject

    dr = backend.drjit()
    one = subject.of(go.Conductor(alpha=0.3))
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        cubature.integrate(one.sample, one.power(), np.array([[0.6, 0.0, 0.8]]), 1e-3)
        sizes = [k["size"] for k in dr.kernel_history([dr.KernelType.JIT]) if k["operation_count"] > 100]
    assert sorted(sizes) == [1024, 1024, *sorted(set(sizes) - {1024})]  # samples and their values, then each round


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
