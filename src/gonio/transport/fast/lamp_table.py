"""Rectangular and spherical lamps of uniform radiance in tables, sampled by one formula per kind.

If they were called from the kernel, like other kinds of lights, these lamps would take a tenth of the render time. In
addition, Mitsuba samples spheres through positions in single precision, which makes a sphere of 4 mm at a distance of
3 m 2 % too bright.
"""

from __future__ import annotations

from collections.abc import Sequence
from types import ModuleType

import drjit as dr
import numpy as np

from ...bridge.faults.borrowed_memory import own
from ...bridge.types import (
    DirectionSample,
    Emitter,
    Float,
    Interaction,
    Mask,
    OfVariant,
    Point,
    Radiance,
    Shape,
    SurfaceInteraction,
    UInt,
    Vector,
)
from ..lights.base import LightHit, LightSample, with_shadow_target
from ..lights.directions import direction_sample
from ..lights.lamps import Lamps
from ..lights.solid_angles import STRAIGHT, Ball, LampView, Rectangle, RectangularArea, SphericalCap
from ..placement import placement_reader
from ..surfaces import Surfaces

NONE, RECTANGLE, BALL = 0, 1, 2


class LampTable:
    """A table of the rectangular and spherical lamps of uniform radiance, with one row per lamp.

    known  for each emitter, whether it is in the table
    """

    def __init__(self, mi: ModuleType, emitters: Sequence[Emitter], pointers: OfVariant):
        self.mi = mi
        rows = np.zeros((max(len(emitters), 1), 4, 4))
        read = placement_reader(mi)
        for row, emitter in zip(rows, emitters, strict=False):
            if shines_evenly(mi, emitter):
                shape = emitter.get_shape()
                kind = shape.class_name()
                if kind in ("Rectangle", "Sphere"):
                    _fill(row, kind, np.array(read(shape)).reshape(4, 4), shape.has_flipped_normals())
                    row[3, 1] = getattr(emitter, "two_sided", False)
        self.known = [bool(row[3, 0] != NONE) for row in rows[: len(emitters)]]
        self.kinds = sorted({int(row[3, 0]) for row in rows} - {NONE})
        self.table = own(mi.Float, rows.ravel().astype(np.float32))
        self.radiance: Float | None = None
        if mi.is_rgb and self.kinds:
            si = dr.zeros(mi.SurfaceInteraction3f, len(emitters))
            si.wi = mi.Vector3f(0, 0, 1)
            sent = np.array(pointers.eval(si, mi.Bool(self.known)), np.float32).reshape(3, -1)
            self.radiance = own(mi.Float, sent.T.ravel())

    def row(self, index: UInt, active: Mask) -> OfVariant:
        """The table row of a lamp."""
        return dr.gather(self.mi.Matrix4f, self.table, index, active)

    def is_known(self, row: OfVariant) -> Mask:
        return row[3, 0] != NONE

    def _views(self, row: OfVariant, origin: Point) -> list[tuple[Mask, LampView]]:
        """For each kind of lamp in the table, a mask of the lanes with this kind, and the lamp as seen from a point."""
        mi, result = self.mi, list[tuple[Mask, LampView]]()
        if RECTANGLE in self.kinds:
            result.append((row[3, 0] == RECTANGLE, RectangularArea(_rectangle(mi, row), origin)))
        if BALL in self.kinds:
            place = mi.Point3f(row[0, 0], row[0, 1], row[0, 2])
            result.append((row[3, 0] == BALL, SphericalCap(mi, Ball(place, row[1, 3], row[0, 3]), origin)))
        return result

    def sample(self, row: OfVariant, it: Interaction, u: Point) -> DirectionSample:
        """Sample a direction toward a lamp: uniformly in solid angle for a ball, uniformly by area for a rectangle.

        u  two random numbers in [0, 1)
        If rectangles were sampled by solid angle, the error with several near lamps would be 6 % smaller, but rendering
        would take 25 % longer, because the solid angle must be computed again for a path that hits a lamp.
        """
        result: DirectionSample | None = None
        for here, view in self._views(row, it.p):
            ds = direction_sample(self.mi, view, u, it)
            result = ds if result is None else dr.select(here, ds, result)
        return result

    def pdf(self, row: OfVariant, origin: Point, distance: Float, cosine: Float) -> Float:
        """The density (1/sr) of `sample` toward a point that a ray hits at `distance`, where |cos| is `cosine`."""
        result = self.mi.Float(0)
        for here, view in self._views(row, origin):
            result = dr.select(here, view.pdf(distance, cosine), result)
        return result

    def sent(self, row: OfVariant, index: UInt, normal: Vector, direction: Vector, active: Mask) -> Radiance:
        """The radiance of a lamp in a direction away from its surface. It is tabulated only in RGB variants."""
        mi = self.mi
        shines = (row[3, 1] != 0) | (dr.dot(normal, direction) > 0)
        return dr.select(shines & active, dr.gather(mi.Color3f, self.radiance, index, active), 0)


