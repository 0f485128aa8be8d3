"""Emission of particles from the lamps.

A particle is a ray from a lamp with a flux, which is the radiance divided by `density`. This density is with respect to
*étendue*, 1/(m^2 sr), which includes the cosine at the lamp. Étendue is conserved by mirrors and, except for the
squared index of refraction, by glass. The same number therefore gives the density of particles on a surface that they
reach through mirrors and glass (`caustics.py`).

With `Targets`, particles are emitted only toward the bounding spheres of certain shapes.
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
from .directions import area_density
from .lights import Lights
from .solid_angles import is_sphere

SURFACE, POINT, INFINITE = 0, 1, 2
DELTA_DENSITY = 1e30  # density of delta lights: larger than that of any other lamp, but small enough for computations
MAX_TARGETS = 8  # maximum number of spheres toward which particles are emitted; the kernel contains code for each


@dataclass
class Particle:
    """A particle when it leaves a lamp.

    origin     origin of the ray; for a lamp at infinity, a position outside the scene
    direction  direction of the ray
    emitter    the lamp
    place      the point on the lamp, if it has a surface
    kind       SURFACE, POINT or INFINITE
    flux       radiance divided by density; for a point light or a parallel beam, the limit of this quotient
    density    density with respect to étendue, 1/(m^2 sr); DELTA_DENSITY for point lights and beams, which no other ray
               can hit
    direct_weight  weight of the lamp for a camera that sees it directly: for a surface, 1 divided by the density by
                   area; for a lamp at infinity, radiance divided by the density by solid angle
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
    """The bounding spheres of shapes. There are at most MAX_TARGETS, so neighboring shapes may share a sphere."""

    def __init__(self, mi: ModuleType, shapes: Sequence[Shape]):
        self.mi = mi
        spheres = _together([_sphere_around(mi, shape) for shape in shapes], MAX_TARGETS)
        self.count = len(spheres)
        self.center = [mi.Point3f(*map(float, s[:3])) for s in spheres]
        self.radius = [mi.Float(float(s[3])) for s in spheres]
        dr.make_opaque(self.center, self.radius)

    def _chosen(self, pick: Float) -> tuple[Point, Float, Float]:
        """The center and radius of a randomly selected sphere, and the random number rescaled for reuse."""
        mi = self.mi
        number = dr.minimum(mi.UInt32(pick * self.count), self.count - 1)
        center, radius = self.center[0], self.radius[0]
        for i in range(1, self.count):
            center = dr.select(number == i, self.center[i], center)
            radius = dr.select(number == i, self.radius[i], radius)
        return center, radius, pick * self.count - mi.Float(number)

    def _cone(self, origin: Point, center: Point, radius: Float) -> tuple[Vector, Float, Float]:
        """The cone of directions toward a sphere: its axis, 1 - cosine of its half angle, and its solid angle.

        If the origin is inside the sphere, the cone contains all directions.
        """
        away = center - origin
        distance2 = dr.squared_norm(away)
        sine2 = dr.square(radius) / dr.maximum(distance2, 1e-30)
        height = dr.select(sine2 < 1, sine2 / (1 + dr.safe_sqrt(1 - sine2)), 2)
        axis = dr.select(distance2 > 0, away * dr.rsqrt(dr.maximum(distance2, 1e-30)), self.mi.Vector3f(0, 0, 1))
        return axis, height, 2 * dr.pi * height

    def direction(self, origin: Point, pick: Float, u: Point) -> Vector:
        """Sample a direction uniformly in the cone subtended by one of the spheres."""
        center, radius, _ = self._chosen(pick)
        axis, height, _ = self._cone(origin, center, radius)
        low = height * u.x
        sine = dr.safe_sqrt(low * (2 - low))
        s, c = dr.sincos(2 * dr.pi * u.y)
        return self.mi.Vector3f(self.mi.Frame3f(axis).to_world(self.mi.Vector3f(c * sine, s * sine, 1 - low)))

    def direction_pdf(self, origin: Point, direction: Vector) -> Float:
        """The density with which `direction` generates a direction, 1/sr."""
        total = self.mi.Float(0)
        for center, radius in zip(self.center, self.radius, strict=True):
            axis, height, solid_angle = self._cone(origin, center, radius)
            # 1 - cosine is computed from the chord, for accuracy in narrow cones, which are enlarged by rounding errors
            inside = dr.squared_norm(direction - axis) * 0.5 <= height * 1.0001
            total += dr.select(inside, dr.rcp(solid_angle), 0)
        return total / self.count

    def line(self, direction: Vector, pick: Float, u: Point) -> Point:
        """Sample a line of a given direction through one of the spheres, uniformly over the disk of the sphere.

        Returns a point on the line.
        """
        center, radius, _ = self._chosen(pick)
        return center + self.mi.Frame3f(direction).to_world(_on_disk(self.mi, u) * radius)

    def line_pdf(self, point: Point, direction: Vector) -> Float:
        """The density with which `line` generates a line through a point, 1/m^2, perpendicular to the direction."""
        total = self.mi.Float(0)
        for center, radius in zip(self.center, self.radius, strict=True):
            offset = point - center
            across2 = dr.squared_norm(offset - direction * dr.dot(offset, direction))
            total += dr.select(across2 <= dr.square(radius) * 1.0001, dr.rcp(dr.pi * dr.square(radius)), 0)
        return total / self.count


