"""Fresnel's equations against their closed forms and against complex arithmetic."""

from __future__ import annotations

from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.ops import backend
from gonio.optics import fresnel
from gonio.optics.fresnel import artist, exact
from gonio.optics.fresnel.f82 import GRAZING, f82
from gonio.optics.fresnel.schlick import schlick, schlick_average

from sphere import SEED

RNG = np.random.default_rng(SEED)
KIND = backend.types("float64")


def number(x: Any) -> Any:
    return KIND.float(np.atleast_1d(np.asarray(x, dtype=np.float64)))


def dielectric(cos_i: Any, eta: Any) -> np.ndarray:
    c, e = number(cos_i), number(eta)
    return exact.dielectric(c, fresnel.cos_transmitted(c, e), e).numpy()


def test_dielectric_is_the_textbook_formula() -> None:
    cos_i, eta = RNG.random(10_000), np.exp(RNG.uniform(-1.5, 1.5, 10_000))
    cos_t = np.sqrt((1 - (1 - cos_i**2) / eta**2).astype(complex))
    s, p = (cos_i - eta * cos_t) / (cos_i + eta * cos_t), (eta * cos_i - cos_t) / (eta * cos_i + cos_t)
    np.testing.assert_allclose(dielectric(cos_i, eta), 0.5 * (np.abs(s) ** 2 + np.abs(p) ** 2), rtol=1e-10, atol=1e-14)


def test_conductor_is_the_textbook_formula_with_a_complex_index() -> None:
    cos_i, eta, k = RNG.random(10_000), RNG.uniform(0.05, 4, 10_000), RNG.uniform(0, 8, 10_000)
    n = eta + 1j * k
    cos_t = np.sqrt(1 - (1 - cos_i**2) / n**2)
    s, p = (cos_i - n * cos_t) / (cos_i + n * cos_t), (n * cos_i - cos_t) / (n * cos_i + cos_t)
    got = exact.conductor(number(cos_i), number(eta), number(k)).numpy()
    np.testing.assert_allclose(got, 0.5 * (np.abs(s) ** 2 + np.abs(p) ** 2), rtol=1e-9)


def test_conductor_is_the_mean_of_r_s_and_r_p() -> None:
    cos_i, eta, k = number(RNG.random(10_000)), number(RNG.uniform(0.05, 4, 10_000)), number(RNG.uniform(0, 8, 10_000))
    r_s, r_p = exact.polarized(cos_i, eta, k)
    np.testing.assert_allclose(exact.conductor(cos_i, eta, k).numpy(), (0.5 * (r_s + r_p)).numpy(), rtol=1e-11)


def test_conductor_without_absorption_is_a_dielectric() -> None:
    cos_i, eta = RNG.random(2000) * 0.999 + 1e-3, RNG.uniform(1.01, 4, 2000)
    conductor = exact.conductor(number(cos_i), number(eta), number(np.zeros(2000))).numpy()
    np.testing.assert_allclose(conductor, dielectric(cos_i, eta), rtol=1e-9)


def test_normal_incidence_is_equations_11_and_12_of_the_sheet() -> None:
    eta, k = RNG.uniform(0.1, 4, 100), RNG.uniform(0, 8, 100)
    r0 = ((eta - 1) ** 2 + k**2) / ((eta + 1) ** 2 + k**2)
    one = number(np.ones(100))
    np.testing.assert_allclose(fresnel.r0_conductor(number(eta), number(k)).numpy(), r0, rtol=1e-14)
    np.testing.assert_allclose(exact.conductor(one, number(eta), number(k)).numpy(), r0, rtol=1e-12)
    r0 = ((eta - 1) / (eta + 1)) ** 2
    np.testing.assert_allclose(fresnel.r0_dielectric(number(eta)).numpy(), r0, rtol=1e-14)
    np.testing.assert_allclose(dielectric(np.ones(100), eta), r0, rtol=1e-11, atol=1e-15)


