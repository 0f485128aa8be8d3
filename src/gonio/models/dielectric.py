"""Torrance-Sparrow dielectric with transmission."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..ops import abs, backend, dot, fma, function, maximum, rsqrt, safe_div, sqr, where
from ..optics import frame, fresnel, indices, masking
from ..optics.ndf import distribution
from . import microfacet
from .base import BSDF, Sample, Value, angle, choice, flag, number, spectrum, width


class _Facet(NamedTuple):
    """What joins a pair of directions.

    wo, wi        the pair, in the frame of the widths
    m             normal of the facet, m.z >= 0
    dot_o, dot_i  o.m and i.m
    reflects      whether wi lies on wo's side
    lit           whether a rough lobe joins them
    alpha         widths
    spread        |o.m| dm/dwi (Walter2007, eq. 14), in refraction (eq. 17) over eta^2
    """

    wo: Any
    wi: Any
    m: Any
    dot_o: Any
    dot_i: Any
    reflects: Any
    lit: Any
    alpha: Any
    spread: Any


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
    fresnel: str = choice(default="exact", doc="Fresnel reflectance", choices=microfacet.FRESNELS)
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
        return fresnel.kind(self.fresnel).dielectric(cos_o, cos_t, eta)

    @function
    def _relative_eta(self, wo: Any) -> Any:
        """Index on the far side over index on wo's side."""
        return where(wo.z >= 0.0, self.eta, 1.0 / self.eta)

    @function
    def _normal(self, wo: Any, wi: Any, eta: Any) -> Any:
        """Normal of the facet that sends wo to wi, reflected or refracted (Walter2007, eq. 13, 16), m.z >= 0."""
        ratio = where(wo.z * wi.z > 0.0, 1.0, eta)
        h = fma(wi, ratio, wo)
        h = h * rsqrt(maximum(dot(h, h), frame.TINY))
        return where(h.z < 0.0, -h, h)

    def _facet(self, wo: Any, wi: Any, eta: Any) -> _Facet:
        """The facet that joins a pair of directions, along the axes of the anisotropy; turned last, see `Conductor`."""
        m = self._normal(wo, wi, eta)
        wo, wi, m = (frame.rotate(w, self.rotation) for w in (wo, wi, m))
        alpha, smooth = self._widths()
        dot_o, dot_i = dot(wo, m), dot(wi, m)
        reflects = wo.z * wi.z > 0.0
        spread = 0.25 + 0.0 * dot_o
        if self.transmission:
            # by Snell's law |o.m + eta i.m| is |1 - eta^2| over the sum, which keeps its digits where eta is near 1
            thinned = sqr((abs(dot_o) + eta * abs(dot_i)) / ((eta - 1.0) * (eta + 1.0)))
            spread = where(reflects, spread, abs(dot_i * dot_o) * thinned)
        # a facet seen from its back, or one that would refract into the wrong side, is never sampled
        lit = (dot_o * wo.z > 0.0) & (dot_i * wi.z > 0.0) & ~smooth
        if not self.transmission:
            lit = lit & reflects
        return _Facet(wo, wi, m, dot_o, dot_i, reflects, lit, alpha, spread)

    def _reflectance_at(self, facet: _Facet, eta: Any) -> Any:
        """F of the facet."""
        cos_o = abs(facet.dot_o)
        # the far direction of a refraction is known: Snell's root would lose its cosine near the critical angle
        cos_t = where(facet.reflects, fresnel.cos_transmitted(cos_o, eta), abs(facet.dot_i))
        return self.reflectance(cos_o, cos_t, eta)

    def _masking(self, facet: _Facet) -> Any:
        """G of the facet."""
        pair = self.masking, distribution(self.ndf), facet.wo, facet.wi, facet.m, facet.alpha
        g = masking.masking_shadowing(*pair)
        if self.transmission:
            g = where(facet.reflects, g, masking.masking_shadowing(*pair, transmits=True))
        return g

    def _value(self, facet: _Facet) -> Any:
        """Radiance's eval without albedo and F."""
        facets = safe_div(distribution(self.ndf).D(facet.m, facet.alpha) * self._masking(facet), abs(facet.wo.z))
        return where(facet.lit, facets * facet.spread, 0.0)

    def _density(self, facet: _Facet, eta: Any) -> Any:
        """The pdf without the probability of the lobe: density of the normal times dm/dwi."""
        density = microfacet.pdf_per_cosine(self, facet.wo, facet.m, facet.alpha)
        return where(facet.lit, density * facet.spread * self._squeeze(facet.reflects, eta), 0.0)

    def _squeeze(self, reflects: Any, eta: Any) -> Any:
        """eta^2 for refraction: by how much solid angle shrinks on its way in, and radiance grows."""
        return where(reflects, 1.0, sqr(eta))

    def _share(self, f: Any) -> Any:
        """Probability of choosing reflection."""
        return f if self.transmission else 1.0 + 0.0 * f

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        """The sum of both lobes times |cos theta_i|; 0 where alpha makes them deltas."""
        eta = self._relative_eta(wo)
        facet = self._facet(wo, wi, eta)
        f = self._reflectance_at(facet, eta)
        value = self._value(facet) * where(facet.reflects, f, 1.0 - f)
        # the eta^2 of the Jacobian cancels for radiance
        return self.albedo * (value * self._squeeze(facet.reflects, eta) if mode == "importance" else value)

    def pdf(self, wo: Any, wi: Any) -> Any:
        """Probability of the lobe, times the density of the normal, times dm/dwi."""
        eta = self._relative_eta(wo)
        facet = self._facet(wo, wi, eta)
        share = self._share(self._reflectance_at(facet, eta))
        return self._density(facet, eta) * where(facet.reflects, share, 1.0 - share)

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Sample:
        """A normal first, then u1 chooses reflection with probability F; a direction on the wrong side is a failure."""
        turned = frame.rotate(wo, self.rotation)
        alpha, smooth = self._widths()
        eta = self._relative_eta(wo)
        m = where(smooth, frame.upright(wo), microfacet.sample_normal(self, turned, u.y, u.z, alpha))
        facing = where(wo.z < 0.0, -m, m)  # a facet faces the side of wo
        cos_o = abs(dot(turned, facing))
        cos_t = fresnel.cos_transmitted(cos_o, eta)
        f = self.reflectance(cos_o, cos_t, eta)
        share = self._share(f)
        reflects = u.x < share
        wi = where(reflects, frame.reflect(turned, facing), frame.refract(turned, facing, cos_t, eta))
        wi = frame.rotate_back(wi, self.rotation)
        sides = wo.z * wi.z
        right_side = where(reflects, sides > 0.0, sides < 0.0)
        # m anew from the rounded wi: the weight is eval / pdf to the last digits, however narrow the lobe
        facet = self._facet(wo, wi, eta)
        squeeze = self._squeeze(reflects, eta)
        value = where(smooth, 1.0 / squeeze, self._value(facet))
        density = where(smooth, 1.0, self._density(facet, eta))
        if mode == "importance":
            value = value * squeeze
        chance = where(reflects, share, 1.0 - share)
        pdf = where(right_side, chance * density, 0.0)
        weight = safe_div(value, density)
        if not self.transmission:  # else F cancels against the probability of the lobe
            weight = weight * self._reflectance_at(facet, eta)
        weight = self.albedo * where(pdf > 0.0, weight, 0.0)
        return Sample(wi, weight, pdf, smooth & right_side, where(reflects, 1.0, eta))

    def terms(self, wo: Any, wi: Any) -> microfacet.Terms:
        """D, G and F of the pair, at the normal that reflects or refracts wo into wi."""
        eta = self._relative_eta(wo)
        facet = self._facet(wo, wi, eta)
        f = self.albedo * self._reflectance_at(facet, eta)
        return microfacet.Terms(distribution(self.ndf).D(facet.m, facet.alpha), self._masking(facet), f)

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
