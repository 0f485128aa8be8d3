"""Smooth glass, panes and slabs: delta lobes only."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.optics import frame


class _Glass(go.BSDF):
    """Right: smooth glass with Fresnel's equations; transmitted light is tinted."""

    eta: go.Number = go.number(1.5, "index inside over index outside", low=1.05, high=2.5)
    tint_colour: go.Colour = go.spectrum(1.0, "share of the refracted light that passes", low=0.0, high=1.0)

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "always"

    def relative(self, wo):
        return ops.where(wo.z >= 0.0, self.eta, 1.0 / self.eta)

    def cos_t(self, cos, eta):
        return ops.safe_sqrt(cos * cos + (eta - 1.0) * (eta + 1.0)) / eta

    def reflectance(self, cos, cos_t, eta):
        r_s = (cos - eta * cos_t) / (cos + eta * cos_t)
        r_p = (eta * cos - cos_t) / (eta * cos + cos_t)
        return ops.where(cos_t > 0.0, 0.5 * (ops.sqr(r_s) + ops.sqr(r_p)), 1.0)

    def refracted(self, wo, cos_t, eta):
        return ops.vec3(-wo.x / eta, -wo.y / eta, -ops.copysign(cos_t, wo.z))

    def factor(self, eta, mode):
        return 1.0 + 0.0 * eta if mode == "importance" else 1.0 / ops.sqr(eta)

    def chosen(self, f, u):
        return u.x < f

    def eval(self, wo, wi, mode="radiance"):
        return self.tint_colour * (0.0 * wo.z)

    def pdf(self, wo, wi):
        return 0.0 * wo.z

    def sample(self, wo, u, mode="radiance"):
        eta = self.relative(wo)
        cos = ops.abs(wo.z)
        cos_t = self.cos_t(cos, eta)
        f = self.reflectance(cos, cos_t, eta)
        reflects = self.chosen(f, u)
        wi = ops.where(reflects, frame.mirror(wo), self.refracted(wo, cos_t, eta))
        one = 1.0 + 0.0 * wo.z
        white = 1.0 + 0.0 * self.tint_colour
        weight = ops.where(reflects, white * one, self.tint_colour * self.factor(eta, mode))
        pdf = ops.where(reflects, f, 1.0 - f)
        return go.Sample(wi, weight, pdf, pdf > 0.0, ops.where(reflects, one, eta))


class GlassFactorUpsideDown(_Glass):
    fault: ClassVar[str] = (
        "Radiance that is refracted is multiplied by (eta_i/eta_o)^2 instead of (eta_o/eta_i)^2, so `radiance` and `importance` differ by the inverse of the sample's eta^2; everywhere in transmission."
    )
    cause: ClassVar[str] = "radiance factor eta^2 is inverted"

    def factor(self, eta, mode):
        return 1.0 + 0.0 * eta if mode == "importance" else ops.sqr(eta)


class GlassSameIndexFromInside(_Glass):
    fault: ClassVar[str] = (
        "A viewer inside the glass (wo below) also gets eta instead of 1/eta: refraction bends the wrong way, never reflects totally, and the path does not retrace."
    )
    cause: ClassVar[str] = "index not inverted for viewer below"

    def relative(self, wo):
        return self.eta + 0.0 * wo.z


class GlassReportsOuterEta(_Glass):
    fault: ClassVar[str] = (
        "The sample's `eta` of a refraction is self.eta from both sides, so for a viewer below it is 1.5 where direction and weight obey 1/1.5."
    )
    cause: ClassVar[str] = "sample's eta not inverted from below"

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        crosses = s.wi.z * wo.z < 0.0
        return s._replace(eta=ops.where(crosses, self.eta, 1.0))


