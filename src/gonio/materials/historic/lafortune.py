"""Lafortune's generalized cosine lobe."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ... import ops
from ...material.bsdf import KnownViolation
from ...material.parameters import Colour, Number, number, spectrum
from ...ops import Direction, Node, Scalar, Spectrum, dot, exp, function, inv_pi, minimum, normalize, sqr, vec3, where
from ...optics.frame import normal_like
from ...optics.special import logrel
from ...optics.warp import power_about, square_to_power_lobe, to_frame
from .glossy import _Glossy, sum_breach

SHORTEST = 1e-6  # squared length of (C o_x, C o_y, C o_z) below which the lobe is negligible


class Lafortune(_Glossy):
    """A generalized cosine lobe: f = diffuse / pi + specular (n + 2) / (2 pi) (C o_x i_x + C o_y i_y + C o_z i_z)^n.

    The three coefficients C are cx, cy and cz, n is `exponent`, and a negative base of the power is clamped to 0
    (Lafortune1997, eq. 4). C = (-1, -1, 1) gives the normalized Phong lobe about the mirror direction (Lafortune1994),
    which Ngan2005 calls Blinn-Phong. If cz is below 1, the lobe is tilted toward the horizon; positive cx and cy cause
    retro-reflection. The largest |C| should be 1, as in the normalization of Ngan2005, because the lobe scales with its
    n-th power. The model is reciprocal. Directions are sampled from a power lobe about (cx o_x, cy o_y, cz o_z).

    The presets, named MATERIAL:PAPER/FIT, are published fits to materials in the MERL database.
    """

    specular: Colour = spectrum(default=0.2, doc="albedo of the lobe for C = (-1, -1, 1), at normal incidence", low=0.0)
    cx: Number = number(default=-1.0, doc="coefficient of o_x i_x; negative for mirror reflection", low=-1.0, high=1.0)
    cy: Number = number(default=-1.0, doc="coefficient of o_y i_y; negative for mirror reflection", low=-1.0, high=1.0)
    cz: Number = number(default=1.0, doc="coefficient of o_z i_z", low=-1.0, high=1.0)
    exponent: Number = number(default=50.0, doc="exponent of the lobe", low=0.0)

    known_violations: ClassVar[Mapping[str, KnownViolation]] = {"energy": sum_breach()}

    @property
    def isotropic(self) -> bool:
        """Whether cx and cy are equal; False for a recording, whose values are unknown."""
        if isinstance(self.cx, Node):
            return False
        return bool(np.array_equal(np.asarray(self.plain.cx), np.asarray(self.plain.cy)))

    def _most(self) -> np.ndarray:
        """specular (n + 2) / (n + 1): the integral of the lobe without the cosine."""
        n = np.asarray(self.exponent, float)
        return np.max(np.asarray(self.specular)) * np.max((n + 2.0) / (n + 1.0))

    @function
    def _axis(self, wo: Direction) -> tuple[Direction, Scalar]:
        """The unit axis of the lobe, and the n-th power of its length before normalization. The power is computed from
        1 - length^2, because a rounded length close to 1 is too inaccurate for a large n."""
        axis = vec3(self.cx * wo.x, self.cy * wo.y, self.cz * wo.z)
        missing = _less(self.cx) * sqr(wo.x) + _less(self.cy) * sqr(wo.y) + _less(self.cz) * sqr(wo.z)  # 1 - length^2
        missing = minimum(missing, 1.0 - SHORTEST)
        axis = where(dot(axis, axis) > SHORTEST, axis, normal_like(wo))
        return normalize(axis), exp(self.exponent * (-0.5 * missing * logrel(-missing)))

    @function
    def _focus(self) -> Scalar:
        """((r - 1/2) / (r + 1/2))^2, where r = (n + 1) / 2 is the peak density of the lobe divided by that of the
        cosine."""
        return sqr(self.exponent / (self.exponent + 2.0))

    @function
    def _lobe(self, wo: Direction, wi: Direction) -> Spectrum:
        """specular (n + 2) / (2 pi) |C o|^n (axis.wi)^n cos theta_i."""
        axis, strength = self._axis(wo)
        norm = (self.exponent + 2.0) * (0.5 * inv_pi)
        return self.specular * (norm * strength * power_about(axis, wi, self.exponent) * wi.z)

    @function
    def _lobe_pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """(n + 1) / (2 pi) (axis.wi)^n."""
        axis, _ = self._axis(wo)
        return (self.exponent + 1.0) * (0.5 * inv_pi) * power_about(axis, wi, self.exponent)

    @function
    def _lobe_sample(self, wo: Direction, u: Direction) -> Direction:
        """A direction sampled from the power lobe about the axis."""
        axis, _ = self._axis(wo)
        return to_frame(axis, square_to_power_lobe(u.y, u.z, self.exponent))

    @function
    def _lobe_albedo(self, wo: Direction) -> Spectrum:
        """specular |C o|^n times the cosine between axis and normal: the albedo of a narrow lobe."""
        axis, strength = self._axis(wo)
        return self.specular * (strength * ops.clamp(axis.z, 0.1, 1.0))


@function
def _less(c: Scalar) -> Scalar:
    """1 - c^2, without cancellation."""
    return (1.0 - c) * (1.0 + c)
