"""Empirical lobes and early half-vector models, each with one mistake."""

from typing import ClassVar

import gonio as go
import numpy as np
from gonio import ops
from gonio.optics import frame, warp


def above(wo, wi):
    return (wo.z > 0.0) & (wi.z > 0.0)


def drawn(material, wo, wi, mode):
    pdf = material.pdf(wo, wi)
    weight = material.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
    return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class W1PhongNoCosine(go.BSDF):
    """A matte base and a normalized Phong highlight."""

    fault: ClassVar[str] = (
        "the highlight's value lacks cos theta_i, so f = eval / cos theta_i is not reciprocal and unbounded at grazing light"
    )
    cause: ClassVar[str] = "the cosine of wi is missing in the specular term of eval"
    kd: go.Colour = go.spectrum(0.4, "albedo of the base", low=0.0, high=1.0)
    ks: go.Colour = go.spectrum(0.8, "albedo of the highlight", low=0.0, high=1.0)
    share: go.Number = go.number(0.4, "share of the highlight", low=0.0, high=1.0)
    p: go.Number = go.number(24.0, "exponent", low=1.0, high=1e4)

    def eval(self, wo, wi, mode="radiance"):
        r = frame.mirror(wo)
        lobe = (self.p + 1.0) * (0.5 * ops.inv_pi) * ops.pow(ops.dot(r, wi), self.p)
        value = self.kd * ((1.0 - self.share) * wi.z * ops.inv_pi) + self.ks * (self.share * lobe)
        return ops.where(above(wo, wi), value, 0.0)


class W1BlinnFourTimes(go.BSDF):
    """A matte base and a Blinn-Phong highlight."""

    fault: ClassVar[str] = "the highlight reflects up to four times the light that it should: energy from nothing"
    cause: ClassVar[str] = (
        "the half-vector lobe is normalized by Phong's (p + 2) / (2 pi) instead of about (p + 8) / (8 pi)"
    )
    kd: go.Colour = go.spectrum(0.3, "albedo of the base", low=0.0, high=1.0)
    ks: go.Colour = go.spectrum(0.9, "albedo of the highlight", low=0.0, high=1.0)
    share: go.Number = go.number(0.35, "share of the highlight", low=0.0, high=1.0)
    p: go.Number = go.number(40.0, "exponent", low=1.0, high=1e4)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        lobe = (self.p + 2.0) * (0.5 * ops.inv_pi) * ops.pow(m.z, self.p)
        f = self.kd * ((1.0 - self.share) * ops.inv_pi) + self.ks * (self.share * lobe)
        return ops.where(above(wo, wi), f * wi.z, 0.0)


class _W1Phong(go.BSDF):
    """A matte base and Phong's lobe in Lafortune's normalization, sampled by a mixture."""

    kd: go.Colour = go.spectrum(0.5, "albedo of the base", low=0.0, high=1.0)
    ks: go.Colour = go.spectrum(0.8, "albedo of the highlight", low=0.0, high=1.0)
    share: go.Number = go.number(0.5, "share of the highlight", low=0.05, high=0.95)
    p: go.Number = go.number(20.0, "exponent", low=1.0, high=1e3)

    def power(self, wo, wi):
        return ops.pow(ops.dot(frame.mirror(wo), wi), self.p)

    def eval(self, wo, wi, mode="radiance"):
        lobe = (self.p + 2.0) * (0.5 * ops.inv_pi) * self.power(wo, wi)
        f = self.kd * ((1.0 - self.share) * ops.inv_pi) + self.ks * (self.share * lobe)
        return ops.where(above(wo, wi), f * wi.z, 0.0)

    def lobe_pdf(self, wo, wi):
        return (self.p + 1.0) * (0.5 * ops.inv_pi) * self.power(wo, wi)

    def pdf(self, wo, wi):
        density = (1.0 - self.share) * wi.z * ops.inv_pi + self.share * self.lobe_pdf(wo, wi)
        return ops.where(above(wo, wi), density, 0.0)

    def lobe_sample(self, wo, u1, u2):
        return warp.to_frame(frame.mirror(wo), warp.square_to_power_lobe(u1, u2, self.p))

    def sample(self, wo, u, mode="radiance"):
        lobe = self.lobe_sample(wo, u.y, u.z)
        wi = ops.where(u.x < self.share, lobe, warp.square_to_cosine_hemisphere(u.y, u.z))
        return drawn(self, wo, wi, mode)


