"""The difference between two materials, in f over pairs of directions and in albedo.

    result = difference(go.OrenNayar(sigma=0.5), go.Lambert())
    result.mean, result.largest, result.largest_at

f is compared at directions of which a third each are sampled from the two materials and from the cosine, so that narrow
lobes are covered; each pair is weighted by the inverse density of this mixture. Perfectly specular components have no f
and contribute only to the albedo.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..material import BSDF
from ..material.angular_range import AngularRange
from .albedo import albedo, direction

Floats = NDArray[np.float64]
VIEWS = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 85.0)  # degrees of wo
AZIMUTHS = 8  # azimuths per view, if a material is anisotropic
PAIRS = 1 << 14  # directions wi per view
GRAZING = 0.03  # smallest cosine of wi: f = eval / cos is inaccurate within 1.7 degrees of the horizon
FAINT = 0.01  # fraction of the mean f of a view below which a relative difference is not visible
METRICS = {
    "mean": "int |f_A - f_B| cos over int f_B cos, averaged over views",
    "largest": "the largest |f_A - f_B| over the larger of both, if either is over 1 % of the mean",
    "albedo": "the largest difference of the directional albedos",
}


@dataclass(frozen=True)
class View:
    """The results of the comparison at one angle of wo.

    theta    angle between wo and the normal, degrees
    mean     int |f_A - f_B| cos d wi divided by int f_B cos d wi, averaged over the channels; inf if B is black
    largest  largest |f_A - f_B| / max(f_A, f_B)
    wi       (theta, phi) of the direction wi at which it occurs, degrees; phi is relative to wo
    f        f_A and f_B at this direction, 1/sr, averaged over the channels
    albedo   directional albedos of A and B, (2, channels)
    """

    theta: float
    mean: float
    largest: float
    wi: tuple[float, float]
    f: tuple[float, float]
    albedo: Floats


@dataclass(frozen=True)
class Difference:
    """The results of the comparison of two materials.

    views         the results at each angle of wo
    known         the angles at which the values of both materials are known; only these are compared
    has_specular  whether either material has perfectly specular components, which contribute only to the albedo
    metric        the metric to which the tolerance applies, one of METRICS
    tolerance     the largest value of the metric that passes; if None, any value passes
    """

    views: tuple[View, ...]
    known: AngularRange
    has_specular: bool
    metric: str = "mean"
    tolerance: float | None = None

    @property
    def mean(self) -> float:
        """The relative difference of f cos, averaged over all wi and views."""
        return float(np.mean([view.mean for view in self.views]))

    @property
    def largest_at(self) -> View:
        """The view with the largest relative difference of f."""
        return max(self.views, key=lambda view: view.largest)

    @property
    def largest(self) -> float:
        return self.largest_at.largest

    @property
    def albedo(self) -> float:
        """The largest difference of the albedos, over channels and views."""
        return float(max(np.abs(view.albedo[0] - view.albedo[1]).max() for view in self.views))

    def value(self, metric: str) -> float:
        return {"mean": self.mean, "largest": self.largest, "albedo": self.albedo}[metric]

    @property
    def passed(self) -> bool:
        return self.tolerance is None or self.value(self.metric) <= self.tolerance

    def as_dict(self) -> dict[str, object]:
        """A dictionary for JSON, in which an infinite mean is null."""
        at = self.largest_at
        return {
            "mean": _finite(self.mean),
            "largest": self.largest,
            "largest_at": {"wo": [at.theta, 0.0], "wi": list(at.wi), "f": list(at.f)},
            "albedo": self.albedo,
            "known": {name: list(ends) for name, ends in self.known._asdict().items()},
            "specular": self.has_specular,
            "views": [
                {
                    "theta": view.theta,
                    "mean": _finite(view.mean),
                    "largest": view.largest,
                    "wi": list(view.wi),
                    "f": list(view.f),
                    "albedo": view.albedo.tolist(),
                }
                for view in self.views
            ],
            "metric": self.metric,
            "tolerance": self.tolerance,
            "passed": self.passed,
        }


def difference(
    a: BSDF, b: BSDF, metric: str = "mean", tolerance: float | None = None, pairs: int = PAIRS, seed: int = 1
) -> Difference:
    """Compare f and the albedo of a material A with those of B, at the angles at which the values of both are known.

    metric     the metric to which the tolerance applies, one of METRICS
    tolerance  the largest value of the metric that passes; if None, any value passes
    pairs      number of directions wi per view
    seed       seed of these directions
    Returns a `Difference`. Raises InputError for an unknown metric, or if there is no angle at which both are known.
    """
    if metric not in METRICS:
        raise InputError(f"unknown metric '{metric}' for materials", "--metric", " | ".join(METRICS))
    if tolerance is not None and not tolerance >= 0.0:
        raise InputError(f"a tolerance of {tolerance:g}", "--tolerance", "give 0 or more")
    known = a.angular_range.within(b.angular_range)
    low, high = known.view
    views = list(dict.fromkeys(min(max(view, low), high) for view in VIEWS)) if low <= high else []
    if not views or known.light[0] > known.light[1]:
        raise InputError("no direction at which both materials are known", "compare", "their measured angles differ")
    mu = np.cos(np.radians(views))
    albedos = np.stack([np.broadcast_to(albedo(one, mu).value, (len(mu), 3)) for one in (a, b)], axis=1)
    rng = np.random.default_rng([seed, 95])
    specular = any(one.delta != "never" for one in (a, b))
    per_view = [_view(a, b, theta, of, known, pairs, rng) for theta, of in zip(views, albedos, strict=True)]
    return Difference(tuple(per_view), known, specular, metric, tolerance)


def _view(
    a: BSDF, b: BSDF, theta: float, albedos: Floats, known: AngularRange, pairs: int, rng: np.random.Generator
) -> View:
    turns = 1 if a.isotropic and b.isotropic else AZIMUTHS
    phi = np.repeat(2.0 * np.pi * np.arange(turns) / turns, -(-pairs // turns))
    wo = direction(np.full(len(phi), np.cos(np.radians(theta))), phi)
    wi, density = _directions(a, b, wo, rng)
    usable = (density > 0.0) & (np.abs(wi[:, 2]) > GRAZING) & known.holds(wo, wi)
    wo, wi, density = wo[usable], wi[usable], density[usable]
    values = [np.asarray(one.eval(wo, wi, precision="float64"), float).mean(axis=1) for one in (a, b)]
    off, of_b = np.abs(values[0] - values[1]), np.abs(values[1])
    total = float((of_b / density).sum())
    apart = float((off / density).sum())
    mean = apart / total if total > 0.0 else (0.0 if apart == 0.0 else np.inf)
    larger = np.maximum(*map(np.abs, values))
    cos = np.abs(wi[:, 2])
    level = FAINT * float((larger / density).sum()) / max(len(density), 1) / np.pi
    ratio = np.where(larger / cos > level, off / np.maximum(larger, 1e-300), 0.0)
    at = int(np.argmax(ratio)) if len(ratio) else 0
    if not len(ratio):
        return View(theta, 0.0, 0.0, (0.0, 0.0), (0.0, 0.0), albedos)
    azimuth = np.degrees(np.arctan2(wi[at, 1], wi[at, 0]) - np.arctan2(wo[at, 1], wo[at, 0])) % 360.0
    place = (float(np.degrees(np.arccos(np.clip(wi[at, 2], -1.0, 1.0)))), float(azimuth) if theta > 0.0 else 0.0)
    f = (float(values[0][at] / cos[at]), float(values[1][at] / cos[at]))
    return View(theta, mean, float(ratio[at]), place, f, albedos)


def _directions(a: BSDF, b: BSDF, wo: Floats, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Directions wi, of which a third each are sampled from the two materials and from the cosine, and the density of
    this mixture. The density is 0 for samples of perfectly specular components."""
    u = rng.random((len(wo), 3))
    both = a.transmits or b.transmits
    side = np.where(both & (u[:, 0] < 0.5), -1.0, 1.0)
    z = np.sqrt(1.0 - u[:, 1])
    wi = direction(z, 2.0 * np.pi * u[:, 2]) * np.stack([np.ones_like(z), np.ones_like(z), side], -1)
    third = np.arange(len(wo)) % 3
    fine = np.ones(len(wo), bool)
    for index, one in enumerate((a, b), 1):
        chosen = third == index
        drawn = one.sample(wo[chosen], u[chosen], precision="float64")
        wi[chosen] = np.asarray(drawn.wi)
        fine[chosen] = ~np.asarray(drawn.delta) & (np.asarray(drawn.pdf) > 0.0)
    cosine = np.abs(wi[:, 2]) / np.pi * np.where(both, 0.5, wi[:, 2] > 0.0)
    density = cosine / 3.0
    for one in (a, b):
        density = density + np.asarray(one.pdf(wo, wi, precision="float64"), float) / 3.0
    return wi, np.where(fine, density, 0.0)


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


__all__ = ["METRICS", "Difference", "View", "difference"]
