"""Compensated, coated, layered and mixed materials, each with one mistake."""

from typing import ClassVar

import gonio as go
import numpy as np
from gonio import ops
from gonio.materials.combined.mix import Mix
from gonio.materials.compensated.kulla_conty import KullaConty
from gonio.optics import frame, warp
from gonio.optics.ndf import distribution


def schlick(cos, r0):
    return r0 + (1.0 - r0) * ops.pow(1.0 - cos, 5.0)


def above(wo, wi):
    return (wo.z > 0.0) & (wi.z > 0.0)


def cosine_mixture(wo, u, pdf, evaluate, share, special):
    """A go.Sample of a mixture of `special` (probability share) and the cosine."""
    wi = ops.where(u.x < share, special, warp.square_to_cosine_hemisphere(u.y, u.z))
    p = pdf(wo, wi)
    return go.Sample(wi, evaluate(wo, wi) * ops.safe_div(1.0, p), p, go.never(p), 1.0 + 0.0 * p)


class AverageHalved(KullaConty):
    """Kulla-Conty's compensation of a white rough metal."""

    fault: ClassVar[str] = "E_avg is int E dmu instead of 2 int E mu dmu, so the added lobe has the wrong size."
    cause: ClassVar[str] = "E_avg without the cosine weight: added lobe mis-scaled, energy"
    base: go.BSDF = go.bsdf("the metal", default=go.Conductor(eta=0.0, k=1.0, alpha=0.7))

    def compensation(self, wo, wi, mode):
        from gonio.optics.special import gauss

        nodes = [(float(x), float(w)) for x, w in zip(*gauss(8), strict=True)]
        mean = 0.0 * wo.z
        for x, w in nodes:
            sin = (1.0 - x * x) ** 0.5
            mean = mean + w * self.M(ops.vec3(sin + 0.0 * wo.z, 0.0 * wo.z, x + 0.0 * wo.z))
        return super().compensation(wo, wi, mode) * ops.safe_div(self.derived.missing.average, mean)


class AddedFromViewer(KullaConty):
    """A metal, and what it misses as diffuse light."""

    fault: ClassVar[str] = "What is missing at the viewer's direction is given back by a Lambert lobe; undeclared."
    cause: ClassVar[str] = "added lobe depends on wo alone: reciprocity, not declared"
    base: go.BSDF = go.bsdf("the metal", default=go.Conductor.preset("Cu", alpha=0.6))

    def compensation(self, wo, wi, mode):
        return self.derived.f_add * ops.where(above(wo, wi), self.M(wo) * wi.z * ops.inv_pi, 0.0)


class BroadLobeUnknownToPdf(KullaConty):
    """Kulla-Conty's compensation of iron."""

    fault: ClassVar[str] = (
        "sample draws from base and broad lobe with one-sample weights of the mixture, pdf still answers for the base alone."
    )
    cause: ClassVar[str] = "pdf omits the compensation lobe"
    base: go.BSDF = go.bsdf("the metal", default=go.Conductor.preset("Fe", alpha=0.8))

    def pdf(self, wo, wi):
        return self.base.pdf(wo, wi)


