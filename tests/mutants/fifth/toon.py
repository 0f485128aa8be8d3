"""Toon and stepped shading. All reflect only: eval is 0 unless both directions are above the surface.

Used throughout: f <= 1 / pi everywhere implies an albedo of at most 1, since the cosine integrates to pi."""

import gonio as go
from gonio import ops
from gonio.optics import frame


def up(wo, wi):
    return (wo.z > 0.0) & (wi.z > 0.0)


def odd(k):
    """Whether a whole number is odd, also if negative."""
    return k - 2.0 * ops.floor(0.5 * k) > 0.5


def disk(x, y):
    """The direction above the point (x, y) of the unit disk and whether there is one; the normal if not.

    An area of the disk is the solid angle times the cosine."""
    r2 = x * x + y * y
    inside = r2 < 1.0
    wi = ops.vec3(ops.where(inside, x, 0.0), ops.where(inside, y, 0.0), ops.where(inside, ops.safe_sqrt(1.0 - r2), 1.0))
    return wi, inside


def drawn(self, wo, wi, mode, ok=None):
    """weight = eval / pdf; weight 0 and pdf 0 where the draw failed."""
    pdf = self.pdf(wo, wi)
    if ok is not None:
        pdf = ops.where(ok, pdf, 0.0)
    weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
    return go.Sample.of_density(wi, weight, pdf)


