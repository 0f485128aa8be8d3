"""Eight wrong materials whose mistakes sit in corners: glass, sheets, translucency, two sides, choices."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.optics import frame, fresnel, warp
from gonio.optics.fresnel import exact


def _up(wo, wi):
    return (wo.z > 0.0) & (wi.z > 0.0)


def _ggx(m, a):
    inside = ops.sqr(m.x / a) + ops.sqr(m.y / a) + ops.sqr(m.z)
    return ops.where(m.z > 0.0, 1.0, 0.0) / (ops.pi * a * a * ops.sqr(ops.maximum(inside, 1e-12)))


def _ggx_normal(u1, u2, a):
    s, c = ops.sincos(2.0 * ops.pi * u2)
    r = ops.safe_sqrt(u1 / ops.maximum(1.0 - u1, 1e-7))
    return ops.normalize(ops.vec3(r * a * c, r * a * s, 1.0 + 0.0 * r))


def _smith(w, a):
    t2 = a * a * frame.sin2(w) / ops.maximum(ops.sqr(w.z), 1e-12)
    return 2.0 / (1.0 + ops.sqrt(1.0 + t2))


def _reflectance(cos, eta):
    return exact.dielectric(cos, fresnel.cos_transmitted(cos, eta), eta)


def _flip(w, wo):
    return ops.vec3(w.x, w.y, ops.where(wo.z < 0.0, -w.z, w.z))


# --------------------------------------------------------------------------- 1


class SmoothGlassEta(go.BSDF):
    """Smooth clear glass."""

    fault: ClassVar[str] = (
        "the sample of a ray refracted from below states eta instead of 1 / eta as the ratio of the indices, against Snell's "
        "law for its directions; from above all is right"
    )
    cause: ClassVar[str] = "sample's eta not inverted from inside"
    eta: go.Number = go.number(1.5, "index inside over index outside", low=1.0, high=3.0)
    tint_color: go.Colour = go.spectrum(1.0, "factor on all light", low=0.0, high=1.0)

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "always"

    def eval(self, wo, wi, mode="radiance"):
        return self.tint_color * (0.0 * wo.z)

    def pdf(self, wo, wi):
        return 0.0 * wo.z

    def sample(self, wo, u, mode="radiance"):
        eta = ops.where(wo.z > 0.0, self.eta, 1.0 / self.eta)
        cos = ops.abs(wo.z)
        cos_t = fresnel.cos_transmitted(cos, eta)
        R = exact.dielectric(cos, cos_t, eta)
        reflects = u.x < R
        up = ops.vec3(0.0 * wo.z, 0.0 * wo.z, ops.copysign(1.0 + 0.0 * wo.z, wo.z))
        wi = ops.where(reflects, frame.mirror(wo), frame.refract(wo, up, cos_t, eta))
        through = 1.0 / ops.sqr(eta) if mode == "radiance" else 1.0
        pdf = ops.where(reflects, R, 1.0 - R)
        weight = self.tint_color * ops.where(reflects, 1.0, through)
        return go.Sample(wi, weight, pdf, pdf > 0.0, ops.where(reflects, 1.0, self.eta))


# --------------------------------------------------------------------------- 2


class WindowSingleFace(go.BSDF):
    """A thin window pane: reflection by both faces, 2 R / (1 + R), and straight transmission."""

    fault: ClassVar[str] = (
        "for straight transmission pdf and weight use 1 - R of one face as the probability, but the lobe is chosen with that "
        "of both faces, (1 - R) / (1 + R): the probabilities sum to more than 1 and transmitted light is too dark"
    )
    cause: ClassVar[str] = "transmission probability of one face only"
    eta: go.Number = go.number(1.5, "index of the pane", low=1.0, high=3.0)
    tint_color: go.Colour = go.spectrum(0.9, "factor on all light", low=0.0, high=1.0)

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "always"

    def eval(self, wo, wi, mode="radiance"):
        return self.tint_color * (0.0 * wo.z)

    def pdf(self, wo, wi):
        return 0.0 * wo.z

    def sample(self, wo, u, mode="radiance"):
        one = _reflectance(ops.abs(wo.z), self.eta)
        both = 2.0 * one / (1.0 + one)
        reflects = u.x < both
        pdf = ops.where(reflects, both, 1.0 - one)
        value = ops.where(reflects, both, 1.0 - both)
        wi = ops.where(reflects, frame.mirror(wo), -wo)
        return go.Sample(wi, self.tint_color * ops.safe_div(value, pdf), pdf, pdf > 0.0, 1.0 + 0.0 * pdf)


# --------------------------------------------------------------------------- 3 to 5


class _RoughGlass(go.BSDF):
    """Walter's rough glass: GGX, Smith's separable masking, all normals sampled."""

    eta: go.Number = go.number(1.5, "index inside over index outside", low=1.05, high=3.0)
    alpha: go.Number = go.number(0.3, "width of the distribution", low=0.05, high=1.0)
    color: go.Colour = go.spectrum(1.0, "factor on all light", low=0.0, high=1.0)

    @property
    def transmits(self):
        return True

    def ratio(self, wo):
        return ops.where(wo.z > 0.0, self.eta, 1.0 / self.eta)

    def facet(self, wo, wi):
        """(normal above, o.m, i.m, reflects, joined, index ratio)"""
        eta = self.ratio(wo)
        reflects = wo.z * wi.z > 0.0
        h = wo + wi * ops.where(reflects, 1.0, eta)
        h = h * ops.rsqrt(ops.maximum(ops.dot(h, h), 1e-20))
        m = ops.where(h.z < 0.0, -h, h)
        dot_o, dot_i = ops.dot(wo, m), ops.dot(wi, m)
        joined = (dot_o * wo.z > 0.0) & (dot_i * wi.z > 0.0)
        return m, dot_o, dot_i, reflects, joined, eta

    def squeeze(self, wo, eta, mode):
        """The factor of transmitted light: 1 for radiance, eta^2 for importance."""
        return ops.sqr(eta) if mode == "importance" else 1.0 + 0.0 * eta

    def pdf_ratio(self, wo, eta):
        return eta

    def eval(self, wo, wi, mode="radiance"):
        m, dot_o, dot_i, reflects, joined, eta = self.facet(wo, wi)
        F = _reflectance(ops.abs(dot_o), eta)
        DG = _ggx(m, self.alpha) * _smith(wo, self.alpha) * _smith(wi, self.alpha) / ops.maximum(ops.abs(wo.z), 1e-6)
        spread = ops.abs(dot_o * dot_i) / ops.maximum(ops.sqr(dot_o + eta * dot_i), 1e-12)
        value = ops.where(reflects, 0.25 * F * DG, (1.0 - F) * DG * spread * self.squeeze(wo, eta, mode))
        return self.color * ops.where(joined, value, 0.0)

    def pdf(self, wo, wi):
        m, dot_o, dot_i, reflects, joined, eta = self.facet(wo, wi)
        F = _reflectance(ops.abs(dot_o), eta)
        density = _ggx(m, self.alpha) * m.z
        e = self.pdf_ratio(wo, eta)
        jacobian = ops.sqr(e) * ops.abs(dot_i) / ops.maximum(ops.sqr(dot_o + eta * dot_i), 1e-12)
        back = F * density / (4.0 * ops.maximum(ops.abs(dot_o), 1e-6))
        return ops.where(joined, ops.where(reflects, back, (1.0 - F) * density * jacobian), 0.0)

    def drawn_share(self, wo, cos, eta):
        return _reflectance(cos, eta)

    def sample(self, wo, u, mode="radiance"):
        eta = self.ratio(wo)
        m = _ggx_normal(u.y, u.z, self.alpha)
        m = ops.where(wo.z < 0.0, -m, m)
        cos = ops.dot(wo, m)
        faces = cos > 0.0
        cos_t = fresnel.cos_transmitted(ops.abs(cos), eta)
        reflects = u.x < self.drawn_share(wo, ops.abs(cos), eta)
        wi = ops.where(reflects, frame.reflect(wo, m), frame.refract(wo, m, cos_t, eta))
        wi = ops.normalize(wi)
        right = faces & ((wo.z * wi.z > 0.0) & reflects | (wo.z * wi.z < 0.0) & ~reflects & (cos_t > 0.0))
        pdf = ops.where(right, self.pdf(wo, wi), 0.0)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), ops.where(reflects, 1.0, eta))


class RoughGlassImportance(_RoughGlass):
    """Rough glass for light and for importance."""

    fault: ClassVar[str] = (
        "in mode 'importance' light seen from below lacks its factor (eta_i / eta_o)^2 = 1 / eta^2, so both modes are the "
        "same there and the two transports are not adjoint; radiance is right"
    )
    cause: ClassVar[str] = "importance factor missing from below"

    def squeeze(self, wo, eta, mode):
        if mode == "importance":
            return ops.where(wo.z > 0.0, ops.sqr(eta), 1.0)
        return 1.0 + 0.0 * eta


class RoughGlassBelowJacobian(_RoughGlass):
    """Rough glass with Walter's densities."""

    fault: ClassVar[str] = (
        "the pdf of refraction has eta^2 of the material in its Jacobian also from below, where the index ratio is 1 / eta: "
        "the density is 5 times too great (at 1.5) and transmitted light seen from inside too dark"
    )
    cause: ClassVar[str] = "refraction Jacobian not inverted from below"

    def pdf_ratio(self, wo, eta):
        return self.eta + 0.0 * eta


