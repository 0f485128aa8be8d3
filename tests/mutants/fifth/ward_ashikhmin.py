"""Wrong materials: anisotropic lobes of Ward and of Ashikhmin and Shirley."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.optics import frame, warp
from gonio.optics.special import exprel


class _Ward(go.BSDF):
    """Right: f = kd (1 - ks) / pi + ks D / (4 (o.m)^2), D Ward's Gaussian over m_z^4; the lobe is sampled by D m_z."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    kd: go.Colour = go.spectrum(0.3, "albedo of the matte part", low=0.0, high=1.0)
    ks: go.Colour = go.spectrum(0.5, "albedo of the lobe", low=0.0, high=1.0)
    alpha: go.Width = go.width((0.2, 0.4), "widths of the lobe", low=0.05, high=1.0)
    rotation: go.Angle = go.angle(0.0, "rotation of the widths about the normal")

    def D(self, m):
        z2 = ops.maximum(ops.sqr(m.z), 1e-6)
        slope2 = (ops.sqr(m.x / self.alpha.x) + ops.sqr(m.y / self.alpha.y)) / z2
        return ops.exp(-slope2) / (ops.pi * self.alpha.x * self.alpha.y * ops.sqr(z2))

    def half(self, wo, wi):
        h = frame.half_vector(wo, wi)
        return frame.rotate(h, self.rotation), ops.maximum(ops.dot(wo, h), 1e-4)

    def eval(self, wo, wi, mode="radiance"):
        m, cos = self.half(wo, wi)
        f = self.kd * (1.0 - self.ks) * ops.inv_pi + self.ks * (self.D(m) / (4.0 * ops.sqr(cos)))
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), f * wi.z, 0.0)

    def lobe_pdf(self, wo, wi):
        m, cos = self.half(wo, wi)
        return self.D(m) * m.z / (4.0 * cos)

    def normal(self, u1, u2):
        s, c = ops.sincos(2.0 * ops.pi * u2)
        r = ops.safe_sqrt(-ops.log(1.0 - u1))
        return ops.normalize(ops.vec3(r * c * self.alpha.x, r * s * self.alpha.y, 1.0 + 0.0 * r))

    def turned_back(self, m):
        return frame.rotate_back(m, self.rotation)

    def pdf(self, wo, wi):
        d = 0.5 * ops.inv_pi * wi.z + 0.5 * self.lobe_pdf(wo, wi)
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), d, 0.0)

    def sample(self, wo, u, mode="radiance"):
        lobe = frame.reflect(wo, self.turned_back(self.normal(u.y, u.z)))
        wi = ops.where(u.x < 0.5, lobe, warp.square_to_cosine_hemisphere(u.y, u.z))
        pdf = self.pdf(wo, wi)
        return go.Sample.of_density(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf)


class WardWrongWay(_Ward):
    """An anisotropic highlight over a matte part."""

    fault: ClassVar[str] = (
        "the sampler turns its normal into the rotated frame once more instead of back out of it: sampler and pdf disagree if rotation is not 0 and the widths differ"
    )
    cause: ClassVar[str] = "sampled normal rotated the wrong way"

    def turned_back(self, m):
        return frame.rotate(m, self.rotation)


class WardPdfWithoutCosine(_Ward):
    """An anisotropic highlight over a matte part."""

    fault: ClassVar[str] = (
        "the pdf of the lobe omits the m_z of the projected area: D / (4 o.m) integrates to over 1, by about 10 % for widths near 0.5"
    )
    cause: ClassVar[str] = "m_z is missing in the lobe's pdf"

    def lobe_pdf(self, wo, wi):
        m, cos = self.half(wo, wi)
        return self.D(m) / (4.0 * cos)


class WardHalfPlane(_Ward):
    """An anisotropic highlight over a matte part."""

    fault: ClassVar[str] = (
        "the azimuth is phi = atan(ay / ax tan(2 pi u)), whose quadrant is not restored: only normals with x > 0 are drawn, each twice as often"
    )
    cause: ClassVar[str] = "atan loses the quadrant of phi"

    def normal(self, u1, u2):
        s, c = ops.sincos(2.0 * ops.pi * u2)
        s, c = ops.where(c < 0.0, -s, s), ops.abs(c)  # atan(s / c) lies in the right half plane
        r = ops.safe_sqrt(-ops.log(1.0 - u1))
        return ops.normalize(ops.vec3(r * c * self.alpha.x, r * s * self.alpha.y, 1.0 + 0.0 * r))


class WardDuer(go.BSDF):
    """Ward's highlight by Duer."""

    fault: ClassVar[str] = (
        "the lobe is divided by cos_o cos_i (Duer's variant), so that it reflects more than it receives at grazing views (beyond about 84 degrees with ks near 1)"
    )
    cause: ClassVar[str] = "Duer's denominator gains energy at grazing"
    ks: go.Colour = go.spectrum(0.9, "albedo of the lobe", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.25, "widths of the lobe", low=0.05, high=0.6)

    def eval(self, wo, wi, mode="radiance"):
        h = wo + wi
        slope2 = (ops.sqr(h.x / self.alpha.x) + ops.sqr(h.y / self.alpha.y)) / ops.maximum(ops.sqr(h.z), 1e-9)
        f = ops.exp(-slope2) / (4.0 * ops.pi * self.alpha.x * self.alpha.y * ops.maximum(wo.z * wi.z, 1e-9))
        return self.ks * ops.where((wo.z > 0.0) & (wi.z > 0.0), f * wi.z, 0.0)


