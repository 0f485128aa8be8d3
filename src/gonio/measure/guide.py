"""Importance sampling of any isotropic material that can be evaluated: a density found from its own values.

    guide = Guide(evaluate)                      # evaluate(wo, wi) -> luminance of f cos theta_i, (N,)
    guide.pdf(wo, wi);  guide.draw(wo, u)

For angles of view from the normal to grazing the luminance is laid over half vectors, in the unit square of
`tables.adaptive` (sqrt(2 theta_m / pi) and phi_m), times the solid angle of each place: there a narrow lobe has room,
and hardly moves with the view. Between two angles of view one of both densities is drawn by chance, and some samples
are cosine's, so that nothing is missed; `pdf` is that mixture's, exactly.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .. import ops
from ..ops import Direction, Scalar, dot, floor, function, maximum, minimum, sqrt, where
from ..optics import warp as warps
from ..optics.frame import reflect
from .angles import azimuth, direction
from .warp import Nodes, Warp

Floats = NDArray[np.float64]

VIEWS = 24  # angles of view; between them densities are mixed
COLUMNS, ROWS = 96, 48  # of theta_m by its square root, and of phi_m over half a turn: its other half is mirrored
FINE = 4  # as many points a node and axis, so that a lobe between two nodes is seen
COSINE = 0.03  # share of samples by the cosine: what the guide misses weighs 1 / 0.03 at most
ALMOST_ONE = 0.99999994  # the largest float32 under 1


def views(count: int) -> Floats:
    """Angles of view, closer together toward grazing, where lobes change."""
    t = np.linspace(0.0, 1.0, count)
    return 0.5 * np.pi * (1.0 - (1.0 - t) ** 1.5) * (1.0 - 1e-3 * t)


class Guide:
    """A density over directions for each direction of view, from the luminance of f cos theta_i.

    evaluate  (wo, wi) -> luminance (N,), of unit vectors (N, 3) above the surface, alike under a turn about the normal
              and under a mirror
    theta     angles of view that are tabulated
    """

    def __init__(
        self,
        evaluate: Callable[[Floats, Floats], Floats],
        theta: Floats | None = None,
        columns: int = COLUMNS,
        rows: int = ROWS,
        cosine: float = COSINE,
    ) -> None:
        theta = views(VIEWS) if theta is None else theta
        self.cosine = cosine
        self._theta = Nodes("guide_theta", theta)
        self._warp = Warp("guide", _densities(evaluate, theta, columns, rows))

    @function
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """Density of `draw`, 1/sr."""
        m = ops.normalize(wo + wi)
        row, t = self._theta.find(_polar(wo))
        x, y = _square(m, azimuth(wo))
        guided = self._warp.pdf([(row, 1.0 - t), (row + 1.0, t)], x, y) * _per_solid_angle(x, m, wi)
        return self.cosine * warps.square_to_cosine_hemisphere_pdf(wi) + (1.0 - self.cosine) * guided

    @function
    def draw(self, wo: Direction, u: Direction) -> tuple[Direction, Scalar]:
        """A direction and its density; below the surface the draw has failed."""
        row, t = self._theta.find(_polar(wo))
        # u.x chooses cosine, the nearer or the farther angle of view; what is left of it chooses the side
        flat = u.x < self.cosine
        v = where(flat, u.x / self.cosine, (u.x - self.cosine) / (1.0 - self.cosine))
        far = v < t
        chosen = row + where(far, 1.0, 0.0)
        v = where(far, ops.safe_div(v, t), ops.safe_div(v - t, 1.0 - t))
        place = self._warp.sample([(chosen, 1.0 + 0.0 * t)], u.y, u.z)
        turn = place.y * ops.pi
        phi = azimuth(wo) + where(v < 0.5, turn, -turn)
        m = direction(place.x * place.x * (0.5 * ops.pi), phi)
        wi = where(flat, warps.square_to_cosine_hemisphere(u.y, u.z), reflect(wo, m))
        return wi, where(wi.z > 0.0, self.pdf(wo, wi), 0.0)


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
        value[lit] = np.maximum(evaluate(np.broadcast_to(wo, (int(lit.sum()), 3)), wi[lit]), 0.0)
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
def _polar(w: Direction) -> Scalar:
    """The angle to the normal."""
    return ops.atan2(ops.safe_sqrt(w.x * w.x + w.y * w.y), w.z)


@function
def _square(m: Direction, phi: Scalar) -> tuple[Scalar, Scalar]:
    """A half vector's place: the square root of its angle, and |phi_m - phi_o| over pi."""
    x = sqrt(maximum(_polar(m), 0.0) * (2.0 / ops.pi))
    turn = (azimuth(m) - phi) * (0.5 / ops.pi)
    share = turn - floor(turn)
    return x, 2.0 * minimum(share, 1.0 - share)


@function
def _per_solid_angle(x: Scalar, m: Direction, wi: Direction) -> Scalar:
    """du / d omega_i: over 2 pi^2 x sin theta_m for the square (each of its points stands for two normals), over
    4 (wi.m) for the mirroring."""
    sin = ops.safe_sqrt(m.x * m.x + m.y * m.y)
    return ops.safe_div(1.0, (2.0 * ops.pi**2) * x * sin * (4.0 * ops.abs(dot(wi, m))))
