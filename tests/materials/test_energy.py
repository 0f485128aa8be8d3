"""The law of energy: no surface sends out more power than it receives."""

from __future__ import annotations

import gonio as go
import numpy as np
import pytest

from materials import MASKINGS, NDFS, SMALL
from sphere import SEED, at, hemisphere

W, WEIGHTS = hemisphere(384, 192)
BOTH, BOTH_WEIGHTS = np.concatenate([W, W * [1, 1, -1]]), np.concatenate([WEIGHTS, WEIGHTS])


def _power(material: go.BSDF, wo: np.ndarray) -> np.ndarray:
    """Scattered power over incident power: mode "importance", where transmission carries no square of the indices."""
    return material.eval(wo, BOTH, "importance", precision="float64").T @ BOTH_WEIGHTS


@pytest.mark.sample(2)
@pytest.mark.parametrize("masking", ["smith-correlated", "smith-separable", "smith-separable-exact"])
@pytest.mark.parametrize("ndf", NDFS)
def test_perfectly_reflecting_facets_gain_nothing(ndf: str, masking: str) -> None:
    for alpha in (0.15, 0.5, 1.0):
        metal = go.Conductor(alpha=alpha, ndf=ndf, masking=masking, fresnel="one")
        for degrees in (0, 45, 75, 85):
            albedo = _power(metal, at(degrees))
            assert 0 < albedo.max() <= 1 + 1e-4, (alpha, degrees)


def test_narrow_facets_lose_next_to_nothing_and_wide_ones_more_than_half() -> None:
    assert _power(go.Conductor(alpha=0.1, fresnel="one"), at(0))[0] > 0.98
    # the sum over view angles at alpha = 1 (Kulla2017): about a half is lost
    assert 0.3 < _power(go.Conductor(alpha=1.0, fresnel="one"), at(60))[0] < 0.6


@pytest.mark.sample(1)
@pytest.mark.parametrize("eta", [1.5, 0.7, 2.4])
@pytest.mark.parametrize("ndf", NDFS)
def test_rough_glass_gains_no_power(ndf: str, eta: float) -> None:
    for alpha in (0.15, 0.5, 1.0):
        for degrees in (0, 60, 80, 100, 140, 180):
            albedo = _power(go.Dielectric(eta, alpha, ndf=ndf), at(degrees))
            assert 0.15 < albedo.max() <= 1 + 2e-4, (alpha, degrees)


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", [name for name in SMALL if "energy" not in SMALL[name].known_violations])
def test_mean_weight_of_samples_is_at_most_one(name: str) -> None:
    material = SMALL[name]
    u = np.random.default_rng(SEED).random((50_000, 3))
    for degrees in (5, 70, 120):
        weight = material.sample(np.tile(at(degrees), (len(u), 1)), u, "importance").weight
        # each colour for itself: lobes that share one may be chosen by the mean
        assert np.all(weight.mean(axis=0) <= 1 + 5 * weight.std(axis=0) / np.sqrt(len(u)) + 1e-5)


def test_schlicks_masking_says_nothing_false_about_energy() -> None:
    """Schlick's k is no Smith term, so energy may be gained; by how much is measured here, so that a change is seen."""
    gain = max(
        _power(go.Conductor(alpha=a, masking=m, fresnel="one"), at(d))[0]
        for m in MASKINGS[3:]
        for a in (0.15, 0.5, 1.0)
        for d in (0, 60, 85)
    )
    assert gain < 1.2


def test_albedo_over_one_is_allowed_with_a_warning() -> None:
    with pytest.warns(go.GonioWarning, match=r"Lambert\.albedo: 1\.2 is over 1.*more light than it receives"):
        assert go.Lambert(1.2).eval(at(0), at(0))[0, 0] == pytest.approx(1.2 / np.pi)
