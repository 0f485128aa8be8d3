"""Mistakes in the Phong and Blinn-Phong models (course sheet, eq. 1)."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ...material import BSDF
from ...verify.forensics.factors import half_vector
from ..finding import Mistake
from .base import Values, Variant, above, color

NAMES = ("phong", "blinn-phong")
_HIGHLIGHT = "the base of the highlight's power"
_SUM = "the weights of the diffuse and the specular part"
_COSINE = "the cosines: (n.l) belongs to the diffuse part alone"


def variants(material: BSDF, wo: np.ndarray, wi: np.ndarray) -> Iterator[Variant]:
    """Incorrect forms of the Phong and Blinn-Phong models; none for other materials."""
    name = type(material).name
    if name not in NAMES:
        return
    kd, ks = color(material.kd), color(material.ks)  # type: ignore[attr-defined]
    p = float(np.max(np.asarray(material.p)))  # type: ignore[attr-defined]
    bases = _bases(wo, wi)
    own, other = ("v.r", "n.h") if name == "phong" else ("n.h", "v.r")
    cosine = np.maximum(wi[:, 2:], 1e-12)
    lit = above(wo, wi)

    def f(diffuse: Values, specular: Values, base: str = own, power: float = p, scale: float = 1.0) -> Values:
        """(diffuse cos + specular base^power) / cos."""
        peak = scale * np.power(bases[base], power)[:, None]
        return np.where(lit, diffuse + specular * peak / cosine, 0.0)

    with np.errstate(all="ignore"):
        yield _variant(f"the highlight's base is {other}, not {own}", _HIGHLIGHT, f(kd, ks, other))
        yield _variant("the highlight's base is v.l: l is not mirrored at n", _HIGHLIGHT, f(kd, ks, "v.l"))
        yield _variant("the highlight's base is n.l", _HIGHLIGHT, f(kd, ks, "n.l"))
        yield _variant("|v.r| in place of max(0, v.r): an even p lights the wrong side", _HIGHLIGHT, f(kd, ks, "|v.r|"))
        yield _variant("the half vector is not normalized", _HIGHLIGHT, f(kd, ks, "unnormalized"))
        yield _variant("l is mirrored with n.l in place of 2 (n.l)", _HIGHLIGHT, f(kd, ks, "short mirror"))
        yield _variant("the power p is missing", "the falloff p", f(kd, ks, power=1.0))
        for text, power in {"2 p": 2 * p, "p / 2": p / 2, "4 p": 4 * p, "p / 4": p / 4, "p + 1": p + 1}.items():
            yield _variant(f"the exponent is {text}, not p", "the falloff p", f(kd, ks, power=power))
        yield _variant("kd and ks exchanged", _SUM, f(ks, kd))
        yield _variant("the specular part is missing", _SUM, f(kd, 0.0 * ks))
        yield _variant("the diffuse part is missing", _SUM, f(0.0 * kd, ks))
        yield _variant("kd / pi in place of kd: the sheet's eq. 1 has no 1 / pi", _SUM, f(kd / math.pi, ks))
        yield _variant("kd and ks are both over pi", _SUM, f(kd / math.pi, ks / math.pi))
        for text, scale in (
            ("(p + 1) / (2 pi)", (p + 1) / (2 * math.pi)),
            ("(p + 2) / (2 pi)", (p + 2) / (2 * math.pi)),
        ):
            words = f"the specular part is normalized by {text}, which eq. 1 does not have"
            yield _variant(words, _SUM, f(kd, ks, scale=scale))
            yield _variant(f"{words}, and kd is over pi", _SUM, f(kd / math.pi, ks, scale=scale))
        yield _variant("the specular part has a cosine (n.l) too", _COSINE, f(kd, ks * cosine))
        yield _variant("the diffuse part lacks its cosine (n.l)", _COSINE, f(kd / cosine, ks))
        yield _variant("ks is missing from the specular part", _SUM, f(kd, np.ones_like(ks)))


def with_cosine(material: BSDF) -> bool:
    """Whether the course includes the cosine in the model, so that values with and without the cosine are accepted."""
    return type(material).name in NAMES


def _variant(words: str, topic: str, values: Values) -> Variant:
    return Variant(Mistake(words, topic), values)


def _bases(wo: np.ndarray, wi: np.ndarray) -> dict[str, Values]:
    """Candidate cosines for the base of the power, by name."""
    mirrored = wi * np.array([-1.0, -1.0, 1.0])
    short = np.array([0.0, 0.0, 1.0]) * wi[:, 2:] - wi
    v_r = np.sum(wo * mirrored, axis=1)
    return {
        "v.r": np.maximum(v_r, 0.0),
        "|v.r|": np.abs(v_r),
        "n.h": np.maximum(half_vector(wo, wi)[:, 2], 0.0),
        "v.l": np.maximum(np.sum(wo * wi, axis=1), 0.0),
        "n.l": np.maximum(wi[:, 2], 0.0),
        "unnormalized": np.maximum((wo + wi)[:, 2], 0.0),
        "short mirror": np.maximum(np.sum(wo * short, axis=1), 0.0),
    }
