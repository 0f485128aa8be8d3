"""Choices, holes, rings, polynomials and stars. All reflect only: eval is 0 unless both directions are above the surface.

p is a direction's horizontal part (x, y); the area of the unit disk of p is the solid angle times the cosine. If f = h(p_o
+ p_i), or h(p_o - p_i) with h even, and the integral of h over the plane is at most 1, f is reciprocal and its albedo is
at most 1. Also, f <= 1 / pi implies an albedo of at most 1."""

import gonio as go
from gonio import ops
from gonio.optics import frame


def up(wo, wi):
    return (wo.z > 0.0) & (wi.z > 0.0)


def odd(k):
    """Whether a whole number is odd, also if negative."""
    return k - 2.0 * ops.floor(0.5 * k) > 0.5


def disk(x, y):
    """The direction above the point (x, y) of the unit disk and whether there is one; the normal if not."""
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


class ChoiceLobe(go.BSDF):
    """One lobe of three profiles, about the mirrored viewer, the viewer, or half each.

    exponential: h = exp(-d / r) / (2 pi r^2); dome: 2 / (pi r^2) (1 - d^2 / r^2) for d < r; rim: the ring 0.8 r < d < r,
    1 / (0.36 pi r^2). Each has the integral 1 over the plane and depends on |d| only, so it is even and isotropic.
    Sampler: the exponential's radius is the sum of two exponential variables, from u.x and u.y; dome: d^2 / r^2 = 1 -
    sqrt(1 - u); "both" folds u.z: below 1/2 the mirror. weight ks, or 0 outside of the disk."""

    ks: go.Colour = go.spectrum((1.0, 0.2, 0.0), "color", low=0.0, high=1.0)
    r: go.Number = go.number(0.1, "radius in the disk", low=0.003, high=5.0)
    profile: str = go.choice(
        "exponential", "the lobe", {"exponential": "a cusp with long tails", "dome": "a dome", "rim": "a ring"}
    )
    about: str = go.choice("both", "where", {"mirror": "mirrored", "retro": "back to the viewer", "both": "half each"})

    def h(self, x, y):
        d2 = x * x + y * y
        r2 = ops.sqr(self.r)
        if self.profile == "exponential":
            return ops.exp(-ops.safe_sqrt(d2) / self.r) * (0.5 * ops.inv_pi) / r2
        if self.profile == "dome":
            return ops.maximum(1.0 - d2 / r2, 0.0) * (2.0 * ops.inv_pi) / r2
        return ops.where((d2 < r2) & (d2 > 0.64 * r2), (ops.inv_pi / 0.36) / r2, 0.0)

    def pdf(self, wo, wi):
        mirror, retro = self.h(wo.x + wi.x, wo.y + wi.y), self.h(wo.x - wi.x, wo.y - wi.y)
        h = {"mirror": mirror, "retro": retro, "both": 0.5 * mirror + 0.5 * retro}[self.about]
        return ops.where(up(wo, wi), h * wi.z, 0.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.ks * self.pdf(wo, wi)

    def sample(self, wo, u, mode="radiance"):
        if self.profile == "exponential":
            r = -self.r * (ops.log(1.0 - u.x) + ops.log(1.0 - u.y))
        elif self.profile == "dome":
            r = self.r * ops.safe_sqrt(1.0 - ops.safe_sqrt(1.0 - u.y))
        else:
            r = self.r * ops.sqrt(0.64 + 0.36 * u.y)
        side = {"mirror": -1.0, "retro": 1.0, "both": ops.where(u.z < 0.5, -1.0, 1.0)}[self.about]
        turns = 2.0 * u.z if self.about == "both" else u.z  # whole turns do not matter
        s, c = ops.sincos(2.0 * ops.pi * turns)
        wi, ok = disk(side * wo.x + r * c, side * wo.y + r * s)
        return drawn(self, wo, wi, mode, ok)


class DeadHole(go.BSDF):
    """Matte with a dark hole about the mirror direction: f = kd / pi (1 - dark) where |p_o + p_i| < r. Only an eval.

    Right: symmetric, isotropic, at most 1 / pi. r beyond 2 changes nothing more (the hole covers the disk), r = 0 makes
    `dark` void."""

    kd: go.Colour = go.spectrum((1.0, 0.0, 0.4), "color", low=0.0, high=1.0)
    dark: go.Number = go.number(1.0, "how dark the hole is", low=0.0, high=1.0)
    r: go.Number = go.number(0.5, "radius of the hole", low=0.0, high=10.0)

    def eval(self, wo, wi, mode="radiance"):
        d2 = ops.sqr(wo.x + wi.x) + ops.sqr(wo.y + wi.y)
        f = ops.where(d2 < ops.sqr(self.r), 1.0 - self.dark, 1.0) * ops.inv_pi
        return self.kd * ops.where(up(wo, wi), f * wi.z, 0.0)


class ZernikePlate(go.BSDF):
    """Products of the first Zernike polynomials of both directions. Only an eval.

    f = kd / pi (1 + a A + b B + c C) / (1 + |a| + |b| + |c|),
    A = (2 s_o - 1)(2 s_i - 1), B = s_o s_i cos 2(phi_o - phi_i), C = (3 s_o - 2)(3 s_i - 2) p_o.p_i, s = sin^2.
    Right: each is symmetric, isotropic and in [-1, 1] (|3 r^3 - 2 r| <= 1), so 0 <= f <= 1 / pi; the polynomials are
    orthogonal to 1 over the disk, so every viewer sees kd / (1 + |a| + |b| + |c|)."""

    kd: go.Colour = go.spectrum((0.0, 1.0, 0.1), "color", low=0.0, high=1.0)
    a: go.Number = go.number(-0.8, "of A", low=-1.0, high=1.0)
    b: go.Number = go.number(1.0, "of B", low=-1.0, high=1.0)
    c: go.Number = go.number(0.5, "of C", low=-1.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        so, si = frame.sin2(wo), frame.sin2(wi)
        along = wo.x * wi.x + wo.y * wi.y
        total = 1.0 + self.a * (2.0 * so - 1.0) * (2.0 * si - 1.0) + self.b * (2.0 * ops.sqr(along) - so * si)
        total = total + self.c * (3.0 * so - 2.0) * (3.0 * si - 2.0) * along
        f = ops.maximum(total, 0.0) / (1.0 + ops.abs(self.a) + ops.abs(self.b) + ops.abs(self.c))
        return self.kd * ops.where(up(wo, wi), f * wi.z * ops.inv_pi, 0.0)


class FejerFan(go.BSDF):
    """A Fourier series in the azimuth between the directions: a ridge that sharpens toward grazing. Only an eval.

    f = kd / pi (1 + 2 sum_{k < n} (1 - k / n) rho^k cos k D), rho = sin_o sin_i, D the azimuth between them (from the
    mirrored viewer if `forward`). Right: at rho = 1 it is Fejer's kernel, not negative; inside it is its harmonic
    extension (Poisson's integral), so not negative either. Every term with k > 0 integrates to 0 over the azimuth of wi:
    every viewer sees exactly kd. Symmetric; a function of p_o.p_i and |p_o||p_i|, smooth at the normal. Up to n / pi."""

    kd: go.Colour = go.spectrum((1.0, 0.5, 0.0), "color", low=0.0, high=1.0)
    n: str = go.choice("6", "terms", {"2": "two", "6": "six", "12": "twelve"})
    forward: bool = go.flag(True, "the ridge lies opposite to the viewer")

    def eval(self, wo, wi, mode="radiance"):
        n = int(self.n)
        x = wo.x * wi.x + wo.y * wi.y  # rho cos D
        x = -x if self.forward else x
        rho2 = frame.sin2(wo) * frame.sin2(wi)
        before, now = 1.0 + 0.0 * x, x
        total = 1.0 + 2.0 * (1.0 - 1.0 / n) * now
        for k in range(2, n):
            before, now = now, 2.0 * x * now - rho2 * before
            total = total + 2.0 * (1.0 - k / n) * now
        return self.kd * ops.where(up(wo, wi), ops.maximum(total, 0.0) * wi.z * ops.inv_pi, 0.0)


class AnnulusHighlight(go.BSDF):
    """A bright ring about the mirror direction, black inside and outside: 1 / (pi t (2 a + t)) for a < |p_o + p_i| < a + t.

    Right: |p_o + p_i| is symmetric and isotropic; the ring's area is pi t (2 a + t), so the plane's integral is ks.
    Viewers may see nothing in the mirror direction itself. Sampler: uniform in the ring, the inner radius with large u;
    weight ks, or 0 outside of the disk; with a large ring most samples of steep viewers fail."""

    ks: go.Colour = go.spectrum((0.0, 0.0, 1.0), "color", low=0.0, high=1.0)
    a: go.Number = go.number(0.3, "inner radius", low=0.0, high=0.95)
    t: go.Number = go.number(0.05, "thickness", low=0.003, high=2.0)

    def area(self):
        return self.t * (2.0 * self.a + self.t)

    def pdf(self, wo, wi):
        d2 = ops.sqr(wo.x + wi.x) + ops.sqr(wo.y + wi.y)
        lit = (d2 > ops.sqr(self.a)) & (d2 < ops.sqr(self.a + self.t)) & up(wo, wi)
        return ops.where(lit, wi.z * ops.inv_pi / self.area(), 0.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.ks * self.pdf(wo, wi)

    def sample(self, wo, u, mode="radiance"):
        r = ops.sqrt(ops.sqr(self.a) + (1.0 - u.z) * self.area())
        s, c = ops.sincos(2.0 * ops.pi * u.y)
        wi, ok = disk(r * c - wo.x, r * s - wo.y)
        return drawn(self, wo, wi, mode, ok)


class SpikyStar(go.BSDF):
    """A star about the mirror direction: h = 2 cos^2(m phi) exp(-d^2 / s^2) / (pi s^2), (d, phi) of p_o + p_i.

    Right: p_o + p_i is symmetric; cos^2 has the mean 1/2, so the plane's integral is ks. Sampler by rejection: a
    Gaussian d is kept with probability cos^2(m phi) (u.x decides), else the sample fails with weight 0. The kept ones
    have the density h cos / 2, integral 1/2 at most, and weight 2 ks. Anisotropic: the star is fixed to the surface."""

    ks: go.Colour = go.spectrum((1.0, 1.0, 0.3), "color", low=0.0, high=1.0)
    s: go.Number = go.number(0.2, "width in the disk", low=0.005, high=2.0)
    turn: go.Angle = go.angle(0.4, "rotation of the star")
    m: str = go.choice("3", "half the number of rays", {"1": "two rays", "3": "six rays", "10": "twenty rays"})

    @property
    def isotropic(self):
        return False

    def kept(self, x, y):
        some = ops.abs(x) + ops.abs(y) > 0.0
        return ops.sqr(ops.cos(int(self.m) * ops.atan2(y, ops.where(some, x, 1.0))))

    def pdf(self, wo, wi):
        d = frame.rotate(ops.vec3(wo.x + wi.x, wo.y + wi.y, wo.z), self.turn)
        g = ops.exp(-(d.x * d.x + d.y * d.y) / ops.sqr(self.s)) * ops.inv_pi / ops.sqr(self.s)
        return ops.where(up(wo, wi), self.kept(d.x, d.y) * g * wi.z, 0.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.ks * (2.0 * self.pdf(wo, wi))

    def sample(self, wo, u, mode="radiance"):
        r = self.s * ops.safe_sqrt(-ops.log(1.0 - u.y))
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        keep = u.x < self.kept(r * c, r * s)
        d = frame.rotate_back(ops.vec3(r * c, r * s, wo.z), self.turn)
        wi, ok = disk(d.x - wo.x, d.y - wo.y)
        return drawn(self, wo, wi, mode, ok & keep)


class CapBelt(go.BSDF):
    """Steep viewers see grazing light only and the reverse; viewers between see black.

    f = kd / max(A, B) if one direction has a cosine above a and the other one below b, else 0; A = pi (1 - a^2) and B =
    pi b^2 are the cosine's integrals over the two. Right: symmetric; the albedo is kd B / max or kd A / max. a >= 1/2 >=
    b, so no direction is in both. Sampler: the cosine in the other part, density cos / B or cos / A; viewers between
    fail always."""

    kd: go.Colour = go.spectrum((1.0, 0.0, 0.0), "color", low=0.0, high=1.0)
    a: go.Number = go.number(0.9, "cosine at the cap's edge", low=0.5, high=0.999)
    b: go.Number = go.number(0.3, "cosine at the belt's edge", low=0.01, high=0.5)

    def parts(self):
        return ops.pi * (1.0 - self.a) * (1.0 + self.a), ops.pi * ops.sqr(self.b)

    def pairs(self, wo, wi):
        down = (wo.z > self.a) & (wi.z < self.b)
        across = (wo.z < self.b) & (wi.z > self.a)
        return up(wo, wi) & down, up(wo, wi) & across

    def eval(self, wo, wi, mode="radiance"):
        down, across = self.pairs(wo, wi)
        cap, belt = self.parts()
        return self.kd * ops.where(down | across, wi.z / ops.maximum(cap, belt), 0.0)

    def pdf(self, wo, wi):
        down, across = self.pairs(wo, wi)
        cap, belt = self.parts()
        return ops.where(down, wi.z / belt, ops.where(across, wi.z / cap, 0.0))

    def sample(self, wo, u, mode="radiance"):
        steep = wo.z > self.a
        s2 = u.y * (1.0 - self.a) * (1.0 + self.a)
        z = ops.where(steep, self.b * ops.sqrt(u.y), ops.safe_sqrt(1.0 - s2))
        r = ops.where(steep, ops.safe_sqrt(1.0 - ops.sqr(self.b) * u.y), ops.sqrt(s2))
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        return drawn(self, wo, ops.vec3(r * c, r * s, z), mode)


class LommelToon(go.BSDF):
    """Lommel-Seeliger's law with a stepped phase function: f = kd P / (2 pi (mu_o + mu_i)). Only an eval.

    P takes the values 1, `quarter` or `full` by steps of wo.wi. f has no upper bound where both directions graze, but f
    mu_i <= kd / (2 pi). Right: symmetric; the albedo at P = 1 is kd (1 - mu ln(1 + 1 / mu)) <= kd."""

    kd: go.Colour = go.spectrum((0.9, 0.9, 0.0), "color", low=0.0, high=1.0)
    quarter: go.Number = go.number(0.2, "phase function where wo.wi is in [0, 0.7)", low=0.0, high=1.0)
    full: go.Number = go.number(1.0, "phase function where wo.wi is above 0.7", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        x = ops.dot(wo, wi)
        phase = ops.where(x < 0.0, 1.0, ops.where(x < 0.7, self.quarter, self.full))
        f = phase * (0.5 * ops.inv_pi) / ops.maximum(wo.z + wi.z, 1e-30)
        return self.kd * ops.where(up(wo, wi), f * wi.z, 0.0)


class OppositionDot(go.BSDF):
    """Matte of one color with a dot of another color exactly about the viewer, however small. Only an eval.

    f = dot / pi where |p_o - p_i| < r, else base / pi. Right: symmetric, isotropic, at most 1 / pi."""

    base: go.Colour = go.spectrum((0.0, 0.2, 0.0), "color of the rest", low=0.0, high=1.0)
    dot: go.Colour = go.spectrum((1.0, 0.0, 1.0), "color of the dot", low=0.0, high=1.0)
    r: go.Number = go.number(0.05, "radius of the dot", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        d2 = ops.sqr(wo.x - wi.x) + ops.sqr(wo.y - wi.y)
        return ops.where(d2 < ops.sqr(self.r), self.dot, self.base) * ops.where(up(wo, wi), wi.z * ops.inv_pi, 0.0)


class BrushedLine(go.BSDF):
    """A line of light: a Gaussian in one axis of the disk and constant along the other, from rim to rim. Anisotropic.

    f = ks exp(-d_x^2 / a^2) / (2 sqrt(pi) a), d = p_o + p_i in the rotated frame. Right: symmetric; the Gaussian
    integrates to 1 over x and a chord of the disk is at most 2 long, so the albedo is at most ks (half the chord).
    Sampler: x by Box-Muller from u.x and u.y, y uniform in [-1, 1]; outside of the disk it fails; weight ks."""

    ks: go.Colour = go.spectrum((1.0, 0.0, 0.0), "color", low=0.0, high=1.0)
    a: go.Number = go.number(0.02, "width across the line", low=0.002, high=3.0)
    turn: go.Angle = go.angle(0.6, "rotation")

    @property
    def isotropic(self):
        return False

    def pdf(self, wo, wi):
        d = frame.rotate(ops.vec3(wo.x + wi.x, wo.y + wi.y, wo.z), self.turn)
        h = ops.exp(-ops.sqr(d.x / self.a)) * (0.5 / ops.pi**0.5) / self.a
        return ops.where(up(wo, wi), h * wi.z, 0.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.ks * self.pdf(wo, wi)

    def sample(self, wo, u, mode="radiance"):
        o = frame.rotate(wo, self.turn)
        x = self.a * ops.safe_sqrt(-ops.log(1.0 - u.x)) * ops.cos(2.0 * ops.pi * u.y) - o.x
        back = frame.rotate_back(ops.vec3(x, 2.0 * u.z - 1.0, o.z), self.turn)
        wi, ok = disk(back.x, back.y)
        return drawn(self, wo, wi, mode, ok)


SOUND = [
    ChoiceLobe,
    DeadHole,
    ZernikePlate,
    FejerFan,
    AnnulusHighlight,
    SpikyStar,
    CapBelt,
    LommelToon,
    OppositionDot,
    BrushedLine,
]
