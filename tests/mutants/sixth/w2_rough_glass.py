"""Rough glass (Walter2007): seven interfaces with GGX or Beckmann normals."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.optics import frame, fresnel
from gonio.optics.fresnel import exact
from gonio.optics.ndf import distribution

GGX = distribution("ggx")


def flip_toward(wo, w):
    """-w if wo lies below the surface."""
    return ops.where(wo.z < 0.0, -w, w)


class _W2Rough(go.BSDF):
    """A rough interface with separable Smith masking; visible normals are sampled."""

    eta: go.Number = go.number(1.5, "index inside over index outside", low=1.05, high=3.0)
    alpha: go.Width = go.width(0.3, "width of the distribution of normals", low=0.05)
    tint: go.Colour = go.spectrum(1.0, "factor on everything scattered", low=0.0, high=1.0)

    def relative(self, wo):
        return ops.where(wo.z >= 0.0, self.eta, 1.0 / self.eta)

    def normal(self, wo, wi, eta):
        h = wo + wi * ops.where(wo.z * wi.z > 0.0, 1.0, eta)
        h = h * ops.rsqrt(ops.maximum(ops.dot(h, h), 1e-20))
        return ops.where(h.z < 0.0, -h, h)

    def lit(self, wo, wi, m):
        return (ops.dot(wo, m) * wo.z > 0.0) & (ops.dot(wi, m) * wi.z > 0.0)

    def reflectance(self, cos, eta):
        return exact.dielectric(cos, fresnel.cos_transmitted(cos, eta), eta)

    def spread(self, wo, wi, m, eta):
        """1 / (o.m + eta i.m)^2"""
        return 1.0 / ops.maximum(ops.sqr(ops.dot(wo, m) + eta * ops.dot(wi, m)), 1e-6)

    def squeeze(self, eta, mode):
        return ops.sqr(eta) if mode == "importance" else 1.0

    def masking(self, wo, wi):
        return GGX.G1(wo, self.alpha) * GGX.G1(wi, self.alpha)

    def eval(self, wo, wi, mode="radiance"):
        eta = self.relative(wo)
        m = self.normal(wo, wi, eta)
        o, i = ops.abs(ops.dot(wo, m)), ops.abs(ops.dot(wi, m))
        f = self.reflectance(o, eta)
        reflected = 0.25 * f
        transmitted = (1.0 - f) * o * i * self.spread(wo, wi, m, eta) * self.squeeze(eta, mode)
        lobe = ops.where(wo.z * wi.z > 0.0, reflected, transmitted)
        facets = GGX.D(m, self.alpha) * self.masking(wo, wi) / ops.maximum(ops.abs(wo.z), 1e-6)
        return self.tint * ops.where(self.lit(wo, wi, m), lobe * facets, 0.0)

    def pdf(self, wo, wi):
        eta = self.relative(wo)
        m = self.normal(wo, wi, eta)
        o, i = ops.abs(ops.dot(wo, m)), ops.abs(ops.dot(wi, m))
        f = self.reflectance(o, eta)
        normals = o * GGX.visible_per_cosine(wo, m, self.alpha)
        reflected = f * normals * ops.safe_div(0.25, o)
        transmitted = (1.0 - f) * normals * self.jacobian(wo, wi, m, eta)
        lobe = ops.where(wo.z * wi.z > 0.0, reflected, transmitted)
        return ops.where(self.lit(wo, wi, m), lobe, 0.0)

    def jacobian(self, wo, wi, m, eta):
        return ops.sqr(eta) * ops.abs(ops.dot(wi, m)) * self.spread(wo, wi, m, eta)

    def draw(self, wo, u):
        return GGX.sample_visible(flip_toward(wo, wo), u.y, u.z, self.alpha)

    def choice(self, cos, wo, eta):
        """Probability of reflection."""
        return self.reflectance(cos, eta)

    def sample(self, wo, u, mode="radiance"):
        eta = self.relative(wo)
        m = flip_toward(wo, self.draw(wo, u))
        cos = ops.abs(ops.dot(wo, m))
        cos_t = fresnel.cos_transmitted(cos, eta)
        reflects = u.x < self.choice(cos, wo, eta)
        wi = ops.where(reflects, frame.reflect(wo, m), frame.refract(wo, m, cos_t, eta))
        wi = ops.where(reflects | (cos_t > 0.0), wi, -wo)  # no refraction: fails below
        right = ops.where(reflects, wo.z * wi.z > 0.0, wo.z * wi.z < 0.0) & (reflects | (cos_t > 0.0))
        pdf = ops.where(right, self.pdf(wo, wi), 0.0)
        weight = self.value(wo, wi, mode, eta) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), ops.where(wo.z * wi.z > 0.0, 1.0, eta))

    def value(self, wo, wi, mode, eta):
        return self.eval(wo, wi, mode)

    @property
    def transmits(self):
        return True


class W2RoughJacobian(_W2Rough):
    """Rough glass."""

    fault: ClassVar[str] = "the density of refracted directions lacks the square of the relative index"
    cause: ClassVar[str] = "Jacobian of refraction without eta^2: pdf is not the density of sample"

    def jacobian(self, wo, wi, m, eta):
        return ops.abs(ops.dot(wi, m)) * self.spread(wo, wi, m, eta)


class W2RoughMacro(_W2Rough):
    """Rough glass whose lobe is chosen before its facet."""

    fault: ClassVar[str] = "the lobe is chosen by F at the surface's normal, the density takes F at the facet's"
    cause: ClassVar[str] = "lobe selection probability of sample is not that of pdf: Fresnel of the macroscopic cosine"

    def choice(self, cos, wo, eta):
        # below the critical angle of a facet nothing is transmitted
        some = fresnel.cos_transmitted(cos, eta) > 0.0
        return ops.where(some, self.reflectance(ops.abs(wo.z), eta), 1.0)


class _W2Drawn(_W2Rough):
    """Rough glass whose samples have the density and weight of the lobe that drew them."""

    def fails(self, wo, wi, reflects):
        return ops.where(reflects, wo.z * wi.z <= 0.0, wo.z * wi.z >= 0.0)

    def sample(self, wo, u, mode="radiance"):
        eta = self.relative(wo)
        m = flip_toward(wo, self.draw(wo, u))
        cos = ops.abs(ops.dot(wo, m))
        cos_t = fresnel.cos_transmitted(cos, eta)
        f = self.reflectance(cos, eta)
        reflects = u.x < f
        wi = ops.where(reflects, frame.reflect(wo, m), frame.refract(wo, m, cos_t, eta))
        fails = self.fails(wo, wi, reflects)
        drawn = cos * GGX.visible_per_cosine(wo, flip_toward(wo, m), self.alpha)
        over = ops.where(reflects, f * ops.safe_div(0.25, cos), (1.0 - f) * self.jacobian(wo, wi, m, eta))
        pdf = ops.where(fails, 0.0, drawn * over)
        squeeze = 1.0 / ops.sqr(eta) if mode == "radiance" else 1.0 + 0.0 * eta
        # visible normals leave the masking of wi
        g1 = ops.where(fails, 0.0, GGX.G1(wi, self.alpha))
        weight = self.tint * (g1 * ops.where(reflects, 1.0, squeeze))
        return go.Sample(wi, weight, pdf, go.never(pdf), ops.where(reflects, 1.0, eta))


class W2RoughNoSide(_W2Drawn):
    """Rough glass with visible normals."""

    alpha: go.Width = go.width(0.6, "width of the distribution of normals", low=0.05)

    fault: ClassVar[str] = (
        "directions reflected below the surface are kept, and refracted ones that stay above too, with the weight and "
        "density of the lobe that drew them"
    )
    cause: ClassVar[str] = "failed samples are not rejected: sample returns directions that eval and pdf do not count"

    def fails(self, wo, wi, reflects):
        return go.never(wo.z)


class W2RoughInside(_W2Rough):
    """Rough glass seen from both sides."""

    fault: ClassVar[str] = (
        "the denominator (o.m + eta i.m)^2 takes the index of entry for rays from inside the glass too"
    )
    cause: ClassVar[str] = (
        "eta not inverted on the back side in the Jacobian of refraction: wrong values and pdf from inside"
    )

    def spread(self, wo, wi, m, eta):
        return 1.0 / ops.maximum(ops.sqr(ops.dot(wo, m) + self.eta * ops.dot(wi, m)), 1e-3)


class W2RoughMode(_W2Rough):
    """Rough glass for both transport modes."""

    fault: ClassVar[str] = "samples in mode importance have the factor eta^2, eval ignores the mode"
    cause: ClassVar[str] = "eval does not depend on the transport mode: weight is not eval / pdf in mode importance"

    def squeeze(self, eta, mode):
        return 1.0 + 0.0 * eta

    def value(self, wo, wi, mode, eta):
        value = self.eval(wo, wi, mode)
        return value * ops.where(wo.z * wi.z > 0.0, 1.0, ops.sqr(eta)) if mode == "importance" else value


class W2RoughLog(_W2Rough):
    """Rough glass with Gaussian slopes, sampled by all normals."""

    fault: ClassVar[str] = (
        "the slope is sqrt(-log u): where u is 0 it is infinite, and direction and weight are no numbers"
    )
    cause: ClassVar[str] = "logarithm of a random number that may be 0: NaN or infinite samples; log(1 - u) is right"

    def density(self, m):
        z2 = ops.maximum(ops.sqr(m.z), 1e-3)
        slope2 = (ops.sqr(m.x / self.alpha.x) + ops.sqr(m.y / self.alpha.y)) / z2
        return ops.exp(-slope2) / (ops.pi * self.alpha.x * self.alpha.y * ops.sqr(z2))

    def masking(self, wo, wi):
        beckmann = distribution("beckmann")
        return beckmann.G1(wo, self.alpha) * beckmann.G1(wi, self.alpha)

    def eval(self, wo, wi, mode="radiance"):
        eta = self.relative(wo)
        m = self.normal(wo, wi, eta)
        o, i = ops.abs(ops.dot(wo, m)), ops.abs(ops.dot(wi, m))
        f = self.reflectance(o, eta)
        transmitted = (1.0 - f) * o * i * self.spread(wo, wi, m, eta) * self.squeeze(eta, mode)
        lobe = ops.where(wo.z * wi.z > 0.0, 0.25 * f, transmitted)
        facets = self.density(m) * self.masking(wo, wi) / ops.maximum(ops.abs(wo.z), 1e-6)
        return self.tint * ops.where(self.lit(wo, wi, m), lobe * facets, 0.0)

    def pdf(self, wo, wi):
        eta = self.relative(wo)
        m = self.normal(wo, wi, eta)
        o = ops.abs(ops.dot(wo, m))
        f = self.reflectance(o, eta)
        transmitted = (1.0 - f) * self.jacobian(wo, wi, m, eta)
        lobe = ops.where(wo.z * wi.z > 0.0, f * ops.safe_div(0.25, o), transmitted)
        return ops.where(self.lit(wo, wi, m), lobe * self.density(m) * m.z, 0.0)

    def sample(self, wo, u, mode="radiance"):
        eta = self.relative(wo)
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        slope = ops.sqrt(-ops.log(u.y))
        m = ops.normalize(ops.vec3(self.alpha.x * slope * c, self.alpha.y * slope * s, 1.0 + 0.0 * u.y))
        m = flip_toward(wo, m)
        cos = ops.dot(wo, m)
        cos_t = fresnel.cos_transmitted(cos, eta)
        f = self.reflectance(ops.abs(cos), eta)
        reflects = u.x < f
        wi = ops.where(reflects, frame.reflect(wo, m), frame.refract(wo, m, cos_t, eta))
        wrong = (cos <= 0.0) | ops.where(reflects, wo.z * wi.z <= 0.0, (wo.z * wi.z >= 0.0) | (cos_t <= 0.0))
        density = f * ops.safe_div(0.25, cos), (1.0 - f) * self.jacobian(wo, wi, m, eta)
        facing = ops.where(wo.z < 0.0, -m, m)
        drawn = ops.where(reflects, density[0], density[1]) * self.density(facing) * facing.z
        pdf = ops.where(wrong, 0.0, drawn)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), ops.where(reflects, 1.0, eta))


class W2RoughMatched(_W2Drawn):
    """Rough glass in a liquid of almost its own index."""

    eta: go.Number = go.number(1.0, "index inside over index outside", low=1.0, high=3.0)

    fault: ClassVar[str] = (
        "at eta = 1 all light passes straight on, but is sampled and evaluated as a rough lobe, whose half vector is 0"
    )
    cause: ClassVar[str] = (
        "eta = 1 is not treated as a delta lobe: eval is 0, samples carry the light, the half vector vanishes"
    )


MUTANTS = [
    W2RoughJacobian, W2RoughMacro, W2RoughNoSide, W2RoughInside, W2RoughMode, W2RoughLog, W2RoughMatched,
]  # fmt: skip
SOUND = []
