"""Holes let light go straight on, in the share that the base leaves."""

from __future__ import annotations

import gonio as go
import numpy as np
import pytest

from sphere import at, random_directions, random_numbers

OPACITY = go.model("opacity")
WO, WI, U = random_directions(2000, 187), random_directions(2000, 188), random_numbers(2000, 187)


@pytest.mark.parametrize("base", [go.Conductor(alpha=0.3), go.Dielectric(1.5, 0.2), go.Mirror()], ids=lambda m: m.name)
def test_a_share_of_the_samples_goes_straight_on_unchanged(base: go.BSDF) -> None:
    drawn = OPACITY(base, 0.3).sample(WO, U, precision="float64")
    holes = U[:, 0] >= 0.3
    np.testing.assert_array_equal(drawn.wi[holes], -WO[holes].astype(float))
    np.testing.assert_allclose(drawn.weight[holes], 1.0)
    np.testing.assert_allclose(drawn.pdf[holes], 0.7)
    assert np.all(drawn.delta[holes]) and np.all(drawn.eta[holes] == 1.0)


def test_the_rest_is_the_base_alone() -> None:
    base = go.Lambert(0.8)
    np.testing.assert_allclose(OPACITY(base, 0.3).eval(WO, WI), 0.3 * base.eval(WO, WI), rtol=1e-6)
    assert go.albedo(OPACITY(base, 0.3), mu=0.5).value[0, 0] == pytest.approx(0.3 * 0.8 + 0.7)


def test_without_holes_it_is_the_base_and_without_the_base_nothing() -> None:
    assert OPACITY(go.Lambert(), 1.0).delta == "never"
    whole, none = OPACITY(go.Lambert(0.8), 1.0), OPACITY(go.Lambert(0.8), 0.0)
    np.testing.assert_allclose(whole.sample(WO, U).weight, go.Lambert(0.8).sample(WO, U).weight, rtol=1e-6)
    np.testing.assert_allclose(none.sample(at(30.0), U).wi, np.tile(-at(30.0), (2000, 1)), rtol=1e-6)


def test_glass_with_holes_is_judged_by_its_own_index() -> None:
    report = go.verify(OPACITY(go.Dielectric(1.5, 0.2), 0.3), quick=True, law=["reciprocity"])
    assert report.passed, str(report)
