"""Historic models in reciprocal form, layers, deltas, two sides, and numbers near the limits of 32 bits."""

import gonio as go
from gonio import ops
from gonio.optics import frame
from gonio.optics.special import exprel
from gonio.optics.warp import power_about, square_to_cosine_hemisphere, square_to_power_lobe, to_frame


def lit(wo, wi):
    """Whether both directions are above the surface."""
    return (wo.z > 0.0) & (wi.z > 0.0)


def drawn(material, wo, wi, mode):
    """The sample for a direction whose density is the material's pdf."""
    pdf = material.pdf(wo, wi)
    weight = material.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
    return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


def dielectric(cos, eta):
    """Fresnel's reflectance of a dielectric, eta > 1, for unpolarized light."""
    c = ops.clamp(cos, 0.0, 1.0)
    g = ops.sqrt(ops.sqr(eta) - 1.0 + ops.sqr(c))
    a = (g - c) / (g + c)
    b = (c * (g + c) - 1.0) / (c * (g - c) + 1.0)
    return 0.5 * ops.sqr(a) * (1.0 + ops.sqr(b))


def conductor(cos, eta, k):
    """Fresnel's reflectance of a conductor for unpolarized light."""
    c2 = ops.sqr(ops.clamp(cos, 0.0, 1.0))
    s2 = 1.0 - c2
    t0 = ops.sqr(eta) - ops.sqr(k) - s2
    both = ops.sqrt(ops.sqr(t0) + 4.0 * ops.sqr(eta * k))
    t1 = both + c2
    t2 = 2.0 * ops.clamp(cos, 0.0, 1.0) * ops.sqrt(ops.maximum(0.5 * (both + t0), 1e-9))
    t3 = c2 * both + ops.sqr(s2)
    t4 = t2 * s2
    rs = ops.maximum(t1 - t2, 0.0) / (t1 + t2)
    return 0.5 * rs * (1.0 + ops.maximum(t3 - t4, 0.0) / (t3 + t4))


class R1LommelSeeliger(go.BSDF):
    """Lommel and Seeliger's law of single scattering in dust, with Henyey and Greenstein's phase function."""

    w: go.Colour = go.spectrum((1.0, 0.8, 0.6), "albedo of a grain", low=0.0, high=1.0)
    g: go.Number = go.number(-0.4, "mean cosine of the scattering angle", low=-0.9, high=0.9)

    def eval(self, wo, wi, mode="radiance"):
        off = ops.maximum(1.0 + ops.sqr(self.g) + 2.0 * self.g * ops.dot(wo, wi), 1e-3)
        phase = 0.25 * ops.inv_pi * (1.0 - ops.sqr(self.g)) * ops.pow(off, -1.5)
        return self.w * ops.where(lit(wo, wi), phase * wi.z / ops.maximum(wo.z + wi.z, 1e-9), 0.0)


class R1Minnaert(go.BSDF):
    """Minnaert's law: f proportional to (cos_o cos_i)^(k - 1)."""

    kd: go.Colour = go.spectrum((0.8, 0.5, 0.9), "albedo at normal incidence", low=0.0, high=1.0)
    k: go.Number = go.number(2.5, "limb darkening", low=1.0, high=50.0)

    def eval(self, wo, wi, mode="radiance"):
        dark = ops.pow(wo.z, self.k - 1.0) * ops.pow(wi.z, self.k)
        return self.kd * ops.where(lit(wo, wi), (self.k + 1.0) * 0.5 * ops.inv_pi * dark, 0.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), (self.k + 1.0) * 0.5 * ops.inv_pi * ops.pow(wi.z, self.k), 0.0)

    def sample(self, wo, u, mode="radiance"):
        return drawn(self, wo, square_to_power_lobe(ops.minimum(u.y, 0.9999999), u.z, self.k), mode)


