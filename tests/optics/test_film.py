"""Thin films against the characteristic matrices of optics, and their colours against the spectrum."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.errors import InputError
from gonio.ops import backend
from gonio.optics import colour, indices
from gonio.optics.fresnel import film

from sphere import SEED

RNG = np.random.default_rng(SEED)
KIND = backend.types("float64")
N = 1000


def number(x: Any) -> Any:
    return KIND.float(np.array(np.atleast_1d(x), float))


def three(x: Sequence[Any]) -> Any:
    return KIND.vec3(*map(number, x))


def amplitudes(theta: Any, film_eta: Any, thickness: Any, n: Any, nm: Any) -> list[np.ndarray]:
    """r_s and r_p of a layer by its characteristic matrix (Born1999, sec. 1.6), fields as exp(-i omega t)."""
    cos, sin2 = np.cos(theta), np.sin(theta) ** 2
    w2, w3 = np.sqrt(film_eta**2 - sin2 + 0j), np.sqrt(n**2 - sin2 + 0j)
    delta = 2 * np.pi * thickness * w2 / nm
    found = []
    for a, b, c in ((cos, w2, w3), (cos, w2 / film_eta**2, w3 / n**2)):
        field, other = np.cos(delta) - 1j * np.sin(delta) * c / b, c * np.cos(delta) - 1j * b * np.sin(delta)
        found.append((a * field - other) / (a * field + other))
    return found


def exact(theta: Any, film_eta: Any, thickness: Any, n: Any, nm: Any) -> np.ndarray:
    s, p = amplitudes(theta, film_eta, thickness, n, nm)
    return np.asarray(0.5 * (np.abs(s) ** 2 + np.abs(p) ** 2))


THETA, ETA2, THICK = RNG.uniform(0, 1.55, N), RNG.uniform(1, 2.5, N), RNG.uniform(0, 3000, N)
ETA, K, NM = RNG.uniform(0.1, 3, (3, N)), RNG.uniform(0, 5, (3, N)), RNG.uniform(380, 780, (3, N))


def random_film(k: np.ndarray = K, form: str = "local") -> film.Film:
    return film.Film(three(ETA), three(k), number(ETA2), number(THICK), form, three(NM))


def test_the_sum_of_waves_is_the_characteristic_matrix() -> None:
    got = np.array(film.reflectance(number(np.cos(THETA)), random_film()))
    want = [exact(THETA, ETA2, THICK, ETA[c] + 1j * K[c], NM[c]) for c in range(3)]
    np.testing.assert_allclose(got, want, atol=1e-12)


def test_the_amplitudes_are_those_of_the_matrix_phases_included() -> None:
    back, _ = film.polarization(number(np.cos(THETA)), random_film())
    for c in range(3):
        s, p = amplitudes(THETA, ETA2, THICK, ETA[c] + 1j * K[c], NM[c])
        total, cross = np.abs(s) ** 2 + np.abs(p) ** 2, s * np.conj(p)
        want = [(np.abs(s) ** 2 - np.abs(p) ** 2) / total, 2 * cross.real / total, 2 * cross.imag / total]
        np.testing.assert_allclose([np.array(x[c]) for x in back], want, atol=1e-9)


def test_without_thickness_or_contrast_it_is_the_bare_surface() -> None:
    cos = number(np.cos(THETA))
    bare = [go.fresnel(THETA, ETA[c], K[c]).R for c in range(3)]
    plain = random_film()
    for none in (plain._replace(thickness=number(0.0)), plain._replace(film_eta=number(1.0))):
        np.testing.assert_allclose(np.array(film.reflectance(cos, none)), bare, atol=1e-11)


def colours(form: str, cos: np.ndarray, metal: indices.Metal, film_eta: float, thickness: np.ndarray) -> np.ndarray:
    found = film.Film(three(metal.eta), three(metal.k), number(film_eta), number(thickness), form, None)
    return np.array(film.reflectance(number(cos), found)).T


FINE = np.arange(380.0, 781.0, 1.0)


def under_daylight(theta: float, metal: indices.Metal, film_eta: float, thickness: float) -> np.ndarray:
    """The same, of the whole spectrum; the metal's indices straight between its three."""
    eta, k = (np.interp(FINE, indices.RGB_WAVELENGTHS[::-1], values[::-1]) for values in (metal.eta, metal.k))
    seen = colour.weights(FINE).T @ exact(theta, film_eta, thickness, eta + 1j * k, FINE)
    return np.asarray(np.clip(seen, 0.0, 1.0))


