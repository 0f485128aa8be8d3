"""Materials against their formulas, written out again with angles, and their limits."""

from __future__ import annotations

import gonio as go
import numpy as np
import pytest

from sphere import at, hemisphere, random_directions, random_numbers

COUNT = 5000
WO, WI = random_directions(COUNT, 71, upper=True), random_directions(COUNT, 72, upper=True)


def test_lambert_is_albedo_over_pi() -> None:
    f = go.Lambert((0.2, 0.5, 0.9)).f(WO, WI, precision="float64")
    np.testing.assert_allclose(f, np.tile(np.array([0.2, 0.5, 0.9]) / np.pi, (COUNT, 1)), rtol=1e-14)


def test_phong_is_equation_1() -> None:
    kd, ks, p = np.array([0.3, 0.4, 0.5]), np.array([0.1, 0.2, 0.3]), 7.0
    r = WI * [-1, -1, 1]
    v_r = np.maximum(np.sum(WO * r, 1), 0)
    expected = kd * WI[:, 2:] + ks * (v_r**p)[:, None]
    got = go.Phong(tuple(kd), tuple(ks), p).eval(WO, WI, precision="float64")
    np.testing.assert_allclose(got, expected, rtol=1e-11, atol=1e-15)


def test_even_power_of_phong_leaves_the_wrong_side_dark() -> None:
    wo, wi = at(80, 0), at(80, 0)  # the highlight lies at azimuth 180: v.r < 0
    assert go.Phong(0.0, 1.0, 2.0).eval(wo, wi)[0, 0] == 0


def test_blinn_phong_is_its_formula() -> None:
    h = (WO + WI) / np.linalg.norm(WO + WI, axis=1, keepdims=True)
    expected = 0.3 * WI[:, 2] + 0.5 * h[:, 2] ** 25
    got = go.BlinnPhong(0.3, 0.5, 25.0).eval(WO, WI, precision="float64")[:, 0]
    np.testing.assert_allclose(got, expected, rtol=1e-11)


def test_ambient_coefficient_is_kept_out_of_eval() -> None:
    plain, ambient = go.Phong(0.3, 0.4, 9.0), go.Phong(0.3, 0.4, 9.0, ka=0.3)
    np.testing.assert_array_equal(plain.eval(WO, WI), ambient.eval(WO, WI))
    assert ambient.ambient == 0.3


def test_sum_of_coefficients_is_checked_on_request() -> None:
    go.Phong(0.3, 0.4, 9.0, ka=0.3, check_sum=True)
    go.Phong((0.3, 0.2, 0.1), (0.4, 0.5, 0.6), 9.0, ka=0.3, check_sum=True)
    with pytest.raises(go.InputError, match=r"ka \+ kd \+ ks = .*0.9.*1 expected"):
        go.Phong(0.3, 0.3, 9.0, ka=0.3, check_sum=True)


def test_phong_samples_estimate_its_albedo() -> None:
    w, weights = hemisphere(300, 120)
    u = random_numbers(100_000, 71)
    for model in (go.Phong(0.2, 0.5, 40.0), go.BlinnPhong(0.2, 0.5, 40.0), go.Phong(0.0, 0.5, 3.0)):
        exact = model.eval(at(50), w, precision="float64")[:, 0] @ weights
        weight = model.sample(np.tile(at(50), (len(u), 1)), u, precision="float64").weight[:, 0]
        assert weight.mean() == pytest.approx(exact, abs=5 * weight.std() / np.sqrt(len(u)) + 1e-5)


@pytest.mark.parametrize("sigma", [0.0, 0.1, 0.5, 1.5])
def test_oren_nayar_is_equations_2_and_3_in_angles(sigma: float) -> None:
    theta_o, theta_i = np.arccos(WO[:, 2]), np.arccos(WI[:, 2])
    phi_o, phi_i = np.arctan2(WO[:, 1], WO[:, 0]), np.arctan2(WI[:, 1], WI[:, 0])
    a = 1 - sigma**2 / (2 * (sigma**2 + 0.33))
    b = 0.45 * sigma**2 / (sigma**2 + 0.09)
    alpha, beta = np.maximum(theta_o, theta_i), np.minimum(theta_o, theta_i)
    f = 0.8 / np.pi * (a + b * np.maximum(0, np.cos(phi_i - phi_o)) * np.sin(alpha) * np.tan(beta))
    got = go.OrenNayar(0.8, sigma).f(WO, WI, precision="float64")[:, 0]
    np.testing.assert_allclose(got, f, rtol=1e-10)


