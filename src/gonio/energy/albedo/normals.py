"""The quadrature rule for integrals over the normals of microfacets: its variables, and the points where it is split.

**The boundary.** In the plane of n and m, a reflection doubles angles. The projection of o onto this plane is at the
angle delta = atan(tan(theta_o) cos(phi_m)) to n, where phi_m is measured from o; the projection of i is at the angle
2 theta_m - delta, so i is above the surface if and only if theta_m < pi/4 + delta / 2. For such an m, o.m > 0 as
well. Inside the boundary, the integrand is smooth, so a Gauss-Legendre rule on an interval that ends there converges
geometrically.

**The variables.** Normals are expressed by their stretched slopes, tan(theta_m) (cos phi_m, sin phi_m) =
t (alpha_x cos b, alpha_y sin b), so that dm = alpha_x alpha_y cos^3(theta_m) t dt db. Then

  - o.m / (mu cos(theta_m)) = 1 + (S / mu) t cos(b - b_o), where S is the length of (alpha_x o_x, alpha_y o_y) and b_o
    its azimuth: anisotropy affects only the boundary and G;
  - t = sinh(x) assigns the same number of nodes to each octave of slope, from the peak through the long tail of GGX;
  - across b - b_o = +-pi/2, the boundary jumps from the complement of theta_o, which is small at grazing angles, to
    nearly pi/2, within an angle of about w = mu |(alpha_x sin b_o, alpha_y cos b_o)| / S, which is cot(theta_o) if the
    alphas are equal. With b - b_o = pi/2 - chi, chi = (pi/2) sinh(a x) / sinh(a) and sinh(a) = (pi/2) / w, the jump
    occupies as much of the range of x as all other angles;
  - where the azimuths of m and o are equal, the integrand has a kink at grazing angles. If the alphas are equal, this
    is at b = b_o, the end of both half turns; otherwise, it is nearby, and the half turns are chosen to end there.

**Glass.** The integrals for reflection and transmission are over the same normals, those visible from o:
theta_m < pi/2 + min(delta, 0). F has a square-root singularity at the critical angle, o.m = cos_c; along a stretched
azimuth, o.m = A cos(theta_m - delta), so it occurs at theta_m = delta +- acos(cos_c / A), where A = |cos delta|^-1 mu
is the length of the projection of o. The integral is split there and at the boundary of reflection; the azimuths are
split where A = cos_c, beyond which there is no total reflection. Each piece is parametrized by s^2 (3 - 2 s), in which
a square root at either end is smooth.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple, TypeAlias

import numpy as np

from ... import ops
from ...ops import Direction, Pair, Scalar, backend
from ...ops.backend import Array
from ...optics import frame
from ...optics.ndf import NDF
from ...optics.special import gauss

SMALLEST_MU = 1e-6  # the integrand contains 1 / mu: the limit mu -> 0 is evaluated at this value
SMALLEST_ALPHA = 1e-5


# (distribution, wo, normal m, o.m, alphas, eta) -> the integrands, without D
Integrand: TypeAlias = Callable[[NDF, Direction, Direction, Scalar, Pair, Array], tuple[Scalar, ...]]


@lru_cache
def longest_slope(ndf: NDF) -> float:
    """The stretched slope t that less than about 1e-9 of a distribution's normals exceed."""
    t = np.logspace(-1, 8, 400)
    kind = backend.types("float64")
    c = 1.0 / np.hypot(1.0, t)
    m = kind.vec3(kind.float(t * c), kind.float(0.0 * t), kind.float(c))
    D: Array = ndf.D(m, kind.vec2(1.0, 1.0))
    density = np.asarray(D.numpy()) * c**4 * np.pi * t**2
    beyond = np.flatnonzero(density < 1e-9)
    return float(t[beyond[0]]) if len(beyond) else float(t[-1])


