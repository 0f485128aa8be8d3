"""Materials that are right on paper and wrong in numbers: cancellation, NaN at an edge, derivatives."""

from typing import ClassVar

import gonio as go
import drjit as dr
from gonio import ops
from gonio.materials.microfacet import microfacet
from gonio.optics import frame, warp
from gonio.optics.roughness import widths


class _Metal(go.BSDF):
    """GGX with correlated masking and Schlick's Fresnel reflectance, in pieces; all normals are sampled."""

    r0: go.Colour = go.spectrum((0.9, 0.7, 0.4), "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.3, "width", low=1e-3)
    kind: ClassVar[str] = "smooth"

    def D(self, m):
        n2 = ops.sqr(m.x / self.alpha.x) + ops.sqr(m.y / self.alpha.y) + ops.sqr(m.z)
        return 1.0 / (ops.pi * self.alpha.x * self.alpha.y * ops.sqr(n2))

    def Lambda(self, v):
        t2 = ops.sqr(self.alpha.x * v.x) + ops.sqr(self.alpha.y * v.y)
        return 0.5 * (ops.sqrt(1.0 + t2 / ops.maximum(ops.sqr(v.z), 1e-12)) - 1.0)

    def fresnel(self, cos):
        return self.r0 + (1.0 - self.r0) * ops.pow(1.0 - cos, 5.0)

    def normal(self, u1, u2):
        s, c = ops.sincos(2.0 * ops.pi * u2)
        tan = ops.sqrt(u1 / (1.0 - u1))
        return ops.normalize(ops.vec3(self.alpha.x * tan * c, self.alpha.y * tan * s, 1.0 + 0.0 * tan))

    def lit(self, wo, wi):
        return (wo.z > 0.0) & (wi.z > 0.0)

    def under(self, wo):
        """4 cos theta_o, held off 0."""
        return 4.0 * ops.maximum(wo.z, 1e-6)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        g = 1.0 / (1.0 + self.Lambda(wo) + self.Lambda(wi))
        value = self.D(m) * g / self.under(wo)
        return self.fresnel(ops.abs(ops.dot(wo, m))) * ops.where(self.lit(wo, wi), value, 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        density = self.D(m) * m.z / (4.0 * ops.maximum(ops.abs(ops.dot(wo, m)), 1e-6))
        return ops.where(self.lit(wo, wi), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        wi = frame.reflect(wo, self.normal(u.y, u.z))
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class MetalCancelling(_Metal):
    """Metal with D in the form that every course has."""

    alpha: go.Width = go.width(0.002, "width", low=1e-3)
    fault: ClassVar[str] = "a^2 / (pi (m_z^2 (a^2 - 1) + 1)^2) cancels in float32: percents at alpha .002"
    cause: ClassVar[str] = "cancellation in D at small alpha"

    def D(self, m):
        a2 = self.alpha.x * self.alpha.y
        return a2 / (ops.pi * ops.maximum(ops.sqr(ops.sqr(m.z) * (a2 - 1.0) + 1.0), 1e-30))


class MetalSampleCancelling(_Metal):
    """Metal whose normals are sampled by their cosine."""

    alpha: go.Width = go.width(0.0015, "width", low=1e-3)
    fault: ClassVar[str] = "sqrt(1 - cos^2) of the sampled normal has hardly a digit left in float32 at small alpha"
    cause: ClassVar[str] = "cancellation in sampling at small alpha"

    def normal(self, u1, u2):
        a2 = self.alpha.x * self.alpha.y
        cos = ops.safe_sqrt((1.0 - u1) / (1.0 + (a2 - 1.0) * u1))
        sin = ops.safe_sqrt(1.0 - ops.sqr(cos))
        s, c = ops.sincos(2.0 * ops.pi * u2)
        return ops.vec3(sin * c, sin * s, cos)


class MetalZeroWidth(_Metal):
    """Metal that promises alpha = 0 and divides by it."""

    alpha: go.Width = go.width(0.0, "width, down to a mirror")
    fault: ClassVar[str] = "alpha = 0 is in the declared range, and D divides by it: NaN"
    cause: ClassVar[str] = ""


class MetalGrazing(_Metal):
    """Metal that divides by the cosine where it is 0."""

    fault: ClassVar[str] = "the side test is >= 0 and nothing holds cos theta_o off 0: inf or NaN at the horizon"
    cause: ClassVar[str] = ""

    def lit(self, wo, wi):
        return (wo.z >= 0.0) & (wi.z >= 0.0)

    def under(self, wo):
        return 4.0 * wo.z

    def Lambda(self, v):
        t2 = (ops.sqr(self.alpha.x * v.x) + ops.sqr(self.alpha.y * v.y)) / ops.sqr(v.z)
        return 0.5 * (ops.sqrt(1.0 + t2) - 1.0)


class MetalDetached(_Metal):
    """Metal whose normalization knows no derivative."""

    fault: ClassVar[str] = "the 1 / alpha^2 of D is detached: its part of the derivative by alpha is missing"
    cause: ClassVar[str] = "derivative of the normalization missing"

    def D(self, m):
        x, y = (dr.detach(a) if dr.is_jit_v(a) else a for a in (self.alpha.x, self.alpha.y))
        n2 = ops.sqr(m.x / self.alpha.x) + ops.sqr(m.y / self.alpha.y) + ops.sqr(m.z)
        return 1.0 / (ops.pi * x * y * ops.sqr(n2))


class MetalSineRoot(_Metal):
    """Metal with a rational masking term of alpha tan, taken as a root."""

    fault: ClassVar[str] = "alpha tan is sqrt(alpha^2 tan^2): the gradient by alpha is NaN at normal incidence"
    cause: ClassVar[str] = ""

    def half_slope(self, v):
        a2 = ops.sqr(self.alpha.x * v.x) + ops.sqr(self.alpha.y * v.y)
        return 0.5 * ops.sqrt(a2) / ops.maximum(ops.abs(v.z), 1e-6)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        g = 1.0 / ((1.0 + self.half_slope(wo)) * (1.0 + self.half_slope(wi)))
        value = self.D(m) * g / self.under(wo)
        return self.fresnel(ops.abs(ops.dot(wo, m))) * ops.where(self.lit(wo, wi), value, 0.0)


class RootOfPower(go.BSDF):
    """A highlight that is the geometric mean of Phong's and Blinn's."""

    ks: go.Colour = go.spectrum(0.6, "share of the lobe", low=0.0, high=1.0)
    p: go.Number = go.number(12.0, "exponent", low=1.0, high=1000.0)
    fault: ClassVar[str] = "sqrt(exp(p log c)), c cut at 0: the gradient by p is 0 * inf for half of all pairs"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"

    def eval(self, wo, wi, mode="radiance"):
        c = ops.maximum(ops.dot(wo, frame.mirror(wi)), 0.0) * ops.maximum(frame.half_vector(wo, wi).z, 0.0)
        lobe = ops.sqrt(ops.exp(self.p * ops.log(c))) * (0.5 * self.p + 1.0) * (0.5 * ops.inv_pi)
        return self.ks * ops.where((wo.z > 0.0) & (wi.z > 0.0), lobe * wi.z, 0.0)


class QuantisedAlbedo(go.BSDF):
    """A matte surface with its albedo rounded to a byte."""

    albedo: go.Colour = go.spectrum((0.501, 0.303, 0.2), "share of light that is reflected", low=0.0, high=1.0)
    fault: ClassVar[str] = "floor(16 albedo + .5) / 16: the derivative by albedo is 0, and values step"
    cause: ClassVar[str] = "albedo rounded to 16 steps"
    kind: ClassVar[str] = "smooth"

    def eval(self, wo, wi, mode="radiance"):
        rounded = ops.floor(self.albedo * 16.0 + 0.5) * (1.0 / 16.0)
        return rounded * ops.where((wo.z > 0.0) & (wi.z > 0.0), wi.z * ops.inv_pi, 0.0)


class HugeExponent(go.BSDF):
    """Blinn's lobe about the half vector, for exponents of ten millions."""

    r0: go.Colour = go.spectrum(0.8, "reflectance", low=0.0, high=1.0)
    p: go.Number = go.number(3e6, "exponent", low=1.0, high=1e7)
    fault: ClassVar[str] = "m_z^p of a float32 cosine near 1: at p = 3e6 one rounding of m_z changes D by 20 %"
    cause: ClassVar[str] = "cosine near 1 to a huge power"
    kind: ClassVar[str] = "smooth"

    def D(self, m):
        return ops.pow(m.z, self.p) * (self.p + 2.0) * (0.5 * ops.inv_pi)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        cos = ops.maximum(ops.abs(ops.dot(wo, m)), 1e-6)
        value = self.D(m) * ops.minimum(wo.z, wi.z) * 0.25 / (cos * ops.maximum(wo.z, 1e-6))
        return self.r0 * ops.where((wo.z > 0.0) & (wi.z > 0.0), value * cos * m.z, 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        density = ops.pow(m.z, self.p + 1.0) * (self.p + 2.0) * (0.5 * ops.inv_pi)
        density = density / (4.0 * ops.maximum(ops.abs(ops.dot(wo, m)), 1e-6))
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        m = warp.square_to_power_lobe(u.y, u.z, self.p + 1.0)
        wi = frame.reflect(wo, m)
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class PhaseSheet(go.BSDF):
    """A thin scattering sheet by Henyey and Greenstein's phase function, to all sides."""

    albedo: go.Colour = go.spectrum(0.5, "share of light that is scattered", low=0.0, high=1.0)
    g: go.Number = go.number(0.0, "mean cosine", low=-0.9, high=0.9)
    fault: ClassVar[str] = "sampling divides by 2 g, and g = 0, isotropic scattering, is in the declared range: NaN"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "transmitting"
    transmits = True

    def pdf(self, wo, wi):
        cos = -ops.dot(wo, wi)
        base = ops.maximum(1.0 + ops.sqr(self.g) - 2.0 * self.g * cos, 1e-6)
        return (0.25 * ops.inv_pi) * (1.0 - ops.sqr(self.g)) / (base * ops.sqrt(base))

    def eval(self, wo, wi, mode="radiance"):
        lobe = self.pdf(wo, wi) * ops.abs(wi.z) / (ops.abs(wo.z) + ops.abs(wi.z) + 1e-6)
        return self.albedo * lobe

    def sample(self, wo, u, mode="radiance"):
        square = (1.0 - ops.sqr(self.g)) / (1.0 - self.g + 2.0 * self.g * u.y)
        cos = (1.0 + ops.sqr(self.g) - ops.sqr(square)) / (2.0 * self.g)
        sin = ops.safe_sqrt(1.0 - ops.sqr(cos))
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        axis = -wo
        side = ops.copysign(1.0 + 0.0 * axis.z, axis.z)
        a = -1.0 / (side + axis.z)
        b = axis.x * axis.y * a
        x = ops.vec3(1.0 + side * axis.x * axis.x * a, side * b, -side * axis.x)
        y = ops.vec3(b, side + axis.y * axis.y * a, -axis.y)
        wi = x * (sin * c) + y * (sin * s) + axis * cos
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class GlassMatched(go.Dielectric):
    """Rough glass that does not know what to do where both indices are equal."""

    eta: go.Number = go.number(1.0, "index inside over index outside", low=0.2, high=5.0)
    alpha: go.Width = go.width(0.3, "width of the microfacet distribution; two for anisotropy")
    fault: ClassVar[str] = "eta = 1 is in the declared range, but no facet is found there: all that should pass is lost"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "transmitting"

    def _widths(self):
        return widths(self.alpha)

    @property
    def delta(self):
        return microfacet.delta_of(self.plain.alpha)


MUTANTS = [
    MetalCancelling,
    MetalSampleCancelling,
    MetalZeroWidth,
    MetalGrazing,
    MetalDetached,
    MetalSineRoot,
    RootOfPower,
    QuantisedAlbedo,
    HugeExponent,
    PhaseSheet,
    GlassMatched,
]
SOUND = []
