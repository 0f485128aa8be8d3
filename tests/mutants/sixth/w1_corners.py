"""Metals and mixtures that go wrong in corners: of parameters, of random numbers, of precision, of modes."""

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


def stretched_length(w, alpha):
    return ops.sqrt(sqr(alpha.x * w.x) + sqr(alpha.y * w.y) + sqr(w.z))


def ggx_D(m, alpha):
    s = sqr(m.x / alpha.x) + sqr(m.y / alpha.y) + sqr(m.z)
    return ops.where(m.z > 0.0, 1.0 / (ops.pi * alpha.x * alpha.y * ops.maximum(sqr(s), 1e-12)), 0.0)


def ggx_normal(u1, u2, alpha):
    """A normal with density D m_z."""
    r = ops.sqrt(u1 / (1.0 - u1))
    s, c = ops.sincos(2.0 * ops.pi * u2)
    return ops.normalize(ops.vec3(alpha.x * r * c, alpha.y * r * s, 1.0 + 0.0 * r))


def visible_normal(wo, u1, u2, alpha):
    """A visible normal of GGX, by a spherical cap."""
    v = ops.normalize(ops.vec3(alpha.x * wo.x, alpha.y * wo.y, wo.z))
    z = (1.0 - u1) * (1.0 + v.z) - v.z
    r = ops.safe_sqrt(1.0 - sqr(z))
    s, c = ops.sincos(2.0 * ops.pi * u2)
    return ops.normalize(ops.vec3(alpha.x * (r * c + v.x), alpha.y * (r * s + v.y), ops.maximum(z + v.z, 1e-6)))


