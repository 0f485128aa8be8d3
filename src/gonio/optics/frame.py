"""The local frame: +z is the shading normal and x the tangent; directions are unit vectors away from the surface."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import ops
from ..ops import Direction, Mask, Pair, Scalar, dot, function, sincos, sqr, vec3, where


@function
def reflect(w: Direction, m: Direction) -> Direction:
    """w reflected about the normal m: 2 (w.m) m - w."""
    return m * (2.0 * dot(w, m)) - w


def mirror(w: Direction) -> Direction:
    """w reflected about the surface normal z."""
    return vec3(-w.x, -w.y, w.z)


@function
def refract(w: Direction, m: Direction, cos_t: Scalar, eta: Scalar) -> Direction:
    """w refracted at a facet with normal m (on w's side) by Snell's law, eta sin t_t = sin t_w.

    cos_t  cosine of the transmitted direction, positive, from `fresnel.cos_transmitted`
    eta    index on the far side divided by the index on w's side
    """
    return m * (dot(w, m) / eta - cos_t) - w * (1.0 / eta)


def spherical_direction(sin_theta: Scalar, cos_theta: Scalar, phi: Scalar) -> Direction:
    """The direction with polar angle theta, given by its sine and cosine, and azimuth phi. For NumPy arrays, see
    `spherical_array`.

    Recorded formulas repeat these lines instead of calling this function, because the recorder would use its variable
    names.
    """
    s, c = sincos(phi)
    return vec3(sin_theta * c, sin_theta * s, cos_theta)


def spherical_array(sin_theta: ArrayLike, cos_theta: ArrayLike, phi: ArrayLike) -> NDArray[np.float64]:
    """`spherical_direction` for NumPy arrays that broadcast: directions, (..., 3)."""
    parts = sin_theta * np.cos(phi), sin_theta * np.sin(phi), cos_theta
    return np.stack(np.broadcast_arrays(*parts), axis=-1)


def angles_of_array(w: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """theta in [0, pi] and phi in (-pi, pi] of directions (..., 3), each (...); accurate near the normal."""
    return np.arctan2(np.hypot(w[..., 0], w[..., 1]), w[..., 2]), np.arctan2(w[..., 1], w[..., 0])


def normal_like(like: Direction) -> Direction:
    """The surface normal (0, 0, 1), repeated for every ray of `like`."""
    zero = ops.zeros_like(like.z)
    return vec3(zero, zero, 1.0 + zero)


@function
def rotate(w: Direction, rotation: Pair | None) -> Direction:
    """w in a frame rotated about z by an angle given as (cos, sin)."""
    if rotation is None:  # decided in Python, so that no rotation is compiled
        return w
    return vec3(rotation.x * w.x + rotation.y * w.y, rotation.x * w.y - rotation.y * w.x, w.z)


@function
def rotate_back(w: Direction, rotation: Pair | None) -> Direction:
    """The inverse of `rotate`."""
    if rotation is None:
        return w
    return vec3(rotation.x * w.x - rotation.y * w.y, rotation.x * w.y + rotation.y * w.x, w.z)


@function
def azimuth(w: Direction) -> Pair:
    """(cos, sin) of the azimuth of w, as an argument of `rotate`; (1, 0) along the normal, where it is undefined."""
    length2 = sin2(w)
    some = length2 > TINY
    over = ops.rsqrt(ops.where(some, length2, 1.0))
    return ops.vec2(ops.where(some, w.x * over, 1.0), ops.where(some, w.y * over, 0.0))


def sin2(w: Direction) -> Scalar:
    """Squared sine of the angle to the normal, computed from x and y, because 1 - z^2 would cancel near the normal."""
    return sqr(w.x) + sqr(w.y)


@function
def half_vector(wo: Direction, wi: Direction) -> Direction:
    """Unit normal of the facet that mirrors wo into wi; 0 for wo = -wi, where it is undefined."""
    h = wo + wi
    length2 = dot(h, h)
    return h * ops.rsqrt(ops.maximum(length2, TINY))


# Lower bound of a squared length. Quotients square its root again, which must not underflow: the smallest normal
# float32 is 1.2e-38.
TINY = 1e-30


class _Lit(NamedTuple):
    above: Mask
    wo: Direction
    wi: Direction


def lit(wo: Direction, wi: Direction) -> _Lit:
    """Whether both directions are above the surface, then wo and wi; if either is below, both are replaced by the
    normal.

    Without the replacement, masked lanes could introduce infinity or the root of a negative number into a gradient.
    """
    above = (wo.z > 0.0) & (wi.z > 0.0)
    return _Lit(above, where(above, wo, normal_like(wo)), where(above, wi, normal_like(wi)))
