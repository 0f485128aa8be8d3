"""Amplitudes, phases and Mueller matrices against the closed forms of the textbooks, to 1e-12 in 64 bits."""

from __future__ import annotations

from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.errors import InputError
from gonio.optics.fresnel import brewster_angle

from sphere import SEED

RNG = np.random.default_rng(SEED)
THETA = RNG.uniform(0.0, np.pi / 2, 4000)
GLASS = np.exp(RNG.uniform(-1.2, 1.2, 4000))  # thinner and denser
ETA, K = RNG.uniform(0.05, 4.0, 4000), RNG.uniform(0.0, 8.0, 4000)
CLOSE = {"rtol": 0.0, "atol": 1e-12}


def refracted(theta: Any, eta: Any) -> np.ndarray:
    return np.arcsin(np.sin(theta) / eta)


def test_amplitudes_are_fresnels_sines_and_tangents() -> None:
    below = np.sin(THETA) < GLASS
    theta, eta = THETA[below], GLASS[below]
    at, t = go.fresnel(theta, eta), refracted(theta, eta)
    np.testing.assert_allclose(at.r_s.real, -np.sin(theta - t) / np.sin(theta + t), **CLOSE)
    np.testing.assert_allclose(at.r_p.real, np.tan(theta - t) / np.tan(theta + t), **CLOSE)
    np.testing.assert_allclose(at.t_s.real, 2 * np.sin(t) * np.cos(theta) / np.sin(theta + t), **CLOSE)
    t_p = 2 * np.sin(t) * np.cos(theta) / (np.sin(theta + t) * np.cos(theta - t))
    np.testing.assert_allclose(at.t_p.real, t_p, **CLOSE)
    for amplitude in (at.r_s, at.r_p, at.t_s, at.t_p):
        assert not amplitude.imag.any()


def test_a_metal_has_the_amplitudes_of_a_complex_refracted_angle() -> None:
    n = ETA + 1j * K
    cos, cos_t = np.cos(THETA), np.sqrt(1 - (np.sin(THETA) / n) ** 2)
    at = go.fresnel(THETA, ETA, K)
    np.testing.assert_allclose(at.r_s, (cos - n * cos_t) / (cos + n * cos_t), **CLOSE)
    np.testing.assert_allclose(at.r_p, (n * cos - cos_t) / (n * cos + cos_t), **CLOSE)
    np.testing.assert_allclose(at.t_s, 2 * cos / (cos + n * cos_t), **CLOSE)
    np.testing.assert_allclose(at.t_p, 2 * cos / (n * cos + cos_t), **CLOSE)


def test_nothing_is_lost_between_reflection_and_refraction() -> None:
    for eta, k in ((GLASS, 0.0), (ETA, K)):
        at = go.fresnel(THETA, eta, k)
        for R, T in ((at.R_s, at.T_s), (at.R_p, at.T_p), (at.R, at.T)):
            np.testing.assert_allclose(R + T, 1.0, **CLOSE)
            assert R.min() >= 0.0 and T.min() >= 0.0
        np.testing.assert_allclose(at.R, 0.5 * (at.R_s + at.R_p), **CLOSE)


def test_brewsters_angle_is_the_arctangent_of_the_index_and_reflects_no_p() -> None:
    eta = np.array([1 / 2.42, 1 / 1.5, 1.2, 1.333, 1.5, 2.42])
    at = go.fresnel(np.arctan(eta), eta)
    np.testing.assert_allclose(np.tan(at.brewster), eta, **CLOSE)
    np.testing.assert_allclose(at.R_p, 0.0, **CLOSE)
    np.testing.assert_allclose(at.R_s, ((1 - eta**2) / (1 + eta**2)) ** 2, **CLOSE)


def test_a_metal_reflects_least_p_at_its_pseudo_brewster_angle() -> None:
    eta, k = ETA[:200], K[:200] + 0.01
    best = brewster_angle(eta, k)
    least = go.fresnel(best, eta, k).R_p
    for step in (-1e-4, 1e-4):
        assert np.all(go.fresnel(best + step, eta, k).R_p > least)
    everywhere = go.fresnel(np.linspace(0, np.pi / 2, 4001)[:, None], eta, k).R_p
    assert np.all(everywhere.min(axis=0) > least - 1e-12)
    assert brewster_angle(1.5) == pytest.approx(np.arctan(1.5), abs=1e-15)


def test_the_critical_angle_is_the_arcsine_of_the_index() -> None:
    eta = np.array([1 / 2.42, 1 / 1.5, 1 / 1.333])
    at = go.fresnel(np.arcsin(eta) + 1e-6, eta)
    np.testing.assert_allclose(np.sin(at.critical), eta, **CLOSE)
    np.testing.assert_allclose([at.R_s, at.R_p], 1.0, **CLOSE)
    assert np.all(go.fresnel(np.arcsin(eta) - 1e-6, eta).R < 1.0)
    assert np.isnan(go.fresnel(1.0, [1.5, 2.0]).critical).all() and np.isnan(go.fresnel(1.0, 0.5, 0.1).critical)


