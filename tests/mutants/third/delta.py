"""Third examiner: mirrors, smooth glass, mixtures of delta and smooth parts; each class carries one mistake."""

from __future__ import annotations

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.optics import frame, fresnel, warp

EXACT = fresnel.kind("exact")


class _Glass(go.BSDF):
    """Smooth glass. Sound as it stands."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    lossless_tolerance: ClassVar[float | None] = 1e-3

    tint_: go.Colour = go.spectrum(1.0, "share that is kept of all that leaves", low=0.0, high=1.0)
    eta: go.Number = go.number(1.5, "index inside over outside", low=1.1, high=2.5)

    def eval(self, wo, wi, mode="radiance"):
        return self.tint_ * (0.0 * wo.z)

    def pdf(self, wo, wi):
        return 0.0 * wo.z

    def ratio(self, wo):
        return ops.where(wo.z >= 0.0, self.eta, 1.0 / self.eta)

    def F(self, cos_o, cos_t, eta):
        return EXACT.dielectric(cos_o, cos_t, eta)

    def choose(self, wo, u):
        """(reflects, F, wi, eta of the sample)"""
        eta = self.ratio(wo)
        up = frame.normal_like(wo)
        m = ops.where(wo.z < 0.0, -up, up)
        cos_o = ops.abs(wo.z)
        cos_t = fresnel.cos_transmitted(cos_o, eta)
        f = self.F(cos_o, cos_t, eta)
        reflects = u.x < f
        wi = ops.where(reflects, frame.mirror(wo), frame.refract(wo, m, cos_t, eta))
        return reflects, f, wi, ops.where(reflects, 1.0, eta)

    def factor(self, wo, reflects, eta, mode):
        """What radiance is multiplied by."""
        return 1.0 / ops.sqr(eta) if mode == "radiance" else 1.0 + 0.0 * eta

    def sample(self, wo, u, mode="radiance"):
        reflects, f, wi, eta = self.choose(wo, u)
        pdf = ops.where(reflects, f, 1.0 - f)
        weight = self.tint_ * self.factor(wo, reflects, eta, mode)
        return go.Sample(wi, weight, pdf, pdf == pdf, eta)

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "always"


class InsideAsOutside(_Glass):
    fault = "the squared index by which radiance changes is always that of entering, also for light seen from inside"
    cause = "1 / eta^2 on the way out as well, where eta^2 belongs: factor does not ask for the side"

    def factor(self, wo, reflects, eta, mode):
        entering = ops.where(reflects, 1.0, 1.0 / ops.sqr(self.eta))
        return entering if mode == "radiance" else 1.0 + 0.0 * eta


class ModeForgotten(_Glass):
    fault = "mode is ignored: particles from the light lose 1 / eta^2 at the surface as radiance does"
    cause = "mode importance carries the factor of radiance"

    def factor(self, wo, reflects, eta, mode):
        return 1.0 / ops.sqr(eta)


class NoTotalReflection(_Glass):
    fault = "Schlick's curve with the incident cosine on the dense side as well: beyond the critical angle F stays low"
    cause = "total internal reflection is missed: light beyond the critical angle is sent along the surface"

    def F(self, cos_o, cos_t, eta):
        r0 = fresnel.r0_dielectric(eta)
        return r0 + (1.0 - r0) * ops.pow(1.0 - cos_o, 5.0)


class OneIndexBothWays(_Glass):
    fault = "the refracted direction is computed with the index of entering on both sides: light leaving bends inward"
    cause = "Snell's law with eta instead of 1 / eta from inside: the path is not the reverse of the one that entered"

    def choose(self, wo, u):
        up = frame.normal_like(wo)
        m = ops.where(wo.z < 0.0, -up, up)
        cos_o = ops.abs(wo.z)
        cos_t = fresnel.cos_transmitted(cos_o, self.eta)
        f = self.F(cos_o, cos_t, self.eta)
        reflects = u.x < f
        wi = ops.where(reflects, frame.mirror(wo), frame.refract(wo, m, cos_t, self.eta))
        return reflects, f, wi, ops.where(reflects, 1.0, self.ratio(wo))


class FresnelTwice(_Glass):
    fault = "the lobe is chosen with probability F, and its weight is multiplied by F again (1 - F for refraction)"
    cause = "weight is not divided by the probability of the choice"

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        return go.Sample(s.wi, s.weight * s.pdf, s.pdf, s.delta, s.eta)


class CertainOfItself(_Glass):
    fault = "every delta sample reports the probability 1, though reflection is chosen with probability F"
    cause = "pdf of a delta sample is not its discrete probability"

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        return go.Sample(s.wi, s.weight, 1.0 + 0.0 * s.pdf, s.delta, s.eta)


class SheetThatReflectsOnly(go.BSDF):
    fault = "a thin sheet lets light straight through, but says of itself that it does not transmit"
    cause = "transmits is left False"

    kt: go.Colour = go.spectrum((0.9, 0.8, 0.7), "share that goes straight on where not reflected", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kt * (0.0 * wo.z)

    def pdf(self, wo, wi):
        return 0.0 * wo.z

    def sample(self, wo, u, mode="radiance"):
        r = 0.04 + 0.96 * ops.pow(1.0 - ops.abs(wo.z), 5.0)
        back = u.x < r
        wi = ops.where(back, frame.mirror(wo), -wo)
        pdf = ops.where(back, r, 1.0 - r)
        one = self.kt * 0.0 + 1.0
        return go.Sample(wi, ops.where(back, one, self.kt), pdf, pdf == pdf, 1.0 + 0.0 * pdf)

    @property
    def delta(self):
        return "always"


class _Varnish(go.BSDF):
    """A mirror's coat with Schlick's Fresnel over a matte base. Sound as it stands."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""

    kd: go.Colour = go.spectrum((0.7, 0.5, 0.3), "share that the base reflects", low=0.0, high=1.0)
    r0: go.Number = go.number(0.05, "reflectance of the coat at normal incidence", low=0.0, high=0.5)

    def F(self, wo):
        return self.r0 + (1.0 - self.r0) * ops.pow(1.0 - ops.abs(wo.z), 5.0)

    def eval(self, wo, wi, mode="radiance"):
        left_o = 1.0 - ops.pow(1.0 - wo.z, 5.0)
        left_i = 1.0 - ops.pow(1.0 - wi.z, 5.0)
        value = (1.0 - self.r0) * left_o * left_i * wi.z * (21.0 / 20.0 / ops.pi)
        return self.kd * ops.where((wo.z > 0.0) & (wi.z > 0.0), value, 0.0)

    def coat(self, wo):
        """probability of the mirror's lobe"""
        return self.F(wo)

    def pdf(self, wo, wi):
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), (1.0 - self.coat(wo)) * wi.z * ops.inv_pi, 0.0)

    def mirrored(self, wo):
        """reflectance of the mirror's lobe"""
        return self.kd * 0.0 + self.F(wo)

    def sample(self, wo, u, mode="radiance"):
        above = wo.z > 0.0
        glint = (u.x < self.coat(wo)) & above
        wi = ops.where(glint, frame.mirror(wo), warp.square_to_cosine_hemisphere(u.y, u.z))
        smooth = self.pdf(wo, wi)
        pdf = ops.where(above, ops.where(glint, self.coat(wo), smooth), 0.0)
        matte = self.eval(wo, wi, mode) * ops.safe_div(1.0, smooth)
        weight = ops.where(glint, self.mirrored(wo) * ops.safe_div(1.0, self.coat(wo)), matte)
        return go.Sample(wi, weight, pdf, glint, 1.0 + 0.0 * pdf)

    @property
    def delta(self):
        return "maybe"


