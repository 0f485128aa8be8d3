"""Estimate the errors of exposure times from the ratios of exposures in all series of a camera.

The true exposure time is t exp(e), where t is the stated time in seconds. The error e is a property of the shutter
setting, so it is the same in every series; it is normally distributed with standard deviation s. The pixels of a series
measure differences r = e_b - e_a between two settings, but not the mean error. Let the matrix A express these
differences, and let V be their variances. Given the pixels, the errors have the covariance
C = (1 / s^2 + A' V^-1 A)^-1 and the mean C A' V^-1 r (Gauss-Markov). The uncertainty C of the settings used in a
picture is a relative error common to all light in the picture.

If the calibration does not state s, it is estimated from the scatter of the n settings. The 95 % quantile of Student's
t distribution with n - 1 degrees of freedom then replaces that of the normal distribution, because the estimate of s is
uncertain: its error is 50 % for three settings.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy import special

from ...errors import InputError
from .calibration import Floats

SIGNIFICANT = 0.0027  # probability of a normal variable beyond three standard deviations
WRONG = 0.1  # relative error of an exposure time above which it is rejected
SIGMAS = 4.0  # number of standard deviations by which the error must exceed WRONG
NORMAL_95 = 1.96


class Ratio(NamedTuple):
    """A measured ratio of two exposure times, relative to the stated ratio.

    short, long  stated exposure times, s
    log          e_long - e_short
    variance     variance of `log`
    file         name of the file of the long exposure
    """

    short: float
    long: float
    log: float
    variance: float
    file: str


class Shutter(NamedTuple):
    """Estimated errors of exposure times.

    errors      relative error of each exposure time, by its stated value in seconds
    covariance  covariance of these errors, (K, K), in the order of `errors`
    """

    errors: Mapping[float, float]
    covariance: Floats

    def factor(self, seconds: float) -> float:
        """The true exposure time divided by the stated one."""
        return float(np.exp(self.errors.get(seconds, 0.0)))

    def scale_error(self, shares: Mapping[float, float]) -> float:
        """The relative standard error of the light in a merged picture.

        shares  fraction of the light that comes from each exposure, by its stated time in seconds
        """
        weights = np.array([shares.get(seconds, 0.0) for seconds in self.errors])
        return float(np.sqrt(max(weights @ self.covariance @ weights, 0.0)))


def estimated(ratios: Sequence[Ratio], seconds: Sequence[float], stated: float) -> Shutter:
    """Estimate the errors of a camera's exposure times from all of its series.

    ratios   measured ratios of exposure times
    seconds  all stated exposure times
    stated   standard deviation of their relative errors; 0 if it is unknown
    Raises InputError if a stated time differs by more than a tenth from the time that the pixels indicate.
    """
    settings = sorted(set(seconds))
    count = len(settings)
    differences = np.zeros((len(ratios), count))
    for row, ratio in zip(differences, ratios, strict=True):
        row[settings.index(ratio.short)], row[settings.index(ratio.long)] = -1.0, 1.0
    weighted = differences.T / np.array([max(ratio.variance, 1e-300) for ratio in ratios])
    information, gradient = weighted @ differences, weighted @ np.array([ratio.log for ratio in ratios])
    # the mean of these errors is 0 in each connected group of settings
    errors = np.linalg.pinv(information, rcond=1e-12, hermitian=True) @ gradient
    if len(ratios):
        _check(ratios, settings, errors, information)
    spread, inflation = stated, 1.0
    if stated <= 0.0:
        degrees = int(np.linalg.matrix_rank(differences)) if len(ratios) else 0
        told = float(gradient @ errors)  # chi-square of the hypothesis that all errors are 0
        if not degrees or special.chdtrc(degrees, told) > SIGNIFICANT:
            return Shutter(dict.fromkeys(settings, 0.0), np.zeros((count, count)))
        # the noise of the ratios increases the scatter of the settings
        noise = float(np.trace(np.linalg.pinv(information, rcond=1e-12, hermitian=True)))
        spread = float(np.sqrt(max(errors @ errors - noise, 0.0) / degrees))
        if spread <= 0.0:
            return Shutter(dict.fromkeys(settings, 0.0), np.zeros((count, count)))
        inflation = float(special.stdtrit(degrees, 0.975)) / NORMAL_95
    covariance = np.linalg.inv(information + np.eye(count) / spread**2)
    return Shutter(
        dict(zip(settings, map(float, covariance @ gradient), strict=True)), np.asarray(covariance * inflation**2)
    )


def _check(ratios: Sequence[Ratio], settings: list[float], errors: Floats, information: Floats) -> None:
    """Raise InputError if two errors differ by more than `WRONG`, beyond their uncertainty."""
    covariance = np.linalg.pinv(information, rcond=1e-12, hermitian=True)
    variance = np.diag(covariance)
    unsure = np.sqrt(np.maximum(variance[:, None] + variance - 2.0 * covariance, 0.0))
    if np.all(np.abs(errors[:, None] - errors) <= np.log1p(WRONG) + SIGMAS * unsure):
        return
    worst = int(np.argmax(np.abs(errors - np.median(errors))))
    told = settings[worst] * float(np.exp(errors[worst] - np.median(np.delete(errors, worst))))
    what = f"{settings[worst]:g} s are stated, but the pixels of the series indicate {told:.3g} s"
    hint = 'correct "seconds" in the calibration file, or omit this exposure; also check the response'
    where = next((one.file for one in ratios if settings[worst] in (one.short, one.long)), "")
    raise InputError(what, where, hint)
