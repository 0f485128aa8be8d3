"""The historic models in closed form: peaks, limits, and what their papers say of them."""

from __future__ import annotations

import gonio as go
import numpy as np
import pytest
from gonio.verify.verdict import DECLARED

from sphere import at, hemisphere

UP = np.array([[0.0, 0.0, 1.0]])


def mirrored(degrees: float) -> tuple[np.ndarray, np.ndarray]:
    return at(degrees, 0.0)[None], at(degrees, 180.0)[None]


def value(material: go.BSDF, wo: np.ndarray, wi: np.ndarray) -> float:
    return float(material.f(wo, wi, precision="float64")[0, 0])


def albedo(material: go.BSDF, degrees: float) -> float:
    wi, weights = hemisphere(160, 200)
    wo = np.broadcast_to(at(degrees), wi.shape)
    return float(weights @ material.eval(wo, wi, precision="float64")[:, 0])


@pytest.mark.parametrize("degrees", [0.0, 40.0, 80.0])
def test_the_peak_of_a_ward_lobe_is_its_normalization(degrees: float) -> None:
    wo, wi = mirrored(degrees)
    cos, peak = wo[0, 2], 0.3 / (4.0 * np.pi * 0.1 * 0.2)
    assert value(go.Ward(0.0, 0.3, (0.1, 0.2)), wo, wi) == pytest.approx(peak / cos)
    assert value(go.WardDuer(0.0, 0.3, (0.1, 0.2)), wo, wi) == pytest.approx(peak / cos**2)
    assert value(go.WardDuer(0.0, 0.3, (0.1, 0.2), bounded=True), wo, wi) == pytest.approx(peak / cos**2)


@pytest.mark.parametrize("degrees", [0.0, 50.0, 70.0])
def test_a_narrow_ward_lobe_reflects_what_its_paper_says(degrees: float) -> None:
    cos = np.cos(np.radians(degrees))
    assert albedo(go.Ward(0.0, 1.0, 0.05), degrees) == pytest.approx(cos, rel=0.03)
    assert albedo(go.WardDuer(0.0, 1.0, 0.05), degrees) == pytest.approx(1.0, rel=0.03)


def test_the_bounded_ward_lobe_stays_bounded_where_the_other_gains() -> None:
    assert albedo(go.WardDuer(0.0, 1.0, 0.2), 89.0) > 3.0
    assert albedo(go.WardDuer(0.0, 1.0, 0.2, bounded=True), 89.0) < 1.0


def test_lafortune_s_lobe_about_the_mirror_is_a_normalized_phong() -> None:
    wo, wi = at(30.0)[None], at(50.0, 150.0)[None]
    cos = float(np.sum(wo * wi * [-1.0, -1.0, 1.0]))
    assert value(go.Lafortune(0.0, 0.4, exponent=20.0), wo, wi) == pytest.approx(0.4 * 22.0 / (2.0 * np.pi) * cos**20)
    assert albedo(go.Lafortune(0.0, 0.4, exponent=20.0), 0.0) == pytest.approx(0.4, rel=1e-6)


def test_lafortune_s_lobe_keeps_its_digits_at_large_exponents() -> None:
    wo, wi = at(40.0)[None], at(40.3, 180.0)[None]
    single = go.Lafortune(0.0, 1.0, -1.0, -1.0, 0.99999, 1e5).f(wo, wi)
    exact = go.Lafortune(0.0, 1.0, -1.0, -1.0, 0.99999, 1e5).f(wo, wi, precision="float64")
    assert single == pytest.approx(exact, rel=5e-3)  # 0.3 degrees are 5e-3; their digits end at 6e-8


def test_ashikhmin_and_shirley_s_half_vectors_are_normalized() -> None:
    material = go.AshikhminShirley(0.0, 1.0, (20.0, 60.0), fresnel="one")
    wo, wi = mirrored(0.0)
    assert value(material, wo, wi) == pytest.approx(np.sqrt(21.0 * 61.0) / (8.0 * np.pi))


def test_ashikhmin_and_shirley_s_coupled_parts_together_keep_the_energy() -> None:
    material = go.AshikhminShirley(1.0, 1.0, 100.0, eta=2.0, coupled=True)
    found = [albedo(material, degrees) for degrees in (0.0, 40.0, 70.0, 85.0)]
    assert max(found) < 1.0 and found[0] > 0.95
    apart = go.AshikhminShirley(1.0, 1.0, 100.0, eta=2.0)
    assert albedo(apart, 0.0) > 1.1


