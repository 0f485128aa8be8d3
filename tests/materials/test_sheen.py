"""Both sheens: albedos, limits, and what stands in their papers."""

from __future__ import annotations

import gonio as go
import numpy as np
import pytest

from sphere import at, random_directions, random_numbers

SHEEN, CHARLIE = go.model("sheen"), go.model("sheen-charlie")
# of Estevez2017, at alpha = 0 and 1
TABLE = (25.3245, 3.32435, 0.16801, -1.27393, -4.85967), (21.5473, 3.82987, 0.19823, -1.97760, -4.32054)
WO, WI = random_directions(500, 185, upper=True), random_directions(500, 186, upper=True)


def test_every_sample_of_sheen_weighs_its_albedo() -> None:
    model, u = SHEEN((0.9, 0.5, 0.1), 0.4), random_numbers(2000, 3)
    drawn = model.sample(np.tile(at(60.0), (2000, 1)), u)
    told = go.albedo(model, mu=0.5).value[0]
    np.testing.assert_allclose(drawn.weight, np.broadcast_to(told, (2000, 3)), rtol=1e-5)
    assert np.all(drawn.pdf > 0.0)


def test_sheen_has_the_printed_values_at_a_node() -> None:
    # alpha = 2 / 31 and mu = 1 / 31 of the table that the authors publish: A = .01895, B = -.00218, R = .09768
    mu = 1.0 / 31.0
    wo, wi = at(np.degrees(np.arccos(mu)), 0.0), at(40.0, 20.0)
    h = np.array([0.01895 * wi[0] - 0.00218 * wi[2], 0.01895 * wi[1], wi[2]])
    D = h[2] / np.linalg.norm(h) / np.pi * 0.01895**2 / np.linalg.norm(h) ** 3
    got = SHEEN(0.5, 2.0 / 31.0).eval(wo, wi, precision="float64")[0, 0]
    assert got == pytest.approx(0.5 * 0.09768 * D, rel=1e-3)


def test_upright_fibres_shine_at_the_rim_and_flakes_everywhere() -> None:
    rim, face = (go.albedo(SHEEN(1.0, 0.2), mu=mu).value[0, 0] for mu in (0.1, 1.0))
    assert rim > 0.25 and face < 1e-3
    assert go.albedo(SHEEN(1.0, 1.0), mu=1.0).value[0, 0] > 0.3


def test_charlie_is_its_formula_in_angles() -> None:
    alpha = 0.4
    h = (WO + WI) / np.linalg.norm(WO + WI, axis=1, keepdims=True)
    D = (2 + 1 / alpha) * np.sqrt(1 - h[:, 2] ** 2) ** (1 / alpha) / (2 * np.pi)
    share = (1 - alpha) ** 2
    a, b, c, d, e = (share * x + (1 - share) * y for x, y in zip(*TABLE, strict=True))

    def L(x: np.ndarray) -> np.ndarray:
        return a / (1 + b * x**c) + d * x + e

    def Lambda(mu: np.ndarray) -> np.ndarray:
        return np.exp(np.where(mu < 0.5, L(mu), 2 * L(np.array(0.5)) - L(1 - mu)))

    f = D / (1 + Lambda(WO[:, 2]) + Lambda(WI[:, 2])) / (4 * WO[:, 2] * WI[:, 2])
    np.testing.assert_allclose(CHARLIE(1.0, alpha).f(WO, WI, precision="float64")[:, 0], f, rtol=1e-8)


@pytest.mark.slow
def test_charlie_s_gain_near_the_horizon_is_declared() -> None:
    mu = np.geomspace(2e-3, 0.02, 4)
    for alpha in (0.01, 0.05):
        gain = go.albedo(CHARLIE(1.0, alpha), mu=mu).value.max() - 1.0
        assert 0.0 < gain < CHARLIE(1.0, alpha).violations()["energy"].size
    assert CHARLIE(1.0, 0.1).violations() == {}
