"""A map of particles that lie where they have arrived: how much light comes to a place, and from where.

The map is a grid of cells as wide as a search (two radii), hashed so that a row of cells along x is one row of memory:
what may lie within the radius of a place stands in four such rows. Particles are sorted by cell and by number, so that
sums over them do not depend on who computed them, or in what order.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import ModuleType

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from ..bridge.faults.borrowed_memory import own
from ..bridge.types import Float, Mask, Point, Radiance, UInt, Vector
from . import sampler

ROW = 4096  # cells along x that keep apart; what lies further is counted as lying in the last
LEVEL = 0.25  # of the radius: how far from the plane of a place a particle may lie,
FACING = 0.9  # and cosine of the angle between normals: what lies around an edge is elsewhere
VISITED = 16  # particles of a row, about
CUBES = 1 << 16  # entries of a PhotonDensity
FIELDS = 16  # numbers of a particle, see Photon


@dataclass
class Photon:
    """A particle at rest.

    position, normal  where it lies, and the geometric normal of the surface there, whatever side it has come to
    direction         where it came from, a unit vector away from the surface
    flux              its share of the light
    density           of étendue at its lamp, `sources.Particle.density`, over the square of the index there
    depth             segments that it has behind it
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
        """One that carries nothing."""
        zero = mi.Vector3f(0)
        return Photon(mi.Point3f(0), zero, zero, mi.Spectrum(0), mi.Float(0), mi.UInt32(0), mi.Bool(False))

    def packed(self) -> list[Float]:
        """Sixteen numbers: what a search compares, then what it needs of those that it finds."""
        mi_float = type(self.density)
        flux = list(self.flux) + [mi_float(0)] * (4 - len(self.flux))
        first = [*self.position, *self.normal, mi_float(self.depth), self.density]
        return [*first, *self.direction, dr.select(self.second, mi_float(1), 0), *flux]


