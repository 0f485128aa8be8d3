"""The steps of a path, which integrators combine in their own loops.

    camera_path   the camera ray and its first hit; then, at each vertex:
    intersect     the surface at the hit
    emitted       the emission of the surface, weighted by MIS with light sampling
    sample_light  a point on a lamp
    sample_bsdf   the value of the BSDF toward this point, and the next direction
    direct_light  the light from the lamp, weighted by MIS with BSDF sampling, if the shadow ray is not blocked
    spawn         the ray in the next direction
    roulette      Russian roulette
    trace         the first hit of this ray; for the last ray, `light_along` adds its light instead

A path ends at the maximum depth, if its throughput is 0, by roulette, or if its ray hits nothing. At each vertex, the
BSDF is called once, to evaluate it toward a light and to sample the next direction. A shadow ray is traced unless the
contribution of the light is zero.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar

import drjit as dr

from ...bridge.adapter.variant import DISPERSES
from ...bridge.types import BSDFSample, Float, Hit, Mask, Point, Radiance, Ray, UInt
from .. import sampler
from ..camera import FIRST_FREE
from ..lights.base import LightSample
from ..scattering import Vertex, keep_hero
from ..scene_data import SceneData
from .base import Integrator, Settings

# Russian roulette begins at this depth, as in Mitsuba's `path`, because the throughput is rarely low enough before. At
# the default maximum depth of 5, it is never played.
ROULETTE_DEPTH = 5
# The ratio of the survival probability to the throughput. Early termination increases the error too much: with a factor
# of 1, the error is 1.3 times as large for rough glass, 1.2 times for a room and 1.08 times for a soft sky, in exchange
# for 0 to 16 % less time.
SURVIVAL = 4.0

# The sample dimensions of a path. Each vertex uses VERTEX_DIMENSIONS dimensions.
FIRST_VERTEX = FIRST_FREE
LIGHT, DIRECTION, LOBE, ROULETTE, VERTEX_DIMENSIONS = 0, 1, 2, 3, 4


@dataclass
class PathState:
    """The state of a path, one per lane."""

    index: UInt  # index of the sample
    depth: UInt  # number of vertices so far: 0 at the first hit
    ray: Ray  # the next segment
    hit: Hit  # first intersection of `ray`
    throughput: Radiance
    eta: Float  # product of the relative indices of refraction along the path
    pdf: Float  # density with which the BSDF sampled `ray`, 1/sr; 0 for camera rays and delta lobes
    solid_angle: Float  # LightSample.solid_angle at the origin of `ray`
    radiance: Radiance  # accumulated radiance
    hero_only: UInt  # 1 if the path continues with only its first wavelength
    inside: UInt  # the media that contain `ray`, see `media.py`
    active: Mask  # False once the path has ended, because of its depth, zero throughput, `roulette` or `trace`


@dataclass
class VertexNumbers:
    """The random numbers of a vertex, in [0, 1)."""

    light: Point
    direction: Point
    lobe: Float
    roulette: Float
    photons: Float


class LightTransport(Integrator):
    """The base class of integrators that trace paths. Subclasses implement `bounce` and call it in a loop.

    samples_lights  whether lights are sampled at the vertices
    samples_lobes   whether all lobes of the BSDF are sampled at the vertices; delta lobes are always sampled
    """

    samples_lights: ClassVar[bool] = True

    def __init__(self, data: SceneData, settings: Settings):
        super().__init__(data, settings)
        mi = self.mi
        self.media, self.scattering, self.lights = data.media, data.scattering, data.lights
        self.max_depth = dr.opaque(mi.UInt32, self.depth(settings))
        self.ambient = data.ambient
        self.smooth, self.disperses = data.smooth, data.disperses
        self.camera_media = data.media_at_camera  # before a loop is recorded

    @classmethod
    def depth(cls, settings: Settings) -> int:
        """The maximum path length in segments; 2 is direct illumination."""
        return 2

    def bounce(self, path: PathState, key: UInt) -> tuple[PathState, list[Float]]:
        """The path after the vertex at its hit, and the features at this vertex (`SceneData.features`)."""
        raise NotImplementedError(f"{type(self).__name__} has no bounce")

    def sample(self, pixel: UInt, key: UInt, index: UInt) -> list[Float]:
        """The color, [r, g, b], and the features of a sample that ends at its first vertex."""
        path, features = self.bounce(self.camera_path(pixel, key, index), key)
        return [*self.data.rgb(path.radiance, path.ray.wavelengths), *features]

    # ------------------------------------------------------------------ the beginning of a path

    def camera_path(
        self, pixel: UInt, key: UInt, index: UInt, begins: Mask = True, wavelength: Float | None = None
    ) -> PathState:
        """The path of a sample up to its first hit, on the lanes `begins`."""
        ray, weight, hit = self.data.first_hit(pixel, key, index, begins, wavelength)
        return self._path(index, ray, hit, self.mi.Spectrum(weight), self.data.begins_path(hit))

    def idle_path(self) -> PathState:
        """A path that has ended."""
        mi = self.mi
        nothing = dr.zeros(mi.Ray3f), dr.zeros(mi.PreliminaryIntersection3f), mi.Spectrum(0)
        return self._path(mi.UInt32(0), *nothing, mi.Bool(False))

    def _path(self, index: UInt, ray: Ray, hit: Hit, weight: Radiance, active: Mask) -> PathState:
        mi = self.mi
        return PathState(
            index=index,
            depth=mi.UInt32(0),
            ray=ray,
            hit=hit,
            throughput=weight,
            eta=mi.Float(1),
            pdf=mi.Float(0),
            solid_angle=mi.Float(0),
            radiance=mi.Spectrum(0),
            hero_only=mi.UInt32(0),
            inside=self.camera_media,
            active=mi.Bool(active),
        )

    def numbers(self, path: PathState, key: UInt) -> VertexNumbers:
        """The random numbers for the vertex at the path's hit."""
        mi, data, index = self.mi, self.data, path.index
        dimension = path.depth * VERTEX_DIMENSIONS + FIRST_VERTEX
        pair = data.direction_pair if self.lights.has_environment else data.pair  # on the sphere, or on a lamp
        roulette, photons = sampler.independent_pair(key, index, dimension + ROULETTE)
        return VertexNumbers(
            light=mi.Point2f(*pair(key, index, dimension + LIGHT)),
            direction=mi.Point2f(*data.direction_pair(key, index, dimension + DIRECTION)),
            lobe=data.pair(key, index, dimension + LOBE)[0],
            roulette=roulette,
            photons=photons,
        )

    # ------------------------------------------------------------------ the steps at a vertex

    def intersect(self, path: PathState) -> tuple[Vertex, Radiance]:
        """The surface at the path's hit, and the throughput after absorption by media along the ray.

        No ray is traced, because `camera_path` or `trace` has already computed the hit.
        """
        return self.data.vertex(path.hit, path.ray, path.inside, path.throughput, path.active)

    def emitted(self, path: PathState, vertex: Vertex) -> Radiance:
        """The radiance emitted along the path's ray, weighted by MIS with light sampling at its origin."""
        lights, active, by_both = self.lights, path.active, path.pdf > 0  # otherwise only BSDF sampling can sample it
        emitted = lights.emitted(vertex.si, active)
        if self.samples_lights:
            compete = active & by_both & dr.any(emitted != 0)
            light_pdf = lights.pdf(path.ray.o, path.solid_angle, vertex.si, compete)
            emitted = dr.select(by_both, emitted * lights.mis_weight(path.pdf, light_pdf), emitted)
        return dr.select(active, emitted, 0)

    def sample_light(self, vertex: Vertex, u: VertexNumbers, active: Mask) -> LightSample | None:
        """A sample of the direct light; None if the scene has no lights."""
        return self.lights.sample(vertex.si, u.light, active) if self.lights.count else None

    def sample_bsdf(
        self, vertex: Vertex, light: LightSample | None, u: VertexNumbers, active: Mask
    ) -> tuple[Radiance, Float, BSDFSample, Radiance]:
        """The BSDF times cosine toward the light, the pdf of this direction, a BSDF sample, and its weight.

        All are computed by one call of the BSDF. Without a light, the first two are 0; if only lights are sampled, the
        last two are 0.
        """
        mi, scattering = self.mi, self.scattering
        value, pdf = mi.Spectrum(0), mi.Float(0)
        if light is None:
            bs, weight = scattering.sample(vertex, u.lobe, u.direction, active)
        elif self.samples_lobes or self.smooth or self.data.aovs:
            toward = vertex.si.to_local(light.ds.d)
            value, pdf, bs, weight = scattering.eval_pdf_sample(vertex, toward, u.lobe, u.direction, active)
        else:
            value = scattering.eval(vertex, vertex.si.to_local(light.ds.d), active)
            bs, weight = dr.zeros(mi.BSDFSample3f), mi.Spectrum(0)
        bs, weight = scattering.pass_through(vertex, bs, weight, active)
        return value, pdf, bs, weight

    def direct_light(
        self, vertex: Vertex, light: LightSample | None, value: Radiance, bsdf_pdf: Float, active: Mask
    ) -> Radiance:
        """The light of a light sample that is scattered back along the path, weighted by MIS with BSDF sampling."""
        if light is None:
            return self.mi.Spectrum(0)
        si, reflected = vertex.si, value * light.weight
        if self.samples_lobes:
            reflected *= dr.select(light.delta, 1, self.lights.mis_weight(light.ds.pdf, bsdf_pdf))
        if vertex.crossing is not None:
            side = vertex.side(si.to_local(light.ds.d))
            reflected *= self.media.transmitted(side, si, light.ds.dist) & vertex.crossing.surface
        visible = self.data.visible(si, light.target, active & dr.any(reflected != 0))
        return dr.select(active, dr.select(visible, reflected, 0), 0)

    def ambient_light(self, vertex: Vertex, active: Mask) -> Radiance:
        """The ambient radiance times the attribute "ambient" of the BSDF, or 0 if the BSDF does not have it."""
        assert self.ambient is not None
        si, bsdf = vertex.si, vertex.bsdf
        if self.mi.is_rgb:
            reflected = bsdf.eval_attribute_3("ambient", si, active)
        else:
            reflected = bsdf.eval_attribute("ambient", si, active)
        return dr.select(active, reflected * self.ambient.eval(si, active), 0)

    def keep_hero(self, path: PathState, vertex: Vertex, throughput: Radiance, active: Mask) -> tuple[Radiance, UInt]:
        """The throughput, and whether the path is limited to its first wavelength.

        At a surface that disperses light, the throughput is limited to the first wavelength.
        """
        if not self.disperses:
            return throughput, path.hero_only
        here = active & ((vertex.bsdf.flags() & DISPERSES) != 0)
        return keep_hero(self.mi, throughput, path.hero_only, here)

    def spawn(
        self, path: PathState, vertex: Vertex, bs: BSDFSample, light: LightSample | None, active: Mask
    ) -> PathState:
        """The path with a ray in the sampled direction, like Mitsuba's `spawn_ray` (see `bridge.faults.ray_offset`).

        path  the path after the vertex, with its accumulated radiance and throughput
        """
        mi = self.mi
        delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
        active = active & dr.any(path.throughput != 0) & (self.samples_lobes | delta)
        return replace(
            path,
            depth=path.depth + 1,
            ray=self.data.surfaces.offsets.ray(vertex.si, vertex.si.to_world(bs.wo)),
            eta=path.eta * dr.select(active, bs.eta, 1),
            pdf=dr.select(delta, 0, bs.pdf) if self.samples_lights else mi.Float(0),
            solid_angle=mi.Float(0) if light is None else light.solid_angle,
            inside=path.inside if vertex.crossing is None else vertex.side(bs.wo),
            active=active,
        )

    def roulette(self, path: PathState, u: VertexNumbers) -> PathState:
        """Russian roulette. The survival probability is SURVIVAL times the largest channel of the throughput, at most
        0.95.

        The factor eta^2 by which radiance is scaled inside glass is ignored, because it is undone on exit.
        """
        throughput = path.throughput
        survive = dr.clip(SURVIVAL * dr.max(dr.detach(throughput)) * dr.square(path.eta), 1e-6, 0.95)
        plays = path.depth >= ROULETTE_DEPTH
        active = path.active & (~plays | (u.roulette < survive))
        return replace(path, throughput=dr.select(plays, throughput / survive, throughput), active=active)

    def trace(self, path: PathState) -> PathState:
        """The path with the first hit of its ray. A path without a hit ends, unless there is an environment."""
        hit = self.data.surfaces.nearest(path.ray, path.active)
        active = path.active if self.lights.has_environment else path.active & hit.is_valid()
        return replace(path, hit=hit, active=active)

    def light_along(self, path: PathState, active: Mask) -> Radiance:
        """The light along the path's ray times the throughput, for rays whose first hit is not needed otherwise."""
        if self.media.known:
            path = self.trace(replace(path, active=active))
            vertex, throughput = self.intersect(path)
            return throughput * self.emitted(path, vertex)
        weigh: Callable[[Radiance, Float], Radiance] = lambda light, _: light  # noqa: E731
        if self.samples_lights:
            mis_weight = self.lights.mis_weight
            weigh = lambda light, pdf: dr.select(path.pdf > 0, light * mis_weight(path.pdf, pdf), light)  # noqa: E731
        light = sum(weigh(*one) for one in self.lights.along(path.ray, path.solid_angle, active))
        return path.throughput * dr.select(active, light, 0)
