"""Special functions against SciPy, maps of the square against their densities, indices, frames."""

from __future__ import annotations

from typing import Any

import gonio as go
import numpy as np
import pytest
import scipy.special
from gonio.errors import InputError
from gonio.ops import backend
from gonio.optics import frame, fresnel, indices, masking, special, warp
from gonio.optics.ndf import distribution
from gonio.optics.special import beta, erfinv, gaussian_ramp

from chi_square import SIGNIFICANCE, p_value
from sphere import SEED, random_directions, relative


def _number(x: np.ndarray, precision: str) -> Any:
    return backend.types(precision).float(np.asarray(x, dtype=np.float64))


def _vector(rows: np.ndarray, precision: str = "float64") -> Any:
    return backend.vector_of(rows, len(np.atleast_2d(rows)[0]), backend.types(precision))


def test_erfinv_is_scipys_within_its_stated_error() -> None:
    x = np.concatenate([np.linspace(-0.999, 0.999, 20_001), 1 - np.logspace(-6, -3, 200)])
    exact = scipy.special.erfinv(x)
    found = relative(erfinv(_number(x, "float64")).numpy(), exact, 1e-9)
    assert found.max() < 1e-9 and found[np.abs(x) < 0.999].max() < 1e-12
    inner = np.abs(x) < 0.999
    assert relative(erfinv(_number(x, "float32")).numpy(), exact, 1e-9)[inner].max() < 2e-6


@pytest.mark.parametrize("precision, bar", [("float64", 1e-14), ("float32", 4e-7)])
def test_the_ramp_of_a_gaussian_is_its_formula_to_the_last_digits(precision: str, bar: float) -> None:
    a = np.concatenate([[0.0], np.logspace(-8, 8, 4001)])
    exact = 0.5 * a * (1.0 + scipy.special.erf(a)) + 0.5 * np.exp(-np.square(a)) / np.sqrt(np.pi)
    found = gaussian_ramp(_number(a, precision)).numpy().astype(float)
    assert relative(found, exact).max() < bar


@pytest.mark.parametrize("precision, bar", [("float64", 1e-8), ("float32", 3e-6)])
def test_beta_is_scipys_within_its_stated_error(precision: str, bar: float) -> None:
    a, b = np.meshgrid(1 + np.logspace(-6, 2, 80), 1 + np.logspace(-6, 2, 80))
    a, b = a.ravel(), b.ravel()
    got = beta(_number(a, precision), _number(b, precision)).numpy().astype(float)
    exact = scipy.special.beta(a, b)
    usual = exact > 1e-30
    assert relative(got, exact)[usual].max() < bar * (1 if precision == "float64" else 10)
    near = (a < 10) & (b < 10)
    assert relative(got, exact)[near].max() < bar


def test_beta_of_a_grazing_direction_is_its_limit() -> None:
    # B(1, b) = 1 / b, also for the enormous Lambda of a grazing direction
    b = np.logspace(0, 6, 50)
    np.testing.assert_allclose(beta(_number(np.ones(50), "float64"), _number(b, "float64")).numpy(), 1 / b, rtol=1e-7)


@pytest.mark.parametrize("p", [None, 1.0, 30.0, 1000.0])
def test_warps_follow_their_densities(p: float | None) -> None:
    kind = backend.types("float64")
    u = np.random.default_rng(SEED).random((100_000, 2))
    u1, u2 = kind.float(u[:, 0].copy()), kind.float(u[:, 1].copy())
    if p is None:
        w = warp.square_to_cosine_hemisphere(u1, u2).numpy().T
        pdf = lambda d: warp.square_to_cosine_hemisphere_pdf(_vector(d)).numpy()  # noqa: E731
    else:
        w = warp.square_to_power_lobe(u1, u2, kind.float(p)).numpy().T
        pdf = lambda d: warp.square_to_power_lobe_pdf(_vector(d).z, kind.float(p)).numpy()  # noqa: E731
    value, integral = p_value(w, np.ones(len(w), bool), pdf)
    assert value > SIGNIFICANCE and integral == pytest.approx(1, abs=1e-4)


