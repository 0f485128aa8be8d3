"""Scattering by a material as data for plots: values and density in the plane of incidence, and albedo.

`wo`, toward the viewer, is tilted to the left by theta_o; angles to the right of the normal, on the side of the mirror
direction, are positive.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..material import BSDF

Floats = NDArray[np.floating]

STEP = 0.05  # degrees between directions: a GGX lobe of alpha 0.01 is 0.6 degrees wide at half maximum
SAMPLES = 64  # per axis and point of an albedo curve: 4096 stratified samples, about 0.2 % of noise


@dataclass(frozen=True)
class Curve:
    """Values and density for one view as functions of the angle of wi (degrees), and the reflectance of delta lobes.
    Values and density are NaN where they are unknown."""

    view: float
    angles: Floats
    values: Floats  # eval, (N, channels), 1/sr
    pdf: Floats  # (N,), 1/sr
    deltas: tuple[tuple[float, float], ...]  # (angle of wi in degrees, weight)

    @property
    def mean(self) -> Floats:
        return self.values.mean(axis=1)

    @property
    def gray(self) -> bool:
        values = np.nan_to_num(self.values)
        return bool(np.ptp(values, axis=1).max() <= 1e-4 * values.max())

    @property
    def peak(self) -> float:
        """The highest known value or density."""
        return max(float(np.nan_to_num(self.mean).max()), float(np.nan_to_num(self.pdf).max()))

    @property
    def full(self) -> bool:
        """Whether the curve extends below the surface."""
        return bool(self.angles[-1] > 90)

    def side(self, side: int) -> NDArray[np.bool_]:
        """A mask of the directions that lie above (1) or below (-1) the surface."""
        above = np.abs(self.angles) <= 90
        return above if side > 0 else ~above


def curve(bsdf: BSDF, view: float) -> Curve:
    """Evaluate a material in the plane of incidence, for wo at `view` degrees from the normal."""
    reach = 180 if bsdf.transmits else 90
    angles = np.linspace(-reach, reach, round(2 * reach / STEP) + 1)
    theta = np.radians(angles)
    wi = np.stack([np.sin(theta), np.zeros_like(theta), np.cos(theta)], axis=1)
    wo = np.broadcast_to(_toward(view), wi.shape)
    values, pdf = np.asarray(bsdf.eval(wo, wi)), np.asarray(bsdf.pdf(wo, wi))
    known = bsdf.angular_range.holds(wo, wi)
    values, pdf = np.where(known[:, None], values, np.nan), np.where(known, pdf, np.nan)
    return Curve(view, angles, values, pdf, _deltas(bsdf, view))


def _toward(view: float) -> Floats:
    theta = math.radians(view)
    return np.array([-math.sin(theta), 0.0, math.cos(theta)])


def _deltas(bsdf: BSDF, view: float) -> tuple[tuple[float, float], ...]:
    u = (np.arange(64) + 0.5) / 64
    drawn = bsdf.sample(np.broadcast_to(_toward(view), (64, 3)), np.stack([u, np.full(64, 0.5), np.full(64, 0.5)], 1))
    deltas: dict[float, float] = {}
    for index in np.flatnonzero(np.asarray(drawn.delta) & (np.asarray(drawn.pdf) > 0)):
        x, _, z = np.asarray(drawn.wi)[index]
        # The fraction of the power in a delta lobe: its weight times its probability, without the factor
        # (eta_o/eta_i)^2 of transmitted radiance.
        probability, eta = float(np.asarray(drawn.pdf)[index]), float(np.asarray(drawn.eta)[index])
        strength = float(np.mean(np.asarray(drawn.weight)[index])) * probability * eta**2
        deltas[round(math.degrees(math.atan2(x, z)), 2)] = strength
    return tuple(deltas.items())


def albedo(bsdf: BSDF, views: Floats) -> Floats:
    """Fraction of the power that leaves, (views, channels): the mean weight of stratified samples.

    Transmitted radiance carries (eta_o/eta_i)^2; power does not, hence the factor sample.eta^2.
    """
    rng = np.random.default_rng(1)
    count = SAMPLES * SAMPLES
    x, y = np.meshgrid(np.arange(SAMPLES), np.arange(SAMPLES))
    cells = np.stack([x.ravel(), y.ravel()], axis=1)
    # The number that selects the lobe is stratified, too, in an independent order.
    u = np.concatenate([rng.permutation(count)[:, None] / count, cells / SAMPLES], axis=1)
    u = u + rng.random(u.shape) * [1 / count, 1 / SAMPLES, 1 / SAMPLES]
    rows = []
    for view in views:
        drawn = bsdf.sample(np.broadcast_to(_toward(view), (count, 3)), np.minimum(u, 1 - 2**-24))
        rows.append((np.asarray(drawn.weight) * np.asarray(drawn.eta)[:, None] ** 2).mean(axis=0))
    return np.array(rows)
