"""Right formulas, wrong arithmetic: cancellation, overflow, division by zero; and widths near their limit."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.optics import frame, warp


class _Metal(go.BSDF):
    """Right: GGX metal with Schlick's reflectance; a mirror below alpha = 1e-3."""

    f0: go.Colour = go.spectrum((0.9, 0.7, 0.4), "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Number = go.number(0.2, "width of the facets' distribution", low=0.0, high=1.0)

    @property
    def delta(self):
        return "maybe"

    def width(self):
        return ops.maximum(self.alpha, 1e-3)

    def smooth(self):
        return self.alpha < 1e-3

    def F(self, cos):
        return self.f0 + (1.0 - self.f0) * ops.pow(1.0 - cos, 5.0)

    def D(self, m):
        a2 = ops.sqr(self.width())
        return a2 * ops.inv_pi / ops.sqr(frame.sin2(m) + a2 * ops.sqr(m.z))

    def g1_over_cos(self, w):
        return 2.0 / (w.z + ops.sqrt(ops.sqr(w.z) + ops.sqr(self.width()) * frame.sin2(w)))

    def lit(self, wo, wi):
        return (wo.z > 0.0) & (wi.z > 0.0) & ~self.smooth()

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        value = 0.25 * self.D(m) * self.g1_over_cos(wo) * self.g1_over_cos(wi) * wi.z
        return self.F(ops.dot(wo, m)) * ops.where(self.lit(wo, wi), value, 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        density = self.D(m) * m.z / ops.maximum(4.0 * ops.dot(wo, m), 1e-9)
        return ops.where(self.lit(wo, wi), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        slope = self.width() * ops.sqrt(u.y / (1.0 - u.y))
        m = ops.normalize(ops.vec3(slope * c, slope * s, 1.0 + 0.0 * slope))
        mirror = self.smooth() & (wo.z > 0.0)
        wi = ops.where(mirror, frame.mirror(wo), frame.reflect(wo, m))
        density = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, density)
        weight = ops.where(mirror, self.F(ops.abs(wo.z)), weight)
        return go.Sample(wi, weight, ops.where(mirror, 1.0, density), mirror, 1.0 + 0.0 * density)


class MetalMirrorTwice(_Metal):
    fault: ClassVar[str] = (
        "Below the width limit 1e-3 samples are those of a mirror, but eval and pdf still return the lobe of the clamped width, so the light is counted twice: once as delta, once as density."
    )
    cause: ClassVar[str] = "smooth limit missing in eval and pdf"

    def lit(self, wo, wi):
        return (wo.z > 0.0) & (wi.z > 0.0)


class MetalClassicD(go.BSDF):
    fault: ClassVar[str] = (
        "GGX in the form cos^2 (alpha^2 - 1) + 1: in 32 bits it cancels for small alpha; near the lower limit 2e-4 it is 0 at the mirror direction and the value infinite or wrong by tens of percent, in 64 bits it is right."
    )
    cause: ClassVar[str] = "cancellation in GGX's denominator, float32"

    f0: go.Colour = go.spectrum((0.9, 0.7, 0.4), "reflectance of a facet", low=0.0, high=1.0)
    alpha: go.Number = go.number(0.2, "width of the facets' distribution", low=2e-4, high=1.0)

    def D(self, m):
        a2 = ops.sqr(self.alpha)
        return a2 * ops.inv_pi / ops.sqr(ops.sqr(m.z) * (a2 - 1.0) + 1.0)

    def g1_over_cos(self, w):
        return 2.0 / (w.z + ops.sqrt(ops.sqr(w.z) + ops.sqr(self.alpha) * frame.sin2(w)))

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        value = 0.25 * self.D(m) * self.g1_over_cos(wo) * self.g1_over_cos(wi) * wi.z
        return self.f0 * ops.where((wo.z > 0.0) & (wi.z > 0.0), value, 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        density = self.D(m) * m.z / ops.maximum(4.0 * ops.dot(wo, m), 1e-9)
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        slope = self.alpha * ops.sqrt(u.y / (1.0 - u.y))
        wi = frame.reflect(wo, ops.normalize(ops.vec3(slope * c, slope * s, 1.0 + 0.0 * slope)))
        pdf = self.pdf(wo, wi)
        return go.Sample.of_density(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf)


class GrazingMicrofacetQuotient(go.BSDF):
    fault: ClassVar[str] = (
        "D G / (4 cos_o) with G by tan^2 and no guard, tested with >= 0: for a viewer exactly in the surface G is 0 and the value 0/0, NaN instead of a finite number or 0; elsewhere it is right."
    )
    cause: ClassVar[str] = "division by cos theta_o = 0"

    F: go.Colour = go.spectrum((0.8, 0.6, 0.5), "reflectance of a facet", low=0.0, high=1.0)
    p: go.Number = go.number(40.0, "exponent of Blinn's distribution", low=2.0, high=1000.0)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        d = (self.p + 2.0) * (0.5 * ops.inv_pi) * ops.pow(m.z, self.p)
        o_m = ops.maximum(ops.dot(wo, m), 1e-6)
        g = ops.minimum(1.0, ops.minimum(2.0 * m.z * wo.z / o_m, 2.0 * m.z * wi.z / o_m))  # V-grooves
        value = d * g / (4.0 * wo.z)
        return self.F * ops.where((wo.z >= 0.0) & (wi.z >= 0.0), value, 0.0)


class _Reflex(go.BSDF):
    """Right: a retro-reflecting lobe, von Mises and Fisher's about the viewer: f = k c exp(kappa (o.i - 1))."""

    k: go.Colour = go.spectrum((0.8, 0.8, 0.3), "share of light in the lobe at normal incidence", low=0.0, high=1.0)
    kappa: go.Number = go.number(30.0, "concentration of the lobe", low=1.0, high=1000.0)

    def lobe(self, cos):
        return self.kappa * (0.5 * ops.inv_pi) / (1.0 - ops.exp(-2.0 * self.kappa)) * ops.exp(self.kappa * (cos - 1.0))

    def eval(self, wo, wi, mode="radiance"):
        value = self.lobe(ops.dot(wo, wi)) * wi.z
        return self.k * ops.where((wo.z > 0.0) & (wi.z > 0.0), value, 0.0)

    def pdf(self, wo, wi):
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), self.lobe(ops.dot(wo, wi)), 0.0)

    def sample(self, wo, u, mode="radiance"):
        rest = ops.exp(-2.0 * self.kappa)
        cos = 1.0 + ops.log((1.0 - u.y) + u.y * rest) / self.kappa
        sin = ops.safe_sqrt((1.0 - cos) * (1.0 + cos))
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        wi = warp.to_frame(wo, ops.vec3(sin * c, sin * s, cos))
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample.of_density(wi, weight, pdf)


class ReflexOverflow(_Reflex):
    fault: ClassVar[str] = (
        "The lobe is kappa exp(kappa cos) / (4 pi sinh kappa) as written in textbooks: in 32 bits numerator and denominator overflow above kappa = 89, and value and pdf are inf/inf, NaN, next to the viewer, and 0 elsewhere."
    )
    cause: ClassVar[str] = "exp overflows for large kappa"

    def lobe(self, cos):
        sinh = 0.5 * (ops.exp(self.kappa) - ops.exp(-self.kappa))
        return self.kappa * (0.25 * ops.inv_pi) * ops.exp(self.kappa * cos) / sinh


class _RoughMatte(go.BSDF):
    """Right: Oren and Nayar's qualitative model."""

    kd: go.Colour = go.spectrum((0.7, 0.5, 0.3), "albedo of a facet", low=0.0, high=0.95)
    sigma: go.Number = go.number(0.4, "standard deviation of slope angles", low=0.0, high=1.0)

    def cos_phi(self, wo, wi):
        across = wo.x * wi.x + wo.y * wi.y
        return across * ops.rsqrt(ops.maximum(frame.sin2(wo) * frame.sin2(wi), 1e-20))

    def eval(self, wo, wi, mode="radiance"):
        s2 = ops.sqr(self.sigma)
        a = 1.0 - 0.5 * s2 / (s2 + 0.33)
        b = 0.45 * s2 / (s2 + 0.09)
        both = ops.safe_sqrt(frame.sin2(wo)) * ops.safe_sqrt(frame.sin2(wi))
        steep = both / ops.maximum(ops.maximum(wo.z, wi.z), 1e-6)
        f = self.kd * ((a + b * ops.maximum(self.cos_phi(wo, wi), 0.0) * steep) * ops.inv_pi)
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), f * wi.z, 0.0)

    def pdf(self, wo, wi):
        return ops.where(wo.z > 0.0, warp.square_to_cosine_hemisphere_pdf(wi), 0.0)

    def draw(self, u1, u2):
        return warp.square_to_cosine_hemisphere(u1, u2)

    def sample(self, wo, u, mode="radiance"):
        wi = self.draw(u.y, u.z)
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample.of_density(wi, weight, pdf)


