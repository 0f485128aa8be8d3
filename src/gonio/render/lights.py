"""Lights: the two-sided area light, and how the integrators choose a light and a point on it.

Three parts:

- `SphericalRectangle`: uniform sampling of the solid angle of a rectangle (Urena2013), the least noisy cheap way
  to sample the lab's lights;
- `register(mi)`: the Mitsuba plugin `gonio_area`, a light that shines from both sides of any shape;
- `Lights`: what the integrators ask: a light sample, the light met by a ray, and the density of both.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType

import drjit as dr

from ..errors import InputError
from .nearby import Nearby
from .sky import Sky
from .surfaces import Surfaces
from .types import (
    DirectionSample,
    Emitter,
    Float,
    Interaction,
    Mask,
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
    Vector,
)

# Outside these solid angles (steradian) the area is sampled instead. Below: angles near pi in float32 carry
# 2.4e-7, so at 1e-3 sr the sampled position is still good to 2.4e-4 of an edge, and light so far away gains nothing
# from the solid angle. Above: the point lies all but in the rectangle (2 pi = 6.283), where 1/z0 loses its digits.
SMALLEST_SOLID_ANGLE, LARGEST_SOLID_ANGLE = 1e-3, 6.22


@dataclass
class Rectangle:
    """A rectangle in space: corner, two perpendicular unit axes, their lengths, the normal axis0 x axis1."""

    corner: Point
    axis0: Vector
    axis1: Vector
    length0: Float
    length1: Float

    @staticmethod
    def of(mi: ModuleType, shape: Shape) -> Rectangle:
        """The rectangle of a Mitsuba `rectangle` shape as the kernel sees it, so that moving it recompiles nothing."""
        zero, one = mi.Float(0), mi.Float(1)
        corner = shape.sample_position(zero, mi.Point2f(zero, zero)).p
        edge0 = shape.sample_position(zero, mi.Point2f(one, zero)).p - corner
        edge1 = shape.sample_position(zero, mi.Point2f(zero, one)).p - corner
        length0, length1 = dr.norm(edge0), dr.norm(edge1)
        return Rectangle(corner, edge0 / length0, edge1 / length1, length0, length1)

    @property
    def normal(self) -> Vector:
        return dr.cross(self.axis0, self.axis1)

    @property
    def area(self) -> Float:
        return self.length0 * self.length1

    def pdf(self, solid_angle: Float, distance: Float, cosine: Float) -> Float:
        """Density (1/sr) toward a point seen at `distance` under |cosine|: uniform in the solid angle where one is
        given, uniform on the area where it is 0."""
        by_area = dr.square(distance) * dr.rcp(dr.maximum(cosine * self.area, 1e-30))  # grazing: large, never inf
        return dr.select(solid_angle > 0, dr.rcp(solid_angle), by_area)

    def hit(self, origin: Point, direction: Vector) -> tuple[Float, tuple[Float, Float], Mask]:
        """Where a ray meets the rectangle: (distance, (u, v) in [0, 1]^2, whether it does)."""
        normal = self.normal
        distance = dr.dot(self.corner - origin, normal) / dr.dot(direction, normal)
        offset = dr.fma(direction, distance, origin) - self.corner
        u, v = dr.dot(offset, self.axis0) / self.length0, dr.dot(offset, self.axis1) / self.length1
        return distance, (u, v), (distance > 0) & (dr.minimum(u, v) >= 0) & (dr.maximum(u, v) <= 1)


class SphericalRectangle:
    """A rectangle seen from a point: its solid angle, and directions uniform in it.

    Urena2013, sec. 3: in the frame of the rectangle, with the point at the origin and the rectangle at z0 < 0, the
    u-coordinate is found by inverting the solid angle of a sub-rectangle, the v-coordinate by inverting the height
    on the sphere. Where the solid angle is too small or too large for float32 the area is sampled instead.

    `solid_angle` is exact for small ones too: twice the sum of the two triangles' (Van Oosterom and Strackee 1983),
    whose numerator is a product and cancels nothing, unlike the sum of four angles less 2 pi.
    """

    def __init__(self, rectangle: Rectangle, origin: Point):
        self.rectangle, self.origin = rectangle, origin
        offset = rectangle.corner - origin
        self.x0, self.y0 = dr.dot(offset, rectangle.axis0), dr.dot(offset, rectangle.axis1)
        self.x1, self.y1 = self.x0 + rectangle.length0, self.y0 + rectangle.length1
        self.z0 = -dr.abs(dr.dot(offset, rectangle.normal))
        zz = dr.square(self.z0)
        xx0, xx1, yy0, yy1 = dr.square(self.x0), dr.square(self.x1), dr.square(self.y0), dr.square(self.y1)
        # z components of the normals of the planes through the origin and an edge: v = y0, y1 and u = x0.
        self.n0 = -self.y0 * dr.rsqrt(yy0 + zz)
        self.n2 = self.y1 * dr.rsqrt(yy1 + zz)
        n3 = -self.x0 * dr.rsqrt(xx0 + zz)
        self.k = 2 * dr.pi - dr.acos(-self.n2 * n3) - dr.acos(-n3 * self.n0)
        self.solid_angle = self._solid_angle(zz, xx0, xx1, yy0, yy1)
        self.uniform = (self.solid_angle > SMALLEST_SOLID_ANGLE) & (self.solid_angle < LARGEST_SOLID_ANGLE)

    def _solid_angle(self, zz: Float, xx0: Float, xx1: Float, yy0: Float, yy1: Float) -> Float:
        r00, r10 = dr.sqrt(xx0 + yy0 + zz), dr.sqrt(xx1 + yy0 + zz)
        r01, r11 = dr.sqrt(xx0 + yy1 + zz), dr.sqrt(xx1 + yy1 + zz)
        volume = -self.z0 * self.rectangle.area
        # dot products of corner vectors: along an edge, and across the diagonal 10-01 that both triangles share
        across = self.x0 * self.x1 + self.y0 * self.y1 + zz
        along_x0, along_x1 = self.x0 * self.x1 + yy0 + zz, self.x0 * self.x1 + yy1 + zz
        along_y0, along_y1 = xx0 + self.y0 * self.y1 + zz, xx1 + self.y0 * self.y1 + zz
        lower = r00 * r10 * r01 + along_x0 * r01 + along_y0 * r10 + across * r00
        upper = r11 * r10 * r01 + along_x1 * r10 + along_y1 * r01 + across * r11
        # The two half angles a and b add as complex numbers, (lower + i volume)(upper + i volume): one atan2, not two.
        # Each half angle is below pi/2 in sum with the other <= pi, so the sum stays inside atan2's branch.
        return 2 * dr.atan2(volume * (lower + upper), lower * upper - dr.square(volume))

    def pdf(self, distance: Float, cosine: Float) -> Float:
        """Density (1/sr) of `sample` toward a point of the rectangle at `distance`, seen under |cosine| on it."""
        return self.rectangle.pdf(dr.select(self.uniform, self.solid_angle, 0), distance, cosine)

    def sample(self, u: Float, v: Float) -> tuple[Point, tuple[Float, Float], Float]:
        """A point of the rectangle from two numbers in [0, 1): (point, (u, v) on it in [0, 1]^2, pdf in 1/sr)."""
        sine, cosine = dr.sincos(dr.fma(u, self.solid_angle, self.k))
        fu = (cosine * self.n0 - self.n2) / sine
        cu = dr.clip(dr.copysign(dr.rsqrt(dr.square(fu) + dr.square(self.n0)), fu), -1, 1)
        x = -(cu * self.z0) * dr.rsqrt(dr.maximum(1 - dr.square(cu), 1e-12))
        x = dr.clip(x, self.x0, self.x1)
        dd = dr.square(x) + dr.square(self.z0)
        h0 = self.y0 * dr.rsqrt(dd + dr.square(self.y0))
        h1 = self.y1 * dr.rsqrt(dd + dr.square(self.y1))
        h = dr.fma(v, h1 - h0, h0)
        y = dr.clip(h * dr.sqrt(dd) * dr.rsqrt(dr.maximum(1 - dr.square(h), 1e-12)), self.y0, self.y1)
        x = dr.select(self.uniform, x, dr.fma(u, self.rectangle.length0, self.x0))
        y = dr.select(self.uniform, y, dr.fma(v, self.rectangle.length1, self.y0))
        x, y = x - self.x0, y - self.y0
        point = self.rectangle.corner + self.rectangle.axis0 * x + self.rectangle.axis1 * y
        away = point - self.origin
        distance = dr.norm(away)
        cosine = dr.abs(self.z0) / distance
        return point, (x / self.rectangle.length0, y / self.rectangle.length1), self.pdf(distance, cosine)


def is_sphere(mi: ModuleType, shape: Shape) -> bool:
    return bool(shape.shape_type() == mi.ShapeType.Sphere.value)


def is_rectangle(mi: ModuleType, shape: Shape) -> bool:
    """Whether a shape is a `rectangle` whose edges are perpendicular (a sheared one is not)."""
    if shape is None or shape.shape_type() != mi.ShapeType.Rectangle.value:
        return False
    rectangle = Rectangle.of(mi, shape)
    # 1e-4: the lean of edges that float32 transforms of a true rectangle stay far below; it bounds the error.
    return abs(float(dr.dot(rectangle.axis0, rectangle.axis1)[0])) < 1e-4


def register(mi: ModuleType) -> None:
    """Make `gonio_area` known to the current variant of Mitsuba. Calling it again does nothing.

    The plugin nests as `emitter` in any shape:

        {"type": "rectangle", "emitter": {"type": "gonio_area", "radiance": {"type": "rgb", "value": [50, 50, 50]}}}

    radiance  emitted radiance, W/(m^2 sr), the same in every direction on **both** sides; rgb, spectrum or texture

    tag       any text. Mitsuba's loader merges Python plugins with equal properties, and then complains of one
              emitter on two shapes: two lamps of the same radiance need different tags, or `load_dict(...,
              optimize=False)`

    It is sampled by solid angle on rectangles, by the shape's own method on others. Not for light tracing
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
            self.m_flags = mi.EmitterFlags.Surface

        def eval(self, si: SurfaceInteraction, active: Mask = True) -> Radiance:
            return dr.select(active, self.radiance.eval(si, active), 0)

        def sample_direction(
            self, it: Interaction, sample: Point, active: Mask = True
        ) -> tuple[DirectionSample, Radiance]:
            shape = self.get_shape()
            if is_rectangle(mi, shape):
                ds = _rectangle_sample(mi, SphericalRectangle(Rectangle.of(mi, shape), it.p), sample, it)
            elif is_sphere(mi, shape):  # samples the visible cap
                ds = shape.sample_direction(it, sample, active)
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
                pdf = shape.pdf_direction(it, ds, active)
            else:
                pdf = shape.pdf_position(ds, active) * dr.square(ds.dist) / cosine
            return dr.select(active & (cosine > 0), pdf, 0)

        def eval_direction(self, it: Interaction, ds: DirectionSample, active: Mask = True) -> Radiance:
            return self.radiance.eval(mi.SurfaceInteraction3f(ds, it.wavelengths), active)

        def bbox(self) -> Record:
            return self.get_shape().bbox()

        def traverse(self, callback: TraversalCallback) -> None:
            callback.put("radiance", self.radiance, mi.ParamFlags.Differentiable)

        def to_string(self) -> str:
            return f"TwoSidedAreaLight[radiance = {self.radiance}]"

    mi.register_emitter("gonio_area", TwoSidedAreaLight)


