"""Unusual materials that are right."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.energy.albedo import walk
from gonio.optics import frame, warp
from gonio.optics.ndf import distribution

GGX = distribution("ggx")
BELOW_ONE = 0.99999994


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


def on_sphere(u1, u2):
    """A direction of the whole sphere, uniformly."""
    z = 1.0 - 2.0 * u1
    r = 2.0 * ops.safe_sqrt(u1 * (1.0 - u1))
    s, c = ops.sincos(2.0 * ops.pi * u2)
    return ops.vec3(r * c, r * s, z)


def on_hemisphere(u1, u2):
    """A direction of the upper hemisphere, uniformly."""
    z = 1.0 - u1
    r = ops.safe_sqrt(u1 * (1.0 + z))
    s, c = ops.sincos(2.0 * ops.pi * u2)
    return ops.vec3(r * c, r * s, z)


class Black(go.BSDF):
    """Nothing comes back."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    why: ClassVar[str] = "0 everywhere is a BRDF; it has no parameter at all, weights are 0 and densities the cosine's"

    def eval(self, wo, wi):
        zero = 0.0 * wi.z
        return ops.vec3(zero, zero, zero)


class ConstantUniform(go.BSDF):
    """The constant BRDF, sampled uniformly over the hemisphere."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    why: ClassVar[str] = "Lambert with a poor but exact sampling: pdf 1/(2 pi), weights 2 kd cos"
    kd: go.Colour = go.spectrum((0.9, 0.5, 0.0), "share of light that is reflected", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where(lit(wo, wi), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), 0.5 * ops.inv_pi + 0.0 * wi.z, 0.0)

    def sample(self, wo, u, mode="radiance"):
        return drawn(self, wo, on_hemisphere(u.y, u.z), mode)


class RetroSmooth(go.BSDF):
    """A broad lobe back to the light."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    why: ClassVar[str] = (
        "(p + 1)/(2 pi) (o.i)^p is symmetric, its albedo below 1; the lobe's lower part is a failed sample"
    )
    ks: go.Colour = go.spectrum((0.9, 0.9, 0.4), "share of light that goes back, at most", low=0.0, high=1.0)
    p: go.Number = go.number(6.0, "exponent", low=1.0, high=200.0)

    def lobe(self, wo, wi):
        return (self.p + 1.0) * (0.5 * ops.inv_pi) * ops.pow(ops.dot(wo, wi), self.p)

    def eval(self, wo, wi, mode="radiance"):
        return self.ks * ops.where(lit(wo, wi), self.lobe(wo, wi) * wi.z, 0.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), self.lobe(wo, wi), 0.0)

    def sample(self, wo, u, mode="radiance"):
        return drawn(self, wo, around(wo, warp.square_to_power_lobe(u.y, u.z, self.p)), mode)


class RetroNarrow(go.BSDF):
    """Glass beads: a lobe of von Mises and Fisher back to the light, two degrees wide."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    why: ClassVar[str] = "exp(-kappa |o - i|^2 / 2) kappa / (2 pi (1 - e^(-2 kappa))) keeps its digits; albedo below 1"
    ks: go.Colour = go.spectrum(0.95, "share of light that goes back, at most", low=0.0, high=1.0)
    kappa: go.Number = go.number(1500.0, "concentration", low=2.0, high=1e4)

    def lobe(self, wo, wi):
        d = wo - wi
        norm = self.kappa / (2.0 * ops.pi * (1.0 - ops.exp(-2.0 * self.kappa)))
        return norm * ops.exp(-0.5 * self.kappa * ops.dot(d, d))

    def eval(self, wo, wi, mode="radiance"):
        return self.ks * ops.where(lit(wo, wi), self.lobe(wo, wi) * wi.z, 0.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), self.lobe(wo, wi), 0.0)

    def sample(self, wo, u, mode="radiance"):
        rest = u.y * (1.0 - ops.exp(-2.0 * self.kappa))
        t = ops.minimum(-ops.log(1.0 - rest) / self.kappa, 2.0)  # 1 - cos
        r = ops.safe_sqrt(t * (2.0 - t))
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        return drawn(self, wo, ops.normalize(around(wo, ops.vec3(r * c, r * s, 1.0 - t))), mode)


class Checker(go.BSDF):
    """A checker in the space of directions: bright where both lie in fields of one colour."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "anisotropic"
    why: ClassVar[str] = "discontinuous, but symmetric in both directions and at most Lambert's; declared anisotropic"
    kd: go.Colour = go.spectrum((0.8, 0.6, 0.4), "share of light that a like field reflects", low=0.0, high=1.0)

    @property
    def isotropic(self):
        return False

    def colour(self, w):
        n = ops.floor(3.0 * w.x + 9.0) + ops.floor(3.0 * w.y + 9.0)
        return n - 2.0 * ops.floor(0.5 * n + 0.25)

    def eval(self, wo, wi):
        alike = ops.abs(self.colour(wo) - self.colour(wi)) < 0.5
        return self.kd * ops.where(lit(wo, wi), ops.where(alike, 1.0, 0.15) * wi.z * ops.inv_pi, 0.0)


