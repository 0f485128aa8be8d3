"""The energy lost by single scattering, M(mu) = 1 - E(mu), as one polynomial of low degree per roughness.

A compensated material needs M at both directions of every pair. Two bilinear lookups require eight memory reads, which
cost more than the complete Torrance-Sparrow term on current processors; a polynomial of degree 10 costs a third of
that. Such a polynomial exists in the variable z of `gonio.energy.bend`, in which M is smooth for any alpha. M nearly
vanishes toward the normal (z = 0), and often also toward grazing angles, where a polynomial in powers of z would be
inaccurate in float32. Therefore, M is expressed in the Bernstein basis with non-negative coefficients:

    M = sum over k of c_k z^k r^(10 - k) = r^10 sum over k of c_k (z / r)^k,   1 / r = 1 + z / r,   c_k >= 0.

Every term is positive, and z / r is computed without cancellation (`descent`), so M has full precision even where it is
very small. The rows of a table contain the c_k at equal steps of roughness and are interpolated linearly, together with
M_avg, which is the integral of the polynomial itself, so that energy is conserved exactly with the values of the table.
Tables for anisotropic materials have two more axes; see `anisotropic`.
"""

from __future__ import annotations

import itertools
from collections import namedtuple
from collections.abc import Callable

import numpy as np

from ... import ops
from ...ops import Direction, Pair, Scalar, Table, sqr, sqrt
from ...ops.backend import Array
from ...optics.special import gauss
from .. import cache
from ..albedo import normals, quadrature
from ..bend import DEGREE, Form, cosine, descent, form_of, numpy_knee, numpy_rise

ROWS = 129  # rows for roughness 0 to 1; linear interpolation between rows has an error of 3e-5
LOBE_NODES = 256  # the interpolated density has an error of 1e-4; with 64 nodes, 4e-4 was lost in a sampled furnace
NODES_OF_FIT = 64
STEPS_OF_FIT = 8


def bernstein(x: np.ndarray, degree: int) -> np.ndarray:
    """x^k (1 - x)^(degree - k), without binomial factors, for k = 0 to degree along the last axis."""
    k = np.arange(degree + 1)
    return x[..., None] ** k * (1.0 - x[..., None]) ** (degree - k)


def fit(form: Form, bend: np.ndarray, missing: Callable[..., np.ndarray], nodes: int = NODES_OF_FIT) -> np.ndarray:
    """Fit c_k >= 0 to M at each bend, with a nearly minimal maximum error, by reweighted non-negative least squares.

    bend     the bends, (rows,)
    missing  function of mu (rows, nodes) that returns M
    nodes    number of Chebyshev nodes of the fit
    Returns the c_k, followed by M_avg, (rows, degree + 2).
    """
    rise = _nodes(nodes)
    mu = cosine(form, rise, bend[:, None])
    basis = bernstein(1.0 - rise, form.degree)
    coefficients_of = np.array([_nearly_minimax(basis, *row) for row in zip(missing(mu), _importance(mu), strict=True)])
    node, w = gauss(96)
    average = evaluate(form, coefficients_of, bend, node[None, :] ** 2) @ (4.0 * w * node**3)
    return np.concatenate([coefficients_of, average[:, None]], axis=1)


def _nodes(count: int) -> np.ndarray:
    """Chebyshev nodes in [0, 1]."""
    return 0.5 - 0.5 * np.cos(np.pi * (np.arange(count) + 0.5) / count)


def _importance(mu: np.ndarray) -> np.ndarray:
    """The weight of the fit at mu. It is low below mu = 0.02, where the albedo has little effect and, for glass, has a
    cusp."""
    return np.minimum(mu / 0.02, 1.0) + 0.02


def _nearly_minimax(basis: np.ndarray, target: np.ndarray, importance: np.ndarray) -> np.ndarray:
    """Non-negative coefficients for which the maximum of error times importance is small, from several reweighted
    fits."""
    from scipy.optimize import nnls  # imported here because renders whose tables exist do not need it

    weight, best, least = importance, np.zeros(basis.shape[1]), np.inf
    for _ in range(STEPS_OF_FIT):
        c = nnls(basis * weight[:, None], target * weight, maxiter=10000)[0]
        error = np.abs(basis @ c - target) * importance
        if error.max() < least:
            best, least = c, error.max()
        weight = weight * np.sqrt(error / max(error.max(), 1e-300) + 0.02)
    return best


