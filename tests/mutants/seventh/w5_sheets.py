"""Panes, films, leaves, masks and coats, each with one mistake."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.optics import frame, fresnel, warp

ALMOST_ONE = 0.99999994


def exact(cos, eta):
    """Fresnel's reflectance from outside or inside."""
    return fresnel.kind("exact").dielectric(cos, fresnel.cos_transmitted(cos, eta), eta)


class W5Pane(go.BSDF):
    """A thin pane of clear glass with all bounces between its faces; it absorbs nothing."""

    fault: ClassVar[str] = "the pane reflects and transmits more light than arrives"
    cause: ClassVar[str] = (
        "sample: the reflectance 2 R / (1 + R) includes all bounces between both faces, but the transmittance is 1 - R "
        "of a single face; it must be 1 - 2 R / (1 + R), so the weights sum to more than 1"
    )
    eta: go.Number = go.number(1.5, "index of the glass", low=1.05, high=3.0)
    albedo: go.Colour = go.spectrum(1.0, "factor on all light", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.albedo * (0.0 * wo.z)

    def pdf(self, wo, wi):
        return 0.0 * wo.z

    def sample(self, wo, u, mode="radiance"):
        face = exact(ops.abs(wo.z), self.eta)
        both = 2.0 * face / (1.0 + face)
        reflects = u.x < both
        pdf = ops.where(reflects, both, 1.0 - both)
        power = ops.where(reflects, both, 1.0 - face)
        wi = ops.where(reflects, frame.mirror(wo), -wo)
        return go.Sample(wi, self.albedo * ops.safe_div(power, pdf), pdf, pdf > 0.0, 1.0 + 0.0 * pdf)

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "always"


class W5FreeFilm(go.BSDF):
    """A free-standing oxide film: interference colors are reflected, the complementary light passes straight through."""

    fault: ClassVar[str] = "the transmitted light is not complementary to the reflected light in each channel"
    cause: ClassVar[str] = (
        "sample: the weight of transmission is 1 - mean(R) over its probability, in all channels, instead of 1 - R per "
        "channel; channels that reflect more than the mean gain energy"
    )
    eta: go.Number = go.number(2.1, "index of the film", low=1.05, high=3.0)
    thickness: go.Number = go.number(190.0, "nm", low=10.0, high=2000.0)
    wavelengths_nm: go.Colour = go.spectrum((610.0, 550.0, 465.0), "wavelength of each channel, nm", low=300.0)

    def film(self, cos):
        """R of Airy's sum for a film with the same medium on both sides."""
        cos_t = fresnel.cos_transmitted(cos, self.eta)
        r = ops.minimum(exact(cos, self.eta), 0.9999)
        finesse = 4.0 * r / ops.sqr(1.0 - r)
        s = ops.sin(self.eta * self.thickness * cos_t * (2.0 * ops.pi) / self.wavelengths_nm)
        waves = s * s * finesse
        return waves / (1.0 + waves)

    def eval(self, wo, wi, mode="radiance"):
        return self.wavelengths_nm * (0.0 * wo.z)

    def pdf(self, wo, wi):
        return 0.0 * wo.z

    def sample(self, wo, u, mode="radiance"):
        R = self.film(ops.abs(wo.z))
        share = ops.mean(R)
        reflects = u.x < share
        pdf = ops.where(reflects, share, 1.0 - share)
        power = ops.where(reflects, R, (1.0 - share) + 0.0 * R)
        wi = ops.where(reflects, frame.mirror(wo), -wo)
        return go.Sample(wi, power * ops.safe_div(1.0, pdf), pdf, pdf > 0.0, 1.0 + 0.0 * pdf)

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "always"


class W5Leaf(go.BSDF):
    """A leaf: diffuse reflection, and diffuse transmission of a share of the light."""

    fault: ClassVar[str] = "from below, no sample is transmitted"
    cause: ClassVar[str] = (
        "sample: the transmitted direction is always put below the surface (z = -|z|), not on the side opposite to wo; "
        "for wo below it lands on wo's own side, and the samples do not have the density pdf"
    )
    kd: go.Colour = go.spectrum((0.35, 0.7, 0.2), "share of light that is scattered", low=0.0, high=1.0)
    through: go.Number = go.number(0.45, "share of the scattered light that is transmitted", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * self.pdf(wo, wi)

    def pdf(self, wo, wi):
        share = ops.where(wo.z * wi.z > 0.0, 1.0 - self.through, self.through)
        return ops.where(wo.z * wi.z != 0.0, share * ops.abs(wi.z) * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        d = warp.square_to_cosine_hemisphere(u.y, u.z)
        z = ops.where(u.x < self.through, -d.z, ops.copysign(d.z, wo.z))
        wi = ops.vec3(d.x, d.y, z)
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)

    @property
    def transmits(self):
        return True


class W5Vellum(go.BSDF):
    """Printed translucent paper whose two sides have different colors."""

    fault: ClassVar[str] = "light that crosses the sheet upward has another color than light that crosses downward"
    cause: ClassVar[str] = (
        "eval: the color of transmission is that of the viewer's side, front for wo above and back for wo below, so "
        "f(wo, wi) != f(wi, wo) across the sheet: not reciprocal (the reflection of each side may differ, "
        "the transmission may not)"
    )
    front: go.Colour = go.spectrum((0.8, 0.7, 0.4), "color of the front", low=0.0, high=1.0)
    back: go.Colour = go.spectrum((0.3, 0.5, 0.8), "color of the back", low=0.0, high=1.0)
    through: go.Number = go.number(0.5, "share of light that is transmitted", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        color = ops.where(wo.z > 0.0, self.front, self.back)
        return color * self.pdf(wo, wi)

    def pdf(self, wo, wi):
        share = ops.where(wo.z * wi.z > 0.0, 1.0 - self.through, self.through)
        return ops.where(wo.z * wi.z != 0.0, share * ops.abs(wi.z) * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        d = warp.square_to_cosine_hemisphere(u.y, u.z)
        z = ops.copysign(d.z, wo.z)
        wi = ops.vec3(d.x, d.y, ops.where(u.x < self.through, -z, z))
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)

    @property
    def transmits(self):
        return True


class W5Stencil(go.BSDF):
    """A base with holes through which light passes."""

    fault: ClassVar[str] = "pdf is that of the base alone"
    cause: ClassVar[str] = (
        "pdf: returns the base's density without the probability `opacity` of choosing the base over the hole; the pdf "
        "that sample states has it, so the two disagree, and pdf plus the hole's probability exceeds 1"
    )
    base: go.BSDF = go.bsdf("the material between the holes", default=go.Eon(0.6))
    opacity: go.Number = go.number(0.5, "share of the surface that is covered", low=0.05, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.base.eval(wo, wi, mode) * self.opacity

    def pdf(self, wo, wi):
        return self.base.pdf(wo, wi)

    def sample(self, wo, u, mode="radiance"):
        covered = u.x < self.opacity
        s = self.base.sample(wo, ops.vec3(ops.minimum(u.x / self.opacity, ALMOST_ONE), u.y, u.z), mode)
        hole = 1.0 - self.opacity + 0.0 * wo.z
        wi = ops.where(covered, s.wi, -wo)
        weight = ops.where(covered, s.weight, 1.0 + 0.0 * s.weight)
        pdf = ops.where(covered, s.pdf * self.opacity, hole)
        return go.Sample(wi, weight, pdf, s.delta | ~covered, ops.where(covered, s.eta, 1.0))

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "maybe"


class W5WireMesh(go.BSDF):
    """Fine metal mesh: matte wires on both sides, and holes."""

    fault: ClassVar[str] = "light that passes the holes is bent"
    cause: ClassVar[str] = (
        "sample: light through the holes leaves along (x, y, -z), wo mirrored at the plane of the surface, instead of "
        "straight on along -wo (eta is 1: there is no refraction)"
    )
    base: go.BSDF = go.bsdf("the wires", default=go.TwoSided(go.Lambert(0.4)))
    cover: go.Number = go.number(0.4, "share of the surface that is wire", low=0.05, high=0.95)

    def eval(self, wo, wi, mode="radiance"):
        return self.base.eval(wo, wi, mode) * self.cover

    def pdf(self, wo, wi):
        return self.base.pdf(wo, wi) * self.cover

    def sample(self, wo, u, mode="radiance"):
        wire = u.x < self.cover
        s = self.base.sample(wo, ops.vec3(ops.minimum(u.x / self.cover, ALMOST_ONE), u.y, u.z), mode)
        wi = ops.where(wire, s.wi, ops.vec3(wo.x, wo.y, -wo.z))
        weight = ops.where(wire, s.weight, 1.0 + 0.0 * s.weight)
        pdf = ops.where(wire, s.pdf * self.cover, 1.0 - self.cover + 0.0 * wo.z)
        return go.Sample(wi, weight, pdf, s.delta | ~wire, ops.where(wire, s.eta, 1.0))

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "maybe"


class W5CoatedMirror(go.BSDF):
    """A silvered mirror behind a thin clear varnish."""

    fault: ClassVar[str] = "the mirror reflects more light than arrives, most at grazing angles"
    cause: ClassVar[str] = (
        "sample: the metal's reflectance is added to the varnish's Fresnel reflectance unreduced, F + a; the metal gets "
        "only what the varnish transmits: F + (1 - F)^2 a / (1 - a F)"
    )
    eta: go.Number = go.number(1.5, "index of the varnish", low=1.05, high=3.0)
    silver: go.Colour = go.spectrum((0.97, 0.96, 0.94), "reflectance of the metal", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.silver * (0.0 * wo.z)

    def pdf(self, wo, wi):
        return 0.0 * wo.z

    def sample(self, wo, u, mode="radiance"):
        above = wo.z > 0.0
        top = exact(ops.abs(wo.z), self.eta)
        one = ops.where(above, 1.0 + 0.0 * wo.z, 0.0)
        return go.Sample(frame.mirror(wo), (self.silver + top) * one, one, above, 1.0 + 0.0 * wo.z)

    @property
    def delta(self):
        return "always"


class W5LacqueredWood(go.BSDF):
    """A base under a smooth clear lacquer that refracts; light between the two is not followed further."""

    fault: ClassVar[str] = "light under the lacquer keeps the cosine of its inner direction"
    cause: ClassVar[str] = (
        "eval: base.eval(o', i') includes the cosine of the refracted direction i', and is not converted to the cosine "
        "outside: the factor wi.z / i'.z is missing, so the result divided by cos theta_i is not reciprocal"
    )
    base: go.BSDF = go.bsdf("the wood, which must not transmit", default=go.Lambert((0.6, 0.4, 0.25)))
    eta: go.Number = go.number(1.5, "index of the lacquer", low=1.05, high=3.0)

    def inside(self, w):
        """The refracted direction, away from the base."""
        over = 1.0 / self.eta
        return ops.vec3(w.x * over, w.y * over, ops.safe_sqrt(1.0 - frame.sin2(w) * ops.sqr(over)))

    def eval(self, wo, wi, mode="radiance"):
        passed = (1.0 - exact(ops.abs(wo.z), self.eta)) * (1.0 - exact(ops.abs(wi.z), self.eta))
        value = self.base.eval(self.inside(wo), self.inside(wi), mode) * (passed / ops.sqr(self.eta))
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), value, 0.0)

    def top_share(self, wo):
        return 0.1 + 0.8 * exact(ops.abs(wo.z), self.eta)

    def pdf(self, wo, wi):
        i = self.inside(wi)
        density = self.base.pdf(self.inside(wo), i) * wi.z / (ops.sqr(self.eta) * ops.maximum(i.z, 1e-6))
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), (1.0 - self.top_share(wo)) * density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        share = self.top_share(wo)
        top = (u.x < share) & (wo.z > 0.0)
        rest = ops.clamp((u.x - share) / (1.0 - share), 0.0, ALMOST_ONE)
        s = self.base.sample(self.inside(wo), ops.vec3(rest, u.y, u.z), mode)
        x, y = s.wi.x * self.eta, s.wi.y * self.eta
        height2 = 1.0 - (x * x + y * y)
        leaves = (height2 > 0.0) & (s.wi.z > 0.0) & (s.pdf > 0.0) & (wo.z > 0.0)
        out = ops.vec3(
            ops.where(leaves, x, 0.0), ops.where(leaves, y, 0.0), ops.where(leaves, ops.safe_sqrt(height2), -1.0)
        )
        wi = ops.where(top, frame.mirror(wo), out)
        density = self.pdf(wo, wi)
        pdf = ops.where(top, share, ops.where(leaves, density, 0.0))
        through = self.eval(wo, wi, mode) * ops.safe_div(1.0, density)
        reflected = exact(ops.abs(wo.z), self.eta) / share + 0.0 * through
        weight = ops.where(pdf > 0.0, ops.where(top, reflected, through), 0.0)
        return go.Sample(wi, weight, pdf, top, 1.0 + 0.0 * pdf)

    @property
    def delta(self):
        return "maybe"


class W5Varnish(go.BSDF):
    """A base under a very thin smooth varnish that does not bend light; it may consist of several lobes."""

    fault: ClassVar[str] = "lobes of the base that are chosen by small numbers are never sampled"
    cause: ClassVar[str] = (
        "sample: u.x, having chosen the base over the varnish, is passed on to base.sample without being rescaled to "
        "[0, 1): the base sees only u.x >= 1/2 and never chooses one of its lobes, so samples do not have the density pdf"
    )
    base: go.BSDF = go.bsdf(
        "the material below, which must not transmit",
        default=go.Mix(go.Lambert(0.5), go.Conductor(alpha=0.3), weight=0.4),
    )
    eta: go.Number = go.number(1.5, "index of the varnish", low=1.05, high=3.0)

    def eval(self, wo, wi, mode="radiance"):
        passed = (1.0 - exact(ops.abs(wo.z), self.eta)) * (1.0 - exact(ops.abs(wi.z), self.eta))
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), self.base.eval(wo, wi, mode) * passed, 0.0)

    def pdf(self, wo, wi):
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), 0.5 * self.base.pdf(wo, wi), 0.0)

    def sample(self, wo, u, mode="radiance"):
        top = (u.x < 0.5) & (wo.z > 0.0)
        s = self.base.sample(wo, u, mode)
        wi = ops.where(top, frame.mirror(wo), s.wi)
        density = self.pdf(wo, wi)
        pdf = ops.where(top, 0.5, ops.where(s.pdf > 0.0, density, 0.0))
        through = self.eval(wo, wi, mode) * ops.safe_div(1.0, density)
        weight = ops.where(top, 2.0 * exact(ops.abs(wo.z), self.eta) + 0.0 * through, through)
        return go.Sample(wi, ops.where(pdf > 0.0, weight, 0.0), pdf, top, 1.0 + 0.0 * pdf)

    @property
    def delta(self):
        return "maybe"


MUTANTS = [
    W5Pane,
    W5FreeFilm,
    W5Leaf,
    W5Vellum,
    W5Stencil,
    W5WireMesh,
    W5CoatedMirror,
    W5LacqueredWood,
    W5Varnish,
]
SOUND = []
