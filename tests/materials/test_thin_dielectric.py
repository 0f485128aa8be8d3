"""A pane of glass against the series of its bounces."""

from __future__ import annotations

from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.errors import InputError

THETA = np.radians([0.0, 20.0, 45.0, 56.31, 75.0, 89.0])
WO = np.stack([np.sin(THETA), 0.0 * THETA, np.cos(THETA)], -1)


def pane(**values: Any) -> go.BSDF:
    return go.ThinDielectric(**values)


def reflected(material: go.BSDF, wo: np.ndarray = WO) -> np.ndarray:
    """The probability of reflection, which is what is reflected."""
    s = material.sample(wo, np.tile([1e-12, 0.5, 0.5], (len(wo), 1)), precision="float64")
    assert np.all(s.delta) and np.all(s.eta == 1.0)
    return np.asarray(s.pdf)


@pytest.mark.parametrize("eta", [1.1, 1.5, 2.4, 0.8])
def test_it_reflects_the_sum_of_all_bounces_of_each_polarization(eta: float) -> None:
    at = go.fresnel(THETA, eta)
    total = np.zeros_like(THETA)
    for R in (at.R_s, at.R_p):
        T = 1.0 - R
        series = R + T**2 * R * sum(R ** (2 * n) for n in range(3000))
        total += 0.5 * np.where(R < 1.0, series, 1.0)
    np.testing.assert_allclose(reflected(pane(eta=eta)), total, atol=1e-12 if eta > 1.0 else 1e-9)
    np.testing.assert_allclose(reflected(pane(eta=eta, bounces="mean")), 2 * at.R / (1 + at.R), atol=1e-12)


def test_the_manual_says_what_it_reflects_at_60_degrees() -> None:
    wo = np.array([[np.sin(np.pi / 3), 0.0, 0.5]])
    assert reflected(pane(), wo)[0] == pytest.approx(0.152, abs=5e-4)
    assert reflected(pane(bounces="mean"), wo)[0] == pytest.approx(0.164, abs=5e-4)


def test_light_goes_straight_on_or_to_the_mirror_and_none_is_lost() -> None:
    for side in (1.0, -1.0):
        wo = WO * [1.0, 1.0, side]
        for u, wi in ((1e-12, wo * [-1.0, -1.0, 1.0]), (0.999999, -wo)):
            s = pane(albedo=(0.9, 0.5, 0.2)).sample(wo, np.tile([u, 0.5, 0.5], (len(wo), 1)), precision="float64")
            np.testing.assert_allclose(s.wi, wi, atol=1e-15)
            np.testing.assert_allclose(s.weight, np.tile([0.9, 0.5, 0.2], (len(wo), 1)))
    albedo = go.albedo(pane(), mu=[0.1, 1.0])
    np.testing.assert_allclose(albedo.value, 1.0)


def test_an_index_that_no_sheet_has_is_an_error() -> None:
    with pytest.raises(InputError, match=r"0 given, >= 0\.2"):
        pane(eta=0.0)
    with pytest.raises(InputError, match="unknown bounces"):
        pane(bounces="coherent")
