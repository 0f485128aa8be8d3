"""Generate the images and meshes that the examples use: python examples/make_assets.py"""

from __future__ import annotations

import itertools
import math
import struct
from pathlib import Path

import gonio as go
import numpy as np
from gonio.bridge import engine
from gonio.instruments.capture import rehearsal
from gonio.pictures import images
from scipy.ndimage import map_coordinates
from scipy.spatial import ConvexHull, HalfspaceIntersection

HERE = Path(__file__).parent


def png(path: str, values: np.ndarray) -> None:
    """Write values in [0, 1], (height, width, 3), as bytes: v = byte / 255."""
    (HERE / path).write_bytes(images.png_bytes(np.rint(values * 255).astype(np.uint8)))


def checker(cells: int, dark: tuple[float, ...], bright: tuple[float, ...]) -> np.ndarray:
    """A checkerboard with one texel per cell, for filter "nearest"."""
    odd = np.add.outer(np.arange(cells), np.arange(cells)) % 2
    return np.where(odd[..., None] == 1, dark, bright)


def sphere(height: int) -> tuple[np.ndarray, np.ndarray]:
    """Points of the unit sphere for the texels of a map, (height, 2 height, 3), and their azimuths."""
    v, u = np.meshgrid((np.arange(height) + 0.5) / height, (np.arange(2 * height) + 0.5) / height / 2, indexing="ij")
    theta, phi = math.pi * v, 2.0 * math.pi * u
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1), phi


