"""Picture measures against closed forms, and FLIP against its authors' program.

The stored FLIP values come from `flip-evaluator` (the authors' own, C++), on the pictures made here.
"""

from __future__ import annotations

import numpy as np
import pytest
from gonio.errors import InputError
from gonio.pictures import metrics


@pytest.fixture
def pictures() -> tuple[np.ndarray, np.ndarray]:
    """A smooth reference and a test picture with noise on its right half and a displaced patch."""
    rng = np.random.default_rng(3)
    y, x = np.mgrid[:90, :140]
    reference = np.stack([0.5 + 0.5 * np.sin(x / 9), 0.5 + 0.5 * np.cos(y / 13 + x / 30), (x + y) / 230], -1)
    reference = reference.astype(np.float32)
    noise = rng.normal(0, 0.08, reference.shape) * (x[..., None] > 70)
    test = np.clip(reference + noise, 0, 1).astype(np.float32)
    test[20:40, 20:40] = reference[10:30, 20:40]
    return test, reference


def test_rmse_and_relmse_have_their_closed_forms() -> None:
    reference = np.full((4, 5, 3), 2.0)
    assert metrics.rmse(reference + 0.5, reference) == pytest.approx(0.5)
    assert metrics.relmse(reference + 0.5, reference) == pytest.approx(0.25 / 4.01)
    assert metrics.mean_ratio(reference + 0.5, reference) == pytest.approx(1.25)


def test_mean_ratio_of_a_black_reference_is_not_a_number() -> None:
    black, white = np.zeros((2, 2, 3)), np.ones((2, 2, 3))
    assert np.isnan(metrics.mean_ratio(white, black))
    assert metrics.mean_ratio(black, black) == 1


@pytest.mark.parametrize("hdr", [False, True])
def test_flip_of_a_picture_with_itself_is_zero(pictures: tuple[np.ndarray, np.ndarray], hdr: bool) -> None:
    assert metrics.flip_map(pictures[1], pictures[1], hdr).max() == 0


def test_flip_of_black_and_white_is_the_authors_value() -> None:
    black, white = np.zeros((32, 32, 3)), np.ones((32, 32, 3))
    assert metrics.flip_map(black, white, hdr=False).mean() == pytest.approx(0.967395, abs=2e-5)
    assert metrics.flip_map(white, black, hdr=False).mean() == pytest.approx(0.967395, abs=2e-5)


def test_ldr_flip_is_the_authors_value(pictures: tuple[np.ndarray, np.ndarray]) -> None:
    assert metrics.flip_map(*pictures, hdr=False).mean() == pytest.approx(0.0965594, abs=2e-6)


def test_hdr_flip_and_its_exposures_are_the_authors_values(pictures: tuple[np.ndarray, np.ndarray]) -> None:
    rng = np.random.default_rng(3)
    rng.normal(0, 0.08, pictures[0].shape)  # the stored value was made with the generator in this state
    reference = (pictures[1] ** 3 * 20).astype(np.float32)
    test = (reference * rng.gamma(20, 1 / 20, reference.shape)).astype(np.float32)
    # The authors take the lower of the two middle values as the median, we their mean: the last digits.
    assert metrics.flip_map(test, reference).mean() == pytest.approx(0.1012514, abs=5e-6)
    assert metrics.exposure_range(reference) == pytest.approx((-3.163067, -1.035143), abs=1e-3)


def test_hdr_flip_does_not_depend_on_the_unit_of_radiance(pictures: tuple[np.ndarray, np.ndarray]) -> None:
    small, large = (metrics.flip_map(*(x * scale for x in pictures)).mean() for scale in (1e-3, 1e3))
    assert small == pytest.approx(large, rel=1e-5)


def test_flip_grows_with_noise(pictures: tuple[np.ndarray, np.ndarray]) -> None:
    rng = np.random.default_rng(1)
    reference, noise = pictures[1], rng.normal(size=pictures[1].shape)
    values = [metrics.flip_map(reference + s * noise, reference, hdr=False).mean() for s in (0.01, 0.05, 0.2)]
    assert values[0] < values[1] < values[2]


@pytest.mark.parametrize("median", [0.0, 1.0])
def test_flip_stays_finite_where_most_of_the_reference_is_black(median: float) -> None:
    reference = np.full((16, 16, 3), median)
    reference[0, 0] = 50
    value = metrics.flip_map(reference * 1.1, reference)
    assert np.isfinite(value).all() and value.max() <= 1


def test_pictures_of_different_size_are_refused_with_both_sizes() -> None:
    with pytest.raises(InputError, match="4x3 and 5x3"):
        metrics.compare(np.zeros((3, 4, 3)), np.zeros((3, 5, 3)))


def test_values_that_are_not_finite_are_refused() -> None:
    broken = np.ones((3, 4, 3))
    broken[1, 2, 0] = np.nan
    with pytest.raises(InputError, match="first picture has 1 values"):
        metrics.compare(broken, np.ones((3, 4, 3)))
