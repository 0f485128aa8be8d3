"""Exposures merged by variance, and the camera's noise that they tell."""

from __future__ import annotations

import dataclasses

import gonio as go
import numpy as np
import pytest
from gonio.errors import InputError
from gonio.instruments.capture import rehearsal, series
from gonio.instruments.capture.pixels import Pixels
from gonio.instruments.capture.series import Exposed, Noise
from scipy import special
from test_capture import PAINT, TRUTH, rig

CAMERA = Noise(np.full(3, 1.5e-3**2), np.full(3, 1.0 / 8000.0), np.zeros(3))
LIGHT = np.geomspace(0.01, 8.0, 96 * 96).reshape(96, 96, 1).repeat(3, axis=2)
TIMES = (0.02, 0.08, 0.32)


def exposed(
    seconds: float, camera: Noise = CAMERA, seed: int = 1, stated: float | None = None, bits: int = 16
) -> Exposed:
    """An exposure of LIGHT, in whole numbers."""
    highest = 2**bits - 1
    values = rehearsal._noisy(LIGHT * seconds, camera, np.random.default_rng([seed, int(1000 * seconds)]))
    signal = np.round(np.clip(values, 0.0, 1.0) * highest) / highest
    step = np.full(LIGHT.shape, 1.0 / highest / np.sqrt(12.0))
    return Exposed(f"{seconds}.png", np.where(signal < 0.99, signal, np.nan), step, stated or seconds, 0.99)


def test_a_merged_series_is_neither_biased_nor_surer_than_it_is() -> None:
    merged = series.merge([exposed(seconds) for seconds in TIMES])
    for part in np.array_split(np.arange(LIGHT.size), 8):  # from the darkest to the brightest, which saturates
        deviation = ((merged.light - LIGHT) / merged.spread).ravel()[part]
        assert abs(deviation.mean()) < 4.0 / np.sqrt(len(part))
        assert np.mean(deviation**2) == pytest.approx(1.0, abs=0.15)


def test_a_sensor_of_few_electrons_biases_neither_light_nor_exposure_times() -> None:
    """A long exposure must not be left out where the short ones are high by chance."""
    small = Noise(np.full(3, 4e-3**2), np.full(3, 1.0 / 1000.0), np.zeros(3))
    merged = series.merge([exposed(seconds, small) for seconds in TIMES])
    assert all(abs(ratio.log) < 3.0 * np.sqrt(ratio.variance) for ratio in merged.ratios)
    np.testing.assert_array_equal(merged.times, 1.0)
    off, variance = (merged.light - LIGHT).ravel(), (merged.spread**2).ravel()
    for part in np.array_split(np.arange(LIGHT.size), 12)[2:]:  # darker ones are cut off at 0
        assert abs(off[part].sum()) < 4.0 * np.sqrt(variance[part].sum())


def test_gain_and_read_noise_are_found_from_the_series() -> None:
    noise = series.merge([exposed(seconds) for seconds in TIMES]).noise
    np.testing.assert_allclose(noise.gain, CAMERA.gain, rtol=0.15)
    np.testing.assert_allclose(np.sqrt(noise.read), np.sqrt(CAMERA.read), rtol=0.05)
    np.testing.assert_array_equal(noise.relative, 0.0)


def test_noise_that_goes_with_the_signal_is_told_from_photons() -> None:
    flicker = CAMERA._replace(relative=np.full(3, 0.02**2))
    noise = series.merge([exposed(seconds, flicker) for seconds in TIMES]).noise
    np.testing.assert_allclose(np.sqrt(noise.relative), 0.02, rtol=0.15)


def test_exposure_times_that_are_slightly_off_are_found() -> None:
    merged = series.merge([exposed(0.02), exposed(0.08, stated=0.0816), exposed(0.32)])
    np.testing.assert_allclose(merged.times / merged.times[0], [1.0, 1.0 / 1.02, 1.0], rtol=2e-3)
    assert merged.scale_error == pytest.approx(0.02 / 3.0 * 4.303 / 1.96, rel=0.2)  # of three settings
    assert series.merge([exposed(seconds) for seconds in TIMES]).scale_error == 0.0


def test_an_exposure_time_that_is_wrong_by_30_percent_is_an_error() -> None:
    with pytest.raises(InputError, match=r"0.104 s are stated, but the pixels of the series indicate 0.08"):
        series.merge([exposed(0.02), exposed(0.08, stated=0.104), exposed(0.32)])


@pytest.mark.parametrize("bits", [8, 16])
def test_a_series_without_noise_is_merged_within_its_steps(bits: int) -> None:
    exact = Noise(np.zeros(3), np.zeros(3), np.zeros(3))
    merged = series.merge([exposed(seconds, exact, bits=bits) for seconds in TIMES])
    assert np.nanmax(np.abs(merged.light - LIGHT) * np.minimum(0.32, 0.9 / LIGHT)) < 2.5 / 2**bits


def test_what_is_cut_off_at_0_has_the_mean_of_what_is_left() -> None:
    light = np.linspace(0.0, 0.1, 401)[:, None].repeat(3, axis=1)
    blank, lamp = np.zeros(light.shape), np.zeros(len(light), int)
    read, gain = 4e-3, 1e-3
    part = Pixels("ball", blank[:, :2], lamp, lamp, blank, blank + read, blank + gain, np.ones(len(light), bool))
    spread = np.sqrt(read**2 + gain * light)
    noise = special.ndtri((np.arange(4000) + 0.5) / 4000)[:, None, None]
    mean, slope = part.expected(light)
    np.testing.assert_allclose(mean, np.maximum(light + spread * noise, 0.0).mean(0), atol=3e-4 * spread.max())
    np.testing.assert_allclose(np.gradient(mean[:, 0], light[:, 0])[1:-1], slope[1:-1, 0], atol=1e-3)
    whole = dataclasses.replace(part, cut=np.zeros(len(light), bool)).expected(light)
    np.testing.assert_array_equal(whole, (light, np.ones(light.shape)))


@pytest.mark.slow
def test_intervals_of_a_capture_from_series_hold_the_truth(tmp_path) -> None:
    raw = rig(suffix="png")
    for shot in raw["photographs"]:
        name, _ = shot.pop("file").split("."), shot.pop("seconds")
        shot["exposures"] = [{"file": f"{name[0]}-{seconds}.png", "seconds": seconds} for seconds in TIMES]
    found = go.capture(rehearsal.take(raw, PAINT, tmp_path / "p", noise=CAMERA, bits=16), "lambert+ggx")
    np.testing.assert_allclose(found.fit.values[:3], TRUTH[:3], rtol=0.01)
    assert np.all(np.abs(found.fit.values - TRUTH) < 3.0 * found.fit.errors)
    assert found.warnings == ()
