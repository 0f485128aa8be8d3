"""Oren-Nayar's rough diffuse reflection."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ...material.bsdf import BSDF, KnownViolation, Limit
from ...material.calling import method
from ...material.parameters import Colour, Number, number, spectrum
from ...material.sample import Sample
from ...ops import Direction, Mode, Scalar, Spectrum, function, inv_pi, maximum, sqr, where
from .lambert import Lambert


class OrenNayar(BSDF):
    """Diffuse reflection by Lambertian V-grooves: the qualitative form of the model (OrenNayar1994, sec. 4.4).

    f = albedo / pi (A + B max(0, cos(phi_i - phi_o)) sin(a) tan(b))
    a = max(theta_o, theta_i),  b = min(theta_o, theta_i)
    A = 1 - sigma^2 / (2 (sigma^2 + 0.33)),  B = 0.45 sigma^2 / (sigma^2 + 0.09)        (course sheet, eqs. 2 and 3)

    No trigonometric functions are evaluated: sin(a) tan(b) = sin theta_o sin theta_i / max(cos theta_o, cos theta_i),
    and the product of the two sines and the cosine of the azimuth difference is the dot product of the tangential
    components. The model is valid only for small sigma (up to about 0.5 rad); beyond this range, the formula is used
    unchanged. Interreflections are omitted, so the energy loss increases with sigma. At grazing angles, the directional
    albedo tends to albedo (A + B / 2), which exceeds 1 for albedo = 1 and sigma < 0.33.
    """

    albedo: Colour = spectrum(
        default=0.5, doc="fraction of light that the sides of the grooves reflect", low=0.0, high=1.0, soft_high=True
    )
    sigma: Number = number(default=0.3, doc="standard deviation of the slope angle of the grooves", low=0.0, unit="rad")

    limits: ClassVar[tuple[Limit, ...]] = (Limit({"sigma": 0.0}, equals=lambda one: Lambert(one.albedo)),)
    known_violations: ClassVar[Mapping[str, KnownViolation]] = {
        "energy": KnownViolation(
            "at grazing angles, the albedo A + B / 2 of the qualitative model reaches 1.015 (sigma = 0.2, albedo = 1)",
            lambda model: max(_grazing_albedo(float(np.max(model.sigma))) - 1.0, 0.0),
            certain=False,  # below sigma = 0.04, the violation is less than a thousandth
        )
    }

    @function
    def _shape(self, wo: Direction, wi: Direction) -> Scalar:
        """A + B max(0, cos(phi_i - phi_o)) sin(a) tan(b)."""
        s2 = sqr(self.sigma)
        a = 1.0 - 0.5 * s2 / (s2 + 0.33)
        b = 0.45 * s2 / (s2 + 0.09)
        tangential = maximum(wo.x * wi.x + wo.y * wi.y, 0.0)
        # both cosines are 0 only where the caller masks the result
        return a + b * tangential / maximum(maximum(wo.z, wi.z), 1e-7)

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """albedo / pi (A + B ...) cos theta_i above the surface."""
        above = (wo.z > 0.0) & (wi.z > 0.0)
        return self.albedo * where(above, self._shape(wo, wi) * wi.z * inv_pi, 0.0)

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """cos theta_i / pi above the surface; the term with B is small and equally smooth."""
        return where((wo.z > 0.0) & (wi.z > 0.0), wi.z * inv_pi, 0.0)

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """A cosine-weighted direction."""
        return self.sample_cosine(wo, u, mode)


def _grazing_albedo(sigma: float) -> float:
    """A + B / 2, the limit of the albedo as theta_o goes to 90 degrees.

    Then sin(a) tan(b) = tan theta_i, and (1 / pi) int max(0, cos phi) tan theta cos theta sin theta dtheta dphi = 1/2.
    """
    s2 = sigma * sigma
    return 1.0 - 0.5 * s2 / (s2 + 0.33) + 0.225 * s2 / (s2 + 0.09)
