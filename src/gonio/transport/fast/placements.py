"""Compute the surface interactions of many spheres or rectangles without a call per shape.

Mitsuba computes the surface interaction at a hit by a virtual call of the shape. Dr.Jit traces this call for every
shape, which takes 0.1 ms per shape and vertex. For many spheres or rectangles, the placements are therefore stored in
one array: each lane reads the placement of the shape that it has hit, and the formula appears only once in the kernel.
Other shapes are called as usual. Meshes do not need a table, because meshes of equal material are merged.
"""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from ...bridge.faults.borrowed_memory import own
from ...bridge.types import Hit, Mask, OfVariant, Ray, Scene, Shape, SurfaceInteraction, UInt, Vector
from ..placement import placement_reader

# The minimum number of shapes of a kind. Tracing the calls of 64 spheres takes about as long as the rest of the
# program.
MANY = 64


class Placements:
    """The shapes of a scene whose placements are in a table. Other shapes are called."""

    def __init__(self, mi: ModuleType, scene: Scene, kinds: dict[str, list[Shape]]) -> None:
        self.mi, self.kinds = mi, list(kinds)
        shapes, read = scene.shapes(), placement_reader(mi)
        self.others = [shape for shape in shapes if shape.class_name() not in self.kinds]
        numbers = dict(zip(map(id, shapes), np.array(dr.reinterpret_array(mi.UInt32, scene.shapes_dr())), strict=True))
        size = 1 + max(numbers.values())  # in a kernel, a pointer to a shape is a number greater than 0
        kind_of, place = np.zeros(size, np.uint32), np.zeros(size, np.uint32)
        placement = np.zeros((size, 16))
        for index, kind in enumerate(self.kinds, start=1):
            rows = [numbers[id(shape)] for shape in kinds[kind]]
            kind_of[rows] = index
            matrices = np.array([read(shape) for shape in kinds[kind]]).reshape(-1, 4, 4)
            flipped = np.array([shape.has_flipped_normals() for shape in kinds[kind]])
            placement[rows] = _KINDS[kind][0](matrices, np.where(flipped, -1.0, 1.0)).reshape(-1, 16)
        place[[numbers[id(shape)] for shape in self.others]] = np.arange(len(self.others))
        self.placement = own(mi.Float, placement.ravel().astype(np.float32))
        self.kind_of, self.place = own(mi.UInt32, kind_of), own(mi.UInt32, place)

    @staticmethod
    def of(mi: ModuleType, scene: Scene, least: int) -> Placements | None:
        """The placements of a scene; None if there are fewer than `least` shapes of each supported kind."""
        shapes = scene.shapes()
        kinds = {kind: [shape for shape in shapes if shape.class_name() == kind] for kind in _KINDS}
        kinds = {kind: members for kind, members in kinds.items() if len(members) >= least}
        return Placements(mi, scene, kinds) if kinds else None

    def interaction(self, hit: Hit, ray: Ray, active: Mask) -> SurfaceInteraction:
        """The surface interaction at a hit, with all fields that Mitsuba's `compute_surface_interaction` sets."""
        mi = self.mi
        active = active & hit.is_valid()
        number = dr.reinterpret_array(mi.UInt32, hit.shape)
        kind = dr.gather(mi.UInt32, self.kind_of, number, active)
        si = self._called(hit, ray, number, active & (kind == 0))
        placement = dr.gather(mi.Matrix4f, self.placement, number, active)
        for index, name in enumerate(self.kinds, start=1):
            si = dr.select(kind == index, self._placed(_KINDS[name][1], hit, ray, placement), si)
        return si

    def _called(self, hit: Hit, ray: Ray, number: UInt, active: Mask) -> SurfaceInteraction:
        """The surface interactions of other shapes, computed by calls."""
        mi = self.mi

        def ask(shape: Shape) -> Callable[[Hit, Ray, Mask], SurfaceInteraction]:
            def asked(hit: Hit, ray: Ray, active: Mask) -> SurfaceInteraction:
                return shape.compute_surface_interaction(ray, hit, mi.RayFlags.All, active)

            return asked

        if not self.others:
            return self._finished(dr.zeros(mi.SurfaceInteraction3f), hit, ray)
        place = dr.gather(mi.UInt32, self.place, number, active)
        result = dr.switch(place, [ask(shape) for shape in self.others], hit, ray, active)
        return self._finished(result, hit, ray)

    def _placed(self, formula: Formula, hit: Hit, ray: Ray, placement: OfVariant) -> SurfaceInteraction:
        """The surface interaction of a shape with the given placement, computed by `formula`."""
        mi = self.mi
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.t = hit.t
        column = [mi.Vector3f(*(placement[row, index] for row in range(3))) for index in range(4)]
        formula(mi, si, hit, ray, column, placement[3, 3])
        return self._finished(si, hit, ray)

    def _finished(self, si: SurfaceInteraction, hit: Hit, ray: Ray) -> SurfaceInteraction:
        """Set the fields that Mitsuba sets for all shapes: the frame, the incoming direction, and the shape."""
        valid = hit.is_valid()
        si.t = dr.select(valid, hit.t, dr.inf)
        si.time, si.wavelengths = ray.time, ray.wavelengths
        si.shape, si.instance, si.prim_index = hit.shape, hit.instance, hit.prim_index
        si.initialize_sh_frame()
        si.wi = dr.select(valid, si.sh_frame.to_local(-ray.d), -ray.d)
        return si


