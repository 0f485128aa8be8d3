"""Wrong anisotropic materials: brushed metal, grooves, strands."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.optics import frame
from gonio.optics.ndf import distribution

GGX = distribution("ggx")


def lit(wo, wi):
    """Whether both directions are above the surface."""
    return (wo.z > 0.0) & (wi.z > 0.0)


def drawn(material, wo, wi, mode):
    """The sample of a chosen direction, its weight eval / pdf."""
    pdf = material.pdf(wo, wi)
    weight = material.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
    return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


def upper(w):
    """w mirrored to the upper side."""
    return ops.vec3(w.x, w.y, ops.abs(w.z))


class _Brushed(go.BSDF):
    """GGX of two widths with Schlick's reflectance, turned by an angle, correlated masking, visible normals."""

    r0: go.Colour = go.spectrum((0.9, 0.7, 0.5), "reflectance at the normal", low=0.0, high=1.0)
    alpha: go.Width = go.width((0.15, 0.5), "widths along and across the brush", low=0.02)
    turn: go.Angle = go.angle(0.7, "turn of the widths about the normal")

    def fresnel(self, cos):
        return self.r0 + (1.0 - self.r0) * ops.pow(1.0 - cos, 5.0)

    def into(self, w):
        return frame.rotate(w, self.turn)

    def D(self, m):
        return GGX.D(m, self.alpha)

    def G(self, wo, wi):
        return 1.0 / (1.0 + GGX.Lambda(wo, self.alpha) + GGX.Lambda(wi, self.alpha))

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        shape = ops.safe_div(self.D(self.into(m)) * self.G(self.into(wo), self.into(wi)), 4.0 * wo.z)
        return self.fresnel(ops.dot(wo, m)) * ops.where(lit(wo, wi), shape, 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        return ops.where(lit(wo, wi), 0.25 * GGX.visible_per_cosine(self.into(wo), self.into(m), self.alpha), 0.0)

    def sample(self, wo, u, mode="radiance"):
        turned = self.into(upper(wo))
        m = GGX.sample_visible(turned, u.y, u.z, self.alpha)
        return drawn(self, wo, frame.rotate_back(frame.reflect(turned, m), self.turn), mode)


class BrushedNotTurnedBack(_Brushed):
    """Brushed metal."""

    fault: ClassVar[str] = "sample turns the viewer into the frame of the widths, but not its direction back out"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "anisotropic"

    def sample(self, wo, u, mode="radiance"):
        turned = self.into(upper(wo))
        m = GGX.sample_visible(turned, u.y, u.z, self.alpha)
        return drawn(self, wo, frame.reflect(turned, m), mode)


class BrushedPdfOtherWay(_Brushed):
    """Brushed metal."""

    fault: ClassVar[str] = "pdf turns by minus the angle"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "anisotropic"

    def pdf(self, wo, wi):
        o, m = (frame.rotate_back(w, self.turn) for w in (wo, frame.half_vector(wo, wi)))
        return ops.where(lit(wo, wi), 0.25 * GGX.visible_per_cosine(o, m, self.alpha), 0.0)


class BrushedLightNotTurned(_Brushed):
    """Brushed metal."""

    fault: ClassVar[str] = "in the masking the viewer is turned and the light is not: not reciprocal"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "anisotropic"

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        shape = ops.safe_div(self.D(self.into(m)) * self.G(self.into(wo), wi), 4.0 * wo.z)
        return self.fresnel(ops.dot(wo, m)) * ops.where(lit(wo, wi), shape, 0.0)


class BrushedMaskedByAxis(_Brushed):
    """Brushed metal, masking of one width each to save time."""

    fault: ClassVar[str] = (
        "Lambda of the viewer uses alpha_x, that of the light alpha_y: not reciprocal where they differ"
    )
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "anisotropic"

    def G(self, wo, wi):
        x, y = ops.vec2(self.alpha.x, self.alpha.x), ops.vec2(self.alpha.y, self.alpha.y)
        return 1.0 / (1.0 + GGX.Lambda(wo, x) + GGX.Lambda(wi, y))


class BrushedMeanWidthPdf(_Brushed):
    """Brushed metal."""

    fault: ClassVar[str] = "pdf is normalized by the squared mean of the widths instead of their product"
    cause: ClassVar[str] = "constant factor in pdf: ((ax + ay) / 2)^2 for ax ay"
    kind: ClassVar[str] = "anisotropic"

    def pdf(self, wo, wi):
        o, m = self.into(wo), self.into(frame.half_vector(wo, wi))
        wrong = self.alpha.x * self.alpha.y / ops.sqr(0.5 * (self.alpha.x + self.alpha.y))
        return ops.where(lit(wo, wi), 0.25 * wrong * GGX.visible_per_cosine(o, m, self.alpha), 0.0)


class BrushedSwapped(_Brushed):
    """Brushed metal."""

    fault: ClassVar[str] = "sample takes the two widths in the wrong order"
    cause: ClassVar[str] = "alpha_x and alpha_y swapped in sample"
    kind: ClassVar[str] = "anisotropic"

    def sample(self, wo, u, mode="radiance"):
        turned = self.into(upper(wo))
        m = GGX.sample_visible(turned, u.y, u.z, ops.vec2(self.alpha.y, self.alpha.x))
        return drawn(self, wo, frame.rotate_back(frame.reflect(turned, m), self.turn), mode)


class BrushedStretchNotUnit(_Brushed):
    """Brushed metal, visible normals after Heitz 2018."""

    fault: ClassVar[str] = "the stretched viewer is not normalized before a visible normal is drawn"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "anisotropic"

    def sample(self, wo, u, mode="radiance"):
        turned = self.into(upper(wo))
        v = ops.vec3(self.alpha.x * turned.x, self.alpha.y * turned.y, turned.z)
        s, c = ops.sincos(2.0 * ops.pi * u.y)
        z = (1.0 - u.z) * (1.0 + v.z) - v.z
        r = ops.safe_sqrt(1.0 - z * z)
        n = ops.vec3(r * c + v.x, r * s + v.y, ops.maximum(z + v.z, 1e-6))
        m = ops.normalize(ops.vec3(self.alpha.x * n.x, self.alpha.y * n.y, n.z))
        return drawn(self, wo, frame.rotate_back(frame.reflect(turned, m), self.turn), mode)


class BrushedShear(_Brushed):
    """Brushed metal whose grooves lean."""

    fault: ClassVar[str] = (
        "it grows with the signed angle from light to viewer (o x i), which changes sign when swapped"
    )
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "anisotropic"

    def G(self, wo, wi):
        lean = 1.0 - 0.4 * (wo.x * wi.y - wo.y * wi.x)
        return lean * super().G(wo, wi) / 1.4


class _Ward(go.BSDF):
    """Ward's highlight of two widths in the form that keeps energy, sampled in closed form."""

    ks: go.Colour = go.spectrum(0.8, "share of light in the highlight", low=0.0, high=1.0)
    alpha: go.Width = go.width((0.1, 0.4), "widths along and across", low=0.02)

    def D(self, m):
        z2 = ops.maximum(ops.sqr(m.z), 1e-3)
        slope2 = (ops.sqr(m.x / self.alpha.x) + ops.sqr(m.y / self.alpha.y)) / z2
        return ops.exp(-slope2) / (ops.pi * self.alpha.x * self.alpha.y * ops.sqr(z2))

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        value = self.D(m) * wi.z / (4.0 * ops.maximum(ops.sqr(ops.dot(wo, m)), 1e-9))
        return self.ks * ops.where(lit(wo, wi), value, 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        return ops.where(lit(wo, wi), ops.safe_div(self.D(m) * m.z, 4.0 * ops.dot(wo, m)), 0.0)

    def azimuth(self, u):
        s, c = ops.sincos(2.0 * ops.pi * u)
        return ops.normalize(ops.vec2(self.alpha.x * c, self.alpha.y * s))

    def sample(self, wo, u, mode="radiance"):
        a = self.azimuth(u.z)
        tan2 = -ops.log(1.0 - u.y) / (ops.sqr(a.x / self.alpha.x) + ops.sqr(a.y / self.alpha.y))
        tan = ops.safe_sqrt(tan2)
        m = ops.normalize(ops.vec3(tan * a.x, tan * a.y, 1.0 + 0.0 * tan))
        return drawn(self, wo, frame.reflect(wo, m), mode)


class WardRoundAzimuth(_Ward):
    """Ward's highlight of two widths."""

    fault: ClassVar[str] = "the azimuth of the half vector is drawn uniformly, not stretched by the widths"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "anisotropic"

    def azimuth(self, u):
        s, c = ops.sincos(2.0 * ops.pi * u)
        return ops.vec2(c, s)


class WardHalfAzimuth(_Ward):
    """Ward's highlight of two widths, phi = atan(ay / ax tan(2 pi u))."""

    fault: ClassVar[str] = "the arc tangent of a quotient gives the right half of the circle only"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "anisotropic"

    def azimuth(self, u):
        s, c = ops.sincos(2.0 * ops.pi * u)
        phi = ops.atan2(self.alpha.y * s * ops.copysign(1.0 + 0.0 * c, c), self.alpha.x * ops.abs(c))
        s, c = ops.sincos(phi)
        return ops.vec2(c, s)


class WardTangentSlope(_Ward):
    """Ward's highlight of two widths."""

    fault: ClassVar[str] = "the exponent divides by alpha, not alpha^2, along y: D is not what sample draws from"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "anisotropic"

    def D(self, m):
        z2 = ops.maximum(ops.sqr(m.z), 1e-3)
        slope2 = (ops.sqr(m.x / self.alpha.x) + ops.sqr(m.y) / self.alpha.y) / z2
        return ops.exp(-slope2) / (ops.pi * self.alpha.x * self.alpha.y * ops.sqr(z2))


class AshikhminIsotropicLie(go.BSDF):
    """Ashikhmin's and Shirley's highlight of two exponents."""

    fault: ClassVar[str] = "its axes come from two exponents, and it does not say that it is not isotropic"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "anisotropic"
    r0: go.Colour = go.spectrum(0.6, "reflectance at the normal", low=0.0, high=1.0)
    nu: go.Number = go.number(10.0, "exponent along x", low=0.0, high=1000.0)
    nv: go.Number = go.number(100.0, "exponent along y", low=0.0, high=1000.0)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        n = ops.safe_div(self.nu * ops.sqr(m.x) + self.nv * ops.sqr(m.y), frame.sin2(m))
        lobe = ops.sqrt((self.nu + 1.0) * (self.nv + 1.0)) * ops.pow(m.z, n) / (8.0 * ops.pi)
        om = ops.dot(wo, m)
        f = self.r0 + (1.0 - self.r0) * ops.pow(1.0 - om, 5.0)
        shape = lobe * wi.z / ops.maximum(om * ops.maximum(wo.z, wi.z), 1e-6)
        return f * ops.where(lit(wo, wi), shape, 0.0)


class StrandWithoutCosine(go.BSDF):
    """Kajiya's and Kay's highlight of strands that run along x."""

    fault: ClassVar[str] = "the highlight sin(t, h)^p has no cosine of wi, so f is not reciprocal"
    cause: ClassVar[str] = "missing cosine of wi in eval"
    kind: ClassVar[str] = "anisotropic"
    ks: go.Colour = go.spectrum((0.25, 0.2, 0.1), "strength of the highlight", low=0.0)
    p: go.Number = go.number(20.0, "exponent", low=1.0, high=500.0)

    @property
    def isotropic(self):
        return False

    def eval(self, wo, wi):
        m = frame.half_vector(wo, wi)
        sin2 = ops.sqr(m.y) + ops.sqr(m.z)
        return self.ks * ops.where(lit(wo, wi), ops.pow(sin2, 0.5 * self.p), 0.0)


MUTANTS = [
    BrushedNotTurnedBack, BrushedPdfOtherWay, BrushedLightNotTurned, BrushedMaskedByAxis, BrushedMeanWidthPdf,
    BrushedSwapped, BrushedStretchNotUnit, BrushedShear, WardRoundAzimuth, WardHalfAzimuth, WardTangentSlope,
    AshikhminIsotropicLie, StrandWithoutCosine,
]  # fmt: skip
SOUND = []
