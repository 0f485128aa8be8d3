"""Torrance-Sparrow conductor."""

from __future__ import annotations

from typing import Any

from ..ops import abs, dot, function, safe_div, where
from ..optics import frame, fresnel, indices, masking
from ..optics.ndf import distribution
from . import microfacet
from .base import BSDF, Sample, Value, angle, choice, spectrum, width


class Conductor(BSDF):
    """Rough metal: f = albedo F D G / (4 (n.o)(n.i)), F at the half vector (Torrance1967; course sheet, eq. 4 to 11).

    D, G and F are chosen by name. alpha below 1e-4 is a perfect mirror. Light that a second facet would reflect is
    lost: at alpha = 1 more than half.
    """

    eta: Value = spectrum(default=0.0, doc="real part of the refractive index, over the outside's", low=0.0)
    k: Value = spectrum(default=1.0, doc="imaginary part of the refractive index, over the outside's", low=0.0)
    alpha: Value = width(default=0.1, doc="width of the microfacet distribution; two for anisotropy")
    rotation: Value = angle(default=0.0, doc="turn of the anisotropy's axes about the normal, from dp/du")
    ndf: str = choice(default="ggx", doc="distribution of microfacet normals", choices=microfacet.NDFS)
    masking: str = choice(default="smith-correlated", doc="masking and shadowing", choices=microfacet.MASKINGS)
    fresnel: str = choice(default="exact", doc="Fresnel reflectance", choices=microfacet.FRESNELS)
    albedo: Value = spectrum(default=1.0, doc="factor on everything reflected", low=0.0, high=1.0, soft_high=True)
    sampling: str = choice(default="visible", doc="which normals are sampled", choices=microfacet.SAMPLINGS)

    @classmethod
    def preset(cls, name: str, **parameters: Any) -> Conductor:
        """A metal by name or symbol: Conductor.preset("Au", alpha=0.2). InputError where it is unknown."""
        metal = indices.metal(name)
        return cls(eta=metal.eta, k=metal.k, **parameters)

    @function
    def reflectance(self, cos_theta: Any) -> Any:
        """F by name, times albedo, at a facet seen under cos_theta."""
        return self.albedo * fresnel.kind(self.fresnel).conductor(cos_theta, self.eta, self.k)

    def _facet(self, wo: Any, wi: Any) -> tuple[Any, Any, Any, Any, Any]:
        """(wo, wi, normal m of the facet that mirrors one into the other, widths, whether a rough lobe joins them), all
        along the axes of the anisotropy; turned last, as wo + wi would cancel with the rounding of the turn."""
        m = frame.half_vector(wo, wi)
        alpha, smooth = microfacet.widths(self.alpha)
        wo, wi, m = (frame.rotate(w, self.rotation) for w in (wo, wi, m))
        return wo, wi, m, alpha, _above(wo, wi) & ~smooth

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        """albedo F D G / (4 cos theta_o); 0 where alpha makes it a mirror."""
        wo, wi, m, alpha, lit = self._facet(wo, wi)
        return self.reflectance(abs(dot(wo, m))) * where(lit, microfacet.reflection(self, wo, wi, m, alpha), 0.0)

    def pdf(self, wo: Any, wi: Any) -> Any:
        """Density of the sampled normal over 4 (o.m) (Walter2007, eq. 14)."""
        wo, wi, m, alpha, lit = self._facet(wo, wi)
        return where(lit, 0.25 * microfacet.pdf_per_cosine(self, wo, m, alpha), 0.0)

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Sample:
        """wo mirrored at a sampled normal; a direction below the surface is a failed sample."""
        alpha, smooth = microfacet.widths(self.alpha)
        turned = frame.rotate(wo, self.rotation)
        m = where(smooth, frame.upright(wo), microfacet.sample_normal(self, turned, u.y, u.z, alpha))
        wi = frame.rotate_back(frame.reflect(turned, m), self.rotation)
        # m anew from the rounded wi: the weight is eval / pdf to the last digits, however narrow the lobe
        wo, turned, m, alpha, lit = self._facet(wo, wi)
        density = 0.25 * microfacet.pdf_per_cosine(self, wo, m, alpha)
        facets = where(lit, safe_div(microfacet.reflection(self, wo, turned, m, alpha), density), 0.0)
        mirrors = smooth & _above(wo, turned)
        weight = self.reflectance(abs(dot(wo, m))) * where(mirrors, 1.0, facets)
        pdf = where(mirrors, 1.0, where(lit, density, 0.0))
        return Sample(wi, weight, pdf, mirrors, 1.0 + 0.0 * pdf)

    def terms(self, wo: Any, wi: Any) -> microfacet.Terms:
        """D, G and F of the pair; eval is F D G / (4 cos theta_o)."""
        wo, wi, m, alpha, _ = self._facet(wo, wi)
        ndf = distribution(self.ndf)
        g = masking.masking_shadowing(self.masking, ndf, wo, wi, m, alpha)
        return microfacet.Terms(ndf.D(m, alpha), g, self.reflectance(abs(dot(wo, m))))

    def tint(self, wo: Any) -> Any:
        """F at the surface's own normal."""
        return self.reflectance(abs(wo.z))

    @property
    def delta(self) -> str:
        return microfacet.delta(self.alpha)


def _above(wo: Any, wi: Any) -> Any:
    return (wo.z > 0.0) & (wi.z > 0.0)