def evaluate(form: Form, coefficients: np.ndarray, bend: np.ndarray, mu: np.ndarray) -> np.ndarray:
    """M at mu (rows, nodes) from coefficients (rows, degree + 1), computed as in `missing`."""
    fall = 1.0 - numpy_rise(form, mu, bend[:, None])
    return np.einsum("rnk,rk->rn", bernstein(fall, form.degree), coefficients)


@cache.of_members
def isotropic(ndf: str, masking: str) -> Table:
    """The table of coefficients over roughness, (ROWS, CHANNELS), for a distribution and a masking term."""

    def build() -> np.ndarray:
        alpha = np.maximum(np.linspace(0.0, 1.0, ROWS) ** 2, normals.SMALLEST_ALPHA)
        form = form_of(ndf, masking)
        return fit(
            form,
            numpy_knee(form, masking, alpha),
            lambda mu: 1.0 - quadrature.moments(ndf, masking, mu, alpha[:, None]).white,
        )

    key = ("curves", ndf, masking, *cache.origin(ndf, masking), ROWS, DEGREE)
    return Table(f"missing_{ndf}_{masking}".replace("-", "_"), cache.remember(key, build))


@cache.of_members
def lobe(ndf: str, masking: str) -> Table:
    """The table of mu^2 over (roughness, u): the inverse distribution function of the lobe proportional to M mu."""
    alpha = np.maximum(np.linspace(0.0, 1.0, ROWS) ** 2, normals.SMALLEST_ALPHA)
    form = form_of(ndf, masking)
    bend = numpy_knee(form, masking, alpha)
    inverse = _inverse(form, isotropic(ndf, masking).values[:, :-1], bend, LOBE_NODES)
    return Table(f"lobe_{ndf}_{masking}".replace("-", "_"), inverse[..., None])


