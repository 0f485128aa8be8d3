"""Bugs of renderers and student ray tracers, each rewritten as a small material: glass, cutouts, samplers."""

from typing import ClassVar, NamedTuple

import gonio as go
from gonio import ops
from gonio.optics import frame, fresnel, warp


@ops.function
def ggx_d(m, alpha):
    """GGX, the density of normals."""
    e = ops.sqr(m.x / alpha.x) + ops.sqr(m.y / alpha.y) + ops.sqr(m.z)
    return 1.0 / (ops.pi * alpha.x * alpha.y * ops.sqr(ops.maximum(e, 1e-12)))


@ops.function
def ggx_lambda(w, alpha):
    """Smith's Lambda of GGX."""
    tan2 = (ops.sqr(alpha.x * w.x) + ops.sqr(alpha.y * w.y)) / ops.maximum(ops.sqr(w.z), 1e-12)
    return 0.5 * (ops.sqrt(1.0 + tan2) - 1.0)


@ops.function
def ggx_lobe(wo, wi, alpha):
    """D G2 / (4 cos_o): the value of a white mirror of facets, times cos_i."""
    m = frame.half_vector(wo, wi)
    g2 = 1.0 / (1.0 + ggx_lambda(wo, alpha) + ggx_lambda(wi, alpha))
    return ggx_d(m, alpha) * g2 / (4.0 * ops.maximum(ops.abs(wo.z), 1e-6))


@ops.function
def ggx_density(wo, wi, alpha):
    """Density of the reflection at a visible normal."""
    m = frame.half_vector(wo, wi)
    g1 = 1.0 / (1.0 + ggx_lambda(wo, alpha))
    return ggx_d(m, alpha) * g1 / (4.0 * ops.maximum(ops.abs(wo.z), 1e-6))


@ops.function
def ggx_normal(wo, u1, u2, alpha):
    """A visible normal, by the spherical cap."""
    v = ops.normalize(ops.vec3(alpha.x * wo.x, alpha.y * wo.y, wo.z))
    s, c = ops.sincos(2.0 * ops.pi * u1)
    z = (1.0 - u2) * (1.0 + v.z) - v.z
    r = ops.safe_sqrt(1.0 - z * z)
    return ops.normalize(ops.vec3(alpha.x * (r * c + v.x), alpha.y * (r * s + v.y), ops.maximum(z + v.z, 1e-7)))


def upper(wo, wi):
    """Both directions above the surface."""
    return (wo.z > 0.0) & (wi.z > 0.0)


def drawn(material, wo, wi, mode):
    """The sample for a direction drawn with the material's pdf."""
    pdf = material.pdf(wo, wi)
    weight = material.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
    return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class Facet(NamedTuple):
    """What both eval and pdf need of a pair of directions at rough glass."""

    eta: object
    reflects: object
    m: object
    dot_o: object
    dot_i: object
    fresnel: object
    lit: object


def facet_of(wo, wi, inside):
    """The facet that reflects or refracts wo into wi; eta is the index on the far side over that on wo's."""
    eta = ops.where(wo.z >= 0.0, inside, 1.0 / inside)
    reflects = wo.z * wi.z > 0.0
    h = wo + wi * ops.where(reflects, 1.0, eta)
    h = h * ops.rsqrt(ops.maximum(ops.dot(h, h), 1e-20))
    m = ops.where(h.z < 0.0, -h, h)
    dot_o, dot_i = ops.dot(wo, m), ops.dot(wi, m)
    cos = ops.minimum(ops.abs(dot_o), 1.0)
    f = fresnel.kind("exact").dielectric(cos, fresnel.cos_transmitted(cos, eta), eta)
    lit = (dot_o * wo.z > 0.0) & (dot_i * wi.z > 0.0)
    return Facet(eta, reflects, m, dot_o, dot_i, f, lit)


def spread_of(facet):
    """|o.m| dm/dwi over eta^2 for refraction, |o.m| dm/dwi for reflection."""
    bent = ops.abs(facet.dot_o * facet.dot_i) / ops.maximum(ops.sqr(facet.dot_o + facet.eta * facet.dot_i), 1e-9)
    return ops.where(facet.reflects, 0.25, bent)