class RoughGlassSurfaceShare(_RoughGlass):
    """Rough glass whose lobe is chosen by Fresnel's reflectance."""

    fault: ClassVar[str] = (
        "the sampler chooses reflection with the reflectance at the viewer's angle to the surface, the pdf has that at the "
        "facet: they differ towards grazing and near the critical angle from below"
    )
    cause: ClassVar[str] = "lobe chosen at the surface's cosine"

    def drawn_share(self, wo, cos, eta):
        return _reflectance(ops.abs(wo.z), eta)


# --------------------------------------------------------------------------- 6


class LeafBelow(go.BSDF):
    """A leaf that reflects and transmits diffusely, from both sides alike."""

    fault: ClassVar[str] = (
        "from below, the sampler takes the probability of transmission for that of reflection: pdf is not the density of "
        "the samples there, unless reflectance and transmittance are equal"
    )
    cause: ClassVar[str] = "lobe probabilities swapped for lower side"
    reflectance: go.Colour = go.spectrum(0.5, "share that is reflected", low=0.0, high=0.5)
    transmittance: go.Colour = go.spectrum(0.25, "share that is transmitted", low=0.0, high=0.5)

    @property
    def transmits(self):
        return True

    def chance(self):
        r, t = ops.mean(self.reflectance), ops.mean(self.transmittance)
        return ops.where(r + t > 0.0, r / ops.maximum(r + t, 1e-9), 0.5)

    def eval(self, wo, wi, mode="radiance"):
        same = wo.z * wi.z > 0.0
        return (self.reflectance * ops.where(same, 1.0, 0.0) + self.transmittance * ops.where(same, 0.0, 1.0)) * (
            ops.abs(wi.z) * ops.inv_pi
        )

    def pdf(self, wo, wi):
        q = self.chance()
        return ops.where(wo.z * wi.z > 0.0, q, 1.0 - q) * ops.abs(wi.z) * ops.inv_pi

    def sample(self, wo, u, mode="radiance"):
        q = ops.where(wo.z > 0.0, self.chance(), 1.0 - self.chance())
        local = warp.square_to_cosine_hemisphere(u.y, u.z)
        side = ops.where(u.x < q, 1.0, -1.0) * ops.copysign(1.0 + 0.0 * wo.z, wo.z)
        return self._weighted(wo, ops.vec3(local.x, local.y, local.z * side), mode)


