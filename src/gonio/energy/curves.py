"""What single scattering misses, M(mu) = 1 - E(mu), as one short polynomial a roughness.

A compensated material needs M at both directions for every pair. Two bilinear lookups are eight gathers, dearer than
the whole Torrance-Sparrow term on today's processors; a polynomial of degree 10 costs a third of it. The right
variable makes one possible. Masking changes where mu is a few alpha, so with

    s(mu) = sqrt(mu / (mu + 4 alpha))        (GGX with Smith's masking; for others see `form_of`)
    x(mu) = 2 s(mu) / s(1) - 1  in [-1, 1]

M is a smooth function of x whatever the width, down to a limit at alpha -> 0. It all but vanishes at both ends, toward
the normal like a square, and the terms of a plain polynomial would take its digits with them in float32. So it is kept
as

    M = (1 - z) (a + z (c + z Q(x))) + z^2 b,   z = (1 - x) / 2,

with z and 1 - z found without cancellation (`descent`). Rows of a table hold a, c, b and the coefficients of Q at equal
steps of roughness and are interpolated linearly, M_avg beside them; M_avg is the integral of the polynomial itself, so
that what the table has, energy has exactly. Anisotropic widths add two axes, see `anisotropic`.
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
DEGREE = 10  # errs by 1e-4 (GGX, Beckmann), 5e-4 (Beckmann's rational fit, which jumps by 5e-5)
CHANNELS = DEGREE + 2  # the last is M_avg
LOBE_NODES = 256  # the density between them is off by 1e-4; with 64 a furnace by sampling was 4e-4 short
NODES_OF_FIT = 64


# How mu is bent into s, by form:   s(mu)                              bend
#   "wide"   metals, Smith, GGX       sqrt(mu / (mu + bend))             8 k = 4 alpha
#   "hypot"  metals, Smith, others    sqrt(mu / sqrt(mu^2 + bend^2))     8 k = 4 alpha
#   "root"   Schlick; glass, thin     sqrt(mu / (mu + bend))             4 k
#   "ratio"  glass, dense             mu / (mu + bend)                   8 k
# with k = alpha / 2, or that of schlick-direct. Chosen, like the factors, for the smallest error of the fit.


def form_of(ndf: str, masking: str, side: str = "") -> str:
    """The form of a table: of a metal, or of a side of glass."""
    if side:
        return "root" if side == "thin" else "ratio"
    if masking.startswith("schlick"):
        return "root"
    return "wide" if ndf == "ggx" else "hypot"


def knee(form: str, masking: str, alpha: Any) -> Any:
    """The bend: the cosine about which masking sets in."""
    factor = 4.0 if form == "root" else 8.0
    if masking == "schlick-direct":
        return sqr(sqrt(alpha) + 1.0) * (factor / 8.0)
    return alpha * (factor / 2.0)


def descent(form: str, mu: Any, bend: Any) -> tuple[Any, Any]:
    """(z, 1 - z), z = 1 - s(mu) / s(1): 0 at the normal, 1 at grazing; neither as a difference of near values."""
    if form == "hypot":
        bend2 = sqr(bend)
        far, near = sqrt(sqr(mu) + bend2), mu * sqrt(1.0 + bend2)
        middle = sqrt(far * near)
        product = (far + near) * (far + middle)
        over = 1.0 / (product * far)
        return bend2 * ((1.0 - mu) * (1.0 + mu)) * far * over, middle * product * over
    below, above = mu + bend, mu * (1.0 + bend)
    if form == "ratio":
        over = 1.0 / below
        return bend * (1.0 - mu) * over, above * over
    root = sqrt(below * above)
    over = 1.0 / (below + root)
    return bend * (1.0 - mu) * over, (above + root) * over


def numpy_knee(form: str, masking: str, alpha: np.ndarray) -> np.ndarray:
    k = (np.sqrt(alpha) + 1.0) ** 2 / 8.0 if masking == "schlick-direct" else alpha / 2.0
    return k * (4.0 if form == "root" else 8.0)


def numpy_squeeze(form: str, mu: np.ndarray, bend: np.ndarray) -> np.ndarray:
    ratio = mu / (np.hypot(mu, bend) if form == "hypot" else mu + bend)
    return ratio if form == "ratio" else np.sqrt(ratio)


def unsqueeze(form: str, s: np.ndarray, bend: np.ndarray) -> np.ndarray:
    ratio = s if form == "ratio" else s**2
    return bend * ratio / (np.sqrt(1.0 - ratio**2) if form == "hypot" else 1.0 - ratio)


def fit(form: str, bend: np.ndarray, missing: Any, nodes: int = NODES_OF_FIT) -> np.ndarray:
    """a, c, b and the coefficients of Q, lowest power first, at each bend: nearly minimax, by reweighted least squares.

    missing  a function of mu (rows, nodes) to M
    Returns (rows, CHANNELS); the last channel is M_avg, of the polynomial where that is not negative.
    """
    x = -np.cos(np.pi * (np.arange(nodes) + 0.5) / nodes)
    top = numpy_squeeze(form, np.ones(1), bend[:, None])
    mu = unsqueeze(form, 0.5 * (x + 1.0) * top, bend[:, None])
    value = missing(np.clip(mu, 0.0, 1.0))
    basis = np.polynomial.chebyshev.chebvander(x, DEGREE)
    rows = []
    for target, at in zip(value, mu, strict=True):
        # below mu = .02 albedo hardly matters, and that of glass has a cusp
        start = np.minimum(at / 0.02, 1.0) + 0.02
        weight = np.ones_like(x) * start
        for _ in range(12):
            found, *_rest = np.linalg.lstsq(basis * weight[:, None], target * weight, rcond=None)
            error = np.abs(basis @ found - target)
            error = error * start
            weight *= np.sqrt(error / max(error.max(), 1e-300) + 0.02)
        powers = np.zeros(DEGREE + 1)
        plain = np.polynomial.chebyshev.cheb2poly(found)
        powers[: len(plain)] = plain
        # M = (1 - z) a + z b + z (1 - z) P, with z (1 - z) = (1 - x^2) / 4; the rest of the division is what is linear
        p, rest = map(np.asarray, np.polynomial.polynomial.polydiv(powers, [0.25, 0.0, -0.25]))
        a, b = rest[0] + rest[1], rest[0] - rest[1]
        q, at_normal = map(np.asarray, np.polynomial.polynomial.polydiv(p, [0.5, -0.5]))  # P = P(1) + z Q
        rows.append(np.concatenate([[a, at_normal[0] + b, b], q]))
    coefficients = np.zeros((len(bend), DEGREE + 1))
    for row, found in zip(coefficients, rows, strict=True):
        row[: len(found)] = found
    node, w = gauss(96)
    average = evaluate(form, coefficients, bend, node[None, :] ** 2) @ (4.0 * w * node**3)
    return np.concatenate([coefficients, average[:, None]], axis=1)


def evaluate(form: str, coefficients: np.ndarray, bend: np.ndarray, mu: np.ndarray) -> np.ndarray:
    """M of rows of coefficients at mu (rows, nodes), as `missing` computes it."""
    rise = numpy_squeeze(form, mu, bend[:, None]) / numpy_squeeze(form, np.ones(1), bend[:, None])
    fall = 1.0 - rise
    total = np.zeros(np.broadcast_shapes(rise.shape, (len(bend), 1)))
    for place in range(DEGREE, 2, -1):
        total = total * (rise - fall) + coefficients[:, place, None]
    a, c, b = (coefficients[:, place, None] for place in range(3))
    return np.maximum((a + fall * (c + fall * total)) * rise + fall**2 * b, 0.0)


@lru_cache
def isotropic(ndf: str, masking: str) -> Table:
    """Coefficients over roughness (ROWS, CHANNELS) of a distribution and masking."""

    def build() -> np.ndarray:
        alpha = np.maximum(np.linspace(0.0, 1.0, ROWS) ** 2, quadrature.SMALLEST_ALPHA)
        form = form_of(ndf, masking)
        return fit(
            form,
            numpy_knee(form, masking, alpha),
            lambda mu: 1.0 - quadrature.moments(ndf, masking, mu, alpha[:, None]).whole,
        )

    key = ("curves", ndf, masking, ROWS, DEGREE)
    return Table(f"missing_{ndf}_{masking}".replace("-", "_"), cache.remember(key, build))


@lru_cache
def lobe(ndf: str, masking: str) -> Table:
    """mu^2 over (roughness, u): the inverse of the share of M mu below mu, to sample the lobe proportional to it."""
    alpha = np.maximum(np.linspace(0.0, 1.0, ROWS) ** 2, quadrature.SMALLEST_ALPHA)
    form = form_of(ndf, masking)
    bend = numpy_knee(form, masking, alpha)
    inverse = _inverse(form, isotropic(ndf, masking).values[:, :-1], bend, LOBE_NODES)
    return Table(f"lobe_{ndf}_{masking}".replace("-", "_"), inverse[..., None])


ASPECTS = 17  # sqrt(alpha_min / alpha_max), 0 to 1: a furnace errs by 1e-3 up to a ratio of 9, 1e-2 at 40
ASPECT_ROWS = 33  # sqrt(alpha_max), 0 to 1
HARMONICS = 6  # powers 0 to 5 of y
AZIMUTHS = 9  # nodes to fit them
TURNED = 4 * -(-((DEGREE + 1) * HARMONICS + 1) // 4)  # channels: powers of x by powers of y, M_avg, padding


@lru_cache
def anisotropic(ndf: str, masking: str) -> Table:
    """Coefficients over (sqrt(alpha_min / alpha_max), sqrt(alpha_max)) of a metal with two widths.

    About the normal M depends on y = cos(2 phi'), tan(phi') = sqrt(alpha_min / alpha_max) tan(phi), phi counted from
    the axis of the larger width; the bend is that of the width seen along w, alpha_phi^2 = alpha_max^2 cos^2 +
    alpha_min^2 sin^2. Channel k HARMONICS + j holds the coefficient of y^j in the k-th
    number of a row.
    """

    def build() -> np.ndarray:
        form = form_of(ndf, masking)
        floor = np.sqrt(quadrature.SMALLEST_ALPHA)
        aspect = np.maximum(np.linspace(0.0, 1.0, ASPECTS), 0.02)
        larger = np.maximum(np.linspace(0.0, 1.0, ASPECT_ROWS), floor) ** 2
        big = np.tile(larger, ASPECTS)
        small = np.repeat(aspect**2, ASPECT_ROWS) * big
        y = np.cos(np.pi * (np.arange(AZIMUTHS) + 0.5) / AZIMUTHS)
        to_powers = np.linalg.pinv(np.vander(y, HARMONICS, increasing=True))
        by_azimuth = []
        for value in y:
            cos2, sin2, seen = _azimuth(value, big, small)
            phi = np.arctan2(np.sqrt(sin2), np.sqrt(cos2))

            def missing(mu: np.ndarray, phi: np.ndarray = phi) -> np.ndarray:
                at = quadrature.moments(ndf, masking, mu, big[:, None], small[:, None], phi[:, None], nodes=(28, 28))
                return 1.0 - at.whole

            by_azimuth.append(fit(form, numpy_knee(form, masking, seen), missing, nodes=24)[:, :-1])
        found = np.einsum("jy,yrk->rkj", to_powers, np.array(by_azimuth))
        # M_avg: over azimuth and cosine, of the fit itself
        turns = (np.arange(24) + 0.5) / 24 * 0.5 * np.pi
        node, weight = gauss(64)
        average = np.zeros(len(big))
        for phi in turns:
            cos2, sin2 = np.cos(phi) ** 2, np.sin(phi) ** 2
            seen = np.sqrt(big**2 * cos2 + small**2 * sin2)
            here = (big * cos2 - small * sin2) / (big * cos2 + small * sin2)
            rows = np.einsum("rkj,rj->rk", found, here[:, None] ** np.arange(HARMONICS))
            values = evaluate(form, rows, numpy_knee(form, masking, seen), node[None, :] ** 2)
            average += values @ (4.0 * weight * node**3) / len(turns)
        table = np.zeros((len(big), TURNED))
        table[:, : (DEGREE + 1) * HARMONICS] = found.reshape(len(big), -1)
        table[:, -1] = average
        return table.reshape(ASPECTS, ASPECT_ROWS, TURNED)

    key = ("turned", ndf, masking, ASPECTS, ASPECT_ROWS, HARMONICS, DEGREE)
    return Table(f"missing_turned_{ndf}_{masking}".replace("-", "_"), cache.remember(key, build))


def _azimuth(y: float, big: np.ndarray, small: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(cos^2 phi, sin^2 phi, alpha_phi) at y = cos(2 phi')."""
    # tan^2(phi) = (1 - y) / (1 + y) big / small
    cos2 = small * (1.0 + y) / (small * (1.0 + y) + big * (1.0 - y))
    return cos2, 1.0 - cos2, np.sqrt(big**2 * cos2 + small**2 * (1.0 - cos2))