class Sources:
    """The lamps of a scene as sources of particles.

    targets  the spheres toward which particles are emitted; None for all directions
    Raises InputError for lamps that cannot emit particles.
    """

    def __init__(self, mi: ModuleType, scene: Scene, sensor: Sensor, lights: Lights, targets: Targets | None = None):
        self.mi, self.scene, self.sensor, self.lights, self.targets = mi, scene, sensor, lights, targets
        self.kinds = [_kind(mi, emitter) for emitter in lights.emitters]
        self.known = sorted(set(self.kinds))
        sides = [getattr(emitter, "two_sided", False) for emitter in lights.emitters]
        self.kind_of, self.two_sided = mi.UInt32(self.kinds), mi.Bool(sides)
        parallel = [mi.has_flag(emitter.flags(), mi.EmitterFlags.DeltaDirection) for emitter in lights.emitters]
        self.parallel = mi.Bool(parallel)
        box = scene.bbox()
        center, radius = (np.zeros(3), 1.0)
        if box.valid():
            low, high = np.array(box.min).ravel(), np.array(box.max).ravel()
            center, radius = (low + high) / 2, max(float(np.linalg.norm(high - low)) / 2, 1e-6)
        self.center, self.radius = mi.Point3f(*map(float, center)), mi.Float(radius)
        dr.make_opaque(self.center, self.radius, self.kind_of, self.two_sided, self.parallel)

    def wavelengths(self, u: Float) -> tuple[Sequence[Float], Radiance]:
        """Sample the wavelengths of a particle, in the same way as the camera does, and their weight; none in RGB."""
        mi = self.mi
        if not mi.is_spectral:
            return [], mi.Spectrum(1)
        return self.sensor.sample_wavelengths(dr.zeros(mi.SurfaceInteraction3f), u)

    def sample(self, pick: Float, place: Point, aim: Float, way: Point, wavelengths: Sequence[Float]) -> Particle:
        """Sample a particle: `pick` selects the lamp, `place` the point on the lamp, `aim` and `way` the direction."""
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
        assert result is not None, "callers check that there are lamps"
        return Particle(
            result.origin,
            result.direction,
            emitter,
            result.place,
            kind,
            result.flux / probability,
            dr.select(result.density < DELTA_DENSITY, result.density * probability, DELTA_DENSITY),
            result.direct_weight / probability,
        )

    def density(self, origin: Point, si: SurfaceInteraction, direction: Vector, active: Mask) -> Float:
        """`Particle.density` of a particle from the lamp at `si`, which a ray from `origin` in `direction` has hit."""
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
                it.p = self.center
                ds = dr.zeros(mi.DirectionSample3f)
                ds.d, ds.emitter = direction, emitter
                pdf = emitter.pdf_direction(it, ds, hit) * self._line_pdf(origin, direction)
                result = dr.select(hit, pdf, result)
        return result * probability

    # ------------------------------------------------------------------ kinds of lamps

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
            # In a ball smaller than the ray's offset, a ray into the ball would begin beyond the opposite side.
            radius = dr.gather(mi.Vector4f, lights.lamps.spheres, number, active).w
            inward = (radius != 0.0) & (si.wi.z * radius < 0.0)
            shines &= ~inward | (abs(radius) > lights.surfaces.offsets.at(ps.p))
        density = ps.pdf * pdf / dr.maximum(cosine, 1e-12)
        flux = dr.select(shines, emitter.eval(si, shines) / density, 0)
        direct_weight = mi.Spectrum(dr.select(ps.pdf > 0, dr.rcp(ps.pdf), 0))
        return Particle(si.p, direction, emitter, si, mi.UInt32(SURFACE), flux, density, direct_weight)

    def _direction_pdf(
        self, si: SurfaceInteraction, direction: Vector, active: Mask, two_sided: Mask | None = None
    ) -> Float:
        """The density of a direction away from the surface of a lamp, 1/sr."""
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
        it.p = self.center
        it.wavelengths = wavelengths
        origin = emitter.sample_direction(it, place, active)[0].p
        if self.targets is not None:
            direction = self.targets.direction(origin, aim, way)
            pdf = self.targets.direction_pdf(origin, direction)
        else:
            direction, pdf = mi.warp.square_to_uniform_sphere(way), mi.Float(dr.inv_four_pi)
        it.p = origin + direction  # at unit distance, flux per area equals flux per solid angle
        _, intensity = emitter.sample_direction(it, place, active)
        flux = dr.select(active & (pdf > 0), intensity / pdf, 0)
        nowhere, density = self._nowhere(wavelengths), mi.Float(DELTA_DENSITY)
        return Particle(origin, direction, emitter, nowhere, mi.UInt32(POINT), flux, density, mi.Spectrum(0))

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
        it.p = self.center
        it.wavelengths = wavelengths
        ds, weight = emitter.sample_direction(it, way, active)
        direction = mi.Vector3f(-ds.d)
        if self.targets is not None:
            point = self.targets.line(direction, aim, place)
        else:
            point = self.center + mi.Frame3f(direction).to_world(_on_disk(mi, place) * self.radius)
        by_area = self._line_pdf(point, direction)
        outside = dr.norm(point - self.center) + 2 * self.radius
        parallel = dr.gather(mi.Bool, self.parallel, number, active)
        density = dr.select(parallel, DELTA_DENSITY, ds.pdf * by_area)
        flux = dr.select(active & (by_area > 0), weight / by_area, 0)
        origin = mi.Point3f(point - direction * outside)
        direct_weight = dr.select(parallel, 0, weight)
        nowhere = self._nowhere(wavelengths)
        return Particle(origin, direction, emitter, nowhere, mi.UInt32(INFINITE), flux, density, direct_weight)

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
    what = f"a lamp of type {emitter.class_name()} cannot emit particles"
    raise InputError(what, "integrator", "use --integrator path, or a lamp with a surface, a point or an environment")


