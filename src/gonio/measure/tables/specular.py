"""Tables in angles about the mirror direction, as used in optical design."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ... import ops
from ...errors import InputError
from ...material.angular_range import AngularRange, of_nodes
from ...ops import Direction, Scalar, Spectrum, Table, where
from ..angles import elevation
from ..warp import Nodes, named
from .base import Floats, Measurement, axis, finite, in_rgb, of_channels, padded
from .guided import Guided


class Specular(Guided, Measurement):
    """f at nodes of (theta_i, azimuth, radial), where the last two give the view direction about the mirror direction.

    The radial angle is 0 in the mirror direction, and the azimuth is 0 from there toward the normal, as in Zemax's
    tabular BSDF. Values are interpolated linearly between nodes, and are constant beyond the first and the last. If the
    azimuth ends at pi, the table is mirror-symmetric; if it ends at 2 pi, the azimuth is periodic.
    """

    name = "specular"
    axes: ClassVar[Mapping[str, str]] = {
        "theta_i": "angle of the light, rad",
        "azimuth": "about the mirror direction, from the normal's side, rad",
        "radial": "angle to the mirror direction, rad",
    }

    def __init__(
        self,
        grid: Sequence[NDArray[np.generic]],
        values: NDArray[np.generic],
        where: str = "",
        title: str = "",
        source: Mapping[str, str] | None = None,
        wavelengths: Floats | None = None,
    ) -> None:
        """A table of values at the nodes of a grid.

        grid    the nodes of theta_i, azimuth and radial, rad
        values  (theta_i, azimuth, radial, channel), f in 1/sr
        where   name of the file in errors
        """
        super().__init__(title, source, wavelengths)
        theta_i, azimuth, radial = grid
        self.theta_i = axis(theta_i, "theta_i", where, 0.0, 0.5 * np.pi)
        self.azimuth = axis(azimuth, "azimuth", where, 0.0, 2.0 * np.pi)
        self.radial = axis(radial, "radial", where, 0.0, np.pi)
        self.values = finite(values, "the table", where)
        nodes = (len(self.theta_i), len(self.azimuth), len(self.radial))
        if self.values.ndim != 4 or self.values.shape[:3] != nodes:
            raise InputError(f"a table of shape {self.values.shape} for {nodes} nodes", where)

    @property
    def angular_range(self) -> AngularRange:
        return of_nodes(np.zeros(0), self.theta_i, np.zeros(0))

    @property
    def mirrored(self) -> bool:
        """Whether the table is mirror-symmetric, that is, whether the azimuth ends at pi."""
        return bool(self.azimuth[-1] < 1.5 * np.pi)

    # ------------------------------------------------------------------ as formulas

    @cached_property
    def _table(self) -> Table:
        rgb = padded(in_rgb(self.values, self.wavelengths))
        return named("specular", rgb.reshape(-1, *rgb.shape[2:]))

    @cached_property
    def _axes(self) -> tuple[Nodes, Nodes, Nodes]:
        return Nodes("theta_i", self.theta_i), Nodes("azimuth", self.azimuth), Nodes("radial", self.radial)

    @ops.function
    def value(self, wo: Direction, wi: Direction) -> Spectrum:
        """f cos theta_i, where f is interpolated linearly in the three angles."""
        of_i, of_azimuth, of_radial = self._axes
        azimuth, radial = about_mirror(wo, wi, self.azimuth[-1] > 1.5 * np.pi)
        i, ti = of_i.find(elevation(wi))
        a, ta = of_azimuth.find(azimuth)
        r, tr = of_radial.find(radial)
        total: ops.Value = 0.0
        last, count = len(self.theta_i) - 1.0, float(len(self.azimuth))
        for di, wx in ((0.0, 1.0 - ti), (1.0, ti)):
            for da, wy in ((0.0, 1.0 - ta), (1.0, ta)):
                row = ops.minimum(i + di, last) * count + ops.minimum(a + da, count - 1.0)
                for dr, wz in ((0.0, 1.0 - tr), (1.0, tr)):
                    total = total + of_channels(ops.fetch(self._table, row, r + dr)) * (wx * wy * wz)
        return total * wi.z

    # ------------------------------------------------------------------ as numbers

    def arrays(self) -> dict[str, NDArray[np.generic]]:
        return {"theta_i": self.theta_i, "azimuth": self.azimuth, "radial": self.radial, "values": self.values}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[np.generic]], **about: ops.Value) -> Specular:
        return cls([arrays[name] for name in cls.axes], arrays["values"], **about)

    @property
    def flaws(self) -> dict[str, float]:
        return {"negative": float(np.mean(self.values < 0.0))}

    @property
    def shape(self) -> dict[str, int]:
        return dict(zip(("theta_i", "azimuth", "radial", "channel"), self.values.shape, strict=True))

    @property
    def range(self) -> tuple[float, float]:
        return float(self.values.min()), float(self.values.max())


@ops.function
def about_mirror(wo: Direction, wi: Direction, full: bool) -> tuple[Scalar, Scalar]:
    """Azimuth and radial angle of wo about the mirror direction of wi.

    The azimuth is in [0, pi], or in [0, 2 pi) if `full`. If wi lies in the x-z plane, the mirror direction is
    s = (-sin theta_i, 0, cos theta_i), and azimuth 0 is the direction (cos theta_i, 0, sin theta_i), toward the normal;
    y completes the frame.
    """
    sin = ops.safe_sqrt(wi.x * wi.x + wi.y * wi.y)
    pole = sin == 0.0
    some = where(pole, 1.0, sin)
    c, s = where(pole, 1.0, wi.x / some), where(pole, 0.0, wi.y / some)
    x, y = c * wo.x + s * wo.y, c * wo.y - s * wo.x
    up = wi.z * x + sin * wo.z
    along = wi.z * wo.z - sin * x
    none = (up == 0.0) & (y == 0.0)
    turn = where(none, 0.0, ops.atan2(y if full else ops.abs(y), where(none, 1.0, up)))
    if full:
        turn = where(turn < 0.0, turn + 2.0 * ops.pi, turn)
    return turn, ops.atan2(ops.safe_sqrt(up * up + y * y), along)


def sampled(value: ops.Value, **about: ops.Value) -> Specular:
    """A table of a function value(wo, wi) = f cos theta_i, (N, 3), evaluated at the nodes.

    For nodes below the horizon or close to it, the function is evaluated slightly above the horizon.
    """
    theta_i = np.radians(np.concatenate([np.arange(0.0, 86.0, 5.0), [88.0]]))
    azimuth = np.radians(np.arange(0.0, 181.0, 7.5))
    radial = np.radians(
        np.concatenate([np.arange(0.0, 10.0, 0.5), np.arange(10.0, 30.0, 1.0), np.arange(30.0, 180.1, 3.0)])
    )
    i, a, r = (v.ravel() for v in np.meshgrid(theta_i, azimuth, radial, indexing="ij"))
    along, up, y = np.cos(r), np.sin(r) * np.cos(a), np.sin(r) * np.sin(a)
    wi = np.stack([np.sin(i), 0.0 * i, np.cos(i)], -1)
    wo = np.stack([-np.sin(i) * along + np.cos(i) * up, y, np.cos(i) * along + np.sin(i) * up], -1)
    wo[:, 2] = np.maximum(wo[:, 2], 1e-3)
    wo /= np.linalg.norm(wo, axis=1, keepdims=True)
    f = value(wo, wi) / wi[:, 2:]
    return Specular((theta_i, azimuth, radial), f.reshape(len(theta_i), len(azimuth), len(radial), 3), **about)
