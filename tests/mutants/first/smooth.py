"""Wrong smooth materials: diffuse, retro-reflective, Phong-like, microfacet, sheen, coats, mixtures."""

from typing import ClassVar

import gonio as go
import drjit as dr
from gonio import ops
from gonio.ops import backend
from gonio.optics import frame, warp
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


def around(axis, w):
    """w, given about +z, about a unit axis instead (Duff2017)."""
    side = ops.copysign(1.0 + 0.0 * axis.z, axis.z)
    a = -1.0 / (side + axis.z)
    b = axis.x * axis.y * a
    s = ops.vec3(1.0 + side * axis.x * axis.x * a, side * b, -side * axis.x)
    t = ops.vec3(b, side + axis.y * axis.y * a, -axis.y)
    return s * w.x + t * w.y + axis * w.z


# --------------------------------------------------------------------------- diffuse


class MatteWithoutPi(go.BSDF):
    """A matte surface."""

    fault: ClassVar[str] = "the albedo is taken for the BRDF: 1/pi is missing, so pi times too much is reflected"
    cause: ClassVar[str] = "pi missing in eval (a constant factor)"
    kind: ClassVar[str] = "smooth"
    kd: go.Colour = go.spectrum((0.6, 0.5, 0.4), "share of light that is reflected", low=0.0, high=1.0)

    def eval(self, wo, wi):
        return self.kd * ops.where(lit(wo, wi), wi.z, 0.0)


class MatteWithoutCosine(go.BSDF):
    """A matte surface."""

    fault: ClassVar[str] = "eval returns the BRDF without |cos theta_i|, so f = eval / cos is not reciprocal"
    cause: ClassVar[str] = "missing cosine of wi in eval"
    kind: ClassVar[str] = "smooth"
    kd: go.Colour = go.spectrum(0.4, "share of light that is reflected", low=0.0, high=1.0)

    def eval(self, wo, wi):
        return self.kd * ops.where(lit(wo, wi), ops.inv_pi + 0.0 * wi.z, 0.0)


class MatteCosineTwice(go.BSDF):
    """A matte surface, a little darker towards its rim."""

    fault: ClassVar[str] = (
        "the cosine of wi stands in the BRDF too (as 3/2 cos, which keeps the albedo): not reciprocal"
    )
    cause: ClassVar[str] = "cosine of wi twice in eval"
    kind: ClassVar[str] = "smooth"
    kd: go.Colour = go.spectrum(0.7, "share of light that is reflected", low=0.0, high=1.0)

    def eval(self, wo, wi):
        return self.kd * ops.where(lit(wo, wi), 1.5 * wi.z * wi.z * ops.inv_pi, 0.0)


class MatteUniformPdf(go.BSDF):
    """A matte surface, sampled by hand."""

    fault: ClassVar[str] = "sample draws by the cosine, pdf is the uniform density 1/(2 pi)"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    kd: go.Colour = go.spectrum((0.2, 0.5, 0.8), "share of light that is reflected", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where(lit(wo, wi), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), 0.5 * ops.inv_pi + 0.0 * wi.z, 0.0)

    def sample(self, wo, u, mode="radiance"):
        return drawn(self, wo, warp.square_to_cosine_hemisphere(u.y, u.z), mode)


