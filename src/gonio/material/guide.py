"""Sampling for a material that defines only `eval`: a density proportional to `eval`, tabulated from it.

A guide is tabulated over a *chart*, which maps directions to a distance from an axis and an azimuth about it. A glossy
lobe is charted by half vectors about the surface normal, so that it does not move with the viewer (as in Dupuy2018); a
broad or asymmetric lobe is charted by wi, about the normal or about the lobe's center. Let v be the half vector or wi,
and q = |v - axis|^2 = 2 (1 - cos). The coordinates are phi and

    s = log(1 + q / q0) / log(1 + q_max / q0),    dw = dq dphi / 2,    dq = (q + q0) log(1 + q_max / q0) ds,

so that equal steps of s resolve a lobe of width sqrt(q0) and any wider lobe. A density over (s, phi), called a slice,
is stored for each of a few angles of wo (and, if `eval` depends on them, for azimuths of wo and values of parameters
that vary over the surface). A slice is bilinear between its nodes; between two angles, the density is a mixture of two
slices. A fraction of the samples follows the cosine, to cover light that the nodes miss.

`pdf` is the density of `sample` regardless of the contents of the tables: a poor fit causes noise but no bias.
`guide_search` computes the tables.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from .. import ops
from ..ops import (
    Direction,
    Mask,
    Scalar,
    Table,
    dot,
    fetch,
    function,
    inv_pi,
    maximum,
    minimum,
    safe_sqrt,
    sincos,
    vec3,
    where,
)
from ..ops.backend import Array
from ..optics.frame import half_vector, reflect
from ..optics.warp import square_to_cosine_hemisphere

ALMOST_ONE = 0.99999994  # the largest float32 below 1


class Lobe(NamedTuple):
    """The distribution of light on one side of the surface.

    across   whether it is the side opposite to wo
    chart    "half" (half vectors about the normal), "normal" or "center" (wi about the normal or the lobe's center)
    q_max    largest q of the chart: 2 about the normal, else 4
    full     whether phi covers the full circle and starts at the tangent; else it starts at wo's azimuth and covers one
             of two symmetric halves
    density  density over (s, phi), per slice; its integral over s and phi is 1
    below    integral of the density over phi up to each node, per slice and node of s
    rows     integral of the density over all phi and over s up to each node, per slice
    scales   q0 and 1 / log(1 + q_max / q0)
    centers  sine and cosine of the angle between the lobe's center and the normal, per slice; positive on wo's side
    """

    across: bool
    chart: str
    q_max: float
    full: bool
    density: Table
    below: Table
    rows: Table
    scales: Table
    centers: Table

    def axis(self, place: Place) -> tuple[Scalar, Scalar]:
        """Sine and cosine of the angle between the chart's axis and the normal, in the plane of wo."""
        if self.chart != "center":
            return ops.zeros_like(place.weights[0]), ops.ones_like(place.weights[0])
        x: Array = 0.0
        z: Array = 0.0
        for index, weight in zip(place.slices, place.weights, strict=True):
            sine, cosine = fetch(self.centers, index)
            x, z = x + weight * sine, z + weight * cosine
        scale = ops.rsqrt(maximum(x * x + z * z, 1e-12))
        return x * scale, z * scale

    def chart_of(self, place: Place, wo: Direction, wi: Direction) -> tuple[Scalar, Scalar, Scalar]:
        """(s, phi, dw / (ds dphi)) at a direction wi above the surface, for wo in the x-z plane."""
        v = half_vector(wo, wi) if self.chart == "half" else wi
        sine, cosine = self.axis(place)
        x, z = cosine * v.x - sine * v.z, sine * v.x + cosine * v.z
        # 2 (1 - z), in a form that does not cancel near the axis
        q = where(z > 0.5, 2.0 * (x * x + v.y * v.y) / (1.0 + z), 2.0 * (1.0 - z))
        q0, scale = fetch(self.scales, ops.zeros_like(z))
        jacobian = 0.5 * (q + q0) / scale
        if self.chart == "half":
            jacobian = jacobian * (4.0 * maximum(dot(wo, v), 0.0))
        if self.full:
            phi = ops.atan2(v.y, x)
            phi = where(phi < 0.0, phi + 2.0 * ops.pi, phi)
        else:
            phi = ops.atan2(ops.abs(v.y), x)
        return ops.log(1.0 + q / q0) * scale, phi, jacobian

    def direction(self, place: Place, wo: Direction, s: Scalar, phi: Scalar) -> Direction:
        """The direction at (s, phi), for wo in the x-z plane; it may lie below the surface."""
        q0, scale = fetch(self.scales, ops.zeros_like(s))
        q = minimum(q0 * (ops.exp(s / scale) - 1.0), self.q_max)
        radius, (sin_phi, cos_phi) = safe_sqrt(q * (1.0 - 0.25 * q)), sincos(phi)
        x, y, z = radius * cos_phi, radius * sin_phi, 1.0 - 0.5 * q
        sine, cosine = self.axis(place)
        v = vec3(cosine * x + sine * z, y, cosine * z - sine * x)
        return reflect(wo, v) if self.chart == "half" else v

    @property
    def span(self) -> float:
        """The range of phi: 2 pi or pi."""
        return 2.0 * ops.pi if self.full else ops.pi

    def at(self, index: Scalar, s: Scalar, phi: Scalar) -> Scalar:
        """The density of a slice at (s, phi)."""
        _, rows, columns = self.density.shape
        row, along = _cell(s * (rows - 1.0), rows)
        column, across = _cell(phi * ((columns - 1.0) / self.span), columns)
        (a,), (b,), (c,), (d,) = (
            fetch(self.density, index, row + i, column + j) for i in (0.0, 1.0) for j in (0.0, 1.0)
        )
        return _between(_between(a, b, across), _between(c, d, across), along)

    @function
    def draw(self, index: Scalar, u1: Scalar, u2: Scalar) -> tuple[Scalar, Scalar]:
        """(s, phi) drawn from the density of a slice: first s, from the integrals over phi, then phi for that s."""
        _, rows, columns = self.density.shape

        def row_below(row: Scalar) -> Scalar:
            return fetch(self.rows, index, row)[0]

        def total(row: Scalar) -> Scalar:
            return fetch(self.below, index, row, ops.zeros_like(row) + (columns - 1.0))[0]

        row = _search(row_below, u1, rows)
        along = _in_cell((u1 - row_below(row)) * (rows - 1.0), total(row), total(row + 1.0))

        def column_below(column: Scalar) -> Scalar:
            (low,), (high,) = fetch(self.below, index, row, column), fetch(self.below, index, row + 1.0, column)
            return _between(low, high, along)

        def height(column: Scalar) -> Scalar:
            (low,), (high,) = fetch(self.density, index, row, column), fetch(self.density, index, row + 1.0, column)
            return _between(low, high, along)

        u2 = u2 * column_below(ops.zeros_like(row) + (columns - 1.0))
        column = _search(column_below, u2, columns)
        width = self.span / (columns - 1.0)
        across = _in_cell((u2 - column_below(column)) / width, height(column), height(column + 1.0))
        return (row + along) / (rows - 1.0), (column + across) * width


class Place(NamedTuple):
    """The slices of which a ray's density is a mixture, with their weights."""

    slices: tuple[Scalar, ...]
    weights: tuple[Scalar, ...]


class Axis(NamedTuple):
    """An axis along which slices are stored: a parameter that varies over the surface.

    read    function that returns the parameter's value in a bound material, as a position from 0 to 1
    slices  number of slices along the axis
    """

    read: Callable[[object], Scalar]
    slices: int


class Guide(NamedTuple):
    """The sampling tables of a material.

    lobes      the lobes on wo's side, on the opposite side, or on both; empty if nothing is scattered
    angles     number of slices over the angle of wo, from the normal to the horizon
    azimuths   number of slices over the azimuth of wo; 1 if `eval` is invariant under rotation
    behind     whether slices for wo below the surface follow those for wo above; else both use the same slices
    above      whether light is scattered toward a wo above the surface
    below      whether light is scattered toward a wo below the surface
    axes       parameters that vary over the surface
    shares     fraction of the light in the lobe on the side opposite to wo, per slice
    cosine     fraction of the samples that follow the cosine
    """

    lobes: tuple[Lobe, ...]
    angles: int
    azimuths: int
    behind: bool
    above: bool
    below: bool
    axes: tuple[Axis, ...]
    shares: Table
    cosine: Table

    def pdf(self, material: object, wo: Direction, wi: Direction) -> Scalar:
        """Density of `sample`, 1/sr."""
        visible = self._scattered(wo)
        crosses = wo.z * wi.z < 0.0
        if not self.lobes:
            return where(visible & ~crosses & (wi.z != 0.0), ops.abs(wi.z) * inv_pi, 0.0)
        place = self._place(material, wo)
        turn, above = self._turn(wo), _above(wo)
        (cosine,) = fetch(self.cosine, ops.zeros_like(wo.z))
        both = len({lobe.across for lobe in self.lobes}) == 2
        density: Array = ops.zeros_like(wo.z)
        for lobe in self.lobes:
            on_side = crosses if lobe.across else ~crosses
            local = _in_azimuth(_above(wi), turn)
            s, phi, jacobian = lobe.chart_of(place, _in_azimuth(above, turn), local)
            here: Array = 0.0
            for index, weight in zip(place.slices, place.weights, strict=True):
                here = here + self._share(lobe, index) * weight * lobe.at(index, s, phi)
            here = here * (1.0 if lobe.full else 0.5)
            smooth = (0.5 if both else 1.0) * ops.abs(wi.z) * inv_pi
            mixed = (1.0 - cosine) * ops.safe_div(here, jacobian) + cosine * smooth
            density = where(on_side, mixed, density)
        return where(visible & (wi.z != 0.0), density, 0.0)

    def draw(self, material: object, wo: Direction, u: Direction) -> Direction:
        """A direction drawn for wo; u.x selects the slice and the side. Its pdf is 0 on a side without scattering."""
        broad = square_to_cosine_hemisphere(u.y, u.z)
        facing = where(wo.z < 0.0, -1.0, 1.0)
        if not self.lobes:
            return vec3(broad.x, broad.y, broad.z * facing)
        place = self._place(material, wo)
        turn, above = self._turn(wo), _above(wo)
        (cosine,) = fetch(self.cosine, ops.zeros_like(wo.z))
        by_cosine = u.x < cosine
        rest = where(by_cosine, u.x / cosine, (u.x - cosine) / (1.0 - cosine))
        index, left = _pick(place, minimum(rest, ALMOST_ONE))
        crosses = left < where(by_cosine, 0.5, fetch(self.shares, index)[0])
        chosen: Direction | None = None
        for lobe in self.lobes:
            # the two halves of the azimuth are equal: u2 selects one and is rescaled
            second = u.z if lobe.full else minimum(ops.abs(2.0 * u.z - 1.0), ALMOST_ONE)
            s, phi = lobe.draw(index, u.y, second)
            if not lobe.full:
                phi = where(u.z < 0.5, -phi, phi)
            w = lobe.direction(place, _in_azimuth(above, turn), s, phi)
            # a direction below the surface, which the lobe of the other side may contain, becomes a failed sample:
            # z = 0
            flattened = ops.rsqrt(maximum(w.x * w.x + w.y * w.y, 1e-20))
            w = where(w.z > 0.0, w, vec3(w.x * flattened, w.y * flattened, ops.zeros_like(w.z)))
            w = _in_azimuth(w, vec3(turn.x, -turn.y, turn.z))
            w = where(by_cosine, broad, w)
            w = vec3(w.x, w.y, w.z * (-facing if lobe.across else facing))
            chosen = w if chosen is None else where(crosses if lobe.across else ~crosses, w, chosen)
        assert chosen is not None
        return chosen

    def _scattered(self, wo: Direction) -> Mask:
        if self.above and self.below:
            return wo.z != 0.0
        return wo.z > 0.0 if self.above else wo.z < 0.0

    def _share(self, lobe: Lobe, index: Scalar) -> Scalar:
        """The fraction of a slice's samples in this lobe."""
        (across,) = fetch(self.shares, index)
        return across if lobe.across else 1.0 - across

    def _turn(self, wo: Direction) -> Direction:
        """(cos, sin, 0) of the azimuth at which phi = 0: that of wo, or of the tangent if `eval` depends on wo's
        azimuth."""
        zero = ops.zeros_like(wo.z)
        if self.azimuths > 1:
            return vec3(1.0 + zero, zero, zero)
        squared = wo.x * wo.x + wo.y * wo.y
        scale = ops.rsqrt(maximum(squared, 1e-20))
        at_pole = squared < 1e-20
        return vec3(where(at_pole, 1.0, wo.x * scale), where(at_pole, 0.0, wo.y * scale), zero)

    def _place(self, material: object, wo: Direction) -> Place:
        """The slices adjacent to wo's angle and to the position along every other axis, with their weights."""
        cos = ops.abs(wo.z)
        angle = ops.atan2(safe_sqrt(1.0 - cos * cos), cos) * (2.0 * inv_pi)
        ways = [_cell(angle * (self.angles - 1.0), self.angles)]
        strides, count = [1], self.angles
        for axis in self.axes:
            ways.append(_cell(axis.read(material) * (axis.slices - 1.0), axis.slices))
            strides.append(count)
            count *= axis.slices
        slices, weights = [ops.zeros_like(cos)], [ops.ones_like(cos)]
        for (cell, along), stride in zip(ways, strides, strict=True):
            slices, weights = (
                [index + (cell + step) * float(stride) for step in (0.0, 1.0) for index in slices],
                [weight * (along if step else 1.0 - along) for step in (0, 1) for weight in weights],
            )
        if self.azimuths > 1:
            phi = ops.atan2(wo.y, wo.x) * (0.5 * inv_pi)
            at = where(phi < 0.0, phi + 1.0, phi) * float(self.azimuths)
            cell = minimum(ops.floor(at), self.azimuths - 1.0)
            along, following = at - cell, where(cell + 1.5 > self.azimuths, 0.0, cell + 1.0)
            slices, weights = (
                [index + turn * float(count) for turn in (cell, following) for index in slices],
                [weight * share for share in (1.0 - along, along) for weight in weights],
            )
            count *= self.azimuths
        if self.behind:
            slices = [index + where(wo.z < 0.0, float(count), 0.0) for index in slices]
        return Place(tuple(slices), tuple(weights))


def _above(w: Direction) -> Direction:
    return vec3(w.x, w.y, ops.abs(w.z))


def _in_azimuth(w: Direction, turn: Direction) -> Direction:
    """w in axes rotated by an azimuth given as (cos, sin, 0)."""
    along, across = turn.x * w.x + turn.y * w.y, turn.x * w.y - turn.y * w.x
    return vec3(along, across, w.z)


def _cell(at: Scalar, count: int) -> tuple[Scalar, Scalar]:
    """(node below, fraction of the way to the next) of a position among `count` nodes 0, 1, ..."""
    at = ops.clamp(at, 0.0, count - 1.0)
    cell = minimum(ops.floor(at), count - 2.0)
    return cell, at - cell


def _between(low: Scalar, high: Scalar, share: Scalar) -> Scalar:
    return low + (high - low) * share


def _search(below: Callable[[Scalar], Scalar], u: Scalar, count: int) -> Scalar:
    """The last of the first count - 1 nodes at which `below` is at most u."""
    node: Array = ops.zeros_like(u)
    step = 1 << ((count - 2).bit_length() - 1) if count > 2 else 0
    while step:
        ahead = node + float(step)
        inside = minimum(ahead, count - 2.0)
        node = where((ahead < count - 1.5) & (below(inside) <= u), ahead, node)
        step >>= 1
    return node


@function
def _in_cell(area: Scalar, low: Scalar, high: Scalar) -> Scalar:
    """The x in [0, 1] up to which the integral of a density, linear from `low` at 0 to `high` at 1, is `area`."""
    root = safe_sqrt(low * low + 2.0 * (high - low) * area)
    return ops.clamp(ops.safe_div(2.0 * area, low + root), 0.0, 1.0)


def _pick(place: Place, u: Scalar) -> tuple[Scalar, Scalar]:
    """A slice, chosen by u with probabilities equal to the weights, and u rescaled to [0, 1)."""
    index, start, width = place.slices[0], ops.zeros_like(u), place.weights[0]
    below: Array = place.weights[0]
    for other, weight in zip(place.slices[1:], place.weights[1:], strict=True):
        passed = (u >= below) & (weight > 0.0)
        index, start, width = where(passed, other, index), where(passed, below, start), where(passed, weight, width)
        below = below + weight
    return index, ops.clamp(ops.safe_div(u - start, width), 0.0, ALMOST_ONE)
