"""Ward's model of 1992."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ...material.bsdf import KnownViolation
from ...material.parameters import Angle, Colour, Width, spectrum, width
from ...ops import Direction, Scalar, Spectrum, function, sqr, sqrt
from ...optics import frame
from ...optics.ndf import distribution
from ..microfacet import microfacet
from .glossy import _Glossy, facet, sum_breach


class Ward(_Glossy):
    """Ward's Gaussian lobe: f = diffuse / pi + specular e / (4 pi alpha_x alpha_y sqrt((n.o)(n.i))) (Ward1992).

    e = exp(-(h_x^2 / alpha_x^2 + h_y^2 / alpha_y^2) / h_z^2), where h is the half vector (Walter2005). The model is
    reciprocal. The albedo of a narrow lobe is specular cos theta_o, so energy is lost toward grazing angles. A wide
    lobe extends toward the normal, and its albedo grows without bound at grazing angles. The model is sampled by
    drawing half vectors with density D (n.h), where D is Beckmann's distribution.

    The presets, named MATERIAL:PAPER/FIT, are published fits to materials in the MERL database.
    """

    specular: Colour = spectrum(default=0.2, doc="albedo of the lobe at normal incidence", low=0.0)
    alpha: Width = width(
        default=0.15, doc="width of the Gaussian; for anisotropy, widths along x and y", low=1e-3, high=4.0
    )
    rotation: Angle = microfacet.rotation_angle()

    known_violations: ClassVar[Mapping[str, KnownViolation]] = {
        "energy": sum_breach("the lobe grows as 1 / sqrt(cos theta_o) toward grazing angles, and "),
    }

    @property
    def _height(self) -> Spectrum:
        """`specular`; mypy does not treat an inherited field of a subclass as a declared parameter."""
        return self.specular

    @function
    def _shape(self, wo: Direction, wi: Direction) -> Scalar:
        """f of the lobe divided by specular D, which is (n.h)^4 / (4 sqrt((n.o)(n.i)))."""
        h, _ = facet(wo, wi)
        return 0.25 * sqr(sqr(h.z)) / sqrt(wo.z * wi.z)

    @function
    def _density(self, h: Direction) -> Scalar:
        """Beckmann's D."""
        return distribution("beckmann").D(frame.rotate(h, self.rotation), self.alpha)

    @function
    def _focus(self) -> Scalar:
        """(r / (1 + r))^2, where r = 1 / (4 alpha_x alpha_y) is the peak density of the lobe divided by that of the
        cosine."""
        return 1.0 / sqr(1.0 + 4.0 * self.alpha.x * self.alpha.y)

    @function
    def _lobe(self, wo: Direction, wi: Direction) -> Spectrum:
        """specular e / (4 pi alpha_x alpha_y sqrt((n.o)(n.i))) cos theta_i."""
        h, _ = facet(wo, wi)
        return self.specular * (self._density(h) * self._shape(wo, wi) * wi.z)

    @function
    def _lobe_pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """D (n.h) / (4 (o.h)) (Walter2005)."""
        h, cos = facet(wo, wi)
        return self._density(h) * h.z / (4.0 * cos)

    @function
    def _lobe_sample(self, wo: Direction, u: Direction) -> Direction:
        """wo mirrored about a half vector with Beckmann's distribution."""
        h = distribution("beckmann").sample(u.y, u.z, self.alpha)
        return frame.reflect(wo, frame.rotate_back(h, self.rotation))

    def _lobe_albedo(self, wo: Direction) -> Spectrum:
        """specular cos theta_o, the albedo of a narrow lobe."""
        return self.specular * wo.z
