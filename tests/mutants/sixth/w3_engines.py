"""Bugs of renderers and engines, each rewritten as a small material: reflection."""

from typing import ClassVar

import gonio as go
import numpy as np
from gonio import ops
from gonio.optics import frame, warp


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


class W3SheenOnTop(go.BSDF):
    """Cloth: Charlie sheen over a matte base. Imitates three.js before its sheen was made to conserve energy (pull request 32147)."""

    fault: ClassVar[str] = "a bright cloth reflects more light than arrives, most toward grazing angles"
    cause: ClassVar[str] = "the sheen is added to the base, which is not scaled down by the sheen's albedo"
    kd: go.Colour = go.spectrum((0.9, 0.85, 0.8), "albedo of the base", low=0.0, high=1.0)
    sheen: go.Colour = go.spectrum((0.6, 0.6, 0.8), "color of the sheen", low=0.0, high=1.0)
    roughness: go.Number = go.number(0.5, "roughness of the sheen", low=0.1, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        over = 1.0 / self.roughness
        d = (2.0 + over) * (0.5 * ops.inv_pi) * ops.pow(ops.safe_sqrt(1.0 - ops.sqr(m.z)), over)
        v = 1.0 / (4.0 * ops.maximum(wo.z + wi.z - wo.z * wi.z, 1e-6))
        return ops.where(upper(wo, wi), (self.sheen * (d * v) + self.kd * ops.inv_pi) * wi.z, 0.0)


class W3CoatOneSided(go.BSDF):
    """Lacquer over matte paint. Imitates the clear coat of real-time engines (three.js, Babylon.js), which dims by the viewer's angle."""

    fault: ClassVar[str] = "the coated base is not reciprocal: the coat's loss depends on the viewer's angle only"
    cause: ClassVar[str] = "the base is multiplied by 1 - F(n.v) once, and not by 1 - F(n.l)"
    kd: go.Colour = go.spectrum((0.7, 0.1, 0.1), "albedo of the base", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.2, "width of the coat's facets", low=0.05)

    def fresnel(self, cos):
        return 0.04 + 0.96 * ops.pow(1.0 - cos, 5.0)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        coat = self.fresnel(ops.clamp(ops.dot(wo, m), 0.0, 1.0)) * ggx_lobe(wo, wi, self.alpha)
        base = self.kd * ((1.0 - self.fresnel(ops.clamp(wo.z, 0.0, 1.0))) * wi.z * ops.inv_pi)
        return ops.where(upper(wo, wi), base + coat, 0.0)

    def pdf(self, wo, wi):
        density = 0.3 * ggx_density(wo, wi, self.alpha) + 0.7 * wi.z * ops.inv_pi
        return ops.where(upper(wo, wi), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        shiny = frame.reflect(wo, ggx_normal(wo, u.y, u.z, self.alpha))
        wi = ops.where(u.x < 0.3, shiny, warp.square_to_cosine_hemisphere(u.y, u.z))
        return drawn(self, wo, wi, mode)


class W3ToonCone(go.BSDF):
    """A toon highlight: even within a cone about the mirror direction. Imitates reports on the toon closure of Blender Cycles."""

    fault: ClassVar[str] = "the middle of the highlight is sampled too often"
    cause: ClassVar[str] = "the cone's angle is drawn evenly, while pdf is even per solid angle"
    ks: go.Colour = go.spectrum(0.8, "color", low=0.0, high=1.0)
    size: go.Number = go.number(0.4, "half angle of the cone", low=0.1, high=1.2)

    def inside(self, wo, wi):
        return upper(wo, wi) & (ops.dot(frame.mirror(wo), wi) > ops.cos(self.size))

    def per_angle(self):
        return 1.0 / (2.0 * ops.pi * (1.0 - ops.cos(self.size)))

    def eval(self, wo, wi, mode="radiance"):
        return self.ks * ops.where(self.inside(wo, wi), self.per_angle() * wi.z, 0.0)

    def pdf(self, wo, wi):
        return ops.where(self.inside(wo, wi), self.per_angle(), 0.0)

    def sample(self, wo, u, mode="radiance"):
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        sin, cos = ops.sincos(self.size * u.y)
        wi = warp.to_frame(frame.mirror(wo), ops.vec3(sin * c, sin * s, cos))
        return drawn(self, wo, wi, mode)


class W3WrappedLambert(go.BSDF):
    """Soft matte paint: light wraps around. Imitates Godot's 'Lambert wrap', which its shader calls energy conserving."""

    fault: ClassVar[str] = (
        "the value is not reciprocal and does not vanish for light along the surface: f is unbounded there"
    )
    cause: ClassVar[str] = "(n.l + w) / (1 + w)^2 replaces the cosine, which is not part of the BRDF, by a shifted one"
    kd: go.Colour = go.spectrum(0.6, "albedo", low=0.0, high=1.0)
    wrap: go.Number = go.number(0.3, "how far light wraps", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        soft = (wi.z + self.wrap) / ops.sqr(1.0 + self.wrap)
        return self.kd * ops.where(upper(wo, wi), soft * ops.inv_pi, 0.0)


class W3RoughDiffuse(go.BSDF):
    """Disney's diffuse lobe. Imitates its first use in engines (Unity, Frostbite), before it was renormalized."""

    fault: ClassVar[str] = "rough bright paint reflects up to 40 percent more than arrives toward grazing views"
    cause: ClassVar[str] = (
        "f_d90 = 0.5 + 2 roughness (l.h)^2 raises the lobe above 1 at grazing angles, without the factor that renormalizes it"
    )
    kd: go.Colour = go.spectrum(0.97, "albedo", low=0.0, high=1.0)
    roughness: go.Number = go.number(1.0, "roughness", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        rise = 2.0 * self.roughness * ops.sqr(ops.dot(wi, m)) - 0.5
        light = 1.0 + rise * ops.pow(1.0 - wi.z, 5.0)
        view = 1.0 + rise * ops.pow(1.0 - wo.z, 5.0)
        return self.kd * ops.where(upper(wo, wi), light * view * wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(upper(wo, wi), wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        return drawn(self, wo, warp.square_to_cosine_hemisphere(u.y, u.z), mode)


class W3HalfFloat(go.BSDF):
    """Metal of GGX facets on a phone. Imitates Filament's issue of n.h in 16-bit floats, where 1 - (n.h)^2 has few digits."""

    fault: ClassVar[str] = "the peak is a flat disk with rings, and the density does not integrate to 1"
    cause: ClassVar[str] = "the cosine of the half vector is rounded to 11 bits before 1 - cos^2"
    kd: go.Colour = go.spectrum((0.9, 0.7, 0.4), "reflectance", low=0.0, high=1.0)
    alpha: go.Number = go.number(0.04, "width of the facets", low=0.02, high=1.0)

    def D(self, m):
        z = ops.floor(m.z * 2048.0 + 0.5) * (1.0 / 2048.0)
        a2 = ops.sqr(self.alpha)
        return a2 / (ops.pi * ops.sqr((1.0 - z * z) + a2 * z * z))

    def width(self):
        return ops.vec2(self.alpha, self.alpha)

    def eval(self, wo, wi, mode="radiance"):
        lambdas = ggx_lambda(wo, self.width()) + ggx_lambda(wi, self.width())
        value = self.D(frame.half_vector(wo, wi)) / ((1.0 + lambdas) * 4.0 * ops.maximum(wo.z, 1e-6))
        return self.kd * ops.where(upper(wo, wi), value, 0.0)

    def pdf(self, wo, wi):
        density = self.D(frame.half_vector(wo, wi)) / (
            (1.0 + ggx_lambda(wo, self.width())) * 4.0 * ops.maximum(wo.z, 1e-6)
        )
        return ops.where(upper(wo, wi), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        return drawn(self, wo, frame.reflect(wo, ggx_normal(wo, u.y, u.z, self.width())), mode)


class W3SheenUniform(go.BSDF):
    """Disney's sheen, a Schlick weight. Imitates a fix in appleseed's Disney BRDF, whose sheen was sampled by one law and weighted by another."""

    fault: ClassVar[str] = (
        "directions are even over the hemisphere, the density is that of the cosine: weights are far off"
    )
    cause: ClassVar[str] = "sample draws uniform directions, pdf returns cos / pi"
    sheen: go.Colour = go.spectrum((0.5, 0.4, 0.6), "color", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        weight = ops.pow(1.0 - ops.clamp(ops.dot(wi, frame.half_vector(wo, wi)), 0.0, 1.0), 5.0)
        return self.sheen * ops.where(upper(wo, wi), weight * wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(upper(wo, wi), wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        r = ops.safe_sqrt(1.0 - ops.sqr(u.y))
        return drawn(self, wo, ops.vec3(r * c, r * s, 1.0 * u.y), mode)


class W3Quadrants(go.BSDF):
    """Ashikhmin and Shirley's anisotropic highlight. Imitates ports of its sampler by quadrants, one of which is written twice."""

    fault: ClassVar[str] = "a quarter of the half vectors is never sampled, its neighbor twice as often"
    cause: ClassVar[str] = "the fourth quadrant of the azimuth is mirrored into the third"
    ks: go.Colour = go.spectrum(0.8, "color", low=0.0, high=1.0)
    nu: go.Number = go.number(60.0, "exponent along x", low=1.0, high=2000.0)
    nv: go.Number = go.number(20.0, "exponent along y", low=1.0, high=2000.0)

    def D(self, m):
        sin2 = ops.maximum(frame.sin2(m), 1e-12)
        exponent = (self.nu * ops.sqr(m.x) + self.nv * ops.sqr(m.y)) / sin2
        return ops.sqrt((self.nu + 1.0) * (self.nv + 1.0)) * (0.5 * ops.inv_pi) * ops.pow(m.z, exponent)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        cos = ops.maximum(ops.dot(wo, m), 1e-6)
        value = self.D(m) * wi.z / (4.0 * cos * ops.maximum(ops.maximum(wo.z, wi.z), 1e-6))
        return self.ks * ops.where(upper(wo, wi), value, 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        return ops.where(upper(wo, wi), self.D(m) / (4.0 * ops.maximum(ops.dot(wo, m), 1e-6)), 0.0)

    def sample(self, wo, u, mode="radiance"):
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        c = ops.where(u.z > 0.75, -c, c)
        azimuth = ops.normalize(ops.vec2(c / ops.sqrt(self.nu + 1.0), s / ops.sqrt(self.nv + 1.0)))
        exponent = self.nu * ops.sqr(azimuth.x) + self.nv * ops.sqr(azimuth.y)
        cos = ops.pow(1.0 - u.y, 1.0 / (exponent + 1.0))
        sin = ops.safe_sqrt(1.0 - ops.sqr(cos))
        return drawn(self, wo, frame.reflect(wo, ops.vec3(sin * azimuth.x, sin * azimuth.y, cos)), mode)

    @property
    def isotropic(self):
        return bool(np.all(np.asarray(self.plain.nu) == np.asarray(self.plain.nv)))


class W3SwappedPdf(go.BSDF):
    """Measured metal, here GGX. Imitates pbrt-v4's MeasuredBxDF (pull request 215), whose PDF had wo and wi flipped relative to Sample_f."""

    fault: ClassVar[str] = "the density is that of sampling wo for a given wi"
    cause: ClassVar[str] = "pdf has its two directions exchanged"
    kd: go.Colour = go.spectrum((0.9, 0.6, 0.3), "reflectance", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.35, "width of the facets", low=0.05)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where(upper(wo, wi), ggx_lobe(wo, wi, self.alpha), 0.0)

    def pdf(self, wo, wi):
        return ops.where(upper(wo, wi), ggx_density(wi, wo, self.alpha), 0.0)

    def sample(self, wo, u, mode="radiance"):
        return drawn(self, wo, frame.reflect(wo, ggx_normal(wo, u.y, u.z, self.alpha)), mode)


class W3LobeWeights(go.BSDF):
    """Plastic of facets over paint. Imitates three-gpu-pathtracer's issue 847: lobe weights from wo when sampling, from the half vector in the density."""

    fault: ClassVar[str] = "the density differs from that of the samples wherever the half vector is not the normal"
    cause: ClassVar[str] = "sample chooses the lobe by Fresnel at n.wo, pdf mixes the densities by Fresnel at wo.h"
    kd: go.Colour = go.spectrum((0.2, 0.4, 0.6), "albedo of the base", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.4, "width of the facets", low=0.05)
    r0: go.Number = go.number(0.05, "reflectance at normal incidence", low=0.0, high=1.0)

    def fresnel(self, cos):
        return self.r0 + (1.0 - self.r0) * ops.pow(1.0 - ops.clamp(cos, 0.0, 1.0), 5.0)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        shine = self.fresnel(ops.dot(wo, m)) * ggx_lobe(wo, wi, self.alpha)
        left = (1.0 - ops.pow(1.0 - wo.z, 5.0)) * (1.0 - ops.pow(1.0 - wi.z, 5.0)) * (1.0 - self.r0) * 1.05
        return ops.where(upper(wo, wi), self.kd * (left * wi.z * ops.inv_pi) + shine, 0.0)

    def weight(self, cos):
        f = self.fresnel(cos)
        return f / (f + 0.5 * (1.0 - f))

    def pdf(self, wo, wi):
        p = self.weight(ops.dot(wo, frame.half_vector(wo, wi)))
        density = p * ggx_density(wo, wi, self.alpha) + (1.0 - p) * wi.z * ops.inv_pi
        return ops.where(upper(wo, wi), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        shiny = frame.reflect(wo, ggx_normal(wo, u.y, u.z, self.alpha))
        matte = warp.square_to_cosine_hemisphere(u.y, u.z)
        wi = ops.where(u.x < self.weight(wo.z), shiny, matte)
        return drawn(self, wo, wi, mode)


class W3CoatLogarithm(go.BSDF):
    """Disney's clear coat lobe, GTR of gamma = 1. Imitates shader ports in which log2 stands for the logarithm."""

    fault: ClassVar[str] = "the density of the samples is 1.44 times what pdf states"
    cause: ClassVar[str] = "GTR1 is normalized by the logarithm to base 2 instead of the natural one"
    coat: go.Colour = go.spectrum(0.25, "strength", low=0.0, high=1.0)
    alpha: go.Number = go.number(0.1, "width", low=0.01, high=0.9)

    def D(self, m):
        a2 = ops.sqr(self.alpha)
        log2 = ops.log(a2) * 1.442695
        return (a2 - 1.0) / (ops.pi * log2 * (1.0 + (a2 - 1.0) * ops.minimum(ops.sqr(m.z), 1.0)))

    def eval(self, wo, wi, mode="radiance"):
        wide = ops.vec2(0.25 + 0.0 * self.alpha, 0.25 + 0.0 * self.alpha)
        g = 1.0 / ((1.0 + ggx_lambda(wo, wide)) * (1.0 + ggx_lambda(wi, wide)))
        value = self.D(frame.half_vector(wo, wi)) * g / (4.0 * ops.maximum(wo.z, 1e-6))
        return self.coat * ops.where(upper(wo, wi), value, 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        return ops.where(upper(wo, wi), self.D(m) * m.z / (4.0 * ops.maximum(ops.dot(wo, m), 1e-6)), 0.0)

    def sample(self, wo, u, mode="radiance"):
        a2 = ops.sqr(self.alpha)
        cos2 = (1.0 - ops.pow(a2, 1.0 - u.y)) / (1.0 - a2)
        sin = ops.safe_sqrt(1.0 - cos2)
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        return drawn(self, wo, frame.reflect(wo, ops.vec3(sin * c, sin * s, ops.safe_sqrt(cos2))), mode)


MUTANTS = [
    W3SheenOnTop,
    W3CoatOneSided,
    W3ToonCone,
    W3WrappedLambert,
    W3RoughDiffuse,
    W3HalfFloat,
    W3SheenUniform,
    W3Quadrants,
    W3SwappedPdf,
    W3LobeWeights,
    W3CoatLogarithm,
]
SOUND = []
