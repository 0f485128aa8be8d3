"""Make the images and meshes that the examples use. Run it to get them again: python examples/make_assets.py"""

from __future__ import annotations

import math
import struct
from pathlib import Path

import numpy as np
from gonio.render import engine, images

HERE = Path(__file__).parent


def png(path: str, values: np.ndarray) -> None:
    """Values in [0, 1], (height, width, 3), as bytes: v = byte / 255."""
    (HERE / path).write_bytes(images.png_bytes(np.rint(values * 255).astype(np.uint8)))


def checker(cells: int, dark: tuple[float, ...], bright: tuple[float, ...]) -> np.ndarray:
    """One texel a cell; for filter "nearest"."""
    odd = np.add.outer(np.arange(cells), np.arange(cells)) % 2
    return np.where(odd[..., None] == 1, dark, bright)


def bumps(size: int, across: int, height: float) -> np.ndarray:
    """Normal map of round bumps. Tangent along u; bitangent = normal x tangent, which on a sphere points up (-v)."""
    x, y = np.meshgrid(*[(np.arange(size) + 0.5) / size * across * 2 * math.pi] * 2)
    slope_u = height * np.cos(x) * np.sin(y)
    slope_v = height * np.sin(x) * np.cos(y)
    normal = np.stack([-slope_u, slope_v, np.ones_like(x)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return (normal + 1) / 2


def worn(size: int) -> np.ndarray:
    """Roughness of a worn surface: smooth noise of a few octaves, contrast raised, .1 to .6."""
    rng = np.random.default_rng(8)
    total = np.zeros((size, size))
    for octave in range(2, 6):
        spectrum = np.fft.rfft2(rng.standard_normal((size, size)))
        fy, fx = np.fft.fftfreq(size)[:, None] * size, np.fft.rfftfreq(size)[None, :] * size
        band = np.exp(-((np.hypot(fx, fy) / 2**octave) ** 2))  # periodic, so it tiles
        layer = np.fft.irfft2(spectrum * band, s=(size, size))
        total += layer / layer.std() / 2**octave * 4
    share = 1 / (1 + np.exp(-2.5 * total / total.std()))
    return np.repeat((0.1 + 0.5 * share)[..., None], 3, axis=2)


def sky(height: int) -> np.ndarray:
    """A studio: dim grey-blue walls, a floor, two soft boxes. Row t = angle from +y, column p = angle from +z to +x."""
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


def main() -> None:
    mi = engine.load()
    grey, white = (0.25, 0.25, 0.25), (0.75, 0.75, 0.75)
    for folder in ("mirror-glass", "rough-dielectric", "shader-ball"):
        png(f"{folder}/checker.png", checker(20, grey, white))
    png("textured/checker.png", checker(16, (0.05, 0.12, 0.3), (0.85, 0.8, 0.65)))
    png("textured/worn.png", worn(256))
    png("normal-map/bumps.png", bumps(256, 12, 0.7))
    ply("shader-ball/shell.ply", *shell(1.0, 0.93))
    mi.Bitmap(sky(128)).write(str(HERE / "shader-ball" / "studio.hdr"))


if __name__ == "__main__":
    main()