class Ledge(go.BSDF):
    """Matte within 50 degrees of the normal, black beyond: a hard edge."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    why: ClassVar[str] = "a step at one angle, the same for both directions; many samples have weight 0 but pdf > 0"
    kd: go.Colour = go.spectrum((0.3, 0.9, 0.6), "share of light that is reflected", low=0.0, high=1.0)

    def eval(self, wo, wi):
        return self.kd * ops.where((wo.z > 0.643) & (wi.z > 0.643), wi.z * ops.inv_pi, 0.0)


class VeryRough(go.Conductor):
    """A metal of width 1, which loses more than half."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    why: ClassVar[str] = "Gonio's own conductor at the end of its range, all normals sampled: half of the samples fail"
    alpha: go.Width = go.width(1.0, "width of the microfacet distribution")
    sampling: str = go.choice("normals", "which normals are sampled", {"normals": "all", "visible": "visible ones"})


class VeryNarrow(go.Conductor):
    """A polished metal, a twentieth of a degree wide."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    why: ClassVar[str] = "Gonio's own conductor just above the width at which it is a mirror"
    alpha: go.Width = go.width(0.0006, "width of the microfacet distribution", low=0.0002)


class Absorbing(go.Conductor):
    """Black brushed metal that turns: nearly all is absorbed."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "anisotropic"
    why: ClassVar[str] = "Gonio's own conductor, 1 % of it, of widths 1 : 40 and turned"
    alpha: go.Width = go.width((0.02, 0.8), "widths of the microfacet distribution")
    rotation: go.Angle = go.angle(1.1, "turn of the widths")
    albedo: go.Colour = go.spectrum((0.01, 0.003, 0.0), "factor on everything reflected", low=0.0, high=1.0)


class OneSided(go.BSDF):
    """A sheet that is painted above and black below."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    why: ClassVar[str] = "from below nothing; sample draws on the upper side for a viewer below too, and says it failed"
    kd: go.Colour = go.spectrum(0.7, "share of light that is reflected", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where(lit(wo, wi), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        return drawn(self, wo, warp.square_to_cosine_hemisphere(u.y, u.z), mode)


class TwoSidedSheet(go.BSDF):
    """Card: matte with a broad shine, from below as from above; nothing passes."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    why: ClassVar[str] = (
        "answers below the surface too and declares two_sided; light does not pass, so transmits is False"
    )
    kd: go.Colour = go.spectrum((0.5, 0.5, 0.3), "share of light that is reflected", low=0.0, high=1.0)

    def eval(self, wo, wi):
        grazing = 0.5 + 0.5 * ops.abs(wo.z * wi.z)
        return self.kd * ops.where(wo.z * wi.z > 0.0, grazing * ops.abs(wi.z) * ops.inv_pi, 0.0)

    @property
    def two_sided(self):
        return True