class ToonBands(go.BSDF):
    """f = kd / pi L(mu_o) L(mu_i) with L a staircase of any real number of steps. Only an eval.

    Right: L = min(1, (floor(levels mu) + 1) / levels) is in (0, 1], so f <= 1 / pi; a product of one function of each
    direction is reciprocal; it depends on cosines only, so it is isotropic."""

    kd: go.Colour = go.spectrum((1.0, 0.6, 0.0), "color", low=0.0, high=1.0)
    levels: go.Number = go.number(3.5, "number of steps, need not be whole", low=1.0, high=64.0)

    def level(self, mu):
        return ops.minimum((ops.floor(self.levels * mu) + 1.0) / self.levels, 1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where(up(wo, wi), self.level(wo.z) * self.level(wi.z) * wi.z * ops.inv_pi, 0.0)


class ToonTwoTone(go.BSDF):
    """Two flat tones, divided where a symmetric quantity crosses a threshold. Cosine sampler.

    Right: half = n.h, product = mu_o mu_i, sum = (mu_o + mu_i) / 2 do not change if the directions are exchanged; the
    tones are at most 1 / pi."""

    lit: go.Colour = go.spectrum((1.0, 1.0, 0.0), "tone of the lit part", low=0.0, high=1.0)
    shade: go.Colour = go.spectrum((0.0, 0.0, 0.3), "tone of the shade", low=0.0, high=1.0)
    threshold: go.Number = go.number(0.8, "where the tone changes", low=0.0, high=1.0)
    criterion: str = go.choice(
        "half", "what is compared", {"half": "n.h", "product": "the product of cosines", "sum": "their mean"}
    )
    swapped: bool = go.flag(False, "exchange the tones")

    def quantity(self, wo, wi):
        if self.criterion == "half":
            return frame.half_vector(wo, wi).z
        if self.criterion == "product":
            return wo.z * wi.z
        return 0.5 * (wo.z + wi.z)

    def eval(self, wo, wi, mode="radiance"):
        first, second = (self.shade, self.lit) if self.swapped else (self.lit, self.shade)
        tone = ops.where(self.quantity(wo, wi) > self.threshold, first, second)
        return tone * ops.where(up(wo, wi), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(up(wo, wi), wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        return self.sample_cosine(wo, u, mode)


class ToonHighlightDisk(go.BSDF):
    """A highlight with a hard rim over a matte base: f = ks h + kd (1 - ks) / pi, h = 1 / (pi r^2) for |p_o + p_i| < r.

    p is a direction's horizontal part. Right: d p = cos dw, so the highlight's albedo is ks times the fraction of the
    disk of radius r about -p_o that lies in the unit disk: at most ks, and ks + (1 - ks) kd <= 1. |p_o + p_i| is
    symmetric and does not change if both rotate. r > 2 is a flat, dark highlight, most samples of which fall outside.
    Sampler: the rim's disk for 70 %, else the cosine; pdf is exactly this mixture, positive in the whole hemisphere."""

    kd: go.Colour = go.spectrum((0.0, 0.3, 0.8), "base", low=0.0, high=1.0)
    ks: go.Colour = go.spectrum((1.0, 0.0, 0.0), "highlight", low=0.0, high=1.0)
    r: go.Number = go.number(0.2, "radius of the highlight", low=0.001, high=3.0)

    def h(self, wo, wi):
        d2 = ops.sqr(wo.x + wi.x) + ops.sqr(wo.y + wi.y)
        return ops.where(d2 < ops.sqr(self.r), ops.inv_pi / ops.sqr(self.r), 0.0)

    def eval(self, wo, wi, mode="radiance"):
        f = self.ks * self.h(wo, wi) + self.kd * (1.0 - self.ks) * ops.inv_pi
        return f * ops.where(up(wo, wi), wi.z, 0.0)

    def pdf(self, wo, wi):
        return ops.where(up(wo, wi), (0.7 * self.h(wo, wi) + 0.3 * ops.inv_pi) * wi.z, 0.0)

    def sample(self, wo, u, mode="radiance"):
        base = u.x < 0.3
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        r = self.r * ops.sqrt(u.y)
        x = ops.where(base, ops.sqrt(u.y) * c, r * c - wo.x)
        y = ops.where(base, ops.sqrt(u.y) * s, r * s - wo.y)
        wi, ok = disk(x, y)
        return drawn(self, wo, wi, mode, ok)


class CelOutline(go.BSDF):
    """A matte cap with a black outline: f = kd / (pi (1 - e^2)) where both cosines exceed e, else black.

    Right: the cosine integrates to pi (1 - e^2) over the cap, so every viewer in the cap sees exactly kd, every other
    one black. The condition is the same for both directions. At e near 1 it is black for nearly everyone. The sampler
    draws in the cap also for viewers that see black: f = 0 there, weight 0, at a positive pdf (exactly cos / (pi (1 -
    e^2)) in the cap, integral 1)."""

    kd: go.Colour = go.spectrum((0.0, 1.0, 0.2), "color", low=0.0, high=1.0)
    edge: go.Number = go.number(0.5, "cosine at the outline", low=0.0, high=0.999)

    def density(self, wi):
        over = 1.0 / (ops.pi * (1.0 - self.edge) * (1.0 + self.edge))
        return ops.where(wi.z > self.edge, wi.z * over, 0.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where(up(wo, wi) & (wo.z > self.edge), self.density(wi), 0.0)

    def pdf(self, wo, wi):
        return ops.where(up(wo, wi), self.density(wi), 0.0)

    def sample(self, wo, u, mode="radiance"):
        r = ops.sqrt((1.0 - self.edge) * (1.0 + self.edge) * u.y)
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        wi, ok = disk(r * c, r * s)
        return drawn(self, wo, wi, mode, ok)


class HatchSum(go.BSDF):
    """Hatched: kd / pi where floor(k (mu_o + mu_i)) is even, else 0; k = 0 is Lambert. Only an eval.

    Right: symmetric, at most 1 / pi, depends on cosines only."""

    kd: go.Colour = go.spectrum((1.0, 0.0, 1.0), "color", low=0.0, high=1.0)
    k: go.Number = go.number(7.0, "lines per unit of cosine", low=0.0, high=200.0)
    inverted: bool = go.flag(False, "black where it is lit otherwise")

    def eval(self, wo, wi, mode="radiance"):
        dark = odd(ops.floor(self.k * (wo.z + wi.z)))
        dark = ~dark if self.inverted else dark
        return self.kd * ops.where(up(wo, wi) & ~dark, wi.z * ops.inv_pi, 0.0)


class FanRelative(go.BSDF):
    """Sectors of the azimuth between the two directions are lit and black in turn. Only an eval.

    Right: the angle atan2(|p_o x p_i|, p_o.p_i) in [0, pi] does not change if the directions are exchanged, or both
    rotated; f <= 1 / pi. At the normal, which has no azimuth, the angle is defined as 0 for all partners, on both
    sides of the exchange."""

    kd: go.Colour = go.spectrum((0.2, 1.0, 0.0), "color", low=0.0, high=1.0)
    sectors: str = go.choice("5", "sectors of a half turn", {"2": "two", "5": "five", "12": "twelve"})

    def eval(self, wo, wi, mode="radiance"):
        across = ops.abs(wo.x * wi.y - wo.y * wi.x)
        along = wo.x * wi.x + wo.y * wi.y
        some = across + ops.abs(along) > 0.0
        angle = ops.atan2(across, ops.where(some, along, 1.0))
        dark = odd(ops.floor(angle * (int(self.sectors) * ops.inv_pi)))
        return self.kd * ops.where(up(wo, wi) & ~dark, wi.z * ops.inv_pi, 0.0)


class PieSlices(go.BSDF):
    """Slices fixed on the surface: f = 2 kd / pi if both azimuths are in lit slices, else black. Anisotropic.

    Right: lit slices cover half of all azimuths, so the cosine integrates to pi / 2 over them and a lit viewer sees
    exactly kd; a viewer in a black slice sees black. The condition is the same for both directions. The sampler picks
    a lit slice: density 2 cos / pi there, integral 1; for black viewers it has no samples (weight and pdf 0)."""

    kd: go.Colour = go.spectrum((1.0, 0.3, 0.0), "color", low=0.0, high=1.0)
    turn: go.Angle = go.angle(0.3, "rotation of the slices")
    slices: str = go.choice("3", "lit slices", {"1": "half", "3": "three", "7": "seven"})

    @property
    def isotropic(self):
        return False

    def lit(self, w):
        w = frame.rotate(w, self.turn)
        some = ops.abs(w.x) + ops.abs(w.y) > 0.0
        phi = ops.atan2(w.y, ops.where(some, w.x, 1.0))
        return ~odd(ops.floor(phi * (int(self.slices) * ops.inv_pi)))

    def pdf(self, wo, wi):
        return ops.where(up(wo, wi) & self.lit(wo) & self.lit(wi), wi.z * (2.0 * ops.inv_pi), 0.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * self.pdf(wo, wi)

    def sample(self, wo, u, mode="radiance"):
        n = int(self.slices)
        slice_ = ops.floor(u.z * n)
        s, c = ops.sincos((2.0 * slice_ + (u.z * n - slice_)) * (ops.pi / n))
        r = ops.sqrt(u.y)
        wi = frame.rotate_back(ops.vec3(r * c, r * s, ops.safe_sqrt(1.0 - u.y)), self.turn)
        return drawn(self, wo, wi, mode)


class BullsEye(go.BSDF):
    """Rings of equal projected area about the normal, lit and black in turn; f = 2 kd / pi between lit rings.

    Right: the rings are steps of sin^2, which is uniform under the cosine, and half of them are lit: a lit viewer sees
    exactly kd, any other black. Sampler: u.x picks the lit ring, u.y the place in it; density 2 cos / pi."""

    kd: go.Colour = go.spectrum((1.0, 0.0, 0.0), "color", low=0.0, high=1.0)
    rings: str = go.choice("8", "number of rings", {"2": "two", "8": "eight", "40": "forty"})

    def lit(self, w):
        return ~odd(ops.floor(frame.sin2(w) * int(self.rings)))

    def pdf(self, wo, wi):
        return ops.where(up(wo, wi) & self.lit(wo) & self.lit(wi), wi.z * (2.0 * ops.inv_pi), 0.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * self.pdf(wo, wi)

    def sample(self, wo, u, mode="radiance"):
        n = int(self.rings)
        ring = ops.floor(u.x * (n // 2))
        s2 = (2.0 * ring + u.y) / n
        r = ops.sqrt(s2)
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        return drawn(self, wo, ops.vec3(r * c, r * s, ops.safe_sqrt(1.0 - s2)), mode)


class PosterFresnel(go.BSDF):
    """A lookup of four levels by the angle between the directions. Sampled uniformly over the hemisphere.

    Right: wo.wi is symmetric and rotation changes nothing; the levels are at most 1, so f <= 1 / pi. Sampler: z = u.y,
    density 1 / (2 pi) above; weight = 2 kd level mu_i <= 2, mean at most 1."""

    kd: go.Colour = go.spectrum((0.9, 1.0, 0.0), "color", low=0.0, high=1.0)
    a: go.Number = go.number(0.0, "level of directions more than a right angle apart", low=0.0, high=1.0)
    b: go.Number = go.number(1.0, "level up to a right angle", low=0.0, high=1.0)
    c: go.Number = go.number(0.1, "level where the cosine is above 0.5", low=0.0, high=1.0)
    d: go.Number = go.number(0.7, "level where the cosine is above 0.95", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        x = ops.dot(wo, wi)
        level = ops.where(x < 0.0, self.a, ops.where(x < 0.5, self.b, ops.where(x < 0.95, self.c, self.d)))
        return self.kd * ops.where(up(wo, wi), level * wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(up(wo, wi), 0.5 * ops.inv_pi + 0.0 * wi.z, 0.0)

    def sample(self, wo, u, mode="radiance"):
        r = ops.safe_sqrt((1.0 - u.y) * (1.0 + u.y))
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        return drawn(self, wo, ops.vec3(r * c, r * s, u.y), mode)


class ToonSaturated(go.BSDF):
    """Each channel is switched on at its own threshold of n.h: red first, blue only at the center. Only an eval.

    Right: n.h is symmetric; each channel is 0 or at most 1 / pi."""

    kd: go.Colour = go.spectrum(1.0, "color", low=0.0, high=1.0)
    first: go.Number = go.number(0.4, "threshold of the first channel", low=0.0, high=1.0)
    step: go.Number = go.number(0.25, "from each channel's threshold to the next", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        high = frame.half_vector(wo, wi).z
        value = ops.where(up(wo, wi), wi.z * ops.inv_pi, 0.0)
        parts = ops.channels(self.kd)
        return ops.of_channels(
            self.kd, [k * ops.where(high > self.first + i * self.step, value, 0.0) for i, k in enumerate(parts)]
        )


SOUND = [
    ToonBands,
    ToonTwoTone,
    ToonHighlightDisk,
    CelOutline,
    HatchSum,
    FanRelative,
    PieSlices,
    BullsEye,
    PosterFresnel,
    ToonSaturated,
]
