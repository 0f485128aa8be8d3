"""Samplers with a narrow fault."""

from typing import ClassVar

import gonio as go
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


class W3UnequalWidths(go.BSDF):
    """A brushed metal of facets, sampled by visible normals."""

    fault: ClassVar[str] = "the density of an anisotropic lobe is too large by alpha.y / alpha.x"
    cause: ClassVar[str] = (
        "pdf normalizes D by alpha_x^2 instead of alpha_x alpha_y, which is right for equal widths only"
    )
    kd: go.Colour = go.spectrum((0.9, 0.8, 0.7), "reflectance", low=0.0, high=1.0)
    alpha: go.Width = go.width((0.25, 0.3), "widths of the facets", low=0.05)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where(upper(wo, wi), ggx_lobe(wo, wi, self.alpha), 0.0)

    def pdf(self, wo, wi):
        scale = self.alpha.y / self.alpha.x  # 1 / (pi ax ax)
        return ops.where(upper(wo, wi), ggx_density(wo, wi, self.alpha) * scale, 0.0)

    def sample(self, wo, u, mode="radiance"):
        wi = frame.reflect(wo, ggx_normal(wo, u.y, u.z, self.alpha))
        return drawn(self, wo, wi, mode)


class W3LobeByLuminance(go.BSDF):
    """A matte base with a gray highlight, mixed by a share."""

    fault: ClassVar[str] = "for saturated colors the density uses another lobe probability than the sampler"
    cause: ClassVar[str] = (
        "sample weighs the lobes by the mean of kd, pdf by its luminance; both are equal for gray only"
    )
    kd: go.Colour = go.spectrum((0.1, 0.2, 0.9), "albedo of the base", low=0.0, high=1.0)
    share: go.Number = go.number(0.3, "share of the highlight", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.3, "width of the highlight", low=0.05)

    def eval(self, wo, wi, mode="radiance"):
        base = self.kd * ((1.0 - self.share) * wi.z * ops.inv_pi)
        return ops.where(upper(wo, wi), base + self.share * ggx_lobe(wo, wi, self.alpha), 0.0)

    def odds(self, gray):
        matte = (1.0 - self.share) * gray
        return ops.clamp(self.share / ops.maximum(self.share + matte, 1e-6), 0.05, 0.95)

    def luminance(self):
        r, g, b = ops.channels(self.kd)
        return 0.2126 * r + 0.7152 * g + 0.0722 * b

    def pdf(self, wo, wi):
        p = self.odds(self.luminance())
        density = p * ggx_density(wo, wi, self.alpha) + (1.0 - p) * wi.z * ops.inv_pi
        return ops.where(upper(wo, wi), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        shiny = frame.reflect(wo, ggx_normal(wo, u.y, u.z, self.alpha))
        matte = warp.square_to_cosine_hemisphere(u.y, u.z)
        wi = ops.where(u.x < self.odds(ops.mean(self.kd)), shiny, matte)
        return drawn(self, wo, wi, mode)


class W3AlmostOne(go.BSDF):
    """Plain matte paint with its own cosine sampler."""

    fault: ClassVar[str] = "no direction within 10 degrees of the horizon is ever sampled; 3 percent fall on one ring"
    cause: ClassVar[str] = "sample clamps u.y to 0.97 'for safety', pdf is that of the whole hemisphere"
    kd: go.Colour = go.spectrum(0.7, "albedo", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where(upper(wo, wi), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(upper(wo, wi), wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        wi = warp.square_to_cosine_hemisphere(ops.minimum(u.y, 0.97), u.z)
        return drawn(self, wo, wi, mode)


class W3UZero(go.BSDF):
    """Facets with Gaussian slopes (Beckmann) in V-shaped grooves."""

    fault: ClassVar[str] = "the sampled direction and its density are not numbers for u.y = 0"
    cause: ClassVar[str] = (
        "the slope is drawn by log(u) instead of log(1 - u), infinite at u = 0, and infinity is divided by infinity"
    )
    kd: go.Colour = go.spectrum(0.8, "reflectance", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.2, "width of the slopes", low=0.05)

    def D(self, m):
        z2 = ops.maximum(ops.sqr(m.z), 1e-3)
        slope2 = (ops.sqr(m.x / self.alpha.x) + ops.sqr(m.y / self.alpha.y)) / z2
        return ops.exp(-slope2) / (ops.pi * self.alpha.x * self.alpha.y * ops.sqr(z2))

    def shade(self, wo, wi, m):
        cos = ops.maximum(ops.dot(wo, m), 1e-6)
        return ops.minimum(1.0, 2.0 * m.z * ops.minimum(wo.z, wi.z) / cos)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        value = self.D(m) * self.shade(wo, wi, m) / (4.0 * ops.maximum(wo.z, 1e-6))
        return self.kd * ops.where(upper(wo, wi), value, 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        return ops.where(upper(wo, wi), self.D(m) * m.z / (4.0 * ops.maximum(ops.dot(wo, m), 1e-6)), 0.0)

    def sample(self, wo, u, mode="radiance"):
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        azimuth = ops.normalize(ops.vec2(self.alpha.x * c, self.alpha.y * s))
        spread = ops.sqr(azimuth.x / self.alpha.x) + ops.sqr(azimuth.y / self.alpha.y)
        tan = ops.sqrt(-ops.log(u.y) / spread)
        m = ops.normalize(ops.vec3(tan * azimuth.x, tan * azimuth.y, 1.0 + 0.0 * tan))
        wi = frame.reflect(wo, m)
        density = self.D(m) * m.z / (4.0 * ops.maximum(ops.dot(wo, m), 1e-6))
        pdf = ops.where((wo.z <= 0.0) | (wi.z <= 0.0), 0.0, density)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class W3RotatedPdf(go.BSDF):
    """Brushed metal whose brush direction is turned about the normal."""

    fault: ClassVar[str] = "the density is that of a lobe turned to the other side"
    cause: ClassVar[str] = (
        "pdf rotates the directions back instead of forth: the sign of the angle differs from eval's and sample's"
    )
    kd: go.Colour = go.spectrum(0.85, "reflectance", low=0.0, high=1.0)
    alpha: go.Width = go.width((0.2, 0.3), "widths along the turned axes", low=0.05)
    rotation: go.Angle = go.angle(0.3, "angle of the brush")

    def eval(self, wo, wi, mode="radiance"):
        o, i = frame.rotate(wo, self.rotation), frame.rotate(wi, self.rotation)
        return self.kd * ops.where(upper(wo, wi), ggx_lobe(o, i, self.alpha), 0.0)

    def pdf(self, wo, wi):
        o, i = frame.rotate_back(wo, self.rotation), frame.rotate_back(wi, self.rotation)
        return ops.where(upper(wo, wi), ggx_density(o, i, self.alpha), 0.0)

    def sample(self, wo, u, mode="radiance"):
        o = frame.rotate(wo, self.rotation)
        wi = frame.rotate_back(frame.reflect(o, ggx_normal(o, u.y, u.z, self.alpha)), self.rotation)
        return drawn(self, wo, wi, mode)


class W3GrazingFloor(go.BSDF):
    """Matte paint that guards its density against division by nearly nothing."""

    fault: ClassVar[str] = (
        "light from within 6 degrees of the horizon counts too little, and the density integrates to 1.01"
    )
    cause: ClassVar[str] = "pdf has a lower bound of 0.1 on the cosine, which sample does not know"
    kd: go.Colour = go.spectrum((0.4, 0.5, 0.6), "albedo", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where(upper(wo, wi), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(upper(wo, wi), ops.maximum(wi.z, 0.1) * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        return drawn(self, wo, warp.square_to_cosine_hemisphere(u.y, u.z), mode)


SECTORS = (1.6, 1.2, 0.9, 0.7, 0.8, 0.9, 0.9, 1.0)  # relative density of eight sectors, counted from wo's azimuth


class W3SectorSeam(go.BSDF):
    """Matte paint, sampled by eight sectors of azimuth relative to the viewer's."""

    fault: ClassVar[str] = "in the last eleven degrees before the viewer's azimuth the density is 1.6 times too large"
    cause: ClassVar[str] = (
        "pdf wraps negative azimuths only below a tolerance; between it and 0 the first sector is read instead of the last"
    )
    kd: go.Colour = go.spectrum(0.6, "albedo", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where(upper(wo, wi), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        local = frame.rotate(wi, frame.azimuth(wo))
        turn = ops.atan2(local.y, local.x) * (0.5 * ops.inv_pi)
        turn = ops.where(turn < -0.03, turn + 1.0, turn)
        sector = ops.floor(8.0 * turn)
        density = SECTORS[0] + 0.0 * turn
        for k in range(1, 8):
            density = ops.where(sector >= float(k), SECTORS[k], density)
        return ops.where(upper(wo, wi), wi.z * ops.inv_pi * density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        turn = u.z * (1.0 / SECTORS[0])
        start = SECTORS[0] / 8.0
        for k in range(1, 8):
            turn = ops.where(u.z >= start, k / 8.0 + (u.z - start) * (1.0 / SECTORS[k]), turn)
            start += SECTORS[k] / 8.0
        s, c = ops.sincos(2.0 * ops.pi * turn)
        r = ops.sqrt(u.y)
        local = ops.vec3(r * c, r * s, ops.safe_sqrt(1.0 - u.y))
        return drawn(self, wo, frame.rotate_back(local, frame.azimuth(wo)), mode)


class W3LeastChance(go.BSDF):
    """Varnish: a highlight by Schlick's curve over a matte base, which gets the remaining light at both ends."""

    fault: ClassVar[str] = "near normal incidence the highlight is sampled more often than the density states"
    cause: ClassVar[str] = "sample raises the highlight's probability to 0.12 where it is smaller, pdf does not"
    kd: go.Colour = go.spectrum(0.5, "albedo of the base", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.25, "width of the highlight", low=0.05)
    r0: ClassVar[float] = 0.04

    def fresnel(self, cos):
        return self.r0 + (1.0 - self.r0) * ops.pow(1.0 - cos, 5.0)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        shine = self.fresnel(ops.clamp(ops.dot(wo, m), 0.0, 1.0)) * ggx_lobe(wo, wi, self.alpha)
        left = (1.0 - ops.pow(1.0 - wo.z, 5.0)) * (1.0 - ops.pow(1.0 - wi.z, 5.0)) * (1.0 - self.r0) * 1.05
        base = self.kd * (left * wi.z * ops.inv_pi)
        return ops.where(upper(wo, wi), base + shine, 0.0)

    def chance(self, wo):
        f = self.fresnel(ops.clamp(wo.z, 0.0, 1.0))
        return f / (f + (1.0 - f) * ops.maximum(ops.mean(self.kd), 0.1))

    def pdf(self, wo, wi):
        p = self.chance(wo)
        density = p * ggx_density(wo, wi, self.alpha) + (1.0 - p) * wi.z * ops.inv_pi
        return ops.where(upper(wo, wi), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        shiny = frame.reflect(wo, ggx_normal(wo, u.y, u.z, self.alpha))
        matte = warp.square_to_cosine_hemisphere(u.y, u.z)
        wi = ops.where(u.x < ops.maximum(self.chance(wo), 0.12), shiny, matte)
        return drawn(self, wo, wi, mode)


class W3CosineInFloats(go.BSDF):
    """A nearly polished metal, whose normals have the density cos^n."""

    fault: ClassVar[str] = "in 32 bits the peak is off by several percent: only steps of the cosine are seen"
    cause: ClassVar[str] = (
        "cos^n is computed from a float32 cosine near 1, whose last bit times n = 4e5 is no longer small"
    )
    kd: go.Colour = go.spectrum(0.9, "reflectance", low=0.0, high=1.0)
    n: go.Number = go.number(4e5, "exponent of the normals", low=1e3, high=4e6)

    def D(self, m):
        return (self.n + 2.0) * (0.5 * ops.inv_pi) * ops.pow(m.z, self.n)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        cos = ops.maximum(ops.dot(wo, m), 1e-6)
        shade = ops.minimum(1.0, 2.0 * m.z * ops.minimum(wo.z, wi.z) / cos)
        return self.kd * ops.where(upper(wo, wi), self.D(m) * shade / (4.0 * ops.maximum(wo.z, 1e-6)), 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        return ops.where(upper(wo, wi), self.D(m) * m.z / (4.0 * ops.maximum(ops.dot(wo, m), 1e-6)), 0.0)

    def sample(self, wo, u, mode="radiance"):
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        cos = ops.pow(1.0 - u.y, 1.0 / (self.n + 2.0))
        sin = ops.safe_sqrt(1.0 - ops.sqr(cos))
        return drawn(self, wo, frame.reflect(wo, ops.vec3(sin * c, sin * s, cos)), mode)


class W3ExponentSlip(go.BSDF):
    """Facets with the density (n + 2) / (2 pi) cos^n in grooves."""

    fault: ClassVar[str] = "the sampled highlight is some percent narrower than its density"
    cause: ClassVar[str] = "the cosine is drawn with exponent 1 / (n + 3), pdf is that of 1 / (n + 2)"
    kd: go.Colour = go.spectrum(0.9, "reflectance", low=0.0, high=1.0)
    n: go.Number = go.number(24.0, "exponent of the normals", low=1.0, high=1000.0)

    def D(self, m):
        return (self.n + 2.0) * (0.5 * ops.inv_pi) * ops.pow(m.z, self.n)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        cos = ops.maximum(ops.dot(wo, m), 1e-6)
        shade = ops.minimum(1.0, 2.0 * m.z * ops.minimum(wo.z, wi.z) / cos)
        return self.kd * ops.where(upper(wo, wi), self.D(m) * shade / (4.0 * ops.maximum(wo.z, 1e-6)), 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        return ops.where(upper(wo, wi), self.D(m) * m.z / (4.0 * ops.maximum(ops.dot(wo, m), 1e-6)), 0.0)

    def sample(self, wo, u, mode="radiance"):
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        cos = ops.pow(1.0 - u.y, 1.0 / (self.n + 3.0))
        sin = ops.safe_sqrt(1.0 - ops.sqr(cos))
        return drawn(self, wo, frame.reflect(wo, ops.vec3(sin * c, sin * s, cos)), mode)


MUTANTS = [
    W3UnequalWidths,
    W3LobeByLuminance,
    W3AlmostOne,
    W3UZero,
    W3RotatedPdf,
    W3GrazingFloor,
    W3SectorSeam,
    W3LeastChance,
    W3CosineInFloats,
    W3ExponentSlip,
]
SOUND = []
