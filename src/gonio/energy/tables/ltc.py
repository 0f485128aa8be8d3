"""Linearly transformed cosines (Heitz2016a): the lobe of an isotropic material as E(o) D(i), for light from polygons.

    D(i) = cos+(W i) |det W| / (pi |W i|^3),   W = [[a, 0, b], [0, 1, 0], [c, 0, d]]  in the plane of o and n

W minimizes int |f |cos| / E - D|^p di over the whole sphere, including directions below the horizon, where f is 0 but D
may be positive. The fit uses p = 3, as in the paper, and continues from the result with p = 1.5 and then p = 1.1: the
error of an integral over a light is at most the fraction of the light that D sends in wrong directions, which p = 1
minimizes, whereas p = 3 fits the peak of a lobe at the cost of its tail. Where the horizon cuts a lobe in half, this
fraction is up to an eighth larger with p = 1.5 than with p = 1.1. The integral is a sum over fixed points: directions
sampled from the material, their mirror images at the horizon, and evenly distributed directions. All cosines of a
roughness are fitted at once by damped Gauss-Newton steps (Levenberg and Marquardt) from two starting points: the fit of
the rougher row, and the covariance of the lobe.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...material import BSDF, tree
from ...material.parameters import pair_of
from ...ops import backend
from ...optics.frame import spherical_array
from ...optics.lattice import r_sequence
from ..albedo import direction, quadrature
from ..albedo.directional import JUDGE, check_uniform, known
from . import area_light
from .bake import _sealed
from .baked import Baked
from .target import describe

Array: TypeAlias = NDArray[np.float64]

SIZE = 64
MIN_ROUGHNESS = 0.0142  # alpha 2e-4: narrower lobes are mirrors, whose W is singular
MIN_COSINE = 1e-3
LOBE, SPHERE = 768, 384  # points per cell
FINER = 24  # factor by which the integrals over polygons use more points
STEPS = 30
POWERS = (3.0, 1.5, 1.1)  # powers of |f - D|: 3, as in the paper, always converges and fits the peak; 1 fits the tail
SMALL = 1e-3  # fraction of the lobe's peak below which the weight of a difference no longer increases
POLYGONS = 1024


class Row(NamedTuple):
    """A row of the table: the entries of W, E per color channel, and the errors of each cell.

    inverse    the numbers a, b, the middle entry, c, d of W, (size, 5)
    norm       E, (size, channels); for a distribution, (E, B): the albedo with Schlick's F is F0 (E - B) + B
    misplaced  half of int |f cos / E - D|, the fraction of the light that D sends in wrong directions, (size,)
    cubed      int |f cos - E D|^3, which the paper minimizes, (size,)
    """

    inverse: Array
    norm: Array
    misplaced: Array
    cubed: Array


class Form(NamedTuple):
    """A parametrization of W: functions of the numbers that describe W, which are given in one row per cell.

    density   (numbers, wi) -> D (cells, K)
    slopes    (numbers, wi) -> D (cells, K), and its derivatives (cells, numbers, K)
    mirrored  numbers -> whether W contains a reflection, (cells,)
    """

    density: Callable[[Array, Array], Array]
    slopes: Callable[[Array, Array], tuple[Array, Array]]
    mirrored: Callable[[Array], NDArray[np.bool_]]


class Points(NamedTuple):
    """The points of the integrals, per cell.

    wi      directions, (cells, K, 3)
    weight  their weights, (cells, K)
    value   f |cos theta_i| at the directions, (cells, K, channels)
    """

    wi: Array
    weight: Array
    value: Array


def bake(model: BSDF, size: int = SIZE, schlick: bool = False) -> Baked:
    """Bake tables of an isotropic material over (roughness, sqrt(1 - mu)), with nodes at both ends.

    size     number of nodes along each axis, 2 to 256
    schlick  whether to store E and B instead of E per color channel, for a material with F = 1
    Returns arrays ltc_inverse (..., 4), ltc_norm (..., 2 or 3), ltc_error (..., 1); the manifest states the mean and
    the largest error of the lobe and of integrals over random quadrilaterals. Tables of a material without a roughness
    have one row. Raises InputError if the material has a mirror lobe, is evaluated by random estimates or absorbs all
    light.
    """
    path = check(model, size)
    roughness = np.linspace(0.0, 1.0, size) if path else np.zeros(1)
    mu = cosines(size)
    rows: list[Row] = []
    start: Array | None = None
    for value in roughness[::-1]:
        rows.insert(0, _row(at(model, path, value), mu, start, schlick))
        start = rows[0].inverse
    inverse, norm, misplaced, cubed = (np.array(part) for part in zip(*rows, strict=True))
    arrays = {"ltc_inverse": inverse[..., (0, 1, 3, 4)] / inverse[..., 2:3], "ltc_norm": norm}
    arrays["ltc_error"] = misplaced[..., None]
    if not path:
        arrays = {name: array[0] for name, array in arrays.items()}
    polygons = polygon_errors(model, path, roughness, mu, inverse)
    dims = ["roughness", "mu"] if path else ["mu"]
    errors: dict[str, dict[str, float]] = {
        "ltc_inverse": {"max": float(misplaced.max()), "rms": float(np.sqrt(np.mean(misplaced**2)))},
        "ltc_norm": {"max": float(polygons.max()), "rms": float(np.sqrt(np.mean(polygons**2)))},
    }
    errors["ltc_inverse"]["mean"], errors["ltc_norm"]["mean"] = float(misplaced.mean()), float(polygons.mean())
    errors["ltc_inverse"]["L3"] = float(np.mean(np.cbrt(cubed)))
    nodes = {"mu": mu, **({"roughness": roughness} if path else {})}
    text = {"mu": "column j at sqrt(1 - mu) = j / (N - 1)", **({"roughness": "row j at j / (N - 1)"} if path else {})}
    facts = {"target": describe(model), "ndf": model.name, "masking": "", "method": "linearly transformed cosines"}
    manifest = {**facts, "size": size, "layout": "ltc", "parameter": path, "axes": text}
    return _sealed(arrays, nodes, dict.fromkeys(arrays, dims), errors, manifest)


def cosines(size: int) -> Array:
    """The cosine of each column; the direction of the last one is just above the horizon."""
    return np.maximum(1.0 - np.linspace(0.0, 1.0, size) ** 2, MIN_COSINE)


def check(model: BSDF, size: int) -> str:
    """The path of the parameter that depends on the roughness; "" if there is none. Raises InputError if the material
    or the size is not supported."""
    check_uniform(model)
    kind = type(model).__name__
    if not 2 <= size <= 256:
        raise InputError(f"linearly transformed cosines of {size} x {size} requested", "--resolution", "give 2 to 256")
    path = next(roughness_paths(model), "")
    if model.stochastic or at(model, path, 1.0).delta != "never":
        what = f"{kind} is estimated by random walks" if model.stochastic else f"{kind} has a mirror lobe"
        raise InputError(what, "--lut", "ltc approximates finite lobes that `eval` computes")
    return path


def roughness_paths(model: BSDF) -> Iterator[str]:
    """Paths of the parameters that can depend on a roughness, alphas first."""
    leaves = list(tree.leaves(model))
    yield from (leaf.path for leaf in leaves if leaf.parameter.kind == "alpha")
    for name in ("roughness", "specular_roughness"):
        yield from (leaf.path for leaf in leaves if leaf.path.rpartition(".")[2] == name)


def at(model: BSDF, path: str, roughness: float) -> BSDF:
    """The material at a roughness, whose square is alpha.

    path  path of the parameter to set, from `check`; "" changes nothing
    """
    if not path:
        return model
    value = max(roughness, MIN_ROUGHNESS)
    kind = next(leaf.parameter.kind for leaf in tree.leaves(model) if leaf.path == path)
    return tree.replace(model, {path: value**2 if kind == "alpha" else value}, "--lut")


# --------------------------------------------------------------------------- values


def points_of(model: BSDF, mu: Array, lobe: int = LOBE, sphere: int = SPHERE, phi: Array | None = None) -> Points:
    """The points of the integrals over a lobe and its surroundings, for each cosine of wo.

    lobe, sphere  numbers of directions sampled from the material, and of evenly distributed directions
    phi           azimuths of wo; None for 0
    """
    kind = backend.types("float64")
    bound, cells = model.bind(kind), len(mu)
    wo = direction(mu, np.zeros_like(mu) if phi is None else phi)
    u = np.tile(r_sequence(lobe, 3, 0.5), (cells, 1))
    sampled = bound.sample(kind.vec3(np.repeat(wo, lobe, 0).T), kind.vec3(u.T), "importance")
    near = np.array(sampled.wi, float).T.reshape(cells, lobe, 3)
    lost = near[..., 2] <= 0.0  # transmitted, or without a value: not needed for f
    flat = r_sequence(sphere, 3, 0.5)
    z = 2.0 * flat[:, 0] - 1.0
    even = spherical_array(np.sqrt(1.0 - z**2), z, 2.0 * np.pi * flat[:, 1])
    below = near[:, ::4] * (1.0, 1.0, -1.0)
    wi = np.concatenate([near, below, np.broadcast_to(even, (cells, sphere, 3))], axis=1)
    lost = np.concatenate([lost, lost[:, ::4], np.zeros((cells, sphere), bool)], axis=1)
    above = kind.vec3((wi * np.where(wi[..., 2:] < 0.0, (1.0, 1.0, -1.0), 1.0)).reshape(-1, 3).T)
    outgoing = kind.vec3(np.repeat(wo, wi.shape[1], 0).T)
    value = bound.eval(outgoing, above, "importance")
    density = np.array(bound.pdf(outgoing, above), float).reshape(wi.shape[:2])
    values = np.stack([np.array(v, float) for v in value], -1).reshape(*wi.shape[:2], -1)
    up = wi[..., 2] > 0.0
    values[~up] = 0.0
    count = np.where(up, lobe, wi.shape[1] - lobe - sphere)
    weight = np.where(lost, 0.0, 1.0 / (count * density + sphere / (4.0 * np.pi)))
    return Points(wi, weight, values)


def _norm(model: BSDF, mu: Array, schlick: bool) -> Array:
    """E of the reflected light per color channel at each cosine; with `schlick`, E at F = 1 and B."""
    surface = model.microsurface
    if schlick and surface is not None:
        x, _ = pair_of(surface.alpha)
        return np.stack(quadrature.moments(surface.ndf, surface.masking, mu, float(x)), axis=-1)
    value = None if model.transmits else known(model, mu, 0.0 * mu, JUDGE)
    if value is not None:
        return value
    points = points_of(model, mu, 8 * LOBE)
    return np.einsum("ck,ckx->cx", points.weight, points.value)


# --------------------------------------------------------------------------- the fit


def _row(model: BSDF, mu: Array, start: Array | None, schlick: bool) -> Row:
    points = points_of(model, mu)
    norm = _norm(model, mu, schlick)
    total = (norm[:, 0] if schlick else norm.mean(-1))[:, None]
    if not np.all(total > 0.0):
        raise InputError(f"{type(model).__name__} reflects nothing", "--lut", "ltc needs a material that reflects")
    lobe = points.value.mean(-1) / total
    given = points.wi, points.weight, lobe
    first = _first(points, lobe)
    starts = [first] if start is None else [first, start]
    best = first
    for power in POWERS:
        best = _fit(given, [best, *starts], power)
    best = best / best[:, 2:3]
    cubed, misplaced = lobe_errors(points, points.value.mean(-1), total, best)
    return Row(best, norm, misplaced, cubed)


def _fit(given: tuple[Array, Array, Array], starts: list[Array], power: float) -> Array:
    """W of each cell for a power p: the best result of all starting points, including the fits of neighboring cells."""
    losses = [loss_of(PLANE, start, *given, power) for start in starts]
    chosen = np.argmin(losses, axis=0)
    best, loss = fitted(PLANE, *given, np.array(starts)[chosen, np.arange(len(chosen))], power)
    for side in (1, -1):
        start = np.roll(best, side, axis=0)
        cells = np.flatnonzero(loss_of(PLANE, start, *given, power) < loss)
        if len(cells):
            wi, weight, values = (part[cells] for part in given)
            best[cells], loss[cells] = fitted(PLANE, wi, weight, values, start[cells], power)
    return best


def lobe_errors(
    points: Points, lobe: Array, total: Array, inverse: Array, form: Form | None = None
) -> tuple[Array, Array]:
    """int |f cos - E D|^3, and half of int |f cos / E - D|, for each cell.

    total  E, (cells, 1)
    """
    difference = np.abs(lobe - total * (form or PLANE).density(inverse, points.wi))
    shares = 0.5 * np.sum(points.weight * difference, axis=1) / total[:, 0]
    return np.sum(points.weight * difference**3, axis=1), shares


def _first(points: Points, lobe: Array) -> Array:
    """An initial W for each cell, from the mean and the covariance of its lobe."""
    weight = points.weight * lobe
    z = np.einsum("ck,ckx->cx", weight, points.wi) * (1.0, 0.0, 1.0)
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    x = np.stack([z[:, 2], 0.0 * z[:, 0], -z[:, 0]], axis=1)
    along, up = (np.einsum("ck,ckx,cx->ck", np.ones_like(weight), points.wi, axis) for axis in (x, z))
    squares = [np.sum(weight * part**2, axis=1) for part in (along, points.wi[..., 1], up)]
    # a cosine lobe has mean squares of 1/4, 1/4 and 1/2
    wide, aside = (np.sqrt(np.maximum(2.0 * part / squares[2], 1e-12)) for part in squares[:2])
    return np.stack([x[:, 0] / wide, x[:, 2] / wide, 1.0 / aside, z[:, 0], z[:, 2]], axis=1)


def _density(inverse: Array, wi: Array) -> Array:
    """D at the directions of each cell."""
    a, b, c, d, e = (inverse[:, i, None] for i in range(5))
    x, y, z = wi[..., 0], wi[..., 1], wi[..., 2]
    height = d * x + e * z
    square = (a * x + b * z) ** 2 + (c * y) ** 2 + height**2
    return np.maximum(height, 0.0) * (c * (a * e - b * d) / np.pi) / square**2


def _slopes(inverse: Array, wi: Array) -> tuple[Array, Array]:
    """D (cells, K), and its derivatives with respect to the five numbers (cells, 5, K)."""
    a, b, c, d, e = (inverse[:, i, None] for i in range(5))
    x, y, z = wi[..., 0], wi[..., 1], wi[..., 2]
    along, aside, height = a * x + b * z, c * y, d * x + e * z
    minor = a * e - b * d
    over = 4.0 / (along**2 + aside**2 + height**2)
    value = np.maximum(height, 0.0) * (c * minor / (16.0 * np.pi)) * over**2
    along, aside = over * along, over * aside
    height = 1.0 / np.where(height > 0.0, height, 1.0) - over * height
    slopes = np.empty((len(wi), 5, wi.shape[1]))
    for place, log in enumerate(
        (
            e / minor - along * x,
            -d / minor - along * z,
            1.0 / c - aside * y,
            height * x - b / minor,
            height * z + a / minor,
        )
    ):
        slopes[:, place] = value * log
    return value, slopes


def _mirrored(inverse: Array) -> NDArray[np.bool_]:
    determinant = inverse[:, 0] * inverse[:, 4] - inverse[:, 1] * inverse[:, 3]
    mirrored: NDArray[np.bool_] = (inverse[:, 2] <= 0.0) | (determinant <= 0.0)
    return mirrored


PLANE = Form(_density, _slopes, _mirrored)  # a mirror plane through o and n


def loss_of(form: Form, inverse: Array, wi: Array, weight: Array, lobe: Array, power: float = 3.0) -> Array:
    """int |f - D|^power for each cell; infinite if W contains a reflection."""
    with np.errstate(all="ignore"):
        loss = np.sum(weight * np.abs(lobe - form.density(inverse, wi)) ** power, axis=1)
    return np.where(form.mirrored(inverse) | ~np.isfinite(loss), np.inf, loss)


def fitted(form: Form, wi: Array, weight: Array, lobe: Array, start: Array, power: float = 3.0) -> tuple[Array, Array]:
    """W and the loss of each cell after damped Gauss-Newton steps from a starting point.

    lobe   values of the normalized lobe, f |cos| / E
    power  power of |f - D| in the integral; below 2, small differences have a larger weight in the steps, up to a bound
           (`SMALL`)
    """
    inverse, damping = start.copy(), np.full(len(start), 1e-2)
    loss = loss_of(form, inverse, wi, weight, lobe, power)
    small = SMALL * lobe.max(axis=1, keepdims=True) if power < 2 else np.zeros((len(lobe), 1))
    active = np.arange(len(start))
    for _ in range(STEPS):
        points = wi[active]
        value, slopes = form.slopes(inverse[active], points)
        rest = lobe[active] - value
        pull = weight[active] * np.maximum(np.abs(rest), small[active]) ** (power - 2.0)
        gradient = slopes @ (pull * rest)[..., None]
        matrix = (slopes * (max(power - 1.0, 1.0) * pull[:, None])) @ np.swapaxes(slopes, 1, 2)
        diagonal = np.einsum("cpp->cp", matrix)  # a view
        diagonal *= 1.0 + damping[active, None]
        diagonal += 1e-12 * diagonal.max(axis=1, keepdims=True) + 1e-300
        tried = inverse[active] + np.linalg.solve(matrix, gradient)[..., 0]
        its = loss_of(form, tried, points, weight[active], lobe[active], power)
        better = its < loss[active]
        done = better & (its > loss[active] * (1.0 - 1e-6))
        inverse[active[better]], loss[active[better]] = tried[better], its[better]
        damping[active] *= np.where(better, 0.3, 4.0)
        active = active[~done & (damping[active] < 1e6)]
        if not len(active):
            break
    return inverse, loss


# --------------------------------------------------------------------------- integrals over polygons


def polygon_errors(model: BSDF, path: str, roughness: Array, mu: Array, inverse: Array) -> Array:
    """The errors of integrals over random quadrilaterals that are computed from the tables, relative to sums of f,
    divided by E, at up to 8 x 8 cells."""
    rows, columns = (np.unique(np.linspace(0, n - 1, 8).round().astype(int)) for n in (len(roughness), len(mu)))
    each = max(POLYGONS // (len(rows) * len(columns)), 1)
    corners = random_quads(np.random.default_rng(1), each * len(rows) * len(columns))
    summed: list[float] = []
    for row in rows:
        points = points_of(at(model, path, roughness[row]), mu[columns], LOBE * FINER, SPHERE * FINER)
        for cell in range(len(columns)):
            light = points.weight[cell] * points.value[cell].mean(-1)
            quads = corners[len(summed) : len(summed) + each]
            summed += [np.sum(light[inside(quad, points.wi[cell])]) / np.sum(light) for quad in quads]
    used = np.repeat(inverse[np.ix_(rows, columns)].reshape(-1, 5), each, axis=0)
    wo = direction(np.tile(np.repeat(mu[columns], each), len(rows)), np.zeros(1))
    return np.abs(covered(used, wo, corners) - summed)


def random_quads(rng: np.random.Generator, count: int) -> Array:
    """The corners (count, 4, 3) of randomly rotated rectangles above the surface, with sides of 0.2 to 2, at
    distance 1."""
    z, phi = rng.random(count), 2.0 * np.pi * rng.random(count)
    center = spherical_array(np.sqrt(1.0 - z**2), z, phi)
    turn, _ = np.linalg.qr(rng.normal(size=(count, 3, 3)))
    x, y = (turn[:, i] * rng.uniform(0.1, 1.0, (count, 1)) for i in (0, 1))
    corners = np.stack([center - x - y, center + x - y, center + x + y, center - x + y], axis=1)
    return np.asarray(corners, float)


def inside(quad: Array, wi: Array) -> NDArray[np.bool_]:
    """Whether each direction passes through a quadrilateral."""
    sides = np.cross(quad, np.roll(quad, -1, axis=0)) @ wi.T
    ahead = quad.mean(0) @ np.cross(quad[1] - quad[0], quad[3] - quad[0])
    return np.all(sides * np.sign(ahead) > 0.0, axis=0)


def covered(inverse: Array, wo: Array, corners: Array) -> Array:
    """The fraction of the lobe of each W (N, 5), for wo (N, 3), that a quadrilateral covers, computed as in shaders."""
    kind = backend.types("float64")
    numbers: Any = tuple(kind.float(part) for part in (inverse / inverse[:, 2:3])[:, (0, 1, 3, 4)].T)
    points: Any = tuple(kind.vec3(corners[:, i].T) for i in range(4))
    return np.array(area_light.quad(numbers, kind.vec3(wo.T), points), float)
