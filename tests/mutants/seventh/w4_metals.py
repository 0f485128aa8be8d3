"""Rough metals of GGX microfacets, each with one mistake."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.optics import frame


def density(m, alpha):
    """D of GGX."""
    stretch = ops.sqr(m.x / alpha.x) + ops.sqr(m.y / alpha.y) + ops.sqr(m.z)
    return ops.inv_pi / (alpha.x * alpha.y * ops.sqr(ops.maximum(stretch, 1e-3)))


def projected(v, alpha):
    """|v| after stretching: (1 + 2 Lambda) v_z."""
    return ops.sqrt(ops.sqr(v.z) + ops.sqr(alpha.x * v.x) + ops.sqr(alpha.y * v.y))


def masked(wo, wi, alpha):
    """G2 / (4 o_z) of correlated Smith masking."""
    both = projected(wo, alpha) * wi.z + projected(wi, alpha) * wo.z
    return 0.5 * wi.z / ops.maximum(both, 1e-12)


def visible_density(wo, wi, alpha):
    """G1(o) D / (4 o_z): the density of directions reflected at visible normals."""
    m = frame.half_vector(wo, wi)
    return 0.5 * density(m, alpha) / ops.maximum(wo.z + projected(wo, alpha), 1e-12)


def visible_cap(v, u1, u2):
    """A visible normal of the hemisphere, not normalized (Dupuy and Benyoub)."""
    s, c = ops.sincos(2.0 * ops.pi * u1)
    z = (1.0 - u2) * (1.0 + v.z) - v.z
    r = ops.safe_sqrt(1.0 - ops.sqr(z))
    return ops.vec3(r * c + v.x, r * s + v.y, ops.maximum(z + v.z, 1e-9))


def visible_normal(wo, u1, u2, alpha):
    """A visible normal of GGX."""
    v = ops.normalize(ops.vec3(alpha.x * wo.x, alpha.y * wo.y, wo.z))
    h = visible_cap(v, u1, u2)
    return ops.normalize(ops.vec3(alpha.x * h.x, alpha.y * h.y, h.z))


def any_normal(u1, u2, alpha):
    """A normal of density D m_z."""
    s, c = ops.sincos(2.0 * ops.pi * u1)
    slope = ops.sqrt(u2 / ops.maximum(1.0 - u2, 1e-7))
    return ops.normalize(ops.vec3(alpha.x * slope * c, alpha.y * slope * s, 1.0 + 0.0 * slope))


def schlick(cos, r0):
    """Schlick's Fresnel reflectance."""
    return r0 + (1.0 - r0) * ops.pow(1.0 - cos, 5.0)


def above(wo, wi):
    return (wo.z > 0.0) & (wi.z > 0.0)


