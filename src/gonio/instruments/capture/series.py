"""Exposures of one view merged by variance, with the camera's noise found from the exposures themselves.

A camera that is linear stores y_i = L t_i + noise of light L exposed for t_i seconds, with

    Var(y_i) = read + gain L t_i + (relative L t_i)^2 + q_i^2

(the EMVA standard 1288, and a relative part: what grows with the signal, such as a flickering lamp; q_i, which is
known, is what the file's steps add). Of all unbiased means of x_i = y_i / t_i the one with the least variance weighs by
1 / v_i, v_i = Var(y_i) / t_i^2 (Gauss and Markov; Debevec1997 weighs by the value alone), and its variance is
1 / sum(1 / v_i).

v_i depends on L. Taken at the exposure's own value, a value that is low by chance counts more, and the mean is biased
by about -gain / t. Taken at the merged value it is not: at these weights the merged value is uncorrelated with
every difference x_i - x_j (with Gaussian noise, independent of it), so that weights that follow it bias nothing to
first order. So v_i is iterated on the merged value, from weights that go with the seconds, which are those of photons
alone. For the same reason neither saturation nor the clipping at 0 is decided by the value that would be left out: an
exposure counts where the shorter ones say that it stays under saturation by three standard deviations; and where it is
three above 0, or the longest that counts.

The differences of two exposures at pixels of like L have the variance v_i + v_j whatever the picture shows. That is
linear in (read, gain, relative^2), which are fitted to it over bins of L by non-negative least squares, channel by
channel. The mean of x_i / x_j tells by how much stated exposure times are off from each other.
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

SIGMAS = 3.0  # from saturation, and from 0, within which an exposure does not count
UNKNOWN = 0.8  # of saturation, up to which exposures count while their noise is not known
ROUNDS = 4  # merged value and noise follow each other; the fourth changes either by less than a thousandth
BINS = 48  # of light, in which variances are taken
FEWEST = 30  # pixels of a bin
BLACK = 0.003  # share of a bin's pixels at 0, from which on its variance is one of clipped values
ASKED = 10.0  # of chi-square, as the Bayesian criterion has it for a number more to some hundred bins; also 3 sigma
NOISELESS = 1e-9  # of the brightest light
TINY = 1e-120  # a variance of 0, whose inverse can still be squared
CUT = 4.0  # standard deviations beyond which a difference is no noise, but something that moved
WRONG = 0.1  # relative, from which on an exposure time is an error and no tolerance


class Exposed(NamedTuple):
    """One exposure.

    file     its name
    signal   (H, W, 3), linear, nan where it is saturated
    step     (H, W, 3), standard deviation of its quantisation; 0 throughout: floating-point numbers, never clipped
    seconds  as they are stated
    ceiling  signal from which on it is saturated
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
    """Of a camera, (3,) each: variance of reading, variance per signal of photons, relative variance of the rest."""

    read: Floats
    gain: Floats
    relative: Floats

    def variance(self, light: Floats, seconds: float, step: Floats) -> Floats:
        """Of signal / seconds, (H, W, 3), at some light."""
        size = np.maximum(light, 0.0)
        return (self.read + step**2) / seconds**2 + self.gain * size / seconds + self.relative * size**2


@dataclass(frozen=True)
class Merged:
    """Light of a series.

    light     (H, W, 3), signal per second; nan where every exposure is saturated
    spread    (H, W, 3), its standard deviation by reading, photons and quantisation
    photon    (H, W, 3), derivative of that variance along the light
    noise     of the camera; zeros where there is one exposure alone
    times     exposure times as the pixels tell them, over the stated ones, shortest first; their product is 1
    """

    light: Floats
    spread: Floats
    photon: Floats
    noise: Noise
    times: Floats

    @property
    def scale_error(self) -> float:
        """Relative standard error of all light, if exposure times are off by as much as they are from each other."""
        count = len(self.times)
        return float(np.std(np.log(self.times), ddof=1) / np.sqrt(count)) if count > 1 else 0.0


