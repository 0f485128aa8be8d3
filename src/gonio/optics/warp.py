"""Maps from the unit square to directions, each with its density."""

from __future__ import annotations

from .. import ops
from ..ops import Direction, Scalar, dot, function, safe_sqrt, sincos, vec3
from .special import exprel, power_of_cosine


@function
def square_to_cosine_hemisphere(u1: Scalar, u2: Scalar) -> Direction:
    """A direction with density cos(theta) / pi about +z, by Malley's method (PBRT4)."""
    r = ops.sqrt(u1)
    phi = (2.0 * ops.pi) * u2
    s, c = sincos(phi)
    return vec3(r * c, r * s, safe_sqrt(1.0 - u1))


def square_to_cosine_hemisphere_pdf(w: Direction) -> Scalar:
    """cos(theta) / pi above the horizon, 0 below; 1/sr."""
    return ops.maximum(w.z, 0.0) * ops.inv_pi


@function
def square_to_power_lobe(u1: Scalar, u2: Scalar, p: Scalar) -> Direction:
    """A direction about +z with density (p + 1) / (2 pi) cos(theta)^p on the upper hemisphere (Lafortune1994).

    sin^2 is computed from the logarithm of the cosine: at p = 1e5, the difference 1 - cos^2 has no correct digits in
    float32.
    """
    log_cos = ops.log(1.0 - u1) / (p + 1.0)
    cos_theta = ops.exp(log_cos)
    sin_theta = safe_sqrt(-2.0 * log_cos * exprel(2.0 * log_cos))
    phi = (2.0 * ops.pi) * u2
    s, c = sincos(phi)
    return vec3(sin_theta * c, sin_theta * s, cos_theta)


@function
def square_to_power_lobe_pdf(cos_theta: Scalar, p: Scalar) -> Scalar:
    """(p + 1) / (2 pi) cos(theta)^p above the horizon, 0 below; 1/sr."""
    return (p + 1.0) * (0.5 * ops.inv_pi) * ops.pow(cos_theta, p)


@function
def power_about(axis: Direction, w: Direction, p: Scalar) -> Scalar:
    """(axis.w)^p, computed from |axis - w|: near the peak, the dot product is rounded too coarsely for large p."""
    off = w - axis
    versine = 0.5 * dot(off, off)
    return power_of_cosine(dot(axis, w), versine * (2.0 - versine), p)


@function
def to_frame(axis: Direction, w: Direction) -> Direction:
    """w transformed from a frame about +z to one about a unit axis; the basis is discontinuous only at axis = -z
    (Duff2017)."""
    side = ops.copysign(ops.ones_like(axis.z), axis.z)
    a = -1.0 / (side + axis.z)
    b = axis.x * axis.y * a
    s = vec3(1.0 + side * axis.x * axis.x * a, side * b, -side * axis.x)
    t = vec3(b, side + axis.y * axis.y * a, -axis.y)
    return s * w.x + t * w.y + axis * w.z
