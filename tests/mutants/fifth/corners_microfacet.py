"""Ten wrong materials whose mistakes sit in corners: microfacets, clearcoats, metals, compensation."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.optics import frame, warp


def _up(wo, wi):
    return (wo.z > 0.0) & (wi.z > 0.0)


def _slope2(m, a):
    """tan^2 of the angle, each axis over its width."""
    return (ops.sqr(m.x / a.x) + ops.sqr(m.y / a.y)) / ops.maximum(ops.sqr(m.z), 1e-12)


def _ggx(m, a):
    inside = ops.sqr(m.x / a.x) + ops.sqr(m.y / a.y) + ops.sqr(m.z)
    return ops.where(m.z > 0.0, 1.0, 0.0) / (ops.pi * a.x * a.y * ops.sqr(ops.maximum(inside, 1e-12)))


def _ggx_lambda(w, ax, ay):
    t2 = (ops.sqr(w.x * ax) + ops.sqr(w.y * ay)) / ops.maximum(ops.sqr(w.z), 1e-12)
    return 0.5 * (ops.sqrt(1.0 + t2) - 1.0)


def _ggx_normal(u1, u2, a):
    """A normal with density D m.z."""
    s, c = ops.sincos(2.0 * ops.pi * u2)
    r = ops.safe_sqrt(u1 / ops.maximum(1.0 - u1, 1e-7))
    return ops.normalize(ops.vec3(r * a.x * c, r * a.y * s, 1.0 + 0.0 * r))


def _beckmann(m, a):
    z = ops.maximum(m.z, 1e-4)
    return ops.exp(-_slope2(m, a)) / (ops.pi * a.x * a.y * ops.sqr(ops.sqr(z)))


def _beckmann_normal(u1, u2, a):
    s, c = ops.sincos(2.0 * ops.pi * u2)
    r = ops.safe_sqrt(-ops.log(ops.maximum(1.0 - u1, 1e-7)))
    return ops.normalize(ops.vec3(r * a.x * c, r * a.y * s, 1.0 + 0.0 * r))


def _groove(wo, wi, m):
    """Masking by v-shaped grooves."""
    om = ops.maximum(ops.dot(wo, m), 1e-6)
    return ops.clamp(2.0 * m.z * ops.minimum(wo.z, wi.z) / om, 0.0, 1.0)


def _schlick(r0, cos):
    return r0 + (1.0 - r0) * ops.pow(1.0 - ops.minimum(cos, 1.0), 5.0)


class _Facets(go.BSDF):
    """A rough reflecting surface; a subclass gives D G F, the density of the normals and a normal."""

    def D(self, m):
        raise NotImplementedError

    def G(self, wo, wi, m):
        return _groove(wo, wi, m)

    def F(self, wo, wi, m):
        raise NotImplementedError

    def normal(self, u1, u2):
        raise NotImplementedError

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        value = self.D(m) * self.G(wo, wi, m) / (4.0 * ops.maximum(wo.z, 1e-6))
        return self.F(wo, wi, m) * ops.where(_up(wo, wi), value, 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        return ops.where(_up(wo, wi), self.D(m) * m.z / (4.0 * ops.maximum(ops.dot(wo, m), 1e-6)), 0.0)

    def sample(self, wo, u, mode="radiance"):
        return self._weighted(wo, frame.reflect(wo, self.normal(u.y, u.z)), mode)


# --------------------------------------------------------------------------- 1


class BrushedMetalSwapped(_Facets):
    """Brushed metal: GGX with Smith's masking and two widths."""

    fault: ClassVar[str] = (
        "Smith's Lambda of the light takes the widths in the wrong order (ax for y): with unequal widths f is not "
        "reciprocal; with equal widths all is right"
    )
    cause: ClassVar[str] = "light's masking swaps the two widths"
    r0: go.Colour = go.spectrum(0.8, "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.3, "width of the distribution; a pair if anisotropic", low=0.02, high=1.0)

    def D(self, m):
        return _ggx(m, self.alpha)

    def G(self, wo, wi, m):
        a = self.alpha
        return 1.0 / (1.0 + _ggx_lambda(wo, a.x, a.y) + _ggx_lambda(wi, a.y, a.x))

    def F(self, wo, wi, m):
        return _schlick(self.r0, ops.dot(wo, m))

    def normal(self, u1, u2):
        return _ggx_normal(u1, u2, self.alpha)


# --------------------------------------------------------------------------- 2


class BeckmannRoundAzimuth(_Facets):
    """Beckmann's distribution with two widths, masked by v-grooves."""

    fault: ClassVar[str] = (
        "the sampler draws the azimuth of the normal uniformly (2 pi u) and then a right slope along it, while the pdf is "
        "D cos / (4 o.m) with the stretched azimuth: wrong for unequal widths only"
    )
    cause: ClassVar[str] = "sampled azimuth not stretched by the widths"
    r0: go.Colour = go.spectrum(0.6, "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.25, "width of the distribution; a pair if anisotropic", low=0.02, high=1.0)

    def D(self, m):
        return _beckmann(m, self.alpha)

    def F(self, wo, wi, m):
        return _schlick(self.r0, ops.dot(wo, m))

    def normal(self, u1, u2):
        s, c = ops.sincos(2.0 * ops.pi * u2)
        along = ops.sqr(c / self.alpha.x) + ops.sqr(s / self.alpha.y)
        r = ops.safe_sqrt(-ops.log(ops.maximum(1.0 - u1, 1e-7)) / along)
        return ops.normalize(ops.vec3(r * c, r * s, 1.0 + 0.0 * r))


# --------------------------------------------------------------------------- 3


class WardTurnedPdf(go.BSDF):
    """Ward's highlight in the form with a bounded albedo, on turned axes."""

    fault: ClassVar[str] = (
        "eval and sample turn the directions into the axes of the widths, the pdf does not: with a rotation and unequal "
        "widths pdf is not the density of the samples, and the weights of samples do not give the albedo"
    )
    cause: ClassVar[str] = "pdf ignores the rotation of the axes"
    ks: go.Colour = go.spectrum(0.5, "strength of the highlight", low=0.0, high=1.0)
    alpha: go.Width = go.width((0.12, 0.4), "width of the highlight; a pair if anisotropic", low=0.02, high=0.6)
    rotation: go.Angle = go.angle(0.0, "rotation of the axes about the normal")

    def eval(self, wo, wi, mode="radiance"):
        m = frame.rotate(frame.half_vector(wo, wi), self.rotation)
        om = ops.maximum(ops.dot(wo, frame.half_vector(wo, wi)), 1e-6)
        value = _beckmann(m, self.alpha) / (4.0 * om * om)
        return self.ks * ops.where(_up(wo, wi), value * wi.z, 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        density = _beckmann(m, self.alpha) * m.z / (4.0 * ops.maximum(ops.dot(wo, m), 1e-6))
        return ops.where(_up(wo, wi), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        m = frame.rotate_back(_beckmann_normal(u.y, u.z, self.alpha), self.rotation)
        return self._weighted(wo, frame.reflect(wo, m), mode)


# --------------------------------------------------------------------------- 4


class LacquerGtr1(_Facets):
    """A clear lacquer with a long tail: Burley's GTR distribution with exponent 1."""

    fault: ClassVar[str] = (
        "at alpha = 1, which is in the declared range, normalization (a^2 - 1) / log(a^2) and sampler are 0 / 0: eval, pdf "
        "and sample are NaN"
    )
    cause: ClassVar[str] = "GTR1 normalization is 0/0 at alpha 1"
    r0: go.Colour = go.spectrum(0.04, "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Number = go.number(0.2, "width of the distribution", low=0.01, high=1.0)

    def D(self, m):
        a2 = ops.sqr(self.alpha)
        return (a2 - 1.0) / (ops.pi * ops.log(a2) * (1.0 + (a2 - 1.0) * ops.sqr(m.z)))

    def F(self, wo, wi, m):
        return _schlick(self.r0, ops.dot(wo, m))

    def normal(self, u1, u2):
        a2 = ops.sqr(self.alpha)
        z2 = (1.0 - ops.exp((1.0 - u1) * ops.log(a2))) / (1.0 - a2)
        s, c = ops.sincos(2.0 * ops.pi * u2)
        r = ops.safe_sqrt(1.0 - z2)
        return ops.vec3(r * c, r * s, ops.safe_sqrt(z2))


# --------------------------------------------------------------------------- 5


class MetalEdgeDip(_Facets):
    """A metal by Schlick's curve, or with Lazanyi's dip before the edge."""

    fault: ClassVar[str] = (
        "with curve = 'lazanyi' the dip a c (1 - c)^6 is taken at the viewer's angle to the surface instead of to the "
        "facet: not reciprocal; 'schlick' is right"
    )
    cause: ClassVar[str] = "one Fresnel choice uses the surface's cosine"
    r0: go.Colour = go.spectrum(0.4, "reflectance at normal incidence", low=0.2, high=1.0)
    dip: go.Number = go.number(2.0, "depth of the dip", low=0.0, high=3.0)
    alpha: go.Number = go.number(0.35, "width of the distribution", low=0.05, high=1.0)
    curve: str = go.choice("schlick", "reflectance by angle", {"schlick": "as glass", "lazanyi": "with a dip"})

    def _pair(self):
        return ops.vec2(self.alpha, self.alpha)

    def D(self, m):
        return _ggx(m, self._pair())

    def F(self, wo, wi, m):
        whole = _schlick(self.r0, ops.dot(wo, m))
        if self.curve == "lazanyi":
            c = ops.clamp(wo.z, 0.0, 1.0)
            return ops.maximum(whole - self.dip * (c * ops.pow(1.0 - c, 6.0)), 0.0)
        return whole

    def normal(self, u1, u2):
        return _ggx_normal(u1, u2, self._pair())


# --------------------------------------------------------------------------- 6


class VisibleNormalsUnwarped(go.BSDF):
    """GGX with Smith's masking, sampled by visible normals."""

    fault: ClassVar[str] = (
        "the sampler takes a uniform point of the disk and does not squeeze its lower half to what a slanted viewer sees "
        "(Heitz's t2 = (1 - s) sqrt(1 - t1^2) + s t2): right from the normal, wrong toward grazing"
    )
    cause: ClassVar[str] = "visible-normal disk is not warped"
    r0: go.Colour = go.spectrum(0.7, "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.35, "width of the distribution; a pair if anisotropic", low=0.02, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        m, a = frame.half_vector(wo, wi), self.alpha
        G = 1.0 / (1.0 + _ggx_lambda(wo, a.x, a.y) + _ggx_lambda(wi, a.x, a.y))
        value = _ggx(m, a) * G / (4.0 * ops.maximum(wo.z, 1e-6))
        return _schlick(self.r0, ops.dot(wo, m)) * ops.where(_up(wo, wi), value, 0.0)

    def pdf(self, wo, wi):
        m, a = frame.half_vector(wo, wi), self.alpha
        seen = 1.0 / (1.0 + _ggx_lambda(wo, a.x, a.y))
        return ops.where(_up(wo, wi), _ggx(m, a) * seen / (4.0 * ops.maximum(wo.z, 1e-6)), 0.0)

    def sample(self, wo, u, mode="radiance"):
        a = self.alpha
        v = ops.normalize(ops.vec3(a.x * wo.x, a.y * wo.y, ops.abs(wo.z)))
        r = ops.sqrt(u.y)
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        n = warp.to_frame(v, ops.vec3(r * c, r * s, ops.safe_sqrt(1.0 - r * r)))
        m = ops.normalize(ops.vec3(a.x * n.x, a.y * n.y, ops.maximum(n.z, 1e-5)))
        return self._weighted(wo, frame.reflect(wo, m), mode)


# --------------------------------------------------------------------------- 7


class CompensatedMatte(go.BSDF):
    """A matte that loses light at grazing angles, and a second term that returns it."""

    fault: ClassVar[str] = (
        "the average loss in the denominator lacks the factor 2 of the mean with the cosine, so the returned light is twice "
        "the loss: white reflects up to 1 + s / 3, half of that at a cosine of 0.5; dark colors show nothing"
    )
    cause: ClassVar[str] = "average loss lacks the factor two"
    albedo: go.Colour = go.spectrum(0.5, "color", low=0.0, high=1.0)
    s: go.Number = go.number(0.4, "loss at grazing angles", low=0.01, high=1.0)

    def loss(self, cos):
        return self.s * (1.0 - ops.clamp(cos, 0.0, 1.0)) / 3.0

    def eval(self, wo, wi, mode="radiance"):
        once = 1.0 - self.s * (1.0 - ops.clamp(wo.z, 0.0, 1.0)) * (1.0 - ops.clamp(wi.z, 0.0, 1.0))
        more = self.loss(wo.z) * self.loss(wi.z) / (self.s / 18.0)  # right: the mean of the loss is s / 9
        return self.albedo * ops.where(_up(wo, wi), (once + more) * wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(_up(wo, wi), wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        return self.sample_cosine(wo, u, mode)


# --------------------------------------------------------------------------- 8


class GrooveHalfMasked(_Facets):
    """Cook and Torrance's metal: Beckmann's distribution in v-grooves."""

    fault: ClassVar[str] = (
        "of the masking min(1, 2 h o / oh, 2 h i / oh) the light's term is missing: f is not reciprocal where the light is "
        "lower than the viewer"
    )
    cause: ClassVar[str] = "shadowing term of the grooves missing"
    r0: go.Colour = go.spectrum((0.9, 0.7, 0.4), "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Number = go.number(0.3, "width of the distribution", low=0.05, high=0.8)

    def D(self, m):
        return _beckmann(m, ops.vec2(self.alpha, self.alpha))

    def G(self, wo, wi, m):
        return ops.clamp(2.0 * m.z * wo.z / ops.maximum(ops.dot(wo, m), 1e-6), 0.0, 1.0)

    def F(self, wo, wi, m):
        return _schlick(self.r0, ops.dot(wo, m))

    def normal(self, u1, u2):
        return _beckmann_normal(u1, u2, ops.vec2(self.alpha, self.alpha))


# --------------------------------------------------------------------------- 9


class _Plastic(go.BSDF):
    """A matte base and GGX facets in v-grooves, each with its own color."""

    def chance(self):
        raise NotImplementedError

    def drawn_chance(self):
        return self.chance()

    def _pair(self):
        return ops.vec2(self.alpha, self.alpha)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        lobe = _ggx(m, self._pair()) * _groove(wo, wi, m) / (4.0 * ops.maximum(wo.z, 1e-6))
        value = self.kd * (1.0 - self.ks) * (ops.inv_pi * wi.z) + self.ks * lobe
        return value * ops.where(_up(wo, wi), 1.0, 0.0)

    def pdf(self, wo, wi):
        m, q = frame.half_vector(wo, wi), self.chance()
        facets = _ggx(m, self._pair()) * m.z / (4.0 * ops.maximum(ops.dot(wo, m), 1e-6))
        return ops.where(_up(wo, wi), q * facets + (1.0 - q) * wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        shiny = frame.reflect(wo, _ggx_normal(u.y, u.z, self._pair()))
        wi = ops.where(u.x < self.drawn_chance(), shiny, warp.square_to_cosine_hemisphere(u.y, u.z))
        return self._weighted(wo, wi, mode)


class PlasticColorShare(_Plastic):
    """Plastic whose lobes are chosen by their colors."""

    fault: ClassVar[str] = (
        "sample chooses the highlight by the largest channels of ks and kd, the pdf by their means: the same for gray, "
        "different for colors, such as kd = (1, 0, 0)"
    )
    cause: ClassVar[str] = "share by maximum in sample, mean in pdf"
    kd: go.Colour = go.spectrum(0.5, "albedo of the base", low=0.0, high=1.0)
    ks: go.Colour = go.spectrum(0.3, "reflectance of the facets", low=0.01, high=1.0)
    alpha: go.Number = go.number(0.3, "width of the distribution", low=0.05, high=1.0)

    def chance(self):
        return ops.mean(self.ks) / (ops.mean(self.ks) + ops.mean(self.kd))

    def drawn_chance(self):
        s, d = ops.max_component(self.ks), ops.max_component(self.kd)
        return s / (s + d)


# --------------------------------------------------------------------------- 10


class PlasticBlack(_Plastic):
    """Plastic whose lobes are chosen by the mean of their colors."""

    fault: ClassVar[str] = (
        "the probability of the highlight is ks / (ks + kd) without a guard: if both colors are 0, as the range allows, pdf "
        "and sample return NaN"
    )
    cause: ClassVar[str] = "lobe probability is 0/0 for black"
    kd: go.Colour = go.spectrum(0.5, "albedo of the base", low=0.0, high=1.0)
    ks: go.Colour = go.spectrum(0.1, "reflectance of the facets", low=0.0, high=1.0)
    alpha: go.Number = go.number(0.4, "width of the distribution", low=0.05, high=1.0)

    def chance(self):
        return ops.mean(self.ks) / (ops.mean(self.ks) + ops.mean(self.kd))


MUTANTS = [
    BrushedMetalSwapped,
    BeckmannRoundAzimuth,
    WardTurnedPdf,
    LacquerGtr1,
    MetalEdgeDip,
    VisibleNormalsUnwarped,
    CompensatedMatte,
    GrooveHalfMasked,
    PlasticColorShare,
    PlasticBlack,
]