def glass_value(wo, wi, inside, alpha, mode):
    """Rough glass, with separable masking."""
    a = facet_of(wo, wi, inside)
    g = 1.0 / ((1.0 + ggx_lambda(wo, alpha)) * (1.0 + ggx_lambda(wi, alpha)))
    value = ggx_d(a.m, alpha) * g / ops.maximum(ops.abs(wo.z), 1e-6) * spread_of(a)
    value = value * ops.where(a.reflects, a.fresnel, 1.0 - a.fresnel)
    if mode == "importance":
        value = value * ops.where(a.reflects, 1.0, ops.sqr(a.eta))
    return ops.where(a.lit, value, 0.0)


def glass_density(wo, wi, inside, alpha):
    """Density of `glass_direction`."""
    a = facet_of(wo, wi, inside)
    visible = ggx_d(a.m, alpha) / ((1.0 + ggx_lambda(wo, alpha)) * ops.maximum(ops.abs(wo.z), 1e-6))
    density = visible * spread_of(a) * ops.where(a.reflects, a.fresnel, (1.0 - a.fresnel) * ops.sqr(a.eta))
    return ops.where(a.lit, density, 0.0)


def glass_direction(wo, u, inside, alpha):
    """(wi, eta): a visible normal, then reflection with probability F."""
    eta = ops.where(wo.z >= 0.0, inside, 1.0 / inside)
    side = ops.where(wo.z >= 0.0, 1.0, -1.0)
    m = ggx_normal(wo * side, u.y, u.z, alpha) * side
    cos = ops.clamp(ops.dot(wo, m), 0.0, 1.0)
    cos_t = fresnel.cos_transmitted(cos, eta)
    f = fresnel.kind("exact").dielectric(cos, cos_t, eta)
    reflects = u.x < f
    wi = ops.where(reflects, frame.reflect(wo, m), frame.refract(wo, m, cos_t, eta))
    return wi, ops.where(reflects, 1.0, eta), reflects


def glass_sample(material, wo, wi, eta, reflects, mode):
    """The sample of a direction drawn by `glass_direction`; on the wrong side it fails."""
    right = ops.where(reflects, wo.z * wi.z > 0.0, wo.z * wi.z < 0.0)
    pdf = ops.where(right, material.pdf(wo, wi), 0.0)
    weight = material.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
    return go.Sample(wi, weight, pdf, go.never(pdf), eta)


class W3BackFacets(go.BSDF):
    """Rough glass. Imitates pbrt-v3's issue 228: MicrofacetTransmission::f lacked a check of dot(wo, wh) dot(wi, wh) < 0."""

    fault: ClassVar[str] = (
        "light passes at facets that are seen from their back: a glow at angles that refraction cannot reach, where the density is 0"
    )
    cause: ClassVar[str] = "the transmitted value is not set to 0 where wo and wi lie on one side of the facet"
    albedo: go.Colour = go.spectrum(1.0, "share of light that is not absorbed", low=0.0, high=1.0)
    eta: go.Number = go.number(1.5, "index inside over outside", low=1.1, high=3.0)
    alpha: go.Width = go.width(0.5, "width of the facets", low=0.05)

    def eval(self, wo, wi, mode="radiance"):
        a = facet_of(wo, wi, self.eta)
        g = 1.0 / ((1.0 + ggx_lambda(wo, self.alpha)) * (1.0 + ggx_lambda(wi, self.alpha)))
        value = ggx_d(a.m, self.alpha) * g / ops.maximum(ops.abs(wo.z), 1e-6) * spread_of(a)
        value = value * ops.where(a.reflects, a.fresnel, 1.0 - a.fresnel)
        if mode == "importance":
            value = value * ops.where(a.reflects, 1.0, ops.sqr(a.eta))
        return self.albedo * ops.where(a.lit | (wo.z * wi.z < 0.0), value, 0.0)

    def pdf(self, wo, wi):
        return glass_density(wo, wi, self.eta, self.alpha)

    def sample(self, wo, u, mode="radiance"):
        wi, eta, reflects = glass_direction(wo, u, self.eta, self.alpha)
        return glass_sample(self, wo, wi, eta, reflects, mode)

    @property
    def transmits(self):
        return True


