"""Prefilter an environment for rough mirrors: the levels of the split sum (Karis2013).

    light reflected at o ~ E(o) L_alpha(r),   L_alpha(r) = int L(i) k(r.i) di / int k(r.i) di,   r = o mirrored at n,
    k(z) = max(z, 0) D(m),   m is the half vector of r and i: the lobe at normal incidence, o = n = r, weighted by i.n.

**The method.** The kernel depends only on the angle between r and i. Between two circles of latitude, the integral is
therefore a convolution in azimuth, a product of Fourier series; the latitudes are summed directly. Every texel
contributes, and no samples are used, so a small sun causes neither noise nor blotches. If a lobe is many texels wide,
the map is first averaged in blocks; if it is narrower than a few texels, the map is interpolated.

**Two errors.** The error of the blur, measured for each level by a sum over all finely divided texels of the map, is
invisible. The error of the split sum itself is visible, because the split sum assumes a circular lobe with uniform
masking. The manifest states both errors for the environment.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct

from ...errors import InputError
from ...ops import Direction, Scalar, backend, normalize, vec2, vec3, where
from ...optics.frame import spherical_array
from ...optics.masking import masking_shadowing
from ...optics.ndf import NDF, distribution
from ..albedo import quadrature
from ..cache import content_hash
from .baked import Baked

Array: TypeAlias = NDArray[np.float64]
Environment: TypeAlias = NDArray[np.floating]

LEVELS = 6
MAX_LEVELS = 10  # lobes with alpha below (1 / 9)^2 would need grids of several thousand rows
MIN_ROWS, MAX_ROWS = 4, 4096  # rows of the map
STEPS = 8.0  # rows of the grid per half width of a lobe
MIN_GRID = 128  # smallest number of rows, for which the error of the blur is at most about 1e-3
JUDGE_STEPS, JUDGE_ROWS = 16.0, 256
COSINES = (1.0, 0.7, 0.3)  # values of n.o at which the error of the split sum is measured
_LANES = 1 << 22  # points evaluated at once: 32 MiB per array
SCHEMA = 2


def roughness_of(level: int, levels: int) -> float:
    """The roughness of a level: 0 for level 0, the map itself, and 1 for the last."""
    return level / (levels - 1)


def prefilter(
    environment: Environment, ndf: str = "ggx", levels: int = LEVELS, location: str = "environment"
) -> list[Array]:
    """The levels of an environment, each half as large as the previous one; the first is the map itself.

    environment  latitude-longitude radiance, (H, 2 H, channels), row 0 toward +z
    ndf          name of the distribution of normals
    levels       number of levels, 2 or more
    location     the name of the environment, for errors
    Level l is for roughness l / (levels - 1); its texels have the same order as those of the map.
    Raises InputError for a map of another shape, with negative or non-finite values, or too small for this many levels,
    and for an unknown distribution.
    """
    source = _checked(environment, levels, location)
    lobe = distribution(ndf)
    return [source, *(_blurred(source, lobe, level, levels) for level in range(1, levels))]


def bake(
    environment: Environment, ndf: str = "ggx", levels: int = LEVELS, masking: str = "smith-correlated",
    name: str = "environment",
) -> Baked:  # fmt: skip
    """Bake the levels of `prefilter` as arrays level_0, level_1, ..., rounded to float32. The manifest states their
    errors.

    masking  masking term that is used for the error of the split sum
    name     name of the environment, for the manifest and for errors
    """
    quadrature.known_masking(masking)
    made = prefilter(environment, ndf, levels, name)
    source = made[0]
    arrays = {f"level_{level}": values.astype(np.float32).astype(np.float64) for level, values in enumerate(made)}
    alphas = [roughness_of(level, levels) ** 2 for level in range(levels)]
    manifest = {
        "schema": SCHEMA,
        "target": Path(name).name,
        "ndf": distribution(ndf).name,
        "masking": masking,
        "method": "convolution",
        "layout": "latitude-longitude",
        "size": source.shape[0],
        "levels": [
            {"roughness": roughness_of(level, levels), "alpha": alpha, "size": [*values.shape[:2]]}
            for level, (alpha, values) in enumerate(zip(alphas, made, strict=True))
        ],
        "axes": {
            "theta": "row i at (i + 1/2) pi / H from the zenith",
            "phi": "column j at (j + 1/2) 2 pi / W, in the order of the map",
            "level": f"roughness = level / {levels - 1}, alpha = roughness^2",
            "split sum": f"E(mu) L(r) against the integral itself at F = 1, mu = {', '.join(map(str, COSINES))}",
        },
        "texels": "linear between texels and between levels",
        "errors are": "relative to the root mean square of the correct values, over the tested directions",
        "dims": {key: ["theta", "phi"] for key in arrays},
        "tables": {key: [*array.shape] for key, array in arrays.items()},
        "error": errors(made, ndf, masking),
        "hash": {key: content_hash(array) for key, array in arrays.items()},
    }
    return Baked(arrays, manifest)


def _checked(environment: Environment, levels: int, location: str) -> Array:
    source = np.asarray(environment, dtype=np.float64)
    if source.ndim != 3 or source.shape[1] != 2 * source.shape[0] or source.size == 0:
        what = f"a picture of shape {source.shape}, expected latitude-longitude: (H, 2 H, channels)"
        raise InputError(what, location, "give a panorama twice as wide as high, with the zenith on top")
    bad = np.count_nonzero(~np.isfinite(source) | (source < 0.0))
    if bad:
        raise InputError(
            f"{bad} values are negative or not finite", location, "radiance is 0 or more: correct the picture"
        )
    height = source.shape[0]
    if not MIN_ROWS <= height <= MAX_ROWS:
        raise InputError(f"a map of {height} rows, expected {MIN_ROWS} to {MAX_ROWS}", location, "scale the picture")
    if not 2 <= levels <= MAX_LEVELS:
        raise InputError(f"{levels} levels given", "--levels", f"give 2 to {MAX_LEVELS}")
    if height >> (levels - 1) < 2:
        what = f"{levels} levels of a map of {height} rows, each half as large as the one before"
        raise InputError(what, location, f"give fewer --levels, or a map of {2 << (levels - 1)} rows or more")
    return source


# --- the blur ---------------------------------------------------------------------------------------------


def _half_width(alpha: float) -> float:
    """The angle at which the lobe of GGX has fallen to a quarter; other distributions have a similar width."""
    return 2.0 * np.arctan(alpha)


def _kernel(lobe: NDF, alpha: float, z: Array) -> Array:
    """The kernel k(z) for an array z = r.i of any shape."""
    kind = backend.types("float64")
    width = backend.float_of(alpha, kind)
    cosine = kind.float(np.ascontiguousarray(z.ravel()))
    m = kind.vec3(_root(0.5 - 0.5 * cosine), 0.0, _root(0.5 + 0.5 * cosine))
    value = lobe.D(m, kind.vec2(width, width)) * backend.drjit().maximum(cosine, 0.0)
    return np.asarray(value).reshape(z.shape)


def _root(x: Scalar) -> Scalar:
    return backend.drjit().sqrt(backend.drjit().maximum(x, 0.0))


def _blurred(source: Array, lobe: NDF, level: int, levels: int) -> Array:
    """One level, by convolution in azimuth and a sum over latitudes."""
    alpha = roughness_of(level, levels) ** 2
    light = _resampled(source, max(STEPS * np.pi / _half_width(alpha), MIN_GRID))
    (rows, columns), channels = light.shape[:2], light.shape[2]
    height, width = source.shape[0] >> level, 2 * (source.shape[0] >> level)
    theta_i, theta_o = _centers(rows), _centers(height)

    # c_m of every row, times solid angle, for azimuths that start at 0, although the center of the first texel is half
    # a texel further on; they are evaluated at the level's texels. The kernel is symmetric about the equator: the
    # southern half of the level is the northern half for the flipped map.
    order = np.arange(columns // 2)
    turn = np.exp(1j * np.pi * order * (1.0 / width - 1.0 / columns))
    series = np.fft.rfft(light, axis=1)[:, :-1] * turn[:, None] * _bands(rows)[:, None, None]
    both = np.concatenate([series, series[::-1]], axis=2).transpose(1, 0, 2)

    north = (height + 1) // 2
    offsets = np.cos(np.arange(columns // 2 + 1) / columns * 2.0 * np.pi)
    result = np.empty((height, width, channels))
    step = max(1, _LANES // (rows * offsets.size))
    for start in range(0, north, step):
        theta = theta_o[start : min(start + step, north), None, None]
        z = np.cos(theta) * np.cos(theta_i[:, None]) + np.sin(theta) * np.sin(theta_i[:, None]) * offsets
        kernel = dct(_kernel(lobe, alpha, z), type=1)[..., :-1]  # Fourier series of an even function
        mean = kernel[..., 0] @ _bands(rows)
        filtered = np.matmul(kernel.transpose(2, 0, 1), both).transpose(1, 0, 2) / mean[:, None, None]
        values = _at_centers(filtered, width) / columns
        result[start : start + len(theta)] = values[..., :channels]
        for row, mirrored in enumerate(values[..., channels:]):
            result[height - 1 - start - row] = mirrored
    return np.maximum(result, 0.0)  # rounding may cause values below 0


def _at_centers(series: NDArray[np.complex128], width: int) -> Array:
    """The values of a Fourier series along axis 1 at `width` equidistant points."""
    fold = max(1, -(-2 * series.shape[1] // width))
    return np.fft.irfft(series, fold * width, axis=1)[:, ::fold] * (fold * width)


def _resampled(source: Array, wanted: float) -> Array:
    """The map on a grid of about `wanted` rows or more, averaged in blocks or interpolated between its texels."""
    height = source.shape[0]
    block = max((k for k in range(1, height // 4 + 1) if height % k == 0 and height / k >= wanted), default=1)
    if block > 1:
        split = (height // block, block, 2 * height // block, block, source.shape[2])
        weighed = (source * _bands(height)[:, None, None]).reshape(split).sum((1, 3))
        return weighed / (block * _bands(height).reshape(-1, block).sum(1))[:, None, None]
    return _divided(source, int(np.ceil(wanted / height)))


def _divided(source: Array, parts: int) -> Array:
    """The map with every texel divided into parts x parts, with the interpolation between texel centers that renderers
    use."""
    if parts <= 1:
        return source
    height, width = source.shape[:2]
    across = np.concatenate([source[:, -1:], source, source[:, :1]], axis=1)
    padded = np.concatenate([across[:1], across, across[-1:]], axis=0)
    at = (np.arange(height * parts) + 0.5) / parts + 0.5
    rows = _between(padded, at, 0)
    return _between(rows, (np.arange(width * parts) + 0.5) / parts + 0.5, 1)


def _between(values: Array, at: Array, axis: int) -> Array:
    """Values interpolated linearly along an axis at positions in units of entries."""
    low = np.minimum(at.astype(int), values.shape[axis] - 2)
    part = np.expand_dims(at - low, tuple(range(1, values.ndim - axis)))
    return np.take(values, low, axis) * (1.0 - part) + np.take(values, low + 1, axis) * part


def _centers(rows: int) -> Array:
    """Angles from the zenith of the centers of the rows."""
    return (np.arange(rows) + 0.5) / rows * np.pi


def _bands(rows: int) -> Array:
    """Solid angle of each row divided by 2 pi."""
    edges = np.cos(np.arange(rows + 1) / rows * np.pi)
    return edges[:-1] - edges[1:]


# --- reading ----------------------------------------------------------------------------------------------


def read(level: Array, directions: Array) -> Array:
    """A level at directions (..., 3): linear between texels, periodic in azimuth, constant at the poles."""
    height, width = level.shape[:2]
    y = np.clip(np.arccos(np.clip(directions[..., 2], -1.0, 1.0)) / np.pi * height - 0.5, 0.0, height - 1.0)
    x = np.arctan2(directions[..., 1], directions[..., 0]) / (2.0 * np.pi) * width - 0.5
    low, left = np.minimum(y.astype(int), height - 2), np.floor(x).astype(int)
    down, right = (y - low)[..., None], (x - left)[..., None]
    left, next_ = left % width, (left + 1) % width
    top = level[low, left] * (1.0 - right) + level[low, next_] * right
    bottom = level[low + 1, left] * (1.0 - right) + level[low + 1, next_] * right
    return top * (1.0 - down) + bottom * down


# --- the errors -------------------------------------------------------------------------------------------


def errors(levels: list[Array], ndf: str, masking: str) -> dict[str, dict[str, float]]:
    """The errors of each level: `max` and `rms`, of the blur at texels; `interpolation`, the largest error between
    texels and halfway to the previous level; `split sum`, the RMS error of the split sum. All are relative to the RMS
    of the exact values.

    They are computed by sums over every texel of the map, in eight evenly distributed directions and at the brightest
    texel of the level.
    """
    lobe, source = distribution(ndf), levels[0]
    spread = _spread(8)
    errors = {"level_0": {"max": 0.0, "rms": 0.0}}
    for level in range(1, len(levels)):
        values, roughness = levels[level], roughness_of(level, len(levels))
        directions = _of_texels(values)
        at = [int(np.argmax(directions @ d)) for d in spread] + [int(np.argmax(values.sum(-1)))]
        chosen = directions[np.unique(at)]
        sky = EveryTexel(source, roughness**2)
        right = np.stack([sky.blurred(lobe, n) for n in chosen])
        figures = _figures(read(values, chosen) - right, right)
        halfway = EveryTexel(source, (roughness - 0.5 / (len(levels) - 1)) ** 2, STEPS)
        right = np.stack([halfway.blurred(lobe, n) for n in spread])
        figures["interpolation"] = _figures(
            0.5 * (read(values, spread) + read(levels[level - 1], spread)) - right, right
        )["max"]
        albedo = quadrature.moments(lobe.name, masking, np.array(COSINES), roughness**2).white
        split = np.concatenate([e * read(values, chosen) for e in albedo])
        right = np.stack([sky.reflected(lobe, masking, *_mirrored(r, mu)) for mu in COSINES for r in chosen])
        errors[f"level_{level}"] = figures | {"split sum": _figures(split - right, right)["rms"]}
    return errors


def _figures(difference: Array, right: Array) -> dict[str, float]:
    unit = max(float(np.sqrt(np.mean(right**2))), 1e-300)
    worst, rms = float(np.max(np.abs(difference))), float(np.sqrt(np.mean(difference**2)))
    return {"max": worst / unit, "rms": rms / unit}


class EveryTexel:
    """All texels of a map, divided finely enough for a lobe, as a reference for the levels without Fourier series."""

    def __init__(self, source: Array, alpha: float, steps: float = JUDGE_STEPS) -> None:
        self.alpha = alpha
        light = _resampled(source, max(steps * np.pi / _half_width(alpha), JUDGE_ROWS))
        rows = light.shape[0]
        power = light * (_bands(rows) * 2.0 * np.pi / light.shape[1])[:, None, None]
        step = max(1, _LANES // light.shape[1])
        kind = backend.types("float64")
        self._bands: list[tuple[Direction, Array, Array]] = []
        for start in range(0, rows, step):
            w = _of_texels(light, start, start + step)
            part = power[start : start + step].reshape(-1, light.shape[2])
            solid = np.repeat(_bands(rows)[start : start + step] * 2.0 * np.pi / light.shape[1], light.shape[1])
            self._bands.append((kind.vec3(*[kind.float(np.ascontiguousarray(c)) for c in w.T]), part, solid))

    def _sums(self, n: Array, value: Callable[[Direction, Scalar], Scalar]) -> Iterator[tuple[Array, float]]:
        """The sums of L value and of value over all directions i.

        value  function value(i, alpha) in the frame of n
        """
        kind = backend.types("float64")
        dr = backend.drjit()
        alpha = backend.float_of(self.alpha, kind)
        axes = [kind.vec3(*[backend.float_of(float(c), kind) for c in axis]) for axis in _frame(n)]
        for w, power, solid in self._bands:
            weight = np.asarray(value(kind.vec3(*[dr.dot(w, axis) for axis in axes]), alpha))
            yield weight @ power, float(weight @ solid)

    def blurred(self, lobe: NDF, n: Array) -> Array:
        """L_alpha(n), computed directly from its definition."""

        def value(i: Direction, alpha: Scalar) -> Scalar:
            m = normalize(vec3(i.x, i.y, i.z + 1.0))
            return _above(i, lobe.D(m, vec2(alpha, alpha)) * i.z)

        light, weight = (np.sum(parts, axis=0) for parts in zip(*self._sums(n, value), strict=True))
        return light / weight

    def reflected(self, lobe: NDF, masking: str, o: Array, n: Array) -> Array:
        """int L(i) D G / (4 o.n) di: the integral that the split sum approximates, at F = 1."""
        kind = backend.types("float64")
        wo = kind.vec3(*[backend.float_of(float(o @ axis), kind) for axis in _frame(n)])

        def value(i: Direction, alpha: Scalar) -> Scalar:
            m = normalize(wo + i)
            g = masking_shadowing(masking, lobe, wo, i, m, vec2(alpha, alpha))
            return _above(i, lobe.D(m, vec2(alpha, alpha)) * g / (4.0 * wo.z))

        return np.sum([light for light, _ in self._sums(n, value)], axis=0)


def _above(i: Direction, value: Scalar) -> Scalar:
    return where(i.z > 0.0, value, 0.0)


def _frame(n: Array) -> Array:
    """Two unit vectors perpendicular to n, and n."""
    t = np.cross([0.0, 1.0, 0.0] if abs(n[1]) < 0.9 else [1.0, 0.0, 0.0], n)
    t /= np.linalg.norm(t)
    return np.stack([t, np.cross(n, t), n])


def _mirrored(r: Array, mu: float) -> tuple[Array, Array]:
    """o and n for which r is the mirror direction and o.n = mu, in an arbitrary plane through r."""
    n = mu * r + np.sqrt(1.0 - mu * mu) * _frame(r)[0]
    return 2.0 * mu * n - r, n


def _of_texels(level: Array, start: int = 0, stop: int | None = None) -> Array:
    """Directions of the centers of the texels in rows start to stop, (N, 3)."""
    height, width = level.shape[:2]
    theta, phi = _centers(height)[start:stop, None], (np.arange(width) + 0.5) / width * 2.0 * np.pi
    sine = np.sin(theta)
    return spherical_array(sine, np.cos(theta), phi).reshape(-1, 3)


def _spread(count: int) -> Array:
    """Directions distributed evenly over the sphere, none of them at a pole: a spiral in golden-angle steps."""
    z = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    phi = np.arange(count) * np.pi * (3.0 - np.sqrt(5.0))
    sine = np.sqrt(1.0 - z * z)
    return spherical_array(sine, z, phi)
