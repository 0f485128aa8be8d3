"""Phong's lobe, normalized: its formula, its albedo, and the models beside it."""

from __future__ import annotations

import gonio as go
import numpy as np
import pytest

from sphere import at, hemisphere, random_directions

PHONG = go.model("modified-phong")
WO, WI = random_directions(2000, 183, upper=True), random_directions(2000, 184, upper=True)


def test_it_is_lafortune_and_willems_formula() -> None:
    cos = np.maximum(np.sum(WO * WI * [-1, -1, 1], 1), 0.0)
    expected = 0.3 / np.pi + 0.5 * 9.0 / (2.0 * np.pi) * cos**7
    np.testing.assert_allclose(PHONG(0.3, 0.5, 7.0).f(WO, WI, precision="float64")[:, 0], expected, rtol=1e-10)


def test_ks_is_the_lobe_s_albedo_from_the_normal_and_less_elsewhere() -> None:
    w, weights = hemisphere(300, 200)
    found = [
        float(weights @ PHONG(0.2, 0.5, 30.0).eval(np.broadcast_to(at(a), w.shape), w, precision="float64")[:, 0])
        for a in (0.0, 40.0, 85.0)
    ]
    assert found[0] == pytest.approx(0.7, abs=1e-5)
    assert found[0] > found[1] > found[2] > 0.2


def test_its_density_is_that_of_all_samples_above_the_surface() -> None:
    w, weights = hemisphere(300, 200)
    for exponent, angle, least in ((7.0, 0.0, 0.9999), (30.0, 40.0, 0.995), (7.0, 80.0, 0.6)):
        density = PHONG(0.2, 0.5, exponent).pdf(np.broadcast_to(at(angle), w.shape), w, precision="float64")
        assert density.min() >= 0.0 and least < float(weights @ density) < 1.0001


def test_lafortune_s_lobe_about_the_mirror_is_the_same() -> None:
    other = go.model("lafortune")(0.3, 0.4, exponent=25.0)
    np.testing.assert_allclose(
        PHONG(0.3, 0.4, 25.0).eval(WO, WI, precision="float64"), other.eval(WO, WI, precision="float64"), rtol=1e-9
    )


def test_two_albedos_over_one_are_a_declared_breach() -> None:
    assert PHONG(0.5, 0.5).violations() == {}
    assert PHONG(0.8, 0.5).violations()["energy"].size == pytest.approx(0.3)
