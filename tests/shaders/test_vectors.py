"""Pairs with 64-bit answers for an engine's own tests."""

from __future__ import annotations

import json
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio import cli
from gonio.shaders.vectors import vectors
from variants import GOLD


def test_pairs_have_the_answers_of_float64(tmp_path: Path) -> None:
    path = tmp_path / "vectors.json"
    with pytest.raises(SystemExit) as done:
        cli.main(["emit", "conductor", "--preset", "Au", "-p", "alpha=0.3", "--check", "500", "-o", str(path)])
    assert not done.value.code
    made = json.loads(path.read_text())
    assert made["model"] == "conductor" and made["fields"]["alpha"] == [0.3, 0.3]
    wo, wi, u = (np.array(made[name]) for name in ("wo", "wi", "u"))
    assert wo.shape == wi.shape == u.shape == (500, 3) and np.array_equal(wo, wo.astype(np.float32))
    assert go.get_precision() == "float32"
    go.set_precision("float64")
    assert np.array_equal(made["eval"], GOLD.eval(wo, wi)) and np.array_equal(made["pdf"], GOLD.pdf(wo, wi))
    assert np.array_equal(made["sample"]["weight"], GOLD.sample(wo, u).weight)
    assert np.mean(np.array(made["eval"]) > 0.0) > 0.9


def test_a_transmitting_material_has_pairs_on_both_sides() -> None:
    made = vectors(go.Dielectric(1.5, 0.3), 100)
    assert np.any(np.array(made["wo"])[:, 2] < 0.0) and set(made["sample"]) == {"wi", "weight", "pdf", "delta"}


def test_counts_and_materials_are_checked() -> None:
    with pytest.raises(go.InputError, match="0 given, a whole number from 1 to 1,000,000 expected"):
        vectors(GOLD, 0)
    with pytest.raises(go.InputError, match="RandomWalk"):
        vectors(go.RandomWalk(go.Conductor()))
