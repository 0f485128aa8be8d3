"""go.albedo: closed forms, agreement of its three ways, and what it refuses."""

from __future__ import annotations

import gonio as go
import numpy as np
import pytest


def test_lambert_and_mirror_have_closed_forms():
    found = go.albedo(go.Lambert((0.2, 0.5, 0.9)), [0.1, 1.0])
    assert found.method == "closed-form"
    np.testing.assert_allclose(found.value, [[0.2, 0.5, 0.9]] * 2)
    np.testing.assert_allclose(go.albedo(go.Mirror(0.9), 0.3).value, 0.9, rtol=1e-6)
    np.testing.assert_allclose(go.albedo(go.Dielectric(1.5, 0.0), [-0.4, 0.4]).value, 1.0)


def test_a_mix_of_closed_forms_is_one():
    found = go.albedo(go.mix(go.Lambert(0.5), go.Mirror(), 0.25), 0.7)
    assert found.method == "closed-form"
    np.testing.assert_allclose(found.value, 0.625, rtol=1e-6)


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    "model",
    [
        go.OrenNayar(0.8, 0.5),
        go.Phong(0.1, 0.4, 80.0),
        go.Conductor.preset("Au", alpha=0.2),
        go.Conductor.preset("Au", alpha=(0.1, 0.5), rotation=0.4),
        go.Dielectric(1.5, 0.3),
        go.mix(go.Lambert(0.5), go.Conductor.preset("Cu", alpha=0.1), 0.4),
    ],
    ids=lambda m: m.name,
)
def test_quadrature_agrees_with_the_models_own_sampling(model):
    exact = go.albedo(model, [0.2, 0.9], 0.3)
    drawn = go.albedo(model, [0.2, 0.9], 0.3, method="sampling", samples=1 << 17)
    assert exact.method == "quadrature"
    assert np.all(np.abs(exact.value - drawn.value) < 6.0 * drawn.error + 1e-4)


def test_bad_input_is_one_clear_error():
    with pytest.raises(go.InputError, match="a material expected"):
        go.albedo(3, 0.5)  # type: ignore[arg-type]
    with pytest.raises(go.InputError, match="unknown method"):
        go.albedo(go.Lambert(), 0.5, method="guess")
    with pytest.raises(go.InputError, match="cosine"):
        go.albedo(go.Lambert(), 1.5)
    with pytest.raises(go.InputError, match="one value per ray"):
        go.albedo(go.Conductor(alpha=np.array([0.1, 0.2])), 0.5)
    with pytest.raises(go.InputError, match="no closed form"):
        go.albedo(go.OrenNayar(), 0.5, method="closed-form")


@pytest.mark.slow  # in one width: test_cubature_foot
def test_the_rim_of_a_narrow_lobe_is_not_missed():
    # a hundredth of this lobe lay in one large cell, between whose nodes it fell
    narrow = go.KullaConty(go.Conductor(alpha=(0.05, 0.02), fresnel="one", ndf="beckmann"))
    found = go.albedo(narrow, mu=[0.2, 0.25], phi=0.3)
    assert found.method == "quadrature"
    assert found.value == pytest.approx(1.0, abs=2e-4)


def test_missing_numbers_are_one_clear_error() -> None:
    rough = go.Conductor.preset("Au", alpha=0.3)
    with pytest.raises(go.InputError, match="no numbers given"):
        go.albedo(rough, [])
    with pytest.raises(go.InputError, match="masked numbers given"):
        go.albedo(rough, np.ma.masked_array([0.5, 0.6], mask=[False, True]))
    up = np.array([[0.0, 0.0, 1.0]] * 2)
    with pytest.raises(go.InputError, match="masked values given"):
        rough.eval(np.ma.masked_array(up, mask=[[False] * 3, [True] * 3]), up)
    np.testing.assert_array_equal(rough.eval(np.ma.masked_array(up), up), rough.eval(up, up))
