"""Sample directions toward an environment with a density proportional to its luminance.

A grid, uniform in longitude and colatitude, contains one luminance per cell; within a cell, directions are uniformly
distributed. If BSDFs are sampled too (multiple importance sampling), the grid contains the excess over the mean
luminance of the sphere: BSDF sampling covers the uniform part, and light sampling concentrates on the rest
(Karlik2019).
"""

from __future__ import annotations

from types import ModuleType

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from ...bridge.faults.borrowed_memory import own
from ...bridge.types import Emitter, Float, Interaction, Mask, Point, Radiance, Scene, SurfaceInteraction, UInt, Vector

# The number of cells in longitude, twice that in colatitude, matches the resolution of the map, up to 0.35 degrees.
MIN_WIDTH, MAX_WIDTH = 64, 1024
MIN_PART = 0.05  # fraction of its luminance that each cell retains, because some materials sample their lobes poorly
SHORT = 16  # maximum number of entries of a row that is searched only by bisection
MAX_STEPS = 4  # maximum number of steps per axis at which a cell is evaluated; sufficient for maps 4096 texels wide


class Sky:
    """The density of directions toward an environment.

    compensated  whether BSDFs are sampled too, so that the uniform part is omitted
    """

    def __init__(self, mi: ModuleType, scene: Scene, emitter: Emitter, compensated: bool) -> None:
        self.mi, self.emitter = mi, emitter
        texels = max(int(mi.traverse(emitter)["data"].shape[1]) - 2, 1)  # Mitsuba repeats a column at each end
        self.width = min(max(1 << (texels - 1).bit_length(), MIN_WIDTH), MAX_WIDTH)
        self.height = self.width // 2
        luminance = self._luminance(min(max(-(-texels // self.width), 2), MAX_STEPS))
        edges = np.cos(np.pi * np.arange(self.height + 1) / self.height)
        angle = (edges[:-1] - edges[1:])[:, None] * (2.0 * np.pi / self.width)  # solid angle of a cell, sr
        if compensated:
            mean = float(np.sum(luminance * angle) / (4.0 * np.pi))
            luminance = np.maximum(luminance - mean, MIN_PART * luminance)
        total = float(np.sum(luminance * angle))
        self.known = 0.0 < total < np.inf
        if not self.known:
            return
        rows = np.cumsum(np.sum(luminance * angle, axis=1) / total)
        columns = np.cumsum(luminance, axis=1)
        columns /= np.maximum(columns[:, -1:], 1e-300)
        self._density = self._stored(luminance / total)  # 1/sr
        self._rows, self._columns = Choice(mi, rows[None] / rows[-1]), Choice(mi, columns)
        box = scene.bbox()
        reach = 1.0 if not box.valid() else float(dr.norm(mi.ScalarVector3f(box.extents())))
        self._far = dr.opaque(mi.Float, max(4.0 * reach, 1e-3))

    def _stored(self, values: NDArray[np.float64]) -> Float:
        return own(self.mi.Float, np.ascontiguousarray(values.ravel(), np.float32))

    def _luminance(self, steps: int) -> NDArray[np.float64]:
        """The luminance of each cell, from (steps + 1)^2 points on its edges and inside.

        It is halfway between the mean and the maximum, so that a cell that contains a part of the sun is not
        underestimated.
        """
        mi, high, wide = self.mi, steps * self.height, steps * self.width
        index = dr.arange(mi.UInt32, (high + 1) * wide)
        row = index // wide
        across, down = dr.opaque(mi.Float, 1.0 / wide), dr.opaque(mi.Float, np.pi / high)
        si = dr.zeros(mi.SurfaceInteraction3f, len(index))
        si.wi = -self._toward(mi.Float(index - row * wide) * across, dr.cos(mi.Float(row) * down))
        if mi.is_spectral:
            si.wavelengths = type(si.wavelengths)(*np.linspace(450.0, 620.0, len(si.wavelengths)).tolist())
        values = self.emitter.eval(si)
        values = mi.luminance(values) if mi.is_rgb else dr.mean(mi.unpolarized_spectrum(values))
        points = np.array(values, np.float32).reshape(high + 1, wide)
        points = np.where(np.isfinite(points), np.maximum(points, 0.0), 0.0)
        points = np.concatenate([points, points[:, :1]], axis=1)
        largest = total = np.zeros((self.height, self.width), np.float32)
        for i in range(steps + 1):
            for j in range(steps + 1):
                part = points[i : i + high - steps + 1 : steps, j : j + wide - steps + 1 : steps]
                largest, total = np.maximum(largest, part), total + part
        return 0.5 * (largest + total / (steps + 1) ** 2).astype(np.float64)

    def _toward(self, longitude: Float, cosine: Float) -> Vector:
        """The direction with a given longitude, in turns, and a given cosine of the angle to the y axis of the grid."""
        sine = dr.sqrt(dr.maximum(0.0, dr.fma(-cosine, cosine, 1.0)))
        sin, cos = dr.sincos(longitude * (2.0 * dr.pi))
        return self.mi.Vector3f(sine * cos, cosine, sine * sin)

    def pdf(self, direction: Vector) -> Float:
        """The density with which `sample` generates a direction, 1/sr."""
        mi = self.mi
        turns = dr.atan2(direction.z, direction.x) * (0.5 * dr.inv_pi)
        turns -= dr.floor(turns)
        down = dr.acos(dr.clip(direction.y, -1.0, 1.0)) * dr.inv_pi
        column = dr.minimum(mi.UInt32(turns * self.width), self.width - 1)
        row = dr.minimum(mi.UInt32(down * self.height), self.height - 1)
        return dr.gather(mi.Float, self._density, row * self.width + column)

    def sample(self, it: Interaction, u: Point, active: Mask) -> tuple[Vector, Point, Float, Radiance]:
        """Sample a direction. Also returns a distant point in this direction, the density in 1/sr, and the radiance."""
        mi = self.mi
        row, down = self._rows.of(mi.UInt32(0), u.y)
        column, along = self._columns.of(row, u.x)
        y, step = mi.Float(row), dr.pi / self.height
        cosine = dr.lerp(dr.cos(y * step), dr.cos((y + 1.0) * step), down)
        direction = self._toward((mi.Float(column) + along) * (1.0 / self.width), cosine)
        density = dr.gather(mi.Float, self._density, row * self.width + column)
        si: SurfaceInteraction = dr.zeros(mi.SurfaceInteraction3f)
        si.wi, si.wavelengths, si.time = -direction, it.wavelengths, it.time
        return direction, dr.fma(direction, self._far, it.p), density, self.emitter.eval(si, active)


class Choice:
    """The inverse of cumulative sums, which increase from 0 to 1 along each row.

    For long rows, [0, 1] is divided into as many equal intervals as the row has entries. For each interval, a guide
    table contains the range of entries to search (Chen1974). For a sky with a sun, the search then takes one or two
    steps, whereas bisection of the row takes nine.
    """

    def __init__(self, mi: ModuleType, sums: NDArray[np.float64]) -> None:
        rows, self.count = sums.shape  # the count is a power of two
        self.mi, sums = mi, sums.astype(np.float32)
        self.sums = own(mi.Float, sums.ravel())
        self.below: UInt | None = None
        if self.count > SHORT:
            # the number of sums in a row that are at most k / count, for k up to count
            at = np.ceil(sums * self.count).astype(np.int64) + np.arange(rows)[:, None] * (self.count + 1)
            below = np.bincount(at.ravel(), minlength=rows * (self.count + 1)).reshape(rows, -1).cumsum(axis=1)
            self.below = own(mi.UInt32, np.minimum(below, self.count - 1).astype(np.uint32).ravel())

    def of(self, row: UInt, u: Float) -> tuple[UInt, Float]:
        """The entry of a row that contains u, in [0, 1], and the relative position of u within it."""
        mi, begin = self.mi, row * self.count
        at = self._bisect(begin, u) if self.below is None else self._search(self.below, row, begin, u)
        start = dr.select(at > 0, dr.gather(mi.Float, self.sums, begin + dr.maximum(at, 1) - 1), 0.0)
        end = dr.gather(mi.Float, self.sums, begin + at)
        return at, dr.clip((u - start) / dr.maximum(end - start, 1e-30), 0.0, 1.0)

    def _bisect(self, begin: UInt, u: Float) -> UInt:
        at, half = self.mi.UInt32(0), self.count // 2
        while half:
            at = dr.select(dr.gather(self.mi.Float, self.sums, begin + at + (half - 1)) <= u, at + half, at)
            half //= 2
        return at

    def _search(self, below: UInt, row: UInt, begin: UInt, u: Float) -> UInt:
        mi = self.mi
        part = row * (self.count + 1) + dr.minimum(mi.UInt32(u * self.count), self.count - 1)

        def halve(low: UInt, high: UInt) -> tuple[UInt, UInt]:
            middle = (low + high) >> 1
            beyond = dr.gather(mi.Float, self.sums, begin + middle) <= u
            return dr.select(beyond, middle + 1, low), dr.select(beyond, high, middle)

        state = dr.gather(mi.UInt32, below, part), dr.gather(mi.UInt32, below, part + 1)
        result = dr.while_loop(state, lambda low, high: low < high, halve, mode="symbolic", label="search")
        return result[0]
