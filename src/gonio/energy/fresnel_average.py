"""F_avg = 2 int_0^1 F(mu) mu dmu: the reflectance that light meets on average between the facets."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..ops import clamp, function, maximum, sqrt
from ..optics import fresnel
from .quadrature import gauss

KINDS = {
    "exact": "the integral",
    "imageworks": "the polynomial fit of Kulla2017, p. 26, in reflectivity r and edge tint g (Gulbrandsen2014)",
}

# Gauss-Legendre in sqrt(mu). Metals: 2e-7 from the integral over every preset; glass of eta 1.05 to 3: 4e-8
NODES = 10


def integral(reflectance: Callable[[Any], Any]) -> Any:
    """2 int F(mu) mu dmu of a function of the cosine; a static sum, so it can be recorded."""
    total: Any = 0.0
    for x, w in zip(*gauss(NODES), strict=True):
        total = total + reflectance(float(x) ** 2) * (4.0 * float(w) * float(x) ** 3)
    return total


def schlick(r0: Any) -> Any:
    """R0 + (1 - R0) / 21: the integral of Schlick's curve."""
    return r0 + (1.0 - r0) * (1.0 / 21.0)


@function
def average_conductor(eta: Any, k: Any) -> Any:
    """F_avg = 2 int F mu dmu of a conductor: Gauss's rule in sqrt(mu), error 2e-7."""
    return integral(lambda mu: fresnel.conductor(mu, eta, k))


def dielectric(eta: Any) -> Any:
    """Exact, from the less dense side, eta > 1 (from the other: 1 - (1 - F_avg) / eta^2, by reciprocity)."""
    return average_dielectric(eta)


@function
def average_dielectric(eta: Any) -> Any:
    """F_avg = 2 int F mu dmu of a dielectric from its less dense side: Gauss's rule in sqrt(mu), error 4e-8."""
    return integral(lambda mu: fresnel.dielectric(mu + 0.0 * eta, fresnel.cos_transmitted(mu + 0.0 * eta, eta), eta))


def edge_tint(eta: Any, k: Any) -> tuple[Any, Any]:
    """(r, g): reflectivity at normal incidence and edge tint of a metal (Gulbrandsen2014, eq. 3 solved for g)."""
    r = clamp(fresnel.r0_conductor(eta, k), 1e-4, 0.9999)
    root = sqrt(r)
    largest, smallest = (1.0 + root) / (1.0 - root), (1.0 - r) / (1.0 + r)
    return r, clamp((largest - eta) / (largest - smallest), 0.0, 1.0)


def index_of(r: Any, g: Any) -> tuple[Any, Any]:
    """(eta, k) of the metal that an artist means by reflectivity r and edge tint g, in (0, 1) (Gulbrandsen2014, eq. 2
    and 3): `go.Conductor(*index_of(np.array([0.944, 0.776, 0.373]), np.array([0.998, 0.981, 0.751])))` is about gold.
    """
    root = r**0.5
    eta = g * (1.0 - r) / (1.0 + r) + (1.0 - g) * (1.0 + root) / (1.0 - root)
    return eta, ((r * (eta + 1.0) ** 2 - (eta - 1.0) ** 2) / (1.0 - r)) ** 0.5


@function
def imageworks(r: Any, g: Any) -> Any:
    """Fit of F_avg in reflectivity r and edge tint g (Kulla2017, p. 26), held in [0, 1]."""
    fit = (
        0.087237
        + g * (0.0230685 + g * (-0.0864902 + g * 0.0774594))
        + r * (0.782654 + r * (-0.136432 + r * 0.278708))
        + r * g * (0.19744 + 0.0360605 * g - 0.2586 * r)
    )
    return clamp(fit, 0.0, 1.0)


def of_metal(base: Any, kind: str) -> Any:
    """F_avg of a conductor, its albedo not counted."""
    if base.fresnel == "one":
        return 1.0 + 0.0 * base.eta
    if kind == "imageworks":
        return imageworks(*edge_tint(base.eta, base.k))
    if base.fresnel == "schlick":
        return schlick(fresnel.r0_conductor(base.eta, base.k))
    return average_conductor(base.eta, base.k)


def of_glass(base: Any) -> Any:
    """F_avg of a dielectric from the side of its less dense medium, a float; eta may be below 1."""
    eta = maximum(base.eta, 1.0 / base.eta)
    if base.fresnel == "one":
        return 1.0 + 0.0 * eta
    if base.fresnel == "schlick":
        return schlick(fresnel.r0_dielectric(eta))
    return dielectric(eta)


__all__ = ["KINDS", "dielectric", "edge_tint", "imageworks", "index_of", "integral", "of_glass", "of_metal", "schlick"]
