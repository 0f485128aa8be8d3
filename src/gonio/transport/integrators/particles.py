"""Particles on their way from the lamps: what those who trace light forward share.

A particle arrives at a surface with a flux; what leaves again is the adjoint of what a path does: radiance's (eta_o /
eta_i)^2 is left out, and where shading and geometric normals differ the flux is corrected (Veach1997, sec. 5.3).
"""

from __future__ import annotations

import re
import weakref
from dataclasses import dataclass
from typing import TYPE_CHECKING

import drjit as dr

from ...bridge.adapter.variant import DISPERSES
from ...bridge.types import BSDFSample, Float, Hit, Mask, MitsubaBSDF, Radiance, Ray, SurfaceInteraction, UInt, Vector
from .. import sampler
from ..lights.sources import Particle, Sources, Targets
from ..media import Crossing

if TYPE_CHECKING:
    from .transport import Transport

# Dimensions of a particle: at the lamp, and at each vertex.
PICK, PLACE, WAY, AIM, FIRST_VERTEX = 0, 1, 2, 3, 4
LOBE, CHOICE, LENS, VERTEX_DIMENSIONS = 0, 1, 2, 3

BENDS = re.compile("NormalMap|BumpMap")

ROULETTE_DEPTH = 5  # segments, as along paths


@dataclass
class Flight:
    """Particles under way, one a lane."""

    depth: UInt  # segments traced, the one to `hit` with them
    ray: Ray
    hit: Hit
    flux: Radiance  # with which it left the lamp
    share: Radiance  # of that, what is left
    eta: Float  # product of the relative indices on the way: of where it is over where it began
    alone: UInt
    inside: UInt
    active: Mask


