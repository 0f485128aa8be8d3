"""Materials that are wrong in a corner only: in a part of a range, in one channel, with values that differ by ray."""

from typing import ClassVar, NamedTuple

import gonio as go
import drjit as dr
import numpy as np
from gonio import ops
from gonio.ops import backend
from gonio.optics import frame, warp
from gonio.optics.ndf import distribution

GGX, BECKMANN = distribution("ggx"), distribution("beckmann")


def lit(wo, wi):
    """Whether both directions are above the surface."""
    return (wo.z > 0.0) & (wi.z > 0.0)


def drawn(material, wo, wi, mode):
    """The sample of a chosen direction, its weight eval / pdf."""
    pdf = material.pdf(wo, wi)
    weight = material.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
    return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


def around(axis, w):
    """w, given about +z, about a unit axis instead (Duff2017)."""
    side = ops.copysign(1.0 + 0.0 * axis.z, axis.z)
    a = -1.0 / (side + axis.z)
    b = axis.x * axis.y * a
    s = ops.vec3(1.0 + side * axis.x * axis.x * a, side * b, -side * axis.x)
    t = ops.vec3(b, side + axis.y * axis.y * a, -axis.y)
    return s * w.x + t * w.y + axis * w.z


class _Metal(go.BSDF):
    """GGX or Beckmann of two widths, correlated masking, visible normals."""

    r0: go.Colour = go.spectrum((0.9, 0.7, 0.5), "reflectance at the normal", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.25, "widths of the facets' distribution", low=0.01)
    turn: go.Angle = go.angle(0.0, "turn of the widths about the normal")

    def ndf(self):
        return GGX

    def fresnel(self, cos):
        return self.r0 + (1.0 - self.r0) * ops.pow(1.0 - cos, 5.0)

    def D(self, m):
        return self.ndf().D(m, self.alpha)

    def G(self, wo, wi):
        return 1.0 / (1.0 + self.ndf().Lambda(wo, self.alpha) + self.ndf().Lambda(wi, self.alpha))

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        o, i, h = (frame.rotate(w, self.turn) for w in (wo, wi, m))
        shape = ops.safe_div(self.D(h) * self.G(o, i), 4.0 * wo.z)
        return self.fresnel(ops.dot(wo, m)) * ops.where(lit(wo, wi), shape, 0.0)

    def pdf_width(self):
        return self.alpha

    def pdf(self, wo, wi):
        o, h = (frame.rotate(w, self.turn) for w in (wo, frame.half_vector(wo, wi)))
        return ops.where(lit(wo, wi), 0.25 * self.ndf().visible_per_cosine(o, h, self.pdf_width()), 0.0)

    def sample(self, wo, u, mode="radiance"):
        turned = frame.rotate(ops.vec3(wo.x, wo.y, ops.abs(wo.z)), self.turn)
        m = self.ndf().sample_visible(turned, u.y, u.z, self.alpha)
        return drawn(self, wo, frame.rotate_back(frame.reflect(turned, m), self.turn), mode)


class RoughUnmasked(_Metal):
    """A metal, smooth to rough."""

    fault: ClassVar[str] = "above alpha = .6 masking is left out: at grazing more light leaves than arrives"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"

    def G(self, wo, wi):
        return ops.where(ops.maximum(self.alpha.x, self.alpha.y) > 0.6, 1.0, super().G(wo, wi))


class NarrowPdfFloor(_Metal):
    """A metal with a floor under the width."""

    fault: ClassVar[str] = "pdf holds each width above .08, eval and sample do not: wrong for narrow lobes only"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "anisotropic"

    def pdf_width(self):
        return ops.vec2(ops.maximum(self.alpha.x, 0.08), ops.maximum(self.alpha.y, 0.08))


