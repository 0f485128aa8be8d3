"""Mixtures of delta and smooth lobes: varnished paint and masks with holes."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.optics import frame, fresnel, warp
from gonio.optics.fresnel import exact


class _W2Varnish(go.BSDF):
    """A smooth varnish, which mirrors a fraction F, over a matte base, which receives the rest."""

    kd: go.Colour = go.spectrum((0.7, 0.5, 0.3), "albedo of the base", low=0.0, high=1.0)
    r0: go.Number = go.number(0.05, "reflectance of the varnish at normal incidence", low=0.0, high=0.5)

    def fresnel(self, cos):
        return self.r0 + (1.0 - self.r0) * ops.pow(1.0 - ops.abs(cos), 5.0)

    def chance(self, cos):
        """Probability of the varnish."""
        f = self.fresnel(cos)
        return f / (f + (1.0 - f) * ops.mean(self.kd) + 1e-9)

    def base(self, wo, wi):
        """The base's BRDF: it receives what the varnish does not reflect, on the way in and out."""
        left = (1.0 - self.fresnel(wo.z)) * (1.0 - self.fresnel(wi.z))
        return self.kd * (left / (ops.pi * (1.0 - self.r0) * (20.0 / 21.0)))

    def eval(self, wo, wi, mode="radiance"):
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), self.base(wo, wi) * wi.z, 0.0)

    def pdf(self, wo, wi):
        density = (1.0 - self.chance(wo.z)) * wi.z * ops.inv_pi
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), density, 0.0)

    def matte(self, u, p):
        return warp.square_to_cosine_hemisphere(u.y, u.z)

    def deltas(self, coat, above):
        return coat & above

    def sample(self, wo, u, mode="radiance"):
        p = self.chance(wo.z)
        coat = u.x < p
        above = wo.z > 0.0
        wi = ops.where(coat, frame.mirror(wo), self.matte(u, p))
        pdf = ops.where(coat, ops.where(above, p, 0.0), self.pdf(wo, wi))
        value = ops.where(coat, self.fresnel(wo.z) + 0.0 * self.kd, self.eval(wo, wi, mode))
        weight = ops.where(above, value * ops.safe_div(1.0, pdf), 0.0)
        return go.Sample(wi, weight, pdf, self.deltas(coat, above), 1.0 + 0.0 * pdf)

    @property
    def delta(self):
        return "maybe"


class W2VarnishAtWi(_W2Varnish):
    """Varnish over paint; the varnish is sampled by its Fresnel reflectance."""

    fault: ClassVar[str] = "the density computes the probability of the base at wi, but it was chosen at wo"
    cause: ClassVar[str] = "pdf uses the lobe probability of the wrong direction: not the density of sample"

    def pdf(self, wo, wi):
        density = (1.0 - self.chance(wi.z)) * wi.z * ops.inv_pi
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), density, 0.0)


class W2VarnishReusedU(_W2Varnish):
    """Varnish over paint, sampled with two random numbers."""

    fault: ClassVar[str] = (
        "the number that chose the base also chooses its polar angle, and is not rescaled from [p, 1)"
    )
    cause: ClassVar[str] = "random number reused without remapping: no samples near the normal, pdf does not match"

    def matte(self, u, p):
        return warp.square_to_cosine_hemisphere(u.x, u.z)


class W2VarnishAllDelta(_W2Varnish):
    """Varnish over paint, part of it a mirror."""

    fault: ClassVar[str] = "samples of the matte base are marked as delta samples too"
    cause: ClassVar[str] = "delta flag set on samples that have a density: light sampling counts them twice"

    def deltas(self, coat, above):
        return above


class W2VarnishOneWay(_W2Varnish):
    """Varnish over paint: the paint receives what the varnish transmits."""

    fault: ClassVar[str] = "the base is reduced by 1 - F of the viewer's direction alone"
    cause: ClassVar[str] = "not reciprocal: the base lacks the Fresnel transmission of the light's direction"

    def base(self, wo, wi):
        return self.kd * ((1.0 - self.fresnel(wo.z)) * ops.inv_pi)


