"""Importance sampling of any isotropic material that can be evaluated: a density found from its own values.

    guide = Guide(evaluate)                      # evaluate(wo, wi) -> luminance of f cos theta_i, (N,)
    guide.pdf(wo, wi);  guide.draw(wo, u)

For angles of view from the normal to grazing the luminance is laid over half vectors, in the unit square of
`tables.adaptive` (sqrt(2 theta_m / pi) and phi_m), times the solid angle of each place: there a narrow lobe has room,
and hardly moves with the view. Between nodes it is bilinear, and linear between angles of view.

A bilinear density is a sum of hats, one a node. So one angle of view of the two is drawn by chance, one of its nodes by
an alias table, a place below the node's hat: two fetches, however many nodes there are. Some samples are cosine's, so
that nothing is missed. `pdf` is that mixture's, exactly.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .. import ops
from ..ops import Direction, Scalar, floor, function, minimum, sqrt, vec3, where
from ..optics import warp as warps
from ..optics.frame import reflect
from .angles import between, direction, elevation
from .warp import named

Floats = NDArray[np.float64]

VIEWS = 24  # angles of view; between them densities are mixed
COLUMNS, ROWS = 96, 48  # of theta_m by its square root, and of phi_m over half a turn: its other half is mirrored
FINE = 4  # as many points a node and axis, so that a lobe between two nodes is seen
COSINE = 0.03  # share of samples by the cosine: what the guide misses weighs 1 / 0.03 at most
TINY = 1e-15  # where half vectors are the normal to float32's last digits, the density is high and the weight 0
LEAST = 1e-7  # a number that is drawn is no nearer to 0 and 1


def views(count: int) -> Floats:
    """Angles of view, closer together toward grazing, where lobes change: cos theta = (1 - t)^2 at even t."""
    t = np.linspace(0.0, 1.0, count)
    # f cos theta_i is asked for a little above the horizon, where it still is what it tends to
    return np.arccos(np.maximum((1.0 - t) ** 2, 1e-4))


class Guide:
    """A density over directions for each direction of view, from the luminance of f cos theta_i.

    evaluate       (wo, wi) -> luminance (N,), of unit vectors (N, 3) above the surface, alike under a turn about the
                   normal; of what differs from its mirror image the mean is taken
    count          angles of view that are tabulated
    columns, rows  nodes along the half vector's angle and azimuth
    cosine         share of samples by the cosine
    """

    def __init__(
        self,
        evaluate: Callable[[Floats, Floats], Floats],
        count: int = VIEWS,
        columns: int = COLUMNS,
        rows: int = ROWS,
        cosine: float = COSINE,
    ) -> None:
        self.count, self.columns, self.rows, self.cosine = count, columns, rows, cosine
        density = _densities(evaluate, views(count), columns, rows)
        area = np.ones((rows, columns))  # of a node's hat, in cells: half of it at an edge
        area[[0, -1]] *= 0.5
        area[:, [0, -1]] *= 0.5
        density[:, :, 0] = 0.0  # as x^3, before it was averaged: at the normal the square has no solid angle
        total = np.einsum("vrc,rc->v", density, area)
        density[total <= 0.0, :, 1:] = 1.0  # black from there: any density will do
        total = np.einsum("vrc,rc->v", density, area)
        density *= ((rows - 1) * (columns - 1) / total)[:, None, None]
        corners = [density[:, r : rows - 1 + r, c : columns - 1 + c] for r in (0, 1) for c in (0, 1)]
        self._corners = named("guide", np.stack(corners, -1))
        chances = [alias((one * area).ravel()) for one in density]
        self._alias = named("guide_alias", np.array(chances).reshape(count, rows, columns, 2))

    def _views(self, wo: Direction) -> tuple[Scalar, Scalar]:
        """The tabulated angle of view before wo's, and the share of the next."""
        at = (1.0 - ops.safe_sqrt(minimum(wo.z, 1.0))) * (self.count - 1.0)
        view = minimum(floor(at), self.count - 2.0)
        return view, at - view

    @function
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """Density of `draw`, 1/sr."""
        h = wo + wi
        view, t = self._views(wo)
        x, y = _square(h, wo)
        at_x, at_y = x * (self.columns - 1.0), y * (self.rows - 1.0)
        column, row = minimum(floor(at_x), self.columns - 2.0), minimum(floor(at_y), self.rows - 2.0)
        tx, ty = at_x - column, at_y - row
        density: ops.Value = 0.0
        for step, share in ((0.0, 1.0 - t), (1.0, t)):
            low0, low1, high0, high1 = ops.fetch(self._corners, view + step, row, column)
            low, high = low0 * (1.0 - tx) + low1 * tx, high0 * (1.0 - tx) + high1 * tx
            density = density + share * (low * (1.0 - ty) + high * ty)
        guided = density * _per_solid_angle(x, h)
        return self.cosine * warps.square_to_cosine_hemisphere_pdf(wi) + (1.0 - self.cosine) * guided

    @function
    def draw(self, wo: Direction, u: Direction) -> tuple[Direction, Scalar]:
        """A direction and its density; below the surface the draw has failed."""
        view, t = self._views(wo)
        # u.x chooses cosine, the nearer or the farther angle of view, and the side; what is left of it a place below
        # the node's hat, and so does u.z. A place at the very edge, where the density is 0, is none.
        flat = u.x < self.cosine
        v = (u.x - self.cosine) * (1.0 / (1.0 - self.cosine))
        far = v < t
        chosen = view + where(far, 1.0, 0.0)
        v = 2.0 * where(far, ops.safe_div(v, t), ops.safe_div(v - t, 1.0 - t))
        left = v < 1.0
        v = ops.clamp(where(left, v, v - 1.0), LEAST, 1.0 - LEAST)
        # u.y chooses a node, or its alias
        count = float(self.rows * self.columns)
        at = u.y * count
        first = minimum(floor(at), count - 1.0)
        own, other = ops.fetch(self._alias, chosen, *self._node(first))
        row, column = self._node(where(at - first < own, first, other))
        x = _below_hat(v, column, self.columns) * (1.0 / (self.columns - 1.0))
        turn = where(left, ops.pi, -ops.pi) * (_below_hat(u.z, row, self.rows) * (1.0 / (self.rows - 1.0)))
        m = _turned(direction(x * x * (0.5 * ops.pi), turn), wo)
        wi = where(flat, warps.square_to_cosine_hemisphere(u.y, u.z), reflect(wo, m))
        return wi, where(wi.z > 0.0, self.pdf(wo, wi), 0.0)

    def _node(self, place: Scalar) -> tuple[Scalar, Scalar]:
        """Row and column of a node by its number."""
        row = floor((place + 0.5) * (1.0 / self.columns))
        return row, place - row * float(self.columns)


