"""The split sum of image-based lighting (Karis2013): E = F0 A + B for Schlick's Fresnel, and prefiltered maps.

    light reflected ~ (F0 A(mu, roughness) + B(mu, roughness)) * prefiltered radiance (reflected direction, roughness)

A + B is E at F = 1, and B the albedo at F = (1 - o.m)^5.
"""

from __future__ import annotations

import numpy as np

from ...errors import InputError
from ...models import Microsurface
from ...models.microfacet import widths
from ...ops import Direction, Scalar, Spectrum, Table, inset, lookup, maximum, sqrt
from ...ops.backend import Array
from .. import cache
from ..albedo import quadrature
from ..albedo.monte_carlo import hammersley

SIZE = 128  # bilinear between them errs by 3e-4 for roughness >= .1


@cache.of_members
def schlick_table(ndf: str, masking: str) -> Table:
    """B over (roughness, sqrt(mu)), nodes at both ends of each axis."""

    def build() -> np.ndarray:
        ends = np.linspace(0.0, 1.0, SIZE)
        return quadrature.moments(ndf, masking, ends**2, ends[:, None] ** 2).schlick[..., None]

    key = ("split-sum", ndf, masking, *cache.origin(ndf, masking), SIZE)
    return Table(f"schlick_{ndf}_{masking}".replace("-", "_"), cache.remember(key, build))


def reflected(surface: Microsurface, f0: Spectrum, whole: Scalar, wo: Direction) -> Spectrum:
    """F0 A + B at wo.

    whole  E(mu) at F = 1, A + B
    """
    alpha, _ = widths(surface.alpha)
    row, column = inset(sqrt(sqrt(alpha.x * alpha.y)), SIZE), inset(sqrt(maximum(wo.z, 1e-6)), SIZE)
    (b,) = lookup(schlick_table(surface.ndf, surface.masking), row, column)
    return f0 * maximum(whole - b, 0.0) + b


def prefilter(environment: np.ndarray, levels: int = 6, samples: int = 512) -> list[np.ndarray]:
    """A mip chain of an environment map for specular lighting by roughness: level l is for roughness l / (levels - 1).

    environment  latitude-longitude radiance, (H, W, channels), z up, row 0 toward +z
    Returns `levels` maps, each half as large as the one before, the first the map itself. Texel r holds
    sum L(i) i.n / sum i.n over GGX normals at n = o = r (Karis2013); each sample reads the mip level whose texels are
    as wide as the sample's share of solid angle (Krivanek2008), so few samples are enough.
    """
    source = np.asarray(environment, dtype=np.float64)
    if source.ndim != 3 or min(source.shape) < 1:
        raise InputError(f"a map of shape {source.shape}, expected (H, W, channels)", "prefilter: environment")
    if levels < 2 or samples < 1:
        raise InputError(f"{levels} levels, {samples} samples", "prefilter", "give 2 or more levels, 1 or more samples")
    pyramid = [source]
    while min(pyramid[-1].shape[:2]) > 1:
        pyramid.append(_half(pyramid[-1]))
    u = hammersley(samples)
    result = [source]
    for level in range(1, levels):
        alpha = (level / (levels - 1)) ** 2
        height, width = max(source.shape[0] >> level, 1), max(source.shape[1] >> level, 1)
        theta = (np.arange(height) + 0.5) / height * np.pi
        phi = (np.arange(width) + 0.5) / width * 2 * np.pi
        n = np.stack(
            np.broadcast_arrays(
                np.sin(theta)[:, None] * np.cos(phi), np.sin(theta)[:, None] * np.sin(phi), np.cos(theta)[:, None]
            ),
            -1,
        )
        tangent = np.stack([-np.sin(phi), np.cos(phi), 0 * phi], -1)[None] + 0 * n
        bitangent = np.cross(n, tangent)
        total = np.zeros((height, width, source.shape[2]))
        weights = 0.0
        slope = alpha * np.sqrt(u[:, 0] / (1.0 - u[:, 0]))
        for t, angle in zip(slope, 2 * np.pi * u[:, 1], strict=True):
            cos_m = 1.0 / np.hypot(1.0, t)
            z = 2.0 * cos_m * cos_m - 1.0  # n.i, with o = n
            if z <= 0.0:
                continue
            r = np.sqrt(1.0 - z * z)
            i = n * z + tangent * (r * np.cos(angle)) + bitangent * (r * np.sin(angle))
            density = alpha**2 / (np.pi * (cos_m**2 * (alpha**2 - 1.0) + 1.0) ** 2) / 4.0
            texel = 4.0 * np.pi / (source.shape[0] * source.shape[1])
            mip = 0.5 * np.log2(max(1.0 / (samples * density) / texel, 1.0)) + 1.0
            total += z * _read(pyramid, i, mip)
            weights += z
        result.append(total / weights)
    return result


def _half(image: np.ndarray) -> np.ndarray:
    """Every two texels each way averaged, weighed by solid angle; odd rests are dropped."""
    height, width = image.shape[0] // 2 * 2, image.shape[1] // 2 * 2
    solid = np.sin((np.arange(height) + 0.5) / image.shape[0] * np.pi)[:, None, None]
    split = (height // 2, 2, width // 2, 2, image.shape[2])
    weighed = (image[:height, :width] * solid).reshape(split).sum((1, 3))
    return weighed / (2.0 * solid.reshape(height // 2, 2, 1).sum(1))[..., None].reshape(height // 2, 1, 1)


def _read(pyramid: list[np.ndarray], w: np.ndarray, mip: float) -> np.ndarray:
    """Trilinear lookup of directions in the pyramid; longitudes wrap."""
    mip = min(mip, len(pyramid) - 1.0)
    low = int(mip)
    total: Array = 0.0
    for level, share in ((low, 1.0 - (mip - low)), (low + 1, mip - low)):
        if share == 0.0:
            continue
        image = pyramid[level]
        height, width = image.shape[:2]
        y = np.clip(np.arccos(np.clip(w[..., 2], -1, 1)) / np.pi * height - 0.5, 0, height - 1)
        x = np.arctan2(w[..., 1], w[..., 0]) / (2 * np.pi) * width - 0.5
        y0, x0 = np.floor(y).astype(int), np.floor(x).astype(int)
        fy, fx = (y - y0)[..., None], (x - x0)[..., None]
        y1 = np.minimum(y0 + 1, height - 1)
        x0, x1 = x0 % width, (x0 + 1) % width
        top = image[y0, x0] * (1 - fx) + image[y0, x1] * fx
        bottom = image[y1, x0] * (1 - fx) + image[y1, x1] * fx
        total = total + share * (top * (1 - fy) + bottom * fy)
    return total
