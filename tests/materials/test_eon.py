"""EON against its formula written in angles, its closed forms and its limits."""

from __future__ import annotations

import gonio as go
import numpy as np
import pytest

from sphere import at, hemisphere, random_directions, random_numbers

EON = go.model("eon")
WO, WI = random_directions(2000, 181, upper=True), random_directions(2000, 182, upper=True)


def albedo_of_single_scattering(mu: np.ndarray, r: float) -> np.ndarray:
    """E of Fujii's model at rho = 1, by quadrature of its first term over the hemisphere, in angles."""
    w, weights = hemisphere(400, 400)
    found = []
    for one in np.atleast_1d(mu):
        wo = at(np.degrees(np.arccos(one)))
        found.append(weights @ (single(np.broadcast_to(wo, w.shape), w, r) * w[:, 2]))
    return np.array(found)


def single(wo: np.ndarray, wi: np.ndarray, r: float) -> np.ndarray:
    s = np.sum(wo * wi, 1) - wo[:, 2] * wi[:, 2]
    t = np.where(s > 0, np.maximum(wo[:, 2], wi[:, 2]), 1.0)
    return (1 + r * s / t) / (1 + (0.5 - 2 / (3 * np.pi)) * r) / np.pi


@pytest.mark.slow
@pytest.mark.parametrize("r", [0.3, 1.0])
def test_eon_is_single_scattering_and_what_that_loses(r: float) -> None:
    rho, count = 0.7, 12
    mu = np.polynomial.legendre.leggauss(48)
    nodes, weights = 0.5 * (mu[0] + 1.0), 0.5 * mu[1]
    E_avg = 2.0 * weights @ (albedo_of_single_scattering(nodes, r) * nodes)
    E_o, E_i = (albedo_of_single_scattering(w[:count, 2], r) for w in (WO, WI))
    rho_ms = rho**2 * E_avg / (1 - rho * (1 - E_avg))
    expected = rho * single(WO, WI, r)[:count] + rho_ms / np.pi * (1 - E_o) * (1 - E_i) / (1 - E_avg)
    got = EON(rho, r).f(WO[:count], WI[:count], precision="float64")[:, 0]
    np.testing.assert_allclose(got, expected, rtol=2e-4)


@pytest.mark.parametrize("energy", ["exact", "fit"])
@pytest.mark.parametrize("r", [0.0, 0.2, 1.0])
def test_a_white_eon_returns_all_light(r: float, energy: str) -> None:
    found = go.albedo(EON(1.0, r, energy=energy), mu=[0.01, 0.1, 0.3, 0.6, 1.0], method="quadrature").value
    np.testing.assert_allclose(found, 1.0, atol=3e-4 if energy == "fit" else 1e-6)


def test_values_integrate_to_the_closed_form() -> None:
    model = EON((0.9, 0.5, 0.1), 0.8)
    w, weights = hemisphere(300, 300)
    for mu in (0.05, 0.5, 1.0):
        wo = np.broadcast_to(at(np.degrees(np.arccos(mu))), w.shape)
        integral = weights @ model.eval(wo, w, precision="float64")
        np.testing.assert_allclose(integral, go.albedo(model, mu=mu).value[0], atol=2e-4)


def test_eon_without_roughness_is_lambert() -> None:
    got = EON(0.7, 0.0).eval(WO, WI, precision="float64")
    np.testing.assert_allclose(got, go.Lambert(0.7).eval(WO, WI, precision="float64"), rtol=1e-14)


def test_its_samples_have_a_tenth_of_the_variance_that_the_cosine_has() -> None:
    model, u = EON(1.0, 1.0), random_numbers(20_000, 5)
    wo = np.tile(at(80.0), (len(u), 1))
    weight = model.sample(wo, u).weight[:, 0]
    wi = go.Lambert().sample(wo, u).wi
    by_cosine = model.eval(wo, wi)[:, 0] / go.Lambert().pdf(wo, wi)
    assert weight.mean() == pytest.approx(1.0, abs=0.01)
    assert weight.var() < 0.1 * by_cosine.var()
    assert np.all(model.sample(wo, u).pdf > 0.0)  # none is lost below the surface
