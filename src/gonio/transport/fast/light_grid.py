"""Select one of many lamps depending on the position in the scene.

The bounding box of the scene is divided into cells, each of which has a table of the probabilities of the lamps. One
part of a probability is proportional to the unoccluded light that the lamp sends to the cell, which accounts for
distance and orientation; the other part is uniform.
"""

from __future__ import annotations

from collections.abc import Sequence
from types import ModuleType

import drjit as dr
import numpy as np

from ...bridge.faults.borrowed_memory import own
from ...bridge.types import Emitter, Float, Mask, Point, Scene, UInt
from ..lights.sky import Choice

CELLS = 8  # maximum number of cells per axis
MAX_ENTRIES = 1 << 21  # maximum number of entries of a table
POINTS = 4  # number of points per cell at which the light of the lamps is evaluated
# The uniform part of the probabilities, or 1 / count if this is more. A lamp and a sky get at least a quarter each.
EVEN = 0.25


class LightGrid:
    """The probabilities of the lights in each cell."""

    def __init__(self, mi: ModuleType, scene: Scene, emitters: Sequence[Emitter]) -> None:
        self.mi, count = mi, len(emitters)
        self.columns = 1 << (count - 1).bit_length()
        self.cells = CELLS
        while self.cells > 1 and self.cells**3 * self.columns > MAX_ENTRIES:
            self.cells //= 2
        box = scene.bbox()
        low, size = (
            (mi.Point3f(box.min), mi.Vector3f(box.extents())) if box.valid() else (mi.Point3f(0), mi.Vector3f(1))
        )
        self._low, self._scale = low, self.cells / dr.maximum(size, 1e-6)
        dr.make_opaque(self._low, self._scale)
        n = self.cells**3
        index = dr.arange(mi.UInt32, n * POINTS)
        cell = index // POINTS
        corner = mi.Point3f(cell % self.cells, (cell // self.cells) % self.cells, cell // self.cells**2)
        # multiples of 1/x, 1/x^2 and 1/x^3, modulo 1, where x^4 = x + 1, are evenly distributed and deterministic (R3
        # sequence, M. Roberts)
        inside = mi.Point3f(*(_fraction(mi.Float(index) * a) for a in (0.8191725, 0.6710436, 0.5497005)))
        it = dr.zeros(mi.SurfaceInteraction3f, n * POINTS)
        it.p = self._low + (corner + inside) / self._scale
        if mi.is_spectral:
            it.wavelengths = type(it.wavelengths)(550)
        u = mi.Point2f(_fraction(mi.Float(index) * 0.7548777), _fraction(mi.Float(index) * 0.5698403))
        table = np.zeros((n, self.columns))
        for place, emitter in enumerate(emitters):
            weight = dr.mean(emitter.sample_direction(it, u, True)[1], axis=0)
            light = np.broadcast_to(np.array(weight, np.float64), n * POINTS)
            table[:, place] = np.where(np.isfinite(light) & (light > 0), light, 0).reshape(n, POINTS).mean(1)
        total = table.sum(1, keepdims=True)
        table[:, :count] = np.where(total > 0, table[:, :count] / np.maximum(total, 1e-300), 1 / count)
        even = max(EVEN, 1.0 / count)
        table[:, :count] = (1.0 - even) * table[:, :count] + even / count
        sums = np.cumsum(table, axis=1)
        sums[:, count - 1 :] = 1.0
        self._chance = own(mi.Float, table.ravel().astype(np.float32))
        self._choice = Choice(mi, sums)

    def _row(self, p: Point) -> UInt:
        mi = self.mi
        at = [dr.clip((p[i] - self._low[i]) * self._scale[i], 0.0, self.cells - 1.0) for i in range(3)]
        # `clip` preserves NaN, which is converted to 2^32 - 1 on processors without AVX-512
        x, y, z = (dr.minimum(mi.UInt32(v), self.cells - 1) for v in at)
        return x + self.cells * (y + self.cells * z)

    def choose(self, p: Point, u: Float) -> tuple[UInt, Float, Float]:
        """Select a lamp. Returns its index, `u` rescaled to [0, 1] for reuse, and the probability of the lamp."""
        row = self._row(p)
        index, left = self._choice.of(row, u)
        return index, left, dr.gather(self.mi.Float, self._chance, row * self.columns + index)

    def probability(self, p: Point, index: UInt, active: Mask) -> Float:
        """The probability with which `choose` selects this lamp."""
        return dr.gather(self.mi.Float, self._chance, self._row(p) * self.columns + index, active)


def _fraction(x: Float) -> Float:
    return x - dr.floor(x)