@pytest.mark.slow
@pytest.mark.parametrize(("form", "bar"), [("local", 0.008), ("belcour-barla", 0.03)])
def test_colours_are_near_those_of_the_spectrum(form: str, bar: float) -> None:
    """Of greyish metals: gold and copper want more than three bands, see docs/thin-film.md."""
    theta, thickness = (
        x.ravel() for x in np.meshgrid(np.radians([0.0, 30.0, 60.0]), [0.0, 150.0, 400.0, 700.0, 1100.0])
    )
    for name in ("Cr", "Fe", "Ti", "W", "Al"):
        metal = indices.METALS[name]
        got = colours(form, np.cos(theta), metal, 1.5, thickness)
        want = [under_daylight(t, metal, 1.5, d) for t, d in zip(theta, thickness, strict=True)]
        assert np.abs(got - want).max() < bar, name


def test_thick_films_have_no_colour_in_fourier_space() -> None:
    metal = indices.METALS["Cr"]
    got = colours("belcour-barla", np.array([1.0]), metal, 1.5, np.array([3000.0]))[0]
    n = np.array(metal.eta) + 1j * np.array(metal.k)
    top, base = ((1 - 1.5) / 2.5) ** 2, np.abs((1.5 - n) / (1.5 + n)) ** 2
    mean = top + (1 - top) ** 2 * base / (1 - top * base)  # light without phase, all bounces
    np.testing.assert_allclose(got, mean, atol=1e-3)


@pytest.mark.parametrize("form", list(film.FORMS))
def test_glass_under_a_film_keeps_all_light(form: str) -> None:
    glass = go.FilmDielectric(1.5, 0.0, thickness=500.0, film_eta=2.2, form=form)
    wo = RNG.normal(size=(200, 3))
    wo /= np.linalg.norm(wo, axis=1, keepdims=True)
    s = glass.sample(wo, RNG.random((200, 3)), mode="importance", precision="float64")
    u = np.full((200, 3), 0.5)
    low, high = (glass.sample(wo, u * [x, 1, 1], mode="importance", precision="float64") for x in (1e-9, 1.999999))
    total = low.weight * low.pdf[:, None] + high.weight * high.pdf[:, None]
    both = (low.wi[:, 2] * high.wi[:, 2] < 0) | (np.abs(low.pdf - 1.0) < 1e-9)
    assert both.all() and s.delta.all()
    transmits = low.wi[:, 2] * high.wi[:, 2] < 0
    np.testing.assert_allclose(total[transmits], 1.0, atol=1e-9)
    assert np.ptp(low.weight * low.pdf[:, None], axis=1).max() > 0.05, "it has colours"


def test_the_skin_of_a_bubble_reflects_and_lets_pass_straight_on() -> None:
    skin = go.FilmDielectric(1.0, 0.3, thickness=350.0, film_eta=1.33)
    wo = np.array([[0.0, 0.6, 0.8], [0.0, 0.6, -0.8]])
    back, on = (skin.sample(wo, np.tile([u, 0.5, 0.5], (2, 1)), precision="float64") for u in (1e-9, 0.999999))
    np.testing.assert_allclose(back.wi, wo * [-1, -1, 1], atol=1e-12)
    np.testing.assert_allclose(on.wi, -wo, atol=1e-12)
    np.testing.assert_allclose(back.weight * back.pdf[:, None] + on.weight * on.pdf[:, None], 1.0, atol=1e-12)
    assert 0.01 < (back.weight * back.pdf[:, None]).min() < (back.weight * back.pdf[:, None]).max() < 0.12


@pytest.mark.parametrize(
    ("name", "values", "text"),
    [
        ("film-conductor", {"thickness": -1.0}, "-1 given, >= 0"),
        ("film-dielectric", {"thickness": -0.5}, "-0.5 given, >= 0"),
        ("film-conductor", {"film_eta": 0.5}, "0.5 given, >= 1"),
        ("film-conductor", {"k": -1.0}, "-1 given, >= 0"),
        ("film-conductor", {"form": "xyz"}, "unknown form 'xyz'"),
        ("film-conductor", {"fresnel": "schlick"}, "unknown fresnel 'schlick'"),
    ],
)
def test_a_film_that_cannot_be_is_an_error(name: str, values: dict[str, Any], text: str) -> None:
    with pytest.raises(InputError, match=text):
        go.model(name)(**values)
