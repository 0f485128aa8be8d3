"""Materials in steps: Lambert's reflection times a symmetric pattern of at most 1."""

import gonio as go
from gonio import ops
from gonio.optics import frame, warp


def lit(wo, wi):
    """Whether both directions are above the surface."""
    return (wo.z > 0.0) & (wi.z > 0.0)


def drawn(material, wo, wi, mode):
    """The sample for a direction whose density is the material's pdf."""
    pdf = material.pdf(wo, wi)
    weight = material.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
    return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


def odd(k):
    """1 for odd whole numbers, 0 for even ones."""
    return k - 2.0 * ops.floor(0.5 * k)


class R1ToonSteps(go.BSDF):
    """A cartoon's matte: Lambert's reflection with staircases over both cosines."""

    kd: go.Colour = go.spectrum((0.9, 0.4, 0.1), "albedo", low=0.0, high=1.0)
    steps: go.Number = go.number(3.7, "steps of the staircase", low=1.0, high=40.0)

    def stair(self, z):
        return (ops.floor(self.steps * ops.clamp(z, 0.0, 1.0)) + 1.0) / (self.steps + 1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where(lit(wo, wi), self.stair(wo.z) * self.stair(wi.z) * wi.z * ops.inv_pi, 0.0)


class R1ToonHighlight(go.BSDF):
    """Three flat colors, selected by the half vector's height: core, rim and shade."""

    core: go.Colour = go.spectrum((1.0, 1.0, 0.2), "albedo of the core", low=0.0, high=1.0)
    rim: go.Colour = go.spectrum((1.0, 0.0, 0.6), "albedo of the rim", low=0.0, high=1.0)
    shade: go.Colour = go.spectrum((0.0, 0.05, 0.3), "albedo elsewhere", low=0.0, high=1.0)
    inner: go.Number = go.number(0.985, "cosine at the core's edge", low=0.93, high=0.9999)
    outer: go.Number = go.number(0.9, "cosine at the rim's edge", low=0.1, high=0.93)

    def eval(self, wo, wi, mode="radiance"):
        z = frame.half_vector(wo, wi).z
        color = ops.where(z > self.inner, self.core, ops.where(z > self.outer, self.rim, self.shade))
        return color * ops.where(lit(wo, wi), wi.z * ops.inv_pi, 0.0)


class R1Checkers(go.BSDF):
    """A checkerboard over the projected directions: pairs on fields of one color and pairs on different ones."""

    same: go.Colour = go.spectrum((0.95, 0.9, 0.8), "albedo between fields of one color", low=0.0, high=1.0)
    other: go.Colour = go.spectrum((0.0, 0.2, 0.02), "albedo between fields of different colors", low=0.0, high=1.0)
    fields: go.Number = go.number(3.0, "fields per unit length", low=0.5, high=25.0)
    rotation: go.Angle = go.angle(0.4, "of the board")

    @property
    def isotropic(self):
        return False

    def field(self, w):
        v = frame.rotate(w, self.rotation)
        return odd(ops.floor(v.x * self.fields + 0.31) + ops.floor(v.y * self.fields + 0.17))

    def eval(self, wo, wi, mode="radiance"):
        color = ops.where(ops.abs(self.field(wo) - self.field(wi)) < 0.5, self.same, self.other)
        return color * ops.where(lit(wo, wi), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        return drawn(self, wo, warp.square_to_cosine_hemisphere(u.y, u.z), mode)


class R1AzimuthWedges(go.BSDF):
    """Wedges of the azimuth between the two directions, each of another brightness."""

    kd: go.Colour = go.spectrum((0.2, 0.8, 1.0), "albedo", low=0.0, high=1.0)
    wedges: go.Number = go.number(4.5, "number of wedges", low=2.0, high=30.0)

    def eval(self, wo, wi, mode="radiance"):
        sines = ops.sqrt(ops.maximum(frame.sin2(wo) * frame.sin2(wi), 1e-12))
        cos = ops.clamp((wo.x * wi.x + wo.y * wi.y) / sines, -1.0, 1.0)
        level = (ops.floor(0.4997 * (cos + 1.0) * self.wedges) + 1.0) / (self.wedges + 1.0)
        return self.kd * ops.where(lit(wo, wi), level * wi.z * ops.inv_pi, 0.0)


class R1MirrorRings(go.BSDF):
    """Sharp rings around the mirrored direction in two colors, sampled over the whole sphere: half the samples fail."""

    even: go.Colour = go.spectrum((1.0, 1.0, 1.0), "albedo of the even rings", low=0.0, high=1.0)
    odd: go.Colour = go.spectrum((0.3, 0.0, 0.0), "albedo of the odd rings", low=0.0, high=1.0)
    rings: go.Number = go.number(6.3, "rings per unit length", low=0.25, high=50.0)

    def eval(self, wo, wi, mode="radiance"):
        distance = ops.sqrt(ops.sqr(wo.x + wi.x) + ops.sqr(wo.y + wi.y) + 1e-12)
        color = ops.where(odd(ops.floor(distance * self.rings)) > 0.5, self.odd, self.even)
        return color * ops.where(lit(wo, wi), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), 0.25 * ops.inv_pi + 0.0 * wi.z, 0.0)

    def sample(self, wo, u, mode="radiance"):
        z = 1.0 - 2.0 * u.y
        r = 2.0 * ops.safe_sqrt(u.y * (1.0 - u.y))
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        return drawn(self, wo, ops.vec3(r * c, r * s, z), mode)


class R1Moire(go.BSDF):
    """Crossed fringes over the sum of the projected directions."""

    kd: go.Colour = go.spectrum((1.0, 0.7, 1.0), "albedo", low=0.0, high=1.0)
    frequency: go.Number = go.number(-17.0, "of the fringes; its sign turns their slant", low=-60.0, high=60.0)
    phase: go.Number = go.number(-4.4, "of the fringes", low=-7.0, high=-3.0, unit="rad")

    @property
    def isotropic(self):
        return False

    def eval(self, wo, wi, mode="radiance"):
        x, y = wo.x + wi.x, wo.y + wi.y
        fringes = ops.cos(self.frequency * x + self.phase) * ops.cos(1.13 * ops.abs(self.frequency) * (y + 0.2 * x))
        return self.kd * ops.where(lit(wo, wi), (0.5 + 0.5 * fringes) * wi.z * ops.inv_pi, 0.0)


class R1NearlyBlack(go.BSDF):
    """Black, or at most a millionth: the light of a trap with a cosine's density."""

    kd: go.Colour = go.spectrum(0.0, "what is left of the light", low=0.0, high=1e-6)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where(lit(wo, wi), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        return self.sample_cosine(wo, u, mode)


class R1SkewedSampler(go.BSDF):
    """Lambert's reflection with a strange sampler: some samples are folded to x > 0, how many jumps with the viewer."""

    kd: go.Colour = go.spectrum((0.5, 0.99, 0.25), "albedo", low=0.0, high=1.0)
    folded: go.Number = go.number(0.8, "fraction of folded samples for a high viewer", low=0.0, high=0.95)

    @property
    def isotropic(self):
        return False  # its values are, its density is not

    def share(self, wo):
        return ops.where(wo.z > 0.47, self.folded, 0.3 * self.folded)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where(lit(wo, wi), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        share = self.share(wo)
        side = ops.where(wi.x > 0.0, 2.0 * share, 0.0 * share)
        return ops.where(lit(wo, wi), wi.z * ops.inv_pi * (1.0 - share + side), 0.0)

    def sample(self, wo, u, mode="radiance"):
        w = warp.square_to_cosine_hemisphere(u.y, u.z)
        x = ops.where(u.x < self.share(wo), ops.abs(w.x), w.x)
        return drawn(self, wo, ops.vec3(x, w.y, w.z), mode)


SOUND = [
    R1ToonSteps, R1ToonHighlight, R1Checkers, R1AzimuthWedges, R1MirrorRings, R1Moire, R1NearlyBlack, R1SkewedSampler,
]  # fmt: skip
