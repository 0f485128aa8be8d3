"""How bright a picture is shown: stops by hand, stops by the picture, and what they clip."""

from __future__ import annotations

import numpy as np
import pytest
from gonio.errors import InputError
from gonio.pictures import exposures


def picture(*shares: tuple[float, float]) -> exposures.RGB:
    """Grey of these values, each over that share of 10,000 pixels."""
    values = np.concatenate([np.full(round(10_000 * share), value) for value, share in shares])
    return np.repeat(values.reshape(100, 100, 1), 3, axis=2).astype(np.float32)


def test_highlights_of_one_percent_may_clip() -> None:
    assert exposures.stops("auto", picture((0.5, 0.992), (40.0, 0.008))) == 1.0
    assert exposures.stops("auto", picture((0.5, 0.98), (2.0, 0.02))) == -1.0


def test_black_pixels_do_not_count() -> None:
    lit = exposures.stops("auto", picture((4.0, 1.0)))
    assert exposures.stops("auto", picture((0.0, 0.999), (4.0, 0.001))) == lit == -2.0
    assert exposures.stops("auto", picture((0.0, 1.0))) == 0.0


def test_a_lamp_does_not_darken_all_else() -> None:
    stops = exposures.stops("auto", picture((0.18, 0.9), (1000.0, 0.1)))
    assert stops > -4  # by the lamp alone it would be -10
    told = exposures.clipping(stops, picture((0.18, 0.9), (1000.0, 0.1)), automatic=True)
    assert told == "10% of the pixels are brighter than white and clipped; try --exposure -10"


def test_several_pictures_are_shown_alike() -> None:
    dark, bright = picture((0.1, 1.0)), picture((1.0, 1.0))
    assert exposures.stops("auto", dark, bright) == exposures.stops("auto", bright) == 0.0


def test_values_that_are_no_numbers_are_left_out() -> None:
    bad = picture((0.5, 1.0))
    bad[:50] = np.nan, np.inf, -np.inf
    assert exposures.stops("auto", bad) == 1.0
    assert exposures.clipping(0.0, bad) == "" == exposures.clipping(0.0, np.full_like(bad, np.nan))


def test_the_noise_of_a_white_furnace_clips_nothing() -> None:
    noisy = 1 + 0.03 * np.random.default_rng(1).standard_normal((64, 64, 3)).astype(np.float32)
    assert exposures.clipping(0.0, noisy) == ""


@pytest.mark.parametrize("given", ["", "Auto", "1,5", "101", "inf"])
def test_what_is_no_exposure_is_an_error(given: str) -> None:
    with pytest.raises(InputError, match="exposure"):
        exposures.parse(given)


def test_an_exposure_is_stops_or_auto() -> None:
    assert exposures.parse("-1.5") == -1.5 and exposures.parse("auto") == "auto"
    assert exposures.stops(2.0, picture((9.0, 1.0))) == 2.0