class TurnedWrongWayBack(_Metal):
    """A metal that can be turned."""

    fault: ClassVar[str] = "sample turns its direction once more instead of back: wrong where turn is not 0"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "anisotropic"
    alpha: go.Width = go.width((0.15, 0.5), "widths of the facets' distribution", low=0.01)

    def sample(self, wo, u, mode="radiance"):
        turned = frame.rotate(ops.vec3(wo.x, wo.y, ops.abs(wo.z)), self.turn)
        m = self.ndf().sample_visible(turned, u.y, u.z, self.alpha)
        return drawn(self, wo, frame.rotate(frame.reflect(turned, m), self.turn), mode)


class BeckmannForgotten(_Metal):
    """A metal of either distribution."""

    fault: ClassVar[str] = "with beckmann chosen D lacks 1 / m.z^4 in eval and pdf, which sample is not told of"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    alpha: go.Width = go.width(0.5, "widths of the facets' distribution", low=0.01)
    shape: str = go.choice("ggx", "distribution of normals", {"ggx": "long tails", "beckmann": "Gaussian slopes"})

    def ndf(self):
        return GGX if self.shape == "ggx" else BECKMANN

    def forgotten(self, m):
        return 1.0 + 0.0 * m.z if self.shape == "ggx" else ops.sqr(ops.sqr(m.z))

    def D(self, m):
        return super().D(m) * self.forgotten(m)

    def pdf(self, wo, wi):
        return super().pdf(wo, wi) * self.forgotten(frame.half_vector(wo, wi))


class GrazingFloor(_Metal):
    """A metal without fireflies at its rim."""

    fault: ClassVar[str] = "the viewer's cosine in the denominator is held above .15: not reciprocal near grazing"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        shape = self.D(m) * self.G(wo, wi) / (4.0 * ops.maximum(wo.z, 0.15))
        return self.fresnel(ops.dot(wo, m)) * ops.where(lit(wo, wi), shape, 0.0)


class ClearcoatForgotten(_Metal):
    """A metal with a clear coat that can be switched on."""

    fault: ClassVar[str] = "with the coat on, sample draws from it in a quarter of the cases and pdf does not know"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    coat: bool = go.flag(False, "whether there is a clear coat")

    def eval(self, wo, wi, mode="radiance"):
        base = super().eval(wo, wi, mode)
        if not self.coat:
            return base
        m, narrow = frame.half_vector(wo, wi), 0.1 * self.alpha
        g = 1.0 / (1.0 + GGX.Lambda(wo, narrow) + GGX.Lambda(wi, narrow))
        f = 0.04 + 0.96 * ops.pow(1.0 - ops.dot(wo, m), 5.0)
        left = 1.0 - (0.04 + 0.96 * ops.pow(1.0 - wo.z, 5.0))
        left = left * (1.0 - (0.04 + 0.96 * ops.pow(1.0 - wi.z, 5.0)))
        coat = ops.where(lit(wo, wi), f * ops.safe_div(GGX.D(m, narrow) * g, 4.0 * wo.z), 0.0)
        return base * left + coat

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        if not self.coat:
            return s
        up = ops.vec3(wo.x, wo.y, ops.abs(wo.z))
        wi = frame.reflect(up, GGX.sample_visible(up, u.y, u.z, 0.1 * self.alpha))
        return drawn(self, wo, ops.where(u.x < 0.25, wi, s.wi), mode)


class CoatAtOne(go.BSDF):
    """A matte base that shows where a film of varying cover leaves it free; film and base exchange light."""

    fault: ClassVar[str] = "the light between film and base is summed as (1 - c) / (1 - c): 0/0 at full cover"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    kd: go.Colour = go.spectrum(0.5, "share of light that the base reflects", low=0.0, high=1.0)
    cover: go.Number = go.number(0.5, "cover of the film", low=0.0, high=1.0)

    def eval(self, wo, wi):
        free = 1.0 - self.cover
        bounce = free / (1.0 - self.cover)
        return self.kd * ops.where(lit(wo, wi), bounce * (free + 0.5 * self.cover) * wi.z * ops.inv_pi, 0.0)


