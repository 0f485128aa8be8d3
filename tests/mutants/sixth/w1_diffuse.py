"""Matte, retroreflecting and fitted materials, each with one mistake."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.ops import sqr
from gonio.optics import frame, warp


def above(wo, wi):
    return (wo.z > 0.0) & (wi.z > 0.0)


def drawn(material, wo, wi, mode):
    pdf = material.pdf(wo, wi)
    weight = material.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
    return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class W1OrenNegative(go.BSDF):
    """Oren and Nayar's rough matte surface, without interreflection."""

    fault: ClassVar[str] = "for oblique directions on opposite sides of the normal the value is negative"
    cause: ClassVar[str] = "the cosine of the difference of azimuths is not clamped at 0: max(0, cos) is missing"
    kd: go.Colour = go.spectrum(0.7, "albedo", low=0.0, high=1.0)
    sigma: go.Number = go.number(0.5, "standard deviation of the slope's angle, radians", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        s2 = sqr(self.sigma)
        A = 1.0 - 0.5 * s2 / (s2 + 0.33)
        B = 0.45 * s2 / (s2 + 0.09)
        across = wo.x * wi.x + wo.y * wi.y  # sin sin cos(phi)
        shape = across / ops.maximum(ops.maximum(wo.z, wi.z), 1e-6)
        return ops.where(above(wo, wi), self.kd * ((A + B * shape) * ops.inv_pi * wi.z), 0.0)


class W1FujiiSign(go.BSDF):
    """Fujii's improved Oren-Nayar model."""

    fault: ClassVar[str] = "a white surface reflects up to a fifth more than it receives"
    cause: ClassVar[str] = "the sign in A = 1 / (pi + (pi / 2 - 2 / 3) sigma) is wrong: minus instead of plus"
    kd: go.Colour = go.spectrum(0.6, "albedo", low=0.0, high=1.0)
    sigma: go.Number = go.number(0.35, "roughness", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        A = 1.0 / (ops.pi - (0.5 * ops.pi - 2.0 / 3.0) * self.sigma)
        s = wo.x * wi.x + wo.y * wi.y
        t = ops.where(s > 0.0, ops.maximum(ops.maximum(wo.z, wi.z), 1e-6), 1.0)
        return ops.where(above(wo, wi), self.kd * (A * (1.0 + self.sigma * s / t) * wi.z), 0.0)


class W1CouplingTwice(go.BSDF):
    """The matte base of a polished plastic, coupled by the light that its surface does not reflect, and the surface."""

    fault: ClassVar[str] = "a white base with its highlight reflects some percent more light than it receives"
    cause: ClassVar[str] = "the coupled base is divided by (1 - F_avg)^2 instead of by 1 - F_avg"
    kd: go.Colour = go.spectrum(0.5, "albedo of the base", low=0.0, high=1.0)
    r0: go.Number = go.number(0.05, "reflectance of the surface at normal incidence", low=0.0, high=0.3)
    alpha: go.Number = go.number(0.1, "width of the highlight", low=0.02, high=0.4)

    def F(self, cos):
        return self.r0 + (1.0 - self.r0) * ops.pow(1.0 - cos, 5.0)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        cos = ops.dot(wo, m)
        z2 = ops.maximum(sqr(m.z), 1e-3)
        D = ops.exp(-frame.sin2(m) / (z2 * sqr(self.alpha))) / (ops.pi * sqr(self.alpha) * sqr(z2))
        spec = self.F(cos) * D / (4.0 * ops.maximum(sqr(cos), 1e-9))
        left = 1.0 - (self.r0 + (1.0 - self.r0) / 21.0)
        base = self.kd * ((1.0 - self.F(wo.z)) * (1.0 - self.F(wi.z)) * ops.inv_pi / sqr(left))
        return ops.where(above(wo, wi), (base + spec) * wi.z, 0.0)


class W1MeanCoupled(go.BSDF):
    """Colored gloss over a colored matte base."""

    fault: ClassVar[str] = "in the channel in which the gloss is strong, gloss and base reflect more light than arrives"
    cause: ClassVar[str] = (
        "the base is scaled by 1 minus the mean of the gloss's channels instead of by 1 minus each channel"
    )
    kd: go.Colour = go.spectrum((0.85, 0.5, 0.4), "albedo of the base", low=0.0, high=1.0)
    ks: go.Colour = go.spectrum((0.75, 0.15, 0.1), "reflectance of the gloss", low=0.0, high=1.0)
    alpha: go.Number = go.number(0.15, "width of the gloss", low=0.02, high=0.4)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        cos = ops.dot(wo, m)
        z2 = ops.maximum(sqr(m.z), 1e-3)
        D = ops.exp(-frame.sin2(m) / (z2 * sqr(self.alpha))) / (ops.pi * sqr(self.alpha) * sqr(z2))
        gloss = self.ks * (D / (4.0 * ops.maximum(sqr(cos), 1e-9)))
        base = self.kd * ((1.0 - ops.mean(self.ks)) * ops.inv_pi)
        return ops.where(above(wo, wi), (base + gloss) * wi.z, 0.0)


class W1ConcentricSigns(go.BSDF):
    """A matte surface, sampled by the concentric map of the disk."""

    fault: ClassVar[str] = (
        "a part of the unit square is mapped to wrong azimuths and radii, so the samples are not cosine-distributed"
    )
    cause: ClassVar[str] = "the concentric map compares a > b instead of |a| > |b|"
    kd: go.Colour = go.spectrum(0.5, "albedo", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where(above(wo, wi), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(above(wo, wi), wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        a, b = 2.0 * u.y - 1.0, 2.0 * u.z - 1.0
        first = a > b
        r = ops.where(first, a, b)
        phi = ops.where(first, 0.25 * ops.pi * ops.safe_div(b, a), 0.5 * ops.pi - 0.25 * ops.pi * ops.safe_div(a, b))
        s, c = ops.sincos(phi)
        wi = ops.vec3(r * c, r * s, ops.safe_sqrt(1.0 - sqr(r)))
        return drawn(self, wo, wi, mode)


class W1RetroShareOfLight(go.BSDF):
    """A retroreflecting lobe about the viewer over a matte base."""

    fault: ClassVar[str] = "the pdf does not integrate to 1 and is not the density of the samples"
    cause: ClassVar[str] = "sample selects the lobe by a probability of wo.z, pdf computes it from wi.z"
    kd: go.Colour = go.spectrum(0.4, "albedo of the base", low=0.0, high=1.0)
    ks: go.Colour = go.spectrum(0.8, "albedo of the lobe", low=0.0, high=1.0)
    share: go.Number = go.number(0.4, "share of the lobe", low=0.0, high=1.0)
    p: go.Number = go.number(10.0, "exponent", low=1.0, high=1e3)

    def chance(self, w):
        return 0.2 + 0.6 * ops.clamp(w.z, 0.0, 1.0)

    def eval(self, wo, wi, mode="radiance"):
        lobe = (self.p + 2.0) * (0.5 * ops.inv_pi) * ops.pow(ops.dot(wo, wi), self.p)
        f = self.kd * ((1.0 - self.share) * ops.inv_pi) + self.ks * (self.share * lobe)
        return ops.where(above(wo, wi), f * wi.z, 0.0)

    def pdf(self, wo, wi):
        chance = self.chance(wi)
        lobe = (self.p + 1.0) * (0.5 * ops.inv_pi) * ops.pow(ops.dot(wo, wi), self.p)
        return ops.where(above(wo, wi), chance * lobe + (1.0 - chance) * wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        lobe = warp.to_frame(wo, warp.square_to_power_lobe(u.y, u.z, self.p))
        wi = ops.where(u.x < self.chance(wo), lobe, warp.square_to_cosine_hemisphere(u.y, u.z))
        return drawn(self, wo, wi, mode)


class W1MinnaertBright(go.BSDF):
    """Minnaert's law of a planet's surface, f = kd (k + 1) / (2 pi) (mu_o mu_i)^(k - 1)."""

    fault: ClassVar[str] = "for k below 1 the albedo grows without bound toward grazing views: energy from nothing"
    cause: ClassVar[str] = "the normalization (k + 1) / (2 pi) holds at normal incidence only, and k may be below 1"
    kd: go.Colour = go.spectrum(0.6, "albedo at normal incidence", low=0.0, high=1.0)
    k: go.Number = go.number(0.85, "limb darkening", low=0.6, high=2.0)

    def eval(self, wo, wi, mode="radiance"):
        product = ops.maximum(wo.z, 1e-6) * ops.maximum(wi.z, 1e-6)
        f = self.kd * ((self.k + 1.0) * (0.5 * ops.inv_pi) * ops.pow(product, self.k - 1.0))
        return ops.where(above(wo, wi), f * wi.z, 0.0)


class W1FitOddAzimuth(go.BSDF):
    """A fit to a measured matte board, in the terms of both directions' components along the surface."""

    fault: ClassVar[str] = "the BRDF changes by up to an eighth when light and viewer are exchanged"
    cause: ClassVar[str] = (
        "the fit contains o_x i_y - o_y i_x, odd in the difference of azimuths, which changes its sign with the exchange"
    )
    kd: go.Colour = go.spectrum((0.8, 0.75, 0.6), "albedo", low=0.0, high=1.0)
    skew: go.Number = go.number(0.05, "coefficient of the third term", low=0.0, high=0.1)

    def eval(self, wo, wi, mode="radiance"):
        along = wo.x * wi.x + wo.y * wi.y
        across = wo.x * wi.y - wo.y * wi.x
        f = self.kd * ((0.85 - 0.08 * along + self.skew * across) * ops.inv_pi)
        return ops.where(above(wo, wi), f * wi.z, 0.0)


class W1FitLopsided(go.BSDF):
    """A fit to a measured matte paint: darker toward grazing angles."""

    fault: ClassVar[str] = "the BRDF is not reciprocal, by up to 4 percent"
    cause: ClassVar[str] = "the coefficients of the terms of theta_o and of theta_i were fitted separately and differ"
    kd: go.Colour = go.spectrum((0.55, 0.5, 0.45), "albedo", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        f = self.kd * ((1.0 - 0.10 * sqr(1.0 - wo.z) - 0.14 * sqr(1.0 - wi.z)) * ops.inv_pi)
        return ops.where(above(wo, wi), f * wi.z, 0.0)


class W1UniformTheta(go.BSDF):
    """A matte surface, sampled uniformly in both angles."""

    fault: ClassVar[str] = "the pdf is a density of angles and not of solid angle: too small near the normal"
    cause: ClassVar[str] = "the Jacobian 1 / sin(theta) is missing in the pdf of uniform theta and phi"
    kd: go.Colour = go.spectrum(0.5, "albedo", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where(above(wo, wi), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(above(wo, wi), 1.0 + 0.0 * wi.z, 0.0) * sqr(ops.inv_pi)

    def sample(self, wo, u, mode="radiance"):
        sin, cos = ops.sincos(0.5 * ops.pi * u.y)
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        return drawn(self, wo, ops.vec3(sin * c, sin * s, cos), mode)


MUTANTS = [
    W1OrenNegative,
    W1FujiiSign,
    W1CouplingTwice,
    W1MeanCoupled,
    W1ConcentricSigns,
    W1RetroShareOfLight,
    W1MinnaertBright,
    W1FitOddAzimuth,
    W1FitLopsided,
    W1UniformTheta,
]
SOUND = []
