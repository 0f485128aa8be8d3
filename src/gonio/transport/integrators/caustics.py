"""Path tracing with a progressive photon map for the light that mirrors and smooth glass cast."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import ClassVar

import drjit as dr
import numpy as np

from ...bridge.faults.kernel_array_order import copy_arrays
from ...bridge.types import BSDFSample, Float, Mask, Radiance, UInt
from .. import delta_retrace
from ..delta_retrace import Retrace
from ..photon_maps import SAMPLES_PER_MAP, SHRINKING, PhotonMaps
from ..photons import Photon, Search
from ..scattering import Vertex
from ..scene_data import SceneData
from ..sums import Sums
from .base import Picture, Settings
from .light_transport import FIRST_VERTEX, ROULETTE, PathState, VertexNumbers
from .path import Path

INNER = 0.25  # radius of the search to which blur is compared, as a fraction of the radius


@dataclass
class CausticPath:
    """A path, and the state of its current chain of mirrors and smooth glass.

    lobe    pdf / cosine with which the last lobe before the chain was sampled; 0 if there is no such lobe
    counts  fraction of the light beyond the chain that the path contributes; particles contribute the rest
    blur    excess of the light from particles over the light from close particles; None if it is not measured
    """

    path: PathState
    lobe: Float
    counts: Float
    retrace: Retrace
    blur: Radiance | None


class Caustics(Path):
    """Path tracing, with a photon map for the light that mirrors and smooth glass cast on other surfaces.

    Light that mirrors or glass cast on a surface is sampled mainly by paths from the camera if the lamps are large, and
    mainly by particles from the lamps if they are small; the two are combined by MIS. A particle contributes within a
    radius that decreases. The picture is therefore blurred by about a pixel at first and converges to a sharp picture:
    the method is consistent but not unbiased. All other light is computed as by `path`.

    The weights are determined by densities with respect to étendue. A path that leaves a surface toward mirrors with
    the density p and then hits a lamp has the density p / cos. N particles that follow the same chain of mirrors from
    the lamp have the density g N pi r^2, where g is their density at the lamp; mirrors and lenses change the width of
    the beam equally for both. Vertex merging as a sampling technique for paths was introduced by Georgiev2012.

    Lamps that the camera sees directly through mirrors and glass are sampled by a retrace, see `delta_retrace`.
    """

    name = "caustics"
    blurs: ClassVar[bool] = True
    shrinking: ClassVar[float] = SHRINKING

    def __init__(self, data: SceneData, settings: Settings) -> None:
        super().__init__(data, settings)
        self.last_ray_apart = self.one_bounce = False  # the light along the last ray is weighted by MIS with particles
        self.merging = bool(self.smooth) and self.lights.count > 0 and settings.max_depth > 2
        self.retraces = False
        if self.merging:
            self.maps = PhotonMaps(data, settings.seed, self.max_depth, settings.radius)
            self.measured = 6 if settings.measures else 0
            self.retraces = delta_retrace.is_possible(self.mi, self.scattering.context, self.smooth)

    def advice(self) -> str:
        return ""

    def stages(self, first: int, last: int) -> Iterator[tuple[int, int]]:
        """Divide samples into groups that share a map, and build the map of each group before it is yielded."""
        if not self.merging:
            yield from super().stages(first, last)
            return
        while first < last:
            number = first // SAMPLES_PER_MAP
            self.maps.prepare(number)
            for read in (self.maps.density, self.maps.current):
                copy_arrays(read)  # copied after the sums at every stage, so that the kernels are identical
            end = min(last, (number + 1) * SAMPLES_PER_MAP)
            yield first, end
            first = end

    # ------------------------------------------------------------------ the loop

    def accumulate(self, pixel: UInt, key: UInt, first: UInt, last: UInt, sums: Sums) -> Sums:
        """Add samples [first, last) of every pixel to the sums, as `path` does; some are followed by a retrace."""
        if not self.merging:
            return super().accumulate(pixel, key, first, last, sums)
        mi = self.mi

        def step(index: UInt, state: CausticPath, sums: Sums) -> tuple[UInt, CausticPath, Sums]:
            begins = ~state.path.active
            wavelength = self.maps.wavelength(index // SAMPLES_PER_MAP, index) if mi.is_spectral else None
            fresh = self.begin(self.camera_path(pixel, key, index, begins, wavelength))
            state, begins = self.regenerate(fresh, state, key, begins)
            state, features = self.merged_bounce(state, key)
            ended = ~state.path.active
            if self.retraces:
                ended &= state.retrace.phase != delta_retrace.DUE
            sums = sums.add(self.values(state), ended, features, begins)
            return index + dr.select(ended, mi.UInt32(1), mi.UInt32(0)), state, sums

        state = (first + dr.zeros(mi.UInt32, dr.width(pixel)), self.begin(self.idle_path()), sums)
        return dr.while_loop(state, lambda index, *_: index < last, step, mode="symbolic", label="vertices")[2]

    def begin(self, path: PathState) -> CausticPath:
        mi = self.mi
        blur = mi.Spectrum(0) if self.measured else None
        return CausticPath(path, mi.Float(0), mi.Float(1), Retrace.none(mi), blur)

    def regenerate(self, fresh: CausticPath, state: CausticPath, key: UInt, begins: Mask) -> tuple[CausticPath, Mask]:
        """On lanes whose path has ended, start the retrace or the next sample; also returns lanes with new samples."""
        if not self.retraces:
            return dr.select(begins, fresh, state), begins
        retraced = begins & (state.retrace.phase == delta_retrace.DUE)
        number = self.data.pair(key, state.path.index, FIRST_VERTEX + ROULETTE)[0]
        fresh.path.radiance = dr.select(retraced, state.path.radiance, fresh.path.radiance)
        fresh.retrace = fresh.retrace.begin(retraced, number)
        if self.measured:
            fresh.blur = dr.select(retraced, state.blur, fresh.blur)
        return dr.select(begins, fresh, state), begins & ~retraced

    def merged_bounce(self, state: CausticPath, key: UInt) -> tuple[CausticPath, list[Float]]:
        """Process a vertex as `path` does, and add the light from particles."""
        path = state.path
        vertex, throughput = self.intersect(path)
        emitted = self.emitted(path, vertex)
        emitted = dr.select(path.active, emitted * self.emission_weight(state, vertex, emitted), 0)
        radiance = path.radiance + throughput * emitted
        active = path.active & vertex.si.is_valid() & (path.depth + 1 < self.max_depth)
        if self.retraces:
            active &= ~(state.retrace.retracing & self.mi.has_flag(vertex.bsdf.flags(), self.mi.BSDFFlags.Smooth))
        throughput, hero_only = self.keep_hero(path, vertex, throughput, active)

        # Light sampling; the same call of the BSDF also samples the next direction.
        u = self.numbers(path, key)
        if self.retraces:
            u.lobe = state.retrace.lobe(u.lobe)
        light = self.sample_light(vertex, u, active)
        value, bsdf_pdf, bs, weight = self.sample_bsdf(vertex, light, u, active)
        gathered = self.direct_light(vertex, light, value, bsdf_pdf, active)

        # The light from particles, weighted by MIS with paths that continue through mirrors
        photons, excess, counts = self.gather_photons(state, vertex, u, active)
        gathered = gathered + dr.select(active, photons, 0)
        radiance = radiance + throughput * gathered
        if self.ambient is not None:
            radiance = radiance + throughput * self.ambient_light(vertex, active)
        blur = state.blur + throughput * excess if self.measured else None

        # BSDF sampling: the next ray
        throughput = throughput * weight
        features = self.data.features(throughput, vertex.si, path.active, active)
        path = replace(path, throughput=throughput, radiance=radiance, hero_only=hero_only)
        path = self.spawn(path, vertex, bs, light, active)
        path = self.trace(self.roulette_behind(state, path, u))
        return self.after_bounce(state, path, vertex, bs, counts, blur), features

    def values(self, state: CausticPath) -> list[Float]:
        """The color of a complete sample, [r, g, b], and its blur as measured with the even and with the odd maps."""
        path = state.path
        values = [*self.data.rgb(path.radiance, path.ray.wavelengths)]
        if not self.measured:
            return values
        odd = (path.index // SAMPLES_PER_MAP & 1) != 0
        blur = [*self.data.rgb(state.blur, path.ray.wavelengths)]
        return [*values, *(dr.select(odd, 0, v) for v in blur), *(dr.select(odd, v, 0) for v in blur)]

    # ------------------------------------------------------------------ the steps at a vertex

    def emission_weight(self, state: CausticPath, vertex: Vertex, emitted: Radiance) -> Float:
        """The MIS weight of a lamp that a path hits through mirrors, relative to the particles or to a retrace."""
        path, sources = state.path, self.maps.particles.sources
        lit = path.active & (path.pdf == 0) & dr.any(emitted != 0)
        behind = lit & (state.lobe > 0)
        density = sources.density(path.ray.o, vertex.si, path.ray.d, behind)
        weight = dr.select(behind, state.counts * self.maps.path_weight(state.lobe, density), 1)
        if not self.retraces:
            return weight
        return dr.select(lit & (state.lobe == 0), state.retrace.weight(), weight)

    def gather_photons(
        self, state: CausticPath, vertex: Vertex, u: VertexNumbers, active: Mask
    ) -> tuple[Radiance, Radiance, Float]:
        """The light from particles at a vertex, its excess over the light from close particles, and a fraction.

        This is the fraction of the light beyond mirrors that the path contributes from this vertex on.
        """
        mi, maps, si, path = self.mi, self.maps, vertex.si, state.path
        photons = maps.current
        if vertex.crossing is not None:
            active = active & vertex.crossing.surface
        active = active & mi.has_flag(vertex.bsdf.flags(), mi.BSDFFlags.Smooth)
        # A path that arrived through mirrors is weighted by MIS with particles that are stored at their second surface.
        by_mirrors = (state.lobe > 0) & (path.pdf == 0)
        counts = dr.select(by_mirrors, maps.path_weight(state.lobe, maps.etendue_density(si.p)), 1)

        def visit(photon: Photon, weight: Float, here: Mask) -> Radiance:
            here &= photon.depth + path.depth + 1 <= self.max_depth
            value, pdf = vertex.bsdf.eval_pdf(self.scattering.context, si, si.to_local(photon.direction), here)
            cosine = dr.maximum(abs(dr.dot(photon.direction, si.n)), 1e-6)
            weight_here = 1 - maps.path_weight(pdf / cosine, photon.density)
            weight_here *= dr.select(photon.second, 1, counts)
            flux = maps.rotated(photon.flux, path.index)
            return dr.select(here, value * flux * (weight * weight_here / cosine), 0)

        within = INNER if self.measured else 0.0
        back, normal = si.to_world(si.wi), mi.Vector3f(si.n)
        search = Search(si.p, normal, back, u.photons)
        light, excess = photons.gather(search, mi.Spectrum(0), visit, active, within)
        return light, excess, counts

    def roulette_behind(self, state: CausticPath, path: PathState, u: VertexNumbers) -> PathState:
        """Russian roulette, except in a retrace, and in a first path whose retrace is not yet due."""
        played = self.roulette(path, u)
        if not self.retraces:
            return played
        plays = (state.retrace.phase == delta_retrace.DUE) | (state.lobe > 0)
        throughput = dr.select(plays, played.throughput, path.throughput)
        return replace(path, throughput=throughput, active=dr.select(plays, played.active, path.active))

    def after_bounce(
        self,
        state: CausticPath,
        path: PathState,
        vertex: Vertex,
        bs: BSDFSample,
        counts: Float,
        blur: Radiance | None,
    ) -> CausticPath:
        """The state after a vertex, from the `state` before it and the `path` after it."""
        mi = self.mi
        delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
        begun = bs.pdf / dr.maximum(abs(dr.dot(path.ray.d, vertex.si.n)), 1e-6)
        lobe = dr.select(delta, state.lobe * dr.square(bs.eta), begun)
        after = CausticPath(path, lobe, dr.select(delta, state.counts, counts), state.retrace, blur)
        if self.retraces:
            two_ways = delta_retrace.reflects_and_transmits(mi, vertex.bsdf.flags())
            here = state.path.active & (state.lobe == 0)
            after.retrace, weight, goes_on = state.retrace.after(bs, delta, two_ways, here)
            after.path = replace(path, throughput=path.throughput * weight, active=path.active & goes_on)
        return after

    # ------------------------------------------------------------------ blur

    def differences(self, measured: Picture, samples: int) -> list[Picture]:
        """The differences from a picture with INNER times the radius, from the even maps and from the odd maps."""
        if not self.measured:
            return []
        rounds, rest = divmod(samples, 2 * SAMPLES_PER_MAP)
        even = rounds * SAMPLES_PER_MAP + min(rest, SAMPLES_PER_MAP)
        weights = samples / max(even, 1), samples / max(samples - even, 1)
        return [measured[..., :3] * np.float32(weights[0]), measured[..., 3:] * np.float32(weights[1])]