def test_oren_nayar_without_slopes_is_lambert() -> None:
    np.testing.assert_allclose(
        go.OrenNayar(0.7, 0.0).eval(WO, WI, precision="float64"),
        go.Lambert(0.7).eval(WO, WI, precision="float64"),
        rtol=1e-14,
    )


@pytest.mark.parametrize("ndf", ["ggx", "beckmann"])
def test_conductor_is_equation_4_in_angles(ndf: str) -> None:
    eta, k, a = 0.4, 2.4, 0.35
    h = (WO + WI) / np.linalg.norm(WO + WI, axis=1, keepdims=True)
    tan2 = (1 - h[:, 2] ** 2) / h[:, 2] ** 2
    if ndf == "ggx":
        d = a**2 / (np.pi * h[:, 2] ** 4 * (a**2 + tan2) ** 2)
    else:
        d = np.exp(-tan2 / a**2) / (np.pi * a**2 * h[:, 2] ** 4)

    def g1(v: np.ndarray) -> np.ndarray:
        tan = np.sqrt(1 - v[:, 2] ** 2) / v[:, 2]
        if ndf == "ggx":
            return 2 / (1 + np.sqrt(1 + a**2 * tan**2))
        b = 1 / (a * tan)
        return np.where(b < 1.6, (3.535 * b + 2.181 * b**2) / (1 + 2.276 * b + 2.577 * b**2), 1)

    r0 = ((eta - 1) ** 2 + k**2) / ((eta + 1) ** 2 + k**2)
    fresnel = r0 + (1 - r0) * (1 - np.sum(WO * h, 1)) ** 5
    expected = d * g1(WO) * g1(WI) * fresnel / (4 * WO[:, 2] * WI[:, 2])
    material = go.Conductor(eta, k, a, ndf=ndf, masking="smith-separable", fresnel="schlick", albedo=0.9)
    got = material.f(WO, WI, precision="float64")[:, 0]
    np.testing.assert_allclose(got, 0.9 * expected, rtol=1e-8, atol=1e-250)


def test_rotation_turns_the_lobe_with_the_axes() -> None:
    turn = 0.8
    c, s = np.cos(turn), np.sin(turn)
    matrix = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])  # rows: what a frame turned by +turn sees
    for cls in (go.Conductor, go.Dielectric):
        still, turned = cls(alpha=(0.1, 0.5)), cls(alpha=(0.1, 0.5), rotation=turn)
        np.testing.assert_allclose(
            turned.eval(WO, WI, precision="float64"),
            still.eval(WO @ matrix.T, WI @ matrix.T, precision="float64"),
            rtol=1e-10,
            atol=1e-14,
        )


def test_quarter_turn_exchanges_the_widths() -> None:
    np.testing.assert_allclose(
        go.Conductor(alpha=(0.1, 0.5), rotation=np.pi / 2).eval(WO, WI, precision="float64"),
        go.Conductor(alpha=(0.5, 0.1)).eval(WO, WI, precision="float64"),
        rtol=1e-10,
    )


