"""Mistakes in the terms D, G and F of a microfacet reflection (course sheet, eqs. 4 to 12; homework, part C).

The terms are taken from the material itself: F is f divided by f of a copy with F = 1, D has a closed form, and G is
the remaining factor. Each mistake replaces one term.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ...errors import GonioError
from ...material import BSDF, tree
from ...verify.forensics.factors import half_vector
from ..finding import Mistake
from .base import Values, Variant, above, color, f_of

_D, _G, _F = "D", "the masking term G", "Fresnel's term F"
_H = "the half vector"
_DENOMINATOR = "the denominator 4 (n.o)(n.i)"


def variants(material: BSDF, wo: np.ndarray, wi: np.ndarray) -> Iterator[Variant]:
    """Incorrect forms of an isotropic microfacet reflection; none for other materials."""
    surface = material.microsurface
    if surface is None or np.size(np.asarray(surface.alpha)) != 1 or surface.ndf not in _DENSITIES:
        return
    terms = _Terms(material, float(np.max(np.asarray(surface.alpha))), surface.ndf, wo, wi)
    if terms.alpha < 1e-3:
        return
    with np.errstate(all="ignore"):
        for family in (_denominators, _masking, _density, _half_vectors, _fresnel):
            for words, topic, factor in family(terms):
                values = terms.f * (factor[:, None] if factor.ndim == 1 else factor)
                yield Variant(Mistake(words, topic), np.where(above(wo, wi), values, 0.0))


class _Terms:
    """f and its terms for pairs of directions."""

    def __init__(self, material: BSDF, alpha: float, ndf: str, wo: np.ndarray, wi: np.ndarray) -> None:
        self.material, self.alpha, self.ndf, self.wo, self.wi = material, alpha, ndf, wo, wi
        self.m = half_vector(wo, wi)
        self.cos_m, self.cos_o, self.cos_i = self.m[:, 2], wo[:, 2], wi[:, 2]
        self.o_m = np.sum(wo * self.m, axis=1)
        self.eta, self.k = (color(getattr(material, name, 0.0)) for name in ("eta", "k"))
        self.r0 = ((self.eta - 1.0) ** 2 + self.k**2) / ((self.eta + 1.0) ** 2 + self.k**2)
        self.f = f_of(material, wo, wi)
        self.D = density(ndf, self.cos_m, alpha)
        try:
            white = f_of(tree.replace(material, {"fresnel": "one"}), wo, wi)
        except GonioError:
            white = np.full_like(self.f, np.nan)
        with np.errstate(all="ignore"):
            self.F = self.f / white
            tint = np.nanmax(np.asarray(getattr(material, "albedo", 1.0), float))
            self.G = white[:, int(np.argmax(np.broadcast_to(np.asarray(getattr(material, "albedo", 1.0)), (3,))))]
            self.G = self.G * 4.0 * self.cos_o * self.cos_i / (self.D * tint)


def schlick(r0: Values, cosine: Values, power: float = 5.0) -> Values:
    """R0 + (1 - R0) (1 - cos)^power, (N, 3)."""
    return r0 + (1.0 - r0) * (1.0 - np.clip(cosine, 0.0, 1.0))[:, None] ** power


Factors = Iterator[tuple[str, str, Values]]


def density(ndf: str, cosine: Values, alpha: float, name: str = "") -> Values:
    """D of the distribution `ndf` at the cosine of the half vector, or its incorrect form `name`."""
    t2 = 1.0 / cosine**2 - 1.0
    return _DENSITIES[ndf][name](cosine, t2, alpha)


_DENSITIES = {
    "ggx": {
        "": lambda c, t2, a: a**2 / (math.pi * c**4 * (a**2 + t2) ** 2),
        "cos^2 in place of cos^4": lambda c, t2, a: a**2 / (math.pi * c**2 * (a**2 + t2) ** 2),
        "cos^4 is missing": lambda c, t2, a: a**2 / (math.pi * (a**2 + t2) ** 2),
        "the square of (alpha^2 + tan^2) is missing": lambda c, t2, a: a**2 / (math.pi * c**4 * (a**2 + t2)),
        "the square of ((n.h)^2 (alpha^2 - 1) + 1) is missing": lambda c, t2, a: a**2 / (math.pi * c**2 * (a**2 + t2)),
        "alpha in place of alpha^2 in the numerator": lambda c, t2, a: a / (math.pi * c**4 * (a**2 + t2) ** 2),
        "alpha in place of alpha^2 beside tan^2": lambda c, t2, a: a**2 / (math.pi * c**4 * (a + t2) ** 2),
        "tan in place of tan^2": lambda c, t2, a: a**2 / (math.pi * c**4 * (a**2 + np.sqrt(t2)) ** 2),
        "n.h in place of (n.h)^2": lambda c, t2, a: a**2 / (math.pi * (c * (a**2 - 1.0) + 1.0) ** 2),
        "(alpha^2 + 1) in place of (alpha^2 - 1)": lambda c, t2, a: a**2 / (math.pi * (c**2 * (a**2 + 1.0) + 1.0) ** 2),
        "the brackets as in the homework's text: (n.h)^2 (alpha^2 - 1) + 1 with 1 inside": lambda c, t2, a: (
            a**2 / (math.pi * (c**2 * (a**2 - 1.0 + 1.0)) ** 2)
        ),
        "the numerator alpha^2 is missing": lambda c, t2, a: 1.0 / (math.pi * c**4 * (a**2 + t2) ** 2),
        "pi is squared with the bracket": lambda c, t2, a: a**2 / (math.pi**2 * c**4 * (a**2 + t2) ** 2),
    },
    "beckmann": {
        "": lambda c, t2, a: np.exp(-np.minimum(t2 / a**2, 600.0)) / (math.pi * a**2 * c**4),
        "cos^2 in place of cos^4": lambda c, t2, a: np.exp(-np.minimum(t2 / a**2, 600.0)) / (math.pi * a**2 * c**2),
        "cos^4 is missing": lambda c, t2, a: np.exp(-np.minimum(t2 / a**2, 600.0)) / (math.pi * a**2),
        "alpha in place of alpha^2 in the exponent": lambda c, t2, a: (
            np.exp(-np.minimum(t2 / a, 600.0)) / (math.pi * a**2 * c**4)
        ),
        "alpha in place of alpha^2 in the denominator": lambda c, t2, a: (
            np.exp(-np.minimum(t2 / a**2, 600.0)) / (math.pi * a * c**4)
        ),
        "tan in place of tan^2 in the exponent": lambda c, t2, a: (
            np.exp(-np.minimum(np.sqrt(t2) / a**2, 600.0)) / (math.pi * a**2 * c**4)
        ),
        "2 alpha^2 in the exponent, as of a Gaussian": lambda c, t2, a: (
            np.exp(-np.minimum(t2 / (2.0 * a**2), 600.0)) / (math.pi * a**2 * c**4)
        ),
        "4 alpha^2 in place of pi alpha^2": lambda c, t2, a: (
            np.exp(-np.minimum(t2 / a**2, 600.0)) / (4.0 * a**2 * c**4)
        ),
        "the sine in place of the tangent": lambda c, t2, a: (
            np.exp(-np.minimum((1.0 - c**2) / a**2, 600.0)) / (math.pi * a**2 * c**4)
        ),
    },
}


def _density(t: _Terms) -> Factors:
    for words in _DENSITIES[t.ndf]:
        if words:
            yield f"D: {words}", _D, density(t.ndf, t.cos_m, t.alpha, words) / t.D
    yield "D is missing", _D, 1.0 / t.D
    other = "beckmann" if t.ndf == "ggx" else "ggx"
    yield f"D is that of {other}", _D, density(other, t.cos_m, t.alpha) / t.D


def _half_vectors(t: _Terms) -> Factors:
    both = t.wo + t.wi
    for words, cosine in (
        ("the half vector is not normalized", both[:, 2]),
        ("the half vector is (wo + wi) / 2, not normalized", 0.5 * both[:, 2]),
        ("D is evaluated at n.o in place of n.h", t.cos_o),
        ("D is evaluated at n.i in place of n.h", t.cos_i),
        ("D is evaluated at o.h in place of n.h", t.o_m),
    ):
        D = density(t.ndf, np.clip(cosine, 1e-6, None), t.alpha) / t.D
        yield words, _H, D
        if "normalized" in words:  # F may be evaluated with the same vector
            o_h = np.sum(t.wo * both, axis=1) * (0.5 if "/ 2" in words else 1.0)
            yield words, _H, D[:, None] * schlick(t.r0, o_h) / t.F


def g1(name: str, cosine: Values, alpha: float) -> Values:
    """The masking function G1 of one direction, in the forms of the sheet and the homework and in incorrect forms."""
    tangent = np.sqrt(np.maximum(1.0 / cosine**2 - 1.0, 0.0))
    if name == "ggx":
        return 2.0 / (1.0 + np.sqrt(1.0 + alpha**2 * tangent**2))
    if name == "ggx, alpha in place of alpha^2":
        return 2.0 / (1.0 + np.sqrt(1.0 + alpha * tangent**2))
    if name == "ggx, 1 in place of 2 above":
        return 1.0 / (1.0 + np.sqrt(1.0 + alpha**2 * tangent**2))
    if name.startswith("beckmann"):
        b = alpha * tangent if "b = alpha tan" in name else 1.0 / np.maximum(alpha * tangent, 1e-12)
        fit = (3.535 * b + 2.181 * b**2) / (1.0 + 2.276 * b + 2.577 * b**2)
        return fit if "without" in name else np.where(b < 1.6, fit, 1.0)
    k = _KS[name](alpha)
    return cosine / (cosine * (1.0 - k) + k)


_KS = {
    "k = (roughness + 1)^2 / 8": lambda a: (math.sqrt(a) + 1.0) ** 2 / 8.0,
    "k = alpha / 2": lambda a: a / 2.0,
    "k = roughness / 2": lambda a: math.sqrt(a) / 2.0,
    "k = (alpha + 1)^2 / 8": lambda a: (a + 1.0) ** 2 / 8.0,
    "k = alpha^2 / 2": lambda a: a**2 / 2.0,
    "k = (roughness + 1) / 8": lambda a: (math.sqrt(a) + 1.0) / 8.0,
    "k = alpha": lambda a: a,
    "k = alpha sqrt(2 / pi)": lambda a: a * math.sqrt(2.0 / math.pi),
}


def _masking(t: _Terms) -> Factors:
    yield "G is missing", _G, 1.0 / t.G
    own = t.ndf
    asked = str(t.material.microsurface.masking) if t.material.microsurface else ""
    forms = [own, *_KS] if asked.startswith("smith") else [*_KS, own]
    if own == "beckmann":
        forms += ["beckmann, without the bound b < 1.6", "beckmann, b = alpha tan in place of 1 / (alpha tan)"]
    else:
        forms += ["ggx, alpha in place of alpha^2", "ggx, 1 in place of 2 above"]
    for name in forms:
        at_o, at_i, at_m = (g1(name, np.maximum(cosine, 1e-6), t.alpha) for cosine in (t.cos_o, t.cos_i, t.o_m))
        label = f"Smith's G1 of {name}" if name in (*_DENSITIES,) else name
        yield f"G: {label}, not {asked}", _G, at_o * at_i / t.G
        yield f"G of one direction only, G1(wo), with {label}", _G, at_o / t.G
        yield f"G of one direction only, G1(wi), with {label}", _G, at_i / t.G
        yield (
            f"G1 at the angle to the micro normal, as the sheet has it, not to the macro normal ({label})",
            _G,
            (at_m * at_m / t.G),
        )
        yield f"G1(wo) + G1(wi) in place of their product ({label})", _G, (at_o + at_i) / t.G
        yield f"G1(wo)^2 in place of G1(wo) G1(wi) ({label})", _G, at_o * at_o / t.G
        yield f"G is squared ({label})", _G, (at_o * at_i) ** 2 / t.G


def _fresnel(t: _Terms) -> Factors:
    yield "F is missing", _F, 1.0 / t.F
    eta, k, r0 = t.eta, t.k, t.r0

    yield "F is Schlick's", _F, schlick(r0, t.o_m) / t.F
    for name, cosine in (("n.o", t.cos_o), ("n.i", t.cos_i), ("n.h", t.cos_m), ("o.i", np.sum(t.wo * t.wi, axis=1))):
        yield f"F at {name} in place of o.h", _F, schlick(r0, cosine) / t.F
    yield "F is R0, without its rise toward grazing", _F, schlick(r0, np.ones_like(t.o_m)) / t.F
    for power in (4.0, 6.0, 1.0, 2.0, 3.0):
        yield f"the power {power:g} in place of 5 in F", _F, schlick(r0, t.o_m, power) / t.F
    yield "F with cos^5 in place of (1 - cos)^5", _F, (r0 + (1.0 - r0) * t.o_m[:, None] ** 5) / t.F
    yield "F = R0 + (1 - cos)^5, without (1 - R0)", _F, (r0 + (1.0 - t.o_m[:, None]) ** 5) / t.F
    yield "1 - F in place of F", _F, (1.0 - t.F) / t.F
    yield "F is squared", _F, t.F
    for words, other in (
        ("k is missing: R0 = (eta - 1)^2 / (eta + 1)^2, as of a dielectric", (eta - 1.0) ** 2 / (eta + 1.0) ** 2),
        ("R0 is not squared: |eta - 1| / (eta + 1)", np.abs(eta - 1.0) / (eta + 1.0)),
        ("k in place of k^2 in R0", ((eta - 1.0) ** 2 + k) / ((eta + 1.0) ** 2 + k)),
        ("k^2 is missing below in R0", ((eta - 1.0) ** 2 + k**2) / (eta + 1.0) ** 2),
        ("k^2 is missing above in R0", (eta - 1.0) ** 2 / ((eta + 1.0) ** 2 + k**2)),
        ("eta and k exchanged", ((k - 1.0) ** 2 + eta**2) / ((k + 1.0) ** 2 + eta**2)),
        ("R0 = 0.04", np.full_like(r0, 0.04)),
    ):
        yield words, _F, schlick(other, t.o_m) / t.F


def _denominators(t: _Terms) -> Factors:
    for words, factor in (
        ("4 (n.o)(n.i) is missing", 4.0 * t.cos_o * t.cos_i),
        ("(n.o)(n.i) is missing from 4 (n.o)(n.i)", t.cos_o * t.cos_i),
        ("n.o is missing from 4 (n.o)(n.i)", t.cos_o),
        ("n.i is missing from 4 (n.o)(n.i), or f has the cosine of wi", t.cos_i),
        ("4 is missing from 4 (n.o)(n.i)", np.full_like(t.cos_o, 4.0)),
        ("pi in place of 4 in the denominator", np.full_like(t.cos_o, 4.0 / math.pi)),
        ("4 (o.h)(i.h) in place of 4 (n.o)(n.i)", t.cos_o * t.cos_i / t.o_m**2),
        ("2 in place of 4 in the denominator", np.full_like(t.cos_o, 2.0)),
        ("the denominator is squared: n.i twice", 1.0 / t.cos_i),
        ("the denominator has n.o twice", 1.0 / t.cos_o),
    ):
        yield words, _DENOMINATOR, factor
