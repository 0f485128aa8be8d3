"""Transforms of mu in which the albedo is smooth despite masking, for polynomials of the missing energy and for the
axes of tables.

Masking is strong where mu is below a few alpha. With a bend b of a few alpha and

    u(mu) = mu^p (1 + b^p) / (mu^p + b^p),   r = u^(1 / 2^n),   z = 1 - r        (p, n, b: see `FORMS`)

the albedo is a smooth function of z in [0, 1] for any alpha, down to the limit alpha -> 0.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .. import ops
from ..ops import Scalar, sqr, sqrt
from ..ops.backend import Array
from ..optics.masking import term
from ..optics.ndf import distribution

DEGREE = 10  # errors: 7e-5 (Smith, schlick-direct), 2e-4 (schlick-ibl), 4e-4 (Beckmann's rational fit, due to its jump)
MIN_POWER = 1e-33  # smallest power of r, and the inverse of the largest z / r: float32 ranges from 1e-38 to 3e38


class Form(NamedTuple):
    """A transform of mu, and the degree of the polynomials in the transformed variable.

    squarings     p = 2^squarings
    roots         n
    factor, hold  b = factor w / (1 + hold w), where w is the onset of masking (`Masking.onset`)
    degree        degree of the polynomials
    """

    squarings: int
    roots: int
    factor: float
    hold: float = 0.0
    degree: int = DEGREE

    @property
    def least(self) -> float:
        """The value of mu / b below which M is constant, because powers of r and z / r would exceed the range of
        float32."""
        return MIN_POWER ** (2.0 ** (self.roots - self.squarings) / self.degree)


# chosen to minimize the error of the fit
FORMS = {
    "schlick": Form(0, 0, 2.0),
    "ggx": Form(0, 0, 2.0, 6.0),
    "narrow": Form(2, 2, 4.0),  # other distributions: no energy is missing where mu exceeds a few alpha
    # glass also has a knee at the critical angle
    "schlick-glass": Form(0, 0, 2.0, degree=14),
    "thin-ggx": Form(0, 1, 2.0, degree=14),
    "thin-narrow": Form(1, 2, 4.0, degree=14),
    "dense-ggx": Form(0, 0, 4.0, degree=14),
    "dense-narrow": Form(1, 1, 4.0, degree=14),
}


def form_of(ndf: str, masking: str, side: str = "") -> Form:
    """The form for the table of a metal, or of one side of glass.

    side  "thin" or "dense" for glass, "" for a metal
    """
    if not term(masking).smith:
        return FORMS["schlick-glass" if side else "schlick"]
    kind = "ggx" if distribution(ndf).falls_slowly else "narrow"
    return FORMS[f"{side}-{kind}" if side else kind]


def knee(form: Form, masking: str, alpha: Scalar) -> Scalar:
    """The bend b of a form for a given alpha: the cosine below which masking is strong."""
    return _bend(form, term(masking).onset(alpha))


def numpy_knee(form: Form, masking: str, alpha: np.ndarray) -> np.ndarray:
    """`knee` for a NumPy array of alphas."""
    onset: Array = term(masking).onset(ops.backend.types("float64").float(np.ravel(alpha)))
    return _bend(form, np.asarray(onset.numpy()).reshape(np.shape(alpha)))


def _bend(form: Form, width: Array) -> Array:
    return form.factor * width / (1.0 + form.hold * width) if form.hold else form.factor * width


@ops.function
def descent(form: Form, mu: Array, bend: Array) -> Array:
    """z / r, computed without differences of nearly equal values; 0 at the normal."""
    mu = ops.maximum(mu, bend * form.least)
    fall = 1.0 - mu
    for _ in range(form.squarings):
        fall = fall * (1.0 + mu)
        mu, bend = sqr(mu), sqr(bend)
    ratio = bend * fall / (mu * (1.0 + bend))  # (1 - u) / u
    for _ in range(form.roots):
        ratio = ratio / (1.0 + sqrt(1.0 + ratio))  # the corresponding value for the root of u
    return ratio


def numpy_rise(form: Form, mu: np.ndarray, bend: np.ndarray) -> np.ndarray:
    """r as a function of mu, for NumPy arrays."""
    mu, power = np.maximum(mu, bend * form.least), 2**form.squarings
    return (mu**power * (1.0 + bend**power) / (mu**power + bend**power)) ** 0.5**form.roots


def cosine(form: Form, rise: np.ndarray, bend: np.ndarray) -> np.ndarray:
    """mu as a function of r, the inverse of `numpy_rise`."""
    power = 2**form.squarings
    bent, u = np.maximum(bend**power, 1e-300), rise**2**form.roots
    return np.clip(bent * u / ((1.0 - u) + bent), 0.0, 1.0) ** (1.0 / power)