def test_rough_glass_is_walters_equation_21() -> None:
    eta, a = 1.5, 0.4
    wo, wi = WO, WI * [1, 1, -1]
    h = -(wo + eta * wi)
    h /= np.linalg.norm(h, axis=1, keepdims=True)
    o_m, i_m = np.sum(wo * h, 1), np.sum(wi * h, 1)
    joined = (h[:, 2] > 0) & (o_m > 0) & (i_m < 0)
    with np.errstate(all="ignore"):
        d = a**2 / (np.pi * h[:, 2] ** 4 * (a**2 + (1 - h[:, 2] ** 2) / h[:, 2] ** 2) ** 2)
        cos_t = -i_m
        s, p = (o_m - eta * cos_t) / (o_m + eta * cos_t), (eta * o_m - cos_t) / (eta * o_m + cos_t)
        f = 0.5 * (s**2 + p**2)
        g = np.prod([2 / (1 + np.sqrt(1 + a**2 * (1 - w[:, 2] ** 2) / w[:, 2] ** 2)) for w in (wo, wi)], axis=0)
        # as Walter2007, eq. 21, with i and o exchanged: his i is the known direction
        importance = np.abs(o_m * i_m / (wo[:, 2] * wi[:, 2])) * eta**2 * (1 - f) * g * d / (o_m + eta * i_m) ** 2
    expected = np.where(joined, importance, 0)
    glass = go.Dielectric(eta, a, masking="smith-separable")
    got = glass.f(wo, wi, "importance", precision="float64")[:, 0]
    np.testing.assert_allclose(got, expected, rtol=1e-8, atol=1e-12)
    radiance = glass.f(wo, wi, precision="float64")[:, 0]
    np.testing.assert_allclose(radiance * eta**2, got, rtol=1e-10, atol=1e-14)
    assert joined.mean() > 0.2


# ---------------------------------------------------------------------------------------------- limits


@pytest.mark.parametrize("cls", [go.Conductor, go.Dielectric])
def test_narrow_facets_tend_to_the_ideal_surface(cls: type) -> None:
    u = random_numbers(COUNT, 73)
    wo = random_directions(COUNT, 73, upper=cls is go.Conductor)
    wo[:, 2] = np.copysign(np.maximum(np.abs(wo[:, 2]), 0.15), wo[:, 2])  # away from grazing, where any width matters
    wo /= np.linalg.norm(wo, axis=1, keepdims=True)
    narrow, ideal = (cls(alpha=a).sample(wo, u, precision="float64") for a in (2e-4, 0.0))
    near = np.linalg.norm(narrow.wi - ideal.wi, axis=1) < 0.02
    assert near.mean() > 0.99
    assert ideal.delta.all() and not narrow.delta.any()
    assert np.median(np.abs(narrow.weight - ideal.weight)[near]) < 1e-3


def test_smooth_metal_is_a_mirror_with_fresnels_colour() -> None:
    s = go.Conductor(0.4, 2.4, 0.0).sample(at(0), [0.5, 0.5, 0.5], precision="float64")
    np.testing.assert_allclose(s.wi, [[0, 0, 1]], atol=1e-15)
    np.testing.assert_allclose(s.weight, ((0.4 - 1) ** 2 + 2.4**2) / ((0.4 + 1) ** 2 + 2.4**2), rtol=1e-12)
    assert s.pdf[0] == 1 and s.eta[0] == 1
    wo = at(50, 20)
    np.testing.assert_allclose(go.Mirror().sample(wo, [0.1, 0.2, 0.3], precision="float64").wi, [wo * [-1, -1, 1]])


def test_smooth_glass_refracts_by_snell_and_reflects_totally() -> None:
    glass = go.Dielectric(1.5, 0.0)
    through = glass.sample(at(40), [0.999, 0.5, 0.5], precision="float64")
    assert through.wi[0, 2] < 0 and through.eta[0] == 1.5
    assert np.hypot(*through.wi[0, :2]) * 1.5 == pytest.approx(np.sin(np.radians(40)))
    total = glass.sample(at(180 - 60), [0.999, 0.5, 0.5], precision="float64")
    np.testing.assert_allclose(total.wi, [at(180 - 60) * [-1, -1, 1]], atol=1e-14)
    assert total.pdf[0] == 1 and total.weight[0, 0] == pytest.approx(1)