class GlassRootOfNegative(_Glass):
    fault: ClassVar[str] = (
        "Beyond the critical angle, from inside, the cosine by Snell's law is the root of a negative number, and reflectance, pdf and weight or direction are NaN."
    )
    cause: ClassVar[str] = "total reflection not handled, NaN"

    def cos_t(self, cos, eta):
        return ops.sqrt(cos * cos + (eta - 1.0) * (eta + 1.0)) / eta

    def reflectance(self, cos, cos_t, eta):
        r_s = (cos - eta * cos_t) / (cos + eta * cos_t)
        r_p = (eta * cos - cos_t) / (eta * cos + cos_t)
        return 0.5 * (ops.sqr(r_s) + ops.sqr(r_p))


class TintedGlassUnweightedReflection(_Glass):
    fault: ClassVar[str] = (
        "The lobe is chosen by F against (1-F) times the tint's mean, but the reflection's weight remains 1 instead of F over that probability: with dark or saturated tints, e.g. (1, 0, 0), reflection and transmission sum to more than 1."
    )
    cause: ClassVar[str] = "reflection weight lacks F over probability"

    tint_colour: go.Colour = go.spectrum((0.9, 0.6, 0.3), "share of the refracted light that passes", low=0.0, high=1.0)

    def sample(self, wo, u, mode="radiance"):
        eta = self.relative(wo)
        cos = ops.abs(wo.z)
        cos_t = self.cos_t(cos, eta)
        f = self.reflectance(cos, cos_t, eta)
        share = ops.where(cos_t > 0.0, f / ops.maximum(f + (1.0 - f) * ops.mean(self.tint_colour), 1e-9), 1.0)
        reflects = u.x < share
        wi = ops.where(reflects, frame.mirror(wo), self.refracted(wo, cos_t, eta))
        one = 1.0 + 0.0 * wo.z
        white = 1.0 + 0.0 * self.tint_colour
        passed = ops.safe_div(1.0 - f, 1.0 - share) * self.factor(eta, mode)
        weight = ops.where(reflects, white * one, self.tint_colour * passed)
        pdf = ops.where(reflects, share, 1.0 - share)
        return go.Sample(wi, weight, pdf, pdf > 0.0, ops.where(reflects, one, eta))


class GlassSchlickFromInside(_Glass):
    fault: ClassVar[str] = (
        "Schlick's curve is taken at the inner angle for a viewer inside and knows no total reflection: R differs between both ends of a refracted path (not reciprocal), and beyond the critical angle the refracted direction is no unit vector."
    )
    cause: ClassVar[str] = "Schlick at denser side's angle"

    def reflectance(self, cos, cos_t, eta):
        r0 = ops.sqr((eta - 1.0) / (eta + 1.0))
        return r0 + (1.0 - r0) * ops.pow(1.0 - cos, 5.0)


class GlassFactorOnReflection(_Glass):
    fault: ClassVar[str] = (
        "The factor 1/eta^2 of refracted radiance multiplies the reflected lobe too: from inside, total reflection has weight eta^2 = 2.25."
    )
    cause: ClassVar[str] = "radiance factor also applied to reflection"

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        if mode == "importance":
            return s
        reflected = s.wi.z * wo.z > 0.0
        return s._replace(weight=ops.where(reflected, s.weight / ops.sqr(self.relative(wo)), s.weight))


class GlassIndexMatchedAtZero(_Glass):
    fault: ClassVar[str] = (
        "At eta = 1, F = 0; the random number u = 0 passes `u <= F`, and the reflection's weight F / p is 0/0: NaN."
    )
    cause: ClassVar[str] = "u <= probability 0, then 0/0"

    eta: go.Number = go.number(1.5, "index inside over index outside", low=1.0, high=2.5)

    def chosen(self, f, u):
        return u.x <= f

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        f = ops.where(s.wi.z * wo.z > 0.0, s.pdf, 1.0 - s.pdf)
        reflected = s.wi.z * wo.z > 0.0
        return s._replace(weight=ops.where(reflected, s.weight * (f / s.pdf), s.weight))