ASPECTS = 17  # nodes of sqrt(alpha_min / alpha_max) in [0, 1]: furnace error 1e-3 up to a ratio of 9, 1e-2 at 40
ASPECT_ROWS = 33  # nodes of sqrt(alpha_max) in [0, 1]
HARMONICS = 7  # number of terms of a polynomial in y
AZIMUTHS = 13  # nodes for the fit of these polynomials
TURNED = 4 * -(-((DEGREE + 1) * HARMONICS + 1) // 4)  # channels: terms in z times terms in y, M_avg, padding


@cache.of_members
def anisotropic(ndf: str, masking: str) -> Table:
    """The table of coefficients over (sqrt(alpha_min / alpha_max), sqrt(alpha_max)) for an anisotropic metal.

    M depends on the azimuth through y = cos(2 phi') with tan(phi') = sqrt(alpha_min / alpha_max) tan(phi), where phi is
    measured from the axis of the larger alpha; the bend is that of the alpha along w, alpha_phi^2 = alpha_max^2 cos^2
    phi + alpha_min^2 sin^2 phi. Channel k HARMONICS + j is the coefficient of Y^j (1 - Y)^(6 - j), with
    Y = (1 + y) / 2, in c_k; all coefficients are non-negative.
    """

    def build() -> np.ndarray:
        form = form_of(ndf, masking)
        floor = np.sqrt(normals.SMALLEST_ALPHA)
        aspect = np.maximum(np.linspace(0.0, 1.0, ASPECTS), 0.02)
        larger = np.maximum(np.linspace(0.0, 1.0, ASPECT_ROWS), floor) ** 2
        big = np.tile(larger, ASPECTS)
        small = np.repeat(aspect**2, ASPECT_ROWS) * big
        y = np.cos(np.pi * (np.arange(AZIMUTHS) + 0.5) / AZIMUTHS)
        rise, target, importance = _nodes(20), [], []
        for value in y:
            cos2, sin2, width = _azimuth(value, big, small)
            phi = np.arctan2(np.sqrt(sin2), np.sqrt(cos2))[:, None]
            mu = cosine(form, rise, numpy_knee(form, masking, width)[:, None])
            at = quadrature.moments(ndf, masking, mu, big[:, None], small[:, None], phi, nodes=(28, 28))
            target.append(1.0 - at.white)
            importance.append(_importance(mu))
        in_z, in_y = bernstein(1.0 - rise, DEGREE), bernstein(0.5 + 0.5 * y, HARMONICS - 1)
        basis = np.einsum("nk,yj->ynkj", in_z, in_y).reshape(AZIMUTHS * len(rise), -1)
        by_cell = (np.stack(part, axis=1).reshape(len(big), -1) for part in (target, importance))
        c = np.array([_nearly_minimax(basis, *cell) for cell in zip(*by_cell, strict=True)])
        c = c.reshape(len(big), DEGREE + 1, HARMONICS)
        # M_avg: the mean of the fitted polynomial over azimuth and cosine
        turns = (np.arange(24) + 0.5) / 24 * 0.5 * np.pi
        node, weight = gauss(64)
        average = np.zeros(len(big))
        for phi in turns:
            cos2, sin2 = np.cos(phi) ** 2, np.sin(phi) ** 2
            width = np.sqrt(big**2 * cos2 + small**2 * sin2)
            here = (big * cos2 - small * sin2) / (big * cos2 + small * sin2)
            rows = np.einsum("rkj,rj->rk", c, bernstein(0.5 + 0.5 * here, HARMONICS - 1))
            values = evaluate(form, rows, numpy_knee(form, masking, width), node[None, :] ** 2)
            average += values @ (4.0 * weight * node**3) / len(turns)
        table = np.zeros((len(big), TURNED))
        table[:, : (DEGREE + 1) * HARMONICS] = c.reshape(len(big), -1)
        table[:, -1] = average
        return table.reshape(ASPECTS, ASPECT_ROWS, TURNED)

    key = ("turned", ndf, masking, *cache.origin(ndf, masking), ASPECTS, ASPECT_ROWS, HARMONICS, DEGREE)
    return Table(f"missing_turned_{ndf}_{masking}".replace("-", "_"), cache.remember(key, build))


def _azimuth(y: float, big: np.ndarray, small: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """cos^2 phi, sin^2 phi and alpha_phi at y = cos(2 phi'), for the alphas `big` and `small`."""
    # tan^2(phi) = (1 - y) / (1 + y) big / small
    cos2 = small * (1.0 + y) / (small * (1.0 + y) + big * (1.0 - y))
    return cos2, 1.0 - cos2, np.sqrt(big**2 * cos2 + small**2 * (1.0 - cos2))


GLASS_ETAS = 21  # nodes at equal steps of the root of sqrt(F0) = (eta - 1) / (eta + 1): M varies fastest near eta = 1
GLASS_ROWS = 33
GLASS_LOBE_NODES = 96
MAX_ROOT = 2.0 / 3.0  # eta = 5
SIDES = ("thin", "dense")


@cache.of_members
def glass(ndf: str, masking: str, fresnel: str) -> dict[str, Table]:
    """The tables of coefficients of rough glass over (root of sqrt(F0), roughness), for light from the less dense side
    ("thin") and from the denser one ("dense")."""

    def build() -> np.ndarray:
        alpha = np.maximum(np.linspace(0.0, 1.0, GLASS_ROWS) ** 2, normals.SMALLEST_ALPHA)
        roots = np.linspace(0.0, 1.0, GLASS_ETAS) ** 2 * MAX_ROOT
        eta = np.maximum((1.0 + roots) / (1.0 - roots), 1.0 + 1e-4)
        alphas, etas = np.tile(alpha, GLASS_ETAS), np.repeat(eta, GLASS_ROWS)
        sides = []
        for side, ratio in zip(SIDES, (etas, 1.0 / etas), strict=True):
            form = form_of(ndf, masking, side)

            def missing(mu: np.ndarray, ratio: np.ndarray = ratio) -> np.ndarray:
                power = quadrature.glass(ndf, masking, fresnel, quadrature.Points(mu, alphas[:, None]), ratio[:, None])
                return 1.0 - power.reflected - power.transmitted

            sides.append(fit(form, numpy_knee(form, masking, alphas), missing, nodes=36))
        return np.array(sides).reshape(2, GLASS_ETAS, GLASS_ROWS, -1)

    key = ("glass", ndf, masking, fresnel, *cache.origin(ndf, masking, fresnel), GLASS_ETAS, GLASS_ROWS)
    values = cache.remember(key, build)
    stem = f"missing_glass_{ndf}_{masking}_{fresnel}".replace("-", "_")
    return {side: Table(f"{stem}_{side}", v) for side, v in zip(SIDES, values, strict=True)}


def widths_along(w: Direction, alpha: Pair, root: Scalar) -> tuple[Scalar, Scalar]:
    """The isotropic alphas for which glass loses about as much energy along w as with the two given alphas, for light
    from the less dense and from the denser side.

    root  sqrt(F0)
    """
    thin2, dense2 = _squares(sqr(w.x), sqr(w.y), ops.abs(w.z), sqr(alpha.x), sqr(alpha.y), root)
    return sqrt(ops.clamp(thin2, 1e-8, 1.0)), sqrt(ops.clamp(dense2, 1e-8, 1.0))


def _squares(x2: Array, y2: Array, cos: Array, alpha_x2: Array, alpha_y2: Array, root: Array) -> tuple[Array, Array]:
    """The squares of `widths_along`.

    At normal incidence, alpha is about the root mean square of the two given alphas. At grazing incidence, masking by
    the alpha along the direction dominates. If S and D are the sum and the difference of the squared alphas,
    alpha^2 = S / 2 + o D sin^2 theta cos(2 phi) + e D^2 / S, where o and e are fitted to the alpha that yields M
    exactly, for indices 1.15, 1.5 and 2.2 and four pairs of alphas.
    """
    S, D, difference, low = alpha_x2 + alpha_y2, alpha_x2 - alpha_y2, x2 - y2, 1.0 - cos
    bent, across, low2 = D * D / S, difference / (1.0 + cos), low * low
    low8, near = low2 * low2 * low2 * low2, 0.04 / (0.04 + root * root)  # near index 1, both sides are equal
    thin = 0.5 * S + D * difference * (0.5 - 0.7 * root + 0.06 * low8) + bent * (0.35 * root * (1.0 - 0.6 * low8))
    dense = 0.5 * S + D * difference * (low2 * low2 - 0.1) + bent * low * (1.3 * across * across - 0.48)
    return thin, dense + (thin - dense) * (near * near)


@cache.of_members
def glass_of_two(ndf: str, masking: str, fresnel: str) -> Table:
    """The table of M_avg of anisotropic glass, for its less dense and its denser side, over (root of sqrt(F0),
    sqrt(alpha_min / alpha_max), sqrt(alpha_max)). M_avg is the mean of M with `widths_along`."""

    def build() -> np.ndarray:
        tables = glass(ndf, masking, fresnel)
        larger = np.maximum(np.linspace(0.0, 1.0, ASPECT_ROWS) ** 2, normals.SMALLEST_ALPHA)[None, :, None]
        smaller = np.maximum(np.linspace(0.0, 1.0, ASPECTS) ** 2, 0.02**2)[:, None, None] * larger
        node, weight = gauss(16)
        mu = (node**2)[None, None, :]
        means = np.zeros((GLASS_ETAS, ASPECTS, ASPECT_ROWS, len(SIDES)))
        turns = (np.arange(8) + 0.5) / 8 * 0.5 * np.pi
        for phi, (e, t) in itertools.product(turns, enumerate(np.linspace(0.0, 1.0, GLASS_ETAS))):
            x2, y2 = (1.0 - mu**2) * np.cos(phi) ** 2, (1.0 - mu**2) * np.sin(phi) ** 2
            both = _squares(x2, y2, mu, larger**2, smaller**2, t * t * MAX_ROOT)
            for n, (side, squares) in enumerate(zip(SIDES, both, strict=True)):
                form, width = form_of(ndf, masking, side), np.sqrt(np.clip(squares, 1e-8, 1.0))
                place = np.sqrt(width) * (GLASS_ROWS - 1)
                cell = np.minimum(place.astype(int), GLASS_ROWS - 2)
                rows, part = tables[side].values[e, :, :-1], (place - cell)[..., None]
                fall = 1.0 - numpy_rise(form, np.broadcast_to(mu, width.shape), numpy_knee(form, masking, width))
                values = (bernstein(fall, form.degree) * (rows[cell] * (1.0 - part) + rows[cell + 1] * part)).sum(-1)
                means[e, ..., n] += values @ (4.0 * weight * node**3) / len(turns)
        return means

    key = (
        "glass-of-two",
        ndf,
        masking,
        fresnel,
        *cache.origin(ndf, masking, fresnel),
        GLASS_ETAS,
        ASPECTS,
        ASPECT_ROWS,
    )
    name = f"missing_glass_of_two_{ndf}_{masking}_{fresnel}".replace("-", "_")
    return Table(name, cache.remember(key, build))


@cache.of_members
def glass_lobe(ndf: str, masking: str, fresnel: str) -> dict[str, Table]:
    """The tables of `lobe` for rough glass over (root of sqrt(F0), roughness, u), by side."""
    alpha = np.maximum(np.linspace(0.0, 1.0, GLASS_ROWS) ** 2, normals.SMALLEST_ALPHA)
    tables = {}
    for side, table in glass(ndf, masking, fresnel).items():
        form = form_of(ndf, masking, side)
        bend = numpy_knee(form, masking, np.tile(alpha, GLASS_ETAS))
        inverse = _inverse(form, table.values.reshape(GLASS_ETAS * GLASS_ROWS, -1)[:, :-1], bend, GLASS_LOBE_NODES)
        name = table.name.replace("missing", "lobe")
        tables[side] = Table(name, inverse.reshape(GLASS_ETAS, GLASS_ROWS, GLASS_LOBE_NODES, 1))
    return tables


def _inverse(form: Form, rows: np.ndarray, bend: np.ndarray, count: int) -> np.ndarray:
    """mu^2 at equal quantiles of the density M mu, for each row."""
    grid = np.linspace(0.0, 1.0, 2049)  # values of mu^2, in which the density is M / M_avg
    density = evaluate(form, rows, bend, np.sqrt(np.maximum(grid, 1e-12))[None, :]) + 1e-9
    below = np.cumsum(0.5 * (density[:, 1:] + density[:, :-1]), axis=1)
    below = np.concatenate([np.zeros((len(rows), 1)), below], axis=1) / below[:, -1:]
    return np.array([np.interp(np.linspace(0.0, 1.0, count), row, grid) for row in below])


def coefficients(ndf: str, masking: str, alpha: Scalar) -> tuple[Scalar, ...]:
    """The coefficients c_0 to c_10 and M_avg for an isotropic alpha."""
    row = ops.inset(sqrt(alpha), ROWS)
    return ops.lookup(isotropic(ndf, masking), row)


Coefficients = namedtuple("Coefficients", "c0 c1 c2 c3 c4 c5 c6 c7 c8 c9 c10")
Coefficients.__doc__ = "c_0 to c_10."


@ops.function
def turn(channels: tuple[Array, ...], along: Array, across: Array) -> Coefficients:
    """The coefficients c_0 to c_10 for a direction, from the channels of `anisotropic`.

    along, across  (1 + y) / 2 and (1 - y) / 2 for the direction's azimuth
    """
    terms = _harmonics(along, across)
    count = (DEGREE + 1) * HARMONICS
    return Coefficients._make(_weigh(channels[at : at + HARMONICS], terms) for at in range(0, count, HARMONICS))


Harmonics = namedtuple("Harmonics", "h0 h1 h2 h3 h4 h5 h6")
Harmonics.__doc__ = "along^j across^(6 - j)."


@ops.function
def _harmonics(along: Array, across: Array) -> Harmonics:
    """along^j across^(6 - j) for j = 0 to 6."""
    along_to, across_to = [along, along], [across, across]
    for _ in range(HARMONICS - 2):
        along_to.append(along_to[-1] * along)
        across_to.append(across_to[-1] * across)
    between = (along_to[j] * across_to[HARMONICS - 1 - j] for j in range(1, HARMONICS - 1))
    return Harmonics._make([across_to[HARMONICS - 1], *between, along_to[HARMONICS - 1]])


@ops.function
def _weigh(factors: tuple[Array, ...], terms: tuple[Array, ...]) -> Array:
    """Sum of the terms, each multiplied by its factor."""
    total = factors[0] * terms[0]
    for factor, value in zip(factors[1:], terms[1:], strict=True):
        total = ops.fma(factor, value, total)
    return total


def missing(form: Form, c: tuple[Array, ...], bend: Array, mu: Array) -> Array:
    """M(mu), clamped to >= 0.

    c     the coefficients c_k, which may be followed by other values
    bend  `knee` for the alpha
    """
    ratio = descent(form, mu, bend)
    return _polynomial(c[: form.degree + 1], ratio) / _power(1.0 + ratio, form.degree)


@ops.function
def _polynomial(c: tuple[Array, ...], x: Array) -> Array:
    """c_0 + c_1 x + c_2 x^2 + ..., by Horner's rule."""
    total = c[-1]
    for factor in reversed(c[:-1]):
        total = ops.fma(total, x, factor)
    return total


def _power(x: Array, exponent: int) -> Array:
    """x^exponent, by squaring."""
    if exponent == 1:
        return x
    even = sqr(_power(x, exponent // 2))
    return even * x if exponent % 2 else even
