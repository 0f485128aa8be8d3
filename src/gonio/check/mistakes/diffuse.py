"""Mistakes in the Oren-Nayar model (course sheet, eqs. 2 and 3)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...material import BSDF
from ..finding import Mistake
from .base import Values, Variant, above, color


@dataclass(frozen=True)
class _Form:
    """albedo / pi (A + B g(cos) sin(a) tan(b)) with replaceable terms and constants."""

    albedo: Values
    sigma2: float
    low: float = 0.33
    wide: float = 0.09
    half: float = 0.5
    factor: float = 0.45
    azimuth: str = "clamped"
    angles: str = "right"
    constant: bool = True

    def values(self, wo: np.ndarray, wi: np.ndarray) -> Values:
        a = 1.0 - self.half * self.sigma2 / (self.sigma2 + self.low) if self.constant else 0.0
        b = self.factor * self.sigma2 / (self.sigma2 + self.wide)
        shape = a + b * (self._azimuth(wo, wi) * self._angles(wo, wi))
        return np.where(above(wo, wi), self.albedo * shape[:, None] / math.pi, 0.0)

    def _azimuth(self, wo: np.ndarray, wi: np.ndarray) -> Values:
        sines = np.hypot(wo[:, 0], wo[:, 1]) * np.hypot(wi[:, 0], wi[:, 1])
        product = wo[:, 0] * wi[:, 0] + wo[:, 1] * wi[:, 1]
        cosine = np.divide(product, sines, out=np.zeros_like(sines), where=sines > 1e-12)
        return {
            "clamped": np.maximum(cosine, 0.0),
            "unclamped": cosine,
            "absolute": np.abs(cosine),
            "negated": np.maximum(-cosine, 0.0),
            "between directions": np.maximum(np.sum(wo * wi, axis=1), 0.0),
            "not normalized": np.maximum(product, 0.0),
            "one": np.ones_like(cosine),
            "degrees": np.maximum(np.cos(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))), 0.0),
        }[self.azimuth]

    def _angles(self, wo: np.ndarray, wi: np.ndarray) -> Values:
        o, i = (np.arccos(np.clip(w[:, 2], -1.0, 1.0)) for w in (wo, wi))
        high, low = np.maximum(o, i), np.minimum(o, i)
        return {
            "right": np.sin(high) * np.tan(low),
            "exchanged": np.sin(low) * np.tan(high),
            "both larger": np.sin(high) * np.tan(high),
            "both smaller": np.sin(low) * np.tan(low),
            "sines": np.sin(high) * np.sin(low),
            "tangents": np.tan(high) * np.tan(low),
            "o and i": np.sin(o) * np.tan(i),
            "i and o": np.sin(i) * np.tan(o),
            "none": np.ones_like(o),
        }[self.angles]


_AZIMUTH = "the difference of the azimuths"
_ANGLES = "alpha and beta, the larger and the smaller angle"
_COEFFICIENTS = "the coefficients A and B"
_SIGMA = "sigma"


def variants(material: BSDF, wo: np.ndarray, wi: np.ndarray) -> Iterator[Variant]:
    """Incorrect forms of the Oren-Nayar model; none for other materials."""
    if type(material).name != "oren-nayar":
        return
    sigma = float(np.max(np.asarray(material.sigma)))  # type: ignore[attr-defined]
    form = _Form(color(material.albedo), sigma**2)  # type: ignore[attr-defined]
    with np.errstate(all="ignore"):
        for words, topic, changes in _changes(sigma):
            yield Variant(Mistake(words, topic), replace(form, **changes).values(wo, wi))


def _changes(sigma: float) -> Iterator[tuple[str, str, dict[str, Any]]]:
    yield "min and max exchanged: sin(min) tan(max) in place of sin(max) tan(min)", _ANGLES, {"angles": "exchanged"}
    yield "alpha and beta are both the larger angle", _ANGLES, {"angles": "both larger"}
    yield "alpha and beta are both the smaller angle", _ANGLES, {"angles": "both smaller"}
    yield "sin(alpha) sin(beta) in place of sin(alpha) tan(beta)", _ANGLES, {"angles": "sines"}
    yield "tan(alpha) tan(beta) in place of sin(alpha) tan(beta)", _ANGLES, {"angles": "tangents"}
    yield "alpha = theta_o and beta = theta_i, without max and min", _ANGLES, {"angles": "o and i"}
    yield "alpha = theta_i and beta = theta_o, without max and min", _ANGLES, {"angles": "i and o"}
    yield "sin(alpha) tan(beta) is missing", _ANGLES, {"angles": "none"}
    yield (
        "max(0, cos(phi_i - phi_o)) without the max: negative where the azimuths oppose",
        _AZIMUTH,
        {"azimuth": "unclamped"},
    )
    yield "|cos(phi_i - phi_o)| in place of max(0, cos(phi_i - phi_o))", _AZIMUTH, {"azimuth": "absolute"}
    yield "cos(phi_i - phi_o) has the wrong sign", _AZIMUTH, {"azimuth": "negated"}
    yield "the cosine between wo and wi in place of that of their azimuths", _AZIMUTH, {"azimuth": "between directions"}
    yield (
        "the tangential parts of wo and wi are not normalized: sin theta_o sin theta_i too many",
        _AZIMUTH,
        {"azimuth": "not normalized"},
    )
    yield "max(0, cos(phi_i - phi_o)) is missing", _AZIMUTH, {"azimuth": "one"}
    yield "the cosine of the azimuths is taken of degrees", _AZIMUTH, {"azimuth": "degrees"}
    yield "sigma in place of sigma^2: sigma is a deviation, not a variance", _SIGMA, {"sigma2": sigma}
    yield "sigma^4 in place of sigma^2: the variance is squared once more", _SIGMA, {"sigma2": sigma**4}
    yield "sigma, in radians, is converted from degrees", _SIGMA, {"sigma2": math.radians(sigma) ** 2}
    yield "sigma, in radians, is converted to degrees", _SIGMA, {"sigma2": math.degrees(sigma) ** 2}
    yield "0.09 in place of 0.33 in A", _COEFFICIENTS, {"low": 0.09}
    yield "0.33 in place of 0.09 in B", _COEFFICIENTS, {"wide": 0.33}
    yield "0.33 and 0.09 exchanged between A and B", _COEFFICIENTS, {"low": 0.09, "wide": 0.33}
    yield "the factor 1 / 2 of A is missing", _COEFFICIENTS, {"half": 1.0}
    yield "the factor 0.45 of B is missing", _COEFFICIENTS, {"factor": 1.0}
    yield "A = 1 + ... in place of 1 - ...", _COEFFICIENTS, {"half": -0.5}
    yield "B's term is subtracted", _COEFFICIENTS, {"factor": -0.45}
    yield "B's term is missing", _COEFFICIENTS, {"factor": 0.0}
    yield "A's term is missing", _COEFFICIENTS, {"constant": False}
    yield "A and B are those of Lambert, as for sigma = 0", _COEFFICIENTS, {"half": 0.0, "factor": 0.0}
    yield "sigma of 0.57 in A: the form with interreflections (0.57 for 0.33)", _COEFFICIENTS, {"low": 0.57}