class _Glossy(go.BSDF):
    """GGX highlight by Schlick over a matte base."""

    kd: go.Colour = go.spectrum((0.9, 0.7, 0.6), "share that the base reflects", low=0.0, high=1.0)
    r0: go.Colour = go.spectrum(0.05, "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.25, "width", low=0.02)

    def left(self, wo, wi, m):
        """Share of the light that reaches and leaves the base."""
        return (1.0 - schlick(wo.z, self.r0)) * (1.0 - schlick(wi.z, self.r0))

    def eval(self, wo, wi, mode="radiance"):
        ggx = distribution("ggx")
        m = frame.half_vector(wo, wi)
        g = 1.0 / (1.0 + ggx.Lambda(wo, self.alpha) + ggx.Lambda(wi, self.alpha))
        gloss = schlick(ops.abs(ops.dot(wo, m)), self.r0) * ops.safe_div(ggx.D(m, self.alpha) * g, 4.0 * wo.z)
        return ops.where(above(wo, wi), gloss + self.kd * self.left(wo, wi, m) * (wi.z * ops.inv_pi), 0.0)

    def pdf(self, wo, wi):
        gloss = 0.25 * distribution("ggx").visible_per_cosine(wo, frame.half_vector(wo, wi), self.alpha)
        return ops.where(above(wo, wi), 0.5 * gloss + 0.5 * wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        m = distribution("ggx").sample_visible(wo, u.y, u.z, self.alpha)
        return cosine_mixture(wo, u, self.pdf, self.eval, 0.5 + 0.0 * wo.z, frame.reflect(wo, m))


class LeftAtHalfVector(_Glossy):
    """Glossy paint: diffuse times 1 - F."""

    fault: ClassVar[str] = (
        "The base gets 1 - F at the half vector, as games do: at grazing views highlight and base return more than comes."
    )
    cause: ClassVar[str] = "diffuse coupled by F at the half vector: energy over 1 at grazing"
    kd: go.Colour = go.spectrum((1.0, 0.9, 0.6), "share that the base reflects", low=0.0, high=1.0)

    def left(self, wo, wi, m):
        return 1.0 - schlick(ops.abs(ops.dot(wo, m)), self.r0)


class LeftOnceOnly(_Glossy):
    """Glossy paint whose base is lit through the highlight's surface."""

    fault: ClassVar[str] = "The base loses the highlight's share on the viewer's way only."
    cause: ClassVar[str] = "coupling by 1 - F(wo) alone: not reciprocal"

    def left(self, wo, wi, m):
        return 1.0 - schlick(wo.z, self.r0)


class HalvedTwice(_Glossy):
    """Glossy paint after Ashikhmin and Shirley: 28/23 (1 - (1 - cos / 2)^5) twice."""

    fault: ClassVar[str] = (
        "The constant 28/23 belongs to (1 - cos/2)^5; here it stands before (1 - cos)^5, so the base returns too much."
    )
    cause: ClassVar[str] = "normalization 28/23 of the diffuse base does not fit: energy"
    kd: go.Colour = go.spectrum((0.97, 0.9, 0.6), "share that the base reflects", low=0.0, high=1.0)

    def left(self, wo, wi, m):
        o, i = (1.0 - ops.pow(1.0 - w.z, 5.0) for w in (wo, wi))
        return (1.0 - self.r0) * (28.0 / 23.0) * (o * i)


class UnstretchedMix(Mix):
    """Chalk dust on glass."""

    fault: ClassVar[str] = (
        "The number that picked the material is handed on as it is: glass, which picks its lobe by it too, reflects too often."
    )
    cause: ClassVar[str] = "u.x reused without rescaling after the choice: sample does not follow pdf"
    a: go.BSDF = go.bsdf("at weight 0", default=go.Lambert(albedo=0.8))
    b: go.BSDF = go.bsdf("at weight 1", default=go.Dielectric(eta=1.5, alpha=0.2))
    weight: go.Number = go.number(0.4, "share of b", low=0.0, high=1.0)

    def sample(self, wo, u, mode="radiance"):
        w = self.weight
        pick_b = u.x < w
        sa, sb = self.a.sample(wo, u, mode), self.b.sample(wo, u, mode)
        wi, eta = ops.where(pick_b, sb.wi, sa.wi), ops.where(pick_b, sb.eta, sa.eta)
        pdf = ops.where(ops.where(pick_b, sb.pdf, sa.pdf) > 0.0, self.pdf(wo, wi), 0.0)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), eta)


# E of white GGX at alpha = 1, smith-correlated, at mu = 0, 1/8, ..., 1 (made below, once)
def _table():
    mu = np.maximum(np.linspace(0.0, 1.0, 9), 1e-3)
    z = (np.arange(400) + 0.5) / 400
    p = (np.arange(256) + 0.5) / 256 * 2 * np.pi
    Z, P = np.meshgrid(z, p, indexing="ij")
    S = np.sqrt(1 - Z * Z)
    wi = np.stack([S * np.cos(P), S * np.sin(P), Z], -1).reshape(-1, 3)
    found = []
    for x in mu:
        wo = np.array([np.sqrt(1 - x * x), 0.0, x])
        m = wo + wi
        m /= np.linalg.norm(m, axis=1, keepdims=True)
        lam = lambda c: 0.5 * (np.sqrt(1 + (1 - c * c) / (c * c)) - 1)  # noqa: E731
        value = (1 / np.pi) / (1 + lam(x) + lam(wi[:, 2])) / (4 * x)
        found.append(float(value.sum() * 2 * np.pi / len(wi)))
    return found


E_TABLE = _table()
_FINE = np.linspace(0, 1, 2001)
E_AVG = float(np.trapezoid(2 * _FINE * np.interp(_FINE, np.linspace(0, 1, 9), E_TABLE), _FINE))


