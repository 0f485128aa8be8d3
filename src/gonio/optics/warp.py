"""Maps from the unit square to directions, each with its density."""

from __future__ import annotations

from .. import ops
from ..ops import Direction, Scalar, function, safe_sqrt, sincos, vec3


@function
def square_to_cosine_hemisphere(u1: Scalar, u2: Scalar) -> Direction:
    """A direction with density cos(theta) / pi about +z; Malley's method (PBRT4)."""
    r = ops.sqrt(u1)
    phi = (2.0 * ops.pi) * u2
    s, c = sincos(phi)
    return vec3(r * c, r * s, safe_sqrt(1.0 - u1))


def square_to_cosine_hemisphere_pdf(w: Direction) -> Scalar:
    """cos(theta) / pi above the horizon, 0 below; 1/sr."""
    return ops.maximum(w.z, 0.0) * ops.inv_pi


@function
def square_to_power_lobe(u1: Scalar, u2: Scalar, p: Scalar) -> Direction:
    """A direction about +z with density (p + 1) / (2 pi) cos(theta)^p on the upper hemisphere (Lafortune1994)."""
    cos_theta = ops.pow(1.0 - u1, 1.0 / (p + 1.0))
    sin_theta = safe_sqrt(1.0 - cos_theta * cos_theta)
    phi = (2.0 * ops.pi) * u2
    s, c = sincos(phi)
    return vec3(sin_theta * c, sin_theta * s, cos_theta)


@function
def square_to_power_lobe_pdf(cos_theta: Scalar, p: Scalar) -> Scalar:
    """(p + 1) / (2 pi) cos(theta)^p above, 0 below; 1/sr."""
    return (p + 1.0) * (0.5 * ops.inv_pi) * ops.pow(cos_theta, p)
