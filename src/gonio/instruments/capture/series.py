"""Merge exposures of one view by variance, with the camera's noise estimated from the exposures themselves.

A linear camera stores y_i = L t_i + noise of light L exposed for t_i seconds, with

    Var(y_i) = read + gain L t_i + (relative L t_i)^2 + q_i^2

(EMVA standard 1288, plus a relative part proportional to the signal, such as a flickering lamp; q_i is the known
quantization error of the file). The unbiased mean of x_i = y_i / t_i with the least variance has the weights
1 / v_i, v_i = Var(y_i) / t_i^2 (Gauss and Markov; Debevec1997 weighs by the value alone), and its variance is
1 / sum(1 / v_i).

v_i depends on L. Evaluated at the exposure's own value, it gives more weight to values that are low by chance, which
biases the mean by about -gain / t. Evaluated at the merged value it does not: with these weights the merged value is
uncorrelated with every difference x_i - x_j (independent of it for Gaussian noise), so weights that depend on it are
unbiased to first order. So v_i is iterated on the merged value, starting with weights proportional to the seconds,
which are those of photon noise. For the same reason, the tests for saturation and clipping at 0 do not use the tested
value: an exposure counts if the shorter ones predict that it is three standard deviations below saturation, and if it
is three above 0 or the longest that counts.

The difference of two exposures at pixels of similar L has the variance v_i + v_j, independent of the picture. It is
linear in (read, gain, relative^2), which are fitted over bins of L by non-negative least squares, per channel. The
mean of x_i / x_j measures the relative error of stated exposure times.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from ...errors import InputError
from .calibration import Floats

SIGMAS = 3.0  # standard deviations from saturation or 0 within which an exposure is ignored
UNKNOWN = 0.8  # of saturation, up to which exposures count before their noise is known
ROUNDS = 4  # iterations of merged value and noise; the fourth changes either by less than a thousandth
BINS = 48  # bins of light for estimating variances
MIN_PIXELS = 30  # per bin
BLACK = 0.003  # share of a bin's pixels at 0 from which clipping affects its variance
MIN_GAIN = 10.0  # gain in chi-square for an additional parameter: the BIC for some hundred bins; also 3 sigma
NOISELESS = 1e-9  # of the brightest light
TINY = 1e-120  # a variance of 0, whose inverse can still be squared
CUT = 4.0  # standard deviations beyond which a difference indicates motion rather than noise
WRONG = 0.1  # relative error of an exposure time from which it is rejected


class Exposed(NamedTuple):
    """One exposure.

    file     name of the file
    signal   (H, W, 3), linear; nan where saturated
    step     (H, W, 3), standard deviation of its quantization; 0 everywhere for floating-point files, never clipped
    seconds  stated exposure time
    ceiling  signal at saturation
    """

    file: str
    signal: Floats
    step: Floats
    seconds: float
    ceiling: float

    @property
    def clips(self) -> bool:
        return bool(self.step.any())


class Noise(NamedTuple):
    """Noise of a camera, (3,) each: read variance, photon variance per signal, relative variance of the rest."""

    read: Floats
    gain: Floats
    relative: Floats

    def variance(self, light: Floats, seconds: float, step: Floats) -> Floats:
        """Variance of signal / seconds, (H, W, 3), at a given light."""
        size = np.maximum(light, 0.0)
        return (self.read + step**2) / seconds**2 + self.gain * size / seconds + self.relative * size**2


@dataclass(frozen=True)
class Merged:
    """Merged light of a series.

    light     (H, W, 3), signal per second; nan where every exposure is saturated
    spread    (H, W, 3), standard deviation from read noise, photons and quantization
    photon    (H, W, 3), derivative of that variance with respect to the light
    noise     of the camera; zeros for a single exposure
    times     estimated over stated exposure times, shortest first; their product is 1
    """

    light: Floats
    spread: Floats
    photon: Floats
    noise: Noise
    times: Floats

    @property
    def scale_error(self) -> float:
        """Relative standard error of all light, estimated from the scatter of the exposure times."""
        count = len(self.times)
        return float(np.std(np.log(self.times), ddof=1) / np.sqrt(count)) if count > 1 else 0.0


def merge(exposures: Sequence[Exposed]) -> Merged:
    """Merge exposures of one view. Raises InputError if stated times contradict the pixels by more than a tenth."""
    ordered = sorted(exposures, key=lambda one: one.seconds)
    times = np.ones(len(ordered))
    noise = Noise(np.zeros(3), np.zeros(3), np.zeros(3))
    light, below = _start(ordered)
    used = below
    if len(ordered) > 1:
        for _ in range(ROUNDS):
            noise = _noise(ordered, times, light, below)
            below = _below(ordered, times, light, noise)
            used = _above(ordered, times, light, below, noise)
            light = _mean(ordered, times, light, used, noise)
            times = _times(ordered, times, light, used, noise)
    # a fit estimates the relative noise again, together with other errors proportional to the signal
    spread, photon = _spread(ordered, times, light, used, noise._replace(relative=np.zeros(3)))
    return Merged(np.where(used.any(axis=0), light, np.nan), spread, photon, noise, times)


def _start(exposures: Sequence[Exposed]) -> tuple[Floats, NDArray[np.bool_]]:
    """(light, which exposures count (K, H, W, 3)) with photon-noise weights, from the shortest exposure."""
    total, seconds = np.zeros_like(exposures[0].signal), np.zeros_like(exposures[0].signal)
    used = []
    for one in exposures:
        fine = ~np.isnan(one.signal)
        if one.clips:
            with np.errstate(invalid="ignore", divide="ignore"):
                fine &= (seconds == 0.0) | (total / seconds * one.seconds < UNKNOWN * one.ceiling)
        total += np.where(fine, one.signal, 0.0)
        seconds += np.where(fine, one.seconds, 0.0)
        used.append(fine)
    return total / np.maximum(seconds, 1e-300), np.array(used)


def _below(exposures: Sequence[Exposed], times: Floats, light: Floats, noise: Noise) -> NDArray[np.bool_]:
    """Mask of exposures below saturation, (K, H, W, 3), as predicted by the shorter ones."""
    total, weights = np.zeros_like(light), np.zeros_like(light)
    used = []
    for one, factor in zip(exposures, times, strict=True):
        seconds = one.seconds * factor
        fine = ~np.isnan(one.signal)
        variance = np.maximum(noise.variance(light, seconds, one.step), TINY)
        if one.clips:
            with np.errstate(invalid="ignore", divide="ignore"):
                spread = np.sqrt(variance + 1.0 / weights)
                inside = (total / weights + SIGMAS * spread) * seconds < one.ceiling
            fine &= (weights == 0.0) | inside
        total += np.where(fine, np.nan_to_num(one.signal) / seconds / variance, 0.0)
        weights += np.where(fine, 1.0 / variance, 0.0)
        used.append(fine)
    return np.array(used)


def _above(
    exposures: Sequence[Exposed], times: Floats, light: Floats, below: NDArray[np.bool_], noise: Noise
) -> NDArray[np.bool_]:
    """Mask of usable exposures, (K, H, W, 3): those well above 0, and the longest."""
    longer = np.zeros(light.shape, bool)
    used = []
    for one, factor, fine in reversed(list(zip(exposures, times, below, strict=True))):
        clear = fine
        if one.clips:
            seconds = one.seconds * factor
            clear = fine & (~longer | (light > SIGMAS * np.sqrt(noise.variance(light, seconds, one.step))))
        longer = longer | fine
        used.append(clear)
    return np.array(used[::-1])


def _mean(exposures: Sequence[Exposed], times: Floats, light: Floats, used: NDArray[np.bool_], noise: Noise) -> Floats:
    """The minimum-variance mean, with variances evaluated at the mean itself."""
    for _ in range(3):
        total, weights = np.zeros_like(light), np.zeros_like(light)
        for one, factor, fine in zip(exposures, times, used, strict=True):
            seconds = one.seconds * factor
            weight = np.where(fine, 1.0 / np.maximum(noise.variance(light, seconds, one.step), TINY), 0.0)
            total += weight * np.nan_to_num(one.signal) / seconds
            weights += weight
        light = total / np.maximum(weights, 1e-300)
    return light


def _spread(
    exposures: Sequence[Exposed], times: Floats, light: Floats, used: NDArray[np.bool_], noise: Noise
) -> tuple[Floats, Floats]:
    """(standard deviation of the merged light, derivative of its variance along the light): V = 1 / sum(1 / v_i),
    dV/dL = V^2 sum(v_i' / v_i^2)."""
    inverse, slope = np.zeros_like(light), np.zeros_like(light)
    for one, factor, fine in zip(exposures, times, used, strict=True):
        seconds = one.seconds * factor
        weight = np.where(fine, 1.0 / np.maximum(noise.variance(light, seconds, one.step), TINY), 0.0)
        inverse += weight
        slope += noise.gain / seconds * weight**2
    known = (inverse > 0.0) & (inverse < 1.0 / TINY)
    variance = np.where(known, 1.0 / np.where(known, inverse, 1.0), 0.0)
    return np.sqrt(variance), np.where(known, variance**2 * np.where(known, slope, 0.0), 0.0)


def _noise(exposures: Sequence[Exposed], times: Floats, light: Floats, used: NDArray[np.bool_]) -> Noise:
    """Read noise, gain and relative noise from the differences of neighboring exposures."""
    coefficients = np.zeros((3, 3))
    for channel in range(3):
        bins = [
            _variances(exposures[k], exposures[k + 1], times[k : k + 2], light, used[k] & used[k + 1], channel)
            for k in range(len(exposures) - 1)
        ]
        coefficients[channel] = _least(*(np.concatenate(parts) for parts in zip(*bins, strict=True)))
    told = coefficients.any(axis=1)
    if told.any():  # dark channels get the median noise of the others: the sensor is the same
        coefficients[~told] = np.median(coefficients[told], axis=0)
    else:  # noise-free, such as renders: any weights are valid, photon-noise weights are used
        coefficients[:, 1] = NOISELESS * max(float(light.max(initial=0.0)), 1e-30)
    return Noise(*coefficients.T)


def _least(columns: Floats, variance: Floats, error: Floats) -> Floats:
    """(read, gain, relative^2), not negative, that fit variances (B,) with relative errors (B,) best. The last is
    hard to separate from photon noise, so it is 0 unless it reduces chi-square by `MIN_GAIN`."""
    if not variance.any():
        return np.zeros(3)
    scale = np.maximum(columns.max(axis=0), 1e-300)
    floor = 1e-6 * float(variance.max())
    best, misfit = np.zeros(3), np.inf
    for some in ([0, 1], [0, 1, 2]):
        size = np.maximum(variance, floor)
        for _ in range(4):  # the error of a variance is proportional to the fitted variance, for the reason given above
            weight = 1.0 / (np.maximum(size, floor) * error)
            part, _ = nnls((columns / scale)[:, some] * weight[:, None], variance * weight)
            coefficients = np.zeros(3)
            coefficients[some] = part / scale[some]
            size = columns @ coefficients
        # logarithms bound the residual of variances far from the fitted ones
        rest = float(np.sum((np.log(np.maximum(variance, floor) / np.maximum(size, floor)) / error) ** 2))
        if rest < misfit - (MIN_GAIN if len(some) > 2 else 0.0):
            best, misfit = coefficients, rest
    return best


def _variances(
    short: Exposed, long: Exposed, factors: Floats, light: Floats, both: NDArray[np.bool_], channel: int
) -> tuple[Floats, Floats, Floats]:
    """(derivatives (B, 3) along read noise, gain and relative variance; variance (B,) of the difference of two
    exposures; relative error of each (B,)), over bins of light, without quantization noise."""
    fine = both[..., channel] & (light[..., channel] > 0.0) if short.clips else both[..., channel]
    level = light[..., channel][fine]
    if len(level) < MIN_PIXELS:
        return np.zeros((0, 3)), np.zeros(0), np.zeros(0)
    a, b = short.seconds * factors[0], long.seconds * factors[1]
    difference = short.signal[..., channel][fine] / a - long.signal[..., channel][fine] / b
    steps = (short.step[..., channel][fine] / a) ** 2 + (long.step[..., channel][fine] / b) ** 2
    edges = np.unique(np.quantile(level, np.linspace(0.0, 1.0, BINS + 1)[1:-1]))
    which = np.searchsorted(edges, level)
    inliers = np.ones(len(level), bool)
    for _ in range(4):
        count = np.bincount(which, inliers, len(edges) + 1)
        variance = np.bincount(which, inliers * difference**2, len(edges) + 1) / np.maximum(count, 1)
        inliers = difference**2 <= CUT**2 * variance[which]

    def mean(x: Floats) -> Floats:
        return np.asarray(np.bincount(which, inliers * x, len(edges) + 1) / np.maximum(count, 1))

    size = np.maximum(level, 0.0)
    ones = np.full(len(count), 1.0 / a**2 + 1.0 / b**2)
    columns = np.stack([ones, mean(size) * (1.0 / a + 1.0 / b), 2.0 * mean(size**2)], -1)
    enough = count >= MIN_PIXELS
    if short.clips:
        black = (short.signal[..., channel][fine] <= 0.0) | (long.signal[..., channel][fine] <= 0.0)
        enough &= np.bincount(which, black, len(edges) + 1) <= BLACK * count + 1.0
    left = np.maximum(variance - mean(steps), 0.0)
    return columns[enough], left[enough], np.sqrt(2.0 / count[enough])


def _times(exposures: Sequence[Exposed], times: Floats, light: Floats, used: NDArray[np.bool_], noise: Noise) -> Floats:
    """Estimated over stated exposure times; 1 unless the pixels contradict them; their product is 1."""
    logs, sure, unsure = [0.0], True, 0.0
    for k in range(len(exposures) - 1):
        a, b = exposures[k], exposures[k + 1]
        seconds = a.seconds * times[k], b.seconds * times[k + 1]
        variances = [noise.variance(light, s, one.step) for s, one in zip(seconds, (a, b), strict=True)]
        both = used[k] & used[k + 1]
        for one, v in zip((a, b), variances, strict=True):
            both &= (light > SIGMAS * np.sqrt(v)) if one.clips else (light > 0.0)
        weight = np.where(both, light / np.maximum(variances[0] + variances[1], 1e-300), 0.0)
        x, y = (float(np.sum(weight * np.nan_to_num(one.signal)) / s) for s, one in zip(seconds, (a, b), strict=True))
        told = float(np.sum(weight * light))
        if not (both.sum() >= MIN_PIXELS and x > 0.0 and y > 0.0 and told > 0.0):
            return times
        step = np.log(y / x) + np.log(times[k + 1] / times[k])
        sure = sure and abs(step) < SIGMAS / np.sqrt(told)
        unsure += 1.0 / told
        logs.append(logs[-1] + step)
    log_times = np.array(logs)
    if np.ptp(log_times) > np.log1p(WRONG) + SIGMAS * np.sqrt(unsure):
        worst = int(np.argmax(np.abs(log_times - np.median(log_times))))
        told_seconds = exposures[worst].seconds * float(
            np.exp(log_times[worst] - np.median(np.delete(log_times, worst)))
        )
        what = f"{exposures[worst].seconds:g} s are stated, but the pixels of the series indicate {told_seconds:.3g} s"
        hint = 'correct "seconds" in the calibration file, or omit this exposure; also check the response'
        raise InputError(what, exposures[worst].file, hint)
    return np.ones(len(log_times)) if sure else np.exp(log_times - log_times.mean())
