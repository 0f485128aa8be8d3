"""Albedos as short formulas for shaders: rational functions of roughness and cosine, fitted to minimize the maximum
error.

    P(x, y) / Q(x, y),  with polynomials P and Q of a given total degree, Q(0, 0) = 1

    x is the roughness or its square, alpha; y is the cosine, its root, sqrt(mu / (mu + 4 alpha)) or
    sqrt(mu^2 + alpha^2), in which E and B / E of microfacet models are smooth. The variables with the smallest error
    are used.

Each step solves a linear problem weighted by the denominator of the previous step (Sanathanan and Koerner), and the
weights increase where the error is large (Lawson), so that the maximum error approaches its minimum.
"""

from __future__ import annotations

import re
from itertools import product
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ... import ops
from ...errors import InputError
from ...material import BSDF
from ...ops import Scalar
from ..albedo import albedo, quadrature
from ..albedo.quadrature import Points
from . import ltc
from .target import Target

Array: TypeAlias = NDArray[np.float64]

LEAST_ROUGHNESS, LEAST_COSINE = 0.045, 0.02  # below them, the albedo has a knee that a short formula cannot reproduce
ROWS, COLUMNS = 17, 33
LARGEST_ORDER = 8
STEPS = 30
SAMPLES = 1 << 14  # for an albedo that can only be estimated by sampling at each roughness


class Rational(NamedTuple):
    """P / Q, a rational function of one or two variables.

    above, below  coefficients of P and Q, for powers of x (rows) and y (columns)
    forms         the variables: "roughness" or "alpha" for x, and "mu", "root", "bent" or "soft" for y
    error, mean   the largest and the mean error on the grid of the fit
    """

    above: Array
    below: Array
    forms: tuple[str, str]
    error: float
    mean: float

    def __call__(self, x: Scalar, y: Scalar) -> Scalar:
        """The value at x and y, which `variables` computes from roughness and cosine."""
        value = _horner(self.above, x, y)
        return value / _horner(self.below, x, y) if np.count_nonzero(self.below) > 1 else value


class Curve(NamedTuple):
    """A quantity of a material that is written as code: one rational function per channel, or one for all channels.

    name, doc  name and description of the function
    angle      whether it depends on the cosine
    swept      whether it depends on the roughness
    parts      the rational functions of its components; for "dfg", those of A + B and B / (A + B), which are both at
               most 1
    """

    name: str
    doc: str
    angle: bool
    swept: bool
    parts: tuple[Rational, ...]

    @property
    def error(self) -> float:
        """The largest error on the grid over all components; for A and B, a bound, which is the sum of the two
        errors."""
        return self._all([part.error for part in self.parts])

    @property
    def mean(self) -> float:
        """The mean error on the grid for the component with the largest error; for A and B, a bound."""
        return self._all([part.mean for part in self.parts])

    def _all(self, errors: list[float]) -> float:
        return sum(errors) if self.name == "dfg" else max(errors)


def degrees(order: str | int) -> tuple[int, int]:
    """The degrees of numerator and denominator.

    order  "4" for degrees 4 and 4, "4/2" for 4 and 2, "5/0" for a polynomial
    Raises InputError for anything else.
    """
    match = re.fullmatch(r"(\d)(?:/(\d))?", str(order).strip())
    above, below = (int(match[1]), int(match[2] or match[1])) if match else (0, 0)
    if not match or not 1 <= above <= LARGEST_ORDER or below > LARGEST_ORDER:
        hint = f"an order from 1 to {LARGEST_ORDER}, such as 4, or N/M, such as 5/0 for a polynomial"
        raise InputError(f"'{order}' given, the order of a fit expected", "emit: fit", hint)
    return above, below


class Samples(NamedTuple):
    """Values on the grid of a fit.

    roughness, mu  the grid; roughness has a single entry if the material has no such parameter
    swept          whether the material has a parameter that depends on the roughness
    values         name -> values (rows, columns, channels)
    """

    roughness: Array
    mu: Array
    swept: bool
    values: dict[str, Array]


def sample(model: BSDF, names: tuple[str, ...] = ("albedo", "average_albedo", "dfg")) -> Samples:
    """Sample a material on the grid of roughness and cosine.

    names  quantities: "albedo" (E), "average_albedo" (E_avg) and, for a microsurface, "dfg" (A and B of the split sum)
    """
    path = next(ltc.roughness_paths(model), "")
    roughness = np.maximum(np.linspace(0.0, 1.0, ROWS), LEAST_ROUGHNESS) if path else np.zeros(1)
    mu = np.maximum(np.linspace(0.0, 1.0, COLUMNS) ** 2, LEAST_COSINE)
    values: dict[str, Array] = {}
    if {"albedo", "average_albedo"} & set(names):
        x, w = quadrature.gauss(24)
        both = _albedos(model, path, roughness, np.concatenate([mu, x**2]))
        average = np.einsum("rmc,m->rc", both[:, len(mu) :], 4.0 * w * x**3)
        values = {"albedo": both[:, : len(mu)], "average_albedo": average[:, None]}
    surface = model.microsurface
    if "dfg" in names and surface is not None and model.isotropic:
        white = quadrature.moments(surface.ndf, surface.masking, mu, roughness[:, None] ** 2)
        values["dfg"] = np.stack([white.white, white.schlick / white.white], axis=-1)  # smoother than A and B
    return Samples(roughness, mu, bool(path), values)


def _albedos(model: BSDF, path: str, roughness: Array, mu: Array) -> Array:
    """E (rows, columns, channels)."""
    surface = model.microsurface
    if surface is not None and model.isotropic:
        target = Target(model, surface.ndf, surface.masking)
        cosine, alpha = np.broadcast_arrays(mu, roughness[:, None] ** 2)
        return target.exact(Points(cosine, alpha, None, 0.0))["E"]
    options: dict[str, Any] = {"method": "sampling", "samples": SAMPLES} if path else {}
    return np.array([albedo(ltc.at(model, path, value), mu, **options).value for value in roughness])


