"""Smooth and rough glass, each with one mistake."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.optics import frame, fresnel
from gonio.optics.ndf import distribution


def facing_normal(wo):
    """The surface normal on wo's side."""
    n = frame.normal_like(wo)
    return ops.where(wo.z < 0.0, -n, n)


def exact(cos_o, cos_t, eta):
    return fresnel.kind("exact").dielectric(cos_o, cos_t, eta)


class W5WindowGlass(go.BSDF):
    """Smooth clear glass: one interface that reflects and refracts."""

    fault: ClassVar[str] = "samples that leave the glass report the eta of samples that enter it"
    cause: ClassVar[str] = (
        "sample: the stated eta of a refracted ray is always the parameter eta; for wo inside the glass it must be "
        "1 / eta (index on wi's side over index on wo's side). Direction and weight are right"
    )
    eta: go.Number = go.number(1.5, "index inside over index outside", low=1.05, high=3.0)
    albedo: go.Colour = go.spectrum(1.0, "factor on all light", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.albedo * (0.0 * wo.z)

    def pdf(self, wo, wi):
        return 0.0 * wo.z

    def sample(self, wo, u, mode="radiance"):
        eta = ops.where(wo.z >= 0.0, self.eta, 1.0 / self.eta)
        cos = ops.abs(wo.z)
        cos_t = fresnel.cos_transmitted(cos, eta)
        f = exact(cos, cos_t, eta)
        reflects = u.x < f
        wi = ops.where(reflects, frame.mirror(wo), frame.refract(wo, facing_normal(wo), cos_t, eta))
        pdf = ops.where(reflects, f, 1.0 - f)
        factor = 1.0 + 0.0 * pdf
        if mode == "radiance":
            factor = ops.where(reflects, 1.0, 1.0 / ops.sqr(eta))
        return go.Sample(wi, self.albedo * factor, pdf, pdf > 0.0, ops.where(reflects, 1.0, self.eta))

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "always"


class W5LensGlass(go.BSDF):
    """Smooth glass, tinted, for lenses."""

    fault: ClassVar[str] = "the factor of radiance is also applied to importance"
    cause: ClassVar[str] = (
        "sample ignores mode: the weight of refraction is divided by eta^2 for mode='importance' as well as for "
        "'radiance', so particles gain or lose power on crossing"
    )
    eta: go.Number = go.number(1.6, "index inside over index outside", low=1.05, high=3.0)
    tint_color: go.Colour = go.spectrum((0.95, 0.9, 0.85), "factor on refracted light", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.tint_color * (0.0 * wo.z)

    def pdf(self, wo, wi):
        return 0.0 * wo.z

    def sample(self, wo, u, mode="radiance"):
        eta = ops.where(wo.z >= 0.0, self.eta, 1.0 / self.eta)
        cos = ops.abs(wo.z)
        cos_t = fresnel.cos_transmitted(cos, eta)
        f = exact(cos, cos_t, eta)
        reflects = u.x < f
        wi = ops.where(reflects, frame.mirror(wo), frame.refract(wo, facing_normal(wo), cos_t, eta))
        pdf = ops.where(reflects, f, 1.0 - f)
        weight = ops.where(reflects, 1.0 + 0.0 * self.tint_color, self.tint_color / ops.sqr(eta))
        return go.Sample(wi, weight, pdf, pdf > 0.0, ops.where(reflects, 1.0, eta))

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "always"


class W5Diamond(go.BSDF):
    """Smooth diamond with Schlick's Fresnel reflectance."""

    fault: ClassVar[str] = "there is no total reflection inside: light leaves along directions that do not exist"
    cause: ClassVar[str] = (
        "sample: total internal reflection is not treated; Schlick's curve is taken at the inner cosine, so beyond the "
        "critical angle most samples still refract, with cos_t clamped to 0 and a wi that lies in the surface and is "
        "longer than 1"
    )
    eta: go.Number = go.number(2.42, "index inside over index outside", low=1.05, high=3.0)
    albedo: go.Colour = go.spectrum(1.0, "factor on all light", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.albedo * (0.0 * wo.z)

    def pdf(self, wo, wi):
        return 0.0 * wo.z

    def sample(self, wo, u, mode="radiance"):
        eta = ops.where(wo.z >= 0.0, self.eta, 1.0 / self.eta)
        cos = ops.abs(wo.z)
        cos_t = fresnel.cos_transmitted(cos, eta)
        r0 = ops.sqr((self.eta - 1.0) / (self.eta + 1.0))
        f = r0 + (1.0 - r0) * ops.pow(1.0 - cos, 5.0)
        reflects = u.x < f
        wi = ops.where(reflects, frame.mirror(wo), frame.refract(wo, facing_normal(wo), cos_t, eta))
        pdf = ops.where(reflects, f, 1.0 - f)
        factor = 1.0 + 0.0 * pdf
        if mode == "radiance":
            factor = ops.where(reflects, 1.0, 1.0 / ops.sqr(eta))
        return go.Sample(wi, self.albedo * factor, pdf, pdf > 0.0, ops.where(reflects, 1.0, eta))

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "always"


class W5FrostedGlass(go.BSDF):
    """Rough glass: GGX, separable masking, visible normals."""

    fault: ClassVar[str] = "the density of refracted directions is too small by eta^2"
    cause: ClassVar[str] = (
        "pdf (and the weight, which divides by it): the Jacobian dm/dwi of refraction lacks the factor eta^2: it is "
        "eta^2 |i.m| / (o.m + eta i.m)^2; the radiance form was copied from eval"
    )
    eta: go.Number = go.number(1.5, "index inside over index outside", low=1.05, high=3.0)
    alpha: go.Width = go.width(0.3, "width of the facets", low=0.01)
    albedo: go.Colour = go.spectrum(1.0, "factor on all light", low=0.0, high=1.0)

    def relative(self, wo):
        return ops.where(wo.z >= 0.0, self.eta, 1.0 / self.eta)

    def normal(self, wo, wi, eta):
        h = wo + wi * ops.where(wo.z * wi.z > 0.0, 1.0, eta)
        h = h * ops.rsqrt(ops.maximum(ops.dot(h, h), 1e-30))
        return ops.where(h.z < 0.0, -h, h)

    def lit(self, wo, wi, m):
        return (ops.dot(wo, m) * wo.z > 0.0) & (ops.dot(wi, m) * wi.z > 0.0)

    def fresnel_at(self, wo, m, eta):
        cos = ops.abs(ops.dot(wo, m))
        return exact(cos, fresnel.cos_transmitted(cos, eta), eta)

    def eval(self, wo, wi, mode="radiance"):
        ndf = distribution("ggx")
        eta = self.relative(wo)
        m = self.normal(wo, wi, eta)
        f = self.fresnel_at(wo, m, eta)
        shape = ndf.D(m, self.alpha) * ndf.G1(wo, self.alpha) * ndf.G1(wi, self.alpha)
        shape = shape / ops.maximum(ops.abs(wo.z), 1e-9)
        om, im = ops.dot(wo, m), ops.dot(wi, m)
        jacobian = ops.abs(om * im) / ops.maximum(ops.sqr(om + eta * im), 1e-9)
        if mode == "importance":
            jacobian = jacobian * ops.sqr(eta)
        value = shape * ops.where(wo.z * wi.z > 0.0, 0.25 * f, (1.0 - f) * jacobian)
        return self.albedo * ops.where(self.lit(wo, wi, m), value, 0.0)

    def pdf(self, wo, wi):
        ndf = distribution("ggx")
        eta = self.relative(wo)
        m = self.normal(wo, wi, eta)
        f = self.fresnel_at(wo, m, eta)
        om, im = ops.dot(wo, m), ops.dot(wi, m)
        visible = ndf.D(m, self.alpha) * ndf.G1(wo, self.alpha) / ops.maximum(ops.abs(wo.z), 1e-9)  # over |o.m|
        jacobian = ops.abs(om * im) / ops.maximum(ops.sqr(om + eta * im), 1e-9)
        density = visible * ops.where(wo.z * wi.z > 0.0, 0.25 * f, (1.0 - f) * jacobian)
        return ops.where(self.lit(wo, wi, m), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        ndf = distribution("ggx")
        eta = self.relative(wo)
        v = ops.where(wo.z < 0.0, -wo, wo)
        m = ndf.sample_visible(v, u.y, u.z, self.alpha)
        m = ops.where(wo.z < 0.0, -m, m)
        cos = ops.abs(ops.dot(wo, m))
        cos_t = fresnel.cos_transmitted(cos, eta)
        reflects = u.x < exact(cos, cos_t, eta)
        wi = ops.where(reflects, frame.reflect(wo, m), frame.refract(wo, m, cos_t, eta))
        side = wo.z * wi.z
        right = ops.where(reflects, side > 0.0, side < 0.0)
        pdf = ops.where(right, self.pdf(wo, wi), 0.0)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), ops.where(reflects, 1.0, eta))

    @property
    def transmits(self):
        return True


class W5PebbledGlass(go.BSDF):
    """Rough glass of bathroom windows: GGX, separable masking, visible normals."""

    fault: ClassVar[str] = "reflected and refracted light each come from a part of the facets only"
    cause: ClassVar[str] = (
        "sample: u.x, the number that chooses between reflection and refraction, also draws the facet's normal "
        "(u.x, u.y instead of u.y, u.z), so normal and lobe are correlated and the samples do not have the density pdf"
    )
    eta: go.Number = go.number(1.5, "index inside over index outside", low=1.05, high=3.0)
    alpha: go.Width = go.width(0.4, "width of the facets", low=0.01)
    albedo: go.Colour = go.spectrum(0.95, "factor on all light", low=0.0, high=1.0)

    def relative(self, wo):
        return ops.where(wo.z >= 0.0, self.eta, 1.0 / self.eta)

    def normal(self, wo, wi, eta):
        h = wo + wi * ops.where(wo.z * wi.z > 0.0, 1.0, eta)
        h = h * ops.rsqrt(ops.maximum(ops.dot(h, h), 1e-30))
        return ops.where(h.z < 0.0, -h, h)

    def lit(self, wo, wi, m):
        return (ops.dot(wo, m) * wo.z > 0.0) & (ops.dot(wi, m) * wi.z > 0.0)

    def lobes(self, wo, wi, m, eta):
        """F / 4 or (1 - F) |o.m| dm/dwi, as density of directions over that of visible normals."""
        om, im = ops.dot(wo, m), ops.dot(wi, m)
        cos = ops.abs(om)
        f = exact(cos, fresnel.cos_transmitted(cos, eta), eta)
        jacobian = ops.sqr(eta) * ops.abs(om * im) / ops.maximum(ops.sqr(om + eta * im), 1e-9)
        return ops.where(wo.z * wi.z > 0.0, 0.25 * f, (1.0 - f) * jacobian)

    def eval(self, wo, wi, mode="radiance"):
        eta = self.relative(wo)
        value = self.pdf(wo, wi) * distribution("ggx").G1(wi, self.alpha)
        if mode == "radiance":
            value = value * ops.where(wo.z * wi.z > 0.0, 1.0, 1.0 / ops.sqr(eta))
        return self.albedo * value

    def pdf(self, wo, wi):
        ndf = distribution("ggx")
        eta = self.relative(wo)
        m = self.normal(wo, wi, eta)
        visible = ndf.D(m, self.alpha) * ndf.G1(wo, self.alpha) / ops.maximum(ops.abs(wo.z), 1e-9)
        return ops.where(self.lit(wo, wi, m), visible * self.lobes(wo, wi, m, eta), 0.0)

    def sample(self, wo, u, mode="radiance"):
        ndf = distribution("ggx")
        eta = self.relative(wo)
        v = ops.where(wo.z < 0.0, -wo, wo)
        m = ndf.sample_visible(v, u.x, u.y, self.alpha)
        m = ops.where(wo.z < 0.0, -m, m)
        cos = ops.abs(ops.dot(wo, m))
        cos_t = fresnel.cos_transmitted(cos, eta)
        reflects = u.x < exact(cos, cos_t, eta)
        wi = ops.where(reflects, frame.reflect(wo, m), frame.refract(wo, m, cos_t, eta))
        side = wo.z * wi.z
        right = ops.where(reflects, side > 0.0, side < 0.0)
        pdf = ops.where(right, self.pdf(wo, wi), 0.0)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), ops.where(reflects, 1.0, eta))

    @property
    def transmits(self):
        return True


