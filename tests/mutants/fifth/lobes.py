"""Very narrow and very wide lobes. All reflect only: eval is 0 unless both directions are above the surface.

Most are kernels on the unit disk: p is a direction's horizontal part (x, y), and the area of the disk is the solid angle
times the cosine. If f = h(p_o, p_i) with h(a, b) = h(b, a) and the integral of h over the whole plane of b is at most 1,
then f is reciprocal and its albedo is at most 1; what falls outside the disk is lost. The density of a direction drawn by
its p with density h is h cos."""

import gonio as go
from gonio import ops
from gonio.optics import frame, ndf, warp
from gonio.optics.special import exprel


def up(wo, wi):
    return (wo.z > 0.0) & (wi.z > 0.0)


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


class NarrowSheet(go.BSDF):
    """A Gaussian in the disk about the mirrored viewer, a hair in one direction and wide in the other.

    f = ks exp(-d_x^2 / a_x^2 - d_y^2 / a_y^2) / (pi a_x a_y), d = p_o + p_i in the rotated frame. Right: d is symmetric
    and the plane's integral is ks. Sampler: d by Box-Muller, with the random numbers mirrored (1 - u); the pdf is the
    Gaussian times cos, weight ks, or 0 outside of the disk. Anisotropic."""

    ks: go.Colour = go.spectrum((1.0, 0.9, 0.0), "color", low=0.0, high=1.0)
    alpha: go.Width = go.width((0.004, 0.6), "widths in the disk", low=0.002, high=1.0)
    rotation: go.Angle = go.angle(0.5, "rotation of the pair")

    @property
    def isotropic(self):
        return False

    def pdf(self, wo, wi):
        d = frame.rotate(ops.vec3(wo.x + wi.x, wo.y + wi.y, wo.z), self.rotation)
        h = ops.exp(-ops.sqr(d.x / self.alpha.x) - ops.sqr(d.y / self.alpha.y)) / (ops.pi * self.alpha.x * self.alpha.y)
        return ops.where(up(wo, wi), h * wi.z, 0.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.ks * self.pdf(wo, wi)

    def sample(self, wo, u, mode="radiance"):
        r = ops.safe_sqrt(-ops.log(1.0 - u.z))
        s, c = ops.sincos(2.0 * ops.pi * (1.0 - u.y))
        d = frame.rotate_back(ops.vec3(self.alpha.x * r * s, self.alpha.y * r * c, wo.z), self.rotation)
        wi, ok = disk(d.x - wo.x, d.y - wo.y)
        return drawn(self, wo, wi, mode, ok)


class RetroGauss(go.BSDF):
    """Light returns to where it came from: a Gaussian of |p_o - p_i|, from a thousandth to ten times the disk.

    f = ks exp(-|p_o - p_i|^2 / s^2) / (pi s^2). Right: symmetric, integral ks over the plane, unchanged by rotation. At
    s = 10 it is a flat and nearly black surface and nearly all samples fail, as they must."""

    ks: go.Colour = go.spectrum((1.0, 0.0, 0.2), "color", low=0.0, high=1.0)
    s: go.Number = go.number(0.03, "width in the disk", low=0.002, high=10.0)

    def pdf(self, wo, wi):
        d2 = ops.sqr(wo.x - wi.x) + ops.sqr(wo.y - wi.y)
        h = ops.exp(-d2 / ops.sqr(self.s)) / (ops.pi * ops.sqr(self.s))
        return ops.where(up(wo, wi), h * wi.z, 0.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.ks * self.pdf(wo, wi)

    def sample(self, wo, u, mode="radiance"):
        r = self.s * ops.safe_sqrt(-ops.log(1.0 - u.x))
        s, c = ops.sincos(2.0 * ops.pi * u.y)
        wi, ok = disk(wo.x + r * c, wo.y + r * s)
        return drawn(self, wo, wi, mode, ok)


class StudentDisk(go.BSDF):
    """A lobe with tails as long as one likes about the mirrored viewer.

    f = ks (g - 1) / (pi a^2) (1 + d^2 / a^2)^-g, d = |p_o + p_i|; at g = 1.5 the tails alone hold most of the light.
    Right: int 2 pi d (g - 1) / (pi a^2) (1 + d^2 / a^2)^-g dd = 1 over the plane, symmetric, unchanged by rotation.
    Sampler: d^2 = a^2 ((1 - u)^(-1 / (g - 1)) - 1); weight ks, or 0 outside of the disk."""

    ks: go.Colour = go.spectrum((0.3, 1.0, 0.9), "color", low=0.0, high=1.0)
    a: go.Number = go.number(0.02, "width in the disk", low=0.002, high=2.0)
    g: go.Number = go.number(1.5, "falloff", low=1.5, high=40.0)

    def pdf(self, wo, wi):
        d2 = ops.sqr(wo.x + wi.x) + ops.sqr(wo.y + wi.y)
        a2 = ops.sqr(self.a)
        h = (self.g - 1.0) / (ops.pi * a2) * ops.exp(-self.g * ops.log(1.0 + d2 / a2))
        return ops.where(up(wo, wi), h * wi.z, 0.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.ks * self.pdf(wo, wi)

    def sample(self, wo, u, mode="radiance"):
        x = -ops.log(1.0 - u.y) / (self.g - 1.0)
        r = self.a * ops.safe_sqrt(x * exprel(x))
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        wi, ok = disk(r * c - wo.x, r * s - wo.y)
        return drawn(self, wo, wi, mode, ok)


class TurnedLobes(go.BSDF):
    """Two lobes off the plane of incidence: the viewer's p turned by +t and by -t about the normal; isotropic.

    f = ks (h(|p_i - R p_o|) + h(|p_i - R^-1 p_o|)) / 2, h a Gaussian of integral 1. Right: |p_i - R p_o| = |R^-1 p_i -
    p_o|, so exchanging the directions exchanges the two terms; turning both directions commutes with R. t = 0 is
    retro-reflection, t = pi the mirror. Sampler: 85 % of samples take the first lobe, 15 % the second; pdf = the same
    mixture, so the weight is at most ks 0.5 / 0.15."""

    ks: go.Colour = go.spectrum((0.0, 1.0, 0.0), "color", low=0.0, high=1.0)
    t: go.Number = go.number(2.0, "angle from the viewer's azimuth", low=0.0, high=3.141592, unit="rad")
    s: go.Number = go.number(0.08, "width in the disk", low=0.005, high=1.0)

    def h(self, wo, wi, side):
        sin, cos = ops.sincos(self.t)
        sin = sin * side
        d2 = ops.sqr(wi.x - cos * wo.x + sin * wo.y) + ops.sqr(wi.y - sin * wo.x - cos * wo.y)
        return ops.exp(-d2 / ops.sqr(self.s)) / (ops.pi * ops.sqr(self.s))

    def eval(self, wo, wi, mode="radiance"):
        both = 0.5 * (self.h(wo, wi, 1.0) + self.h(wo, wi, -1.0))
        return self.ks * ops.where(up(wo, wi), both * wi.z, 0.0)

    def pdf(self, wo, wi):
        both = 0.85 * self.h(wo, wi, 1.0) + 0.15 * self.h(wo, wi, -1.0)
        return ops.where(up(wo, wi), both * wi.z, 0.0)

    def sample(self, wo, u, mode="radiance"):
        sin, cos = ops.sincos(self.t)
        sin = ops.where(u.x < 0.85, sin, -sin)
        r = self.s * ops.safe_sqrt(-ops.log(1.0 - u.y))
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        wi, ok = disk(cos * wo.x - sin * wo.y + r * c, sin * wo.x + cos * wo.y + r * s)
        return drawn(self, wo, wi, mode, ok)


class GratingOrders(go.BSDF):
    """Five orders of a grating, at distances along x that differ by channel. Anisotropic.

    f_c = kd_c sum_k e_k h(p_o + p_i - k pitch_c x), k = -2 ... 2, e_0 = zero and the rest equal, so sum e_k = 1; h a
    Gaussian of integral 1. Right: p_o + p_i is symmetric whatever is subtracted; each channel's plane integral is kd_c.
    Sampler: each order and channel equally often, whatever their light; pdf = the mean of all lobes (times cos), so the
    weight is at most 5 (channels) e_k kd."""

    kd: go.Colour = go.spectrum((1.0, 0.0, 1.0), "color", low=0.0, high=1.0)
    pitch: go.Number = go.number(0.45, "distance of the orders in the disk, of the first channel", low=0.0, high=2.0)
    zero: go.Number = go.number(0.2, "share of the order 0", low=0.0, high=1.0)
    s: go.Number = go.number(0.05, "width of each order", low=0.005, high=0.5)
    turn: go.Angle = go.angle(0.7, "direction of the orders")

    @property
    def isotropic(self):
        return False

    def h(self, wo, wi, k, channel):
        d = frame.rotate(ops.vec3(wo.x + wi.x, wo.y + wi.y, wo.z), self.turn)
        d2 = ops.sqr(d.x - k * self.pitch / (1.0 + 0.3 * channel)) + ops.sqr(d.y)
        return ops.exp(-d2 / ops.sqr(self.s)) / (ops.pi * ops.sqr(self.s))

    def eval(self, wo, wi, mode="radiance"):
        other = 0.25 * (1.0 - self.zero)
        value = ops.where(up(wo, wi), wi.z, 0.0)
        parts = []
        for channel, k in enumerate(ops.channels(self.kd)):
            rest = sum(self.h(wo, wi, float(order), channel) for order in (-2, -1, 1, 2))
            parts.append(k * (self.zero * self.h(wo, wi, 0.0, channel) + other * rest) * value)
        return ops.of_channels(self.kd, parts)

    def pdf(self, wo, wi):
        n = len(ops.channels(self.kd))
        total = sum(self.h(wo, wi, float(order), channel) for order in (-2, -1, 0, 1, 2) for channel in range(n))
        return ops.where(up(wo, wi), total * wi.z / (5.0 * n), 0.0)

    def sample(self, wo, u, mode="radiance"):
        n = len(ops.channels(self.kd))
        order = ops.floor(5.0 * u.x)
        channel = ops.minimum(ops.floor((5.0 * u.x - order) * n), n - 1.0)
        at = (order - 2.0) * self.pitch / (1.0 + 0.3 * channel)
        r = self.s * ops.safe_sqrt(-ops.log(1.0 - u.y))
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        d = frame.rotate_back(ops.vec3(at + r * c, r * s, wo.z), self.turn)
        wi, ok = disk(d.x - wo.x, d.y - wo.y)
        return drawn(self, wo, wi, mode, ok)


class PrismSheet(go.BSDF):
    """Returns light along x and mirrors it along y, as a sheet of long right-angled prisms. Only an eval. Anisotropic.

    f = ks h(o_x - i_x, o_y + i_y) in the rotated frame, h a Gaussian with two widths, even in both arguments. Right:
    exchanging the directions changes the sign of the first argument only; integral ks over the plane."""

    ks: go.Colour = go.spectrum((0.0, 0.5, 1.0), "color", low=0.0, high=1.0)
    alpha: go.Width = go.width((0.05, 0.4), "widths in the disk", low=0.02, high=1.0)
    rotation: go.Angle = go.angle(0.0, "rotation of the prisms")

    @property
    def isotropic(self):
        return False

    def eval(self, wo, wi, mode="radiance"):
        o, i = frame.rotate(wo, self.rotation), frame.rotate(wi, self.rotation)
        e = ops.sqr((o.x - i.x) / self.alpha.x) + ops.sqr((o.y + i.y) / self.alpha.y)
        h = ops.exp(-e) / (ops.pi * self.alpha.x * self.alpha.y)
        return self.ks * ops.where(up(wo, wi), h * wi.z, 0.0)


class KeyholePhong(go.BSDF):
    """A normalized Phong lobe, cut off hard at an angle: f = ks (p + 2) / (2 pi) (v.r)^p where v.r > cut, else 0.

    Right: v.r is symmetric. The albedo is the integral of an increasing function of the cosine to r times an increasing
    function of the cosine to n (the clamped cosine), which is greatest where the axes coincide (level sets are caps):
    there (p + 2) / (2 pi) 2 pi / (p + 2) = 1 without the cut, which only removes. p up to a million. Sampler: the whole
    lobe about r; what is cut off or below has weight 0. pdf = (p + 1) / (2 pi) (v.r)^p inside the cut."""

    ks: go.Colour = go.spectrum((1.0, 0.0, 0.0), "color", low=0.0, high=1.0)
    p: go.Number = go.number(20.0, "exponent", low=0.0, high=1e6)
    cut: go.Number = go.number(0.9, "cosine at the cut", low=0.0, high=0.99)

    def lobe(self, wo, wi):
        axis = frame.mirror(wo)
        return ops.where(up(wo, wi) & (ops.dot(axis, wi) > self.cut), warp.power_about(axis, wi, self.p), 0.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.ks * (self.lobe(wo, wi) * (self.p + 2.0) * (0.5 * ops.inv_pi) * ops.maximum(wi.z, 0.0))

    def pdf(self, wo, wi):
        return self.lobe(wo, wi) * (self.p + 1.0) * (0.5 * ops.inv_pi)

    def sample(self, wo, u, mode="radiance"):
        wi = warp.to_frame(frame.mirror(wo), warp.square_to_power_lobe(u.y, u.z, self.p))
        return drawn(self, wo, wi, mode)


class SteppedFresnelMetal(go.BSDF):
    """GGX facets, a hundred times wider along one axis than along the other, that reflect one of two colors.

    f = F D G / (4 mu_o mu_i), F = low where o.m > step, else high. Right: o.m = i.m, so F is symmetric; both forms of G
    are at most G1(o), by which the visible normals are normalized, so the albedo is at most that of F. Sampler: visible
    normals, density D G1(o) / (4 mu_o); weight F G / G1(o) <= 1, or 0 below the surface."""

    low: go.Colour = go.spectrum((0.0, 0.0, 1.0), "color of facets seen from the front", low=0.0, high=1.0)
    high: go.Colour = go.spectrum((1.0, 0.5, 0.0), "color of facets seen askew", low=0.0, high=1.0)
    step: go.Number = go.number(0.8, "cosine at which the color changes", low=0.0, high=1.0)
    alpha: go.Width = go.width((0.01, 0.9), "widths", low=0.01)
    rotation: go.Angle = go.angle(1.0, "rotation of the pair")
    masking: str = go.choice("joint", "G", {"joint": "1 / (1 + L_o + L_i)", "product": "G1(o) G1(i)"})

    @property
    def isotropic(self):
        return False

    def lit(self, wo, wi):
        n = frame.normal_like(wo)
        above = up(wo, wi)
        o, i = (
            frame.rotate(ops.where(above, wo, n), self.rotation),
            frame.rotate(ops.where(above, wi, n), self.rotation),
        )
        return above, o, i, frame.half_vector(o, i)

    def eval(self, wo, wi, mode="radiance"):
        above, o, i, m = self.lit(wo, wi)
        ggx = ndf.distribution("ggx")
        lo, li = ggx.Lambda(o, self.alpha), ggx.Lambda(i, self.alpha)
        g = 1.0 / (1.0 + lo + li) if self.masking == "joint" else 1.0 / ((1.0 + lo) * (1.0 + li))
        value = ops.where(above, ggx.D(m, self.alpha) * g / (4.0 * o.z), 0.0)
        near = ops.dot(o, i) > 2.0 * ops.sqr(self.step) - 1.0  # o.i = 2 (o.m)^2 - 1, exactly symmetric
        return ops.where(near, self.low, self.high) * value

    def pdf(self, wo, wi):
        above, o, i, m = self.lit(wo, wi)
        return ops.where(above, 0.25 * ndf.distribution("ggx").visible_per_cosine(o, m, self.alpha), 0.0)

    def sample(self, wo, u, mode="radiance"):
        o = frame.rotate(ops.where(wo.z > 0.0, wo, frame.normal_like(wo)), self.rotation)
        m = ndf.distribution("ggx").sample_visible(o, u.y, u.z, self.alpha)
        return drawn(self, wo, frame.rotate_back(frame.reflect(o, m), self.rotation), mode)


class RimLight(go.BSDF):
    """Black but for grazing directions: f = kd (p + 1) / pi (s_o s_i)^p with s = sin^2, p up to a thousand.

    Right: symmetric; s is uniform in [0, 1] under the cosine / pi, so the albedo is kd s_o^p <= kd. f is large (p / pi)
    between two grazing directions and 0 within float for most. Sampler: s^(p + 1) uniform, density (p + 1) / pi s_i^p
    cos, for all viewers; weight kd s_o^p, 0 for most of them."""

    kd: go.Colour = go.spectrum((1.0, 1.0, 0.0), "color", low=0.0, high=1.0)
    p: go.Number = go.number(30.0, "exponent", low=0.1, high=1000.0)

    def rim(self, w):
        return ops.pow(frame.sin2(w), self.p)

    def pdf(self, wo, wi):
        return ops.where(up(wo, wi), (self.p + 1.0) * ops.inv_pi * self.rim(wi) * wi.z, 0.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * (self.rim(wo) * self.pdf(wo, wi))

    def sample(self, wo, u, mode="radiance"):
        log_s = ops.log(1.0 - u.y) / (self.p + 1.0)
        r = ops.exp(0.5 * log_s)
        z = ops.safe_sqrt(-log_s * exprel(log_s))
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        return drawn(self, wo, ops.vec3(r * c, r * s, z), mode)


class SlitDiffraction(go.BSDF):
    """The diffraction of a rectangular slit: sinc^2 along both axes, with black lines between. Only an eval.

    f = ks sinc^2(d_x / a_x) sinc^2(d_y / a_y) / (pi^2 a_x a_y), sinc t = sin t / t, d = p_o + p_i. Right: symmetric;
    int sinc^2(x / a) dx = pi a, so the plane's integral is ks. Anisotropic even with equal widths."""

    ks: go.Colour = go.spectrum((0.0, 1.0, 0.5), "color", low=0.0, high=1.0)
    alpha: go.Width = go.width((0.03, 0.3), "widths in the disk", low=0.02, high=1.0)
    rotation: go.Angle = go.angle(0.25, "rotation of the slit")

    @property
    def isotropic(self):
        return False

    def sinc2(self, t):
        small = ops.abs(t) < 0.01
        return ops.sqr(ops.where(small, 1.0 - t * t / 6.0, ops.sin(t) / ops.where(small, 1.0, t)))

    def eval(self, wo, wi, mode="radiance"):
        d = frame.rotate(ops.vec3(wo.x + wi.x, wo.y + wi.y, wo.z), self.rotation)
        h = self.sinc2(d.x / self.alpha.x) * self.sinc2(d.y / self.alpha.y)
        h = h / (ops.pi * ops.pi * self.alpha.x * self.alpha.y)
        return self.ks * ops.where(up(wo, wi), h * wi.z, 0.0)


SOUND = [
    NarrowSheet,
    RetroGauss,
    StudentDisk,
    TurnedLobes,
    GratingOrders,
    PrismSheet,
    KeyholePhong,
    SteppedFresnelMetal,
    RimLight,
    SlitDiffraction,
]
