"""Wrong materials: sheen, retro-reflection, rough matte and dust."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.optics import frame, warp


class _Sheen(go.BSDF):
    """Right: f = color (k + 1)(k + 2) / (2 pi) (1 - o.z)^k (1 - i.z)^k, whose albedo is color (1 - o.z)^k."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    colour: go.Colour = go.spectrum(0.8, "albedo at grazing views", low=0.0, high=1.0)
    k: go.Number = go.number(3.0, "exponent", low=1.0, high=8.0)

    def eval(self, wo, wi, mode="radiance"):
        rim = ops.pow(1.0 - wo.z, self.k) * ops.pow(1.0 - wi.z, self.k)
        f = (self.k + 1.0) * (self.k + 2.0) * (0.5 * ops.inv_pi) * rim
        return self.colour * ops.where((wo.z > 0.0) & (wi.z > 0.0), f * wi.z, 0.0)


class SheenBelow(_Sheen):
    """Sheen of cloth."""

    fault: ClassVar[str] = (
        "the pdf of the uniform hemisphere is 1 / (2 pi) for every wi, below the surface too: it integrates to 2 over the sphere, while no sample lies below"
    )
    cause: ClassVar[str] = "pdf not zero below the surface"

    def pdf(self, wo, wi):
        return ops.where(wo.z > 0.0, 0.5 * ops.inv_pi + 0.0 * wi.z, 0.0)

    def sample(self, wo, u, mode="radiance"):
        r = ops.safe_sqrt(1.0 - ops.sqr(u.y))
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        wi = ops.vec3(r * c, r * s, u.y)
        pdf = self.pdf(wo, wi)
        return go.Sample.of_density(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf)


class SheenZero(_Sheen):
    """Sheen of cloth."""

    fault: ClassVar[str] = (
        "wi is drawn with density (1 - i.z)^k; at u2 = 0 it is the normal, where value and density are both 0, and the weight value / density without a guard is NaN"
    )
    cause: ClassVar[str] = "weight is 0/0 at u = 0"

    def pdf(self, wo, wi):
        d = (self.k + 1.0) * (0.5 * ops.inv_pi) * ops.pow(1.0 - wi.z, self.k)
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), d, 0.0)

    def sample(self, wo, u, mode="radiance"):
        z = 1.0 - ops.pow(u.y, 1.0 / (self.k + 1.0))
        r = ops.safe_sqrt(1.0 - ops.sqr(z))
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        wi = ops.vec3(r * c, r * s, z)
        pdf = self.pdf(wo, wi)
        weight = ops.where((wo.z > 0.0) & (wi.z > 0.0), self.eval(wo, wi, mode) * (1.0 / pdf), 0.0)
        return go.Sample.of_density(wi, weight, pdf)


