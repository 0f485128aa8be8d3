"""Sample directions from a point toward rectangular and spherical lamps, uniformly in solid angle or by area."""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType

import drjit as dr

from ...bridge.types import Float, Mask, Point, Shape, Vector

# Outside this range of solid angles (steradians), the area is sampled instead. Below it, angles near pi have an error
# of 2.4e-7 in float32, so at 1e-3 sr the error of the sampled position is 2.4e-4 of an edge, and for such distant
# lamps, sampling the solid angle has no advantage. Above it, the point is almost in the rectangle (2 pi = 6.283), where
# 1/z0 loses precision.
SMALLEST_SOLID_ANGLE, LARGEST_SOLID_ANGLE = 1e-3, 6.22

# A point counts as on a ball if its distance from the ball is less than these fractions of the radius and coordinates.
TOUCHING, ROUNDING = 1e-4, 1e-6

# Largest |cosine| between the edges of a rectangle; it is far larger than the errors of float32 transformations.
STRAIGHT = 1e-4

Sample = tuple[Point, Vector, tuple[Float, Float], Float]  # point, normal, (u, v), density in 1/sr


@dataclass
class Rectangle:
    """A rectangle in space: a corner, two perpendicular unit axes, lengths of the edges, and side of the normal.

    The side is 1 if the normal is axis0 x axis1, and -1 if it is the opposite.
    """

    corner: Point
    axis0: Vector
    axis1: Vector
    length0: Float
    length1: Float
    side: Float | int = 1

    @staticmethod
    def of(mi: ModuleType, shape: Shape) -> Rectangle:
        """The rectangle of a Mitsuba `rectangle`, without the side of the normal.

        It is kernel data, so moving the rectangle does not recompile kernels.
        """
        zero, one = mi.Float(0), mi.Float(1)
        corner = shape.sample_position(zero, mi.Point2f(zero, zero)).p
        edge0 = shape.sample_position(zero, mi.Point2f(one, zero)).p - corner
        edge1 = shape.sample_position(zero, mi.Point2f(zero, one)).p - corner
        length0, length1 = dr.norm(edge0), dr.norm(edge1)
        return Rectangle(corner, edge0 / length0, edge1 / length1, length0, length1)

    @property
    def normal(self) -> Vector:
        return dr.cross(self.axis0, self.axis1) * self.side

    @property
    def area(self) -> Float:
        return self.length0 * self.length1

    def pdf(self, solid_angle: Float, distance: Float, cosine: Float) -> Float:
        """The density (1/sr) toward a point at `distance`, where |cos| is `cosine`.

        It is uniform in solid angle, or uniform by area if `solid_angle` is 0.
        """
        return dr.select(solid_angle > 0, dr.rcp(solid_angle), self.pdf_by_area(distance, cosine))

    def pdf_by_area(self, distance: Float, cosine: Float) -> Float:
        return dr.square(distance) * dr.rcp(dr.maximum(cosine * self.area, 1e-30))  # large but finite at grazing angles

    def hit(self, origin: Point, direction: Vector) -> tuple[Float, tuple[Float, Float], Mask]:
        """The intersection with a ray: its distance, (u, v) in [0, 1]^2, and whether there is an intersection."""
        normal = self.normal
        distance = dr.dot(self.corner - origin, normal) / dr.dot(direction, normal)
        offset = dr.fma(direction, distance, origin) - self.corner
        u, v = dr.dot(offset, self.axis0) / self.length0, dr.dot(offset, self.axis1) / self.length1
        return distance, (u, v), (distance > 0) & (dr.minimum(u, v) >= 0) & (dr.maximum(u, v) <= 1)


