"""Rough glass: Walter's model with GGX or Beckmann facets, written out."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.optics import frame


class _RoughGlass(go.BSDF):
    """Right: rough glass (Walter2007), separable Smith masking, normals sampled by D cos."""

    eta: go.Number = go.number(1.5, "index inside over index outside", low=1.1, high=2.5)
    alpha: go.Width = go.width(0.3, "width of the facets' distribution", low=0.05)
    rotation: go.Angle = go.angle(0.0, "turns the pair of widths")
    albedo: go.Colour = go.spectrum(1.0, "factor on all light", low=0.0, high=1.0)

    @property
    def transmits(self):
        return True

    # ---- parts

    def relative(self, wo):
        return ops.where(wo.z >= 0.0, self.eta, 1.0 / self.eta)

    def fresnel(self, cos, eta):
        cos_t = ops.safe_sqrt(cos * cos + (eta - 1.0) * (eta + 1.0)) / eta
        r_s = (cos - eta * cos_t) / (cos + eta * cos_t)
        r_p = (eta * cos - cos_t) / (eta * cos + cos_t)
        return ops.where(cos_t > 0.0, 0.5 * (ops.sqr(r_s) + ops.sqr(r_p)), 1.0)

    def D(self, m):
        a = self.alpha
        q = ops.sqr(m.x / a.x) + ops.sqr(m.y / a.y) + ops.sqr(m.z)
        return 1.0 / (ops.pi * a.x * a.y * ops.sqr(q))

    def draw(self, u1, u2):
        s, c = ops.sincos(2.0 * ops.pi * u2)
        slope = ops.sqrt(u1 / (1.0 - u1))
        return ops.normalize(ops.vec3(self.alpha.x * slope * c, self.alpha.y * slope * s, 1.0 + 0.0 * slope))

    def G1_over_cos(self, w):
        a = self.alpha
        z = ops.abs(w.z)
        return 2.0 / (z + ops.sqrt(ops.sqr(z) + ops.sqr(a.x * w.x) + ops.sqr(a.y * w.y)))

    def G_over_cos_o(self, wo, wi, reflects):
        return self.G1_over_cos(wo) * self.G1_over_cos(wi) * ops.abs(wi.z)

    def normal(self, wo, wi, eta):
        h = wo + wi * ops.where(wo.z * wi.z > 0.0, 1.0, eta)
        h = h * ops.rsqrt(ops.maximum(ops.dot(h, h), 1e-30))
        return ops.where(h.z < 0.0, -h, h)

    def lit(self, wo, wi, m):
        return (ops.dot(wo, m) * wo.z > 0.0) & (ops.dot(wi, m) * wi.z > 0.0)

    def lit_eval(self, wo, wi, m):
        return self.lit(wo, wi, m)

    def squeeze(self, o_m, i_m, eta):
        """dm/dwi over eta^2 of a refraction."""
        return ops.abs(i_m) / ops.maximum(ops.sqr(o_m + eta * i_m), 1e-12)

    def eval_F(self, wo, wi, m, eta):
        return self.fresnel(ops.abs(ops.dot(wo, m)), eta)

    def pdf_F(self, wo, m, eta):
        return self.fresnel(ops.abs(ops.dot(wo, m)), eta)

    def pdf_eta2(self, eta):
        return ops.sqr(eta)

    def mode_factor(self, eta, mode):
        return ops.sqr(eta) if mode == "importance" else 1.0 + 0.0 * eta

    def into(self, w):
        return frame.rotate(w, self.rotation)

    def out_of(self, w):
        return frame.rotate_back(w, self.rotation)

    # ---- formulas

    def eval(self, wo, wi, mode="radiance"):
        wo, wi = frame.rotate(wo, self.rotation), frame.rotate(wi, self.rotation)
        eta = self.relative(wo)
        m = self.normal(wo, wi, eta)
        o_m, i_m = ops.dot(wo, m), ops.dot(wi, m)
        reflects = wo.z * wi.z > 0.0
        f = self.eval_F(wo, wi, m, eta)
        facets = self.D(m) * self.G_over_cos_o(wo, wi, reflects)
        through = (1.0 - f) * ops.abs(o_m) * self.squeeze(o_m, i_m, eta) * self.mode_factor(eta, mode)
        value = ops.where(self.lit_eval(wo, wi, m), facets * ops.where(reflects, 0.25 * f, through), 0.0)
        return self.albedo * value

    def pdf(self, wo, wi):
        wo, wi = frame.rotate(wo, self.rotation), frame.rotate(wi, self.rotation)
        eta = self.relative(wo)
        m = self.normal(wo, wi, eta)
        o_m, i_m = ops.dot(wo, m), ops.dot(wi, m)
        reflects = wo.z * wi.z > 0.0
        f = self.pdf_F(wo, m, eta)
        back = ops.safe_div(0.25 * f, ops.abs(o_m))
        through = (1.0 - f) * self.squeeze(o_m, i_m, eta) * self.pdf_eta2(eta)
        return ops.where(self.lit(wo, wi, m), self.D(m) * m.z * ops.where(reflects, back, through), 0.0)

    def sample(self, wo, u, mode="radiance"):
        o = self.into(wo)
        eta = self.relative(o)
        m = self.draw(u.y, u.z)
        facing = ops.where(o.z < 0.0, -m, m)
        o_m = ops.dot(o, facing)
        cos = ops.maximum(o_m, 0.0)
        f = self.fresnel(cos, eta)
        reflects = u.x < f
        cos_t = ops.safe_sqrt(cos * cos + (eta - 1.0) * (eta + 1.0)) / eta
        i = ops.where(reflects, frame.reflect(o, facing), frame.refract(o, facing, cos_t, eta))
        sides = o.z * i.z
        good = (o_m > 0.0) & ops.where(reflects, sides > 0.0, sides < 0.0)
        wi = ops.where(good, self.out_of(i), wo)
        pdf = ops.where(good, self.pdf(wo, wi), 0.0)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), ops.where(good & ~reflects, eta, 1.0))


class _RoughGlassBeckmann(_RoughGlass):
    """Right: with Beckmann's distribution (masked as GGX, which masks more)."""

    def D(self, m):
        a = self.alpha
        z2 = ops.maximum(ops.sqr(m.z), 1e-7)
        tan2 = (ops.sqr(m.x / a.x) + ops.sqr(m.y / a.y)) / z2
        return ops.exp(-tan2) / (ops.pi * a.x * a.y * ops.sqr(z2))

    def draw(self, u1, u2):
        s, c = ops.sincos(2.0 * ops.pi * u2)
        slope = ops.sqrt(-ops.log(1.0 - u1))
        return ops.normalize(ops.vec3(self.alpha.x * slope * c, self.alpha.y * slope * s, 1.0 + 0.0 * slope))


