"""The Torrance-Sparrow conductor."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ...material.bsdf import Preset
from ...material.parameters import Angle, Colour, Member, Width, spectrum
from ...material.polarization import Polarized
from ...ops import Direction, Mask, Mode, Scalar, Spectrum, abs, dot, function, where
from ...optics import frame, fresnel, indices
from ...optics.fresnel.artist import edge_tint, imageworks
from ...optics.fresnel.polarization import Diattenuation, reflected_by_metal
from . import microfacet
from .reflector import _Reflector


class Conductor(_Reflector):
    """A rough metal: f = albedo F D G / (4 (n.o)(n.i)) (Torrance1967; course sheet, eqs. 4 to 11).

    F is evaluated at the half vector. D, G and F are selected by `ndf`, `masking` and `fresnel`. If alpha is below
    1e-4, the surface is a perfect mirror. Multiply scattered light, which is more than half of the light at alpha = 1,
    is lost.
    """

    eta: Colour = spectrum(default=0.0, doc="real part of the refractive index, relative to the outside", low=0.0)
    k: Colour = spectrum(default=1.0, doc="imaginary part of the refractive index, relative to the outside", low=0.0)
    alpha: Width = microfacet.alpha_width()
    rotation: Angle = microfacet.rotation_angle()  # type: ignore[assignment]  # mypy mistakes an inherited field
    ndf: Member = microfacet.ndf_choice()
    masking: Member = microfacet.masking_choice()
    fresnel: Member = microfacet.fresnel_choice()
    albedo: Colour = microfacet.albedo_factor("scale factor for all reflected light")
    sampling: str = microfacet.sampling_choice()

    preset_kind: ClassVar[str] = "metal"

    @classmethod
    def presets(cls) -> Mapping[str, Preset]:
        """Metals by chemical symbol, with eta and k."""
        metals = indices.METALS.items()
        return {symbol: Preset(m.name, {"eta": m.eta, "k": m.k}, m.source, m.also) for symbol, m in metals}

    @function
    def reflectance(self, cos_theta: Scalar) -> Spectrum:
        """`albedo` times F at the cosine of incidence on a facet, by the formula that `fresnel` selects."""
        return self.albedo * fresnel.kind(self.fresnel).conductor(cos_theta, self.eta, self.k)

    def _polarization(self, cos_theta: Scalar) -> Diattenuation[Spectrum]:
        """Polarization of the light that a facet reflects."""
        return reflected_by_metal(cos_theta, self.eta, self.k)

    def polarized(self, wo: Direction, wi: Direction, delta: Mask, mode: Mode = "radiance") -> tuple[Polarized, ...]:
        """All light, polarized according to the exact equations; the chosen Fresnel kind affects only its amount."""
        m = frame.half_vector(wo, wi)
        cos = abs(dot(wo, m))
        value = where(delta, self.reflectance(cos), self.eval(wo, wi, mode))
        return (Polarized(value, m, self._polarization(cos)),)

    def mean_reflectance(self, average: str = "exact") -> Spectrum:
        """F_avg of the chosen Fresnel kind, or of the fit `artist.imageworks`."""
        kind = fresnel.kind(self.fresnel)
        if average == "imageworks" and not kind.white:
            return imageworks(*edge_tint(self.eta, self.k))
        return kind.conductor_average(self.eta, self.k)