class _Pane(go.BSDF):
    """Right: a thin pane, all bounces of both faces summed; light that passes goes straight on. Tint by absorption."""

    eta: go.Number = go.number(1.5, "index of the pane", low=1.05, high=2.5)
    sigma: go.Colour = go.spectrum(0.0, "optical depth of the pane, crossed perpendicularly", low=0.0, high=4.0)

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "always"

    def face(self, cos):
        cos_t = ops.safe_sqrt(cos * cos + (self.eta - 1.0) * (self.eta + 1.0)) / self.eta
        r_s = (cos - self.eta * cos_t) / (cos + self.eta * cos_t)
        r_p = (self.eta * cos - cos_t) / (self.eta * cos + cos_t)
        return 0.5 * (ops.sqr(r_s) + ops.sqr(r_p)), cos_t

    def crossing(self, wo, cos_t):
        return ops.exp(self.sigma * (-1.0 / cos_t))

    def both(self, wo):
        """(all that is reflected, all that passes)."""
        r, cos_t = self.face(ops.abs(wo.z))
        t = self.crossing(wo, cos_t)
        over = ops.sqr(1.0 - r) / ops.maximum(1.0 - ops.sqr(t * r), 1e-9)
        return r * (1.0 + over * ops.sqr(t)), t * over

    def eval(self, wo, wi, mode="radiance"):
        return self.sigma * (0.0 * wo.z)

    def pdf(self, wo, wi):
        return 0.0 * wo.z

    def sample(self, wo, u, mode="radiance"):
        reflected, passed = self.both(wo)
        share = ops.clamp(ops.mean(reflected) / ops.maximum(ops.mean(reflected) + ops.mean(passed), 1e-9), 0.01, 0.99)
        reflects = u.x < share
        pdf = ops.where(reflects, share, 1.0 - share)
        wi = ops.where(reflects, frame.mirror(wo), -wo)
        return go.Sample(wi, ops.where(reflects, reflected, passed) / pdf, pdf, pdf > 0.0, 1.0 + 0.0 * pdf)


class PaneHalfSummed(_Pane):
    fault: ClassVar[str] = (
        "The reflection sums the bounces of both faces, but the transmission is that of one face, 1 - R: both exceed 1 by about R(1-R)/(1+R), 3.7 % at normal incidence and 17 % at grazing angles."
    )
    cause: ClassVar[str] = "transmission of one face only"

    def both(self, wo):
        reflected, _ = super().both(wo)
        r, cos_t = self.face(ops.abs(wo.z))
        return reflected, self.crossing(wo, cos_t) * (1.0 - r)


class PaneSignedDepth(_Pane):
    fault: ClassVar[str] = (
        "The path through a tinted pane is divided by the signed cosine, so for a viewer below light is amplified, exp(+sigma), instead of absorbed; not at sigma = 0."
    )
    cause: ClassVar[str] = "absorption with signed cosine"

    sigma: go.Colour = go.spectrum(
        (0.05, 0.1, 0.3), "optical depth of the pane, crossed perpendicularly", low=0.0, high=4.0
    )

    def crossing(self, wo, cos_t):
        return ops.exp(self.sigma * (-1.0 / ops.copysign(cos_t, wo.z)))

    def both(self, wo):
        r, cos_t = self.face(ops.abs(wo.z))
        t = self.crossing(wo, cos_t)
        inner = ops.exp(self.sigma * (-1.0 / cos_t))
        over = ops.sqr(1.0 - r) / ops.maximum(1.0 - ops.sqr(inner * r), 1e-9)
        return r * (1.0 + over * ops.sqr(inner)), t * over


MUTANTS = [
    GlassFactorUpsideDown,
    GlassSameIndexFromInside,
    GlassReportsOuterEta,
    GlassRootOfNegative,
    TintedGlassUnweightedReflection,
    GlassSchlickFromInside,
    GlassFactorOnReflection,
    GlassIndexMatchedAtZero,
    PaneHalfSummed,
    PaneSignedDepth,
]