class W1PhongPlusTwo(_W1Phong):
    """Phong's lobe over a matte base, sampled by a mixture."""

    fault: ClassVar[str] = (
        "the pdf is too large where the highlight is: it does not integrate to 1 and is not the density of the samples"
    )
    cause: ClassVar[str] = (
        "the pdf of the power lobe is normalized by p + 2, the constant of the BRDF, instead of p + 1"
    )
    p: go.Number = go.number(12.0, "exponent", low=1.0, high=1e3)

    def lobe_pdf(self, wo, wi):
        return (self.p + 2.0) * (0.5 * ops.inv_pi) * self.power(wo, wi)


class W1PhongOwnLobe(_W1Phong):
    """Phong's lobe over a matte base, sampled by a mixture."""

    fault: ClassVar[str] = (
        "samples are weighted by the density of the chosen lobe alone, so the sum of both lobes is counted twice"
    )
    cause: ClassVar[str] = "sample's pdf and weight use only the chosen lobe's density instead of the mixture's"

    def sample(self, wo, u, mode="radiance"):
        specular = u.x < self.share
        wi = ops.where(specular, self.lobe_sample(wo, u.y, u.z), warp.square_to_cosine_hemisphere(u.y, u.z))
        own = ops.where(specular, self.share * self.lobe_pdf(wo, wi), (1.0 - self.share) * wi.z * ops.inv_pi)
        pdf = ops.where(above(wo, wi), own, 0.0)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class W1PhongReusedNumber(_W1Phong):
    """Phong's lobe over a matte base, sampled by a mixture."""

    fault: ClassVar[str] = (
        "the highlight is sampled near its peak only: directions of its outer half never come from it"
    )
    cause: ClassVar[str] = (
        "the random number that selects the lobe is reused for the direction without being rescaled to [0, 1)"
    )

    def sample(self, wo, u, mode="radiance"):
        wi = ops.where(u.x < self.share, self.lobe_sample(wo, u.x, u.z), warp.square_to_cosine_hemisphere(u.y, u.z))
        return drawn(self, wo, wi, mode)


class W1PhongFlippedUp(_W1Phong):
    """A wide Phong lobe over a matte base, sampled by a mixture."""

    fault: ClassVar[str] = "at grazing views more samples arrive near the horizon than the pdf states"
    cause: ClassVar[str] = "samples below the horizon are mirrored upward (z = |z|), which the pdf does not count"
    p: go.Number = go.number(6.0, "exponent", low=1.0, high=1e3)

    def lobe_sample(self, wo, u1, u2):
        w = warp.to_frame(frame.mirror(wo), warp.square_to_power_lobe(u1, u2, self.p))
        return ops.vec3(w.x, w.y, ops.abs(w.z))


class W1LafortuneLong(go.BSDF):
    """One generalized cosine lobe over a matte base."""

    fault: ClassVar[str] = "the lobe's peak is cz^p times too high: energy from nothing"
    cause: ClassVar[str] = (
        "the lobe is normalized by (p + 2) / (2 pi) as for coefficients of length 1, but cz exceeds 1 and is raised to p"
    )
    kd: go.Colour = go.spectrum(0.4, "albedo of the base", low=0.0, high=1.0)
    ks: go.Colour = go.spectrum(0.7, "albedo of the lobe", low=0.0, high=1.0)
    share: go.Number = go.number(0.6, "share of the lobe", low=0.0, high=1.0)
    cz: go.Number = go.number(1.06, "coefficient of z", low=0.8, high=1.2)
    p: go.Number = go.number(14.0, "exponent", low=1.0, high=100.0)

    def eval(self, wo, wi, mode="radiance"):
        cosine = self.cz * wo.z * wi.z - wo.x * wi.x - wo.y * wi.y
        lobe = (self.p + 2.0) * (0.5 * ops.inv_pi) * ops.pow(cosine, self.p)
        f = self.kd * ((1.0 - self.share) * ops.inv_pi) + self.ks * (self.share * lobe)
        return ops.where(above(wo, wi), f * wi.z, 0.0)


