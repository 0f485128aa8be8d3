"""Starting points of fits."""

from __future__ import annotations

import itertools

import numpy as np

from ..material import BSDF
from ..measure.tables.base import Floats
from .parameters import Free, ranges, start_of

WIDTHS = (0.03, 0.1, 0.3, 0.7)  # lobe widths of the starting points
INDICES = (0.5, 2.0)  # starting values of unbounded colors such as indices, at whose default the derivative may be 0
STARTS = 24  # maximum number of systematic starting points
RANDOM = 6  # additional random starting points
OPEN = 4.0  # upper limit for random values of unbounded parameters


def starts_of(material: BSDF, free: list[Free]) -> list[Floats]:
    """The starting points: the material's own values, and combinations of other lobe widths and indices."""
    first = start_of(material, free)
    starts = [first]
    open_ended = np.repeat([one.kind == "spectrum" and one.high > 1e5 for one in free], [one.count for one in free])
    firsts = [first, *(np.where(open_ended, value, first) for value in INDICES if open_ended.any())]
    places = np.cumsum([0, *(one.count for one in free)])
    lobes = [int(at) for at, one in zip(places, free, strict=False) if _is_width(one)]
    for widths in itertools.combinations_with_replacement(WIDTHS, len(lobes)):
        for begin in firsts:
            other = begin.copy()
            for at, width in zip(lobes, widths, strict=True):
                one = free[int(np.searchsorted(places, at, side="right")) - 1]
                other[at] = np.clip(_of_width(one, width), one.low, one.high)
            starts.append(other)
    return starts[:STARTS] + random_starts(first, free)


def random_starts(first: Floats, free: list[Free], count: int = RANDOM, seed: int = 23) -> list[Floats]:
    """Random starting points within the ranges of the parameters; unbounded ranges end at `OPEN`.

    first  values of the free parameters in the material, (K,)
    seed   seed of the random numbers
    """
    rng = np.random.default_rng(seed)
    return [_inside(free, first, rng.random(len(first))) for _ in range(count)]


def between(free: list[Free], share: float) -> Floats:
    """Numbers at a fraction of their ranges, (K,), on a logarithmic scale for lobe widths; unbounded ranges end at
    `OPEN`."""
    count = sum(one.count for one in free)
    return _inside(free, np.zeros(count), np.full(count, share))


def _inside(free: list[Free], first: Floats, share: Floats) -> Floats:
    """Numbers at a fraction of their ranges, (K,); unbounded ranges end at `OPEN` or at twice `first`."""
    low, high, ratio = ranges(free)
    high = np.where(high > 1e5, np.maximum(OPEN, 2.0 * np.abs(first)), high)
    low = np.where(low < -1e5, -high, low)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(ratio, low ** (1.0 - share) * high**share, low + share * (high - low)))


def _is_width(one: Free) -> bool:
    return one.kind == "alpha" or _exponent(one) or _rough(one)


def _of_width(one: Free, width: float) -> float:
    """The value of a parameter for which the lobe has the given width."""
    if one.kind == "alpha":
        return width
    return float(np.sqrt(width)) if _rough(one) else 2.0 / (width * width)  # exponent of a cosine lobe of this width


def _rough(one: Free) -> bool:
    """Whether alpha is the square of the parameter, as in principled materials."""
    return one.kind == "float" and one.path.rpartition(".")[2].endswith("roughness") and one.high <= 1.0


def _exponent(one: Free) -> bool:
    return one.kind == "float" and one.ratio and one.high >= 1e3