# --------------------------------------------------------------------------- 7


class TwoSidedOneLobe(go.BSDF):
    """A painted sheet, matte with a Blinn highlight, the same on both sides."""

    fault: ClassVar[str] = (
        "seen from below the sampler mirrors the matte direction to the viewer's side but not the highlight's: these samples "
        "fail, and the light of the highlight is lost there"
    )
    cause: ClassVar[str] = "highlight's sample not flipped from below"
    kd: go.Colour = go.spectrum(0.5, "albedo of the matte part", low=0.0, high=0.5)
    ks: go.Colour = go.spectrum(0.25, "reflectance of the facets", low=0.0, high=0.5)
    p: go.Number = go.number(50.0, "exponent", low=1.0, high=1000.0)

    @property
    def two_sided(self):
        return True

    def eval(self, wo, wi, mode="radiance"):
        wo, wi = _flip(wo, wo), _flip(wi, wo)
        m = frame.half_vector(wo, wi)
        om = ops.maximum(ops.dot(wo, m), 1e-6)
        G = ops.clamp(2.0 * m.z * ops.minimum(wo.z, wi.z) / om, 0.0, 1.0)
        D = (self.p + 2.0) * (0.5 * ops.inv_pi) * ops.pow(m.z, self.p)
        value = self.kd * (ops.inv_pi * wi.z) + self.ks * (D * G / (4.0 * ops.maximum(wo.z, 1e-6)))
        return value * ops.where(_up(wo, wi), 1.0, 0.0)

    def pdf(self, wo, wi):
        wo, wi = _flip(wo, wo), _flip(wi, wo)
        m = frame.half_vector(wo, wi)
        shiny = warp.square_to_power_lobe_pdf(m.z, self.p) / (4.0 * ops.maximum(ops.dot(wo, m), 1e-6))
        return ops.where(_up(wo, wi), 0.6 * wi.z * ops.inv_pi + 0.4 * shiny, 0.0)

    def sample(self, wo, u, mode="radiance"):
        front = _flip(wo, wo)
        shiny = frame.reflect(front, warp.square_to_power_lobe(u.y, u.z, self.p))
        matte = _flip(warp.square_to_cosine_hemisphere(u.y, u.z), wo)
        return self._weighted(wo, ops.where(u.x < 0.4, shiny, matte), mode)


