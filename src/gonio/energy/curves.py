"""What single scattering misses, M(mu) = 1 - E(mu), as one short polynomial a roughness.

A compensated material needs M at both directions for every pair. Two bilinear lookups are eight gathers, dearer than the
whole Torrance-Sparrow term on today's processors; a polynomial of degree 10 costs a third of it. The right variable makes
one possible. Masking changes where mu is a few alpha, so with

    s(mu) = sqrt(mu / sqrt(mu^2 + (4 alpha)^2))        (Smith; for the Schlick forms sqrt(mu / (mu + 4 k)))
    x(mu) = 2 s(mu) / s(1) - 1  in [-1, 1]

M is a smooth function of x whatever the width, down to a limit at alpha -> 0. Rows of a table hold the coefficients in x
at equal steps of roughness and are interpolated linearly, M_avg beside them; M_avg is the integral of the polynomial
itself, so that what the table has, energy has exactly. Anisotropic widths add two axes, see `anisotropic`.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from .. import ops
from ..ops import Table, sqr, sqrt
from . import cache, quadrature
from .quadrature import gauss

ROWS = 129  # roughness 0 to 1; linear interpolation between them errs by 3e-5
DEGREE = 10  # errs by 6e-5 (GGX), 1e-4 (Beckmann), 5e-4 (Beckmann's rational fit, which jumps by 5e-5)
CHANNELS = DEGREE + 2  # the last is M_avg
SCALE = 4.0  # chosen for the smallest error of the fit over all distributions and maskings
LOBE_NODES = 64
NODES_OF_FIT = 64
VERSION = 1


def knee(masking: str, alpha: Any) -> Any:
    """The cosine about which masking sets in: 4 alpha, or 4 k for the Schlick forms."""
    if masking == "schlick-direct":
        return sqr(sqrt(alpha) + 1.0) * (SCALE / 8.0)
    return alpha * (SCALE / 2.0 if masking == "schlick-ibl" else SCALE)


def squeeze(masking: str, mu: Any, bend: Any) -> Any:
    """s(mu), see the module."""
    if masking.startswith("schlick"):
        return sqrt(mu / (mu + bend))
    return sqrt(mu / sqrt(sqr(mu) + sqr(bend)))


def _numpy_squeeze(masking: str, mu: np.ndarray, bend: np.ndarray) -> np.ndarray:
    return np.sqrt(mu / (mu + bend if masking.startswith("schlick") else np.hypot(mu, bend)))


def _unsqueeze(masking: str, s: np.ndarray, bend: np.ndarray) -> np.ndarray:
    if masking.startswith("schlick"):
        return bend * s**2 / (1.0 - s**2)
    return bend * s**2 / np.sqrt(1.0 - s**4)


def knee_of(masking: str, alpha: np.ndarray) -> np.ndarray:
    """`knee` in NumPy."""
    if masking == "schlick-direct":
        return (np.sqrt(alpha) + 1.0) ** 2 * (SCALE / 8.0)
    return alpha * (SCALE / 2.0 if masking == "schlick-ibl" else SCALE)


def fit(masking: str, bend: np.ndarray, missing: Any) -> np.ndarray:
    """Coefficients in x, lowest power first, of M at each bend: nearly minimax, by reweighted least squares.

    missing  a function of mu (rows, nodes) to M
    Returns (rows, CHANNELS); the last channel is M_avg, of the polynomial where that is not negative.
    """
    x = -np.cos(np.pi * (np.arange(NODES_OF_FIT) + 0.5) / NODES_OF_FIT)
    top = _numpy_squeeze(masking, np.ones(1), bend[:, None])
    mu = _unsqueeze(masking, 0.5 * (x + 1.0) * top, bend[:, None])
    value = missing(np.clip(mu, 0.0, 1.0))
    basis = np.polynomial.chebyshev.chebvander(x, DEGREE)
    rows = []
    for target in value:
        weight = np.ones_like(x)
        for _ in range(12):
            found, *_rest = np.linalg.lstsq(basis * weight[:, None], target * weight, rcond=None)
            error = np.abs(basis @ found - target)
            weight *= np.sqrt(error / max(error.max(), 1e-300) + 0.02)
        rows.append(np.polynomial.chebyshev.cheb2poly(found))
    coefficients = np.zeros((len(bend), DEGREE + 1))
    for row, found in zip(coefficients, rows, strict=True):
        row[: len(found)] = found
    node, w = gauss(96)
    average = evaluate(masking, coefficients, bend, node[None, :] ** 2) @ (4.0 * w * node**3)
    return np.concatenate([coefficients, average[:, None]], axis=1)


def evaluate(masking: str, coefficients: np.ndarray, bend: np.ndarray, mu: np.ndarray) -> np.ndarray:
    """M of rows of coefficients at mu (rows, nodes), as `missing` computes it."""
    x = 2.0 * _numpy_squeeze(masking, mu, bend[:, None]) / _numpy_squeeze(masking, np.ones(1), bend[:, None]) - 1.0
    total = np.zeros(np.broadcast_shapes(x.shape, (len(bend), 1)))
    for power in range(DEGREE, -1, -1):
        total = total * x + coefficients[:, power, None]
    return np.maximum(total, 0.0)


@lru_cache
def isotropic(ndf: str, masking: str) -> Table:
    """Coefficients over roughness (ROWS, CHANNELS) of a distribution and masking."""

    def build() -> np.ndarray:
        alpha = np.maximum(np.linspace(0.0, 1.0, ROWS) ** 2, quadrature.SMALLEST_ALPHA)
        return fit(
            masking,
            knee_of(masking, alpha),
            lambda mu: 1.0 - quadrature.moments(ndf, masking, mu, alpha[:, None]).whole,
        )

    key = ("curves", VERSION, ndf, masking, ROWS, DEGREE, SCALE)
    return Table(f"missing_{ndf}_{masking}".replace("-", "_"), cache.remember(key, build, ndf))


@lru_cache
def lobe(ndf: str, masking: str) -> Table:
    """mu^2 over (roughness, u): the inverse of the share of M mu below mu, to sample the lobe proportional to it."""
    rows = isotropic(ndf, masking).values
    alpha = np.maximum(np.linspace(0.0, 1.0, ROWS) ** 2, quadrature.SMALLEST_ALPHA)
    grid = np.linspace(0.0, 1.0, 4097)  # of mu^2, in which the density is M / M_avg
    density = evaluate(masking, rows[:, :-1], knee_of(masking, alpha), np.sqrt(np.maximum(grid, 1e-12))[None, :]) + 1e-9
    below = np.concatenate([np.zeros((ROWS, 1)), np.cumsum(0.5 * (density[:, 1:] + density[:, :-1]), axis=1)], axis=1)
    below /= below[:, -1:]
    u = np.linspace(0.0, 1.0, LOBE_NODES)
    inverse = np.array([np.interp(u, row, grid) for row in below])
    return Table(f"lobe_{ndf}_{masking}".replace("-", "_"), inverse[..., None])


def coefficients(ndf: str, masking: str, alpha: Any) -> tuple[Any, ...]:
    """The polynomial's coefficients, lowest power first, and M_avg, at an isotropic width."""
    return ops.lookup(isotropic(ndf, masking), ops.inset(sqrt(alpha), ROWS))


def missing(masking: str, found: tuple[Any, ...], bend: Any, top: Any, mu: Any) -> Any:
    """M(mu), at least 0.

    found  from `coefficients`;  bend, top  `knee` at this width, and 2 / s(1)
    """
    x = squeeze(masking, mu, bend) * top - 1.0
    total = found[DEGREE]
    for power in range(DEGREE - 1, -1, -1):
        total = total * x + found[power]
    return ops.maximum(total, 0.0)