class TabledLamps(Lamps):
    """Lamps that are sampled from a table, or by calls of Mitsuba's emitters if they are not in the table."""

    table: LampTable
    index_of_pointer: UInt | None

    @classmethod
    def of(
        cls,
        surfaces: Surfaces,
        emitters: Sequence[Emitter],
        scene_indices: UInt,
        environment: int,
        pointers: OfVariant,
        index_of_pointer: UInt | None,
    ) -> TabledLamps | None:
        """The lamps of a scene; None if no lamp can be in a table.

        pointers          Dr.Jit's pointers to the emitters
        index_of_pointer  index of each emitter, by the number of its pointer; None if there is only one emitter
        """
        table = LampTable(surfaces.mi, emitters, pointers)
        if not table.kinds:
            return None
        lamps = cls(surfaces, emitters, scene_indices, environment)
        lamps.table, lamps.index_of_pointer = table, index_of_pointer
        others = [i for i, known in enumerate(table.known) if not known and i != environment]
        lamps.asks = bool(others)
        # whether a ray may hit a lamp whose radiance is not in the table
        lamps.asks_on_hit = any(emitters[i].get_shape() is not None for i in others) or table.radiance is None
        return lamps

    asks = asks_on_hit = False

    def emitted(self, si: SurfaceInteraction, active: Mask) -> Radiance:
        if self.asks_on_hit or self.index_of_pointer is None:
            return super().emitted(si, active)
        mi = self.mi
        number = dr.reinterpret_array(mi.UInt32, si.emitter(self.scene, active))
        here = active & (number > 0)
        index = dr.gather(mi.UInt32, self.index_of_pointer, number, here)
        row = self.table.row(index, here)
        return dr.select(here, self.table.sent(row, index, si.n, si.to_world(si.wi), here), 0)

    def sample(self, si: SurfaceInteraction, u: Point, index: UInt, active: Mask) -> LightSample:
        table = self.table
        emitter = self.emitter(index, active)
        row = table.row(index, active)
        known = active & table.is_known(row)
        ds = table.sample(row, si, u)
        if table.radiance is not None:
            sent = table.sent(row, index, ds.n, -ds.d, known)
        else:
            sent = self.sent(emitter, ds, si, known)
        light = with_shadow_target(self.surfaces.offsets, si, ds, dr.select(ds.pdf > 0, sent / ds.pdf, 0))
        if not self.asks:
            return light
        asked = with_shadow_target(self.surfaces.offsets, si, *self._asked(emitter, index, si, u, active & ~known))
        return dr.select(known, light, asked)

    def pdf(self, hit: LightHit, index: UInt, active: Mask) -> Float:
        row = self.table.row(index, active)
        known = active & self.table.is_known(row)
        others = super().pdf(hit, index, active & ~known) if self.asks else self.mi.Float(0)
        cosine = dr.abs(dr.dot(hit.ds.d, hit.ds.n))
        return dr.select(known, self.table.pdf(row, hit.origin, hit.ds.dist, cosine), others)


def has_known_sides(emitter: Emitter) -> bool:
    """Whether a light is a surface that emits from one side, or equally from both sides."""
    two_sided = getattr(emitter, "two_sided", False)
    return (two_sided or emitter.class_name() == "AreaLight") and emitter.get_shape() is not None


def shines_evenly(mi: ModuleType, emitter: Emitter) -> bool:
    """Whether a light is a surface with uniform radiance."""
    return has_known_sides(emitter) and not mi.has_flag(emitter.flags(), mi.EmitterFlags.SpatiallyVarying)


def rectangle_of(mi: ModuleType, shape: Shape) -> Rectangle | None:
    """The rectangle of a shape; None for other shapes. It is kernel data, so moving it does not recompile kernels."""
    row = np.zeros((4, 4))
    if shape.class_name() == "Rectangle":
        _fill(row, "Rectangle", np.array(placement_reader(mi)(shape)).reshape(4, 4), shape.has_flipped_normals())
    if row[3, 0] != RECTANGLE:
        return None
    table = own(mi.Float, row.ravel().astype(np.float32))
    return _rectangle(mi, dr.gather(mi.Matrix4f, table, mi.UInt32(0)))


def _rectangle(mi: ModuleType, row: OfVariant) -> Rectangle:
    corner, axis0, axis1 = ([row[i, k] for k in range(3)] for i in range(3))
    return Rectangle(mi.Point3f(*corner), mi.Vector3f(*axis0), mi.Vector3f(*axis1), row[1, 3], row[2, 3], row[0, 3])


def _fill(row: np.ndarray, kind: str, to_world: np.ndarray, flipped: bool) -> None:
    """Fill the row of a lamp: position, side of the normal, and a rectangle's axes and lengths or a ball's radius."""
    side = -1.0 if flipped else 1.0
    if kind == "Sphere":
        row[0], row[1, 3], row[3, 0] = (*to_world[:3, 3], side), np.linalg.norm(to_world[:3, 0]), BALL
        return
    edges = 2 * to_world[:3, :2].T
    lengths = np.linalg.norm(edges, axis=1)
    if not lengths.min() > 0 or abs(edges[0] @ edges[1]) >= STRAIGHT * lengths.prod():
        return
    row[0] = *(to_world[:3, 3] - 0.5 * edges.sum(0)), side * np.sign(np.linalg.det(to_world[:3, :3]))
    row[1:3, :3], row[1:3, 3], row[3, 0] = edges / lengths[:, None], lengths, RECTANGLE
