"""Tables of rough surfaces for OpenPBR: the albedo of facets of any reflectance, and its distribution."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ... import ops
from ...energy import cache
from ...energy.albedo import quadrature
from ...ops import Direction, Pair, Scalar, Table, clamp, function, inset, lookup, maximum, sqrt
from ...ops.backend import Array
from ...ops.table import read_in_numpy
from ...optics import frame, fresnel
from ...optics import masking as terms
from ...optics.lattice import r_sequence
from ...optics.ndf import NDF
from ...optics.roughness import SMOOTH
from ...optics.special import gauss
from ..compensated.kulla_conty import KullaConty
from ..microfacet.conductor import Conductor

SHARP = math.sqrt(SMOOTH)  # roughness of the first row of the tables; smoother facets act as a mirror
MAX_ROOT_F0 = 2.0 / 3.0  # square root of F0 at index 5, where the tables end
INDICES, ROUGHNESSES, COSINES = 33, 33, 65  # the error of F is 2e-3 at grazing angles for any index, else 5e-4
DRAWS = 1 << 12  # samples per direction
HATS = 12  # nodes of the cosine, at equal steps of its root; error for a white coated metal 0.5 %, with 8 nodes 1 %
NODES = [float(x) for x in gauss(6)[0]]  # roots of cosines, for means through two layers; error 1e-3 at F0 = 0.05


def _row(roughness: Scalar) -> Scalar:
    """The coordinate of a roughness in the tables."""
    return maximum(roughness - SHARP, 0.0) * (1.0 / (1.0 - SHARP))


def _root_of(eta: Scalar) -> Scalar:
    """The coordinate of an index in the tables, whose nodes are denser toward 1, where F varies fastest at grazing
    angles."""
    return sqrt(maximum(eta - 1.0, 1e-12) / ((eta + 1.0) * MAX_ROOT_F0))


def _rows(count: int) -> np.ndarray:
    """The roughness of each of `count` rows."""
    return SHARP + (1.0 - SHARP) * np.linspace(0.0, 1.0, count)


@function
def reflected(cos: Scalar, roughness: Scalar, index: Scalar, masking: str) -> Scalar:
    """E of GGX facets of a dielectric of index 1 to 5: the fraction of light that is reflected once."""
    table = _albedos(masking)
    places = _root_of(index), _row(roughness), sqrt(maximum(cos, 0.0))
    at = [inset(x, count) for x, count in zip(places, table.shape, strict=True)]
    return clamp(lookup(table, *at)[0], 0.0, 1.0)


@lru_cache
def _albedos(masking: str) -> Table:
    """E over (fourth root of F0, roughness, square root of the cosine)."""

    def build() -> np.ndarray:
        root = np.linspace(0.0, 1.0, INDICES)[:, None, None] ** 2 * MAX_ROOT_F0
        alpha = _rows(ROUGHNESSES)[None, :, None] ** 2
        mu = np.linspace(0.0, 1.0, COSINES)[None, None, :] ** 2
        eta = np.maximum((1.0 + root) / (1.0 - root), 1.0 + 1e-6)
        return quadrature.glass("ggx", masking, "exact", quadrature.Points(mu, alpha), eta).reflected

    values = cache.remember(("openpbr", masking, INDICES, ROUGHNESSES, COSINES), build)
    return Table("openpbr_reflected", values[..., None])


def reflected_at_nodes(roughness: Scalar, index: Scalar, masking: str) -> tuple[Scalar, ...]:
    """`reflected` at the cosines of `HATS`, then at those of `NODES`, in one lookup instead of eighteen."""
    table = _at_nodes(masking).reflected
    return lookup(table, *[inset(x, n) for x, n in zip((_root_of(index), _row(roughness)), table.shape, strict=True)])


def scattered_at_nodes(roughness: Scalar, masking: str) -> list[tuple[Scalar, ...]]:
    """`scattered` at the cosines of `HATS`."""
    table = _at_nodes(masking).scattered
    shares = lookup(table, inset(_row(roughness), *table.shape))
    return [shares[n : n + HATS] for n in range(0, HATS * HATS, HATS)]


def faced_at_nodes(roughness: Scalar, masking: str) -> list[tuple[Scalar, ...]]:
    """`faced` at the cosines of `NODES`."""
    table = _at_nodes(masking).faced
    shares, count = lookup(table, inset(_row(roughness), *table.shape)), len(PLACES)
    return [shares[n : n + count] for n in range(0, count * len(NODES), count)]


class _AtNodes(NamedTuple):
    reflected: Table
    scattered: Table
    faced: Table


@lru_cache
def _at_nodes(masking: str) -> _AtNodes:
    """The tables at fixed cosines, interpolated as in `lookup`."""
    hats = np.linspace(0.0, 1.0, HATS)

    def at(table: Table, x: np.ndarray) -> np.ndarray:
        axes = [inset(np.linspace(0.0, 1.0, n), n) for n in table.shape[:-1]]
        grid = np.meshgrid(*axes, inset(x, table.shape[-1]), indexing="ij")
        values = np.moveaxis(read_in_numpy(table, *grid), 0, -1)
        return values.reshape(*values.shape[:-2], -1)

    return _AtNodes(
        Table("openpbr_reflected_at_nodes", at(_albedos(masking), np.concatenate([hats, NODES]))),
        Table("openpbr_scattered_at_nodes", at(_scattering(masking), hats)),
        Table("openpbr_faced_at_nodes", at(_faced(masking), np.array(NODES))),
    )


def scattered(cos: Scalar, roughness: Scalar, masking: str) -> tuple[Scalar, ...]:
    """Fractions of the light that white facets scatter, over all bounces, to the neighborhoods of the `HATS`
    cosines."""
    table = _scattering(masking)
    at = [inset(x, count) for x, count in zip((_row(roughness), sqrt(maximum(cos, 0.0))), table.shape, strict=True)]
    return lookup(table, *at)


@lru_cache
def _scattering(masking: str) -> Table:
    """`scattered` over (roughness, square root of the cosine)."""

    def build() -> np.ndarray:
        cos = np.maximum(np.linspace(0.0, 1.0, COSINES) ** 2, 1e-4)
        wo = np.repeat(np.stack([np.sqrt(1.0 - cos * cos), 0.0 * cos, cos], -1), DRAWS, 0)
        u = np.tile(r_sequence(DRAWS, 3), (COSINES, 1))
        rows = []
        for roughness in _rows(ROUGHNESSES):
            drawn = KullaConty(Conductor(alpha=roughness**2, fresnel="one", masking=masking)).sample(wo, u)
            weight = np.where(drawn.pdf > 0.0, drawn.weight[:, 0], 0.0)
            hats = _hats(np.sqrt(np.clip(drawn.wi[:, 2], 0.0, 1.0))) * weight[:, None]
            rows.append(hats.reshape(COSINES, DRAWS, HATS).mean(1))
        shares = np.array(rows)
        normalized: np.ndarray = shares / shares.sum(-1, keepdims=True)
        return normalized

    values = cache.remember(("openpbr-scattered", masking, ROUGHNESSES, COSINES, HATS), build)
    return Table("openpbr_scattered", values)


def _hats(x: np.ndarray) -> np.ndarray:
    """Weights of the nodes for interpolation at positions between them, (N, HATS). They are cubic (Catmull-Rom),
    because linear interpolation would underestimate the mean of a concave transmittance, and linear beyond the ends."""
    d = np.abs(x[:, None] * (HATS - 1) - np.arange(-1, HATS + 1))
    near, far = 1.0 + d * d * (1.5 * d - 2.5), 2.0 + d * (d * (2.5 - 0.5 * d) - 4.0)
    weights: np.ndarray = np.where(d < 1.0, near, np.where(d < 2.0, far, 0.0))
    for ghost, end, next_one in ((0, 1, 2), (HATS + 1, HATS, HATS - 1)):
        weights[:, end] += 2.0 * weights[:, ghost]
        weights[:, next_one] -= weights[:, ghost]
    return weights[:, 1:-1]


@lru_cache
def means() -> list[float]:
    """Weights of the `HATS` nodes for a cosine-weighted mean."""
    return _hats(((np.arange(4096) + 0.5) / 4096) ** 0.25).mean(0).tolist()


# --------------------------------------------------------------------------- any reflectance

# Gauss nodes of the cosine at which the reflectance of facets is evaluated; it is interpolated by a polynomial
PLACES = [float(x) for x in gauss(8)[0]]
FEW_PLACES = [float(x) for x in gauss(4)[0]]  # for small corrections
LOSS_INDICES, LOSS_ROUGHNESSES, LOSS_COSINES = 13, 13, 25


def prepare(masking: str) -> None:
    """Compute all tables."""
    for find in (_at_nodes, _spared):
        find(masking)


def shares_of(x: Array, places: list[float]) -> list[Array]:
    """Lagrange polynomials: the weights, for interpolation at x, of the values at `places`."""
    shares = []
    for n, here in enumerate(places):
        others = [one for m, one in enumerate(places) if m != n]
        value: Array = 1.0
        for one in others:
            value = value * ((x - one) * (1.0 / (here - one)))
        shares.append(value)
    return shares


FROM_PLACES: list[list[float]] = np.array(
    shares_of(np.array(FEW_PLACES), PLACES)
).T.tolist()  # weights of the values at `PLACES`, for each of `FEW_PLACES`


def faced(cos: Scalar, roughness: Scalar, masking: str) -> tuple[Scalar, ...]:
    """The weights with which the reflectance at each of `PLACES` contributes to the albedo of facets for a cosine."""
    table = _faced(masking)
    at = [inset(x, count) for x, count in zip((_row(roughness), sqrt(maximum(cos, 0.0))), table.shape, strict=True)]
    return lookup(table, *at)


@lru_cache
def _faced(masking: str) -> Table:
    """`faced` over (roughness, square root of the cosine)."""
    rows, columns = ROUGHNESSES, 65

    def one(ndf: NDF, wo: Direction, m: Direction, o_m: Scalar, alpha: Pair, _: Scalar) -> tuple[Scalar, ...]:
        g = terms.masking_shadowing(masking, ndf, wo, frame.reflect(wo, m), m, alpha)
        return tuple(g * share for share in shares_of(o_m, PLACES))

    def build() -> np.ndarray:
        alpha = _rows(rows)[:, None] ** 2
        mu = np.linspace(0.0, 1.0, columns)[None, :] ** 2
        return np.stack(quadrature.over_normals("ggx", one, len(PLACES), quadrature.Points(mu, alpha)), -1)

    return Table("openpbr_faced", cache.remember(("openpbr-faced", masking, rows, columns, len(PLACES)), build))


def spared(cos: Scalar, roughness: Scalar, eta: Scalar, masking: str) -> tuple[Scalar, ...]:
    """The derivative of the energy lost by glass facets with respect to the reflectance at each of `FEW_PLACES`
    (cosines outside), which is the transmitted minus the reflected energy; first for light from outside, then from
    inside."""
    table = _spared(masking)[0]
    at = [
        inset(x, count)
        for x, count in zip((_root_of(eta), _row(roughness), sqrt(maximum(cos, 0.0))), table.shape, strict=True)
    ]
    return lookup(table, *at)


def spared_on_average(roughness: Scalar, eta: Scalar, masking: str) -> tuple[Scalar, ...]:
    """The cosine-weighted mean of `spared`."""
    table = _spared(masking)[1]
    return lookup(table, *[inset(x, n) for x, n in zip((_root_of(eta), _row(roughness)), table.shape, strict=True)])


@lru_cache
def _spared(masking: str) -> tuple[Table, Table]:
    """`spared` over (fourth root of F0, roughness, square root of the cosine), and its cosine-weighted mean."""

    def one(ndf: NDF, wo: Direction, m: Direction, o_m: Scalar, alpha: Pair, eta: Scalar) -> tuple[Scalar, ...]:
        cos_t = fresnel.cos_transmitted(o_m, eta)
        mirrored, through = frame.reflect(wo, m), frame.refract(wo, m, cos_t, eta)
        back = terms.masking_shadowing(masking, ndf, wo, mirrored, m, alpha)
        on = terms.masking_shadowing(masking, ndf, wo, through, m, alpha, transmits=True)
        more = ops.where((cos_t > 0.0) & (through.z < 0.0), on, 0.0) - ops.where(mirrored.z > 0.0, back, 0.0)
        more = ops.where(cos_t > 0.0, more, 0.0)  # total reflection does not depend on layers
        return tuple(more * share for share in shares_of(ops.where(eta > 1.0, o_m, cos_t), FEW_PLACES))

    def build() -> np.ndarray:
        root = np.linspace(0.0, 1.0, LOSS_INDICES)[:, None, None] ** 2 * MAX_ROOT_F0
        eta = np.maximum((1.0 + root) / (1.0 - root), 1.0 + 1e-4)
        alpha = _rows(LOSS_ROUGHNESSES)[None, :, None] ** 2
        x, w = gauss(16)
        places = np.concatenate([np.linspace(0.0, 1.0, LOSS_COSINES), x])[None, None, :]
        sides = [
            quadrature.over_normals(
                "ggx", one, len(FEW_PLACES), quadrature.Points(places**2, alpha), ratio, quadrature.GLASS_NODES
            )
            for ratio in (eta, 1.0 / eta)
        ]
        values = np.stack([part for side in sides for part in side], -1)
        average = np.einsum("erxc,x->erc", values[:, :, LOSS_COSINES:], 4.0 * w * x**3)
        return np.concatenate([values[:, :, :LOSS_COSINES], average[:, :, None]], 2)

    key = ("openpbr-spared", masking, LOSS_INDICES, LOSS_ROUGHNESSES, LOSS_COSINES, len(FEW_PLACES))
    values = cache.remember(key, build)
    return Table("openpbr_spared", values[:, :, :-1]), Table("openpbr_spared_on_average", values[:, :, -1])
