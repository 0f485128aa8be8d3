"""Artist-friendly parameters of metals, reflectivity and edge tint, and a fit of F_avg to these parameters."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ...ops import Spectrum, clamp, function, sqrt
from .base import r0_conductor

Reals: TypeAlias = NDArray[np.float64]

AVERAGES = {
    "exact": "the integral of F",
    "imageworks": "the polynomial fit of Kulla2017, p. 26, in reflectivity r and edge tint g (Gulbrandsen2014)",
}


def edge_tint(eta: Spectrum, k: Spectrum) -> tuple[Spectrum, Spectrum]:
    """The reflectivity r at normal incidence and the edge tint g of a metal (Gulbrandsen2014, eq. 3 solved for g)."""
    r = clamp(r0_conductor(eta, k), 1e-4, 0.9999)
    root = sqrt(r)
    largest, smallest = (1.0 + root) / (1.0 - root), (1.0 - r) / (1.0 + r)
    return r, clamp((largest - eta) / (largest - smallest), 0.0, 1.0)


def index_of(r: Reals, g: Reals) -> tuple[Reals, Reals]:
    """(eta, k) of the metal with reflectivity r and edge tint g, both in (0, 1) (Gulbrandsen2014, eq. 2
    and 3): `go.Conductor(*index_of(np.array([0.944, 0.776, 0.373]), np.array([0.998, 0.981, 0.751])))` resembles gold.
    """
    root = r**0.5
    eta = g * (1.0 - r) / (1.0 + r) + (1.0 - g) * (1.0 + root) / (1.0 - root)
    return eta, ((r * (eta + 1.0) ** 2 - (eta - 1.0) ** 2) / (1.0 - r)) ** 0.5


@function
def imageworks(r: Spectrum, g: Spectrum) -> Spectrum:
    """F_avg by a fit in reflectivity r and edge tint g (Kulla2017, p. 26), clamped to [0, 1]."""
    fit = (
        0.087237
        + g * (0.0230685 + g * (-0.0864902 + g * 0.0774594))
        + r * (0.782654 + r * (-0.136432 + r * 0.278708))
        + r * g * (0.19744 + 0.0360605 * g - 0.2586 * r)
    )
    return clamp(fit, 0.0, 1.0)
