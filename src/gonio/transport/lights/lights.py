"""Lights: the two-sided area light, and how the integrators choose a light and a point on it.

Two parts:

- `register(mi)`: the Mitsuba plugin `gonio_area`, a light that shines from both sides of any shape;
- `Lights`: what the integrators ask: a light sample, the light met by a ray, and the density of both.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from types import ModuleType
from typing import TypeVar

import drjit as dr
import numpy as np

from ...bridge import plugin_search
from ...bridge.types import (
    DirectionSample,
    Emitter,
    Float,
    Interaction,
    Mask,
    OfVariant,
    Plugin,
    Point,
    PositionSample,
    Properties,
    Radiance,
    Ray,
    Record,
    Scene,
    Shape,
    SurfaceInteraction,
    TraversalCallback,
    UInt,
)
from ...errors import InputError
from ..fast.lamps import Lamps, balls, direction_sample, has_known_sides, rectangle_of, toward
from ..fast.nearby import Nearby
from ..surfaces import Surfaces
from .sky import Sky
from .solid_angles import Ball, Rectangle, SphericalCap, SphericalRectangle, is_rectangle, is_sphere


def register(mi: ModuleType) -> None:
    """Make `gonio_area` known to the current variant of Mitsuba. Calling it again does nothing.

    The plugin nests as `emitter` in any shape:

        {"type": "rectangle", "emitter": {"type": "gonio_area", "radiance": {"type": "rgb", "value": [50, 50, 50]}}}

    radiance  emitted radiance, W/(m^2 sr), the same in every direction on **both** sides; rgb, spectrum or texture

    tag       any text. Mitsuba's loader merges Python plugins with equal properties, and then complains of one
              emitter on two shapes: two lamps of the same radiance need different tags, or `load_dict(...,
              optimize=False)`

    It is sampled by solid angle on rectangles and spheres, by area on others. Not for light tracing
    (`sample_ray` is not offered).
    """
    if mi.variant() in _registered:
        return
    _registered.add(mi.variant())

    base: Plugin = mi.Emitter

    class TwoSidedAreaLight(base):
        two_sided = True

        def __init__(self, properties: Properties):
            base.__init__(self, properties)
            if "radiance" not in properties:  # Mitsuba would follow a null pointer
                raise InputError("missing", "gonio_area.radiance", "give the radiance: a number, a colour or a texture")
            self.radiance = properties.get_emissive_texture("radiance")
            properties.get("tag", "")
            varying = mi.EmitterFlags.SpatiallyVarying if self.radiance.is_spatially_varying() else 0
            self.m_flags = mi.EmitterFlags.Surface | varying

        def eval(self, si: SurfaceInteraction, active: Mask = True) -> Radiance:
            return dr.select(active, self.radiance.eval(si, active), 0)

        def sample_direction(
            self, it: Interaction, sample: Point, active: Mask = True
        ) -> tuple[DirectionSample, Radiance]:
            shape = self.get_shape()
            if is_rectangle(mi, shape):
                ds = direction_sample(mi, SphericalRectangle(Rectangle.of(mi, shape), it.p), sample, it)
            elif is_sphere(mi, shape):  # not its own method: (u, v) there are the sample, and it shines on itself
                ds = direction_sample(mi, SphericalCap(mi, Ball.of(mi, shape), it.p), sample, it)
            else:  # not its own method: a mesh's never chooses a point whose normal looks away
                ds = _area_sample(mi, shape.sample_position(it.time, sample, active), it)
            active = mi.Bool(active) & (ds.pdf > 0)
            ds.emitter = mi.EmitterPtr(self)
            si = mi.SurfaceInteraction3f(ds, it.wavelengths)
            return ds, dr.select(active, self.radiance.eval(si, active) / ds.pdf, 0)

        def pdf_direction(self, it: Interaction, ds: DirectionSample, active: Mask = True) -> Float:
            shape = self.get_shape()
            cosine = dr.abs(dr.dot(ds.d, ds.n))
            if is_rectangle(mi, shape):
                pdf = SphericalRectangle(Rectangle.of(mi, shape), it.p).pdf(ds.dist, cosine)
            elif is_sphere(mi, shape):
                pdf = SphericalCap(mi, Ball.of(mi, shape), it.p).pdf(ds.dist, cosine)
            else:
                pdf = _per_steradian(area_density(shape, ds, active), ds)
            return dr.select(active & (cosine > 0), pdf, 0)

        def eval_direction(self, it: Interaction, ds: DirectionSample, active: Mask = True) -> Radiance:
            return self.radiance.eval(mi.SurfaceInteraction3f(ds, it.wavelengths), active)

        def bbox(self) -> Record:
            return self.get_shape().bbox()

        def traverse(self, callback: TraversalCallback) -> None:
            callback.put("radiance", self.radiance, mi.ParamFlags.Differentiable)

        def to_string(self) -> str:
            return f"TwoSidedAreaLight[radiance = {self.radiance}]"

    plugin_search.register(mi.register_emitter, "gonio_area", TwoSidedAreaLight)


_registered: set[str] = set()
Answer = TypeVar("Answer")


def _area_sample(mi: ModuleType, ps: PositionSample, it: Interaction) -> DirectionSample:
    """A Mitsuba direction sample from a point sampled by area: pdf per steradian = pdf per area * r^2 / |cos|."""
    ds = toward(mi, ps, it)
    ds.pdf = _per_steradian(ps.pdf, ds)
    return ds


def area_density(shape: Shape, ps: PositionSample, active: Mask) -> Float:
    """That of the points of a shape that it samples."""
    density: Float = shape.pdf_position(ps, active)
    return density


def _per_steradian(pdf: Float, ds: DirectionSample) -> Float:
    """A density by area as one by solid angle."""
    cosine = dr.abs(dr.dot(ds.d, ds.n))
    return dr.select(cosine > 0, pdf * dr.square(ds.dist) / cosine, 0)


class Lights:
    """The lights of a scene, as an integrator uses them.

    A scene lit by one rectangle, as most of the lab's are, takes a short way: no choice of light, no virtual call,
    solid-angle sampling whether the emitter is `gonio_area` or Mitsuba's one-sided `area`, and for a path's last
    ray a hit test of one rectangle. In other scenes rectangles and balls are sampled from tables (`Lamps`), and lights
    of other kinds (points, textures, ...) asked themselves; one of several is chosen by the light that it sends to
    where one is (`Nearby`), and for particles, which begin at lamps, by `probability`: half evenly, half by the light
    that it sends into the scene.

    beside_lobes  lobes are sampled too: an environment's own samples leave to them what they find (`Sky`)
    """

    def __init__(self, mi: ModuleType, scene: Scene, surfaces: Surfaces | None = None, beside_lobes: bool = False):
        self.mi, self.scene = mi, scene
        self.surfaces = Surfaces(mi, scene) if surfaces is None else surfaces
        found = scene.emitters()
        kept = [index for index in range(len(found)) if not _is_black(mi, found[index])]
        # Mitsuba merges the shapes of a file in an order of chance, and that of their lights must not follow it
        order = sorted(kept, key=lambda index: _order(found[index]))
        self.emitters = [found[index] for index in order]
        self.count = len(self.emitters)
        self.rectangle: Rectangle | None = None
        self.has_environment = scene.environment() is not None
        if self.count == 1 and has_known_sides(self.emitters[0]):
            self.rectangle = rectangle_of(mi, self.emitters[0].get_shape())
            dr.make_opaque(self.rectangle)
        shape = self.emitters[0].get_shape() if self.count == 1 else None
        # Data, too: where another scene is alive, this one's shapes have other numbers.
        self.shape = None if shape is None else dr.reinterpret_array(mi.UInt32, mi.ShapePtr(shape))
        dr.make_opaque(self.shape)
        # the environment's place among the emitters, -1 where there is none
        self.around = next((i for i in range(self.count) if self._is_environment(self.emitters[i])), -1)
        self.sky = self._sky(beside_lobes)
        if self.count > 1:
            self.probability = self._probabilities()
            self.choice = mi.DiscreteDistribution(self.probability)
            self.place = mi.UInt32(order)  # of each of `emitters` among the scene's
            self.by_pointer = self._by_pointer(self.probability)
            self.nearby = Nearby(mi, scene, self.emitters)
            self.number = self._by_pointer(dr.arange(mi.UInt32, self.count))
        pointers = dr.gather(mi.EmitterPtr, scene.emitters_dr(), mi.UInt32(order)) if self.count else None
        self.lamps = Lamps(mi, self.emitters if self.rectangle is None else [], pointers)
        unknown = [i for i, known in enumerate(self.lamps.known) if not known and i != self.around]
        self.asks = bool(unknown)  # whether there are lights that are to be asked, and of those, any that rays meet
        self.asks_met = any(self.emitters[i].get_shape() is not None for i in unknown) or self.lamps.radiance is None
        by_area = [_by_area(mi, emitter) for emitter in self.emitters]
        self.by_area = mi.Bool(by_area) if any(by_area) else None
        dr.make_opaque(self.by_area)

    def _sky(self, beside_lobes: bool) -> Sky | None:
        """The environment's density, where it is one that varies."""
        if self.around < 0 or "data" not in dict(self.mi.traverse(self.emitters[self.around])):
            return None
        sky = Sky(self.mi, self.scene, self.emitters[self.around], beside_lobes)
        return sky if sky.known else None

    def _is_environment(self, emitter: Emitter) -> bool:
        flags, kinds = emitter.flags(), self.mi.EmitterFlags
        return self.mi.has_flag(flags, kinds.Infinite) and not self.mi.has_flag(flags, kinds.DeltaDirection)

    def _probabilities(self) -> Float:
        """Half uniform, half by the mean unoccluded light at 256 points spread in the scene's bounding box.

        The uniform half keeps every light's weight below 2 n: a dim lamp beside an object may matter most there.
        """
        mi = self.mi
        index = dr.arange(mi.UInt32, 256)
        it = dr.zeros(mi.SurfaceInteraction3f, 256)
        box = self.scene.bbox()
        if box.valid():
            # Multiples of the plastic number's kin mod 1 (R3 sequence, M. Roberts): even, and the same every time.
            spread = mi.Point3f(*(fraction(mi.Float(index) * a) for a in (0.8191725, 0.6710436, 0.5497005)))
            low, extents = mi.Point3f(box.min), mi.Vector3f(box.extents())
            dr.make_opaque(low, extents)  # data: as literals they would make a kernel for every size of scene
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
        share = [f / total if total > 0 else 1 / self.count for f in flux]
        return mi.Float([0.5 / self.count + 0.5 * s for s in share])

    def _by_pointer(self, values: Float) -> Float:
        """A value of each of `emitters`, indexed by Dr.Jit's number of the emitter (what an EmitterPtr holds)."""
        mi = self.mi
        number = dr.reinterpret_array(mi.UInt32, self.scene.emitters_dr())
        table = dr.zeros(type(values), int(dr.max(number)[0]) + 1)
        dr.scatter(table, values, dr.gather(mi.UInt32, number, self.place))
        dr.eval(table)
        return table

    def emitted(self, si: SurfaceInteraction, active: Mask) -> Radiance:
        """Radiance that the surface (or, where the ray left the scene, the environment) at `si` sends along the ray."""
        mi, sent = self.mi, self.mi.Spectrum(0)
        if self.count == 0:
            return sent
        # Calls from the kernel take a tenth of a render under a sky: a light that is alone is asked by itself.
        if self.around >= 0:
            beyond = ~si.is_valid()
            sent = dr.select(beyond, self.emitters[self.around].eval(si, active & beyond), 0)
        met = active & si.is_valid()
        if self.count == 1:
            if self.shape is None:
                return sent
            here = met & (dr.reinterpret_array(mi.UInt32, si.shape) == self.shape)
            return dr.select(here, self.emitters[0].eval(si, here), 0)
        emitter = si.emitter(self.scene, met)
        if self.asks_met:
            return dr.select(met, emitter.eval(si, met), sent)
        number = dr.reinterpret_array(mi.UInt32, emitter)
        here = met & (number > 0)
        index = dr.gather(mi.UInt32, self.number, number, here)
        row = self.lamps.row(index, here)
        return dr.select(here, self.lamps.sent(row, index, si.n, si.to_world(si.wi), here), sent)

    def sample(self, si: SurfaceInteraction, u: Point, active: Mask) -> LightSample:
        """A direction toward a light: `u` in [0, 1)^2 chooses the light by its x, and by what is left a point on it.

        Chosen by a number of its own, a light would get any of the points of all: as uneven as chance.
        """
        mi = self.mi
        if self.rectangle is not None:
            seen = SphericalRectangle(self.rectangle, si.p)
            ds = direction_sample(mi, seen, u, si)
            light = self._ended(si, ds, self._sent(self.emitters[0], ds, si, active) / ds.pdf)
            light.solid_angle = dr.select(seen.uniform, seen.solid_angle, 0)
            return light
        if self.count == 1:
            if self.around == 0:
                return self._toward_environment(si, u, active)
            return self._toward_lamp(self.emitters[0], mi.UInt32(0), si, u, active)
        index, left, probability = self.nearby.choose(si.p, u.x)
        u = mi.Point2f(left, u.y)
        place = dr.gather(mi.UInt32, self.place, index, active)
        emitter = dr.gather(mi.EmitterPtr, self.scene.emitters_dr(), place, active)
        if self.around < 0:
            light = self._toward_lamp(emitter, index, si, u, active)
        else:
            lamp = index != self.around
            if self.count == 2:  # one that is alone is asked by itself
                emitter = self.emitters[1 - self.around]
            near = self._toward_lamp(emitter, index, si, u, active & lamp)
            light = dr.select(lamp, near, self._toward_environment(si, u, active & ~lamp))
        light.ds.pdf *= probability
        light.weight /= probability
        return light

    def _toward_lamp(
        self, emitter: Emitter, index: UInt, si: SurfaceInteraction, u: Point, active: Mask
    ) -> LightSample:
        """The sample of a light that is no environment."""
        lamps = self.lamps
        row = lamps.row(index, active)
        known = active & lamps.is_known(row)
        asked = not lamps.kinds or self.asks
        if asked:
            found = self._ended(si, *self._asked(emitter, index, si, u, active & ~known))
        if not lamps.kinds:
            return found
        ds = lamps.sample(row, si, u)
        sent = self._sent(emitter, ds, si, known)
        if lamps.radiance is not None:
            sent = lamps.sent(row, index, ds.n, -ds.d, known)
        light = self._ended(si, ds, dr.select(ds.pdf > 0, sent / ds.pdf, 0))
        return dr.select(known, light, found) if asked else light

    def _asked(
        self, emitter: Emitter, index: UInt, si: SurfaceInteraction, u: Point, active: Mask
    ) -> tuple[DirectionSample, Radiance]:
        """What a light itself samples; where that goes wrong, a point on its area."""
        if self.by_area is None:
            own: tuple[DirectionSample, Radiance] = emitter.sample_direction(si, u, active)
            return own
        here = dr.gather(self.mi.Bool, self.by_area, index, active)
        ds, weight = emitter.sample_direction(si, u, active & ~here)
        near = _area_sample(self.mi, self.on_area(emitter, index, u, here), si)
        near.emitter = ds.emitter = emitter
        sent = self._sent(emitter, near, si, here)
        return dr.select(here, near, ds), dr.select(here & (near.pdf > 0), sent / near.pdf, weight & ~here)

    def on_area(self, emitter: Emitter, index: UInt, u: Point, active: Mask) -> PositionSample:
        """A point of a lamp, even on its area."""
        mi = self.mi
        nothing: PositionSample = dr.zeros(mi.PositionSample3f)
        ps = self.of_shape(emitter, index, lambda shape, *args: shape.sample_position(0.0, *args), nothing, u, active)
        if self.balls is not None:  # of a sphere that is turned, Mitsuba 3.9 has the normal of one that is not
            ball = dr.gather(mi.Vector4f, self.balls, index, active)
            ps.n = dr.select(ball.w != 0.0, mi.Normal3f((ps.p - mi.Point3f(ball.xyz)) / ball.w), ps.n)
        return ps

    def of_shape(
        self, emitter: Emitter, index: UInt, ask: Callable[..., Answer], nothing: Answer, *args: OfVariant
    ) -> Answer:
        """`ask(shape, *args)` of a lamp's shape; `nothing` of a lamp that has none."""
        if self.count == 1 or not self.instances:
            return ask(self.emitters[0].get_shape() if self.count == 1 else emitter.get_shape(), *args)

        # An instance, which a call from the kernel would ask too, has no area.
        def answer(shape: Shape | None) -> Callable[..., Answer]:
            return lambda *args: nothing if shape is None else ask(shape, *args)

        found: Answer = dr.switch(index, [answer(one.get_shape()) for one in self.emitters], *args)
        return found

    @cached_property
    def instances(self) -> bool:
        return any(shape.class_name() == "Instance" for shape in self.scene.shapes())

    @cached_property
    def balls(self) -> Float | None:
        return balls(self.mi, self.emitters)

    def _sent(self, emitter: Emitter, ds: DirectionSample, si: SurfaceInteraction, active: Mask) -> Radiance:
        """What a lamp sends to `si` from a place on it."""
        at_light = self.mi.SurfaceInteraction3f(ds, si.wavelengths)
        at_light.wi = at_light.to_local(-ds.d)
        return emitter.eval(at_light, active)

    def _ended(self, si: SurfaceInteraction, ds: DirectionSample, weight: Radiance) -> LightSample:
        """A light's sample, with the end of its shadow ray as far off the lamp's surface as it begins off `si`'s.

        From a ray that ended on it, a round lamp would hide its own limb. Nothing comes from closer, where all is
        rounding.
        """
        mi = self.mi
        off = self.off(si.p, ds.p)
        normal = dr.select(dr.any(ds.n != 0), ds.n, -ds.d)  # a point has none
        target = mi.Point3f(ds.p - normal * dr.mulsign(off, dr.dot(normal, ds.d)))
        weight = dr.select(ds.delta | (ds.dist > off), weight, 0)
        return LightSample(ds, target, weight, mi.Bool(ds.delta), mi.Float(0))

    def off(self, p: Point, q: Point) -> Float:
        """How far off surfaces a ray between two points begins and ends."""
        reach = dr.maximum(dr.max(dr.abs(p)), dr.max(dr.abs(q)))
        return self.mi.math.RayEpsilon * (1 + reach)

    def _toward_environment(self, si: SurfaceInteraction, u: Point, active: Mask) -> LightSample:
        if self.sky is not None:
            return self._toward_sky(self.sky, si, u, active)
        return self._ended(si, *self.emitters[self.around].sample_direction(si, u, active))

    def _toward_sky(self, sky: Sky, si: SurfaceInteraction, u: Point, active: Mask) -> LightSample:
        mi = self.mi
        ds = dr.zeros(mi.DirectionSample3f, dr.width(si.p))
        ds.d, ds.p, ds.pdf, radiance = sky.sample(si, u, active)
        ds.dist, ds.n, ds.time, ds.delta = dr.norm(ds.p - si.p), mi.Normal3f(-ds.d), si.time, mi.Bool(False)
        return LightSample(ds, ds.p, dr.select(ds.pdf > 0, radiance / ds.pdf, 0), mi.Bool(False), mi.Float(0))

    def pdf(self, origin: Point, solid_angle: Float, si: SurfaceInteraction, active: Mask) -> Float:
        """Density with which `sample`, asked at `origin`, would have chosen the direction in which light `si` was met.

        solid_angle  `LightSample.solid_angle` at that origin, so that it is not computed twice
        """
        mi = self.mi
        if self.count == 0:
            return mi.Float(0)
        if self.rectangle is not None:
            away = si.p - origin
            distance = dr.norm(away)
            return self.rectangle.pdf(solid_angle, distance, dr.abs(dr.dot(away, si.n)) / distance)
        it = dr.zeros(mi.SurfaceInteraction3f)
        it.p = origin
        ds = mi.DirectionSample3f(self.scene, si, it)
        density = mi.Float(0)
        if self.around >= 0:
            density = self._density_around(it, ds, active)
        if self.count == 1:
            return density if self.around >= 0 else self._density(self.emitters[0], mi.UInt32(0), it, ds, active)
        number = dr.reinterpret_array(mi.UInt32, ds.emitter)
        index = dr.gather(mi.UInt32, self.number, number, active)
        lamp = active & si.is_valid()  # the environment is what no surface is before
        density = dr.select(lamp, self._density(ds.emitter, index, it, ds, lamp), density)
        return density * self.nearby.probability(origin, index, active)

    def _density_around(self, it: Interaction, ds: DirectionSample, active: Mask) -> Float:
        """Density (1/sr) with which `_toward_environment` chooses a direction."""
        if self.sky is not None:
            return self.sky.pdf(ds.d)
        return self.emitters[self.around].pdf_direction(it, ds, active)

    def _density(self, emitter: Emitter, index: UInt, it: Interaction, ds: DirectionSample, active: Mask) -> Float:
        """Density (1/sr) with which `_toward_lamp` chooses a direction."""
        lamps = self.lamps
        row = lamps.row(index, active)
        known = active & lamps.is_known(row)
        density = self.mi.Float(0)
        if self.asks:
            asked = active & ~known
            here = self.mi.Bool(False) if self.by_area is None else dr.gather(self.mi.Bool, self.by_area, index, asked)
            density = emitter.pdf_direction(it, ds, asked & ~here)
            if self.by_area is not None:
                area = self.of_shape(emitter, index, area_density, self.mi.Float(0), ds, here)
                density = dr.select(here, _per_steradian(area, ds), density)
        if not lamps.kinds:
            return density
        return dr.select(known, lamps.pdf(row, it.p, ds.dist, dr.abs(dr.dot(ds.d, ds.n))), density)

    def share(self, pdf: Float, other: Float) -> Float:
        """What one of two strategies of a sample each is weighed by, of densities `pdf` and `other`, lights and lobes.

        The power heuristic, p^2 / (p^2 + q^2) (Veach 1995), where a density follows its light; p / (p + q) beside a sky
        that has been left what lobes find, for which that is the better one (Karlik2019), by 5 to 10 %.
        """
        ratio = other / pdf  # first the ratio: p^2 itself overflows for sharp lobes
        both = dr.fma(ratio, ratio, 1) if self.sky is None else ratio + 1
        return dr.select(pdf > 0, dr.rcp(both), 0)

    def last_hit(
        self, ray: Ray, solid_angle: Float, active: Mask, weigh: Callable[[Radiance, Float], Radiance]
    ) -> Radiance:
        """What a path's last ray adds: the radiance that arrives along it, `weigh`ed with its density as in `pdf`.

        All that this ray can still find is a light; with one rectangle the ray is traced only where it points at it.
        """
        mi = self.mi
        if self.rectangle is None:
            hit = self.surfaces.nearest(ray, active)
            si = self.surfaces.interaction(hit, ray, active)
            radiance = self.emitted(si, active)
            return weigh(radiance, self.pdf(ray.o, solid_angle, si, active & dr.any(radiance != 0)))
        distance, uv, hit = self.rectangle.hit(ray.o, ray.d)
        active = active & hit & (distance < ray.maxt)
        ds = dr.zeros(mi.DirectionSample3f)
        ds.n, ds.d, ds.uv = mi.Normal3f(self.rectangle.normal), ray.d, mi.Point2f(*uv)
        at_light = mi.SurfaceInteraction3f(ds, ray.wavelengths)
        at_light.wi = at_light.to_local(-ray.d)
        radiance = self.emitters[0].eval(at_light, active)
        shadow = mi.Ray3f(ray)
        shadow.maxt = distance - self.off(ray.o, ray(distance))
        active &= dr.any(radiance != 0)
        active &= ~self.surfaces.blocked(shadow, active)
        pdf = self.rectangle.pdf(solid_angle, distance, dr.abs(dr.dot(ray.d, self.rectangle.normal)))
        return weigh(dr.select(active, radiance, 0), pdf)