class R1ReciprocalPhong(go.BSDF):
    """Phong's lobe without the cosine in its denominator (Lafortune and Willems 1994), from flat to sharp."""

    ks: go.Colour = go.spectrum((1.0, 0.6, 0.8), "reflectance at normal incidence", low=0.0, high=1.0)
    n: go.Number = go.number(25.0, "exponent", low=0.0, high=2e4)

    def eval(self, wo, wi, mode="radiance"):
        lobe = (self.n + 2.0) * 0.5 * ops.inv_pi * power_about(frame.mirror(wo), wi, self.n)
        return self.ks * ops.where(lit(wo, wi), lobe * wi.z, 0.0)

    def pdf(self, wo, wi):
        lobe = (self.n + 1.0) * 0.5 * ops.inv_pi * power_about(frame.mirror(wo), wi, self.n)
        return ops.where(lit(wo, wi), lobe, 0.0)

    def sample(self, wo, u, mode="radiance"):
        local = square_to_power_lobe(ops.minimum(u.y, 0.9999999), u.z, self.n)
        return drawn(self, wo, to_frame(frame.mirror(wo), local), mode)


class R1WardNeumann(go.BSDF):
    """Ward's anisotropic Gaussian with Neumann's denominator max(cos_o, cos_i)."""

    ks: go.Colour = go.spectrum((0.3, 0.6, 1.0), "reflectance", low=0.0, high=1.0)
    alpha: go.Width = go.width((0.05, 0.5), "widths of the lobe", low=0.01, high=1.0)
    rotation: go.Angle = go.angle(2.2, "of the lobe")

    @property
    def isotropic(self):
        return False

    def eval(self, wo, wi, mode="radiance"):
        total = wo + wi
        cos = 0.5 * ops.sqrt(ops.maximum(ops.dot(total, total), 1e-10))  # of wo and the half vector
        m = frame.rotate(frame.half_vector(wo, wi), self.rotation)
        z2 = ops.maximum(ops.sqr(m.z), 1e-3)
        slope2 = (ops.sqr(m.x / self.alpha.x) + ops.sqr(m.y / self.alpha.y)) / z2
        density = ops.exp(-slope2) / (ops.pi * self.alpha.x * self.alpha.y * ops.sqr(z2))
        highest = ops.maximum(ops.maximum(wo.z, wi.z), 1e-9)
        q = density * ops.maximum(m.z, 0.0) / (4.0 * cos)
        # below m_z^2 = 1e-3 the Gaussian of the widest lobe is gone too, but its limit is not its density
        return self.ks * ops.where(lit(wo, wi) & (m.z > 0.0317), q * ops.maximum(wi.z, 0.0) / highest, 0.0)


class R1ConeGrooves(go.BSDF):
    """Metal V-grooves (Torrance and Sparrow) whose normals fill a cone evenly, up to a sharp edge."""

    eta: go.Colour = go.spectrum((0.2, 0.9, 1.4), "refractive index", low=0.05, high=6.0)
    k: go.Colour = go.spectrum((3.9, 2.4, 1.7), "extinction", low=0.1, high=10.0)
    opening: go.Number = go.number(0.06, "squared sine of the cone's half angle", low=0.002, high=0.9)

    def eval(self, wo, wi, mode="radiance"):
        total = wo + wi
        cos = 0.5 * ops.sqrt(ops.maximum(ops.dot(total, total), 1e-10))
        m = frame.half_vector(wo, wi)
        density = ops.where((frame.sin2(m) < self.opening) & (m.z > 0.0), ops.inv_pi / self.opening, 0.0)
        lower, higher = ops.minimum(wo.z, wi.z), ops.maximum(wo.z, wi.z)
        # G / (4 cos_o cos_i) = min(1, 2 m_z lower / cos) / (4 lower higher)
        open_ = ops.minimum(1.0 / ops.maximum(lower, 1e-9), 2.0 * m.z / cos) / (4.0 * ops.maximum(higher, 1e-9))
        f = conductor(cos, self.eta, self.k) * (density * open_)
        return ops.where(lit(wo, wi), f * ops.maximum(wi.z, 0.0), 0.0)