class SphericalRectangle:
    """A rectangle as seen from a point: its solid angle, and uniform sampling of directions in it.

    The method is that of Urena2013, sec. 3. In the frame of the rectangle, with the point at the origin and the
    rectangle at z0 < 0, the u-coordinate is found by inverting the solid angle of a sub-rectangle, and the v-coordinate
    by inverting the height on the sphere. If the solid angle is too small or too large for float32, the area is sampled
    instead.

    `solid_angle` is accurate for small values too. It is twice the sum of the half angles of two triangles (Van
    Oosterom and Strackee 1983), whose numerators are products without cancellation, unlike the sum of four angles minus
    2 pi.
    """

    def __init__(self, rectangle: Rectangle, origin: Point):
        self.rectangle, self.origin = rectangle, origin
        offset = rectangle.corner - origin
        self.x0, self.y0 = dr.dot(offset, rectangle.axis0), dr.dot(offset, rectangle.axis1)
        self.x1, self.y1 = self.x0 + rectangle.length0, self.y0 + rectangle.length1
        self.z0 = -dr.abs(dr.dot(offset, rectangle.normal))
        zz = dr.square(self.z0)
        xx0, xx1, yy0, yy1 = dr.square(self.x0), dr.square(self.x1), dr.square(self.y0), dr.square(self.y1)
        # z components of the normals of the planes through the origin and the edges v = y0, v = y1 and u = x0
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
        # dot products of corner vectors: along an edge, and across the diagonal 10-01, which the two triangles share
        across = self.x0 * self.x1 + self.y0 * self.y1 + zz
        along_x0, along_x1 = self.x0 * self.x1 + yy0 + zz, self.x0 * self.x1 + yy1 + zz
        along_y0, along_y1 = xx0 + self.y0 * self.y1 + zz, xx1 + self.y0 * self.y1 + zz
        lower = r00 * r10 * r01 + along_x0 * r01 + along_y0 * r10 + across * r00
        upper = r11 * r10 * r01 + along_x1 * r10 + along_y1 * r01 + across * r11
        # The half angles are the arguments of two complex numbers, (lower + i volume) and (upper + i volume). The
        # argument of their product is the sum, so one atan2 suffices. The sum is at most pi, which is in the range of
        # atan2.
        return 2 * dr.atan2(volume * (lower + upper), lower * upper - dr.square(volume))

    def pdf(self, distance: Float, cosine: Float) -> Float:
        """Density (1/sr) of `sample` toward a point of the rectangle at `distance`, where |cos| is `cosine`."""
        return self.rectangle.pdf(dr.select(self.uniform, self.solid_angle, 0), distance, cosine)

    def sample(self, u: Float, v: Float) -> Sample:
        """A point of the rectangle from two numbers in [0, 1)."""
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
        uv = x / self.rectangle.length0, y / self.rectangle.length1
        return point, self.rectangle.normal, uv, self.pdf(distance, cosine)


@dataclass
class RectangularArea:
    """A rectangle as seen from a point, whose points are sampled uniformly by area."""

    rectangle: Rectangle
    origin: Point

    def pdf(self, distance: Float, cosine: Float) -> Float:
        """Density (1/sr) of `sample` toward a point of the rectangle at `distance`, where |cos| is `cosine`."""
        return self.rectangle.pdf_by_area(distance, cosine)

    def sample(self, u: Float, v: Float) -> Sample:
        """A point of the rectangle from two numbers in [0, 1)."""
        rectangle = self.rectangle
        point = rectangle.corner + rectangle.axis0 * (rectangle.length0 * u) + rectangle.axis1 * (rectangle.length1 * v)
        away = point - self.origin
        distance = dr.norm(away)
        pdf = self.pdf(distance, dr.abs(dr.dot(away, rectangle.normal)) / distance)
        return point, rectangle.normal, (u, v), pdf


@dataclass
class Ball:
    """A sphere in space: center, radius, side of the normal (1 outward, -1 inward), and axes of (u, v) if needed."""

    center: Point
    radius: Float
    side: Float
    axes: tuple[Vector, ...] = ()

    @staticmethod
    def of(mi: ModuleType, shape: Shape) -> Ball:
        """The ball of a Mitsuba `sphere`. It is kernel data, so moving the sphere does not recompile kernels."""
        zero, half, one = mi.Float(0), mi.Float(0.5), mi.Float(1)
        top, bottom = (shape.sample_position(zero, mi.Point2f(zero, v)).p for v in (zero, one))
        side = mi.Float(-1 if shape.has_flipped_normals() else 1)
        center = 0.5 * (top + bottom)
        radius = 0.5 * dr.norm(top - bottom)
        x, y = (shape.sample_position(zero, mi.Point2f(u, half)).p - center for u in (zero, mi.Float(0.25)))
        return Ball(center, radius, side, (x / radius, y / radius, (top - center) / radius))

    def uv(self, outward: Vector) -> tuple[Float, Float]:
        """(u, v) of the point with the outward normal `outward`, as in ray intersections; (0, 0) without axes."""
        if not self.axes:
            return type(self.radius)(0), type(self.radius)(0)
        x, y, z = (dr.dot(outward, axis) for axis in self.axes)
        azimuth = dr.atan2(y, x) * (0.5 * dr.inv_pi)
        return dr.select(azimuth < 0, azimuth + 1, azimuth), dr.safe_acos(z) * dr.inv_pi