class W1AshikhminWhole(go.BSDF):
    """Ashikhmin and Shirley's matte base below their highlight."""

    fault: ClassVar[str] = "base and highlight together reflect up to 16 percent more than they receive"
    cause: ClassVar[str] = (
        "the diffuse term has (1 - cos)^5 where its normalization 28 / (23 pi) requires (1 - cos / 2)^5"
    )
    kd: go.Colour = go.spectrum(0.7, "albedo of the base", low=0.0, high=1.0)
    r0: go.Number = go.number(0.05, "reflectance of the highlight at normal incidence", low=0.0, high=0.3)
    p: go.Number = go.number(80.0, "exponent", low=1.0, high=1e4)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        cos = ops.dot(wo, m)
        F = self.r0 + (1.0 - self.r0) * ops.pow(1.0 - cos, 5.0)
        larger = ops.maximum(wo.z, wi.z)
        spec = (self.p + 1.0) * (0.125 * ops.inv_pi) * ops.pow(m.z, self.p) * F / ops.maximum(cos * larger, 1e-7)
        left = (1.0 - ops.pow(1.0 - wo.z, 5.0)) * (1.0 - ops.pow(1.0 - wi.z, 5.0))
        base = self.kd * (28.0 / (23.0 * ops.pi) * (1.0 - self.r0) * left)
        return ops.where(above(wo, wi), (base + spec) * wi.z, 0.0)


class W1AshikhminHalfCircle(go.BSDF):
    """Ashikhmin and Shirley's anisotropic highlight, with its sampler."""

    fault: ClassVar[str] = "half vectors with negative x are never sampled, although the pdf covers the circle"
    cause: ClassVar[str] = "atan returns azimuths from -pi/2 to pi/2 only; the quadrant of the random number is lost"
    r0: go.Colour = go.spectrum(0.7, "reflectance at normal incidence", low=0.0, high=1.0)
    nu: go.Number = go.number(12.0, "exponent along x", low=1.0, high=1e4)
    nv: go.Number = go.number(90.0, "exponent along y", low=1.0, high=1e4)

    @property
    def isotropic(self):
        return bool(np.all(np.asarray(self.plain.nu) == np.asarray(self.plain.nv)))

    def D(self, m):
        exponent = ops.safe_div(self.nu * ops.sqr(m.x) + self.nv * ops.sqr(m.y), frame.sin2(m))
        return (
            ops.sqrt((self.nu + 1.0) * (self.nv + 1.0))
            * (0.5 * ops.inv_pi)
            * ops.where(m.z > 0.999999, 1.0, ops.pow(m.z, exponent))
        )

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        cos = ops.dot(wo, m)
        F = self.r0 + (1.0 - self.r0) * ops.pow(1.0 - cos, 5.0)
        f = F * (self.D(m) / ops.maximum(4.0 * cos * ops.maximum(wo.z, wi.z), 1e-7))
        return ops.where(above(wo, wi), f * wi.z, 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        return ops.where(above(wo, wi), ops.safe_div(self.D(m), 4.0 * ops.dot(wo, m)), 0.0)

    def sample(self, wo, u, mode="radiance"):
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        tangent = ops.sqrt((self.nu + 1.0) / (self.nv + 1.0)) * ops.safe_div(s, c)
        s, c = ops.sincos(ops.atan2(tangent, 1.0 + 0.0 * tangent))
        exponent = self.nu * ops.sqr(c) + self.nv * ops.sqr(s)
        cos = ops.pow(1.0 - u.y, 1.0 / (exponent + 1.0))
        sin = ops.safe_sqrt(1.0 - ops.sqr(cos))
        return drawn(self, wo, frame.reflect(wo, ops.vec3(sin * c, sin * s, cos)), mode)


class W1WardSquare(go.BSDF):
    """Ward's anisotropic highlight in its bounded form."""

    fault: ClassVar[str] = "where the widths differ the highlight is ay / ax times too bright: energy from nothing"
    cause: ClassVar[str] = "D is normalized by pi ax^2 instead of pi ax ay"
    r0: go.Colour = go.spectrum(0.6, "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Width = go.width((0.12, 0.2), "width of the highlight", low=0.02, high=0.5)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        cos = ops.dot(wo, m)
        z2 = ops.maximum(ops.sqr(m.z), 1e-3)
        slope2 = (ops.sqr(m.x / self.alpha.x) + ops.sqr(m.y / self.alpha.y)) / z2
        D = ops.exp(-slope2) / (ops.pi * ops.sqr(self.alpha.x) * ops.sqr(z2))
        F = self.r0 + (1.0 - self.r0) * ops.pow(1.0 - cos, 5.0)
        f = F * (D / (4.0 * ops.maximum(ops.sqr(cos), 1e-9)))
        return ops.where(above(wo, wi), f * wi.z, 0.0)


MUTANTS = [
    W1PhongNoCosine,
    W1BlinnFourTimes,
    W1PhongPlusTwo,
    W1PhongOwnLobe,
    W1PhongReusedNumber,
    W1PhongFlippedUp,
    W1LafortuneLong,
    W1AshikhminWhole,
    W1AshikhminHalfCircle,
    W1WardSquare,
]
SOUND = []