class R1FresnelCoat(go.BSDF):
    """A glossy coat with Fresnel's reflectance s toward both directions, over a matte base with (1 - s)."""

    kd: go.Colour = go.spectrum((0.05, 0.6, 0.9), "albedo of the base", low=0.0, high=1.0)
    eta: go.Number = go.number(1.5, "refractive index of the coat", low=1.01, high=3.0)
    kappa: go.Number = go.number(500.0, "concentration of the coat's lobe", low=0.5, high=3e4)

    def lobe(self, wo, wi):
        off = wi - frame.mirror(wo)
        return ops.exp(-0.5 * self.kappa * ops.dot(off, off)) / (4.0 * ops.pi * exprel(-2.0 * self.kappa))

    def eval(self, wo, wi, mode="radiance"):
        so, si = dielectric(wo.z, self.eta), dielectric(wi.z, self.eta)
        coat = so * si * self.lobe(wo, wi) / ops.maximum(ops.maximum(wo.z, wi.z), 1e-9)
        base = self.kd * (ops.inv_pi * (1.0 - so) * (1.0 - si))
        return ops.where(lit(wo, wi), (base + coat) * ops.maximum(wi.z, 0.0), 0.0)

    def share(self, wo):
        s = dielectric(wo.z, self.eta)
        return s / (s + (1.0 - s) * ops.mean(self.kd))

    def pdf(self, wo, wi):
        share = self.share(wo)
        return ops.where(lit(wo, wi), share * self.lobe(wo, wi) + (1.0 - share) * wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        inside = ops.maximum(1.0 - u.y * (2.0 * self.kappa * exprel(-2.0 * self.kappa)), 5e-8)
        v = ops.clamp(-ops.log(inside) / self.kappa, 0.0, 2.0)
        sin = ops.safe_sqrt(v * (2.0 - v))
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        glossy = to_frame(frame.mirror(wo), ops.vec3(sin * c, sin * s, 1.0 - v))
        wi = ops.where(u.x < self.share(wo), glossy, square_to_cosine_hemisphere(u.y, u.z))
        return drawn(self, wo, wi, mode)


class R1BeerVarnish(go.BSDF):
    """A matte base below a colored varnish, which light crosses twice at its own slant."""

    kd: go.Colour = go.spectrum(1.0, "albedo of the base", low=0.0, high=1.0)
    depth: go.Colour = go.spectrum((0.01, 0.3, 4.0), "optical depth of the varnish", low=0.0, high=80.0)

    def eval(self, wo, wi, mode="radiance"):
        path = 1.0 / ops.maximum(wo.z, 1e-3) + 1.0 / ops.maximum(wi.z, 1e-3)
        return self.kd * ops.exp(-self.depth * path) * ops.where(lit(wo, wi), wi.z * ops.inv_pi, 0.0)


class R1DeepDust(go.BSDF):
    """A deep layer of dust with multiple scattering: w / 4 pi H(cos_o) H(cos_i) / (cos_o + cos_i), H in two streams."""

    w: go.Colour = go.spectrum((0.999, 0.9, 0.5), "albedo of a grain", low=0.0, high=1.0)

    def H(self, z):
        slope = 1.7320508 * ops.clamp(z, 0.0, 1.0)
        return (1.0 + slope) / (1.0 + slope * ops.sqrt(ops.maximum(1.0 - self.w, 1e-9)))

    def eval(self, wo, wi, mode="radiance"):
        spread = 0.25 * ops.inv_pi * wi.z / ops.maximum(wo.z + wi.z, 1e-9)
        return self.w * self.H(wo.z) * self.H(wi.z) * ops.where(lit(wo, wi), spread, 0.0)


class R1TinyNumbers(go.BSDF):
    """Values of about 1e-31, which are close to the smallest numbers of 32 bits but are not 0."""

    kd: go.Colour = go.spectrum((3e-31, 1e-33, 0.0), "albedo", low=0.0, high=1e-30)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where(lit(wo, wi), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        return drawn(self, wo, square_to_cosine_hemisphere(u.y, u.z), mode)


class R1WideScale(go.BSDF):
    """Lambert's reflection that decays with the distance from the mirrored direction on any scale at all."""

    kd: go.Colour = go.spectrum((1.0, 0.5, 0.25), "albedo without decay", low=0.0, high=1.0)
    scale: go.Number = go.number(40.0, "decay: 1 / (1 + scale d^2)", low=1e-30, high=1e30)

    def eval(self, wo, wi, mode="radiance"):
        d2 = ops.sqr(wo.x + wi.x) + ops.sqr(wo.y + wi.y)
        return self.kd * ops.where(lit(wo, wi), wi.z * ops.inv_pi / (1.0 + self.scale * d2), 0.0)


class R1RetroMirrorMix(go.BSDF):
    """Perfect retroreflectors, a delta lobe, on part of a matte surface."""

    ks: go.Colour = go.spectrum((1.0, 0.9, 0.1), "reflectance of the retroreflectors", low=0.0, high=1.0)
    kd: go.Colour = go.spectrum((0.1, 0.2, 0.7), "albedo of the matte part", low=0.0, high=1.0)
    share: go.Number = go.number(0.4, "part of the surface that the retroreflectors cover", low=0.0, high=1.0)

    @property
    def delta(self):
        return "maybe"

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where(lit(wo, wi), (1.0 - self.share) * wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), (1.0 - self.share) * wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        above = wo.z > 0.0
        delta = (u.x < self.share) & above
        wi = ops.where(delta, wo, square_to_cosine_hemisphere(u.y, u.z))
        smooth = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, smooth)
        pdf = ops.where(delta, self.share, smooth)
        return go.Sample(wi, ops.where(delta, self.ks, weight), pdf, delta, 1.0 + 0.0 * pdf)


class R1TwoSidedToon(go.BSDF):
    """Paper in three tones, the same from both sides."""

    kd: go.Colour = go.spectrum((0.95, 0.9, 0.7), "albedo of the light tone", low=0.0, high=1.0)
    edge: go.Number = go.number(0.36, "product of the cosines at which the tone changes", low=0.05, high=0.9)

    @property
    def two_sided(self):
        return True

    def eval(self, wo, wi, mode="radiance"):
        product = wo.z * wi.z
        tone = ops.where(product > self.edge, 1.0, ops.where(product > 0.5 * self.edge, 0.55, 0.2))
        return self.kd * ops.where(product > 0.0, tone * ops.abs(wi.z) * ops.inv_pi, 0.0)


class R1FrontAndBack(go.BSDF):
    """Orange cloth with a blue lining, which is seen from below."""

    front: go.Colour = go.spectrum((1.0, 0.45, 0.0), "albedo from above", low=0.0, high=1.0)
    back: go.Colour = go.spectrum((0.0, 0.1, 1.0), "albedo from below", low=0.0, high=1.0)

    @property
    def back_differs(self):
        return True

    def eval(self, wo, wi, mode="radiance"):
        above, below = lit(wo, wi), (wo.z < 0.0) & (wi.z < 0.0)
        cos = ops.abs(wi.z) * ops.inv_pi
        return self.front * ops.where(above, cos, 0.0) + self.back * ops.where(below, cos, 0.0)

    def pdf(self, wo, wi):
        above, below = lit(wo, wi), (wo.z < 0.0) & (wi.z < 0.0)
        return ops.where(above | below, ops.abs(wi.z) * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        return self.sample_cosine(wo, u, mode)


class R1SlantFilter(go.BSDF):
    """A filter of dyed glass fibers over any material: it passes more light the steeper the light is."""

    base: go.BSDF = go.bsdf("the material below", go.Lambert(0.8))
    dye: go.Colour = go.spectrum((0.1, 0.9, 0.5), "share that passes at grazing incidence", low=0.0, high=1.0)

    def passed(self, w):
        z = ops.minimum(ops.abs(w.z), 1.0)
        return self.dye + (1.0 - self.dye) * ops.sqr(z)

    def eval(self, wo, wi, mode="radiance"):
        return self.base.eval(wo, wi, mode) * self.passed(wo) * self.passed(wi)

    def pdf(self, wo, wi):
        return self.base.pdf(wo, wi)

    def sample(self, wo, u, mode="radiance"):
        s = self.base.sample(wo, u, mode)
        return go.Sample(s.wi, s.weight * self.passed(wo) * self.passed(s.wi), s.pdf, s.delta, s.eta)

    @property
    def isotropic(self):
        return self.base.isotropic

    @property
    def transmits(self):
        return self.base.transmits

    @property
    def delta(self):
        return self.base.delta

    @property
    def two_sided(self):
        return self.base.two_sided


SOUND = [
    R1LommelSeeliger, R1Minnaert, R1ReciprocalPhong, R1WardNeumann, R1ConeGrooves, R1FresnelCoat, R1BeerVarnish,
    R1DeepDust, R1TinyNumbers, R1WideScale, R1RetroMirrorMix, R1TwoSidedToon, R1FrontAndBack, R1SlantFilter,
]  # fmt: skip
