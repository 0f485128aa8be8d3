"""Sound but unusual: deltas beside smooth parts, sheets, filters, gratings, hard edges, nothing at all."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.optics import frame, fresnel, warp


def grey(x):
    """A colour of three equal channels."""
    return ops.vec3(x, x, x)


def around(axis, w):
    """w, given about +z, about a unit axis instead (Duff2017)."""
    side = ops.copysign(1.0 + 0.0 * axis.z, axis.z)
    a = -1.0 / (side + axis.z)
    b = axis.x * axis.y * a
    s = ops.vec3(1.0 + side * axis.x * axis.x * a, side * b, -side * axis.x)
    t = ops.vec3(b, side + axis.y * axis.y * a, -axis.y)
    return s * w.x + t * w.y + axis * w.z


# ------------------------------------------------------------------ deltas


class _Delta(go.BSDF):
    """Nothing but deltas."""

    kind: ClassVar[str] = "delta"
    delta = "always"

    def eval(self, wo, wi, mode="radiance"):
        return grey(0.0 * wo.z)

    def pdf(self, wo, wi):
        return 0.0 * wo.z


class TintedMirror(go.Mirror):
    """A mirror that is black in one channel."""

    albedo: go.Colour = go.spectrum((0.9, 0.0, 0.3), "share of light that is reflected", low=0.0, high=1.0)
    kind: ClassVar[str] = "delta"
    fault: ClassVar[str] = ""
    why: ClassVar[str] = "a share of 0 in one channel is a colour like any other"


class CornerCube(_Delta):
    """Retro-reflecting foil: all light goes back where it came from."""

    albedo: go.Colour = go.spectrum((0.8, 0.8, 0.2), "share of light that is sent back", low=0.0, high=1.0)
    fault: ClassVar[str] = ""
    why: ClassVar[str] = "wi = wo is its own inverse and keeps solid angles: a reciprocal delta, though no mirror"

    def sample(self, wo, u, mode="radiance"):
        above = wo.z > 0.0
        one = ops.where(above, 1.0 + 0.0 * wo.z, 0.0)
        return go.Sample(wo, self.albedo * one, one, above, 1.0 + 0.0 * one)


class Grating(_Delta):
    """A reflecting grating with grooves along y: orders -1, 0 and 1."""

    albedo: go.Colour = go.spectrum((0.9, 0.8, 0.7), "share of light that is reflected", low=0.0, high=1.0)
    step: go.Number = go.number(0.35, "wavelength over the grooves' distance", low=0.0, high=1.0)
    first: go.Number = go.number(0.2, "share of each first order", low=0.0, high=0.5)
    fault: ClassVar[str] = ""
    why: ClassVar[str] = (
        "t_o + t_i = n step is symmetric and keeps projected solid angle, so equal shares are reciprocal; an order "
        "that cannot leave is lost, as a failed sample"
    )

    @property
    def isotropic(self):
        return False

    def sample(self, wo, u, mode="radiance"):
        up, down = u.x < self.first, u.x > 1.0 - self.first
        n = ops.where(up, 1.0, ops.where(down, -1.0, 0.0 * wo.z))
        x = n * self.step - wo.x
        z2 = 1.0 - ops.sqr(x) - ops.sqr(wo.y)
        zero = n == 0.0
        z = ops.where(zero, wo.z, ops.safe_sqrt(z2))
        lives = (wo.z > 0.0) & (zero | ((z2 > 1e-6) & (wo.z > 1e-3)))
        wi = ops.where(lives, ops.vec3(x, -wo.y, z), frame.mirror(wo))
        chance = ops.where(zero, 1.0 - 2.0 * self.first, self.first)
        pdf = ops.where(lives, chance, 0.0)
        return go.Sample(wi, self.albedo * ops.where(lives, 1.0 + 0.0 * pdf, 0.0), pdf, lives, 1.0 + 0.0 * pdf)


class ColourFilter(_Delta):
    """A coloured foil without reflections: what passes goes straight on."""

    pane: go.Colour = go.spectrum((0.9, 0.5, 0.1), "share that passes", low=0.0, high=1.0)
    fault: ClassVar[str] = ""
    why: ClassVar[str] = "wi = -wo is a delta transmission with eta 1, tinted alike from both sides"
    transmits = True

    def sample(self, wo, u, mode="radiance"):
        one = 1.0 + 0.0 * wo.z
        return go.Sample(-wo, self.pane * one, one, ~go.never(one), one)


class Nothing(_Delta):
    """No surface at all."""

    fault: ClassVar[str] = ""
    why: ClassVar[str] = "all light passes straight on with weight 1; it has no parameter"
    transmits = True
    lossless_tolerance: ClassVar[float] = 1e-6

    def sample(self, wo, u, mode="radiance"):
        one = 1.0 + 0.0 * wo.z
        return go.Sample(-wo, grey(one), one, ~go.never(one), one)


class ThinSlab(_Delta):
    """A window pane: light bounces between its faces and leaves straight."""

    eta: go.Number = go.number(1.5, "index of the pane", low=1.0, high=3.0)
    fault: ClassVar[str] = ""
    why: ClassVar[str] = "R = 2r/(1+r), T = 1 - R, in air on both sides: no radiance factor and eta 1"
    transmits = True
    lossless_tolerance: ClassVar[float] = 1e-5

    def sample(self, wo, u, mode="radiance"):
        cos = ops.abs(wo.z)
        r = fresnel.kind("exact").dielectric(cos, fresnel.cos_transmitted(cos, self.eta), self.eta)
        both = 2.0 * r / (1.0 + r)
        reflects = u.x < both
        pdf = ops.where(reflects, both, 1.0 - both)
        wi = ops.where(reflects, frame.mirror(wo), -wo)
        return go.Sample(wi, grey(1.0 + 0.0 * pdf), pdf, ~go.never(pdf), 1.0 + 0.0 * pdf)


class SchlickGlass(_Delta):
    """Smooth glass with Schlick's curve at the cosine of the thinner side."""

    eta: go.Number = go.number(1.5, "index inside over index outside", low=0.2, high=5.0)
    fault: ClassVar[str] = ""
    why: ClassVar[str] = "the larger of both angles is the same from both sides, so the approximation is reciprocal"
    transmits = True

    def sample(self, wo, u, mode="radiance"):
        eta = ops.where(wo.z >= 0.0, self.eta, 1.0 / self.eta)
        cos_o = ops.abs(wo.z)
        cos_t = fresnel.cos_transmitted(cos_o, eta)
        r0 = ops.sqr((eta - 1.0) / (eta + 1.0))
        f = r0 + (1.0 - r0) * ops.pow(1.0 - ops.minimum(cos_o, cos_t), 5.0)
        f = ops.where(cos_t > 0.0, f, 1.0)
        reflects = u.x < f
        through = ops.vec3(-wo.x / eta, -wo.y / eta, ops.where(wo.z >= 0.0, -cos_t, cos_t))
        pdf = ops.where(reflects, f, 1.0 - f)
        radiance = 1.0 / ops.sqr(eta) if mode == "radiance" else 1.0 + 0.0 * eta
        weight = ops.where(reflects, 1.0 + 0.0 * radiance, radiance)
        wi = ops.where(reflects, frame.mirror(wo), through)
        return go.Sample(wi, grey(weight), pdf, ~go.never(pdf), ops.where(reflects, 1.0, eta))


