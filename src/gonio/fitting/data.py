"""What a material is fitted to: pairs of directions with the measured values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..measure.tables.base import Floats, Measurement, in_rgb
from ..measure.tables.half_difference import HalfDifference, centres

GRAZING = 80.0  # degrees: beyond, measurements are not to be trusted, and papers leave them out (Ngan2005)
SHARED = 0.01  # of the values, that are the largest one to the last digit where a detector saturates
HIGHLIGHT = 4.0  # times the median, from which on the largest value is a highlight's and not a diffuse material's
GRID = (60, 45, 36)  # of half vector and difference, where a table has another grid than that


@dataclass(frozen=True)
class Data:
    """Measured values.

    wo, wi  (N, 3) float64, above the surface
    value   f cos theta_i, (N, 3)
    row     of which run of neighbors each is one, (N,): what lies close together is off together
    out     values of the table that are left out, by why
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
        """Values under 0, of each channel, (3,)."""
        return np.count_nonzero(self.value < 0.0, axis=0)

    def some(self, count: int, seed: int = 1) -> Data:
        """So many of them, drawn evenly from all; all where there are no more."""
        if count >= len(self):
            return self
        chosen = np.sort(np.random.default_rng([seed, 91]).choice(len(self), count, replace=False))
        return Data(self.wo[chosen], self.wi[chosen], self.value[chosen], self.row[chosen], self.out)


def data_of(table: Measurement, grazing: float = GRAZING, where: str = "") -> Data:
    """The values of a table up to an angle of both directions, degrees.

    A table over half vector and difference gives its own cells, but invalid ones; any other is read on such a grid,
    at the angles that were measured.
    Raises InputError where nothing is left.
    """
    if not 0.0 < grazing <= 90.0:
        raise InputError(f"{grazing:g} degrees given, more than 0 and at most 90 expected", "grazing")
    own = isinstance(table, HalfDifference)
    shape = table.values.shape[:3] if isinstance(table, HalfDifference) else GRID
    turn = table.turn if isinstance(table, HalfDifference) else np.pi
    cells = int(np.prod(shape))
    wo, wi, row, seen = _cells((int(shape[0]), int(shape[1]), int(shape[2])), turn, grazing)
    kept = seen
    out = {"grazing": cells - len(wo)}
    if isinstance(table, HalfDifference):
        valid = table.valid.ravel()[seen]
        wo, wi, row, kept = wo[valid], wi[valid], row[valid], seen & table.valid.ravel()
    if not own:
        known = table.angular_range.holds(wo, wi)
        wo, wi, row, kept = wo[known], wi[known], row[known], seen
    out["not measured"] = cells - out["grazing"] - len(wo)
    if not len(wo):
        raise InputError("no valid value up to that angle", where, "raise --grazing, or check the file")
    if isinstance(table, HalfDifference):
        value = in_rgb(table.values.reshape(-1, table.values.shape[-1])[kept], table.wavelengths) * wi[:, 2:]
    else:
        value = table.rgb(wo, wi)
    fine = np.isfinite(value).all(axis=1)
    clipped = fine & _saturated(value / wi[:, 2:])
    if not (fine & ~clipped).any():
        raise InputError("no finite value up to that angle", where, "check the file")
    out |= {"not finite": int(np.count_nonzero(~fine)), "saturated": int(np.count_nonzero(clipped))}
    if not fine.all() or clipped.any():
        fine &= ~clipped
        wo, wi, value, row = wo[fine], wi[fine], value[fine], row[fine]
    return Data(wo, wi, value, row, {why: count for why, count in out.items() if count})


def _saturated(f: Floats) -> NDArray[np.bool_]:
    """Which values (N, 3) stand at the end of what was measured, (N,): a hundredth and more of a channel share its
    largest value to the last digit, and it is a highlight's."""
    found = np.zeros(len(f), bool)
    for channel in f.T:
        largest = np.max(channel, initial=0.0, where=np.isfinite(channel))
        at_end = channel == largest
        if at_end.mean() >= SHARED and largest > HIGHLIGHT * np.nanmedian(np.abs(channel)):
            found |= at_end
    return found


@lru_cache(maxsize=2)
def _cells(
    shape: tuple[int, int, int], turn: float, grazing: float
) -> tuple[Floats, Floats, NDArray[np.int64], NDArray[np.bool_]]:
    """(wo, wi, row, which) of the cells whose middles both lie within an angle of the normal; which of all they are."""
    wo, wi = centres(shape, turn)
    lowest = max(float(np.cos(np.radians(grazing))), 1e-6)
    kept = (wo[:, 2] > lowest) & (wi[:, 2] > lowest)
    return wo[kept], wi[kept], (np.arange(len(wo)) // shape[2])[kept], kept
