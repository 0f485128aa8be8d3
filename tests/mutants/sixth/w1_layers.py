"""Sheen, coats and combined materials, each with one mistake."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.ops import sqr
from gonio.optics import frame, warp


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


class _W1Ggx4(go.BSDF):
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


class _W1Visible4(_W1Ggx4):
    """The same, sampled by visible normals."""

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        density = self.D(m) * 0.5 / ops.maximum(wo.z + stretched_length(wo, self.alpha), 1e-9)
        return ops.where(above(wo, wi), density, 0.0)

    def normal(self, wo, u1, u2):
        return visible_normal(wo, u1, u2, self.alpha)

    def sample(self, wo, u, mode="radiance"):
        return drawn(self, wo, frame.reflect(wo, self.normal(wo, u.y, u.z)), mode)


class W1SheenPower(go.BSDF):
    """Charlie sheen with Neubelt's visibility."""

    fault: ClassVar[str] = "toward grazing views the sheen reflects more light than it receives"
    cause: ClassVar[str] = "D is normalized by 2 + 1 / alpha^2, but its exponent is 1 / alpha"
    colour: go.Colour = go.spectrum(0.8, "albedo of the fibers", low=0.0, high=1.0)
    alpha: go.Number = go.number(0.3, "width", low=0.1, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        D = (2.0 + 1.0 / sqr(self.alpha)) * (0.5 * ops.inv_pi) * ops.pow(frame.sin2(m), 0.5 / self.alpha)
        V = 1.0 / (4.0 * ops.maximum(wo.z + wi.z - wo.z * wi.z, 1e-6))
        return ops.where(above(wo, wi), self.colour * (D * V * wi.z), 0.0)


class W1SheenStalePdf(go.BSDF):
    """Velvet: a matte base with a rim, sampled uniformly."""

    fault: ClassVar[str] = "pdf is not the density of the samples, whose own pdf is right"
    cause: ClassVar[str] = "the sampler was changed from cosine to uniform, the method pdf was not"
    colour: go.Colour = go.spectrum((0.5, 0.1, 0.15), "albedo", low=0.0, high=1.0)
    rim: go.Number = go.number(0.6, "strength of the rim", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        V = 1.0 / (4.0 * ops.maximum(wo.z + wi.z - wo.z * wi.z, 1e-6))
        sheen = (4.0 * 0.5 * ops.inv_pi) * frame.sin2(m) * V
        f = self.colour * ((1.0 - self.rim) * ops.inv_pi + self.rim * 0.5 * sheen)
        return ops.where(above(wo, wi), f * wi.z, 0.0)

    def pdf(self, wo, wi):
        return ops.where(above(wo, wi), wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        sin = ops.safe_sqrt(1.0 - sqr(u.y))
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        wi = ops.vec3(sin * c, sin * s, u.y)
        pdf = ops.where(above(wo, wi), 1.0 + 0.0 * wi.z, 0.0) * (0.5 * ops.inv_pi)
        weight = self.eval(wo, wi, mode) * (2.0 * ops.pi)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class W1TransformedCosine(go.BSDF):
    """Velvet, sampled by a linearly transformed cosine that leans away from the viewer."""

    fault: ClassVar[str] = (
        "the pdf does not integrate to 1: it is too large where the inverse transform lengthens a direction, too small where it shortens it"
    )
    cause: ClassVar[str] = (
        "the Jacobian of the transformed cosine has |h|^3 instead of |h|^4: the cosine of the transformed direction is not normalized"
    )
    colour: go.Colour = go.spectrum((0.2, 0.3, 0.6), "albedo", low=0.0, high=1.0)
    A: go.Number = go.number(0.8, "widening of the proposal", low=0.3, high=2.0)
    B: go.Number = go.number(0.7, "leaning of the proposal at grazing views", low=0.0, high=2.0)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        V = 1.0 / (4.0 * ops.maximum(wo.z + wi.z - wo.z * wi.z, 1e-6))
        sheen = (4.0 * 0.5 * ops.inv_pi) * frame.sin2(m) * V
        f = self.colour * (0.4 * ops.inv_pi + 0.3 * sheen)
        return ops.where(above(wo, wi), f * wi.z, 0.0)

    def lean(self, wo):
        return self.B * ops.sqrt(frame.sin2(wo))

    def pdf(self, wo, wi):
        w = frame.rotate(wi, frame.azimuth(wo))
        h = ops.vec3(self.A * w.x + self.lean(wo) * w.z, self.A * w.y, w.z)
        length2 = ops.dot(h, h)
        density = ops.maximum(w.z, 0.0) * ops.inv_pi * sqr(self.A) / ops.maximum(length2 * ops.sqrt(length2), 1e-9)
        return ops.where(above(wo, wi), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        h = warp.square_to_cosine_hemisphere(u.y, u.z)
        w = ops.normalize(ops.vec3(h.x - self.lean(wo) * h.z, h.y, self.A * h.z))
        return drawn(self, wo, frame.rotate_back(w, frame.azimuth(wo)), mode)


class W1CoatNoEta(_W1Ggx4):
    """A varnish over a matte base, with all reflections between the two."""

    fault: ClassVar[str] = "the base seen through the varnish is eta^2 times too bright: a white one doubles the light"
    cause: ClassVar[str] = "the factor 1 / eta^2, the change of solid angle on leaving the varnish, is missing"
    r0: go.Number = go.number(0.04, "reflectance of the varnish at normal incidence", low=0.0, high=0.1)
    kd: go.Colour = go.spectrum((0.6, 0.35, 0.2), "albedo of the base", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.1, "width of the highlight", low=0.02, high=0.5)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        top = self.F(ops.dot(wo, m)) * (self.D(m) * self.visibility(wo, wi))
        root = ops.sqrt(self.r0)
        eta = (1.0 + root) / (1.0 - root)
        inside = 1.0 - (1.0 - (self.r0 + (1.0 - self.r0) / 21.0)) / sqr(eta)
        through = (1.0 - self.F(wo.z)) * (1.0 - self.F(wi.z)) * ops.inv_pi * wi.z
        return ops.where(above(wo, wi), top + self.kd * through / (1.0 - self.kd * inside), 0.0)


class W1OneWayAbsorption(go.BSDF):
    """A colored film over a matte base."""

    fault: ClassVar[str] = "the BRDF is not reciprocal: an oblique viewer sees a darker base than oblique light makes"
    cause: ClassVar[str] = "the film's absorption is applied along wo only, not on the way in along wi"
    kd: go.Colour = go.spectrum(0.8, "albedo of the base", low=0.0, high=1.0)
    absorption: go.Colour = go.spectrum((0.05, 0.2, 0.5), "optical thickness of the film", low=0.0)
    eta: go.Number = go.number(1.5, "index of the film", low=1.0, high=2.5)

    def eval(self, wo, wi, mode="radiance"):
        inner = ops.sqrt(ops.maximum(1.0 - frame.sin2(wo) / sqr(self.eta), 1e-4))
        left = ops.exp(self.absorption * (-2.0 / inner))
        return ops.where(above(wo, wi), self.kd * left * (wi.z * ops.inv_pi), 0.0)


class W1HalfVectorBase(_W1Ggx4):
    """A plastic: a GGX highlight over a matte base that receives the rest."""

    fault: ClassVar[str] = "at grazing views highlight and base together reflect more light than arrives"
    cause: ClassVar[str] = (
        "the base is scaled by 1 - F at the half vector, which is not the light that the highlight leaves over"
    )
    r0: go.Number = go.number(0.04, "reflectance of the highlight at normal incidence", low=0.0, high=0.3)
    kd: go.Colour = go.spectrum(0.85, "albedo of the base", low=0.0, high=1.0)
    alpha: go.Width = go.width(0.15, "width of the highlight", low=0.02, high=0.5)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        F = self.F(ops.dot(wo, m))
        value = self.kd * ((1.0 - F) * wi.z * ops.inv_pi) + F * (self.D(m) * self.visibility(wo, wi))
        return ops.where(above(wo, wi), value, 0.0)


class W1ThreeLobes(go.BSDF):
    """A narrow lobe, a wide lobe and a matte base."""

    fault: ClassVar[str] = "the wide lobe is sampled less often than the pdf states, the base more often"
    cause: ClassVar[str] = "the second comparison is u < p_wide instead of u < p_narrow + p_wide"
    kd: go.Colour = go.spectrum(0.6, "albedo of the base", low=0.0, high=1.0)
    narrow: go.Number = go.number(0.2, "share of the narrow lobe", low=0.05, high=0.4)
    wide: go.Number = go.number(0.45, "share of the wide lobe", low=0.05, high=0.5)

    def lobes(self, wo, wi):
        cos = ops.dot(frame.mirror(wo), wi)
        return (0.5 * ops.inv_pi) * ops.pow(cos, 80.0), (0.5 * ops.inv_pi) * ops.pow(cos, 8.0)

    def eval(self, wo, wi, mode="radiance"):
        narrow, wide = self.lobes(wo, wi)
        lobes = self.narrow * 82.0 * narrow + self.wide * 10.0 * wide
        f = self.kd * ((1.0 - self.narrow - self.wide) * ops.inv_pi) + lobes
        return ops.where(above(wo, wi), f * wi.z, 0.0)

    def pdf(self, wo, wi):
        narrow, wide = self.lobes(wo, wi)
        density = self.narrow * 81.0 * narrow + self.wide * 9.0 * wide
        density = density + (1.0 - self.narrow - self.wide) * wi.z * ops.inv_pi
        return ops.where(above(wo, wi), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        narrow = warp.to_frame(frame.mirror(wo), warp.square_to_power_lobe(u.y, u.z, 80.0 + 0.0 * u.y))
        wide = warp.to_frame(frame.mirror(wo), warp.square_to_power_lobe(u.y, u.z, 8.0 + 0.0 * u.y))
        wi = ops.where(u.x < self.wide, wide, warp.square_to_cosine_hemisphere(u.y, u.z))
        wi = ops.where(u.x < self.narrow, narrow, wi)
        return drawn(self, wo, wi, mode)


class W1FilmDenominator(_W1Ggx4):
    """A thin film on a metal, by the sum of all reflections (Airy), at one wavelength per channel."""

    fault: ClassVar[str] = "where the waves agree the film reflects up to twice the light that arrives"
    cause: ClassVar[str] = "the term 2 r1 r2 cos(phase) is missing in the denominator of Airy's sum"
    only_rgb: ClassVar[bool] = True
    r0: go.Colour = go.spectrum(0.95, "factor on everything reflected", low=0.0, high=1.0)
    eta: go.Number = go.number(1.45, "index of the film", low=1.0, high=2.5)
    thickness: go.Number = go.number(305.0, "thickness of the film, nm", low=0.0, high=2000.0)
    alpha: go.Width = go.width(0.1, "width", low=0.02, high=1.0)

    def F(self, cos):
        normal = sqr((self.eta - 1.0) / (self.eta + 1.0))
        r1 = ops.sqrt(normal + (1.0 - normal) * ops.pow(1.0 - cos, 5.0))
        r2 = 0.85
        inner = ops.safe_sqrt(1.0 - (1.0 - sqr(cos)) / sqr(self.eta))
        way = 4.0 * ops.pi * self.eta * self.thickness * inner
        bands = []
        for wavelength in (640.0, 550.0, 450.0):
            cross = 2.0 * r1 * r2 * ops.cos(way * (1.0 / wavelength))
            bands.append((sqr(r1) + r2 * r2 + cross) / (1.0 + sqr(r1) * (r2 * r2)))
        return self.r0 * ops.of_channels(self.r0, bands)


class W1CoatedMirrorPdf(go.BSDF):
    """A perfectly smooth clear coat, a mirror, over a matte base that receives the rest."""

    fault: ClassVar[str] = (
        "the matte samples' pdf is too large, so a picture loses the share of them that went to the mirror"
    )
    cause: ClassVar[str] = "pdf omits the probability 1 - P that the matte lobe is chosen"
    kd: go.Colour = go.spectrum(0.6, "albedo of the base", low=0.0, high=1.0)
    r0: go.Number = go.number(0.15, "reflectance of the coat at normal incidence", low=0.0, high=0.5)

    @property
    def delta(self):
        return "maybe"

    def F(self, cos):
        return self.r0 + (1.0 - self.r0) * ops.pow(1.0 - ops.clamp(cos, 0.0, 1.0), 5.0)

    def chance(self, wo):
        return ops.clamp(self.F(wo.z), 0.1, 0.9)

    def eval(self, wo, wi, mode="radiance"):
        left = (1.0 - self.F(wo.z)) * (1.0 - self.F(wi.z)) / (1.0 - self.r0) * (21.0 / 20.0)
        return ops.where(above(wo, wi), self.kd * (left * wi.z * ops.inv_pi), 0.0)

    def pdf(self, wo, wi):
        return ops.where(above(wo, wi), wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        chance = self.chance(wo)
        mirrored = (u.x < chance) & (wo.z > 0.0)
        wi = ops.where(mirrored, frame.mirror(wo), warp.square_to_cosine_hemisphere(u.y, u.z))
        density = self.pdf(wo, wi)
        pdf = ops.where(mirrored, chance, density)
        matte = self.eval(wo, wi, mode) * ops.safe_div(1.0, density)
        weight = ops.where(mirrored, (1.0 + 0.0 * matte) * (self.F(wo.z) / chance), matte)
        return go.Sample(wi, weight, pdf, mirrored, 1.0 + 0.0 * pdf)


class W1BothSidesAbs(go.BSDF):
    """Matte paper that looks the same from both sides."""

    fault: ClassVar[str] = (
        "light from the other side is seen as if it came from the viewer's side, so twice the albedo leaves"
    )
    cause: ClassVar[str] = "eval takes |cos| of both directions and does not test that they are on the same side"
    kd: go.Colour = go.spectrum(0.7, "albedo", low=0.0, high=1.0)

    @property
    def two_sided(self):
        return True

    def eval(self, wo, wi, mode="radiance"):
        o, i = ops.abs(wo.z), ops.abs(wi.z)
        rough = 1.0 - 0.1 * sqr(1.0 - o) * sqr(1.0 - i)
        return self.kd * (rough * i * ops.inv_pi)

    def pdf(self, wo, wi):
        return ops.where(wo.z * wi.z > 0.0, ops.abs(wi.z) * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        w = warp.square_to_cosine_hemisphere(u.y, u.z)
        wi = ops.vec3(w.x, w.y, ops.copysign(w.z, wo.z))
        return drawn(self, wo, wi, mode)


MUTANTS = [
    W1SheenPower,
    W1SheenStalePdf,
    W1TransformedCosine,
    W1CoatNoEta,
    W1OneWayAbsorption,
    W1HalfVectorBase,
    W1ThreeLobes,
    W1FilmDenominator,
    W1CoatedMirrorPdf,
    W1BothSidesAbs,
]
SOUND = []