class PaperSheet(go.BSDF):
    """Thin paper: half comes back, a third goes through, diffusely."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "transmitting"
    why: ClassVar[str] = "transmits without refraction: eta is 1, so mode makes no difference; 1/6 is absorbed"
    kd: go.Colour = go.spectrum((0.9, 0.8, 0.6), "what the fibres leave of the light", low=0.0, high=1.0)
    through: go.Number = go.number(0.4, "share of what leaves that goes through", low=0.0, high=1.0)

    @property
    def transmits(self):
        return True

    def side(self, wo, wi):
        same, other = wo.z * wi.z > 0.0, wo.z * wi.z < 0.0
        return ops.where(same, 1.0 - self.through, ops.where(other, self.through, 0.0)) * ops.abs(wi.z) * ops.inv_pi

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * self.side(wo, wi)

    def pdf(self, wo, wi):
        return self.side(wo, wi)

    def sample(self, wo, u, mode="radiance"):
        w = warp.square_to_cosine_hemisphere(u.y, u.z)
        z = ops.copysign(w.z, wo.z)
        return drawn(self, wo, ops.vec3(w.x, w.y, ops.where(u.x < self.through, -z, z)), mode)


class Speckle(go.BSDF):
    """A matte surface whose value is random: kd / pi times a number of mean 1 between 0 and 2."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    why: ClassVar[str] = (
        "stochastic is declared; the random factor is independent with mean 1, pdf and sampling are exact"
    )
    stochastic: ClassVar[bool] = True
    kd: go.Colour = go.spectrum(0.5, "share of light that is reflected", low=0.0, high=1.0)
    seed: go.Number = go.number(0.0, "shifts the random numbers")

    def eval(self, wo, wi, mode="radiance"):
        rng = walk.generator(wo, wi, self.seed)
        factor = 2.0 * type(wo.z)(rng.next_float32())
        return self.kd * ops.where(lit(wo, wi), factor * wi.z * ops.inv_pi, 0.0)


class ThreeLobes(go.BSDF):
    """Matte, a highlight and a shine back to the light, one of them often nearly black."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    why: ClassVar[str] = "three lobes by one number; pdf is that of all three; shares never are 0/0"
    kd: go.Colour = go.spectrum((0.4, 0.0, 0.1), "share of light in the matte part", low=0.0, high=0.4)
    ks: go.Colour = go.spectrum((0.0, 0.3, 0.1), "share of light in the highlight", low=0.0, high=0.3)
    kr: go.Colour = go.spectrum((0.02, 0.0, 0.3), "share of light back", low=0.0, high=0.3)
    p: go.Number = go.number(40.0, "exponent of both lobes", low=1.0, high=300.0)

    def lobe(self, cos):
        return (self.p + 1.0) * (0.5 * ops.inv_pi) * ops.pow(cos, self.p)

    def shares(self):
        d, s, r = (0.01 + ops.mean(k) for k in (self.kd, self.ks, self.kr))
        return d / (d + s + r), s / (d + s + r)

    def eval(self, wo, wi, mode="radiance"):
        f = self.kd * ops.inv_pi + self.ks * self.lobe(ops.dot(frame.mirror(wo), wi))
        f = f + self.kr * self.lobe(ops.dot(wo, wi))
        return ops.where(lit(wo, wi), f * wi.z, 0.0)

    def pdf(self, wo, wi):
        d, s = self.shares()
        back = (1.0 - d - s) * self.lobe(ops.dot(wo, wi))
        density = d * wi.z * ops.inv_pi + s * self.lobe(ops.dot(frame.mirror(wo), wi)) + back
        return ops.where(lit(wo, wi), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        d, s = self.shares()
        lobe = warp.square_to_power_lobe(u.y, u.z, self.p)
        axis = ops.where(u.x < d + s, frame.mirror(wo), wo)
        wi = ops.where(u.x < d, warp.square_to_cosine_hemisphere(u.y, u.z), around(axis, lobe))
        return drawn(self, wo, wi, mode)


class StretchedNumber(ThreeLobes):
    """The same three lobes; one number picks the lobe and, stretched, gives the direction's first coordinate."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    why: ClassVar[str] = "u1 is stretched to [0, 1) within its lobe before it serves again"

    def sample(self, wo, u, mode="radiance"):
        d, s = self.shares()
        matte, high = u.x < d, u.x < d + s
        low = ops.where(matte, 0.0, ops.where(high, d, d + s))
        width = ops.where(matte, d, ops.where(high, s, 1.0 - d - s))
        u1 = ops.clamp((u.x - low) / width, 0.0, BELOW_ONE)
        lobe = warp.square_to_power_lobe(u1, u.y, self.p)
        axis = ops.where(high, frame.mirror(wo), wo)
        wi = ops.where(matte, warp.square_to_cosine_hemisphere(u1, u.y), around(axis, lobe))
        return drawn(self, wo, wi, mode)