class PhotonMap:
    """Particles, found by place. `radius` is data of the kernel like the particles: changed, it compiles nothing."""

    def __init__(self, mi: ModuleType, photons: Sequence[Photon], landed: Sequence[Mask], radius: float):
        self.mi = mi
        self.radius = dr.opaque(mi.Float, radius)
        self.per_cell = dr.opaque(mi.Float, 0.5 / radius)
        self.low = dr.opaque(mi.Int32, -(ROW // 2))  # of cells along x, about the origin of the scene
        rows, columns = [], []
        for photon, there in zip(photons, landed, strict=True):
            cell = [mi.Int32(dr.floor(x * self.per_cell)) for x in photon.position]
            values = photon.packed()
            there = there & dr.isfinite(sum(values[1:], values[0]))
            rows.append(self._hashed(cell[1], cell[2]))
            columns.append(dr.select(there, self._along(cell[0]), ROW))
        dr.eval(rows, columns)
        column = np.concatenate([np.array(one) for one in columns])
        lie = np.flatnonzero(column < ROW)
        self.count = len(lie)
        # Twice as many rows as particles, at least: more take longer to make and to read, fewer have them meet.
        bits = max(self.count.bit_length() + 1, 10)
        row = np.concatenate([np.array(one) for one in rows])[lie] & np.uint32((1 << bits) - 1)
        key = row + column[lie]
        self.mask = dr.opaque(mi.UInt32, (1 << bits) - 1)
        keys = (1 << bits) + ROW
        starts = np.zeros(keys + 1, np.uint32)
        np.cumsum(np.bincount(key, minlength=keys), out=starts[1:])
        self.starts = own(mi.UInt32, starts)
        rank = np.zeros(len(column), np.uint32)
        rank[lie[_sorted(key)]] = np.arange(self.count, dtype=np.uint32)
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
        place: Point,
        normal: Vector,
        back: Vector,
        u: Float,
        zero: Radiance,
        visit: Callable[[Photon, Float, Mask], Radiance],
        active: Mask,
        within: float = 0.0,
    ) -> tuple[Radiance, Radiance]:
        """Sum over the particles around a place: `visit(particle, weight by distance in 1/m^2, mask)`; and by how much
        it is above the sum over those `within` that part of the radius, where this is not 0.

        On surfaces that face the same way they count whichever side they have come to, since a rough one may let light
        through; on those that face the other way, as parts of one mesh may, if they have come to the side of `back`, a
        direction toward who looks.

        The weight is a paraboloid over the disc of the radius, with the integral 1. Where they lie close, every second,
        third, ... one of a row is visited, from one on that the random number `u` chooses, and stands for the others.
        """
        mi, radius2 = self.mi, dr.square(self.radius)
        low = [mi.Int32(dr.floor((x - self.radius) * self.per_cell)) for x in place]
        high = [mi.Int32(dr.floor((x + self.radius) * self.per_cell)) for x in place]
        along = self._along(low[0]), self._along(high[0]) + 1

        def row(number: UInt, wanted: Mask) -> tuple[UInt, UInt, UInt, UInt, UInt]:
            """(cell in y, in z, first and last particle, step) of one of the four rows; empty where there are fewer."""
            up, far = (number & 1) != 0, (number & 2) != 0
            y, z = dr.select(up, high[1], low[1]), dr.select(far, high[2], low[2])
            there = wanted & (number < 4) & (~up | (high[1] != low[1])) & (~far | (high[2] != low[2]))
            begin = self._row(y, z)
            first = dr.gather(mi.UInt32, self.starts, begin + along[0], there)
            last = dr.select(there, dr.gather(mi.UInt32, self.starts, begin + along[1], there), first)
            stride = 1 + (last - first) // VISITED
            return y, z, first + dr.minimum(mi.UInt32(u * mi.Float(stride)), stride - 1), last, stride

        def step(number: UInt, y: UInt, z: UInt, at: UInt, end: UInt, stride: UInt, total: Radiance, above: Radiance):  # type: ignore[no-untyped-def]
            here = at < end
            record = dr.gather(mi.Matrix4f, self.values, at, here)
            near = [record[i // 4, i % 4] for i in range(8)]
            position, other = mi.Point3f(*near[:3]), mi.Normal3f(*near[3:6])
            offset = position - place
            distance2, height = dr.squared_norm(offset), dr.dot(offset, normal)
            here &= (distance2 < radius2) & (abs(height) < LEVEL * self.radius)
            alike, came = dr.dot(normal, other), mi.Vector3f(*(record[2, i] for i in range(3)))
            other_side = dr.dot(normal, back) * dr.dot(other, came) < 0
            here &= (alike > FACING) | ((alike < -FACING) & other_side)
            # rows of other cells may share their memory
            here &= mi.Int32(dr.floor(position.y * self.per_cell)) == y
            here &= mi.Int32(dr.floor(position.z * self.per_cell)) == z
            rest = [record[i // 4, i % 4] for i in range(8, 16)]
            flux = type(zero)(*rest[4 : 4 + len(zero)])
            photon = Photon(position, other, mi.Vector3f(*rest[:3]), flux, near[7], mi.UInt32(near[6]), rest[3] > 0)
            weight = (1 - distance2 / radius2) * (2 / (dr.pi * radius2)) * mi.Float(stride)
            light = dr.select(here, visit(photon, weight, here), 0)
            total = total + light
            if within:
                inner2 = radius2 * (within * within)
                inner = (1 - distance2 / inner2) * (2 / (dr.pi * inner2)) * mi.Float(stride)
                above = above + light * (1 - dr.select(distance2 < inner2, inner / weight, 0))
            at = at + stride
            over = at >= end
            following = row(number + 1, over)
            y, z, at, end, stride = (
                dr.select(over, new, old) for new, old in zip(following, (y, z, at, end, stride), strict=True)
            )
            return number + dr.select(over, mi.UInt32(1), 0), y, z, at, end, stride, total, above

        begin = mi.UInt32(dr.select(active, mi.UInt32(0), 4))
        state = (begin, *row(begin, active), zero, type(zero)(zero))
        result = dr.while_loop(state, lambda number, *_: number < 4, step, mode="symbolic", label="photons")
        return result[-2], result[-1]


def _sorted(key: NDArray[np.uint32]) -> NDArray[np.intp]:
    """The order of keys, the first first among equals: one of whole numbers, the same whoever sorts.

    By 16 bits at a time, which NumPy sorts by counting: 32 bits take twice as long.
    """
    order = np.argsort(key.astype(np.uint16), kind="stable")
    return order[np.argsort((key[order] >> 16).astype(np.uint16), kind="stable")]


class PhotonDensity:
    """How many particles arrive per area, roughly: a number for each cube of space, from one map, that then stays.

    Weights are made of it, and any number will do for those, as long as it is the same whoever asks.
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
        """No particles, before the first map exists; to a kernel it is like any other."""
        photon = Photon.none(mi)
        return PhotonDensity(mi, photon, mi.Bool(False), 1.0, 1)

    def at(self, place: Point) -> Float:
        """1/m^2, of one particle that is traced."""
        return dr.gather(self.mi.Float, self.values, self._place(place))

    def _place(self, point: Point) -> UInt:
        mi = self.mi
        x, y, z = (mi.UInt32(mi.Int32(dr.floor(v * self.per_cell))) for v in point)
        return sampler.mix(sampler.mix(x, y), z) & (CUBES - 1)