GLASS_ETAS = 21  # at equal steps of the root of sqrt(F0) = (eta - 1) / (eta + 1): M changes fastest near eta = 1
GLASS_ROWS = 33
GLASS_LOBE_NODES = 96
LARGEST_ROOT = 2.0 / 3.0  # eta = 5
SIDES = ("thin", "dense")


@lru_cache
def glass(ndf: str, masking: str, fresnel: str) -> dict[str, Table]:
    """Coefficients over (root of sqrt(F0), roughness) of rough glass, for light from its thin and its dense side."""

    def build() -> np.ndarray:
        alpha = np.maximum(np.linspace(0.0, 1.0, GLASS_ROWS) ** 2, quadrature.SMALLEST_ALPHA)
        roots = np.linspace(0.0, 1.0, GLASS_ETAS) ** 2 * LARGEST_ROOT
        eta = np.maximum((1.0 + roots) / (1.0 - roots), 1.0 + 1e-4)
        alphas, etas = np.tile(alpha, GLASS_ETAS), np.repeat(eta, GLASS_ROWS)
        sides = []
        for side, ratio in zip(SIDES, (etas, 1.0 / etas), strict=True):
            form = form_of(ndf, masking, side)

            def missing(mu: np.ndarray, ratio: np.ndarray = ratio) -> np.ndarray:
                power = quadrature.glass(ndf, masking, fresnel, mu, alphas[:, None], ratio[:, None])
                return 1.0 - power.reflected - power.transmitted

            sides.append(fit(form, numpy_knee(form, masking, alphas), missing, nodes=36))
        return np.array(sides).reshape(2, GLASS_ETAS, GLASS_ROWS, CHANNELS)

    key = ("glass", ndf, masking, fresnel, GLASS_ETAS, GLASS_ROWS, DEGREE)
    values = cache.remember(key, build)
    stem = f"missing_glass_{ndf}_{masking}_{fresnel}".replace("-", "_")
    return {side: Table(f"{stem}_{side}", v) for side, v in zip(SIDES, values, strict=True)}


