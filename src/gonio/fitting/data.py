"""The data of a fit: pairs of directions with measured values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..measure.angles import half_difference_arrays
from ..measure.tables.angles import Angles
from ..measure.tables.base import Floats, Measurement, in_rgb
from ..measure.tables.half_difference import HalfDifference, centres
from ..measure.tables.samples import Samples

GRAZING = 80.0  # degrees: measurements at larger angles are unreliable, and papers exclude them (Ngan2005)
SHARED = 0.01  # fraction of the values equal to the maximum above which the detector counts as saturated
RUNS = 3  # smallest number of runs of neighbors that contain the maximum: fewer may be the only peak of a small table
HIGHLIGHT = 4.0  # ratio to the median above which a maximum belongs to a highlight, not to a diffuse material
GRID = (60, 45, 36)  # cells in half-vector and difference angles, for tables without directions of their own


@dataclass(frozen=True)
class Data:
    """Measured values for a fit.

    wo, wi  (N, 3) float64, above the surface
    value   f cos theta_i, (N, 3)
    row     index of the run of neighbors, (N,), within which errors are correlated
    out     number of excluded values of the table, by reason
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
        return self.at(np.sort(np.random.default_rng([seed, 91]).choice(len(self), count, replace=False)))

    def at(self, chosen: NDArray[np.integer] | NDArray[np.bool_]) -> Data:
        """The values with the given indices or mask."""
        return Data(self.wo[chosen], self.wi[chosen], self.value[chosen], self.row[chosen], self.out)

    def known(self, measured: NDArray[np.bool_]) -> Data:
        """The measured values; the others are counted in `out` as "not measured"."""
        return replace(self.at(measured), out={**self.out, "not measured": int(np.count_nonzero(~measured))})


def data_of(table: Measurement, grazing: float = GRAZING, where: str = "") -> Data:
    """The values of a table whose directions both lie within `grazing` degrees of the normal.

    Samples, tables over angles and half-difference tables provide the stored values at their own directions, because
    interpolated values would be treated as measurements. Other tables are resampled to a half-difference grid within
    the measured angles.

    where  name of the table, for errors
    Raises InputError if no value remains.
    """
    if not 0.0 < grazing <= 90.0:
        raise InputError(f"{grazing:g} degrees given, more than 0 and at most 90 expected", "grazing")
    if isinstance(table, HalfDifference):
        data = _of_cells(table, grazing)
    elif isinstance(table, (Samples, Angles)):
        data = _of_pairs(table, grazing, where)
    else:
        data = _resampled(table, grazing)
    if not len(data):
        raise InputError("no valid value within that angle", where, "raise --grazing, or check the file")
    fine = np.isfinite(data.value).all(axis=1)
    clipped = fine & _saturated(data.value / data.wi[:, 2:], data.row)
    if not (fine & ~clipped).any():
        raise InputError("no finite value within that angle", where, "check the file")
    out = {
        **data.out,
        "not finite": int(np.count_nonzero(~fine)),
        "saturated": int(np.count_nonzero(clipped)),
    }
    data = replace(data, out={why: count for why, count in out.items() if count})
    used = fine & ~clipped
    return data if used.all() else data.at(used)


def _of_cells(table: HalfDifference, grazing: float) -> Data:
    """The valid cells of a half-difference table."""
    n, m, count, channels = table.values.shape
    wo, wi, row, inside = _cells((n, m, count), table.turn, grazing)
    valid = table.valid.ravel()
    value = in_rgb(table.values.reshape(-1, channels)[inside], table.wavelengths) * wi[:, 2:]
    data = Data(wo, wi, value, row, {"grazing": len(inside) - len(wo)})
    return data if valid.all() else data.known(valid[inside])


def _of_pairs(table: Samples | Angles, grazing: float, where: str) -> Data:
    """The values of a table that stores them for pairs of directions. The pairs of a run of neighbors have about the
    same theta_h and theta_d, as in a half-difference table. A run includes the swapped pair and the mirror image of
    each pair, which have the same value in a reciprocal table."""
    wo, wi = table.pairs()
    inside = _inside(wo, wi, grazing)
    wo, wi = wo[inside], wi[inside]
    f = table.values.reshape(-1, table.values.shape[-1])[inside]
    value = in_rgb(f, table.wavelengths, where) * wi[:, 2:]
    _, row = np.unique(_cell_of(wo, wi), return_inverse=True)
    return Data(wo, wi, value, row, {"grazing": len(inside) - len(wo)})


def _resampled(table: Measurement, grazing: float) -> Data:
    """Interpolated values of a table at the centers of a half-difference grid, within the measured angles."""
    wo, wi, row, inside = _cells(GRID, np.pi, grazing)
    known = table.angular_range.holds(wo, wi)
    data = Data(wo, wi, np.zeros((len(wo), 3)), row, {"grazing": len(inside) - len(wo)}).known(known)
    return replace(data, value=table.rgb(data.wo, data.wi))


def _saturated(f: Floats, row: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Mask (N,) of saturated values (N, 3). A channel is saturated if its maximum is a highlight and if at least a
    fraction `SHARED` of its values, in `RUNS` or more runs of neighbors, are equal to the maximum."""
    saturated = np.zeros(len(f), bool)
    for channel in f.T:
        largest = np.max(channel, initial=0.0, where=np.isfinite(channel))
        at_end = channel == largest
        bright = largest > HIGHLIGHT * np.nanmedian(np.abs(channel))
        if bright and at_end.mean() >= SHARED and len(np.unique(row[at_end])) >= RUNS:
            saturated |= at_end
    return saturated


@lru_cache(maxsize=2)
def _cells(
    shape: tuple[int, int, int], turn: float, grazing: float
) -> tuple[Floats, Floats, NDArray[np.int64], NDArray[np.bool_]]:
    """(wo, wi, row, mask over all cells) of the cells whose centers lie within `grazing` degrees of the normal."""
    wo, wi = centres(shape, turn)
    inside = _inside(wo, wi, grazing)
    return wo[inside], wi[inside], (np.arange(len(wo)) // shape[2])[inside], inside


def _inside(wo: Floats, wi: Floats, grazing: float) -> NDArray[np.bool_]:
    """Whether both directions lie within `grazing` degrees of the normal, (N,)."""
    lowest = max(float(np.cos(np.radians(grazing))), 1e-6)
    return np.asarray((wo[:, 2] > lowest) & (wi[:, 2] > lowest))


def _cell_of(wo: Floats, wi: Floats) -> NDArray[np.int64]:
    """Index of the cell in theta_h and theta_d of `GRID` that contains a pair, (N,)."""
    theta_h, theta_d, _ = half_difference_arrays(wo, wi)
    i = np.minimum(np.sqrt(theta_h * (2.0 / np.pi)) * GRID[0], GRID[0] - 1)
    j = np.minimum(theta_d * (2.0 / np.pi) * GRID[1], GRID[1] - 1)
    return i.astype(np.int64) * GRID[1] + j.astype(np.int64)