def test_reflection_and_refraction_obey_the_law_of_the_plane_and_of_snell() -> None:
    w, m = random_directions(1000, 61), random_directions(1000, 62)
    m *= np.sign(np.sum(w * m, 1))[:, None]
    r = frame.reflect(_vector(w), _vector(m)).numpy().T
    np.testing.assert_allclose(np.sum(r * m, 1), np.sum(w * m, 1), rtol=1e-10, atol=1e-14)
    np.testing.assert_allclose(np.cross(r, m), -np.cross(w, m), atol=1e-14)
    kind = backend.types("float64")
    eta = kind.float(1.5)
    cos_t = fresnel.cos_transmitted(kind.float(np.sum(w * m, 1)), eta)
    t = frame.refract(_vector(w), _vector(m), cos_t, eta).numpy().T
    np.testing.assert_allclose(np.linalg.norm(t, axis=1), 1, rtol=1e-12)
    np.testing.assert_allclose(1.5 * np.cross(t, m), -np.cross(w, m), atol=1e-13)
    assert np.all(np.sum(t * m, 1) < 0)


def test_the_azimuth_of_the_normal_is_that_of_x() -> None:
    w = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.6, 0.0, 0.8], [0.0, -0.6, 0.8]])
    np.testing.assert_allclose(frame.azimuth(_vector(w)).numpy().T, [[1, 0], [1, 0], [1, 0], [0, -1]], atol=1e-15)


def test_rotating_back_undoes_a_rotation() -> None:
    w, turn = random_directions(100, 63), _vector(np.array([np.cos(0.7), np.sin(0.7)]))
    turned = frame.rotate(_vector(w), turn)
    np.testing.assert_allclose(frame.rotate_back(turned, turn).numpy().T, w, atol=1e-15)
    # a frame turned by +90 degrees sees +y as its x
    quarter = _vector(np.array([0.0, 1.0]))
    np.testing.assert_allclose(
        frame.rotate(_vector(np.array([[0.0, 1, 0]])), quarter).numpy().T, [[1, 0, 0]], atol=1e-15
    )


@pytest.mark.parametrize("kind", masking.Masking.family.all())
def test_masking_lies_between_zero_and_one_and_is_symmetric(kind: str) -> None:
    wo, wi = random_directions(5000, 64, upper=True), random_directions(5000, 65, upper=True)
    m = wo + wi
    m /= np.linalg.norm(m, axis=1, keepdims=True)
    alpha = _vector(np.array([0.2, 0.7]))
    for name in ("ggx", "beckmann", "student-t"):
        ndf = distribution(name)
        g = masking.masking_shadowing(kind, ndf, _vector(wo), _vector(wi), _vector(m), alpha).numpy()
        back = masking.masking_shadowing(kind, ndf, _vector(wi), _vector(wo), _vector(m), alpha).numpy()
        # Beckmann's rational fit overshoots 1 by 6e-5 at its seam
        assert g.min() >= 0 and g.max() <= 1 + (2e-4 if (kind, name) == ("smith-separable", "beckmann") else 1e-12)
        np.testing.assert_allclose(g, back, rtol=1e-12)


def test_correlated_masking_hides_less_than_separable_masking() -> None:
    wo, wi = random_directions(2000, 66, upper=True), random_directions(2000, 67, upper=True)
    m = (wo + wi) / np.linalg.norm(wo + wi, axis=1, keepdims=True)
    args = distribution("ggx"), _vector(wo), _vector(wi), _vector(m), _vector(np.array([0.6, 0.6]))
    correlated = masking.masking_shadowing("smith-correlated", *args).numpy()
    assert np.all(correlated >= masking.masking_shadowing("smith-separable-exact", *args).numpy() - 1e-14)


def test_transmission_is_hidden_more_than_reflection() -> None:
    """B(1 + a, 1 + b) is the chance of both when seen from opposite sides: below 1 / (1 + a + b) (Heitz2016)."""
    wo, wi = random_directions(2000, 68, upper=True), random_directions(2000, 69, upper=True)
    m = np.tile([0.0, 0.0, 1.0], (2000, 1))
    alpha = _vector(np.array([0.6, 0.6]))
    reflect = masking.masking_shadowing(
        "smith-correlated", distribution("ggx"), _vector(wo), _vector(wi), _vector(m), alpha
    )
    through = masking.masking_shadowing(
        "smith-correlated",
        distribution("ggx"),
        _vector(wo),
        _vector(wi * [1, 1, -1]),
        -_vector(-m),
        alpha,
        transmits=True,
    )
    assert np.all(through.numpy() <= reflect.numpy() + 1e-9)


