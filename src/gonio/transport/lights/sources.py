"""Where light begins: particles that leave the lamps.

A particle is a ray from a lamp and the light that it carries, its radiance over `density`. That density is one of
*étendue*, 1/(m^2 sr) with the cosine at the lamp: light keeps its étendue through mirrors, and through glass but for
the square of the index, so that the same number tells how likely particles arrive on a surface behind (`caustics.py`).

With `Targets` particles go where certain shapes may stand, and nowhere else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from ...bridge.types import (
    Emitter,
    Float,
    Mask,
    Point,
    Radiance,
    Scene,
    Sensor,
    Shape,
    SurfaceInteraction,
    UInt,
    Vector,
)
from ...errors import InputError
from .base import shadow_offset
from .directions import area_density
from .lights import Lights
from .solid_angles import is_sphere

SURFACE, POINT, INFINITE = 0, 1, 2
UNMET = 1e30  # larger than what any lamp with an extent has, and small enough to be counted with
MOST_TARGETS = 8  # spheres that particles are aimed at; the code for each stands in the kernel


@dataclass
class Particle:
    """What leaves a lamp.

    origin     where, and the direction; for a lamp at infinity a point outside of the scene
    direction
    emitter    the lamp
    place      of a lamp with a surface, the point on it
    kind       SURFACE, POINT or INFINITE
    flux       radiance over density; of a lamp that is a point or a parallel beam, its limit
    density    1/(m^2 sr), of étendue; UNMET for those two, which no ray from elsewhere meets
    direct_weight  of the lamp in the eyes of a camera that sees it directly: of a surface one over its density by area,
                   of infinity the radiance over its density by solid angle
    """

    origin: Point
    direction: Vector
    emitter: Emitter
    place: SurfaceInteraction
    kind: UInt
    flux: Radiance
    density: Float
    direct_weight: Radiance


class Targets:
    """Spheres around shapes, at most MOST_TARGETS: who stand together share one."""

    def __init__(self, mi: ModuleType, shapes: Sequence[Shape]):
        self.mi = mi
        spheres = _together([_sphere_around(mi, shape) for shape in shapes], MOST_TARGETS)
        self.count = len(spheres)
        self.centre = [mi.Point3f(*map(float, s[:3])) for s in spheres]
        self.radius = [mi.Float(float(s[3])) for s in spheres]
        dr.make_opaque(self.centre, self.radius)

    def _chosen(self, pick: Float) -> tuple[Point, Float, Float]:
        """(centre, radius, what is left of the random number) of one of them."""
        mi = self.mi
        number = dr.minimum(mi.UInt32(pick * self.count), self.count - 1)
        centre, radius = self.centre[0], self.radius[0]
        for i in range(1, self.count):
            centre = dr.select(number == i, self.centre[i], centre)
            radius = dr.select(number == i, self.radius[i], radius)
        return centre, radius, pick * self.count - mi.Float(number)

    def _cone(self, origin: Point, centre: Point, radius: Float) -> tuple[Vector, Float, Float]:
        """(axis, 1 - cosine of its half angle, solid angle) of the cone of a sphere; of all around from inside."""
        away = centre - origin
        distance2 = dr.squared_norm(away)
        sine2 = dr.square(radius) / dr.maximum(distance2, 1e-30)
        height = dr.select(sine2 < 1, sine2 / (1 + dr.safe_sqrt(1 - sine2)), 2)
        axis = dr.select(distance2 > 0, away * dr.rsqrt(dr.maximum(distance2, 1e-30)), self.mi.Vector3f(0, 0, 1))
        return axis, height, 2 * dr.pi * height

    def direction(self, origin: Point, pick: Float, u: Point) -> Vector:
        """A direction toward one of the spheres, uniform in its cone."""
        centre, radius, _ = self._chosen(pick)
        axis, height, _ = self._cone(origin, centre, radius)
        low = height * u.x
        sine = dr.safe_sqrt(low * (2 - low))
        s, c = dr.sincos(2 * dr.pi * u.y)
        return self.mi.Vector3f(self.mi.Frame3f(axis).to_world(self.mi.Vector3f(c * sine, s * sine, 1 - low)))

    def direction_pdf(self, origin: Point, direction: Vector) -> Float:
        """Density (1/sr) of `direction`."""
        total = self.mi.Float(0)
        for centre, radius in zip(self.centre, self.radius, strict=True):
            axis, height, solid_angle = self._cone(origin, centre, radius)
            # 1 - cosine from the chord, which keeps its digits in a narrow cone; a little wider, for rounding
            inside = dr.squared_norm(direction - axis) * 0.5 <= height * 1.0001
            total += dr.select(inside, dr.rcp(solid_angle), 0)
        return total / self.count

    def line(self, direction: Vector, pick: Float, u: Point) -> Point:
        """A point through which a line of that direction meets one of the spheres, uniform over its disc."""
        centre, radius, _ = self._chosen(pick)
        return centre + self.mi.Frame3f(direction).to_world(_on_disc(self.mi, u) * radius)

    def line_pdf(self, point: Point, direction: Vector) -> Float:
        """Density (1/m^2, across the direction) of `line`."""
        total = self.mi.Float(0)
        for centre, radius in zip(self.centre, self.radius, strict=True):
            offset = point - centre
            across2 = dr.squared_norm(offset - direction * dr.dot(offset, direction))
            total += dr.select(across2 <= dr.square(radius) * 1.0001, dr.rcp(dr.pi * dr.square(radius)), 0)
        return total / self.count


class Sources:
    """The lamps of a scene as what particles leave; `targets` None sends them everywhere.

    Raises InputError for lamps that cannot be asked.
    """

    def __init__(self, mi: ModuleType, scene: Scene, sensor: Sensor, lights: Lights, targets: Targets | None = None):
        self.mi, self.scene, self.sensor, self.lights, self.targets = mi, scene, sensor, lights, targets
        self.kinds = [_kind(mi, emitter) for emitter in lights.emitters]
        self.known = sorted(set(self.kinds))
        sides = [getattr(emitter, "two_sided", False) for emitter in lights.emitters]
        self.any_two_sided = any(sides)
        self.kind_of, self.two_sided = mi.UInt32(self.kinds), mi.Bool(sides)
        parallel = [mi.has_flag(emitter.flags(), mi.EmitterFlags.DeltaDirection) for emitter in lights.emitters]
        self.parallel = mi.Bool(parallel)
        box = scene.bbox()
        centre, radius = (np.zeros(3), 1.0)
        if box.valid():
            low, high = np.array(box.min).ravel(), np.array(box.max).ravel()
            centre, radius = (low + high) / 2, max(float(np.linalg.norm(high - low)) / 2, 1e-6)
        self.centre, self.radius = mi.Point3f(*map(float, centre)), mi.Float(radius)
        dr.make_opaque(self.centre, self.radius, self.kind_of, self.two_sided, self.parallel)

    def wavelengths(self, u: Float) -> tuple[Sequence[Float], Radiance]:
        """Wavelengths of a particle as the camera's are, and their weight; none in RGB."""
        mi = self.mi
        if not mi.is_spectral:
            return [], mi.Spectrum(1)
        return self.sensor.sample_wavelengths(dr.zeros(mi.SurfaceInteraction3f), u)

    def sample(self, pick: Float, place: Point, aim: Float, way: Point, wavelengths: Sequence[Float]) -> Particle:
        """A particle; `pick` chooses the lamp, `place` the point on it, `aim` and `way` the direction."""
        mi, lights = self.mi, self.lights
        if lights.count == 1:
            number, probability, emitter = mi.UInt32(0), mi.Float(1), mi.EmitterPtr(lights.emitters[0])
        else:
            number, probability = lights.by_power.sample_pmf(pick)
            emitter = dr.gather(
                mi.EmitterPtr, self.scene.emitters_dr(), dr.gather(mi.UInt32, lights.scene_indices, number)
            )
        kind = dr.gather(mi.UInt32, self.kind_of, number)
        result: Particle | None = None
        for one in self.known:
            make = (self._from_surface, self._from_point, self._from_infinite)[one]
            here = kind == one
            other = make(number, emitter, place, aim, way, wavelengths, here)
            result = other if result is None else dr.select(here, other, result)
        assert result is not None, "who asks has seen that there are lamps"
        return Particle(
            result.origin,
            result.direction,
            emitter,
            result.place,
            kind,
            result.flux / probability,
            dr.select(result.density < UNMET, result.density * probability, UNMET),
            result.direct_weight / probability,
        )

    def density(self, origin: Point, si: SurfaceInteraction, direction: Vector, active: Mask) -> Float:
        """`Particle.density` of the one that would come from the lamp met at `si` by a ray of that direction."""
        mi, lights = self.mi, self.lights
        emitter = si.emitter(self.scene)
        probability, index = mi.Float(1), mi.UInt32(0)
        if lights.count > 1:
            number = dr.reinterpret_array(mi.UInt32, emitter)
            probability = dr.gather(mi.Float, lights.probability_of_pointer, number, active)
            index = dr.gather(mi.UInt32, lights.index_of_pointer, number, active)
        result = mi.Float(0)
        for one in self.known:
            if one == SURFACE:
                hit = active & si.is_valid()
                ps = mi.PositionSample3f(si)
                cosine = dr.abs(dr.dot(direction, si.n))
                by_area = lights.lamps.of_shape(emitter, index, area_density, mi.Float(0), ps, hit)
                pdf = by_area * self._direction_pdf(si, -direction, hit) / dr.maximum(cosine, 1e-12)
                result = dr.select(hit, pdf, result)
            if one == INFINITE:
                hit = active & ~si.is_valid()
                it = dr.zeros(mi.SurfaceInteraction3f)
                it.p = self.centre
                ds = dr.zeros(mi.DirectionSample3f)
                ds.d, ds.emitter = direction, emitter
                pdf = emitter.pdf_direction(it, ds, hit) * self._line_pdf(origin, direction)
                result = dr.select(hit, pdf, result)
        return result * probability

    # ------------------------------------------------------------------ of each kind

    def _from_surface(
        self,
        number: UInt,
        emitter: Emitter,
        place: Point,
        aim: Float,
        way: Point,
        wavelengths: Sequence[Float],
        active: Mask,
    ) -> Particle:
        mi, lights = self.mi, self.lights
        ps = lights.lamps.on_area(emitter, number, place, active)
        si = mi.SurfaceInteraction3f(ps, wavelengths) if mi.is_spectral else mi.SurfaceInteraction3f(ps, [])
        two_sided = dr.gather(mi.Bool, self.two_sided, number, active)
        if self.targets is not None:
            direction = self.targets.direction(ps.p, aim, way)
        else:
            local = mi.warp.square_to_cosine_hemisphere(way)
            local.z = dr.select(two_sided & (aim < 0.5), -local.z, local.z)
            direction = si.to_world(local)
        si.wi = si.to_local(direction)
        cosine = dr.abs(si.wi.z)
        pdf = self._direction_pdf(si, direction, active, two_sided)
        shines = active & (two_sided | (si.wi.z > 0)) & (pdf > 0)
        if lights.lamps.spheres is not None:
            # into one that is smaller than the step off a surface: out at its other side
            radius = dr.gather(mi.Vector4f, lights.lamps.spheres, number, active).w
            inward = (radius != 0.0) & (si.wi.z * radius < 0.0)
            shines &= ~inward | (abs(radius) > shadow_offset(mi, ps.p, ps.p))
        density = ps.pdf * pdf / dr.maximum(cosine, 1e-12)
        flux = dr.select(shines, emitter.eval(si, shines) / density, 0)
        direct_weight = mi.Spectrum(dr.select(ps.pdf > 0, dr.rcp(ps.pdf), 0))
        return Particle(si.p, direction, emitter, si, mi.UInt32(SURFACE), flux, density, direct_weight)

    def _direction_pdf(
        self, si: SurfaceInteraction, direction: Vector, active: Mask, two_sided: Mask | None = None
    ) -> Float:
        """1/sr, of a direction away from a lamp's surface."""
        if self.targets is not None:
            return self.targets.direction_pdf(si.p, direction)
        assert two_sided is not None
        return dr.abs(dr.dot(direction, si.n)) * dr.inv_pi * dr.select(two_sided, 0.5, 1)

    def _from_point(
        self,
        number: UInt,
        emitter: Emitter,
        place: Point,
        aim: Float,
        way: Point,
        wavelengths: Sequence[Float],
        active: Mask,
    ) -> Particle:
        mi = self.mi
        it = dr.zeros(mi.SurfaceInteraction3f)
        it.p = self.centre
        it.wavelengths = wavelengths
        origin = emitter.sample_direction(it, place, active)[0].p
        if self.targets is not None:
            direction = self.targets.direction(origin, aim, way)
            pdf = self.targets.direction_pdf(origin, direction)
        else:
            direction, pdf = mi.warp.square_to_uniform_sphere(way), mi.Float(dr.inv_four_pi)
        it.p = origin + direction  # at the distance of one, light per area is light per solid angle
        _, intensity = emitter.sample_direction(it, place, active)
        flux = dr.select(active & (pdf > 0), intensity / pdf, 0)
        place_ = self._nowhere(wavelengths)
        return Particle(origin, direction, emitter, place_, mi.UInt32(POINT), flux, mi.Float(UNMET), mi.Spectrum(0))

    def _from_infinite(
        self,
        number: UInt,
        emitter: Emitter,
        place: Point,
        aim: Float,
        way: Point,
        wavelengths: Sequence[Float],
        active: Mask,
    ) -> Particle:
        mi = self.mi
        it = dr.zeros(mi.SurfaceInteraction3f)
        it.p = self.centre
        it.wavelengths = wavelengths
        ds, weight = emitter.sample_direction(it, way, active)
        direction = mi.Vector3f(-ds.d)
        if self.targets is not None:
            point = self.targets.line(direction, aim, place)
        else:
            point = self.centre + mi.Frame3f(direction).to_world(_on_disc(mi, place) * self.radius)
        by_area = self._line_pdf(point, direction)
        outside = dr.norm(point - self.centre) + 2 * self.radius
        parallel = dr.gather(mi.Bool, self.parallel, number, active)
        density = dr.select(parallel, UNMET, ds.pdf * by_area)
        flux = dr.select(active & (by_area > 0), weight / by_area, 0)
        origin = mi.Point3f(point - direction * outside)
        direct_weight = dr.select(parallel, 0, weight)
        place_ = self._nowhere(wavelengths)
        return Particle(origin, direction, emitter, place_, mi.UInt32(INFINITE), flux, density, direct_weight)

    def _line_pdf(self, point: Point, direction: Vector) -> Float:
        if self.targets is not None:
            return self.targets.line_pdf(point, direction)
        return dr.rcp(dr.pi * dr.square(self.radius))

    def _nowhere(self, wavelengths: Sequence[Float]) -> SurfaceInteraction:
        si = dr.zeros(self.mi.SurfaceInteraction3f)
        si.wavelengths = wavelengths
        return si


