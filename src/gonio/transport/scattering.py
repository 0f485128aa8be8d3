"""Evaluate and sample BSDFs at a vertex."""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType

import drjit as dr

from ..bridge.adapter.variant import NESTS, SEPARATES
from ..bridge.types import BSDFPlugin, BSDFSample, Float, Mask, Point, Radiance, SurfaceInteraction, UInt, Vector
from .media import Crossing, Media


@dataclass
class Vertex:
    """A point at which a path has hit a surface.

    crossing  media on the two sides of the surface; None in scenes without media
    """

    si: SurfaceInteraction
    bsdf: BSDFPlugin
    crossing: Crossing | None = None

    def side(self, direction: Vector) -> UInt:
        """The media on the side of the surface to which a local direction points."""
        assert self.crossing is not None
        return dr.select(self.si.wi.z * direction.z < 0.0, self.crossing.beyond, self.crossing.here)


class Scattering:
    """Evaluates BSDFs in a context that specifies how the integrator treats media and wavelengths."""

    def __init__(self, mi: ModuleType, media: Media) -> None:
        self.mi = mi
        self.context = mi.BSDFContext()
        self.context.type_mask = NESTS if media.known else SEPARATES

    def eval(self, vertex: Vertex, toward: Vector, active: Mask) -> Radiance:
        """The BSDF times the cosine for a light in the local direction `toward`."""
        return vertex.bsdf.eval(self.context, vertex.si, toward, active)

    def sample(self, vertex: Vertex, lobe: Float, u: Point, active: Mask) -> tuple[BSDFSample, Radiance]:
        """Sample a direction. Also returns its weight, the BSDF times the cosine divided by the density."""
        return vertex.bsdf.sample(self.context, vertex.si, lobe, u, active)

    def eval_pdf_sample(
        self, vertex: Vertex, toward: Vector, lobe: Float, u: Point, active: Mask
    ) -> tuple[Radiance, Float, BSDFSample, Radiance]:
        """The value and density toward a light, a BSDF sample, and its weight, in one call from the kernel."""
        return vertex.bsdf.eval_pdf_sample(self.context, vertex.si, toward, lobe, u, active)

    def pass_through(
        self, vertex: Vertex, bs: BSDFSample, weight: Radiance, active: Mask
    ) -> tuple[BSDFSample, Radiance]:
        """The sample, replaced by one that passes straight through if the media form no real surface here."""
        if vertex.crossing is None:
            return bs, weight
        mi, through = self.mi, active & ~vertex.crossing.surface
        bs.wo = dr.select(through, -vertex.si.wi, bs.wo)
        bs.pdf, bs.eta = dr.select(through, 1.0, bs.pdf), dr.select(through, 1.0, bs.eta)
        bs.sampled_type = dr.select(through, mi.UInt32(+mi.BSDFFlags.DeltaTransmission), bs.sampled_type)
        return bs, dr.select(through, mi.Spectrum(1.0), weight)


def keep_hero(mi: ModuleType, throughput: Radiance, hero_only: UInt, here: Mask) -> tuple[Radiance, UInt]:
    """Continue with only the first wavelength, weighted for all wavelengths, if the index of refraction depends on it.

    The wavelengths of a sample are shifted copies of one number, so the first wavelength has the same distribution as
    the others and can represent all of them (PBRT4, sec. 4.5.4; Wilkie2014 calls it the hero wavelength).
    """
    count = dr.size_v(throughput)
    hero = mi.Spectrum(0)
    hero[0] = throughput[0] * dr.select(hero_only == 0, count, 1)
    return dr.select(here, hero, throughput), dr.select(here, mi.UInt32(1), hero_only)
