"""Path tracing with a progressive map of the light behind mirrors and smooth glass."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from types import ModuleType
from typing import ClassVar

import drjit as dr
import numpy as np

from ...bridge import engine
from ...bridge.types import BSDFSample, Float, Mask, MitsubaBSDF, Radiance, Scene, Sensor, SurfaceInteraction, UInt
from .. import sampler
from ..lights.sources import Targets
from ..photons import Crowding, Photon, PhotonMap
from . import transport
from .base import Picture, Settings
from .particles import FIRST_VERTEX, VERTEX_DIMENSIONS, Flight, Particles
from .path import Path
from .transport import ROULETTE, PathState

SHARED = 4  # samples of a pixel that look at the same map
PER_PIXEL = 2.0  # particles of a map for each pixel,
FEWEST, MOST = 1 << 14, 1 << 19  # but so many at least, and at most
FOOTPRINT = 1.0  # first radius of a search, in pixels as they are seen on the scene on the median
SHARPER = 0.25  # part of the radius, against which blur is measured
SHRINKING = -1 / 6  # power of the number of maps by which the radius goes to 0 (Knaus2011, with alpha = 2/3)
CROWD = 4.0  # radii wide: the cubes in which particles are counted
COLOURS = 4  # wavelengths of a sample in spectral variants
HUES = 0x48554553  # key of the sequence that maps take them from
PROBED = 48  # rays each way, to measure a pixel
ASKED_COSINES = (-1.0, -0.9, -0.5, -0.1, 0.1, 0.5, 0.9, 1.0)  # where materials are asked how they choose lobes,
ASKED_STEPS = 65  # by so many numbers each
MOST_ODDS = 1e12  # of a second trip, so that their square is finite
END = 2.0**-20  # of the numbers that choose a lobe: what chooses the one at each end; no lobe is rarer


@dataclass
class _Way:
    """Particles on their way from a lamp by mirrors to a place, and from there by mirrors to a second one."""

    flight: Flight
    density: Float  # of étendue, where the present chain of mirrors began
    mirrored: Mask  # whether such a chain has begun
    kept: Mask
    first: Photon
    kept_again: Mask
    second: Photon


@dataclass
class _Chains:
    """What a path carries along of the mirrors and smooth glass on its way.

    lobe    pdf over cosine with which the last lobe before them chose its direction; 0 where there was none
    counts  of the light behind them that it finds from that surface on
    trip    0 of a sample's first trip; 1 where a second is to follow, 2 on that
    odds    how likely a second trip takes the chain from the camera on, over how likely a first one does
    number  [0, 1), by which a second trip chooses
    blur    how much more light particles have brought so far than those close by have; None where nobody asks
    """

    lobe: Float
    counts: Float
    trip: UInt
    odds: Float
    number: Float
    blur: Radiance | None


class Caustics(Path):
    """Path tracing, where light by way of mirrors and smooth glass comes from a map of particles, too.

    Of the light that mirrors or glass throw upon a surface, paths from the camera find what comes from wide lamps,
    particles from the lamps what comes from small ones: each is weighed by how likely it was to find it. A particle
    counts for places around it, within a radius that shrinks, so that the picture is blurred by about a pixel at first
    and sharp in the end (consistent, not unbiased); all other light is that of `path`.

    How likely: a path that leaves a surface with density p toward mirrors and meets the lamp behind them, and N
    particles that come from there the other way, are as dense as p / cos and g N pi r^2 over the same étendue, with
    the particles' density g at the lamp; what mirrors and lenses do to the width of the beam is the same for both.
    Merging as one more way to sample a path is of Georgiev2012.

    Lamps that the camera itself sees by mirrors and glass no particle shows, and a lamp behind two reflections within a
    glass ball is met by one path in a thousand. So where a path has come to glass first, its sample goes on a second
    trip: by mirrors and glass alone, with reflection and refraction as likely as each other, to the lamp or to nothing.
    Both trips are weighed by how likely they go that way (power heuristic).
    """

    name = "caustics"
    merges: ClassVar[bool] = True
    blurs: ClassVar[bool] = True
    shrinking: ClassVar[float] = SHRINKING

    def __init__(self, mi: ModuleType, scene: Scene, sensor: Sensor, settings: Settings, aovs: bool):
        super().__init__(mi, scene, sensor, settings, aovs)
        self.particles: Particles | None = None
        self._map: tuple[int, PhotonMap] | None = None
        self._forks = False  # whether there are second trips
        self.merging = bool(self.smooth) and self.lights.count > 0 and settings.max_depth > 2
        if not self.merging:
            return
        self.particles = Particles(self, Targets(mi, self.smooth))
        size = sensor.film().crop_size()
        self.count = int(np.clip(PER_PIXEL * int(size[0]) * int(size[1]), FEWEST, MOST))
        self.radius = FOOTPRINT * settings.radius * self._pixel()
        self.measured = 6 if settings.measures else 0
        self._total = dr.opaque(mi.Float, self.count)
        self._forks = self._both_ends()
        self._crowding = Crowding.nowhere(mi)
        self._seen = False  # a map, from which to tell where particles crowd

    def stages(self, first: int, last: int) -> Iterator[tuple[int, int]]:
        """The samples that share a map; the map is made before them."""
        while self.merging and first < last:
            number = first // SHARED
            if not self._seen:
                way, width = self._traced(0), CROWD * self.radius
                self._crowding, self._seen = Crowding(self.mi, way.first, way.kept, width, self.count), True
            if self._map is None or self._map[0] != number:
                self._map = None  # before the next one: there is one at a time
                self._map = number, self._mapped(number)
            for read in (self._crowding, self._map[1]):
                engine.renew(read)  # after the sums, in every stage
            end = min(last, (number + 1) * SHARED)
            yield first, end
            first = end
        if not self.merging:
            yield from super().stages(first, last)

    def _pixel(self) -> float:
        """The width of a pixel on what is seen, on the median."""
        mi = self.mi
        across = int(self.sensor.film().crop_size()[0])
        x, y = dr.meshgrid(*[dr.linspace(mi.Float, 0.01, 0.99, PROBED)] * 2)
        rays = []
        for step in (0.0, 1.0 / across):
            place = mi.Point2f(x + dr.opaque(mi.Float, step), y)
            rays.append(self.sensor.sample_ray(0.0, 0.5, place, mi.Point2f(0.5))[0])
        hit = self.surfaces.nearest(mi.Ray3f(rays[0]))
        angle = dr.norm(rays[1].d - rays[0].d)
        widths = np.array(dr.select(hit.is_valid(), hit.t * angle, 0))
        widths = widths[widths > 0]
        return float(np.median(widths)) if len(widths) else 1e-3

    # ------------------------------------------------------------------ particles

    def _traced(self, number: int) -> _Way:
        """The particles of map `number`, at the end of their ways."""
        mi, particles = self.mi, self.particles
        assert particles is not None
        lane = dr.arange(mi.UInt32, self.count)
        begin = mi.UInt64(dr.opaque(mi.UInt64, number * self.count)) + mi.UInt64(lane)
        low, key = mi.UInt32(begin), particles.key(mi.UInt32(begin >> 32))
        # Each of a map's wavelengths goes on alone, where they part, with a share of the particles: of neighbours in
        # the sequence, which are even by themselves.
        turn = lane * COLOURS // dr.opaque(mi.UInt32, self.count)
        hue = self._hue(dr.opaque(mi.UInt32, number), turn) if mi.is_spectral else None
        particle, flight = particles.leave(key, low, mi.Bool(True), hue)
        none = Photon.none(mi)

        def vertex(way: _Way) -> _Way:
            flight = way.flight
            si, bsdf, crossing = particles.arrive(flight)
            flags = bsdf.flags()
            smooth, rough = mi.has_flag(flags, mi.BSDFFlags.Delta), mi.has_flag(flags, mi.BSDFFlags.Smooth)
            at = flight.depth * VERTEX_DIMENSIONS + (FIRST_VERTEX - VERTEX_DIMENSIONS)
            # A surface that is both a mirror and rough keeps every second particle, at twice its share.
            both = smooth & rough & way.mirrored
            flight.share *= dr.select(both, 2, 1)
            stays = flight.active & rough & way.mirrored & (~both | (self._coin(key, low, at) < 0.5))
            if crossing is not None:
                stays &= crossing.surface
            photon = Photon(
                si.p,
                mi.Vector3f(si.n),
                mi.Vector3f(-flight.ray.d),
                self._turned(flight.flux * flight.share, COLOURS - turn) / self._total,
                way.density * dr.square(flight.eta),
                flight.depth,
                way.kept,
            )
            first, second = stays & ~way.kept, stays & way.kept
            bs, weight = particles.scatter(key, low, flight, si, bsdf, crossing)
            delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
            # From where it has arrived it goes on once more, to a second place behind mirrors.
            active = flight.active & ~second & (first ^ delta)
            flight.eta = dr.select(first, 1, flight.eta)
            following = particles.go_on(key, low, flight, si, crossing, bs, weight, active)
            following.eta = dr.select(first, 1, following.eta)
            return _Way(
                following,
                dr.select(first, self._crowding.at(si.p) * dr.inv_pi, way.density),
                (way.mirrored & ~first) | (active & delta),
                way.kept | first,
                dr.select(first, photon, way.first),
                way.kept_again | second,
                dr.select(second, photon, way.second),
            )

        way = _Way(flight, particle.density, mi.Bool(False), mi.Bool(False), none, mi.Bool(False), none)
        state = dr.while_loop(
            (way,), lambda w: w.flight.active, lambda w: (vertex(w),), mode="symbolic", label="particles"
        )
        found: _Way = state[0]
        dr.eval(found.kept, found.kept_again, found.first, found.second)  # all, that it be one kernel for all who ask
        return found

    def _mapped(self, number: int) -> PhotonMap:
        """Map `number` of the picture, from its particles."""
        way = self._traced(number)
        radius = self.radius * (number + 1) ** SHRINKING
        return PhotonMap(self.mi, [way.first, way.second], [way.kept, way.kept_again], radius)

    def _hue(self, number: UInt, turn: UInt) -> Float:
        """The number that chooses the wavelengths of a map, whose particles have no others than the paths that look
        at it, with another one of them as the first.

        Wavelengths are one number and it shifted by 1/4, 2/4, 3/4 of the range: multiples of the golden ratio spread
        all of them evenly over a quarter, and those of the root of 2 say which of them comes first.
        """
        assert self.particles is not None
        key = sampler.pixel_key(self.mi.UInt32(HUES), self.particles.seed)
        place, first = (
            sampler.unit(key + number * 0x9E3779B9),
            sampler.unit(sampler.mix(key, key) + number * 0x6A09E667),
        )
        return (place + self.mi.Float((self.mi.UInt32(COLOURS * first) + turn) % COLOURS)) / COLOURS

    def _turned(self, flux: Radiance, by: UInt) -> Radiance:
        """The flux by wavelengths in the order of those that many turns on."""
        found = list(flux)
        for step in range(1, COLOURS if self.mi.is_spectral else 1):
            found = [dr.select(by % COLOURS == step, flux[(i + step) % COLOURS], v) for i, v in enumerate(found)]
        return type(flux)(*found)

    def _coin(self, key: UInt, low: UInt, at: UInt) -> Float:
        return self.pair(key, low, at + 2)[0]

    # ------------------------------------------------------------------ paths

    def differences(self, measured: Picture, samples: int) -> list[Picture]:
        """From a picture with SHARPER of the radius, by the even maps and by the odd ones."""
        if not self.measured:
            return []
        rounds, rest = divmod(samples, 2 * SHARED)
        even = rounds * SHARED + min(rest, SHARED)
        weights = samples / max(even, 1), samples / max(samples - even, 1)
        return [measured[..., :3] * np.float32(weights[0]), measured[..., 3:] * np.float32(weights[1])]

    def hue(self, index: UInt, own: Float) -> Float:
        return self._hue(index // SHARED, index) if self.merging and self.mi.is_spectral else own

    def carried(self) -> _Chains | None:
        mi = self.mi
        if not self.merging:
            return None
        blur = mi.Spectrum(0) if self.measured else None
        return _Chains(mi.Float(0), mi.Float(1), mi.UInt32(0), mi.Float(1), mi.Float(0), blur)

    def found(self, path: PathState) -> list[Float]:
        if not self.measured:
            return super().found(path)
        odd = (path.index // SHARED & 1) != 0
        blur = [*self.rgb(path.more.blur, path.ray.wavelengths)]
        return [*super().found(path), *(dr.select(odd, 0, v) for v in blur), *(dr.select(odd, v, 0) for v in blur)]

    def brought(
        self, si: SurfaceInteraction, bsdf: MitsubaBSDF, path: PathState, u: Float, active: Mask
    ) -> tuple[Radiance, _Chains]:
        """The light that particles have brought to a place, toward the path that has come there; and what the path
        carries along, with what counts of the light behind mirrors that it finds from there on."""
        mi = self.mi
        if self._map is None:
            return mi.Spectrum(0), path.more
        photons, depth, chains = self._map[1], path.depth, path.more
        active = active & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        # Who has come here by mirrors shares what first particles have brought with second particles.
        by_mirrors = (chains.lobe > 0) & (path.pdf == 0)
        crowd = self._crowding.at(si.p) * dr.inv_pi
        counts = dr.select(by_mirrors, self._by_path(chains.lobe, crowd, photons), 1)

        def visit(photon: Photon, weight: Float, here: Mask) -> Radiance:
            here &= photon.depth + depth + 1 <= self.max_depth
            value, pdf = bsdf.eval_pdf(self.context, si, si.to_local(photon.direction), here)
            cosine = dr.maximum(abs(dr.dot(photon.direction, si.n)), 1e-6)
            share = 1 - self._by_path(pdf / cosine, photon.density, photons)
            share *= dr.select(photon.again, 1, counts)
            flux = self._turned(photon.flux, path.index)
            return dr.select(here, value * flux * (weight * share / cosine), 0)

        within = SHARPER if self.measured else 0.0
        back = si.to_world(si.wi)
        light, above = photons.gather(si.p, mi.Vector3f(si.n), back, u, mi.Spectrum(0), visit, active, within)
        blur = chains.blur + path.throughput * above if self.measured else None
        return light, replace(chains, counts=counts, blur=blur)

    def _by_path(self, lobe: Float, density: Float, photons: PhotonMap) -> Float:
        """Weight of a path that finds the lamp behind mirrors by itself, beside the particles (power heuristic).

        lobe     density of its last direction before the mirrors, over the cosine
        density  of the particles' étendue at the lamp, in the medium where the path set out
        """
        particles = density * (self._total * dr.pi * dr.square(photons.radius))
        ratio = particles / lobe
        return dr.select(lobe > 0, dr.rcp(dr.fma(ratio, ratio, 1)), 0)

    def met(
        self, path: PathState, si: SurfaceInteraction, bsdf: MitsubaBSDF, emitted: Radiance, active: Mask
    ) -> tuple[Radiance, Mask]:
        """What a path finds at a lamp that it meets by way of mirrors, beside the particles or another trip."""
        if self._map is None:
            return emitted, active
        assert self.particles is not None
        mi, chains = self.mi, path.more
        lit = active & (path.pdf == 0) & dr.any(emitted != 0)
        behind = lit & (chains.lobe > 0)
        density = self.particles.sources.density(path.ray.o, si, path.ray.d, behind)
        share = dr.select(behind, chains.counts * self._by_path(chains.lobe, density, self._map[1]), 1)
        if not self._forks:
            return emitted * share, active
        second = chains.trip == 2
        by_second = dr.select(chains.odds == 1, 0, dr.rcp(1 + dr.rcp(dr.square(chains.odds))))  # 1: there was no choice
        share = dr.select(lit & (chains.lobe == 0), dr.select(second, by_second, 1 - by_second), share)
        return emitted * share, active & ~(second & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth))

    def followed(
        self,
        path: PathState,
        following: PathState,
        si: SurfaceInteraction,
        bsdf: MitsubaBSDF,
        bs: BSDFSample,
        kept: _Chains,
    ) -> PathState:
        if self._map is None:
            return following
        mi, chains = self.mi, path.more
        delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
        begun = bs.pdf / dr.maximum(abs(dr.dot(following.ray.d, si.n)), 1e-6)
        after = replace(
            chains,
            lobe=dr.select(delta, chains.lobe * dr.square(bs.eta), begun),
            counts=dr.select(delta, chains.counts, kept.counts),
            blur=kept.blur,
        )
        if not self._forks:
            return replace(following, more=after)
        # On the chain from the camera on: two ways, of which a second trip takes each as often, or a sole one, or
        # what a second trip does not follow.
        here, two = path.active & (chains.lobe == 0), delta & self._two(bsdf.flags())
        sole = delta & (bs.pdf > 1 - END)
        fork = here & two & ~sole
        odds = chains.odds * dr.select(here & ~sole, dr.select(fork & (bs.pdf > END), 0.5 / bs.pdf, 0), 1)
        odds = dr.minimum(odds, MOST_ODDS)
        after.odds = odds
        second = chains.trip == 2
        after.trip = dr.select(fork & (chains.trip == 0) & (chains.odds > 0), mi.UInt32(1), chains.trip)
        after.number = dr.select(fork, 2 * chains.number - dr.floor(2 * chains.number), chains.number)
        weight = dr.select(fork & second, 2 * bs.pdf, 1)
        active = following.active & (~second | (odds > 0))
        return replace(following, throughput=following.throughput * weight, active=active, more=after)

    # ------------------------------------------------------------------ second trips

    def renewed(self, fresh: PathState, path: PathState, key: UInt, begins: Mask) -> tuple[PathState, Mask]:
        if not self._forks:
            return super().renewed(fresh, path, key, begins)
        again = begins & (path.more.trip == 1)
        # One number makes all choices, a digit each: so the ways that several of them make are taken evenly, too.
        number = self.pair(key, path.index, transport.FIRST_VERTEX + ROULETTE)[0]
        fresh.radiance = dr.select(again, path.radiance, fresh.radiance)
        fresh.more.trip = dr.select(again, self.mi.UInt32(2), fresh.more.trip)
        fresh.more.number = number
        if self.measured:
            fresh.more.blur = dr.select(again, path.more.blur, fresh.more.blur)
        return dr.select(begins, fresh, path), begins & ~again

    def complete(self, path: PathState) -> Mask:
        return ~path.active & (path.more.trip != 1) if self._forks else super().complete(path)

    def choice(self, path: PathState, u: Float) -> Float:
        if not self._forks:
            return u
        return dr.select(path.more.trip == 2, dr.select(path.more.number < 0.5, END, 1 - END), u)

    def roulette(
        self, path: PathState, key: UInt, dimension: UInt, depth: UInt, throughput: Radiance, eta: Float, active: Mask
    ) -> tuple[Radiance, Mask]:
        """As the base's, but not of a second trip, nor of a first that has not come to where a second is to follow."""
        share, survives = super().roulette(path, key, dimension, depth, throughput, eta, active)
        if not self._forks:
            return share, survives
        plays = (path.more.trip == 1) | (path.more.lobe > 0)
        return dr.select(plays, share, throughput), dr.select(plays, survives, active)

    def _two(self, flags: UInt) -> Mask:
        """Whether a surface reflects as a mirror and lets through straight or refracted, and does nothing else."""
        mi, kinds = self.mi, self.mi.BSDFFlags
        through = mi.has_flag(flags, kinds.DeltaTransmission) ^ mi.has_flag(flags, kinds.Null)
        return mi.has_flag(flags, kinds.DeltaReflection) & through & ~mi.has_flag(flags, kinds.Smooth)

    def _both_ends(self) -> bool:
        """Whether there are surfaces with two ways, each of which one end of the numbers that choose a lobe takes.

        Asked of the materials themselves, since anybody may write one; those with more than one change of ways along
        the numbers have no second trips.
        """
        mi = self.mi
        plugins = {id(plugin): plugin for plugin in (shape.bsdf() for shape in self.smooth)}.values()
        asked = [plugin for plugin in plugins if self._two(mi.UInt32(+plugin.flags()))[0]]
        shape = len(ASKED_COSINES), ASKED_STEPS
        lane = dr.arange(mi.UInt32, shape[0] * shape[1])
        si = dr.zeros(mi.SurfaceInteraction3f, len(lane))
        si.n, si.dp_du, si.dp_dv = mi.Normal3f(0, 0, 1), mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0)
        si.sh_frame = mi.Frame3f(si.n)
        cosine = dr.gather(mi.Float, mi.Float(ASKED_COSINES), lane // ASKED_STEPS)
        si.wi = mi.Vector3f(dr.safe_sqrt(1 - dr.square(cosine)), 0, cosine)
        si.wavelengths = type(si.wavelengths)(*[550] * dr.size_v(si.wavelengths))  # nm, where there are any
        u = dr.lerp(END, 1 - END, mi.Float(lane % ASKED_STEPS) / (ASKED_STEPS - 1))
        for plugin in asked:
            bs, _ = plugin.sample(self.context, si, u, mi.Point2f(0.5))
            first = np.array(mi.Float(bs.wo.z * cosine)).reshape(shape) < 0
            first = first == first[:, :1]  # those that go where the smallest number goes, of which it is so likely:
            likely = np.array(mi.Float(bs.pdf) + 0 * cosine).reshape(shape)[:, 0]
            changes = np.sum(first[:, 1:] != first[:, :-1], axis=1)
            if np.any(changes > 1) or not np.all(abs(first.mean(1) - likely) < 2 / ASKED_STEPS):
                return False
        return bool(asked)