class RoughGlassPdfWithoutEta2(_RoughGlass):
    fault: ClassVar[str] = (
        "The Jacobian of refraction in the pdf lacks eta^2, so from outside the density of transmission is too low by 2.25 and does not integrate to 1 (and it is too high from inside)."
    )
    cause: ClassVar[str] = "refraction Jacobian lacks eta^2 in pdf"

    def pdf_eta2(self, eta):
        return 1.0 + 0.0 * eta


class RoughGlassNormalTowardViewer(_RoughGlass):
    fault: ClassVar[str] = (
        "The half vector is turned to the viewer's side instead of to the upper side, and the pdf multiplies by its signed z: for a viewer below, the density is negative, and so are the samples' weights."
    )
    cause: ClassVar[str] = "signed m.z in pdf from below"

    def normal(self, wo, wi, eta):
        h = wo + wi * ops.where(wo.z * wi.z > 0.0, 1.0, eta)
        h = h * ops.rsqrt(ops.maximum(ops.dot(h, h), 1e-30))
        return ops.where(ops.dot(wo, h) < 0.0, -h, h)

    def lit(self, wo, wi, m):
        same = wo.z * wi.z
        return (m.z * wo.z > 0.0) & (ops.dot(wo, m) > 0.0) & (ops.dot(wi, m) * same > 0.0)


class RoughGlassSampleIgnoresMode(_RoughGlassBeckmann):
    fault: ClassVar[str] = (
        "`sample` does not pass `mode` on, so with mode='importance' a refracted sample has the weight for radiance, too small by eta^2 = 2.25 from outside."
    )
    cause: ClassVar[str] = "sample ignores the mode"

    def sample(self, wo, u, mode="radiance"):
        return super().sample(wo, u, "radiance")


class RoughGlassImportanceFromInside(_RoughGlass):
    fault: ClassVar[str] = (
        "In mode 'importance' the value is multiplied by self.eta^2 from both sides instead of by the relative index squared: for a viewer inside refraction is too strong by eta^4, about 5."
    )
    cause: ClassVar[str] = "importance factor with unrelative eta"

    def mode_factor(self, eta, mode):
        return ops.sqr(self.eta) + 0.0 * eta if mode == "importance" else 1.0 + 0.0 * eta


class RoughGlassMacroFresnel(_RoughGlassBeckmann):
    fault: ClassVar[str] = (
        "Fresnel's reflectance in eval is taken at the viewer's angle to the surface normal instead of to the facet: value(wo, wi) is not reciprocal, and F + T is not 1 per facet."
    )
    cause: ClassVar[str] = "Fresnel at surface normal, not facet"

    def eval_F(self, wo, wi, m, eta):
        return self.fresnel(ops.abs(wo.z), eta)


class RoughGlassSwappedWidths(_RoughGlass):
    fault: ClassVar[str] = (
        "For refraction the masking of wi uses the two widths exchanged; transmission is not reciprocal, only for unequal widths and oblique directions."
    )
    cause: ClassVar[str] = "alpha.x, alpha.y swapped in one masking"

    alpha: go.Width = go.width((0.2, 0.6), "width of the facets' distribution", low=0.05)

    def G_over_cos_o(self, wo, wi, reflects):
        a = self.alpha
        z = ops.abs(wi.z)
        swapped = 2.0 / (z + ops.sqrt(ops.sqr(z) + ops.sqr(a.y * wi.x) + ops.sqr(a.x * wi.y)))
        return self.G1_over_cos(wo) * ops.where(reflects, self.G1_over_cos(wi), swapped) * z