def _kind(mi: ModuleType, emitter: Emitter) -> int:
    flags, kinds = emitter.flags(), mi.EmitterFlags

    def has(kind: int) -> bool:
        return bool(mi.has_flag(flags, kind))

    if has(kinds.Infinite):
        return INFINITE
    if has(kinds.DeltaPosition):
        return POINT
    if has(kinds.Surface) and not has(kinds.DeltaDirection):
        return SURFACE
    what = f"a lamp of the kind {emitter.class_name()}, which sends no particles"
    raise InputError(what, "integrator", "use --integrator path, or a lamp with a surface, a point or an environment")


def _on_disc(mi: ModuleType, u: Point) -> Vector:
    """A point of the unit disc across z."""
    on_disc = mi.warp.square_to_uniform_disk_concentric(u)
    return mi.Vector3f(on_disc.x, on_disc.y, 0)


def _sphere_around(mi: ModuleType, shape: Shape) -> NDArray[np.float64]:
    """Centre and radius of a sphere that holds a shape."""
    box = shape.bbox()
    low, high = np.array(box.min, float).ravel(), np.array(box.max, float).ravel()
    radius = float(np.max(high - low)) / 2 if is_sphere(mi, shape) else float(np.linalg.norm(high - low)) / 2
    return np.array([*(low + high) / 2, radius * 1.001 + 1e-9])


def _together(spheres: list[NDArray[np.float64]], most: int) -> list[NDArray[np.float64]]:
    """At most so many spheres that hold all: the longest extent of their centres is halved until there are enough."""
    groups = [np.array(spheres)]
    while len(groups) < most:
        spans = [float(np.max(np.ptp(group[:, :3], axis=0))) if len(group) > 1 else -1.0 for group in groups]
        if max(spans) < 0.0:
            break
        group = groups.pop(int(np.argmax(spans)))
        group = group[np.argsort(group[:, int(np.argmax(np.ptp(group[:, :3], axis=0)))], kind="stable")]
        groups += [group[: len(group) // 2], group[len(group) // 2 :]]
    return [_around(group) for group in groups]


def _around(group: NDArray[np.float64]) -> NDArray[np.float64]:
    if len(group) == 1:
        return group[0]
    low, high = (group[:, :3] - group[:, 3:]).min(0), (group[:, :3] + group[:, 3:]).max(0)
    centre = (low + high) / 2
    radius = float(np.max(np.linalg.norm(group[:, :3] - centre, axis=1) + group[:, 3]))
    return np.array([*centre, radius])