class SphericalCap:
    """A ball as seen from a point: the cone of directions that it subtends, and uniform sampling of these directions.

    A point of the ball is computed from its direction by the law of sines (PBRT4, sec. 6.2.4), without cancellation.
    For origins on the surface and inside, points are sampled uniformly by area, so that all samples have the same
    weight on a diffuse inner side. The outer side cannot illuminate itself; sampling the cone would give a distance of
    0, and a direction dominated by rounding errors.
    """

    def __init__(self, mi: ModuleType, ball: Ball, origin: Point):
        self.mi, self.ball, self.origin = mi, ball, origin
        away = ball.center - origin
        distance = dr.norm(away)
        self.axis = dr.select(distance > 0, away / distance, mi.Vector3f(0, 0, 1))
        reach = dr.max(dr.abs(ball.center)) + ball.radius
        self.outside = distance - ball.radius > TOUCHING * ball.radius + ROUNDING * reach
        self.distance = dr.select(self.outside, distance, 2 * ball.radius)
        sine2 = dr.square(ball.radius / self.distance)
        self.height = sine2 / (1 + dr.sqrt(1 - sine2))  # 1 - cosine of the half angle of the cone

    @property
    def solid_angle(self) -> Float:
        """The solid angle (sr) of the ball as seen from outside."""
        return 2 * dr.pi * self.height

    def pdf(self, distance: Float, cosine: Float) -> Float:
        """Density (1/sr) of `sample` toward a point of the ball at `distance`, where |cos| is `cosine`."""
        area = 4 * dr.pi * dr.square(self.ball.radius)
        by_area = dr.square(distance) * dr.rcp(dr.maximum(cosine * area, 1e-30))
        return dr.select(self.outside, dr.rcp(self.solid_angle), by_area)

    def sample(self, u: Float, v: Float) -> Sample:
        """A point of the ball from two numbers in [0, 1)."""
        mi, ball = self.mi, self.ball
        low = self.height * u
        sine = dr.safe_sqrt(low * (2 - low))
        far = self.distance * (1 - low) - dr.safe_sqrt(dr.square(ball.radius) - dr.square(self.distance * sine))
        across = dr.minimum(far * sine / ball.radius, 1)
        z = dr.select(self.outside, -dr.safe_sqrt(1 - dr.square(across)), 1 - 2 * u)
        across = dr.select(self.outside, across, dr.safe_sqrt(1 - dr.square(z)))
        s, c = dr.sincos(2 * dr.pi * v)
        normal = mi.Vector3f(mi.Frame3f(self.axis).to_world(mi.Vector3f(c * across, s * across, z)))
        point = dr.fma(normal, ball.radius, ball.center)
        away = point - self.origin
        distance = dr.norm(away)
        pdf = self.pdf(distance, dr.abs(dr.dot(away, normal)) / distance)
        return point, normal * ball.side, ball.uv(normal), pdf


LampView = SphericalRectangle | RectangularArea | SphericalCap


def is_sphere(mi: ModuleType, shape: Shape) -> bool:
    """Whether a shape is a `sphere`."""
    return bool(shape.shape_type() == mi.ShapeType.Sphere.value)


def is_rectangle(mi: ModuleType, shape: Shape) -> bool:
    """Whether a shape is a `rectangle` with perpendicular edges, that is, not sheared."""
    if shape is None or shape.shape_type() != mi.ShapeType.Rectangle.value:
        return False
    rectangle = Rectangle.of(mi, shape)
    return abs(float(dr.dot(rectangle.axis0, rectangle.axis1)[0])) < STRAIGHT