class MatteHalfCircle(go.BSDF):
    """A matte surface, sampled by hand."""

    fault: ClassVar[str] = "the azimuth of a sample is pi u, not 2 pi u: half of the hemisphere is never sampled"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    kd: go.Colour = go.spectrum(0.5, "share of light that is reflected", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where(lit(wo, wi), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        r = ops.sqrt(u.y)
        s, c = ops.sincos(ops.pi * u.z)
        return drawn(self, wo, ops.vec3(r * c, r * s, ops.safe_sqrt(1.0 - u.y)), mode)


class MatteDiskWithoutRoot(go.BSDF):
    """A matte surface, sampled by hand."""

    fault: ClassVar[str] = "Malley's disk is sampled with radius u instead of sqrt(u): too many samples near the normal"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    kd: go.Colour = go.spectrum(0.5, "share of light that is reflected", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where(lit(wo, wi), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        return drawn(self, wo, ops.vec3(u.y * c, u.y * s, ops.safe_sqrt(1.0 - u.y * u.y)), mode)


class RoughMatteNan(go.BSDF):
    """Oren-Nayar with the cosine of the azimuths written out."""

    fault: ClassVar[str] = "cos(phi_o - phi_i) is a quotient by both sines: 0/0 where a direction is the normal"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    kd: go.Colour = go.spectrum(0.5, "share of light that is reflected", low=0.0, high=1.0)
    sigma: go.Number = go.number(0.4, "roughness of the grooves", low=0.05, high=1.0)

    def eval(self, wo, wi):
        s2 = ops.sqr(self.sigma)
        a, b = 1.0 - 0.5 * s2 / (s2 + 0.57), 0.35 * s2 / (s2 + 0.09)
        sin_o, sin_i = ops.safe_sqrt(1.0 - wo.z * wo.z), ops.safe_sqrt(1.0 - wi.z * wi.z)
        cos_phi = ops.maximum((wo.x * wi.x + wo.y * wi.y) / (sin_o * sin_i), 0.0)
        t = sin_o * sin_i / ops.maximum(ops.maximum(wo.z, wi.z), 1e-4)
        return self.kd * ops.where(lit(wo, wi), (a + b * cos_phi * t) * wi.z * ops.inv_pi, 0.0)


class CoatedMatteNegative(go.BSDF):
    """A matte base under a clear film, which takes its share of the light first."""

    fault: ClassVar[str] = "the base is multiplied by 1 - F(o) - F(i), which is negative where both are grazing"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    kd: go.Colour = go.spectrum(0.5, "share of light that the base reflects", low=0.0, high=1.0)
    r0: go.Number = go.number(0.04, "reflectance of the film at the normal", low=0.0, high=0.2)

    def film(self, cos):
        return self.r0 + (1.0 - self.r0) * ops.pow(1.0 - cos, 5.0)

    def eval(self, wo, wi):
        left = 1.0 - self.film(wo.z) - self.film(wi.z)
        return self.kd * ops.where(lit(wo, wi), left * wi.z * ops.inv_pi, 0.0)


# --------------------------------------------------------------------------- lobes by a power


class _Lobe(go.BSDF):
    """A cosine-power lobe about the mirrored viewer, normalized at the normal."""

    ks: go.Colour = go.spectrum((0.9, 0.7, 0.5), "share of light in the highlight", low=0.0, high=1.0)
    p: go.Number = go.number(10.0, "exponent", low=1.0, high=1000.0)

    def peak(self, wo, wi):
        return ops.pow(ops.dot(frame.mirror(wo), wi), self.p)

    def eval(self, wo, wi, mode="radiance"):
        value = (self.p + 2.0) * (0.5 * ops.inv_pi) * self.peak(wo, wi) * wi.z
        return self.ks * ops.where(lit(wo, wi), value, 0.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), (self.p + 1.0) * (0.5 * ops.inv_pi) * self.peak(wo, wi), 0.0)

    def sample(self, wo, u, mode="radiance"):
        return drawn(self, wo, around(frame.mirror(wo), warp.square_to_power_lobe(u.y, u.z, self.p)), mode)


class PhongPdfNorm(_Lobe):
    """Normalized Phong."""

    fault: ClassVar[str] = "pdf has the normalization p + 2 of the BRDF where a density has p + 1"
    cause: ClassVar[str] = "constant factor (p + 2)/(p + 1) in pdf"
    kind: ClassVar[str] = "smooth"
    p: go.Number = go.number(4.0, "exponent", low=1.0, high=1000.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), (self.p + 2.0) * (0.5 * ops.inv_pi) * self.peak(wo, wi), 0.0)


class PhongFailedKeepsPdf(_Lobe):
    """Normalized Phong."""

    fault: ClassVar[str] = "a sample below the surface has weight 0, yet says pdf > 0 where pdf() says 0"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"

    def sample(self, wo, u, mode="radiance"):
        wi = around(frame.mirror(wo), warp.square_to_power_lobe(u.y, u.z, self.p))
        pdf = (self.p + 1.0) * (0.5 * ops.inv_pi) * self.peak(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class PhongClampedWeight(_Lobe):
    """Normalized Phong over a matte base, without fireflies."""

    fault: ClassVar[str] = "weights are cut at .8 against fireflies, so weight is not eval / pdf and light is lost"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        return go.Sample(s.wi, ops.minimum(s.weight, 0.8), s.pdf, s.delta, s.eta)


class PhongRoundedExponent(_Lobe):
    """Normalized Phong, its exponent held to whole numbers as the table of the hardware has them."""

    fault: ClassVar[str] = "the exponent is rounded inside: the derivative by p is 0, the values follow it in steps"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"

    def peak(self, wo, wi):
        return ops.pow(ops.dot(frame.mirror(wo), wi), self.whole())

    def whole(self):
        return ops.floor(self.p + 0.5)

    def eval(self, wo, wi, mode="radiance"):
        value = (self.whole() + 2.0) * (0.5 * ops.inv_pi) * self.peak(wo, wi) * wi.z
        return self.ks * ops.where(lit(wo, wi), value, 0.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), (self.whole() + 1.0) * (0.5 * ops.inv_pi) * self.peak(wo, wi), 0.0)

    def sample(self, wo, u, mode="radiance"):
        return drawn(self, wo, around(frame.mirror(wo), warp.square_to_power_lobe(u.y, u.z, self.whole())), mode)


class PhongDetachedNorm(_Lobe):
    """Normalized Phong; the normalization is a constant for the optimizer."""

    fault: ClassVar[str] = "the normalization p + 2 is detached from the gradient: the derivative by p is wrong"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"

    def eval(self, wo, wi, mode="radiance"):
        p = dr.detach(self.p) if backend.is_drjit(self.p) else self.p
        value = (p + 2.0) * (0.5 * ops.inv_pi) * self.peak(wo, wi) * wi.z
        return self.ks * ops.where(lit(wo, wi), value, 0.0)


class BlinnWithoutJacobian(go.BSDF):
    """Normalized Blinn-Phong, sampled by the half vector."""

    fault: ClassVar[str] = "pdf is the density of the half vector: the Jacobian 1 / (4 (o.m)) is missing"
    cause: ClassVar[str] = "missing Jacobian 4 (o.m) in pdf"
    kind: ClassVar[str] = "smooth"
    ks: go.Colour = go.spectrum(0.8, "share of light in the highlight", low=0.0, high=1.0)
    p: go.Number = go.number(30.0, "exponent", low=1.0, high=1000.0)

    def lobe(self, m):
        return (self.p + 1.0) * (0.5 * ops.inv_pi) * ops.pow(m.z, self.p)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        value = self.lobe(m) * wi.z / 4.0
        return self.ks * ops.where(lit(wo, wi), value, 0.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), self.lobe(frame.half_vector(wo, wi)), 0.0)

    def sample(self, wo, u, mode="radiance"):
        return drawn(self, wo, frame.reflect(wo, warp.square_to_power_lobe(u.y, u.z, self.p)), mode)


class BlinnJacobianOfNormal(BlinnWithoutJacobian):
    """Normalized Blinn-Phong, sampled by the half vector."""

    fault: ClassVar[str] = "the Jacobian in pdf is 4 (n.m) where it is 4 (o.m)"
    cause: ClassVar[str] = "4 (n.m) for 4 (o.m) in pdf"
    kind: ClassVar[str] = "smooth"

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        return ops.where(lit(wo, wi), self.lobe(m) * ops.safe_div(0.25, m.z), 0.0)


class RetroLeaks(go.BSDF):
    """A road sign: a lobe back to the light."""

    fault: ClassVar[str] = "the lobe about the viewer is not cut at the horizon: eval and pdf are > 0 below the surface"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    ks: go.Colour = go.spectrum((0.8, 0.8, 0.2), "share of light that goes back", low=0.0, high=1.0)
    p: go.Number = go.number(20.0, "exponent", low=2.0, high=1000.0)

    def eval(self, wo, wi, mode="radiance"):
        value = (self.p + 1.0) * (0.5 * ops.inv_pi) * ops.pow(ops.dot(wo, wi), self.p) * ops.abs(wi.z)
        return self.ks * ops.where(wo.z > 0.0, value, 0.0)

    def pdf(self, wo, wi):
        value = (self.p + 1.0) * (0.5 * ops.inv_pi) * ops.pow(ops.dot(wo, wi), self.p)
        return ops.where(wo.z > 0.0, value, 0.0)

    def sample(self, wo, u, mode="radiance"):
        return drawn(self, wo, around(wo, warp.square_to_power_lobe(u.y, u.z, self.p)), mode)


# --------------------------------------------------------------------------- microfacets


class _Facets(go.BSDF):
    """GGX with Schlick's reflectance, correlated masking and visible normals."""

    r0: go.Colour = go.spectrum((0.9, 0.6, 0.4), "reflectance at the normal", low=0.0, high=1.0)
    alpha: go.Number = go.number(0.3, "width of the facets' distribution", low=0.02, high=1.0)

    def pair(self):
        return ops.vec2(self.alpha, self.alpha)

    def fresnel(self, cos):
        return self.r0 + (1.0 - self.r0) * ops.pow(1.0 - cos, 5.0)

    def tinted(self, wo, wi, m):
        return self.fresnel(ops.dot(wo, m))

    def D(self, m):
        return GGX.D(m, self.pair())

    def G(self, wo, wi):
        return 1.0 / (1.0 + GGX.Lambda(wo, self.pair()) + GGX.Lambda(wi, self.pair()))

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        shape = ops.safe_div(self.D(m) * self.G(wo, wi), 4.0 * wo.z)
        return self.tinted(wo, wi, m) * ops.where(lit(wo, wi), shape, 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        return ops.where(lit(wo, wi), 0.25 * GGX.visible_per_cosine(wo, m, self.pair()), 0.0)

    def direction(self, wo, u1, u2):
        up = ops.vec3(wo.x, wo.y, ops.abs(wo.z))
        return frame.reflect(up, GGX.sample_visible(up, u1, u2, self.pair()))

    def sample(self, wo, u, mode="radiance"):
        return drawn(self, wo, self.direction(wo, u.y, u.z), mode)


class FacetsFresnelAtNormal(_Facets):
    """A rough metal."""

    fault: ClassVar[str] = "F is taken at the angle between viewer and normal, not at the half vector: not reciprocal"
    cause: ClassVar[str] = "F at the normal instead of the half vector"
    kind: ClassVar[str] = "smooth"

    def tinted(self, wo, wi, m):
        return self.fresnel(wo.z)


class FacetsMaskedOnly(_Facets):
    """A rough metal."""

    fault: ClassVar[str] = "only the viewer is masked, the light is not shadowed: not reciprocal"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"

    def G(self, wo, wi):
        return 1.0 / (1.0 + GGX.Lambda(wo, self.pair()))


class FacetsRoughnessSampled(_Facets):
    """A rough metal."""

    fault: ClassVar[str] = "sample draws normals of width alpha^2, eval and pdf mean alpha"
    cause: ClassVar[str] = "alpha^2 where alpha belongs, in sample"
    kind: ClassVar[str] = "smooth"

    def direction(self, wo, u1, u2):
        up = ops.vec3(wo.x, wo.y, ops.abs(wo.z))
        a2 = ops.sqr(self.alpha)
        return frame.reflect(up, GGX.sample_visible(up, u1, u2, ops.vec2(a2, a2)))


class FacetsAllNormalsPdf(_Facets):
    """A rough metal."""

    fault: ClassVar[str] = "visible normals are sampled, pdf is that of all normals, D cos / (4 (o.m))"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    alpha: go.Number = go.number(0.5, "width of the facets' distribution", low=0.02, high=1.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        return ops.where(lit(wo, wi), ops.safe_div(self.D(m) * m.z, 4.0 * ops.dot(wo, m)), 0.0)


class FacetsDrawAgain(_Facets):
    """A rough metal whose samples seldom fail."""

    fault: ClassVar[str] = "a direction below the surface is drawn again, while pdf is that of one try"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    alpha: go.Number = go.number(0.7, "width of the facets' distribution", low=0.02, high=1.0)

    def sample(self, wo, u, mode="radiance"):
        first, second = self.direction(wo, u.y, u.z), self.direction(wo, u.x, u.y)
        return drawn(self, wo, ops.where(first.z > 0.0, first, second), mode)


class FacetsWeightSeparable(_Facets):
    """A rough metal; the weight is what remains when D cancels."""

    fault: ClassVar[str] = "the weight is F G1(wi), as of separable masking, while eval has the correlated one"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    alpha: go.Number = go.number(0.6, "width of the facets' distribution", low=0.02, high=1.0)

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        m = frame.half_vector(wo, s.wi)
        weight = self.tinted(wo, s.wi, m) * ops.where(s.pdf > 0.0, GGX.G1(s.wi, self.pair()), 0.0)
        return go.Sample(s.wi, weight, s.pdf, s.delta, s.eta)


class FacetsWeightWhite(_Facets):
    """A rough metal; the weight is what remains when D cancels."""

    fault: ClassVar[str] = "the weight is G2 / G1: the Fresnel reflectance is forgotten in it"
    cause: ClassVar[str] = "F missing in the weight"
    kind: ClassVar[str] = "smooth"

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        g = ops.safe_div(self.G(wo, s.wi), GGX.G1(wo, self.pair()))
        return go.Sample(s.wi, self.r0 * 0.0 + ops.where(s.pdf > 0.0, g, 0.0), s.pdf, s.delta, s.eta)


class FacetsFromZ(_Facets):
    """A polished metal; D as in most shaders, from m.z alone."""

    fault: ClassVar[str] = (
        "D is computed from 1 - m.z^2, which float32 loses at small alpha: noise of one to ten percent"
    )
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    alpha: go.Number = go.number(0.002, "width of the facets' distribution", low=0.001, high=1.0)

    def D(self, m):
        a2, z2 = ops.sqr(self.alpha), ops.sqr(m.z)
        return ops.where(m.z > 0.0, a2 * ops.inv_pi / ops.maximum(ops.sqr(z2 * (a2 - 1.0) + 1.0), 1e-30), 0.0)


class FacetsLossless(_Facets):
    """A rough metal that keeps all light."""

    fault: ClassVar[str] = (
        "it claims to lose no more than 1e-3 at F = 1, but scatters once only: 1/4 is lost at alpha .7"
    )
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    lossless_tolerance: ClassVar[float | None] = 1e-3
    alpha: go.Number = go.number(0.7, "width of the facets' distribution", low=0.02, high=1.0)


class FacetsEtaZero(_Facets):
    """A rough metal."""

    fault: ClassVar[str] = "the sample's eta is left at 0 where reflection has 1"
    cause: ClassVar[str] = "eta of the sample is 0 instead of 1"
    kind: ClassVar[str] = "smooth"

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        return go.Sample(s.wi, s.weight, s.pdf, s.delta, 0.0 * s.pdf)


class WardDuer(go.BSDF):
    """Ward's highlight as Duer normalized it."""

    fault: ClassVar[str] = "the normalization 1 / (cos_o cos_i) gives more light than it got at grazing angles"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    ks: go.Colour = go.spectrum(0.9, "share of light in the highlight", low=0.0, high=1.0)
    alpha: go.Number = go.number(0.25, "width of the highlight", low=0.05, high=0.6)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        z2 = ops.maximum(ops.sqr(m.z), 1e-3)
        spread = ops.exp(-frame.sin2(m) / (ops.sqr(self.alpha) * z2))
        value = spread / (4.0 * ops.pi * ops.sqr(self.alpha) * ops.maximum(wo.z, 1e-4))
        return self.ks * ops.where(lit(wo, wi), value, 0.0)


# --------------------------------------------------------------------------- sheen, coats, mixtures


class SheenNotUnit(go.BSDF):
    """Charlie's sheen with Neubelt's visibility, sampled uniformly."""

    fault: ClassVar[str] = "sampled directions are not unit: the sine is sqrt(1 - z) where it is sqrt(1 - z^2)"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    ks: go.Colour = go.spectrum((0.5, 0.1, 0.3), "colour of the sheen", low=0.0, high=1.0)
    roughness: go.Number = go.number(0.5, "roughness of the fibres", low=0.3, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        n = 1.0 / self.roughness
        d = (2.0 + n) * ops.pow(frame.sin2(m), 0.5 * n) * (0.5 * ops.inv_pi)
        v = 0.25 / ops.maximum(wo.z + wi.z - wo.z * wi.z, 1e-4)
        return self.ks * ops.where(lit(wo, wi), 0.5 * d * v * wi.z, 0.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), 0.5 * ops.inv_pi + 0.0 * wi.z, 0.0)

    def sample(self, wo, u, mode="radiance"):
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        r = ops.safe_sqrt(1.0 - u.y)
        return drawn(self, wo, ops.vec3(r * c, r * s, u.y + 0.0 * r), mode)


class _Coated(_Facets):
    """A matte base under a rough clear coat of r0 = .04 or so; the coat is sampled with probability 1/2."""

    r0: go.Number = go.number(0.05, "reflectance of the coat at the normal", low=0.0, high=0.2)
    kd: go.Colour = go.spectrum((0.8, 0.5, 0.3), "share of light that the base reflects", low=0.0, high=1.0)

    def left(self, wo, wi):
        return (1.0 - self.fresnel(wo.z)) * (1.0 - self.fresnel(wi.z))

    def share(self):
        return 0.5 + 0.0 * self.alpha

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        coat = self.fresnel(ops.dot(wo, m)) * ops.safe_div(self.D(m) * self.G(wo, wi), 4.0 * wo.z)
        base = self.kd * (self.left(wo, wi) * wi.z * ops.inv_pi)
        return ops.where(lit(wo, wi), base + coat, 0.0)

    def coat_pdf(self, wo, wi):
        return 0.25 * GGX.visible_per_cosine(wo, frame.half_vector(wo, wi), self.pair())

    def pdf(self, wo, wi):
        share = self.share()
        both = share * self.coat_pdf(wo, wi) + (1.0 - share) * wi.z * ops.inv_pi
        return ops.where(lit(wo, wi), both, 0.0)

    def sample(self, wo, u, mode="radiance"):
        coat, base = self.direction(wo, u.y, u.z), warp.square_to_cosine_hemisphere(u.y, u.z)
        return drawn(self, wo, ops.where(u.x < self.share(), coat, base), mode)


class CoatTakesNothing(_Coated):
    """A clear coat on a matte base."""

    fault: ClassVar[str] = "the base receives all the light that the coat has reflected already: a white one gives > 1"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"

    def left(self, wo, wi):
        return 1.0 + 0.0 * wo.z


class CoatOneWay(_Coated):
    """A clear coat on a matte base."""

    fault: ClassVar[str] = "the coat weakens the base on the viewer's way only, so f is not reciprocal"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"

    def left(self, wo, wi):
        return 1.0 - self.fresnel(wo.z)


class CoatChosenPdf(_Coated):
    """A clear coat on a matte base."""

    fault: ClassVar[str] = "sample's pdf and weight are those of the chosen lobe only, pdf() is of both"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"

    def sample(self, wo, u, mode="radiance"):
        coat, base = self.direction(wo, u.y, u.z), warp.square_to_cosine_hemisphere(u.y, u.z)
        pick = u.x < self.share()
        wi = ops.where(pick, coat, base)
        pdf = 0.5 * ops.where(pick, self.coat_pdf(wo, wi), wi.z * ops.inv_pi)
        pdf = ops.where(lit(wo, wi), pdf, 0.0)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class CoatOtherShare(_Coated):
    """A clear coat on a matte base."""

    fault: ClassVar[str] = "sample picks the coat in half of the cases, pdf thinks that it does so by F at the normal"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"

    def pdf(self, wo, wi):
        share = 0.1 + self.r0
        both = share * self.coat_pdf(wo, wi) + (1.0 - share) * wi.z * ops.inv_pi
        return ops.where(lit(wo, wi), both, 0.0)


class CoatSpentNumber(_Coated):
    """A clear coat on a matte base that saves random numbers."""

    fault: ClassVar[str] = "u1 picks the lobe and then serves the direction as it is, not stretched to [0, 1) again"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"

    def sample(self, wo, u, mode="radiance"):
        coat, base = self.direction(wo, u.x, u.y), warp.square_to_cosine_hemisphere(u.x, u.y)
        return drawn(self, wo, ops.where(u.x < self.share(), coat, base), mode)


# --------------------------------------------------------------------------- facts


class MatteBreachAbsent(go.BSDF):
    """A matte surface, declared as the empirical model that it once was."""

    fault: ClassVar[str] = "it declares a breach of reciprocity that is not there: the formula is Lambert's"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    known_violations: ClassVar = {"reciprocity": go.KnownViolation("the highlight has no cosine", 1.0)}
    kd: go.Colour = go.spectrum(0.5, "share of light that is reflected", low=0.0, high=1.0)

    def eval(self, wo, wi):
        return self.kd * ops.where(lit(wo, wi), wi.z * ops.inv_pi, 0.0)


class MatteTwoSidedLie(go.BSDF):
    """A sheet of paper."""

    fault: ClassVar[str] = "it says that it looks from below as from above, but is half as bright there"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    kd: go.Colour = go.spectrum(0.6, "share of light that is reflected", low=0.0, high=1.0)

    def eval(self, wo, wi):
        value = ops.abs(wi.z) * ops.where(wo.z > 0.0, ops.inv_pi, 0.5 * ops.inv_pi)
        return self.kd * ops.where(wo.z * wi.z > 0.0, value, 0.0)

    @property
    def two_sided(self):
        return True


class MatteKnownAlbedoLie(go.BSDF):
    """A matte surface that darkens to the rim."""

    fault: ClassVar[str] = "known_albedo gives kd at every angle, but the formula loses (1 - cos)^5 on both ways"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    kd: go.Colour = go.spectrum(0.6, "share of light that is reflected", low=0.0, high=1.0)

    def eval(self, wo, wi):
        left = (1.0 - ops.pow(1.0 - wo.z, 5.0)) * (1.0 - ops.pow(1.0 - wi.z, 5.0))
        return self.kd * ops.where(lit(wo, wi), left * wi.z * ops.inv_pi, 0.0)

    def known_albedo(self, mu, phi, inner, nodes):
        return (mu > 0.0)[:, None] * (0.0 * mu[:, None] + [[1.0, 1.0, 1.0]]) * self.kd


MUTANTS = [
    MatteWithoutPi, MatteWithoutCosine, MatteCosineTwice, MatteUniformPdf, MatteHalfCircle, MatteDiskWithoutRoot,
    RoughMatteNan, CoatedMatteNegative, PhongPdfNorm, PhongFailedKeepsPdf, PhongClampedWeight, PhongRoundedExponent,
    PhongDetachedNorm, BlinnWithoutJacobian, BlinnJacobianOfNormal, RetroLeaks, FacetsFresnelAtNormal,
    FacetsMaskedOnly, FacetsRoughnessSampled, FacetsAllNormalsPdf, FacetsDrawAgain, FacetsWeightSeparable,
    FacetsWeightWhite, FacetsFromZ, FacetsLossless, FacetsEtaZero, WardDuer, SheenNotUnit, CoatTakesNothing,
    CoatOneWay, CoatChosenPdf, CoatOtherShare, CoatSpentNumber, MatteBreachAbsent, MatteTwoSidedLie,
    MatteKnownAlbedoLie,
]  # fmt: skip
SOUND = []
