"""E by sampling: unbiased, with the error that its variance predicts, and the homework's bars."""

from __future__ import annotations

import gonio as go
import numpy as np
import pytest
from gonio.energy.albedo import monte_carlo, quadrature
from gonio.energy.albedo.monte_carlo import Sampling

CENTRES = (np.arange(64) + 0.5) / 64
MU, ROUGHNESS = np.meshgrid(CENTRES, CENTRES[CENTRES >= 0.1])


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("masking", "bar"),
    [("schlick-direct", 0.005), ("schlick-ibl", 0.005), ("smith-separable", 0.006), ("smith-correlated", 0.006)],
)
def test_hammersley_points_at_1024_samples_meet_the_homeworks_bar(masking, bar):
    exact = quadrature.moments("ggx", masking, MU, ROUGHNESS**2).white
    found = monte_carlo.estimate("ggx", masking, quadrature.Points(MU, ROUGHNESS**2), Sampling("ggx"))
    assert np.sqrt(np.mean((found.value - exact) ** 2)) <= bar


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("ndf", "method"), [("ggx", "ggx"), ("ggx", "visible"), ("beckmann", "beckmann"), ("beckmann", "visible")]
)
def test_independent_points_err_as_their_variance_predicts(ndf, method):
    exact = quadrature.moments(ndf, "smith-correlated", MU, ROUGHNESS**2).white
    found = monte_carlo.estimate(
        ndf, "smith-correlated", quadrature.Points(MU, ROUGHNESS**2), Sampling(method, 1024, "independent", seed=7)
    )
    ratio = np.sqrt(np.mean((found.value - exact) ** 2) / np.mean(found.standard_error**2))
    assert 1 / 1.2 < ratio < 1.2


def test_cosine_sampling_is_unbiased_where_the_lobe_is_broad():
    exact = quadrature.moments("ggx", "smith-correlated", 0.6, 0.8).white
    sampling = Sampling("cosine", 1 << 16, "independent")
    found = monte_carlo.estimate("ggx", "smith-correlated", quadrature.Points(0.6, 0.8), sampling, "float64")
    assert abs(found.value - exact) < 5 * found.standard_error


def test_hammersley_points_are_the_known_ones():
    np.testing.assert_allclose(
        monte_carlo.hammersley(4), [[0.125, 0.125], [0.375, 0.625], [0.625, 0.375], [0.875, 0.875]]
    )


def test_unknown_names_and_no_samples_are_refused():
    for change, text in (
        (("gxg", 8, "hammersley"), "unknown method"),
        (("ggx", 0, "hammersley"), "samples"),
        (("ggx", 8, "sobol"), "points"),
    ):
        with pytest.raises(go.InputError, match=text):
            monte_carlo.estimate("ggx", "smith-correlated", quadrature.Points(0.5, 0.5), Sampling(*change))
    with pytest.raises(go.InputError, match="unknown masking"):
        monte_carlo.estimate("ggx", "smith", quadrature.Points(0.5, 0.5), Sampling("ggx"))
