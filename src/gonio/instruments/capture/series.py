"""Merge exposures of one view by variance, with the camera's noise estimated from the exposures themselves.

A linear camera stores y_i = L t_i + noise of light L exposed for t_i seconds, with

    Var(y_i) = read + gain L t_i + (relative L t_i)^2 + q_i^2

(EMVA standard 1288, plus a relative part proportional to the signal, such as a flickering lamp; q_i is the known
quantization error of the file). The unbiased mean of x_i = y_i / t_i with the smallest variance has the weights
1 / v_i, v_i = Var(y_i) / t_i^2 (Gauss and Markov; Debevec1997 weights by the value alone), and its variance is
1 / sum(1 / v_i).

v_i depends on L. Evaluated at the exposure's own value, it gives more weight to values that are low by chance, which
biases the mean by about -gain / t. Evaluated at the merged value, it does not: with these weights, the merged value is
uncorrelated with every difference x_i - x_j (independent of it for Gaussian noise), so weights that depend on it are
unbiased to first order. So v_i is iterated on the merged value, starting with weights proportional to the seconds, the
best ones for pure photon noise. For the same reason, the tests for saturation and clipping at 0 use merged values: an
exposure counts if its mean with the shorter ones is three standard deviations below saturation, and if it is three
above 0 or the longest that counts. A test of the shorter ones alone would include the long exposure where they are low
by chance, and exclude it where they are high: an error of 0.5 % of the light for a sensor of 1,000 electrons, and of
its exposure times.

The difference of two exposures at pixels of similar L has the variance v_i + v_j, independent of the picture. It is
linear in (read, gain, relative^2), which are fitted over bins of L by non-negative least squares, per channel. The
mean of x_i / x_j measures the ratio of exposure times (`shutter.py`).
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from .calibration import Floats
from .shutter import Ratio, Shutter, estimated

SIGMAS = 3.0  # standard deviations from saturation or 0 within which an exposure is ignored
UNKNOWN = 0.8  # fraction of saturation up to which exposures count before their noise is known
ROUNDS = 4  # iterations of merged value and noise; the fourth changes either by less than a thousandth
BINS = 48  # bins of light for estimating variances
MIN_PIXELS = 30  # minimum number of pixels per bin
NEIGHBORS = 2  # exposures further apart have hardly any usable pixels in common
BLACK = 0.003  # fraction of a bin's pixels at 0 above which clipping affects its variance
MIN_GAIN = 10.0  # gain in chi-square for an additional parameter: the BIC for some hundred bins; also 3 sigma
NOISELESS = 1e-9  # relative to the brightest light
TINY = 1e-120  # stands for a variance of 0; its inverse can still be squared
CUT = 4.0  # standard deviations above which a difference indicates motion rather than noise


class Exposed(NamedTuple):
    """One exposure.

    file     name of the file
    signal   (H, W, 3), linear; nan where saturated
    step     (H, W, 3), standard deviation of its quantization; 0 for floating-point files, which are never clipped
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
    """Noise of a camera, (3,) each: variance of the read noise, photon variance per signal, and variance of the noise
    proportional to the signal, relative to its square.

    known  whether there were pixels to estimate it from
    """

    read: Floats
    gain: Floats
    relative: Floats
    known: bool = True

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
    noise     noise of the camera; zeros for a single exposure
    times     estimated divided by stated exposure times, shortest first
    ratios    measured ratios of exposure times
    shares    fraction of all light from each exposure, by stated seconds
    shutter   the errors of exposure times that were corrected
    """

    light: Floats
    spread: Floats
    photon: Floats
    noise: Noise
    times: Floats
    ratios: Sequence[Ratio]
    shares: Mapping[float, float]
    shutter: Shutter

    @property
    def scale_error(self) -> float:
        """Relative standard error of all light, from the errors of the exposure times."""
        return self.shutter.scale_error(self.shares)


def merge(exposures: Sequence[Exposed], off: float = 0.0, shutter: Shutter | None = None) -> Merged:
    """Merge exposures of one view. Raises InputError if stated times contradict the pixels by more than a tenth.

    off      standard deviation of relative errors of exposure times; 0 if it is not known
    shutter  the errors themselves, estimated from all series of a camera; None: estimated from this series
    """
    ordered = sorted(exposures, key=lambda one: one.seconds)
    seconds = [one.seconds for one in ordered]
    known = estimated((), seconds, off) if shutter is None else shutter
    times = np.array([known.factor(one) for one in seconds])
    noise = Noise(np.zeros(3), np.zeros(3), np.zeros(3))
    ratios: list[Ratio] = []
    light, below = _start(ordered)
    used, all_light = below, light
    if len(ordered) > 1:
        for _ in range(ROUNDS):
            noise = _noise(ordered, times, all_light, below)
            below = _below(ordered, times, light, noise)
            # a mean of every exposure, which is uncorrelated with every difference
            all_light = _mean(ordered, times, light, below, noise)
            used = _above(ordered, times, light, below, noise)
            light = _mean(ordered, times, light, used, noise)
            if shutter is None:
                ratios = _ratios(ordered, times, light, used, noise)
                known = estimated(ratios, seconds, off)
                times = np.array([known.factor(one) for one in seconds])
    # a fit estimates the relative noise again, together with other errors proportional to the signal
    spread, photon = _spread(ordered, times, light, used, noise._replace(relative=np.zeros(3)))
    shares = _shares(ordered, times, light, used, noise)
    light = np.where(used.any(axis=0), light, np.nan)
    return Merged(light, spread, photon, noise, times, ratios, shares, known)


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
    """Mask of exposures below saturation, (K, H, W, 3), as predicted by the shorter ones and the exposure itself."""
    total, weights = np.zeros_like(light), np.zeros_like(light)
    used = []
    for one, factor in zip(exposures, times, strict=True):
        seconds = one.seconds * factor
        fine = ~np.isnan(one.signal)
        variance = np.maximum(noise.variance(light, seconds, one.step), TINY)
        with_it = total + np.nan_to_num(one.signal) / seconds / variance, weights + 1.0 / variance
        if one.clips:
            predicted = with_it[0] / with_it[1]
            fine &= (weights == 0.0) | ((predicted + SIGMAS * np.sqrt(variance)) * seconds < one.ceiling)
        total, weights = (np.where(fine, new, old) for new, old in zip(with_it, (total, weights), strict=True))
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
            bright = light > SIGMAS * np.sqrt(noise.variance(light, seconds, one.step))
            clear = fine & (~longer | (bright if noise.known else False))
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


def _shares(
    exposures: Sequence[Exposed], times: Floats, light: Floats, used: NDArray[np.bool_], noise: Noise
) -> dict[float, float]:
    """Fraction of the light of all pixels from each exposure, by its stated seconds."""
    weights = []
    for one, factor, fine in zip(exposures, times, used, strict=True):
        variance = np.maximum(noise.variance(light, one.seconds * factor, one.step), TINY)
        weights.append(np.where(fine, 1.0 / variance, 0.0))
    total = np.maximum(np.sum(weights, axis=0), 1e-300)
    bright = np.maximum(light, 0.0)
    shares: dict[float, float] = {}
    for one, weight in zip(exposures, weights, strict=True):
        share = float(np.sum(bright * weight / total)) / max(float(bright.sum()), 1e-300)
        shares[one.seconds] = shares.get(one.seconds, 0.0) + share
    return shares


def _spread(
    exposures: Sequence[Exposed], times: Floats, light: Floats, used: NDArray[np.bool_], noise: Noise
) -> tuple[Floats, Floats]:
    """(standard deviation of the merged light, derivative of its variance with respect to the light):
    V = 1 / sum(1 / v_i), dV/dL = V^2 sum(v_i' / v_i^2)."""
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
    """Read noise, gain and relative noise from the differences of exposures that are at most `NEIGHBORS` apart."""
    coefficients, known = np.zeros((3, 3)), False
    pairs = [(k, j) for k, j in itertools.combinations(range(len(exposures)), 2) if j - k <= NEIGHBORS]
    for channel in range(3):
        bins = [
            _variances(exposures[k], exposures[j], times[[k, j]], light, used[k] & used[j], channel) for k, j in pairs
        ]
        columns, variance, error = (np.concatenate(parts) for parts in zip(*bins, strict=True))
        coefficients[channel] = _least(columns, variance, error)
        known = known or bool(len(variance))
    told = coefficients.any(axis=1)
    if told.any():  # dark channels get the median noise of the others: the sensor is the same
        coefficients[~told] = np.median(coefficients[told], axis=0)
    else:  # noise-free, such as renders: any weights are valid; those of photon noise are used
        coefficients[:, 1] = NOISELESS * max(float(light.max(initial=0.0)), 1e-30)
    read, gain, relative = coefficients.T
    return Noise(read, gain, relative, known)


def _least(columns: Floats, variance: Floats, error: Floats) -> Floats:
    """Non-negative (read, gain, relative^2) that fit variances (B,) with relative errors (B,) best. The last is hard to
    separate from photon noise, so it is 0 unless it reduces chi-square by `MIN_GAIN`."""
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
    """(derivatives (B, 3) with respect to read noise, gain and relative variance; variance (B,) of the difference of
    two exposures; relative error of each (B,)), over bins of light, without quantization noise."""
    fine = both[..., channel] & (light[..., channel] > 0.0) if short.clips else both[..., channel]
    level = light[..., channel][fine]
    if len(level) < MIN_PIXELS:
        return np.zeros((0, 3)), np.zeros(0), np.zeros(0)
    a, b = short.seconds * factors[0], long.seconds * factors[1]
    difference = short.signal[..., channel][fine] / a - long.signal[..., channel][fine] / b
    steps = (short.step[..., channel][fine] / a) ** 2 + (long.step[..., channel][fine] / b) ** 2
    edges = np.unique(np.quantile(level, np.linspace(0.0, 1.0, BINS + 1)[1:-1]))
    which = np.searchsorted(edges, level)

    def clipped(one: Exposed) -> NDArray[np.bool_]:
        black = np.bincount(which, one.signal[..., channel][fine] <= 0.0, len(edges) + 1)
        return np.asarray(black > BLACK * np.bincount(which, minlength=len(edges) + 1) + 1.0)

    # values of the short exposure that are clipped at 0 have negative differences: the others have the same variance
    counts = ~clipped(short)[which] | (difference > 0.0) if short.clips else np.ones(len(level), bool)
    inliers = counts
    for _ in range(4):
        count = np.bincount(which, inliers, len(edges) + 1)
        variance = np.bincount(which, inliers * difference**2, len(edges) + 1) / np.maximum(count, 1)
        inliers = counts & (difference**2 <= CUT**2 * variance[which])

    def mean(x: Floats) -> Floats:
        return np.asarray(np.bincount(which, inliers * x, len(edges) + 1) / np.maximum(count, 1))

    size = np.maximum(level, 0.0)
    ones = np.full(len(count), 1.0 / a**2 + 1.0 / b**2)
    columns = np.stack([ones, mean(size) * (1.0 / a + 1.0 / b), 2.0 * mean(size**2)], -1)
    enough = count >= MIN_PIXELS
    if short.clips:
        enough &= ~clipped(long)
    left = np.maximum(variance - mean(steps), 0.0)
    return columns[enough], left[enough], np.sqrt(2.0 / count[enough])


def _ratios(
    exposures: Sequence[Exposed], times: Floats, light: Floats, used: NDArray[np.bool_], noise: Noise
) -> list[Ratio]:
    """Ratios of the times of neighboring exposures. Pixels are weighted by their light divided by the variance of the
    difference: this gives the smallest variance, and the light is uncorrelated with that difference."""
    ratios: list[Ratio] = []
    if not noise.known:
        return ratios
    for k, (a, b) in enumerate(itertools.pairwise(exposures)):
        seconds = a.seconds * times[k], b.seconds * times[k + 1]
        variances = [noise.variance(light, s, one.step) for s, one in zip(seconds, (a, b), strict=True)]
        both = used[k] & used[k + 1]
        for one, v in zip((a, b), variances, strict=True):
            both &= (light > SIGMAS * np.sqrt(v)) if one.clips else (light > 0.0)
        weight = np.where(both, light / np.maximum(variances[0] + variances[1], 1e-300), 0.0)
        x, y = (float(np.sum(weight * np.nan_to_num(one.signal)) / s) for s, one in zip(seconds, (a, b), strict=True))
        told = float(np.sum(weight * light))
        if a.seconds < b.seconds and both.sum() >= MIN_PIXELS and x > 0.0 and y > 0.0 and told > 0.0:
            log = float(np.log(y / x) + np.log(times[k + 1] / times[k]))
            ratios.append(Ratio(a.seconds, b.seconds, log, 1.0 / told, b.file))
    return ratios