def test_at_brewsters_angle_only_s_polarized_light_is_reflected() -> None:
    eta = np.array([1.2, 1.5, 2.42])
    cos_i = np.cos(np.arctan(eta))
    expected = 0.5 * ((1 - eta**2) / (1 + eta**2)) ** 2  # R_p = 0, and theta_i + theta_t = 90 degrees in R_s
    np.testing.assert_allclose(dielectric(cos_i, eta), expected, rtol=1e-12)


def test_beyond_the_critical_angle_all_is_reflected() -> None:
    critical = np.sqrt(1 - 1 / 1.5**2)
    below = np.linspace(0, critical - 1e-9, 100)
    assert np.all(dielectric(below, np.full(100, 1 / 1.5)) == 1.0)
    assert np.all(dielectric(np.linspace(critical + 1e-6, 1, 100), np.full(100, 1 / 1.5)) < 1.0)


def test_grazing_light_is_all_reflected() -> None:
    assert dielectric(0.0, 1.5) == pytest.approx(1.0, abs=1e-15)
    assert dielectric(1e-9, 1.5) == pytest.approx(1.0, abs=1e-8)
    assert exact.conductor(number(0.0), number(0.2), number(3.0)).numpy() == pytest.approx(1.0)


def test_reflectance_is_the_same_from_both_sides() -> None:
    cos_i, eta = RNG.uniform(0.01, 1, 1000), RNG.uniform(1.01, 3, 1000)
    cos_t = np.sqrt(1 - (1 - cos_i**2) / eta**2)
    np.testing.assert_allclose(dielectric(cos_i, eta), dielectric(cos_t, 1 / eta), rtol=1e-9)


def test_equal_indices_reflect_nothing() -> None:
    np.testing.assert_allclose(dielectric(np.linspace(0.01, 1, 50), np.ones(50)), 0.0, atol=1e-24)


def test_schlick_meets_r0_and_one() -> None:
    r0 = number([0.04, 0.5, 0.95])
    np.testing.assert_allclose(schlick(number(np.ones(3)), r0).numpy(), [0.04, 0.5, 0.95])
    np.testing.assert_allclose(schlick(number(np.zeros(3)), r0).numpy(), 1.0)
    half = schlick(number(0.5), number(0.04)).numpy()
    assert half == pytest.approx(0.04 + 0.96 / 32)


def test_schlick_is_within_four_percent_of_glass() -> None:
    cos_i = np.linspace(0, 1, 500)
    truth = dielectric(cos_i, np.full(500, 1.5))
    assert np.abs(schlick(number(cos_i), number(np.full(500, 0.04))).numpy() - truth).max() < 0.04


def test_snells_law_holds_for_the_transmitted_cosine() -> None:
    cos_i, eta = RNG.random(1000), RNG.uniform(1, 3, 1000)
    cos_t = fresnel.cos_transmitted(number(cos_i), number(eta)).numpy()
    np.testing.assert_allclose(eta**2 * (1 - cos_t**2), 1 - cos_i**2, rtol=1e-10, atol=1e-14)


def test_average_fresnel_has_its_closed_forms() -> None:
    assert schlick_average(0.04) == pytest.approx(0.04 + 0.96 / 21)
    n = 1.5  # Walsh1926, as Duntley1942 gives it
    closed = 0.5 + (n - 1) * (3 * n + 1) / (6 * (n + 1) ** 2)
    closed += n**2 * (n**2 - 1) ** 2 / (n**2 + 1) ** 3 * np.log((n - 1) / (n + 1))
    closed -= 2 * n**3 * (n**2 + 2 * n - 1) / ((n**2 + 1) * (n**4 - 1))
    closed += 8 * n**4 * (n**4 + 1) / ((n**2 + 1) * (n**4 - 1) ** 2) * np.log(n)
    assert fresnel.kind("exact").dielectric_average(n) == pytest.approx(closed, abs=1e-7)


@pytest.mark.parametrize("metal", ["Au", "Ag", "Ti"])
def test_a_metals_average_is_the_integral(metal: str) -> None:
    m = go.Conductor.preset(metal)
    exact = fresnel.kind("exact")
    for eta, k in zip(m.eta, m.k, strict=True):
        x, w = np.polynomial.legendre.leggauss(200)
        root = 0.5 * (x + 1.0)  # of the cosine: the reflectance is smooth in it
        integral = np.sum(0.5 * w * 4.0 * root**3 * np.array([exact.conductor(r * r, eta, k) for r in root]))
        assert exact.conductor_average(eta, k) == pytest.approx(integral, abs=1e-6)


