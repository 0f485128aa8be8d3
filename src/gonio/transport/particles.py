"""Trace particles from the lamps: the steps that `light` and `caustics` have in common.

    leave -> [ intersect -> sample_bsdf, eval_bsdf -> follow ]

A particle arrives at a surface with a flux and is scattered by the adjoint BSDF. The factor (eta_o / eta_i)^2 for
radiance is therefore omitted, and the flux is corrected where the shading and geometric normals differ (Veach1997, sec.
5.3).
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr

from ..bridge.adapter.variant import DISPERSES
from ..bridge.faults.bent_normals import bends_normals
from ..bridge.types import (
    BSDFSample,
    DirectionSample,
    Float,
    Hit,
    Mask,
    Radiance,
    Ray,
    SurfaceInteraction,
    UInt,
    Vector,
)
from . import sampler
from .lights.sources import Particle, Sources, Targets
from .scattering import Vertex, keep_hero
from .scene_data import SceneData

# The sample dimensions of a particle at the lamp and at each vertex
PICK, PLACE, WAY, AIM, FIRST_VERTEX = 0, 1, 2, 3, 4
DIRECTION, LOBE, LENS, VERTEX_DIMENSIONS = 0, 1, 2, 3

ROULETTE_DEPTH = 5  # number of segments, as for paths


@dataclass
class Flight:
    """The state of the particles, one per lane."""

    depth: UInt  # number of segments traced, including the one to `hit`
    ray: Ray
    hit: Hit
    flux: Radiance  # flux at the lamp
    throughput: Radiance  # fraction of the flux that remains
    eta: Float  # product of the relative indices: the current index of refraction divided by that at the lamp
    hero_only: UInt
    inside: UInt
    active: Mask

    @property
    def dimension(self) -> UInt:
        """The dimension of the first random number at the next vertex."""
        return self.depth * VERTEX_DIMENSIONS + (FIRST_VERTEX - VERTEX_DIMENSIONS)


class Particles:
    """The particles of a picture. They form one sequence: particle n = (low, high) does not depend on where it is
    traced.

    max_depth  maximum path length in segments, as kernel data
    targets    spheres toward which particles are emitted; None for all directions
    """

    def __init__(self, data: SceneData, seed: int, max_depth: UInt, targets: Targets | None = None) -> None:
        self.mi = mi = data.mi
        self.data, self.max_depth = data, max_depth
        self.sources = Sources(mi, data.scene, data.sensor, data.lights, targets)
        self.context = mi.BSDFContext(mi.TransportMode.Importance)
        self.context.type_mask = data.scattering.context.type_mask
        self.seed = dr.opaque(mi.UInt32, seed)
        self.bent = bends_normals(data.scene)

    def key(self, high: UInt) -> UInt:
        """The key of the sampler for particles whose numbers have the given upper 32 bits."""
        return sampler.pixel_key(high, self.seed)

    def number(self, index: UInt, pixel: UInt, pixels: UInt) -> tuple[UInt, UInt]:
        """The key, and the lower 32 bits of the number, of the particle for a sample of a pixel."""
        mi = self.mi
        number = mi.UInt64(index) * mi.UInt64(pixels) + mi.UInt64(pixel)
        low = mi.UInt32(number)
        return self.key(mi.UInt32(number >> 32)), low

    def leave(self, key: UInt, low: UInt, wavelength: Float | None = None) -> tuple[Particle, Flight]:
        """Particle `low` when it leaves its lamp, and its state at the first surface that it hits.

        wavelength  a number in [0, 1) that selects the wavelengths of the flux; if it is None, the wavelengths are
                    sampled for each particle, and the flux is weighted by their density
        """
        mi, data = self.mi, self.data
        pick, color = data.pair(key, low, PICK)
        place, way = mi.Point2f(*data.pair(key, low, PLACE)), mi.Point2f(*data.direction_pair(key, low, WAY))
        wavelengths, weight = self.sources.wavelengths(color if wavelength is None else wavelength)
        weight = weight if wavelength is None else mi.Spectrum(1)
        particle = self.sources.sample(pick, place, data.pair(key, low, AIM)[0], way, wavelengths)
        particle.flux *= weight
        particle.direct_weight *= weight
        ray = data.surfaces.offsets.ray(particle.place, particle.direction)  # begins off the surface of the lamp
        ray.o = dr.select(particle.place.is_valid(), ray.o, particle.origin)
        ray.wavelengths = wavelengths
        active = mi.Bool(True) & dr.any(particle.flux != 0) & (self.max_depth > 1)
        hit = data.surfaces.nearest(ray, active)
        one, none = mi.UInt32(1), mi.UInt32(0)
        flight = Flight(
            one,
            ray,
            hit,
            particle.flux,
            mi.Spectrum(1),
            mi.Float(1),
            none,
            mi.UInt32(0),
            active & hit.is_valid(),
        )
        return particle, flight

    def intersect(self, flight: Flight) -> Vertex:
        """The surface that a particle has hit, with the throughput attenuated by media along the ray. Traces no ray."""
        data, active = self.data, flight.active
        vertex, throughput = data.vertex(flight.hit, flight.ray, flight.inside, flight.throughput, active)
        flight.throughput = throughput
        if data.disperses:
            here = active & ((vertex.bsdf.flags() & DISPERSES) != 0)
            flight.throughput, flight.hero_only = keep_hero(self.mi, throughput, flight.hero_only, here)
        return vertex

    def sample_bsdf(self, key: UInt, low: UInt, flight: Flight, vertex: Vertex) -> tuple[BSDFSample, Radiance]:
        """Sample a scattered direction. Also returns the weight of the flux in this direction."""
        mi, data, si, active = self.mi, self.data, vertex.si, flight.active
        lobe, _ = data.pair(key, low, flight.dimension + LOBE)
        u = mi.Point2f(*data.direction_pair(key, low, flight.dimension + DIRECTION))
        bs, weight = vertex.bsdf.sample(self.context, si, lobe, u, active)
        bs, weight = data.scattering.pass_through(vertex, bs, weight, active)
        if not self.bent:
            return bs, weight * adjoint(si, bs.wo)
        delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
        value = self.eval_bsdf(vertex, bs.wo, active & ~delta) / dr.select(bs.pdf > 0, bs.pdf, 1)
        between = si.wi + bs.wo * bs.eta  # along the normal that reflects or refracts
        bend = adjoint(si, bs.wo, si.to_world(between * dr.rsqrt(dr.maximum(dr.squared_norm(between), 1e-12))))
        return bs, dr.select(delta, weight * dr.select(dr.squared_norm(between) > 1e-6, bend, 1), value)

    def eval_bsdf(self, vertex: Vertex, toward: Vector, active: Mask) -> Radiance:
        """The flux that a rough surface scatters in a direction, including the cosine, by the adjoint BSDF."""
        si, bsdf = vertex.si, vertex.bsdf
        if not self.bent:
            return bsdf.eval(self.context, si, toward, active) * adjoint(si, toward)
        # The BSDF is evaluated in reverse, as radiance, because glass scales radiance but not importance.
        reverse = self.mi.SurfaceInteraction3f(si)
        reverse.wi = toward
        into, out = abs(dr.dot(si.n, si.to_world(si.wi))), abs(dr.dot(si.n, si.to_world(toward)))
        value = bsdf.eval(self.data.scattering.context, reverse, si.wi, active)
        return value * (out / dr.maximum(into, 1e-12))

    def through_media(self, vertex: Vertex, value: Radiance, ds: DirectionSample) -> Radiance:
        """The light from a vertex to the camera after absorption by media."""
        if vertex.crossing is None:
            return value
        side = vertex.side(vertex.si.to_local(ds.d))
        return value * (self.data.media.transmitted(side, vertex.si, ds.dist) & vertex.crossing.surface)

    def follow(
        self, key: UInt, low: UInt, flight: Flight, vertex: Vertex, bs: BSDFSample, weight: Radiance, active: Mask
    ) -> Flight:
        """The state at the next surface in the direction of a sample."""
        data, si = self.data, vertex.si
        throughput = flight.throughput * weight
        active = active & dr.any(throughput != 0) & (flight.depth + 1 < self.max_depth)
        survive = dr.clip(dr.max(throughput), 1e-6, 0.95)
        plays = flight.depth >= ROULETTE_DEPTH
        active &= ~plays | (data.pair(key, low, flight.dimension + LOBE)[1] < survive)
        throughput = dr.select(plays, throughput / survive, throughput)
        inside = flight.inside if vertex.crossing is None else vertex.side(bs.wo)
        ray = data.surfaces.offsets.ray(si, si.to_world(bs.wo))
        hit = data.surfaces.nearest(ray, active)
        active &= hit.is_valid()
        eta = flight.eta * dr.select(active, bs.eta, 1)
        return Flight(flight.depth + 1, ray, hit, flight.flux, throughput, eta, flight.hero_only, inside, active)


def adjoint(si: SurfaceInteraction, wo: Vector, normal: Vector | None = None) -> Float:
    """The factor of a particle's flux where the shading normal s and the geometric normal g differ.

    It is |wi.s wo.g / (wi.g wo.s)|.

    normal  s, if it differs from the shading normal of the surface
    """
    into, out = abs(dr.dot(si.n, si.to_world(si.wi))), abs(dr.dot(si.n, si.to_world(wo)))
    shading = si.sh_frame.n if normal is None else normal
    from_light, onward = abs(dr.dot(shading, si.to_world(si.wi))), abs(dr.dot(shading, si.to_world(wo)))
    factor = from_light * out / dr.maximum(into * onward, 1e-12)
    return dr.select(abs(dr.dot(si.n, shading)) > 1 - 1e-6, 1, factor)