class W3MissingEtap(go.BSDF):
    """Rough glass. Imitates pbrt-v4's issue 30: the factor of the squared index was missing in DielectricInterfaceBxDF::f."""

    fault: ClassVar[str] = (
        "refracted light is divided by the squared index once too often: more leaves from inside than arrives, less from outside"
    )
    cause: ClassVar[str] = "the transmitted value lacks the factor eta^2 of the Jacobian of the half vector"
    albedo: go.Colour = go.spectrum(0.9, "share of light that is not absorbed", low=0.0, high=1.0)
    eta: go.Number = go.number(1.33, "index inside over outside", low=1.1, high=3.0)
    alpha: go.Width = go.width(0.25, "width of the facets", low=0.05)

    def eval(self, wo, wi, mode="radiance"):
        value = glass_value(wo, wi, self.eta, self.alpha, "radiance")
        eta = ops.where(wo.z >= 0.0, self.eta, 1.0 / self.eta)
        if mode == "radiance":
            value = value * ops.where(wo.z * wi.z > 0.0, 1.0, 1.0 / ops.sqr(eta))
        return self.albedo * value

    def pdf(self, wo, wi):
        return glass_density(wo, wi, self.eta, self.alpha)

    def sample(self, wo, u, mode="radiance"):
        wi, eta, reflects = glass_direction(wo, u, self.eta, self.alpha)
        return glass_sample(self, wo, wi, eta, reflects, mode)

    @property
    def transmits(self):
        return True