def test_the_imageworks_fit_is_within_a_percent_of_the_integral() -> None:
    for metal in ("Au", "Ag", "Cu", "Al", "Fe", "Ti"):
        m = go.Conductor.preset(metal)
        for eta, k in zip(m.eta, m.k, strict=True):
            average = fresnel.kind("exact").conductor_average(eta, k)
            assert artist.imageworks(*artist.edge_tint(eta, k)) == pytest.approx(average, abs=0.01)


def test_an_artists_two_colours_name_a_metal_and_come_back() -> None:
    r, g = np.array([0.944, 0.776, 0.373]), np.array([0.9, 0.6, 0.2])
    metal = go.Conductor(*artist.index_of(r, g))
    for eta, k, reflectivity, tint in zip(metal.eta, metal.k, r, g, strict=True):
        found = artist.edge_tint(float(eta), float(k))
        assert found == pytest.approx((reflectivity, tint), abs=1e-9)


def test_f82_meets_the_exact_values_at_0_and_82_degrees() -> None:
    kind = fresnel.kind("f82")
    eta, k = number(RNG.uniform(0.1, 4, 500)), number(RNG.uniform(1.0, 6, 500))
    for cos in (1.0, GRAZING):
        got, truth = (by.conductor(number(cos), eta, k).numpy() for by in (kind, fresnel.kind("exact")))
        np.testing.assert_allclose(got, truth, atol=1e-12)
    glass = number(RNG.uniform(1.2, 3, 500))
    cos = number(np.full(500, GRAZING))
    got = kind.dielectric(cos, fresnel.cos_transmitted(cos, glass), glass).numpy()
    np.testing.assert_allclose(got, dielectric(np.full(500, GRAZING), glass.numpy()), atol=1e-12)


def test_f82_is_schlick_where_the_edge_is_schlicks() -> None:
    cos, r0 = number(RNG.random(500)), number(RNG.random(500))
    edge = schlick(number(GRAZING), r0)
    np.testing.assert_allclose(f82(cos, r0, edge).numpy(), schlick(cos, r0).numpy(), atol=1e-14)


def test_f82_is_nearer_to_metals_than_schlick() -> None:
    cos = number(np.cos(np.radians(np.linspace(0, 90, 181))))
    for metal in ("Al", "Cr", "Fe", "Ti", "W", "Hg"):
        m = go.Conductor.preset(metal)
        for eta, k in zip(m.eta, m.k, strict=True):
            exact_, f82_, schlick_ = (
                fresnel.kind(name).conductor(cos, number(eta), number(k)).numpy()
                for name in ("exact", "f82", "schlick")
            )
            assert np.abs(f82_ - exact_).max() < 0.5 * np.abs(schlick_ - exact_).max()


def test_a_metal_by_its_colours_reflects_them_from_above_and_at_82_degrees() -> None:
    r0, edge = np.array([1.0, 0.8, 0.4]), np.array([0.9, 1.0, 0.7])
    metal = go.Metal(r0, edge, alpha=0.0)
    wo = np.array([[0.0, 0.0, 1.0], [np.sqrt(1 - GRAZING**2), 0.0, GRAZING]])
    got = metal.sample(wo, np.full((2, 3), 0.5), precision="float64").weight
    curve = r0 + (1 - r0) * (1 - GRAZING) ** 5
    np.testing.assert_allclose(got, [r0, edge * curve], rtol=1e-12)
    mu = np.linspace(0, 1, 20001)[:, None]
    values = f82(number(mu[:, 0]), number(0.4), number(0.7 * curve[2])).numpy()
    average = 2 * np.trapezoid(values * mu[:, 0], mu[:, 0])
    assert metal.bind(KIND).mean_reflectance().numpy()[2] == pytest.approx(average, abs=1e-8)