def scattered(rng: np.random.Generator, count: int) -> np.ndarray:
    """Random points on the unit sphere, (count, 3)."""
    points = rng.standard_normal((count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def hammered(height: int, dents: int, seed: int, depth: float = 0.055) -> np.ndarray:
    """Normal map of a hammered sphere with round dents, (height, 2 height, 3).

    Each point belongs to the dent with the nearest center. Dents are bowls, which meet in ridges. Tangent along u;
    bitangent = normal x tangent, which on a sphere points up (-v).
    """
    rng = np.random.default_rng(seed)
    centers = scattered(rng, dents)
    place, phi = sphere(height)
    nearest = centers[np.argmax(place @ centers.T, axis=-1)]
    away = place - nearest  # the slope of a bowl is proportional to it
    east = np.stack([-np.sin(phi), np.cos(phi), np.zeros_like(phi)], -1)
    steep = depth * dents**0.5
    slope_u = steep * np.sum(away * east, -1)
    slope_v = steep * np.sum(away * np.cross(place, east), -1)
    normal = np.stack([-slope_u, -slope_v, np.ones_like(slope_u)], -1)
    return (normal / np.linalg.norm(normal, axis=-1, keepdims=True) + 1) / 2


def terrazzo(height: int, chips: int, seed: int) -> np.ndarray:
    """Albedo of a floor of colored stone chips in cream cement, (height, 2 height, 3), for a sphere or a tile."""
    rng = np.random.default_rng(seed)
    centers = scattered(rng, chips)
    place, _ = sphere(height)
    near = np.sort(place @ centers.T, axis=-1)[..., -2:]
    margin = np.arccos(np.clip(near[..., 0], -1, 1)) - np.arccos(np.clip(near[..., 1], -1, 1))
    which = np.argmax(place @ centers.T, axis=-1)
    stones = np.array([[0.62, 0.12, 0.06], [0.04, 0.16, 0.3], [0.75, 0.42, 0.1], [0.06, 0.28, 0.22], [0.12, 0.1, 0.1]])
    color = stones[rng.integers(len(stones), size=chips)[which]]
    gap = rng.uniform(0.25, 0.9, chips)[which] / chips**0.5
    return np.where((margin > gap)[..., None], color, np.array([0.8, 0.74, 0.62]))


def cloudy(size: int, seed: int, octaves: range) -> np.ndarray:
    """Smooth tileable noise of a few octaves with increased contrast, 0 to 1."""
    rng = np.random.default_rng(seed)
    total = np.zeros((size, size))
    for octave in octaves:
        spectrum = np.fft.rfft2(rng.standard_normal((size, size)))
        fy, fx = np.fft.fftfreq(size)[:, None] * size, np.fft.rfftfreq(size)[None, :] * size
        band = np.exp(-((np.hypot(fx, fy) / 2**octave) ** 2))  # periodic, so it tiles
        layer = np.fft.irfft2(spectrum * band, s=(size, size))
        total += layer / layer.std() / 2**octave * 4
    return 1 / (1 + np.exp(-2.5 * total / total.std()))


def worn(size: int) -> np.ndarray:
    """Roughness of a worn surface, 0.1 to 0.6."""
    return np.repeat((0.1 + 0.5 * cloudy(size, 8, range(2, 6)))[..., None], 3, axis=2)


def maria(height: int) -> np.ndarray:
    """Albedo of a moon, (height, 2 height, 3): dark plains in bright highlands, craters, rays around the youngest."""
    rng = np.random.default_rng(11)
    place, _ = sphere(height)

    def noise(rate: float, waves: int = 24) -> np.ndarray:
        ways = rng.standard_normal((waves, 3)) * rate
        return np.cos(place @ ways.T + rng.uniform(0, 2 * math.pi, waves)).sum(-1) / waves**0.5

    detail = 0.25 * noise(9) + 0.2 * noise(19) + 0.12 * noise(40)
    plains = 1 / (1 + np.exp(-9 * (noise(2.2) + detail - 0.15)))
    level = 0.5 - 0.26 * plains + 0.05 * noise(30) * (1 - 0.6 * plains)
    for k in range(340):
        center = rng.standard_normal(3)
        center /= np.linalg.norm(center)
        radius = 0.012 * rng.uniform() ** -0.45
        if k % 60 == 0:
            radius = 0.045
        near = place @ center > math.cos(min(9 * radius, 1.2))
        away = np.arccos(np.clip(place[near] @ center, -1, 1)) / radius
        level[near] *= 1 - 0.22 * (away < 0.85) + 0.3 * np.exp(-(((away - 1) / 0.16) ** 2))
        if k % 60 == 0:  # rays of bright dust
            axis = np.cross(center, [0.3, 0.5, 0.81])
            axis /= np.linalg.norm(axis)
            turn = np.arctan2(place[near] @ np.cross(center, axis), place[near] @ axis)
            star = np.maximum(np.cos(7 * turn + 2 * np.sin(3 * turn)), 0) ** 6
            level[near] += (0.1 + 0.28 * star) * np.exp(-away / 3.2) * (away > 0.9)
    level = np.rint(np.clip(level, 0.1, 0.75) * 128) / 128  # few levels, which compress well
    return level[..., None] * np.array([1.0, 0.97, 0.92])


def shore_sky(height: int) -> np.ndarray:
    """A summer sky over a lake, its horizon bright, woods on a third of the shore. Row t, column p as in `sky`."""
    theta, phi = np.meshgrid(
        (np.arange(height) + 0.5) / height * math.pi, (np.arange(2 * height) + 0.5) / height * math.pi, indexing="ij"
    )
    up = np.clip(np.cos(theta), 0.0, 1.0)[..., None]
    blue = np.array([0.95, 0.95, 0.9]) * (1.0 - up) ** 3 + np.array([0.1, 0.3, 0.72]) * (1.0 - (1.0 - up) ** 3)
    # Clouds in a planar projection from below, so that they have no seam at the zenith.
    radius = height / 2.0 * np.tan(np.minimum(theta, 1.45) / 2.0)
    place = [height / 2.0 + radius * f(phi) for f in (np.cos, np.sin)]
    cover, relief = (
        map_coordinates(cloudy(height, seed, octaves), place, order=1, mode="nearest")[..., None]
        for seed, octaves in ((23, range(2, 6)), (5, range(3, 7)))
    )
    white = np.array([1.0, 0.98, 0.95]) * (0.72 + 0.28 * relief)
    picture = blue + np.clip(1.6 * cover - 0.75, 0.0, 1.0) * (white - blue)
    waves = sum(np.sin(k * phi + k * k) / k**0.7 for k in (3, 7, 13, 29, 53, 83))
    woods = np.radians(9.0 + 3.0 * waves) * np.clip(2.5 * np.cos(phi - 0.9) - 1.0, 0.0, 1.0)
    picture = np.where((math.pi / 2.0 - theta < woods)[..., None], [0.035, 0.06, 0.03], picture)
    return 0.72 * np.where((theta > math.pi / 2.0)[..., None], [0.1, 0.15, 0.16], np.clip(picture, 0.0, 1.0))


def sky(height: int) -> np.ndarray:
    """A studio: dim gray-blue walls, a floor, two soft boxes. Row t = angle from +y, column p = angle from +z to +x."""
    theta, phi = np.meshgrid(
        (np.arange(height) + 0.5) / height * math.pi, (np.arange(2 * height) + 0.5) / height * math.pi, indexing="ij"
    )
    picture = 0.12 + 0.25 * np.clip(np.cos(theta), 0, 1)[..., None] * np.array([0.8, 0.9, 1.0])
    picture = np.where((theta > math.pi / 2)[..., None], [0.07, 0.065, 0.06], picture)
    for middle_theta, middle_phi, across, radiance in ((1.0, 0.9, 0.35, 6.0), (1.15, 5.2, 0.25, 3.0)):
        apart = np.abs((phi - middle_phi + math.pi) % (2 * math.pi) - math.pi)
        inside = (np.abs(theta - middle_theta) < across * 1.2) & (apart < across)
        picture = np.where(inside[..., None], radiance * np.array([1.0, 0.96, 0.9]), picture)
    return picture.astype(np.float32)


def ply(path: str, vertices: np.ndarray, normals: np.ndarray, uv: np.ndarray, faces: np.ndarray) -> None:
    names = ["x", "y", "z", "nx", "ny", "nz", "s", "t"]
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    header += [f"property float {name}" for name in names]
    header += [f"element face {len(faces)}", "property list uchar ushort vertex_indices", "end_header", ""]
    body = np.hstack([vertices, normals, uv]).astype("<f4").tobytes()
    body += b"".join(struct.pack("<B3H", 3, *map(int, face)) for face in faces)
    (HERE / path).write_bytes("\n".join(header).encode() + body)


def shell(radius: float, inner: float, rows: int = 40, columns: int = 80) -> tuple[np.ndarray, ...]:
    """A hollow sphere with a window toward +z: outer skin, inner skin, and the rim of the window between them."""
    open_rows, open_columns = range(rows // 4, rows * 5 // 8), range(columns // 16, columns * 5 // 16)
    theta, phi = np.meshgrid(
        np.arange(rows + 1) / rows * math.pi, np.arange(columns + 1) / columns * 2 * math.pi, indexing="ij"
    )
    out = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), np.sin(theta) * np.cos(phi)], axis=-1).reshape(-1, 3)
    uv = np.stack([phi / (2 * math.pi), theta / math.pi], axis=-1).reshape(-1, 2)
    number = np.arange((rows + 1) * (columns + 1)).reshape(rows + 1, columns + 1)

    def window(i: int, j: int) -> bool:
        return i in open_rows and j in open_columns

    quads, rims = [], []
    for i in range(rows):
        for j in range(columns):
            if window(i, j):
                continue
            a, b, c, d = number[i, j], number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]
            quads.append((a, b, c, d))
            beyond = (((a, b), i, j - 1), ((b, c), i + 1, j), ((c, d), i, j + 1), ((d, a), i - 1, j))
            for (p, q), k, m in beyond:
                if window(k, m):
                    rims.append((p, q))
    vertices, normals, coordinates = [out * radius, out * inner], [out, -out], [uv, uv]
    quad = np.array(quads)
    faces = [quad[:, :3], quad[:, [0, 2, 3]], quad[:, 2::-1] + len(out), quad[:, [3, 2, 0]] + len(out)]
    first = 2 * len(out)
    for p, q in rims:
        corners = np.array([out[p] * radius, out[p] * inner, out[q] * inner, out[q] * radius])
        normal = np.cross(corners[1] - corners[0], corners[3] - corners[0])
        vertices.append(corners)
        normals.append(np.tile(normal / np.linalg.norm(normal), (4, 1)))
        coordinates.append(uv[[p, p, q, q]])
        faces.append(first + np.array([[0, 1, 2], [0, 2, 3]]))
        first += 4
    return np.vstack(vertices), np.vstack(normals), np.vstack(coordinates), np.vstack(faces)