@lru_cache
def glass_lobe(ndf: str, masking: str, fresnel: str) -> dict[str, Table]:
    """As `lobe`, over (the root of sqrt(F0), roughness, u), for either side."""
    alpha = np.maximum(np.linspace(0.0, 1.0, GLASS_ROWS) ** 2, quadrature.SMALLEST_ALPHA)
    tables = {}
    for side, table in glass(ndf, masking, fresnel).items():
        form = form_of(ndf, masking, side)
        bend = numpy_knee(form, masking, np.tile(alpha, GLASS_ETAS))
        inverse = _inverse(form, table.values.reshape(-1, CHANNELS)[:, :-1], bend, GLASS_LOBE_NODES)
        name = table.name.replace("missing", "lobe")
        tables[side] = Table(name, inverse.reshape(GLASS_ETAS, GLASS_ROWS, GLASS_LOBE_NODES, 1))
    return tables


def _inverse(form: str, rows: np.ndarray, bend: np.ndarray, count: int) -> np.ndarray:
    """mu^2 below which lie the shares 0 to 1 of M mu, for each row."""
    grid = np.linspace(0.0, 1.0, 2049)  # of mu^2, in which the density is M / M_avg
    density = evaluate(form, rows, bend, np.sqrt(np.maximum(grid, 1e-12))[None, :]) + 1e-9
    below = np.cumsum(0.5 * (density[:, 1:] + density[:, :-1]), axis=1)
    below = np.concatenate([np.zeros((len(rows), 1)), below], axis=1) / below[:, -1:]
    return np.array([np.interp(np.linspace(0.0, 1.0, count), row, grid) for row in below])


def coefficients(ndf: str, masking: str, alpha: Any) -> tuple[Any, ...]:
    """a, c, b, the coefficients of Q, lowest power first, and M_avg, at an isotropic width."""
    return ops.lookup(isotropic(ndf, masking), ops.inset(sqrt(alpha), ROWS))


def missing(form: str, found: tuple[Any, ...], bend: Any, mu: Any) -> Any:
    """M(mu), at least 0.

    found  from `coefficients`;  bend  `knee` at this width
    """
    fall, rise = descent(form, mu, bend)
    x = rise - fall
    total = found[DEGREE]
    for place in range(DEGREE - 1, 2, -1):
        total = ops.fma(total, x, found[place])
    a, c, b = found[:3]
    total = ops.fma(ops.fma(total, fall, c), fall, a)
    return ops.maximum(ops.fma(total, rise, b * sqr(fall)), 0.0)