def test_schlicks_masking_has_the_homeworks_k() -> None:
    cos, alpha = 0.3, 0.25
    roughness = np.sqrt(alpha)
    k = (roughness + 1) ** 2 / 8
    expected = (cos / (cos * (1 - k) + k)) ** 2
    w = np.array([[np.sqrt(1 - cos**2), 0, cos]])
    mirrored = w * [-1, 1, 1]
    m = _vector(np.array([[0.0, 0, 1]]))
    widths = _vector(np.array([alpha, alpha]))
    got = masking.masking_shadowing("schlick-direct", distribution("ggx"), _vector(w), _vector(mirrored), m, widths)
    assert got.numpy()[0] == pytest.approx(expected, rel=1e-12)
    k = alpha / 2
    got = masking.masking_shadowing("schlick-ibl", distribution("ggx"), _vector(w), _vector(mirrored), m, widths)
    assert got.numpy()[0] == pytest.approx((cos / (cos * (1 - k) + k)) ** 2, rel=1e-12)


def test_metals_have_their_colours() -> None:
    def colour(name: str) -> np.ndarray:
        metal = go.Conductor.preset(name)
        return np.array(
            [((n - 1) ** 2 + k * k) / ((n + 1) ** 2 + k * k) for n, k in zip(metal.eta, metal.k, strict=True)]
        )

    r, g, b = colour("Cu")
    assert r > 0.9 and r - g > 0.15 and g > b - 0.02, "copper is reddish"
    r, g, b = colour("gold")
    assert r > 0.9 and g > 0.6 and g - b > 0.2, "gold is yellowish"
    silver = colour("silver")
    assert silver.min() > 0.9
    assert np.ptp(colour("aluminium")) < 0.05


def test_every_index_names_its_source_and_is_found_by_symbol_or_name() -> None:
    for symbol, metal in indices.METALS.items():
        assert metal.source and len(metal.eta) == len(metal.k) == 3
        gold = [go.Conductor.preset(called) for called in (symbol.lower(), metal.name)]
        assert all((c.eta, c.k) == (metal.eta, metal.k) for c in gold)
        assert all(indices.constants(name).name == symbol for name in (metal.name, *metal.also))
    assert go.Dielectric.preset("Water").eta == pytest.approx(1.333, abs=5e-4)
    with pytest.raises(InputError, match="unknown metal 'goldd'"):
        go.Conductor.preset("goldd")
    with pytest.raises(InputError, match="did you mean 'gold'"):
        go.Conductor.preset("goldd")
    with pytest.raises(InputError, match="did you mean 'water'"):
        go.Dielectric.preset("watr")


@pytest.mark.parametrize("precision, tolerance", [("float32", 3e-7), ("float64", 1e-15)])
def test_exprel_and_logrel_keep_their_digits_about_zero(precision: str, tolerance: float) -> None:
    x = np.concatenate([-np.logspace(-12, np.log10(0.9), 200), np.logspace(-12, 1, 200)])
    rounded = x.astype(np.float32).astype(float) if precision == "float32" else x
    for word, exact in ((special.exprel, np.expm1(rounded) / rounded), (special.logrel, np.log1p(rounded) / rounded)):
        found = np.asarray(backend.to_numpy(word(_number(x, precision)), len(x)), float)
        assert np.max(np.abs(found / exact - 1.0)) < tolerance, word


def test_a_power_law_s_quantile_turns_its_integral_round() -> None:
    log_t = np.linspace(0.1, 12.0, 50)
    for q in (-1.5, -1e-9, 0.0, 0.3, 1.0):
        power = _number(np.array([q]), "float64")
        area = special.power_integral(_number(log_t, "float64"), power)
        back = backend.to_numpy(special.power_quantile(area, power), 50)
        assert np.allclose(back, log_t, rtol=1e-6)
