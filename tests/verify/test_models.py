"""Every model passes its own laws, whatever the seed; another value of a parameter compiles nothing."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import gonio as go
import pytest
from gonio.material import tree
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


@pytest.mark.parametrize(
    ("name", "values", "law", "status"),
    [
        (
            "sheen-charlie",
            {"albedo": 0.0, "alpha": 0.01},
            "energy",
            "breaks as declared",
        ),  # that of the lossless variant
        (
            "normal-map(base=conductor)",
            {"base.alpha": 0.3},
            "gradients",
            "pass",
        ),  # a kink at no tilt, for views along the surface
        pytest.param(
            "turquin(base=conductor)",
            {"base.alpha": (0.16, 0.0016)},
            "energy",
            "breaks as declared",
            marks=pytest.mark.slow,
        ),
        ("fdez-aguera(base=conductor)", {"base.alpha": (0.16, 0.0016)}, "energy", "breaks as declared"),
        # widths of the base outweigh those of the top
        pytest.param(
            "coat(base=conductor)",
            {"base.alpha": (0.5, 0.1), "alpha": (0.05, 0.3)},
            "isotropy",
            "pass",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_what_only_thorough_trials_met(name: str, values: dict[str, Any], law: str, status: str) -> None:
    material = tree.replace(go.material(name), values)
    verdict = verify(material, law=law).cards[0][law]
    assert verdict.status == status, verdict.why
