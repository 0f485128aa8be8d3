"""Ray tracing in a periodic patch of a surface: Mitsuba intersects the facets, and a Dr.Jit loop traces the bounces."""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from ...bridge import engine
from ...bridge.types import Scene
from ...material import BSDF, guide_search
from ...ops import backend
from ..surfaces.base import Patch

Floats = NDArray[np.float64]
Kernel: TypeAlias = Any  # a Dr.Jit value in a kernel

MAX_BOUNCES = 256
MAX_STEPS = 4096  # maximum number of bounces and crossings of a periodic boundary
OFFSET = 1e-6  # distance of a ray's origin from its facet, relative to the period's extent: a few float32 ulps
UNDERWAY, AWAY, DARK, LOST = 0, 1, 2, 3  # states of a ray; DARK: absorbed, LOST: below the surface due to rounding
LANES = 1 << 21  # rays per kernel launch, which bounds memory


class Ground(NamedTuple):
    """A patch as a Mitsuba scene.

    scene   the triangles of the patch
    size    extent of the period in x and y
    top     height at which rays start and escape
    offset  distance of a ray's origin from its facet
    """

    scene: Scene
    size: tuple[float, float]
    top: float
    offset: float


def ground(patch: Patch) -> Ground:
    """Build the Mitsuba scene of a patch, with its acceleration structure."""
    mi = engine.load()
    mesh = mi.Mesh("patch", len(patch.vertices), len(patch.faces))
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = mi.Float(patch.vertices.ravel().astype(np.float32))
    parameters["faces"] = mi.UInt32(patch.faces.ravel().astype(np.uint32))
    parameters.update()
    extent = max(*patch.size, float(np.abs(patch.vertices).max()))
    return Ground(
        mi.load_dict({"type": "scene", "patch": mesh}), patch.size, patch.top + 1e-4 * extent, OFFSET * extent
    )


class Left(NamedTuple):
    """The final state of each ray. Rays that neither escaped nor were lost have been absorbed.

    angle      index of the angle of incidence
    direction  final direction, rotated so that the light comes from above the x axis
    weight     remaining throughput, a color
    bounces    number of facets hit
    escaped    whether it left the surface
    lost       whether rounding errors moved it below the surface
    """

    angle: Kernel
    direction: Kernel
    weight: Kernel
    bounces: Kernel
    escaped: Kernel
    lost: Kernel


class Box(NamedTuple):
    """One period of a patch as kernel values: half extents, height of the top, and offset of ray origins."""

    half_x: Kernel
    half_y: Kernel
    top: Kernel
    offset: Kernel


class State(NamedTuple):
    """A ray during tracing: position, direction, throughput, number of facets hit, number of steps, and state."""

    place: Kernel
    along: Kernel
    weight: Kernel
    bounces: Kernel
    steps: Kernel
    state: Kernel
    rng: Kernel


def shoot(on: Ground, facet: BSDF, cosines: Kernel, each: int, first: int, count: int, seed: int) -> Left:
    """Trace rays from above the surface until they leave it or are absorbed.

    facet    material of the facets, bound to the types of the variant
    cosines  cosines of the angles of incidence; azimuths and positions are uniformly distributed
    each     rays per angle of incidence; rays are numbered angle by angle
    first    index of the first of `count` rays
    seed     seed of the random numbers
    """
    mi = engine.load()
    number = dr.arange(mi.UInt32, count) + dr.opaque(mi.UInt32, first)
    angle = number // dr.opaque(mi.UInt32, each)
    rng = mi.PCG32(size=count, initstate=dr.opaque(mi.UInt64, seed), initseq=dr.opaque(mi.UInt64, first))
    u, v = _positions(number, each, rng)
    turn = rng.next_float32()
    cos = dr.gather(mi.Float, cosines, angle)
    box = Box(*(dr.opaque(mi.Float, x) for x in (0.5 * on.size[0], 0.5 * on.size[1], on.top, on.offset)))
    sin_phi, cos_phi = dr.sincos(2.0 * dr.pi * turn)
    sin = dr.safe_sqrt(1.0 - dr.square(cos))
    place = mi.Point3f((2.0 * u - 1.0) * box.half_x, (2.0 * v - 1.0) * box.half_y, box.top)
    along = mi.Vector3f(-sin * cos_phi, -sin * sin_phi, -cos)
    start = State(place, along, mi.Color3f(1.0), mi.UInt32(0), mi.UInt32(0), mi.UInt32(UNDERWAY), rng)
    left = State(
        *dr.while_loop(
            tuple(start),
            lambda *now: now[5] == UNDERWAY,
            lambda *now: tuple(_step(on.scene, facet, box, State(*now))),
            labels=State._fields,
            label="goniometer",
        )
    )
    along = left.along
    direction = mi.Vector3f(along.x * cos_phi + along.y * sin_phi, along.y * cos_phi - along.x * sin_phi, along.z)
    return Left(angle, direction, left.weight, left.bounces, left.state == AWAY, left.state == LOST)