def _is_black(mi: ModuleType, emitter: Emitter) -> bool:
    """Whether an environment is black all over: a density of Mitsuba's is then 0 / 0."""
    if not mi.has_flag(emitter.flags(), mi.EmitterFlags.Infinite):
        return False
    pixels = dict(mi.traverse(emitter)).get("data")
    if pixels is None:
        return False
    if mi.is_spectral:  # three numbers tell a texel's colour, black too, and the last one how bright it is
        return not np.any(np.asarray(pixels)[..., 3])
    return not dr.any(pixels.array != 0)


def _by_area(mi: ModuleType, emitter: Emitter) -> bool:
    """Whether a light's own samples are wrong: Mitsuba's `area` with a texture looks for places by their uv, which
    triangles of a mesh may share (a cube is 18 % too dark), on round shapes that are turned it mistakes the normal (a
    cylinder's are up to 21 % too dark), and on shapes turned inside out the side."""
    shape = emitter.get_shape()
    varies = mi.has_flag(emitter.flags(), mi.EmitterFlags.SpatiallyVarying)
    own = emitter.class_name() == "AreaLight" and shape is not None and varies
    return own and (shape.class_name() not in ("Rectangle", "Disk") or shape.has_flipped_normals())


def _order(emitter: Emitter) -> tuple[str, list[float]]:
    """What lights are sorted by: nothing that changes between two runs."""
    shape = emitter.get_shape()
    box = [] if shape is None else [float(x) for x in (*shape.bbox().min, *shape.bbox().max)]
    return str(emitter), box


@dataclass
class LightSample:
    """A direction sample `ds`, the point `target` up to which nothing may stand in its way, radiance over pdf `weight`,
    whether the light is a point (no BSDF sample can meet it), and the solid angle of a rectangle sampled uniformly in
    it (0 where it was not)."""

    ds: DirectionSample
    target: Point
    weight: Radiance
    delta: Mask
    solid_angle: Float


def fraction(x: Float) -> Float:
    """The part of x >= 0 behind the point."""
    return x - dr.floor(x)
