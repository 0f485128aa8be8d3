"""Cook and Torrance's model of 1982."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ...material.bsdf import KnownViolation
from ...material.parameters import Angle, Colour, Member, Width, spectrum, width
from ...ops import Direction, Scalar, Spectrum, function, zeros_like
from ...optics import frame, fresnel
from ...optics.masking.v_groove import v_groove
from ...optics.ndf import distribution
from ..microfacet import microfacet
from .glossy import _Glossy, facet, sum_breach


class CookTorrance(_Glossy):
    """Rough metal or varnish in the original form: f = diffuse / pi + specular F D G / (pi (n.o)(n.i)) (Cook1982).

    As published, D = exp(-tan^2 / alpha^2) / (alpha^2 cos^4), with the tangent and cosine of the angle between h and n,
    is Beckmann's distribution without the factor 1 / pi, and G is that of V-grooves. Today, D includes 1 / pi and the
    denominator has a 4 in place of pi (`conductor`), so this lobe is four times as bright as a surface with this
    distribution, and specular = 1/4 corresponds to a real surface. Ngan2005 divides by pi once more. F is computed for
    a real index eta, without absorption; for a metal of reflectance F0, set eta to (1 + sqrt(F0)) / (1 - sqrt(F0)). The
    model is reciprocal. It is sampled by the visible normals of Beckmann's distribution with Smith masking.

    The presets are published fits to materials of the MERL database, named MATERIAL:PAPER/FIT.
    """

    specular: Colour = spectrum(default=0.25, doc="scale factor of the lobe; 1/4 for a real surface", low=0.0)
    alpha: Width = width(default=0.15, doc="width of the distribution; two for anisotropy", low=1e-3, high=4.0)
    rotation: Angle = microfacet.rotation_angle()
    eta: Colour = spectrum(default=1.5, doc="refractive index, relative to the outside", low=1.0)
    fresnel: Member = microfacet.fresnel_choice()

    known_violations: ClassVar[Mapping[str, KnownViolation]] = {
        "energy": sum_breach("D G / (pi cos cos) is four times the light that facets reflect, "),
    }

    def _most(self) -> np.ndarray:
        """4 specular, since the lobe is at most four times the reflection by facets of F = 1."""
        return 4.0 * np.max(np.asarray(self.specular, float))

    def reflectance(self, cos_theta: Scalar) -> Spectrum:
        """F at the cosine of incidence on a facet, by the formula that `fresnel` names."""
        return fresnel.kind(self.fresnel).conductor(cos_theta, self.eta, zeros_like(self.eta))

    @function
    def _lobe(self, wo: Direction, wi: Direction) -> Spectrum:
        """specular F D G / cos theta_o, with the factor 1 / pi in D."""
        h, cos = facet(wo, wi)
        d = distribution("beckmann").D(frame.rotate(h, self.rotation), self.alpha)
        return self.specular * self.reflectance(cos) * (d * v_groove(wo, wi, h) / wo.z)

    @function
    def _lobe_pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """Density of Beckmann's visible normals divided by 4 (o.h) (Walter2007, eq. 14)."""
        h, _ = facet(wo, wi)
        wo_local, normal = frame.rotate(wo, self.rotation), frame.rotate(h, self.rotation)
        return 0.25 * distribution("beckmann").visible_per_cosine(wo_local, normal, self.alpha)

    @function
    def _lobe_sample(self, wo: Direction, u: Direction) -> Direction:
        """wo mirrored about a visible normal."""
        wo_local = frame.rotate(wo, self.rotation)
        h = distribution("beckmann").sample_visible(wo_local, u.y, u.z, self.alpha)
        return frame.rotate_back(frame.reflect(wo_local, h), self.rotation)

    def _lobe_albedo(self, wo: Direction) -> Spectrum:
        """4 specular F, the albedo of a narrow lobe."""
        return self.specular * self.reflectance(wo.z) * 4.0