class FairCoinGlass(_Delta):
    """A smooth bubble of air in water, whose lobes are chosen by a fair coin."""

    eta: go.Number = go.number(0.75, "index inside over index outside", low=0.2, high=5.0)
    fault: ClassVar[str] = ""
    why: ClassVar[str] = "eta < 1: total reflection is met from above, not from below; a weight is up to 2, rightly"
    transmits = True

    def sample(self, wo, u, mode="radiance"):
        eta = ops.where(wo.z >= 0.0, self.eta, 1.0 / self.eta)
        cos_o = ops.abs(wo.z)
        cos_t = fresnel.cos_transmitted(cos_o, eta)
        f = fresnel.kind("exact").dielectric(cos_o, cos_t, eta)
        share = ops.where(cos_t > 0.0, 0.5, 1.0 + 0.0 * f)
        reflects = u.x < share
        through = ops.vec3(-wo.x / eta, -wo.y / eta, ops.where(wo.z >= 0.0, -cos_t, cos_t))
        pdf = ops.where(reflects, share, 1.0 - share)
        radiance = 1.0 / ops.sqr(eta) if mode == "radiance" else 1.0 + 0.0 * eta
        weight = ops.safe_div(ops.where(reflects, f, (1.0 - f) * radiance), pdf)
        wi = ops.where(reflects, frame.mirror(wo), through)
        return go.Sample(wi, grey(weight), pdf, ~go.never(pdf), ops.where(reflects, 1.0, eta))