class RoughMatteNoAzimuth(_RoughMatte):
    fault: ClassVar[str] = (
        "The cosine of the azimuths' difference divides by both sines: for a viewer or light along the normal it is 0/0, and the value is NaN."
    )
    cause: ClassVar[str] = "0/0 azimuth at normal incidence"

    def cos_phi(self, wo, wi):
        across = wo.x * wi.x + wo.y * wi.y
        return across / ops.sqrt(frame.sin2(wo) * frame.sin2(wi))

    def eval(self, wo, wi, mode="radiance"):
        s2 = ops.sqr(self.sigma)
        a = 1.0 - 0.5 * s2 / (s2 + 0.33)
        b = 0.45 * s2 / (s2 + 0.09)
        both = ops.sqrt(frame.sin2(wo)) * ops.sqrt(frame.sin2(wi))
        steep = both / ops.maximum(ops.maximum(wo.z, wi.z), 1e-6)
        cos_phi = self.cos_phi(wo, wi)
        f = self.kd * ((a + b * ops.where(cos_phi < 0.0, 0.0, cos_phi) * steep) * ops.inv_pi)
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), f * wi.z, 0.0)


class _BlinnMetal(go.BSDF):
    """Right: Blinn's distribution, V-grooves and Schlick's reflectance."""

    f0: go.Colour = go.spectrum((0.6, 0.5, 0.3), "reflectance at normal incidence", low=0.0, high=1.0)
    p: go.Number = go.number(20.0, "exponent of the distribution", low=2.0, high=1000.0)

    def fifth(self, x):
        return ops.pow(x, 5.0)

    def eval(self, wo, wi, mode="radiance"):
        h = wo + wi
        m = h / ops.sqrt(ops.maximum(ops.dot(h, h), 1e-30))
        o_m = ops.dot(wo, m)
        d = (self.p + 2.0) * (0.5 * ops.inv_pi) * ops.pow(m.z, self.p)
        shortest = ops.minimum(wo.z, wi.z)
        # min(1, 2 m.z o.z / o.m, 2 m.z i.z / o.m) / o.z
        over = ops.minimum(
            1.0 / ops.maximum(wo.z, 1e-6), 2.0 * m.z * shortest / (ops.maximum(wo.z, 1e-6) * ops.maximum(o_m, 1e-6))
        )
        reflectance = self.f0 + (1.0 - self.f0) * self.fifth(1.0 - o_m)
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), reflectance * (0.25 * d * over), 0.0)


class BlinnSchlickOfNegative(_BlinnMetal):
    fault: ClassVar[str] = (
        "Schlick's (1 - cos)^5 is written exp(5 log(1 - cos)); with the light at the viewer (wi = wo) the cosine of a 32-bit vector to itself may round above 1, and the logarithm of a negative number is NaN: for some directions, in 32 bits only."
    )
    cause: ClassVar[str] = "power of negative rounding error"

    def fifth(self, x):
        return ops.exp(5.0 * ops.log(x))


MUTANTS = [
    MetalMirrorTwice,
    MetalClassicD,
    GrazingMicrofacetQuotient,
    ReflexOverflow,
    RoughMatteNoAzimuth,
    BlinnSchlickOfNegative,
]
