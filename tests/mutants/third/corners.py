"""Third examiner: right at the defaults or nearly everywhere; wrong in a corner, an edge or a band. One mistake each."""

from __future__ import annotations

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.materials.microfacet.dielectric import Dielectric
from gonio.optics import frame, warp
from gonio.optics.ndf import distribution

GGX = distribution("ggx")


class _Metal(go.BSDF):
    """GGX with Schlick's Fresnel, visible normals. Sound as it stands."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""

    r0: go.Colour = go.spectrum((0.9, 0.7, 0.4), "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.3, "width; two for anisotropy", low=0.002, high=1.0)

    def widths(self):
        return self.alpha

    def D(self, m):
        return GGX.D(m, self.widths())

    def fresnel(self, cos):
        return self.r0 + (1.0 - self.r0) * ops.pow(1.0 - cos, 5.0)

    def eval(self, wo, wi, mode="radiance"):
        m, a = frame.half_vector(wo, wi), self.widths()
        g = 1.0 / (1.0 + GGX.Lambda(wo, a) + GGX.Lambda(wi, a))
        value = ops.safe_div(self.D(m) * g, 4.0 * ops.abs(wo.z))
        return self.fresnel(ops.abs(ops.dot(wo, m))) * ops.where((wo.z > 0.0) & (wi.z > 0.0), value, 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        density = 0.25 * ops.safe_div(self.D(m), GGX.projected_area(wo, self.widths()))
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), density, 0.0)

    def normal(self, wo, u):
        upper = ops.where(wo.z < 0.0, -wo, wo)
        return GGX.sample_visible(upper, u.y, u.z, self.widths())

    def sample(self, wo, u, mode="radiance"):
        wi = frame.reflect(wo, self.normal(wo, u))
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class CosineOnly(_Metal):
    fault = "D of GGX is written with cos^2 (alpha^2 - 1) + 1: in float32 the peak of a narrow lobe is lost in rounding"
    cause = "float32 cancellation near the normal at small alpha"

    alpha: go.Number = go.number(0.3, "width", low=0.001, high=1.0)

    def widths(self):
        return ops.vec2(self.alpha, self.alpha)

    def D(self, m):
        a2 = ops.sqr(self.alpha)
        d = ops.sqr(m.z) * (a2 - 1.0) + 1.0
        return ops.where(m.z > 0.0, a2 * ops.inv_pi / ops.maximum(d * d, 1e-20), 0.0)


class AspectOfAnotherBook(_Metal):
    fault = "eval and pdf make the two widths by sqrt(1 - 0.9 anisotropic), sample by sqrt(1 - anisotropic)"
    cause = "sample and pdf disagree on the widths once anisotropic is not 0"

    alpha: go.Number = go.number(0.3, "width", low=0.02, high=0.6)
    anisotropic: go.Number = go.number(0.0, "0 round, towards 1 stretched along x", low=0.0, high=0.9)

    def stretched(self, share):
        aspect = ops.sqrt(1.0 - share * self.anisotropic)
        return ops.vec2(self.alpha / aspect, self.alpha * aspect)

    def widths(self):
        return self.stretched(0.9)

    def normal(self, wo, u):
        upper = ops.where(wo.z < 0.0, -wo, wo)
        return GGX.sample_visible(upper, u.y, u.z, self.stretched(1.0))

    @property
    def isotropic(self):
        import numpy as np

        return bool(np.all(np.asarray(self.plain.anisotropic) == 0.0))


class NoTangentAtTheNormal(_Metal):
    fault = "the tangent of the view is normalized without a guard: seen exactly along the normal every sampled direction is NaN and is lost"
    cause = "0/0 in sample's frame at normal incidence"

    alpha: go.Number = go.number(0.3, "width", low=0.05, high=1.0)

    def widths(self):
        return ops.vec2(self.alpha, self.alpha)

    def normal(self, wo, u):
        """Heitz 2018: visible normals by a projected disk."""
        up = ops.where(wo.z < 0.0, -wo, wo)
        v = ops.normalize(ops.vec3(self.alpha * up.x, self.alpha * up.y, up.z))
        length = ops.sqrt(v.x * v.x + v.y * v.y)
        t1 = ops.vec3(-v.y / length, v.x / length, 0.0 * v.x)
        t2 = ops.vec3(-v.z * t1.y, v.z * t1.x, v.x * t1.y - v.y * t1.x)  # v x t1
        r = ops.sqrt(u.y)
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        p1, lean = r * c, 0.5 * (1.0 + v.z)
        p2 = (1.0 - lean) * ops.safe_sqrt(1.0 - p1 * p1) + lean * r * s
        n = t1 * p1 + t2 * p2 + v * ops.safe_sqrt(1.0 - p1 * p1 - p2 * p2)
        return ops.normalize(ops.vec3(self.alpha * n.x, self.alpha * n.y, ops.maximum(n.z, 1e-6)))


class LogOfZero(go.BSDF):
    fault = "the logarithm is taken of u, which may be 0, instead of 1 - u: that sample is NaN"
    cause = "log(0) in sample at u = 0"

    ks: go.Colour = go.spectrum(0.8, "share of the highlight", low=0.0, high=1.0)
    alpha: go.Number = go.number(0.25, "width of the Gaussian of slopes", low=0.05, high=0.6)

    def D(self, m):
        z2 = ops.maximum(ops.sqr(m.z), 1e-3)
        a2 = ops.sqr(self.alpha)
        return ops.exp(-frame.sin2(m) / (z2 * a2)) / (ops.pi * a2 * z2 * z2)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        o_m = ops.dot(wo, m)
        g = ops.minimum(1.0, 2.0 * m.z * ops.safe_div(ops.minimum(wo.z, wi.z), o_m))
        value = ops.safe_div(self.D(m) * g, 4.0 * wo.z)
        return self.ks * ops.where((wo.z > 0.0) & (wi.z > 0.0), value, 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        density = ops.safe_div(self.D(m) * m.z, 4.0 * ops.dot(wo, m))
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        tan = ops.sqrt(-ops.log(u.y)) * self.alpha
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        cos = ops.rsqrt(1.0 + tan * tan)
        m = ops.vec3(tan * c * cos, tan * s * cos, cos)
        wi = frame.reflect(wo, m)
        o_m = ops.dot(wo, m)
        failed = (wo.z <= 0.0) | (wi.z <= 0.0) | (o_m <= 0.0)
        g = ops.minimum(1.0, 2.0 * m.z * ops.minimum(wo.z, wi.z) / o_m)
        # eval / pdf, D cancels
        weight = self.ks * ops.where(failed, 0.0, g * o_m / (wo.z * m.z))
        pdf = ops.where(failed, 0.0, self.D(m) * m.z / (4.0 * o_m))
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class HalfAMirror(_Metal):
    fault = (
        "below alpha = 0.01 sample makes the surface a mirror, eval and pdf keep the narrow lobe: it is counted twice"
    )
    cause = "the smooth limit is taken in sample only: eval is not 0 beside the delta lobe"

    alpha: go.Number = go.number(0.2, "width", low=0.002, high=1.0)

    def widths(self):
        return ops.vec2(self.alpha, self.alpha)

    def sample(self, wo, u, mode="radiance"):
        smooth = (self.alpha < 0.01) & (wo.z > 0.0)
        s = super().sample(wo, u, mode)
        wi = ops.where(smooth, frame.mirror(wo), s.wi)
        weight = ops.where(smooth, self.fresnel(ops.abs(wo.z)), s.weight)
        return go.Sample(wi, weight, ops.where(smooth, 1.0, s.pdf), smooth, s.eta)

    @property
    def delta(self):
        import numpy as np

        small = np.asarray(self.plain.alpha, float) < 0.01
        return "always" if np.all(small) else "maybe" if np.any(small) else "never"


class LowExponent(go.BSDF):
    fault = "half vectors are sampled by cos^p, their density is that of cos^(p+1): the same for sharp lobes, not for dull ones"
    cause = "exponent off by one between sample and pdf, seen at small p"

    ks: go.Colour = go.spectrum(0.9, "share of the highlight", low=0.0, high=1.0)
    p: go.Number = go.number(1000.0, "exponent", low=1.0, high=5000.0)

    def lobe(self, m):
        """(p + 2) / (2 pi) cos^p"""
        return (self.p + 2.0) * (0.5 * ops.inv_pi) * ops.pow(m.z, self.p)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        g = ops.minimum(1.0, 2.0 * m.z * ops.safe_div(ops.minimum(wo.z, wi.z), ops.dot(wo, m)))
        value = ops.safe_div(self.lobe(m) * g, 4.0 * wo.z)
        return self.ks * ops.where((wo.z > 0.0) & (wi.z > 0.0), value, 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        density = ops.safe_div(self.lobe(m) * m.z, 4.0 * ops.dot(wo, m))
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        wi = frame.reflect(wo, warp.square_to_power_lobe(u.y, u.z, self.p))
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class NeverBelowOne(Dielectric):
    fault = (
        "seen from outside an index below 1 is held at 1.001, seen from inside it is not: bubbles refract one way only"
    )
    cause = "eta is clamped on one side: eta < 1 is not reciprocal"

    alpha: go.Width = go.width(0.3, "width", low=0.05, high=1.0)

    def _relative_eta(self, wo):
        return ops.where(wo.z >= 0.0, ops.maximum(self.eta, 1.001), 1.0 / self.eta)


class FlooredCosine(_Metal):
    fault = "the cosine of wo is held above 0.1 in the denominator, against division by zero: too dark at grazing, from one side"
    cause = "floor on one cosine: f is not reciprocal near the horizon"

    def eval(self, wo, wi, mode="radiance"):
        m, a = frame.half_vector(wo, wi), self.widths()
        g = 1.0 / (1.0 + GGX.Lambda(wo, a) + GGX.Lambda(wi, a))
        value = self.D(m) * g / (4.0 * ops.maximum(wo.z, 0.1))
        return self.fresnel(ops.abs(ops.dot(wo, m))) * ops.where((wo.z > 0.0) & (wi.z > 0.0), value, 0.0)


class UniformChoice(go.BSDF):
    fault = "with sampling=uniform directions are uniform over the hemisphere, and pdf is 1/pi instead of 1/(2 pi)"
    cause = "pdf of one choice of sampling: area of the hemisphere halved"

    kd: go.Colour = go.spectrum((0.7, 0.6, 0.5), "share that is reflected", low=0.0, high=1.0)
    sampling: str = go.choice("cosine", "how directions are drawn", {"cosine": "by the cosine", "uniform": "uniformly"})

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where((wo.z > 0.0) & (wi.z > 0.0), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        density = wi.z * ops.inv_pi if self.sampling == "cosine" else ops.inv_pi + 0.0 * wi.z
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        if self.sampling == "cosine":
            wi = warp.square_to_cosine_hemisphere(u.y, u.z)
        else:
            s, c = ops.sincos(2.0 * ops.pi * u.z)
            r = ops.safe_sqrt(1.0 - u.y * u.y)
            wi = ops.vec3(r * c, r * s, u.y)
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


MUTANTS = [
    CosineOnly, AspectOfAnotherBook, NoTangentAtTheNormal, LogOfZero, HalfAMirror, LowExponent, NeverBelowOne,
    FlooredCosine, UniformChoice,
]  # fmt: skip
SOUND = []