class W3WeekendGlass(go.BSDF):
    """Smooth glass with Schlick's curve. Imitates 'Ray Tracing in One Weekend' and its many ports: the curve is taken at the incident angle on both sides."""

    fault: ClassVar[str] = (
        "from inside the reflectance is not that of the same path from outside; it jumps to 1 at the critical angle"
    )
    cause: ClassVar[str] = (
        "Schlick's curve is evaluated at the inner angle for rays that leave, instead of at the transmitted one"
    )
    albedo: go.Colour = go.spectrum(1.0, "share of light that is not absorbed", low=0.0, high=1.0)
    eta: go.Number = go.number(1.5, "index inside over outside", low=1.1, high=3.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.albedo * (0.0 * wo.z)

    def pdf(self, wo, wi):
        return 0.0 * wo.z

    def sample(self, wo, u, mode="radiance"):
        eta = ops.where(wo.z >= 0.0, self.eta, 1.0 / self.eta)
        cos = ops.abs(wo.z)
        cos_t = fresnel.cos_transmitted(cos, eta)
        r0 = ops.sqr((1.0 - eta) / (1.0 + eta))
        f = ops.where(cos_t > 0.0, r0 + (1.0 - r0) * ops.pow(1.0 - cos, 5.0), 1.0)
        reflects = u.x < f
        m = frame.normal_like(wo) * ops.where(wo.z >= 0.0, 1.0, -1.0)
        wi = ops.where(reflects, frame.mirror(wo), frame.refract(wo, m, cos_t, eta))
        scale = ops.where(reflects, 1.0, 1.0 if mode == "importance" else 1.0 / ops.sqr(eta))
        pdf = ops.where(reflects, f, 1.0 - f)
        return go.Sample(wi, self.albedo * scale, pdf, pdf > 0.0, ops.where(reflects, 1.0, eta))

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "always"


class W3WeekendBall(go.BSDF):
    """Matte paint, sampled by a ball that touches the surface. Imitates the first editions of 'Ray Tracing in One Weekend'."""

    fault: ClassVar[str] = "directions are denser near the normal than a Lambertian surface's"
    cause: ClassVar[str] = (
        "the point is drawn in the ball, whose directions go with cos^3, instead of on its sphere, whose go with cos"
    )
    kd: go.Colour = go.spectrum((0.8, 0.3, 0.3), "albedo", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where(upper(wo, wi), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(upper(wo, wi), wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        radius = ops.pow(u.x, 1.0 / 3.0)
        z = 1.0 - 2.0 * u.y
        r = ops.safe_sqrt(1.0 - z * z)
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        wi = ops.normalize(ops.vec3(radius * r * c, radius * r * s, ops.maximum(radius * z + 1.0, 1e-6)))
        return drawn(self, wo, wi, mode)


class W3RouletteOdds(go.BSDF):
    """Smooth glass by roulette. Imitates ports of smallpt, in which P = 1/4 + Re/2 chooses reflection and the two quotients are mixed up."""

    fault: ClassVar[str] = (
        "transmitted light is counted by a fifth too little at normal incidence, too much at grazing angles"
    )
    cause: ClassVar[str] = "the weight of refraction is divided by 1 - Re instead of by the probability 1 - P"
    albedo: go.Colour = go.spectrum(0.999, "share of light that is not absorbed", low=0.0, high=1.0)
    eta: go.Number = go.number(1.5, "index inside over outside", low=1.1, high=3.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.albedo * (0.0 * wo.z)

    def pdf(self, wo, wi):
        return 0.0 * wo.z

    def sample(self, wo, u, mode="radiance"):
        eta = ops.where(wo.z >= 0.0, self.eta, 1.0 / self.eta)
        cos = ops.abs(wo.z)
        cos_t = fresnel.cos_transmitted(cos, eta)
        re = fresnel.kind("exact").dielectric(cos, cos_t, eta)
        p = ops.where(cos_t > 0.0, 0.25 + 0.5 * re, 1.0)
        reflects = u.x < p
        m = frame.normal_like(wo) * ops.where(wo.z >= 0.0, 1.0, -1.0)
        wi = ops.where(reflects, frame.mirror(wo), frame.refract(wo, m, cos_t, eta))
        scale = 1.0 if mode == "importance" else 1.0 / ops.sqr(eta)
        through = ops.safe_div(1.0 - re, 1.0 - re) * scale
        pdf = ops.where(reflects, p, 1.0 - p)
        weight = ops.where(reflects, re / p, through)
        return go.Sample(wi, self.albedo * weight, pdf, pdf > 0.0, ops.where(reflects, 1.0, eta))

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "always"


class W3BlinnJacobian(go.BSDF):
    """Blinn's highlight, sampled by half vectors. Imitates a question that students ask each year: why is my highlight too dark?"""

    fault: ClassVar[str] = "the density is four times too large and more: that of half vectors, not of directions"
    cause: ClassVar[str] = "pdf lacks the Jacobian of the reflection, 1 / (4 wo.h)"
    ks: go.Colour = go.spectrum(0.6, "color", low=0.0, high=1.0)
    n: go.Number = go.number(50.0, "exponent", low=1.0, high=1000.0)

    def D(self, m):
        return (self.n + 2.0) * (0.5 * ops.inv_pi) * ops.pow(m.z, self.n)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        cos = ops.maximum(ops.dot(wo, m), 1e-6)
        shade = ops.minimum(1.0, 2.0 * m.z * ops.minimum(wo.z, wi.z) / cos)
        return self.ks * ops.where(upper(wo, wi), self.D(m) * shade / (4.0 * ops.maximum(wo.z, 1e-6)), 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        return ops.where(upper(wo, wi), self.D(m) * m.z, 0.0)

    def sample(self, wo, u, mode="radiance"):
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        cos = ops.pow(1.0 - u.y, 1.0 / (self.n + 2.0))
        sin = ops.safe_sqrt(1.0 - ops.sqr(cos))
        return drawn(self, wo, frame.reflect(wo, ops.vec3(sin * c, sin * s, cos)), mode)


class W3FlipForgotten(go.BSDF):
    """Metal leaf that looks the same from both sides. Imitates a bug of two-sided adapters (Mitsuba's 'twosided' and its ports)."""

    fault: ClassVar[str] = "from below the sampled direction lies above the surface, where eval and pdf are 0"
    cause: ClassVar[str] = "sample mirrors wo to the front, and does not mirror wi back"
    ks: go.Colour = go.spectrum((0.9, 0.75, 0.4), "reflectance", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.3, "width of the facets", low=0.05)

    def front(self, w, wo):
        return ops.vec3(w.x, w.y, ops.where(wo.z < 0.0, -w.z, w.z))

    def eval(self, wo, wi, mode="radiance"):
        o, i = self.front(wo, wo), self.front(wi, wo)
        return self.ks * ops.where(upper(o, i), ggx_lobe(o, i, self.alpha), 0.0)

    def pdf(self, wo, wi):
        o, i = self.front(wo, wo), self.front(wi, wo)
        return ops.where(upper(o, i), ggx_density(o, i, self.alpha), 0.0)

    def sample(self, wo, u, mode="radiance"):
        o = self.front(wo, wo)
        i = frame.reflect(o, ggx_normal(o, u.y, u.z, self.alpha))
        return drawn(self, o, i, mode)

    @property
    def two_sided(self):
        return True


class W3Cutout(go.BSDF):
    """A leaf with an opacity: what it does not cover passes straight on. Imitates opacity masks in renderers (Blender, LuxCore forums)."""

    fault: ClassVar[str] = "more light leaves than arrives wherever the leaf is partly transparent"
    cause: ClassVar[str] = (
        "the reflected value is not multiplied by the opacity, while the passing light has 1 - opacity"
    )
    kd: go.Colour = go.spectrum((0.8, 0.9, 0.6), "albedo of the leaf", low=0.0, high=1.0)
    opacity: go.Number = go.number(0.7, "covered share", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where(wo.z * wi.z > 0.0, ops.abs(wi.z) * ops.inv_pi, 0.0)

    def odds(self):
        return ops.clamp(self.opacity, 0.05, 0.95)

    def pdf(self, wo, wi):
        return ops.where(wo.z * wi.z > 0.0, self.odds() * ops.abs(wi.z) * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        local = warp.square_to_cosine_hemisphere(u.y, u.z)
        covered = u.x < self.odds()
        matte = ops.vec3(local.x, local.y, ops.where(wo.z < 0.0, -local.z, local.z))
        wi = ops.where(covered, matte, -wo)
        density = self.pdf(wo, wi)
        pdf = ops.where(covered, density, 1.0 - self.odds())
        through = ((1.0 - self.opacity) / (1.0 - self.odds())) * ops.ones_like(self.kd)
        weight = ops.where(covered, self.eval(wo, wi, mode) * ops.safe_div(1.0, density), through)
        return go.Sample(wi, weight, pdf, ~covered, 1.0 + 0.0 * pdf)

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "maybe"


class W3RadianceUnscaled(go.BSDF):
    """Rough glass. Imitates renderers that leave out how radiance shrinks with the squared index (Blender Cycles, by choice; many others, not)."""

    fault: ClassVar[str] = (
        "radiance and importance are the same: light inside the glass is brighter than the law of radiance allows"
    )
    cause: ClassVar[str] = "mode radiance lacks the factor (eta_o / eta_i)^2 of transmission"
    albedo: go.Colour = go.spectrum(1.0, "share of light that is not absorbed", low=0.0, high=1.0)
    eta: go.Number = go.number(1.5, "index inside over outside", low=1.1, high=3.0)
    alpha: go.Width = go.width(0.2, "width of the facets", low=0.05)

    def eval(self, wo, wi, mode="radiance"):
        return self.albedo * glass_value(wo, wi, self.eta, self.alpha, "importance")

    def pdf(self, wo, wi):
        return glass_density(wo, wi, self.eta, self.alpha)

    def sample(self, wo, u, mode="radiance"):
        wi, eta, reflects = glass_direction(wo, u, self.eta, self.alpha)
        return glass_sample(self, wo, wi, eta, reflects, mode)

    @property
    def transmits(self):
        return True


class W3BlackLobes(go.BSDF):
    """Paint with a highlight, each with its color. Imitates reports of black pixels and NaN on black textures (Babylon.js, Falcor, Unity)."""

    fault: ClassVar[str] = "samples, weights and densities are not numbers if both colors are black"
    cause: ClassVar[str] = "the lobe's probability divides by the sum of both lobes' luminances, which is 0 there"
    kd: go.Colour = go.spectrum(0.4, "albedo of the base", low=0.0, high=0.5)
    ks: go.Colour = go.spectrum(0.3, "reflectance of the highlight", low=0.0, high=0.5)
    alpha: go.Width = go.width(0.3, "width of the highlight", low=0.05)

    def eval(self, wo, wi, mode="radiance"):
        value = self.kd * (wi.z * ops.inv_pi) + self.ks * ggx_lobe(wo, wi, self.alpha)
        return ops.where(upper(wo, wi), value, 0.0)

    def chance(self):
        return ops.mean(self.ks) / (ops.mean(self.ks) + ops.mean(self.kd))

    def pdf(self, wo, wi):
        p = self.chance()
        density = p * ggx_density(wo, wi, self.alpha) + (1.0 - p) * wi.z * ops.inv_pi
        return ops.where(upper(wo, wi), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        shiny = frame.reflect(wo, ggx_normal(wo, u.y, u.z, self.alpha))
        wi = ops.where(u.x < self.chance(), shiny, warp.square_to_cosine_hemisphere(u.y, u.z))
        return drawn(self, wo, wi, mode)


MUTANTS = [
    W3BackFacets,
    W3MissingEtap,
    W3WeekendGlass,
    W3WeekendBall,
    W3RouletteOdds,
    W3BlinnJacobian,
    W3FlipForgotten,
    W3Cutout,
    W3RadianceUnscaled,
    W3BlackLobes,
]
SOUND = []
