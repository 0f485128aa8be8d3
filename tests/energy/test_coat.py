"""A coat: its furnace, its closed forms over Lambert and over a mirror, reciprocity, and the random walk as referee."""

from __future__ import annotations

import sys
from pathlib import Path

import gonio as go
import numpy as np
import pytest

from sphere import at, random_directions

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

import coat as referee

COAT, EON = go.model("coat"), go.model("eon")
WO, WI = random_directions(500, 191, upper=True), random_directions(500, 192, upper=True)


def fresnel(cos: np.ndarray, eta: float) -> np.ndarray:
    cos_t = np.sqrt(1 - (1 - cos**2) / eta**2)
    return 0.5 * (((cos - eta * cos_t) / (cos + eta * cos_t)) ** 2 + ((eta * cos - cos_t) / (eta * cos + cos_t)) ** 2)


def test_over_lambert_it_is_saunderson_s_closed_form() -> None:
    eta, rho = 1.5, np.array([0.8, 0.5, 0.2])
    x = (np.arange(200_000) + 0.5) / 200_000
    K = 1 - (1 - np.sum(2 * x * fresnel(x, eta)) / len(x)) / eta**2  # internal reflectance of diffuse light
    T = (1 - fresnel(WO[:, 2], eta)) * (1 - fresnel(WI[:, 2], eta))
    expected = T[:, None] / eta**2 * rho / np.pi / (1 - rho * K)
    got = COAT(go.Lambert(tuple(rho)), eta).f(WO, WI, precision="float64")
    np.testing.assert_allclose(got, expected, rtol=2e-3)


def test_over_a_mirror_it_is_the_series_of_two_mirrors() -> None:
    R, sigma, mu = 0.8, 0.3, 0.6
    F, inside = float(fresnel(np.array(mu), 1.5)), np.sqrt(1 - (1 - mu**2) / 1.5**2)
    t = np.exp(-sigma / inside)
    expected = F + (1 - F) ** 2 * t**2 * R / (1 - R * F * t**2)
    found = go.albedo(COAT(go.Mirror(R), absorption=sigma), mu=mu, method="sampling")
    assert found.value[0, 0] == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize("alpha", [0.0, pytest.param(0.4, marks=pytest.mark.slow)])
def test_white_on_white_keeps_all_light(alpha: float) -> None:
    for base in (go.Lambert(1.0), EON(1.0, 1.0)):
        found = go.albedo(COAT(base, alpha=alpha), mu=[0.1, 0.4, 1.0], method="sampling", samples=1 << 17).value
        assert np.all((found > 0.99) & (found < 1.004)), found


def test_a_coat_is_reciprocal_over_any_base() -> None:
    model = COAT(go.Conductor.preset("Au", alpha=0.3), absorption=(0.1, 0.5, 1.0))
    forth, back = model.f(WO, WI, precision="float64"), model.f(WI, WO, precision="float64")
    np.testing.assert_allclose(forth, back, rtol=1e-9)


def test_a_coat_of_the_outside_s_own_index_is_only_a_filter() -> None:
    t = np.exp(-0.5 / WO[:, 2:] - 0.5 / WI[:, 2:])
    got = COAT(go.Lambert(0.7), 1.0, absorption=0.5).f(WO, WI, precision="float64")
    np.testing.assert_allclose(got, np.broadcast_to(0.7 / np.pi * t, got.shape), rtol=1e-6)


def test_a_textured_colour_gives_what_each_colour_gives_alone() -> None:
    colours = np.array([[0.8, 0.2, 0.1], [0.1, 0.9, 0.5]])
    wo, wi = np.stack([at(30.0)] * 2), np.stack([at(50.0, 80.0)] * 2)
    both = COAT(go.Lambert(colours)).eval(wo, wi, precision="float64")
    for row, colour in zip(both, colours, strict=True):
        alone = COAT(go.Lambert(tuple(colour))).eval(wo[:1], wi[:1], precision="float64")[0]
        np.testing.assert_allclose(row, alone, rtol=1e-12)


@pytest.mark.parametrize(
    ("make", "what"),
    [
        (lambda: COAT(go.Dielectric()), "transmits"),
        (lambda: COAT(go.mix(go.Mirror(), go.Lambert())), "is a mirror in places"),
        (lambda: COAT(go.Mirror(), alpha=0.2), "rough coat over a perfect mirror"),
        (lambda: COAT(go.Lambert(), np.array([1.3, 1.5])), "varies from ray to ray"),
        (lambda: COAT(go.Lambert(), 0.9), ">= 1"),
    ],
)
def test_what_cannot_be_coated_is_one_clear_error(make: object, what: str) -> None:
    with pytest.raises(go.InputError, match=what):
        make()  # type: ignore[operator]


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    "name", ["lambert", "eon", "gold, alpha .05", "gold, alpha .05; coloured", "gold, alpha .05; coat alpha .2"]
)
def test_its_albedo_is_that_of_a_random_walk_within_two_percent(name: str) -> None:
    coat = referee.cases()[name]
    for mu in (0.3, 0.95):
        right, error = referee.walked(coat, mu, 40_000)
        found = go.albedo(coat, mu=mu, method="sampling", samples=1 << 17).value[0]
        assert np.all(np.abs(found - right) < 0.02 * right + 4.0 * error)