# --------------------------------------------------------------------------- 8


class NeumannMinimum(go.BSDF):
    """A Blinn highlight with a choice of the term that stands for masking."""

    fault: ClassVar[str] = (
        "with masking = 'neumann' f is divided by the smaller of both cosines instead of the larger: at grazing angles it "
        "reflects many times what it receives; the other two choices are right"
    )
    cause: ClassVar[str] = "Neumann's choice divides by smaller cosine"
    ks: go.Colour = go.spectrum(0.4, "reflectance of the facets", low=0.0, high=1.0)
    p: go.Number = go.number(30.0, "exponent", low=1.0, high=1000.0)
    masking: str = go.choice(
        "groove",
        "masking",
        {
            "groove": "by v-shaped grooves",
            "product": "the product of the cosines, so that they cancel",
            "neumann": "the larger cosine",
        },
    )

    def eval(self, wo, wi, mode="radiance"):
        up = _up(wo, wi)
        m = frame.half_vector(wo, wi)
        om = ops.maximum(ops.dot(wo, m), 1e-6)
        D = (self.p + 2.0) * (0.5 * ops.inv_pi) * ops.pow(m.z, self.p)
        low, high = ops.minimum(wo.z, wi.z), ops.maximum(wo.z, wi.z)
        if self.masking == "groove":
            value = ops.minimum(1.0, 2.0 * m.z * low / om) / (4.0 * ops.maximum(wo.z, 1e-6) * ops.maximum(wi.z, 1e-6))
        elif self.masking == "neumann":
            value = 1.0 / (4.0 * ops.maximum(low, 1e-6))
        else:
            value = 0.25 + 0.0 * low
        return self.ks * ops.where(up, D * value * wi.z, 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        shiny = warp.square_to_power_lobe_pdf(m.z, self.p) / (4.0 * ops.maximum(ops.dot(wo, m), 1e-6))
        return ops.where(_up(wo, wi), shiny, 0.0)

    def sample(self, wo, u, mode="radiance"):
        return self._weighted(wo, frame.reflect(wo, warp.square_to_power_lobe(u.y, u.z, self.p)), mode)


MUTANTS = [
    SmoothGlassEta,
    WindowSingleFace,
    RoughGlassImportance,
    RoughGlassBelowJacobian,
    RoughGlassSurfaceShare,
    LeafBelow,
    TwoSidedOneLobe,
    NeumannMinimum,
]
