"""Merge several exposures of one view by inverse-variance weighting, with the noise estimated from the exposures.

For light L and an exposure time of t_i seconds, a linear camera stores y_i = L t_i + noise, with

    Var(y_i) = read + gain L t_i + (relative L t_i)^2 + q_i^2

This is the model of EMVA standard 1288, extended by a noise proportional to the signal, such as that of a flickering
lamp; q_i is the known quantization error of the file. Let x_i = y_i / t_i. The unbiased mean of the x_i with the
smallest variance has the weights 1 / v_i, with v_i = Var(y_i) / t_i^2 (Gauss and Markov; Debevec1997 derives weights
from the value alone), and its variance is 1 / sum(1 / v_i).

v_i depends on L. If it were computed from the value of the exposure itself, values that are low by chance would get
more weight, which would bias the mean by about -gain / t. It is therefore computed from the merged value: this value is
uncorrelated with every difference x_i - x_j (and independent of it for Gaussian noise), so weights that depend on it
are unbiased to first order. v_i and the merged value are computed iteratively, starting with weights proportional to
the exposure times, which are optimal for pure photon noise. For the same reason, the tests for saturation and for
clipping at 0 use merged values. An exposure is used if its mean with the shorter exposures is three standard deviations
below saturation, and if the merged value is three standard deviations above 0 or no longer exposure is usable. A test
of the shorter exposures alone would include the long exposure where they are low by chance and exclude it where they
are high. This would cause an error of 0.5 % of the light, and of the exposure times, for a sensor of 1,000 electrons.

The difference of two exposures at pixels with similar L has the variance v_i + v_j, independent of the content of the
picture. It is linear in (read, gain, relative^2), which are fitted by non-negative least squares over bins of L, per
channel. The mean of x_i / x_j measures the ratio of exposure times (`shutter.py`).
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

SIGMAS = 3.0  # an exposure within this number of standard deviations of saturation or 0 is ignored
UNKNOWN = 0.8  # fraction of saturation up to which exposures are used before their noise is known
ROUNDS = 4  # iterations of the merged value and the noise; the fourth changes both by less than a thousandth
BINS = 48  # number of bins of light for estimating variances
MIN_PIXELS = 30  # minimum number of pixels per bin
NEIGHBORS = 2  # maximum distance of compared exposures in the series; others share hardly any usable pixels
BLACK = 0.003  # fraction of pixels at 0 in a bin above which clipping affects its variance
MIN_GAIN = 10.0  # reduction of chi-square that an additional parameter requires: 3 sigma, and the BIC for some 100 bins
NOISELESS = 1e-9  # relative to the brightest light
TINY = 1e-120  # replaces a variance of 0; the square of its inverse does not overflow
CUT = 4.0  # standard deviations above which a difference indicates motion rather than noise


class Exposed(NamedTuple):
    """One exposure.

    file     name of the file
    signal   (H, W, 3), linear; nan where saturated
    step     (H, W, 3), standard deviation due to quantization; 0 for floating-point files, which are never clipped
    seconds  stated exposure time, s
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
    """The noise of a camera.

    read      variance of the read noise, (3,)
    gain      variance of the photon noise per unit of signal, (3,)
    relative  variance of the noise that is proportional to the signal, relative to the squared signal, (3,)
    known     whether there were pixels from which to estimate the noise
    """

    read: Floats
    gain: Floats
    relative: Floats
    known: bool = True

    def variance(self, light: Floats, seconds: float, step: Floats) -> Floats:
        """The variance of signal / seconds, (H, W, 3), for a given amount of light."""
        size = np.maximum(light, 0.0)
        return (self.read + step**2) / seconds**2 + self.gain * size / seconds + self.relative * size**2


