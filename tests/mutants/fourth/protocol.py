"""Precision, batches, modes, state, eta and gradients: materials, each with one mistake."""

from typing import ClassVar

import gonio as go
import drjit as dr
import numpy as np
from gonio import ops
from gonio.materials.microfacet.conductor import Conductor
from gonio.materials.microfacet.dielectric import Dielectric
from gonio.optics import frame, warp


def above(wo, wi):
    return (wo.z > 0.0) & (wi.z > 0.0)


class TextbookGGX(go.BSDF):
    """GGX by the formula of the slides: alpha^2 / (pi ((n.h)^2 (alpha^2 - 1) + 1)^2)."""

    fault: ClassVar[str] = (
        "In float32 (n.h)^2 (alpha^2 - 1) + 1 cancels: the peak of a narrow lobe is off by per cents."
    )
    cause: ClassVar[str] = "float32 cancellation in D at small alpha"
    r0: go.Colour = go.spectrum((0.95, 0.8, 0.4), "reflectance", low=0.0, high=1.0)
    alpha: go.Number = go.number(0.002, "width", low=0.0005, high=1.0)

    def D(self, m):
        a2 = ops.sqr(self.alpha)
        return a2 / (ops.pi * ops.sqr(ops.maximum(ops.sqr(m.z) * (a2 - 1.0) + 1.0, 1e-12)))

    def Lambda(self, w):
        z2 = ops.maximum(ops.sqr(w.z), 1e-12)
        return 0.5 * (ops.sqrt(1.0 + ops.sqr(self.alpha) * frame.sin2(w) / z2) - 1.0)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        g = 1.0 / (1.0 + self.Lambda(wo) + self.Lambda(wi))
        return self.r0 * ops.where(above(wo, wi), self.D(m) * g * ops.safe_div(1.0, 4.0 * wo.z), 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        return ops.where(above(wo, wi), ops.safe_div(self.D(m) * m.z, 4.0 * ops.dot(wo, m)), 0.0)

    def sample(self, wo, u, mode="radiance"):
        tan = self.alpha * ops.sqrt(u.y / ops.maximum(1.0 - u.y, 1e-7))
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        m = ops.normalize(ops.vec3(tan * c, tan * s, 1.0 + 0.0 * tan))
        wi = frame.reflect(wo, m)
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class SpreadOverBatch(go.BSDF):
    """A matte surface whose probabilities are balanced for the rays at hand."""

    fault: ClassVar[str] = (
        "The highlight's probability is the mean of Fresnel over all rays of the call: a ray's pdf depends on its neighbours."
    )
    cause: ClassVar[str] = "reduction over the batch: pdf of a ray depends on the other rays"
    kd: go.Colour = go.spectrum(0.5, "share of the base", low=0.0, high=0.5)
    ks: go.Colour = go.spectrum(0.2, "share of the highlight", low=0.0, high=0.5)
    p: go.Number = go.number(20.0, "exponent", low=1.0, high=500.0)

    def share(self, wo):
        grazing = ops.pow(1.0 - ops.abs(wo.z), 5.0)
        return 0.1 + 0.8 * (dr.mean(grazing) if ops.is_drjit(grazing) else grazing)

    def eval(self, wo, wi, mode="radiance"):
        lobe = warp.square_to_power_lobe_pdf(ops.dot(frame.mirror(wo), wi), self.p)
        return ops.where(above(wo, wi), self.kd * (wi.z * ops.inv_pi) + self.ks * (lobe * wi.z), 0.0)

    def pdf(self, wo, wi):
        share = self.share(wo)
        lobe = warp.square_to_power_lobe_pdf(frame.half_vector(wo, wi).z, self.p)
        lobe = ops.safe_div(lobe, 4.0 * ops.dot(wo, frame.half_vector(wo, wi)))
        return ops.where(above(wo, wi), share * lobe + (1.0 - share) * wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        m = warp.square_to_power_lobe(u.y, u.z, self.p)
        diffuse = warp.square_to_cosine_hemisphere(u.y, u.z)
        wi = ops.where(u.x < self.share(wo), frame.reflect(wo, m), diffuse)
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


_normalization: dict[str, float] = {}


class NormalizedOnce(go.BSDF):
    """A power lobe about the normal, reciprocal; normalized by a sum that is kept, as it is slow."""

    fault: ClassVar[str] = (
        "The normalization is kept for the class, not for the exponent: a second material has that of the first."
    )
    cause: ClassVar[str] = "state kept between instances: cached normalization"
    albedo: go.Colour = go.spectrum(0.9, "share reflected", low=0.0, high=1.0)
    p: go.Number = go.number(2.0, "falloff", low=0.0, high=20.0)

    def norm(self):
        if "norm" not in _normalization:
            p = float(np.max(np.asarray(self.plain.p, float)))
            mu = (np.arange(2000) + 0.5) / 2000
            _normalization["norm"] = float(1.0 / (2.0 * np.pi * np.mean(mu ** (p + 1.0))))
        return _normalization["norm"]

    def eval(self, wo, wi, mode="radiance"):
        value = ops.pow(wo.z, self.p) * ops.pow(wi.z, self.p) * wi.z * self.norm()
        return self.albedo * ops.where(above(wo, wi), value, 0.0)


class EtaUpsideDown(Dielectric):
    """Rough glass."""

    fault: ClassVar[str] = "sample.eta is the index on wo's side over that on wi's: upside down."
    cause: ClassVar[str] = "eta of refracted samples inverted"
    alpha: go.Width = go.width(0.2, "width")

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        return go.Sample(s.wi, s.weight, s.pdf, s.delta, 1.0 / s.eta)


class PlainTint(go.BSDF):
    """Minnaert's law, the colour taken from the material as it was made."""

    fault: ClassVar[str] = (
        "eval reads the colour of the first ray from `plain`: arrays of colours, and gradients by the colour, are lost."
    )
    cause: ClassVar[str] = "parameter read from plain, not from the bound copy: per-ray values and gradients ignored"
    kd: go.Colour = go.spectrum((0.6, 0.4, 0.3), "share reflected", low=0.0, high=1.0)
    k: go.Number = go.number(1.3, "darkening", low=1.0, high=3.0)

    def eval(self, wo, wi, mode="radiance"):
        plain = self.plain.kd
        first = np.broadcast_to(np.asarray(plain, float).reshape(-1, 3)[0] if np.ndim(plain) else float(plain), (3,))
        shape = ops.pow(wo.z * wi.z, self.k - 1.0) * wi.z * ops.inv_pi
        shape = ops.where(above(wo, wi), ops.where(self.k == 1.0, wi.z * ops.inv_pi, shape), 0.0)
        return ops.vec3(shape * float(first[0]), shape * float(first[1]), shape * float(first[2])) + 0.0 * self.kd


class FrozenNormalization(go.BSDF):
    """A power lobe about the normal, reciprocal: f = albedo (p + 2) / (2 pi) (cos_o cos_i)^p."""

    fault: ClassVar[str] = (
        "The normalization is taken from a detached p: its derivative is left out of every gradient by p."
    )
    cause: ClassVar[str] = "detached parameter: gradient by p incomplete"
    albedo: go.Colour = go.spectrum(0.9, "share reflected", low=0.0, high=1.0)
    p: go.Number = go.number(3.0, "falloff", low=0.0, high=20.0)

    def eval(self, wo, wi, mode="radiance"):
        p = dr.detach(self.p) if ops.is_drjit(self.p) else self.p
        value = ops.exp(self.p * ops.log(ops.maximum(wo.z * wi.z, 1e-12))) * wi.z * ((p + 2.0) * (0.5 * ops.inv_pi))
        return self.albedo * ops.where(above(wo, wi), value, 0.0)


class PolishedUndeclared(Conductor):
    """Metal that may be polished."""

    fault: ClassVar[str] = "At alpha = 0 samples are of a mirror, but the material says that it never has a delta lobe."
    cause: ClassVar[str] = "delta declared never, samples are delta"
    alpha: go.Width = go.width(0.0, "width")
    eta: go.Colour = go.spectrum(0.2, "index", low=0.0)
    k: go.Colour = go.spectrum((3.4, 2.3, 1.8), "index, imaginary", low=0.0)

    @property
    def delta(self):
        return "never"


class RowsOfThousand(go.BSDF):
    """A rough diffuse surface with a ripple, in blocks."""

    fault: ClassVar[str] = (
        "Light is taken from wi of the ray 1024 lanes before: in calls of more than 1024 rays the later ones are wrong."
    )
    cause: ClassVar[str] = "batch index wraps at 1024: large batches wrong"
    kd: go.Colour = go.spectrum(0.8, "share reflected", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        z = wi.z
        if ops.is_drjit(z) and dr.width(z) > 1024:
            UInt = dr.uint32_array_t(type(z))
            lane = dr.arange(UInt, dr.width(z))
            z = dr.gather(type(z), dr.copy(z), lane & UInt(1023))
        return self.kd * ops.where(above(wo, wi), ops.maximum(z, 0.0) * ops.inv_pi, 0.0)


MUTANTS = [
    TextbookGGX, SpreadOverBatch, NormalizedOnce, EtaUpsideDown, PlainTint, FrozenNormalization,
    PolishedUndeclared, RowsOfThousand,
]  # fmt: skip
SOUND = []