class BlackPaintNan(go.BSDF):
    """A matte part and a glossy one, sampled by what each reflects."""

    fault: ClassVar[str] = (
        "the share of a lobe is its colour over the sum of both: 0/0 in pdf and sample where all is black"
    )
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    kd: go.Colour = go.spectrum((0.3, 0.1, 0.1), "share of light in the matte part", low=0.0, high=0.5)
    ks: go.Colour = go.spectrum(0.3, "share of light in the highlight", low=0.0, high=0.5)
    p: go.Number = go.number(30.0, "exponent", low=1.0, high=1000.0)

    def share(self):
        return ops.mean(self.ks) / (ops.mean(self.ks) + ops.mean(self.kd))

    def peak(self, wo, wi):
        return ops.pow(ops.dot(frame.mirror(wo), wi), self.p) * (0.5 * ops.inv_pi)

    def eval(self, wo, wi, mode="radiance"):
        value = self.kd * ops.inv_pi + self.ks * ((self.p + 2.0) * self.peak(wo, wi))
        return ops.where(lit(wo, wi), value * wi.z, 0.0)

    def pdf(self, wo, wi):
        share = self.share()
        both = share * (self.p + 1.0) * self.peak(wo, wi) + (1.0 - share) * wi.z * ops.inv_pi
        return ops.where(lit(wo, wi), both, 0.0)

    def sample(self, wo, u, mode="radiance"):
        gloss = around(frame.mirror(wo), warp.square_to_power_lobe(u.y, u.z, self.p))
        return drawn(self, wo, ops.where(u.x < self.share(), gloss, warp.square_to_cosine_hemisphere(u.y, u.z)), mode)


class InkNan(go.BSDF):
    """Ink on white paper: the way through the ink grows with the angle (Beer and Lambert)."""

    fault: ClassVar[str] = "absorption is -log of the colour: a channel that is 0 gives inf, and 0 * inf is no number"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    colour: go.Colour = go.spectrum((0.8, 0.4, 0.2), "share of light that passes the ink upright", low=0.0, high=1.0)
    strength: go.Number = go.number(0.5, "amount of ink", low=0.0, high=1.0)

    def eval(self, wo, wi):
        way = self.strength * (0.5 / ops.maximum(wo.z, 0.1) + 0.5 / ops.maximum(wi.z, 0.1))
        passed = ops.exp(ops.log(self.colour) * (way * ops.where(lit(wo, wi), 1.0, 0.0)))
        return passed * ops.where(lit(wo, wi), wi.z * ops.inv_pi, 0.0)


class RetroOverflow(go.BSDF):
    """A lobe of von Mises and Fisher back to the light."""

    fault: ClassVar[str] = "normalized by sinh(kappa), which overflows float32 above kappa = 89: NaN"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    ks: go.Colour = go.spectrum(0.8, "share of light that goes back", low=0.0, high=1.0)
    kappa: go.Number = go.number(20.0, "concentration", low=1.0, high=400.0)

    def eval(self, wo, wi):
        sinh = 0.5 * (ops.exp(self.kappa) - ops.exp(-self.kappa))
        lobe = self.kappa / (4.0 * ops.pi * sinh) * ops.exp(self.kappa * ops.dot(wo, wi))
        return self.ks * ops.where(lit(wo, wi), lobe * wi.z, 0.0)


class DispersedBlue(go.BSDF):
    """A highlight that is wider in red and blue."""

    fault: ClassVar[str] = "the blue lobe has half the exponent but the normalization of the whole: it gains light"
    cause: ClassVar[str] = "normalization of one channel (blue)"
    kind: ClassVar[str] = "smooth"
    ks: go.Colour = go.spectrum((0.8, 0.8, 0.8), "share of light in the highlight", low=0.0, high=1.0)
    p: go.Number = go.number(20.0, "exponent", low=1.0, high=500.0)

    def eval(self, wo, wi):
        c = ops.dot(frame.mirror(wo), wi)
        red = (0.8 * self.p + 2.0) * ops.pow(c, 0.8 * self.p)
        green = (self.p + 2.0) * ops.pow(c, self.p)
        blue = (self.p + 2.0) * ops.pow(c, 0.5 * self.p)
        rgb = ops.vec3(red, green, blue) * (0.5 * ops.inv_pi * wi.z)
        return self.ks * ops.where(lit(wo, wi), rgb, 0.0)


