"""Glass, coats and channels with a subtle fault."""

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


class W3DeltaIndex(go.BSDF):
    """Smooth clear glass."""

    fault: ClassVar[str] = "for rays that leave the glass the sample's eta is that of rays that enter"
    cause: ClassVar[str] = "the index handed to the renderer is not inverted on the inside, though the refraction is"
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
        f = fresnel.kind("exact").dielectric(cos, cos_t, eta)
        reflects = u.x < f
        m = frame.normal_like(wo) * ops.where(wo.z >= 0.0, 1.0, -1.0)
        wi = ops.where(reflects, frame.mirror(wo), frame.refract(wo, m, cos_t, eta))
        scale = ops.where(reflects, 1.0, 1.0 if mode == "importance" else 1.0 / ops.sqr(eta))
        pdf = ops.where(reflects, f, 1.0 - f)
        return go.Sample(wi, self.albedo * scale, pdf, pdf > 0.0, ops.where(reflects, 1.0, self.eta + 0.0 * eta))

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "always"


class W3Pane(go.BSDF):
    """A window pane: all reflections between its two faces; the rest goes straight on."""

    fault: ClassVar[str] = (
        "the light that passes is counted by up to ten percent too little; the probabilities do not sum to 1"
    )
    cause: ClassVar[str] = (
        "the passing ray's probability is 1 - R of one face, while it is chosen with 1 - 2 R / (1 + R)"
    )
    albedo: go.Colour = go.spectrum((0.95, 1.0, 0.97), "share of light that is not absorbed", low=0.0, high=1.0)
    eta: go.Number = go.number(1.5, "index of the pane", low=1.1, high=3.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.albedo * (0.0 * wo.z)

    def pdf(self, wo, wi):
        return 0.0 * wo.z

    def sample(self, wo, u, mode="radiance"):
        cos = ops.abs(wo.z)
        face = fresnel.kind("exact").dielectric(cos, fresnel.cos_transmitted(cos, self.eta), self.eta)
        pane = 2.0 * face / (1.0 + face)
        reflects = u.x < pane
        pdf = ops.where(reflects, pane, 1.0 - face)
        weight = ops.where(reflects, 1.0, (1.0 - pane) / ops.maximum(1.0 - face, 1e-6))
        return go.Sample(
            ops.where(reflects, frame.mirror(wo), -wo), self.albedo * weight, pdf, pdf > 0.0, 1.0 + 0.0 * pdf
        )

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "always"


class W3GlassFromInside(go.BSDF):
    """Rough glass."""

    fault: ClassVar[str] = "importance that leaves the glass is not the adjoint of radiance that enters it"
    cause: ClassVar[str] = (
        "mode importance multiplies by the square of the index inside on both sides, instead of by that of the relative index"
    )
    albedo: go.Colour = go.spectrum(0.95, "share of light that is not absorbed", low=0.0, high=1.0)
    eta: go.Number = go.number(1.4, "index inside over outside", low=1.1, high=3.0)
    alpha: go.Width = go.width(0.3, "width of the facets", low=0.05)

    def eval(self, wo, wi, mode="radiance"):
        value = glass_value(wo, wi, self.eta, self.alpha, "radiance")
        if mode == "importance":
            value = value * ops.where(wo.z * wi.z > 0.0, 1.0, ops.sqr(self.eta))
        return self.albedo * value

    def pdf(self, wo, wi):
        return glass_density(wo, wi, self.eta, self.alpha)

    def sample(self, wo, u, mode="radiance"):
        wi, eta, reflects = glass_direction(wo, u, self.eta, self.alpha)
        return glass_sample(self, wo, wi, eta, reflects, mode)

    @property
    def transmits(self):
        return True


class W3CoatFit(go.BSDF):
    """Plastic: a smooth coat, which mirrors, over a matte base, with all bounces between the two."""

    fault: ClassVar[str] = "a bright base reflects some percent more light than arrives; a dark one hardly"
    cause: ClassVar[str] = (
        "a coefficient of the fit of the coat's internal reflectance is mistyped, 0.0836 instead of 0.0636"
    )
    kd: go.Colour = go.spectrum((0.98, 0.7, 0.3), "albedo of the base", low=0.0, high=1.0)
    eta: go.Number = go.number(1.5, "index of the coat", low=1.3, high=2.0)

    def outer(self, cos):
        c = ops.clamp(cos, 0.0, 1.0)
        return fresnel.kind("exact").dielectric(c, fresnel.cos_transmitted(c, self.eta), self.eta)

    def inner(self):
        over = 1.0 / self.eta
        return 0.6681 + over * (0.7099 - 1.4399 * over) + 0.0836 * self.eta

    def eval(self, wo, wi, mode="radiance"):
        left = (1.0 - self.outer(wo.z)) * (1.0 - self.outer(wi.z)) / ops.sqr(self.eta)
        color = self.kd / (1.0 - self.kd * self.inner())
        return color * ops.where(upper(wo, wi), left * wi.z * ops.inv_pi, 0.0)

    def chance(self, wo):
        return ops.clamp(self.outer(wo.z), 0.1, 0.9)

    def pdf(self, wo, wi):
        return ops.where(upper(wo, wi), (1.0 - self.chance(wo)) * wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        p = self.chance(wo)
        mirrors = u.x < p
        wi = ops.where(mirrors, frame.mirror(wo), warp.square_to_cosine_hemisphere(u.y, u.z))
        above = wo.z > 0.0
        density = self.pdf(wo, wi)
        pdf = ops.where(above, ops.where(mirrors, p, density), 0.0)
        body = self.eval(wo, wi, mode) * ops.safe_div(1.0, density)
        coat = (self.outer(wo.z) / p) * ops.ones_like(self.kd)
        weight = ops.where(above, ops.where(mirrors, coat, body), 0.0)
        return go.Sample(wi, weight, pdf, mirrors & above, 1.0 + 0.0 * pdf)

    @property
    def delta(self):
        return "maybe"


class W3ChannelPick(go.BSDF):
    """A highlight that is wider in blue than in red, sampled by choosing a channel."""

    fault: ClassVar[str] = "red's lobe is sampled 5 percent more often than its density states, blue's less"
    cause: ClassVar[str] = "the channel is chosen by the bounds 0.35 and 0.67 instead of 1/3 and 2/3"
    only_rgb: ClassVar[bool] = True
    ks: go.Colour = go.spectrum(0.9, "reflectance", low=0.0, high=1.0)
    alpha: go.Number = go.number(0.3, "width of green", low=0.1, high=0.6)

    def widths(self):
        return [ops.vec2(self.alpha * k, self.alpha * k) for k in (0.4, 1.0, 1.6)]

    def eval(self, wo, wi, mode="radiance"):
        lobes = ops.of_channels(self.ks, [ggx_lobe(wo, wi, alpha) for alpha in self.widths()])
        return self.ks * ops.where(upper(wo, wi), lobes, 0.0)

    def pdf(self, wo, wi):
        red, green, blue = (ggx_density(wo, wi, alpha) for alpha in self.widths())
        return ops.where(upper(wo, wi), (red + green + blue) * (1.0 / 3.0), 0.0)

    def sample(self, wo, u, mode="radiance"):
        red, green, blue = self.widths()
        alpha = ops.where(u.x < 0.35, red, ops.where(u.x < 0.67, green, blue))
        return drawn(self, wo, frame.reflect(wo, ggx_normal(wo, u.y, u.z, alpha)), mode)


MUTANTS = [W3DeltaIndex, W3Pane, W3GlassFromInside, W3CoatFit, W3ChannelPick]
SOUND = []
