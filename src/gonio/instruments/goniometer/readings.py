"""Detector readings of a rough surface, from traced rays: one map of outgoing light per angle of incidence.

A map is a grid on the equal-area disk, (x, y) = sqrt(1 - cos theta) (cos phi, sin phi), with the light in the x-z
plane. The surface rotates under the light, so y and -y are equivalent, and only half of the disk is stored. The
aperture of the detector is a cone. In a map, the light in the cone about a square is the sum over all squares whose
centers lie in the cone; the reading is interpolated between the four squares around the axis of the detector. The
collected light is divided by the projected solid angle of these squares above the horizon, so f is an average over
them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ... import garbage
from ...bridge import engine
from ...catalog.notation import written
from ...errors import InputError
from ...material import BSDF
from ...optics.frame import angles_of_array
from ..surfaces.base import Surface
from . import rays
from .specimen import GROUPS, Floats, Specimen, half_angle

SQUARES = 2.5  # squares of the map per half angle of the detector
SMALLEST = 0.25  # degrees, the smallest half angle of a detector
MAX_LIGHTS = 64  # number of angles of incidence above which readings are interpolated linearly from a grid
STEEPEST = 89.0  # largest angle of incidence, degrees; at larger angles, the values at this angle are used
PARTS = 8  # subdivisions per side of a square, to integrate its part above the horizon
MAX_RAYS = 1 << 24  # rays per patch and angle of incidence that a float32 sum can count
MAX_BYTES = 4 << 30  # memory limit of the maps


@dataclass(frozen=True)
class Tracing:
    """Options of ray tracing.

    samples   rays per angle of incidence, over all patches
    patches   number of patches of a random surface; rounded up to a multiple of `GROUPS`
    seed      seed of the random numbers
    device    "cpu", "cuda" or "auto"
    progress  called with the number of rays traced and their total number
    """

    samples: int
    patches: int
    seed: int
    device: str = "cpu"
    progress: Callable[[int, int], None] | None = None


class Rough(Specimen):
    """A rough surface, given as a triangle mesh and measured by ray tracing. `prepare` sets the attributes.

    lights  angles of incidence [rad], (N,)
    first   fraction of the light that leaves after one reflection, (N, 3)
    later   fraction of the light that leaves after two or more reflections, (N, 3)
    lost    fraction of the rays lost to rounding, (N,)
    """

    def __init__(
        self, surface: Surface, facet: BSDF, solid_angle: float, tracing: Tracing, facet_name: str = ""
    ) -> None:
        """A rough surface.

        facet        material of the facets
        solid_angle  solid angle of the detector, sr
        facet_name   name of the material in the title; by default, its notation
        """
        check_facet(facet)
        self.surface, self.facet, self.seed, self.device = surface, facet, tracing.seed, tracing.device
        self.half_angle = half_angle(solid_angle)
        if not np.radians(SMALLEST) <= self.half_angle:
            what = f"{solid_angle:.3g} sr, a half angle of {np.degrees(self.half_angle):.2g} degrees"
            least = 2.0 * np.pi * (1.0 - np.cos(np.radians(SMALLEST)))
            raise InputError(f"the detector has {what}", "--solid-angle", f"give {least:.2g} sr or more")
        self.samples, self.patches = tracing.samples, -(-tracing.patches // GROUPS) * GROUPS
        self._progress = tracing.progress or (lambda done, total: None)
        self.side = int(np.ceil(SQUARES * np.sqrt(2.0) / self.half_angle))  # squares along the radius of the disk
        self.title = f"{surface} of {facet_name or written(facet)}"
        self.about = {
            "format": "gonio",
            "instrument": "virtual gonioreflectometer",
            "surface": str(surface),
            "facet": written(facet),
            "detector": f"{solid_angle:g} sr",
            "rays": f"{self.samples} for each angle of incidence",
            "patches": str(self.patches),
            "seed": str(self.seed),
        }
        self.sent = 0

    # ------------------------------------------------------------------ measuring

    def prepare(self, theta_i: Floats) -> None:
        wanted: Floats = np.unique(np.round(np.minimum(theta_i, np.radians(STEEPEST)), 9))
        if len(wanted) > MAX_LIGHTS:
            count = int(np.ceil(np.radians(STEEPEST) / self.half_angle)) + 1
            wanted = np.linspace(0.0, np.radians(STEEPEST), count)
        self.lights: Floats = wanted
        with garbage.paused():
            self._shoot()

    def _shoot(self) -> None:
        mi = engine.load(self.device)
        import drjit as dr

        facet = rays.bound(self.facet)
        each = max(self.samples // self.patches, 1)
        channels = 1 if is_gray(self.facet) else 3
        lights, squares = len(self.lights), 2 * self.side * self.side
        total, size = lights * each, 2 * lights * channels * squares
        if each > MAX_RAYS or total >= 1 << 32:
            what = f"{each} rays on each patch, at each of {lights} angles of incidence"
            raise InputError(what, "--samples", "give more patches, or fewer rays")
        if 4 * size * (GROUPS + 3) > MAX_BYTES:
            what = f"maps of {lights} angles of incidence would take {4e-9 * size * (GROUPS + 3):.0f} GB"
            raise InputError(what, "--solid-angle", "give a larger one, or fewer angles")
        cosines = mi.Float(np.cos(self.lights).astype(np.float32))
        side = dr.opaque(mi.Float, float(self.side))
        sums = np.zeros((GROUPS, size), np.float32)
        lost: Floats = np.zeros(lights)
        ground = None
        for patch in range(self.patches):
            if ground is None or self.surface.random:
                ground = rays.ground(self.surface.patch(np.random.default_rng([self.seed, patch, 90])))
            maps, gone = dr.zeros(mi.Float, size), dr.zeros(mi.Float, lights)
            for start in range(0, total, rays.LANES):
                count = min(rays.LANES, total - start)
                left = rays.shoot(ground, facet, cosines, each, start, count, self.seed * 1_000_003 + patch)
                w = left.direction
                shrink = side * dr.rsqrt(1.0 + dr.maximum(w.z, 0.0))
                column = dr.minimum(mi.UInt32(dr.maximum(w.x * shrink + side, 0.0)), 2 * self.side - 1)
                row = dr.minimum(mi.UInt32(dr.abs(w.y) * shrink), self.side - 1)
                place = row * (2 * self.side) + column
                order = dr.select(left.bounces == 1, mi.UInt32(0), mi.UInt32(1))
                for channel in range(channels):
                    index = ((order * lights + left.angle) * channels + channel) * squares + place
                    dr.scatter_reduce(dr.ReduceOp.Add, maps, left.weight[channel], index, left.escaped)
                dr.scatter_reduce(dr.ReduceOp.Add, gone, mi.Float(1.0), left.angle, left.lost)
                dr.eval(maps, gone)
                self.sent += count
                self._progress(self.sent, total * self.patches)
            sums[patch % GROUPS] += maps.numpy()
            lost += gone.numpy()
        self._look(sums.reshape(GROUPS, 2, lights, channels, self.side, 2 * self.side), each * self.patches // GROUPS)
        self.lost = lost / (each * self.patches)

    def _look(self, sums: NDArray[np.float32], sent: int) -> None:
        """Integrate the maps over the aperture about each square: (group, bounces, light, square, channel)."""
        of_light = sums.sum(axis=(4, 5), dtype=np.float64).mean(axis=0) / sent
        self.first, self.later = (np.repeat(one, 3, 1)[:, :3] if one.shape[1] == 1 else one for one in of_light)
        groups, orders, lights, channels = sums.shape[:4]
        solid = projected(self.side)
        self._collected = np.empty((groups + 1, orders, lights, solid.size, channels), np.float32)
        for group, one in enumerate(sums):
            collected, self._solid = gathered(one, solid, self.half_angle)
            flat = collected.reshape(orders, lights, channels, -1)
            # y and -y share one square, hence the factor 0.5; channels are last because lookups read them together
            self._collected[group] = np.moveaxis(flat, 2, 3) * np.float32(0.5 / sent)
        self._collected[groups] = self._collected[:groups].mean(axis=0)

    # ------------------------------------------------------------------ reading

    def f(self, wo: Floats, wi: Floats, part: int | None = None, bounces: str = "all") -> Floats:
        group = self._collected[GROUPS if part is None else part]
        maps = {"first": group[0], "later": group[1]}.get(bounces)
        maps = group[0] + group[1] if maps is None else maps
        places, weights = self._places(wo, wi)
        solid = np.sum([weight * self._solid[place] for place, weight in zip(places, weights, strict=True)], axis=0)
        at = np.interp(angles_of_array(wi)[0], self.lights, np.arange(len(self.lights)))
        low = np.minimum(at.astype(np.int64), max(len(self.lights) - 2, 0))
        rest = (at - low)[:, None]
        total = np.zeros((len(wo), 3))
        for light, share in ((low, 1.0 - rest), (np.minimum(low + 1, len(self.lights) - 1), rest)):
            for place, weight in zip(places, weights, strict=True):
                total += share * weight[:, None] * maps[light, place]
        return total / solid[:, None]

    def _places(self, wo: Floats, wi: Floats) -> tuple[list[NDArray[np.int64]], list[Floats]]:
        """The indices of the four squares around wo, and their interpolation weights."""
        flat = np.hypot(wi[:, 0], wi[:, 1])
        pole = flat < 1e-9  # at normal incidence every azimuth is equivalent
        some = np.where(pole, 1.0, flat)
        c, s = np.where(pole, 1.0, wi[:, 0] / some), np.where(pole, 0.0, wi[:, 1] / some)
        shrink = self.side / np.sqrt(1.0 + np.maximum(wo[:, 2], 0.0))
        x = (c * wo[:, 0] + s * wo[:, 1]) * shrink + self.side - 0.5
        y = np.abs(c * wo[:, 1] - s * wo[:, 0]) * shrink - 0.5
        column = np.clip(np.floor(x), 0, 2 * self.side - 2)
        row = np.clip(np.floor(y), -1, self.side - 2)
        tx, ty = np.clip(x - column, 0.0, 1.0), np.clip(y - row, 0.0, 1.0)
        places, weights = [], []
        for dy, wy in ((0, 1.0 - ty), (1, ty)):
            rows = row + dy
            rows = np.where(rows < 0, 0, rows)  # the mirror image of the first row
            for dx, wx in ((0, 1.0 - tx), (1, tx)):
                places.append((rows * (2 * self.side) + column + dx).astype(np.int64))
                weights.append(wx * wy)
        return places, weights


def check_facet(facet: BSDF) -> None:
    """Raise InputError if a material cannot be used for the facets of a surface."""
    if facet.transmits:
        raise InputError(f"{facet.name} transmits light", "--facet", "facets reflect only: conductor, mirror, ...")
    if not facet.isotropic:
        raise InputError(f"this {facet.name} is anisotropic", "--facet", "facets need an isotropic material")


def is_gray(facet: BSDF) -> bool:
    """Whether sample weights of the material are equal in all channels."""
    rng = np.random.default_rng(7)
    wo = rng.standard_normal((256, 3))
    wo[:, 2] = np.abs(wo[:, 2]) + 0.01
    weight = facet.sample(wo / np.linalg.norm(wo, axis=1, keepdims=True), rng.random((256, 3))).weight
    return bool(np.all(weight == weight[:, :1]))


def centers(side: int) -> Floats:
    """The direction of the center of each square, (side, 2 side, 3). Centers outside the disk are below the horizon."""
    y, x = np.meshgrid((np.arange(side) + 0.5) / side, (np.arange(2 * side) + 0.5) / side - 1.0, indexing="ij")
    square = np.minimum(x * x + y * y, 2.0)
    scale = np.sqrt(2.0 - square)
    return np.stack([x * scale, y * scale, 1.0 - square], -1)


def projected(side: int) -> Floats:
    """The projected solid angle of each square above the horizon, (side, 2 side): its area times 2 cos theta."""
    fine = side * PARTS
    y, x = np.meshgrid((np.arange(fine) + 0.5) / fine, (np.arange(2 * fine) + 0.5) / fine - 1.0, indexing="ij")
    cos = np.maximum(1.0 - x * x - y * y, 0.0)
    return 2.0 * cos.reshape(side, PARTS, 2 * side, PARTS).sum(axis=(1, 3)) / fine**2


def gathered(maps: NDArray[np.float32], solid: Floats, half_angle: float) -> tuple[NDArray[np.float32], Floats]:
    """The sums of maps, (..., side, 2 side), and of `solid`, flattened, over the cone about each square."""
    side = solid.shape[0]
    reach = int(np.ceil(half_angle * side)) + 1
    lowest = np.cos(half_angle)
    directions = centers(side)

    def padded(values: NDArray) -> NDArray:
        wide = np.concatenate([np.flip(values[..., :reach, :], -2), values], -2)  # y and -y are equivalent
        return np.pad(wide, [(0, 0)] * (values.ndim - 2) + [(0, reach), (reach, reach)])

    full, area = padded(maps), padded(solid)
    neighbors = np.stack([padded(directions[..., axis]) for axis in range(3)], -1)
    neighbors[:reach, :, 1] *= -1.0
    total, total_solid = np.zeros_like(maps), np.zeros_like(solid)
    for dy in range(-reach, reach + 1):
        for dx in range(-reach, reach + 1):
            part = (..., slice(reach + dy, reach + dy + side), slice(reach + dx, reach + dx + 2 * side))
            near = np.einsum("yxc,yxc->yx", directions, neighbors[part[1:]]) >= lowest
            if dy == dx == 0:
                near[:] = True
            if near.any():
                total += np.where(near, full[part], np.float32(0.0))
                total_solid += np.where(near, area[part], 0.0)
    return total, total_solid.ravel()
