"""Smooth glass: eight interfaces between two media, both of whose lobes are deltas."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.optics import frame, fresnel
from gonio.optics.fresnel import exact


class _W2Glass(go.BSDF):
    """A smooth interface: Fresnel reflection, or refraction by Snell's law."""

    eta: go.Number = go.number(1.5, "index inside over index outside", low=1.05, high=3.0)
    tint: go.Colour = go.spectrum(1.0, "factor on everything reflected or transmitted", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.tint * (0.0 * wo.z)

    def pdf(self, wo, wi):
        return 0.0 * wo.z

    def relative(self, wo):
        return ops.where(wo.z >= 0.0, self.eta, 1.0 / self.eta)

    def reflectance(self, cos_o, cos_t, eta):
        return exact.dielectric(cos_o, cos_t, eta)

    def refracted(self, wo, cos_t, eta):
        return ops.vec3(-wo.x / eta, -wo.y / eta, ops.where(wo.z >= 0.0, -cos_t, cos_t))

    def squeeze(self, eta):
        """The factor of transmitted radiance."""
        return 1.0 / ops.sqr(eta)

    def stated_eta(self, eta):
        return eta

    def passed(self, wi):
        return 1.0 + 0.0 * wi.z

    def sample(self, wo, u, mode="radiance"):
        eta = self.relative(wo)
        cos_o = ops.abs(wo.z)
        cos_t = fresnel.cos_transmitted(cos_o, eta)
        f = self.reflectance(cos_o, cos_t, eta)
        reflects = u.x < f
        wi = ops.where(reflects, frame.mirror(wo), self.refracted(wo, cos_t, eta))
        one = 1.0 + 0.0 * f
        through = self.squeeze(eta) if mode == "radiance" else one
        pdf = ops.where(reflects, f, 1.0 - f)
        weight = self.tint * ops.where(reflects, one, through) * ops.where(reflects, one, self.passed(wi))
        return go.Sample(wi, weight, pdf, pdf > 0.0, ops.where(reflects, one, self.stated_eta(eta)))

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "always"


class W2GlassFirstPower(_W2Glass):
    """Glass whose transmitted radiance is scaled for the change of medium."""

    fault: ClassVar[str] = "transmitted radiance is divided by the relative index, not by its square"
    cause: ClassVar[str] = "radiance factor of refraction is 1/eta instead of 1/eta^2"

    def squeeze(self, eta):
        return 1.0 / eta


class W2GlassFactorSide(_W2Glass):
    """Glass whose transmitted radiance is scaled by the index of the glass."""

    fault: ClassVar[str] = "radiance that leaves the glass is divided by eta^2 too, instead of multiplied by it"
    cause: ClassVar[str] = "radiance factor does not depend on the side: eta is not inverted for rays from inside"

    def squeeze(self, eta):
        return 1.0 / ops.sqr(self.eta) + 0.0 * eta


class W2GlassSampleEta(_W2Glass):
    """Glass that states the ratio of indices of its samples."""

    fault: ClassVar[str] = "a refracted sample's eta is the index on wo's side over that on wi's side"
    cause: ClassVar[str] = "eta of the sample is inverted"

    def stated_eta(self, eta):
        return 1.0 / eta


class W2GlassWeekend(_W2Glass):
    """Glass with Schlick's reflectance and total internal reflection, as in a first ray tracer."""

    fault: ClassVar[str] = (
        "from inside the glass Schlick's curve is evaluated at the incident cosine, so a path in reverse is "
        "transmitted by another fraction"
    )
    cause: ClassVar[str] = "Schlick's Fresnel from the denser side must use the transmitted angle: not reciprocal"

    def reflectance(self, cos_o, cos_t, eta):
        r0 = ops.sqr((1.0 - eta) / (1.0 + eta))
        return ops.where(cos_t > 0.0, r0 + (1.0 - r0) * ops.pow(1.0 - cos_o, 5.0), 1.0)


class W2GlassBend(_W2Glass):
    """Glass that bends rays on both sides."""

    fault: ClassVar[str] = "rays that leave the glass are bent toward the normal, like those that enter it"
    cause: ClassVar[str] = (
        "the direction of refraction uses the index of entry on both sides: Snell's law inverted inside"
    )

    def refracted(self, wo, cos_t, eta):
        cos = fresnel.cos_transmitted(ops.abs(wo.z), self.eta)
        return ops.vec3(-wo.x / self.eta, -wo.y / self.eta, ops.where(wo.z >= 0.0, -cos, cos))


class W2GlassTotal(_W2Glass):
    """Glass whose refraction falls back to the mirrored direction where there is none."""

    fault: ClassVar[str] = (
        "totally reflected light carries the eta and the radiance factor of refraction, 2.25 from inside the glass"
    )
    cause: ClassVar[str] = "total internal reflection is treated as transmission: weight above 1, eta not 1"

    def reflectance(self, cos_o, cos_t, eta):
        return ops.where(cos_t > 1e-15, exact.dielectric(cos_o, cos_t, eta), 0.0)

    def refracted(self, wo, cos_t, eta):
        bent = ops.vec3(-wo.x / eta, -wo.y / eta, ops.where(wo.z >= 0.0, -cos_t, cos_t))
        return ops.where(cos_t > 1e-15, bent, frame.mirror(wo))


class W2GlassTintByWi(_W2Glass):
    """Glass that absorbs a little where light passes: by the cosine of the ray."""

    sigma: go.Colour = go.spectrum((0.1, 0.3, 0.8), "optical thickness of the absorbing skin", low=0.0)

    fault: ClassVar[str] = "the skin's absorption depends on the cosine of wi, on whichever side wi lies"
    cause: ClassVar[str] = "absorption by the cosine of the sampled direction instead of the inner one: not reciprocal"

    def passed(self, wi):
        return ops.exp(-self.sigma / ops.maximum(ops.abs(wi.z), 1e-4))


class W2GlassClamped(_W2Glass):
    """Glass that follows both lobes with at least a tenth of the rays."""

    fault: ClassVar[str] = (
        "reflection is chosen with F clamped to [0.1, 0.9], but weight and pdf are those of a choice with F"
    )
    cause: ClassVar[str] = "lobe selection probability clamped, not divided out: samples do not follow their pdf"

    def sample(self, wo, u, mode="radiance"):
        eta = self.relative(wo)
        cos_o = ops.abs(wo.z)
        cos_t = fresnel.cos_transmitted(cos_o, eta)
        f = self.reflectance(cos_o, cos_t, eta)
        reflects = u.x < ops.clamp(f, 0.1, 0.9)
        wi = ops.where(reflects, frame.mirror(wo), self.refracted(wo, cos_t, eta))
        one = 1.0 + 0.0 * f
        through = self.squeeze(eta) if mode == "radiance" else one
        pdf = ops.where(reflects, f, 1.0 - f)
        weight = self.tint * ops.where(pdf > 0.0, ops.where(reflects, one, through), 0.0)
        return go.Sample(wi, weight, pdf, pdf > 0.0, ops.where(reflects, one, eta))


MUTANTS = [
    W2GlassFirstPower, W2GlassFactorSide, W2GlassSampleEta, W2GlassWeekend,
    W2GlassBend, W2GlassTotal, W2GlassTintByWi, W2GlassClamped,
]  # fmt: skip
SOUND = []
