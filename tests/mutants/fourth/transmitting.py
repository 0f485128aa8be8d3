"""Transmitting materials, each with one mistake."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.materials.microfacet.dielectric import Dielectric
from gonio.optics import frame, warp
from gonio.optics import fresnel as fr
from gonio.optics.ndf import distribution


class PlainJacobian(Dielectric):
    """Rough glass whose density of refracted directions has a half Jacobian."""

    fault: ClassVar[str] = "The pdf of refraction lacks the eta^2 of Walter's Jacobian; weights are eval over that pdf."
    cause: ClassVar[str] = "Jacobian of refraction, missing eta^2 in pdf"
    alpha: go.Width = go.width(0.3, "width")

    def _density(self, facet, eta):
        return super()._density(facet, eta) * ops.where(facet.reflects, 1.0, 1.0 / ops.sqr(eta))


class ModeForgotten(Dielectric):
    """Rough glass that knows only radiance."""

    fault: ClassVar[str] = "eval and sample ignore the mode: importance is scaled as radiance is."
    cause: ClassVar[str] = "mode ignored, importance treated as radiance"
    alpha: go.Width = go.width(0.25, "width")

    def eval(self, wo, wi, mode="radiance"):
        return super().eval(wo, wi, "radiance")

    def sample(self, wo, u, mode="radiance"):
        return super().sample(wo, u, "radiance")


class ModeInSampleOnly(Dielectric):
    """Rough glass whose sample scales by the inverse factor from inside."""

    fault: ClassVar[str] = "sample in importance mode multiplies by the inside index squared also for rays that leave."
    cause: ClassVar[str] = "importance weight of sample uses eta, not relative eta, when leaving"
    alpha: go.Width = go.width(0.25, "width")

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, "radiance")
        through = wo.z * s.wi.z < 0.0
        scale = ops.where(through, ops.sqr(self.eta), 1.0) if mode == "importance" else 1.0 + 0.0 * wo.z
        return go.Sample(s.wi, s.weight * scale, s.pdf, s.delta, s.eta)


class SchlickInside(Dielectric):
    """Rough glass by Schlick's curve."""

    fault: ClassVar[str] = "Schlick's curve is evaluated at the incident cosine also from the denser side."
    cause: ClassVar[str] = "Fresnel from inside uses the wrong cosine; transmission not reciprocal"
    alpha: go.Width = go.width(0.3, "width")

    def reflectance(self, cos_o, cos_t, eta):
        r0 = fr.r0_dielectric(eta)
        return ops.where(cos_t > 0.0, r0 + (1.0 - r0) * ops.pow(1.0 - cos_o, 5.0), 1.0)


class ImportanceOfBubble(Dielectric):
    """Rough glass whose importance is written for glass, not for bubbles."""

    fault: ClassVar[str] = (
        "The importance factor assumes the inside to be denser: wrong for eta < 1, in eval and sample alike."
    )
    cause: ClassVar[str] = "importance factor uses max(eta, 1/eta); wrong for eta < 1"
    alpha: go.Width = go.width(0.3, "width")

    def _factor(self, wo, wi):
        dense = ops.maximum(self.eta, 1.0 / self.eta)
        factor = ops.where(wo.z > 0.0, ops.sqr(dense), 1.0 / ops.sqr(dense))
        return ops.where(wo.z * wi.z > 0.0, 1.0, factor)

    def eval(self, wo, wi, mode="radiance"):
        value = super().eval(wo, wi, "radiance")
        return value * self._factor(wo, wi) if mode == "importance" else value

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, "radiance")
        weight = s.weight * self._factor(wo, s.wi) if mode == "importance" else s.weight
        return go.Sample(s.wi, weight, s.pdf, s.delta, s.eta)


class SmoothUnscaled(Dielectric):
    """Glass, rough or smooth."""

    fault: ClassVar[str] = "At alpha = 0 the refracted ray carries radiance without the factor 1 / eta^2."
    cause: ClassVar[str] = "smooth transmission lacks the radiance factor (eta_o/eta_i)^2"
    alpha: go.Width = go.width(0.0, "width")

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        if mode == "radiance":
            return go.Sample(s.wi, ops.where(s.delta, s.weight * ops.sqr(s.eta), s.weight), s.pdf, s.delta, s.eta)
        return s


# ------------------------------------------------------------------------------------- thin sheets