def test_cook_and_torrance_s_surface_of_1982_is_four_times_as_bright_as_its_facets() -> None:
    today = go.Conductor(2.0, 0.0, 0.3, ndf="beckmann", masking="v-groove")
    wo, wi = at(50.0)[None], at(35.0, 160.0)[None]
    assert value(go.CookTorrance(0.0, 1.0, 0.3, eta=2.0), wo, wi) == pytest.approx(4.0 * value(today, wo, wi))


def test_he_s_series_ends_in_a_rough_surface_of_beckmann_s_slopes() -> None:
    material = go.HeTorrance(0.0, 1.0, 4000.0, 40000.0, 1e6)
    facets = go.Conductor(0.0, 1e6, 0.2, ndf="beckmann", masking="smith-separable-exact")
    wo, wi = at(20.0)[None], at(35.0, 170.0)[None]
    # far from grazing light nothing is in shadow: neither S nor the roughness differs from Beckmann's
    assert value(material, wo, wi) == pytest.approx(value(facets, wo, wi), rel=2e-3)


def test_he_s_short_waves_see_more_of_a_smooth_surface() -> None:
    wo, wi = mirrored(20.0)
    red, green, blue = go.HeTorrance(0.0, 1.0, 20.0, 3000.0).f(wo, wi)[0]
    assert red < green < blue


def test_low_s_smooth_lobe_is_as_wide_on_the_disk_at_every_angle() -> None:
    material = go.LowSmooth(0.0, 5.0, 400.0, 1.5, fresnel="one")
    step = np.array([0.05, 0.02])
    for degrees in (10.0, 50.0):
        wo = at(degrees)[None]
        across = step - wo[:, :2]
        wi = np.concatenate([across, np.sqrt(1.0 - (across**2).sum(1, keepdims=True))], 1)
        assert value(material, wo, wi) == pytest.approx(5.0 * (1.0 + 400.0 * (step**2).sum()) ** -1.5)


def test_low_s_facets_fall_off_by_their_power_law() -> None:
    material = go.LowMicrofacet(0.0, 3.0, 100.0, 2.0, fresnel="one")
    wi = at(40.0)[None]
    half = np.cos(np.radians(20.0))
    expected = 3.0 * (1.0 + 100.0 * (1.0 - half)) ** -2.0 / (np.pi * wi[0, 2])
    assert value(material, UP, wi) == pytest.approx(expected * min(1.0, 2.0 * half * wi[0, 2] / half))


def test_a_shifted_gamma_distribution_is_normalized() -> None:
    gamma = go.ShiftedGamma(0.0, 1.0, 0.3, 0.5, 1.0, 0.0, Lambda=0.0)
    x, w = np.polynomial.laguerre.laggauss(80)
    # alpha Gamma(1 - p, alpha) by x = alpha + s
    norm = 1.0 / (0.3 * np.exp(-0.3) * float(w @ (0.3 + x) ** -0.5))
    theta = np.linspace(0.0, np.pi / 2, 20001)[:-1]
    material = go.ShiftedGamma(0.0, 1.0, 0.3, 0.5, 1.0, 0.0, norm, Lambda=0.0)
    h = np.stack([np.sin(theta), 0 * theta, np.cos(theta)], -1)
    wi = 2.0 * h[:, 2:] * h - UP  # above the surface up to 45 degrees of h
    above = wi[:, 2] > 1e-6
    d = material.f(np.broadcast_to(UP, wi.shape), wi, precision="float64")[:, 0] * np.pi * wi[:, 2]
    tan2 = np.tan(theta) ** 2
    expected = norm * np.exp(-0.3 - tan2 / 0.3) * (0.3 + tan2 / 0.3) ** -0.5 / (np.pi * np.cos(theta) ** 4)
    assert np.allclose(d[above], expected[above], rtol=1e-9)
    assert np.trapezoid(expected * h[:, 2] * 2.0 * np.pi * np.sin(theta), theta) == pytest.approx(1.0, rel=1e-3)
    assert gamma.normalization == 17.5


NEGATIVE = go.ShiftedGamma(0.0, 1.0, 0.3, 0.5, 0.0, 0.5)


def test_negative_light_is_kept() -> None:
    assert value(NEGATIVE, UP, at(20.0)[None]) < 0.0
    assert "positivity" in NEGATIVE.violations()


@pytest.mark.slow
def test_negative_light_is_declared() -> None:
    report = go.verify(NEGATIVE, law="positivity", quick=True, isolated=False)
    assert report.cards[0].verdicts[0].status == DECLARED and report.passed