class _W1Ggx5(go.BSDF):
    """A GGX metal with Schlick's reflectance and height-correlated masking."""

    r0: go.Colour = go.spectrum((0.9, 0.7, 0.4), "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.4, "width", low=0.02, high=1.0)

    def F(self, cos):
        return self.r0 + (1.0 - self.r0) * ops.pow(1.0 - cos, 5.0)

    def D(self, m):
        return ggx_D(m, self.alpha)

    def visibility(self, wo, wi):
        """G / (4 o.z i.z), times i.z."""
        a = self.alpha
        return 0.5 * wi.z / ops.maximum(wi.z * stretched_length(wo, a) + wo.z * stretched_length(wi, a), 1e-9)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        value = self.F(ops.dot(wo, m)) * (self.D(m) * self.visibility(wo, wi))
        return ops.where(above(wo, wi), value, 0.0)


class _W1Visible5(_W1Ggx5):
    """The same, sampled by visible normals."""

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        density = self.D(m) * 0.5 / ops.maximum(wo.z + stretched_length(wo, self.alpha), 1e-9)
        return ops.where(above(wo, wi), density, 0.0)

    def normal(self, wo, u1, u2):
        return visible_normal(wo, u1, u2, self.alpha)

    def sample(self, wo, u, mode="radiance"):
        return drawn(self, wo, frame.reflect(wo, self.normal(wo, u.y, u.z)), mode)


class W1RotatedSample(_W1Visible5):
    """A brushed GGX metal whose grooves are rotated, sampled by visible normals."""

    fault: ClassVar[str] = "samples lie in a lobe that is rotated by twice the angle the wrong way relative to the pdf"
    cause: ClassVar[str] = "the sampled direction is rotated forward once more instead of back"
    alpha: go.Width = go.width((0.1, 0.4), "width", low=0.02, high=1.0)
    rotation: go.Angle = go.angle(0.5, "of the grooves")

    def eval(self, wo, wi, mode="radiance"):
        o, i = frame.rotate(wo, self.rotation), frame.rotate(wi, self.rotation)
        m = frame.half_vector(o, i)
        value = self.F(ops.dot(o, m)) * (self.D(m) * self.visibility(o, i))
        return ops.where(above(wo, wi), value, 0.0)

    def pdf(self, wo, wi):
        o, i = frame.rotate(wo, self.rotation), frame.rotate(wi, self.rotation)
        density = self.D(frame.half_vector(o, i)) * 0.5 / ops.maximum(o.z + stretched_length(o, self.alpha), 1e-9)
        return ops.where(above(wo, wi), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        o = frame.rotate(wo, self.rotation)
        wi = frame.reflect(o, self.normal(o, u.y, u.z))
        return drawn(self, wo, frame.rotate(wi, self.rotation), mode)


class W1UnrotatedMasking(_W1Ggx5):
    """A brushed GGX metal whose grooves are rotated."""

    fault: ClassVar[str] = (
        "masking follows other axes than D: at some azimuths more light leaves than arrives at grazing views, and a turned material differs from the material turned"
    )
    cause: ClassVar[str] = (
        "the half vector is rotated into the frame of the grooves, wo and wi in the masking term are not"
    )
    alpha: go.Width = go.width((0.15, 0.5), "width", low=0.02, high=1.0)
    rotation: go.Angle = go.angle(1.3, "of the grooves")

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        turned = frame.rotate(m, self.rotation)
        value = self.F(ops.dot(wo, m)) * (self.D(turned) * self.visibility(wo, wi))
        return ops.where(above(wo, wi), value, 0.0)


class W1GammaOne(_W1Ggx5):
    """A metal with the long-tailed distribution GTR of any gamma, masked by V-shaped grooves."""

    fault: ClassVar[str] = "at gamma = 1, the lower end of its range, the value is not a number; it is right elsewhere"
    cause: ClassVar[str] = (
        "the normalization (gamma - 1) / (1 - alpha^(2 (1 - gamma))) is 0 / 0 at gamma = 1; its limit, a logarithm, is missing"
    )
    gamma: go.Number = go.number(2.0, "fall-off of the tail", low=1.0, high=6.0)
    alpha: go.Width = go.width(0.3, "width; the first of a pair counts", low=0.05, high=0.9)

    @property
    def isotropic(self):
        return True

    def D(self, m):
        a2 = sqr(self.alpha.x)
        scale = (self.gamma - 1.0) * (a2 - 1.0) / (ops.pi * (1.0 - ops.pow(a2, 1.0 - self.gamma)))
        return scale * ops.pow(a2 * sqr(m.z) + frame.sin2(m), -self.gamma)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        cos = ops.dot(wo, m)
        G = ops.minimum(2.0 * m.z * ops.minimum(wo.z, wi.z) / ops.maximum(cos, 1e-6), 1.0)
        value = self.F(cos) * (self.D(m) * G / (4.0 * ops.maximum(wo.z, 1e-6)))
        return ops.where(above(wo, wi) & (m.z > 0.0), value, 0.0)


class W1NarrowCancel(_W1Visible5):
    """A polished GGX metal, sampled by visible normals."""

    fault: ClassVar[str] = (
        "in 32 bits the narrow highlight is speckled: values are wrong by several percent, up to a quarter at the least width"
    )
    cause: ClassVar[str] = "tan^2 of the half vector is computed as (1 - z^2) / z^2, which cancels near the normal"
    alpha: go.Width = go.width(0.0015, "width; the first of a pair counts", low=0.001, high=0.5)

    @property
    def isotropic(self):
        return True

    def D(self, m):
        z2 = ops.maximum(sqr(m.z), 1e-6)
        a2 = sqr(self.alpha.x)
        tan2 = (1.0 - z2) / z2
        return ops.where(m.z > 0.0, 1.0 / (ops.pi * a2 * sqr(z2) * sqr(1.0 + tan2 / a2)), 0.0)

    def visibility(self, wo, wi):
        a = ops.vec2(self.alpha.x, self.alpha.x)
        return 0.5 * wi.z / ops.maximum(wi.z * stretched_length(wo, a) + wo.z * stretched_length(wi, a), 1e-9)

    def normal(self, wo, u1, u2):
        return visible_normal(wo, u1, u2, ops.vec2(self.alpha.x, self.alpha.x))


class W1ClampedNumbers(_W1Ggx5):
    """A GGX metal, sampled by all its normals."""

    fault: ClassVar[str] = (
        "a percent each of the samples fall on two rings of normals; the peak inside and the tail outside are never sampled"
    )
    cause: ClassVar[str] = (
        "the random number is clamped to [0.01, 0.99] against infinite slopes, which the pdf does not count"
    )
    alpha: go.Width = go.width(0.3, "width", low=0.02, high=1.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        return ops.where(above(wo, wi), ops.safe_div(self.D(m) * m.z, 4.0 * ops.dot(wo, m)), 0.0)

    def sample(self, wo, u, mode="radiance"):
        m = ggx_normal(ops.clamp(u.y, 0.01, 0.99), u.z, self.alpha)
        return drawn(self, wo, frame.reflect(wo, m), mode)


class _W1Plastic5(_W1Ggx5):
    """A GGX highlight over a matte base that receives the rest, sampled by a mixture."""

    r0: go.Number = go.number(0.05, "reflectance of the highlight at normal incidence", low=0.0, high=0.9)
    kd: go.Colour = go.spectrum(0.1, "albedo of the base", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.25, "width of the highlight", low=0.02, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        spec = self.F(ops.dot(wo, m)) * (self.D(m) * self.visibility(wo, wi))
        left_o, left_i = 1.0 - ops.pow(1.0 - wo.z, 5.0), 1.0 - ops.pow(1.0 - wi.z, 5.0)
        base = self.kd * ((1.0 - self.r0) * left_o * left_i * (21.0 / 20.0 / ops.pi) * wi.z)
        return ops.where(above(wo, wi), base + spec, 0.0)

    def chance(self, wo):
        F = self.F(ops.clamp(wo.z, 0.0, 1.0))
        return F / ops.maximum(F + (1.0 - F) * ops.mean(self.kd), 1e-6)

    def density(self, wo, wi, chance):
        m = frame.half_vector(wo, wi)
        spec = self.D(m) * 0.5 / ops.maximum(wo.z + stretched_length(wo, self.alpha), 1e-9)
        return ops.where(above(wo, wi), chance * spec + (1.0 - chance) * wi.z * ops.inv_pi, 0.0)

    def direction(self, wo, u, chance):
        spec = frame.reflect(wo, visible_normal(wo, u.y, u.z, self.alpha))
        return ops.where(u.x < chance, spec, warp.square_to_cosine_hemisphere(u.y, u.z))


class W1ClampedShare(_W1Plastic5):
    """A mirror-like lacquer over a nearly black base, sampled by a mixture."""

    fault: ClassVar[str] = (
        "pdf is not the density of the samples where one lobe dominates: the matte part of the density is too small there"
    )
    cause: ClassVar[str] = "sample clamps the lobe's probability to [0.1, 0.9], pdf does not"
    r0: go.Number = go.number(0.6, "reflectance of the highlight at normal incidence", low=0.0, high=0.9)
    kd: go.Colour = go.spectrum(0.04, "albedo of the base", low=0.0, high=1.0)

    def pdf(self, wo, wi):
        return self.density(wo, wi, self.chance(wo))

    def sample(self, wo, u, mode="radiance"):
        return drawn(self, wo, self.direction(wo, u, ops.clamp(self.chance(wo), 0.1, 0.9)), mode)


class W1ForgottenHaze(_W1Ggx5):
    """A metal with a haze: two GGX lobes of different widths, sampled by a mixture."""

    fault: ClassVar[str] = "pdf is that of the narrow lobe alone, far below the density of the samples in the haze"
    cause: ClassVar[str] = "pdf omits the second lobe, which sample chooses in 3 of 10 cases"
    alpha: go.Width = go.width(0.12, "width of the narrow lobe", low=0.02, high=0.3)

    def one(self, wo, wi, m, alpha):
        V = 0.5 * wi.z / ops.maximum(wi.z * stretched_length(wo, alpha) + wo.z * stretched_length(wi, alpha), 1e-9)
        return ggx_D(m, alpha) * V

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        both = 0.7 * self.one(wo, wi, m, self.alpha) + 0.3 * self.one(wo, wi, m, self.alpha * 3.0)
        return ops.where(above(wo, wi), self.F(ops.dot(wo, m)) * both, 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        spec = self.D(m) * 0.5 / ops.maximum(wo.z + stretched_length(wo, self.alpha), 1e-9)
        return ops.where(above(wo, wi), spec, 0.0)

    def sample(self, wo, u, mode="radiance"):
        narrow, wide = visible_normal(wo, u.y, u.z, self.alpha), visible_normal(wo, u.y, u.z, self.alpha * 3.0)
        return drawn(self, wo, frame.reflect(wo, ops.where(u.x < 0.7, narrow, wide)), mode)


class W1FlooredPdf(_W1Plastic5):
    """A plastic, sampled by a mixture."""

    fault: ClassVar[str] = (
        "the weights of directions with a small density are too small: light is lost toward the horizon"
    )
    cause: ClassVar[str] = "the weight is divided by max(pdf, 0.1) to avoid bright dots"
    kd: go.Colour = go.spectrum(0.5, "albedo of the base", low=0.0, high=1.0)

    def pdf(self, wo, wi):
        return self.density(wo, wi, self.chance(wo))

    def sample(self, wo, u, mode="radiance"):
        wi = self.direction(wo, u, self.chance(wo))
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) / ops.maximum(pdf, 0.1)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class W1ImportanceCosines(_W1Ggx5):
    """A GGX metal, for tracers of light paths too."""

    fault: ClassVar[str] = (
        "photons are reflected with other values than rays from the viewer, although nothing transmits"
    )
    cause: ClassVar[str] = (
        "in importance mode eval multiplies by cos_o / cos_i, a correction for shading normals that is the integrator's"
    )

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        value = self.F(ops.dot(wo, m)) * (self.D(m) * self.visibility(wo, wi))
        if mode == "importance":
            value = value * (wo.z / ops.maximum(wi.z, 1e-3))
        return ops.where(above(wo, wi), value, 0.0)


class W1SoftTerminator(go.BSDF):
    """A matte surface with a softened terminator."""

    fault: ClassVar[str] = "for light near the horizon the BRDF is not reciprocal"
    cause: ClassVar[str] = "the smooth step that softens the terminator depends on wi only"
    kd: go.Colour = go.spectrum((0.7, 0.6, 0.5), "albedo", low=0.0, high=1.0)
    soft: go.Number = go.number(0.15, "cosine up to which the shadow is softened", low=0.01, high=0.3)

    def eval(self, wo, wi, mode="radiance"):
        t = ops.clamp(wi.z / self.soft, 0.0, 1.0)
        return ops.where(above(wo, wi), self.kd * (sqr(t) * (3.0 - 2.0 * t) * wi.z * ops.inv_pi), 0.0)


class W1WideNorm(_W1Ggx5):
    """A GGX metal of any width."""

    fault: ClassVar[str] = "for widths over 1 the lobe is alpha^2 times too bright: energy from nothing; right below"
    cause: ClassVar[str] = "the normalization 1 / (pi ax ay) clamps the widths to 1, the shape of D does not"
    alpha: go.Width = go.width(0.5, "width", low=0.02, high=3.0)

    def D(self, m):
        a = self.alpha
        s = sqr(m.x / a.x) + sqr(m.y / a.y) + sqr(m.z)
        norm = ops.pi * ops.minimum(a.x, 1.0) * ops.minimum(a.y, 1.0)
        return ops.where(m.z > 0.0, 1.0 / (norm * ops.maximum(sqr(s), 1e-12)), 0.0)


class W1LogOfZero(go.BSDF):
    """Ward's highlight in its bounded form, sampled by its normals."""

    fault: ClassVar[str] = "for the random number 0 the sampled direction, its pdf and its weight are not numbers"
    cause: ClassVar[str] = "the slope is sqrt(-log u) instead of sqrt(-log(1 - u)), infinite at u = 0"
    r0: go.Colour = go.spectrum((0.9, 0.6, 0.4), "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Number = go.number(0.2, "width", low=0.02, high=0.5)

    def D(self, m):
        z2 = ops.maximum(sqr(m.z), 1e-3)
        return ops.exp(-frame.sin2(m) / (z2 * sqr(self.alpha))) / (ops.pi * sqr(self.alpha) * sqr(z2))

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        cos = ops.dot(wo, m)
        F = self.r0 + (1.0 - self.r0) * ops.pow(1.0 - cos, 5.0)
        return ops.where(above(wo, wi), F * (self.D(m) * wi.z / (4.0 * ops.maximum(sqr(cos), 1e-9))), 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        return ops.where(above(wo, wi), ops.safe_div(self.D(m) * m.z, 4.0 * ops.dot(wo, m)), 0.0)

    def sample(self, wo, u, mode="radiance"):
        tan = self.alpha * ops.sqrt(-ops.log(u.y))
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        m = ops.normalize(ops.vec3(tan * c, tan * s, 1.0 + 0.0 * u.z))
        wi = frame.reflect(wo, m)
        cos = ops.dot(wo, m)
        failed = (wo.z <= 0.0) | (wi.z <= 0.0)
        density = self.D(m) * m.z / (4.0 * ops.maximum(cos, 1e-6))
        F = self.r0 + (1.0 - self.r0) * ops.pow(1.0 - cos, 5.0)
        pdf = ops.where(failed, 0.0, density)
        weight = ops.where(failed, 0.0, F * (wi.z / (ops.maximum(cos, 1e-6) * m.z)))
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


MUTANTS = [
    W1RotatedSample,
    W1UnrotatedMasking,
    W1GammaOne,
    W1NarrowCancel,
    W1ClampedNumbers,
    W1ClampedShare,
    W1ForgottenHaze,
    W1FlooredPdf,
    W1ImportanceCosines,
    W1SoftTerminator,
    W1WideNorm,
    W1LogOfZero,
]
SOUND = []