class WardOneWidthNorm(go.BSDF):
    """An anisotropic highlight, bounded at grazing angles."""

    fault: ClassVar[str] = (
        "the Gaussian is normalized by pi ax^2 instead of pi ax ay: right for equal widths, too bright by ay / ax otherwise, so a white lobe with ay > ax gains energy"
    )
    cause: ClassVar[str] = "normalization uses only alpha.x"
    ks: go.Colour = go.spectrum(0.9, "albedo of the lobe", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.2, "widths of the lobe", low=0.05, high=0.6)

    def eval(self, wo, wi, mode="radiance"):
        h = frame.half_vector(wo, wi)
        z2 = ops.maximum(ops.sqr(h.z), 1e-6)
        slope2 = (ops.sqr(h.x / self.alpha.x) + ops.sqr(h.y / self.alpha.y)) / z2
        d = ops.exp(-slope2) / (ops.pi * ops.sqr(self.alpha.x) * ops.sqr(z2))
        f = d / (4.0 * ops.sqr(ops.maximum(ops.dot(wo, h), 1e-4)))
        return self.ks * ops.where((wo.z > 0.0) & (wi.z > 0.0), f * wi.z, 0.0)


class _Shirley(go.BSDF):
    """Right: f = F p(h) / (4 (o.h) max(n.o, n.i)), p anisotropic Phong's density of half vectors; F by Schlick."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    r0: go.Colour = go.spectrum(0.6, "reflectance at normal incidence", low=0.0, high=1.0)
    n: go.Width = go.width((20.0, 60.0), "exponents along x and y", low=1.0, high=2000.0)

    def exponent(self, c2, s2):
        return self.n.x * c2 + self.n.y * s2

    def density(self, h):
        sin2 = ops.maximum(frame.sin2(h), 1e-12)
        power = self.exponent(ops.sqr(h.x) / sin2, ops.sqr(h.y) / sin2)
        return self.norm() * ops.pow(h.z, power)

    def norm(self):
        return ops.sqrt((self.n.x + 1.0) * (self.n.y + 1.0)) * (0.5 * ops.inv_pi)

    def pair(self, wo, wi):
        h = frame.half_vector(wo, wi)
        return h, ops.maximum(ops.dot(wo, h), 1e-5)

    def shadow(self, wo, wi):
        return ops.maximum(ops.maximum(wo.z, wi.z), 1e-6)

    def eval(self, wo, wi, mode="radiance"):
        h, cos = self.pair(wo, wi)
        fresnel = self.r0 + (1.0 - self.r0) * ops.pow(1.0 - cos, 5.0)
        value = self.density(h) * wi.z / (4.0 * cos * self.shadow(wo, wi))
        return fresnel * ops.where((wo.z > 0.0) & (wi.z > 0.0), value, 0.0)

    def pdf(self, wo, wi):
        h, cos = self.pair(wo, wi)
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), self.density(h) / (4.0 * cos), 0.0)

    def azimuth(self, u):
        s, c = ops.sincos(2.0 * ops.pi * u)
        s = s * ops.sqrt((self.n.x + 1.0) / (self.n.y + 1.0))
        over = ops.rsqrt(ops.sqr(s) + ops.sqr(c))
        return c * over, s * over

    def log_cosine(self, u, c, s):
        return ops.log(1.0 - u) / (self.exponent(ops.sqr(c), ops.sqr(s)) + 1.0)

    def half_sample(self, u1, u2):
        c, s = self.azimuth(u2)
        log_cos = self.log_cosine(u1, c, s)
        sin = ops.safe_sqrt(-2.0 * log_cos * exprel(2.0 * log_cos))
        return ops.vec3(sin * c, sin * s, ops.exp(log_cos))

    def sample(self, wo, u, mode="radiance"):
        wi = frame.reflect(wo, self.half_sample(u.y, u.z))
        pdf = self.pdf(wo, wi)
        return go.Sample.of_density(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf)


class ShirleyQuadrants(_Shirley):
    """Anisotropic Phong."""

    fault: ClassVar[str] = (
        "the first quadrant's azimuth is rotated by 90 degrees into each other quadrant instead of mirrored: in the second and fourth the exponents are exchanged; right for equal exponents only"
    )
    cause: ClassVar[str] = "quadrants rotated instead of mirrored"

    def azimuth(self, u):
        at = 4.0 * u
        quadrant = ops.floor(at)
        s, c = ops.sincos((0.5 * ops.pi) * (at - quadrant))
        s = s * ops.sqrt((self.n.x + 1.0) / (self.n.y + 1.0))
        over = ops.rsqrt(ops.sqr(s) + ops.sqr(c))
        s, c = s * over, c * over
        t, d = ops.sincos((0.5 * ops.pi) * quadrant)
        return c * d - s * t, s * d + c * t


class ShirleyZero(_Shirley):
    """Anisotropic Phong."""

    fault: ClassVar[str] = (
        "cos theta = u^(1 / (n + 1)) by exp(log(u) / (n + 1)) without a guard and the tangent by 1 / cos: at u2 = 0 log is -infinity and the sampled direction is not a number"
    )
    cause: ClassVar[str] = "log of zero at u = 0"

    def half_sample(self, u1, u2):
        c, s = self.azimuth(u2)
        log_cos = ops.log(u1) / (self.exponent(ops.sqr(c), ops.sqr(s)) + 1.0)
        tan = ops.sqrt(ops.maximum(ops.exp(-2.0 * log_cos) - 1.0, 0.0))
        return ops.normalize(ops.vec3(tan * c, tan * s, 1.0 + 0.0 * tan))

    def sample(self, wo, u, mode="radiance"):
        h = self.half_sample(u.y, u.z)
        wi = frame.reflect(wo, h)
        cos = ops.maximum(ops.dot(wo, h), 1e-5)
        fails = (wi.z <= 0.0) | (wo.z <= 0.0) | (ops.dot(wo, h) <= 0.0)
        fresnel = self.r0 + (1.0 - self.r0) * ops.pow(1.0 - cos, 5.0)
        weight = fresnel * ops.where(fails, 0.0, wi.z / self.shadow(wo, wi))
        return go.Sample.of_density(wi, weight, ops.where(fails, 0.0, self.density(h) / (4.0 * cos)))


class ShirleySamplerExponent(_Shirley):
    """Anisotropic Phong."""

    fault: ClassVar[str] = (
        "the polar angle is drawn with the exponent nx sin^2 phi + ny cos^2 phi (sine and cosine exchanged) at the right azimuth; density right; wrong for unequal exponents"
    )
    cause: ClassVar[str] = "sine and cosine exchanged in sampled exponent"

    def log_cosine(self, u, c, s):
        return ops.log(1.0 - u) / (self.exponent(ops.sqr(s), ops.sqr(c)) + 1.0)


class ShirleyViewerOnly(go.BSDF):
    """Anisotropic Phong."""

    fault: ClassVar[str] = (
        "the denominator has n.o instead of max(n.o, n.i): f is not reciprocal, and at grazing views it gains energy"
    )
    cause: ClassVar[str] = "max of the cosines replaced by one"
    r0: go.Colour = go.spectrum(0.6, "reflectance at normal incidence", low=0.0, high=1.0)
    n: go.Width = go.width((20.0, 60.0), "exponents along x and y", low=1.0, high=2000.0)

    def eval(self, wo, wi, mode="radiance"):
        h = frame.half_vector(wo, wi)
        cos = ops.maximum(ops.dot(wo, h), 1e-5)
        sin2 = ops.maximum(frame.sin2(h), 1e-12)
        p = ops.pow(h.z, (self.n.x * ops.sqr(h.x) + self.n.y * ops.sqr(h.y)) / sin2)
        p = p * ops.sqrt((self.n.x + 1.0) * (self.n.y + 1.0)) * (0.5 * ops.inv_pi)
        fresnel = self.r0 + (1.0 - self.r0) * ops.pow(1.0 - cos, 5.0)
        return fresnel * ops.where((wo.z > 0.0) & (wi.z > 0.0), p * wi.z / (4.0 * cos * ops.maximum(wo.z, 1e-6)), 0.0)


class ShirleyMatteFade(go.BSDF):
    """The coupled matte part of Ashikhmin and Shirley's model."""

    fault: ClassVar[str] = (
        "the fade (1 - (1 - cos / 2)^5) of the viewer's cosine enters twice and that of the light not at all: f is not reciprocal"
    )
    cause: ClassVar[str] = "copied factor: viewer's cosine used twice"
    kd: go.Colour = go.spectrum(0.6, "albedo", low=0.0, high=1.0)
    rs: go.Colour = go.spectrum(0.05, "reflectance of the lobe above", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        a = 1.0 - ops.pow(ops.maximum(1.0 - 0.5 * wo.z, 0.0), 5.0)
        b = 1.0 - ops.pow(ops.maximum(1.0 - 0.5 * wo.z, 0.0), 5.0)
        value = (28.0 / 23.0) * ops.inv_pi * a * b * wi.z
        return self.kd * (1.0 - self.rs) * ops.where((wo.z > 0.0) & (wi.z > 0.0), value, 0.0)


MUTANTS = [
    WardWrongWay,
    WardPdfWithoutCosine,
    WardHalfPlane,
    WardDuer,
    WardOneWidthNorm,
    ShirleyQuadrants,
    ShirleyZero,
    ShirleySamplerExponent,
    ShirleyViewerOnly,
    ShirleyMatteFade,
]