class BlackSheet(_Delta):
    """A sheet that absorbs everything."""

    fault: ClassVar[str] = ""
    why: ClassVar[str] = "every sample fails, eval and pdf are 0 everywhere: black, and consistent"
    kind: ClassVar[str] = "smooth"
    delta = "never"

    def sample(self, wo, u, mode="radiance"):
        zero = 0.0 * wo.z
        return go.Sample(frame.mirror(wo), grey(zero), zero, go.never(zero), 1.0 + zero)


# ------------------------------------------------------------------ deltas beside smooth parts


class HalfMirror(go.BSDF):
    """Matte paint with flakes of mirror in it."""

    albedo: go.Colour = go.spectrum((0.7, 0.2, 0.1), "share that the paint reflects", low=0.0, high=1.0)
    silver: go.Colour = go.spectrum(0.9, "share that a flake reflects", low=0.0, high=1.0)
    flakes: go.Number = go.number(0.3, "share of the surface that is flakes", low=0.0, high=1.0)
    kind: ClassVar[str] = "delta"
    fault: ClassVar[str] = ""
    why: ClassVar[str] = "a delta and a smooth lobe side by side; each sample has the pdf of its own kind alone"

    @property
    def delta(self):
        return "maybe"

    def eval(self, wo, wi, mode="radiance"):
        value = (1.0 - self.flakes) * wi.z * ops.inv_pi
        return self.albedo * ops.where((wo.z > 0.0) & (wi.z > 0.0), value, 0.0)

    def pdf(self, wo, wi):
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), (1.0 - self.flakes) * wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        above = wo.z > 0.0
        flake = (u.x < self.flakes) & above
        wi = ops.where(flake, frame.mirror(wo), warp.square_to_cosine_hemisphere(u.y, u.z))
        pdf = ops.where(flake, self.flakes, self.pdf(wo, wi))
        weight = ops.where(flake, self.silver, self.albedo) * ops.where(pdf > 0.0, 1.0 + 0.0 * pdf, 0.0)
        return go.Sample(wi, weight, pdf, flake, 1.0 + 0.0 * pdf)


class Gauze(go.BSDF):
    """Matte cloth with holes: a mask."""

    albedo: go.Colour = go.spectrum((0.6, 0.5, 0.4), "share that a thread reflects", low=0.0, high=1.0)
    opacity: go.Number = go.number(0.7, "share of the surface that is threads", low=0.0, high=1.0)
    kind: ClassVar[str] = "delta"
    fault: ClassVar[str] = ""
    why: ClassVar[str] = "null transmission wi = -wo beside a one-sided matte part; from below it is black with holes"
    transmits = True

    @property
    def delta(self):
        return "maybe"

    def eval(self, wo, wi, mode="radiance"):
        return self.albedo * ops.where((wo.z > 0.0) & (wi.z > 0.0), self.opacity * wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), self.opacity * wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        hole = u.x >= self.opacity
        wi = ops.where(hole, -wo, warp.square_to_cosine_hemisphere(u.y, u.z))
        pdf = ops.where(hole, 1.0 - self.opacity, self.pdf(wo, wi))
        one = ops.where(pdf > 0.0, 1.0 + 0.0 * pdf, 0.0)
        weight = ops.where(hole, 1.0 + 0.0 * self.albedo, self.albedo) * one
        return go.Sample(wi, weight, pdf, hole, 1.0 + 0.0 * pdf)


class MixOfThree(go.Mix):
    """Paint, flakes and clear spots."""

    a: go.BSDF = go.bsdf("the material at weight 0", go.Lambert(albedo=(0.7, 0.5, 0.3)))
    b: go.BSDF = go.bsdf("the material at weight 1", go.Mix(a=go.Mirror(), b=go.Dielectric(alpha=0.2), weight=0.4))
    weight: go.Number = go.number(0.6, "share of b", low=0.0, high=1.0)
    kind: ClassVar[str] = "delta"
    fault: ClassVar[str] = ""
    why: ClassVar[str] = "a mixture of a mixture: matte, delta and rough transmitting parts, u1 stretched twice"


# ------------------------------------------------------------------ transmitting


