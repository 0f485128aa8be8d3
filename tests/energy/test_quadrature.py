"""E(mu, alpha) against independent integrations, closed forms and limits."""

from __future__ import annotations

from itertools import pairwise

import gonio as go
import numpy as np
import pytest
from gonio.energy.albedo import quadrature
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import integrate

MASKINGS = ("smith-correlated", "smith-separable", "schlick-direct", "schlick-ibl")


def independent(ndf: str, masking: str, mu: float, alpha: float) -> float:
    """E by SciPy's adaptive quadrature over the reflected direction, in NumPy's own formulas."""
    sin_o = np.sqrt(1.0 - mu * mu)

    def g1(z):
        tan = alpha * np.sqrt(max(1.0 - z * z, 0.0)) / z
        if masking.startswith("schlick"):
            k = (np.sqrt(alpha) + 1.0) ** 2 / 8.0 if masking == "schlick-direct" else alpha / 2.0
            return z / (z * (1.0 - k) + k)
        if ndf == "ggx":
            return 2.0 / (1.0 + np.sqrt(1.0 + tan * tan))
        a = 1.0 / max(tan, 1e-12)
        if masking == "smith-separable":
            return (3.535 * a + 2.181 * a * a) / (1.0 + 2.276 * a + 2.577 * a * a) if a < 1.6 else 1.0
        from scipy.special import erf

        return 1.0 / (1.0 + 0.5 * (erf(a) - 1.0) + np.exp(-a * a) / (2.0 * a * np.sqrt(np.pi)))

    def integrand(phi, theta):
        wi = np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
        h = wi + np.array([sin_o, 0.0, mu])
        h /= np.linalg.norm(h)
        z2 = h[2] ** 2
        tan2 = (1.0 - z2) / z2
        if ndf == "ggx":
            d = alpha**2 / (np.pi * z2**2 * (alpha**2 + tan2) ** 2)
        else:
            d = np.exp(-tan2 / alpha**2) / (np.pi * alpha**2 * z2**2)
        o, i = g1(mu), g1(wi[2])
        g = 1.0 / (1.0 / o + 1.0 / i - 1.0) if masking == "smith-correlated" else o * i
        return 2.0 * d * g / (4.0 * mu) * np.sin(theta)

    peak = np.arccos(mu)
    total = 0.0
    edges = sorted({0.0, max(peak - 4 * alpha, 0.0), peak, min(peak + 4 * alpha, np.pi / 2), np.pi / 2})
    cuts = [np.pi, max(np.pi - 4 * alpha, 0.0), 0.0][::-1]
    for a, b in pairwise(edges):
        for p, q in pairwise(cuts):
            total += integrate.dblquad(integrand, a, b, p, q, epsabs=2e-7, epsrel=2e-7)[0]
    return total


@pytest.mark.sample(4)
@pytest.mark.parametrize("masking", MASKINGS)
@pytest.mark.parametrize("ndf", ["ggx", "beckmann"])
@pytest.mark.parametrize(("mu", "roughness"), [(0.5, 0.5), (0.12, 0.9), (0.97, 0.7)])
def test_e_agrees_with_an_independent_integration(ndf, masking, mu, roughness):
    ours = quadrature.moments(ndf, masking, mu, roughness**2).white
    # 2e-5 is the bar for every table; Beckmann's rational fit jumps by 5e-5 and takes most of it
    assert float(ours) == pytest.approx(independent(ndf, masking, mu, roughness**2), abs=2e-5)


@pytest.mark.sample(1)
@pytest.mark.parametrize("masking", MASKINGS)
@pytest.mark.parametrize("ndf", ["ggx", "beckmann", "student-t"])
def test_e_agrees_with_finer_nodes_over_the_whole_table(ndf, masking):
    centres = (np.arange(32) + 0.5) / 32
    centres = np.concatenate([[0.5 / 128], centres])
    mu, roughness = np.meshgrid(centres, np.maximum(centres, 0.05))
    coarse = quadrature.moments(ndf, masking, mu, roughness**2).white
    fine = quadrature.moments(ndf, masking, mu, roughness**2, nodes=(90, 70)).white
    assert np.abs(coarse - fine).max() < 2e-5


@pytest.mark.slow
@given(mu=st.floats(0.01, 1.0), alpha=st.floats(0.003, 1.0), ndf=st.sampled_from(["ggx", "beckmann", "student-t"]))
@settings(max_examples=30, deadline=None)
def test_e_lies_between_0_and_1_and_correlated_loses_least(mu, alpha, ndf):
    e = {m: float(quadrature.moments(ndf, m, mu, alpha).white) for m in ("smith-correlated", "smith-separable-exact")}
    assert 0.0 < e["smith-separable-exact"] <= e["smith-correlated"] + 1e-6 <= 1.0 + 2e-6


def test_e_falls_with_roughness_at_normal_incidence():
    alpha = np.linspace(0.01, 1.0, 60)
    for ndf in ("ggx", "beckmann", "student-t"):
        assert np.all(np.diff(quadrature.moments(ndf, "smith-correlated", 1.0, alpha).white) < 1e-12)