class W5PolishedGlass(go.BSDF):
    """Glass with a trace of roughness: a narrow GGX lobe, visible normals."""

    fault: ClassVar[str] = "the narrow peak is noise in float32"
    cause: ClassVar[str] = (
        "eval and pdf: GGX's D is computed as a^2 / (pi (m_z^2 (a^2 - 1) + 1)^2), which cancels near the peak: for "
        "small alpha in float32 the denominator a^2 has no digits left, so value and density are off by large factors"
    )
    eta: go.Number = go.number(1.5, "index inside over index outside", low=1.05, high=3.0)
    alpha: go.Number = go.number(5e-4, "width of the facets", low=2e-4, high=1.0)
    albedo: go.Colour = go.spectrum(1.0, "factor on all light", low=0.0, high=1.0)

    def D(self, m):
        a2 = ops.sqr(self.alpha)
        spread = ops.sqr(m.z) * (a2 - 1.0) + 1.0
        return a2 / (ops.pi * ops.maximum(ops.sqr(spread), 1e-14))

    def pair(self):
        return ops.vec2(self.alpha, self.alpha)

    def relative(self, wo):
        return ops.where(wo.z >= 0.0, self.eta, 1.0 / self.eta)

    def normal(self, wo, wi, eta):
        h = wo + wi * ops.where(wo.z * wi.z > 0.0, 1.0, eta)
        h = h * ops.rsqrt(ops.maximum(ops.dot(h, h), 1e-30))
        return ops.where(h.z < 0.0, -h, h)

    def eval(self, wo, wi, mode="radiance"):
        eta = self.relative(wo)
        value = self.pdf(wo, wi) * distribution("ggx").G1(wi, self.pair())
        if mode == "radiance":
            value = value * ops.where(wo.z * wi.z > 0.0, 1.0, 1.0 / ops.sqr(eta))
        return self.albedo * value

    def pdf(self, wo, wi):
        eta = self.relative(wo)
        m = self.normal(wo, wi, eta)
        om, im = ops.dot(wo, m), ops.dot(wi, m)
        cos = ops.abs(om)
        f = exact(cos, fresnel.cos_transmitted(cos, eta), eta)
        visible = self.D(m) * distribution("ggx").G1(wo, self.pair()) / ops.maximum(ops.abs(wo.z), 1e-9)
        jacobian = ops.sqr(eta) * ops.abs(om * im) / ops.maximum(ops.sqr(om + eta * im), 1e-9)
        density = visible * ops.where(wo.z * wi.z > 0.0, 0.25 * f, (1.0 - f) * jacobian)
        return ops.where((om * wo.z > 0.0) & (im * wi.z > 0.0), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        eta = self.relative(wo)
        v = ops.where(wo.z < 0.0, -wo, wo)
        m = distribution("ggx").sample_visible(v, u.y, u.z, self.pair())
        m = ops.where(wo.z < 0.0, -m, m)
        cos = ops.abs(ops.dot(wo, m))
        cos_t = fresnel.cos_transmitted(cos, eta)
        reflects = u.x < exact(cos, cos_t, eta)
        wi = ops.where(reflects, frame.reflect(wo, m), frame.refract(wo, m, cos_t, eta))
        side = wo.z * wi.z
        right = ops.where(reflects, side > 0.0, side < 0.0)
        pdf = ops.where(right, self.pdf(wo, wi), 0.0)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), ops.where(reflects, 1.0, eta))

    @property
    def transmits(self):
        return True


MUTANTS = [W5WindowGlass, W5LensGlass, W5Diamond, W5FrostedGlass, W5PebbledGlass, W5PolishedGlass]
SOUND = []