class Leaf(go.BSDF):
    """A leaf: matte on both sides, and light shines through."""

    albedo: go.Colour = go.spectrum((0.3, 0.8, 0.1), "share of light that leaves", low=0.0, high=1.0)
    through: go.Number = go.number(0.35, "share of that which passes", low=0.0, high=1.0)
    kind: ClassVar[str] = "transmitting"
    fault: ClassVar[str] = ""
    why: ClassVar[str] = "a diffuse transmitter in air: no radiance factor, eta 1"
    transmits = True

    def eval(self, wo, wi, mode="radiance"):
        return self.albedo * self.pdf(wo, wi)

    def pdf(self, wo, wi):
        sides = wo.z * wi.z
        share = ops.where(sides > 0.0, 1.0 - self.through, self.through)
        return ops.where(sides != 0.0, share * ops.abs(wi.z) * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        w = warp.square_to_cosine_hemisphere(u.y, u.z)
        z = ops.where(u.x < self.through, -w.z, w.z)
        wi = ops.vec3(w.x, w.y, ops.where(wo.z < 0.0, -z, z))
        pdf = self.pdf(wo, wi)
        weight = self.albedo * ops.where(pdf > 0.0, 1.0 + 0.0 * pdf, 0.0)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class TwoFaced(Leaf):
    """A sheet with one bright and one dark face."""

    front: go.Number = go.number(0.9, "share that the front reflects of what does not pass", low=0.0, high=1.0)
    back: go.Number = go.number(0.2, "share that the back reflects of what does not pass", low=0.0, high=1.0)
    why: ClassVar[str] = "the faces reflect differently, what passes is the same both ways: reciprocal, not symmetric"

    def eval(self, wo, wi, mode="radiance"):
        face = ops.where(wo.z > 0.0, self.front, self.back)
        return self.albedo * (self.pdf(wo, wi) * ops.where(wo.z * wi.z > 0.0, face, 1.0))

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        value = self.eval(wo, s.wi, mode)
        return go.Sample(s.wi, value * ops.safe_div(1.0, s.pdf), s.pdf, s.delta, s.eta)


class FrostedBoundary(go.BSDF):
    """A matte boundary of air and glass: what enters is spread evenly, and what leaves is."""

    eta: go.Number = go.number(1.5, "index inside over index outside", low=1.0, high=3.0)
    through: go.Number = go.number(0.6, "share that enters", low=0.0, high=1.0)
    kind: ClassVar[str] = "transmitting"
    fault: ClassVar[str] = ""
    why: ClassVar[str] = "of what would leave only 1 / eta^2 of the share that enters does: what reciprocity asks for"
    transmits = True
    lossless_tolerance: ClassVar[float] = 1e-5

    def _eta(self, wo):
        return ops.where(wo.z > 0.0, self.eta, 1.0 / self.eta)

    def _passes(self, wo):
        return ops.where(wo.z > 0.0, self.through, self.through / ops.sqr(self.eta))

    def eval(self, wo, wi, mode="radiance"):
        radiance = 1.0 / ops.sqr(self._eta(wo)) if mode == "radiance" else 1.0 + 0.0 * wo.z
        return grey(self.pdf(wo, wi) * ops.where(wo.z * wi.z > 0.0, 1.0, radiance))

    def pdf(self, wo, wi):
        share = ops.where(wo.z * wi.z > 0.0, 1.0 - self._passes(wo), self._passes(wo))
        return ops.where(wo.z * wi.z != 0.0, share * ops.abs(wi.z) * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        w = warp.square_to_cosine_hemisphere(u.y, u.z)
        z = ops.where(u.x < self._passes(wo), -w.z, w.z)
        wi = ops.vec3(w.x, w.y, ops.where(wo.z > 0.0, z, -z))
        pdf = self.pdf(wo, wi)
        eta = ops.where(wo.z * wi.z < 0.0, self._eta(wo), 1.0)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), eta)


class HazyFoil(go.BSDF):
    """A foil that scatters by a metal's lobe, to both sides: the transmitted lobe is the mirrored one, seen through."""

    lobe: go.BSDF = go.bsdf("the lobe", go.Conductor(eta=0.2, k=3.0, alpha=0.25))
    through: go.Number = go.number(0.7, "share that passes", low=0.0, high=1.0)
    kind: ClassVar[str] = "transmitting"
    fault: ClassVar[str] = ""
    why: ClassVar[str] = "a rough sheet in air: f(o, i) is the lobe of o and i folded to one side; the same from both"
    transmits = True

    def _up(self, w):
        return ops.vec3(w.x, w.y, ops.abs(w.z))

    def _chance(self, wo, wi):
        sides = wo.z * wi.z
        return ops.where(sides > 0.0, 1.0 - self.through, ops.where(sides < 0.0, self.through, 0.0 * sides))

    def eval(self, wo, wi, mode="radiance"):
        return self.lobe.eval(self._up(wo), self._up(wi), mode) * self._chance(wo, wi)

    def pdf(self, wo, wi):
        return self.lobe.pdf(self._up(wo), self._up(wi)) * self._chance(wo, wi)

    def sample(self, wo, u, mode="radiance"):
        s = self.lobe.sample(self._up(wo), u, mode)
        passes = u.x < self.through
        flip = ops.where(wo.z < 0.0, -1.0, 1.0) * ops.where(passes, -1.0, 1.0 + 0.0 * wo.z)
        pdf = s.pdf * ops.where(passes, self.through, 1.0 - self.through)
        return go.Sample(ops.vec3(s.wi.x, s.wi.y, s.wi.z * flip), s.weight, pdf, s.delta, s.eta)


