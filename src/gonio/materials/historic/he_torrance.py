"""The model of He, Torrance, Sillion and Greenberg."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ... import ops
from ...material.bsdf import KnownViolation
from ...material.parameters import Colour, Member, Number, number, spectrum
from ...ops import (
    Direction,
    Pair,
    Scalar,
    Spectrum,
    clamp,
    erf,
    exp,
    function,
    inv_pi,
    log,
    max_component,
    maximum,
    mean,
    minimum,
    sqr,
    sqrt,
    vec2,
)
from ...optics import frame, fresnel
from ...optics.ndf import distribution
from ...optics.roughness import SMOOTH
from ...optics.special import exprel
from ..microfacet import microfacet
from .glossy import _Glossy, facet, sum_breach

TERMS = 64  # number of terms of the series; the term with m = g is the largest, so these suffice up to g = 40
ROUGH = 18.0  # if all g are larger, the limit of the series is used, blended over an interval of 1 (Westin's program)


class HeTorrance(_Glossy):
    """The directional-diffuse term of a wave-optics model of Gaussian rough surfaces (He1991, eq. 71, 76 and 78).

    f = diffuse / pi + specular F S G D / (pi (n.o)(n.i))

    D = (pi tau / 2 lambda)^2 sum_m g^m e^-g / (m m!) exp(-(pi tau v / lambda)^2 / m), where lambda is the wavelength, v
    is the length of the tangential component of o + i, and g = (2 pi s / lambda (n.o + n.i))^2. The roughness of the
    unshadowed part of the surface is s = sigma / sqrt(1 + w), where w e^w = x^2 and x is the sum of
    tan theta erfc(cot theta / width) / sqrt(8 pi) over the two directions, with width = 2 sigma / tau. G, the factor
    due to the polarization vectors, is 4 (o.h)^2 / (n.h)^2 for any pair of directions, because the vectors of eq. 76
    are orthonormal and the other factors cancel. S is Smith masking for Beckmann slopes of this width, multiplied for
    each direction by (1 + erf(cot theta / width)) / 2; it includes the exponential that is missing from eq. 25 as
    printed (Holzschuch2017).

    As in Ngan2005, F is computed for a real index and unpolarized light, and the coherent (mirror) term is omitted,
    because measured tables do not contain it. If g exceeds 18, D is the limit of the series,
    exp(-(tan h / width)^2) / (4 width^2 ((n.o) + (n.i))^2), where h is the angle between the half vector and n. The
    model is reciprocal. Lengths are in nm, but only their ratios matter. `sample` reflects wo about a visible normal of
    a GGX distribution that has the width of the lobe at its peak.

    The presets, named MATERIAL:PAPER/FIT, are published fits to materials in the MERL database.
    """

    specular: Colour = spectrum(default=1.0, doc="scale factor for the lobe", low=0.0)
    sigma: Number = number(default=180.0, doc="standard deviation of the heights", low=1.0, unit="nm")
    tau: Number = number(default=3000.0, doc="correlation length of the heights", low=100.0, unit="nm")
    eta: Number = number(default=1.5, doc="refractive index, relative to the outside", low=1.0)
    wavelength: Colour = spectrum(default=(645.0, 526.0, 444.0), doc="wavelength of each channel", low=100.0, unit="nm")
    fresnel: Member = microfacet.fresnel_choice()

    known_violations: ClassVar[Mapping[str, KnownViolation]] = {
        "energy": sum_breach("toward grazing angles, G D grows faster than S falls, and "),
    }

    def reflectance(self, cos_theta: Scalar) -> Scalar:
        """F at the cosine of incidence on a facet, by the formula that `fresnel` selects."""
        return fresnel.kind(self.fresnel).dielectric(cos_theta, fresnel.cos_transmitted(cos_theta, self.eta), self.eta)

    @function
    def _width(self) -> Scalar:
        """The width of the slope distribution, equivalent to Beckmann's alpha."""
        return 2.0 * self.sigma / self.tau

    @function
    def _focus(self) -> Scalar:
        """(r / (1 + r))^2, where r = 1 / (4 width^2) is the peak density of the rough lobe divided by that of the
        cosine."""
        return 1.0 / sqr(1.0 + 4.0 * sqr(self._width()))

    @function
    def _shadowing(self, v: Direction) -> Scalar:
        """S of one direction (He1991, eqs. 24 and 25, with the exponential)."""
        width = self._width()
        return distribution("beckmann").G1(v, vec2(width, width)) * (0.5 + 0.5 * erf(_cot(v) / width))

    @function
    def _shadowed(self, v: Direction) -> Scalar:
        """tan erfc(cot / width) / sqrt(8 pi): the contribution of v to x in the equation for s."""
        cot = _cot(v)
        return (1.0 - erf(cot / self._width())) / cot * (8.0 * ops.pi) ** -0.5

    @function
    def _roughness2(self, x: Scalar) -> Scalar:
        """s^2 = sigma^2 / (1 + w) with w e^w = x^2 (He1991, eqs. 80 to 82). An estimate of w within a few percent is
        refined to rounding error by Newton steps for w = x^2 e^-w."""
        x2 = sqr(x)
        log_x = log(1.0 + x2)
        w = log_x * (1.0 - log(1.0 + log_x) / (2.0 + log_x))
        for _ in range(4):
            e = x2 * exp(-w)
            w = w - (w - e) / (1.0 + e)
        return sqr(self.sigma) / (1.0 + w)

    @function
    def _series(self, g: Spectrum, spread: Spectrum) -> Spectrum:
        """sum_m g^m e^-g / (m m!) exp(-spread / m), and its limit exp(-spread / g) / g if g is large in all
        channels."""
        limit = exp(-spread / maximum(g, 1.0)) / maximum(g, 1.0)
        blend = clamp(-max_component(-g) - ROUGH, 0.0, 1.0)
        g = minimum(g, 60.0)  # above 60, only the limit is used; the powers would overflow float32
        term = g * exp(-g)
        total = term * exp(-spread)
        for m in range(2, TERMS + 1):
            term = term * (g * (1.0 / m))
            total = total + term * (1.0 / m) * exp(spread * (-1.0 / m))
        return total + (limit - total) * blend

    @function
    def _lobe(self, wo: Direction, wi: Direction) -> Spectrum:
        """specular F S G D / (pi cos theta_o)."""
        h, cos = facet(wo, wi)
        s2 = self._roughness2(self._shadowed(wo) + self._shadowed(wi))
        waves = 1.0 / self.wavelength  # per nm
        g = waves * waves * (sqr(2.0 * ops.pi * (wo.z + wi.z)) * s2)
        correlation = sqr(waves * (ops.pi * self.tau))
        spread = correlation * (sqr(wo.x + wi.x) + sqr(wo.y + wi.y))
        d = correlation * 0.25 * self._series(g, spread)
        geometry = sqr(2.0 * cos / h.z) * self._shadowing(wo) * self._shadowing(wi)
        return self.specular * d * (self.reflectance(cos) * geometry * inv_pi / wo.z)

    @function
    def _peak(self, wo: Direction) -> tuple[Pair, Scalar]:
        """The width of the lobe of half vectors at the mirror direction, and g there, for the mean wavelength.

        The terms near m = 1 + g dominate: exp(-(pi tau v / lambda)^2 / m), with v = 2 (n.o) tan h.
        """
        waves = 1.0 / mean(self.wavelength)
        g = sqr(4.0 * ops.pi * wo.z * waves) * self._roughness2(2.0 * self._shadowed(wo))
        width = sqrt(1.0 + g) / (2.0 * ops.pi * self.tau * waves * maximum(wo.z, 0.01))
        width = clamp(width, SMOOTH, 1.0)
        return vec2(width, width), g

    @function
    def _lobe_pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """Density of visible normals divided by 4 (o.h) (Walter2007, eq. 14)."""
        alpha, _ = self._peak(wo)
        h, _ = facet(wo, wi)
        return 0.25 * distribution("ggx").visible_per_cosine(wo, h, alpha)

    @function
    def _lobe_sample(self, wo: Direction, u: Direction) -> Direction:
        """wo mirrored about a visible normal."""
        alpha, _ = self._peak(wo)
        return frame.reflect(wo, distribution("ggx").sample_visible(wo, u.y, u.z, alpha))

    @function
    def _lobe_albedo(self, wo: Direction) -> Spectrum:
        """specular F (1 - e^-g), which excludes the mirror term."""
        _, g = self._peak(wo)
        return self.specular * (self.reflectance(wo.z) * g * exprel(-g))


@function
def _cot(v: Direction) -> Scalar:
    """cos / sin, both clamped so that powers of the quotient remain within float32."""
    return clamp(v.z, 1e-6, 1.0) / sqrt(maximum(frame.sin2(v), 1e-12))
