"""Values with a fault in a corner."""

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


class W3GreenHaze(go.BSDF):
    """Matte paint that is a little brighter toward grazing angles."""

    fault: ClassVar[str] = "the green channel is not reciprocal, by up to some percent"
    cause: ClassVar[str] = "the factor of green depends on the viewer's cosine twice instead of on both cosines"
    only_rgb: ClassVar[bool] = True
    kd: go.Colour = go.spectrum((0.5, 0.6, 0.4), "albedo", low=0.0, high=1.0)

    def haze(self, a, b):
        return 0.94 + 0.06 * (1.0 - a) * (1.0 - b)

    def eval(self, wo, wi, mode="radiance"):
        r, g, b = ops.channels(self.kd)
        both, wrong = self.haze(wo.z, wi.z), self.haze(wo.z, wo.z)
        color = ops.of_channels(self.kd, [r * both, g * wrong, b * both])
        return color * ops.where(upper(wo, wi), wi.z * ops.inv_pi, 0.0)


class W3Vivid(go.BSDF):
    """Matte paint whose saturation can be raised."""

    fault: ClassVar[str] = (
        "a saturated color reflects up to 9 percent more light than arrives, in its brightest channel"
    )
    cause: ClassVar[str] = "saturation moves each channel away from the luminance and clamps only at 0, not at 1"
    only_rgb: ClassVar[bool] = True
    kd: go.Colour = go.spectrum((0.9, 0.1, 0.1), "albedo before saturation", low=0.0, high=1.0)
    saturation: go.Number = go.number(1.3, "factor of the distance from gray", low=0.0, high=1.5)

    def vivid(self):
        r, g, b = ops.channels(self.kd)
        gray = 0.2126 * r + 0.7152 * g + 0.0722 * b
        return ops.maximum(gray + (self.kd - gray) * self.saturation, 0.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.vivid() * ops.where(upper(wo, wi), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(upper(wo, wi), wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        return drawn(self, wo, warp.square_to_cosine_hemisphere(u.y, u.z), mode)


class W3LongTail(go.BSDF):
    """Facets with long tails (GTR of any gamma) in V-shaped grooves."""

    fault: ClassVar[str] = "at gamma = 1 alone the lobe is twice as bright as it should be, and creates energy"
    cause: ClassVar[str] = "the special case gamma = 1 divides by log(alpha) instead of log(alpha^2)"
    kd: go.Colour = go.spectrum(0.9, "reflectance", low=0.0, high=1.0)
    alpha: go.Number = go.number(0.3, "width", low=0.05, high=0.9)
    gamma: go.Number = go.number(2.0, "exponent of the tail", low=1.0, high=4.0)

    def D(self, m):
        a2 = ops.sqr(self.alpha)
        is_one = ops.abs(self.gamma - 1.0) < 1e-3
        k = ops.where(is_one, 1.0, self.gamma - 1.0)
        general = k * (a2 - 1.0) / (1.0 - ops.pow(a2, -k))
        scale = ops.where(is_one, (a2 - 1.0) / ops.log(self.alpha), general)
        return scale * ops.inv_pi * ops.pow(1.0 + (a2 - 1.0) * ops.minimum(ops.sqr(m.z), 1.0), -self.gamma)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        cos = ops.maximum(ops.dot(wo, m), 1e-6)
        shade = ops.minimum(1.0, 2.0 * m.z * ops.minimum(wo.z, wi.z) / cos)
        return self.kd * ops.where(upper(wo, wi), self.D(m) * shade / (4.0 * ops.maximum(wo.z, 1e-6)), 0.0)


def _albedo_of_ggx(alpha, cosines):
    """Directional albedo of white GGX facets, by the midpoint rule over visible normals."""
    u1, u2 = np.meshgrid((np.arange(64) + 0.5) / 64, (np.arange(64) + 0.5) / 64)
    albedos = []
    for cos in cosines:
        o = np.array([np.sqrt(1.0 - cos * cos), 0.0, cos])
        v = o * [alpha, alpha, 1.0]
        v = v / np.linalg.norm(v)
        z = (1.0 - u2) * (1.0 + v[2]) - v[2]
        r = np.sqrt(np.maximum(1.0 - z * z, 0.0))
        m = np.stack([r * np.cos(2 * np.pi * u1), r * np.sin(2 * np.pi * u1), z], -1) + v
        m = m * [alpha, alpha, 1.0]
        m = m / np.linalg.norm(m, axis=-1, keepdims=True)
        i = 2.0 * (m @ o)[..., None] * m - o
        lam_o, lam_i = (
            0.5 * (np.sqrt(1.0 + alpha**2 * (1.0 - w**2) / np.maximum(w**2, 1e-9)) - 1.0) for w in (cos, i[..., 2])
        )
        ratio = (1.0 + lam_o) / (1.0 + lam_o + lam_i)
        albedos.append(np.where(i[..., 2] > 0.0, ratio, 0.0).mean())
    return np.array(albedos)


ALPHA = 0.8
NODES = (np.arange(8) + 0.5) / 8.0
LOST = ops.Table("w3_lost", 1.0 - _albedo_of_ggx(ALPHA, NODES)[:, None])
MEAN_LOST = float(2.0 * np.mean(LOST.values[:, 0] * NODES))


class W3TableOffset(go.BSDF):
    """White rough metal (alpha = 0.8) with a second lobe that returns what the facets lose."""

    fault: ClassVar[str] = "seen from the side the metal reflects up to 14 percent more light than arrives"
    cause: ClassVar[str] = (
        "the table holds values at texel centers, but is looked up with an inset, as if its ends were at 0 and 1"
    )
    kd: go.Colour = go.spectrum(1.0, "reflectance", low=0.0, high=1.0)

    def lost(self, cos):
        return ops.lookup(LOST, ops.inset(cos, 8))[0]

    def eval(self, wo, wi, mode="radiance"):
        once = ggx_lobe(wo, wi, ops.vec2(ALPHA + 0.0 * wo.z, ALPHA + 0.0 * wo.z))
        again = self.lost(wo.z) * self.lost(wi.z) * wi.z * (1.0 / (ops.pi * MEAN_LOST))
        return self.kd * ops.where(upper(wo, wi), once + again, 0.0)


class W3MaskThreshold(go.BSDF):
    """Metal of facets, which are taken for unshadowed if nearly polished."""

    fault: ClassVar[str] = "below alpha = 0.05 a grazing ray reflects more light than arrives"
    cause: ClassVar[str] = "masking and shadowing are skipped below a threshold of the width, even at grazing angles"
    kd: go.Colour = go.spectrum((0.95, 0.9, 0.8), "reflectance", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.04, "width of the facets", low=0.01)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        rough = (self.alpha.x > 0.05) | (self.alpha.y > 0.05)
        lambdas = ggx_lambda(wo, self.alpha) + ggx_lambda(wi, self.alpha)
        g2 = ops.where(rough, 1.0 / (1.0 + lambdas), 1.0)
        return self.kd * ops.where(upper(wo, wi), ggx_d(m, self.alpha) * g2 / (4.0 * ops.maximum(wo.z, 1e-6)), 0.0)

    def pdf(self, wo, wi):
        return ops.where(upper(wo, wi), ggx_density(wo, wi, self.alpha), 0.0)

    def sample(self, wo, u, mode="radiance"):
        return drawn(self, wo, frame.reflect(wo, ggx_normal(wo, u.y, u.z, self.alpha)), mode)


class W3Asperity(go.BSDF):
    """Velvet of fine hairs, brightest where the surface is seen from the side, over matte cloth."""

    fault: ClassVar[str] = "the fuzz grows without bound toward grazing views: more light leaves than arrives"
    cause: ClassVar[str] = "the fuzz has the reciprocal factor 1 / (cos_o cos_i) without the attenuation of a slab"
    kd: go.Colour = go.spectrum((0.3, 0.05, 0.1), "albedo of the cloth", low=0.0, high=0.6)
    fuzz: go.Number = go.number(0.04, "amount of fuzz", low=0.0, high=0.2)

    def eval(self, wo, wi, mode="radiance"):
        base = self.kd * (wi.z * ops.inv_pi)
        haze = self.fuzz / (4.0 * ops.maximum(wo.z, 1e-4))
        return ops.where(upper(wo, wi), base + haze, 0.0)


class W3PoleAzimuth(go.BSDF):
    """A rough matte surface (Oren and Nayar's qualitative model, in Fujii's form)."""

    fault: ClassVar[str] = "the value is not a number if either direction is exactly the normal"
    cause: ClassVar[str] = "the cosine of the azimuths' difference is 0/0 where a direction has no azimuth"
    kd: go.Colour = go.spectrum(0.5, "albedo", low=0.0, high=1.0)
    sigma: go.Number = go.number(0.4, "roughness", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        a = 1.0 / (1.0 + (0.5 - 2.0 / (3.0 * ops.pi)) * self.sigma)
        b = a * self.sigma
        sin_o, sin_i = ops.sqrt(frame.sin2(wo)), ops.sqrt(frame.sin2(wi))
        cos_phi = (wo.x * wi.x + wo.y * wi.y) / (sin_o * sin_i)
        s = sin_o * sin_i * cos_phi
        t = ops.where(s > 0.0, ops.maximum(ops.maximum(wo.z, wi.z), 1e-6), 1.0)
        return self.kd * ops.where(upper(wo, wi), (a + b * s / t) * wi.z * ops.inv_pi, 0.0)


class W3StraightThrough(go.BSDF):
    """Paper: it scatters half of the light back and half through, more in the direction of the ray."""

    fault: ClassVar[str] = "the value is not a number for the ray that goes straight through, wi = -wo"
    cause: ClassVar[str] = "the transmitted lobe normalizes wo + wi, which vanishes there"
    kd: go.Colour = go.spectrum(0.8, "albedo", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        h = ops.normalize(wo + wi)
        across = 1.0 - ops.abs(h.z)  # 1 if wi = -wo about the plane
        through = 0.5 * across * across
        back = 0.5 + 0.0 * wi.z
        same = wo.z * wi.z > 0.0
        apart = wo.z * wi.z < 0.0
        return self.kd * (ops.abs(wi.z) * ops.inv_pi * ops.where(same, back, ops.where(apart, through, 0.0)))

    @property
    def transmits(self):
        return True


class W3ContrastCurve(go.BSDF):
    """Matte paint with a contrast curve on its albedo, which leaves black and white as they are."""

    fault: ClassVar[str] = "albedos between 0.67 and 1 become more than 1, by up to 4 percent; those of 1 do not"
    cause: ClassVar[str] = "the curve a + 1.5 a (1 - a) overshoots between its ends"
    kd: go.Colour = go.spectrum((0.2, 0.8, 0.5), "albedo before the curve", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        color = self.kd + 1.5 * self.kd * (1.0 - self.kd)
        return color * ops.where(upper(wo, wi), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(upper(wo, wi), wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        return drawn(self, wo, warp.square_to_cosine_hemisphere(u.y, u.z), mode)


class W3BackwardHarmonic(go.BSDF):
    """Moon dust: brighter toward the light's side than away from it, by the first harmonic of the azimuth."""

    fault: ClassVar[str] = "the value is negative where both directions are grazing and opposite in azimuth"
    cause: ClassVar[str] = "the harmonic's amplitude is 1.2 sin sin instead of at most 1, and is not clamped"
    kd: go.Colour = go.spectrum(0.3, "albedo", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        harmonic = 1.0 + 1.2 * (wo.x * wi.x + wo.y * wi.y)
        return self.kd * ops.where(upper(wo, wi), harmonic * wi.z * ops.inv_pi, 0.0)


MUTANTS = [
    W3GreenHaze,
    W3Vivid,
    W3LongTail,
    W3TableOffset,
    W3MaskThreshold,
    W3Asperity,
    W3PoleAzimuth,
    W3StraightThrough,
    W3ContrastCurve,
    W3BackwardHarmonic,
]
SOUND = []