_registered: set[str] = set()


def _rectangle_sample(mi: ModuleType, seen: SphericalRectangle, sample: Point, it: Interaction) -> DirectionSample:
    """A Mitsuba direction sample from a spherical rectangle."""
    point, uv, pdf = seen.sample(sample.x, sample.y)
    ps = dr.zeros(mi.PositionSample3f, dr.width(point))
    ps.p, ps.n, ps.uv, ps.time = point, mi.Normal3f(seen.rectangle.normal), mi.Point2f(*uv), it.time
    ds = _toward(mi, ps, it)
    ds.pdf = pdf
    return ds


def _area_sample(mi: ModuleType, ps: PositionSample, it: Interaction) -> DirectionSample:
    """A Mitsuba direction sample from a point sampled by area: pdf per steradian = pdf per area * r^2 / |cos|."""
    ds = _toward(mi, ps, it)
    cosine = dr.abs(dr.dot(ds.d, ds.n))
    ds.pdf = dr.select(cosine > 0, ps.pdf * dr.square(ds.dist) / cosine, 0)
    return ds


def _toward(mi: ModuleType, ps: PositionSample, it: Interaction) -> DirectionSample:
    ds = mi.DirectionSample3f(ps)
    away = ps.p - it.p
    ds.dist = dr.norm(away)
    ds.d = away / ds.dist
    ds.delta = mi.Bool(False)
    return ds


