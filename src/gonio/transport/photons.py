"""A photon map: particles are stored where they arrive, for estimating the incident light at a point.

The map is a grid of cells whose width is the diameter of a search. It is hashed so that a row of cells along x is
contiguous in memory; all particles within the radius of a point are then in four rows. Particles are sorted by cell and
by number, so sums over particles do not depend on the machine or on the order of computation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import ModuleType

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from ..bridge.faults.borrowed_memory import own
from ..bridge.types import Float, Mask, OfVariant, Point, Radiance, UInt, Vector
from . import sampler

ROW = 4096  # number of distinct cells along x; particles farther out are assigned to the outermost cells
LEVEL = 0.25  # largest distance of a particle from the tangent plane at the point, as a fraction of the radius
FACING = 0.9  # smallest cosine between the normals, which excludes particles beyond an edge
VISITED = 16  # approximate number of particles visited per row
CUBES = 1 << 16  # number of entries of a `PhotonDensity`
FIELDS = 16  # number of values per particle, see `Photon.packed`


@dataclass
class Photon:
    """A stored particle.

    position, normal  position, and geometric normal of the surface, which is independent of the side of arrival
    direction         unit vector toward the origin of the particle, away from the surface
    flux              flux of the particle
    density           `sources.Particle.density` at the lamp, divided by the squared index of refraction at the lamp
    depth             number of segments of the path
    second            whether the particle has been stored before and this is its second surface
    """

    position: Point
    normal: Vector
    direction: Vector
    flux: Radiance
    density: Float
    depth: UInt
    second: Mask

    @staticmethod
    def none(mi: ModuleType) -> Photon:
        """A particle without flux."""
        zero = mi.Vector3f(0)
        return Photon(mi.Point3f(0), zero, zero, mi.Spectrum(0), mi.Float(0), mi.UInt32(0), mi.Bool(False))

    def packed(self) -> list[Float]:
        """The particle as a list of FIELDS values."""
        mi_float = type(self.density)
        flux = list(self.flux) + [mi_float(0)] * (4 - len(self.flux))
        first = [*self.position, *self.normal, mi_float(self.depth), self.density]
        return [*first, *self.direction, dr.select(self.second, mi_float(1), 0), *flux]

    @staticmethod
    def unpacked(mi: ModuleType, record: OfVariant, like: Radiance) -> Photon:
        """A particle from the values of `packed`, with a flux of the same type as `like`."""
        values = [record[i // 4, i % 4] for i in range(FIELDS)]
        return Photon(
            mi.Point3f(*values[:3]),
            mi.Normal3f(*values[3:6]),
            mi.Vector3f(*values[8:11]),
            type(like)(*values[12 : 12 + len(like)]),
            values[7],
            mi.UInt32(values[6]),
            values[11] > 0,
        )


@dataclass
class Search:
    """A search for particles near a point, on the surface of this point.

    On surfaces with a similar normal, particles from both sides are accepted, because a rough surface may transmit
    light. On surfaces with the opposite normal, which may be parts of the same mesh, only particles that arrived on the
    side of `back` are accepted.

    place, normal  the point, and the normal of its surface
    back           direction toward the viewer
    u              a random number in [0, 1), see `PhotonMap.gather`
    """

    place: Point
    normal: Vector
    back: Vector
    u: Float

    def accepts(self, photon: Photon, radius: Float) -> Mask:
        """Whether a particle is within the radius, close to the tangent plane at the point, and on a matching side."""
        offset = photon.position - self.place
        distance2, height = dr.squared_norm(offset), dr.dot(offset, self.normal)
        near = (distance2 < dr.square(radius)) & (abs(height) < LEVEL * radius)
        alike = dr.dot(self.normal, photon.normal)
        other_side = dr.dot(self.normal, self.back) * dr.dot(photon.normal, photon.direction) < 0
        return near & ((alike > FACING) | ((alike < -FACING) & other_side))


class PhotonMap:
    """Particles, indexed by position. `radius` is kernel data, so changing it does not recompile kernels."""

    def __init__(self, mi: ModuleType, photons: Sequence[Photon], landed: Sequence[Mask], radius: float):
        self.mi = mi
        self.radius = dr.opaque(mi.Float, radius)
        self.per_cell = dr.opaque(mi.Float, 0.5 / radius)
        self.low = dr.opaque(mi.Int32, -(ROW // 2))  # lowest cell along x, with the scene's origin in the middle
        rows, columns = [], []
        for photon, there in zip(photons, landed, strict=True):
            cell = [mi.Int32(dr.floor(x * self.per_cell)) for x in photon.position]
            values = photon.packed()
            there = there & dr.isfinite(sum(values[1:], values[0]))
            rows.append(self._hashed(cell[1], cell[2]))
            columns.append(dr.select(there, self._along(cell[0]), ROW))
        dr.eval(rows, columns)
        column = np.concatenate([np.array(one) for one in columns])
        stored = np.flatnonzero(column < ROW)
        self.count = len(stored)
        # At least twice as many rows as particles: with more rows, building and reading takes longer; with fewer rows,
        # collisions are more frequent.
        bits = max(self.count.bit_length() + 1, 10)
        row = np.concatenate([np.array(one) for one in rows])[stored] & np.uint32((1 << bits) - 1)
        key = row + column[stored]
        self.mask = dr.opaque(mi.UInt32, (1 << bits) - 1)
        keys = (1 << bits) + ROW
        starts = np.zeros(keys + 1, np.uint32)
        np.cumsum(np.bincount(key, minlength=keys), out=starts[1:])
        self.starts = own(mi.UInt32, starts)
        rank = np.zeros(len(column), np.uint32)
        rank[stored[_sorted(key)]] = np.arange(self.count, dtype=np.uint32)
        self.values = dr.empty(mi.Float, max(self.count, 1) * FIELDS)
        first = 0
        for photon, along in zip(photons, columns, strict=True):
            last = first + len(along)
            at = own(mi.UInt32, rank[first:last])
            dr.scatter(self.values, mi.Matrix4f(*photon.packed()), at, along < ROW)
            first = last
        dr.eval(self.values)

    def _hashed(self, y: UInt, z: UInt) -> UInt:
        mi = self.mi
        return sampler.mix(mi.UInt32(y), mi.UInt32(z))

    def _row(self, y: UInt, z: UInt) -> UInt:
        return self._hashed(y, z) & self.mask

    def _along(self, x: UInt) -> UInt:
        return self.mi.UInt32(dr.clip(x - self.low, 0, ROW - 1))

    def gather(
        self,
        search: Search,
        zero: Radiance,
        visit: Callable[[Photon, Float, Mask], Radiance],
        active: Mask,
        within: float = 0.0,
    ) -> tuple[Radiance, Radiance]:
        """The sum of `visit(particle, weight, mask)` over the particles of a search, and its excess over a second sum.

        The weight depends on the distance, in 1/m^2: it is a paraboloid over the disk of the search, with integral 1.
        Where particles are dense, only every second, third, ... particle of a row is visited, starting with one
        selected by the random number of the search, and its weight is multiplied accordingly. The second sum is that of
        a search with the fraction `within` of the radius; the excess is 0 if `within` is 0.
        """
        mi, radius2 = self.mi, dr.square(self.radius)
        rows = self._rows(search)

        def step(number: UInt, y: UInt, z: UInt, at: UInt, end: UInt, stride: UInt, total: Radiance, excess: Radiance):
            # type: ignore[no-untyped-def]
            here = at < end
            photon = Photon.unpacked(mi, dr.gather(mi.Matrix4f, self.values, at, here), zero)
            position = photon.position
            here &= search.accepts(photon, self.radius)
            # rows of other cells may have the same hash
            here &= mi.Int32(dr.floor(position.y * self.per_cell)) == y
            here &= mi.Int32(dr.floor(position.z * self.per_cell)) == z
            distance2 = dr.squared_norm(position - search.place)
            weight = (1 - distance2 / radius2) * (2 / (dr.pi * radius2)) * mi.Float(stride)
            light = dr.select(here, visit(photon, weight, here), 0)
            total = total + light
            if within:
                inner2 = radius2 * (within * within)
                inner = (1 - distance2 / inner2) * (2 / (dr.pi * inner2)) * mi.Float(stride)
                excess = excess + light * (1 - dr.select(distance2 < inner2, inner / weight, 0))
            at = at + stride
            over = at >= end
            following = rows(number + 1, over)
            y, z, at, end, stride = (
                dr.select(over, new, old) for new, old in zip(following, (y, z, at, end, stride), strict=True)
            )
            return number + dr.select(over, mi.UInt32(1), 0), y, z, at, end, stride, total, excess

        begin = mi.UInt32(dr.select(active, mi.UInt32(0), 4))
        state = (begin, *rows(begin, active), zero, type(zero)(zero))
        result = dr.while_loop(state, lambda number, *_: number < 4, step, mode="symbolic", label="photons")
        return result[-2], result[-1]

    def _rows(self, search: Search) -> Callable[[UInt, Mask], tuple[UInt, UInt, UInt, UInt, UInt]]:
        """A function that maps the number of a row, 0 to 3, to cell in y, cell in z, first particle, end and stride.

        If the search covers fewer than four rows, the remaining rows are empty.
        """
        mi = self.mi
        low = [mi.Int32(dr.floor((x - self.radius) * self.per_cell)) for x in search.place]
        high = [mi.Int32(dr.floor((x + self.radius) * self.per_cell)) for x in search.place]
        along = self._along(low[0]), self._along(high[0]) + 1

        def row(number: UInt, wanted: Mask) -> tuple[UInt, UInt, UInt, UInt, UInt]:
            up, far = (number & 1) != 0, (number & 2) != 0
            y, z = dr.select(up, high[1], low[1]), dr.select(far, high[2], low[2])
            there = wanted & (number < 4) & (~up | (high[1] != low[1])) & (~far | (high[2] != low[2]))
            begin = self._row(y, z)
            first = dr.gather(mi.UInt32, self.starts, begin + along[0], there)
            last = dr.select(there, dr.gather(mi.UInt32, self.starts, begin + along[1], there), first)
            stride = 1 + (last - first) // VISITED
            return y, z, first + dr.minimum(mi.UInt32(search.u * mi.Float(stride)), stride - 1), last, stride

        return row


def _sorted(key: NDArray[np.uint32]) -> NDArray[np.intp]:
    """The indices that sort keys stably.

    The keys are sorted by 16 bits at a time, for which NumPy uses radix sort; sorting by 32 bits takes twice as long.
    """
    order = np.argsort(key.astype(np.uint16), kind="stable")
    return order[np.argsort((key[order] >> 16).astype(np.uint16), kind="stable")]


class PhotonDensity:
    """The approximate number of arriving particles per unit area, computed once from one map, per cube of space.

    The density only determines MIS weights, which are valid for any density as long as all estimators use the same one.
    """

    def __init__(self, mi: ModuleType, photon: Photon, landed: Mask, width: float, traced: int):
        self.mi = mi
        self.per_cell = dr.opaque(mi.Float, 1 / width)
        place = self._place(photon.position)
        dr.eval(place, landed)
        counts = np.bincount(np.array(place)[np.array(landed)], minlength=CUBES)
        self.values = own(mi.Float, (counts / (traced * width**2)).astype(np.float32))

    @staticmethod
    def nowhere(mi: ModuleType) -> PhotonDensity:
        """The density before the first map exists: 0 everywhere. It uses the same kernel as other densities."""
        photon = Photon.none(mi)
        return PhotonDensity(mi, photon, mi.Bool(False), 1.0, 1)

    def at(self, place: Point) -> Float:
        """The density at a point, 1/m^2, per traced particle."""
        return dr.gather(self.mi.Float, self.values, self._place(place))

    def _place(self, point: Point) -> UInt:
        mi = self.mi
        x, y, z = (mi.UInt32(mi.Int32(dr.floor(v * self.per_cell))) for v in point)
        return sampler.mix(sampler.mix(x, y), z) & (CUBES - 1)
