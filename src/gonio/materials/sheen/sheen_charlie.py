"""Sheen by upright microfacets."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ... import ops
from ...material.bsdf import BSDF, KnownViolation
from ...material.calling import method
from ...material.parameters import Colour, Number, number, spectrum
from ...ops import Direction, Mode, Scalar, Spectrum, exp, function, inv_pi, log, sqr, where
from ...optics import frame
from ...optics.frame import lit
from ..microfacet.microfacet import Terms

# a, b, c, d, e of L(x) = a / (1 + b x^c) + d x + e at alpha = 0 and at alpha = 1 (Estevez2017, table 1)
NARROW = (25.3245, 3.32435, 0.16801, -1.27393, -4.85967)
WIDE = (21.5473, 3.82987, 0.19823, -1.97760, -4.32054)


class SheenCharlie(BSDF):
    """The "Charlie" sheen of cloth with upright fibers: f = albedo D G / (4 (n.o)(n.i)) (Estevez2017).

    D = (2 + 1 / alpha) sin(theta_m)^(1 / alpha) / (2 pi), with its peak at the horizon instead of the normal
    G = 1 / (1 + Lambda(mu_o) + Lambda(mu_i)), with mu = cos theta, Lambda = exp L(mu) and a fitted L

    The softened terminator of the paper is omitted, because it is not reciprocal. There is no Fresnel term, and only
    single scattering is modeled: at normal incidence, the model reflects a fifth of the light at alpha = 1 and a
    thousandth at alpha = 0.1. The remaining light reaches the cloth below, which is not part of this model. glTF uses
    this model, with the square of the sheen roughness as alpha. If alpha is below 0.07, the model reflects more light
    than it receives near the horizon. Directions are sampled from a guide, a density tabulated from `eval`.
    """

    albedo: Colour = spectrum(default=1.0, doc="scale factor for reflected light", low=0.0, high=1.0, soft_high=True)
    alpha: Number = number(default=0.3, doc="spread of the microfacet normals about the horizon", low=0.01, high=1.0)

    known_violations: ClassVar[Mapping[str, KnownViolation]] = {
        "energy": KnownViolation(
            "for alpha below 0.07, the fit of Lambda gives too little masking, so the albedo exceeds 1 at 89 degrees",
            lambda model: _gain(model),
            certain=False,
        )
    }

    @function
    def _density(self, h: Direction) -> Scalar:
        """D, computed from sin^2 = x^2 + y^2, because the exponent 1 / alpha can be large."""
        power = 1.0 / self.alpha
        sin2 = frame.sin2(h)
        positive = sin2 > frame.TINY
        peak = where(positive, exp(0.5 * power * log(where(positive, sin2, 1.0))), 0.0)
        return (2.0 + power) * (0.5 * inv_pi) * peak

    @function
    def _lambda(self, mu: Scalar) -> Scalar:
        """Lambda: exp L(mu) for mu < 1/2, else exp(2 L(1/2) - L(1 - mu))."""
        low = mu < 0.5
        at = self._exponent(where(low, mu, 1.0 - mu))
        return exp(where(low, at, 2.0 * self._exponent(0.5 + ops.zeros_like(mu)) - at))

    @function
    def _exponent(self, x: Scalar) -> Scalar:
        """L, the exponent of the fit to Lambda."""
        share = sqr(1.0 - self.alpha)
        a, b, c, d, e = (share * narrow + (1.0 - share) * wide for narrow, wide in zip(NARROW, WIDE, strict=True))
        return a / (1.0 + b * ops.pow(x, c)) + d * x + e

    @function
    def _visible(self, wo: Direction, wi: Direction) -> Scalar:
        """G, masking and shadowing of the two directions."""
        return 1.0 / (1.0 + self._lambda(wo.z) + self._lambda(wi.z))

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """albedo D G / (4 cos theta_o)."""
        above, o, i = lit(wo, wi)
        value = self._density(frame.half_vector(o, i)) * self._visible(o, i) / (4.0 * o.z)
        return self.albedo * where(above, value, 0.0)

    @method
    def terms(self, wo: Direction, wi: Direction) -> Terms:
        """D, G and the albedo of the pair."""
        above, o, i = lit(wo, wi)
        return Terms(where(above, self._density(frame.half_vector(o, i)), 0.0), self._visible(o, i), self.albedo)


def _gain(model: SheenCharlie) -> float:
    """The largest excess of the albedo above 1, measured at 40 widths and 60 angles, plus a tenth of it."""
    alpha = float(np.min(np.asarray(model.alpha)))
    return float(np.interp(alpha, GAINS[0], GAINS[1])) * float(np.max(np.asarray(model.albedo)))


GAINS = ((0.01, 0.015, 0.02, 0.03, 0.05, 0.07), (1.25, 0.9, 0.65, 0.4, 0.15, 0.0))
