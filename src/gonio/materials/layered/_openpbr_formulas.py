"""Formulas shared by OpenPBR's slabs."""

from __future__ import annotations

import math

from ... import ops
from ...ops import (
    Direction,
    Mask,
    Pair,
    Scalar,
    Spectrum,
    abs,
    clamp,
    function,
    inv_pi,
    log,
    maximum,
    minimum,
    safe_div,
    safe_sqrt,
    sqr,
    sqrt,
    vec3,
    where,
)
from ...ops.backend import Array
from ...optics import frame, fresnel
from ...optics.fresnel.schlick import schlick
from ...optics.special import gauss
from ._openpbr_tables import HATS, MAX_ROOT_F0


def mix(a: Array, b: Array, share: Scalar) -> Array:
    """Linear interpolation: a at share = 0, b at share = 1."""
    return a * (1.0 - share) + b * share


@function
def modulated(ratio: Scalar, weight: Scalar) -> Scalar:
    """The index whose F0 is `weight` times that of the index `ratio`, limited to 5."""
    root = (ratio - 1.0) / (ratio + 1.0)
    epsilon = ops.copysign(minimum(abs(root) * sqrt(maximum(weight, 1e-24)), MAX_ROOT_F0), root)
    return (1.0 + epsilon) / (1.0 - epsilon)


def total_of(terms: list[Array]) -> Array:
    total = terms[0]
    for term in terms[1:]:
        total = total + term
    return total


def seen_by(cos: Scalar, ratio: Scalar, row: tuple[Scalar, ...], facets: tuple[Scalar, ...]) -> Scalar:
    """<w>, the mean of w over the light that a dielectric's facets scatter to a direction with the given cosine. The
    facets reflect most at grazing angles, so the weights are those of white facets times F of the facet whose normal is
    halfway between the two directions.

    row     weights of white facets, from `scattered`
    facets  w at the same nodes of the cosine
    """
    sin, r0 = safe_sqrt(1.0 - sqr(cos)), fresnel.r0_dielectric(ratio)
    weighted, total = ops.zeros_like(cos), ops.zeros_like(cos)
    for n, (share, w) in enumerate(zip(row, facets, strict=True)):
        other = (n / (HATS - 1.0)) ** 2
        half = safe_sqrt(0.5 + 0.5 * (other * cos - math.sqrt(1.0 - other * other) * sin))
        one = share * schlick(half, r0)
        weighted, total = weighted + one * w, total + one
    return weighted / maximum(total, 1e-9)


@function
def rough_along(w: Direction, alpha: Pair, index: Scalar) -> Scalar:
    """The roughness of an isotropic dielectric that reflects about as much as an anisotropic one along a direction. Its
    alpha is the root mean square of the two widths at normal incidence, and the width along the direction at grazing
    incidence. The error is 0.02 if the ratio of the widths is 3."""
    total, sin2 = 0.5 * (sqr(alpha.x) + sqr(alpha.y)), frame.sin2(w)
    seen2 = (sqr(alpha.x * w.x) + sqr(alpha.y * w.y) + 1e-6 * total) / (sin2 + 1e-6)
    share = (1.0 - w.z) * (1.2 - (index - 1.0) / (index + 1.0))
    return minimum(sqrt(sqrt(total * ops.exp(share * log(seen2 / total)))), 1.0)


def covered_less(transmitted: Scalar, less: Scalar, let_in: Spectrum) -> Spectrum:
    """Transmittance of a coat for light from the body below, which also receives the light `less` that facets lose
    relative to white facets.

    transmitted  transmittance of the coat's surface
    let_in       transmittance of the base's surface
    """
    return transmitted + less * (1.0 - let_in) / maximum(let_in, 1e-3)


def covered(E: Spectrum, filmed: tuple[Spectrum, ...], shares: tuple[Scalar, ...]) -> Spectrum:
    """The albedo of facets under a film: E plus the film's changes at `PLACES`, weighted by `shares`."""
    if not filmed:
        return E
    return clamp(E + total_of([one * share for one, share in zip(filmed, shares, strict=True)]), 0.0, 1.0)


def averaged(values: list[Array]) -> Array:
    """2 int F mu dmu from F at `PLACES`, or at `FEW_PLACES`."""
    x, w = gauss(len(values))
    return total_of([value * weight for value, weight in zip(values, (2.0 * w * x).tolist(), strict=True)])


@function
def over_pi(scale: Scalar) -> Scalar:
    """The mean m for which 1 / (pi m) equals `scale`; 0 for a scale of 0."""
    return safe_div(inv_pi, scale)


def colour_again(f: Spectrum, lost: Scalar) -> Spectrum:
    """The color of light scattered twice or more by facets: F^2 E_avg / (1 - F (1 - E_avg)).

    f     F, averaged over the hemisphere
    lost  1 - E_avg
    """
    return sqr(f) * (1.0 - lost) / (1.0 - f * lost)


@function
def power(colour: Spectrum, exponent: Scalar) -> Spectrum:
    """A color raised to a power; 0 remains 0."""
    return ops.exp(log(maximum(colour, 1e-6)) * exponent)


def direction_at(cos: Scalar) -> Direction:
    """A direction with a given cosine, halfway between the x and y axes."""
    sin = math.sqrt(0.5) * safe_sqrt(1.0 - sqr(cos))
    return vec3(sin, sin, cos)


def lobe_value(value: Array, smooth: Mask | None, ideal: Mask | None, mirror: Scalar | float = 1.0) -> Array:
    """The value of a lobe, which is 0 if its facets are smooth. For pairs connected by a delta lobe, `mirror` if the
    facets are smooth, else 0.

    smooth  rays for which the facets are smooth; None if there are none
    ideal   rays whose pair of directions is connected by a delta lobe; None if there are none
    """
    if ideal is None:
        return value if smooth is None else where(smooth, 0.0, value)
    rough = where(ideal, 0.0, value)
    return rough if smooth is None else where(smooth, where(ideal, mirror, 0.0), rough)
