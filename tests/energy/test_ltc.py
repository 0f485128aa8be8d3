"""Linearly transformed cosines: the fit, its errors, and integrals over quadrilaterals."""

from __future__ import annotations

import gonio as go
import numpy as np
import pytest
from gonio.energy.tables import ltc

IDENTITY = np.array([1.0, 0.0, 1.0, 0.0, 1.0])
UP = np.array([0.0, 0.0, 1.0])


def test_a_cosine_lobe_seen_through_quadrilaterals_is_its_integral() -> None:
    quads = ltc.random_quads(np.random.default_rng(3), 40)
    covered = ltc.covered(np.tile(IDENTITY, (40, 1)), np.tile(UP, (40, 1)), quads)
    points = ltc.points_of(go.Lambert(1.0), np.ones(1), 8_000, 8_000)
    light = points.weight[0] * points.value[0, :, 0]
    summed = [np.sum(light[ltc.inside(quad, points.wi[0])]) for quad in quads]
    cut = np.any(quads[..., 2] < 0.0, axis=1)
    assert cut.any() and not cut.all()
    assert np.max(np.abs(covered - summed)) < 1e-2


def test_a_floor_of_light_covers_the_whole_hemisphere() -> None:
    corners = 1e6 * np.array([[[-1.0, -1.0, 0], [1.0, -1.0, 0], [1.0, 1.0, 0], [-1.0, 1.0, 0]]]) + UP
    assert ltc.covered(IDENTITY[None], UP[None], corners)[0] == pytest.approx(1.0, abs=1e-5)
    assert ltc.covered(IDENTITY[None], UP[None], corners * (1, 1, -1))[0] == 0.0


def test_lambert_is_a_cosine_itself() -> None:
    baked = ltc.bake(go.Lambert(0.5), 4)
    assert baked.arrays["ltc_inverse"].shape == (4, 4)
    assert np.allclose(baked.arrays["ltc_inverse"], (1.0, 0.0, 0.0, 1.0), atol=1e-5)
    assert np.allclose(baked.arrays["ltc_norm"], 0.5, atol=1e-3)
    assert baked.manifest["error"]["ltc_inverse"]["max"] < 1e-5


@pytest.mark.slow
def test_gold_keeps_its_albedo_and_its_lobe() -> None:
    gold = go.Conductor.preset("Au")
    baked = ltc.bake(gold, 6)
    rough, mu = go.Conductor.preset("Au", alpha=0.36), baked.arrays["mu"]
    assert np.allclose(baked.arrays["ltc_norm"][3], go.albedo(rough, mu).value, atol=1e-6)
    assert np.max(np.abs(baked.arrays["ltc_inverse"][:, 0, 1:3])) < 0.02  # round at normal incidence
    error = baked.manifest["error"]
    assert baked.manifest["parameter"] == "alpha"
    assert error["ltc_inverse"]["mean"] < 0.1 and error["ltc_norm"]["mean"] < 0.01
    assert np.max(baked.arrays["ltc_error"][1:, :3]) < 0.03


def test_less_light_goes_elsewhere_than_by_the_measure_of_the_paper() -> None:
    mu = np.array([0.6, 0.3, 0.1, 0.03])
    model = go.Conductor(alpha=0.36).lossless()
    row = ltc._row(model, mu, None, True)
    points = ltc.points_of(model, mu)
    lobe = points.value.mean(-1) / row.norm[:, :1]
    given = points.wi, points.weight, lobe
    cubed, _ = ltc.fitted(ltc.PLANE, *given, row.inverse)
    own, paper = (ltc.loss_of(ltc.PLANE, one, *given, 1.0) for one in (row.inverse, cubed))
    assert np.all(own < 0.95 * paper) and np.all(own > 0.5 * paper)
    assert 0.5 * own == pytest.approx(row.misplaced, rel=1e-6)


@pytest.mark.slow
def test_a_distribution_has_the_two_albedos_of_the_split_sum() -> None:
    baked = go.bake("ggx", lut=["ltc"], resolution=3)
    both = go.bake("ggx", lut=["dfg"], resolution=3, layout="stretched")
    assert np.allclose(baked.arrays["ltc_norm"][2, 0], (both.arrays["dfg"][2, 2].sum(), both.arrays["dfg"][2, 2, 1]))


@pytest.mark.parametrize(
    ("model", "words"),
    [
        (go.RandomWalk(go.Conductor()), "RandomWalk is estimated by random walks"),
        (go.model("mirror")(), "has a mirror lobe"),
    ],
)
def test_what_has_no_such_table_says_why(model: go.BSDF, words: str) -> None:
    with pytest.raises(go.InputError, match=words):
        ltc.bake(model, 4)


def test_options_of_other_tables_are_refused() -> None:
    with pytest.raises(go.InputError, match="ltc with 'E'"):
        go.bake("ggx", lut=["ltc", "E"])
    with pytest.raises(go.InputError, match="--layout stretched"):
        go.bake("ggx", lut=["ltc"], layout="stretched")
    with pytest.raises(go.InputError, match="512 x 512"):
        go.bake("ggx", lut=["ltc"], resolution=512)


def test_a_lobe_that_the_horizon_cuts_in_half_is_fitted_by_its_tail() -> None:
    """With p = 1.5 as the last power, 0.42 of the light goes elsewhere."""
    model = ltc.at(go.Conductor().lossless(), "alpha", 12 / 63)
    row = ltc._row(model, np.array([0.9, 0.1, ltc.MIN_COSINE]), None, True)
    assert row.misplaced[-1] < 0.39 and row.misplaced[0] < 0.01
