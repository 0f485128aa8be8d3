"""Smooth sheets, odd glass and odd mirrors: lobes that are all, or partly, delta distributions."""

import gonio as go
from gonio import ops
from gonio.optics import frame, fresnel, warp


def delta_sample(wo, wi, value, chance, crosses, eta):
    """A delta sample of reflectance or transmittance `value`, chosen with probability `chance`.

    It fails (weight and pdf 0) where wi is not on the side where it should be."""
    sides = wo.z * wi.z
    ok = ops.where(crosses, sides < 0.0, sides > 0.0) & (chance > 0.0)
    pdf = ops.where(ok, chance, 0.0)
    return go.Sample(wi, value * ops.safe_div(1.0, pdf), pdf, ok, eta)


class PulsedGap(go.BSDF):
    """A colored gel: light passes straight on, times `passed`. Nothing else happens.

    Right: wi = -wo maps solid angle and cosine to themselves, the factor is the same both ways and at most 1, and the
    index is the same on both sides. Unusual: the sampler draws only every fourth sample (probability 0.25, weight
    passed / 0.25); the others have weight and pdf 0. The mean of the weights over u is passed.
    """

    passed: go.Colour = go.spectrum((0.9, 0.0, 0.3), "fraction that passes", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.passed * ops.zeros_like(wo.z)

    def pdf(self, wo, wi):
        return ops.zeros_like(wo.z)

    def sample(self, wo, u, mode="radiance"):
        drawn = (u.x >= 0.5) & (u.x < 0.75)
        pdf = ops.where(drawn, 0.25 + 0.0 * wo.z, 0.0)
        return go.Sample(-wo, self.passed * ops.safe_div(1.0, pdf), pdf, drawn, ops.ones_like(pdf))

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "always"


class BeerSlab(go.BSDF):
    """A thin plane slab of index `eta` that absorbs: all bounces summed, path in the slab depth / cos_t per crossing.

    With R the exact Fresnel reflectance of a face, T = 1 - R and a = exp(-depth / cos_t):
    R' = R + T^2 R a^2 / (1 - R^2 a^2),  T' = T^2 a / (1 - R^2 a^2);  R' + T' <= 1 as it is 1 at a = 1 and grows with a.
    Both faces are in the same medium, so radiance is not scaled; all depends on |cos| alone, hence is reciprocal.
    Where the index is below 1 there is total reflection: R' = 1, T' = 0. Sampled with fixed probabilities 0.2 and 0.8.
    """

    eta: go.Number = go.number(0.7, "index of the slab", low=0.3, high=4.0)
    depth: go.Colour = go.spectrum((0.0, 0.5, 3.0), "optical depth at normal incidence", low=0.0, high=30.0)

    def both(self, wo):
        cos = ops.maximum(ops.abs(wo.z), 1e-6)
        cos_t = fresnel.cos_transmitted(cos, self.eta)
        crosses = cos_t > 1e-4
        cos_t = ops.where(crosses, cos_t, 1.0)
        r = ops.where(crosses, fresnel.kind("exact").dielectric(cos, cos_t, self.eta), 1.0)
        t = 1.0 - r
        a = ops.exp(-self.depth / cos_t)
        left = ops.maximum(1.0 - a * a * (r * r), 1e-12)
        reflected = a * a * (t * t * r) / left + r
        passed = a * (t * t) / left
        return ops.where(crosses, reflected, 1.0 + 0.0 * reflected), ops.where(crosses, passed, 0.0 * passed)

    def eval(self, wo, wi, mode="radiance"):
        return self.depth * ops.zeros_like(wo.z)

    def pdf(self, wo, wi):
        return ops.zeros_like(wo.z)

    def sample(self, wo, u, mode="radiance"):
        reflected, passed = self.both(wo)
        mirrors = u.x < 0.2
        wi = ops.where(mirrors, frame.mirror(wo), -wo)
        value = ops.where(mirrors, reflected, passed)
        chance = ops.where(mirrors, 0.2 + 0.0 * wo.z, 0.8)
        return delta_sample(wo, wi, value, chance, ~mirrors, ops.ones_like(wo.z))

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "always"


class SchlickGlass(go.BSDF):
    """Smooth glass by Schlick's polynomial at the cosine in the thinner medium, with separate tints.

    F = r0 + (1 - r0) (1 - cos)^5 where cos is that of the direction in the medium of smaller index, so that both ways
    through the surface have the same F, and F = 1 in total reflection (cos_t = 0). Power: tint_r F + tint_t (1 - F)
    <= 1. Transmitted radiance has the factor 1 / eta^2, importance has not. At eta = 1 it does not bend, but still
    reflects (1 - cos)^5: odd, and still reciprocal and conserving.
    """

    eta: go.Number = go.number(1.0001, "index inside over outside", low=0.3, high=4.0)
    tint_r: go.Colour = go.spectrum((1.0, 0.5, 0.0), "factor on the reflected light", low=0.0, high=1.0)
    tint_t: go.Colour = go.spectrum((0.0, 1.0, 0.8), "factor on the transmitted light", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.tint_r * ops.zeros_like(wo.z)

    def pdf(self, wo, wi):
        return ops.zeros_like(wo.z)

    def sample(self, wo, u, mode="radiance"):
        eta = ops.where(wo.z >= 0.0, self.eta, 1.0 / self.eta)
        cos = ops.abs(wo.z)
        cos_t = fresnel.cos_transmitted(cos, eta)
        thin = ops.where(eta < 1.0, cos_t, cos)
        r0 = ops.sqr((eta - 1.0) / (eta + 1.0))
        f = r0 + (1.0 - r0) * ops.pow(1.0 - thin, 5.0)
        chance_r = ops.where(cos_t > 0.0, 0.1 + 0.8 * f, 1.0)  # not F itself, but 1 in total reflection
        mirrors = u.x < chance_r
        n = ops.where(wo.z >= 0.0, frame.normal_like(wo), -frame.normal_like(wo))
        wi = ops.where(mirrors, frame.mirror(wo), frame.refract(wo, n, cos_t, eta))
        t = (1.0 - f) if mode == "importance" else (1.0 - f) / ops.sqr(eta)
        value = ops.where(mirrors, self.tint_r * f, self.tint_t * t)
        chance = ops.where(mirrors, chance_r, 1.0 - chance_r)
        return delta_sample(wo, wi, value, chance, ~mirrors, ops.where(mirrors, 1.0, eta))

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "always"


class NegativeGlass(go.BSDF):
    """A metamaterial that refracts to the wrong side: Snell's law with index -eta, so that wi's tangential part has
    the direction of wo's own, over eta.

    It is ordinary refraction followed by a half turn about the normal: the measure |cos| dw scales by the same 1/eta^2,
    and the way back (index 1 / eta) leads to wo again. F is that of the positive index (exact, the same both ways);
    power F + (1 - F) = 1 times the tint. The sample's eta is positive.
    """

    eta: go.Number = go.number(1.4, "absolute value of the index", low=0.6, high=3.0)
    tint: go.Colour = go.spectrum((1.0, 1.0, 0.4), "factor on the transmitted light", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.tint * ops.zeros_like(wo.z)

    def pdf(self, wo, wi):
        return ops.zeros_like(wo.z)

    def sample(self, wo, u, mode="radiance"):
        eta = ops.where(wo.z >= 0.0, self.eta, 1.0 / self.eta)
        cos = ops.maximum(ops.abs(wo.z), 1e-6)
        cos_t = fresnel.cos_transmitted(cos, eta)
        f = fresnel.kind("exact").dielectric(cos, cos_t, eta)
        mirrors = u.x < f
        bent = ops.vec3(wo.x / eta, wo.y / eta, -ops.copysign(cos_t, wo.z))
        wi = ops.where(mirrors, frame.mirror(wo), bent)
        t = self.tint * ((1.0 - f) if mode == "importance" else (1.0 - f) / ops.sqr(eta))
        value = ops.where(mirrors, f + 0.0 * t, t)
        chance = ops.where(mirrors, f, 1.0 - f)
        return delta_sample(wo, wi, value, chance, ~mirrors, ops.where(mirrors, 1.0, eta))

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "always"


class SwapMirror(go.BSDF):
    """A delta reflection that exchanges steep and grazing: theta_i = pi / 2 - theta_o, opposite azimuth.

    In the projected disk the squared radius s = sin^2 theta goes to 1 - s and the azimuth is kept up to a half turn, so
    |cos| dw = ds dphi / 2 is preserved, and the map is its own inverse: reciprocal and conserving for albedo <= 1.
    Only within 1e-6 of the normal and of the horizon, which go to one another, the sample fails.
    """

    albedo: go.Colour = go.spectrum((0.9, 0.6, 0.0), "fraction reflected", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.albedo * ops.zeros_like(wo.z)

    def pdf(self, wo, wi):
        return ops.zeros_like(wo.z)

    def sample(self, wo, u, mode="radiance"):
        around = frame.azimuth(wo)
        wi = ops.vec3(-around.x * wo.z, -around.y * wo.z, ops.safe_sqrt(frame.sin2(wo)))
        ok = (wo.z > 1e-6) & (wi.z > 1e-6)
        one = ops.where(ok, 1.0 + 0.0 * wo.z, 0.0)
        return go.Sample(wi, self.albedo * one, one, ok, ops.ones_like(wo.z))

    @property
    def delta(self):
        return "always"


class Kaleidoscope(go.BSDF):
    """A delta reflection whose azimuth is mirrored at an axis that depends on the ring of cos theta.

    (x, y, z) goes to (M(z) (x, y), z), M(z) a reflection of the plane at one of four axes, by z alone. M^2 = 1 and z is
    unchanged, so the map is its own inverse, and it preserves dw and cos: reciprocal, albedo <= 1 conserves. On one
    ring it is a corner that reflects back along x, on others the lobe leaves the plane of incidence: not isotropic.
    """

    albedo: go.Colour = go.spectrum((1.0, 0.4, 0.4), "fraction reflected", low=0.0, high=1.0)
    turn: go.Angle = go.angle(0.3, "angle of the axes")

    def eval(self, wo, wi, mode="radiance"):
        return self.albedo * ops.zeros_like(wo.z)

    def pdf(self, wo, wi):
        return ops.zeros_like(wo.z)

    def sample(self, wo, u, mode="radiance"):
        w = frame.rotate(wo, self.turn)
        twice = ops.where(w.z < 0.25, 0.0 * w.z, ops.where(w.z < 0.5, 1.0, ops.where(w.z < 0.75, 2.5, ops.pi)))
        s, c = ops.sincos(twice)
        wi = frame.rotate_back(ops.vec3(c * w.x + s * w.y, s * w.x - c * w.y, w.z), self.turn)
        ok = wo.z > 0.0
        one = ops.where(ok, 1.0 + 0.0 * wo.z, 0.0)
        return go.Sample(wi, self.albedo * one, one, ok, ops.ones_like(wo.z))

    @property
    def delta(self):
        return "always"

    @property
    def isotropic(self):
        return False


class Twister(go.BSDF):
    """A sheet that lets light through and turns its azimuth: by +turn seen from above, by -turn from below.

    From above wi = -R(turn) wo; from below wi = -R(-turn) wo, the inverse, so both ways along a path agree: reciprocal.
    A rotation about the normal preserves solid angle and cosine. It commutes with all rotations about the normal, so
    the sheet is isotropic, though without mirror symmetry.
    """

    passed: go.Colour = go.spectrum((0.2, 0.9, 0.7), "fraction that passes", low=0.0, high=1.0)
    turn: go.Angle = go.angle(0.8, "by how much the azimuth is turned")

    def eval(self, wo, wi, mode="radiance"):
        return self.passed * ops.zeros_like(wo.z)

    def pdf(self, wo, wi):
        return ops.zeros_like(wo.z)

    def sample(self, wo, u, mode="radiance"):
        wi = -ops.where(wo.z > 0.0, frame.rotate_back(wo, self.turn), frame.rotate(wo, self.turn))
        one = ops.ones_like(wo.z)
        return go.Sample(wi, self.passed * one, one, one > 0.0, one)

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "always"


class Blinds(go.BSDF):
    """Thin slats along y: light passes straight on where the slope x / z falls into a gap, else it meets matte paint.

    T(w) = 1 where frac(count x / z) < gap, else 0 (|z| at least 0.02 here). x / z is the same for w and -w, so T is the same both ways. The paint,
    on either side: f = paint (1 - T(wo)) (1 - T(wi)) / pi, symmetric. Power: T + paint (1 - T) at most <= 1. Samples
    choose the gaps with probability 0.5 even where there are none (weight 0).
    """

    paint: go.Colour = go.spectrum((0.8, 0.8, 0.1), "albedo of the slats", low=0.0, high=1.0)
    count: go.Number = go.number(2.0, "gaps per unit slope", low=0.0, high=8.0)
    gap: go.Number = go.number(0.5, "fraction of gaps", low=0.0, high=1.0)
    turn: go.Angle = go.angle(0.0, "angle of the slats")

    def through(self, w):
        w = frame.rotate(w, self.turn)
        slope = self.count * w.x / ops.copysign(ops.maximum(ops.abs(w.z), 0.02), w.z)
        return ops.where(slope - ops.floor(slope) < self.gap, 1.0 + 0.0 * slope, 0.0)

    def eval(self, wo, wi, mode="radiance"):
        f = (1.0 - self.through(wo)) * (1.0 - self.through(wi)) * ops.abs(wi.z) * ops.inv_pi
        return self.paint * ops.where(wo.z * wi.z > 0.0, f, 0.0)

    def pdf(self, wo, wi):
        return ops.where(wo.z * wi.z > 0.0, (0.5 * ops.inv_pi) * ops.abs(wi.z), 0.0)

    def sample(self, wo, u, mode="radiance"):
        straight = u.x < 0.5
        local = warp.square_to_cosine_hemisphere(u.y, u.z)
        wi = ops.where(straight, -wo, ops.vec3(local.x, local.y, ops.copysign(local.z, wo.z)))
        density = self.pdf(wo, wi)
        painted = self.eval(wo, wi, mode) * ops.safe_div(1.0, density)
        weight = ops.where(straight, 2.0 * self.through(wo) + 0.0 * painted, painted)
        return go.Sample(wi, weight, ops.where(straight, 0.5, density), straight, ops.ones_like(density))

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "maybe"

    @property
    def isotropic(self):
        return False


PANES = {"1": "one pane", "2": "two panes", "5": "five panes"}


class PaneStack(go.BSDF):
    """1, 2 or 5 parallel panes of glass with air between them, bounces inside and between all of them summed.

    A pane has R = r + t^2 r a^2 / (1 - r^2 a^2), T = t^2 a / (1 - r^2 a^2), with a the fraction that one crossing
    leaves; panes are added by R12 = R1 + T1^2 R2 / (1 - R1 R2), T12 = T1 T2 / (1 - R1 R2), which keeps R + T <= 1, and
    equal panes look the same from both sides. By |cos| alone: reciprocal. At grazing angles r = 1: R = 1, T = 0.
    """

    panes: str = go.choice("5", "how many panes", PANES)
    clear: go.Colour = go.spectrum((1.0, 0.95, 0.6), "fraction that one crossing leaves", low=0.0, high=1.0)
    eta: go.Number = go.number(1.5, "index of the glass", low=1.0, high=3.0)

    def both(self, wo):
        cos = ops.maximum(ops.abs(wo.z), 1e-4)
        r = fresnel.kind("exact").dielectric(cos, fresnel.cos_transmitted(cos, self.eta), self.eta)
        t, a = 1.0 - r, self.clear
        left = 1.0 / ops.maximum(1.0 - a * a * (r * r), 1e-9)
        one_r, one_t = a * a * (t * t * r) * left + r, a * (t * t) * left
        R, T = one_r, one_t
        for _ in range(int(self.panes) - 1):
            over = 1.0 / ops.maximum(1.0 - R * one_r, 1e-9)
            R, T = R + T * T * one_r * over, T * one_t * over
        return R, T

    def eval(self, wo, wi, mode="radiance"):
        return self.clear * ops.zeros_like(wo.z)

    def pdf(self, wo, wi):
        return ops.zeros_like(wo.z)

    def sample(self, wo, u, mode="radiance"):
        R, T = self.both(wo)
        share = ops.safe_div(ops.mean(R), ops.mean(R) + ops.mean(T))
        mirrors = u.x < share
        wi = ops.where(mirrors, frame.mirror(wo), -wo)
        chance = ops.where(mirrors, share, 1.0 - share)
        return delta_sample(wo, wi, ops.where(mirrors, R, T), chance, ~mirrors, ops.ones_like(wo.z))

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "always"


class MirrorFrontMatteBack(go.BSDF):
    """An opaque sheet: a mirror from above, paint of another color from below.

    Above: delta with weight `silver` <= 1. Below: Lambert with albedo `paint` <= 1. No light crosses. `back_differs`.
    """

    silver: go.Colour = go.spectrum((1.0, 0.8, 0.5), "reflectance of the front", low=0.0, high=1.0)
    paint: go.Colour = go.spectrum((0.0, 0.3, 0.9), "albedo of the back", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.paint * self.pdf(wo, wi)

    def pdf(self, wo, wi):
        return ops.where((wo.z < 0.0) & (wi.z < 0.0), -wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        above = wo.z > 0.0
        local = warp.square_to_cosine_hemisphere(u.y, u.z)
        wi = ops.where(above, frame.mirror(wo), -local)
        density = self.pdf(wo, wi)
        painted = self.paint * ops.where(density > 0.0, 1.0 + 0.0 * density, 0.0)
        pdf = ops.where(above, 1.0, density)
        return go.Sample(wi, ops.where(above, self.silver, painted), pdf, above, ops.ones_like(pdf))

    @property
    def delta(self):
        return "maybe"

    @property
    def back_differs(self):
        return True


SOUND = [PulsedGap, BeerSlab, SchlickGlass, NegativeGlass, SwapMirror, Kaleidoscope, Twister, Blinds, PaneStack,
         MirrorFrontMatteBack]  # fmt: skip