class _Retro(go.BSDF):
    """Right: f = kd (1 - ks) / pi + ks (p + 2) / (2 pi) (o.i)^p, sampled by both."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    kd: go.Colour = go.spectrum(0.3, "albedo of the matte part", low=0.0, high=1.0)
    ks: go.Colour = go.spectrum(0.6, "albedo of the beads", low=0.0, high=1.0)
    p: go.Number = go.number(6.0, "exponent of the beads' lobe", low=2.0, high=400.0)

    def eval(self, wo, wi, mode="radiance"):
        beads = (self.p + 2.0) * (0.5 * ops.inv_pi) * ops.pow(ops.dot(wo, wi), self.p)
        f = self.kd * (1.0 - self.ks) * ops.inv_pi + self.ks * beads
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), f * wi.z, 0.0)

    def lobe_pdf(self, wo, wi):
        return (self.p + 1.0) * (0.5 * ops.inv_pi) * ops.pow(ops.dot(wo, wi), self.p)

    def pdf(self, wo, wi):
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), 0.3 * ops.inv_pi * wi.z + 0.7 * self.lobe_pdf(wo, wi), 0.0)

    def about(self, axis, w):
        return warp.to_frame(axis, w)

    def sample(self, wo, u, mode="radiance"):
        lobe = self.about(wo, warp.square_to_power_lobe(u.y, u.z, self.p))
        wi = ops.where(u.x < 0.7, lobe, warp.square_to_cosine_hemisphere(u.y, u.z))
        pdf = self.pdf(wo, wi)
        return go.Sample.of_density(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf)


class RetroFrame(_Retro):
    """Glass beads on a matte ground."""

    fault: ClassVar[str] = (
        "the frame about the viewer is built from the cross product with z, whose length is 0 for a view exactly along the normal: the sampled direction is NaN (or the lobe collapses) there"
    )
    cause: ClassVar[str] = "tangent frame degenerate at the normal"

    def about(self, axis, w):
        over = 1.0 / ops.sqrt(ops.sqr(axis.x) + ops.sqr(axis.y))
        s = ops.vec3(-axis.y * over, axis.x * over, 0.0 * over)
        t = ops.vec3(axis.y * s.z - axis.z * s.y, axis.z * s.x - axis.x * s.z, axis.x * s.y - axis.y * s.x)
        return s * w.x + t * w.y + axis * w.z


class RetroAbs(_Retro):
    """Glass beads on a matte ground."""

    fault: ClassVar[str] = (
        "the pdf raises |o.i| to the power p: the density has a second lobe about -wo, a part of which is above the surface at grazing views, where the sampler never goes by it and the pdf's integral is too large"
    )
    cause: ClassVar[str] = "abs instead of clamp in pdf"

    def lobe_pdf(self, wo, wi):
        return (self.p + 1.0) * (0.5 * ops.inv_pi) * ops.pow(ops.abs(ops.dot(wo, wi)), self.p)


class RetroBelow(go.BSDF):
    """Glass beads on a matte ground."""

    fault: ClassVar[str] = (
        "the test for the same side is o.z i.z > 0, which also holds with both directions below the surface: there f times i.z is negative"
    )
    cause: ClassVar[str] = "product test lets both-below through"
    kd: go.Colour = go.spectrum(0.3, "albedo of the matte part", low=0.0, high=1.0)
    ks: go.Colour = go.spectrum(0.6, "albedo of the beads", low=0.0, high=1.0)
    p: go.Number = go.number(6.0, "exponent of the beads' lobe", low=2.0, high=400.0)

    def eval(self, wo, wi, mode="radiance"):
        beads = (self.p + 2.0) * (0.5 * ops.inv_pi) * ops.pow(ops.dot(wo, wi), self.p)
        f = self.kd * (1.0 - self.ks) * ops.inv_pi + self.ks * beads
        return ops.where(wo.z * wi.z > 0.0, f * wi.z, 0.0)


class LunarDust(go.BSDF):
    """Dust by Lommel and Seeliger's law with a phase function 1 + b cos(phase angle)."""

    fault: ClassVar[str] = (
        "the phase function 1 + b cos g is declared for |b| up to 1.5, where it is negative: for b > 1 in forward, for b < -1 in backward scattering"
    )
    cause: ClassVar[str] = "phase function negative for large b"
    w: go.Colour = go.spectrum(0.6, "albedo of a grain", low=0.0, high=1.0)
    b: go.Number = go.number(0.5, "preference for scattering back", low=-1.5, high=1.5)

    def eval(self, wo, wi, mode="radiance"):
        phase = 1.0 + self.b * ops.dot(wo, wi)
        value = 0.25 * ops.inv_pi * phase * wi.z / ops.maximum(wo.z + wi.z, 1e-6)
        return self.w * ops.where((wo.z > 0.0) & (wi.z > 0.0), value, 0.0)


class PlasterTangent(go.BSDF):
    """Rough plaster by Oren and Nayar's qualitative model."""

    fault: ClassVar[str] = (
        "alpha and beta are exchanged: sin sin / min(cos_o, cos_i) instead of / max, so that f grows without bound at grazing, and the albedo exceeds 1 for rough bright plaster"
    )
    cause: ClassVar[str] = "larger and smaller angle exchanged"
    kd: go.Colour = go.spectrum(0.8, "albedo", low=0.0, high=1.0)
    sigma: go.Number = go.number(0.5, "deviation of the facets' slope angle", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        s2 = ops.sqr(self.sigma)
        a, b = 1.0 - 0.5 * s2 / (s2 + 0.33), 0.45 * s2 / (s2 + 0.09)
        across = ops.maximum(wo.x * wi.x + wo.y * wi.y, 0.0)  # sin sin cos(phi)
        f = ops.inv_pi * (a + b * across / ops.maximum(ops.minimum(wo.z, wi.z), 1e-4))
        return self.kd * ops.where((wo.z > 0.0) & (wi.z > 0.0), f * wi.z, 0.0)


class PaintRough(go.BSDF):
    """Burley's matte paint."""

    fault: ClassVar[str] = (
        "the factor that keeps the energy below 1 (1 / 1.51 at roughness 1) is missing: rough white paint reflects more than it receives at grazing views, smooth paint does not"
    )
    cause: ClassVar[str] = "energy factor of rough diffuse missing"
    kd: go.Colour = go.spectrum(0.8, "albedo", low=0.0, high=1.0)
    roughness: go.Number = go.number(0.5, "roughness", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        h = frame.half_vector(wo, wi)
        edge = 2.0 * self.roughness * ops.sqr(ops.dot(wi, h)) - 0.5
        a = 1.0 + edge * ops.pow(ops.maximum(1.0 - wo.z, 0.0), 5.0)
        b = 1.0 + edge * ops.pow(ops.maximum(1.0 - wi.z, 0.0), 5.0)
        return self.kd * ops.where((wo.z > 0.0) & (wi.z > 0.0), ops.inv_pi * a * b * wi.z, 0.0)


MUTANTS = [SheenBelow, SheenZero, RetroFrame, RetroAbs, RetroBelow, LunarDust, PlasterTangent, PaintRough]
