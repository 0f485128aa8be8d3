"""Torrance-Sparrow dielectric with transmission."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..ops import abs, backend, dot, function, maximum, norm, safe_div, sqr, where
from ..optics import frame, fresnel, indices, masking
from ..optics.ndf import distribution
from . import microfacet
from .base import BSDF, Sample, Value, angle, choice, flag, number, spectrum, width


class Dielectric(BSDF):
    """Rough glass: reflection F D G / (4 (n.o)(n.i)) and refraction by Walter2007, eq. 21.

    With eta = eta_i / eta_o (indices on the wi and wo sides) and the facet's normal m along +-(wo + eta wi):
    f_t = albedo |o.m| |i.m| (1 - F) D G / (|o.n| |i.n| (o.m + eta i.m)^2), the form that carries radiance: it holds the
    factor 1 / eta^2 by which radiance shrinks; mode "importance" leaves it out. alpha below 1e-4 is smooth glass, and
    eta = 1 is no surface at all. `transmission=False` keeps the reflection only.
    """

    eta: Value = number(default=1.5, doc="index inside over index outside", low=0.2, high=5.0)
    alpha: Value = width(default=0.1, doc="width of the microfacet distribution; two for anisotropy")
    rotation: Value = angle(default=0.0, doc="turn of the anisotropy's axes about the normal, from dp/du")
    ndf: str = choice(default="ggx", doc="distribution of microfacet normals", choices=microfacet.NDFS)
    masking: str = choice(default="smith-correlated", doc="masking and shadowing", choices=microfacet.MASKINGS)
    fresnel: str = choice(default="exact", doc="Fresnel reflectance", choices=fresnel.KINDS)
    albedo: Value = spectrum(
        default=1.0, doc="factor on everything reflected or transmitted", low=0.0, high=1.0, soft_high=True
    )
    transmission: bool = flag(default=True, doc="whether refracted light goes on, or is lost")
    sampling: str = choice(default="visible", doc="which normals are sampled", choices=microfacet.SAMPLINGS)

    @classmethod
    def preset(cls, name: str, **parameters: Any) -> Dielectric:
        """A medium by name: Dielectric.preset("water", alpha=0). InputError where it is unknown."""
        return cls(eta=indices.medium(name).eta, **parameters)

    @function
    def reflectance(self, cos_o: Any, cos_t: Any, eta: Any) -> Any:
        """F by name at a facet seen under cos_o, with transmitted cosine cos_t (0: total reflection)."""
        if self.fresnel == "one":
            return 1.0 + 0.0 * cos_o
        if self.fresnel == "schlick":
            # from the denser side Schlick's angle is the transmitted one: the curve is 1 at the critical angle
            cos_theta = where(eta < 1.0, cos_t, cos_o)
            return where(cos_t > 0.0, fresnel.schlick(cos_theta, fresnel.r0_dielectric(eta)), 1.0)
        return fresnel.dielectric(cos_o, cos_t, eta)

    @function
    def _relative_eta(self, wo: Any) -> Any:
        """Index on the far side over index on wo's side."""
        return where(wo.z >= 0.0, self.eta, 1.0 / self.eta)

    @function
    def _normal(self, wo: Any, wi: Any, eta: Any) -> Any:
        """Normal of the facet that sends wo to wi, reflected or refracted (Walter2007, eq. 13, 16), m.z >= 0."""
        ratio = where(wo.z * wi.z > 0.0, 1.0, eta)
        h = wo + wi * ratio
        h = h * (1.0 / maximum(norm(h), 1e-15))
        return where(h.z < 0.0, -h, h)

    def _terms(self, wo: Any, wi: Any, m: Any, eta: Any, alpha: Any) -> tuple[Any, Any, Any]:
        """(D G / |o.n|, |o.m| dm/dwi over `_squeeze`, F) for the pair: what eval, pdf and the weight are made of."""
        ndf = distribution(self.ndf)
        reflects = wo.z * wi.z > 0.0
        dot_o, dot_i = dot(wo, m), dot(wi, m)
        # the far direction of a refraction is known: Snell's root would lose its cosine near the critical angle
        cos_t = where(reflects, fresnel.cos_transmitted(abs(dot_o), eta), abs(dot_i))
        f = self.reflectance(abs(dot_o), cos_t, eta)
        g = masking.masking_shadowing(self.masking, ndf, wo, wi, m, alpha)
        spread = 0.25 + 0.0 * dot_o
        if self.transmission:
            g_through = masking.masking_shadowing(self.masking, ndf, wo, wi, m, alpha, transmits=True)
            g = where(reflects, g, g_through)
            # Walter2007, eq. 17 (eq. 14 for reflection), times |o.m| / eta^2
            spread = where(reflects, spread, safe_div(abs(dot_i * dot_o), sqr(dot_o + eta * dot_i)))
        return safe_div(ndf.D(m, alpha) * g, abs(wo.z)), spread, f

    def _share(self, f: Any) -> Any:
        """Probability of choosing reflection."""
        return f if self.transmission else 1.0 + 0.0 * f

    def _squeeze(self, reflects: Any, eta: Any) -> Any:
        """eta^2 for transmission: by how much solid angle shrinks on its way in, and radiance grows."""
        return where(reflects, 1.0, sqr(eta))

    def _carried(self, reflects: Any, eta: Any, mode: str) -> Any:
        """Factor of the quantity that is carried: the eta^2 of the Jacobian cancels for radiance."""
        return self._squeeze(reflects, eta) if mode == "importance" else 1.0

    def _live(self, wo: Any, wi: Any) -> Any:
        """Whether the pair can be joined by a rough lobe at all."""
        return (wo.z * wi.z != 0.0) if self.transmission else (wo.z * wi.z > 0.0)

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        """The sum of both lobes times |cos theta_i|; 0 where alpha makes them deltas."""
        wo, wi = frame.rotate(wo, self.rotation), frame.rotate(wi, self.rotation)
        alpha, smooth = self._widths()
        eta = self._relative_eta(wo)
        m = self._normal(wo, wi, eta)
        facets, spread, f = self._terms(wo, wi, m, eta, alpha)
        reflects = wo.z * wi.z > 0.0
        share = where(reflects, f, 1.0 - f) * self._carried(reflects, eta, mode)
        return self.albedo * where(self._live(wo, wi) & ~smooth, facets * spread * share, 0.0)

    def pdf(self, wo: Any, wi: Any) -> Any:
        """Probability of the lobe, times the density of the normal, times dm/dwi."""
        wo, wi = frame.rotate(wo, self.rotation), frame.rotate(wi, self.rotation)
        alpha, smooth = self._widths()
        eta = self._relative_eta(wo)
        m = self._normal(wo, wi, eta)
        _, spread, f = self._terms(wo, wi, m, eta, alpha)
        reflects = wo.z * wi.z > 0.0
        share = where(reflects, self._share(f), 1.0 - self._share(f)) * self._squeeze(reflects, eta)
        # a facet seen from its back, or one that would refract into the wrong side, is never sampled
        seen = (dot(wo, m) * wo.z > 0.0) & (dot(wi, m) * wi.z > 0.0)
        density = safe_div(share * microfacet.normal_pdf(self, wo, m, alpha) * spread, abs(dot(wo, m)))
        return where(self._live(wo, wi) & seen & ~smooth, density, 0.0)

    def terms(self, wo: Any, wi: Any) -> microfacet.Terms:
        """D, G and F of the pair, at the normal that reflects or refracts wo into wi."""
        wo, wi = frame.rotate(wo, self.rotation), frame.rotate(wi, self.rotation)
        alpha, _ = self._widths()
        eta = self._relative_eta(wo)
        m = self._normal(wo, wi, eta)
        ndf = distribution(self.ndf)
        reflects = wo.z * wi.z > 0.0
        cos_t = where(reflects, fresnel.cos_transmitted(abs(dot(wo, m)), eta), abs(dot(wi, m)))
        f = self.reflectance(abs(dot(wo, m)), cos_t, eta)
        g = masking.masking_shadowing(self.masking, ndf, wo, wi, m, alpha)
        if self.transmission:
            g = where(reflects, g, masking.masking_shadowing(self.masking, ndf, wo, wi, m, alpha, transmits=True))
        return microfacet.Terms(ndf.D(m, alpha), g, self.albedo * f)

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Sample:
        """A normal first, then u1 chooses reflection with probability F; a direction on the wrong side is a failure."""
        wo = frame.rotate(wo, self.rotation)
        alpha, smooth = self._widths()
        eta = self._relative_eta(wo)
        m = microfacet.sample_normal(self, wo, u.y, u.z, alpha)
        m = where(smooth, frame.upright(wo), m)
        # a facet faces the side of wo
        facing = where(wo.z < 0.0, -m, m)
        cos_o = abs(dot(wo, facing))
        cos_t = fresnel.cos_transmitted(cos_o, eta)
        f = self.reflectance(cos_o, cos_t, eta)
        share = self._share(f)
        reflects = u.x < share
        wi = where(reflects, frame.reflect(wo, facing), frame.refract(wo, facing, cos_t, eta))
        facets, spread, _ = self._terms(wo, wi, m, eta, alpha)
        chance = where(reflects, share, 1.0 - share)
        right_side = where(reflects, wo.z * wi.z > 0.0, wo.z * wi.z < 0.0) & (dot(wo, facing) > 0.0)
        density = safe_div(microfacet.normal_pdf(self, wo, m, alpha) * spread * self._squeeze(reflects, eta), cos_o)
        pdf = chance * where(smooth, 1.0, density)
        pdf = where(right_side, pdf, 0.0)
        ideal = 1.0 if mode == "importance" else 1.0 / self._squeeze(reflects, eta)
        value = where(smooth, ideal, facets * spread * self._carried(reflects, eta, mode)) * where(reflects, f, 1.0 - f)
        weight = self.albedo * where(pdf > 0.0, safe_div(value, pdf), 0.0)
        relative = where(reflects, 1.0, eta)
        return Sample(frame.rotate_back(wi, self.rotation), weight, pdf, smooth & right_side, relative)

    def _widths(self) -> tuple[Any, Any]:
        """Widths, and whether the surface is smooth; where both indices are equal light goes straight on."""
        alpha, smooth = microfacet.widths(self.alpha)
        if self.transmission:
            smooth = smooth | (abs(self.eta - 1.0) < MATCHED)
        return alpha, smooth

    @property
    def transmits(self) -> bool:
        return self.transmission

    @property
    def delta(self) -> str:
        if self.transmission and not backend.is_drjit(self.eta):
            matched = np.abs(np.asarray(self.eta, dtype=float) - 1.0) < MATCHED
            if np.all(matched):
                return "always"
            if np.any(matched):
                return "maybe"
        return microfacet.delta(self.alpha) if not backend.is_drjit(self.eta) else "maybe"


# Refraction turns light by about (eta - 1) tan: below this difference of indices that is lost in the rounding of a
# float32 direction (6e-8), and the normal that joins two directions can no longer be told.
MATCHED = 1e-6