def alias(weights: Floats) -> Floats:
    """(share of its own, number of another) for each of N entries: an entry drawn evenly, and then kept with that share
    or exchanged for the other, has the probability of its weight (Walker1977).

    By sums instead of a list that is worked off: what the light entries lack is laid along what the heavy ones have too
    much of. A heavy entry that a light one exhausts lacks the rest itself, and takes it from the next heavy one.
    """
    share = weights * (len(weights) / weights.sum())
    share[np.argmax(share)] = max(float(share.max()), 1.0)  # one is heavy, whatever rounding says
    other = np.arange(len(weights))
    light, heavy = np.flatnonzero(share < 1.0), np.flatnonzero(share >= 1.0)
    lacking, excess = np.cumsum(1.0 - share[light]), np.cumsum(share[heavy] - 1.0)
    before = lacking - (1.0 - share[light])
    other[light] = heavy[np.minimum(np.searchsorted(excess, before, side="right"), len(heavy) - 1)]
    last = np.searchsorted(lacking, excess)  # the light entry that exhausts each heavy one
    ended = last < len(lacking)
    over = np.where(ended, lacking[np.minimum(last, len(lacking) - 1)] - excess, 0.0) if len(light) else 0.0 * excess
    share[heavy] = 1.0 - over
    other[heavy[:-1]] = heavy[1:]
    share[heavy[-1]] = 1.0  # what rounding has left over
    return np.stack([np.clip(share, 0.0, 1.0), other.astype(float)], -1)


