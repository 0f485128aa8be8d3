"""A ratio of two values that should be equal. `fits` finds its formula, and `causes` the probable mistake."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from ..subject import Subject

SPREAD = 1e-3  # largest 5 % to 95 % spread of a ratio that fits
COVER = 0.97  # fraction of the pairs at which a fit must hold

# maps (subject, wo, wi, mode) to the denominator of a ratio, for another subject or other arguments
Denominator: TypeAlias = "Callable[[Subject, np.ndarray, np.ndarray, str], np.ndarray]"


@dataclasses.dataclass(frozen=True)
class Cause:
    """A probable cause.

    words   the cause as a sentence of the report
    key     the cause without numbers: failures with the same key have the same cause
    """

    words: str
    key: str


@dataclasses.dataclass(frozen=True)
class Ratio:
    """Two values that should be equal, for pairs of directions.

    top, bottom    names of the two values, such as "weight x pdf" and "eval"
    wo, wi         directions, (N, 3)
    above, below   the values, (N, channels)
    subject        the subject to which they belong
    recompute      function that computes `below` for another subject, other directions or the other mode
    numbers        constants, in addition to the usual ones, to which this ratio may be equal: "2 alpha"
    zero           the mistake suggested by a ratio of 0
    antisymmetric  whether swapping wo and wi inverts the ratio, so that factors symmetric in the two cancel
    accuracy       relative difference of two values that count as equal; None derives it from the precision
    """

    top: str
    bottom: str
    wo: np.ndarray
    wi: np.ndarray
    above: np.ndarray
    below: np.ndarray
    subject: Subject
    recompute: Denominator | None = None
    antisymmetric: bool = False
    numbers: dict[str, float] = dataclasses.field(default_factory=dict)
    zero: str = "a value that is never used"
    accuracy: float | None = None

    @property
    def name(self) -> str:
        return f"the ratio of {self.top} to {self.bottom}"

    def take(self, rows: np.ndarray, channels: np.ndarray | None = None) -> Ratio:
        """The ratio restricted to some pairs, and to some channels."""
        above, below = self.above[rows], self.below[rows]
        if channels is not None:
            above, below = above[:, channels], below[:, channels]
        return dataclasses.replace(self, wo=self.wo[rows], wi=self.wi[rows], above=above, below=below)


class Fit(NamedTuple):
    """The formula of a ratio, the mistake that it suggests, and its accuracy: spread and fraction of the pairs covered.
    `number` is the formula's value if it is a constant."""

    formula: str
    guess: str
    spread: float
    cover: float
    number: float | None = None


NUMBERS = {
    "pi": np.pi,
    "2 pi": 2.0 * np.pi,
    "4 pi": 4.0 * np.pi,
    "pi^2": np.pi**2,
    "2": 2.0,
    "3": 3.0,
    "4": 4.0,
    "8": 8.0,
    "16": 16.0,
    "sqrt 2": np.sqrt(2.0),
}
NUMBERS |= {f"1 / {f'({name})' if ' ' in name else name}": 1.0 / value for name, value in NUMBERS.items()}
NUMBERS |= {"4 / pi": 4.0 / np.pi, "pi / 4": np.pi / 4.0, "2 / pi": 2.0 / np.pi, "pi / 2": np.pi / 2.0}


def written(value: float, allowed: float = SPREAD) -> str:
    """A number as text: a formula if it is a known number, digits otherwise."""
    for name, known in NUMBERS.items():
        if abs(value / known - 1.0) < allowed:
            return name
    return f"{value:.5g}"


def factor_key(number: float) -> str:
    """A common key for a factor and its inverse, because the ratio does not show which of the two values lacks it."""
    return f"factor {max(number, 1.0 / number):.3g}" if number > 0.0 else f"factor {number:.3g}"


def tolerance(ratio: Ratio) -> float:
    """The relative difference of two values that count as equal."""
    if ratio.accuracy is not None:
        return ratio.accuracy
    return 1e-5 if ratio.subject.best == "float64" else 5e-3


def scalar(ratio: Ratio) -> np.ndarray | None:
    """The ratio as one number per pair, (N,), if it is the same for all channels; else None."""
    lit = np.abs(ratio.below) > 1e-3 * np.abs(ratio.below).max(1, keepdims=True)
    r = np.divide(ratio.above, ratio.below, out=np.full_like(ratio.above, np.nan), where=lit)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # rows without light stay NaN
        middle = np.nanmedian(r, axis=1)
        spread = np.nanmax(np.abs(r - middle[:, None]), axis=1)
    apart = ~(spread <= max(SPREAD, tolerance(ratio)) * np.abs(middle))
    return middle if apart.mean() < 1.0 - COVER else None


def holds(ratio: Ratio, quotient: np.ndarray) -> tuple[float, float] | None:
    """Spread and cover of quotients that should be 1; None if too many of them are not 1."""
    allowed = max(SPREAD, tolerance(ratio))
    good = np.isfinite(quotient)
    cover = float(np.mean(good & (np.abs(quotient - 1.0) < allowed)))
    if cover < COVER:
        return None
    low, high = np.percentile(quotient[good], [5.0, 95.0])
    return (float(high - low), cover) if high - low < allowed else None
