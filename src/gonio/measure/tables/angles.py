"""Tables over the angles theta_i, theta_r and |phi_r - phi_i|, the first parameterization that the course proposes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ... import ops
from ...errors import InputError
from ...material.angular_range import AngularRange, of_nodes
from ...ops import Direction, Scalar, Spectrum, Table, maximum, minimum
from ..angles import between, elevation
from ..warp import Nodes, named
from .base import Floats, Measurement, axis, finite, in_rgb, of_channels, padded
from .guided import Guided

SAME = 1e-6  # relative difference below which values count as reciprocal, because files have six digits


class Angles(Guided, Measurement):
    """f at nodes of (theta_i, theta_r, |phi_r - phi_i|), interpolated linearly (course notes, part B).

    theta_i is the angle of the light and theta_r that of the view. Beyond the first and the last node of an axis, f is
    constant. If theta_i and theta_r have the same nodes and the values are symmetric, only the values with
    theta_i <= theta_r are stored.
    """

    name = "angles"
    mirrored = True
    axes: ClassVar[Mapping[str, str]] = {
        "theta_i": "angle of the light, rad",
        "theta_r": "angle of view, rad",
        "phi": "azimuth between them, rad",
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

        grid    the nodes of theta_i, theta_r and phi, rad
        values  (theta_i, theta_r, phi, channel), f in 1/sr
        where   name of the file in errors
        """
        super().__init__(title, source, wavelengths)
        theta_i, theta_r, phi = grid
        self.theta_i = axis(theta_i, "theta_i", where, 0.0, 0.5 * np.pi)
        self.theta_r = axis(theta_r, "theta_r", where, 0.0, 0.5 * np.pi)
        self.phi = axis(phi, "phi", where, 0.0, np.pi)
        self.values = finite(values, "the table", where)
        nodes = (len(self.theta_i), len(self.theta_r), len(self.phi))
        if self.values.ndim != 4 or self.values.shape[:3] != nodes:
            raise InputError(f"a table of shape {self.values.shape} for {nodes} nodes", where)

    # ------------------------------------------------------------------ as formulas

    @cached_property
    def reciprocal(self) -> bool:
        """Whether swapping theta_i and theta_r leaves f unchanged."""
        if not np.array_equal(self.theta_i, self.theta_r):
            return False
        swapped = np.swapaxes(self.values, 0, 1)
        limit = SAME * np.maximum(np.maximum(np.abs(swapped), np.abs(self.values)), np.abs(self.values).max() * 1e-9)
        return bool(np.all(np.abs(swapped - self.values) <= limit))

    @property
    def angular_range(self) -> AngularRange:
        return of_nodes(self.theta_r, self.theta_i, self.phi)

    @cached_property
    def _table(self) -> Table:
        """Colors by (pair of angles, phi); for a reciprocal table, only the pairs with theta_i <= theta_r."""
        rgb = padded(in_rgb(self.values, self.wavelengths))
        if self.reciprocal:
            high, low = np.tril_indices(len(self.theta_i))
            return named("angles", rgb[low, high])
        return named("angles", rgb.reshape(-1, *rgb.shape[2:]))

    @cached_property
    def _axes(self) -> tuple[Nodes, Nodes, Nodes]:
        return Nodes("theta_i", self.theta_i), Nodes("theta_r", self.theta_r), Nodes("phi", self.phi)

    def _row(self, i: Scalar, r: Scalar) -> Scalar:
        if not self.reciprocal:
            return minimum(i, len(self.theta_i) - 1.0) * float(len(self.theta_r)) + minimum(r, len(self.theta_r) - 1.0)
        high, low = minimum(maximum(i, r), len(self.theta_i) - 1.0), minimum(i, r)
        return high * (high + 1.0) * 0.5 + low

    @ops.function
    def value(self, wo: Direction, wi: Direction) -> Spectrum:
        """f cos theta_i, where f is interpolated linearly in the three angles."""
        of_i, of_r, of_phi = self._axes
        i, ti = of_i.find(elevation(wi))
        r, tr = of_r.find(elevation(wo))
        k, tk = of_phi.find(between(wo, wi))
        total: ops.Value = 0.0
        for di, a in ((0.0, 1.0 - ti), (1.0, ti)):
            for dr, b in ((0.0, 1.0 - tr), (1.0, tr)):
                row = self._row(i + di, r + dr)
                for dk, c in ((0.0, 1.0 - tk), (1.0, tk)):
                    total = total + of_channels(ops.fetch(self._table, row, k + dk)) * (a * b * c)
        return total * wi.z

    # ------------------------------------------------------------------ as numbers

    def pairs(self) -> tuple[Floats, Floats]:
        """wo and wi of every value, (N, 3) each, in the order of `values`."""
        return pairs(self.theta_i, self.theta_r, self.phi)

    def arrays(self) -> dict[str, NDArray[np.generic]]:
        """The axes and the values; for a reciprocal table, only those with theta_i <= theta_r: (pair, phi, channel)."""
        values = self.values
        if self.reciprocal:
            high, low = np.tril_indices(len(self.theta_i))
            values = values[low, high]
        return {"theta_i": self.theta_i, "theta_r": self.theta_r, "phi": self.phi, "values": values}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[np.generic]], **about: ops.Value) -> Angles:
        values, count = arrays["values"], len(arrays["theta_i"])
        if values.ndim == 3:
            if len(values) != count * (count + 1) // 2:
                raise InputError(f"{len(values)} pairs of {count} angles", str(about.get("where", "")))
            i, r = np.ogrid[:count, :count]
            high, low = np.maximum(i, r), np.minimum(i, r)
            values = values[high * (high + 1) // 2 + low]
        return cls([arrays[name] for name in cls.axes], values, **about)

    @property
    def flaws(self) -> dict[str, float]:
        return {"negative": float(np.mean(self.values < 0.0))}

    @property
    def shape(self) -> dict[str, int]:
        return dict(zip(("theta_i", "theta_r", "phi", "channel"), self.values.shape, strict=True))

    @property
    def range(self) -> tuple[float, float]:
        return float(self.values.min()), float(self.values.max())


def nodes(thetas: int = 46, phis: int = 73) -> tuple[Floats, Floats]:
    """The default nodes: `thetas` polar angles and `phis` azimuths.

    The last polar angle is slightly above the horizon, where f has a limit but eval is 0.
    """
    theta = np.linspace(0.0, 0.5 * np.pi, thetas)
    theta[-1] -= 1e-3
    # the nodes are denser around the mirror direction, |phi| = pi
    t = np.linspace(0.0, 1.0, phis)
    return theta, np.pi * np.sin(0.5 * np.pi * t)


def pairs(theta_i: Floats, theta_r: Floats, phi: Floats) -> tuple[Floats, Floats]:
    """wo and wi at every node, (N, 3) each, in the order of the table."""
    i, r, p = (a.ravel() for a in np.meshgrid(theta_i, theta_r, phi, indexing="ij"))
    wi = np.stack([np.sin(i), 0.0 * i, np.cos(i)], -1)
    return np.stack([np.sin(r) * np.cos(p), np.sin(r) * np.sin(p), np.cos(r)], -1), wi


def sampled(value: ops.Value, thetas: int = 46, phis: int = 73, **about: ops.Value) -> Angles:
    """A table of a function value(wo, wi) = f cos theta_i, (N, 3), evaluated at the default nodes."""
    theta, phi = nodes(thetas, phis)
    wo, wi = pairs(theta, theta, phi)
    f = value(wo, wi) / wi[:, 2:]
    return Angles((theta, theta, phi), f.reshape(thetas, thetas, phis, 3), **about)
