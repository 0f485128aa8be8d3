"""Intersect rays with a few simple shapes in the kernel.

A call of Embree from a kernel, with callbacks for each sphere, takes longer than evaluating the formulas for a dozen
spheres and flat shapes, which are vectorized like the rest of the kernel. Scenes of balls on a floor render 1.4 to 1.8
times as fast with this method. For scenes with more shapes or with shapes of other kinds, Mitsuba is used.

Rectangles, disks and triangles are intersected by one formula: the ray is intersected with the plane z = 0 of the frame
of the shape, and the point (x, y) is tested against the outline. Two triangles of a mesh that form a parallelogram are
treated as one shape.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import ModuleType

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from ...bridge.faults.borrowed_memory import own
from ...bridge.types import Float, Hit, Mask, Point, Ray, Scene, Shape, UInt

# The maximum total cost of the shapes, where a sphere costs 1. Embree intersects triangles itself and calls Mitsuba for
# each sphere. It is as fast as this module with 40 spheres, for which compilation takes 0.6 s longer, or 11 flat
# shapes.
MAX_COST = 24
COST_OF_FLAT = 2

# With float32, the far side of a sphere must be distinguishable from the side that a ray has just left. The error of
# the distance from the surface is some 2e-7 of the radius and of the center's distance from the origin, and the offset
# of a ray from the surface is 9e-5 (unit + |p|), see `Offsets`. If (radius + distance from the origin) / (unit + |p|)
# exceeds this ratio, Mitsuba intersects the sphere, in double precision.
MAX_SPHERE = 50.0

MESHES = ("Mesh", "OBJMesh", "PLYMesh", "SerializedMesh", "Cube")
FLAT = 1e-5  # largest deviation of the fourth corner of a parallelogram, relative to its sides

Matrix = NDArray[np.float64]
Inside = Callable[[Float, Float], Mask]
Row = list[Float]  # a row of a 3 x 4 matrix


# One or two faces of a mesh (below and above the diagonal x + y = 1), each with the barycentric weights of its second
# and third corner as functions a + b x + c y.
Faces = tuple[tuple[int, tuple[tuple[int, int, int], ...]], ...]


@dataclass
class Sphere:
    shape: int  # index of the shape in the scene
    center: list[float]
    radius: float


@dataclass
class Flat:
    """A part of a plane, given by the first three rows of the matrix that transforms the plane to z = 0."""

    shape: int
    kind: str  # a key of `_INSIDE`
    rows: list[list[float]]
    faces: Faces = ()


_INSIDE: dict[str, Inside] = {
    "rectangle": lambda x, y: dr.maximum(dr.abs(x), dr.abs(y)) <= 1,
    "disk": lambda x, y: dr.square(x) + dr.square(y) <= 1,
    "triangle": lambda x, y: (dr.minimum(x, y) >= 0) & (x + y <= 1),
    "parallelogram": lambda x, y: (dr.minimum(x, y) >= 0) & (dr.maximum(x, y) <= 1),
}


class Inline:
    """The shapes that a scene has when this object is constructed.

    To construct it, call `of`, which returns None if the shapes are not supported.
    """

    def __init__(self, mi: ModuleType, scene: Scene, spheres: list[Sphere], flats: list[Flat]):
        self.mi = mi
        # Mitsuba's order of shapes is random, so neither the kernel nor a tie between two shapes may depend on it.
        flats.sort(key=lambda f: (f.kind, f.faces, f.rows))
        spheres.sort(key=lambda s: (s.center, s.radius))
        parts = [flat.shape for flat in flats] + [sphere.shape for sphere in spheres]
        self.shapes = dr.gather(mi.ShapePtr, scene.shapes_dr(), mi.UInt32(parts))  # the shape of each part
        dr.eval(self.shapes)
        # All numbers are in one array, because kernels depend on the order in which their arrays were created.
        numbers = [n for s in spheres for n in (*s.center, s.radius)]
        numbers += [n for flat in flats for row in flat.rows for n in row]
        table = own(mi.Float, np.array(numbers, np.float32))
        read = (dr.gather(mi.Float, table, at) for at in range(len(numbers)))
        self.spheres = [(mi.Point3f(*itertools.islice(read, 3)), next(read)) for _ in spheres]
        self.flats = [(flat, [list(itertools.islice(read, 4)) for _ in range(3)]) for flat in flats]

    @staticmethod
    def of(mi: ModuleType, scene: Scene, to_world: Callable[[Shape], list[float]], unit: float) -> Inline | None:
        """The shapes of a scene, or None if Mitsuba must intersect them.

        This is the case if there are many shapes or unsupported ones, and on a GPU, which has ray tracing hardware.

        to_world  function that returns the placement of a shape, 16 numbers row by row
        unit      `Offsets.unit` of the scene
        """
        shapes = scene.shapes()
        if "llvm" not in mi.variant() or not 0 < sum(map(_cost, shapes)) <= MAX_COST:
            return None
        spheres, flats = list[Sphere](), list[Flat]()
        for index, shape in enumerate(shapes):
            kind = shape.class_name()
            if kind in MESHES:
                flats += _of_mesh(index, shape)
                continue
            matrix = np.array(to_world(shape), float).reshape(4, 4)
            if kind != "Sphere":
                if (flat := _flat(index, kind.lower(), matrix)) is None:
                    return None
                flats.append(flat)
                continue
            center, radius = matrix[:3, 3], float(np.linalg.norm(matrix[:3, 0]))
            away = float(np.linalg.norm(center))
            if away + radius > MAX_SPHERE * (unit + max(away - radius, 0.0)):
                return None
            spheres.append(Sphere(index, center.tolist(), radius))
        return Inline(mi, scene, spheres, flats) if spheres or flats else None

    def nearest(self, ray: Ray, active: Mask) -> Hit:
        """The first intersection of a ray with the shapes."""
        mi = self.mi
        best = dr.select(active, mi.Float(ray.maxt), 0)
        count = len(self.flats) + len(self.spheres)
        part, face, place = mi.UInt32(count), mi.UInt32(0), mi.Point2f(0)
        for number, (flat, rows) in enumerate(self.flats):
            t, x, y, hits = self._on_flat(flat, rows, ray, best)
            best, part = dr.select(hits, t, best), dr.select(hits, number, part)
            face, place = self._placed(flat, x, y, hits, face, place)
        for number, (center, radius) in enumerate(self.spheres, start=len(self.flats)):
            t, hits = self._on_sphere(center, radius, ray, best)
            best, part = dr.select(hits, t, best), dr.select(hits, number, part)
        hit = dr.zeros(mi.PreliminaryIntersection3f)
        hit.valid = part < count
        hit.t = dr.select(hit.valid, best, dr.inf)
        hit.prim_index, hit.prim_uv = face, place
        hit.shape = dr.gather(mi.ShapePtr, self.shapes, part, hit.valid)
        return hit

    def blocked(self, ray: Ray, active: Mask) -> Mask:
        """Whether a ray hits any shape."""
        mi = self.mi
        most = dr.select(active, mi.Float(ray.maxt), 0)
        hits = mi.Bool(False)
        for flat, rows in self.flats:
            hits |= self._on_flat(flat, rows, ray, most)[3]
        for center, radius in self.spheres:
            hits |= self._on_sphere(center, radius, ray, most)[1]
        return hits

    def _on_sphere(self, center: Point, radius: Float, ray: Ray, most: Float) -> tuple[Float, Mask]:
        """The distance of the nearest intersection with a sphere, and whether it is between 0 and `most`.

        The discriminant is computed from the distance between the ray and the center, and the nearer root as a
        quotient, so nearly equal numbers are not subtracted (Haines2019).
        """
        away, square = center - ray.o, dr.square(radius)
        along = dr.dot(away, ray.d)
        discriminant = square - dr.squared_norm(dr.fma(-ray.d, along, away))
        far = along + dr.mulsign(dr.sqrt(dr.maximum(discriminant, 0)), along)
        near = (dr.squared_norm(away) - square) / far
        first, second = dr.minimum(near, far), dr.maximum(near, far)
        t = dr.select(first > 0, first, second)
        return t, (discriminant >= 0) & (t > 0) & (t < most)

    def _on_flat(self, flat: Flat, rows: list[Row], ray: Ray, most: Float) -> tuple[Float, Float, Float, Mask]:
        """The distance of the intersection with a flat shape, its local coordinates x and y, and whether it is valid.

        It is valid if the point is inside the shape and the distance is between 0 and `most`.
        """
        across, along, up = rows
        t = -_at(up, ray.o) / dr.dot(self.mi.Vector3f(*up[:3]), ray.d)
        point = dr.fma(ray.d, t, ray.o)
        x, y = _at(across, point), _at(along, point)
        return t, x, y, _INSIDE[flat.kind](x, y) & (t > 0) & (t < most)

    def _placed(self, flat: Flat, x: Float, y: Float, hits: Mask, face: UInt, place: Point) -> tuple[UInt, Point]:
        """The face index and uv of a hit, as Mitsuba defines them.

        For meshes, uv are the barycentric weights of the second and third corner; for disks, they are x and y. For
        other shapes, they are computed from the point (`Surfaces`).
        """
        mi = self.mi
        if flat.kind == "disk":
            return face, dr.select(hits, mi.Point2f(x, y), place)
        for (number, weights), here in zip(flat.faces, (hits, hits & (x + y > 1)), strict=False):
            weighed = mi.Point2f(*(a + b * x + c * y for a, b, c in weights))
            face, place = dr.select(here, number, face), dr.select(here, weighed, place)
        return face, place


def _at(row: Row, p: Point) -> Float:
    return dr.fma(row[0], p.x, dr.fma(row[1], p.y, dr.fma(row[2], p.z, row[3])))


def _cost(shape: Shape) -> int:
    kind = shape.class_name()
    if kind in MESHES:
        return COST_OF_FLAT * ((int(shape.face_count()) + 1) // 2)
    return {"Sphere": 1, "Rectangle": COST_OF_FLAT, "Disk": COST_OF_FLAT}.get(kind, MAX_COST + 1)


def _flat(shape: int, kind: str, frame: Matrix, faces: Faces = ()) -> Flat | None:
    """The part of the plane z = 0 in a given frame, a 4 x 4 matrix to world space; None if the frame is degenerate."""
    across, along, up = frame[:3, :3].T
    normal = np.cross(across, along)
    if not (size := float(np.linalg.norm(normal))) > 0.0:
        return None
    oblique = abs(up @ normal) <= (1.0 - FLAT) * np.linalg.norm(up) * size
    if kind == "disk" and (oblique or abs(across @ along) > FLAT * size):
        return None  # Mitsuba treats disks with non-perpendicular axes differently
    frame = frame.copy()
    frame[:3, 2] = normal / np.sqrt(size)  # scaled like the other axes
    with np.errstate(all="ignore"):
        inverse = np.linalg.inv(frame)
    if not np.all(np.isfinite(inverse.astype(np.float32))):
        return None
    return Flat(shape, kind, inverse[:3].tolist(), faces)


def _of_mesh(shape: int, mesh: Shape) -> Iterator[Flat]:
    """The triangles of a mesh. Two triangles that form a parallelogram are one shape; degenerate ones are omitted."""
    corners = np.array(mesh.vertex_positions_buffer(), float).reshape(-1, 3)
    faces = np.array(mesh.faces_buffer()).reshape(-1, 3).astype(int)
    left = list(range(len(faces)))
    while left:
        first = left.pop(0)
        pair = next(_partners(corners, faces, first, left), None)
        turn = 0 if pair is None else pair[1]
        a, b, c = (int(faces[first][(turn + k) % 3]) for k in range(3))
        frame = np.eye(4)
        frame[:3, 0], frame[:3, 1], frame[:3, 3] = corners[b] - corners[a], corners[c] - corners[a], corners[a]
        weight = {a: (1, -1, -1), b: (0, 1, 0), c: (0, 0, 1)}
        result = [(first, tuple(weight[int(v)] for v in faces[first][1:]))]
        if pair is not None:
            second, _, fourth = pair
            left.remove(second)
            weight = {fourth: (-1, 1, 1), b: (1, 0, -1), c: (1, -1, 0)}
            result.append((second, tuple(weight[int(v)] for v in faces[second][1:])))
        kind = "triangle" if pair is None else "parallelogram"
        if (flat := _flat(shape, kind, frame, tuple(result))) is not None:
            yield flat


def _partners(
    corners: Matrix, faces: NDArray[np.int_], first: int, others: list[int]
) -> Iterator[tuple[int, int, int]]:
    """The faces that form a parallelogram with the face `first`.

    Yields the face, the position in `first` of the corner opposite the common edge, and the index of the vertex of the
    other face that is opposite this edge.
    """
    for second, turn in itertools.product(others, range(3)):
        a, b, c = (int(faces[first][(turn + k) % 3]) for k in range(3))
        rest = set(map(int, faces[second])) - {b, c}
        if len(rest) != 1 or not {b, c} <= set(map(int, faces[second])):
            continue
        fourth = rest.pop()
        size = np.linalg.norm(corners[b] - corners[c])
        if np.linalg.norm(corners[b] + corners[c] - corners[a] - corners[fourth]) <= FLAT * size:
            yield second, turn, fourth