class Bubble(go.Dielectric):
    """A rough bubble."""

    eta: go.Number = go.number(0.75, "index inside over index outside", low=0.2, high=5.0)
    alpha: go.Width = go.width(0.3, "width of the microfacet distribution; two for anisotropy")
    kind: ClassVar[str] = "transmitting"
    fault: ClassVar[str] = ""
    why: ClassVar[str] = "eta < 1: the inside is the thinner medium"


class MatchedGlass(go.Dielectric):
    """Rough glass in oil of the same index."""

    eta: go.Number = go.number(1.0, "index inside over index outside", low=0.2, high=5.0)
    alpha: go.Width = go.width(0.4, "width of the microfacet distribution; two for anisotropy")
    kind: ClassVar[str] = "delta"
    fault: ClassVar[str] = ""
    why: ClassVar[str] = "eta = 1 exactly is no surface: light goes straight on, whatever alpha is"


class BrushedGlass(go.Dielectric):
    """Anisotropic rough glass, turned, tinted."""

    alpha: go.Width = go.width((0.06, 0.35), "width of the microfacet distribution; two for anisotropy")
    rotation: go.Angle = go.angle(0.7, "turn of the axes")
    albedo: go.Colour = go.spectrum((0.95, 0.9, 0.7), "factor on everything that leaves", low=0.0, high=1.0)
    kind: ClassVar[str] = "anisotropic"
    fault: ClassVar[str] = ""
    why: ClassVar[str] = "two widths and a turn, which refraction has as reflection has"


class NearlyClear(go.Dielectric):
    """Glass that is rough by a thousandth."""

    alpha: go.Width = go.width(1e-3, "width of the microfacet distribution; two for anisotropy")
    kind: ClassVar[str] = "transmitting"
    fault: ClassVar[str] = ""
    why: ClassVar[str] = "a lobe that is nearly a delta is still a density, of some 1e5 per steradian"


class NearlyMirror(go.Conductor):
    """Gold that is rough by a thousandth."""

    eta: go.Colour = go.spectrum((0.18, 0.42, 1.37), "real part of the index", low=0.0)
    k: go.Colour = go.spectrum((3.42, 2.35, 1.77), "imaginary part of the index", low=0.0)
    alpha: go.Width = go.width(1e-3, "width of the microfacet distribution; two for anisotropy")
    kind: ClassVar[str] = "smooth"
    fault: ClassVar[str] = ""
    why: ClassVar[str] = "a lobe that is nearly a delta is still a density, of some 1e5 per steradian"


# ------------------------------------------------------------------ smooth, with edges and noise


class HardCone(go.BSDF):
    """A lobe that is constant within a cone about the mirrored direction, and ends there."""

    albedo: go.Colour = go.spectrum((0.9, 0.8, 0.6), "share of light before the cosine", low=0.0, high=1.0)
    edge: go.Number = go.number(0.9, "cosine of the cone's half angle", low=0.0, high=0.99)
    kind: ClassVar[str] = "smooth"
    fault: ClassVar[str] = ""
    why: ClassVar[str] = "f depends on mirror(o).i alone, so it is reciprocal; a cosine <= 1 keeps the energy"

    def _inside(self, wo, wi):
        hit = ops.dot(frame.mirror(wo), wi) >= self.edge - 1e-6
        height = (0.5 * ops.inv_pi) / (1.0 - self.edge + 1e-6)
        return ops.where(hit & (wo.z > 0.0) & (wi.z > 0.0), height, 0.0 * wo.z)

    def eval(self, wo, wi, mode="radiance"):
        return self.albedo * (self._inside(wo, wi) * ops.maximum(wi.z, 0.0))

    def pdf(self, wo, wi):
        return self._inside(wo, wi)

    def sample(self, wo, u, mode="radiance"):
        drop = u.y * (1.0 - self.edge + 1e-6)
        sin = ops.safe_sqrt(drop * (2.0 - drop))
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        wi = around(frame.mirror(wo), ops.vec3(sin * c, sin * s, 1.0 - drop))
        pdf = self.pdf(wo, wi)
        weight = self.albedo * ops.where(pdf > 0.0, wi.z, 0.0)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class Striped(go.BSDF):
    """A matte surface that answers only to half vectors in stripes."""

    albedo: go.Colour = go.spectrum(0.8, "share of light that a stripe reflects", low=0.0, high=1.0)
    kind: ClassVar[str] = "anisotropic"
    fault: ClassVar[str] = ""
    why: ClassVar[str] = "f is albedo / pi or 0 by the half vector's x: reciprocal, discontinuous, declared anisotropic"

    @property
    def isotropic(self):
        return False

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        stripe = ops.floor(4.0 * m.x) * 0.5
        lit = (stripe == ops.floor(stripe)) & (wo.z > 0.0) & (wi.z > 0.0)
        return self.albedo * ops.where(lit, wi.z * ops.inv_pi, 0.0)