def test_total_reflection_shifts_the_phases_as_the_textbooks_have_it() -> None:
    """tan(delta_s / 2) = root / cos, tan(delta_p / 2) = root / (n^2 cos), root = sqrt(sin^2 - n^2) (Born1999)."""
    n = 1 / 1.51
    theta = np.linspace(np.arcsin(n) + 1e-3, np.pi / 2 - 1e-3, 500)
    at, root = go.fresnel(theta, n), np.sqrt(np.sin(theta) ** 2 - n**2)
    np.testing.assert_allclose(at.phase_s, -2 * np.arctan(root / np.cos(theta)), **CLOSE)
    np.testing.assert_allclose(at.phase_p, -2 * np.arctan(root / (n**2 * np.cos(theta))), **CLOSE)


def test_fresnels_rhomb_turns_linear_light_into_circular() -> None:
    """Two total reflections at 54.62 degrees in glass of 1.51 part s and p by a quarter of a wave (Born1999)."""
    part = go.fresnel(np.radians(54.6234), 1 / 1.51)
    assert np.degrees(part.phase_s - part.phase_p) == pytest.approx(45.0, abs=2e-3)
    turned = part.reflection @ part.reflection @ np.array([1.0, 0.0, 1.0, 0.0])
    np.testing.assert_allclose(np.abs(turned), [1.0, 0.0, 0.0, 1.0], atol=1e-4)


def test_normal_incidence_knows_no_polarization() -> None:
    at = go.fresnel(0.0, ETA, K)
    r0 = ((ETA - 1) ** 2 + K**2) / ((ETA + 1) ** 2 + K**2)
    np.testing.assert_allclose(at.R_s, r0, **CLOSE)
    np.testing.assert_allclose(at.R_p, r0, **CLOSE)
    np.testing.assert_allclose(at.r_p, -at.r_s, **CLOSE)


def test_grazing_light_is_all_reflected_and_equal_indices_reflect_none() -> None:
    np.testing.assert_allclose(go.fresnel(np.pi / 2, ETA, K).R, 1.0, **CLOSE)
    np.testing.assert_allclose(go.fresnel(THETA[THETA < 1.5], 1.0).R, 0.0, **CLOSE)


def test_mueller_matrices_do_to_stokes_vectors_what_amplitudes_do_to_fields() -> None:
    fields = RNG.normal(size=(2, 300)) + 1j * RNG.normal(size=(2, 300))
    theta, eta, k = THETA[:300], ETA[:300], K[:300]
    at = go.fresnel(theta, eta, k)

    def stokes(s: np.ndarray, p: np.ndarray) -> np.ndarray:
        cross = s * np.conj(p)
        return np.stack([abs(s) ** 2 + abs(p) ** 2, abs(s) ** 2 - abs(p) ** 2, 2 * cross.real, 2 * cross.imag], -1)

    got = np.einsum("nij,nj->ni", at.reflection, stokes(*fields))
    np.testing.assert_allclose(got, stokes(at.r_s * fields[0], at.r_p * fields[1]), atol=1e-12 * np.abs(got).max())
    glass = go.fresnel(theta, GLASS[:300])
    power = np.sqrt(np.divide(glass.T_s, np.abs(glass.t_s) ** 2, where=glass.T_s > 0, out=np.zeros(300)))
    got = np.einsum("nij,nj->ni", glass.refraction, stokes(*fields))
    wanted = stokes(power * glass.t_s * fields[0], power * glass.t_p * fields[1])
    np.testing.assert_allclose(got, wanted, atol=1e-12 * np.abs(got).max())


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ((0.1, 0.0), "eta = 0, a positive index expected"),
        ((0.1, -1.5), "eta = -1.5"),
        ((0.1, 1.5, -0.1), "k = -0.1, which would amplify light"),
        ((2.0, 1.5), "an angle is outside 0 to pi/2"),
        ((-0.1, 1.5), "an angle is outside"),
        ((0.1, 1.5 + 1j), "give eta and k separately"),
        ((0.1, "glass"), "'glass' given, a number"),
        ((np.nan, 1.5), "not finite"),
        (([0.1, 0.2], [1.0, 2.0, 3.0]), "do not broadcast"),
    ],
)
def test_an_index_that_no_medium_has_is_an_error(arguments: tuple[Any, ...], text: str) -> None:
    with pytest.raises(InputError, match=text):
        go.fresnel(*arguments)
