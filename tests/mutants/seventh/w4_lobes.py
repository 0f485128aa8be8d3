"""Beckmann, Blinn-Phong and GTR lobes with V-groove masking, diffuse and sheen models, each with one mistake."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.optics import frame, warp


def above(wo, wi):
    return (wo.z > 0.0) & (wi.z > 0.0)


def schlick(cos, r0):
    """Schlick's Fresnel reflectance."""
    return r0 + (1.0 - r0) * ops.pow(1.0 - cos, 5.0)


def beckmann(m, alpha):
    """D of Beckmann; alpha is a pair."""
    z2 = ops.maximum(ops.sqr(m.z), 1e-3)
    slope2 = (ops.sqr(m.x / alpha.x) + ops.sqr(m.y / alpha.y)) / z2
    return ops.exp(-slope2) * ops.inv_pi / (alpha.x * alpha.y * ops.sqr(z2))


def groove(wo, wi, m):
    """G of V-shaped grooves."""
    lower = ops.minimum(wo.z, wi.z)
    return ops.minimum(2.0 * m.z * lower / ops.maximum(ops.dot(wo, m), 1e-9), 1.0)


class W4Slate(go.BSDF):
    """Dark rough stone: an isotropic Beckmann lobe in V-shaped grooves."""

    fault: ClassVar[str] = "D has cos^2 where Beckmann's distribution has cos^4"
    cause: ClassVar[str] = (
        "Beckmann's D is divided by m_z^2 instead of m_z^4, so D m_z does not integrate to 1; pdf, computed from this "
        "D, is too low at large tilts and does not match the normals drawn by sample"
    )
    r0: go.Colour = go.spectrum(0.4, "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Number = go.number(0.5, "width", low=0.05, high=0.8)

    def D(self, m):
        z2 = ops.maximum(ops.sqr(m.z), 1e-3)
        a2 = ops.sqr(self.alpha)
        return ops.exp(-frame.sin2(m) / (z2 * a2)) * ops.inv_pi / (a2 * z2)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        f = schlick(ops.dot(wo, m), self.r0) * (self.D(m) * groove(wo, wi, m) / (4.0 * ops.maximum(wo.z, 1e-9)))
        return ops.where(above(wo, wi), f, 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        return ops.where(above(wo, wi), self.D(m) * m.z / (4.0 * ops.maximum(ops.dot(wo, m), 1e-9)), 0.0)

    def sample(self, wo, u, mode="radiance"):
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        tan = self.alpha * ops.safe_sqrt(-ops.log(1.0 - u.y))
        m = ops.normalize(ops.vec3(tan * c, tan * s, 1.0 + 0.0 * tan))
        wi = frame.reflect(wo, m)
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class W4Hairline(go.BSDF):
    """Hairline steel: an anisotropic Beckmann lobe in V-shaped grooves."""

    fault: ClassVar[str] = "normals are sampled in only one half of the azimuths"
    cause: ClassVar[str] = (
        "sample takes the azimuth as atan(alpha_y / alpha_x tan(2 pi u)), which lies in (-pi/2, pi/2): the quadrant is "
        "lost, normals with m.x < 0 are never drawn and the others twice as often as pdf says"
    )
    r0: go.Colour = go.spectrum(0.6, "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Width = go.width((0.15, 0.4), "widths", low=0.05, high=0.8)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        lobe = beckmann(m, self.alpha) * groove(wo, wi, m) / (4.0 * ops.maximum(wo.z, 1e-9))
        return ops.where(above(wo, wi), schlick(ops.dot(wo, m), self.r0) * lobe, 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        p = beckmann(m, self.alpha) * m.z / (4.0 * ops.maximum(ops.dot(wo, m), 1e-9))
        return ops.where(above(wo, wi), p, 0.0)

    def sample(self, wo, u, mode="radiance"):
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        ratio = self.alpha.y / self.alpha.x * ops.safe_div(s, c)
        phi = ops.atan2(ratio, 1.0 + 0.0 * ratio)
        s, c = ops.sincos(phi)
        tan2 = -ops.log(1.0 - u.y) / (ops.sqr(c / self.alpha.x) + ops.sqr(s / self.alpha.y))
        tan = ops.safe_sqrt(tan2)
        m = ops.normalize(ops.vec3(tan * c, tan * s, 1.0 + 0.0 * tan))
        wi = frame.reflect(wo, m)
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class W4Grooves(go.BSDF):
    """Cook and Torrance's metal: Beckmann in V-shaped grooves."""

    fault: ClassVar[str] = "G contains masking only, no shadowing"
    cause: ClassVar[str] = (
        "the V-groove term is min(1, 2 m_z o_z / (o.m)); the third argument of the minimum, 2 m_z i_z / (o.m), is "
        "missing, so the light's direction is not shadowed and the BRDF is not reciprocal"
    )
    r0: go.Colour = go.spectrum((0.95, 0.64, 0.54), "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.35, "width", low=0.05, high=0.8)

    def G(self, wo, wi, m):
        return ops.minimum(1.0, 2.0 * m.z * wo.z / ops.maximum(ops.dot(wo, m), 1e-9))

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        lobe = beckmann(m, self.alpha) * self.G(wo, wi, m) / (4.0 * ops.maximum(wo.z, 1e-9))
        return ops.where(above(wo, wi), schlick(ops.dot(wo, m), self.r0) * lobe, 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        p = beckmann(m, self.alpha) * m.z / (4.0 * ops.maximum(ops.dot(wo, m), 1e-9))
        return ops.where(above(wo, wi), p, 0.0)

    def sample(self, wo, u, mode="radiance"):
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        tan = ops.safe_sqrt(-ops.log(1.0 - u.y))
        m = ops.normalize(ops.vec3(self.alpha.x * tan * c, self.alpha.y * tan * s, 1.0 + 0.0 * tan))
        wi = frame.reflect(wo, m)
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class W4Blinn(go.BSDF):
    """Blinn-Phong microfacets, D = (n + 2) / (2 pi) m_z^n, in V-shaped grooves."""

    fault: ClassVar[str] = "the sampled cosine has the exponent 1 / (n + 1) instead of 1 / (n + 2)"
    cause: ClassVar[str] = (
        "sample draws m_z = (1 - u)^(1 / (n + 1)), the lobe m_z^n, while pdf is that of D m_z, (n + 2) / (2 pi) "
        "m_z^(n + 1), which requires (1 - u)^(1 / (n + 2)): the exponent is off by one"
    )
    r0: go.Colour = go.spectrum(0.5, "reflectance at normal incidence", low=0.0, high=1.0)
    exponent: go.Number = go.number(6.0, "exponent n", low=1.0, high=1000.0)

    def D(self, m):
        return (self.exponent + 2.0) * (0.5 * ops.inv_pi) * ops.pow(m.z, self.exponent)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        lobe = self.D(m) * groove(wo, wi, m) / (4.0 * ops.maximum(wo.z, 1e-9))
        return ops.where(above(wo, wi), schlick(ops.dot(wo, m), self.r0) * lobe, 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        return ops.where(above(wo, wi), self.D(m) * m.z / (4.0 * ops.maximum(ops.dot(wo, m), 1e-9)), 0.0)

    def sample(self, wo, u, mode="radiance"):
        m = warp.square_to_power_lobe(u.y, u.z, self.exponent)
        wi = frame.reflect(wo, m)
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class W4Clearcoat(go.BSDF):
    """The long-tailed clear coat of Disney's model, GTR with gamma = 1, by itself."""

    fault: ClassVar[str] = "not a number at the largest alpha, 1"
    cause: ClassVar[str] = (
        "GTR1's normalization (alpha^2 - 1) / log(alpha^2) is 0 / 0 at alpha = 1, which the parameter's range allows; "
        "the limit, 1 / pi, is not handled, and eval returns NaN there"
    )
    r0: go.Colour = go.spectrum(0.04, "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Number = go.number(0.3, "width", low=0.02, high=1.0)

    def D(self, m):
        a2 = ops.sqr(self.alpha)
        spread = frame.sin2(m) + a2 * ops.sqr(m.z)
        return (a2 - 1.0) * ops.inv_pi / (ops.log(a2) * ops.maximum(spread, 1e-9))

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        lobe = self.D(m) * groove(wo, wi, m) / (4.0 * ops.maximum(wo.z, 1e-9))
        return ops.where(above(wo, wi), schlick(ops.dot(wo, m), self.r0) * lobe, 0.0)


class W4Clay(go.BSDF):
    """Oren and Nayar's rough diffuse reflection, in trigonometric form."""

    fault: ClassVar[str] = "sine and tangent have each other's angle"
    cause: ClassVar[str] = (
        "the qualitative model has sin(a) tan(b) with a the larger and b the smaller angle; here a and b are swapped, "
        "so the tangent of the larger angle grows without bound and the albedo exceeds 1 toward grazing"
    )
    kd: go.Colour = go.spectrum(0.7, "albedo", low=0.0, high=1.0)
    sigma: go.Number = go.number(0.5, "standard deviation of the slopes, in radians", low=0.0, high=0.8)

    def eval(self, wo, wi, mode="radiance"):
        s2 = ops.sqr(self.sigma)
        a = 1.0 - 0.5 * s2 / (s2 + 0.33)
        b = 0.45 * s2 / (s2 + 0.09)
        # sin(a) tan(b) cos(phi_i - phi_o): the product of the sines times the cosine is the product of the tangents
        tangential = ops.maximum(wo.x * wi.x + wo.y * wi.y, 0.0)
        over_cos = 1.0 / ops.maximum(ops.minimum(wo.z, wi.z), 1e-4)
        f = self.kd * (ops.inv_pi * (a + b * tangential * over_cos) * wi.z)
        return ops.where(above(wo, wi), f, 0.0)

    def pdf(self, wo, wi):
        return ops.where(above(wo, wi), wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        wi = warp.square_to_cosine_hemisphere(u.y, u.z)
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class W4Plaster(go.BSDF):
    """Oren and Nayar's rough diffuse reflection of plaster."""

    fault: ClassVar[str] = "negative values where light and viewer are on opposite sides"
    cause: ClassVar[str] = (
        "cos(phi_i - phi_o) is not clamped, max(0, .) is missing: for opposite azimuths the second term is negative, "
        "and toward grazing it exceeds the first, so the BRDF becomes negative"
    )
    kd: go.Colour = go.spectrum(0.7, "albedo", low=0.0, high=1.0)
    sigma: go.Number = go.number(0.5, "standard deviation of the slopes, in radians", low=0.0, high=0.8)

    def eval(self, wo, wi, mode="radiance"):
        s2 = ops.sqr(self.sigma)
        a = 1.0 - 0.5 * s2 / (s2 + 0.33)
        b = 0.45 * s2 / (s2 + 0.09)
        tangential = wo.x * wi.x + wo.y * wi.y
        over_cos = 1.0 / ops.maximum(ops.maximum(wo.z, wi.z), 1e-6)
        f = self.kd * (ops.inv_pi * (a + b * tangential * over_cos) * wi.z)
        return ops.where(above(wo, wi), f, 0.0)

    def pdf(self, wo, wi):
        return ops.where(above(wo, wi), wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        wi = warp.square_to_cosine_hemisphere(u.y, u.z)
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class W4Velour(go.BSDF):
    """Sheen of upright fibers: the inverted sine distribution in V-shaped grooves."""

    fault: ClassVar[str] = "not a number at the smallest roughness, 0"
    cause: ClassVar[str] = (
        "the exponent 1 / roughness is not guarded, and the parameter's range includes 0: there (2 + inf) * sin^inf is "
        "infinity times 0, so eval returns NaN"
    )
    tint_color: go.Colour = go.spectrum(0.8, "color of the fibers", low=0.0, high=1.0)
    roughness: go.Number = go.number(0.4, "tilt of the fibers", low=0.0, high=1.0)

    def D(self, m):
        power = 1.0 / self.roughness
        return (2.0 + power) * (0.5 * ops.inv_pi) * ops.pow(ops.safe_sqrt(frame.sin2(m)), power)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        lobe = self.D(m) * groove(wo, wi, m) / (4.0 * ops.maximum(wo.z, 1e-9))
        return ops.where(above(wo, wi), self.tint_color * lobe, 0.0)


class W4Felt(go.BSDF):
    """Minnaert's model of a porous surface: f = kd (k + 1) / (2 pi) (o_z i_z)^(k - 1)."""

    fault: ClassVar[str] = "light from below the surface is reflected upward"
    cause: ClassVar[str] = (
        "eval tests only wo.z and uses |wi.z|: for wi below the surface it is not 0 although the material does not "
        "transmit, and the surface sends out up to twice its albedo"
    )
    kd: go.Colour = go.spectrum(0.6, "albedo at normal incidence", low=0.0, high=1.0)
    k: go.Number = go.number(1.4, "darkening", low=1.0, high=4.0)

    def eval(self, wo, wi, mode="radiance"):
        cos_i = ops.abs(wi.z)
        f = (self.k + 1.0) * (0.5 * ops.inv_pi) * ops.pow(wo.z * cos_i, self.k - 1.0)
        return ops.where(wo.z > 0.0, self.kd * (f * cos_i), 0.0)

    def pdf(self, wo, wi):
        return ops.where(above(wo, wi), wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        wi = warp.square_to_cosine_hemisphere(u.y, u.z)
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


MUTANTS = [W4Slate, W4Hairline, W4Grooves, W4Blinn, W4Clearcoat, W4Clay, W4Plaster, W4Velour, W4Felt]
SOUND = []
