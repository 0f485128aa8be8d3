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
    """Cook and Torrance's model as published: f = diffuse / pi + specular F D G / (pi (n.o)(n.i)) (Cook1982).

    The model describes rough metal or varnish. D = exp(-tan^2 / alpha^2) / (alpha^2 cos^4), a function of the angle
    between h and n, is Beckmann's distribution without the factor 1 / pi, and G is that of V-grooves. In the modern
    form (`conductor`), D includes the factor 1 / pi, and the denominator contains 4 instead of pi. The lobe is
    therefore four times as bright as that of a real surface with this distribution; for a real surface, set specular to
    1/4. Ngan2005 divides by pi once more. F is computed for a real index eta, without absorption; for a metal with
    reflectance F0, set eta to (1 + sqrt(F0)) / (1 - sqrt(F0)). The model is reciprocal. `sample` reflects wo about a
    visible normal of Beckmann's distribution with Smith masking.

    The presets, named MATERIAL:PAPER/FIT, are published fits to materials in the MERL database.
    """

    specular: Colour = spectrum(default=0.25, doc="scale factor for the lobe; 1/4 for a real surface", low=0.0)
    alpha: Width = width(
        default=0.15,
        doc="width of the distribution; for anisotropy, widths along x and y",
        low=1e-3,
        high=4.0,
    )
    rotation: Angle = microfacet.rotation_angle()
    eta: Colour = spectrum(default=1.5, doc="refractive index, relative to the outside", low=1.0)
    fresnel: Member = microfacet.fresnel_choice()

    known_violations: ClassVar[Mapping[str, KnownViolation]] = {
        "energy": sum_breach("D G / (pi cos cos) gives four times the light that facets reflect, and "),
    }

    def _most(self) -> np.ndarray:
        """4 specular, because the lobe is at most four times the light that facets reflect at F = 1."""
        return 4.0 * np.max(np.asarray(self.specular, float))

    def reflectance(self, cos_theta: Scalar) -> Spectrum:
        """F at the cosine of incidence on a facet, by the formula that `fresnel` selects."""
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