class BadSampling(go.BSDF):
    """A matte surface, sampled mostly near the normal."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    why: ClassVar[str] = "nine tenths of the samples fall in a narrow cone: weights up to 20, but unbiased"
    kd: go.Colour = go.spectrum(0.8, "share of light that is reflected", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where(lit(wo, wi), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        cone = 31.0 * (0.5 * ops.inv_pi) * ops.pow(wi.z, 30.0)
        return ops.where(lit(wo, wi), 0.9 * cone + 0.1 * (0.5 * ops.inv_pi), 0.0)

    def sample(self, wo, u, mode="radiance"):
        wi = ops.where(u.x < 0.9, warp.square_to_power_lobe(u.y, u.z, 30.0 + 0.0 * u.y), on_hemisphere(u.y, u.z))
        return drawn(self, wo, wi, mode)


class HalfFail(go.BSDF):
    """A matte surface, sampled over the whole sphere."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    why: ClassVar[str] = "half of all samples are below the surface: weight = pdf = 0, and pdf integrates to 1/2"
    kd: go.Colour = go.spectrum((0.8, 0.3, 0.3), "share of light that is reflected", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where(lit(wo, wi), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), 0.25 * ops.inv_pi + 0.0 * wi.z, 0.0)

    def sample(self, wo, u, mode="radiance"):
        return drawn(self, wo, on_sphere(u.y, u.z), mode)


class Rejection(go.BSDF):
    """A matte surface; the disk below the hemisphere is found in a square by at most two tries."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    why: ClassVar[str] = (
        "pdf is the cosine's times the chance 1 - (1 - pi/4)^2 that a try succeeds; else a failed sample"
    )
    kd: go.Colour = go.spectrum((0.8, 0.8, 0.1), "share of light that is reflected", low=0.0, high=1.0)
    hits: ClassVar[float] = 1.0 - (1.0 - ops.pi / 4.0) ** 2

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where(lit(wo, wi), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), self.hits * wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        x, y = 2.0 * u.y - 1.0, 2.0 * u.z - 1.0
        again = x * x + y * y >= 1.0
        coarse = ops.floor(4096.0 * u.x)  # the unused number has digits for two coordinates
        x = ops.where(again, 2.0 * (coarse + 0.5) / 4096.0 - 1.0, x)
        y = ops.where(again, 2.0 * (4096.0 * u.x - coarse) - 1.0, y)
        r2 = x * x + y * y
        z = ops.safe_sqrt(1.0 - r2)
        hit = r2 < 1.0
        wi = ops.vec3(ops.where(hit, x, 0.0), ops.where(hit, y, 0.0), ops.where(hit, z, -1.0))
        return drawn(self, wo, wi, mode)


class Moon(go.BSDF):
    """The law of Lommel and Seeliger: the bright rim of the full moon."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    why: ClassVar[str] = (
        "w / (4 pi (cos_o + cos_i)): f grows without bound at grazing, eval and albedo (< w / 2) do not"
    )
    w: go.Colour = go.spectrum((0.9, 0.85, 0.8), "single scattering albedo", low=0.0, high=1.0)

    def eval(self, wo, wi):
        both = ops.where(lit(wo, wi), ops.maximum(wo.z + wi.z, 1e-20), 1.0)
        return self.w * ops.where(lit(wo, wi), wi.z / (4.0 * ops.pi * both), 0.0)