class W2MaskMean(go.BSDF):
    """A matte sheet with a colored opacity on both sides: the rest of the light passes straight on."""

    opacity: go.Colour = go.spectrum((0.9, 0.5, 0.2), "opacity of each channel", low=0.0, high=1.0)
    kd: go.Colour = go.spectrum(0.9, "albedo of the sheet", low=0.0, high=1.0)

    fault: ClassVar[str] = "light that passes has weight 1 in all channels, as if each had the mean opacity"
    cause: ClassVar[str] = (
        "transmission by the mean opacity while reflection uses each channel's: more light leaves than arrives in red"
    )

    def eval(self, wo, wi, mode="radiance"):
        return ops.where(wo.z * wi.z > 0.0, self.kd * self.opacity * (ops.abs(wi.z) * ops.inv_pi), 0.0)

    def pdf(self, wo, wi):
        return ops.where(wo.z * wi.z > 0.0, ops.mean(self.opacity) * ops.abs(wi.z) * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        covered = u.x < ops.mean(self.opacity)
        w = warp.square_to_cosine_hemisphere(u.y, u.z)
        wi = ops.where(covered, ops.vec3(w.x, w.y, ops.copysign(w.z, wo.z)), -wo)
        pdf = ops.where(covered, self.pdf(wo, wi), 1.0 - ops.mean(self.opacity))
        weight = ops.where(covered, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), 1.0)
        return go.Sample(wi, weight, pdf, ~covered, 1.0 + 0.0 * pdf)

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "maybe"


class W2MaskHoleEta(go.BSDF):
    """Smooth glass on a fraction of the surface, and holes elsewhere."""

    opacity: go.Number = go.number(0.6, "fraction that the glass covers", low=0.0, high=1.0)
    eta: go.Number = go.number(1.5, "index inside over index outside", low=1.05, high=3.0)
    tint: go.Colour = go.spectrum(1.0, "factor on everything that the glass scatters", low=0.0, high=1.0)

    fault: ClassVar[str] = "light that passes through a hole states the eta of the glass's lane: 1.5 if that refracts"
    cause: ClassVar[str] = "eta of a straight pass-through is not 1: it belongs to the lobe that was not chosen"

    def eval(self, wo, wi, mode="radiance"):
        return self.tint * (0.0 * wo.z)

    def pdf(self, wo, wi):
        return 0.0 * wo.z

    def sample(self, wo, u, mode="radiance"):
        eta = ops.where(wo.z >= 0.0, self.eta, 1.0 / self.eta)
        cos_o = ops.abs(wo.z)
        cos_t = fresnel.cos_transmitted(cos_o, eta)
        f = exact.dielectric(cos_o, cos_t, eta)
        covered = u.x < self.opacity
        reflects = u.y < f
        bent = ops.vec3(-wo.x / eta, -wo.y / eta, ops.where(wo.z >= 0.0, -cos_t, cos_t))
        one = 1.0 + 0.0 * f
        squeeze = 1.0 / ops.sqr(eta) if mode == "radiance" else one
        glass = self.tint * ops.where(reflects, one, squeeze)
        chance = self.opacity * ops.where(reflects, f, 1.0 - f)
        pdf = ops.where(covered, chance, 1.0 - self.opacity)
        wi = ops.where(covered, ops.where(reflects, frame.mirror(wo), bent), -wo)
        weight = ops.where(covered, glass, 1.0)
        return go.Sample(wi, weight, pdf, pdf > 0.0, ops.where(reflects, one, eta))

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "always"


MUTANTS = [
    W2VarnishAtWi, W2VarnishReusedU, W2VarnishAllDelta, W2VarnishOneWay, W2MaskMean, W2MaskHoleEta,
]  # fmt: skip
SOUND = []