class Lights:
    """The lights of a scene, as an integrator uses them.

    A scene lit by one rectangle, as most of the lab's are, takes a short way: no choice of light, no virtual call,
    solid-angle sampling whether the emitter is `gonio_area` or Mitsuba's one-sided `area`, and for a path's last
    ray a hit test of one rectangle. Every other scene asks the emitters themselves (point, environment, ...); one of
    several is chosen by the light that it sends to where one is (`Nearby`), and for particles, which begin at lamps, by
    `probability`: half evenly, half by the light that it sends into the scene.

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
        if self.count == 1 and self._is_rectangle_light(self.emitters[0]):
            self.rectangle = Rectangle.of(mi, self.emitters[0].get_shape())
            dr.make_opaque(self.rectangle)
        self.sky, self.sky_place = self._sky(beside_lobes)
        if self.count > 1:
            self.probability = self._probabilities()
            self.choice = mi.DiscreteDistribution(self.probability)
            self.place = mi.UInt32(order)  # of each of `emitters` among the scene's
            self.by_pointer = self._by_pointer(self.probability)
            self.nearby = Nearby(mi, scene, self.emitters)
            self.number = self._by_pointer(dr.arange(mi.UInt32, self.count))

    def _sky(self, beside_lobes: bool) -> tuple[Sky | None, int]:
        """The environment's density, where it is one that varies, and its place among the emitters."""
        for place, emitter in enumerate(self.emitters):
            if "data" in dict(self.mi.traverse(emitter)) and self.mi.has_flag(
                emitter.flags(), self.mi.EmitterFlags.Infinite
            ):
                sky = Sky(self.mi, self.scene, emitter, beside_lobes)
                return (sky, place) if sky.known else (None, -1)
        return None, -1

    def _is_rectangle_light(self, emitter: Emitter) -> bool:
        known = getattr(emitter, "two_sided", False) or emitter.class_name() == "AreaLight"
        return known and is_rectangle(self.mi, emitter.get_shape())

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
        if self.count == 0:
            return dr.zeros(self.mi.Spectrum)
        return si.emitter(self.scene).eval(si, active)

    def sample(self, si: SurfaceInteraction, u: Point, active: Mask) -> LightSample:
        """A direction toward a light: `u` in [0, 1)^2 chooses the light by its x, and by what is left a point on it.

        Chosen by a number of its own, a light would get any of the points of all: as uneven as chance.
        """
        mi = self.mi
        if self.rectangle is not None:
            seen = SphericalRectangle(self.rectangle, si.p)
            ds = _rectangle_sample(mi, seen, u, si)
            at_light = mi.SurfaceInteraction3f(ds, si.wavelengths)
            at_light.wi = at_light.to_local(-ds.d)
            weight = dr.select(ds.pdf > 0, self.emitters[0].eval(at_light, active) / ds.pdf, 0)
            return LightSample(ds, weight, mi.Bool(False), dr.select(seen.uniform, seen.solid_angle, 0))
        if self.count == 1:
            if self.sky is not None:
                return self._toward_sky(self.sky, si, u, active)
            ds, weight = self.emitters[0].sample_direction(si, u, active)
            return LightSample(ds, weight, mi.Bool(ds.delta), mi.Float(0))
        index, left, probability = self.nearby.choose(si.p, u.x)
        u = mi.Point2f(left, u.y)
        place = dr.gather(mi.UInt32, self.place, index, active)
        emitter = dr.gather(mi.EmitterPtr, self.scene.emitters_dr(), place, active)
        if self.sky is None:
            ds, weight = emitter.sample_direction(si, u, active)
        else:
            above, lamp = self._toward_sky(self.sky, si, u, active), index != self.sky_place
            ds, weight = emitter.sample_direction(si, u, active & lamp)
            ds, weight = dr.select(lamp, ds, above.ds), dr.select(lamp, weight, above.weight)
        ds.pdf *= probability
        return LightSample(ds, weight / probability, mi.Bool(ds.delta), mi.Float(0))

    def _toward_sky(self, sky: Sky, si: SurfaceInteraction, u: Point, active: Mask) -> LightSample:
        mi = self.mi
        ds = dr.zeros(mi.DirectionSample3f, dr.width(si.p))
        ds.d, ds.p, ds.pdf, radiance = sky.sample(si, u, active)
        ds.dist, ds.n, ds.time, ds.delta = dr.norm(ds.p - si.p), mi.Normal3f(-ds.d), si.time, mi.Bool(False)
        return LightSample(ds, dr.select(ds.pdf > 0, radiance / ds.pdf, 0), mi.Bool(False), mi.Float(0))

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
        if self.count == 1:
            if self.sky is not None:
                return self.sky.pdf(ds.d)
            return self.emitters[0].pdf_direction(it, ds, active)
        number = dr.reinterpret_array(mi.UInt32, ds.emitter)
        if self.sky is None:
            density = ds.emitter.pdf_direction(it, ds, active)
        else:
            lamp = active & si.is_valid()  # the sky is what no surface is before
            density = dr.select(lamp, ds.emitter.pdf_direction(it, ds, lamp), self.sky.pdf(ds.d))
        index = dr.gather(mi.UInt32, self.number, number, active)
        return density * self.nearby.probability(origin, index, active)

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
        # Stops short of the light by the same relative distance as Interaction::spawn_ray_to.
        shadow.maxt = distance * (1 - mi.math.ShadowEpsilon)
        active &= dr.any(radiance != 0)
        active &= ~self.surfaces.blocked(shadow, active)
        pdf = self.rectangle.pdf(solid_angle, distance, dr.abs(dr.dot(ray.d, self.rectangle.normal)))
        return weigh(dr.select(active, radiance, 0), pdf)


def _is_black(mi: ModuleType, emitter: Emitter) -> bool:
    """Whether an environment is black all over: a density of Mitsuba's is then 0 / 0."""
    if not mi.has_flag(emitter.flags(), mi.EmitterFlags.Infinite):
        return False
    pixels = dict(mi.traverse(emitter)).get("data")
    return pixels is not None and not dr.any(pixels.array != 0)


def _order(emitter: Emitter) -> tuple[str, list[float]]:
    """What lights are sorted by: nothing that changes between two runs."""
    shape = emitter.get_shape()
    box = [] if shape is None else [float(x) for x in (*shape.bbox().min, *shape.bbox().max)]
    return str(emitter), box


@dataclass
class LightSample:
    """A direction sample `ds`, radiance over pdf `weight`, whether the light is a point (no BSDF sample can meet it),
    and the solid angle of a rectangle sampled uniformly in it (0 where it was not)."""

    ds: DirectionSample
    weight: Radiance
    delta: Mask
    solid_angle: Float


def fraction(x: Float) -> Float:
    """The part of x >= 0 behind the point."""
    return x - dr.floor(x)
