"""Phong's model as normalized by Lafortune and Willems."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Self

import numpy as np

from ... import ops
from ...material.bsdf import BSDF, KnownViolation, Limit
from ...material.calling import method
from ...material.parameters import Colour, Number, number, spectrum
from ...material.sample import Sample
from ...ops import Direction, Mode, Scalar, Spectrum, clamp, function, inv_pi, mean, sqr, where
from ...optics.frame import lit, mirror
from ...optics.warp import power_about, square_to_cosine_hemisphere, square_to_power_lobe, to_frame
from ..diffuse.lambert import Lambert


class ModifiedPhong(BSDF):
    """Phong's lobe as a reciprocal, energy-conserving BRDF: f = kd / pi + ks (p + 2) / (2 pi) (v.r)^p.

    v is wo, and r is wi mirrored about the normal; v.r is clamped to 0 (Lafortune1994). Because of the normalization
    factor, ks is the albedo of the lobe at normal incidence; toward grazing angles, part of the lobe lies below the
    surface and is lost. Energy is conserved if kd + ks <= 1. `phong` is Phong's original model, and `lafortune`
    generalizes `modified-phong`.
    """

    kd: Colour = spectrum(default=0.5, doc="albedo of the diffuse component", low=0.0, high=1.0, soft_high=True)
    ks: Colour = spectrum(default=0.3, doc="albedo of the lobe at normal incidence", low=0.0, high=1.0, soft_high=True)
    p: Number = number(default=32.0, doc="exponent of the lobe", low=0.0)

    limits: ClassVar[tuple[Limit, ...]] = (Limit({"ks": 0.0}, equals=lambda one: Lambert(one.kd)),)
    known_violations: ClassVar[Mapping[str, KnownViolation]] = {
        "energy": KnownViolation(
            "kd + ks exceeds 1",
            lambda model: max(float(np.max(np.asarray(model.kd) + np.asarray(model.ks))) - 1.0, 0.0),
            certain=False,  # reached only at normal incidence, which not every test includes
        )
    }

    @function
    def _share(self, wo: Direction) -> Scalar:
        """Probability of sampling the lobe: ks / (ks + kd), where ks is reduced if the lobe is wide or partly below
        the horizon.

        Let r = (p + 1) / 2 be the peak density of the lobe divided by that of the cosine. For a wide lobe, ks is
        multiplied by ((r - 1/2) / (r + 1/2))^2.
        """
        lobe = mean(self.ks) * sqr(self.p / (self.p + 2.0)) * clamp(wo.z, 0.1, 1.0)
        return clamp(ops.safe_div(lobe, lobe + mean(self.kd)), 0.0, MAX_LOBE_SHARE)

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """kd / pi cos theta_i + ks (p + 2) / (2 pi) (v.r)^p cos theta_i above the surface."""
        above, o, i = lit(wo, wi)
        lobe = (self.p + 2.0) * (0.5 * inv_pi) * power_about(mirror(o), i, self.p)
        return where(above, (self.kd * inv_pi + self.ks * lobe) * i.z, 0.0)

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """Mixture of the cosine density and (p + 1) / (2 pi) (v.r)^p."""
        above, o, i = lit(wo, wi)
        share = self._share(o)
        lobe = (self.p + 1.0) * (0.5 * inv_pi) * power_about(mirror(o), i, self.p)
        return where(above, (1.0 - share) * i.z * inv_pi + share * lobe, 0.0)

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """u.x selects a lobe; a direction below the surface is a failed sample."""
        lobe = to_frame(mirror(wo), square_to_power_lobe(u.y, u.z, self.p))
        wi = where(u.x < self._share(wo), lobe, square_to_cosine_hemisphere(u.y, u.z))
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return Sample.of_density(wi, weight, pdf)

    def lossless(self) -> Self:
        """The material itself, because no kd and ks with kd + ks = 1 reflect all light."""
        return self

    def tint(self, wo: Direction) -> Spectrum:
        """The sum of the two albedos."""
        return self.kd + self.ks


MAX_LOBE_SHARE = 0.95  # maximum probability of the lobe; cosine samples keep the weights bounded
