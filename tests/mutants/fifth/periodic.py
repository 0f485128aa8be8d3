"""Reflecting materials with tables, series and periodic formulas."""

import gonio as go
from gonio import ops
from gonio.optics import frame, warp


def above(wo, wi):
    return (wo.z > 0.0) & (wi.z > 0.0)


def finished(material, wo, wi, mode):
    """The sample for wi by the material's own eval and pdf."""
    pdf = material.pdf(wo, wi)
    weight = material.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
    return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class GratingSum(go.BSDF):
    """Matte, with fringes that depend on x_o + x_i along a turned axis: f = k / pi (1/2 + 1/2 cos(2 pi lines (x_o + x_i))).

    The sum is symmetric, and 0 <= f <= k / pi, so the power is at most k. At lines = 0 Lambert. Not isotropic.
    Sampled evenly over the hemisphere (pdf 1 / (2 pi)); u.x mirrors half of the samples at z x.
    """

    k: go.Colour = go.spectrum((0.9, 0.9, 0.5), "albedo at the bright fringes", low=0.0, high=1.0)
    lines: go.Number = go.number(6.0, "fringes per unit", low=0.0, high=40.0)
    turn: go.Angle = go.angle(0.4, "direction across the fringes")

    def eval(self, wo, wi, mode="radiance"):
        x = frame.rotate(wo, self.turn).x + frame.rotate(wi, self.turn).x
        bright = 0.5 + 0.5 * ops.cos(2.0 * ops.pi * self.lines * x)
        return self.k * ops.where(above(wo, wi), bright * wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(above(wo, wi), 0.5 * ops.inv_pi, 0.0 * wi.z)

    def sample(self, wo, u, mode="radiance"):
        across = ops.safe_sqrt((1.0 - u.z) * (1.0 + u.z))
        s, c = ops.sincos(ops.pi * u.y)
        wi = ops.vec3(across * c, ops.where(u.x < 0.5, s, -s) * across, u.z)
        return finished(self, wo, wi, mode)

    @property
    def isotropic(self):
        return False


class AzimuthSeries(go.BSDF):
    """A Fourier series in the difference of azimuths: f = k / pi (1 + sum c_m Re((z_o conj(z_i))^m)) / (1 + sum |c_m|).

    z = x + i y, so the terms are (sin sin)^m cos(m (phi_o - phi_i)), smooth at the normal and symmetric. The bracket is
    between 0 and 1 + sum |c_m| as |z| <= 1 and sum |c_m| of the defaults, 2, is more than 1: hence clamped at 0 (a
    symmetric operation): black azimuths. Power <= k. Isotropic. Only an eval.
    """

    k: go.Colour = go.spectrum((0.8, 0.3, 0.9), "albedo at the brightest", low=0.0, high=1.0)
    swing: go.Number = go.number(1.0, "factor on all terms but the first", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        re, im = wo.x * wi.x + wo.y * wi.y, wo.y * wi.x - wo.x * wi.y
        a, b = re, im
        total, size = 0.0 * re, 0.0
        for c in (-0.5, 0.4, 0.0, -0.6, 0.5):
            total, size = total + c * a, size + abs(c)
            a, b = a * re - b * im, a * im + b * re
        series = ops.maximum(1.0 + self.swing * total, 0.0) / (1.0 + self.swing * size)
        return self.k * ops.where(above(wo, wi), series * wi.z * ops.inv_pi, 0.0)


class ChiralMatte(go.BSDF):
    """A matte surface with a twist: f = k / (2 pi) (1 + twist s), s = Im(z_o conj(z_i)) (|z_o|^2 - |z_i|^2) 2.6.

    With wo and wi exchanged both factors change their sign, so s does not: reciprocal, though f differs for azimuths
    left and right of the viewer (isotropic without mirror symmetry). |z_o z_i (|z_o|^2 - |z_i|^2)| = a b |a^2 - b^2| with
    a, b <= 1 is at most (at a = 1, b - b^3) 2 / (3 sqrt 3) = 0.385, so |s| <= 1.001 2.6 0.385 / 1 = 1.0008: clamped to
    [-1, 1] to be safe. 0 <= f <= k / pi.
    """

    k: go.Colour = go.spectrum((0.9, 0.7, 0.1), "twice the mean albedo", low=0.0, high=1.0)
    twist: go.Number = go.number(1.0, "strength and sense of the twist", low=-1.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        turn = wo.y * wi.x - wo.x * wi.y
        s = ops.clamp(2.6 * turn * (frame.sin2(wo) - frame.sin2(wi)), -1.0, 1.0)
        return self.k * ops.where(above(wo, wi), 0.5 * (1.0 + self.twist * s) * wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(above(wo, wi), wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        return self.sample_cosine(wo, u, mode)


class ZernikeSquare(go.BSDF):
    """f = k / pi q^2, q = sum a_j Z_j(wo) Z_j(wi) over Zernike polynomials of the projected disk.

    Z: 1, x, y, 2 r^2 - 1, x^2 - y^2, 2 x y, 6 r^4 - 6 r^2 + 1, (3 r^2 - 2) x; each within [-1, 1] on the disk, and the
    |a_j| add up to 1, so |q| <= 1 and 0 <= f <= k / pi. The sum is diagonal, hence symmetric. Not isotropic (turned by
    `turn`). Only an eval.
    """

    k: go.Colour = go.spectrum((1.0, 0.6, 0.8), "factor", low=0.0, high=1.0)
    turn: go.Angle = go.angle(0.0, "angle of the axes")

    def basis(self, w):
        w = frame.rotate(w, self.turn)
        x, y = w.x, w.y
        r2 = frame.sin2(w)
        return (1.0 + 0.0 * x, x, y, 2.0 * r2 - 1.0, x * x - y * y, 2.0 * x * y, 6.0 * r2 * (r2 - 1.0) + 1.0,
                (3.0 * r2 - 2.0) * x)  # fmt: skip

    def eval(self, wo, wi, mode="radiance"):
        q = 0.0 * wo.z
        for a, o, i in zip(
            (0.2, -0.15, 0.1, 0.2, -0.1, 0.05, 0.15, -0.05), self.basis(wo), self.basis(wi), strict=True
        ):
            q = q + a * o * i
        return self.k * ops.where(above(wo, wi), q * q * wi.z * ops.inv_pi, 0.0)

    @property
    def isotropic(self):
        return False


TABLE = (
    (1.0, 0.2, 0.0, 0.7, 0.0, 0.9),
    (0.2, 0.0, 0.5, 0.1, 0.0, 0.3),
    (0.0, 0.5, 0.8, 0.0, 0.6, 0.0),
    (0.7, 0.1, 0.0, 0.4, 1.0, 0.2),
    (0.0, 0.0, 0.6, 1.0, 0.0, 0.5),
    (0.9, 0.3, 0.0, 0.2, 0.5, 0.1),
)
CHANCES = (0.3, 0.05, 0.2, 0.05, 0.1, 0.3)


class StepTable(go.BSDF):
    """A symmetric table of 6 by 6 steps in the cosines: f = k / pi TABLE[ring(wo)][ring(wi)], with entries in [0, 1].

    The table is symmetric, so f is; f <= k / pi. Rings of equal width in cos theta. Sampled by choosing a ring with
    fixed unequal probabilities (even a ring that is black for this viewer) and evenly within it: the density
    is the ring's probability times 6 / (2 pi). `soft` < 1 fades the table toward 1 (still symmetric, still <= 1).
    """

    k: go.Colour = go.spectrum((0.9, 0.9, 0.0), "factor on the table", low=0.0, high=1.0)
    hard: go.Number = go.number(1.0, "1 is the table, 0 is white", low=0.0, high=1.0)

    def pick(self, z, row):
        value = row[5] + 0.0 * z
        for j in range(5):
            value = ops.where((z >= j / 6.0) & (z < (j + 1) / 6.0), row[j], value)
        return value

    def eval(self, wo, wi, mode="radiance"):
        entry = self.pick(wo.z, [self.pick(wi.z, row) for row in TABLE])
        return self.k * ops.where(above(wo, wi), (1.0 - self.hard * (1.0 - entry)) * wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(above(wo, wi), self.pick(wi.z, CHANCES) * (6.0 * 0.5 * ops.inv_pi), 0.0)

    def sample(self, wo, u, mode="radiance"):
        ring, total = 0.0 * u.x, 0.0
        for chance in CHANCES[:5]:
            total += chance
            ring = ring + ops.where(u.x >= total, 1.0, 0.0)
        z = ops.minimum((ring + u.y) / 6.0, 1.0)
        across = ops.safe_sqrt((1.0 - z) * (1.0 + z))
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        return finished(self, wo, ops.vec3(across * c, across * s, z), mode)


KNOTS = (0.05, 0.9, 0.0, 0.0, 0.7, 0.2, 1.0, 0.1, 1.0)  # at m.z = 0, 1/8, ..., 1


class HalfRings(go.BSDF):
    """Rings about the half vector by a table that is interpolated: f = k / pi tab(m.z), m the normalized wo + wi.

    m is symmetric, tab in [0, 1], so f <= k / pi. Between two knots it is 0. Sampled by a poor mixture: 0.85 of a narrow
    power lobe about the normal (exponent 200), 0.15 of the even hemisphere: pdf >= 0.15 / (2 pi), weights at most 14.
    """

    k: go.Colour = go.spectrum((0.6, 1.0, 0.6), "factor on the table", low=0.0, high=1.0)
    stretch: go.Number = go.number(1.0, "power of m.z before the look-up", low=0.1, high=8.0)

    def table(self, z):
        value = KNOTS[8] + 0.0 * z
        for j in range(8):
            t = 8.0 * z - j
            value = ops.where((t >= 0.0) & (t < 1.0), KNOTS[j] * (1.0 - t) + KNOTS[j + 1] * t, value)
        return value

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        z = ops.clamp(ops.pow(m.z, self.stretch), 0.0, 1.0)
        return self.k * ops.where(above(wo, wi), self.table(z) * wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        narrow = 201.0 * ops.pow(wi.z, 200.0)
        return ops.where(above(wo, wi), (0.85 * narrow + 0.15) * (0.5 * ops.inv_pi), 0.0)

    def sample(self, wo, u, mode="radiance"):
        p = ops.where(u.x < 0.85, 200.0 + 0.0 * u.x, 0.0)
        return finished(self, wo, warp.square_to_power_lobe(u.y, u.z, p), mode)


class HalfChecker(go.BSDF):
    """A checkerboard in azimuth and height of the half vector: f = color / pi, one of two colors by the sign of
    cos(N phi_m) cos(2 pi rings m.z).

    The half vector is symmetric (exactly so in floating point: a sum), both colors are <= 1. Not isotropic.
    Sampled by points of the square [-1, 1]^2 taken as projected directions; those outside the unit disk fail (weight
    and pdf 0), so the density is cos / 4 and integrates to pi / 4.
    """

    a: go.Colour = go.spectrum((1.0, 0.0, 0.0), "color of one half", low=0.0, high=1.0)
    b: go.Colour = go.spectrum((0.0, 0.1, 0.9), "color of the other half", low=0.0, high=1.0)
    N: go.Number = go.number(6.0, "sectors", low=0.0, high=24.0)
    rings: go.Number = go.number(3.0, "rings", low=0.0, high=10.0)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        phi = ops.atan2(m.y, m.x)
        # only whole numbers of sectors are continuous across phi = pi; any other jumps there, which is symmetric too
        sign = ops.cos(self.N * phi) * ops.cos(2.0 * ops.pi * self.rings * m.z)
        color = ops.where(sign > 0.0, self.a, self.b)
        return color * ops.where(above(wo, wi), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(above(wo, wi), 0.25 * wi.z, 0.0)

    def sample(self, wo, u, mode="radiance"):
        x, y = 2.0 * u.x - 1.0, 2.0 * u.z - 1.0
        r2 = x * x + y * y
        inside = r2 < 1.0
        wi = ops.vec3(
            ops.where(inside, x, 0.0), ops.where(inside, y, 0.0), ops.where(inside, ops.safe_sqrt(1.0 - r2), 1.0)
        )
        pdf = ops.where(inside, self.pdf(wo, wi), 0.0)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)

    @property
    def isotropic(self):
        return False


class RetroFringes(go.BSDF):
    """Rings about the viewer's own direction, another period for each channel: f = k / pi (1/2 + 1/2 cos(2 pi p d)).

    d = |wo - wi| is symmetric, 0 <= f <= k / pi. Isotropic. Sampled with density proportional to 1 / 2 + cos:
    half of the samples evenly, half by the cosine: 0.25 / pi + 0.5 cos / pi.
    """

    k: go.Colour = go.spectrum((1.0, 0.9, 0.8), "albedo of the bright rings", low=0.0, high=1.0)
    period: go.Colour = go.spectrum((4.0, 5.0, 6.5), "rings per unit, for each channel", low=0.0, high=25.0)

    def eval(self, wo, wi, mode="radiance"):
        off = wo - wi
        d = ops.safe_sqrt(ops.dot(off, off))
        rings = 0.5 + 0.5 * ops.cos(self.period * (2.0 * ops.pi * d))
        return self.k * rings * ops.where(above(wo, wi), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where(above(wo, wi), (0.25 + 0.5 * wi.z) * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        z = ops.where(u.z < 0.5, u.x, ops.sqrt(u.x))
        across = ops.safe_sqrt((1.0 - z) * (1.0 + z))
        s, c = ops.sincos(2.0 * ops.pi * u.y)
        return finished(self, wo, ops.vec3(across * c, across * s, z), mode)


class FilmGloss(go.BSDF):
    """A microfacet gloss whose reflectance is periodic in the cosine on the facet, as of a thin film: one color after
    another up to full saturation.

    f = F D G / (4 cos_o cos_i), D = (n + 2) / (2 pi) m_z^n, G of V-grooves (Cook1982), F = k sin^2(pi order c) with c the
    cosine between wo and m, for each channel. F <= 1 and is symmetric as wo.m = wi.m. For facets symmetric about z the
    visible ones with G1 integrate to 1 and G <= G1, so the power is at most 1. Sampled by D m_z; weights <= 2.
    """

    k: go.Colour = go.spectrum(1.0, "reflectance at the peaks", low=0.0, high=1.0)
    order: go.Colour = go.spectrum((3.5, 4.2, 5.0), "periods over the cosine, for each channel", low=0.0, high=30.0)
    n: go.Number = go.number(40.0, "exponent", low=0.5, high=1000.0)

    def facet(self, wo, wi):
        m = frame.half_vector(wo, wi)
        return m, ops.maximum(ops.dot(wo, m), 1e-6)

    def power(self, m):
        """m_z^n, 0 below 1e-30: value and density end together, before they underflow."""
        power = ops.pow(m.z, self.n)
        return ops.where(power > 1e-30, power, 0.0)

    def eval(self, wo, wi, mode="radiance"):
        m, c = self.facet(wo, wi)
        d = (self.n + 2.0) * (0.5 * ops.inv_pi) * self.power(m)
        g = ops.minimum(1.0, 2.0 * m.z * ops.minimum(wo.z, wi.z) / c)
        color = self.k * ops.sqr(ops.sin(self.order * (ops.pi * c)))
        return color * ops.where(above(wo, wi), 0.25 * d * ops.safe_div(g, wo.z), 0.0)

    def pdf(self, wo, wi):
        m, c = self.facet(wo, wi)
        normals = (self.n + 2.0) * (0.5 * ops.inv_pi) * self.power(m) * m.z
        return ops.where(above(wo, wi), normals / (4.0 * c), 0.0)

    def sample(self, wo, u, mode="radiance"):
        m = ops.normalize(warp.square_to_power_lobe(u.y, u.z, self.n + 1.0))
        wi = frame.reflect(wo, m)
        ok = (ops.dot(wo, m) > 0.0) & above(wo, wi)
        pdf = ops.where(ok, self.pdf(wo, wi), 0.0)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class ThreeLobes(go.BSDF):
    """Lobes beside the mirror direction, at azimuths 60 degrees left and right of the viewer's own, and one back at the
    viewer.

    f = k ((1 - back) (L(R wo, wi) + L(R^-1 wo, wi)) / 2 + back L(wo, wi)) / max(cos_o, cos_i), R a rotation of 60 degrees
    about the normal, L(a, w) = (n + 1) / (2 pi) max(a.w, 0)^n. (R wo).wi = wo.(R^-1 wi), so the exchange of wo and wi
    swaps the first two, which have equal weights. Each L integrates to at most 1: power <= k. Isotropic.
    Lobes are chosen with probabilities 0.5, 0.2 and 0.3.
    """

    k: go.Colour = go.spectrum((0.9, 0.5, 0.2), "reflectance", low=0.0, high=1.0)
    back: go.Number = go.number(0.2, "share that goes back", low=0.0, high=1.0)
    n: go.Number = go.number(200.0, "exponent", low=1.0, high=10000.0)

    def axes(self, wo):
        c, s = 0.5, 0.75**0.5
        left = ops.vec3(c * wo.x - s * wo.y, s * wo.x + c * wo.y, wo.z)
        right = ops.vec3(c * wo.x + s * wo.y, c * wo.y - s * wo.x, wo.z)
        return left, right, wo

    def lobe(self, axis, w):
        power = warp.power_about(axis, w, self.n)
        inside = (ops.dot(axis, w) > 0.0) & (power > 1e-30)  # value and density end together, before they underflow
        return (self.n + 1.0) * (0.5 * ops.inv_pi) * ops.where(inside, power, 0.0)

    def eval(self, wo, wi, mode="radiance"):
        left, right, own = (self.lobe(axis, wi) for axis in self.axes(wo))
        value = (0.5 * (1.0 - self.back)) * (left + right) + self.back * own
        return self.k * ops.where(above(wo, wi), value * ops.safe_div(wi.z, ops.maximum(wo.z, wi.z)), 0.0)

    def pdf(self, wo, wi):
        left, right, own = (self.lobe(axis, wi) for axis in self.axes(wo))
        return ops.where(above(wo, wi), 0.5 * left + 0.2 * right + 0.3 * own, 0.0)

    def sample(self, wo, u, mode="radiance"):
        left, right, own = self.axes(wo)
        axis = ops.where(u.x < 0.5, left, ops.where(u.x < 0.7, right, own))
        wi = ops.normalize(warp.to_frame(axis, warp.square_to_power_lobe(u.y, u.z, self.n)))
        return finished(self, wo, wi, mode)


SOUND = [GratingSum, AzimuthSeries, ChiralMatte, ZernikeSquare, StepTable, HalfRings, HalfChecker, RetroFringes,
         FilmGloss, ThreeLobes]  # fmt: skip
