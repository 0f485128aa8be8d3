"""Low's microfacet model."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ... import ops
from ...material.bsdf import KnownViolation
from ...material.parameters import Colour, Member, Number, number, spectrum
from ...ops import Direction, Scalar, Spectrum, exp, function, inv_pi, log, safe_sqrt, sincos, sqr, vec3
from ...optics import frame, fresnel
from ...optics.masking.v_groove import v_groove
from ...optics.special import exprel, logrel, power_integral, power_quantile
from ..microfacet import microfacet
from .glossy import _Glossy, facet, sum_breach


class LowMicrofacet(_Glossy):
    """A microfacet model with a power-law D: f = diffuse / pi + specular F D G / (pi (n.o)(n.i)) (Low2012).

    D = (1 + b (1 - n.h))^-c is not normalized, so `specular` includes the height of the peak of D. G is that of
    V-grooves, and the factor 1 / pi is that of Cook1982. The model is reciprocal. Half vectors are sampled with a
    density proportional to D.

    The presets, named MATERIAL:PAPER/FIT, are published fits to materials in the MERL database.
    """

    specular: Colour = spectrum(default=3.0, doc="scale factor for the lobe, including the height of D", low=0.0)
    b: Number = number(default=300.0, doc="narrowness of the peak, which extends to 1 - n.h = 1 / b", low=1e-3)
    c: Number = number(default=1.5, doc="exponent of the falloff beyond the peak, (1 - n.h)^-c", low=0.0)
    eta: Colour = spectrum(default=1.5, doc="refractive index, relative to the outside", low=1.0)
    fresnel: Member = microfacet.fresnel_choice()

    known_violations: ClassVar[Mapping[str, KnownViolation]] = {"energy": sum_breach("D is not normalized, and ")}

    def _most(self) -> np.ndarray:
        """16 specular m, where m = int D d(n.h): the weight of a sample is 8 specular m F G (o.h) / (n.o), and
        G (o.h) <= 2 (n.o)."""
        b, c = np.asarray(self.b, float), np.asarray(self.c, float)
        log_t, q = np.log1p(b), np.where(np.abs(1.0 - c) < 1e-9, 1e-9, 1.0 - c)
        return np.max(np.asarray(self.specular, float)) * 16.0 * np.max(np.expm1(q * log_t) / (q * b))

    def reflectance(self, cos_theta: Scalar) -> Spectrum:
        """F at the cosine of incidence on a facet, by the formula that `fresnel` selects."""
        return fresnel.kind(self.fresnel).conductor(cos_theta, self.eta, ops.zeros_like(self.eta))

    @function
    def _fall(self, h: Direction) -> Scalar:
        """(1 + b (1 - n.h))^-c, with 1 - n.h computed from the sine, because the difference cancels at the peak."""
        return exp(-self.c * log(1.0 + self.b * frame.sin2(h) / (1.0 + h.z)))

    @function
    def _mass(self) -> Scalar:
        """int_0^1 D d(n.h)."""
        return logrel(self.b) * exprel((1.0 - self.c) * self._log_end())

    @function
    def _log_end(self) -> Scalar:
        """log(1 + b), at which the power law ends."""
        return self.b * logrel(self.b)

    @function
    def _focus(self) -> Scalar:
        """(r / (1 + r))^3, where r = 1 / (8 int D) is the peak density of the lobe divided by that of the cosine."""
        narrower = 1.0 / (1.0 + 8.0 * self._mass())
        return narrower * sqr(narrower)

    @function
    def _lobe(self, wo: Direction, wi: Direction) -> Spectrum:
        """specular F D G / (pi cos theta_o)."""
        h, cos = facet(wo, wi)
        facets = self._fall(h) * v_groove(wo, wi, h) * inv_pi / wo.z
        return self.specular * self.reflectance(cos) * facets

    @function
    def _lobe_pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """D, divided by its integral over the hemisphere and by 4 (o.h)."""
        h, cos = facet(wo, wi)
        return self._fall(h) * (0.5 * inv_pi) / (self._mass() * 4.0 * cos)

    @function
    def _lobe_sample(self, wo: Direction, u: Direction) -> Direction:
        """wo mirrored about a half vector with density D: 1 + b (1 - n.h) follows a power law from 1 to 1 + b."""
        q = 1.0 - self.c
        log_t = power_quantile(u.y * power_integral(self._log_end(), q), q)
        versine = log_t * exprel(log_t) / self.b
        sin = safe_sqrt(versine * (2.0 - versine))
        s, c = sincos((2.0 * ops.pi) * u.z)
        return frame.reflect(wo, vec3(sin * c, sin * s, 1.0 - versine))

    def _lobe_albedo(self, wo: Direction) -> Spectrum:
        """8 specular F int D, the albedo of a narrow lobe."""
        return self.specular * self.reflectance(wo.z) * (8.0 * self._mass())
