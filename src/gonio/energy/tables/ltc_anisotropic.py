"""Linearly transformed cosines of anisotropic materials: a full matrix W over roughness, azimuth and angle.

    D(i) = cos+(W i) |det W| / (pi |W i|^3)

The material is symmetric about the planes of its axes, so azimuths in one quarter turn suffice. W acts in the frame
whose x axis lies below o. D does not change if W is multiplied by a number or rotated about the axis of the cosine
lobe; the table stores the matrix whose upper left block is symmetric and whose center entry is 1, so that neighbors can
be interpolated. The fit is that of `ltc`, with nine numbers.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...material import BSDF, tree
from ...material.parameters import pair_of
from ...ops import backend, lookup
from ...ops.table import Table
from ..albedo import direction
from ..albedo.directional import JUDGE, known
from . import area_light, ltc
from .bake import _sealed
from .baked import Baked
from .ltc import Array, Form, Points
from .target import describe

SIZE = 16
AZIMUTHS = 9  # number of azimuths from 0 to pi / 2
PLACES = 64  # number of points at which `polygon_errors` tests 16 quadrilaterals each


def bake(model: BSDF, size: int = SIZE, schlick: bool = False) -> Baked:
    """Bake tables over (roughness, azimuth, sqrt(1 - mu)), with nodes at both ends, as `ltc.bake` but with eight
    numbers of W.

    The roughness is the root of the larger alpha; the ratio of the alphas is that of the material. The arguments are
    those of `ltc.bake`. Raises InputError if the x and y axes are not axes of symmetry, and in the cases of `ltc.bake`.
    """
    path = ltc.check(model, size)
    _check_symmetry(model)
    roughness = np.linspace(0.0, 1.0, size) if path else np.zeros(1)
    mu, phi = ltc.cosines(size), np.linspace(0.0, 0.5 * np.pi, AZIMUTHS)
    rows: list[tuple[Array, ...]] = []
    start: Array | None = None
    for value in roughness[::-1]:
        rows.insert(0, _row(at(model, path, value), mu, phi, start, schlick))
        start = rows[0][0].reshape(-1, 9)
    inverse, norm, misplaced, cubed = (np.array(part) for part in zip(*rows, strict=True))
    inverse = _gauge(inverse.reshape(-1, 3, 3)).reshape(inverse.shape)
    arrays = {"ltc_inverse": np.delete(inverse, 4, axis=-1), "ltc_norm": norm, "ltc_error": misplaced[..., None]}
    if not path:
        arrays = {name: array[0] for name, array in arrays.items()}
    polygons = polygon_errors(model, path, arrays["ltc_inverse"])
    errors = {
        "ltc_inverse": {**_errors(misplaced), "L3": float(np.mean(np.cbrt(cubed)))},
        "ltc_norm": _errors(polygons),
    }
    swept = ["roughness"] if path else []
    dims = [*swept, "phi", "mu"]
    nodes = {"mu": mu, "phi": phi, **({"roughness": roughness} if path else {})}
    text = {"mu": "column j at sqrt(1 - mu) = j / (N - 1)", "phi": "row j at pi/2 j / (N - 1)"}
    text |= {"roughness": "layer j at j / (N - 1)"} if path else {}
    facts = {"target": describe(model), "ndf": model.name, "masking": "", "method": "linearly transformed cosines"}
    manifest = {**facts, "size": size, "layout": "ltc", "parameter": path, "axes": text}
    return _sealed(arrays, nodes, dict.fromkeys(arrays, dims), errors, manifest)


def _errors(values: Array) -> dict[str, float]:
    return {"max": float(values.max()), "rms": float(np.sqrt(np.mean(values**2))), "mean": float(values.mean())}


def at(model: BSDF, path: str, roughness: float) -> BSDF:
    """The material at a roughness, which sets the alphas, with their ratio unchanged, or the parameter at `path`."""
    leaf = next((leaf for leaf in tree.leaves(model) if leaf.path == path), None)
    if leaf is None or leaf.parameter.kind != "alpha":
        return ltc.at(model, path, roughness)
    widths = np.array([float(one) for one in pair_of(leaf.value)])
    scaled = max(roughness, ltc.MIN_ROUGHNESS) ** 2 * widths / widths.max()
    return tree.replace(model, {path: tuple(map(float, scaled))}, "--lut")


def _check_symmetry(model: BSDF) -> None:
    """Raise InputError unless `eval` is invariant under mirroring both directions at x = 0, and at y = 0."""
    kind = backend.types("float64")
    random = np.random.default_rng(1)
    wo, wi = (v / np.linalg.norm(v, axis=0) for v in np.abs(random.normal(size=(2, 3, 64))))
    wi = wi * random.choice((-1.0, 1.0), (3, 64)) ** [[1], [1], [0]]
    values = [
        np.array(model.bind(kind).eval(kind.vec3(wo * flip), kind.vec3(wi * flip)), float)
        for flip in np.array([[1.0, 1.0, 1.0], [-1.0, 1.0, 1.0], [1.0, -1.0, 1.0]])[..., None]
    ]
    if not np.allclose(values[0], values[1], rtol=1e-6) or not np.allclose(values[0], values[2], rtol=1e-6):
        what = f"{type(model).__name__} is not symmetric about x and y"
        raise InputError(what, "--lut", "set its rotation to 0; the light's corners are in the frame of its axes")


# --------------------------------------------------------------------------- the fit


def _row(model: BSDF, mu: Array, phi: Array, start: Array | None, schlick: bool) -> tuple[Array, Array, Array, Array]:
    """For one roughness, W (azimuths, cosines, 9), E, the fraction of misplaced light, and the cubed error of the fit,
    as in `ltc.Row`."""
    shape = len(phi), len(mu)
    across, azimuths = np.tile(mu, len(phi)), np.repeat(phi, len(mu))
    points = ltc.points_of(model, across, phi=azimuths)
    norm = _norm(model, points, across, azimuths, schlick)
    total = (norm[:, 0] if schlick else norm.mean(-1))[:, None]
    if not np.all(total > 0.0):
        raise InputError(f"{type(model).__name__} reflects nothing", "--lut", "ltc needs a material that reflects")
    given = points._replace(wi=_in_view(points.wi, azimuths))
    lobe = given.value.mean(-1) / total
    parts = given.wi, given.weight, lobe
    best = _first(given, lobe)
    if start is not None:
        better = ltc.loss_of(MATRIX, start, *parts) < ltc.loss_of(MATRIX, best, *parts)
        best = np.where(better[:, None], start, best)
    best, loss = ltc.fitted(MATRIX, *parts, best)
    for axis in (0, 1):  # use the fits of the neighbors where they are better
        for side in (1, -1):
            other = np.roll(best.reshape(*shape, 9), side, axis).reshape(-1, 9)
            cells = np.flatnonzero(ltc.loss_of(MATRIX, other, *parts) < loss)
            if len(cells):
                wi, weight, values = (part[cells] for part in parts)
                best[cells], loss[cells] = ltc.fitted(MATRIX, wi, weight, values, other[cells])
    cubed, misplaced = ltc.lobe_errors(given, given.value.mean(-1), total, best, MATRIX)
    return best.reshape(*shape, 9), norm.reshape(*shape, -1), misplaced.reshape(shape), cubed.reshape(shape)


def _norm(model: BSDF, points: Points, mu: Array, phi: Array, schlick: bool) -> Array:
    """E per color channel at each cell; with `schlick`, E at F = 1 and B."""
    if schlick:
        wo = direction(mu, phi)[:, None]
        half = wo + points.wi
        half /= np.maximum(np.linalg.norm(half, axis=-1, keepdims=True), 1e-9)
        light = points.weight * points.value.mean(-1)
        rim = (1.0 - np.clip(np.sum(wo * half, axis=-1), 0.0, 1.0)) ** 5
        return np.stack([light.sum(1), (light * rim).sum(1)], axis=-1)
    value = None if model.transmits else known(model, mu, phi, JUDGE)
    return np.einsum("ck,ckx->cx", points.weight, points.value) if value is None else value


def _in_view(wi: Array, phi: Array) -> Array:
    """The directions of each cell in the frame whose x axis lies below o."""
    c, s = np.cos(phi)[:, None], np.sin(phi)[:, None]
    return np.stack([c * wi[..., 0] + s * wi[..., 1], c * wi[..., 1] - s * wi[..., 0], wi[..., 2]], axis=-1)


def _first(points: Points, lobe: Array) -> Array:
    """An initial W for each cell, from the mean of its lobe and the covariance along its axes perpendicular to the
    mean."""
    weight = points.weight * lobe
    z = np.einsum("ck,ckx->cx", weight, points.wi)
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    x = np.cross([0.0, 1.0, 0.0], z)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    frame = np.stack([x, np.cross(z, x), z], axis=1)
    local = points.wi @ np.swapaxes(frame, 1, 2)
    squares = np.einsum("ck,cki,ckj->cij", weight, local, local)
    sizes, axes = np.linalg.eigh(2.0 * squares[:, :2, :2] / squares[:, 2:, 2:])
    over = 1.0 / np.sqrt(np.maximum(sizes, 1e-12))
    upper = (axes * over[:, None]) @ np.swapaxes(axes, 1, 2) @ frame[:, :2]  # for a cosine lobe, the sizes are 1
    return np.concatenate([upper, frame[:, 2:]], axis=1).reshape(-1, 9)


def _density(numbers: Array, wi: Array) -> Array:
    """D at the directions of each cell."""
    matrix = numbers.reshape(-1, 3, 3)
    transformed = wi @ np.swapaxes(matrix, 1, 2)
    square = np.sum(transformed**2, axis=-1)
    return np.maximum(transformed[..., 2], 0.0) * (np.linalg.det(matrix) / np.pi)[:, None] / square**2


def _slopes(numbers: Array, wi: Array) -> tuple[Array, Array]:
    """D (cells, K), and its derivatives with respect to the nine numbers (cells, 9, K)."""
    matrix = numbers.reshape(-1, 3, 3)
    transformed = wi @ np.swapaxes(matrix, 1, 2)
    value = _density(numbers, wi)
    over = 4.0 / np.sum(transformed**2, axis=-1)
    pull = -over[..., None] * transformed
    pull[..., 2] += 1.0 / np.where(transformed[..., 2] > 0.0, transformed[..., 2], 1.0)
    volume = np.swapaxes(np.linalg.inv(matrix), 1, 2)  # derivative of log det W
    slopes = (np.einsum("cki,ckj->cijk", pull, wi) + volume[..., None]) * value[:, None, None]
    return value, slopes.reshape(len(numbers), 9, -1)


def _mirrored(numbers: Array) -> NDArray[np.bool_]:
    mirrored: NDArray[np.bool_] = np.linalg.det(numbers.reshape(-1, 3, 3)) <= 0.0
    return mirrored


MATRIX = Form(_density, _slopes, _mirrored)


def _gauge(matrix: Array) -> Array:
    """Matrices of the same lobes with a symmetric upper left block and a center entry of 1."""
    turn = np.arctan2(matrix[:, 0, 1] - matrix[:, 1, 0], matrix[:, 0, 0] + matrix[:, 1, 1])
    c, s = np.cos(turn)[:, None], np.sin(turn)[:, None]
    upper = np.stack([c * matrix[:, 0] - s * matrix[:, 1], s * matrix[:, 0] + c * matrix[:, 1]], axis=1)
    gauged = np.concatenate([upper, matrix[:, 2:]], axis=1)
    return np.asarray(gauged / gauged[:, 1:2, 1:2])


# --------------------------------------------------------------------------- integrals over polygons


def polygon_errors(model: BSDF, path: str, inverse: Array) -> Array:
    """The errors of integrals over random quadrilaterals that are computed from the interpolated table, relative to
    sums of f, divided by E, at random points of the table."""
    random = np.random.default_rng(1)
    each = ltc.POLYGONS // PLACES
    corners = ltc.random_quads(random, each * PLACES)
    roughness = random.random(PLACES) if path else np.zeros(PLACES)
    mu = np.maximum(1.0 - random.random(PLACES) ** 2, ltc.MIN_COSINE)
    phi = random.uniform(-np.pi, np.pi, PLACES)
    summed: list[float] = []
    for place in range(PLACES):
        cell = mu[place : place + 1], ltc.LOBE * ltc.FINER, ltc.SPHERE * ltc.FINER, phi[place : place + 1]
        points = ltc.points_of(at(model, path, roughness[place]), *cell)
        light = points.weight[0] * points.value[0].mean(-1)
        quads = corners[place * each : (place + 1) * each]
        summed += [np.sum(light[ltc.inside(quad, points.wi[0])]) / np.sum(light) for quad in quads]
    wo = direction(np.repeat(mu, each), np.repeat(phi, each))
    return np.abs(covered(inverse, np.repeat(roughness, each), wo, corners) - summed)


def covered(inverse: Array, roughness: Array, wo: Array, corners: Array) -> Array:
    """The fraction of the lobe for wo (N, 3) that a quadrilateral (N, 4, 3) covers, from the table as in shaders."""
    kind = backend.types("float64")
    table, outgoing = Table("ltc_inverse", inverse), kind.vec3(wo.T)
    points: Any = tuple(kind.vec3(corners[:, i].T) for i in range(4))
    place = area_light.turned_coordinates(table, kind.float(roughness), outgoing)
    return np.array(area_light.turned_quad(lookup(table, *place), outgoing, points), float)
