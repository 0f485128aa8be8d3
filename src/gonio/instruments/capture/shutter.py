"""Errors of exposure times, from the ratios of exposures in all series of a camera.

A camera exposes for t exp(e) seconds where t is stated. The error e belongs to a setting of the shutter, so it is the
same in every series, and is a normal variable of standard deviation s. The pixels of a series measure differences
e_b - e_a of two settings, never their mean. With the matrix A of these differences and their variances V, the errors
given the pixels have the covariance C = (1 / s^2 + A' V^-1 A)^-1 and the mean C A' V^-1 r (Gauss-Markov). The
uncertainty that C leaves in the settings of a picture is a relative error of all its light.

If the calibration does not state s, it is estimated from the scatter of the n settings, and the 95 % quantile of
Student's t distribution with n - 1 degrees of freedom replaces the normal one: three settings determine s to 50 %.
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
SIGMAS = 4.0  # standard deviations by which the error must exceed that
NORMAL_95 = 1.96


class Ratio(NamedTuple):
    """A measured ratio of two exposure times, each divided by its stated value.

    short, long  stated seconds
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

    errors      relative error by stated seconds
    covariance  (K, K), of these errors, in the order of `errors`
    """

    errors: Mapping[float, float]
    covariance: Floats

    def factor(self, seconds: float) -> float:
        """True exposure time divided by the stated one."""
        return float(np.exp(self.errors.get(seconds, 0.0)))

    def scale_error(self, shares: Mapping[float, float]) -> float:
        """Relative standard error of light to which exposures contribute these fractions, by stated seconds."""
        weights = np.array([shares.get(seconds, 0.0) for seconds in self.errors])
        return float(np.sqrt(max(weights @ self.covariance @ weights, 0.0)))


def estimated(ratios: Sequence[Ratio], seconds: Sequence[float], stated: float) -> Shutter:
    """Errors of the exposure times of a camera from all its series.

    seconds  all stated exposure times
    stated   standard deviation of their relative errors; 0 if it is not known
    Raises InputError if a stated time contradicts the pixels by more than a tenth.
    """
    settings = sorted(set(seconds))
    count = len(settings)
    differences = np.zeros((len(ratios), count))
    for row, ratio in zip(differences, ratios, strict=True):
        row[settings.index(ratio.short)], row[settings.index(ratio.long)] = -1.0, 1.0
    weighted = differences.T / np.array([max(ratio.variance, 1e-300) for ratio in ratios])
    information, gradient = weighted @ differences, weighted @ np.array([ratio.log for ratio in ratios])
    errors = np.linalg.pinv(information, rcond=1e-12, hermitian=True) @ gradient  # with mean 0 in each connected group
    if len(ratios):
        _check(ratios, settings, errors, information)
    spread, inflation = stated, 1.0
    if stated <= 0.0:
        degrees = int(np.linalg.matrix_rank(differences)) if len(ratios) else 0
        told = float(gradient @ errors)  # chi-square of the hypothesis that all errors are 0
        if not degrees or special.chdtrc(degrees, told) > SIGNIFICANT:
            return Shutter(dict.fromkeys(settings, 0.0), np.zeros((count, count)))
        # noise of the ratios adds to the scatter of the settings
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
    """Raise InputError if the errors differ by more than `WRONG`."""
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
