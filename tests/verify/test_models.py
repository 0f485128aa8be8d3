"""Every model passes its own laws, whatever the seed; another value of a parameter compiles nothing."""

from __future__ import annotations

import sys
from pathlib import Path

import gonio as go
import pytest
from gonio.ops import backend
from gonio.verify import verify

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

from verify import correct

MODELS = correct()
FEW = ("oren-nayar", "conductor brushed", "dielectric", "mix with mirror")


def test_every_model_is_in_the_list() -> None:
    listed = {model.name for model in MODELS.values()} | {"fdez-aguera", "random-walk", "turquin"}
    assert set(go.models()) <= listed


@pytest.mark.slow
@pytest.mark.parametrize("name", FEW)
def test_a_model_passes_every_law(name: str) -> None:
    report = verify(MODELS[name], quick=True, seed=2013)
    assert report.passed, str(report)


@pytest.mark.slow
@pytest.mark.parametrize("name", MODELS)
def test_a_model_passes_twenty_seeds_in_a_row(name: str) -> None:
    for seed in range(20):
        report = verify(MODELS[name], quick=True, seed=seed)
        assert report.passed, str(report)


@pytest.mark.slow
def test_another_value_compiles_no_kernel() -> None:
    dr = backend.drjit()
    laws = ["reciprocity", "energy", "pdf", "weight", "precision"]
    verify(go.Conductor.preset("Au", alpha=0.3), quick=True, law=laws)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory):
        dr.kernel_history_clear()
        verify(go.Conductor.preset("Cu", alpha=0.5), quick=True, law=laws, seed=2)
        kernels = [k for k in dr.kernel_history() if k["type"] == dr.KernelType.JIT]
    assert len(kernels) > 20
    assert sum(not k["cache_hit"] for k in kernels) == 0