class _Sheet(go.BSDF):
    """A sheet of frosted glass: a GGX lobe reflected, and its mirror image transmitted; air on both sides."""

    eta: go.Number = go.number(1.5, "index of the sheet", low=1.01, high=3.0)
    alpha: go.Width = go.width(0.3, "width of the lobes", low=0.02)
    tint: go.Colour = go.spectrum((0.9, 0.7, 0.5), "share of the entering light that passes", low=0.0, high=1.0)

    @property
    def transmits(self):
        return True

    def R(self, cos):
        """Reflectance of the whole sheet, all bounces inside counted, seen under cos."""
        f = self.F(cos)
        return 2.0 * f / (1.0 + f)

    def T(self, cos):
        """Transmittance of the whole sheet."""
        return 1.0 - self.R(cos)

    def F(self, cos):
        cos_t = fr.cos_transmitted(cos, self.eta)
        return fr.kind("exact").dielectric(cos, cos_t, self.eta)

    def passes(self, wo, wi):
        """Colour of what passes."""
        return self.tint

    def through(self):
        """Widths of the transmitted lobe."""
        return self.alpha

    def through_drawn(self):
        """Widths of the normals drawn for the transmitted lobe."""
        return self.through()

    def turned(self, wo, wi):
        """Both directions on the upper side."""
        up = ops.where(wo.z < 0.0, -1.0 + 0.0 * wo.z, 1.0 + 0.0 * wo.z)
        return ops.vec3(wo.x, wo.y, ops.abs(wo.z)), ops.vec3(wi.x, wi.y, ops.abs(wi.z)), up

    def lobe(self, o, i, alpha):
        """D G / (4 cos_o)."""
        ggx = distribution("ggx")
        m = frame.half_vector(o, i)
        g = 1.0 / (1.0 + ggx.Lambda(o, alpha) + ggx.Lambda(i, alpha))
        return ops.safe_div(ggx.D(m, alpha) * g, 4.0 * o.z)

    def lobe_pdf(self, o, i, alpha):
        return 0.25 * distribution("ggx").visible_per_cosine(o, frame.half_vector(o, i), alpha)

    def eval(self, wo, wi, mode="radiance"):
        o, i, _ = self.turned(wo, wi)
        cos = ops.abs(ops.dot(o, frame.half_vector(o, i)))
        same, other = wo.z * wi.z > 0.0, wo.z * wi.z < 0.0
        value = ops.where(same, self.lobe(o, i, self.alpha) * self.R(cos), 0.0) + 0.0 * self.tint
        return value + self.passes(wo, wi) * ops.where(other, self.lobe(o, i, self.through()) * self.T(cos), 0.0)

    def share(self, wo):
        return 0.5 + 0.0 * wo.z

    def pdf(self, wo, wi):
        o, i, _ = self.turned(wo, wi)
        share = self.share(wo)
        same, other = wo.z * wi.z > 0.0, wo.z * wi.z < 0.0
        reflected = ops.where(same, self.lobe_pdf(o, i, self.alpha) * share, 0.0)
        return reflected + ops.where(other, self.lobe_pdf(o, i, self.through()) * (1.0 - share), 0.0)

    def sample(self, wo, u, mode="radiance"):
        o, _, up = self.turned(wo, wo)
        reflects = u.x < self.share(wo)
        ggx = distribution("ggx")
        m = ggx.sample_visible(o, u.y, u.z, self.alpha)
        n = ggx.sample_visible(o, u.y, u.z, self.through_drawn())
        i = frame.reflect(o, ops.where(reflects, m, n))
        wi = ops.vec3(i.x, i.y, i.z * ops.where(reflects, up, -up))
        pdf = ops.where(i.z > 0.0, self.pdf(wo, wi), 0.0)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class SheetAddsBounces(_Sheet):
    """Frosted sheet."""

    fault: ClassVar[str] = (
        "Reflection counts the bounces inside the sheet, R + T^2 R / (1 - R^2), transmission is 1 - R of one side."
    )
    cause: ClassVar[str] = "energy: R of the sheet and T of one interface add to over 1"

    alpha: go.Width = go.width(0.08, "width of the lobes", low=0.02)
    tint: go.Colour = go.spectrum(1.0, "share of the entering light that passes", low=0.0, high=1.0)

    def T(self, cos):
        return 1.0 - self.F(cos)


class SheetBeerOneWay(_Sheet):
    """Frosted sheet of coloured glass."""

    fault: ClassVar[str] = "The colour of the sheet is raised to 1 / cos of the viewer's direction alone."
    cause: ClassVar[str] = "absorption depends on wo only: transmission not reciprocal"

    def passes(self, wo, wi):
        depth = ops.maximum(-ops.log(ops.maximum(self.tint, 1e-4)), 0.0)
        return ops.exp(-depth / ops.maximum(ops.abs(wo.z), 1e-3))


