"""The charts of a guide (see `gonio.material.guide`): `eval` over (s, phi), and the chart of smallest variance."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..ops import Table
from .guide import Lobe
from .guide_probe import Grid, direction, mean_light

ANGLES = 33  # number of angles of wo, from the normal to the horizon, in steps of 2.8 degrees
FEWER = 17  # number of angles if there are slices along other axes as well
ROWS, COLUMNS = 64, 17  # numbers of nodes of s, and of the azimuth over 180 degrees
ROUND = 33  # number of nodes of the azimuth over 360 degrees, if `eval` is not invariant under rotation
REFINEMENTS = 4  # number of refinements of the tables toward smaller variance; further ones have no effect
JUDGED = 4  # one of this many azimuths of wo is tested
FINE = 2  # number of evaluations of `eval` per step between nodes, along each axis
HORIZON = np.radians(89.7)  # replaces 90 degrees, where the value is 0
COSINES = (0.0005, 0.002, 0.01, 0.03, 0.1, 0.3, 0.6)  # candidate fractions of samples that follow the cosine
NARROWEST = 1e-10  # smallest q, that of lobes 1e-5 wide
WIDTH_ANGLES = (0.12, 0.45, 0.75)  # angles of wo at which a lobe's width is measured, as fractions of 90 degrees
PEAKS, ZOOMS = 801, 3  # directions in the plane of wo that are searched for a lobe's peak, and successive zooms
WIDTH_SHARE = 0.2  # fraction of a lobe's light within q0
MIN_MEAN = 0.25  # lower limit of the refinement, relative to the mean about a node; `eval` may peak between the points
MIN_LIGHT = 1e-20  # light of a slice below which it counts as dark
CHARTS = ("half", "normal", "center")


@dataclass(frozen=True)
class Chart:
    """A chart, as in `guide.Lobe`, for NumPy arrays.

    name    "half", "normal" or "center"
    across  whether it covers the side opposite to wo
    q0      squared width of the narrowest lobe that the chart resolves
    """

    name: str
    across: bool
    q0: float

    @property
    def q_max(self) -> float:
        return 4.0 if self.name == "center" else 2.0

    @property
    def span(self) -> float:
        """log(1 + q_max / q0)."""
        return float(np.log1p(self.q_max / self.q0))

    def direction(
        self, wo: tuple[Grid, ...], s: Grid, phi: NDArray[np.floating], center: tuple[Any, Any]
    ) -> tuple[tuple[Grid, ...], Grid]:
        """(wi, dw / (ds dphi)) at (s, phi), for wo above the surface; wi may lie below.

        center  sine and cosine of the angle between the lobe's center and the normal
        """
        q = self.q0 * np.expm1(s * self.span)
        jacobian = 0.5 * self.span * (q + self.q0)
        radius = np.sqrt(np.maximum(q * (1.0 - 0.25 * q), 0.0))
        x, y, z = radius * np.cos(phi), radius * np.sin(phi), 1.0 - 0.5 * q
        if self.name == "center":
            sine, cosine = center
            x, z = cosine * x + sine * z, cosine * z - sine * x
        if self.name == "half":
            cos = wo[0] * x + wo[1] * y + wo[2] * z
            return tuple(2.0 * cos * m - w for m, w in zip((x, y, z), wo, strict=True)), jacobian * 4.0 * np.maximum(
                cos, 0.0
            )
        return (x, y, z), np.broadcast_to(jacobian, np.broadcast_shapes(jacobian.shape, x.shape))


@dataclass(frozen=True)
class _Fine:
    """`eval` and the cosine-weighted density on the fine grid, as densities over s and phi; (angles, s, phi)."""

    light: Grid
    cosine: Grid


def _steps(count: int, round_: bool) -> tuple[Grid, Grid, Grid]:
    """For an axis of `count` nodes: fine positions in [0, 1], and the matrices from fine values to nodes and back."""
    fine = (np.arange((count - 1) * FINE) + 0.5) / FINE
    hat = np.maximum(1.0 - np.abs(fine[None] - np.arange(count)[:, None]), 0.0)
    gather = hat.copy()
    if round_:  # periodic: the last node is the first
        gather[0] = gather[-1] = gather[0] + gather[-1]
    return fine / (count - 1), gather / gather.sum(1, keepdims=True), hat.T


@dataclass(frozen=True)
class _Best:
    """The tables of one side in its best chart."""

    chart: Chart
    full: bool
    density: Grid
    light: Grid
    centers: Grid
    variance: float
    cosine: float

    @property
    def across(self) -> bool:
        return self.chart.across

    def lobe(self) -> Lobe:
        """The tables in the form that formulas read."""
        span = 2.0 * np.pi if self.full else np.pi
        g = self.density
        steps = np.cumsum(0.5 * (g[..., 1:] + g[..., :-1]), axis=-1) * (span / (g.shape[-1] - 1))
        below = np.concatenate([np.zeros_like(g[..., :1]), steps], axis=-1)
        rows = below[..., -1]
        over_s = np.cumsum(0.5 * (rows[:, 1:] + rows[:, :-1]), axis=-1) / (rows.shape[-1] - 1)
        over_s = np.concatenate([np.zeros_like(rows[:, :1]), over_s], axis=-1)
        return Lobe(
            self.across,
            self.chart.name,
            self.chart.q_max,
            self.full,
            named("density", g[..., None]),
            named("below", below[..., None]),
            named("rows", over_s[..., None]),
            named("scales", np.array([[self.chart.q0, 1.0 / self.chart.span]])),
            named("centers", self.centers),
        )


class Slices:
    """The slices of a guide. Angles of wo vary fastest, then versions of the material, azimuths and sides.

    versions  the material with uniform parameters, one copy per combination of nodes of varying parameters
    azimuths  number of azimuths of wo; 1 if `eval` is invariant under rotation
    sides     sides of wo: 1 above the surface, -1 below
    """

    def __init__(self, versions: list[Any], azimuths: int, sides: list[float]) -> None:
        self.versions, self.azimuths, self.sides = versions, azimuths, sides
        self.full = azimuths > 1
        self.angles = np.linspace(0.0, 0.5 * np.pi, FEWER if self.full or len(versions) > 1 else ANGLES)
        self.s, self._rows, self._from_rows = _steps(ROWS, False)
        phi, self._columns, self._from_columns = _steps(ROUND if self.full else COLUMNS, self.full)
        self.span = 2.0 * np.pi if self.full else np.pi
        # alternating halves, so that an asymmetry is at least averaged
        flip = 1.0 if self.full else np.where(np.arange(len(phi)) % 2 == 0, 1.0, -1.0)
        self.phi = phi * self.span * flip
        self.cell = self.span / (len(self.s) * len(phi))

    @property
    def count(self) -> int:
        return len(self.angles) * len(self.versions) * self.azimuths * len(self.sides)

    def groups(self) -> Iterator[tuple[Any, float, float]]:
        """(version, azimuth, side) of each run of slices over the angles of wo."""
        for side in self.sides:
            for azimuth in range(self.azimuths):
                for version in self.versions:
                    yield version, 2.0 * np.pi * azimuth / self.azimuths, side

    def fine(
        self, chart: Chart, material: Any, angles: Grid, azimuth: float, side: float, centers: Grid | None = None
    ) -> _Fine:
        """`eval` on the fine grid of a chart, for wo at the given angles and azimuth on one side.

        centers  sine and cosine of the angle between the lobe's center and the normal, per angle
        """
        wo = tuple(x[..., None, None] for x in direction(np.minimum(angles, HORIZON), azimuth, 1.0))
        center = np.array([[0.0, 1.0]]) if centers is None else centers
        wi, jacobian = chart.direction(
            wo, self.s[:, None], self.phi, (center[:, 0, None, None], center[:, 1, None, None])
        )
        above = wi[2] > 0.0
        both = 1.0 if self.full else 2.0  # the two halves of the azimuth
        light = np.where(above, self._side_light(material, chart.across, side, wo, wi) * jacobian * both, 0.0)
        cosine = np.where(above, wi[2] * jacobian * (both / np.pi), 0.0)
        shape = (len(angles), len(self.s), len(self.phi))
        return _Fine(np.broadcast_to(light, shape), np.broadcast_to(cosine, shape))

    def best(self, across: bool) -> _Best | None:
        """The chart of smallest variance with its tables; None if that side of the surface is dark.

        across  whether the side is the one opposite to wo
        """
        names = [name for name in CHARTS if not (name == "half" and across) and not (name == "center" and self.full)]
        tried = [best for name in names if (best := self._in_chart(name, across)) is not None]
        return min(tried, key=lambda best: best.variance, default=None)

    def _in_chart(self, name: str, across: bool) -> _Best | None:
        centers = [self._centers(name, version, across, side) for version, _, side in self.groups()]
        groups = list(zip(self.groups(), centers, strict=True))
        widths = [self._width(name, across, group, own) for group, own in groups]
        known = [width for width in widths if width is not None]
        if not known:
            return None
        chart = Chart(name, across, min(known))
        nodes, middles = [], []
        step = JUDGED if self.full else 1
        half_way = 0.5 * (self.angles[1:] + self.angles[:-1])
        turn = np.pi / self.azimuths if self.full else 0.0
        for number, ((version, azimuth, side), own) in enumerate(groups):
            nodes.append(self.fine(chart, version, self.angles, azimuth, side, own))
            if number % step:
                continue
            between = own[1:] + own[:-1]
            between = between / np.maximum(np.linalg.norm(between, axis=1, keepdims=True), 1e-6)
            # midway between slices, the worst case
            middles.append(self.fine(chart, version, half_way, azimuth + turn, side, between))
        return self._judged(chart, nodes, middles, np.concatenate(centers))

    def _judged(self, chart: Chart, nodes: list[_Fine], middles: list[_Fine], centers: Grid) -> _Best:
        """The tables of a chart, with the sampling variance midway between slices.

        nodes    `eval` at the slices
        middles  `eval` midway between them
        """
        light = np.array([fine.light.sum((1, 2)) * self.cell for fine in nodes])
        density = np.array([self._fitted(fine.light) for fine in nodes])
        sums = (_trapezoid(density.shape[-2], 1.0), _trapezoid(density.shape[-1], self.span))
        totals = np.einsum("gakj,k,j->ga", density, *sums)
        density /= np.maximum(totals, MIN_LIGHT)[..., None, None]
        dark = totals <= MIN_LIGHT
        if dark.any() and not dark.all():
            # for wo near a black slice, some samples are drawn from it, so its density must also integrate to 1
            density[dark] = density[~dark].mean(0)
        along = density.reshape(len(self.sides), self.azimuths, len(self.versions), *density.shape[1:])
        mixed = 0.5 * (along[..., 1:, :, :] + along[..., :-1, :, :])
        mixed = 0.5 * (mixed + np.roll(mixed, -1, axis=1)) if self.full else mixed
        mixed = mixed.reshape(len(nodes), *mixed.shape[3:])[:: len(nodes) // len(middles)]
        expected = self._from_rows @ mixed @ self._from_columns.T
        wanted = np.array([fine.light for fine in middles])
        flat = np.array([fine.cosine for fine in middles])
        total = wanted.sum((2, 3)) * self.cell
        lit = total > MIN_LIGHT
        best = (np.inf, COSINES[-1])
        for cosine in COSINES:
            got = (1.0 - cosine) * expected + cosine * flat
            second = np.divide(wanted * wanted, got, out=np.zeros_like(got), where=wanted > 0.0).sum((2, 3)) * self.cell
            variance = float(np.mean(second[lit] / total[lit] ** 2) - 1.0) if np.any(lit) else 0.0
            best = min(best, (variance, cosine))
        shape = (self.count, *density.shape[2:])
        return _Best(chart, self.full, density.reshape(shape), light.ravel(), centers, *best)

    def _fitted(self, light: Grid) -> Grid:
        """Values at the nodes: the means around each, refined to reduce the integral of light^2 / density.

        At the minimum, the mean of (light / density)^2 is the same around every node, so each node is multiplied by
        the square root of this mean, in steps that preserve positivity.
        """
        means = nodes = self._rows @ light @ self._columns.T
        for _ in range(REFINEMENTS):
            density = self._from_rows @ nodes @ self._from_columns.T
            ratio = np.divide(light, density, out=np.zeros_like(light), where=density > 0.0)
            nodes = np.maximum(nodes * np.sqrt(self._rows @ (ratio * ratio) @ self._columns.T), MIN_MEAN * means)
        return nodes

    def _width(self, name: str, across: bool, group: tuple[Any, float, float], centers: Grid) -> float | None:
        """The q within which the fraction `WIDTH_SHARE` of the light lies, averaged over angles; None without light."""
        material, azimuth, side = group
        chart = Chart(name, across, NARROWEST)
        q = np.geomspace(NARROWEST, chart.q_max, 320)
        s = np.log1p(q / chart.q0) / chart.span
        phi = (np.arange(12) + 0.5) * (2.0 * np.pi / 12)
        places = []
        for place in (round(share * (len(self.angles) - 1)) for share in WIDTH_ANGLES):
            wo = direction(self.angles[place], azimuth, 1.0)
            wi, jacobian = chart.direction(wo, s[:, None], phi[None], (centers[place, 0], centers[place, 1]))
            light = self._side_light(material, across, side, wo, wi)
            below = np.cumsum(np.where(wi[2] > 0.0, light * jacobian, 0.0).sum(1))
            if below[-1] > 0.0:
                places.append(q[np.searchsorted(below, WIDTH_SHARE * below[-1])])
        return float(np.exp(np.mean(np.log(places)))) if places else None

    def _centers(self, name: str, material: Any, across: bool, side: float) -> Grid:
        """Sine and cosine of the angle between a lobe's peak and the normal, for each angle of wo."""
        if name != "center":
            return np.tile([0.0, 1.0], (len(self.angles), 1))
        wo = tuple(x[:, None] for x in direction(np.minimum(self.angles, HORIZON), 0.0, 1.0))
        reach, middle = 0.5 * np.pi, np.zeros((len(self.angles), 1))
        for _ in range(ZOOMS):
            angle = np.clip(middle + reach * np.linspace(-1.0, 1.0, PEAKS), -HORIZON, HORIZON)
            light = self._side_light(material, across, side, wo, (np.sin(angle), 0.0 * angle, np.cos(angle)))
            weight = (light / np.maximum(light.max(1, keepdims=True), MIN_LIGHT)) ** 4
            middle = ((weight * angle).sum(1) / np.maximum(weight.sum(1), MIN_LIGHT))[:, None]
            reach *= 8.0 / PEAKS
        return np.concatenate([np.sin(middle), np.cos(middle)], axis=1)

    def _side_light(self, material: Any, across: bool, side: float, wo: tuple[Grid, ...], wi: tuple[Grid, ...]) -> Grid:
        """Mean |eval| for pairs of directions, both of which are given as if they were above the surface."""
        return mean_light(material, (wo[0], wo[1], side * wo[2]), (wi[0], wi[1], (-side if across else side) * wi[2]))


def _trapezoid(count: int, length: float) -> Grid:
    """Trapezoidal weights of the nodes of an axis."""
    weights = np.full(count, length / (count - 1))
    weights[[0, -1]] *= 0.5
    return weights


def named(stem: str, values: Grid) -> Table:
    """A table with a unique name, because one shader may contain two guides."""
    return Table(f"guide_{stem}_{hashlib.sha256(np.ascontiguousarray(values).tobytes()).hexdigest()[:8]}", values)