class FlagOnEveryRay(_Varnish):
    fault = "samples of the matte base carry the delta flag too: a renderer counts the light that they find twice"
    cause = "delta is a fact of the material instead of the sample's lobe"

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        return go.Sample(s.wi, s.weight, s.pdf, s.pdf > 0.0, s.eta)


class SaysNever(_Varnish):
    fault = "the material says that it never has a delta lobe, and its coat is a mirror"
    cause = "fact delta says never; samples are flagged"

    @property
    def delta(self):
        return "never"


class BaseDensityWhole(_Varnish):
    fault = "pdf and the matte samples leave out the probability 1 - F with which the base is chosen: the base grows too dark"
    cause = "pdf of the smooth lobe lacks the probability of its choice"

    def pdf(self, wo, wi):
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), wi.z * ops.inv_pi, 0.0)


class WornSilver(go.BSDF):
    fault = "`worn` is the share of the matte part in eval and pdf; sample takes the mirror with that probability, and with its weight"
    cause = "share of the mixture swapped in sample: right at 1/2 alone"

    kd: go.Colour = go.spectrum(0.6, "share that worn spots reflect", low=0.0, high=1.0)
    ks: go.Colour = go.spectrum(0.9, "share that silver reflects", low=0.0, high=1.0)
    worn: go.Number = go.number(0.5, "share of worn spots", low=0.1, high=0.9)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * (self.worn * ops.where((wo.z > 0.0) & (wi.z > 0.0), wi.z * ops.inv_pi, 0.0))

    def pdf(self, wo, wi):
        return self.worn * ops.where((wo.z > 0.0) & (wi.z > 0.0), wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        glint = (u.x < self.worn) & (wo.z > 0.0)
        wi = ops.where(glint, frame.mirror(wo), warp.square_to_cosine_hemisphere(u.y, u.z))
        smooth = self.pdf(wo, wi)
        pdf = ops.where(glint, self.worn, smooth)
        return go.Sample(
            wi, ops.where(glint, self.ks, self.kd * ops.where(smooth > 0.0, 1.0, 0.0)), pdf, glint, 1.0 + 0.0 * pdf
        )

    @property
    def delta(self):
        return "maybe"


MUTANTS = [
    InsideAsOutside, ModeForgotten, NoTotalReflection, OneIndexBothWays, FresnelTwice, CertainOfItself,
    SheetThatReflectsOnly, FlagOnEveryRay, SaysNever, BaseDensityWhole, WornSilver,
]  # fmt: skip
SOUND = []
