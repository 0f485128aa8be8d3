"""The photon maps for caustics: particles that mirrors and smooth glass cast on other surfaces.

A particle leaves a lamp toward mirrors and glass, and is stored at the first surface that is neither. From there it is
scattered once; if it hits mirrors or glass again, it is stored a second time at the next surface that is neither.
SAMPLES_PER_MAP samples of every pixel share a map. The radius within which a particle contributes decreases from map to
map.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import numpy as np

from ..bridge.types import Float, Mask, Point, Radiance, UInt
from . import sampler
from .lights.sources import Targets
from .particles import Flight, Particles
from .photons import Photon, PhotonDensity, PhotonMap
from .scene_data import SceneData

SAMPLES_PER_MAP = 4
PER_PIXEL = 2.0  # particles of a map per pixel, subject to the following limits
MIN_PARTICLES, MAX_PARTICLES = 1 << 14, 1 << 19
FOOTPRINT = 1.0  # radius of a search in the first map, relative to the median width of a pixel on the visible surfaces
SHRINKING = -1 / 6  # exponent of the number of maps in the radius (Knaus2011, with alpha = 2/3)
DENSITY_CELL = 4.0  # width of the cubes in which particles are counted, relative to the radius
WAVELENGTHS = 4  # number of wavelengths per sample in spectral variants
WAVELENGTH_KEY = 0x48554553  # key of the sequence of the maps' wavelengths
PROBED = 48  # rays per axis for measuring the width of a pixel


@dataclass
class _Trail:
    """The path of a particle: from a lamp through mirrors to a first surface, then through mirrors to a second one."""

    flight: Flight
    density: Float  # density with respect to étendue, at the start of the current chain of mirrors
    mirrored: Mask  # whether a chain of mirrors has begun
    landed: Mask
    first: Photon
    landed_again: Mask
    second: Photon


class PhotonMaps:
    """The photon maps of a render, of which only one is in memory at a time.

    current  map of the current samples
    density  approximate number of arriving particles per unit area, computed from the first map and used for all maps

    radius_factor  factor applied to the default radius of the first map
    """

    def __init__(self, data: SceneData, seed: int, max_depth: UInt, radius_factor: float) -> None:
        mi = data.mi
        self.mi, self.data = mi, data
        self.particles = Particles(data, seed, max_depth, Targets(mi, data.smooth))
        size = data.sensor.film().crop_size()
        self.count = int(np.clip(PER_PIXEL * int(size[0]) * int(size[1]), MIN_PARTICLES, MAX_PARTICLES))
        self.radius = FOOTPRINT * radius_factor * self._pixel_width()
        self.total = dr.opaque(mi.Float, self.count)
        self.density, self._is_dense = PhotonDensity.nowhere(mi), False
        self._current: tuple[int, PhotonMap] | None = None

    def prepare(self, number: int) -> None:
        """Compute map `number`, which becomes the current map."""
        if not self._is_dense:
            trail, width = self._trace(0), DENSITY_CELL * self.radius
            self.density, self._is_dense = PhotonDensity(self.mi, trail.first, trail.landed, width, self.count), True
        if self._current is None or self._current[0] != number:
            self._current = None  # free the memory before the next map is computed
            trail, radius = self._trace(number), self.radius * (number + 1) ** SHRINKING
            photons, landed = [trail.first, trail.second], [trail.landed, trail.landed_again]
            self._current = number, PhotonMap(self.mi, photons, landed, radius)

    @property
    def current(self) -> PhotonMap:
        assert self._current is not None, "`prepare` comes first"
        return self._current[1]

    def path_weight(self, lobe: Float, density: Float) -> Float:
        """The MIS weight (power heuristic) of a path that hits a lamp through mirrors, relative to the particles.

        lobe     density of the last direction that the path sampled before the mirrors, divided by the cosine
        density  density of the particles at the lamp with respect to étendue, in the medium where the path began
        """
        particles = density * (self.total * dr.pi * dr.square(self.current.radius))
        ratio = particles / lobe
        return dr.select(lobe > 0, dr.rcp(dr.fma(ratio, ratio, 1)), 0)

    def etendue_density(self, place: Point) -> Float:
        """The approximate density, with respect to étendue, of the particles that arrive at a rough surface."""
        return self.density.at(place) * dr.inv_pi

    # ------------------------------------------------------------------ wavelengths

    def wavelength(self, number: UInt, turn: UInt) -> Float:
        """The number in [0, 1) that selects the wavelengths of the particles of a map and of the paths that use the
        map.

        The wavelengths correspond to this number and to its shifts by 1/4, 2/4 and 3/4; `turn` determines which of them
        is the first. Multiples of the golden ratio distribute the numbers evenly over a quarter of the range, and
        multiples of the square root of 2 select the first wavelength.
        """
        key = sampler.pixel_key(self.mi.UInt32(WAVELENGTH_KEY), self.particles.seed)
        place, first = (
            sampler.unit(key + number * 0x9E3779B9),
            sampler.unit(sampler.mix(key, key) + number * 0x6A09E667),
        )
        return (place + self.mi.Float((self.mi.UInt32(WAVELENGTHS * first) + turn) % WAVELENGTHS)) / WAVELENGTHS

    def rotated(self, flux: Radiance, by: UInt) -> Radiance:
        """The flux per wavelength, rotated so that wavelength number `by` is first."""
        values = list(flux)
        for step in range(1, WAVELENGTHS if self.mi.is_spectral else 1):
            values = [
                dr.select(by % WAVELENGTHS == step, flux[(i + step) % WAVELENGTHS], v) for i, v in enumerate(values)
            ]
        return type(flux)(*values)

    # ------------------------------------------------------------------ particles

    def _pixel_width(self) -> float:
        """The median width of a pixel on the visible surfaces."""
        mi, sensor = self.mi, self.data.sensor
        across = int(sensor.film().crop_size()[0])
        x, y = dr.meshgrid(*[dr.linspace(mi.Float, 0.01, 0.99, PROBED)] * 2)
        rays = []
        for step in (0.0, 1.0 / across):
            place = mi.Point2f(x + dr.opaque(mi.Float, step), y)
            rays.append(sensor.sample_ray(0.0, 0.5, place, mi.Point2f(0.5))[0])
        hit = self.data.surfaces.nearest(mi.Ray3f(rays[0]))
        angle = dr.norm(rays[1].d - rays[0].d)
        widths = np.array(dr.select(hit.is_valid(), hit.t * angle, 0))
        widths = widths[widths > 0]
        return float(np.median(widths)) if len(widths) else 1e-3

    def _trace(self, number: int) -> _Trail:
        """Trace the particles of map `number` to their ends."""
        mi, particles = self.mi, self.particles
        lane = dr.arange(mi.UInt32, self.count)
        begin = mi.UInt64(dr.opaque(mi.UInt64, number * self.count)) + mi.UInt64(lane)
        low, key = mi.UInt32(begin), particles.key(mi.UInt32(begin >> 32))
        # Where wavelengths separate, a particle continues with one of the map's wavelengths, a different one for each
        # part of the particles. A part is contiguous in the sequence of particles, so it is evenly distributed.
        turn = lane * WAVELENGTHS // dr.opaque(mi.UInt32, self.count)
        wavelength = self.wavelength(dr.opaque(mi.UInt32, number), turn) if mi.is_spectral else None
        particle, flight = particles.leave(key, low, wavelength)
        none = Photon.none(mi)
        trail = _Trail(flight, particle.density, mi.Bool(False), mi.Bool(False), none, mi.Bool(False), none)
        trail = dr.while_loop(
            (trail,),
            lambda t: t.flight.active,
            lambda t: (self._vertex(t, key, low, turn),),
            mode="symbolic",
            label="particles",
        )[0]
        dr.eval(trail.landed, trail.landed_again, trail.first, trail.second)  # all results are computed by one kernel
        return trail

    def _vertex(self, trail: _Trail, key: UInt, low: UInt, turn: UInt) -> _Trail:
        """Process one vertex of a particle, at which it is stored, continues, or ends."""
        mi, particles, flight = self.mi, self.particles, trail.flight
        vertex = particles.intersect(flight)
        flags = vertex.bsdf.flags()
        smooth, rough = mi.has_flag(flags, mi.BSDFFlags.Delta), mi.has_flag(flags, mi.BSDFFlags.Smooth)
        # At a surface with both a delta and a rough lobe, every second particle is stored, with twice its flux.
        both = smooth & rough & trail.mirrored
        flight.throughput *= dr.select(both, 2, 1)
        coin = self.data.pair(key, low, flight.dimension + 2)[0]
        stays = flight.active & rough & trail.mirrored & (~both | (coin < 0.5))
        if vertex.crossing is not None:
            stays &= vertex.crossing.surface
        photon = Photon(
            vertex.si.p,
            mi.Vector3f(vertex.si.n),
            mi.Vector3f(-flight.ray.d),
            self.rotated(flight.flux * flight.throughput, WAVELENGTHS - turn) / self.total,
            trail.density * dr.square(flight.eta),
            flight.depth,
            trail.landed,
        )
        first, second = stays & ~trail.landed, stays & trail.landed
        bs, weight = particles.sample_bsdf(key, low, flight, vertex)
        delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
        # After the first surface, a particle is scattered once and continues through mirrors to a second surface.
        active = flight.active & ~second & (first ^ delta)
        flight.eta = dr.select(first, 1, flight.eta)
        following = particles.follow(key, low, flight, vertex, bs, weight, active)
        following.eta = dr.select(first, 1, following.eta)
        return _Trail(
            following,
            dr.select(first, self.etendue_density(vertex.si.p), trail.density),
            (trail.mirrored & ~first) | (active & delta),
            trail.landed | first,
            dr.select(first, photon, trail.first),
            trail.landed_again | second,
            dr.select(second, photon, trail.second),
        )
