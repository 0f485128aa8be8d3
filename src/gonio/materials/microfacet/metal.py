"""A metal that is specified by its colors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ...material.bsdf import KnownViolation
from ...material.parameters import Angle, Colour, Member, Width, choice, spectrum
from ...ops import Scalar, Spectrum, function, ones_like
from ...optics.fresnel import average as mean_over_angles
from ...optics.fresnel.f82 import GRAZING, f82
from ...optics.fresnel.schlick import schlick
from . import microfacet
from .reflector import _Reflector

FRESNELS = {"f82": "Schlick's approximation, corrected at 82 degrees", "one": "F = 1, a perfect mirror"}


class Metal(_Reflector):
    """A rough metal with artist-friendly parameters: the color at normal incidence and the tint at the edge
    (F82-tint, Kutz2021).

    f = albedo F D G / (4 (n.o)(n.i)), with F = r0 at normal incidence and F = 1 at 90 degrees. At 82 degrees, F is
    `edge` times the value of Schlick's approximation; edge = 1 therefore gives Schlick's approximation. OpenPBR uses
    this model for metals. `metal` has no refractive index, which thin films and polarization require; for these, use
    `conductor`.
    """

    known_violations: ClassVar[Mapping[str, KnownViolation]] = {
        "linearity": KnownViolation("for `edge` below 0.5 and a dark `r0`, F is clamped to 0", 1.0, certain=False),
        "precision": KnownViolation(
            "near the angles at which F is clamped to 0, F is a difference of nearly equal numbers", 0.01, certain=False
        ),
    }

    r0: Colour = spectrum(default=0.9, doc="reflectance at normal incidence", low=0.0, high=1.0, soft_high=True)
    edge: Colour = spectrum(default=1.0, doc="F at 82 degrees, relative to Schlick's approximation", low=0.0, high=1.0)
    alpha: Width = microfacet.alpha_width()
    rotation: Angle = microfacet.rotation_angle()  # type: ignore[assignment]  # mypy mistakes an inherited field
    ndf: Member = microfacet.ndf_choice()
    masking: Member = microfacet.masking_choice()
    fresnel: str = choice("f82", "Fresnel reflectance", FRESNELS, white="one")
    albedo: Colour = microfacet.albedo_factor("scale factor for all reflected light")
    sampling: str = microfacet.sampling_choice()

    @function
    def reflectance(self, cos_theta: Scalar) -> Spectrum:
        """`albedo` times F at the cosine of incidence on a facet."""
        if self.fresnel == "one":
            return self.albedo * ones_like(cos_theta)
        return self.albedo * self._curve(cos_theta)

    def _curve(self, cos_theta: Scalar | float) -> Spectrum:
        return f82(cos_theta, self.r0, self.edge * schlick(GRAZING, self.r0))

    def mean_reflectance(self, average: str = "exact") -> Spectrum:
        """F_avg, the integral of the curve, for any `average`."""
        if self.fresnel == "one":
            return ones_like(self.r0)
        return mean_over_angles(self._curve)