DOCS = {
    "albedo": "Directional albedo: the fraction of the light from a direction that is scattered.",
    "average_albedo": "The albedo under uniform illumination.",
    "dfg": "A and B of the split sum: for Schlick's Fresnel term, the albedo is F0 A + B (Karis2013).",
}


def fit(samples: Samples, order: str | int, names: tuple[str, ...] = ()) -> list[Curve]:
    """Fit the curves of a material.

    order  degrees of the rational functions, as in `degrees`
    names  names of the curves to fit; if empty, all
    """
    above, below = degrees(order)
    curves = []
    for name, values in samples.values.items():
        if names and name not in names:
            continue
        angle = values.shape[1] > 1
        mu = samples.mu if angle else np.ones(1)
        equal = np.ptp(values, axis=-1).max() < 1e-12
        channels = values[..., :1] if equal else values
        parts = tuple(_best(samples.roughness, mu, c, above, below) for c in np.moveaxis(channels, -1, 0))
        curves.append(Curve(name, DOCS[name], angle, samples.swept, parts))
    return curves


def variables(form: tuple[str, str], roughness: Any, mu: Any) -> tuple[Any, Any]:
    """The variables x and y of a form, for a roughness and a cosine."""
    alpha = roughness * roughness
    x = alpha if form[0] == "alpha" else roughness
    if form[1] == "bent":
        return x, ops.sqrt(mu / (mu + 4.0 * alpha))
    if form[1] == "soft":
        return x, ops.sqrt(mu * mu + alpha * alpha)
    return x, ops.sqrt(mu) if form[1] == "root" else mu


def _best(roughness: Array, mu: Array, values: Array, above: int, below: int) -> Rational:
    """The rational function in the variables with the smallest error."""
    forms = product(
        ("roughness", "alpha")[: len(roughness)],
        ("mu", "root", "bent", "soft")[: 4 if len(roughness) > 1 < len(mu) else len(mu)],
    )
    return min((_fitted(roughness, mu, values, above, below, form) for form in forms), key=lambda made: made.error)


def _fitted(roughness: Array, mu: Array, values: Array, above: int, below: int, forms: tuple[str, str]) -> Rational:
    alpha = roughness[:, None] ** 2
    x = alpha if forms[0] == "alpha" else roughness[:, None]
    bent, soft = np.sqrt(mu / (mu + 4.0 * alpha)), np.sqrt(mu**2 + alpha**2)
    y = {"mu": mu, "root": np.sqrt(mu), "bent": bent, "soft": soft}[forms[1]]
    x, y = (part.ravel() for part in np.broadcast_arrays(x, y))
    values = values.ravel()
    up, down = (_powers(degree, len(roughness) > 1, len(mu) > 1) for degree in (above, below))
    tops, bottoms = (np.stack([x**i * y**j for i, j in powers], axis=1) for powers in (up, down))
    last, weight, ridge = np.ones(len(values)), np.ones(len(values)), 1e-6
    best, error, mean = np.zeros(len(up) + len(down)), np.inf, np.inf
    system = np.concatenate([tops, -values[:, None] * bottoms[:, 1:]], axis=1)
    # because the columns are orthogonalized once, the normal equations of every step are well conditioned
    z, r = np.linalg.qr(system)
    back = np.linalg.inv(r + 1e-13 * np.eye(len(r)))
    damped = back[len(up) :].T @ back[len(up) :]  # keeps Q near 1
    for _ in range(STEPS):
        scaled = z * (weight / last**2)[:, None]
        matrix = np.einsum("ki,kj->ij", scaled, z) + ridge**2 * damped
        numbers = back @ np.linalg.solve(matrix, np.einsum("ki,k->i", scaled, values))
        top, bottom = tops @ numbers[: len(up)], 1.0 + bottoms[:, 1:] @ numbers[len(up) :]
        if np.min(bottom) < 1e-3:  # a pole
            last, ridge = np.ones(len(values)), 10.0 * ridge
            continue
        rest = np.abs(top / bottom - values)
        if rest.max() < error:
            best, error, mean = np.concatenate([numbers[: len(up)], [1.0], numbers[len(up) :]]), rest.max(), rest.mean()
        weight *= (rest / rest.max() + 0.03) ** 0.7 if rest.max() > 0.0 else 1.0
        weight /= weight.mean()
        last = bottom
    return Rational(_array(up, best[: len(up)]), _array(down, best[len(up) :]), forms, float(error), float(mean))


def _powers(degree: int, rows: bool, columns: bool) -> list[tuple[int, int]]:
    """The powers of x and y up to a total degree, (0, 0) first."""
    both = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
    return [(i, j) for i, j in both if (rows or i == 0) and (columns or j == 0)]


def _array(powers: list[tuple[int, int]], numbers: Array) -> Array:
    made = np.zeros([max(p[axis] for p in powers) + 1 for axis in (0, 1)])
    for place, number in zip(powers, numbers, strict=True):
        made[place] = float(np.float32(number))  # rounded as in a shader
    return made


def _horner(coefficients: Array, x: Any, y: Any) -> Any:
    """The value of a polynomial in y whose coefficients are polynomials in x."""
    value: Any = None
    for column in coefficients.T[::-1]:
        inner: Any = None
        for number in np.trim_zeros(column, "b")[::-1]:
            inner = float(number) if inner is None else inner * x + float(number)
        inner = 0.0 if inner is None else inner
        value = inner if value is None else value * y + inner
    return value
