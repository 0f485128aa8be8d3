"""Third examiner: reflection without delta lobes; each class carries one mistake."""

from __future__ import annotations

from typing import ClassVar

import gonio as go
import numpy as np
from gonio import ops
from gonio.optics import frame, warp
from gonio.optics.ndf import distribution

GGX = distribution("ggx")


class _Glossy(go.BSDF):
    """GGX with Schlick's Fresnel over a matte base that receives what the highlight leaves. Sound as it stands."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""

    kd: go.Colour = go.spectrum((0.6, 0.35, 0.2), "share of light that the base reflects", low=0.0, high=0.8)
    r0: go.Colour = go.spectrum(0.08, "reflectance of the highlight at normal incidence", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.3, "width of the highlight; two for anisotropy", low=0.01, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        up = (wo.z > 0.0) & (wi.z > 0.0)
        return ops.where(up, self.base(wo, wi) + self.highlight(wo, wi), 0.0)

    def fresnel(self, cos):
        return self.r0 + (1.0 - self.r0) * ops.pow(1.0 - cos, 5.0)

    def G(self, wo, wi):
        return 1.0 / (1.0 + GGX.Lambda(wo, self.alpha) + GGX.Lambda(wi, self.alpha))

    def highlight(self, wo, wi):
        """times cos theta_i"""
        m = frame.half_vector(wo, wi)
        dg = GGX.D(m, self.alpha) * self.G(wo, wi)
        return self.fresnel(ops.abs(ops.dot(wo, m))) * ops.safe_div(dg, 4.0 * ops.abs(wo.z))

    def base(self, wo, wi):
        """times cos theta_i"""
        left_o = 1.0 - ops.pow(1.0 - wo.z, 5.0)
        left_i = 1.0 - ops.pow(1.0 - wi.z, 5.0)
        return self.kd * (1.0 - self.r0) * (left_o * left_i * wi.z * (21.0 / 20.0 / ops.pi))

    def share(self, wo):
        shiny = ops.mean(self.fresnel(ops.abs(wo.z)))
        return ops.safe_div(shiny, shiny + (1.0 - shiny) * ops.mean(self.kd))

    def shiny_pdf(self, wo, wi):
        return 0.25 * GGX.visible_per_cosine(wo, frame.half_vector(wo, wi), self.alpha)

    def shiny_sample(self, wo, u1, u2):
        upper = ops.where(wo.z < 0.0, -wo, wo)
        return frame.reflect(wo, GGX.sample_visible(upper, u1, u2, self.alpha))

    def pdf(self, wo, wi):
        s = self.share(wo)
        density = s * self.shiny_pdf(wo, wi) + (1.0 - s) * wi.z * ops.inv_pi
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), density, 0.0)

    def direction(self, wo, u):
        shiny = self.shiny_sample(wo, u.y, u.z)
        return ops.where(u.x < self.share(wo), shiny, warp.square_to_cosine_hemisphere(u.y, u.z))

    def finish(self, wo, wi, mode):
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)

    def sample(self, wo, u, mode="radiance"):
        return self.finish(wo, self.direction(wo, u), mode)


class VisibleNormalsPlainDensity(_Glossy):
    fault = "visible normals are sampled, and pdf still is the density of all normals, D cos / (4 o.m)"
    cause = "pdf lacks G1 / cos of the visible normals"

    def shiny_pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        return ops.safe_div(GGX.D(m, self.alpha) * m.z, 4.0 * ops.dot(wo, m))


class BlueFresnelAtNormal(_Glossy):
    fault = "the blue channel's Fresnel factor is taken at wo's angle to the surface, red and green at the half vector"
    cause = "one channel's Fresnel depends on wo alone: not reciprocal in blue"

    rim: go.Colour = go.spectrum((0.0, 0.0, 1.0), "how much of a channel's Fresnel is the rim's", low=0.0, high=1.0)

    def highlight(self, wo, wi):
        m = frame.half_vector(wo, wi)
        dg = ops.safe_div(GGX.D(m, self.alpha) * self.G(wo, wi), 4.0 * ops.abs(wo.z))
        f = self.fresnel(ops.abs(ops.dot(wo, m)))
        g = self.fresnel(ops.abs(wo.z))
        return (f * (1.0 - self.rim) + g * self.rim) * dg


class GreyWeight(_Glossy):
    fault = "the sample's weight is the mean of the channels over the pdf: sampled light loses its colour"
    cause = "mean of the channels in weight instead of eval per channel"

    def finish(self, wo, wi, mode):
        pdf = self.pdf(wo, wi)
        grey = ops.mean(self.eval(wo, wi, mode)) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, grey * (self.kd * 0.0 + 1.0), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class ChoiceNumberAgain(_Glossy):
    fault = "the number that chose the lobe serves again as the diffuse azimuth without being stretched to [0, 1)"
    cause = "u.x is reused unscaled after the choice of the lobe: a sector of azimuths is never sampled"

    def direction(self, wo, u):
        shiny = self.shiny_sample(wo, u.y, u.z)
        return ops.where(u.x < self.share(wo), shiny, warp.square_to_cosine_hemisphere(u.y, u.x))


class OneLobeDensity(_Glossy):
    fault = "sample reports value and density of the chosen lobe alone, pdf and eval those of both"
    cause = "sample's pdf leaves out the lobe that was not chosen"

    def sample(self, wo, u, mode="radiance"):
        wi = self.direction(wo, u)
        s = self.share(wo)
        up = (wo.z > 0.0) & (wi.z > 0.0)
        shiny = u.x < s
        pdf = ops.where(shiny, s * self.shiny_pdf(wo, wi), (1.0 - s) * wi.z * ops.inv_pi)
        pdf = ops.where(up, pdf, 0.0)
        value = ops.where(shiny, self.highlight(wo, wi), self.base(wo, wi))
        weight = ops.where(up, value, 0.0) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class TurnedBackTooFar(_Glossy):
    fault = (
        "both sides shine; from below wo is mirrored at the surface, but the sample is returned as -wi, not mirrored"
    )
    cause = "below the surface the sampled direction is negated instead of mirrored: wrong azimuth"

    def eval(self, wo, wi, mode="radiance"):
        a, b = self.turned(wo, wo), self.turned(wi, wo)
        return ops.where((a.z > 0.0) & (b.z > 0.0), self.base(a, b) + self.highlight(a, b), 0.0)

    def pdf(self, wo, wi):
        a, b = self.turned(wo, wo), self.turned(wi, wo)
        s = self.share(a)
        density = s * self.shiny_pdf(a, b) + (1.0 - s) * b.z * ops.inv_pi
        return ops.where((a.z > 0.0) & (b.z > 0.0), density, 0.0)

    def turned(self, w, wo):
        return ops.vec3(w.x, w.y, ops.where(wo.z < 0.0, -w.z, w.z))

    def sample(self, wo, u, mode="radiance"):
        above = self.turned(wo, wo)
        s = self.finish(above, self.direction(above, u), mode)
        return go.Sample(ops.where(wo.z < 0.0, -s.wi, s.wi), s.weight, s.pdf, s.delta, s.eta)

    @property
    def two_sided(self):
        return True


_KEPT: dict[str, float] = {}


class KeptNormalization(go.BSDF):
    fault = (
        "the density's normalization is kept from the first material of this class, whatever exponent later ones have"
    )
    cause = "state kept between calls: pdf uses the exponent of the first material made"

    p: go.Number = go.number(20.0, "exponent of the lobe of half vectors", low=1.0, high=500.0)

    def highlight(self, wo, wi):
        m = frame.half_vector(wo, wi)
        lower = ops.minimum(wo.z, wi.z)
        g = ops.minimum(1.0, 2.0 * m.z * ops.safe_div(lower, ops.dot(wo, m)))
        return (self.p + 2.0) * (0.5 * ops.inv_pi) * ops.pow(m.z, self.p) * ops.safe_div(g, 4.0 * wo.z)

    def eval(self, wo, wi, mode="radiance"):
        white = ops.vec3(1.0 + 0.0 * wo.z, 1.0 + 0.0 * wo.z, 1.0 + 0.0 * wo.z)
        return white * ops.where((wo.z > 0.0) & (wi.z > 0.0), self.highlight(wo, wi), 0.0)

    def pdf(self, wo, wi):
        if "norm" not in _KEPT:
            _KEPT["norm"] = (float(np.max(np.asarray(self.plain.p))) + 2.0) / (2.0 * np.pi)
        m = frame.half_vector(wo, wi)
        density = _KEPT["norm"] * ops.pow(m.z, self.p + 1.0) * ops.safe_div(1.0, 4.0 * ops.dot(wo, m))
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        m = warp.square_to_power_lobe(u.y, u.z, self.p + 1.0)
        wi = frame.reflect(wo, m)
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class SixteenBitRows(_Glossy):
    fault = "rays are counted in sixteen bits: in batches of more than 65536 rows eval gives 0 for the rows beyond"
    cause = "large batches: rows past 65536 are never evaluated"

    def eval(self, wo, wi, mode="radiance"):
        value = ops.where((wo.z > 0.0) & (wi.z > 0.0), self.base(wo, wi) + self.highlight(wo, wi), 0.0)
        if not ops.is_drjit(wo.z):
            return value
        import drjit as dr

        if dr.flag(dr.JitFlag.SymbolicScope):
            return value
        rows = max(dr.width(wo), dr.width(wi))
        if rows <= 65536:
            return value
        row = dr.arange(dr.uint32_array_t(type(wo.z)), rows)
        return ops.where(row < 65536, value, 0.0)


class ImportanceTakesOtherCosine(_Glossy):
    fault = "in mode importance eval carries the cosine of wo instead of wi's"
    cause = "mode importance: wrong cosine"

    def eval(self, wo, wi, mode="radiance"):
        up = (wo.z > 0.0) & (wi.z > 0.0)
        value = ops.where(up, self.base(wo, wi) + self.highlight(wo, wi), 0.0)
        if mode == "importance":
            value = value * ops.safe_div(wo.z, ops.maximum(wi.z, 1e-4))
        return value


class RotatedTwice(_Glossy):
    fault = "sample turns wi forward once more where it has to turn it back out of the brushed frame"
    cause = "rotation applied with the wrong sense on the way out of sample"

    alpha: go.Width = go.width((0.08, 0.5), "widths along and across the brush", low=0.01, high=1.0)
    rotation: go.Angle = go.angle(0.5, "turn of the brush")

    def eval(self, wo, wi, mode="radiance"):
        a, b = frame.rotate(wo, self.rotation), frame.rotate(wi, self.rotation)
        return ops.where((a.z > 0.0) & (b.z > 0.0), self.base(a, b) + self.highlight(a, b), 0.0)

    def pdf(self, wo, wi):
        a, b = frame.rotate(wo, self.rotation), frame.rotate(wi, self.rotation)
        s = self.share(a)
        density = s * self.shiny_pdf(a, b) + (1.0 - s) * b.z * ops.inv_pi
        return ops.where((a.z > 0.0) & (b.z > 0.0), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        a = frame.rotate(wo, self.rotation)
        return self.finish(wo, frame.rotate(self.direction(a, u), self.rotation), mode)


class RedWeave(_Glossy):
    fault = "the red threads reflect by the azimuth of both directions, and the material says that it is isotropic"
    cause = "anisotropy that is not declared (isotropic is left True), in the red channel"

    thread: go.Colour = go.spectrum((0.8, 0.0, 0.0), "how much of the base is threads", low=0.0, high=1.0)

    def base(self, wo, wi):
        b = super().base(wo, wi)
        red = (0.5 + 0.5 * self.azimuth(wo)) * (0.5 + 0.5 * self.azimuth(wi))
        return b * (1.0 - self.thread * (1.0 - red))

    def azimuth(self, w):
        """cos(3 phi)^2 sin^6, a polynomial"""
        return ops.sqr(w.x * (w.x * w.x - 3.0 * w.y * w.y))


class FoldedBackUp(_Glossy):
    fault = "a sampled direction below the horizon is folded up by |z| so as not to lose it; pdf does not know"
    cause = "failed samples are mirrored back above the surface instead of failing"

    def direction(self, wo, u):
        wi = super().direction(wo, u)
        return ops.vec3(wi.x, wi.y, ops.where(wo.z > 0.0, ops.abs(wi.z), wi.z))


class ClampedWeight(_Glossy):
    fault = "sample clamps its weight to 1 against fireflies, the value in eval stays"
    cause = "weight is clamped: it is not eval / pdf"

    kd: go.Colour = go.spectrum((0.8, 0.3, 0.05), "share of light that the base reflects", low=0.0, high=0.8)

    def finish(self, wo, wi, mode):
        s = super().finish(wo, wi, mode)
        return go.Sample(wi, ops.minimum(s.weight, 1.0), s.pdf, s.delta, s.eta)


class SafetyLobe(_Glossy):
    fault = "a tenth of the samples is meant to be uniform over the hemisphere, but is drawn uniform in the polar angle"
    cause = "uniform polar angle without the sine: the safety lobe's pdf 1/(2 pi) is not its density"

    def pdf(self, wo, wi):
        s = self.share(wo)
        density = s * self.shiny_pdf(wo, wi) + (1.0 - s) * wi.z * ops.inv_pi
        density = 0.9 * density + 0.1 * (0.5 * ops.inv_pi)
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), density, 0.0)

    def direction(self, wo, u):
        safe = u.x < 0.1
        rest = ops.vec3((u.x - 0.1) / 0.9, u.y, u.z)
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        sin_t, cos_t = ops.sincos(0.5 * ops.pi * u.y)
        return ops.where(safe, ops.vec3(sin_t * c, sin_t * s, cos_t), super().direction(wo, rest))


class RingTable(go.BSDF):
    fault = "the search in the table of rings stops one entry early: the ring about the normal is never sampled"
    cause = "off by one in the search of the cumulated table"

    kd: go.Colour = go.spectrum(0.9, "share of light that the brightest rings reflect", low=0.0, high=1.0)

    TABLE: ClassVar[tuple[float, ...]] = (0.2, 0.9, 0.4, 0.6, 1.0, 0.5, 0.8, 0.7)

    def at(self, z):
        x = ops.sqr(z) * 8.0
        value = self.TABLE[0] + 0.0 * z
        for k in range(1, 8):
            value = ops.where(x >= float(k), self.TABLE[k], value)
        return value

    def eval(self, wo, wi, mode="radiance"):
        up = (wo.z > 0.0) & (wi.z > 0.0)
        return self.kd * ops.where(up, self.at(wo.z) * self.at(wi.z) * wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        up = (wo.z > 0.0) & (wi.z > 0.0)
        return ops.where(up, self.at(wi.z) * (8.0 / sum(self.TABLE)) * wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        total, below = sum(self.TABLE), 0.0
        ring = 0.0 * u.y
        for k in range(6):  # seven thresholds part eight rings
            below += self.TABLE[k] / total
            ring = ops.where(u.y >= below, float(k + 1), ring)
        z2 = (ring + u.x) / 8.0
        r = ops.safe_sqrt(1.0 - z2)
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        wi = ops.vec3(r * c, r * s, ops.safe_sqrt(z2))
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class LightLeak(_Glossy):
    fault = "the highlight forgets to ask whether the light is above the surface: lights from just behind shine through"
    cause = "eval is not 0 for wi below the surface, though nothing is transmitted"

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        matte = ops.where((wo.z > 0.0) & (wi.z > 0.0), self.base(wo, wi), 0.0)
        shiny = ops.where((wo.z > 0.0) & (m.z > 0.0), self.highlight(wo, wi), 0.0)
        return matte + shiny


class ShareAtTheFacet(_Glossy):
    fault = "pdf weighs the lobes by the Fresnel factor at the half vector, sample by the one at the normal"
    cause = "probability of the lobe in pdf depends on wi: it is not the one that sample uses"

    def pdf(self, wo, wi):
        shiny = ops.mean(self.fresnel(ops.abs(ops.dot(wo, frame.half_vector(wo, wi)))))
        s = ops.safe_div(shiny, shiny + (1.0 - shiny) * ops.mean(self.kd))
        density = s * self.shiny_pdf(wo, wi) + (1.0 - s) * wi.z * ops.inv_pi
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), density, 0.0)


class NarrowWidthTwice(_Glossy):
    fault = (
        "the anisotropic lobe is normalized by pi ax^2 instead of pi ax ay: twice as bright as it may be; pdf is right"
    )
    cause = "normalization of D uses one width twice: more light leaves than comes"

    alpha: go.Width = go.width((0.2, 0.4), "widths along x and y", low=0.01, high=1.0)

    def highlight(self, wo, wi):
        return super().highlight(wo, wi) * (self.alpha.y / self.alpha.x)


MUTANTS = [
    VisibleNormalsPlainDensity, BlueFresnelAtNormal, GreyWeight, ChoiceNumberAgain,
    OneLobeDensity, TurnedBackTooFar, KeptNormalization, SixteenBitRows, ImportanceTakesOtherCosine, RotatedTwice,
    RedWeave, FoldedBackUp, ClampedWeight, SafetyLobe, RingTable, LightLeak, ShareAtTheFacet, NarrowWidthTwice,
]  # fmt: skip
SOUND = []