class Particles:
    """The particles of an integrator that follows light, whose media, surfaces and random numbers they share.

    Particle number n = (low, high) is the same whoever traces it: all of a picture are one sequence, evenly spread.
    """

    def __init__(self, transport: Transport, targets: Targets | None = None):
        # No circle: who goes by the collector of garbage, with the scene, goes at any time.
        self.of: Transport = weakref.proxy(transport)
        self.mi = transport.mi
        mi = self.mi
        self.sources = Sources(mi, transport.scene, transport.sensor, transport.lights, targets)
        self.context = mi.BSDFContext(mi.TransportMode.Importance)
        self.context.type_mask = transport.context.type_mask
        self.seed = dr.opaque(mi.UInt32, transport.settings.seed)
        # Plugins of Mitsuba's that bend normals keep that to themselves.
        self.bent = any(BENDS.search(str(shape.bsdf())) for shape in transport.scene.shapes())

    def key(self, high: UInt) -> UInt:
        return sampler.pixel_key(high, self.seed)

    def leave(self, key: UInt, low: UInt, active: Mask, hue: Float | None = None) -> tuple[Particle, Flight]:
        """Particle `low` as it leaves its lamp, and on the way to what it meets first.

        hue  chooses its wavelengths, for which it stands; None: it has some of its own, and stands for all
        """
        mi, of = self.mi, self.of
        pick, colour = of.pair(key, low, PICK)
        place, way = mi.Point2f(*of.pair(key, low, PLACE)), mi.Point2f(*of.direction_pair(key, low, WAY))
        wavelengths, weight = self.sources.wavelengths(colour if hue is None else hue)
        weight = weight if hue is None else mi.Spectrum(1)
        particle = self.sources.sample(pick, place, of.pair(key, low, AIM)[0], way, wavelengths)
        particle.flux *= weight
        particle.seen *= weight
        ray = particle.place.spawn_ray(particle.direction)  # off the lamp's own surface
        ray.o = dr.select(particle.place.is_valid(), ray.o, particle.origin)
        ray.wavelengths = wavelengths
        active = active & dr.any(particle.flux != 0) & (of.max_depth > 1)
        hit = of.surfaces.nearest(ray, active)
        flight = Flight(
            mi.UInt32(1),
            ray,
            hit,
            particle.flux,
            mi.Spectrum(1),
            mi.Float(1),
            mi.UInt32(0),
            mi.UInt32(0),
            active & hit.is_valid(),
        )
        return particle, flight

    def arrive(self, flight: Flight) -> tuple[SurfaceInteraction, MitsubaBSDF, Crossing | None]:
        """The surface that they meet; what is absorbed on the way is taken off."""
        mi, of = self.mi, self.of
        si = of.surfaces.interaction(flight.hit, flight.ray, flight.active)
        bsdf = si.bsdf(flight.ray)
        crossing = None
        if of.media.known:
            flight.share *= dr.select(flight.active, of.media.transmitted(flight.inside, si, si.t), 1)
            crossing = of.media.crossing(si, bsdf, flight.inside, flight.active)
            si.duv_dx = mi.Vector2f(crossing.outer - 1.0, 0.0)
        if of.disperses:
            here = flight.active & ((bsdf.flags() & DISPERSES) != 0)
            flight.share, flight.alone = of.separate(flight.share, flight.alone, here)
        return si, bsdf, crossing

    def scatter(
        self, key: UInt, low: UInt, flight: Flight, si: SurfaceInteraction, bsdf: MitsubaBSDF, crossing: Crossing | None
    ) -> tuple[BSDFSample, Radiance]:
        """A direction to go on in, and the share that goes there."""
        mi, of = self.mi, self.of
        at = flight.depth * VERTEX_DIMENSIONS + (FIRST_VERTEX - VERTEX_DIMENSIONS)
        lobe, _ = of.pair(key, low, at + CHOICE)
        u = mi.Point2f(*of.direction_pair(key, low, at + LOBE))
        bs, weight = bsdf.sample(self.context, si, lobe, u, flight.active)
        if crossing is not None:
            bs, weight = of.straight_on(si, bs, weight, flight.active & ~crossing.surface)
        if not self.bent:
            return bs, weight * adjoint(si, bs.wo)
        delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
        value = self.sent(si, bsdf, bs.wo, flight.active & ~delta) / dr.select(bs.pdf > 0, bs.pdf, 1)
        between = si.wi + bs.wo * bs.eta  # along the normal that mirrors or refracts
        bend = adjoint(si, bs.wo, si.to_world(between * dr.rsqrt(dr.maximum(dr.squared_norm(between), 1e-12))))
        return bs, dr.select(delta, weight * dr.select(dr.squared_norm(between) > 1e-6, bend, 1), value)

    def sent(self, si: SurfaceInteraction, bsdf: MitsubaBSDF, toward: Vector, active: Mask) -> Radiance:
        """The share that a rough surface sends in a direction, with its cosine: what a path from there would find."""
        if not self.bent:
            return bsdf.eval(self.context, si, toward, active) * adjoint(si, toward)
        mi = self.mi
        # As radiance from here: glass scales that by its index, and importance not.
        seen = mi.SurfaceInteraction3f(si)
        seen.wi = toward
        into, out = abs(dr.dot(si.n, si.to_world(si.wi))), abs(dr.dot(si.n, si.to_world(toward)))
        return bsdf.eval(self.of.context, seen, si.wi, active) * (out / dr.maximum(into, 1e-12))

    def go_on(
        self,
        key: UInt,
        low: UInt,
        flight: Flight,
        si: SurfaceInteraction,
        crossing: Crossing | None,
        bs: BSDFSample,
        weight: Radiance,
        active: Mask,
    ) -> Flight:
        """To the next surface, in the direction of a sample."""
        of = self.of
        share = flight.share * weight
        active = active & dr.any(share != 0) & (flight.depth + 1 < of.max_depth)
        at = flight.depth * VERTEX_DIMENSIONS + (FIRST_VERTEX - VERTEX_DIMENSIONS)
        survive = dr.clip(dr.max(share), 1e-6, 0.95)
        plays = flight.depth >= ROULETTE_DEPTH
        active &= ~plays | (of.pair(key, low, at + CHOICE)[1] < survive)
        share = dr.select(plays, share / survive, share)
        inside = flight.inside
        if crossing is not None:
            inside = dr.select(si.wi.z * bs.wo.z < 0.0, crossing.beyond, crossing.here)
        ray = si.spawn_ray(si.to_world(bs.wo))
        hit = of.surfaces.nearest(ray, active)
        active &= hit.is_valid()
        eta = flight.eta * dr.select(active, bs.eta, 1)
        return Flight(flight.depth + 1, ray, hit, flight.flux, share, eta, flight.alone, inside, active)


def adjoint(si: SurfaceInteraction, wo: Vector, normal: Vector | None = None) -> Float:
    """What a particle's flux is multiplied by where the shading normal is not the geometric one, |wi.s wo.g / (wi.g
    wo.s)|; 1 where they are the same. `normal` is s where it is not that of the surface."""
    into, out = abs(dr.dot(si.n, si.to_world(si.wi))), abs(dr.dot(si.n, si.to_world(wo)))
    shading = si.sh_frame.n if normal is None else normal
    from_light, onward = abs(dr.dot(shading, si.to_world(si.wi))), abs(dr.dot(shading, si.to_world(wo)))
    factor = from_light * out / dr.maximum(into * onward, 1e-12)
    return dr.select(abs(dr.dot(si.n, shading)) > 1 - 1e-6, 1, factor)
