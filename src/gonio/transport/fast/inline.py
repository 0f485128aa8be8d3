"""Rays against a few simple shapes, in the kernel itself.

A call of Embree from a kernel, and the calls that it makes for each sphere, take longer than the formulas of a dozen
spheres and flat shapes, which are as vectorised as all else in the kernel. Scenes of balls on a floor are rendered 1.4
to 1.8 times as fast so. Where there are more shapes, or others, Mitsuba is asked.

Rectangles, disks and triangles are all one formula: the ray meets the plane z = 0 of a frame of the shape's own, and
the place (x, y) there is inside or not. Two triangles of a mesh that make a parallelogram are one shape.
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

# What shapes may cost together, a sphere 1. Embree, which has its own ways with triangles and calls Mitsuba for each
# sphere, is as fast as 40 spheres (and there a kernel takes .6 s longer to compile), or as 11 flat shapes.
MOST = 24
OF_FLAT = 2

# A sphere's far side is told from the side that a ray has just left by float32, in which the distance from the surface
# is known to some 2e-7 of the radius and the centre's distance from the origin. A ray starts off by 9e-5 of (1 + |p|):
# beyond so many times that, Mitsuba, which takes 64 bits there, is asked.
LARGEST = 50.0

MESHES = ("Mesh", "OBJMesh", "PLYMesh", "SerializedMesh", "Cube")
FLAT = 1e-5  # how far, relative to its sides, the fourth corner of a parallelogram may lie elsewhere

Matrix = NDArray[np.float64]
Inside = Callable[[Float, Float], Mask]
Row = list[Float]  # of a matrix


# Of a mesh: faces, one or two (below and above the diagonal x + y = 1), each with the weights of its second and third
# corner as functions a + b x + c y.
Faces = tuple[tuple[int, tuple[tuple[int, int, int], ...]], ...]


@dataclass
class Sphere:
    shape: int  # which of the scene's
    centre: list[float]
    radius: float


@dataclass
class Flat:
    """A part of a plane: three rows of a matrix that takes a point to a frame in which it is part of z = 0."""

    shape: int
    kind: str  # of `_INSIDE`
    rows: list[list[float]]
    faces: Faces = ()


_INSIDE: dict[str, Inside] = {
    "rectangle": lambda x, y: dr.maximum(dr.abs(x), dr.abs(y)) <= 1,
    "disk": lambda x, y: dr.square(x) + dr.square(y) <= 1,
    "triangle": lambda x, y: (dr.minimum(x, y) >= 0) & (x + y <= 1),
    "parallelogram": lambda x, y: (dr.minimum(x, y) >= 0) & (dr.maximum(x, y) <= 1),
}


class Inline:
    """The shapes of a scene, as they are when this is made. `of` says whether it is for them."""

    def __init__(self, mi: ModuleType, scene: Scene, spheres: list[Sphere], flats: list[Flat]):
        self.mi = mi
        # Mitsuba's order of shapes is one of chance, which neither the kernel nor a tie between two shapes may follow.
        flats.sort(key=lambda f: (f.kind, f.faces, f.rows))
        spheres.sort(key=lambda s: (s.centre, s.radius))
        parts = [flat.shape for flat in flats] + [sphere.shape for sphere in spheres]
        self.shapes = dr.gather(mi.ShapePtr, scene.shapes_dr(), mi.UInt32(parts))  # of each part
        dr.eval(self.shapes)
        # One array: kernels differ by the order in which the arrays that they read were made.
        numbers = [n for s in spheres for n in (*s.centre, s.radius)]
        numbers += [n for flat in flats for row in flat.rows for n in row]
        table = own(mi.Float, np.array(numbers, np.float32))
        read = (dr.gather(mi.Float, table, at) for at in range(len(numbers)))
        self.spheres = [(mi.Point3f(*itertools.islice(read, 3)), next(read)) for _ in spheres]
        self.flats = [(flat, [list(itertools.islice(read, 4)) for _ in range(3)]) for flat in flats]

    @staticmethod
    def of(mi: ModuleType, scene: Scene, to_world: Callable[[Shape], list[float]]) -> Inline | None:
        """None where Mitsuba is to be asked: many shapes, others than are known here, or a GPU, which has its own ways.

        to_world  reads a shape's placement, 16 numbers row by row
        """
        shapes = scene.shapes()
        if "llvm" not in mi.variant() or not 0 < sum(map(_cost, shapes)) <= MOST:
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
            centre, radius = matrix[:3, 3], float(np.linalg.norm(matrix[:3, 0]))
            away = float(np.linalg.norm(centre))
            if away + radius > LARGEST * (1.0 + max(away - radius, 0.0)):
                return None
            spheres.append(Sphere(index, centre.tolist(), radius))
        return Inline(mi, scene, spheres, flats) if spheres or flats else None

    def nearest(self, ray: Ray, active: Mask) -> Hit:
        """What the ray meets first."""
        mi = self.mi
        best = dr.select(active, mi.Float(ray.maxt), 0)
        count = len(self.flats) + len(self.spheres)
        part, face, place = mi.UInt32(count), mi.UInt32(0), mi.Point2f(0)
        for number, (flat, rows) in enumerate(self.flats):
            t, x, y, hits = self._on_flat(flat, rows, ray, best)
            best, part = dr.select(hits, t, best), dr.select(hits, number, part)
            face, place = self._placed(flat, x, y, hits, face, place)
        for number, (centre, radius) in enumerate(self.spheres, start=len(self.flats)):
            t, hits = self._on_sphere(centre, radius, ray, best)
            best, part = dr.select(hits, t, best), dr.select(hits, number, part)
        hit = dr.zeros(mi.PreliminaryIntersection3f)
        hit.valid = part < count
        hit.t = dr.select(hit.valid, best, dr.inf)
        hit.prim_index, hit.prim_uv = face, place
        hit.shape = dr.gather(mi.ShapePtr, self.shapes, part, hit.valid)
        return hit

    def blocked(self, ray: Ray, active: Mask) -> Mask:
        """Whether the ray meets anything."""
        mi = self.mi
        most = dr.select(active, mi.Float(ray.maxt), 0)
        hits = mi.Bool(False)
        for flat, rows in self.flats:
            hits |= self._on_flat(flat, rows, ray, most)[3]
        for centre, radius in self.spheres:
            hits |= self._on_sphere(centre, radius, ray, most)[1]
        return hits

    def _on_sphere(self, centre: Point, radius: Float, ray: Ray, most: Float) -> tuple[Float, Mask]:
        """(distance, whether it is between 0 and `most`).

        The discriminant by the ray's distance from the centre, the nearer root by a quotient: neither is the difference
        of numbers that are nearly equal (Haines2019).
        """
        away, square = centre - ray.o, dr.square(radius)
        along = dr.dot(away, ray.d)
        discriminant = square - dr.squared_norm(dr.fma(-ray.d, along, away))
        far = along + dr.mulsign(dr.sqrt(dr.maximum(discriminant, 0)), along)
        near = (dr.squared_norm(away) - square) / far
        first, second = dr.minimum(near, far), dr.maximum(near, far)
        t = dr.select(first > 0, first, second)
        return t, (discriminant >= 0) & (t > 0) & (t < most)

    def _on_flat(self, flat: Flat, rows: list[Row], ray: Ray, most: Float) -> tuple[Float, Float, Float, Mask]:
        """(distance, place there x, y, whether it is inside and between 0 and `most`)."""
        across, along, up = rows
        t = -_at(up, ray.o) / dr.dot(self.mi.Vector3f(*up[:3]), ray.d)
        point = dr.fma(ray.d, t, ray.o)
        x, y = _at(across, point), _at(along, point)
        return t, x, y, _INSIDE[flat.kind](x, y) & (t > 0) & (t < most)

    def _placed(self, flat: Flat, x: Float, y: Float, hits: Mask, face: UInt, place: Point) -> tuple[UInt, Point]:
        """Face and place on it as Mitsuba tells them of meshes, weights of the second and third corner; of disks x, y.

        Those of other shapes follow from the point (`Surfaces`).
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
        return OF_FLAT * ((int(shape.face_count()) + 1) // 2)
    return {"Sphere": 1, "Rectangle": OF_FLAT, "Disk": OF_FLAT}.get(kind, MOST + 1)


def _flat(shape: int, kind: str, frame: Matrix, faces: Faces = ()) -> Flat | None:
    """The part of the plane z = 0 of a frame (4 x 4, it leads to the world); None where it is degenerate."""
    across, along, up = frame[:3, :3].T
    normal = np.cross(across, along)
    if not (size := float(np.linalg.norm(normal))) > 0.0:
        return None
    oblique = abs(up @ normal) <= (1.0 - FLAT) * np.linalg.norm(up) * size
    if kind == "disk" and (oblique or abs(across @ along) > FLAT * size):
        return None  # Mitsuba has its own view of a disk whose axes are not perpendicular
    frame = frame.copy()
    frame[:3, 2] = normal / np.sqrt(size)  # of a length like that of the others; where its own points does not matter
    with np.errstate(all="ignore"):
        inverse = np.linalg.inv(frame)
    if not np.all(np.isfinite(inverse.astype(np.float32))):
        return None
    return Flat(shape, kind, inverse[:3].tolist(), faces)


def _of_mesh(shape: int, mesh: Shape) -> Iterator[Flat]:
    """A mesh's triangles, by two where they make a parallelogram. Those without an area are left out."""
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
    """Faces that make a parallelogram with one: (face, which corner of `first` is across from it, its own there)."""
    for second, turn in itertools.product(others, range(3)):
        a, b, c = (int(faces[first][(turn + k) % 3]) for k in range(3))
        rest = set(map(int, faces[second])) - {b, c}
        if len(rest) != 1 or not {b, c} <= set(map(int, faces[second])):
            continue
        fourth = rest.pop()
        size = np.linalg.norm(corners[b] - corners[c])
        if np.linalg.norm(corners[b] + corners[c] - corners[a] - corners[fourth]) <= FLAT * size:
            yield second, turn, fourth