def test_e_tends_to_1_as_alpha_vanishes_except_for_schlick_direct():
    for masking in ("smith-correlated", "smith-separable", "schlick-ibl"):
        assert float(quadrature.moments("ggx", masking, 0.5, 1e-4).white) == pytest.approx(1.0, abs=1e-3)
    k = (np.sqrt(1e-4) + 1.0) ** 2 / 8.0
    masked = (0.5 / (0.5 * (1.0 - k) + k)) ** 2  # a mirror under this G
    assert float(quadrature.moments("ggx", "schlick-direct", 0.5, 1e-4).white) == pytest.approx(masked, abs=1e-3)


def test_e_avg_of_schlick_direct_at_low_roughness_is_the_false_rim():
    assert quadrature.average("ggx", "schlick-direct", np.array([0.05**2]))[0] == pytest.approx(0.835, abs=5e-4)


@pytest.mark.parametrize("masking", MASKINGS)
def test_e_avg_agrees_with_adaptive_integration_of_e(masking):
    alpha = 0.36
    exact, _ = integrate.quad(
        lambda mu: 2.0 * mu * float(quadrature.moments("ggx", masking, mu, alpha, nodes=(60, 48)).white),
        0.0, 1.0, epsabs=1e-8,
    )  # fmt: skip
    assert quadrature.average("ggx", masking, np.array([alpha]))[0] == pytest.approx(exact, abs=1e-5)


def test_two_widths_agree_with_one_where_equal_and_with_sampling_where_not():
    equal = quadrature.moments("ggx", "smith-correlated", 0.3, 0.4, 0.4, 1.0).white
    assert float(equal) == pytest.approx(float(quadrature.moments("ggx", "smith-correlated", 0.3, 0.4).white), abs=1e-8)
    metal = go.Conductor(alpha=(0.1, 0.6), fresnel="one")
    found = go.albedo(metal, 0.3, 0.7)
    drawn = go.albedo(metal, 0.3, 0.7, method="sampling", samples=1 << 18)
    assert abs(found.value - drawn.value).max() < 5 * drawn.error.max()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ndf", "masking"), [("ggx", "smith-correlated"), ("ggx", "smith-separable"), ("beckmann", "smith-correlated")]
)
def test_two_widths_are_met_to_2e_5_down_to_grazing(ndf, masking):
    mu = np.concatenate([[0.5 / 128, 1.5 / 128, 0.05], np.linspace(0.1, 1.0, 6)])
    roughness = np.array([0.05, 0.2, 0.5, 1.0])[:, None]
    phi = np.linspace(0.0, 0.5 * np.pi, 7)[:, None, None]
    for aspect in (0.5, 0.25, 0.1):
        at = (mu, roughness**2, aspect * roughness**2, phi)
        fine = quadrature.moments(ndf, masking, *at, nodes=(160, 96)).white
        assert np.abs(quadrature.moments(ndf, masking, *at).white - fine).max() < 2e-5


def test_two_widths_agree_with_adaptive_integration():
    mu, phi, ax, ay = 0.4, 0.9, 0.5, 0.2
    o = np.array([np.sqrt(1 - mu * mu) * np.cos(phi), np.sqrt(1 - mu * mu) * np.sin(phi), mu])

    def smith(w):
        return 0.5 * (np.sqrt(1.0 + ((ax * w[0]) ** 2 + (ay * w[1]) ** 2) / w[2] ** 2) - 1.0)

    def integrand(azimuth, theta):
        i = np.array([np.sin(theta) * np.cos(azimuth), np.sin(theta) * np.sin(azimuth), np.cos(theta)])
        h = (o + i) / np.linalg.norm(o + i)
        d = 1.0 / (np.pi * ax * ay * ((h[0] / ax) ** 2 + (h[1] / ay) ** 2 + h[2] ** 2) ** 2)
        return d / (1.0 + smith(o) + smith(i)) / (4.0 * mu) * np.sin(theta)

    exact, _ = integrate.dblquad(integrand, 0.0, 0.5 * np.pi, 0.0, 2.0 * np.pi, epsabs=1e-6, epsrel=1e-6)
    found = quadrature.moments("ggx", "smith-correlated", mu, ax, ay, phi).white
    assert float(found) == pytest.approx(exact, abs=5e-6)


def test_split_sum_gives_the_albedo_of_schlicks_fresnel():
    metal = go.Conductor(eta=0.2, k=3.0, alpha=0.3, fresnel="schlick")
    r0 = (0.8**2 + 9.0) / (1.2**2 + 9.0)
    found = quadrature.moments("ggx", "smith-correlated", 0.4, 0.3)
    expected = r0 * (found.white - found.schlick) + found.schlick
    assert go.albedo(metal, 0.4).value[0, 0] == pytest.approx(float(expected), abs=1e-7)


@pytest.mark.sample(1)
@pytest.mark.parametrize(("mu", "alpha"), [(0.3, 0.4), (-0.3, 0.4), (-0.8, 0.1), (0.9, 0.7)])
def test_glass_agrees_with_cubature_of_its_eval(mu, alpha):
    from gonio.energy.albedo.directional import _by_cubature

    glass = go.Dielectric(1.5, alpha)
    other = _by_cubature(glass, np.array([mu]), np.array([0.0]), 0)
    assert go.albedo(glass, mu).value[0, 0] == pytest.approx(other.value[0, 0], abs=6e-4)
