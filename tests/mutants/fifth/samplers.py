"""Right samplers of an odd kind, and kernels that exchange parts of the hemisphere. All reflect only: eval is 0 unless
both directions are above the surface.

Used throughout: f <= 1 / pi implies an albedo of at most 1. And if the hemisphere is cut into n parts, over each of which
the cosine integrates to pi / n, and f = n kd / pi where part(i) = P(part(o)), else 0, with a permutation P that is its own
inverse, then f is reciprocal and every viewer sees exactly kd."""

import gonio as go
from gonio import ops
from gonio.optics import frame, warp


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


class ForwardBackward(go.BSDF):
    """One color forward (p_o.p_i < 0), another backward; 90 % of the samples go forward, whatever the colors.

    Right: p_o.p_i is symmetric and unchanged by rotation; f <= 1 / pi. At the normal p_o.p_i = 0 is backward on both
    sides of the exchange. Sampler: the cosine, mirrored into the chosen half of the azimuths of wo: density 2 cos / pi
    times 0.9 or 0.1, integral 1; weight at most 5."""

    forward: go.Colour = go.spectrum((1.0, 0.0, 0.0), "color forward", low=0.0, high=1.0)
    backward: go.Colour = go.spectrum((0.0, 0.0, 1.0), "color backward", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        ahead = wo.x * wi.x + wo.y * wi.y < 0.0
        return ops.where(ahead, self.forward, self.backward) * ops.where(up(wo, wi), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        axis = frame.azimuth(wo)
        ahead = axis.x * wi.x + axis.y * wi.y < 0.0
        return ops.where(up(wo, wi), ops.where(ahead, 1.8, 0.2) * wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        w = warp.square_to_cosine_hemisphere(u.y, u.z)
        along = ops.where(u.x < 0.9, -ops.abs(w.x), ops.abs(w.x))
        return drawn(self, wo, frame.rotate_back(ops.vec3(along, w.y, w.z), frame.azimuth(wo)), mode)


class SquareChecks(go.BSDF):
    """A chessboard in the disk of p_o + p_i. Points are drawn in a square; those outside of the disk fail. Anisotropic.

    Right: p_o + p_i is symmetric; f is 0 or kd / pi. Sampler: p_i uniform in [-1, 1]^2, density cos / 4 in the disk,
    whose integral is pi / 4; the other 21 % have weight and pdf 0; weight kd 4 / pi or 0."""

    kd: go.Colour = go.spectrum((0.0, 1.0, 1.0), "color", low=0.0, high=1.0)
    n: go.Number = go.number(4.0, "fields per unit", low=0.0, high=100.0)
    turn: go.Angle = go.angle(0.2, "rotation of the board")

    @property
    def isotropic(self):
        return False

    def eval(self, wo, wi, mode="radiance"):
        d = frame.rotate(ops.vec3(wo.x + wi.x, wo.y + wi.y, wo.z), self.turn)
        dark = odd(ops.floor(self.n * d.x) + ops.floor(self.n * d.y))
        return self.kd * ops.where(up(wo, wi) & ~dark, wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(up(wo, wi), 0.25 * wi.z, 0.0)

    def sample(self, wo, u, mode="radiance"):
        wi, ok = disk(2.0 * u.y - 1.0, 1.0 - 2.0 * u.z)
        return drawn(self, wo, wi, mode, ok)


class WholeSphere(go.BSDF):
    """Waves in the product of the cosines, sampled uniformly over the whole sphere.

    f = kd / pi cos^2(k mu_o mu_i) <= 1 / pi, symmetric. Sampler: uniform over the sphere; the lower half fails (weight
    and pdf 0), so the pdf is 1 / (4 pi) above and integrates to 1/2; weight 4 kd cos^2 mu_i."""

    kd: go.Colour = go.spectrum((0.6, 0.0, 1.0), "color", low=0.0, high=1.0)
    k: go.Number = go.number(15.0, "waves", low=0.0, high=300.0)

    def eval(self, wo, wi, mode="radiance"):
        wave = ops.sqr(ops.cos(self.k * (wo.z * wi.z)))
        return self.kd * ops.where(up(wo, wi), wave * wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(up(wo, wi), 0.25 * ops.inv_pi + 0.0 * wi.z, 0.0)

    def sample(self, wo, u, mode="radiance"):
        r = 2.0 * ops.safe_sqrt(u.y * (1.0 - u.y))
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        return drawn(self, wo, ops.vec3(r * c, r * s, 1.0 - 2.0 * u.y), mode)


class PoorPower(go.BSDF):
    """f = kd (p + 2) / (2 pi) (mu_o mu_i)^p: bright from above only. Sampled by half the exponent.

    Right: symmetric; int mu^(p + 1) dw = 2 pi / (p + 2), so the albedo is kd mu_o^p. Sampler: a power lobe about the
    normal with q = p / 2; toward grazing its pdf vanishes, but f cos vanishes faster: weight = kd (p + 2) / (q + 1)
    mu_o^p mu_i^(p + 1 - q) <= 2."""

    kd: go.Colour = go.spectrum((1.0, 0.0, 0.5), "color", low=0.0, high=1.0)
    p: go.Number = go.number(12.0, "exponent", low=0.0, high=500.0)

    def eval(self, wo, wi, mode="radiance"):
        f = (self.p + 2.0) * (0.5 * ops.inv_pi) * ops.pow(wo.z, self.p) * ops.pow(wi.z, self.p)
        return self.kd * ops.where(up(wo, wi), f * wi.z, 0.0)

    def pdf(self, wo, wi):
        return ops.where(up(wo, wi), warp.square_to_power_lobe_pdf(wi.z, 0.5 * self.p), 0.0)

    def sample(self, wo, u, mode="radiance"):
        return drawn(self, wo, warp.square_to_power_lobe(u.y, u.z, 0.5 * self.p), mode)


class FourLobes(go.BSDF):
    """A hard disk about the mirror, a Gaussian back to the viewer, a matte part and a rim; chosen at 10, 20, 30, 40 %.

    f = (s_1 c_1 h(|p_o + p_i|) + s_2 c_2 g(|p_o - p_i|) + s_3 c_3 / pi + s_4 c_4 4 / pi (sin^2_o sin^2_i)^3) / max(1,
    s_1 + s_2 + s_3 + s_4), h and g of integral 1 over the plane. Right: each term is symmetric, isotropic and has an
    albedo of at most its color (the last one sin^6_o of it); the shares sum to at most 1. Sampler: fixed probabilities,
    whatever the shares; pdf = 0.1 h cos + 0.2 g cos + 0.3 cos / pi + 0.4 4 / pi sin^6_i cos; weight at most 10."""

    c1: go.Colour = go.spectrum((1.0, 0.0, 0.0), "color of the disk", low=0.0, high=1.0)
    c2: go.Colour = go.spectrum((0.0, 1.0, 0.0), "color of the Gaussian", low=0.0, high=1.0)
    c3: go.Colour = go.spectrum((0.0, 0.0, 1.0), "color of the matte part", low=0.0, high=1.0)
    c4: go.Colour = go.spectrum((1.0, 1.0, 0.0), "color of the rim", low=0.0, high=1.0)
    s1: go.Number = go.number(0.4, "share of the disk", low=0.0, high=1.0)
    s2: go.Number = go.number(0.3, "share of the Gaussian", low=0.0, high=1.0)
    s3: go.Number = go.number(0.2, "share of the matte part", low=0.0, high=1.0)
    s4: go.Number = go.number(0.9, "share of the rim", low=0.0, high=1.0)
    width: go.Number = go.number(0.1, "radius of the disk and width of the Gaussian", low=0.005, high=1.0)

    def lobes(self, wo, wi):
        w2 = ops.sqr(self.width)
        d2 = ops.sqr(wo.x + wi.x) + ops.sqr(wo.y + wi.y)
        e2 = ops.sqr(wo.x - wi.x) + ops.sqr(wo.y - wi.y)
        rim = ops.sqr(frame.sin2(wi)) * frame.sin2(wi) * (4.0 * ops.inv_pi)
        return ops.where(d2 < w2, ops.inv_pi / w2, 0.0), ops.exp(-e2 / w2) * ops.inv_pi / w2, rim

    def eval(self, wo, wi, mode="radiance"):
        h, g, rim = self.lobes(wo, wi)
        grazing = ops.sqr(frame.sin2(wo)) * frame.sin2(wo)
        f = self.c1 * (self.s1 * h) + self.c2 * (self.s2 * g) + self.c3 * (self.s3 * ops.inv_pi)
        f = f + self.c4 * (self.s4 * rim * grazing)
        return f * ops.where(up(wo, wi), wi.z / ops.maximum(self.s1 + self.s2 + self.s3 + self.s4, 1.0), 0.0)

    def pdf(self, wo, wi):
        h, g, rim = self.lobes(wo, wi)
        return ops.where(up(wo, wi), (0.1 * h + 0.2 * g + 0.3 * ops.inv_pi + 0.4 * rim) * wi.z, 0.0)

    def sample(self, wo, u, mode="radiance"):
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        matte = ops.sqrt(u.y)
        gauss = self.width * ops.safe_sqrt(-ops.log(1.0 - u.y))
        rim = ops.sqrt(ops.sqrt(matte))  # sin^2 = u^(1/4), so sin = u^(1/8)
        r = ops.where(u.x < 0.1, self.width * matte, ops.where(u.x < 0.3, gauss, ops.where(u.x < 0.6, matte, rim)))
        side = ops.where(u.x < 0.1, -1.0, ops.where(u.x < 0.3, 1.0, 0.0))
        wi, ok = disk(side * wo.x + r * c, side * wo.y + r * s)
        return drawn(self, wo, wi, mode, ok)


class SimilarElevation(go.BSDF):
    """Only light at nearly the viewer's own height is reflected: f = kd / pi where |mu_o - mu_i| < w, else black.

    Right: symmetric, at most 1 / pi. Sampler: mu_i uniform between max(0, mu_o - w) and min(1, mu_o + w), any azimuth:
    it covers just the lit band; density 1 / (2 pi (length of the band)), weight 2 kd mu_i length <= 2."""

    kd: go.Colour = go.spectrum((0.7, 1.0, 0.0), "color", low=0.0, high=1.0)
    w: go.Number = go.number(0.15, "half width of the band in the cosine", low=0.002, high=1.0)

    def band(self, wo):
        low = ops.maximum(wo.z - self.w, 0.0)
        return low, ops.minimum(wo.z + self.w, 1.0) - low

    def eval(self, wo, wi, mode="radiance"):
        lit = up(wo, wi) & (ops.abs(wo.z - wi.z) < self.w)
        return self.kd * ops.where(lit, wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        lit = up(wo, wi) & (ops.abs(wo.z - wi.z) < self.w)
        _, length = self.band(wo)
        return ops.where(lit, 0.5 * ops.inv_pi / ops.maximum(length, 1e-6), 0.0)

    def sample(self, wo, u, mode="radiance"):
        low, length = self.band(wo)
        z = ops.clamp(low + length * u.y, 0.0, 1.0)
        r = ops.safe_sqrt((1.0 - z) * (1.0 + z))
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        return drawn(self, wo, ops.vec3(r * c, r * s, z), mode)


class Quadrants(go.BSDF):
    """Light stays in the quadrant that it came from: f = 4 kd / pi in the same quadrant, else 0. Anisotropic.

    Right: parts of pi / 4 and P = identity (see the file). Sampler: the cosine, folded into the quadrant of wo: density
    4 cos / pi there, weight kd always."""

    kd: go.Colour = go.spectrum((1.0, 0.0, 0.0), "color", low=0.0, high=1.0)
    turn: go.Angle = go.angle(0.9, "rotation of the quadrants")

    @property
    def isotropic(self):
        return False

    def pdf(self, wo, wi):
        o, i = frame.rotate(wo, self.turn), frame.rotate(wi, self.turn)
        same_x = ((o.x >= 0.0) & (i.x >= 0.0)) | ((o.x < 0.0) & (i.x < 0.0))
        same_y = ((o.y >= 0.0) & (i.y >= 0.0)) | ((o.y < 0.0) & (i.y < 0.0))
        return ops.where(up(wo, wi) & same_x & same_y, wi.z * (4.0 * ops.inv_pi), 0.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * self.pdf(wo, wi)

    def sample(self, wo, u, mode="radiance"):
        o, w = frame.rotate(wo, self.turn), warp.square_to_cosine_hemisphere(u.y, u.z)
        x = ops.where(o.x >= 0.0, ops.abs(w.x), -ops.abs(w.x))
        y = ops.where(o.y >= 0.0, ops.abs(w.y), -ops.abs(w.y))
        return drawn(self, wo, frame.rotate_back(ops.vec3(x, y, w.z), self.turn), mode)


class Kaleidoscope(go.BSDF):
    """Each of n sectors of azimuth reflects into its mirror image only: sector j into n - 1 - j. Only an eval.

    Right: parts of pi / n and P(j) = n - 1 - j, its own inverse (see the file). f = n kd / pi, up to 8 / pi.
    Anisotropic. At the normal the azimuth is taken as 0 in both roles."""

    kd: go.Colour = go.spectrum((0.0, 0.8, 1.0), "color", low=0.0, high=1.0)
    turn: go.Angle = go.angle(0.0, "rotation of the sectors")
    n: str = go.choice("5", "sectors", {"3": "three", "5": "five", "8": "eight"})

    @property
    def isotropic(self):
        return False

    def sector(self, w):
        w = frame.rotate(w, self.turn)
        some = ops.abs(w.x) + ops.abs(w.y) > 0.0
        turns = 0.5 + (0.5 * ops.inv_pi) * ops.atan2(w.y, ops.where(some, w.x, 1.0))
        n = int(self.n)
        return ops.clamp(ops.floor(turns * n), 0.0, n - 1.0)

    def eval(self, wo, wi, mode="radiance"):
        n = int(self.n)
        partner = ops.abs(self.sector(wo) + self.sector(wi) - (n - 1.0)) < 0.5
        return self.kd * ops.where(up(wo, wi) & partner, wi.z * (n * ops.inv_pi), 0.0)


class RingSwap(go.BSDF):
    """n rings of equal projected area; light from ring j leaves by ring n - 1 - j (or by its own).

    Right: rings are steps of sin^2, parts of pi / n; both permutations are their own inverse (see the file). Steep views
    show grazing light and the reverse. Sampler: exactly the partner ring; density n cos / pi, weight kd. The first
    random number is not used."""

    kd: go.Colour = go.spectrum((1.0, 0.0, 0.0), "color", low=0.0, high=1.0)
    n: str = go.choice("6", "rings", {"2": "two", "6": "six", "25": "twenty-five"})
    partner: str = go.choice("swap", "where the light goes", {"swap": "ring n - 1 - j", "same": "ring j"})

    def ring(self, w):
        n = int(self.n)
        return ops.clamp(ops.floor(frame.sin2(w) * n), 0.0, n - 1.0)

    def target(self, wo):
        return (int(self.n) - 1.0) - self.ring(wo) if self.partner == "swap" else self.ring(wo)

    def pdf(self, wo, wi):
        lit = up(wo, wi) & (ops.abs(self.target(wo) - self.ring(wi)) < 0.5)
        return ops.where(lit, wi.z * (int(self.n) * ops.inv_pi), 0.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * self.pdf(wo, wi)

    def sample(self, wo, u, mode="radiance"):
        s2 = (self.target(wo) + u.z) / float(int(self.n))
        r = ops.sqrt(s2)
        s, c = ops.sincos(2.0 * ops.pi * u.y)
        return drawn(self, wo, ops.vec3(r * c, r * s, ops.safe_sqrt(1.0 - s2)), mode)


class RingColors(go.BSDF):
    """Rings of equal projected area: the first channel stays in its ring, the second goes to the mirrored one, the
    third to the neighbor in pairs (0-1, 2-3, ...); further channels stay. Only an eval.

    Right: parts of pi / n, n even; for every channel the permutation is its own inverse (see the file), so each channel
    has exactly the albedo kd. Most pairs of directions show one saturated color or black."""

    kd: go.Colour = go.spectrum(1.0, "color", low=0.0, high=1.0)
    n: str = go.choice("6", "rings", {"2": "two", "6": "six", "12": "twelve"})

    def ring(self, w):
        n = int(self.n)
        return ops.clamp(ops.floor(frame.sin2(w) * n), 0.0, n - 1.0)

    def eval(self, wo, wi, mode="radiance"):
        n = int(self.n)
        o, i = self.ring(wo), self.ring(wi)
        value = ops.where(up(wo, wi), wi.z * (n * ops.inv_pi), 0.0)
        targets = [o, (n - 1.0) - o, ops.where(odd(o), o - 1.0, o + 1.0)]
        parts = []
        for channel, k in enumerate(ops.channels(self.kd)):
            target = targets[channel] if channel < 3 else o
            parts.append(k * ops.where(ops.abs(target - i) < 0.5, value, 0.0))
        return ops.of_channels(self.kd, parts)


SOUND = [
    ForwardBackward,
    SquareChecks,
    WholeSphere,
    PoorPower,
    FourLobes,
    SimilarElevation,
    Quadrants,
    Kaleidoscope,
    RingSwap,
    RingColors,
]
