"""Angular coordinates of tables, computed accurately near the normal and at grazing angles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .. import ops
from ..ops import Direction, Scalar, backend, dot, function, sqr, vec3, where

Floats = NDArray[np.float64]


@function
def elevation(w: Direction) -> Scalar:
    """The angle between a direction and the normal, in [0, pi]."""
    return ops.atan2(ops.safe_sqrt(sqr(w.x) + sqr(w.y)), w.z)


@function
def azimuth(w: Direction) -> Scalar:
    """The azimuth of a direction about the normal, measured from x, in (-pi, pi]; 0 at the normal."""
    at_pole = (w.x == 0.0) & (w.y == 0.0)
    return where(at_pole, 0.0, ops.atan2(w.y, where(at_pole, 1.0, w.x)))


@function
def between(wo: Direction, wi: Direction) -> Scalar:
    """|phi_i - phi_o|, in [0, pi]; 0 if one of the directions is the normal."""
    cross = wo.x * wi.y - wo.y * wi.x
    along = wo.x * wi.x + wo.y * wi.y
    none = (cross == 0.0) & (along == 0.0)
    return where(none, 0.0, ops.atan2(ops.abs(cross), where(none, 1.0, along)))


@function
def half_difference(wo: Direction, wi: Direction) -> tuple[Scalar, Scalar, Scalar]:
    """theta_h, theta_d and phi_d of a pair of directions (Rusinkiewicz1998); phi_d is that of wi, in (-pi, pi].

    sin theta_d = |wi - wo| / 2 and cos theta_d = |wi + wo| / 2 avoid cancellation. phi_d is the azimuth of wi - wo in
    the frame whose x-z plane contains the half vector.
    """
    flat, length, along, side = _half_frame(wo, wi)
    theta_h = ops.atan2(flat, wo.z + wi.z)
    d = wi - wo
    theta_d = ops.atan2(ops.safe_sqrt(dot(d, d)), length)
    none = (along == 0.0) & (side == 0.0)
    return theta_h, theta_d, where(none, 0.0, ops.atan2(side, where(none, 1.0, along)))


def half_difference_arrays(wo: Floats, wi: Floats) -> tuple[Floats, Floats, Floats]:
    """`half_difference` for NumPy arrays, (N, 3) each."""
    if len(wo) == 0:  # Dr.Jit cannot broadcast empty arrays with arrays of one entry
        return np.empty(0), np.empty(0), np.empty(0)
    types = backend.types("float64")
    angles = half_difference(*(backend.vector_of(w, 3, types) for w in (wo, wi)))
    backend.drjit().eval(angles)
    theta_h, theta_d, phi_d = (backend.to_numpy(angle, len(wo)) for angle in angles)
    return theta_h, theta_d, phi_d


@function
def half_difference_vectors(wo: Direction, wi: Direction) -> tuple[Direction, Direction]:
    """The half vector, rotated about the normal into the x-z plane, and the difference vector, which is wi in the frame
    of the half vector: unit vectors with the angles of `half_difference`."""
    flat, length, along, side = _half_frame(wo, wi)
    scale = 1.0 / where(length == 0.0, 1.0, length)
    return vec3(flat * scale, 0.0 * flat, (wo.z + wi.z) * scale), vec3(0.5 * along, 0.5 * side, 0.5 * length)


@function
def _half_frame(wo: Direction, wi: Direction) -> tuple[Scalar, Scalar, Scalar, Scalar]:
    """Two lengths of h = wo + wi, that of its projection onto the surface and its own, and two components of wi - wo.

    These are the components along the first two axes of the frame of h, (cos theta_h c, cos theta_h s, -sin theta_h)
    and (-s, c, 0).
    """
    h, d = wo + wi, wi - wo
    flat = ops.safe_sqrt(sqr(h.x) + sqr(h.y))
    length = ops.safe_sqrt(dot(h, h))
    pole = flat == 0.0
    across = where(pole, 1.0, flat)
    c, s = where(pole, 1.0, h.x / across), where(pole, 0.0, h.y / across)
    some = where(length == 0.0, 1.0, length)
    along = (h.z * (c * d.x + s * d.y) - flat * d.z) / some
    return flat, length, along, c * d.y - s * d.x


def direction(theta: Scalar, phi: Scalar) -> Direction:
    """The unit vector at an angle theta to the normal and an azimuth phi."""
    (s, c), (sin_phi, cos_phi) = ops.sincos(theta), ops.sincos(phi)
    return vec3(s * cos_phi, s * sin_phi, c)