class LowExponent(go.BSDF):
    """Normalized Phong."""

    fault: ClassVar[str] = "sample holds the exponent above 1, eval and pdf do not: wrong for p < 1 only"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    ks: go.Colour = go.spectrum(0.8, "share of light in the highlight", low=0.0, high=1.0)
    p: go.Number = go.number(10.0, "exponent", low=0.0, high=500.0)

    def peak(self, wo, wi):
        return ops.pow(ops.dot(frame.mirror(wo), wi), self.p) * (0.5 * ops.inv_pi)

    def eval(self, wo, wi, mode="radiance"):
        return self.ks * ops.where(lit(wo, wi), (self.p + 1.0) * self.peak(wo, wi) * wi.z, 0.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), (self.p + 1.0) * self.peak(wo, wi), 0.0)

    def sample(self, wo, u, mode="radiance"):
        lobe = warp.square_to_power_lobe(u.y, u.z, ops.maximum(self.p, 1.0))
        return drawn(self, wo, around(frame.mirror(wo), lobe), mode)


class TexturedNorm(LowExponent):
    """Normalized Phong that computes its normalization once."""

    fault: ClassVar[str] = "the normalization is that of the largest exponent of all rays; by p it has no derivative"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "textured"
    p: go.Number = go.number(10.0, "exponent", low=1.0, high=500.0)

    def norm(self):
        p = self.plain.p
        return 11.0 if backend.is_drjit(p) else float(np.max(np.asarray(p, float))) + 1.0

    def eval(self, wo, wi, mode="radiance"):
        return self.ks * ops.where(lit(wo, wi), self.norm() * self.peak(wo, wi) * wi.z, 0.0)


class FirstRow(NamedTuple):
    """What is found once."""

    p: object


class TexturedFirst(LowExponent):
    """Normalized Phong that derives its exponent from a glossiness."""

    fault: ClassVar[str] = "what it derives comes from the first ray's glossiness, so a textured one is ignored"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "textured"
    p: go.Number = go.number(10.0, "exponent", low=1.0, high=500.0)

    def derive(self):
        first = self.p
        if backend.is_drjit(first) and dr.width(first) > 1:
            first = dr.gather(type(first), first, dr.uint32_array_t(type(first))(0))
        return FirstRow(first)

    def peak(self, wo, wi):
        return ops.pow(ops.dot(frame.mirror(wo), wi), self.derived.p) * (0.5 * ops.inv_pi)


class TexturedMeanShare(BlackPaintNan):
    """A matte part and a glossy one, sampled by what each reflects."""

    fault: ClassVar[str] = "sample picks the lobe by the mean share over all rays of the batch, pdf by the ray's own"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "textured"

    def share(self):
        return 0.05 + 0.9 * ops.safe_div(ops.mean(self.ks), ops.mean(self.ks) + ops.mean(self.kd))

    def sample(self, wo, u, mode="radiance"):
        share = self.share()
        if backend.is_drjit(share) and dr.width(share) > 1:
            share = dr.mean(dr.detach(share))
        gloss = around(frame.mirror(wo), warp.square_to_power_lobe(u.y, u.z, self.p))
        return drawn(self, wo, ops.where(u.x < share, gloss, warp.square_to_cosine_hemisphere(u.y, u.z)), mode)


MUTANTS = [
    RoughUnmasked, NarrowPdfFloor, TurnedWrongWayBack, BeckmannForgotten, GrazingFloor, ClearcoatForgotten, CoatAtOne,
    BlackPaintNan, InkNan, RetroOverflow, DispersedBlue, LowExponent, TexturedNorm, TexturedFirst, TexturedMeanShare,
]  # fmt: skip
SOUND = []
