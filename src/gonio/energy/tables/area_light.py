"""Light from polygons by linearly transformed cosines (Heitz2016a), written in the operations that shaders can contain.

A lobe is approximated by E(o) D(i), where D is the cosine lobe transformed by a matrix W: D(i) = cos+(W i) |det
W| / (pi |W i|^3). The integral of D over a polygon P is the integral of the cosine lobe over the polygon W P, for which
Lambert's closed form exists.
"""

from __future__ import annotations

from ... import ops
from ...ops import (
    Direction,
    Scalar,
    Table,
    dot,
    function,
    inset,
    maximum,
    minimum,
    norm,
    safe_div,
    sqrt,
    vec3,
    where,
)

Corners = tuple[Direction, Direction, Direction, Direction]


@function
def edge(a: Direction, b: Direction) -> Scalar:
    """The contribution of an edge of a polygon to the integral of the cosine lobe, times 2 pi: the angle between the
    vectors a and b to its ends, times the z component of the unit normal of their plane."""
    across = vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
    sine = norm(across)
    return across.z * safe_div(ops.atan2(sine, where(sine > 0.0, dot(a, b), 1.0)), sine)


@function
def visible_edge(a: Direction, b: Direction) -> Scalar:
    """`edge` for the part of an edge above the horizon, z = 0."""
    cut = horizon(a, b)
    value = edge(where(a.z > 0.0, a, cut), where(b.z > 0.0, b, cut))
    return where(maximum(a.z, b.z) > 0.0, value, 0.0)


@function
def horizon(a: Direction, b: Direction) -> Direction:
    """A vector toward the point at which an edge crosses the horizon, for ends on different sides of the horizon."""
    return a * ops.abs(b.z) + b * ops.abs(a.z)


@function
def leaving(a: Direction, b: Direction) -> Direction:
    """`horizon` for an edge that crosses the horizon downward, else 0."""
    return where((a.z > 0.0) & (b.z <= 0.0), horizon(a, b), 0.0 * a)


@function
def cosine_quad(a: Direction, b: Direction, c: Direction, d: Direction) -> Scalar:
    """The fraction of the cosine lobe about +z that a convex quadrilateral covers; 1 for the hemisphere.

    a, b, c, d  vectors to the corners, in order; the part below z = 0 is cut off
    """
    total = visible_edge(a, b) + visible_edge(b, c) + visible_edge(c, d) + visible_edge(d, a)
    out = leaving(a, b) + leaving(b, c) + leaving(c, d) + leaving(d, a)
    back = leaving(b, a) + leaving(c, b) + leaving(d, c) + leaving(a, d)
    return ops.abs(total + edge(out, back)) * (0.5 / ops.pi)  # the cut along the horizon is an edge, too


@function
def to_cosine(first: Scalar, second: Scalar, third: Scalar, fourth: Scalar, wo: Direction, p: Direction) -> Direction:
    """W p, normalized. The rows of W are (first, 0, second), (0, 1, 0), (third, 0, fourth), in axes in which
    wo.y = 0."""
    size = sqrt(maximum(wo.x * wo.x + wo.y * wo.y, 1e-20))
    along = where(size > 1e-8, (p.x * wo.x + p.y * wo.y) / size, p.x)
    aside = where(size > 1e-8, (p.y * wo.x - p.x * wo.y) / size, p.y)
    return ops.normalize(vec3(first * along + second * p.z, aside, third * along + fourth * p.z))


def quad(inverse: tuple[Scalar, ...], wo: Direction, corners: Corners) -> Scalar:
    """The fraction of the lobe of W that a quadrilateral covers.

    inverse  the four numbers of W, as stored in the table
    corners  vectors to the corners, as in `cosine_quad`
    """
    first, second, third, fourth = inverse
    a, b, c, d = (to_cosine(first, second, third, fourth, wo, p) for p in corners)
    return cosine_quad(a, b, c, d)


@function
def in_view(wo: Direction, p: Direction) -> Direction:
    """p in the frame whose x axis lies below wo, for a surface that is symmetric about the planes of its axes.

    First, wo and p are mirrored so that wo lies between +x and +y.
    """
    size = sqrt(maximum(wo.x * wo.x + wo.y * wo.y, 1e-20))
    c = where(size > 1e-8, ops.abs(wo.x) / size, 1.0)
    s = where(size > 1e-8, ops.abs(wo.y) / size, 0.0)
    x, y = where(wo.x < 0.0, -p.x, p.x), where(wo.y < 0.0, -p.y, p.y)
    return vec3(x * c + y * s, y * c - x * s, p.z)


def turned_quad(inverse: tuple[Scalar, ...], wo: Direction, corners: Corners) -> Scalar:
    """`quad` for an anisotropic lobe.

    inverse  the entries of W by rows, without the center one, which is 1; W acts in the frame of `in_view`
    """
    a, b, c, d, e, f, g, h = inverse

    def transformed(p: Direction) -> Direction:
        v = in_view(wo, p)
        return ops.normalize(vec3(a * v.x + b * v.y + c * v.z, d * v.x + v.y + e * v.z, f * v.x + g * v.y + h * v.z))

    first, second, third, fourth = (transformed(p) for p in corners)
    return cosine_quad(first, second, third, fourth)


def turned_coordinates(table: Table, roughness: Scalar, wo: Direction) -> tuple[Scalar, ...]:
    """`coordinates` for a table in which an axis for the azimuth precedes the axis for the angle."""
    size = wo.x * wo.x + wo.y * wo.y
    azimuth = ops.atan2(ops.abs(wo.y), where(size > 1e-16, ops.abs(wo.x), 1.0)) * (2.0 / ops.pi)
    column = inset(sqrt(maximum(1.0 - wo.z, 0.0)), table.shape[-1])
    place = (inset(azimuth, table.shape[-2]), column)
    return (inset(minimum(roughness, 1.0), table.shape[0]), *place) if len(table.shape) == 3 else place


def coordinates(table: Table, roughness: Scalar, wo: Direction) -> tuple[Scalar, ...]:
    """The coordinates at which a table is read for a roughness and wo; if it has one row, only the coordinate of the
    angle."""
    column = inset(sqrt(maximum(1.0 - wo.z, 0.0)), table.shape[-1])
    return (inset(minimum(roughness, 1.0), table.shape[0]), column) if len(table.shape) == 2 else (column,)