def test_probability_of_smooth_reflection_is_fresnels() -> None:
    s = go.Dielectric(1.5, 0.0).sample(np.tile(at(0), (2, 1)), [[0.0399, 0, 0], [0.0401, 0, 0]], precision="float64")
    np.testing.assert_allclose(s.pdf, [0.04, 0.96], rtol=1e-12)
    assert s.wi[0, 2] > 0 > s.wi[1, 2]
    np.testing.assert_allclose(s.weight[:, 0], [1, 1 / 2.25], rtol=1e-12)  # radiance shrinks by eta^2


def test_first_number_picks_the_lobe() -> None:
    u = random_numbers(COUNT, 74)
    wo = np.tile(at(30), (COUNT, 1))
    s = go.Dielectric(1.5, 0.1).sample(wo, u)
    up = s.wi[:, 2] > 0
    assert u[up & (s.pdf > 0), 0].max() < u[~up & (s.pdf > 0), 0].min() + 0.1
    low, high = u.copy(), u.copy()
    low[:, 0], high[:, 0] = 0.0, 0.9999
    assert (go.Dielectric(1.5, 0.1).sample(wo, low).wi[:, 2] > 0).mean() > 0.98  # the rest fails below the horizon
    assert (go.Dielectric(1.5, 0.1).sample(wo, high).wi[:, 2] < 0).all()


def test_matched_indices_let_light_straight_through() -> None:
    s = go.Dielectric(1.0, 0.5).sample(WO, random_numbers(COUNT, 75), precision="float64")
    np.testing.assert_allclose(s.wi, -WO, atol=1e-12)
    np.testing.assert_allclose(s.weight, 1.0, rtol=1e-12)
    assert s.delta.all()


@pytest.mark.parametrize("eta", [1.0001, 1.00001])
def test_nearly_matched_indices_nearly_let_light_straight_through(eta: float) -> None:
    wo = np.tile(at(30), (COUNT, 1))
    s = go.Dielectric(eta, 0.3).sample(wo, random_numbers(COUNT, 76))
    turned = np.linalg.norm(s.wi + wo, axis=1)
    assert np.percentile(turned, 95) < 10 * (eta - 1)
    assert s.weight[:, 0].mean() > 0.98


def test_glass_without_transmission_is_its_reflection_alone() -> None:
    whole, exercise = go.Dielectric(1.5, 0.3), go.Dielectric(1.5, 0.3, transmission=False)
    np.testing.assert_allclose(
        exercise.eval(WO, WI, precision="float64"), whole.eval(WO, WI, precision="float64"), rtol=1e-12
    )
    assert not exercise.eval(WO, WI * [1, 1, -1]).any() and not exercise.transmits and whole.transmits


def test_mix_is_the_weighted_average() -> None:
    a, b = go.Lambert(0.2), go.Conductor(alpha=0.4)
    mixed = go.mix(a, b, 0.25).eval(WO, WI, precision="float64")
    expected = 0.75 * a.eval(WO, WI, precision="float64") + 0.25 * b.eval(WO, WI, precision="float64")
    np.testing.assert_allclose(mixed, expected, rtol=1e-13)
    pdf = 0.75 * a.pdf(WO, WI, precision="float64") + 0.25 * b.pdf(WO, WI, precision="float64")
    np.testing.assert_allclose(go.mix(a, b, 0.25).pdf(WO, WI, precision="float64"), pdf, rtol=1e-13)
    for weight, alone in ((0.0, a), (1.0, b)):
        s, t = (m.sample(WO, random_numbers(COUNT, 77), precision="float64") for m in (go.mix(a, b, weight), alone))
        np.testing.assert_allclose(s.wi, t.wi, atol=1e-6)  # the stretched number is cut at the largest float32 under 1


def test_two_sided_looks_alike_from_behind() -> None:
    base = go.Conductor(alpha=(0.1, 0.4))
    both = go.two_sided(base)
    down = [1, 1, -1]
    np.testing.assert_allclose(both.eval(WO * down, WI * down), base.eval(WO, WI), rtol=1e-6)
    assert not both.eval(WO, WI * down).any() and not base.eval(WO * down, WI * down).any()
    with pytest.raises(go.InputError, match="Dielectric transmits"):
        go.two_sided(go.Dielectric())