class RoughGlassBackFacets(_RoughGlass):
    fault: ClassVar[str] = (
        "eval does not check that the facet is seen from its front by both directions: pairs that no refraction joins (o.m and i.m of one sign) have a value > 0, where pdf is 0 and sample never goes; visible at large widths and oblique pairs on one azimuth."
    )
    cause: ClassVar[str] = "back-facing test missing in eval"

    alpha: go.Width = go.width(0.7, "width of the facets' distribution", low=0.05)

    def lit_eval(self, wo, wi, m):
        return (ops.abs(wo.z) > 0.0) & (ops.abs(wi.z) > 0.0)


class RoughGlassPdfMacroShare(_RoughGlass):
    fault: ClassVar[str] = (
        "`sample` chooses reflection by F at the sampled facet, pdf uses F at the surface normal; pdf is not the density of the samples, most at oblique views and large widths."
    )
    cause: ClassVar[str] = "lobe probability from other angle in pdf"

    def pdf_F(self, wo, m, eta):
        return self.fresnel(ops.abs(wo.z), eta)


class RoughGlassRotatedBackwards(_RoughGlassBeckmann):
    fault: ClassVar[str] = (
        "`sample` turns wo into the frame of the widths in the wrong direction and wi back likewise; wrong only for a rotation other than 0 and unequal widths."
    )
    cause: ClassVar[str] = "sample rotates in opposite direction"

    alpha: go.Width = go.width((0.15, 0.5), "width of the facets' distribution", low=0.05)
    rotation: go.Angle = go.angle(0.5, "turns the pair of widths")

    def into(self, w):
        return frame.rotate_back(w, self.rotation)

    def out_of(self, w):
        return frame.rotate(w, self.rotation)


class RoughGlassMatchedIndex(_RoughGlass):
    fault: ClassVar[str] = (
        "At eta = 1 (allowed) the half vector of wi = -wo is 0/0, so eval and pdf are NaN straight through; other values of eta are right."
    )
    cause: ClassVar[str] = "half vector normalized without guard"

    eta: go.Number = go.number(1.5, "index inside over index outside", low=1.0, high=2.5)

    def normal(self, wo, wi, eta):
        h = wo + wi * ops.where(wo.z * wi.z > 0.0, 1.0, eta)
        h = h / ops.sqrt(ops.dot(h, h))
        return ops.where(h.z < 0.0, -h, h)

    def squeeze(self, o_m, i_m, eta):
        return ops.abs(i_m) / ops.sqr(o_m + eta * i_m)

    def lit(self, wo, wi, m):
        return ~((ops.dot(wo, m) * wo.z <= 0.0) | (ops.dot(wi, m) * wi.z <= 0.0))


class RoughGlassLogOfZero(_RoughGlassBeckmann):
    fault: ClassVar[str] = (
        "The slope is the root of -log(u), not of -log(1 - u): the random number 0, which may occur, gives an infinite slope and a direction that is NaN."
    )
    cause: ClassVar[str] = "log(u) at u = 0"

    def draw(self, u1, u2):
        s, c = ops.sincos(2.0 * ops.pi * u2)
        slope = ops.sqrt(-ops.log(u1))
        return ops.normalize(ops.vec3(self.alpha.x * slope * c, self.alpha.y * slope * s, 1.0 + 0.0 * slope))

    def sample(self, wo, u, mode="radiance"):
        o = self.into(wo)
        eta = self.relative(o)
        m = self.draw(u.y, u.z)
        facing = ops.where(o.z < 0.0, -m, m)
        o_m = ops.dot(o, facing)
        f = self.fresnel(ops.abs(o_m), eta)
        reflects = u.x < f
        cos_t = ops.safe_sqrt(o_m * o_m + (eta - 1.0) * (eta + 1.0)) / eta
        i = ops.where(reflects, frame.reflect(o, facing), frame.refract(o, facing, cos_t, eta))
        sides = o.z * i.z
        bad = (o_m <= 0.0) | ops.where(reflects, sides <= 0.0, sides >= 0.0)
        wi = ops.where(bad, wo, self.out_of(i))
        pdf = ops.where(bad, 0.0, self.pdf(wo, wi))
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), ops.where(~bad & ~reflects, eta, 1.0))


MUTANTS = [
    RoughGlassPdfWithoutEta2,
    RoughGlassNormalTowardViewer,
    RoughGlassSampleIgnoresMode,
    RoughGlassImportanceFromInside,
    RoughGlassMacroFresnel,
    RoughGlassSwappedWidths,
    RoughGlassBackFacets,
    RoughGlassPdfMacroShare,
    RoughGlassRotatedBackwards,
    RoughGlassMatchedIndex,
    RoughGlassLogOfZero,
]
