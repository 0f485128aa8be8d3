"""Correct and incorrect tables of E[roughness, mu], as programs for the homework would compute them.

Every form is an integral over the same visible normals of GGX, so forty forms cost hardly more than one:

    E = mean over m of G w / G1(o),   w = 1, or the factor by which a mistake changes the integrand

Nodes are the centers of texels: mu = (j + 1/2) / N, roughness = (i + 1/2) / N.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..energy.albedo.monte_carlo import hammersley
from .finding import Mistake

Values = NDArray[np.float64]
POINTS = 256  # visible normals per node, for an error of about 1e-3, a quarter of a gray level
NODES = 24  # along each axis
STRATA = 32  # along each axis of the square, as in the homework's cosine sampling
_G = "the masking term G"
_ROUGHNESS = "the roughness: alpha = roughness^2"
_INTEGRAND = "the integrand f cos / pdf"


class Form(NamedTuple):
    """A table E[roughness, mu].

    words    description of the form: "k = alpha / 2"
    mistake  the mistake; None if the form is correct
    masking  Gonio's name for the masking term; "" if there is none
    """

    words: str
    mistake: Mistake | None
    masking: str
    values: Values


def nodes(size: int, count: int = NODES) -> NDArray[np.intp]:
    """Indices of at most `count` evenly spaced texels of an axis, including the first and the last."""
    return np.unique(np.linspace(0, size - 1, min(count, size)).round().astype(np.intp))


@functools.lru_cache(maxsize=8)
def forms(size: int) -> tuple[Form, ...]:
    """All forms at the nodes of a table of the given size, correct forms first."""
    at = (nodes(size) + 0.5) / size
    right = _with_width(at, at, at**2)
    tables = [
        Form("k = alpha / 2, as the homework's figures", None, "schlick-ibl", right("k = alpha / 2")),
        Form("k = (roughness + 1)^2 / 8, as the homework's text", None, "schlick-direct", right("text")),
        Form("Smith's separable G", None, "smith-separable", right("smith-separable")),
        Form("Smith's height-correlated G", None, "smith-correlated", right("smith-correlated")),
    ]

    def wrong(words: str, topic: str, values: Values) -> None:
        tables.append(Form(words, Mistake(words, topic), "", values))

    for name in _KS:
        if name not in ("k = alpha / 2", "text"):
            wrong(name, _G, right(name))
    wrong("G is missing", _G, right("one"))
    for k, words in (("k = alpha / 2", "alpha / 2"), ("text", "(roughness + 1)^2 / 8")):
        wrong(f"G of one direction only, Gs(v), with k = {words}", _G, right(k, sides="o"))
        wrong(f"G of one direction only, Gs(l), with k = {words}", _G, right(k, sides="i"))
        wrong(f"G is squared, with k = {words}", _G, right(k, sides="twice"))
        for name, what in _WEIGHTS.items():
            wrong(f"{what} (k = {words})", _INTEGRAND, right(k, weight=name))
    for words, width in (
        ("alpha = roughness in place of roughness^2, in D", at),
        ("alpha = roughness^4 in place of roughness^2, in D: roughness is squared twice", at**4),
    ):
        other = _with_width(at, at, width)
        for name, text in (("k = alpha / 2", "k = roughness^2 / 2"), ("text", "k = (roughness + 1)^2 / 8")):
            wrong(f"{words} ({text})", _ROUGHNESS, other(name))
    both = _with_width(at, at, at)
    wrong("alpha = roughness in place of roughness^2, in D and in k", _ROUGHNESS, both("k = roughness / 2"))
    return tuple(tables)


_KS = {
    "k = alpha / 2": lambda r: r**2 / 2.0,
    "text": lambda r: (r + 1.0) ** 2 / 8.0,
    "k = roughness / 2": lambda r: r / 2.0,
    "k = (alpha + 1)^2 / 8": lambda r: (r**2 + 1.0) ** 2 / 8.0,
    "k = alpha^2 / 2": lambda r: r**4 / 2.0,
    "k = (roughness + 1) / 8": lambda r: (r + 1.0) / 8.0,
    "k = roughness^2 / 8": lambda r: r**2 / 8.0,
    "k = alpha": lambda r: r**2,
    "k = (roughness + 1)^2 / 2": lambda r: (r + 1.0) ** 2 / 2.0,
}

_WEIGHTS = {
    "cos_i": "the cosine of the light is applied twice",
    "2 cos_i": "the pdf 1 / (2 pi) of uniform directions for cosine-weighted ones",
    "1 / cos_i": "the cosine of the light is missing",
    "4 cos cos": "the denominator 4 (n.o)(n.i) is missing",
    "1 / 4 o.m": "the Jacobian 4 (o.m) of the half vector is missing in the pdf",
    "o.m": "(o.m) is applied twice",
    "1 / o.m": "(o.m) is missing in the weight",
    "n.m": "(n.m) is missing in the pdf of the normals",
    "schlick": "Schlick's F with R0 = 0.04, where F = 1 is asked for",
}


class _with_width:
    """E as a function of the name of the masking term, for D with the given alpha."""

    def __init__(self, roughness: Values, mu: Values, alpha: Values) -> None:
        self.roughness = roughness[:, None, None]
        self.mu = mu[None, :, None]
        self.alpha = np.maximum(alpha, 1e-4)[:, None, None]
        self.cos_i, self.o_m, self.n_m = self._reflected()

    def _reflected(self) -> tuple[Values, Values, Values]:
        """n.i, o.m and n.m for visible normals m (Heitz2018), where i is the reflection of o at m."""
        u = hammersley(POINTS)
        u1, u2 = u[:, 0][None, None], u[:, 1][None, None]
        sine = np.sqrt(1.0 - self.mu**2)
        x = self.alpha * sine
        length = np.sqrt(x**2 + self.mu**2)
        sx, sz = x / length, self.mu / length  # the stretched view direction, in the xz plane
        r, phi = np.sqrt(u1), 2.0 * math.pi * u2
        t1, t2 = r * np.cos(phi), r * np.sin(phi)
        s = 0.5 * (1.0 + sz)
        t2 = (1.0 - s) * np.sqrt(np.maximum(1.0 - t1**2, 0.0)) + s * t2
        t3 = np.sqrt(np.maximum(1.0 - t1**2 - t2**2, 0.0))
        nx, ny, nz = -sz * t2 + sx * t3, t1, sx * t2 + sz * t3
        mx, my, mz = self.alpha * nx, self.alpha * ny, np.maximum(nz, 1e-9)
        scale = 1.0 / np.sqrt(mx**2 + my**2 + mz**2)
        m_x, m_z = mx * scale, mz * scale
        o_m = sine * m_x + self.mu * m_z
        return 2.0 * o_m * m_z - self.mu, o_m, m_z

    def __call__(self, masking: str, sides: str = "both", weight: str = "") -> Values:
        lit = self.cos_i > 0.0
        cos_i = np.where(lit, self.cos_i, 1.0)
        G = self._masking(masking, self.mu, cos_i, sides) / self._smith(self.mu)
        G = G * self._weight(weight, cos_i) if weight else G
        return np.asarray(np.mean(np.where(lit, G, 0.0), axis=2))

    def _smith(self, cosine: Values) -> Values:
        tan2 = 1.0 / cosine**2 - 1.0
        return np.asarray(2.0 / (1.0 + np.sqrt(1.0 + self.alpha**2 * tan2)))

    def _masking(self, name: str, cos_o: Values, cos_i: Values, sides: str) -> Values:
        if name == "one":
            return np.ones_like(cos_i)
        if name.startswith("smith"):
            o, i = self._smith(cos_o), self._smith(cos_i)
            return o * i if name == "smith-separable" else 1.0 / (1.0 / o + 1.0 / i - 1.0)
        k = _KS[name](self.roughness)
        o, i = cos_o / (cos_o * (1.0 - k) + k), cos_i / (cos_i * (1.0 - k) + k)
        return {"o": o * np.ones_like(i), "i": i, "twice": (o * i) ** 2}.get(sides, o * i)

    def _weight(self, name: str, cos_i: Values) -> Values:
        o_m, n_m = self.o_m, self.n_m
        values: Values = {
            "cos_i": cos_i,
            "2 cos_i": 2.0 * cos_i,
            "1 / cos_i": 1.0 / cos_i,
            "4 cos cos": 4.0 * self.mu * cos_i,
            "1 / 4 o.m": 0.25 / np.maximum(o_m, 1e-6),
            "o.m": o_m,
            "1 / o.m": 1.0 / np.maximum(o_m, 1e-6),
            "n.m": n_m,
            "schlick": 0.04 + 0.96 * (1.0 - np.clip(o_m, 0.0, 1.0)) ** 5,
        }[name]
        return values

    def mean_of_light(self) -> Values:
        """2 max(0, n.i), averaged over normals with the density D(m) n.m, (roughness, mu)."""
        u = hammersley(POINTS)
        t = self.alpha * np.sqrt(u[:, 0] / (1.0 - u[:, 0]))[None, None]
        c = 1.0 / np.sqrt(1.0 + t**2)
        o_m = np.sqrt(1.0 - self.mu**2) * t * c * np.cos(2.0 * math.pi * u[:, 1])[None, None] + self.mu * c
        return np.asarray(np.mean(2.0 * np.maximum(2.0 * o_m * c - self.mu, 0.0), axis=2))


# --------------------------------------------------------------------------- E_avg


class Weighting(NamedTuple):
    """A method of averaging E over mu: its description, the mistake (None if the method is correct), and the weights of
    E, [roughness, mu]."""

    words: str
    mistake: Mistake | None
    weights: Values


@functools.lru_cache(maxsize=8)
def weightings(size: int, columns: int) -> tuple[Weighting, ...]:
    """Correct and incorrect averages over `columns` values of mu, for the rows of `nodes(size)`."""
    at, mu = (nodes(size) + 0.5) / size, (np.arange(columns) + 0.5) / columns
    one = np.ones((len(at), 1))
    topic = "the weights of the average"
    light = _with_width(at, mu, at**2).mean_of_light()
    ways = [Weighting("2 int E mu dmu", None, one * 2.0 * mu)]
    for words, weights in (
        ("int E dmu: the weight 2 mu is missing", one + 0.0 * mu),
        ("int E mu dmu: the factor 2 is missing", one * mu),
        ("4/3 int E dmu: 2 (n.l) of cosine-weighted directions l in place of 2 mu", one * 4.0 / 3.0 + 0.0 * mu),
        ("int E 2 (n.l) dmu with l of the sampled normals in place of 2 mu", light),
        ("2 int E dmu: the weight mu is missing", 2.0 * one + 0.0 * mu),
        ("2 int E mu^2 dmu: mu is applied twice", one * 2.0 * mu**2),
        ("4 int E mu dmu: the factor 2 is applied twice", one * 4.0 * mu),
        ("2 pi int E mu dmu", one * 2.0 * math.pi * mu),
        ("int E mu dmu / pi", one * mu / math.pi),
        ("2 int E mu dmu / pi", one * 2.0 * mu / math.pi),
        ("2 int E (1 - mu) dmu: mu runs the other way", one * 2.0 * (1.0 - mu)),
        ("2 int E sqrt(1 - mu^2) dmu: the sine in place of mu", one * 2.0 * np.sqrt(1.0 - mu**2)),
    ):
        ways.append(Weighting(words, Mistake(words, topic), weights))
    return tuple(ways)


@functools.lru_cache(maxsize=8)
def columns_of(size: int) -> tuple[Form, ...]:
    """The correct forms of E in the rows of `nodes(size)` and at 64 values of mu, for averages."""
    at, mu = (nodes(size) + 0.5) / size, (np.arange(64) + 0.5) / 64
    right = _with_width(at, mu, at**2)
    return tuple(
        Form(words, None, name, right("text" if name == "schlick-direct" else text))
        for words, name, text in (
            ("k = alpha / 2, as the homework's figures", "schlick-ibl", "k = alpha / 2"),
            ("k = (roughness + 1)^2 / 8, as the homework's text", "schlick-direct", "text"),
            ("Smith's separable G", "smith-separable", "smith-separable"),
            ("Smith's height-correlated G", "smith-correlated", "smith-correlated"),
        )
    )


# --------------------------------------------------------------------------- cosine sampling


@functools.lru_cache(maxsize=16)
def cosine_sampled(size: int, masking: str, floor: float) -> Values:
    """E at the nodes, computed with 32 x 32 jittered cosine-weighted directions per mu; the denominator of D is at
    least `floor`."""
    at = (nodes(size) + 0.5) / size
    jitter = np.random.default_rng(1).random((2, len(at), STRATA, STRATA))
    cell = np.arange(STRATA)
    theta = 0.5 * np.arccos(1.0 - 2.0 * (cell[:, None] + jitter[0]) / STRATA).reshape(len(at), -1)
    phi = 2.0 * math.pi * ((cell + jitter[1]) / STRATA).reshape(len(at), -1)
    cos_i, mu, r = np.cos(theta), at[:, None], at[:, None, None]  # each mu has its own directions, shared by all rows
    o_i = np.sqrt(1.0 - mu**2) * np.sin(theta) * np.cos(phi) + mu * cos_i
    cos_h2 = (mu + cos_i) ** 2 / (2.0 + 2.0 * o_i)
    D = r**4 / np.maximum(math.pi * (cos_h2 * (r**4 - 1.0) + 1.0) ** 2, floor)
    k = _KS["text" if masking == "schlick-direct" else "k = alpha / 2"](r)
    G = mu / (mu * (1.0 - k) + k) * cos_i / (cos_i * (1.0 - k) + k)
    return np.asarray(np.mean(D * G * math.pi / (4.0 * mu * cos_i), axis=2))