def merge(exposures: Sequence[Exposed]) -> Merged:
    """Exposures of one view merged. Raises InputError where their times contradict their pixels by a tenth."""
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
    # what goes with the signal itself is found again in a fit, beside other faults of that kind
    spread, photon = _spread(ordered, times, light, used, noise._replace(relative=np.zeros(3)))
    return Merged(np.where(used.any(axis=0), light, np.nan), spread, photon, noise, times)


def _start(exposures: Sequence[Exposed]) -> tuple[Floats, NDArray[np.bool_]]:
    """(light, which exposures count (K, H, W, 3)) with weights of photons, from the shortest exposure on."""
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
    """Which exposures stay under saturation, (K, H, W, 3), as the shorter ones tell."""
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
    """Which of these count, (K, H, W, 3): those that stay clear of 0, and the longest."""
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
    """The mean of the least variance, that variance taken at the mean itself."""
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
    if told.any():  # a channel that is dark throughout tells nothing; the sensor is the same
        coefficients[~told] = np.median(coefficients[told], axis=0)
    else:  # without noise, as renders may be: any weights will do, those of photons will
        coefficients[:, 1] = NOISELESS * max(float(light.max(initial=0.0)), 1e-30)
    return Noise(*coefficients.T)


def _least(columns: Floats, variance: Floats, error: Floats) -> Floats:
    """(read, gain, relative^2), not negative, that explain variances (B,) with their relative errors (B,) best. The
    last, which is hard to tell from photons, is 0 unless the variances ask for it by `ASKED` of chi-square."""
    if not variance.any():
        return np.zeros(3)
    scale = np.maximum(columns.max(axis=0), 1e-300)
    floor = 1e-6 * float(variance.max())
    best, misfit = np.zeros(3), np.inf
    for some in ([0, 1], [0, 1, 2]):
        size = np.maximum(variance, floor)
        for _ in range(4):  # the error of a variance goes with it: with the fitted one, for the reason given above
            weight = 1.0 / (np.maximum(size, floor) * error)
            part, _ = nnls((columns / scale)[:, some] * weight[:, None], variance * weight)
            coefficients = np.zeros(3)
            coefficients[some] = part / scale[some]
            size = columns @ coefficients
        # of a variance that differs from the fitted one by more than its size, the logarithm counts
        rest = float(np.sum((np.log(np.maximum(variance, floor) / np.maximum(size, floor)) / error) ** 2))
        if rest < misfit - (ASKED if len(some) > 2 else 0.0):
            best, misfit = coefficients, rest
    return best


def _variances(
    short: Exposed, long: Exposed, factors: Floats, light: Floats, both: NDArray[np.bool_], channel: int
) -> tuple[Floats, Floats, Floats]:
    """(derivatives (B, 3) along read noise, gain and relative variance; variance (B,) of the difference of two
    exposures; relative error of each (B,)), over bins of light; what quantisation does is taken off."""
    fine = both[..., channel] & (light[..., channel] > 0.0) if short.clips else both[..., channel]
    level = light[..., channel][fine]
    if len(level) < FEWEST:
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
    enough = count >= FEWEST
    if short.clips:
        black = (short.signal[..., channel][fine] <= 0.0) | (long.signal[..., channel][fine] <= 0.0)
        enough &= np.bincount(which, black, len(edges) + 1) <= BLACK * count + 1.0
    left = np.maximum(variance - mean(steps), 0.0)
    return columns[enough], left[enough], np.sqrt(2.0 / count[enough])


def _times(exposures: Sequence[Exposed], times: Floats, light: Floats, used: NDArray[np.bool_], noise: Noise) -> Floats:
    """Exposure times over the stated ones, as far as the pixels contradict these; their product is 1."""
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
        if not (both.sum() >= FEWEST and x > 0.0 and y > 0.0 and told > 0.0):
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
        what = (
            f"{exposures[worst].seconds:g} s are stated, its pixels and those of the others tell {told_seconds:.3g} s"
        )
        hint = 'correct "seconds" in the calibration file, or leave this exposure out; is the response right?'
        raise InputError(what, exposures[worst].file, hint)
    return np.ones(len(log_times)) if sure else np.exp(log_times - log_times.mean())
