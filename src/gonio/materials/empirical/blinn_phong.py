"""Blinn's half-vector variant of Phong's model."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ...material.bsdf import KnownViolation
from ...ops import Direction, Scalar, dot, function, inv_pi, safe_div
from ...optics.frame import half_vector, reflect, sin2
from ...optics.special import power_of_cosine
from ...optics.warp import square_to_power_lobe
from .phong import _Empirical


class BlinnPhong(_Empirical):
    """Blinn's variant of Phong's model: eval = kd cos theta_i + ks max(0, n.h)^p (Blinn1977).

    h is the half vector. For light and viewer above the surface, n.h is never negative, so the highlight is never cut
    off. To match the width of Phong's highlight, the exponent must be about four times as large. The model is neither
    reciprocal nor energy-conserving.
    """

    known_violations: ClassVar[Mapping[str, KnownViolation]] = {
        **_Empirical.known_violations,
        # the bound of `_highlight_power` is not tight, so a small size need not mean a violation
        "energy": _Empirical.known_violations["energy"]._replace(certain=False),
    }

    def _highlight_power(self) -> np.ndarray:
        """An upper bound: the smaller of int cos^p 4 (v.h) dh <= 8 pi / (p + 1) and the solid angle 2 pi of the
        hemisphere."""
        return np.minimum(8.0 * np.pi / (np.asarray(self.p) + 1.0), 2.0 * np.pi)

    @function
    def _highlight(self, wo: Direction, wi: Direction) -> Scalar:
        """n.h, the cosine of the angle between the normal and the half vector."""
        return half_vector(wo, wi).z

    @function
    def _peak(self, wo: Direction, wi: Direction) -> Scalar:
        """The lobe (n.h)^p about the normal, 1 at its peak."""
        h = half_vector(wo, wi)
        return power_of_cosine(h.z, sin2(h), self._exponent)

    @function
    def _highlight_pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """Density of wi, 1/sr: the density of h, (p + 1) / (2 pi) (n.h)^p, divided by 4 (v.h) (Walter2007, eq. 14)."""
        lobe = (self._exponent + 1.0) * (0.5 * inv_pi) * self._peak(wo, wi)
        return safe_div(lobe, 4.0 * dot(wo, half_vector(wo, wi)))

    @function
    def _highlight_sample(self, wo: Direction, u1: Scalar, u2: Scalar) -> Direction:
        """wo reflected about a sampled half vector."""
        return reflect(wo, square_to_power_lobe(u1, u2, self._exponent))
