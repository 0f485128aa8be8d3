"""Data of a fit: pairs of directions with measured values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..measure.tables.base import Floats, Measurement, in_rgb
from ..measure.tables.half_difference import HalfDifference, centres

GRAZING = 80.0  # degrees: measurements beyond are unreliable, and papers exclude them (Ngan2005)
SHARED = 0.01  # fraction of the values equal to the maximum above which the detector counts as saturated
HIGHLIGHT = 4.0  # times the median: a larger maximum belongs to a highlight, not to a diffuse material
GRID = (60, 45, 36)  # cells in half-vector and difference angles, for tables with another grid


@dataclass(frozen=True)
class Data:
    """Measured values for a fit.

    wo, wi  (N, 3) float64, above the surface
    value   f cos theta_i, (N, 3)
    row     index of the run of neighbors, (N,): errors of neighbors are correlated
    out     number of values of the table that are excluded, by reason
    """

    wo: Floats
    wi: Floats
    value: Floats
    row: NDArray[np.int64]
    out: Mapping[str, int] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.wo)

    @property
    def negative(self) -> NDArray[np.int64]:
        """Number of negative values per channel, (3,)."""
        return np.count_nonzero(self.value < 0.0, axis=0)

    def some(self, count: int, seed: int = 1) -> Data:
        """A uniform random subset of `count` values, selected by `seed`; all values if there are fewer."""
        if count >= len(self):
            return self
        chosen = np.sort(np.random.default_rng([seed, 91]).choice(len(self), count, replace=False))
        return Data(self.wo[chosen], self.wi[chosen], self.value[chosen], self.row[chosen], self.out)


def data_of(table: Measurement, grazing: float = GRAZING, where: str = "") -> Data:
    """The values of a table whose directions both lie within `grazing` degrees of the normal.

    A half-difference table provides its own valid cells; other tables are resampled on such a grid within the measured
    angles.

    where  name of the table, for errors
    Raises InputError if no value remains.
    """
    if not 0.0 < grazing <= 90.0:
        raise InputError(f"{grazing:g} degrees given, more than 0 and at most 90 expected", "grazing")
    own = isinstance(table, HalfDifference)
    shape = table.values.shape[:3] if isinstance(table, HalfDifference) else GRID
    turn = table.turn if isinstance(table, HalfDifference) else np.pi
    cells = int(np.prod(shape))
    wo, wi, row, inside = _cells((int(shape[0]), int(shape[1]), int(shape[2])), turn, grazing)
    used = inside
    out = {"grazing": cells - len(wo)}
    if isinstance(table, HalfDifference):
        valid = table.valid.ravel()[inside]
        wo, wi, row, used = wo[valid], wi[valid], row[valid], inside & table.valid.ravel()
    if not own:
        known = table.angular_range.holds(wo, wi)
        wo, wi, row, used = wo[known], wi[known], row[known], inside
    out["not measured"] = cells - out["grazing"] - len(wo)
    if not len(wo):
        raise InputError("no valid value within that angle", where, "raise --grazing, or check the file")
    if isinstance(table, HalfDifference):
        value = in_rgb(table.values.reshape(-1, table.values.shape[-1])[used], table.wavelengths) * wi[:, 2:]
    else:
        value = table.rgb(wo, wi)
    fine = np.isfinite(value).all(axis=1)
    clipped = fine & _saturated(value / wi[:, 2:])
    if not (fine & ~clipped).any():
        raise InputError("no finite value within that angle", where, "check the file")
    out |= {"not finite": int(np.count_nonzero(~fine)), "saturated": int(np.count_nonzero(clipped))}
    if not fine.all() or clipped.any():
        fine &= ~clipped
        wo, wi, value, row = wo[fine], wi[fine], value[fine], row[fine]
    return Data(wo, wi, value, row, {why: count for why, count in out.items() if count})


def _saturated(f: Floats) -> NDArray[np.bool_]:
    """Mask (N,) of saturated values (N, 3): at least `SHARED` of a channel equals its maximum, which is a highlight."""
    saturated = np.zeros(len(f), bool)
    for channel in f.T:
        largest = np.max(channel, initial=0.0, where=np.isfinite(channel))
        at_end = channel == largest
        if at_end.mean() >= SHARED and largest > HIGHLIGHT * np.nanmedian(np.abs(channel)):
            saturated |= at_end
    return saturated


@lru_cache(maxsize=2)
def _cells(
    shape: tuple[int, int, int], turn: float, grazing: float
) -> tuple[Floats, Floats, NDArray[np.int64], NDArray[np.bool_]]:
    """(wo, wi, row, mask over all cells) of the cells whose centers lie within `grazing` degrees of the normal."""
    wo, wi = centres(shape, turn)
    lowest = max(float(np.cos(np.radians(grazing))), 1e-6)
    inside = (wo[:, 2] > lowest) & (wi[:, 2] > lowest)
    return wo[inside], wi[inside], (np.arange(len(wo)) // shape[2])[inside], inside