Matrices = NDArray[np.float64]
Formula = Callable[[ModuleType, SurfaceInteraction, Hit, Ray, list[Vector], OfVariant], None]


def _of_spheres(to_world: Matrices, sign: NDArray[np.float64]) -> Matrices:
    """Pack the placements of spheres.

    Columns 0 to 2 are the axes, whose length is the radius. Column 3 is the center, and 1, or -1 if the normal points
    inward.
    """
    placement = to_world.copy()
    placement[:, 3, 3] = sign
    return placement


def _sphere(mi: ModuleType, si: SurfaceInteraction, hit: Hit, ray: Ray, column: list[Vector], sign: OfVariant) -> None:
    """The surface of a sphere. u is the azimuth about z, and v the angle to z, both scaled to [0, 1]."""
    x, y, z, center = column
    radius = dr.norm(x)
    normal = dr.normalize(ray(hit.t) - center)
    si.p = dr.fma(normal, radius, center)  # project onto the sphere, because the distance along the ray is rounded
    local = mi.Vector3f(dr.dot(normal, x), dr.dot(normal, y), dr.dot(normal, z)) / radius
    azimuth = dr.atan2(local.y, local.x)
    azimuth = dr.select(azimuth < 0, azimuth + 2 * dr.pi, azimuth)
    si.uv = mi.Point2f(azimuth / (2 * dr.pi), _angle_from_z(local) / dr.pi)
    rho = dr.hypot(local.x, local.y)
    pole = rho == 0
    cos, sin = dr.select(pole, 1, local.x / rho), dr.select(pole, 0, local.y / rho)
    si.dp_du = (x * -local.y + y * local.x) * (2 * dr.pi)
    si.dp_dv = (x * (local.z * cos) + y * (local.z * sin) - z * rho) * dr.pi
    si.n = si.sh_frame.n = mi.Normal3f(normal * sign)


def _angle_from_z(v: Vector) -> OfVariant:
    """The angle between a unit vector and z, accurate at both poles."""
    near = 2 * dr.asin(0.5 * dr.norm(v - dr.select(v.z >= 0, 1, -1) * type(v)(0, 0, 1)))
    return dr.select(v.z >= 0, near, dr.pi - near)


def _of_rectangles(to_world: Matrices, sign: NDArray[np.float64]) -> Matrices:
    """Pack the placements of rectangles: columns 0 and 1 are dp_du and dp_dv, 2 the unit normal, and 3 the center."""
    placement = to_world.copy()
    placement[:, :3, :2] *= 2  # from [-1, 1] to [0, 1]
    normal = np.cross(to_world[:, :3, 0], to_world[:, :3, 1])
    normal *= (sign * np.sign(np.linalg.det(to_world[:, :3, :3])))[:, None]
    placement[:, :3, 2] = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    return placement


def _rectangle(mi: ModuleType, si: SurfaceInteraction, hit: Hit, ray: Ray, column: list[Vector], _: OfVariant) -> None:
    """The surface of a rectangle or a parallelogram. u and v, in [0, 1], are the coordinates along the edges."""
    si.dp_du, si.dp_dv, normal, middle = column
    point = ray(hit.t)
    si.p = dr.fma(normal, dr.dot(middle - point, normal), point)  # project onto the plane
    offset, across, along = si.p - middle, dr.cross(normal, si.dp_du), dr.cross(si.dp_dv, normal)
    u, v = dr.dot(along, offset) / dr.dot(along, si.dp_du), dr.dot(across, offset) / dr.dot(across, si.dp_dv)
    si.uv = mi.Point2f(u + 0.5, v + 0.5)
    si.n = si.sh_frame.n = mi.Normal3f(normal)


# class name: (function that packs the placements for the kernel, formula)
_KINDS: dict[str, tuple[Callable[[Matrices, NDArray[np.float64]], Matrices], Formula]] = {
    "Sphere": (_of_spheres, _sphere),
    "Rectangle": (_of_rectangles, _rectangle),
}