class Moon(go.BSDF):
    """Lommel and Seeliger's law of dark dust."""

    dust: go.Colour = go.spectrum((0.9, 0.8, 0.7), "albedo of one grain", low=0.0, high=1.0)
    kind: ClassVar[str] = "smooth"
    fault: ClassVar[str] = ""
    why: ClassVar[str] = "f = w / (4 pi (mu_o + mu_i)) grows without bound at grazing, f cos and the albedo do not"

    def eval(self, wo, wi, mode="radiance"):
        lit = (wo.z > 0.0) & (wi.z > 0.0)
        value = ops.safe_div(wi.z * (0.25 * ops.inv_pi), ops.where(lit, wo.z + wi.z, 1.0))
        return self.dust * ops.where(lit, value, 0.0)


class UniformMatte(go.BSDF):
    """A matte surface that is sampled over the whole sphere."""

    albedo: go.Colour = go.spectrum(0.6, "share of light that is reflected", low=0.0, high=1.0)
    kind: ClassVar[str] = "smooth"
    fault: ClassVar[str] = ""
    why: ClassVar[str] = "half of its samples fail (weight = pdf = 0), the others weigh up to four: poor, and right"

    def eval(self, wo, wi, mode="radiance"):
        return self.albedo * ops.where((wo.z > 0.0) & (wi.z > 0.0), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), 0.25 * ops.inv_pi + 0.0 * wi.z, 0.0)

    def sample(self, wo, u, mode="radiance"):
        z = 1.0 - 2.0 * u.y
        r = 2.0 * ops.safe_sqrt(u.y * (1.0 - u.y))
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        wi = ops.vec3(r * c, r * s, z)
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class Grainy(go.BSDF):
    """A matte surface estimated by a roll of dice."""

    stochastic: ClassVar[bool] = True
    albedo: go.Colour = go.spectrum((0.6, 0.5, 0.4), "share of light that is reflected", low=0.0, high=1.0)
    seed: go.Number = go.number(0.0, "shifts the random numbers")
    kind: ClassVar[str] = "smooth"
    fault: ClassVar[str] = ""
    why: ClassVar[str] = "eval is random with the right mean, by a hash of both directions and seed, and says so"

    def _dice(self, wo, wi):
        x = 12.9898 * wo.x + 78.233 * wo.y + 37.719 * wi.x + 93.989 * wi.y + 0.618034 * self.seed
        x = ops.sin(6.2831853 * (x - ops.floor(x))) * 437.5453
        return x - ops.floor(x)

    def eval(self, wo, wi, mode="radiance"):
        value = (0.5 + self._dice(wo, wi)) * wi.z * ops.inv_pi
        return self.albedo * ops.where((wo.z > 0.0) & (wi.z > 0.0), value, 0.0)


MUTANTS = []
SOUND = [
    TintedMirror,
    CornerCube,
    Grating,
    ColourFilter,
    Nothing,
    ThinSlab,
    SchlickGlass,
    FairCoinGlass,
    BlackSheet,
    HalfMirror,
    Gauze,
    MixOfThree,
    Leaf,
    TwoFaced,
    FrostedBoundary,
    HazyFoil,
    Bubble,
    MatchedGlass,
    BrushedGlass,
    NearlyClear,
    NearlyMirror,
    HardCone,
    Striped,
    Moon,
    UniformMatte,
    Grainy,
]
