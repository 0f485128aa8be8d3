"""Materials that look odd and are right."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.energy.albedo import walk
from gonio.optics import frame, warp
from gonio.optics import fresnel as fr
from gonio.optics.ndf import distribution


def above(wo, wi):
    return (wo.z > 0.0) & (wi.z > 0.0)


class FrostedSheet(go.BSDF):
    """A frosted sheet of coloured glass in air: a GGX lobe reflected, and its mirror image transmitted."""

    fault: ClassVar[str] = (
        "It transmits though eta of every sample is 1 (air on both sides); the side is chosen unevenly, by wo."
    )
    cause: ClassVar[str] = ""
    eta: go.Number = go.number(1.5, "index of the sheet", low=1.05, high=2.5)
    alpha: go.Width = go.width((0.15, 0.4), "widths of both lobes", low=0.05)
    depth: go.Colour = go.spectrum((0.05, 0.4, 0.9), "optical depth", low=0.0, high=5.0)

    @property
    def transmits(self):
        return True

    def R(self, cos):
        f = fr.kind("exact").dielectric(cos, fr.cos_transmitted(cos, self.eta), self.eta)
        return 2.0 * f / (1.0 + f)

    def lifted(self, w):
        return ops.vec3(w.x, w.y, ops.abs(w.z))

    def eval(self, wo, wi, mode="radiance"):
        o, i = self.lifted(wo), self.lifted(wi)
        ggx, m = distribution("ggx"), frame.half_vector(o, i)
        g = 1.0 / (1.0 + ggx.Lambda(o, self.alpha) + ggx.Lambda(i, self.alpha))
        lobe = ops.safe_div(ggx.D(m, self.alpha) * g, 4.0 * o.z)
        R = self.R(ops.abs(ops.dot(o, m)))
        sin2 = 0.5 * (frame.sin2(wo) + frame.sin2(wi))
        tint = ops.exp(self.depth * (-1.0 * ops.rsqrt(1.0 - sin2 / ops.sqr(self.eta))))
        sides = wo.z * wi.z
        return tint * ops.where(sides < 0.0, lobe * (1.0 - R), 0.0) + ops.where(sides > 0.0, lobe * R, 0.0)

    def chance(self, wo):
        return ops.where(wo.z > 0.0, 0.3, 0.2) + 0.4 * ops.sqr(1.0 - ops.abs(wo.z))

    def pdf(self, wo, wi):
        o, i = self.lifted(wo), self.lifted(wi)
        p = 0.25 * distribution("ggx").visible_per_cosine(o, frame.half_vector(o, i), self.alpha)
        sides, chance = wo.z * wi.z, self.chance(wo)
        return ops.where(sides > 0.0, p * chance, ops.where(sides < 0.0, p * (1.0 - chance), 0.0))

    def sample(self, wo, u, mode="radiance"):
        o = self.lifted(wo)
        i = frame.reflect(o, distribution("ggx").sample_visible(o, u.y, u.z, self.alpha))
        reflects = u.x < self.chance(wo)
        up = ops.where(wo.z < 0.0, -1.0 + 0.0 * wo.z, 1.0 + 0.0 * wo.z)
        wi = ops.vec3(i.x, i.y, i.z * ops.where(reflects, up, -up))
        pdf = ops.where(i.z > 0.0, self.pdf(wo, wi), 0.0)
        weight = self.eval(wo, wi) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class TwoFacedLeaf(go.BSDF):
    """A leaf: its two faces reflect differently, what passes is the same both ways."""

    fault: ClassVar[str] = (
        "The two sides reflect different colours, which reciprocity allows; the direction is drawn uniformly, not by the cosine."
    )
    cause: ClassVar[str] = ""
    upper: go.Colour = go.spectrum((0.1, 0.3, 0.05), "reflected above", low=0.0, high=0.5)
    lower: go.Colour = go.spectrum((0.3, 0.4, 0.2), "reflected below", low=0.0, high=0.5)
    through: go.Colour = go.spectrum((0.3, 0.45, 0.02), "transmitted", low=0.0, high=0.5)

    @property
    def transmits(self):
        return True

    def eval(self, wo, wi, mode="radiance"):
        cos, sides = ops.abs(wi.z) * ops.inv_pi, wo.z * wi.z
        face = ops.where(wo.z > 0.0, self.upper, self.lower)
        return face * ops.where(sides > 0.0, cos, 0.0) + self.through * ops.where(sides < 0.0, cos, 0.0)

    def pdf(self, wo, wi):
        return ops.where(wo.z * wi.z != 0.0, 0.25 * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        z = 1.0 - 2.0 * u.y
        r = ops.safe_sqrt(4.0 * u.y * (1.0 - u.y))
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        wi = ops.vec3(r * c, r * s, z)
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class Lottery(go.BSDF):
    """A cloth of two threads; each call looks at one of them, drawn by lot."""

    fault: ClassVar[str] = "eval is a random number with the right mean (stochastic), pdf is not random."
    cause: ClassVar[str] = ""
    stochastic: ClassVar[bool] = True
    matte: go.Colour = go.spectrum((0.8, 0.3, 0.2), "colour of the matte thread", low=0.0, high=1.0)
    satin: go.Colour = go.spectrum((0.2, 0.3, 0.7), "colour of the satin thread", low=0.0, high=1.0)
    share: go.Number = go.number(0.4, "share of satin", low=0.0, high=1.0)
    seed: go.Number = go.number(0.0, "shifts the random numbers")

    def eval(self, wo, wi, mode="radiance"):
        rng = walk.generator(wo, wi, self.seed)
        drawn = type(wo.z)(rng.next_float32())
        satin = self.satin * (self.share * (1.75 * ops.inv_pi) * ops.pow(wo.z * wi.z, 1.5) * wi.z)
        matte = self.matte * ((1.0 - self.share) * wi.z * ops.inv_pi)
        value = ops.where(drawn < 0.5, satin, matte) * 2.0  # each is drawn every other time
        return ops.where(above(wo, wi), value, 0.0)

    def pdf(self, wo, wi):
        return ops.where(above(wo, wi), wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        return self.sample_cosine(wo, u, mode)


class BouncingLacquer(go.BSDF):
    """A smooth lacquer over a matte base, with all the light that is thrown back and forth between them."""

    fault: ClassVar[str] = (
        "A delta lobe and a density in one; the base divides by 1 - kd F_inside and loses nothing at kd = 1."
    )
    cause: ClassVar[str] = ""
    kd: go.Colour = go.spectrum((0.8, 0.3, 0.1), "share that the base reflects", low=0.0, high=1.0)
    eta: go.Number = go.number(1.5, "index of the lacquer", low=1.1, high=2.5)
    lossless_tolerance: ClassVar[float] = 1e-3

    @property
    def delta(self):
        return "maybe"

    def F(self, cos):
        return fr.kind("exact").dielectric(cos, fr.cos_transmitted(cos, self.eta), self.eta)

    def T(self, cos):
        """1 - F, without that difference."""
        cos_t = fr.cos_transmitted(cos, self.eta)
        over = 1.0 / ops.sqr(cos + self.eta * cos_t) + 1.0 / ops.sqr(self.eta * cos + cos_t)
        return 2.0 * self.eta * cos * cos_t * over

    def eval(self, wo, wi, mode="radiance"):
        outside = fr.kind("exact").dielectric_average(self.eta)
        eta2 = ops.sqr(self.eta)
        inside = 1.0 - (1.0 - outside) / eta2
        left = self.T(ops.abs(wo.z)) * self.T(ops.abs(wi.z)) * ops.abs(wi.z) * ops.inv_pi / eta2
        return self.kd / (1.0 - self.kd * inside) * ops.where(above(wo, wi), left, 0.0)

    def chance(self, wo):
        """Of the mirror: not F, but near it."""
        return 0.2 + 0.6 * self.F(ops.abs(wo.z))

    def pdf(self, wo, wi):
        return ops.where(above(wo, wi), (1.0 - self.chance(wo)) * wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        up, chance = wo.z > 0.0, self.chance(wo)
        mirror = (u.x < chance) & up
        wi = ops.where(mirror, frame.mirror(wo), warp.square_to_cosine_hemisphere(u.y, u.z))
        density = self.pdf(wo, wi)
        base = self.eval(wo, wi) * ops.safe_div(1.0, density)
        weight = ops.where(mirror, self.F(ops.abs(wo.z)) / chance, ops.where(density > 0.0, base, 0.0))
        return go.Sample(wi, weight, ops.where(mirror, chance, density), mirror, 1.0 + 0.0 * density)


class WholeVelvet(go.BSDF):
    """f = 3/2 r mu_o mu_i / pi, whose albedo is r mu, and what it misses, 3 (1 - mu_o) (1 - mu_i) / pi, given back."""

    fault: ClassVar[str] = (
        "The base loses almost all at grazing; the compensation is its own, in closed form, and loses nothing at r = 1."
    )
    cause: ClassVar[str] = ""
    r: go.Colour = go.spectrum((0.9, 0.5, 0.2), "share of each bounce", low=0.0, high=1.0)
    lossless_tolerance: ClassVar[float] = 1e-3

    def eval(self, wo, wi, mode="radiance"):
        single = 1.5 * wo.z * wi.z
        multi = 3.0 * (1.0 - wo.z) * (1.0 - wi.z)
        again = self.r * self.r * (2.0 / 3.0) / (1.0 - self.r / 3.0)
        value = self.r * single + again * multi
        return value * ops.where(above(wo, wi), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        p = wo.z * (1.5 * ops.sqr(wi.z) * ops.inv_pi) + (1.0 - wo.z) * (wi.z * ops.inv_pi)
        return ops.where(above(wo, wi), p, 0.0)

    def sample(self, wo, u, mode="radiance"):
        steep = warp.square_to_power_lobe(u.y, u.z, 2.0 + 0.0 * wo.z)
        wi = ops.where(u.x < wo.z, steep, warp.square_to_cosine_hemisphere(u.y, u.z))
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class StainedGlass(go.BSDF):
    """Rough glass with paint on its upper side; how much paint differs by channel."""

    fault: ClassVar[str] = (
        "A mixture whose weight is a colour; the choice is by its mean, the density of both, from below paint is unseen."
    )
    cause: ClassVar[str] = ""
    glass: go.BSDF = go.bsdf("below the paint", default=go.Dielectric(eta=1.5, alpha=0.3))
    paint: go.BSDF = go.bsdf("the paint", default=go.Lambert(albedo=(0.8, 0.6, 0.1)))
    cover: go.Colour = go.spectrum((0.2, 0.5, 0.7), "how much is covered", low=0.0, high=0.95)

    @property
    def transmits(self):
        return True

    def eval(self, wo, wi, mode="radiance"):
        return self.glass.eval(wo, wi, mode) * (1.0 - self.cover) + self.paint.eval(wo, wi, mode) * self.cover

    def pdf(self, wo, wi):
        c = ops.mean(self.cover)
        return self.glass.pdf(wo, wi) * (1.0 - c) + self.paint.pdf(wo, wi) * c

    def sample(self, wo, u, mode="radiance"):
        c = ops.mean(self.cover)
        paint = u.x < c
        again = ops.where(paint, ops.safe_div(u.x, c), ops.safe_div(u.x - c, 1.0 - c))
        u = ops.vec3(ops.minimum(again, 0.99999994), u.y, u.z)
        a, b = self.glass.sample(wo, u, mode), self.paint.sample(wo, u, mode)
        wi = ops.where(paint, b.wi, a.wi)
        valid = ops.where(paint, b.pdf, a.pdf) > 0.0
        pdf = ops.where(valid, self.pdf(wo, wi), 0.0)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), ops.where(paint, b.eta, a.eta))


MUTANTS = []
SOUND = [FrostedSheet, TwoFacedLeaf, Lottery, BouncingLacquer, WholeVelvet, StainedGlass]
