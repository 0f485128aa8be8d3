"""Wrong materials: Phong's and Blinn's lobes."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.optics import frame, warp


class _Phong(go.BSDF):
    """Right: f = kd (1 - ks) / pi + ks (p + 2) / (2 pi) (v.r)^p, sampled by a mixture of both."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    kd: go.Colour = go.spectrum(0.5, "albedo of the matte part", low=0.0, high=1.0)
    ks: go.Colour = go.spectrum(0.4, "albedo of the lobe at the normal", low=0.0, high=1.0)
    p: go.Number = go.number(20.0, "exponent of the lobe", low=1.0, high=1000.0)

    def matte(self):
        return self.kd * (1.0 - self.ks)

    def power(self, wo, wi):
        return warp.power_about(frame.mirror(wo), wi, self.p)

    def share(self, wo):
        a, b = ops.mean(self.ks), ops.mean(self.matte())
        return ops.clamp(ops.safe_div(a, a + b), 0.1, 0.9)

    def lobe_pdf(self, wo, wi):
        return (self.p + 1.0) * (0.5 * ops.inv_pi) * self.power(wo, wi)

    def lobe_sample(self, wo, u1, u2):
        return warp.to_frame(frame.mirror(wo), warp.square_to_power_lobe(u1, u2, self.p))

    def eval(self, wo, wi, mode="radiance"):
        f = self.matte() * ops.inv_pi + self.ks * ((self.p + 2.0) * (0.5 * ops.inv_pi) * self.power(wo, wi))
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), f * wi.z, 0.0)

    def pdf(self, wo, wi):
        s = self.share(wo)
        d = (1.0 - s) * ops.inv_pi * wi.z + s * self.lobe_pdf(wo, wi)
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), d, 0.0)

    def draw(self, wo, u):
        return ops.where(
            u.x < self.share(wo), self.lobe_sample(wo, u.y, u.z), warp.square_to_cosine_hemisphere(u.y, u.z)
        )

    def sample(self, wo, u, mode="radiance"):
        wi = self.draw(wo, u)
        pdf = self.pdf(wo, wi)
        return go.Sample.of_density(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf)


class PhongRedShare(_Phong):
    """A matte part and a lobe, sampled by their colors."""

    fault: ClassVar[str] = (
        "the share of the lobe is computed from the red channels alone and not clamped: for a matte part without red "
        "(kd = (0, 1, 1)) and a lobe with red, share = 1, so the green and blue matte light is never sampled where v.r <= 0 (pdf = 0 there, eval > 0)"
    )
    cause: ClassVar[str] = "lobe selection looks at red only"

    def share(self, wo):
        a, b = ops.channels(self.ks)[0], ops.channels(self.matte())[0]
        return ops.safe_div(a, a + b)


class PhongPdfNorm(_Phong):
    """A matte part and a lobe."""

    fault: ClassVar[str] = (
        "the pdf of the lobe has the BRDF's normalization (p + 2) / (2 pi) instead of (p + 1) / (2 pi): it integrates to over 1, by 1 / (p + 1) of the lobe's share"
    )
    cause: ClassVar[str] = "lobe pdf normalized with p + 2"

    def lobe_pdf(self, wo, wi):
        return (self.p + 2.0) * (0.5 * ops.inv_pi) * self.power(wo, wi)


class PhongSameRandom(_Phong):
    """A matte part and a lobe."""

    fault: ClassVar[str] = (
        "u2 selects the lobe and is used again, without rescaling, for the polar angle: the lobe gets only its peak and the matte part only its rim, while the pdf is that of the full mixture"
    )
    cause: ClassVar[str] = "random number reused for lobe and angle"

    def draw(self, wo, u):
        return ops.where(
            u.y < self.share(wo), self.lobe_sample(wo, u.y, u.z), warp.square_to_cosine_hemisphere(u.y, u.z)
        )


class PhongClampedWeight(_Phong):
    """A matte part and a lobe, without fireflies."""

    fault: ClassVar[str] = (
        "the sample's weight is limited to 1 against fireflies, so weight is not eval / pdf where this is over 1: in the strong channels of saturated colors, e.g. ks = (1, 0, 0) with kd = (0, 0.5, 1)"
    )
    cause: ClassVar[str] = "sample weight clamped to 1"

    def sample(self, wo, u, mode="radiance"):
        wi = self.draw(wo, u)
        pdf = self.pdf(wo, wi)
        weight = ops.minimum(self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), 1.0)
        return go.Sample.of_density(wi, weight, pdf)


