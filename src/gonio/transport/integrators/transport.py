"""Light transport along paths: what all integrators share that follow light.

How it is fast, beside what `progressive` does:

- A vertex costs one BSDF call, which evaluates the light's direction and samples the next; shadow rays that would
  carry nothing are not traced; the last ray of a path is traced only where it points at the light.
- Sampler and lights: see `sampler.py`, `lights.py`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import ModuleType
from typing import Any, ClassVar

import drjit as dr

from ...bridge.adapter.variant import DISPERSES, NESTS, SEPARATES
from ...bridge.types import (
    BSDFSample,
    Float,
    Hit,
    Mask,
    MitsubaBSDF,
    Radiance,
    Ray,
    Scene,
    Sensor,
    SurfaceInteraction,
    Texture,
    UInt,
    Vector,
)
from .. import sampler
from ..lights.lights import Lights
from ..media import Crossing, Media
from .base import FIRST_FREE, Integrator, Settings
from .sums import Sums

# Russian roulette begins at this depth, as in Mitsuba's `path`: before it, paths are rarely dim enough to pay.
ROULETTE_DEPTH = 5
# How likely a path goes on, over what is left of its throughput. What ends a path early costs more than the path: by
# 1 in its place, rough glass has 1.3 times the error, a room 1.2, a soft sky 1.08, for 0 to 16 % less time.
SURVIVAL = 4.0

# Dimensions of a path: each vertex takes VERTEX_DIMENSIONS of them.
FIRST_VERTEX = FIRST_FREE
LIGHT, LOBE, CHOICE, ROULETTE, VERTEX_DIMENSIONS = 0, 1, 2, 3, 4


@dataclass
class PathState:
    """A path on its way, one a lane."""

    index: UInt  # of the sample
    depth: UInt  # segments traced so far
    ray: Ray  # the next segment, and
    hit: Hit  # what it meets
    throughput: Radiance
    eta: Float  # product of the relative indices on the way
    pdf: Float  # with which the BSDF chose this ray, 1/sr; 0 for camera rays and delta lobes
    solid_angle: Float  # LightSample.solid_angle at its origin
    radiance: Radiance  # found so far
    alone: UInt  # 1 where the first wavelength goes on without the others
    inside: UInt  # of which media, see `media.py`
    active: Mask
    more: Any = None  # what a subclass carries along


class Transport(Integrator):
    """An integrator that follows light along paths. A subclass says how:

    samples_lights  whether each vertex looks for light by sampling the lights
    samples_lobes   whether it does by sampling the BSDF's lobes; delta lobes are always followed
    plays_roulette  whether dim paths are ended by chance
    merges          whether particles bring light to vertices too
    depth           the longest path in segments, a method

    and where it has more to do on the way `carried`, `renewed`, `complete`, `found`, `met`, `choice`, `brought`,
    `followed`
    """

    samples_lights: ClassVar[bool] = True
    samples_lobes: ClassVar[bool] = True
    plays_roulette: ClassVar[bool] = False
    merges: ClassVar[bool] = False

    def __init__(self, mi: ModuleType, scene: Scene, sensor: Sensor, settings: Settings, aovs: bool):
        super().__init__(mi, scene, sensor, settings, aovs)
        self.media = Media(mi, scene)
        self.context = mi.BSDFContext()
        self.context.type_mask = NESTS if self.media.known else SEPARATES
        self.lights = Lights(mi, scene, self.surfaces, mis_compensation=self.samples_lobes)
        depth = self.depth(settings)
        self.max_depth = dr.opaque(mi.UInt32, depth)
        self.ambient = self._ambient()
        self.smooth = [shape for shape in scene.shapes() if mi.has_flag(shape.bsdf().flags(), mi.BSDFFlags.Delta)]
        self.follows_delta = bool(self.smooth)
        self.disperses = any(shape.bsdf().flags() & DISPERSES for shape in scene.shapes())
        eye = mi.Point3f(sensor.world_transform() @ mi.Point3f(0.0)) if self.media.known else None
        self.begun = None if eye is None else self.media.around(eye)
        # Where media dim the way to a lamp, or particles compete for it, the last ray is traced like the others; and
        # where it may meet any of several lamps, for which each vertex would have a second ray and its surface.
        self.traces_last = self.media.known or self.merges or (depth > 2 and not self.lights.shortens_last_ray)
        # Whether any path has a second vertex to shade.
        self.goes_on = (depth > 2 or self.traces_last) and (self.samples_lobes or self.follows_delta)

    @classmethod
    def depth(cls, settings: Settings) -> int:
        """The longest path in segments; 2 is direct light."""
        return 2

    def _ambient(self) -> Texture | None:
        """The ambient light as a texture of radiance, None where nothing would take it."""
        colour = self.settings.ambient
        if colour is None or not any(colour):
            return None
        if not any(dr.any(shape.bsdf().has_attribute("ambient")) for shape in self.scene.shapes()):
            return None
        # An rgb texture alone is a reflectance and ends at 1; d65 times one is a light, also in spectral variants.
        scale = max(colour)
        tint = {"type": "rgb", "value": [c / scale for c in colour]}
        return self.mi.load_dict({"type": "d65", "color": tint, "scale": scale})

    def accumulate(self, pixel: UInt, key: UInt, first: UInt, last: UInt, sums: Sums) -> Sums:
        """Add samples [first, last) of every pixel to the sums, each sum in the order of the samples.

        One flat loop over vertices, whatever sample they are of: a lane whose path has ended begins its next one at
        once, instead of idling until the longest of its 16 neighbours' has ended.
        """
        if not self.goes_on:
            return super().accumulate(pixel, key, first, last, sums)
        mi = self.mi

        def body(index: UInt, path: PathState, sums: Sums) -> tuple[UInt, PathState, Sums]:
            begins = ~path.active
            path, begins = self.renewed(self.first(pixel, key, index, begins), path, key, begins)
            path, features = self.extend(path, key)
            ended = self.complete(path)
            sums = sums.add(self.found(path), ended, features, begins)
            return index + dr.select(ended, mi.UInt32(1), mi.UInt32(0)), path, sums

        nothing = dr.zeros(mi.Ray3f), dr.zeros(mi.PreliminaryIntersection3f), mi.Spectrum(0)
        idle = self._path(mi.UInt32(0), *nothing, active=False)
        state = (first + dr.zeros(mi.UInt32, dr.width(pixel)), idle, sums)
        return dr.while_loop(state, lambda index, *_: index < last, body, mode="symbolic", label="vertices")[2]

    def sample(self, pixel: UInt, key: UInt, index: UInt) -> list[Float]:
        """[r, g, b] and the features of a sample that ends at its first vertex."""
        path, features = self.extend(self.first(pixel, key, index), key, first=True)
        return [*self.rgb(path.radiance, path.ray.wavelengths), *features]

    def first(self, pixel: UInt, key: UInt, index: UInt, begins: Mask = True) -> PathState:
        """A sample's path up to the first thing that it meets, on lanes that begin one."""
        ray, weight, hit = self.first_hit(pixel, key, index, begins)
        return self._path(index, ray, hit, self.mi.Spectrum(weight), True)

    def _path(self, index: UInt, ray: Ray, hit: Hit, weight: Radiance, active: Mask) -> PathState:
        """A path that has met nothing yet."""
        mi, zero = self.mi, self.mi.Float(0)
        inside = self.begun if self.begun is not None else mi.UInt32(0)
        return PathState(
            index,
            mi.UInt32(0),
            ray,
            hit,
            weight,
            mi.Float(1),
            zero,
            zero,
            mi.Spectrum(0),
            mi.UInt32(0),
            inside,
            mi.Bool(active),
            self.carried(),
        )

    def extend(self, path: PathState, key: UInt, first: bool = False) -> tuple[PathState, list[Float]]:
        """One vertex of a path: take its light, gather light there, choose the next direction and trace it.

        first  whether it is known to be the first vertex, which makes the program shorter

        Returns the path, and albedo and normal of the vertex where they are wanted.
        """
        mi, lights = self.mi, self.lights
        ray, throughput, radiance, active = path.ray, path.throughput, path.radiance, path.active
        depth = mi.UInt32(0) if first else path.depth
        dimension = depth * VERTEX_DIMENSIONS + FIRST_VERTEX
        last = depth + 2 >= self.max_depth

        si = self.surfaces.interaction(path.hit, ray, active)
        if self.media.known:
            through = active & si.is_valid()
            throughput = dr.select(through, throughput * self.media.transmitted(path.inside, si, si.t), throughput)
        emitted = lights.emitted(si, active)
        if self.samples_lights and not first:
            compete = active & (path.pdf > 0) & dr.any(emitted != 0)
            weight = lights.mis_weight(path.pdf, lights.pdf(ray.o, path.solid_angle, si, compete))
            emitted = dr.select(path.pdf > 0, emitted * weight, emitted)
        bsdf = si.bsdf(ray)
        emitted, goes_on = self.met(path, si, bsdf, emitted, active)
        radiance = radiance + throughput * dr.select(active, emitted, 0)
        active = active & si.is_valid() & (depth + 1 < self.max_depth) & goes_on

        crossing = self.media.crossing(si, bsdf, path.inside, active) if self.media.known else None
        if crossing is not None:
            si.duv_dx = mi.Vector2f(crossing.outer - 1.0, 0.0)
        alone = path.alone
        if self.disperses:
            throughput, alone = self.separate(throughput, alone, active & ((bsdf.flags() & DISPERSES) != 0))
        gathered, solid_angle, bs, weight = self.scatter(path, key, dimension, si, bsdf, active, crossing)
        inside = path.inside
        if crossing is not None:
            bs, weight = self.straight_on(si, bs, weight, active & ~crossing.surface)
            inside = dr.select(si.wi.z * bs.wo.z < 0.0, crossing.beyond, crossing.here)
        kept = None
        if self.merges:
            path = replace(path, throughput=throughput)  # up to here
            surface = active if crossing is None else active & crossing.surface
            _, u = sampler.independent_pair(key, path.index, dimension + ROULETTE)
            brought, kept = self.brought(si, bsdf, path, u, surface)
            gathered = gathered + brought
        radiance = radiance + throughput * dr.select(active, gathered, 0)
        if self.ambient is not None:
            radiance = radiance + throughput * self.ambient_light(self.ambient, bsdf, si, active)
        throughput = throughput * weight
        seen = (*self.rgb(throughput, ray.wavelengths), *si.sh_frame.n) if self.aovs else ()
        features = [dr.select(active, v, 0) for v in seen]

        delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
        active = active & dr.any(throughput != 0) & (self.samples_lobes | delta)
        pdf = dr.select(delta, 0, bs.pdf) if self.samples_lights else mi.Float(0)
        eta = path.eta * dr.select(active, bs.eta, 1)
        if self.plays_roulette:
            throughput, active = self.roulette(path, key, dimension, depth, throughput, eta, active)

        ray = si.spawn_ray(si.to_world(bs.wo))
        # The last ray can only find light: no surface beyond it is shaded.
        end = active & last

        def weigh(light: Radiance, light_pdf: Float) -> Radiance:
            if not self.samples_lights:
                return light
            return dr.select(pdf > 0, light * lights.mis_weight(pdf, light_pdf), light)

        if not self.traces_last:
            arriving = sum(weigh(*one) for one in lights.along(ray, solid_angle, end))
            radiance = radiance + throughput * dr.select(end, arriving, 0)
            active = active & ~last
        hit = self.surfaces.nearest(ray, active)
        if not lights.has_environment:  # else the path goes on to meet it
            active = active & hit.is_valid()
        following = PathState(
            path.index,
            depth + 1,
            ray,
            hit,
            throughput,
            eta,
            pdf,
            solid_angle,
            radiance,
            alone,
            inside,
            active,
            path.more,
        )
        return self.followed(path, following, si, bsdf, bs, kept), features

    # ------------------------------------------------------------------ what a subclass may do on the way

    def carried(self) -> Any:
        """`PathState.more` of a path that begins; None, or a dataclass of the kernel's values."""
        return None

    def renewed(self, fresh: PathState, path: PathState, key: UInt, begins: Mask) -> tuple[PathState, Mask]:
        """Where a path has ended, the next one in its place; and whether that is of a new sample."""
        return dr.select(begins, fresh, path), begins

    def found(self, path: PathState) -> list[Float]:
        """What counts of a sample that is complete: [r, g, b], and what else is measured."""
        return [*self.rgb(path.radiance, path.ray.wavelengths)]

    def complete(self, path: PathState) -> Mask:
        """Whether a sample is complete."""
        return ~path.active

    def met(
        self, path: PathState, si: SurfaceInteraction, bsdf: MitsubaBSDF, emitted: Radiance, active: Mask
    ) -> tuple[Radiance, Mask]:
        """What counts of the light of what a path meets, and whether it goes on from there."""
        return emitted, active

    def choice(self, path: PathState, u: Float) -> Float:
        """The number that chooses a lobe."""
        return u

    def brought(
        self, si: SurfaceInteraction, bsdf: MitsubaBSDF, path: PathState, u: Float, active: Mask
    ) -> tuple[Radiance, Any]:
        """Of an integrator that merges: what particles bring to a vertex, and what `followed` is told of it."""
        raise NotImplementedError

    def followed(
        self,
        path: PathState,
        following: PathState,
        si: SurfaceInteraction,
        bsdf: MitsubaBSDF,
        bs: BSDFSample,
        kept: Any,
    ) -> PathState:
        """The path after a vertex, with what it carries along from there."""
        return following

    # ------------------------------------------------------------------ the parts of a vertex

    def straight_on(
        self, si: SurfaceInteraction, bs: BSDFSample, weight: Radiance, through: Mask
    ) -> tuple[BSDFSample, Radiance]:
        """A BSDF sample, where there is no surface after all one that goes straight on."""
        mi = self.mi
        bs.wo = dr.select(through, -si.wi, bs.wo)
        bs.pdf, bs.eta = dr.select(through, 1.0, bs.pdf), dr.select(through, 1.0, bs.eta)
        bs.sampled_type = dr.select(through, mi.UInt32(+mi.BSDFFlags.DeltaTransmission), bs.sampled_type)
        return bs, dr.select(through, mi.Spectrum(1.0), weight)

    def separate(self, throughput: Radiance, alone: UInt, here: Mask) -> tuple[Radiance, UInt]:
        """Go on with the first wavelength alone where the index depends on it, at the weight of all.

        The wavelengths of a sample are shifted copies of one number, so that the first is distributed as each of them
        is: in its place it stands for all (PBRT4, sec. 4.5.4; Wilkie2014 calls it the hero).
        """
        mi, count = self.mi, dr.size_v(throughput)
        hero = mi.Spectrum(0)
        hero[0] = throughput[0] * dr.select(alone == 0, count, 1)
        return dr.select(here, hero, throughput), dr.select(here, mi.UInt32(1), alone)

    def scatter(
        self,
        path: PathState,
        key: UInt,
        dimension: UInt,
        si: SurfaceInteraction,
        bsdf: MitsubaBSDF,
        active: Mask,
        crossing: Crossing | None = None,
    ) -> tuple[Radiance, Float, BSDFSample, Radiance]:
        """Ask the BSDF, in one call, what it does with a light's direction, and for a direction of its own.

        crossing  the media on both sides of the surface, where they matter

        Returns (light gathered from the lights, solid angle of the light, BSDF sample, its weight).
        """
        mi, lights, context = self.mi, self.lights, self.context
        index = path.index
        lobe = self.choice(path, self.pair(key, index, dimension + CHOICE)[0])
        u = mi.Point2f(*self.direction_pair(key, index, dimension + LOBE))
        if not self.samples_lights or lights.count == 0:
            bs, weight = bsdf.sample(context, si, lobe, u, active)
            _, weight = self.attached(si, bsdf, bs.wo, mi.Spectrum(0), bs, weight, active)
            return mi.Spectrum(0), mi.Float(0), bs, weight
        pair = self.direction_pair if lights.has_environment else self.pair
        light = lights.sample(si, mi.Point2f(*pair(key, index, dimension + LIGHT)), active)
        toward = si.to_local(light.ds.d)
        if self.samples_lobes or self.follows_delta or self.aovs:
            value, pdf, bs, weight = bsdf.eval_pdf_sample(context, si, toward, lobe, u, active)
        else:
            value, pdf = bsdf.eval(context, si, toward, active), mi.Float(0)
            bs, weight = dr.zeros(mi.BSDFSample3f), mi.Spectrum(0)
        value, weight = self.attached(si, bsdf, toward, value, bs, weight, active)
        gathered = value * light.weight
        if self.samples_lobes:
            gathered *= dr.select(light.delta, 1, lights.mis_weight(light.ds.pdf, pdf))
        if crossing is not None:
            side = dr.select(si.wi.z * toward.z < 0.0, crossing.beyond, crossing.here)
            gathered *= self.media.transmitted(side, si, light.ds.dist) & crossing.surface
        visible = active & dr.any(gathered != 0)
        visible = self.unoccluded(si, light.target, visible)
        return dr.select(visible, gathered, 0), light.solid_angle, bs, weight

    def attached(
        self,
        si: SurfaceInteraction,
        bsdf: MitsubaBSDF,
        toward: Vector,
        value: Radiance,
        bs: BSDFSample,
        weight: Radiance,
        active: Mask,
    ) -> tuple[Radiance, Radiance]:
        """The BSDF's value toward a light and the weight of its sample, as they are; for who differentiates them."""
        return value, weight

    def ambient_light(self, light: Texture, bsdf: MitsubaBSDF, si: SurfaceInteraction, active: Mask) -> Radiance:
        """Ambient radiance times the BSDF's attribute "ambient" (0 where it has none)."""
        if self.mi.is_rgb:
            reflected = bsdf.eval_attribute_3("ambient", si, active)
        else:
            reflected = bsdf.eval_attribute("ambient", si, active)
        return dr.select(active, reflected * light.eval(si, active), 0)

    def roulette(
        self, path: PathState, key: UInt, dimension: UInt, depth: UInt, throughput: Radiance, eta: Float, active: Mask
    ) -> tuple[Radiance, Mask]:
        """End dim paths by chance: survive with SURVIVAL times the throughput's largest channel, at most .95.

        Inside glass radiance is scaled by eta^2, which the way out takes back: it does not make a path important.
        """
        survive = dr.clip(SURVIVAL * dr.max(dr.detach(throughput)) * dr.square(eta), 1e-6, 0.95)
        u, _ = sampler.independent_pair(key, path.index, dimension + ROULETTE)
        plays = depth + 1 >= ROULETTE_DEPTH
        active = active & (~plays | (u < survive))
        return dr.select(plays, throughput / survive, throughput), active