class SheetWider(_Sheet):
    """Frosted sheet whose transmitted lobe is narrower, as light bends back on its way out."""

    fault: ClassVar[str] = (
        "Transmitted directions are drawn with alpha, but pdf and eval have the scaled alpha (1.3 (eta - 1) alpha)."
    )
    cause: ClassVar[str] = "sample draws transmission with another width than pdf says"

    def through(self):
        return self.alpha * (1.3 * (self.eta - 1.0))

    def through_drawn(self):
        return self.alpha


# ------------------------------------------------------------------------------------- diffuse transmitters


class _Leaf(go.BSDF):
    """Lambert's law on both sides."""

    reflect: go.Colour = go.spectrum((0.15, 0.3, 0.05), "share reflected", low=0.0, high=0.5)
    transmit: go.Colour = go.spectrum((0.3, 0.4, 0.02), "share transmitted", low=0.0, high=0.5)

    @property
    def transmits(self):
        return True

    def chance(self, wo):
        """Probability of reflection."""
        r, t = ops.mean(self.reflect), ops.mean(self.transmit)
        return ops.where(r + t > 0.0, ops.safe_div(r, r + t), 0.5)

    def chance_drawn(self, wo):
        return self.chance(wo)

    def eval(self, wo, wi, mode="radiance"):
        cos = ops.abs(wi.z) * ops.inv_pi
        same = ops.where(wo.z * wi.z > 0.0, cos, 0.0)
        return self.reflect * same + self.transmit * ops.where(wo.z * wi.z < 0.0, cos, 0.0)

    def pdf(self, wo, wi):
        cos, r = ops.abs(wi.z) * ops.inv_pi, self.chance(wo)
        return ops.where(wo.z * wi.z > 0.0, cos * r, ops.where(wo.z * wi.z < 0.0, cos * (1.0 - r), 0.0))

    def sample(self, wo, u, mode="radiance"):
        local = warp.square_to_cosine_hemisphere(u.y, u.z)
        side = ops.where(u.x < self.chance_drawn(wo), 1.0 + 0.0 * wo.z, -1.0 + 0.0 * wo.z)
        wi = ops.vec3(local.x, local.y, ops.copysign(local.z, wo.z) * side)
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class LeafByRed(_Leaf):
    """Leaf, its side chosen by the colours."""

    fault: ClassVar[str] = "sample chooses the side by the red channel, pdf by the mean of the channels."
    cause: ClassVar[str] = "discrete choice of the side in sample differs from pdf"

    def chance_drawn(self, wo):
        r, t = self.reflect.x, self.transmit.x
        return ops.where(r + t > 0.0, ops.safe_div(r, r + t), 0.5)


class LeafNotDeclared(_Leaf):
    """Leaf."""

    fault: ClassVar[str] = (
        "Light passes, but `transmits` is left at False: a renderer that trusts it never asks about the other side."
    )
    cause: ClassVar[str] = "transmits not declared"

    @property
    def transmits(self):
        return False


class LeafFromAbove(_Leaf):
    """Leaf with a thick vein structure below: colours swap."""

    fault: ClassVar[str] = (
        "From below the two colours are swapped as well as the sides: what passes downward is not what passes upward."
    )
    cause: ClassVar[str] = "transmission differs by the side of the viewer: not reciprocal"

    reflect: go.Colour = go.spectrum((0.15, 0.3, 0.05), "share reflected", low=0.0, high=0.5)

    def eval(self, wo, wi, mode="radiance"):
        cos = ops.abs(wi.z) * ops.inv_pi
        above = wo.z > 0.0
        r = ops.where(above, self.reflect, self.transmit)
        t = ops.where(above, self.transmit, self.reflect)
        return r * ops.where(wo.z * wi.z > 0.0, cos, 0.0) + t * ops.where(wo.z * wi.z < 0.0, cos, 0.0)


class SlabOfPaint(_Leaf):
    """A diffuse transmitter that is the surface of a dense medium of index eta."""

    fault: ClassVar[str] = (
        "Samples say that light enters a medium of index eta, but transmitted radiance is not scaled by 1 / eta^2."
    )
    cause: ClassVar[str] = "diffuse transmission into an index lacks the eta^2 of radiance: reciprocity"
    eta: go.Number = go.number(1.4, "index inside over outside", low=1.0, high=2.0)

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        relative = ops.where(wo.z >= 0.0, self.eta, 1.0 / self.eta)
        return go.Sample(s.wi, s.weight, s.pdf, s.delta, ops.where(wo.z * s.wi.z < 0.0, relative, 1.0))


MUTANTS = [
    PlainJacobian, ModeForgotten, ModeInSampleOnly, SchlickInside, ImportanceOfBubble, SmoothUnscaled, SheetAddsBounces,
    SheetBeerOneWay, SheetWider, LeafByRed, LeafNotDeclared, LeafFromAbove, SlabOfPaint,
]  # fmt: skip
SOUND = []
