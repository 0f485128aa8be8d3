"""Plastics, coats over bases, mixtures and energy compensation, each with one mistake."""

from typing import ClassVar

import gonio as go
import numpy as np
from gonio import ops
from gonio.optics import frame, warp


def above(wo, wi):
    return (wo.z > 0.0) & (wi.z > 0.0)


def schlick(cos, r0):
    """Schlick's Fresnel reflectance."""
    return r0 + (1.0 - r0) * ops.pow(1.0 - cos, 5.0)


def density(m, a):
    """D of isotropic GGX."""
    a2 = ops.sqr(a)
    spread = ops.maximum(frame.sin2(m) + a2 * ops.sqr(m.z), 1e-12)
    return a2 * ops.inv_pi / ops.sqr(spread)


def projected(v, a):
    """(1 + 2 Lambda) v_z."""
    return ops.sqrt(ops.sqr(v.z) + ops.sqr(a) * frame.sin2(v))


def ggx(wo, wi, a):
    """D G2 / (4 o_z), with correlated Smith masking."""
    both = projected(wo, a) * wi.z + projected(wi, a) * wo.z
    return density(frame.half_vector(wo, wi), a) * 0.5 * wi.z / ops.maximum(both, 1e-12)


def visible_pdf(wo, wi, a):
    """G1(o) D / (4 o_z)."""
    return 0.5 * density(frame.half_vector(wo, wi), a) / ops.maximum(wo.z + projected(wo, a), 1e-12)


def visible_sample(wo, u1, u2, a):
    """wo reflected at a visible normal of GGX."""
    v = ops.normalize(ops.vec3(a * wo.x, a * wo.y, wo.z))
    s, c = ops.sincos(2.0 * ops.pi * u1)
    z = (1.0 - u2) * (1.0 + v.z) - v.z
    r = ops.safe_sqrt(1.0 - ops.sqr(z))
    m = ops.normalize(ops.vec3(a * (r * c + v.x), a * (r * s + v.y), ops.maximum(z + v.z, 1e-9)))
    return frame.reflect(wo, m)


