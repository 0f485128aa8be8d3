"""Torrance-Sparrow conductor."""

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
    """Rough metal: f = albedo F D G / (4 (n.o)(n.i)), F at the half vector (Torrance1967; course sheet, eq. 4 to 11).

    D, G and F are chosen by name. alpha below 1e-4 is a perfect mirror. Light that a second facet would reflect is
    lost: more than half at alpha = 1.
    """

    eta: Colour = spectrum(default=0.0, doc="real part of the refractive index, over the outside's", low=0.0)
    k: Colour = spectrum(default=1.0, doc="imaginary part of the refractive index, over the outside's", low=0.0)
    alpha: Width = microfacet.alpha_width()
    rotation: Angle = microfacet.rotation_angle()  # type: ignore[assignment]  # mypy mistakes an inherited field
    ndf: Member = microfacet.ndf_choice()
    masking: Member = microfacet.masking_choice()
    fresnel: Member = microfacet.fresnel_choice()
    albedo: Colour = microfacet.albedo_factor("factor on everything reflected")
    sampling: str = microfacet.sampling_choice()

    preset_kind: ClassVar[str] = "metal"

    @classmethod
    def presets(cls) -> Mapping[str, Preset]:
        """Metals by symbol: eta and k."""
        metals = indices.METALS.items()
        return {symbol: Preset(m.name, {"eta": m.eta, "k": m.k}, m.source) for symbol, m in metals}

    @function
    def reflectance(self, cos_theta: Scalar) -> Spectrum:
        """F, by name, times albedo, at a facet seen at cos_theta."""
        return self.albedo * fresnel.kind(self.fresnel).conductor(cos_theta, self.eta, self.k)

    def _polarization(self, cos_theta: Scalar) -> Diattenuation[Spectrum]:
        """Polarization by a facet."""
        return reflected_by_metal(cos_theta, self.eta, self.k)

    def polarized(self, wo: Direction, wi: Direction, delta: Mask, mode: Mode = "radiance") -> tuple[Polarized, ...]:
        """All of the light, by the exact equations; the Fresnel kind affects only its amount."""
        m = frame.half_vector(wo, wi)
        cos = abs(dot(wo, m))
        value = where(delta, self.reflectance(cos), self.eval(wo, wi, mode))
        return (Polarized(value, m, self._polarization(cos)),)

    def mean_reflectance(self, average: str = "exact") -> Spectrum:
        """From the Fresnel kind, or by the fit of `artist.imageworks`."""
        kind = fresnel.kind(self.fresnel)
        if average == "imageworks" and not kind.white:
            return imageworks(*edge_tint(self.eta, self.k))
        return kind.conductor_average(self.eta, self.k)