class Minnaert(go.BSDF):
    """Minnaert's law, normalized where the viewer is upright."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "smooth"
    why: ClassVar[str] = "(cos_o cos_i)^(k - 1) with k >= 1 is symmetric and its albedo kd cos_o^(k - 1) is below 1"
    kd: go.Colour = go.spectrum((0.9, 0.4, 0.2), "share of light that is reflected upright", low=0.0, high=1.0)
    k: go.Number = go.number(2.5, "limb darkening", low=1.0, high=6.0)

    def eval(self, wo, wi):
        both = ops.where(lit(wo, wi), wo.z * wi.z, 1.0)
        value = (self.k + 1.0) * (0.5 * ops.inv_pi) * ops.pow(both, self.k - 1.0) * wi.z
        return self.kd * ops.where(lit(wo, wi), value, 0.0)


class ExponentAxes(go.BSDF):
    """Ashikhmin's and Shirley's highlight of two exponents, with its sampling."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "anisotropic"
    why: ClassVar[str] = (
        "its axes come from two numbers, and isotropic says whether they differ; one channel reflects 0"
    )
    ks: go.Colour = go.spectrum((0.9, 0.0, 0.4), "reflectance", low=0.0, high=1.0)
    nu: go.Number = go.number(8.0, "exponent along x", low=0.0, high=500.0)
    nv: go.Number = go.number(90.0, "exponent along y", low=0.0, high=500.0)

    @property
    def isotropic(self):
        import numpy as np

        return bool(np.all(np.asarray(self.plain.nu) == np.asarray(self.plain.nv)))

    def lobe(self, m):
        """Density of normals: sqrt((nu + 1) (nv + 1)) / (2 pi) m.z^n, n the exponent along m's azimuth."""
        sin2 = frame.sin2(m)
        n = ops.where(sin2 > 1e-12, (self.nu * ops.sqr(m.x) + self.nv * ops.sqr(m.y)) / ops.maximum(sin2, 1e-12), 0.0)
        return ops.sqrt((self.nu + 1.0) * (self.nv + 1.0)) * (0.5 * ops.inv_pi) * ops.pow(m.z, n)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        om = ops.where(lit(wo, wi), ops.maximum(ops.dot(wo, m), 1e-5), 1.0)
        top = ops.where(lit(wo, wi), ops.maximum(wo.z, wi.z), 1.0)
        return self.ks * ops.where(lit(wo, wi), self.lobe(m) * wi.z / (4.0 * om * top), 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        return ops.where(lit(wo, wi), self.lobe(m) / (4.0 * ops.maximum(ops.dot(wo, m), 1e-5)), 0.0)

    def sample(self, wo, u, mode="radiance"):
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        a = ops.normalize(ops.vec2(c * ops.rsqrt(self.nu + 1.0), s * ops.rsqrt(self.nv + 1.0)))
        n = self.nu * ops.sqr(a.x) + self.nv * ops.sqr(a.y)
        z = ops.pow(1.0 - u.y, 1.0 / (n + 1.0))
        r = ops.safe_sqrt((1.0 - z) * (1.0 + z))
        return drawn(self, wo, frame.reflect(wo, ops.vec3(r * a.x, r * a.y, z)), mode)


class MirrorUnderVelvet(go.Mix):
    """A mirror and a matte surface, patched."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "delta"
    why: ClassVar[str] = "Gonio's own mix of a delta lobe and a finite one: delta is maybe"
    a: go.BSDF = go.bsdf("the material at weight 0", go.Mirror(albedo=(0.9, 0.0, 0.5)))
    b: go.BSDF = go.bsdf("the material at weight 1", go.Lambert(albedo=(0.1, 0.9, 0.3)))


class NearlyWhite(go.KullaConty):
    """A rough compensated metal that reflects all light in one channel and none in another."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "compensated"
    why: ClassVar[str] = "Gonio's own compensation of its own conductor at alpha = 1, with a zero channel"
    base: go.BSDF = go.bsdf(
        "the material to be compensated", go.Conductor(alpha=1.0, fresnel="one", albedo=(1.0, 0.5, 0.0))
    )


MUTANTS = []
SOUND = [
    Black, ConstantUniform, RetroSmooth, RetroNarrow, Checker, Ledge, VeryRough, VeryNarrow, Absorbing, OneSided,
    TwoSidedSheet, PaperSheet, Speckle, ThreeLobes, StretchedNumber, BadSampling, HalfFail, Rejection, Moon, Minnaert,
    ExponentAxes, MirrorUnderVelvet, NearlyWhite,
]  # fmt: skip
