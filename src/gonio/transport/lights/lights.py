"""The lights of a scene: their samplers, the selection of a light, and the MIS weights for BSDF sampling."""

from __future__ import annotations

from types import ModuleType
from typing import Protocol

import drjit as dr

from ...bridge.faults.black_environment import is_black_environment
from ...bridge.faults.shape_order import light_key
from ...bridge.types import Emitter, Float, Mask, Point, Radiance, Ray, Scene, SurfaceInteraction, UInt
from .. import fast
from ..fast.lamp_table import TabledLamps
from ..fast.light_grid import LightGrid
from ..fast.rectangle_light import RectangleLight
from ..surfaces import Surfaces
from .area_light import register as register
from .base import LightHit, LightSample, LightSampler
from .environment import VaryingEnvironment, environment
from .lamps import Lamps


class Choice(Protocol):
    """The interface of rules that select one of several lights for a sample at a point."""

    def choose(self, p: Point, u: Float) -> tuple[UInt, Float, Float]:
        """Select a light. Returns its index, `u` rescaled to [0, 1] for reuse, and the probability of the light."""
        ...

    def probability(self, p: Point, index: UInt, active: Mask) -> Float:
        """The probability with which `choose` selects this light."""
        ...


class Lights:
    """The lights of a scene, with the methods that integrators use.

    emitters  Mitsuba's emitters, in an order that does not change between runs; `index` is a position in this list
    samplers  samplers of the environment and of the lamps; the fastest suitable ones are used (`fast/`)
    lamps     sampler of all lights except the environment

    mis_compensation  whether BSDFs are sampled too, so that the density of an environment map can omit its uniform part
    """

    def __init__(self, mi: ModuleType, scene: Scene, surfaces: Surfaces | None = None, mis_compensation: bool = False):
        self.mi, self.scene = mi, scene
        self.surfaces = Surfaces(mi, scene) if surfaces is None else surfaces
        all_ = scene.emitters()
        lit = [index for index in range(len(all_)) if not is_black_environment(mi, all_[index])]
        order = sorted(lit, key=lambda index: light_key(all_[index]))
        self.emitters = [all_[index] for index in order]
        self.count = len(self.emitters)
        self.has_environment = scene.environment() is not None
        self.scene_indices = mi.UInt32(order) if self.count > 1 else None
        place = next((i for i in range(self.count) if self._is_environment(self.emitters[i])), -1)
        self.samplers: list[LightSampler] = []
        if place >= 0:
            self.samplers.append(environment(self.surfaces, self.emitters[place], mis_compensation))
        self.environment_index = place
        if self.count > 1:
            self._prepare_choice()
        self.lamps = self._lamps(order)
        if self.count - (place >= 0) > 0:
            self.samplers.append(self.lamps)

    def _is_environment(self, emitter: Emitter) -> bool:
        flags, kinds = emitter.flags(), self.mi.EmitterFlags
        return self.mi.has_flag(flags, kinds.Infinite) and not self.mi.has_flag(flags, kinds.DeltaDirection)

    def _prepare_choice(self) -> None:
        """Prepare the probabilities of the lights, and tables that are indexed by Dr.Jit's pointers to the lights."""
        mi = self.mi
        self.probability = self._probabilities()
        self.by_power = mi.DiscreteDistribution(self.probability)
        self.probability_of_pointer = self._of_pointer(self.probability)
        grid = LightGrid(mi, self.scene, self.emitters) if fast.enabled() else None
        self.choice: Choice = PowerChoice(self.by_power) if grid is None else grid
        self.index_of_pointer = self._of_pointer(dr.arange(mi.UInt32, self.count))

    def _lamps(self, order: list[int]) -> Lamps:
        """The fastest sampler that supports the lamps."""
        mi = self.mi
        parts = self.surfaces, self.emitters, self.scene_indices, self.environment_index
        if not fast.enabled() or not self.count:
            return Lamps(*parts)
        if self.count == 1 and (rectangle := RectangleLight.of(*parts)) is not None:
            return rectangle
        pointers = dr.gather(mi.EmitterPtr, self.scene.emitters_dr(), mi.UInt32(order))
        return TabledLamps.of(*parts, pointers, self.index_of_pointer if self.count > 1 else None) or Lamps(*parts)

    def _probabilities(self) -> Float:
        """The probabilities of the lights.

        One half of the probability is uniform. The other half is proportional to the mean unoccluded light at 256
        points in the bounding box of the scene. With n lights, the uniform half limits the weight of every light to
        2 n, because a dim lamp next to an object may be the most important one there.
        """
        mi = self.mi
        index = dr.arange(mi.UInt32, 256)
        it = dr.zeros(mi.SurfaceInteraction3f, 256)
        box = self.scene.bbox()
        if box.valid():
            # Multiples of 1/x, 1/x^2 and 1/x^3, modulo 1, where x^4 = x + 1, are evenly distributed and deterministic
            # (R3 sequence, M. Roberts).
            spread = mi.Point3f(*(fraction(mi.Float(index) * a) for a in (0.8191725, 0.6710436, 0.5497005)))
            low, extents = mi.Point3f(box.min), mi.Vector3f(box.extents())
            dr.make_opaque(low, extents)  # kernel data: literals would cause a new kernel for each scene size
            it.p = low + spread * extents
        if mi.is_spectral:
            it.wavelengths = type(it.wavelengths)(550)
        sample = mi.Point2f(fraction(mi.Float(index) * 0.7548777), fraction(mi.Float(index) * 0.5698403))
        flux = []
        for emitter in self.emitters:
            _, weight = emitter.sample_direction(it, sample, True)
            mean = float(dr.mean(dr.mean(weight, axis=0))[0])
            flux.append(mean if 0 <= mean < float("inf") else 0.0)
        total = sum(flux)
        fractions = [f / total if total > 0 else 1 / self.count for f in flux]
        return mi.Float([0.5 / self.count + 0.5 * fraction for fraction in fractions])

    def _of_pointer(self, values: Float) -> Float:
        """A table of one value per light, indexed by Dr.Jit's number of the emitter (the content of an EmitterPtr)."""
        mi = self.mi
        number = dr.reinterpret_array(mi.UInt32, self.scene.emitters_dr())
        table = dr.zeros(type(values), int(dr.max(number)[0]) + 1)
        dr.scatter(table, values, dr.gather(mi.UInt32, number, self.scene_indices))
        dr.eval(table)
        return table

    # ------------------------------------------------------------------ used by integrators

    def emitted(self, si: SurfaceInteraction, active: Mask) -> Radiance:
        """The radiance emitted along the ray by the surface at `si`, or by the environment if the ray left it."""
        radiance = self.mi.Spectrum(0)
        for sampler in self.samplers:
            owns = sampler.owns(si)
            radiance = dr.select(owns, sampler.emitted(si, active & owns), radiance)
        return radiance

    def sample(self, si: SurfaceInteraction, u: Point, active: Mask) -> LightSample:
        """Sample a direction toward a light with two random numbers `u` in [0, 1)^2.

        u.x selects the light; u.x, rescaled, and u.y select a point on it. If the light were selected with a separate
        number, each light would get a random subset of the points, which is not stratified.
        """
        mi = self.mi
        if self.count == 1:
            return self.samplers[0].sample(si, u, mi.UInt32(0), active)
        index, left, probability = self.choice.choose(si.p, u.x)
        u = mi.Point2f(left, u.y)
        if len(self.samplers) == 1:
            light = self.samplers[0].sample(si, u, index, active)
        else:
            lamp = index != self.environment_index
            near = self.lamps.sample(si, u, index, active & lamp)
            light = dr.select(lamp, near, self.samplers[0].sample(si, u, index, active & ~lamp))
        light.ds.pdf *= probability
        light.weight /= probability
        return light

    def pdf(self, origin: Point, solid_angle: Float, si: SurfaceInteraction, active: Mask) -> Float:
        """The density (1/sr) with which `sample` at `origin` would have generated the direction to the light at `si`.

        solid_angle  `LightSample.solid_angle` at this origin, so that it is not computed twice
        """
        mi = self.mi
        if self.count == 0:
            return mi.Float(0)
        hit = LightHit(mi, self.scene, origin, solid_angle, si)
        if self.count == 1:
            return self.samplers[0].pdf(hit, mi.UInt32(0), active)
        density = mi.Float(0)
        index = dr.gather(mi.UInt32, self.index_of_pointer, dr.reinterpret_array(mi.UInt32, hit.ds.emitter), active)
        for sampler in self.samplers:
            here = active & sampler.owns(si)
            density = dr.select(here, sampler.pdf(hit, index, here), density)
        return density * self.choice.probability(origin, index, active)

    def mis_weight(self, pdf: Float, other: Float) -> Float:
        """The MIS weight of a sample with density p = `pdf`, where the other strategy has the density q = `other`.

        The two strategies are light and BSDF sampling, with one sample each. The weight is that of the power heuristic,
        p^2 / (p^2 + q^2) (Veach1997). For a compensated environment map, it is that of the balance heuristic, p / (p +
        q), whose error is 5 to 10 % less in this case (Karlik2019).
        """
        ratio = other / pdf  # the ratio is computed first, because p^2 overflows for narrow lobes
        compensated = any(isinstance(sampler, VaryingEnvironment) for sampler in self.samplers)
        both = ratio + 1 if compensated else dr.fma(ratio, ratio, 1)
        return dr.select(pdf > 0, dr.rcp(both), 0)

    @property
    def shortens_last_ray(self) -> bool:
        """Whether `along` traces only a shadow ray, and only if the ray points at the light, but no nearest surface."""
        return isinstance(self.lamps, RectangleLight)

    def along(self, ray: Ray, solid_angle: Float, active: Mask) -> list[tuple[Radiance, Float]]:
        """The radiance along a ray, and its density as in `pdf`, in a list of pairs.

        There is one pair, or several if lights do not occlude each other, as in `foreground.py`. Surfaces that do not
        emit light contribute nothing.
        """
        if isinstance(self.lamps, RectangleLight):
            return [self.lamps.along(ray, solid_angle, active)]
        hit = self.surfaces.nearest(ray, active)
        si = self.surfaces.interaction(hit, ray, active)
        radiance = self.emitted(si, active)
        return [(radiance, self.pdf(ray.o, solid_angle, si, active & dr.any(radiance != 0)))]


class PowerChoice:
    """Selects lights with probabilities that do not depend on the point, see `Lights._probabilities`."""

    def __init__(self, by_power: Choice) -> None:
        self._by_power = by_power

    def choose(self, p: Point, u: Float) -> tuple[UInt, Float, Float]:
        index, left, probability = self._by_power.sample_reuse_pmf(u)  # type: ignore[attr-defined]
        return index, left, probability

    def probability(self, p: Point, index: UInt, active: Mask) -> Float:
        return self._by_power.eval_pmf_normalized(index, active)  # type: ignore[attr-defined]


def fraction(x: Float) -> Float:
    """The fractional part of x >= 0."""
    return x - dr.floor(x)