@dataclass(frozen=True)
class Merged:
    """The merged light of a series of exposures.

    light     (H, W, 3), signal per second; nan where every exposure is saturated
    spread    (H, W, 3), standard deviation due to read noise, photon noise and quantization
    photon    (H, W, 3), derivative of the variance, spread^2, with respect to the light
    noise     noise of the camera; zeros for a single exposure
    times     estimated exposure times divided by the stated ones, shortest first
    ratios    measured ratios of exposure times
    shares    fraction of the light from each exposure, by its stated time in seconds
    shutter   errors of the exposure times that were corrected
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
        """The relative standard error of all light due to the errors of the exposure times."""
        return self.shutter.scale_error(self.shares)


def merge(exposures: Sequence[Exposed], off: float = 0.0, shutter: Shutter | None = None) -> Merged:
    """Merge several exposures of one view.

    off      standard deviation of the relative errors of exposure times; 0 if it is unknown
    shutter  errors of the exposure times, estimated from all series of the camera; None estimates them from this series
    Raises InputError if a stated time differs by more than a tenth from the time that the pixels indicate.
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
            # the mean of all exposures is uncorrelated with the difference of any two
            all_light = _mean(ordered, times, light, below, noise)
            used = _above(ordered, times, light, below, noise)
            light = _mean(ordered, times, light, used, noise)
            if shutter is None:
                ratios = _ratios(ordered, times, light, used, noise)
                known = estimated(ratios, seconds, off)
                times = np.array([known.factor(one) for one in seconds])
    # the relative noise is omitted because the fit estimates it together with other errors proportional to the signal
    spread, photon = _spread(ordered, times, light, used, noise._replace(relative=np.zeros(3)))
    shares = _shares(ordered, times, light, used, noise)
    light = np.where(used.any(axis=0), light, np.nan)
    return Merged(light, spread, photon, noise, times, ratios, shares, known)


def _start(exposures: Sequence[Exposed]) -> tuple[Floats, NDArray[np.bool_]]:
    """The light, and a mask of usable exposures, (K, H, W, 3), with the weights for photon noise.

    Exposures are added one by one, starting with the shortest.
    """
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
    """A mask of exposures below saturation, (K, H, W, 3), predicted from the exposure itself and the shorter ones."""
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
    """A mask of usable exposures, (K, H, W, 3): those well above 0, and the longest one below saturation."""
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
    """The minimum-variance mean, where the variances are computed from the mean itself."""
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
    """The fraction of the light of all pixels that comes from each exposure, by its stated time in seconds."""
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
    """The standard deviation of the merged light, and the derivative of its variance V with respect to the light.

    V = 1 / sum(1 / v_i), dV/dL = V^2 sum(v_i' / v_i^2).
    """
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
    """The read noise, gain and relative noise, from differences of exposures that are at most `NEIGHBORS` apart."""
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
    if told.any():  # dark channels get the median noise of the others, because the sensor is the same
        coefficients[~told] = np.median(coefficients[told], axis=0)
    else:  # for noise-free pictures such as renders, any weights are valid; those for photon noise are used
        coefficients[:, 1] = NOISELESS * max(float(light.max(initial=0.0)), 1e-30)
    read, gain, relative = coefficients.T
    return Noise(read, gain, relative, known)


def _least(columns: Floats, variance: Floats, error: Floats) -> Floats:
    """The non-negative (read, gain, relative^2) that best fit variances (B,) with relative errors (B,).

    relative^2 is hard to distinguish from photon noise, so it is 0 unless it reduces chi-square by `MIN_GAIN`.
    """
    if not variance.any():
        return np.zeros(3)
    scale = np.maximum(columns.max(axis=0), 1e-300)
    floor = 1e-6 * float(variance.max())
    best, misfit = np.zeros(3), np.inf
    for some in ([0, 1], [0, 1, 2]):
        size = np.maximum(variance, floor)
        for _ in range(4):  # weights from the fitted variances are unbiased, as explained above
            weight = 1.0 / (np.maximum(size, floor) * error)
            part, _ = nnls((columns / scale)[:, some] * weight[:, None], variance * weight)
            coefficients = np.zeros(3)
            coefficients[some] = part / scale[some]
            size = columns @ coefficients
        # logarithms limit the residuals of variances that are far from the fitted ones
        rest = float(np.sum((np.log(np.maximum(variance, floor) / np.maximum(size, floor)) / error) ** 2))
        if rest < misfit - (MIN_GAIN if len(some) > 2 else 0.0):
            best, misfit = coefficients, rest
    return best


def _variances(
    short: Exposed, long: Exposed, factors: Floats, light: Floats, both: NDArray[np.bool_], channel: int
) -> tuple[Floats, Floats, Floats]:
    """The variance of the difference of two exposures in bins of light, without quantization noise.

    Returns its derivatives with respect to read noise, gain and relative variance, (B, 3), the variance, (B,), and its
    relative error, (B,).
    """
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

    # where the short exposure is clipped at 0, differences are negative; the positive ones have the same variance
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
    """The ratios of the times of successive exposures.

    Pixels are weighted by their light divided by the variance of the difference. These weights give the smallest
    variance, and the light is uncorrelated with the difference.
    """
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
