"""Directional albedo of microfacet models by deterministic quadrature: E(mu, alpha), its average, and the split sum.

With F = 1, the albedo of a microfacet BRDF is an integral over normals (dwi = 4 (o.m) dm, Walter2007, eq. 14):

    E(o) = int D(m) G(o, i) (o.m) / (o.n) dm,   i = 2 (o.m) m - o,   over all m for which i is above the surface.

The quadrature rule is defined in `normals`.

**The error** of a value is estimated as its difference from the same integral computed with different numbers of nodes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ... import ops
from ...ops import Direction, Pair, Scalar, Spectrum, backend
from ...ops.backend import Array
from ...optics import frame, fresnel, masking
from ...optics.ndf import NDF, distribution
from ...optics.special import gauss
from .normals import Integrand, over_azimuths

# Gauss-Legendre nodes in (chi, x). Measured errors of the worst texel of a 128 x 128 table with roughness >= 0.05:
# 2e-7, and 1.4e-5 for Beckmann's `smith-separable`, whose rational fit jumps by 5e-5 at a = 1.6.
NODES = (40, 32)
JUDGE = (60, 48)  # numbers of nodes for the reference by which the error with NODES is estimated
# The same for unequal alphas: errors of 1.2e-5 for ratios down to 0.1. NODES would suffice for nearly equal alphas.
TURNED_NODES = (64, 32)
TURNED_JUDGE = (96, 48)
# For glass: nodes in (each of three pieces of chi, each of five pieces of x)
GLASS_NODES = (12, 10)
GLASS_JUDGE = (24, 20)

_LANES = 1 << 22  # points evaluated at once: 32 MiB per array


class Points(NamedTuple):
    """Points at which E is evaluated: numbers, or arrays that are broadcast against each other.

    mu              cosine of wo, in [0, 1]
    alpha, alpha_y  alphas along x and y; isotropic if alpha_y is None
    phi             azimuth of wo, radians
    """

    mu: Any
    alpha: Any
    alpha_y: Any = None
    phi: Any = 0.0


class Moments(NamedTuple):
    """Integrals at each point: `white` with F = 1, `schlick` with F = (1 - o.m)^5 (B of the split sum)."""

    white: np.ndarray
    schlick: np.ndarray


class TwoWays(NamedTuple):
    """The power that glass reflects and the power that it transmits, at each point."""

    reflected: np.ndarray
    transmitted: np.ndarray


def known_masking(name: str) -> str:
    """Return the name itself. Raises InputError if there is no masking term of this name."""
    return masking.term(name).name


def moments(
    ndf: str,
    masking_name: str,
    mu: ArrayLike,
    alpha: ArrayLike,
    alpha_y: ArrayLike | None = None,
    phi: ArrayLike = 0.0,
    nodes: tuple[int, int] | None = None,
) -> Moments:
    """The albedo of the microfacet BRDF F D G / (4 cos cos) with F = 1, and with F = (1 - o.m)^5.

    mu ... phi  see `Points`
    nodes       numbers of Gauss-Legendre nodes in azimuth and slope; None selects NODES, or TURNED_NODES if alpha_y is
                given
    Returns float64 arrays of the broadcast shape.
    """
    known_masking(masking_name)

    def terms(chosen: NDF, wo: Direction, m: Direction, o_m: Scalar, widths: Pair, _: Scalar) -> tuple[Scalar, ...]:
        value = masking.masking_shadowing(masking_name, chosen, wo, frame.reflect(wo, m), m, widths)
        c = ops.maximum(1.0 - o_m, 0.0)
        return value, value * (ops.sqr(ops.sqr(c)) * c)

    return Moments(*over_normals(ndf, terms, 2, Points(mu, alpha, alpha_y, phi), nodes=nodes))


def reflected(
    ndf: str, masking_name: str, reflectance: Callable[[Scalar], Spectrum], mu: ArrayLike, alpha: ArrayLike,
    alpha_y: ArrayLike | None = None, phi: ArrayLike = 0.0, nodes: tuple[int, int] | None = None,
) -> np.ndarray:  # fmt: skip
    """The albedo of a microfacet BRDF with any Fresnel reflectance.

    reflectance  function of the cosine of incidence on a facet that returns a spectrum
    mu ... phi   see `Points`
    nodes        as in `moments`
    Returns a float64 array of the broadcast shape, with channels last.
    """
    known_masking(masking_name)

    def terms(chosen: NDF, wo: Direction, m: Direction, o_m: Scalar, widths: Pair, _: Scalar) -> tuple[Scalar, ...]:
        g = masking.masking_shadowing(masking_name, chosen, wo, frame.reflect(wo, m), m, widths)
        f: Array = reflectance(o_m)
        return tuple(g * channel for channel in (f if backend.drjit().is_vector_v(f) else (f, f, f)))

    return np.stack(over_normals(ndf, terms, 3, Points(mu, alpha, alpha_y, phi), nodes=nodes), axis=-1)


def glass(
    ndf: str,
    masking_name: str,
    fresnel_name: str,
    points: Points,
    eta: ArrayLike,
    nodes: tuple[int, int] = GLASS_NODES,
) -> TwoWays:
    """The power that a rough dielectric (albedo 1) reflects, and the power that it transmits; their sum is E(mu, alpha,
    eta).

    points  the points (mu, alpha, alpha_y, phi) at which it is evaluated
    eta     index on the far side divided by the index on wo's side: above 1, wo is in the less dense medium; below 1,
            it is in the denser one
    nodes   numbers of nodes in each piece of azimuth and of slope
    """
    known_masking(masking_name)
    kind = fresnel.kind(fresnel_name)

    def terms(chosen: NDF, wo: Direction, m: Direction, o_m: Scalar, widths: Pair, eta_: Scalar) -> tuple[Scalar, ...]:
        cos_t = fresnel.cos_transmitted(o_m, eta_)
        f = kind.dielectric(o_m, cos_t, eta_)
        mirrored, through = frame.reflect(wo, m), frame.refract(wo, m, cos_t, eta_)
        g = masking.masking_shadowing(masking_name, chosen, wo, mirrored, m, widths)
        g_through = masking.masking_shadowing(masking_name, chosen, wo, through, m, widths, transmits=True)
        passes = (cos_t > 0.0) & (through.z < 0.0)
        return f * ops.where(mirrored.z > 0.0, g, 0.0), (1.0 - f) * ops.where(passes, g_through, 0.0)

    return TwoWays(*over_normals(ndf, terms, 2, points, eta, nodes))


def average(
    ndf: str, masking_name: str, alpha: ArrayLike, nodes: tuple[int, int] | None = None, count: int = 32
) -> np.ndarray:
    """E_avg = 2 int_0^1 E(mu) mu dmu at each isotropic alpha, by a Gauss-Legendre rule with `count` nodes in sqrt(mu).

    nodes  as in `moments`
    """
    x, w = gauss(count)
    alpha = np.asarray(alpha, float)
    return moments(ndf, masking_name, x**2, alpha[..., None], nodes=nodes).white @ (4.0 * w * x**3)


def over_normals(
    ndf: str,
    terms: Integrand,
    channels: int,
    points: Points,
    eta: ArrayLike | None = None,
    nodes: tuple[int, int] | None = None,
) -> list[np.ndarray]:
    """int D(m) (o.m) / mu terms(...) dm over the normals that reflect o to a direction above the surface or, if eta is
    given, over those visible from o.

    terms     function (ndf, wo, m, o.m, alpha, eta) that returns `channels` values, without D
    eta       for glass, index on the far side divided by the index on wo's side
    nodes     numbers of nodes in azimuth and slope; for glass, in each piece of them
    Returns one array per channel, of the broadcast shape.
    """
    isotropic = points.alpha_y is None
    nodes = nodes or (NODES if isotropic else TURNED_NODES)
    across = points.alpha if points.alpha_y is None else points.alpha_y
    given = [points.mu, points.alpha, across, points.phi, 2.0 if eta is None else eta]
    arrays = np.broadcast_arrays(*[np.asarray(v, float) for v in given])
    shape, flat = arrays[0].shape, [a.ravel() for a in arrays]
    sides = 1 if isotropic else 2  # without anisotropy, both sides of the plane of incidence are equal
    if eta is not None:
        nodes = (3 * nodes[0], nodes[1])
    rows = max(1, _LANES // (nodes[0] * sides))
    parts = []
    for start in range(0, flat[0].size, rows):
        part = [np.ascontiguousarray(a[start : start + rows]) for a in flat]
        parts.append(over_azimuths(distribution(ndf), terms, channels, part, nodes, sides, eta is not None))
    return [np.concatenate([p[c] for p in parts]).reshape(shape) for c in range(channels)]