def _on_disk(mi: ModuleType, u: Point) -> Vector:
    """Sample a point of the unit disk perpendicular to z."""
    on_disk = mi.warp.square_to_uniform_disk_concentric(u)
    return mi.Vector3f(on_disk.x, on_disk.y, 0)


def _sphere_around(mi: ModuleType, shape: Shape) -> NDArray[np.float64]:
    """The center and radius of a bounding sphere of a shape."""
    box = shape.bbox()
    low, high = np.array(box.min, float).ravel(), np.array(box.max, float).ravel()
    radius = float(np.max(high - low)) / 2 if is_sphere(mi, shape) else float(np.linalg.norm(high - low)) / 2
    return np.array([*(low + high) / 2, radius * 1.001 + 1e-9])


def _together(spheres: list[NDArray[np.float64]], most: int) -> list[NDArray[np.float64]]:
    """At most `most` spheres that contain all given spheres.

    The spheres are divided into groups, by repeatedly halving the group whose centers have the largest extent.
    """
    groups = [np.array(spheres)]
    while len(groups) < most:
        spans = [float(np.max(np.ptp(group[:, :3], axis=0))) if len(group) > 1 else -1.0 for group in groups]
        if max(spans) < 0.0:
            break
        group = groups.pop(int(np.argmax(spans)))
        group = group[np.argsort(group[:, int(np.argmax(np.ptp(group[:, :3], axis=0)))], kind="stable")]
        groups += [group[: len(group) // 2], group[len(group) // 2 :]]
    return [_bounding_sphere(group) for group in groups]


def _bounding_sphere(group: NDArray[np.float64]) -> NDArray[np.float64]:
    """The center and radius of a sphere that contains all spheres of a group."""
    if len(group) == 1:
        return group[0]
    low, high = (group[:, :3] - group[:, 3:]).min(0), (group[:, :3] + group[:, 3:]).max(0)
    center = (low + high) / 2
    radius = float(np.max(np.linalg.norm(group[:, :3] - center, axis=1) + group[:, 3]))
    return np.array([*center, radius])