class W4Copper(go.BSDF):
    """GGX copper, sampled by its visible normals."""

    fault: ClassVar[str] = "pdf is the density of all normals while sample draws visible normals"
    cause: ClassVar[str] = (
        "pdf returns D(m) m_z / (4 o.m), the density of sampling the full distribution of normals, but sample draws "
        "visible normals, whose density is G1(o) D(m) / (4 o_z)"
    )
    r0: go.Colour = go.spectrum((0.95, 0.64, 0.54), "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.35, "width", low=0.02)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        f = schlick(ops.dot(wo, m), self.r0) * (density(m, self.alpha) * masked(wo, wi, self.alpha))
        return ops.where(above(wo, wi), f, 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        p = density(m, self.alpha) * m.z / (4.0 * ops.maximum(ops.dot(wo, m), 1e-9))
        return ops.where(above(wo, wi), p, 0.0)

    def sample(self, wo, u, mode="radiance"):
        wi = frame.reflect(wo, visible_normal(wo, u.y, u.z, self.alpha))
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class W4Silver(go.BSDF):
    """Anisotropic GGX silver, sampled by its visible normals."""

    fault: ClassVar[str] = "the sampled normal is stretched back by alpha_x along both axes"
    cause: ClassVar[str] = (
        "in sample, the visible normal is unstretched with alpha.x for its y component too (a copy-and-paste slip; "
        "alpha.y is meant), so anisotropic surfaces are sampled with a density other than pdf"
    )
    r0: go.Colour = go.spectrum(0.95, "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Width = go.width((0.15, 0.45), "widths", low=0.02)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        f = schlick(ops.dot(wo, m), self.r0) * (density(m, self.alpha) * masked(wo, wi, self.alpha))
        return ops.where(above(wo, wi), f, 0.0)

    def pdf(self, wo, wi):
        return ops.where(above(wo, wi), visible_density(wo, wi, self.alpha), 0.0)

    def sample(self, wo, u, mode="radiance"):
        v = ops.normalize(ops.vec3(self.alpha.x * wo.x, self.alpha.y * wo.y, wo.z))
        h = visible_cap(v, u.y, u.z)
        m = ops.normalize(ops.vec3(self.alpha.x * h.x, self.alpha.x * h.y, h.z))
        wi = frame.reflect(wo, m)
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class W4Titanium(go.BSDF):
    """GGX titanium with height-correlated masking, whose samples' weights are written in closed form."""

    fault: ClassVar[str] = "the weight of a sample is F G1(i), which belongs to separable masking"
    cause: ClassVar[str] = (
        "sample's weight is F G1(wi), i.e. G2 / G1(wo) for separable Smith masking, but eval uses the "
        "height-correlated G2; the weight is therefore not eval / pdf (it is too low)"
    )
    r0: go.Colour = go.spectrum((0.54, 0.50, 0.45), "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.5, "width", low=0.02)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        f = schlick(ops.dot(wo, m), self.r0) * (density(m, self.alpha) * masked(wo, wi, self.alpha))
        return ops.where(above(wo, wi), f, 0.0)

    def pdf(self, wo, wi):
        return ops.where(above(wo, wi), visible_density(wo, wi, self.alpha), 0.0)

    def sample(self, wo, u, mode="radiance"):
        m = visible_normal(wo, u.y, u.z, self.alpha)
        wi = frame.reflect(wo, m)
        pdf = self.pdf(wo, wi)
        g1 = 2.0 * wi.z / ops.maximum(wi.z + projected(wi, self.alpha), 1e-12)
        weight = schlick(ops.dot(wo, m), self.r0) * g1
        return go.Sample(wi, ops.where(pdf > 0.0, weight, 0.0), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class W4Chrome(go.BSDF):
    """GGX chrome controlled by an artist's roughness, alpha = roughness^2."""

    fault: ClassVar[str] = "masking squares the roughness twice, so that rough surfaces gain energy toward grazing"
    cause: ClassVar[str] = (
        "the masking-shadowing term is given alpha^2 = roughness^4 where the distribution has alpha = roughness^2 "
        "(squared once too often): too little is masked, and the albedo exceeds 1 at grazing views"
    )
    r0: go.Colour = go.spectrum(0.9, "reflectance at normal incidence", low=0.0, high=1.0)
    roughness: go.Number = go.number(0.7, "square root of alpha", low=0.15, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        a = ops.sqr(self.roughness)
        m = frame.half_vector(wo, wi)
        g = masked(wo, wi, ops.vec2(ops.sqr(a), ops.sqr(a)))
        f = schlick(ops.dot(wo, m), self.r0) * (density(m, ops.vec2(a, a)) * g)
        return ops.where(above(wo, wi), f, 0.0)

    def pdf(self, wo, wi):
        a = ops.sqr(self.roughness)
        m = frame.half_vector(wo, wi)
        p = density(m, ops.vec2(a, a)) * m.z / (4.0 * ops.maximum(ops.dot(wo, m), 1e-9))
        return ops.where(above(wo, wi), p, 0.0)

    def sample(self, wo, u, mode="radiance"):
        a = ops.sqr(self.roughness)
        wi = frame.reflect(wo, any_normal(u.y, u.z, ops.vec2(a, a)))
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class W4Brass(go.BSDF):
    """GGX brass with Schlick's Fresnel reflectance."""

    fault: ClassVar[str] = "Fresnel is evaluated at the viewer's angle to the surface"
    cause: ClassVar[str] = (
        "F is evaluated at wo.z, the view's angle to the surface normal, instead of wo.m, the angle to the microfacet; "
        "the BRDF is then not reciprocal"
    )
    r0: go.Colour = go.spectrum((0.89, 0.75, 0.35), "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.3, "width", low=0.02)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        f = schlick(wo.z, self.r0) * (density(m, self.alpha) * masked(wo, wi, self.alpha))
        return ops.where(above(wo, wi), f, 0.0)

    def pdf(self, wo, wi):
        return ops.where(above(wo, wi), visible_density(wo, wi, self.alpha), 0.0)

    def sample(self, wo, u, mode="radiance"):
        wi = frame.reflect(wo, visible_normal(wo, u.y, u.z, self.alpha))
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class W4Brushed(go.BSDF):
    """Brushed steel: anisotropic GGX whose brushing direction is an angle."""

    fault: ClassVar[str] = "the sampled direction is rotated the wrong way out of the brushing's frame"
    cause: ClassVar[str] = (
        "sample turns its direction by `rotate` where `rotate_back` is needed: the lobe is sampled in the rotated "
        "frame and not returned to the surface's, so its density is not pdf unless rotation is 0"
    )
    r0: go.Colour = go.spectrum(0.6, "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Width = go.width((0.12, 0.4), "widths along and across the rotated axis", low=0.02)
    rotation: go.Angle = go.angle(0.6, "direction of the brushing")

    def eval(self, wo, wi, mode="radiance"):
        o, i = frame.rotate(wo, self.rotation), frame.rotate(wi, self.rotation)
        m = frame.half_vector(o, i)
        f = schlick(ops.dot(o, m), self.r0) * (density(m, self.alpha) * masked(o, i, self.alpha))
        return ops.where(above(wo, wi), f, 0.0)

    def pdf(self, wo, wi):
        o, i = frame.rotate(wo, self.rotation), frame.rotate(wi, self.rotation)
        return ops.where(above(wo, wi), visible_density(o, i, self.alpha), 0.0)

    def sample(self, wo, u, mode="radiance"):
        o = frame.rotate(wo, self.rotation)
        i = frame.reflect(o, visible_normal(o, u.y, u.z, self.alpha))
        wi = frame.rotate(i, self.rotation)
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class W4Polished(go.BSDF):
    """Polished GGX metal with a narrow highlight."""

    fault: ClassVar[str] = "D cancels in float32 for narrow highlights"
    cause: ClassVar[str] = (
        "D's denominator is computed as m_z^2 (alpha^2 - 1) + 1, which cancels catastrophically in float32 near the "
        "peak for small alpha; the sine should come from m_x and m_y. Values differ between float32 and float64"
    )
    r0: go.Colour = go.spectrum(0.9, "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Number = go.number(0.001, "width", low=0.001, high=0.5)

    def D(self, m):
        a2 = ops.sqr(self.alpha)
        d = ops.sqr(m.z) * (a2 - 1.0) + 1.0
        return a2 * ops.inv_pi / ops.sqr(d)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        pair = ops.vec2(self.alpha, self.alpha)
        f = schlick(ops.dot(wo, m), self.r0) * (self.D(m) * masked(wo, wi, pair))
        return ops.where(above(wo, wi), f, 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        p = 0.5 * self.D(m) / ops.maximum(wo.z + projected(wo, ops.vec2(self.alpha, self.alpha)), 1e-12)
        return ops.where(above(wo, wi), p, 0.0)

    def sample(self, wo, u, mode="radiance"):
        wi = frame.reflect(wo, visible_normal(wo, u.y, u.z, ops.vec2(self.alpha, self.alpha)))
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class W4Gold(go.BSDF):
    """GGX gold: a hue, taken from a base color, times a brightness."""

    fault: ClassVar[str] = "the hue is the color over its luminance, so a channel of the reflectance exceeds 1"
    cause: ClassVar[str] = (
        "the color is normalized by its luminance (as Disney's tint) and used as reflectance: channels brighter than "
        "the luminance exceed 1 in saturated colors, so the red channel reflects more than it receives; it should be "
        "divided by its largest channel"
    )
    base: go.Colour = go.spectrum((1.0, 0.70, 0.25), "color whose hue is used", low=0.05, high=1.0)
    brightness: go.Number = go.number(0.95, "brightness", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.2, "width", low=0.02)

    def reflectance(self):
        r, g, b = ops.channels(self.base)
        luminance = 0.2126 * r + 0.7152 * g + 0.0722 * b
        return self.base * (self.brightness / luminance)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        f = self.reflectance() * (density(m, self.alpha) * masked(wo, wi, self.alpha))
        return ops.where(above(wo, wi), f, 0.0)

    def pdf(self, wo, wi):
        return ops.where(above(wo, wi), visible_density(wo, wi, self.alpha), 0.0)

    def sample(self, wo, u, mode="radiance"):
        wi = frame.reflect(wo, visible_normal(wo, u.y, u.z, self.alpha))
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class W4Iron(go.BSDF):
    """Cast iron: rough GGX, sampled by all normals."""

    fault: ClassVar[str] = "directions below the surface are flipped up instead of failing"
    cause: ClassVar[str] = (
        "sample takes |wi.z| of reflections that point below the surface; such samples must fail (weight = pdf = 0). "
        "The flipped directions add a density that pdf does not contain"
    )
    r0: go.Colour = go.spectrum((0.53, 0.51, 0.49), "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.6, "width", low=0.02)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        f = schlick(ops.dot(wo, m), self.r0) * (density(m, self.alpha) * masked(wo, wi, self.alpha))
        return ops.where(above(wo, wi), f, 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        p = density(m, self.alpha) * m.z / (4.0 * ops.maximum(ops.dot(wo, m), 1e-9))
        return ops.where(above(wo, wi), p, 0.0)

    def sample(self, wo, u, mode="radiance"):
        mirrored = frame.reflect(wo, any_normal(u.y, u.z, self.alpha))
        wi = ops.vec3(mirrored.x, mirrored.y, ops.abs(mirrored.z))
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


MUTANTS = [W4Copper, W4Silver, W4Titanium, W4Chrome, W4Brass, W4Brushed, W4Polished, W4Gold, W4Iron]
SOUND = []
