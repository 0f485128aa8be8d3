"""The directions to measure: those of a file format, or angles given by the user."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError, did_you_mean
from ...measure import format_of
from ...measure.formats.base import Format
from ...measure.tables import angles
from ...measure.tables.angles import Angles
from ...measure.tables.base import Measurement
from ...measure.tables.half_difference import HalfDifference
from ...measure.tables.samples import Samples

Floats = NDArray[np.float64]
MAX_CELLS = 1 << 24


class Plan:
    """A file format and the directions at which it stores values.

    file  the file format; that of .gonio files if no file is written
    kind  kind of the table
    """

    def __init__(self, output: Path | None, kind: str, grid: tuple[Floats, Floats, Floats] | None) -> None:
        where = str(output or "go.measure")
        self.file = Format.family.get("gonio") if output is None else format_of(output)
        if not self.file.writes:
            raise InputError(
                f"{self.file.name} files cannot be written", where, "choose another suffix, such as .gonio"
            )
        own = self.file.writes
        kinds = ["angles", *sorted({one.writes for one in Format.family.all().values()} - {"", "any"})]
        if kind and kind not in kinds:
            raise InputError(f"unknown kind of table '{kind}'", "--table", did_you_mean(kind, kinds))
        if kind and own not in ("any", kind):
            raise InputError(f"{self.file.name} files hold tables of kind {own}", "--table", "omit it, or use .gonio")
        self.kind = kind or ("angles" if own == "any" else own)
        self._grid = grid
        if grid is not None and (own not in ("any", "samples") or self.kind not in ("angles", "samples")):
            hint = "omit --theta-i, --theta-r and --phi, or use .gonio, .astm or .brdf"
            raise InputError(f"a {self.kind} table has its own directions", where, hint)

    def table(self, source: Measurement) -> Measurement:
        """A table of the values of `source.rgb` at the planned directions."""
        about: dict[str, Any] = {"title": source.title, "source": source.source}
        if self._grid is not None:
            wo, wi = angles.pairs(*self._grid)
            f = source.rgb(wo, wi) / wi[:, 2:]
            if self.kind == "angles":
                return Angles(self._grid, f.reshape(*map(len, self._grid), 3), **about)
            i, r, p = (a.ravel() for a in np.meshgrid(*self._grid, indexing="ij"))
            return Samples(np.stack([i, 0.0 * i, r, p], -1), f, **about)
        if self.kind == "angles":
            return angles.sampled(source.rgb, **about)
        writers = [self.file, *Format.family.all().values()]
        return next(one for one in writers if one.writes == self.kind).resampled(source)


def axis_of(text: str | None, name: str) -> list[float] | None:
    """Parse a list of angles such as "0,30,60", or a range such as "0:85:5", from 0 to 85 in steps of 5.

    Returns None if `text` is None.
    """
    if text is None:
        return None
    where = f"--{name.replace('_', '-')}"
    values: list[float] = []
    for part in filter(None, map(str.strip, text.split(","))):
        try:
            numbers = [float(word) for word in part.split(":")]
        except ValueError:
            numbers = []
        if len(numbers) == 1:
            values += numbers
        elif (
            len(numbers) == 3
            and np.all(np.isfinite(numbers))
            and numbers[2] > 0.0
            and numbers[1] - numbers[0] < 1e5 * numbers[2]
        ):
            first, last, step = numbers
            values += list(first + step * np.arange(int(np.floor((last - first) / step + 1e-9)) + 1))
        else:
            raise InputError(f"'{part}' given, angles expected", where, "such as 0,30,60 or 0:85:5")
    return values


def angles_of(values: Sequence[float] | None, default: Floats, name: str, most: float) -> Floats:
    """Convert angles in degrees to a sorted axis in radians; None selects `default`, which is in radians.

    name  name of the axis in errors
    most  largest valid angle, degrees
    Raises InputError for an empty list, and for angles out of range.
    """
    if values is None:
        return default
    degrees = np.unique(np.asarray(values, np.float64))
    if degrees.size == 0:
        raise InputError("no angles, so there is nothing to measure", f"--{name}", "such as 0,30,60 or 0:85:5")
    if not np.all(np.isfinite(degrees)) or degrees[0] < 0.0 or degrees[-1] > most:
        raise InputError(f"{degrees[0]:g} to {degrees[-1]:g} degrees given, 0 to {most:g} expected", f"--{name}")
    return np.radians(degrees)


def grid_of(
    theta_i: Sequence[float] | None, theta_r: Sequence[float] | None, phi: Sequence[float] | None
) -> tuple[Floats, Floats, Floats] | None:
    """The axes of a grid [rad] from angles [degrees]; None if no angles are given.

    An axis that is not given has the default nodes of a table of kind `angles`.
    """
    if theta_i is None and theta_r is None and phi is None:
        return None
    thetas, phis = angles.nodes()
    highest = 89.95
    axes = (
        angles_of(theta_i, thetas, "theta-i", highest),
        angles_of(theta_r, thetas, "theta-r", highest),
        angles_of(phi, phis, "phi", 180.0),
    )
    cells = int(np.prod([len(axis) for axis in axes]))
    if cells > MAX_CELLS:
        raise InputError(f"{cells} cells, at most {MAX_CELLS} expected", "--theta-i", "give fewer angles")
    return axes


def without(table: Measurement, blocked: float) -> tuple[Measurement, float, bool]:
    """Remove the cells in which the angle between the two directions is less than `blocked` [rad].

    Returns the table, the fraction of affected cells, and whether they have been removed: cells of MERL tables can be
    marked as invalid and samples can be omitted, but other tables must have a value everywhere.
    """
    if blocked <= 0.0:
        return table, 0.0, True
    if isinstance(table, HalfDifference):
        count = table.values.shape[1]
        hidden = np.arange(count) + 0.5 < blocked / np.pi * count
        hidden[-1] = False
        values = table.values.copy()
        values[:, hidden] = -1.0
        made = HalfDifference(values, table.turn, title=table.title, source=table.source)
        made.beside = table.beside
        return made, float(hidden.mean()), True
    if isinstance(table, Samples):
        wo, wi = table.pairs()
        visible = between(wo, wi) >= blocked
        if int(visible.sum()) < 8:
            raise InputError(f"{visible.sum()} directions remain, at least 8 expected", "--blocked", "block less")
        made_ = Samples(table.directions[visible], table.values[visible], title=table.title, source=table.source)
        made_.beside = {name: array[visible] for name, array in table.beside.items()}
        return made_, float(1.0 - visible.mean()), True
    return table, 0.0, False


def between(wo: Floats, wi: Floats) -> Floats:
    """The angle between pairs of directions (N, 3), rad, (N,)."""
    return 2.0 * np.arctan2(np.linalg.norm(wo - wi, axis=1), np.linalg.norm(wo + wi, axis=1))


def beside_lamp(wo: Floats, wi: Floats, blocked: float) -> Floats:
    """wo, where directions inside the blocked cone about wi are moved to its edge."""
    hidden = between(wo, wi) < blocked
    if blocked <= 0.0 or not hidden.any():
        return wo
    o, i = wo[hidden], wi[hidden]
    aside = o - np.sum(o * i, axis=1, keepdims=True) * i
    length = np.linalg.norm(aside, axis=1, keepdims=True)
    up = np.array([0.0, 0.0, 1.0]) - i[:, 2:] * i  # toward the normal if wo equals wi
    flat = np.linalg.norm(up, axis=1, keepdims=True) < 1e-6
    up = np.where(flat, [1.0, 0.0, 0.0], up)
    aside = np.where(length < 1e-9, up, aside)
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    rim = np.cos(blocked) * i + np.sin(blocked) * aside
    rim = np.where(rim[:, 2:] > 1e-3, rim, np.cos(blocked) * i - np.sin(blocked) * aside)
    moved = wo.copy()
    moved[hidden] = rim
    return moved
