"""Directional albedo: the share of the power arriving along one direction that a material gives back.

    albedo(wo) = int f*(wo, wi) |cos theta_i| dwi        over both sides of the surface

f* is the BSDF without the radiance factor (eta_o/eta_i)^2 (mode "importance"), so that reflected and transmitted power
add up, and 1 is a surface that keeps nothing and adds nothing.

Three ways, by falling trust:
    closed form  Lambert, mirrors, smooth glass, and mixes of what is known
    quadrature   microfacets by `quadrature`; any other `eval` by adaptive cubature, which starts where `sample` goes
    sampling     `sample`'s weights over shifted lattices, with the standard error of the shifts
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from .. import ops
from ..errors import InputError, did_you_mean
from ..models import BSDF
from ..models.base import converter
from ..models.conductor import Conductor
from ..models.dielectric import Dielectric
from ..models.lambert import Lambert
from ..models.microfacet import SMOOTH
from ..models.mirror import Mirror
from ..models.mix import Mix
from ..models.two_sided import TwoSided
from ..ops import backend
from ..optics import fresnel
from . import quadrature
from .quadrature import gauss

METHODS = ("auto", "closed-form", "quadrature", "sampling")


class Albedo(NamedTuple):
    """value (N, channels); error, an estimate of its size (N, channels); method, how it was found."""

    value: np.ndarray
    error: np.ndarray
    method: str


def albedo(
    model: BSDF,
    mu: Any = 1.0,
    phi: Any = 0.0,
    *,
    method: str = "auto",
    samples: int = 1 << 16,
    seed: int = 0,
) -> Albedo:
    """Directional albedo of power, reflected plus transmitted, of any material.

        go.albedo(go.Conductor.preset("Au", alpha=0.3), mu=[0.2, 1.0]).value        # (2, 3)

    mu       cosine of wo, (N,) or a number in [-1, 1]; below 0 wo lies inside, for materials that transmit
    phi      azimuth of wo, radians
    method   "auto" takes the first of "closed-form", "quadrature" and "sampling" that there is for the material
    samples  for "sampling", in all, a direction
    Returns value, error and method. The error of a quadrature is its difference to a finer or coarser one, that of
    sampling one standard error.
    Raises InputError where the method does not exist for the material, or a parameter has one value a ray.
    """
    if not isinstance(model, BSDF):
        raise InputError(f"{type(model).__name__} given, a material expected", "albedo")
    if method not in METHODS:
        raise InputError(f"unknown method '{method}'", "albedo: method", did_you_mean(str(method), list(METHODS)))
    mu, phi = np.broadcast_arrays(np.atleast_1d(np.asarray(mu, float)), np.asarray(phi, float))
    if mu.ndim != 1 or not np.all(np.abs(mu) <= 1.0):
        raise InputError("mu is a cosine: numbers in [-1, 1] expected", "albedo: mu")
    check_uniform(model)
    if method in ("auto", "closed-form"):
        value = _closed_form(model, mu, phi)
        if value is not None:
            return Albedo(value, np.zeros_like(value), "closed-form")
        if method == "closed-form":
            raise InputError(f"no closed form is known for {type(model).__name__}", "albedo: method", 'give "auto"')
    rule = _rule(model)
    if method in ("auto", "quadrature") and rule is not None:
        coarse, fine = rule(model, mu, phi, False), rule(model, mu, phi, True)
        return Albedo(fine, np.abs(fine - coarse), "quadrature")
    stochastic = getattr(model, "stochastic", False)
    if method == "sampling" or (method == "auto" and (model.delta != "never" or stochastic)):
        return _by_sampling(model, mu, phi, samples, seed)
    if model.delta != "never" or stochastic:
        raise InputError(f"{type(model).__name__} cannot be integrated by quadrature", "albedo", 'give "sampling"')
    return _by_cubature(model, mu, phi, seed)


def direction(mu: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """Unit vectors (N, 3) of cosine mu and azimuth phi."""
    sin = np.sqrt(np.maximum((1.0 - mu) * (1.0 + mu), 0.0))
    return np.stack([sin * np.cos(phi), sin * np.sin(phi), mu], axis=-1)


def check_uniform(model: BSDF) -> None:
    """Raise InputError where a parameter has one value a ray."""
    for parameter in model.parameters().values():
        value = getattr(model, parameter.name)
        if parameter.kind == "bsdf":
            check_uniform(value)
        elif parameter.numeric and not backend.is_drjit(value):
            rows = np.ndim(value) - (parameter.kind == "spectrum") - isinstance(value, tuple | list)
            if rows > 0:
                where = f"albedo: {type(model).__name__}.{parameter.name}"
                raise InputError("one value a ray given, one value expected", where)


def _spectrum(value: Any, count: int) -> np.ndarray:
    value = np.asarray(value, float)
    return np.broadcast_to(value if value.ndim == 2 else np.atleast_1d(value), (count, 3)).astype(float)


def widths(model: Any) -> tuple[float, float]:
    """(alpha_x, alpha_y) of a microfacet material as plain numbers."""
    alpha = model.alpha
    pair = alpha if isinstance(alpha, tuple | list) else (alpha, alpha)
    return float(pair[0]), float(pair[1])


def bound_in_float64(model: BSDF) -> Any:
    """The model with its parameters as Dr.Jit values."""
    return model.bind(converter(backend.types("float64")))


# --------------------------------------------------------------------------- closed forms


def _closed_form(model: BSDF, mu: np.ndarray, phi: np.ndarray) -> np.ndarray | None:
    count = len(mu)
    above = (mu > 0.0)[:, None]
    if type(model) is Lambert:
        return _spectrum(model.albedo, count) * above
    if isinstance(model, Mix):
        a, b = _closed_form(model.a, mu, phi), _closed_form(model.b, mu, phi)
        return None if a is None or b is None else a * (1.0 - model.weight) + b * model.weight
    if isinstance(model, TwoSided):
        return _closed_form(model.base, np.abs(mu), phi)
    smooth = type(model) in (Conductor, Dielectric) and max(widths(model)) < SMOOTH
    if type(model) is Mirror or smooth:
        # one direction or two, each with its weight: the expectation over u1 is the sum over the choices of a lobe
        wo = direction(mu, phi)
        if type(model) is Dielectric:
            return _smooth_glass(model, mu)
        result = model.sample(wo, np.full((count, 3), 0.5), precision="float64")  # type: ignore[call-arg]
        return np.asarray(result.weight) * above
    return None


def _smooth_glass(model: Dielectric, mu: np.ndarray) -> np.ndarray:
    if model.transmission:
        return _spectrum(model.albedo, len(mu))
    kind = backend.types("float64")
    bound = bound_in_float64(model)
    cos = kind.float(np.abs(mu))
    eta = ops.where(kind.float(mu) >= 0.0, bound.eta, 1.0 / bound.eta)
    f = bound.reflectance(cos, fresnel.cos_transmitted(cos, eta), eta)
    return _spectrum(model.albedo, len(mu)) * backend.to_numpy(f, len(mu))[:, None]


# --------------------------------------------------------------------------- microfacets


def _rule(model: BSDF) -> Callable[[Any, np.ndarray, np.ndarray, bool], np.ndarray] | None:
    if type(model) is Conductor:
        return _conductor if min(widths(model)) >= SMOOTH else None
    if type(model) is Dielectric:
        return _dielectric if min(widths(model)) >= SMOOTH and abs(float(model.eta) - 1.0) > 1e-6 else None
    if hasattr(model, "base") and getattr(model, "turned", None) is False and not model.stochastic:
        return _compensated if _rule(model.base) else None  # type: ignore[attr-defined]
    if isinstance(model, TwoSided) and _rule(model.base):
        return lambda m, mu, phi, fine: _rule(m.base)(m.base, np.abs(mu), phi, fine)  # type: ignore[misc]
    return None


def _shape(model: Any, phi: np.ndarray) -> dict[str, Any]:
    ax, ay = widths(model)
    turn = 0.0 if model.rotation is None else float(model.rotation)
    return {"alpha": ax, "alpha_y": None if ax == ay else ay, "phi": phi - turn}


def _conductor(model: Conductor, mu: np.ndarray, phi: np.ndarray, fine: bool) -> np.ndarray:
    shape = _shape(model, phi)
    judge = quadrature.JUDGE if shape["alpha_y"] is None else quadrature.TURNED_JUDGE
    value = quadrature.reflected(
        model.ndf,
        model.masking,
        bound_in_float64(model).reflectance,
        np.abs(mu),
        nodes=judge if fine else None,
        **shape,
    )
    return value * (mu > 0.0)[:, None]


def _dielectric(model: Dielectric, mu: np.ndarray, phi: np.ndarray, fine: bool) -> np.ndarray:
    nodes = quadrature.GLASS_JUDGE if fine else quadrature.GLASS_NODES
    eta = np.where(mu >= 0.0, float(model.eta), 1.0 / float(model.eta))
    # an o below the surface sees the facets turned about: the azimuth of -o
    shape = _shape(model, np.where(mu < 0.0, phi + np.pi, phi))
    power = quadrature.glass(model.ndf, model.masking, model.fresnel, np.abs(mu), eta=eta, nodes=nodes, **shape)
    total = power.reflected + (power.transmitted if model.transmission else 0.0)
    return _spectrum(model.albedo, len(mu)) * total[:, None]


def _compensated(model: Any, mu: np.ndarray, phi: np.ndarray, fine: bool) -> np.ndarray:
    """The base by its own rule, times a factor of wo alone, or plus lobes that are alike all around the normal."""
    base = _rule(model.base)(model.base, mu, phi, fine)  # type: ignore[misc]
    kind = backend.types("float64")
    bound = bound_in_float64(model)
    bound.settle()
    x, w = gauss(96 if fine else 64)
    wo = [backend.vector_of(d, 3, kind) for d in direction(mu, phi)]
    if hasattr(model, "_factor"):
        return base * np.array([backend.to_numpy(bound._factor(v), 1)[0] for v in wo])
    for row, v in enumerate(wo):
        for side in (1.0, -1.0) if model.transmits else (float(np.sign(mu[row])),):
            wi = backend.vector_of(direction(side * x**2, 0.0 * x), 3, kind)
            value = backend.to_numpy(bound._extra(bound.derived(), v, wi, "importance"), len(x))
            base[row] += 2.0 * np.pi * (2.0 * x * w) @ value
    return base


# --------------------------------------------------------------------------- any eval


ORDER = 6  # Gauss-Legendre nodes a side of a cell, judged by ORDER - 2
TOLERANCE = 1e-6
ROUNDS = 24
MOST_CELLS = 20_000


def _by_cubature(model: BSDF, mu: np.ndarray, phi: np.ndarray, seed: int) -> Albedo:
    values, errors = [], []
    for m, p in zip(mu, phi, strict=True):
        value, error = _cubature(model, direction(np.array([m]), np.array([p])), seed)
        values.append(value)
        errors.append(error)
    return Albedo(np.array(values), np.array(errors), "quadrature")


def _cubature(model: BSDF, wo: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Adaptive cubature over wi in (theta, phi); cells are first split where samples of the model crowd."""
    top = np.pi if model.transmits else 0.5 * np.pi
    if not model.transmits and wo[0, 2] < 0:
        top = np.pi
    side = np.arange(8) / 8
    low = np.stack(np.meshgrid(side * top, side * 2 * np.pi, indexing="ij"), -1).reshape(-1, 2)
    size = np.broadcast_to([top / 8, np.pi / 4], low.shape)
    drawn = model.sample(np.repeat(wo, 512, 0), np.random.default_rng(seed).random((512, 3)))
    wi = np.asarray(drawn.wi)[np.asarray(drawn.pdf) > 0]
    spots = np.stack([np.arccos(np.clip(wi[:, 2], -1, 1)), np.arctan2(wi[:, 1], wi[:, 0]) % (2 * np.pi)], -1)
    for _ in range(10):
        low, size = _split(low, size, _inside(spots, low, size) > 16)
    # the rim of a narrow lobe may fall into a large cell: where any sample fell, cells are of nearly one size
    for _ in range(10):
        hit = _inside(spots, low, size) > 0
        area = np.prod(size, -1)
        low, size = _split(low, size, hit & (area > 16.0 * np.min(area, initial=np.inf, where=hit)))
    done_value: Any = 0.0
    done_error: Any = 0.0
    for _ in range(ROUNDS):
        value, error = _cells(model, wo, low, size)
        total = done_value + value.sum(0)
        worst = error.max(-1)
        open_ = worst > TOLERANCE / max(len(low), 256)
        if not open_.any() or len(low) > MOST_CELLS:
            return total, done_error + error.sum(0)
        done_value, done_error = done_value + value[~open_].sum(0), done_error + error[~open_].sum(0)
        low, size = _split(low[open_], size[open_], np.ones(int(open_.sum()), bool))
    return total, done_error + error.sum(0)