class W4Enamel(go.BSDF):
    """Enamel: a GGX highlight over a matte base that receives the remaining light, coupled in both directions."""

    fault: ClassVar[str] = "the base is normalized by a wrong average Fresnel reflectance and gains energy"
    cause: ClassVar[str] = (
        "the average of Schlick's reflectance is taken as r0 + (1 - r0) / 6, the integral over the cosine without the "
        "weight 2 cos; it is r0 + (1 - r0) / 21. The base, divided by 1 - F_avg, is too bright by a seventh, and a "
        "white base reflects more than arrives"
    )
    kd: go.Colour = go.spectrum(0.95, "albedo of the base", low=0.0, high=1.0)
    r0: go.Number = go.number(0.05, "reflectance of the highlight at normal incidence", low=0.0, high=0.5)
    alpha: go.Number = go.number(0.2, "width of the highlight", low=0.02, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        highlight = schlick(ops.dot(wo, m), self.r0) * ggx(wo, wi, self.alpha)
        average = self.r0 + (1.0 - self.r0) / 6.0
        left = (1.0 - schlick(wo.z, self.r0)) * (1.0 - schlick(wi.z, self.r0))
        base = self.kd * (left * wi.z / (ops.pi * (1.0 - average)))
        return ops.where(above(wo, wi), base + highlight, 0.0)

    def probability(self, wo):
        f = schlick(ops.abs(wo.z), self.r0)
        return f / (f + (1.0 - f) * ops.mean(self.kd) + 1e-6)

    def pdf(self, wo, wi):
        p = self.probability(wo)
        both = p * visible_pdf(wo, wi, self.alpha) + (1.0 - p) * wi.z * ops.inv_pi
        return ops.where(above(wo, wi), both, 0.0)

    def sample(self, wo, u, mode="radiance"):
        shiny = visible_sample(wo, u.y, u.z, self.alpha)
        wi = ops.where(u.x < self.probability(wo), shiny, warp.square_to_cosine_hemisphere(u.y, u.z))
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class W4Lacquer(go.BSDF):
    """Lacquer: a GGX highlight over a coupled matte base, sampled by choosing one of the two lobes."""

    fault: ClassVar[str] = "a sample's density is that of the chosen lobe alone"
    cause: ClassVar[str] = (
        "sample divides the sum of both lobes by the density of only the lobe that was chosen (times its probability) "
        "and returns it as pdf; the density is the sum over both lobes. Sampled light is counted twice, and sample.pdf "
        "differs from pdf"
    )
    kd: go.Colour = go.spectrum((0.5, 0.1, 0.1), "albedo of the base", low=0.0, high=1.0)
    r0: go.Number = go.number(0.05, "reflectance of the highlight at normal incidence", low=0.0, high=0.5)
    alpha: go.Number = go.number(0.3, "width of the highlight", low=0.02, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        highlight = schlick(ops.dot(wo, m), self.r0) * ggx(wo, wi, self.alpha)
        average = self.r0 + (1.0 - self.r0) / 21.0
        left = (1.0 - schlick(wo.z, self.r0)) * (1.0 - schlick(wi.z, self.r0))
        base = self.kd * (0.98 * left * wi.z / (ops.pi * (1.0 - average)))  # the coat absorbs a fiftieth
        return ops.where(above(wo, wi), base + highlight, 0.0)

    def probability(self, wo):
        f = schlick(ops.abs(wo.z), self.r0)
        return f / (f + (1.0 - f) * ops.mean(self.kd) + 1e-6)

    def pdf(self, wo, wi):
        p = self.probability(wo)
        both = p * visible_pdf(wo, wi, self.alpha) + (1.0 - p) * wi.z * ops.inv_pi
        return ops.where(above(wo, wi), both, 0.0)

    def sample(self, wo, u, mode="radiance"):
        p = self.probability(wo)
        shiny = u.x < p
        wi = ops.where(shiny, visible_sample(wo, u.y, u.z, self.alpha), warp.square_to_cosine_hemisphere(u.y, u.z))
        chosen = ops.where(shiny, p * visible_pdf(wo, wi, self.alpha), (1.0 - p) * wi.z * ops.inv_pi)
        pdf = ops.where(above(wo, wi), chosen, 0.0)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class W4Varnish(go.BSDF):
    """Varnish: a GGX highlight over a coupled matte base, its lobes chosen by Fresnel reflectance."""

    fault: ClassVar[str] = "pdf weights the lobes by another probability than sample"
    cause: ClassVar[str] = (
        "sample chooses the highlight with a probability from F at the view angle o_z, but pdf weights the lobes by F "
        "at the half vector of the pair, o.m; a probability may not depend on wi, and this pdf does not integrate to 1"
    )
    kd: go.Colour = go.spectrum((0.4, 0.25, 0.1), "albedo of the base", low=0.0, high=1.0)
    r0: go.Number = go.number(0.05, "reflectance of the highlight at normal incidence", low=0.0, high=0.5)
    alpha: go.Number = go.number(0.25, "width of the highlight", low=0.02, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        highlight = schlick(ops.dot(wo, m), self.r0) * ggx(wo, wi, self.alpha)
        average = self.r0 + (1.0 - self.r0) / 21.0
        left = (1.0 - schlick(wo.z, self.r0)) * (1.0 - schlick(wi.z, self.r0))
        base = self.kd * (0.98 * left * wi.z / (ops.pi * (1.0 - average)))  # the coat absorbs a fiftieth
        return ops.where(above(wo, wi), base + highlight, 0.0)

    def probability(self, cos):
        f = schlick(ops.abs(cos), self.r0)
        return f / (f + (1.0 - f) * ops.mean(self.kd) + 1e-6)

    def pdf(self, wo, wi):
        p = self.probability(ops.dot(wo, frame.half_vector(wo, wi)))
        both = p * visible_pdf(wo, wi, self.alpha) + (1.0 - p) * wi.z * ops.inv_pi
        return ops.where(above(wo, wi), both, 0.0)

    def sample(self, wo, u, mode="radiance"):
        shiny = visible_sample(wo, u.y, u.z, self.alpha)
        wi = ops.where(u.x < self.probability(wo.z), shiny, warp.square_to_cosine_hemisphere(u.y, u.z))
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class W4Glaze(go.BSDF):
    """A clear glaze over a matte body: the body is lit and seen along refracted directions."""

    fault: ClassVar[str] = "the body's light carries the cosine of the refracted direction"
    cause: ClassVar[str] = (
        "the body is evaluated with its own cosine factor, that of the refracted light direction inside the glaze, "
        "where eval needs the outer cosine, wi.z: the BRDF is the body's times cos_t / cos_i, which is not reciprocal "
        "and reflects more than arrives"
    )
    kd: go.Colour = go.spectrum(0.85, "albedo of the body", low=0.0, high=1.0)
    eta: go.Number = go.number(1.5, "refractive index of the glaze", low=1.05, high=2.5)
    alpha: go.Number = go.number(0.15, "width of the glaze's highlight", low=0.02, high=1.0)

    def inside(self, w):
        """The direction refracted into the glaze, mirrored to point up."""
        sin2 = frame.sin2(w) / ops.sqr(self.eta)
        return ops.vec3(w.x / self.eta, w.y / self.eta, ops.safe_sqrt(1.0 - sin2))

    def body(self, wo, wi):
        """Lambert's reflection of the body, times its cosine."""
        return self.kd * ops.where(above(wo, wi), wi.z * ops.inv_pi, 0.0)

    def eval(self, wo, wi, mode="radiance"):
        r0 = ops.sqr((self.eta - 1.0) / (self.eta + 1.0))
        m = frame.half_vector(wo, wi)
        highlight = schlick(ops.dot(wo, m), r0) * ggx(wo, wi, self.alpha)
        through = (1.0 - schlick(wo.z, r0)) * (1.0 - schlick(wi.z, r0))
        f = self.body(self.inside(wo), self.inside(wi)) * through + highlight
        return ops.where(above(wo, wi), f, 0.0)


class W4Stained(go.BSDF):
    """A stain on any material: everything that it scatters is tinted."""

    fault: ClassVar[str] = "eval ignores the mode"
    cause: ClassVar[str] = (
        "eval does not pass `mode` on to the base, so it is always that for radiance: in mode importance the "
        "transmitted light of rough glass keeps the factor (eta_o / eta_i)^2, unlike the weight of sample, which does "
        "pass it on"
    )
    base: go.BSDF = go.bsdf("the stained material", go.Dielectric(eta=1.5, alpha=0.3))
    stain: go.Colour = go.spectrum((0.9, 0.6, 0.3), "factor on everything", low=0.0, high=1.0)

    @property
    def transmits(self):
        return self.base.transmits

    @property
    def delta(self):
        return self.base.delta

    @property
    def two_sided(self):
        return self.base.two_sided

    def eval(self, wo, wi, mode="radiance"):
        return self.stain * self.base.eval(wo, wi)

    def pdf(self, wo, wi):
        return self.base.pdf(wo, wi)

    def sample(self, wo, u, mode="radiance"):
        s = self.base.sample(wo, u, mode)
        return go.Sample(s.wi, self.stain * s.weight, s.pdf, s.delta, s.eta)


class W4Blend(go.BSDF):
    """A patchwork of two materials that do not transmit and have no delta lobes."""

    fault: ClassVar[str] = "the random number that chose the material is passed on to it without rescaling"
    cause: ClassVar[str] = (
        "sample chooses b if u.x < weight and passes u unchanged: the inner material uses u.x again to choose its "
        "lobe, but sees only [0, weight) or [weight, 1), so its lobes are chosen with wrong probabilities and the "
        "density is not pdf; u.x must be remapped to [0, 1)"
    )
    a: go.BSDF = go.bsdf("the material at weight 0", go.Lambert(albedo=0.6))
    b: go.BSDF = go.bsdf("the material at weight 1", go.AshikhminShirley(diffuse=0.4, specular=0.5, exponent=30.0))
    weight: go.Number = go.number(0.4, "share of b", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.a.eval(wo, wi, mode) * (1.0 - self.weight) + self.b.eval(wo, wi, mode) * self.weight

    def pdf(self, wo, wi):
        return self.a.pdf(wo, wi) * (1.0 - self.weight) + self.b.pdf(wo, wi) * self.weight

    def sample(self, wo, u, mode="radiance"):
        wi = ops.where(u.x < self.weight, self.b.sample(wo, u, mode).wi, self.a.sample(wo, u, mode).wi)
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


# --------------------------------------------------------------------------- energy compensation

WIDTHS, COSINES = 16, 24


def _albedos():
    """E(alpha, mu) of GGX at F = 1, by visible normals; and its average, 2 int E mu dmu."""
    a, mu = np.linspace(0.05, 1.0, WIDTHS)[:, None, None], np.linspace(0.0, 1.0, COSINES)[None, :, None]
    mu = np.maximum(mu, 0.005)
    n = 32
    u1, u2 = (x.ravel()[None, None, :] for x in np.meshgrid((np.arange(n) + 0.5) / n, (np.arange(n) + 0.5) / n))
    sin = np.sqrt(1.0 - mu**2)
    length = np.sqrt(a**2 * sin**2 + mu**2)
    vx, vz = a * sin / length, mu / length
    z = (1.0 - u2) * (1.0 + vz) - vz
    r = np.sqrt(np.maximum(1.0 - z**2, 0.0))
    mx, my, mz = a * (r * np.cos(2.0 * np.pi * u1) + vx), a * r * np.sin(2.0 * np.pi * u1), z + vz
    size = np.sqrt(mx**2 + my**2 + mz**2)
    mx, mz = mx / size, mz / size
    cos = sin * mx + mu * mz
    iz = np.maximum(2.0 * cos * mz - mu, 1e-9)
    po = np.sqrt(mu**2 + a**2 * sin**2)
    pi = np.sqrt(iz**2 + a**2 * (1.0 - iz**2))
    ratio = iz * (mu + po) / (po * iz + pi * mu)  # G2 / G1(o)
    e = np.mean(np.where(2.0 * cos * mz - mu > 0.0, ratio, 0.0), axis=-1)
    grid = np.linspace(0.0, 1.0, COSINES)
    fine = (np.arange(400) + 0.5) / 400
    average = np.array([np.mean(2.0 * fine * np.interp(fine, grid, row)) for row in e])
    return ops.Table("W4 albedo", e[..., None]), ops.Table("W4 average", average[:, None])


ALBEDO, AVERAGE = _albedos()


class W4Compensated(go.BSDF):
    """GGX metal with the energy compensation of Kulla and Conty."""

    fault: ClassVar[str] = "the color of multiple scattering has E_avg where 1 - E_avg belongs, and adds energy"
    cause: ClassVar[str] = (
        "the denominator of the multiple-scattering color is 1 - F_avg E_avg instead of 1 - F_avg (1 - E_avg): the "
        "light that escapes is taken for the light that is scattered again, and the compensation returns several "
        "times the missing energy"
    )
    r0: go.Colour = go.spectrum((0.95, 0.85, 0.7), "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Number = go.number(0.6, "width", low=0.05, high=1.0)

    def albedo(self, w):
        """E at F = 1."""
        at = ops.inset((self.alpha - 0.05) / 0.95, WIDTHS)
        (e,) = ops.lookup(ALBEDO, at, ops.inset(w.z, COSINES))
        return e

    def average(self):
        """E_avg."""
        (e,) = ops.lookup(AVERAGE, ops.inset((self.alpha - 0.05) / 0.95, WIDTHS))
        return e

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        single = schlick(ops.dot(wo, m), self.r0) * ggx(wo, wi, self.alpha)
        e_avg = self.average()
        f_avg = self.r0 + (1.0 - self.r0) * (1.0 / 21.0)
        color = f_avg * f_avg * e_avg / (1.0 - f_avg * e_avg)
        missing = (1.0 - self.albedo(wo)) * (1.0 - self.albedo(wi)) * ops.inv_pi / (1.0 - e_avg)
        return ops.where(above(wo, wi), single + color * (missing * wi.z), 0.0)

    def pdf(self, wo, wi):
        both = 0.5 * visible_pdf(wo, wi, self.alpha) + 0.5 * wi.z * ops.inv_pi
        return ops.where(above(wo, wi), both, 0.0)

    def sample(self, wo, u, mode="radiance"):
        shiny = visible_sample(wo, u.y, u.z, self.alpha)
        wi = ops.where(u.x < 0.5, shiny, warp.square_to_cosine_hemisphere(u.y, u.z))
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


MUTANTS = [W4Enamel, W4Lacquer, W4Varnish, W4Glaze, W4Stained, W4Blend, W4Compensated]
SOUND = []
