"""Intervals by the profile of the loss, where a parameter's value +- error does not hold."""

from __future__ import annotations

import gonio as go
import numpy as np
import pytest
from gonio.fitting import fit
from gonio.fitting.certainty import Certainty
from gonio.fitting.parameters import Free
from gonio.fitting.profiles import profiles
from gonio.materials.combined.sum import Sum
from test_fitting import table


def gloss(eta: tuple[float, float, float]) -> go.BSDF:
    return Sum(go.Lambert((0.4, 0.2, 0.1)), go.Conductor(eta=eta, k=0.0, alpha=0.2, ndf="ggx", fresnel="schlick"))


@pytest.mark.slow
@pytest.mark.parametrize("eta", [1.0, 1.02])
def test_an_index_of_1_is_bounded_from_above(eta):
    """At 1 the reflectance ((eta - 1) / (eta + 1))^2 has no slope, so J^T J tells nothing about the index."""
    held = 0
    for seed in range(3):
        found = go.fit(table(gloss((eta, 1.5, 1.6)), noise=0.05, seed=seed), "lambert+ggx")
        at = found.names.index("b.eta.r")
        low, high = found.interval[at]
        held += low <= eta <= high
        assert 1.0 <= low <= found.values[at] <= high < 1.05  # R0 < 6e-4 where the data have a noise of 5 %
        assert found.determined.all()
        assert not [note for note in found.notes if "strongly correlated" in note or "determine" in note]
        assert found.as_dict()["parameters"]["b.eta.r"]["interval"] == pytest.approx([low, high])
    assert held >= 2


class Wall:
    """One residual: the sum of squares is (exp(x) - 1)^2, with a wall of slope 10 at x > 1 if there is one."""

    def __init__(self, high: float) -> None:
        self.free = [Free("x", "float", -50.0, high, False)]
        self.count = 1

    def cost(self, numbers: np.ndarray) -> float:
        return float(np.exp(numbers[0]) - 1.0) ** 2

    def linearized(self, numbers: np.ndarray):
        e = np.exp(numbers)
        return [(e - 1.0, e[:, None], [0])]


@pytest.mark.parametrize("high", [50.0, 0.5])
def test_ends_where_the_rise_is_that_of_the_quantile(high):
    """exp(x) - 1 = +-0.9 at log 0.1 and log 1.9: far from even, and the parabola would say +-0.9."""
    sure = Certainty(np.array([[0.81]]), [], np.array([[0.81]]))
    ((low, up),) = profiles(Wall(high), np.zeros(1), 0.0, sure, np.array([0.9]), 1.0, False)  # type: ignore[arg-type]
    assert low == pytest.approx(np.log(0.1), rel=0.02)
    assert up == pytest.approx(min(np.log(1.9), high), rel=0.02)


def test_undetermined_numbers_are_not_called_tied():
    """The pseudoinverse holds rounding where the data tell nothing; correlations made of it exceeded 1."""
    inverse = np.array([[1.0, 0.0, 2e-9], [0.0, 1.0, 1e-9], [2e-9, 1e-9, 1e-18]])
    covariance = np.diag([1.0, 1.0, np.inf])
    assert np.array_equal(Certainty(covariance, [[2]], inverse).coupling, np.eye(3))


def test_the_text_of_a_fit_states_intervals():
    found = fit.fit(table(go.Lambert((0.4, 0.2, 0.1)), noise=0.02, seed=1), "lambert")
    low, high = found.interval[0]
    assert f"albedo.r = {found.values[0]:.5g}, {low:.5g} to {high:.5g}" in str(found)


def test_an_exact_fit_has_no_profile():
    """Its residuals are rounding, in which the search for a rise of that size would not end."""
    sure = Certainty(np.array([[0.81]]), [], np.array([[0.81]]))
    assert np.isnan(profiles(Wall(50.0), np.zeros(1), 0.0, sure, np.array([0.9]), 1e-8, False)).all()  # type: ignore[arg-type]


def test_of_many_values_only_what_has_no_standard_error_is_profiled():
    for error, expected in ((0.9, np.nan), (np.inf, np.log(1.9))):
        sure = Certainty(np.array([[error**2]]), [], np.array([[0.81]]))
        ends = profiles(Wall(50.0), np.zeros(1), 0.0, sure, np.array([0.9]), 1.0, True)  # type: ignore[arg-type]
        assert ends[0, 1] == pytest.approx(expected, rel=0.02, nan_ok=True)
