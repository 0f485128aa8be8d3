"""Errors of exposure times, estimated from ratios."""

from __future__ import annotations

import numpy as np
import pytest
from gonio.instruments.capture.shutter import Ratio, estimated

SECONDS = (0.02, 0.08, 0.32)


def ratios(errors: np.ndarray, noise: float, rng: np.random.Generator) -> list[Ratio]:
    return [
        Ratio(SECONDS[k], SECONDS[k + 1], errors[k + 1] - errors[k] + noise * rng.normal(), noise**2, "")
        for k in range(2)
    ]


@pytest.mark.sample(1)
@pytest.mark.parametrize("noise", [1e-4, 0.005, 0.1], ids=["sharp", "as large as the errors", "useless"])
@pytest.mark.parametrize("shares", [(0.0, 0.0, 1.0), (0.2, 0.3, 0.5)])
def test_the_error_of_all_light_is_as_large_as_stated(noise: float, shares: tuple[float, ...]) -> None:
    rng = np.random.default_rng(3)
    deviations = []
    for _ in range(2000):
        errors = 0.005 * rng.normal(size=3)
        found = estimated(ratios(errors, noise, rng), SECONDS, 0.005)
        left = errors - np.array([found.errors[one] for one in SECONDS])
        deviations.append(np.array(shares) @ left / found.scale_error(dict(zip(SECONDS, shares, strict=True))))
    assert np.std(deviations) == pytest.approx(1.0, abs=0.05)


@pytest.mark.slow
def test_without_a_stated_error_three_settings_determine_it_to_a_half() -> None:
    """Student's t: the scatter of three settings says what their mean is off by, in 95 %."""
    rng = np.random.default_rng(4)
    held = []
    for _ in range(2000):
        errors = 0.005 * rng.normal(size=3)
        found = estimated(ratios(errors, 1e-5, rng), SECONDS, 0.0)
        left = np.mean(errors) - np.mean(list(found.errors.values()))
        held.append(abs(left) < 1.96 * found.scale_error(dict.fromkeys(SECONDS, 1.0 / 3.0)))
    assert np.mean(held) == pytest.approx(0.95, abs=0.015)


def test_times_that_agree_with_the_pixels_are_exact() -> None:
    found = estimated(ratios(np.zeros(3), 0.001, np.random.default_rng(5)), SECONDS, 0.0)
    assert not any(found.errors.values()) and not found.covariance.any()
