"""The split sum: F0 A + B against the albedo itself."""

from __future__ import annotations

import gonio as go
import numpy as np
import pytest
from gonio.energy.albedo import quadrature
from gonio.energy.tables import bake, split_sum
from gonio.ops import backend


@pytest.mark.sample(1)
@pytest.mark.parametrize("masking", ["smith-correlated", "schlick-direct"])
@pytest.mark.parametrize("ndf", ["ggx", "beckmann"])
def test_f0_a_plus_b_is_the_albedo_with_schlicks_fresnel(ndf, masking):
    baked = bake.bake(ndf, ["dfg"], size=8, masking=masking)
    for f0 in (0.04, 0.5, 1.0):
        metal = go.Conductor(*_index(f0), ndf=ndf, masking=masking, fresnel="schlick")
        exact = bake.bake(metal, ["E"], size=8).arrays["E"][..., 0]
        np.testing.assert_allclose(baked.arrays["dfg"] @ [f0, 1.0], exact, atol=1e-6)


@pytest.mark.parametrize("alpha", [0.02, 0.3, 1.0])
def test_the_table_that_shaders_read_is_met_between_its_nodes(alpha):
    kind = backend.types("float64")
    f0 = 0.3
    metal = go.Conductor(*_index(f0), alpha=alpha, fresnel="schlick")
    bound = metal.bind(kind)
    for mu in (0.07, 0.31, 0.62, 0.97):
        whole = quadrature.moments("ggx", "smith-correlated", mu, alpha)
        wo = kind.vec3(float(np.sqrt(1 - mu * mu)), 0.0, mu)
        found = split_sum.reflected(bound, kind.vec3(f0, f0, f0), kind.float(float(whole.white)), wo)
        exact = f0 * (whole.white - whole.schlick) + whole.schlick
        assert found.x[0] == pytest.approx(float(exact), abs=3e-4)


def _index(f0):
    """(eta, k) of a metal with that reflectance at normal incidence, k = 0."""
    root = np.sqrt(min(f0, 1.0 - 1e-12))
    return float((1 + root) / (1 - root)), 0.0
