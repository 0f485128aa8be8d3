"""The effect of a table's error on a picture of a sphere, which is lit by a lamp and a sky."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..tables.base import Floats

SIZE = 64  # pixels across
LAMP = np.array([-0.5, 0.6, 0.62])  # direction toward the lamp, which is as bright as the whole sky
SKY = 256  # number of evenly distributed directions of the sky
DARK = 0.01  # fraction of the picture's mean: lower limit of the denominator of relative differences

Rgb = Callable[[Floats, Floats], Floats]


def frame() -> tuple[Floats, Floats, Floats]:
    """(normals, tangents, bitangents) of the pixels, (P, 3), for an orthographic view along -z."""
    x, y = np.meshgrid(*[(np.arange(SIZE) + 0.5) / SIZE * 2.0 - 1.0] * 2)
    inside = x * x + y * y < 1.0
    x, y = x[inside], y[inside]
    n = np.stack([x, y, np.sqrt(1.0 - x * x - y * y)], -1)
    t = np.cross(np.array([0.3, 1.0, 0.2]), n)
    t /= np.linalg.norm(t, axis=1, keepdims=True)
    return n, t, np.cross(n, t)


def lights() -> tuple[Floats, Floats]:
    """Directions toward the lights, (L, 3), and the irradiance from each: a spiral of equal steps, then the lamp."""
    z = 1.0 - (2.0 * np.arange(SKY) + 1.0) / SKY
    phi = np.arange(SKY) * (np.pi * (3.0 - np.sqrt(5.0)))
    r = np.sqrt(1.0 - z * z)
    sky = np.stack([r * np.cos(phi), r * np.sin(phi), z], -1)
    return np.vstack([sky, LAMP / np.linalg.norm(LAMP)]), np.append(np.full(SKY, 4.0 * np.pi / SKY), np.pi)


def picture(rgb: Rgb) -> Floats:
    """The pixels that show the sphere, (P, 3), for a function rgb(wo, wi) = f cos theta_i, (N, 3)."""
    n, t, b = frame()
    wo = np.stack([t[:, 2], b[:, 2], n[:, 2]], -1)  # the view direction, (0, 0, 1), in each pixel's frame
    radiance = np.zeros_like(n)
    for light, irradiance in zip(*lights(), strict=True):
        wi = np.stack([t @ light, b @ light, n @ light], -1)
        lit = wi[:, 2] > 0.0
        radiance[lit] += irradiance * rgb(wo[lit], wi[lit])
    return radiance


def error(old: Floats, new: Floats) -> float:
    """The mean of |new - old| / (|old| + a hundredth of the mean of |old|) over all pixels and channels."""
    return float(np.mean(np.abs(new - old) / (np.abs(old) + DARK * np.abs(old).mean())))
