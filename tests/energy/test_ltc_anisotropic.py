"""Linearly transformed cosines of anisotropic materials: the fit, its gauge, and integrals over quadrilaterals."""

from __future__ import annotations

import gonio as go
import numpy as np
import pytest
from gonio.energy.albedo import direction
from gonio.energy.tables import ltc, ltc_anisotropic
from gonio.energy.tables.baked import Baked

BRUSHED = go.Conductor.preset("Au", alpha=(0.4, 0.1))


@pytest.fixture(scope="module")
def brushed() -> Baked:
    return ltc_anisotropic.bake(BRUSHED, 4)


def test_the_slopes_of_d_are_its_derivatives() -> None:
    random = np.random.default_rng(2)
    numbers = (np.eye(3) + 0.3 * random.normal(size=(5, 3, 3))).reshape(5, 9)
    wi = random.normal(size=(5, 7, 3))
    wi /= np.linalg.norm(wi, axis=-1, keepdims=True)
    value, slopes = ltc_anisotropic._slopes(numbers, wi)
    for place in range(9):
        step = 1e-6 * np.eye(9)[place]
        two = [ltc_anisotropic._density(numbers + side * step, wi) for side in (1.0, -1.0)]
        np.testing.assert_allclose(slopes[:, place], (two[0] - two[1]) / 2e-6, atol=1e-6 * np.max(np.abs(slopes)))
    # neither a multiple of W nor a turn about the axis of the cosine changes D
    np.testing.assert_allclose(np.einsum("cp,cpk->ck", numbers, slopes), 0.0, atol=1e-9)
    gauged = ltc_anisotropic._gauge(numbers.reshape(5, 3, 3)).reshape(5, 9)
    np.testing.assert_allclose(ltc_anisotropic._density(gauged, wi), value, rtol=1e-9)


@pytest.mark.slow
def test_equal_widths_have_the_tables_of_isotropic_materials() -> None:
    gold = go.Conductor.preset("Au")
    full, flat = ltc_anisotropic.bake(gold, 3), ltc.bake(gold, 3)
    turned = full.arrays["ltc_inverse"][2, :, 1]  # roughness 1, one angle, all azimuths
    assert np.ptp(turned, axis=0).max() < 0.05
    four = turned[0, [0, 2, 5, 7]]
    np.testing.assert_allclose(four, flat.arrays["ltc_inverse"][2, 1], atol=0.03)
    np.testing.assert_allclose(full.arrays["ltc_norm"][2, 0], flat.arrays["ltc_norm"][2], atol=1e-4)


@pytest.mark.slow
def test_brushed_gold_keeps_its_albedo_and_its_lobe(brushed: Baked) -> None:
    assert brushed.arrays["ltc_inverse"].shape == (4, 9, 4, 8)
    mu, phi = brushed.arrays["mu"], brushed.arrays["phi"]
    wide = go.Conductor.preset("Au", alpha=(1.0, 0.25))
    exact = go.albedo(wide, mu[[1]], phi=phi[[3]]).value
    np.testing.assert_allclose(brushed.arrays["ltc_norm"][3, 3, 1], exact[0], atol=1e-3)
    along, across = brushed.arrays["ltc_inverse"][2, 0, 0], brushed.arrays["ltc_inverse"][2, -1, 0]
    assert along[0] < 0.5 < 2.0 < across[0]  # from above the lobe is long in x
    assert np.max(brushed.arrays["ltc_error"][1:, :, :2]) < 0.15
    assert brushed.manifest["error"]["ltc_norm"]["mean"] < 0.02


@pytest.mark.long
def test_the_four_quarters_are_mirror_images(brushed: Baked) -> None:
    corners = ltc.random_quads(np.random.default_rng(5), 1)
    wo = direction(np.array([0.6]), np.array([0.7]))
    flips = np.array([[1.0, 1.0, 1.0], [-1.0, 1.0, 1.0], [1.0, -1.0, 1.0], [-1.0, -1.0, 1.0]])
    seen = ltc_anisotropic.covered(brushed.arrays["ltc_inverse"], np.full(4, 0.6), wo * flips, corners * flips[:, None])
    np.testing.assert_allclose(seen, seen[0], rtol=1e-12)
    assert 0.0 < seen[0] < 1.0


def test_a_rotated_material_is_refused() -> None:
    with pytest.raises(go.InputError, match="not symmetric about x and y"):
        go.bake(go.Conductor(alpha=(0.1, 0.3), rotation=0.3), lut=["ltc"], resolution=3)
