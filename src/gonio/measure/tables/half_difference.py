"""Tables over half and difference angles, as in the MERL database (Matusik2003)."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ... import ops
from ...errors import InputError
from ...ops import Direction, Scalar, Spectrum, Table, clamp, floor, maximum, minimum, sqrt, where
from ..angles import half_difference
from ..warp import named
from .base import Floats, Measurement, finite, in_rgb, of_channels, padded
from .guided import Guided

GRAZING = 0.03  # smallest cos theta_i at which f is computed from f cos theta_i: 1.7 degrees above the horizon


class HalfDifference(Guided, Measurement):
    """f in cells of (theta_h, theta_d, phi_d), with theta_h divided by its square root (Rusinkiewicz1998, Matusik2003).

    Of n x m x l cells, cell (i, j, k) covers theta_h from (i / n)^2 to ((i + 1) / n)^2 quarter turns. theta_d is
    divided into m equal steps over a quarter turn, and phi_d into l equal steps over half a turn or a full turn. Half a
    turn suffices for reciprocal tables, because swapping wo and wi adds pi to phi_d. Each value applies at the center
    of its cell in (sqrt(theta_h), theta_d, phi_d); values between centers are interpolated linearly, and phi_d is
    periodic. Outside the first and the last center, values are constant: in a table of MERL's size, values for
    theta_h > 89.0 and theta_d > 89.5 degrees are extrapolated.

    A cell with a negative value is invalid. The stored value is preserved, but the interpolation uses the value of the
    preceding valid cell along theta_d instead, where both directions are farther from the horizon.
    """

    name = "half-difference"
    axes: ClassVar[Mapping[str, str]] = {
        "theta_h": "angle of the half vector, by its square root",
        "theta_d": "angle of the difference",
        "phi_d": "azimuth of the difference",
    }

    def __init__(
        self,
        values: NDArray[np.generic],
        turn: float = np.pi,
        where: str = "",
        title: str = "",
        source: Mapping[str, str] | None = None,
        wavelengths: Floats | None = None,
    ) -> None:
        """A table of cells.

        values  (theta_h, theta_d, phi_d, channel), f in 1/sr
        turn    range of phi_d: pi or 2 pi
        where   name of the file in errors
        """
        super().__init__(title, source, wavelengths)
        self.values = finite(values, "the table", where)
        self.turn = float(turn)
        if self.values.ndim != 4 or min(self.values.shape) < 1 or max(self.values.shape[:2]) < 2:
            raise InputError(
                f"a table of shape {self.values.shape}, (theta_h, theta_d, phi_d, channel) expected", where
            )
        if not min(abs(self.turn - np.pi), abs(self.turn - 2.0 * np.pi)) < 1e-6:
            raise InputError(f"phi_d spans {self.turn:g}, pi or 2 pi expected", where)
        if not np.any(self.valid):
            raise InputError("every cell is invalid (negative)", where, "the table contains no data")

    @cached_property
    def valid(self) -> NDArray[np.bool_]:
        """Mask of the valid cells, whose values are not negative."""
        return np.asarray(self.values.min(axis=-1) >= 0.0)

    @cached_property
    def mirrored(self) -> bool:
        """Whether the values at phi_d and -phi_d are equal."""
        return bool(np.allclose(self.values, self.values[:, :, ::-1], rtol=1e-9, atol=0.0))

    @property
    def reciprocal(self) -> bool:
        """Whether the coordinates ensure reciprocity, because phi_d covers half a turn."""
        return self.turn < 4.0

    # ------------------------------------------------------------------ as formulas

    @cached_property
    def _table(self) -> Table:
        values = in_rgb(self.values, self.wavelengths)
        if not self.valid.all():
            values = self._held(values)
        if self._folded:
            values = values[:, :, : values.shape[2] // 2]
        return named("half_difference", padded(values))

    @property
    def _folded(self) -> bool:
        """Whether the half of the table up to a quarter turn of phi_d suffices; a smaller table is faster to fetch."""
        return self.mirrored and self.reciprocal and self.values.shape[2] % 2 == 0

    def _held(self, values: Floats) -> Floats:
        """Values in which invalid cells are replaced.

        Each gets the value of the last valid cell at a smaller theta_d, where both directions are farther from the
        horizon. If there is no such cell, it gets the value of the nearest valid cell, where a step along theta_h
        counts as four steps along the other axes.
        """
        step = np.arange(values.shape[1])[None, :, None]
        last = np.maximum.accumulate(np.where(self.valid, step, -1), axis=1)
        held = np.take_along_axis(values, np.maximum(last, 0)[..., None], axis=1)
        if last.min() < 0:
            from scipy.ndimage import distance_transform_edt  # imported here to speed up renders that do not need it

            has_values = last >= 0
            nearest = distance_transform_edt(~has_values, (4.0, 1.0, 1.0), return_distances=False, return_indices=True)
            held = held[tuple(nearest)]
        return held

    @ops.function
    def value(self, wo: Direction, wi: Direction) -> Spectrum:
        """f cos theta_i, where f is interpolated linearly in the coordinates of the table."""
        theta_h, theta_d, phi_d = half_difference(wo, wi)
        n, m, count = map(float, self.values.shape[:3])
        x = clamp(sqrt(maximum(theta_h * (2.0 / ops.pi), 0.0)) * n - 0.5, 0.0, n - 1.0)
        y = clamp(theta_d * (2.0 / ops.pi) * m - 0.5, 0.0, m - 1.0)
        i, j = minimum(floor(x), max(n - 2.0, 0.0)), minimum(floor(y), max(m - 2.0, 0.0))
        (first, second), tz = self._azimuth_cell(phi_d * (count / self.turn), count)
        tx, ty = x - i, y - j
        total: ops.Value = 0.0
        for di, wx in ((0.0, 1.0 - tx), (1.0, tx)):
            for dj, wy in ((0.0, 1.0 - ty), (1.0, ty)):
                for cell, wz in ((first, 1.0 - tz), (second, tz)):
                    total = total + of_channels(ops.fetch(self._table, i + di, j + dj, cell)) * (wx * wy * wz)
        return total * wi.z

    def _azimuth_cell(self, at: Scalar, count: float) -> tuple[tuple[Scalar, Scalar], Scalar]:
        """The cells on both sides of phi_d, given in units of cells, and the fraction of the distance between their
        centers."""
        if self._folded:
            at = at - floor(at * (1.0 / count)) * count
            z = clamp(minimum(at, count - at) - 0.5, 0.0, 0.5 * count - 1.0)
            k = minimum(floor(z), max(0.5 * count - 2.0, 0.0))
            return (k, k + 1.0), z - k
        z = at - 0.5
        k = floor(z)
        first = k - floor(k * (1.0 / count) + 0.25 / count) * count  # the remainder, in [0, count)
        return (first, where(first + 1.5 > count, 0.0, first + 1.0)), z - k

    # ------------------------------------------------------------------ as numbers

    def arrays(self) -> dict[str, NDArray[np.generic]]:
        return {"values": self.values, "turn": np.array([self.turn])}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[np.generic]], **about: ops.Value) -> HalfDifference:
        return cls(arrays["values"], float(np.asarray(arrays["turn"], np.float64).ravel()[0]), **about)

    @property
    def flaws(self) -> dict[str, float]:
        return {"invalid": float(1.0 - self.valid.mean())}

    @property
    def shape(self) -> dict[str, int]:
        return dict(zip(("theta_h", "theta_d", "phi_d", "channel"), self.values.shape, strict=True))

    @property
    def range(self) -> tuple[float, float]:
        valid = self.values[self.valid]
        return float(valid.min()), float(valid.max())


def centres(shape: tuple[int, int, int], turn: float = np.pi) -> tuple[Floats, Floats]:
    """wo and wi at the center of every cell, (N, 3) each, in the order of the table. Some are below the surface."""
    n, m, count = shape
    theta_h = ((np.arange(n) + 0.5) / n) ** 2 * (0.5 * np.pi)
    theta_d = (np.arange(m) + 0.5) / m * (0.5 * np.pi)
    phi_d = (np.arange(count) + 0.5) / count * turn
    return pair_at(*(a.ravel() for a in np.meshgrid(theta_h, theta_d, phi_d, indexing="ij")))


def pair_at(theta_h: Floats, theta_d: Floats, phi_d: Floats) -> tuple[Floats, Floats]:
    """wo and wi from their half and difference angles, with the half vector in the x-z plane.

    This is the inverse of `angles.half_difference`.
    """
    sin_h, cos_h, sin_d, cos_d = np.sin(theta_h), np.cos(theta_h), np.sin(theta_d), np.cos(theta_d)
    along, side = sin_d * np.cos(phi_d), sin_d * np.sin(phi_d)
    offset = np.stack([along * cos_h, side, -along * sin_h], -1)
    middle = np.stack([cos_d * sin_h, 0.0 * cos_d, cos_d * cos_h], -1)
    return middle - offset, middle + offset


def sampled(
    value: ops.Value, shape: tuple[int, int, int] = (90, 90, 180), turn: float = np.pi, **about: ops.Value
) -> HalfDifference:
    """A table of a function value(wo, wi) = f cos theta_i, (N, 3), evaluated at the centers of the cells.

    A cell whose center lies below the surface is invalid; its value is -1. If phi_d covers half a turn, a pair and its
    swapped pair share one value of f. For a reciprocal material, the function returns v = f cos theta_i and
    v' = f cos theta_o for the two. The least-squares solution for f is

        f = (v cos theta_i + v' cos theta_o) / (cos^2 theta_i + cos^2 theta_o).

    The mean of v / cos theta_i and v' / cos theta_o would amplify errors at grazing angles, where a cosine is near 0.
    """
    wo, wi = centres(shape, turn)
    lowest = np.minimum(wo[:, 2], wi[:, 2])
    values = np.full((len(wo), 3), -1.0)
    lit = lowest > 1e-9
    cosine_o, cosine_i = wo[lit, 2:], wi[lit, 2:]
    forward = value(wo[lit], wi[lit])
    f = (forward * cosine_i + value(wi[lit], wo[lit]) * cosine_o) / (cosine_i**2 + cosine_o**2)
    if turn > 4.0:  # each pair has its own cell, but the quotient is unreliable at grazing angles
        f = np.where(cosine_i > GRAZING, forward / cosine_i, f)
    values[lit] = np.maximum(f, 0.0)
    return HalfDifference(values.reshape(*shape, 3), turn, **about)
