"""Triangle meshes: shapes that Mitsuba does not have, and mesh files.

Disks, cones and cylinders are tessellated, with exact normals and texture coordinates at the vertices. A full turn has
`SEGMENTS` = 1024 segments, so points are up to radius * (1 - cos(pi/1024)) = 4.7e-6 radius inside the true surface. The
direction of dp/du is constant within a segment and has an error of up to pi/1024 = 0.18 degrees, as have normals near
the apex of a cone. Near the center of a disk and the apex of a cone, u has an error of up to half a segment, 1/2048.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import NoReturn, Protocol, TypeAlias

import numpy as np

from ..bridge.types import BSDFPlugin, Emitter, Shape
from ..errors import InputError

PlyProperties: TypeAlias = list[tuple[str, ...]]  # (type, name), or ("list", type of the count, type, name)
PlyTable: TypeAlias = dict[str, np.ndarray | list[list[int]]]  # columns by name; columns of lists are lists of lists

SEGMENTS = 1024
MAX_BYTES = 2**30  # maximum size of a mesh file


@dataclass(frozen=True)
class Triangles:
    """A mesh: vertices (N, 3), faces (M, 3) as vertex indices, and normals (N, 3) and uv (N, 2) per vertex, or None."""

    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray | None = None
    uv: np.ndarray | None = None

    def transformed(self, matrix: np.ndarray) -> Triangles:
        """The mesh transformed by a 4x4 matrix. A reflection reverses the faces, so normals remain outward."""
        linear = matrix[:3, :3]
        normals = None
        if self.normals is not None:
            normals = _unit(self.normals @ np.linalg.inv(linear))  # n -> inverse transpose * n
        return replace(
            self,
            vertices=self.vertices @ linear.T + matrix[:3, 3],
            faces=self.faces[:, ::-1] if np.linalg.det(linear) < 0 else self.faces,
            normals=normals,
        )

    def to_mitsuba(self, mi: ModuleType, name: str, bsdf: BSDFPlugin, emitter: Emitter | None = None) -> Shape:
        """A `mi.Mesh` with the given BSDF and, optionally, an emitter."""
        properties = mi.Properties()
        properties["bsdf"] = bsdf
        if emitter is not None:
            properties["emitter"] = emitter
        mesh = mi.Mesh(
            name,
            len(self.vertices),
            len(self.faces),
            has_vertex_normals=self.normals is not None,
            has_vertex_texcoords=self.uv is not None,
            props=properties,
        )
        values = mi.traverse(mesh)
        values["vertex_positions"] = np.ascontiguousarray(self.vertices, np.float32).ravel()
        values["faces"] = np.ascontiguousarray(self.faces, np.uint32).ravel()
        if self.normals is not None:
            values["vertex_normals"] = np.ascontiguousarray(self.normals, np.float32).ravel()
        if self.uv is not None:
            values["vertex_texcoords"] = np.ascontiguousarray(self.uv, np.float32).ravel()
        values.update()
        return mesh


def _unit(vectors: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(length > 0, length, 1.0)


# ---------------------------------------------------------------------- shapes of revolution about z


def disk(radius: float, inner_radius: float, phi_max: float) -> Triangles:
    """A disk in the plane z = 0 with the normal +z; u = phi / phi_max, and v is 0 at the edge and 1 at the center."""
    return _revolved(
        phi_max, rings=[(radius, 0.0, 0.0), (inner_radius, 0.0, 1.0 - inner_radius / radius)], slope=(0.0, 1.0)
    )


def cylinder(radius: float, height: float, phi_max: float) -> Triangles:
    """A cylinder from z = 0 to z = height, open at both ends, with outward normals; v = z / height."""
    return _revolved(phi_max, rings=[(radius, 0.0, 0.0), (radius, height, 1.0)], slope=(1.0, 0.0))


def cone(radius: float, height: float, phi_max: float) -> Triangles:
    """A cone with its base in the plane z = 0 and its apex at z = height, without the base disk; v = z / height.

    The normals point outward.
    """
    length = math.hypot(radius, height)
    return _revolved(phi_max, rings=[(radius, 0.0, 0.0), (0.0, height, 1.0)], slope=(height / length, radius / length))


def _revolved(phi_max: float, rings: list[tuple[float, float, float]], slope: tuple[float, float]) -> Triangles:
    """The band between two rings (radius, z, v) about the z axis.

    On a ring of radius 0, where u is undefined, there is one vertex per segment, at the middle angle of the segment, so
    dp/du of each triangle has the direction of its chord.

    slope  components of the normal along the radius and along z
    """
    count = max(3, math.ceil(SEGMENTS * phi_max / (2 * math.pi)))
    edges = np.linspace(0.0, 1.0, count + 1)
    middles = (edges[:-1] + edges[1:]) / 2
    (r0, z0, v0), (r1, z1, v1) = rings
    upper = middles if r1 == 0 else edges

    def ring(u: np.ndarray, r: float, z: float, v: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        phi = u * phi_max
        outward = np.stack([np.cos(phi), np.sin(phi), np.zeros_like(phi)], axis=1)
        points = outward * r + [0.0, 0.0, z]
        normals = outward * slope[0] + [0.0, 0.0, slope[1]]
        return points, normals, np.stack([u, np.full_like(u, v)], axis=1)

    parts = [ring(edges, r0, z0, v0), ring(upper, r1, z1, v1)]
    vertices, normals, uv = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    low = np.arange(count)
    high = count + 1 + low
    if r1 == 0:
        faces = np.stack([low, low + 1, high], axis=1)
    else:
        faces = np.concatenate([np.stack([low, low + 1, high + 1], axis=1), np.stack([low, high + 1, high], axis=1)])
    return Triangles(vertices, faces, normals, uv)


def cube() -> Triangles:
    """The cube [-1, 1]^3 with outward normals. On faces normal to axis i, u is along axis i + 1 and v along i + 2."""
    vertices: list[np.ndarray] = []
    normals: list[np.ndarray] = []
    faces: list[list[int]] = []
    uv: list[tuple[int, int]] = []
    for axis in range(3):
        along_u, along_v = (axis + 1) % 3, (axis + 2) % 3
        for side in (-1.0, 1.0):
            first = len(vertices)
            for u, v in ((0, 0), (1, 0), (1, 1), (0, 1)):
                corner = np.zeros(3)
                corner[axis], corner[along_u], corner[along_v] = side, 2 * u - 1, 2 * v - 1
                normal = np.zeros(3)
                normal[axis] = side
                vertices.append(corner)
                normals.append(normal)
                uv.append((u, v))
            quad = [first, first + 1, first + 2, first + 3]
            if side < 0:
                quad.reverse()
            faces += [[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]
    return Triangles(np.array(vertices), np.array(faces), np.array(normals), np.array(uv, dtype=float))


# ---------------------------------------------------------------------- files


def is_ply(path: Path) -> bool:
    """Whether a file begins like a .ply, regardless of its name."""
    with open(path, "rb") as file:
        return re.fullmatch(rb"ply[\r\n]", file.read(4)) is not None


def read_mesh(path: Path, where: str, kind: str = "") -> Triangles:
    """Read the triangles of an .obj or .ply file. Raises InputError, with the line if the format has lines.

    where  location in the scene, for errors
    kind   suffix of the format, if it differs from that of the path
    """
    readers = {".obj": read_obj, ".ply": read_ply}
    kind = kind or path.suffix.lower()
    if kind not in readers:
        raise InputError(f"'{path.name}' is not a known kind of mesh", where, "use .obj or .ply")
    size = path.stat().st_size
    if size > MAX_BYTES:
        raise InputError(
            f"'{path.name}' has {size / 2**20:.0f} MiB, the limit is {MAX_BYTES // 2**20} MiB", where, "simplify it"
        )
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"'{path.name}' cannot be read: {error.strerror or error}", where, "check the file") from None
    mesh = readers[kind](data, path, where)
    return _sound(mesh, path, where)


def _sound(mesh: Triangles, path: Path, where: str) -> Triangles:
    """The mesh without degenerate faces and with unit normals. Raises InputError for unusable numbers or indices."""
    if len(mesh.faces) == 0:
        raise InputError(f"'{path.name}' has no faces", where, "export it with triangles or polygons")
    for name, values in (("vertex", mesh.vertices), ("normal", mesh.normals), ("texture coordinate", mesh.uv)):
        if values is not None and not np.all(np.abs(values) < 1e18):  # false for NaN
            row = int(np.argmin(np.all(np.abs(values) < 1e18, axis=1)))
            raise InputError(
                f"'{path.name}': a {name} is not finite: {values[row].tolist()}", where, "export the mesh again"
            )
    low, high = int(mesh.faces.min()), int(mesh.faces.max())
    if low < 0 or high >= len(mesh.vertices):
        wrong = low if low < 0 else high
        raise InputError(
            f"'{path.name}': a face names vertex {wrong}, the file has 0 to {len(mesh.vertices) - 1}",
            where,
            "export the mesh again",
        )
    corners = mesh.vertices[mesh.faces]
    crossed = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat = np.linalg.norm(crossed, axis=1) == 0
    if flat.all():
        raise InputError(f"'{path.name}': all faces are degenerate (area 0)", where, "export the mesh again")
    faces, crossed = mesh.faces[~flat], crossed[~flat]
    normals = mesh.normals
    if normals is not None:
        short = np.linalg.norm(normals, axis=1) < 1e-12
        if short.any():  # some exporters write 0 0 0; these normals are computed from the adjacent faces
            face_normals = np.zeros_like(normals)
            np.add.at(face_normals, faces.ravel(), np.repeat(crossed, 3, axis=0))
            normals = np.where(short[:, None], face_normals, normals)
        normals = _unit(normals)
    return replace(mesh, faces=faces, normals=normals)


def read_obj(data: bytes, path: Path, where: str) -> Triangles:
    """Read Wavefront OBJ data, of which v, vt, vn and f are used. Polygons are divided into triangle fans; negative
    indices count from the end. Errors name `path` and `where`."""
    columns: dict[bytes, list[list[float]]] = {b"v": [], b"vt": [], b"vn": []}
    corners: list[tuple[int, int, int]] = []
    needed = {b"v": 3, b"vt": 2, b"vn": 3}
    counts = (columns[b"v"], columns[b"vt"], columns[b"vn"])

    def refuse(line: int, what: str, hint: str = "export the mesh again") -> NoReturn:
        raise InputError(f"{path.name}:{line}: {what}", where, hint)

    def corner(token: bytes, line: int) -> tuple[int, int, int]:
        indices = [-1, -1, -1]
        for slot, text in enumerate(token.split(b"/")[:3]):
            if not text and slot > 0:
                continue
            try:
                number = int(text)
            except ValueError:
                refuse(line, f"'{_show(token)}' is not a face vertex", "write f 1 2 3, f 1/1 2/2 3/3 or f 1/1/1 ...")
            count = len(counts[slot])
            index = number - 1 if number > 0 else count + number
            if number == 0 or not 0 <= index < count:
                kind = ("vertex", "texture coordinate", "normal")[slot]
                refuse(line, f"the face names {kind} {number}, {count} are given above it", "numbers start at 1")
            indices[slot] = index
        return indices[0], indices[1], indices[2]

    for number, line in enumerate(data.split(b"\n"), start=1):
        words = line.split()
        if not words:
            continue
        key = words[0]
        if key in needed:
            try:
                values = [float(word) for word in words[1 : 1 + needed[key]]]
            except ValueError:
                refuse(number, f"'{_show(line)}' contains something that is not a number")
            if len(values) < needed[key]:
                refuse(number, f"'{_show(line)}': {needed[key]} numbers expected")
            columns[key].append(values)
        elif key == b"f":
            polygon = [corner(word, number) for word in words[1:]]
            if len(polygon) < 3:
                refuse(number, f"a face of {len(polygon)} vertices, at least 3 expected")
            for second, third in pairwise(polygon[1:]):
                corners += [polygon[0], second, third]
    if not corners:
        raise InputError(f"'{path.name}' has no faces", where, "is it an OBJ file? expected lines like: f 1 2 3")
    # Each distinct combination of position, uv and normal becomes one vertex.
    combined, faces = np.unique(np.array(corners), axis=0, return_inverse=True)
    arrays = {key: np.array(rows, dtype=float).reshape(-1, needed[key]) for key, rows in columns.items()}
    has_uv, has_normals = (combined[:, 1] >= 0).all(), (combined[:, 2] >= 0).all()
    return Triangles(
        arrays[b"v"][combined[:, 0]],
        faces.reshape(-1, 3),
        arrays[b"vn"][combined[:, 2]] if has_normals else None,
        arrays[b"vt"][combined[:, 1]] if has_uv else None,
    )


def _show(text: bytes) -> str:
    return text[:40].decode("ascii", "replace").strip()


_PLY_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip


def read_ply(data: bytes, path: Path, where: str) -> Triangles:
    """Read the triangles of Stanford PLY data, ASCII or binary. Errors name `path` and `where`.

    Two elements are read: vertex, with x y z [nx ny nz] [u v | s t | texture_u texture_v], and face, with index lists.
    """

    def refuse(what: str, hint: str = "export the mesh again") -> NoReturn:
        raise InputError(f"'{path.name}': {what}", where, hint)

    end = data.find(b"end_header")
    if not data.startswith(b"ply") or end < 0:
        refuse("no PLY header", "is it a PLY file?")
    start = data.find(b"\n", end) + 1
    if start == 0:
        refuse("nothing follows the header")
    order, elements = _ply_header(data[:end], refuse)
    tables: dict[str, PlyTable] = {}
    body = memoryview(data)[start:]
    words = data[start:].split() if order == "ascii" else []
    for name, count, properties in elements:
        try:
            if order == "ascii":
                tables[name], words = _ply_ascii(words, count, properties)
            else:
                tables[name], body = _ply_binary(body, count, properties, order)
        except (ValueError, IndexError, OverflowError):
            refuse(f"the file is truncated or damaged within its {count} '{name}' entries")
        if "vertex" in tables and "face" in tables:
            break
    vertex = {name: column for name, column in tables.get("vertex", {}).items() if isinstance(column, np.ndarray)}
    if not {"x", "y", "z"} <= set(vertex):
        refuse("no vertices with x, y, z")
    lists = [column for column in tables.get("face", {}).values() if isinstance(column, list)]
    if not lists:
        refuse("no faces")

    def columns(*names: str) -> np.ndarray | None:
        if not set(names) <= set(vertex):
            return None
        return np.stack([np.asarray(vertex[name], dtype=float) for name in names], axis=1)

    faces = [(polygon[0], second, third) for polygon in lists[0] for second, third in pairwise(polygon[1:])]
    uv = [columns(*names) for names in (("u", "v"), ("s", "t"), ("texture_u", "texture_v"))]
    positions = columns("x", "y", "z")
    assert positions is not None
    try:
        triangles = np.array(faces, dtype=np.int64).reshape(-1, 3)
    except OverflowError:
        refuse("a face has a vertex index that is out of range")
    return Triangles(
        positions,
        triangles,
        columns("nx", "ny", "nz"),
        next((table for table in uv if table is not None), None),
    )


class _Refuse(Protocol):
    """The type of functions that raise InputError."""

    def __call__(self, what: str, hint: str = "") -> NoReturn: ...


def _ply_header(header: bytes, refuse: _Refuse) -> tuple[str, list[tuple[str, int, PlyProperties]]]:
    """The byte order ("ascii", "<" or ">"), and the name, count and properties of each element."""
    order = ""
    elements: list[tuple[str, int, PlyProperties]] = []
    for line in header.decode("ascii", "replace").splitlines()[1:]:
        words = line.split()
        if not words or words[0] in ("comment", "obj_info"):
            continue
        if words[0] == "format" and len(words) > 1:
            order = {"ascii": "ascii", "binary_little_endian": "<", "binary_big_endian": ">"}.get(words[1], "")
        elif words[0] == "element" and len(words) == 3 and words[2].isdecimal() and len(words[2]) < 12:
            elements.append((words[1], int(words[2]), []))
        elif words[0] == "property" and elements and len(words) in (3, 5):
            if any(kind not in _PLY_TYPES for kind in (words[2:4] if words[1] == "list" else words[1:2])):
                refuse(f"unknown property '{line.strip()[:40]}'")
            if any(words[-1] == known[-1] for known in elements[-1][2]):
                refuse(f"the property '{words[-1][:40]}' is given twice")
            elements[-1][2].append(tuple(words[1:]))
        else:
            refuse(f"the header line '{line.strip()[:40]}' is not understood")
    if not order:
        refuse("no format ascii, binary_little_endian or binary_big_endian")
    return order, elements


def _ply_ascii(words: list[bytes], count: int, properties: PlyProperties) -> tuple[PlyTable, list[bytes]]:
    if count > len(words) + 1:  # checked before allocation, because the count in the header may be wrong
        raise ValueError
    numbers: dict[str, list[float]] = {p[-1]: [] for p in properties if p[0] != "list"}
    lists: dict[str, list[list[int]]] = {p[-1]: [] for p in properties if p[0] == "list"}
    at = 0
    for _ in range(count):
        for *kind, name in properties:
            if kind[0] == "list":
                length = int(words[at])
                if not 0 <= length <= len(words) - at - 1:
                    raise ValueError
                lists[name].append([int(word) for word in words[at + 1 : at + 1 + length]])
                at += 1 + length
            else:
                numbers[name].append(float(words[at]))
                at += 1
    return {**{name: np.array(column) for name, column in numbers.items()}, **lists}, words[at:]


def _ply_binary(body: memoryview, count: int, properties: PlyProperties, order: str) -> tuple[PlyTable, memoryview]:
    if count > len(body):  # checked before allocation, because the count in the header may be wrong
        raise ValueError
    if not any(p[0] == "list" for p in properties):
        row = np.dtype([(name, order + _PLY_TYPES[kind]) for kind, name in properties])
        rows = np.frombuffer(body, row, count)
        return {name: rows[name] for name in row.names or ()}, body[count * row.itemsize :]
    fast = _ply_triangles(body, count, properties, order)
    if fast is not None:
        return fast
    numbers: dict[str, list[float]] = {p[-1]: [] for p in properties if p[0] != "list"}
    lists: dict[str, list[list[int]]] = {p[-1]: [] for p in properties if p[0] == "list"}
    at = 0
    for _ in range(count):
        for *kind, name in properties:
            if kind[0] == "list":
                counter = np.dtype(order + _PLY_TYPES[kind[1]])
                length = int(np.frombuffer(body, counter, 1, at)[0])
                item = np.dtype(order + _PLY_TYPES[kind[2]])
                at += counter.itemsize
                if not 0 <= length * item.itemsize <= len(body) - at:
                    raise ValueError
                lists[name].append(np.frombuffer(body, item, length, at).astype(int).tolist())
                at += length * item.itemsize
            else:
                item = np.dtype(order + _PLY_TYPES[kind[0]])
                numbers[name].append(float(np.frombuffer(body, item, 1, at)[0]))
                at += item.itemsize
    return {**{name: np.array(column) for name, column in numbers.items()}, **lists}, body[at:]


def _ply_triangles(
    body: memoryview, count: int, properties: PlyProperties, order: str
) -> tuple[PlyTable, memoryview] | None:
    """Read the faces without a loop in the usual case, a single list of triangles; returns None in other cases."""
    if len(properties) != 1:
        return None
    _, counter, item, name = properties[0]
    row = np.dtype([("n", order + _PLY_TYPES[counter]), ("i", order + _PLY_TYPES[item], (3,))])
    if count * row.itemsize > len(body):
        return None
    rows = np.frombuffer(body, row, count)
    if not np.all(rows["n"] == 3):
        return None
    return {name: rows["i"].astype(np.int64).tolist()}, body[count * row.itemsize :]