def _inside(spots: np.ndarray, low: np.ndarray, size: np.ndarray) -> np.ndarray:
    """How many of the spots lie in each cell."""
    return np.array([np.sum(np.all((spots >= a) & (spots < a + b), axis=1)) for a, b in zip(low, size, strict=True)])


def _split(low: np.ndarray, size: np.ndarray, which: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    half = size[which] / 2
    corners = [low[which] + half * np.array(c) for c in ((0, 0), (1, 0), (0, 1), (1, 1))]
    return np.concatenate([low[~which], *corners]), np.concatenate([size[~which], *[half] * 4])


def _cells(model: BSDF, wo: np.ndarray, low: np.ndarray, size: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    rules = []
    for order in (ORDER, ORDER - 2):
        x, w = gauss(order)
        a, b = np.meshgrid(x, x, indexing="ij")
        at = low[:, None, :] + size[:, None, :] * np.stack([a.ravel(), b.ravel()], -1)
        theta, phi = at[..., 0].ravel(), at[..., 1].ravel()
        wi = direction(np.cos(theta), phi)
        value = np.asarray(model.eval(wo, wi, mode="importance", precision="float64"))  # type: ignore[call-arg]
        value = (value * np.sin(theta)[:, None]).reshape(len(low), order * order, -1)
        rules.append(np.einsum("cnk,n->ck", value, np.outer(w, w).ravel()) * np.prod(size, -1)[:, None])
    return rules[0], np.abs(rules[0] - rules[1])


SHIFTS = 16


def _by_sampling(model: BSDF, mu: np.ndarray, phi: np.ndarray, samples: int, seed: int) -> Albedo:
    """Mean weight over SHIFTS randomly shifted lattices (the R3 lattice, powers of x^4 = x + 1)."""
    if samples < SHIFTS:
        raise InputError(f"{samples} samples asked for", "albedo: samples", f"give {SHIFTS} or more")
    count = samples // SHIFTS
    rng = np.random.default_rng(seed)
    root = 1.2207440846057596
    lattice = np.arange(1, count + 1)[:, None] * root ** -np.arange(1.0, 4.0) % 1.0
    u = (lattice[None] + rng.random((SHIFTS, 1, 3))).reshape(-1, 3) % 1.0
    values, errors = [], []
    for wo in direction(mu, phi):
        weight = np.asarray(model.sample(np.repeat(wo[None], len(u), 0), u, mode="importance").weight, float)
        means = weight.reshape(SHIFTS, count, -1).mean(1)
        values.append(means.mean(0))
        errors.append(means.std(0, ddof=1) / np.sqrt(SHIFTS))
    return Albedo(np.array(values), np.array(errors), "sampling")
