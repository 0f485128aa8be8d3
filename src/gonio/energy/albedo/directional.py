"""Directional albedo: the fraction of the power arriving along one direction that a material scatters back.

    albedo(wo) = int f*(wo, wi) |cos theta_i| dwi        over both sides of the surface

f* is the BSDF without the radiance factor (eta_o/eta_i)^2 (mode "importance"), so that reflected and transmitted power
can be added; an albedo of 1 means no absorption.

There are three methods, from most to least accurate:
    closed form  provided by the material itself (`BSDF.known_albedo`): Lambert, mirrors, smooth glass, mixtures of them
    quadrature   for microfacet models by `quadrature`; for any other `eval` by `cubature`, guided by `sample`
    sampling     mean weight of `sample` over randomly shifted lattices, with the standard error over the shifts
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ... import _html
from ...errors import InputError, did_you_mean
from ...material import BSDF, tree
from ...material.parameters import pair_of
from ...ops import Direction, Spectrum, backend
from ...optics import frame
from ...optics.lattice import r_sequence
from ...optics.roughness import SMOOTH
from ...owner import public
from . import cubature, quadrature

METHODS = ("auto", "closed-form", "quadrature", "sampling")


class Albedo(NamedTuple):
    """Directional albedos.

    value   the albedos, (N, channels)
    error   their estimated errors, (N, channels)
    method  the name of the method
    """

    value: NDArray[np.float64]
    error: NDArray[np.float64]
    method: str

    def _repr_html_(self) -> str:
        rows = zip(self.value, self.error.max(axis=1), strict=True)
        shown = (("  ".join(f"{v:.6g}" for v in value), f"{error:.1e}") for value, error in rows)
        return _html.table(shown, ("albedo", "error"), self.method)


@public
def albedo(
    model: BSDF,
    mu: ArrayLike = 1.0,
    phi: ArrayLike = 0.0,
    *,
    method: str = "auto",
    samples: int = 1 << 16,
    seed: int = 0,
) -> Albedo:
    """Directional albedo of any material: the reflected plus the transmitted fraction of the power.

        go.albedo(go.Conductor.preset("Au", alpha=0.3), mu=[0.2, 1.0]).value        # (2, 3)

    mu       cosine of the angle between wo and the normal, a number in [-1, 1] or (N,); if negative, wo lies inside the
             material, if it transmits
    phi      azimuth of wo, radians
    method   "auto" selects the first of "closed-form", "quadrature" and "sampling" that supports the material
    samples  total number of samples per direction, for "sampling"
    seed     seed of the samples
    Returns an `Albedo`. The error of a quadrature is its difference from a finer or coarser quadrature; the error of
    sampling is one standard error. Raises InputError if the method does not support the material, or if a parameter has
    one value per ray.
    """
    if not isinstance(model, BSDF):
        raise InputError(f"{type(model).__name__} given, a material expected", "albedo")
    if method not in METHODS:
        raise InputError(f"unknown method '{method}'", "albedo: method", did_you_mean(str(method), list(METHODS)))
    if np.ma.is_masked(mu):
        raise InputError("masked numbers given", "albedo: mu", "give mu.compressed()")
    mu, phi = np.broadcast_arrays(np.atleast_1d(np.asarray(mu, float)), np.asarray(phi, float))
    if mu.size == 0:
        raise InputError("no numbers given", "albedo: mu", "give at least one cosine")
    if mu.ndim != 1 or not np.all(np.abs(mu) <= 1.0):
        raise InputError("mu is a cosine: numbers in [-1, 1] expected", "albedo: mu")
    check_uniform(model)
    if method in ("auto", "closed-form"):
        value = known(model, mu, phi, None)
        if value is not None:
            return Albedo(value, np.zeros_like(value), "closed-form")
        if method == "closed-form":
            raise InputError(f"no closed form is known for {type(model).__name__}", "albedo: method", 'give "auto"')
    if method in ("auto", "quadrature"):
        coarse = known(model, mu, phi, NODES)
        fine = None if coarse is None else known(model, mu, phi, JUDGE)
        if coarse is not None and fine is not None:
            return Albedo(fine, np.abs(fine - coarse), "quadrature")
    singular = model.delta != "never" or model.stochastic
    if method == "sampling" or (method == "auto" and singular):
        return _by_sampling(model, mu, phi, samples, seed)
    if singular:
        raise InputError(f"{type(model).__name__} cannot be integrated by quadrature", "albedo", 'give "sampling"')
    return _by_cubature(model, mu, phi, seed)


def direction(mu: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """Unit vectors (N, 3) with the cosines mu and azimuths phi."""
    sin = np.sqrt(np.maximum((1.0 - mu) * (1.0 + mu), 0.0))
    return frame.spherical_array(sin, mu, phi)


def check_uniform(model: BSDF) -> None:
    """Raise InputError if a parameter of the model has one value per ray."""
    for leaf in tree.leaves(model):
        if leaf.parameter.numeric and not backend.is_drjit(leaf.value) and leaf.parameter.rows(leaf.value) != 1:
            where = f"albedo: {type(leaf.owner).__name__}.{leaf.parameter.name}"
            raise InputError("one value per ray given, a single value expected", where)


# --------------------------------------------------------------------------- closed forms and quadrature

NODES, JUDGE = 64, 96  # nodes of the quadratures that a material performs itself, and of those that estimate the error


def known(
    model: BSDF, mu: NDArray[np.float64], phi: NDArray[np.float64], nodes: int | None
) -> NDArray[np.float64] | None:
    """The albedo that the material itself provides, or its quadrature over the microsurface; None if neither is
    possible.

    nodes  number of quadrature nodes; None allows only closed forms
    """

    def inner(material: BSDF, mu: NDArray[np.float64], phi: NDArray[np.float64]) -> NDArray[np.float64] | None:
        return known(material, mu, phi, nodes)

    value = model.known_albedo(mu, phi, inner, nodes)
    if value is not None or nodes is None or model.delta != "never":
        return value
    return _microsurface(model, mu, phi, nodes == JUDGE)


def _microsurface(model: BSDF, mu: np.ndarray, phi: np.ndarray, fine: bool) -> NDArray[np.float64] | None:
    """The albedo by quadrature over the normals of the facets; None if the material has no rough microsurface."""
    surface = model.microsurface
    if surface is None or min(widths(surface.alpha)) < SMOOTH:
        return None
    x, y = widths(surface.alpha)
    turn = 0.0 if surface.rotation is None else float(surface.rotation)  # type: ignore[arg-type]
    if surface.eta is None:
        judge = quadrature.JUDGE if x == y else quadrature.TURNED_JUDGE
        reflectance = model.bind(backend.types("float64")).reflectance  # type: ignore[attr-defined]
        names = surface.ndf, surface.masking, reflectance
        two = None if x == y else y
        return (
            quadrature.reflected(*names, np.abs(mu), x, two, phi - turn, nodes=judge if fine else None)
            * (mu > 0.0)[:, None]
        )
    index = float(surface.eta)  # type: ignore[arg-type]
    # if o is below the surface, the facets are rotated by 180 degrees: the azimuth is that of -o
    azimuth = np.where(mu < 0.0, phi + np.pi, phi) - turn
    power = quadrature.glass(
        surface.ndf,
        surface.masking,
        surface.fresnel,
        quadrature.Points(np.abs(mu), x, None if x == y else y, azimuth),
        np.where(mu >= 0.0, index, 1.0 / index),
        quadrature.GLASS_JUDGE if fine else quadrature.GLASS_NODES,
    )
    total = power.reflected + (power.transmitted if surface.transmits else 0.0)
    return total[:, None] * np.broadcast_to(np.asarray(surface.albedo, float), 3)


def widths(alpha: object) -> tuple[float, float]:
    """The two alphas (alpha_x, alpha_y) as plain numbers."""
    x, y = pair_of(alpha)
    return float(x), float(y)


# --------------------------------------------------------------------------- any other material

TOLERANCE = 1e-6


def _by_cubature(model: BSDF, mu: np.ndarray, phi: np.ndarray, seed: int) -> Albedo:
    bound = model.bind(backend.types("float64"))

    def power(wo: Direction, wi: Direction) -> Spectrum:
        return bound.eval(wo, wi, "importance")

    integral = cubature.integrate(model.sample, power, direction(mu, phi), TOLERANCE, seed)
    return Albedo(integral.value, integral.error, "quadrature")


SHIFTS = 16


def _by_sampling(model: BSDF, mu: np.ndarray, phi: np.ndarray, samples: int, seed: int) -> Albedo:
    """The mean weight over SHIFTS randomly shifted lattices."""
    if samples < SHIFTS:
        raise InputError(f"{samples} samples given", "albedo: samples", f"give {SHIFTS} or more")
    count = samples // SHIFTS
    rng = np.random.default_rng(seed)
    u = (r_sequence(count, 3)[None] + rng.random((SHIFTS, 1, 3))).reshape(-1, 3) % 1.0
    values, errors = [], []
    for wo in direction(mu, phi):
        weight = np.asarray(model.sample(np.repeat(wo[None], len(u), 0), u, mode="importance").weight, float)
        means = weight.reshape(SHIFTS, count, -1).mean(1)
        values.append(means.mean(0))
        errors.append(means.std(0, ddof=1) / np.sqrt(SHIFTS))
    return Albedo(np.array(values), np.array(errors), "sampling")