class _White(go.BSDF):
    """White GGX of width 1, compensated by a table of its own."""

    albedo: go.Colour = go.spectrum(1.0, "share of each bounce", low=0.0, high=1.0)
    lossless_tolerance: ClassVar[float] = 1e-2

    def E(self, mu):
        """By linear interpolation; a chain of `where`, as shaders without textures have it."""
        at = self.place(mu)
        value = E_TABLE[0] + 0.0 * mu
        for k in range(8):
            t = ops.clamp(at - k, 0.0, 1.0)
            value = value + (E_TABLE[k + 1] - E_TABLE[k]) * t
        return value

    def place(self, mu):
        return mu * 8.0

    def eval(self, wo, wi, mode="radiance"):
        ggx, one = distribution("ggx"), ops.vec2(1.0 + 0.0 * wo.z, 1.0 + 0.0 * wo.z)
        m = frame.half_vector(wo, wi)
        g = 1.0 / (1.0 + ggx.Lambda(wo, one) + ggx.Lambda(wi, one))
        single = ops.safe_div(ggx.D(m, one) * g, 4.0 * wo.z)
        multi = (1.0 - self.E(wo.z)) * (1.0 - self.E(wi.z)) * wi.z * (ops.inv_pi / (1.0 - E_AVG))
        series = self.albedo * E_AVG / (1.0 - self.albedo * (1.0 - E_AVG))
        return ops.where(above(wo, wi), self.albedo * single + self.albedo * series * multi, 0.0)


class TexelCentres(_White):
    """White GGX with a table."""

    fault: ClassVar[str] = "The table's nodes stand at 0, 1/8, ..., 1 but are read as if they were texel centres."
    cause: ClassVar[str] = "table read half a texel off: compensation does not fit, energy"

    def place(self, mu):
        return mu * 9.0 - 0.5


class CoatChoiceForgotten(go.BSDF):
    """A smooth lacquer over a matte base."""

    fault: ClassVar[str] = (
        "The base's samples are taken with probability 1 - F(wo), but pdf answers the plain cosine; the weights are right."
    )
    cause: ClassVar[str] = "pdf lacks the probability of choosing the base"
    kd: go.Colour = go.spectrum((0.7, 0.2, 0.2), "share that the base reflects", low=0.0, high=1.0)
    r0: go.Number = go.number(0.05, "reflectance at normal incidence", low=0.0, high=0.5)

    @property
    def delta(self):
        return "maybe"

    def eval(self, wo, wi, mode="radiance"):
        left = (1.0 - schlick(wo.z, self.r0)) * (1.0 - schlick(wi.z, self.r0))
        return self.kd * ops.where(above(wo, wi), left * wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(above(wo, wi), wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        F = schlick(ops.abs(wo.z), self.r0)
        up = wo.z > 0.0
        mirrored = (u.x < F) & up
        wi = ops.where(mirrored, frame.mirror(wo), warp.square_to_cosine_hemisphere(u.y, u.z))
        p = self.pdf(wo, wi)
        base = self.eval(wo, wi) * ops.safe_div(1.0, p * (1.0 - F))
        pdf = ops.where(up, ops.where(mirrored, F, p), 0.0)
        return go.Sample(wi, ops.where(mirrored, 1.0, ops.where(up, base, 0.0)), pdf, mirrored, 1.0 + 0.0 * F)


class EightOverEight(go.BSDF):
    """Normalized Blinn-Phong, white: (p + 8) / (8 pi) (n.h)^p cos."""

    fault: ClassVar[str] = (
        "(p + 8) / (8 pi) is the limit's normalization; for p from about 1 to 400 the lobe returns up to 6 % too much from above."
    )
    cause: ClassVar[str] = "approximate normalization (p+8)/(8 pi): energy over 1"
    ks: go.Colour = go.spectrum(1.0, "share reflected", low=0.0, high=1.0)
    p: go.Number = go.number(12.0, "exponent", low=1.0, high=1000.0)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        value = ops.pow(m.z, self.p) * wi.z * ((self.p + 8.0) / (8.0 * ops.pi))
        return self.ks * ops.where(above(wo, wi), value, 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        lobe = ops.safe_div(warp.square_to_power_lobe_pdf(m.z, self.p), 4.0 * ops.dot(wo, m))
        return ops.where(above(wo, wi), 0.5 * lobe + 0.5 * wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        m = warp.square_to_power_lobe(u.y, u.z, self.p)
        return cosine_mixture(wo, u, self.pdf, self.eval, 0.5 + 0.0 * wo.z, frame.reflect(wo, m))


MUTANTS = [
    AverageHalved, AddedFromViewer, BroadLobeUnknownToPdf, LeftAtHalfVector, LeftOnceOnly, HalvedTwice, UnstretchedMix,
    TexelCentres, CoatChoiceForgotten, EightOverEight,
]  # fmt: skip
SOUND = []
