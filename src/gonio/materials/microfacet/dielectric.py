"""The Torrance-Sparrow dielectric with transmission."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...material.bsdf import Delta, InnerAlbedo, Interior, Preset
from ...material.calling import method
from ...material.parameters import Angle, Colour, Index, Member, Number, Width, flag, index, number, spectrum
from ...material.polarization import Polarized
from ...material.sample import Sample
from ...ops import abs, backend, dot, fma, function, maximum, ones_like, rsqrt, safe_div, sqr, where, zeros_like
from ...ops.types import Direction, Mask, Mode, Pair, Scalar, Spectrum
from ...optics import frame, fresnel, indices, masking
from ...optics.fresnel.polarization import Diattenuation, reflected_by_glass, refracted
from ...optics.ndf import distribution
from ...optics.roughness import widths
from . import microfacet
from .microfacet import Terms


class _Facet(NamedTuple):
    """The facet that reflects or refracts one direction of a pair into the other.

    wo, wi        the pair, in the frame of the anisotropy
    m             normal of the facet, m.z >= 0
    dot_o, dot_i  o.m and i.m
    reflects      whether wi lies on wo's side
    lit           whether a rough lobe can be nonzero for the pair
    alpha         widths along x and y
    spread        |o.m| dm/dwi (Walter2007, eq. 14); for refraction (eq. 17), divided by eta^2
    """

    wo: Direction
    wi: Direction
    m: Direction
    dot_o: Scalar
    dot_i: Scalar
    reflects: Mask
    lit: Mask
    alpha: Pair
    spread: Scalar


class Dielectric(microfacet._Microfacet):
    """Rough glass: microfacet reflection, F D G / (4 (n.o)(n.i)), and refraction (Walter2007, eq. 21).

    Let eta = eta_i / eta_o be the ratio of the indices on the sides of wi and wo, and let m be the facet normal, which
    is parallel to +-(wo + eta wi). The refracted lobe is f_t = albedo |o.m| |i.m| (1 - F) D
    G / (|o.n| |i.n| (o.m + eta i.m)^2). This is the form for radiance, which includes the factor 1 / eta^2 for the
    change of radiance on refraction; in the mode "importance", this factor is omitted. If alpha is below 1e-4, the
    glass is smooth; if eta = 1, there is no surface. With `transmission=False`, light is only reflected. Gonio's
    integrators apply absorption inside the glass (`absorption`, by the Beer-Lambert law exp(-absorption length)) and
    choose among overlapping media (`priority`, Schmidt2002); the values of the BSDF do not depend on these parameters.
    """

    eta: Index = index(
        default=1.5, doc="refractive index inside divided by that outside, or a substance's name", low=0.2, high=5.0
    )
    alpha: Width = microfacet.alpha_width()
    rotation: Angle = microfacet.rotation_angle()
    ndf: Member = microfacet.ndf_choice()
    masking: Member = microfacet.masking_choice()
    fresnel: Member = microfacet.fresnel_choice()
    albedo: Colour = microfacet.albedo_factor("scale factor for all reflected and transmitted light")
    transmission: bool = flag(default=True, doc="whether refracted light is transmitted; otherwise it is lost")
    sampling: str = microfacet.sampling_choice()
    absorption: Colour = spectrum(
        default=0.0, doc="absorption coefficient of the medium inside", low=0.0, unit="1/length", inside=True
    )
    priority: Number = number(
        default=0.0,
        doc="priority of the medium; where media overlap, the one with the highest priority applies",
        low=-1e6,
        high=1e6,
        inside=True,
    )

    preset_kind: ClassVar[str] = "medium"

    @classmethod
    def presets(cls) -> Mapping[str, Preset]:
        """Transparent media by name, with eta."""
        media = indices.media().items()
        return {name: Preset(m.title, {"eta": indices.DispersiveIndex(m)}, m.source) for name, m in media}

    @function
    def reflectance(self, cos_o: Scalar, cos_t: Scalar, eta: Scalar) -> Scalar:
        """F by the formula that `fresnel` selects, at the cosines of incidence, cos_o, and of transmission, cos_t (0
        for total reflection)."""
        return fresnel.kind(self.fresnel).dielectric(cos_o, cos_t, eta)

    @function
    def _relative_eta(self, wo: Direction) -> Scalar:
        """Index on the far side divided by the index on wo's side."""
        return where(wo.z >= 0.0, self.eta, 1.0 / self.eta)

    @function
    def _normal(self, wo: Direction, wi: Direction, eta: Scalar) -> Direction:
        """Normal of the facet that reflects or refracts wo into wi (Walter2007, eq. 13, 16), m.z >= 0."""
        ratio = where(wo.z * wi.z > 0.0, 1.0, eta)
        h = fma(wi, ratio, wo)
        h = h * rsqrt(maximum(dot(h, h), frame.TINY))
        return where(h.z < 0.0, -h, h)

    def _facet(self, wo: Direction, wi: Direction, eta: Scalar) -> _Facet:
        """The facet that reflects or refracts one direction into the other, in the frame of the anisotropy. The
        rotation is applied last, as in `_Reflector._facet`."""
        m = self._normal(wo, wi, eta)
        wo, wi, m = (frame.rotate(w, self.rotation) for w in (wo, wi, m))
        alpha, smooth = self._widths()
        dot_o, dot_i = dot(wo, m), dot(wi, m)
        reflects = wo.z * wi.z > 0.0
        spread = 0.25 + zeros_like(dot_o)
        if self.transmission:
            # by Snell's law |o.m + eta i.m| is |1 - eta^2| / (|o.m| + eta |i.m|), which is accurate near eta = 1
            thinned = sqr((abs(dot_o) + eta * abs(dot_i)) / ((eta - 1.0) * (eta + 1.0)))
            spread = where(reflects, spread, abs(dot_i * dot_o) * thinned)
        # a facet seen from behind, or one that would refract to the wrong side, is never sampled
        lit = (dot_o * wo.z > 0.0) & (dot_i * wi.z > 0.0) & ~smooth
        if not self.transmission:
            lit = lit & reflects
        return _Facet(wo, wi, m, dot_o, dot_i, reflects, lit, alpha, spread)

    def _reflectance_at(self, facet: _Facet, eta: Scalar) -> Scalar:
        """F of the facet."""
        cos_o = abs(facet.dot_o)
        # for refraction, the cosine of wi is used: the root in Snell's law is inaccurate near the critical angle
        cos_t = where(facet.reflects, fresnel.cos_transmitted(cos_o, eta), abs(facet.dot_i))
        return self.reflectance(cos_o, cos_t, eta)

    def _masking(self, facet: _Facet) -> Scalar:
        """G of the facet."""
        pair = self.masking, distribution(self.ndf), facet.wo, facet.wi, facet.m, facet.alpha
        g = masking.masking_shadowing(*pair)
        if self.transmission:
            g = where(facet.reflects, g, masking.masking_shadowing(*pair, transmits=True))
        return g

    def _value(self, facet: _Facet) -> Scalar:
        """`eval` for radiance, without the albedo and F."""
        d_g = distribution(self.ndf).D(facet.m, facet.alpha) * self._masking(facet)
        facets = safe_div(d_g, abs(facet.wo.z))
        return where(facet.lit, facets * facet.spread, 0.0)

    def _density(self, facet: _Facet, eta: Scalar) -> Scalar:
        """`pdf` without the probability of the lobe: the density of the normal times dm/dwi."""
        density = microfacet.pdf_per_cosine(self, facet.wo, facet.m, facet.alpha)
        return where(facet.lit, density * facet.spread * self._squeeze(facet.reflects, eta), 0.0)

    def _squeeze(self, reflects: Mask, eta: Scalar) -> Scalar:
        """eta^2 for refraction, 1 for reflection: the factor by which solid angle shrinks and radiance grows inside."""
        return where(reflects, 1.0, sqr(eta))

    def _share(self, f: Scalar) -> Scalar:
        """Probability of choosing reflection."""
        return f if self.transmission else ones_like(f)

    def _over_chance(self, facet: _Facet, eta: Scalar) -> Spectrum:
        """`albedo` times F or 1 - F of the chosen lobe, divided by the probability of that lobe, which cancels F."""
        return self.albedo if self.transmission else self.albedo * self._reflectance_at(facet, eta)

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """The sum of the two lobes times |cos theta_i|; 0 where they are delta lobes."""
        eta = self._relative_eta(wo)
        facet = self._facet(wo, wi, eta)
        f = self._reflectance_at(facet, eta)
        value = self._value(facet) * where(facet.reflects, f, 1.0 - f)
        # the eta^2 of the Jacobian cancels for radiance
        return self.albedo * (value * self._squeeze(facet.reflects, eta) if mode == "importance" else value)

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """Probability of the lobe, times the density of the normal, times dm/dwi."""
        eta = self._relative_eta(wo)
        facet = self._facet(wo, wi, eta)
        share = self._share(self._reflectance_at(facet, eta))
        return self._density(facet, eta) * where(facet.reflects, share, 1.0 - share)

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """A normal is sampled first, then u.x selects reflection with probability F. A direction on the wrong side is a
        failed sample."""
        wo_local = frame.rotate(wo, self.rotation)
        alpha, smooth = self._widths()
        eta = self._relative_eta(wo)
        m = where(smooth, frame.normal_like(wo), microfacet.sample_normal(self, wo_local, u.y, u.z, alpha))
        facing = where(wo.z < 0.0, -m, m)  # a facet faces the side of wo
        cos_o = abs(dot(wo_local, facing))
        cos_t = fresnel.cos_transmitted(cos_o, eta)
        f = self.reflectance(cos_o, cos_t, eta)
        share = self._share(f)
        reflects = u.x < share
        wi = where(reflects, frame.reflect(wo_local, facing), frame.refract(wo_local, facing, cos_t, eta))
        wi = frame.rotate_back(wi, self.rotation)
        sides = wo.z * wi.z
        right_side = where(reflects, sides > 0.0, sides < 0.0)
        # m is recomputed from the rounded wi: the weight is eval / pdf to the last digits, however narrow the lobe
        facet = self._facet(wo, wi, eta)
        squeeze = self._squeeze(reflects, eta)
        value = where(smooth, 1.0 / squeeze, self._value(facet))
        density = where(smooth, 1.0, self._density(facet, eta))
        if mode == "importance":
            value = value * squeeze
        chance = where(reflects, share, 1.0 - share)
        pdf = where(right_side, chance * density, 0.0)
        tinted = self._over_chance(facet, eta) * where(pdf > 0.0, safe_div(value, density), 0.0)
        return Sample(wi, tinted, pdf, smooth & right_side, where(reflects, 1.0, eta))

    def polarized(self, wo: Direction, wi: Direction, delta: Mask, mode: Mode = "radiance") -> tuple[Polarized, ...]:
        """All light, polarized according to the exact equations; the chosen Fresnel kind affects only its amount."""
        eta = self._relative_eta(wo)
        m = self._normal(wo, wi, eta)
        m = where(delta, frame.normal_like(wo), m)  # equal indices: no refraction, so m is undefined
        cos_o, cos_i = abs(dot(wo, m)), abs(dot(wi, m))
        reflects = wo.z * wi.z > 0.0
        f = self.reflectance(cos_o, where(reflects, fresnel.cos_transmitted(cos_o, eta), cos_i), eta)
        through = 1.0 - f if self.transmission else zeros_like(f)
        ideal = where(reflects, f, through if mode == "importance" else through / sqr(eta))
        value = where(delta, self.albedo * ideal, self.eval(wo, wi, mode))
        back, on = self._polarization(cos_o, cos_i, eta)
        both = [where(reflects, one, other) for one, other in zip(back, on, strict=True)]
        return (Polarized(value, m, Diattenuation(*both)),)

    def _polarization(
        self, cos_o: Scalar, cos_i: Scalar, eta: Scalar
    ) -> tuple[Diattenuation[Scalar], Diattenuation[Scalar]]:
        """Polarization of the light that a facet reflects, and of the light that it transmits."""
        return reflected_by_glass(cos_o, eta), refracted(cos_o, cos_i, eta)

    @method
    def terms(self, wo: Direction, wi: Direction) -> Terms:
        """D, G and F of the pair, at the normal that reflects or refracts wo into wi."""
        eta = self._relative_eta(wo)
        facet = self._facet(wo, wi, eta)
        f = self.albedo * self._reflectance_at(facet, eta)
        return Terms(distribution(self.ndf).D(facet.m, facet.alpha), self._masking(facet), f)

    def _widths(self) -> tuple[Pair, Mask]:
        """The widths, and whether the surface is smooth. It is also smooth for equal indices, because light then passes
        straight through."""
        alpha, smooth = widths(self.alpha)
        if self.transmission:
            smooth = smooth | (abs(self.eta - 1.0) < MATCHED)
        return alpha, smooth

    @property
    def transmits(self) -> bool:
        return self.transmission

    @property
    def delta(self) -> Delta:
        eta = self.plain.eta
        if backend.is_drjit(eta):
            return "maybe"
        if self.transmission:
            matched = np.abs(np.asarray(eta, dtype=float) - 1.0) < MATCHED
            if np.all(matched):
                return "always"
            if np.any(matched):
                return "maybe"
        return microfacet.delta_of(self.plain.alpha)

    def _index(self) -> Scalar:
        return self.eta

    @property
    def interior(self) -> Interior | None:
        return Interior(self.eta, self.absorption, self.priority) if self.transmission else None

    def normal_reflectance(self) -> Spectrum:
        """F at normal incidence, times the albedo."""
        one = ones_like(self.eta)
        return self.reflectance(one, one, self.eta) * self.albedo

    def mean_reflectance(self, average: str = "exact") -> Scalar:
        """F_avg for light from the side with the lower index."""
        return fresnel.kind(self.fresnel).dielectric_average(self.eta)

    def known_albedo(
        self, mu: NDArray[np.float64], phi: NDArray[np.float64], inner: InnerAlbedo, nodes: int | None
    ) -> NDArray[np.float64] | None:
        """The albedo of smooth glass: `albedo`, because no other light is lost, or `albedo` times F without
        transmission; None for rough glass."""
        if self.delta != "always":
            return None
        albedo = np.broadcast_to(np.asarray(self.albedo, float), (len(mu), 3))
        if self.transmission:
            return np.array(albedo)
        types = backend.types("float64")
        bound, cos = self.bind(types), types.float(np.abs(mu))
        eta = where(types.float(mu) >= 0.0, bound.eta, 1.0 / bound.eta)
        f = bound.reflectance(cos, fresnel.cos_transmitted(cos, eta), eta)
        return albedo * backend.to_numpy(f, len(mu))[:, None]


# Refraction deflects light by about (eta - 1) tan theta. Below this difference of indices, the deflection is lost in
# the rounding error of a float32 direction (6e-8), so the normal that joins two directions cannot be determined.
MATCHED = 1e-6
