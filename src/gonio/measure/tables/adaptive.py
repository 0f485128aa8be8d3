"""Tables in coordinates adapted to the distribution of normals of the material, as in the RGL's files (Dupuy2018)."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ... import ops
from ...errors import InputError
from ...material.angular_range import AngularRange, of_nodes
from ...ops import Direction, Scalar, Spectrum, backend, copysign, dot, floor, maximum, sqrt, vec3, where
from ...optics.frame import reflect
from ..angles import azimuth, direction
from ..warp import Nodes, Slices, Warp, named
from .base import Floats, Measurement, axis, finite, in_rgb, of_channels, padded

ROUNDING = 1e-6  # relative to the largest density; smaller negative densities are noise: one of nine files has -1e-10
TINY_JACOBIAN = 1e-6  # as in Mitsuba's `measured`, so that densities agree at the normal too


class Adaptive(Measurement):
    """A table over warped half vectors for each view direction (Dupuy2018, sec. 4).

    A half vector m corresponds to a point of the unit square, u = (sqrt(2 theta_m / pi), phi_m / 2 pi + 1/2). For each
    view direction, `vndf` is the density of the visible normals over this square. The coordinates of the table are the
    two numbers s for which sampling from this density yields m: f cos theta_i = rgb(s) ndf(u) / (4 sigma). The table is
    therefore densest in the lobe.

    The arrays are phi_i and theta_i (nodes of the view direction), ndf and sigma (phi, theta), vndf (phi_i, theta_i,
    phi_m, theta_m), luminance (phi_i, theta_i, y, x) and values (phi_i, theta_i, channel, y, x). All are interpolated
    bilinearly between nodes, which include the edges. The table is isotropic if phi_i has at most 2 entries. Beyond the
    last viewing angle, the values at this angle are used.
    """

    name = "adaptive"
    sums = True
    axes: ClassVar[Mapping[str, str]] = {"phi_i": "azimuth of view, rad", "theta_i": "angle of view, rad"}

    def __init__(
        self,
        arrays: Mapping[str, NDArray[np.generic]],
        jacobian: bool = True,
        where: str = "",
        title: str = "",
        source: Mapping[str, str] | None = None,
        wavelengths: Floats | None = None,
    ) -> None:
        super().__init__(title, source, wavelengths)
        self.phi = axis(arrays["phi_i"], "phi_i", where, -np.pi, 2.0 * np.pi)
        self.theta = axis(arrays["theta_i"], "theta_i", where, 0.0, 0.5 * np.pi)
        parts = ("ndf", "sigma", "vndf", "luminance", "values")
        self.ndf, self.sigma, self.vndf, self.luminance, self.values = (
            finite(arrays[name], name, where) for name in parts
        )
        self.jacobian = bool(jacobian)
        views = (len(self.phi), len(self.theta))
        for name, part, rank in (("ndf", self.ndf, 2), ("sigma", self.sigma, 2), ("vndf", self.vndf, 4)):
            if part.ndim != rank or min(part.shape[-2:]) < 2 or (rank == 4 and part.shape[:2] != views):
                raise InputError(f"{name} has shape {part.shape}, which does not fit {views} views", where)
        channels = 3 if wavelengths is None else len(wavelengths)
        if self.luminance.ndim != 4 or self.luminance.shape[:2] != views or min(self.luminance.shape[2:]) < 2:
            raise InputError(f"luminance has shape {self.luminance.shape}, which does not fit {views} views", where)
        if self.values.shape != (*views, channels, *self.luminance.shape[2:]):
            raise InputError(f"the values have shape {self.values.shape}, which does not fit the luminance", where)
        for name, part in (("vndf", self.vndf), ("luminance", self.luminance)):
            if part.min() < -ROUNDING * part.max() or part.max() <= 0.0:
                raise InputError(
                    f"{name} is a density, and has values from {part.min():.3g} to {part.max():.3g}",
                    where,
                    "the file is damaged",
                )
        if self.sigma.min() <= 0.0 or self.ndf.min() < 0.0:
            raise InputError("sigma is not positive, or ndf negative, somewhere", where, "the file is damaged")

    # ------------------------------------------------------------------ as formulas

    @property
    def angular_range(self) -> AngularRange:
        return of_nodes(self.theta, np.zeros(0), np.zeros(0))

    @property
    def isotropic(self) -> bool:
        return len(self.phi) <= 2

    @cached_property
    def _reduction(self) -> int:
        """The number of symmetric sectors in a full turn; one is measured, and the others are its mirror images."""
        span = self.phi[-1] - self.phi[0]
        return 1 if self.isotropic else max(1, round(2.0 * np.pi / span))

    @cached_property
    def _phis(self) -> Nodes:
        return Nodes("phi_i", self.phi)

    @cached_property
    def _thetas(self) -> Nodes:
        return Nodes("theta_i", self.theta)

    @cached_property
    def _visible(self) -> Warp:
        return Warp("visible_normals", self.vndf.reshape(-1, *self.vndf.shape[2:]))

    @cached_property
    def _bright(self) -> Warp:
        return Warp("luminance", self.luminance.reshape(-1, *self.luminance.shape[2:]))

    @cached_property
    def _ndf(self) -> ops.Table:
        return named("ndf", self.ndf[..., None])

    @cached_property
    def _sigma(self) -> ops.Table:
        return named("sigma", self.sigma[..., None])

    @cached_property
    def _colours(self) -> ops.Table:
        rgb = in_rgb(np.moveaxis(self.values, 2, -1), self.wavelengths)
        return named("rgb", padded(rgb.reshape(-1, *rgb.shape[2:])))

    def _folded(self, wo: Direction, wi: Direction) -> tuple[Direction, Direction]:
        """Both directions, mirrored if necessary, so that wo lies within the measured azimuths."""
        if self._reduction < 2:
            return wo, wi
        flip_y = -copysign(1.0 + 0.0 * wo.y, wo.y)
        flip_x = -copysign(1.0 + 0.0 * wo.x, wo.x) if self._reduction == 4 else flip_y
        return vec3(wo.x * flip_x, wo.y * flip_y, wo.z), vec3(wi.x * flip_x, wi.y * flip_y, wi.z)

    def _slices(self, wo: Direction) -> tuple[Slices, Scalar]:
        """The measured view directions adjacent to wo with their weights, and the azimuth of wo."""
        theta, phi = polar(wo), azimuth(wo)
        row, t = self._thetas.find(theta)
        if len(self.phi) == 1:
            return [(row, 1.0 - t), (row + 1.0, t)], phi
        column, p = self._phis.find(phi)
        count = float(len(self.theta))
        first, second = column * count + row, (column + 1.0) * count + row
        pairs = [(first, (1.0 - t) * (1.0 - p)), (first + 1.0, t * (1.0 - p))]
        return [*pairs, (second, (1.0 - t) * p), (second + 1.0, t * p)], phi

    def _square(self, m: Direction, phi: Scalar) -> tuple[Scalar, Scalar]:
        """The point of the unit square that corresponds to a half vector."""
        turn = azimuth(m) - phi if self.isotropic else azimuth(m)
        y = turn * (0.5 / ops.pi) + 0.5
        return sqrt(polar(m) * (2.0 / ops.pi)), y - floor(y)

    @ops.function
    def value(self, wo: Direction, wi: Direction) -> Spectrum:
        """f cos theta_i = rgb(s) ndf(u_m) / (4 sigma(u_o)) (Dupuy2018, eq. 3)."""
        wo, wi = self._folded(wo, wi)
        slices, phi = self._slices(wo)
        x, y = self._square(ops.normalize(wo + wi), phi)
        place = self._visible.invert(slices, x, y)
        colour = of_channels(bilinear(self._colours, place.x, place.y, slices))
        return colour * self._factor(wo, x, y, phi) if self.jacobian else colour

    def _factor(self, wo: Direction, x: Scalar, y: Scalar, phi: Scalar) -> Scalar:
        """ndf(u_m) / (4 sigma(u_o))."""
        (density,) = bilinear(self._ndf, x, y)
        (area,) = bilinear(self._sigma, sqrt(polar(wo) * (2.0 / ops.pi)), phi * (0.5 / ops.pi) + 0.5)
        return density / (4.0 * area)

    @ops.function
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """The density of the visible normal times the density of s, converted to solid angle of wi."""
        wo, wi = self._folded(wo, wi)
        m = ops.normalize(wo + wi)
        slices, phi = self._slices(wo)
        x, y = self._square(m, phi)
        place = self._visible.invert(slices, x, y)
        return place.pdf * self._bright.pdf(slices, place.x, place.y) / _jacobian(x, m, wi)

    @ops.function
    def draw(self, wo: Direction, u: Direction) -> tuple[Direction, Scalar]:
        """Sample s from the luminance, then the normal from `vndf`, and reflect wo about the normal."""
        folded, _ = self._folded(wo, wo)
        slices, phi = self._slices(folded)
        bright = self._bright.sample(slices, u.y, u.z)
        visible = self._visible.sample(slices, bright.x, bright.y)
        turn = (2.0 * visible.y - 1.0) * ops.pi
        m = direction(visible.x * visible.x * (0.5 * ops.pi), turn + phi if self.isotropic else turn)
        mirrored = reflect(folded, m)
        pdf = visible.pdf * bright.pdf / _jacobian(visible.x, m, mirrored)
        _, wi = self._folded(wo, mirrored)  # mirroring is its own inverse
        return wi, where(dot(folded, m) > 0.0, pdf, 0.0)

    # ------------------------------------------------------------------ as numbers

    def nodes(self) -> tuple[Floats, Floats, Floats]:
        """wo and wi for every value of an isotropic table, (theta_i, y, x, 3), and the factor between a value and
        f cos theta_i."""
        types = backend.types("float64")
        shape = (len(self.theta), *self.luminance.shape[2:])
        view, y, x = (a.ravel() for a in np.meshgrid(*map(np.arange, shape), indexing="ij"))
        row, at_x, at_y = (backend.float_of(a, types) for a in (view, x / (shape[2] - 1), y / (shape[1] - 1)))
        wo = direction(backend.float_of(self.theta[view], types), row * 0.0)
        visible = self._visible.sample([(row, 1.0 + 0.0 * row)], at_x, at_y)
        m = direction(visible.x * visible.x * (0.5 * ops.pi), (2.0 * visible.y - 1.0) * ops.pi)
        factor = self._factor(wo, visible.x, visible.y, 0.0 * row)
        o, i = (backend.to_numpy(w, len(view)).reshape(*shape, 3) for w in (wo, reflect(wo, m)))
        return o, i, backend.to_numpy(factor, len(view)).reshape(shape)

    def arrays(self) -> dict[str, NDArray[np.generic]]:
        return {
            "phi_i": self.phi,
            "theta_i": self.theta,
            "ndf": self.ndf,
            "sigma": self.sigma,
            "vndf": self.vndf,
            "luminance": self.luminance,
            "values": self.values,
            "jacobian": np.array([self.jacobian], np.uint8),
        }

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[np.generic]], **about: ops.Value) -> Adaptive:
        return cls(arrays, bool(arrays["jacobian"].ravel()[0]), **about)

    @property
    def flaws(self) -> dict[str, float]:
        return {"negative": float(np.mean(self.values < 0.0))}

    @property
    def shape(self) -> dict[str, int]:
        phi, theta, channels, y, x = self.values.shape
        return {"phi_i": phi, "theta_i": theta, "channel": channels, "y": y, "x": x}

    @property
    def range(self) -> tuple[float, float]:
        return float(self.values.min()), float(self.values.max())


@ops.function
def polar(w: Direction) -> Scalar:
    """The angle between a direction and the normal, computed from the chord: 2 asin(|w - z| / 2)."""
    chord2 = w.x * w.x + w.y * w.y + (w.z - 1.0) * (w.z - 1.0)
    return 2.0 * ops.atan2(sqrt(chord2), ops.safe_sqrt(4.0 - chord2))


@ops.function
def _jacobian(x: Scalar, m: Direction, wi: Direction) -> Scalar:
    """d omega_i / du: a factor 4 (wi.m) for the reflection and a factor 2 pi^2 x sin theta_m for the unit square."""
    sin = ops.safe_sqrt(m.x * m.x + m.y * m.y)
    return maximum((2.0 * ops.pi**2) * x * sin, TINY_JACOBIAN) * (4.0 * ops.abs(dot(wi, m)))


def bilinear(table: ops.Table, x: Scalar, y: Scalar, slices: Slices | None = None) -> tuple[Scalar, ...]:
    """All channels of a table over the unit square, interpolated bilinearly; its outermost nodes lie on the edges.

    slices  a mixture of slices; None for a table without slices
    """
    rows, columns = table.shape[-2:]
    at_x, at_y = ops.clamp(x, 0.0, 1.0) * (columns - 1.0), ops.clamp(y, 0.0, 1.0) * (rows - 1.0)
    column, row = ops.minimum(floor(at_x), columns - 2.0), ops.minimum(floor(at_y), rows - 2.0)
    tx, ty = at_x - column, at_y - row
    total: list[ops.Value] = [0.0] * table.channels
    unsliced: list[tuple[Scalar | None, ops.Value]] = [(None, 1.0)]
    for one, weight in slices or unsliced:
        for dy, wy in ((0.0, 1.0 - ty), (1.0, ty)):
            for dx, wx in ((0.0, 1.0 - tx), (1.0, tx)):
                place = (row + dy, column + dx) if one is None else (one, row + dy, column + dx)
                texel = ops.fetch(table, *place)
                share = weight * wy * wx
                total = [sum_ + share * channel for sum_, channel in zip(total, texel, strict=True)]
    return tuple(total)