def over_azimuths(
    ndf: NDF, terms: Integrand, channels: int, points: list[np.ndarray], nodes: tuple[int, int],
    sides: int, through: bool,
) -> list[np.ndarray]:  # fmt: skip
    """Integrals over normals, one per point. Each lane loops over the slopes of one point and one stretched azimuth.

    points   mu, alpha_x, alpha_y, phi and eta of each point
    nodes    numbers of nodes in azimuth and slope
    sides    number of half turns to integrate over: 1 if the two are equal, else 2
    through  whether to include all normals visible from o, as for glass
    """
    dr = backend.drjit()
    kind = backend.types("float64")
    n_azimuth, n_slope = nodes
    block = n_azimuth * sides
    index = dr.arange(kind.module.UInt32, len(points[0]) * block)
    mu, ax, ay, phi, eta = [dr.gather(kind.float, kind.float(p), index // block) for p in points]
    azimuth = index % block
    at = azimuth % n_azimuth
    side = dr.select(azimuth < n_azimuth, kind.float(1.0), kind.float(-1.0))
    rule = gauss(n_azimuth) if not through else _in_three(n_azimuth // 3)
    chi_node, chi_weight = [dr.gather(kind.float, kind.float(a), at) for a in rule]
    limit = dr.opaque(kind.float, longest_slope(ndf))
    view = _view(mu, kind.vec2(ax, ay), phi)
    eta = eta if through else None
    slope, weight = _azimuth(view, eta, chi_node, chi_weight, side)
    sums = _over_slopes(ndf, terms, channels, view, eta, slope, _cuts(view, eta, slope, limit), n_slope)
    factor = weight * view.alpha.x * view.alpha.y / view.mu
    scaled = [total * factor for total in sums]
    dr.eval(scaled)  # in one call, because each reduction would otherwise run the loop again
    return [np.asarray((dr.block_sum(total, block) * (2.0 / sides)).numpy()) for total in scaled]


class _View(NamedTuple):
    """A direction o per lane, and derived values.

    sin_o           sine of the angle between o and the normal
    cos_bo, sin_bo  cosine and sine of the azimuth b_o of the stretched o
    length          length of the stretched o along the surface
    """

    mu: Array
    alpha: Array
    phi: Array
    wo: Array
    sin_o: Array
    cos_bo: Array
    sin_bo: Array
    length: Array


def _view(mu: Array, alpha: Array, phi: Array) -> _View:
    dr = backend.drjit()
    mu = dr.maximum(mu, SMALLEST_MU)
    alpha = type(alpha)(dr.maximum(alpha.x, SMALLEST_ALPHA), dr.maximum(alpha.y, SMALLEST_ALPHA))
    sin_o = dr.sqrt((1.0 - mu) * (1.0 + mu))
    wo = frame.spherical_direction(sin_o, mu, phi)
    stretched = ops.vec2(alpha.x * wo.x, alpha.y * wo.y)
    length = dr.norm(stretched)
    cos_bo = dr.select(length > 0.0, stretched.x / length, 1.0)
    sin_bo = dr.select(length > 0.0, stretched.y / length, 0.0)
    return _View(mu, alpha, phi, wo, sin_o, cos_bo, sin_bo, length)


def _azimuth(view: _View, eta: Array | None, chi: Array, chi_weight: Array, side: Array) -> tuple[Array, Array]:
    """For one stretched azimuth, the slope of the normals at t = 1, and the weight."""
    dr = backend.drjit()
    wo, alpha, cos_bo, sin_bo = view.wo, view.alpha, view.cos_bo, view.sin_bo
    # chi = (pi/2) sinh(a x) / sinh(a), x in [-1, 1]; the width of the jump is limited to 1, at which there is no jump
    across = dr.norm(ops.vec2(alpha.x * sin_bo, alpha.y * cos_bo))
    leap = dr.minimum(view.mu * across / dr.maximum(view.length, 1e-9 * across), 1.0)
    a = _asinh(0.5 * ops.pi / leap)
    # the kink at which the azimuths of m and o are equal is at the angle beta from b_o
    edge_x, edge_y = wo.x / alpha.x, wo.y / alpha.y
    beta = dr.atan2(edge_y * cos_bo - edge_x * sin_bo, edge_x * cos_bo + edge_y * sin_bo)
    beta = dr.select(view.length > 0.0, beta, 0.0)
    top = _signed_asinh((0.5 * ops.pi - side * beta) / leap) / a
    if eta is None:
        x, stretch = (top + 1.0) * chi - 1.0, 0.5 * (top + 1.0)
    else:
        x, stretch = _in_pieces(chi, top, *_glass_ends(view, eta, side, leap, a, top))
    grow = dr.exp(a * x)
    angle = 0.5 * leap * (grow - 1.0 / grow)
    weight = chi_weight * stretch * (leap * a) * (grow + 1.0 / grow)
    # the unit vector of b = b_o + pi/2 - chi, stretched
    sin_b, cos_b = side * dr.cos(angle), dr.sin(angle)
    slope = ops.vec2(alpha.x * (cos_b * cos_bo - sin_b * sin_bo), alpha.y * (sin_b * cos_bo + cos_b * sin_bo))
    return slope, weight


def _glass_ends(view: _View, eta: Array, side: Array, leap: Array, a: Array, top: Array) -> list[Array]:
    """The values of x, high and low, at which A = cos_c, that is, cos(phi_m - phi_o) = +-q; arbitrary if there are
    none."""
    dr = backend.drjit()
    cos_c = dr.sqrt(dr.maximum(1.0 - dr.square(eta), 0.0))
    q = dr.sqrt(dr.maximum(dr.square(cos_c) - dr.square(view.mu), 0.0)) / dr.maximum(view.sin_o, 1e-9)
    cut = (cos_c > view.mu) & (q < 1.0)
    turn = dr.acos(dr.minimum(q, 1.0))
    ends = []
    for psi, fallback in ((turn, top / 3.0), (ops.pi - turn, -1.0 / 3.0)):
        s, c = dr.sincos(view.phi + side * psi)
        bx, by = c / view.alpha.x, s / view.alpha.y
        relative = side * dr.atan2(by * view.cos_bo - bx * view.sin_bo, bx * view.cos_bo + by * view.sin_bo)
        chi_cut = 0.5 * ops.pi - relative
        ends.append(dr.select(cut, _signed_asinh(chi_cut / leap) / a, fallback))
    return ends


def _in_pieces(chi: Array, top: Array, high: Array, low: Array) -> tuple[Array, Array]:
    """x, and half its derivative, in the pieces [-1, low], [low, high] and [high, top]; chi is the index of the piece
    plus the position in it."""
    dr = backend.drjit()
    piece = dr.floor(chi)
    start = dr.select(piece < 0.5, -1.0, dr.select(piece < 1.5, low, high))
    stop = dr.select(piece < 0.5, low, dr.select(piece < 1.5, high, top))
    s = chi - piece
    return start + (stop - start) * s * s * (3.0 - 2.0 * s), 3.0 * s * (1.0 - s) * (stop - start)


def _cuts(view: _View, eta: Array | None, slope: Array, limit: Array) -> list[Array]:
    """The ends of the pieces of x along one azimuth, in ascending order."""
    dr = backend.drjit()
    spread = dr.norm(slope)
    # tan(delta) = tan(theta_o) cos(phi_m - phi_o)
    delta = dr.atan((slope.x * view.wo.x + slope.y * view.wo.y) / (spread * view.mu))

    def x_at(theta: Array) -> Array:
        """The variable x for an angle of the normal, limited to the end of the distribution."""
        inside = theta < 0.5 * ops.pi - 1e-9
        t = dr.select(inside, dr.tan(dr.select(inside, theta, 0.0)) / spread, limit)
        return _asinh(dr.clip(t, 0.0, limit))

    mirror_end = x_at(0.25 * ops.pi + 0.5 * delta)
    zero = type(view.mu)(0.0)
    if eta is None:
        return [zero, mirror_end]
    end = x_at(0.5 * ops.pi + dr.minimum(delta, 0.0))
    middle = dr.minimum(mirror_end, end)
    cos_c = dr.sqrt(dr.maximum(1.0 - dr.square(eta), 0.0))
    reach = cos_c * dr.cos(delta) / view.mu  # cos_c / A, because A cos(delta) = mu
    partly = (eta < 1.0) & (reach < 1.0)
    half = dr.acos(dr.minimum(reach, 1.0))
    low, high = [dr.minimum(x_at(dr.maximum(delta + s * half, 0.0)), end) for s in (-1.0, 1.0)]
    low, high = dr.select(partly, low, 0.3 * end), dr.select(partly, high, 0.6 * end)
    # a narrow distribution has 90 % of its normals within t = 3
    inner = dr.minimum(1.8, 0.5 * end)
    cuts: list[Array] = []
    for cut in (low, middle, high, inner):  # insertion sort
        for place, earlier in enumerate(cuts):
            cuts[place], cut = dr.minimum(earlier, cut), dr.maximum(earlier, cut)
        cuts.append(cut)
    return [zero, *cuts, end]


def _over_slopes(
    ndf: NDF, terms: Integrand, channels: int, view: _View, eta: Array | None, slope: Array, cuts: list[Array],
    n_slope: int,
) -> list[Array]:  # fmt: skip
    """The integral over slopes along one stretched azimuth."""
    dr = backend.drjit()
    Float = type(view.mu)
    UInt = backend.types_like(Float).module.UInt32
    wo, alpha = view.wo, view.alpha
    node, node_weight = [Float(v) for v in gauss(n_slope)]

    def body(i: Array, *sums: Array) -> tuple[Array, ...]:
        s, ds = dr.gather(Float, node, i % n_slope), dr.gather(Float, node_weight, i % n_slope)
        if eta is not None:
            s, ds = s * s * (3.0 - 2.0 * s), ds * 6.0 * s * (1.0 - s)
        low, high = cuts[0], cuts[1]
        for piece in range(1, len(cuts) - 1):
            here = i >= piece * n_slope
            low, high = dr.select(here, cuts[piece], low), dr.select(here, cuts[piece + 1], high)
        grow = dr.exp(low + (high - low) * s)
        t, dt = 0.5 * (grow - 1.0 / grow), 0.5 * (grow + 1.0 / grow) * (high - low) * ds
        nx, ny = slope.x * t, slope.y * t
        cos_m = dr.rcp(dr.sqrt(1.0 + dr.square(nx) + dr.square(ny)))
        m = ops.vec3(nx * cos_m, ny * cos_m, cos_m)
        o_m = dr.maximum(ops.dot(wo, m), 0.0)
        density = ndf.D(m, alpha) * o_m * (dr.square(cos_m) * cos_m * t * dt)
        values = terms(ndf, wo, m, o_m, alpha, eta)
        return i + 1, *[total + density * value for total, value in zip(sums, values, strict=True)]

    count = n_slope * (len(cuts) - 1)
    zeros = tuple(Float(0.0) for _ in range(channels))
    labels = ("i", *(f"sum{c}" for c in range(channels)))
    _, *sums = dr.while_loop(state=(UInt(0), *zeros), cond=lambda i, *_: i < count, body=body, labels=labels)
    return list(sums)


def _in_three(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights of three pieces; each node is given as the index of its piece plus the position in the
    piece."""
    x, w = gauss(count)
    return np.concatenate([x, 1.0 + x, 2.0 + x]), np.tile(w, 3)


def _asinh(t: Array) -> Array:
    """asinh for t >= 0."""
    return ops.log(t + ops.sqrt(1.0 + t * t))


def _signed_asinh(t: Array) -> Array:
    return ops.copysign(_asinh(ops.abs(t)), t)