def _step(scene: Scene, facet: BSDF, box: Box, now: State) -> State:
    """Advance a ray to the next facet, across the boundary of the period, or to the top, where it escapes."""
    mi = engine.load()
    place, along, weight, bounces, steps, state, rng = now
    # a ray may reach a boundary of the period or the top before it hits a facet
    wall_x, wall_y = _boundary(place.x, along.x, box.half_x), _boundary(place.y, along.y, box.half_y)
    wall = dr.maximum(dr.minimum(wall_x, wall_y), 0.0)
    roof = dr.select(along.z > 0.0, (box.top - place.z) / along.z, dr.inf)
    ray = mi.Ray3f(place, along)
    ray.maxt = dr.minimum(wall, roof)
    hit = scene.ray_intersect_preliminary(ray, False, True)
    is_hit = hit.is_valid()
    away = ~is_hit & (roof <= wall)
    through = ~is_hit & ~away
    # scattering at the facet
    si = hit.compute_surface_interaction(ray, mi.RayFlags.Minimal, is_hit)
    frame = mi.Frame3f(si.n)
    back = frame.to_local(-along)
    drawn = facet.sample(back, mi.Point3f(rng.next_float32(), rng.next_float32(), rng.next_float32()))
    onward = mi.Vector3f(drawn.wi)
    behind = is_hit & (back.z <= 0.0)
    on_front = is_hit & ~behind
    dark = on_front & ~((drawn.pdf > 0.0) & (onward.z > 0.0))
    weight = dr.select(on_front, weight * dr.select(dark, 0.0, mi.Color3f(drawn.weight)), weight)
    bounces = dr.select(on_front, bounces + 1, bounces)
    along_next = dr.select(on_front, dr.normalize(frame.to_world(onward)), along)
    # a ray that crosses a boundary enters on the opposite side
    beyond = _wrapped(place + along * wall, along, wall_x <= wall_y, box.half_x, box.half_y)
    place = dr.select(on_front, si.p + si.n * box.offset, dr.select(through, beyond, place))
    steps = steps + 1
    over = (bounces >= MAX_BOUNCES) | (steps >= MAX_STEPS)
    state = dr.select(behind | (over & ~away), LOST, dr.select(dark, DARK, dr.select(away, AWAY, state)))
    return State(place, along_next, weight, bounces, steps, mi.UInt32(state), rng)


def _positions(number: Kernel, each: int, rng: Kernel) -> tuple[Kernel, Kernel]:
    """Positions in the unit square along a Z-order curve.

    Neighboring rays hit the same facets, which makes tracing 3 times as fast.
    """
    mi = engine.load()
    along_curve = mi.Float64(number % dr.opaque(mi.UInt32, each)) + mi.Float64(rng.next_float32())
    index = mi.UInt32(dr.minimum(along_curve * dr.opaque(mi.Float64, 2.0**32 / each), 2.0**32 - 1.0))
    u, v = (2.0**-16 * (mi.Float(_every_other(index >> bit)) + rng.next_float32()) for bit in (0, 1))
    return u, v


def _boundary(x: Kernel, direction: Kernel, half: Kernel) -> Kernel:
    """Distance along a ray to the boundary of the period in one coordinate."""
    return dr.select(direction == 0.0, dr.inf, (dr.select(direction > 0.0, half, -half) - x) / direction)


def _wrapped(place: Kernel, along: Kernel, is_x: Kernel, half_x: Kernel, half_y: Kernel) -> Kernel:
    """A point on the boundary in x, if `is_x`, or in y, moved to the opposite side of the period."""
    place.x = dr.select(is_x, dr.select(along.x > 0.0, -half_x, half_x), place.x)
    place.y = dr.select(is_x, place.y, dr.select(along.y > 0.0, -half_y, half_y))
    return place


def _every_other(bits: Kernel) -> Kernel:
    """Bits 0, 2, 4, ... as a 16-bit number: one coordinate of a point on the Z-order curve."""
    for shift, mask in ((0, 0x55555555), (1, 0x33333333), (2, 0x0F0F0F0F), (4, 0x00FF00FF), (8, 0x0000FFFF)):
        bits = (bits | (bits >> shift)) & mask
    return bits


def bound(facet: BSDF) -> BSDF:
    """Bind the material of the facets to Mitsuba's types, so that it can be used in symbolic loops."""
    mi = engine.load()
    guide_search.prepare(facet)
    return facet.bind(backend.types_like(mi.Float))