class PhongFolded(_Phong):
    """A matte part and a lobe; no sample is lost."""

    fault: ClassVar[str] = (
        "a lobe sample below the horizon is flipped up (z -> |z|), but the pdf omits the folded-in density: at grazing views with broad lobes the samples near the horizon are too frequent"
    )
    cause: ClassVar[str] = "samples folded at the horizon, pdf not"

    def lobe_sample(self, wo, u1, u2):
        w = warp.to_frame(frame.mirror(wo), warp.square_to_power_lobe(u1, u2, self.p))
        return ops.vec3(w.x, w.y, ops.abs(w.z))


class _Blinn(_Phong):
    """Right: the lobe is ks (p + 2) / (8 pi) (n.h)^p / max(o.z, i.z) / (o.h): Ashikhmin's form, bounded by ks."""

    def half_density(self, h):
        return (self.p + 1.0) * (0.5 * ops.inv_pi) * ops.pow(h.z, self.p)

    def eval(self, wo, wi, mode="radiance"):
        h = frame.half_vector(wo, wi)
        spread = self.half_density(h) / (
            4.0 * ops.maximum(ops.dot(wo, h), 1e-6) * ops.maximum(ops.maximum(wo.z, wi.z), 1e-6)
        )
        f = self.matte() * ops.inv_pi + self.ks * spread
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), f * wi.z, 0.0)

    def lobe_pdf(self, wo, wi):
        h = frame.half_vector(wo, wi)
        return self.half_density(h) / (4.0 * ops.maximum(ops.dot(wo, h), 1e-6))

    def lobe_sample(self, wo, u1, u2):
        return frame.reflect(wo, warp.square_to_power_lobe(u1, u2, self.p))


class BlinnJacobian(_Blinn):
    """A matte part and a half-vector lobe."""

    fault: ClassVar[str] = (
        "the Jacobian of the half vector in the pdf is 1 / (4 n.h) instead of 1 / (4 o.h): right at normal incidence only, off by 1 / cos theta_o elsewhere"
    )
    cause: ClassVar[str] = "half-vector Jacobian uses n.h, not o.h"

    def lobe_pdf(self, wo, wi):
        h = frame.half_vector(wo, wi)
        return self.half_density(h) / (4.0 * ops.maximum(h.z, 1e-6))


class BlinnEight(go.BSDF):
    """Normalized Blinn-Phong: f = ks (p + 8) / (8 pi) (n.h)^p."""

    fault: ClassVar[str] = (
        "the popular norm (p + 8) / (8 pi) is over the exact (p + 2)(p + 4) / (8 pi (p + 2^(-p/2))): a white lobe reflects up to 8 % more than it receives at normal incidence (p near 5 to 20)"
    )
    cause: ClassVar[str] = "approximate Blinn normalization gains energy"
    ks: go.Colour = go.spectrum(1.0, "albedo of the lobe at the normal", low=0.0, high=1.0)
    p: go.Number = go.number(12.0, "exponent", low=4.0, high=1000.0)

    def eval(self, wo, wi, mode="radiance"):
        h = frame.half_vector(wo, wi)
        f = (self.p + 8.0) * (0.125 * ops.inv_pi) * ops.pow(h.z, self.p)
        return self.ks * ops.where((wo.z > 0.0) & (wi.z > 0.0), f * wi.z, 0.0)


class PhongLobeWithoutCosine(go.BSDF):
    """A matte part and a lobe."""

    fault: ClassVar[str] = (
        "the lobe's term lacks the cosine of the light (only the matte term has it): f = eval / cos is not reciprocal and unbounded at grazing light"
    )
    cause: ClassVar[str] = "cos theta_i missing in the lobe"
    kd: go.Colour = go.spectrum(0.5, "albedo of the matte part", low=0.0, high=1.0)
    ks: go.Colour = go.spectrum(0.4, "albedo of the lobe", low=0.0, high=1.0)
    p: go.Number = go.number(20.0, "exponent of the lobe", low=1.0, high=1000.0)

    def eval(self, wo, wi, mode="radiance"):
        lobe = (self.p + 1.0) * (0.5 * ops.inv_pi) * warp.power_about(frame.mirror(wo), wi, self.p)
        value = self.kd * (1.0 - self.ks) * (ops.inv_pi * wi.z) + self.ks * lobe
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), value, 0.0)


MUTANTS = [
    PhongRedShare,
    PhongPdfNorm,
    PhongSameRandom,
    PhongClampedWeight,
    PhongFolded,
    BlinnJacobian,
    BlinnEight,
    PhongLobeWithoutCosine,
]