def _densities(evaluate: Callable[[Floats, Floats], Floats], theta: Floats, columns: int, rows: int) -> Floats:
    """The luminance over the unit square of half vectors, (views, rows, columns), averaged around each node."""
    nx, ny = (columns - 1) * FINE + 1, (rows - 1) * FINE + 1
    x, phi = np.linspace(0.0, 1.0, nx), np.linspace(0.0, np.pi, ny)
    theta_m = x * x * (0.5 * np.pi)
    sin_m, cos_m = np.sin(theta_m), np.cos(theta_m)
    m = np.stack(np.broadcast_arrays(
        sin_m * np.cos(phi)[:, None], sin_m * np.sin(phi)[:, None], cos_m + 0.0 * phi[:, None]
    ), -1)  # fmt: skip
    found = np.empty((len(theta), rows, columns))
    for view, angle in enumerate(theta):
        wo = np.array([np.sin(angle), 0.0, np.cos(angle)])
        cos = m @ wo
        wi = 2.0 * cos[..., None] * m - wo
        lit = (cos > 0.0) & (wi[..., 2] > 0.0)
        value = np.zeros(lit.shape)
        views_, lights = np.broadcast_to(wo, (int(lit.sum()), 3)), wi[lit]
        both = evaluate(views_, lights) + evaluate(views_, lights * np.array([1.0, -1.0, 1.0]))
        value[lit] = np.maximum(0.5 * both, 0.0)
        value *= np.maximum(cos, 0.0) * x * sin_m
        found[view] = _averaged(_averaged(value, FINE).T, FINE).T
    return found


def _averaged(fine: Floats, steps: int) -> Floats:
    """Rows at every `steps`-th place, the mean of those around by the weights of a hat."""
    hat = 1.0 - np.abs(np.arange(1 - steps, steps)) / steps
    padded = np.pad(fine, ((steps - 1, steps - 1), (0, 0)))
    weight = np.pad(np.ones(len(fine)), steps - 1)
    rows = np.arange(0, len(fine), steps)
    total = sum(h * padded[rows + i] for i, h in enumerate(hat))
    return np.asarray(total / sum(h * weight[rows + i] for i, h in enumerate(hat))[:, None])


@function
def _square(h: Direction, wo: Direction) -> tuple[Scalar, Scalar]:
    """A half vector's place: the square root of its angle, and its azimuth from wo's over pi, without sign."""
    return sqrt(elevation(h) * (2.0 / ops.pi)), between(wo, h) * (1.0 / ops.pi)


@function
def _turned(m: Direction, wo: Direction) -> Direction:
    """m about the normal by wo's azimuth."""
    sin = ops.safe_sqrt(wo.x * wo.x + wo.y * wo.y)
    pole = sin == 0.0
    some = where(pole, 1.0, sin)
    c, s = where(pole, 1.0, wo.x / some), where(pole, 0.0, wo.y / some)
    return vec3(c * m.x - s * m.y, s * m.x + c * m.y, m.z)


@function
def _per_solid_angle(x: Scalar, h: Direction) -> Scalar:
    """du / d omega_i: over 2 pi^2 x sin theta_m for the square, each of whose points stands for two normals, and over
    4 (wi.m) for the mirroring; with m = h / |h| and wi.m = |h| / 2."""
    return 1.0 / ops.maximum((4.0 * ops.pi**2) * x * ops.safe_sqrt(h.x * h.x + h.y * h.y), TINY)


@function
def _below_hat(u: Scalar, node: Scalar, count: int) -> Scalar:
    """A place around a node, with the density of its hat: 1 - |distance|; on this side of an edge."""
    low = u < 0.5
    step = where(low, ops.safe_sqrt(2.0 * u) - 1.0, 1.0 - ops.safe_sqrt(2.0 - 2.0 * u))
    return ops.clamp((count - 1.0) - ops.abs((count - 1.0) - ops.abs(node + step)), 0.0, count - 1.0)