def obj(path: str, vertices: np.ndarray, faces: np.ndarray) -> None:
    """Write a faceted mesh as an .obj file; indices in `faces` start at 0."""
    lines = [*("v {:.9g} {:.9g} {:.9g}".format(*v) for v in vertices), *("f {} {} {}".format(*f) for f in faces + 1)]
    (HERE / path).write_text("\n".join(lines) + "\n")


def convex(vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The convex hull of points, with triangles counterclockwise as seen from outside."""
    hull = ConvexHull(vertices)
    faces = hull.simplices.copy()
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0.0
    faces[inward] = faces[inward, ::-1]
    return vertices, faces


def prism(turn: float, height: float) -> tuple[np.ndarray, np.ndarray]:
    """An upright prism of side 1; its base runs along x, rotated toward -z, its apex points to +z."""
    along, apex = np.array([math.cos(turn), -math.sin(turn)]), np.array([math.sin(turn), math.cos(turn)])
    corners = [apex / math.sqrt(3.0), *(-apex / math.sqrt(12.0) + side * along / 2.0 for side in (-1.0, 1.0))]
    return convex(np.array([[x, y, z] for y in (0.0, height) for x, z in corners]))


def brilliant() -> tuple[np.ndarray, np.ndarray]:
    """A round brilliant of radius 1 with 57 facets, a girdle and Tolkowsky's proportions; its table faces +y."""
    crown, pavilion, table, girdle = math.radians(34.5), math.radians(40.75), 0.53, 0.02
    top = girdle + (1.0 - table) * math.tan(crown)
    planes = [(0.0, 1.0, 0.0, top)]

    def ring(count: int, first: float, angle: float, radius: float, height: float) -> None:
        """Add facets tilted by `angle`, negative below the girdle, through the point at that radius and height."""
        for number in range(count):
            around = math.radians(first) + number * 2.0 * math.pi / count
            sin, cos = math.sin(abs(angle)), math.copysign(math.cos(angle), angle)
            planes.append((sin * math.cos(around), cos, sin * math.sin(around), sin * radius + cos * height))

    ring(8, 0.0, crown, 1.0, girdle)
    ring(8, 22.5, math.radians(21.5), table * math.cos(math.radians(22.5)), top)
    ring(16, 11.25, math.radians(40.5), 1.0, girdle)
    ring(64, 0.0, math.pi / 2.0, 1.0, 0.0)
    ring(16, 11.25, -math.radians(42.0), 1.0, -girdle)
    ring(8, 0.0, -pavilion, 1.0, -girdle)
    halves = np.array(planes) * [1.0, 1.0, 1.0, -1.0]
    corners = HalfspaceIntersection(halves, np.zeros(3)).intersections
    return convex(np.unique(corners.round(7), axis=0))


def tube(points: np.ndarray, radius: float, sides: int = 48) -> tuple[np.ndarray, ...]:
    """A rod along points, with a smooth outside and flat ends."""
    along = np.gradient(points, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across = np.zeros_like(along)
    across[0] = np.cross(along[0], [0.0, 1.0, 0.0])
    for i in range(1, len(points)):  # transport the frame without twist
        across[i] = across[i - 1] - along[i] * (along[i] @ across[i - 1])
        across[i] /= np.linalg.norm(across[i])
    other = np.cross(along, across)
    angle = np.arange(sides) / sides * 2.0 * math.pi
    out = np.cos(angle)[None, :, None] * across[:, None] + np.sin(angle)[None, :, None] * other[:, None]
    skin = points[:, None] + radius * out
    number = np.arange(len(points) * sides).reshape(len(points), sides)
    a, b = number[:-1], number[1:]
    quads = [a, np.roll(a, -1, 1), np.roll(b, -1, 1), b]
    faces = [np.stack([quads[i].ravel() for i in three], 1) for three in ((0, 1, 2), (0, 2, 3))]
    vertices, normals, first = [skin.reshape(-1, 3)], [out.reshape(-1, 3)], number.size
    for end, sign in ((0, -1.0), (-1, 1.0)):
        vertices += [skin[end], points[end][None]]
        normals.append(np.tile(sign * along[end], (sides + 1, 1)))
        rim = first + np.arange(sides)
        fan = np.stack([rim, np.roll(rim, -1), np.full(sides, first + sides)], 1)
        faces.append(fan if sign > 0 else fan[:, ::-1])
        first += sides + 1
    found = np.vstack(vertices)
    return found, np.vstack(normals), np.zeros((len(found), 2)), np.vstack(faces)


def waves(size: int, cells: int, height: float) -> tuple[np.ndarray, ...]:
    """A water surface with waves over [-size, size]^2: heights from a sum of sines, normals from its slopes."""
    rng = np.random.default_rng(4)
    x, z = (axis.ravel() for axis in np.meshgrid(*[np.linspace(-size, size, cells + 1)] * 2, indexing="ij"))
    level, slope_x, slope_z = np.zeros_like(x), np.zeros_like(x), np.zeros_like(x)
    for _ in range(24):
        turn, number, phase = rng.uniform(0.0, 2.0 * math.pi), rng.uniform(5.0, 16.0), rng.uniform(0.0, 2.0 * math.pi)
        kx, kz = number * math.cos(turn), number * math.sin(turn)
        rise = height / number
        level += rise * np.sin(kx * x + kz * z + phase)
        slope = rise * np.cos(kx * x + kz * z + phase)
        slope_x, slope_z = slope_x + kx * slope, slope_z + kz * slope
    normals = np.stack([-slope_x, np.ones_like(x), -slope_z], 1)
    number = np.arange(x.size).reshape(cells + 1, cells + 1)
    a, b, c, d = (part.ravel() for part in (number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]))
    faces = np.vstack([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return np.stack([x, level, z], 1), normals, np.zeros((x.size, 2)), faces


def turned(profile: np.ndarray, sides: int) -> tuple[np.ndarray, ...]:
    """A solid of revolution about +y from a profile of (radius, height); u runs around it, v along the profile.

    With the axis on the left, the profile runs counterclockwise around the inside: up the outside. Corners sharper than
    40 degrees remain sharp, because their points are duplicated, once for each side.
    """
    steps = np.diff(profile, axis=0)
    outward = np.stack([steps[:, 1], -steps[:, 0]], 1) / np.linalg.norm(steps, axis=1, keepdims=True)
    runs, first = [], 0
    for i in range(1, len(steps) + 1):
        if i == len(steps) or outward[i] @ outward[i - 1] < math.cos(math.radians(40.0)):
            runs.append((first, i))
            first = i
    points, normals = [], []
    for first, end in runs:
        own = outward[first:end]
        mean = np.vstack([own[:1], own[1:] + own[:-1], own[-1:]])
        normals.append(mean / np.linalg.norm(mean, axis=1, keepdims=True))
        points.append(profile[first : end + 1])
    starts = np.cumsum([0, *(len(run) for run in points)])
    rows = np.concatenate([np.arange(a, b - 1) for a, b in itertools.pairwise(starts)])
    place, normal = np.vstack(points), np.vstack(normals)
    turn = np.linspace(0.0, 2.0 * math.pi, sides + 1)  # the seam twice, for u = 0 and 1

    def around(pairs: np.ndarray) -> np.ndarray:
        shape = (len(pairs), sides + 1)
        x, z = pairs[:, :1] * np.sin(turn), pairs[:, :1] * np.cos(turn)
        return np.stack([x, np.broadcast_to(pairs[:, 1:], shape), z], -1).reshape(-1, 3)

    u, v = np.meshgrid(turn / (2.0 * math.pi), np.linspace(0.0, 1.0, len(place)))
    a = (rows[:, None] * (sides + 1) + np.arange(sides)).ravel()
    faces = np.vstack([np.stack([a, a + 1, a + sides + 2], 1), np.stack([a, a + sides + 2, a + sides + 1], 1)])
    return around(place), around(normal), np.stack([u.ravel(), v.ravel()], 1), faces


def draped(radius: float, height: float, folds: int, rows: int = 36, columns: int = 132) -> tuple[np.ndarray, ...]:
    """A cloth over a ball on the ground: smooth on the ball, in folds of increasing depth below its equator."""
    along = np.linspace(0.0, 1.0, rows + 1)[:, None]
    turn = np.linspace(0.0, 2.0 * math.pi, columns + 1)[None, :]
    arc = along * (math.pi / 2.0 * radius + height)  # length from the top
    angle = np.minimum(arc / radius, math.pi / 2.0)
    hanging = np.maximum(arc - math.pi / 2.0 * radius, 0.0) / height
    wave = np.cos(folds * turn + 0.9 * np.sin(2.0 * turn)) + 0.35 * np.cos((folds - 3) * turn + 1.0)
    grown = hanging**1.4
    reach = radius * np.sin(angle) * (1.0 + 0.22 * grown * (1.0 + wave))
    x, z = reach * np.sin(turn), reach * np.cos(turn)
    y = np.broadcast_to(height + radius * np.cos(angle) - height * hanging, x.shape)
    place = np.stack([x, y, z], -1)
    down, across = np.gradient(place, axis=0), np.gradient(place, axis=1)
    across[:, 0] = across[:, -1] = place[:, 1] - place[:, -2]
    normal = np.cross(down, across)
    normal[0] = [0.0, 1.0, 0.0]
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    number = np.arange(x.size).reshape(x.shape)
    a, b, c, d = (part.ravel() for part in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    faces = np.vstack([np.stack([a, b, c], 1), np.stack([a, c, d], 1)[columns:]])
    uv = np.stack(np.broadcast_arrays(turn / (2.0 * math.pi), along), -1)
    return place.reshape(-1, 3), normal.reshape(-1, 3), uv.reshape(-1, 2), faces


def goblet() -> tuple[np.ndarray, np.ndarray]:
    """Profiles of a wine glass of height 2.6, and of the wine, which extends halfway into the wall of the glass."""
    bowl = np.linspace(-math.pi / 2.0 + 0.12, 0.95, 22)
    outer = np.stack([0.72 * np.cos(bowl), 1.78 + 0.82 * np.sin(bowl)], 1)
    inner = np.stack([0.69 * np.cos(bowl), 1.79 + 0.79 * np.sin(bowl)], 1)
    foot = [(0.0, 0.0), (0.62, 0.0), (0.64, 0.015), (0.62, 0.035), (0.3, 0.06), (0.12, 0.1), (0.06, 0.2), (0.05, 0.5)]
    stem = [(0.05, 0.8), (0.06, 0.92)]
    glass = np.vstack([foot, stem, outer, inner[::-1], [(0.0, inner[0, 1] - 0.005)]])
    filled = np.linspace(-math.pi / 2.0, -0.1, 18)
    wine = np.stack([0.705 * np.cos(filled), 1.785 + 0.805 * np.sin(filled)], 1)
    wine[0, 0] = 0.0
    return glass, np.vstack([wine, [(0.0, wine[-1, 1])]])


def knob() -> np.ndarray:
    """Profile of the ring between the side and the face of a hi-fi knob of radius 1 and height 0.9."""
    turn = np.linspace(0.0, math.pi / 2.0, 7)
    return np.stack([0.94 + 0.06 * np.cos(turn), 0.84 + 0.06 * np.sin(turn)], 1)


def photographs() -> None:
    """Photographs of a ball of brown paint under one lamp after another; lengths in millimeters."""
    center, distance = np.array([0.0, 0.0, 500.0]), 400.0
    lamps = {}
    for name, angles in (("right", (20, 0)), ("below", (50, 100)), ("left", (80, 220)), ("above", (35, 300))):
        theta, phi = np.radians(angles)  # angle from the camera as seen from the ball, and azimuth about that axis
        toward = np.array([math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), -math.cos(theta)])
        lamps[name] = {"position": (center + distance * toward).round(2).tolist(), "intensity": distance**2}
    calibration = {
        "camera": {"size": [96, 96], "focal": 25.0, "pixel": 0.07},
        "response": "srgb",
        "ball": {"radius": 50.0, "center": center.tolist()},
        "lights": lamps,
        "photographs": [{"file": f"{name}.png", "seconds": 1.5, "light": name} for name in lamps],
        "uncertainty": {"light": 1.0, "scale": 0.005},
    }
    coat = go.Conductor(eta=1.5, k=0.0, alpha=0.15, fresnel="schlick")
    paint = go.Sum(go.Lambert((0.3, 0.2, 0.1)), coat)
    folder = HERE / "photographs"
    rehearsal.take(calibration, paint, folder, noise=0.01, bits=8)


def main() -> None:
    mi = engine.load()
    grey, white = (0.25, 0.25, 0.25), (0.75, 0.75, 0.75)
    for folder in ("mirror-glass", "rough-dielectric", "shader-ball"):
        png(f"{folder}/checker.png", checker(20, grey, white))
    png("textured/worn.png", worn(256))
    png("all-models/dents.png", hammered(128, 160, 5))
    png("all-models/heights.png", np.repeat(cloudy(128, 3, range(3, 5))[..., None], 3, axis=2))
    png("textured/terrazzo.png", terrazzo(400, 260, 3))
    png("full-moon/maria.png", maria(512))
    png("pool-caustic/tiles.png", checker(24, (0.08, 0.4, 0.5), (0.32, 0.62, 0.68)))
    png("snells-window/sky.png", shore_sky(512))
    png("snells-window/tiles.png", checker(16, (0.03, 0.16, 0.2), (0.08, 0.3, 0.34)))
    png("normal-map/hammered.png", hammered(384, 900, 5))
    obj("prism/prism.obj", *prism(math.asin(1.7844560 / 2.0) - math.pi / 6.0, 0.8))
    obj("diamond/brilliant.obj", *brilliant())
    way = np.linspace(0.0, 1.0, 121)
    bend = np.stack([1.6 * np.cos(1.5 * math.pi * way), 0.25 + 0.9 * way, -1.6 * np.sin(1.5 * math.pi * way)], 1)
    ply("fibre/fibre.ply", *tube(bend, 0.1, sides=48))
    ply("pool-caustic/water.ply", *waves(2, 70, 0.05))
    ply("velvet/cloth.ply", *draped(1.0, 1.1, 11))
    glass, wine = goblet()
    ply("wine/glass.ply", *turned(glass, 56))
    ply("wine/wine.ply", *turned(wine, 56))
    ply("brushed-knobs/edge.ply", *turned(knob(), 128))
    ply("shader-ball/shell.ply", *shell(1.0, 0.93))
    mi.Bitmap(sky(128)).write(str(HERE / "shader-ball" / "studio.hdr"))
    photographs()


if __name__ == "__main__":
    main()
