"""Metals of microfacets, each with one mistake."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.ops import sqr
from gonio.optics import frame


def above(wo, wi):
    return (wo.z > 0.0) & (wi.z > 0.0)


def drawn(material, wo, wi, mode):
    pdf = material.pdf(wo, wi)
    weight = material.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
    return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


def stretched_length(w, alpha):
    return ops.sqrt(sqr(alpha.x * w.x) + sqr(alpha.y * w.y) + sqr(w.z))


def ggx_D(m, alpha):
    s = sqr(m.x / alpha.x) + sqr(m.y / alpha.y) + sqr(m.z)
    return ops.where(m.z > 0.0, 1.0 / (ops.pi * alpha.x * alpha.y * ops.maximum(sqr(s), 1e-12)), 0.0)


def ggx_normal(u1, u2, alpha):
    """A normal with density D m_z."""
    r = ops.sqrt(u1 / (1.0 - u1))
    s, c = ops.sincos(2.0 * ops.pi * u2)
    return ops.normalize(ops.vec3(alpha.x * r * c, alpha.y * r * s, 1.0 + 0.0 * r))


def visible_normal(wo, u1, u2, alpha):
    """A visible normal of GGX, by a spherical cap."""
    v = ops.normalize(ops.vec3(alpha.x * wo.x, alpha.y * wo.y, wo.z))
    z = (1.0 - u1) * (1.0 + v.z) - v.z
    r = ops.safe_sqrt(1.0 - sqr(z))
    s, c = ops.sincos(2.0 * ops.pi * u2)
    return ops.normalize(ops.vec3(alpha.x * (r * c + v.x), alpha.y * (r * s + v.y), ops.maximum(z + v.z, 1e-6)))


class _W1Ggx2(go.BSDF):
    """A GGX metal with Schlick's reflectance and height-correlated masking."""

    r0: go.Colour = go.spectrum((0.9, 0.7, 0.4), "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.4, "width", low=0.02, high=1.0)

    def F(self, cos):
        return self.r0 + (1.0 - self.r0) * ops.pow(1.0 - cos, 5.0)

    def D(self, m):
        return ggx_D(m, self.alpha)

    def visibility(self, wo, wi):
        """G / (4 o.z i.z), times i.z."""
        a = self.alpha
        return 0.5 * wi.z / ops.maximum(wi.z * stretched_length(wo, a) + wo.z * stretched_length(wi, a), 1e-9)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        value = self.F(ops.dot(wo, m)) * (self.D(m) * self.visibility(wo, wi))
        return ops.where(above(wo, wi), value, 0.0)


class _W1Visible2(_W1Ggx2):
    """The same, sampled by visible normals."""

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        density = self.D(m) * 0.5 / ops.maximum(wo.z + stretched_length(wo, self.alpha), 1e-9)
        return ops.where(above(wo, wi), density, 0.0)

    def normal(self, wo, u1, u2):
        return visible_normal(wo, u1, u2, self.alpha)

    def sample(self, wo, u, mode="radiance"):
        return drawn(self, wo, frame.reflect(wo, self.normal(wo, u.y, u.z)), mode)


class W1VisibleOldPdf(_W1Visible2):
    """A GGX metal, sampled by visible normals."""

    fault: ClassVar[str] = "the pdf is that of another sampler: too small near grazing views and wrong in shape"
    cause: ClassVar[str] = (
        "normals are sampled as visible ones, but the pdf is D m_z / (4 o.m), the density of all normals"
    )

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        return ops.where(above(wo, wi), ops.safe_div(self.D(m) * m.z, 4.0 * ops.dot(wo, m)), 0.0)


class W1VisibleOneStretch(_W1Visible2):
    """An anisotropic GGX metal, sampled by visible normals."""

    fault: ClassVar[str] = "the sampled normals are too narrow along y; right where both widths are equal"
    cause: ClassVar[str] = (
        "the sampled normal is stretched back by alpha.x in both directions instead of by alpha.y along y"
    )
    alpha: go.Width = go.width((0.2, 0.45), "width", low=0.02, high=1.0)

    def normal(self, wo, u1, u2):
        a = self.alpha
        v = ops.normalize(ops.vec3(a.x * wo.x, a.y * wo.y, wo.z))
        z = (1.0 - u1) * (1.0 + v.z) - v.z
        r = ops.safe_sqrt(1.0 - sqr(z))
        s, c = ops.sincos(2.0 * ops.pi * u2)
        return ops.normalize(ops.vec3(a.x * (r * c + v.x), a.x * (r * s + v.y), ops.maximum(z + v.z, 1e-6)))


class W1VisibleFullDisk(_W1Visible2):
    """A GGX metal, sampled by visible normals as on a projected disk (Heitz2018)."""

    fault: ClassVar[str] = (
        "at oblique views normals are sampled that the viewer does not see, in a density other than the pdf"
    )
    cause: ClassVar[str] = (
        "the step that squeezes the disk into its visible part, t2 = (1 - s) sqrt(1 - t1^2) + s t2, is missing"
    )

    def normal(self, wo, u1, u2):
        a = self.alpha
        v = ops.normalize(ops.vec3(a.x * wo.x, a.y * wo.y, wo.z))
        length2 = frame.sin2(v)
        flat = length2 < 1e-12
        over = ops.rsqrt(ops.where(flat, 1.0, length2))
        tx, ty = ops.where(flat, 1.0, -v.y * over), ops.where(flat, 0.0, v.x * over)
        bx, by, bz = -v.z * ty, v.z * tx, v.x * ty - v.y * tx
        r = ops.sqrt(u1)
        s, c = ops.sincos(2.0 * ops.pi * u2)
        t1, t2 = r * c, r * s
        up = ops.safe_sqrt(1.0 - sqr(t1) - sqr(t2))
        x = tx * t1 + bx * t2 + v.x * up
        y = ty * t1 + by * t2 + v.y * up
        z = bz * t2 + v.z * up
        return ops.normalize(ops.vec3(a.x * x, a.y * y, ops.maximum(z, 1e-6)))


class W1SwappedMasking(_W1Ggx2):
    """An anisotropic GGX metal."""

    fault: ClassVar[str] = (
        "facets that should be hidden along the rough axis are not: at grazing views more light leaves than arrives"
    )
    cause: ClassVar[str] = "alpha.x and alpha.y are swapped in the masking term"
    alpha: go.Width = go.width((0.15, 0.6), "width", low=0.02, high=1.0)

    def visibility(self, wo, wi):
        a = ops.vec2(self.alpha.y, self.alpha.x)
        return 0.5 * wi.z / ops.maximum(wi.z * stretched_length(wo, a) + wo.z * stretched_length(wi, a), 1e-9)


class W1FresnelAtNormal(_W1Ggx2):
    """A GGX plastic highlight."""

    fault: ClassVar[str] = "the reflectance depends on the light's angle to the surface, so the BRDF is not reciprocal"
    cause: ClassVar[str] = "Fresnel's term is evaluated at n.wi instead of at the half vector, o.m"
    r0: go.Colour = go.spectrum(0.06, "reflectance at normal incidence", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        value = self.F(ops.clamp(wi.z, 0.0, 1.0)) * (self.D(m) * self.visibility(wo, wi))
        return ops.where(above(wo, wi), value, 0.0)


class W1EdgeTintNegative(_W1Ggx2):
    """A GGX metal with a color at 82 degrees, for artists."""

    fault: ClassVar[str] = "around 82 degrees the reflectance of a channel with a dark edge color is negative"
    cause: ClassVar[str] = (
        "the edge term is (1 - c)^5 c where its coefficient was solved for c (1 - c)^6, so it subtracts too much"
    )
    r0: go.Colour = go.spectrum((0.95, 0.7, 0.5), "reflectance at normal incidence", low=0.0, high=1.0)
    edge: go.Colour = go.spectrum((0.95, 0.4, 0.02), "factor of the reflectance at 82 degrees", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.15, "width", low=0.02, high=1.0)

    def F(self, cos):
        at = 1.0 / 7.0
        there = self.r0 + (1.0 - self.r0) * ((1.0 - at) ** 5)
        coefficient = there * (1.0 - self.edge) / (at * (1.0 - at) ** 6)
        schlick = self.r0 + (1.0 - self.r0) * ops.pow(1.0 - cos, 5.0)
        return schlick - coefficient * (cos * ops.pow(1.0 - cos, 5.0))


class W1RationalTypo(go.BSDF):
    """A Beckmann metal with the rational fit of Smith's masking."""

    fault: ClassVar[str] = "masking is up to 17 percent over 1 at oblique directions: energy from nothing"
    cause: ClassVar[str] = "a typo in the rational fit of G1: 1.276 instead of 2.276"
    r0: go.Colour = go.spectrum(0.85, "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Number = go.number(0.12, "width", low=0.02, high=1.0)

    def G1(self, w):
        a = w.z / ops.maximum(self.alpha * ops.sqrt(frame.sin2(w)), 1e-9)
        return ops.where(a < 1.6, (3.535 * a + 2.181 * sqr(a)) / (1.0 + 1.276 * a + 2.577 * sqr(a)), 1.0)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        z2 = ops.maximum(sqr(m.z), 1e-3)
        D = ops.exp(-frame.sin2(m) / (z2 * sqr(self.alpha))) / (ops.pi * sqr(self.alpha) * sqr(z2))
        F = self.r0 + (1.0 - self.r0) * ops.pow(1.0 - ops.dot(wo, m), 5.0)
        value = F * (D * self.G1(wo) * self.G1(wi) / (4.0 * ops.maximum(wo.z, 1e-7)))
        return ops.where(above(wo, wi) & (m.z > 0.0), value, 0.0)


class W1SampleBelow(_W1Visible2):
    """A rough GGX metal, sampled by visible normals."""

    fault: ClassVar[str] = (
        "sample returns directions below the surface with weights over 0, although the metal is opaque"
    )
    cause: ClassVar[str] = "sample does not test that the reflected direction is above the surface"
    alpha: go.Width = go.width(0.6, "width", low=0.02, high=1.0)

    def sample(self, wo, u, mode="radiance"):
        m = self.normal(wo, u.y, u.z)
        wi = frame.reflect(wo, m)
        up = ops.vec3(wi.x, wi.y, ops.abs(wi.z))
        density = self.D(m) * 0.5 / ops.maximum(wo.z + stretched_length(wo, self.alpha), 1e-9)
        pdf = ops.where(wo.z > 0.0, density, 0.0)
        value = self.F(ops.dot(wo, m)) * (self.D(m) * self.visibility(wo, up))
        weight = value * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


MUTANTS = [
    W1VisibleOldPdf,
    W1VisibleOneStretch,
    W1VisibleFullDisk,
    W1SwappedMasking,
    W1FresnelAtNormal,
    W1EdgeTintNegative,
    W1RationalTypo,
    W1SampleBelow,
]
SOUND = []
