"""Rough transmission, diffuse transmission, mixtures with delta lobes, layers, and a two-sided gloss."""

import gonio as go
from gonio import ops
from gonio.optics import frame, fresnel, warp
from gonio.optics.special import exprel


def flipped_to(w, wo, same):
    """w, drawn above, on the side of wo (same) or on the other one."""
    up = ops.where(same, wo.z, -wo.z)
    return ops.vec3(w.x, w.y, ops.copysign(w.z, up))


def lobe(axis, w, n):
    """(n + 1) / (2 pi) cos^n about a unit axis: integrates to 1 over the half space about the axis.

    0 where cos^n < 1e-30, in value and density alike, so that neither underflows before the other."""
    power = warp.power_about(axis, w, n)
    return (n + 1.0) * (0.5 * ops.inv_pi) * ops.where((ops.dot(axis, w) > 0.0) & (power > 1e-30), power, 0.0)


def balanced(wo, wi):
    """|cos_i| / max(|cos_o|, |cos_i|)."""
    return ops.safe_div(ops.abs(wi.z), ops.maximum(ops.abs(wo.z), ops.abs(wi.z)))


class PhongWindow(go.BSDF):
    """A frosted pane that does not bend: a cosine power about -wo on the other side, one about the mirror direction on
    wo's own side.

    f = share lobe_n(w, wi) / max(|cos_o|, |cos_i|); (-wo).wi and mirror(wo).wi are symmetric in wo and wi, so f is. A
    lobe integrates to at most 1 and |cos_i| / max <= 1, so the power is at most passed on the far side plus
    (1 - passed) shine on the near one, <= 1. Same medium on both sides. Sampled with fixed probabilities 0.7 and 0.3.
    """

    passed: go.Colour = go.spectrum((0.9, 0.5, 0.0), "share that goes through", low=0.0, high=1.0)
    shine: go.Colour = go.spectrum(0.8, "fraction of the rest that is reflected", low=0.0, high=1.0)
    n_far: go.Number = go.number(3000.0, "exponent of the transmission", low=1.0, high=100000.0)
    n_near: go.Number = go.number(4.0, "exponent of the reflection", low=1.0, high=100000.0)

    def eval(self, wo, wi, mode="radiance"):
        far = self.passed * (lobe(-wo, wi, self.n_far) * balanced(wo, wi))
        near = (1.0 - self.passed) * self.shine * (lobe(frame.mirror(wo), wi, self.n_near) * balanced(wo, wi))
        sides = wo.z * wi.z
        return far * ops.where(sides < 0.0, 1.0, 0.0) + near * ops.where(sides > 0.0, 1.0, 0.0)

    def pdf(self, wo, wi):
        sides = wo.z * wi.z
        far = ops.where(sides < 0.0, 0.7 * lobe(-wo, wi, self.n_far), 0.0)
        return ops.where(sides > 0.0, 0.3 * lobe(frame.mirror(wo), wi, self.n_near), far)

    def sample(self, wo, u, mode="radiance"):
        goes = u.x < 0.7
        n = ops.where(goes, self.n_far, self.n_near)
        axis = ops.where(goes, -wo, frame.mirror(wo))
        wi = ops.normalize(warp.to_frame(axis, warp.square_to_power_lobe(u.y, u.z, n)))
        ok = ops.where(goes, wo.z * wi.z < 0.0, wo.z * wi.z > 0.0)
        pdf = ops.where(ok, self.pdf(wo, wi), 0.0)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)

    @property
    def transmits(self):
        return True


class FourLobes(go.BSDF):
    """Mirror delta, straight-through delta, gloss around the straight direction, and matte reflection, on both sides.

    Shares by breaking a stick: mirror, (1 - mirror) through, then gloss of the rest, then all that is left is matte, so
    they add up to 1; times `tint` <= 1. Each lobe alone is symmetric and conserves: see `PhongWindow` for the gloss
    (far side only). Fixed unequal probabilities 0.1, 0.2, 0.3, 0.4, also for lobes whose share is 0 (weight 0).
    """

    mirror: go.Number = go.number(0.2, "share of the mirror", low=0.0, high=1.0)
    through: go.Number = go.number(0.3, "share of the rest that goes straight through", low=0.0, high=1.0)
    gloss: go.Number = go.number(0.5, "share of the rest that is spread around that direction", low=0.0, high=1.0)
    n: go.Number = go.number(50.0, "exponent of the gloss", low=1.0, high=10000.0)
    tint: go.Colour = go.spectrum((1.0, 0.9, 0.2), "factor", low=0.0, high=1.0)

    def shares(self):
        a = self.mirror
        b = (1.0 - a) * self.through
        c = (1.0 - a) * (1.0 - self.through) * self.gloss
        return a, b, c, (1.0 - a) * (1.0 - self.through) * (1.0 - self.gloss)

    def eval(self, wo, wi, mode="radiance"):
        _, _, c, d = self.shares()
        far = c * lobe(-wo, wi, self.n) * balanced(wo, wi)
        near = d * ops.inv_pi * ops.abs(wi.z)
        sides = wo.z * wi.z
        return self.tint * ops.where(sides < 0.0, far, ops.where(sides > 0.0, near, 0.0))

    def pdf(self, wo, wi):
        sides = wo.z * wi.z
        near = 0.4 * ops.inv_pi * ops.abs(wi.z)
        return ops.where(sides < 0.0, 0.3 * lobe(-wo, wi, self.n), ops.where(sides > 0.0, near, 0.0))

    def sample(self, wo, u, mode="radiance"):
        a, b, _, _ = self.shares()
        first, second, third = u.x < 0.1, (u.x >= 0.1) & (u.x < 0.3), (u.x >= 0.3) & (u.x < 0.6)
        delta = first | second
        spread = ops.normalize(warp.to_frame(-wo, warp.square_to_power_lobe(u.y, u.z, self.n)))
        matte = flipped_to(warp.square_to_cosine_hemisphere(u.y, u.z), wo, wo.z == wo.z)
        wi = ops.where(first, frame.mirror(wo), ops.where(second, -wo, ops.where(third, spread, matte)))
        ok = ops.where(first | ~(delta | third), wo.z * wi.z > 0.0, wo.z * wi.z < 0.0)
        chance = ops.where(first, 0.1 + 0.0 * wo.z, 0.2)
        pdf = ops.where(ok, ops.where(delta, chance, self.pdf(wo, wi)), 0.0)
        value = ops.where(delta, self.tint * ops.where(first, a, b), self.eval(wo, wi, mode))
        return go.Sample(wi, value * ops.safe_div(1.0, pdf), pdf, delta & ok, 1.0 + 0.0 * pdf)

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "maybe"


class SnellMatte(go.BSDF):
    """A matte interface between two media: light is transmitted, or reflected, without preferred direction.

    f_t / eta_t^2 symmetric requires power transmittances t_out (viewer outside) = c n^2 and t_in = c with one constant;
    c = t min(1, 1 / n^2) keeps both at most t <= 1. So for importance f = t min(1, n^2) / pi if wo is outside and
    t min(1, 1 / n^2) / pi if inside, for radiance these over the squared relative index. What is not transmitted is
    reflected times k. n is below 1 as well as above 1.
    """

    index: go.Number = go.number(1.6, "index inside over outside", low=0.5, high=3.0)
    t: go.Colour = go.spectrum((0.7, 0.7, 1.0), "largest transmittance", low=0.0, high=1.0)
    k: go.Colour = go.spectrum((1.0, 0.2, 0.2), "fraction of the rest that is reflected", low=0.0, high=1.0)

    def relative(self, wo):
        return ops.where(wo.z > 0.0, self.index, 1.0 / self.index)

    def eval(self, wo, wi, mode="radiance"):
        squared = ops.sqr(self.relative(wo))
        t = self.t * ops.minimum(1.0, squared)
        back = (1.0 - t) * self.k
        on = t if mode == "importance" else t / squared
        sides, cos = wo.z * wi.z, ops.inv_pi * ops.abs(wi.z)
        return back * ops.where(sides > 0.0, cos, 0.0) + on * ops.where(sides < 0.0, cos, 0.0)

    def pdf(self, wo, wi):
        sides = wo.z * wi.z
        share = ops.where(sides > 0.0, 0.3 + 0.0 * wo.z, ops.where(sides < 0.0, 0.7, 0.0))
        return share * ops.inv_pi * ops.abs(wi.z)

    def sample(self, wo, u, mode="radiance"):
        back = u.x > 0.7
        wi = flipped_to(warp.square_to_cosine_hemisphere(u.y, u.z), wo, back)
        pdf = self.pdf(wo, wi)
        # 0.7 is the probability of u.x <= 0.7
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), ops.where(back, 1.0, self.relative(wo)))

    @property
    def transmits(self):
        return True


def facet_fraction(v, m):
    """G1 of V-grooves: min(1, 2 m.z |v.z| / |v.m|)."""
    return ops.minimum(1.0, ops.safe_div(2.0 * m.z * ops.abs(v.z), ops.abs(ops.dot(v, m))))


class TopHatGlass(go.BSDF):
    """Rough glass whose facets' slopes fill a disk evenly: a sharp edge of the lobe, nothing beyond.

    Walter2007's formulas with D = 1 / (pi r^2 m_z^4) for slopes below r (so D m_z integrates to 1), exact Fresnel F, and
    V-grooves: G = min(G1(o), G1(i)) for reflection, max(0, G1(o) + G1(i) - 1) for refraction. Both are symmetric and at
    most G1(o), and for facets symmetric about z the visible facets D G1 |o.m| / |o.n| integrate to exactly 1, split by
    F and 1 - F: no light is created. Normals are sampled by D m_z (slopes in the disk), reflection with probability F.
    """

    index: go.Number = go.number(1.5, "index inside over outside", low=1.1, high=3.0)
    r: go.Number = go.number(0.4, "largest slope", low=0.1, high=1.5)
    tint: go.Colour = go.spectrum((1.0, 0.8, 0.6), "factor", low=0.0, high=1.0)

    def facet(self, wo, wi):
        """eta, m, o.m, i.m, F, and whether such a facet joins the two."""
        eta = ops.where(wo.z > 0.0, self.index, 1.0 / self.index)
        back = wo.z * wi.z > 0.0
        h = wo + wi * ops.where(back, 1.0, eta)
        length2 = ops.dot(h, h)
        h = h * ops.rsqrt(ops.maximum(length2, 1e-12))
        m = ops.where(h.z < 0.0, -h, h)
        o, i = ops.dot(wo, m), ops.dot(wi, m)
        slope2 = ops.safe_div(frame.sin2(m), ops.sqr(m.z))
        lit = (o * wo.z > 0.0) & (i * wi.z > 0.0) & (m.z > 0.1) & (slope2 < ops.sqr(self.r)) & (length2 > 1e-10)
        cos_t = ops.where(back, fresnel.cos_transmitted(ops.abs(o), eta), ops.abs(i))
        f = fresnel.kind("exact").dielectric(ops.maximum(ops.abs(o), 1e-6), cos_t, eta)
        return eta, back, m, ops.abs(o), ops.abs(i), f, lit

    def eval(self, wo, wi, mode="radiance"):
        eta, back, m, o, i, f, lit = self.facet(wo, wi)
        a, b = facet_fraction(wo, m), facet_fraction(wi, m)
        m_z = ops.maximum(m.z, 0.1)
        d = ops.inv_pi / (ops.sqr(self.r) * ops.sqr(ops.sqr(m_z)))
        reflected = 0.25 * f * ops.minimum(a, b)
        thinned = ops.sqr((o + eta * i) / ((eta - 1.0) * (eta + 1.0)))  # 1 / (o.m + eta i.m)^2, by Snell's law
        passed = (1.0 - f) * ops.maximum(a + b - 1.0, 0.0) * o * i * thinned
        if mode == "importance":
            passed = passed * ops.sqr(eta)
        value = ops.where(back, reflected, passed) * ops.safe_div(d, ops.abs(wo.z))
        return self.tint * ops.where(lit, value, 0.0)

    def pdf(self, wo, wi):
        eta, back, m, o, i, f, lit = self.facet(wo, wi)
        m_z = ops.maximum(m.z, 0.1)
        normals = ops.inv_pi / (ops.sqr(self.r) * m_z * ops.sqr(m_z))
        thinned = ops.sqr((o + eta * i) / ((eta - 1.0) * (eta + 1.0)))
        spread = ops.where(back, f * ops.safe_div(0.25, o), (1.0 - f) * ops.sqr(eta) * i * thinned)
        return ops.where(lit, normals * spread, 0.0)

    def sample(self, wo, u, mode="radiance"):
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        slope = self.r * ops.sqrt(u.y)
        m = ops.normalize(ops.vec3(slope * c, slope * s, 1.0 + 0.0 * slope))
        m = ops.where(wo.z > 0.0, m, -m)
        o = ops.dot(wo, m)
        eta = ops.where(wo.z > 0.0, self.index, 1.0 / self.index)
        cos_t = fresnel.cos_transmitted(ops.abs(o), eta)
        f = fresnel.kind("exact").dielectric(ops.maximum(ops.abs(o), 1e-6), cos_t, eta)
        back = u.x < f
        wi = ops.where(back, frame.reflect(wo, m), frame.refract(wo, m, cos_t, eta))
        ok = (o > 0.0) & ops.where(back, wo.z * wi.z > 0.0, wo.z * wi.z < 0.0)
        pdf = ops.where(ok, self.pdf(wo, wi), 0.0)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), ops.where(back, 1.0, eta))

    @property
    def transmits(self):
        return True


class BrushedBubble(go.BSDF):
    """The rough surface of a bubble: index below 1, anisotropic Gaussian facets, and all reflected light is lost.

    Only the refraction of Walter2007: f = tint |o.m||i.m| (1 - F) D G / (|o.n||i.n| (o.m + eta i.m)^2), D Beckmann's
    with two widths in a rotated frame, G = max(0, G1(o) + G1(i) - 1) of V-grooves, 1 - F by Schlick's polynomial at the
    cosine in the thinner medium (or 1). All factors are symmetric apart from the index, and G <= G1(o), so at most
    all the light on the visible facets passes. Sampled by D m_z; total reflection and wrong sides are failed samples.
    """

    index: go.Number = go.number(0.7, "index inside over outside", low=0.4, high=0.9)
    alpha: go.Width = go.width((0.1, 0.5), "widths", low=0.05, high=0.8)
    turn: go.Angle = go.angle(0.5, "angle of the widths")
    lossless_facets: bool = go.flag(False, "whether no light is reflected where some can pass")
    tint: go.Colour = go.spectrum((0.0, 1.0, 0.5), "factor", low=0.0, high=1.0)

    def facet(self, wo, wi):
        o, i = frame.rotate(wo, self.turn), frame.rotate(wi, self.turn)
        eta = ops.where(wo.z > 0.0, self.index, 1.0 / self.index)
        h = o + i * eta
        h = h * ops.rsqrt(ops.maximum(ops.dot(h, h), 1e-12))
        m = ops.where(h.z < 0.0, -h, h)
        om, im = ops.dot(o, m), ops.dot(i, m)
        lit = (wo.z * wi.z < 0.0) & (om * wo.z > 0.0) & (im * wi.z > 0.0) & (m.z > 0.01)
        m_z = ops.maximum(m.z, 0.01)
        slope2 = (ops.sqr(m.x / self.alpha.x) + ops.sqr(m.y / self.alpha.y)) / ops.sqr(m_z)
        lit = lit & (slope2 < 60.0)  # exp(-60) = 1e-26: value and density end together, before they underflow
        d_mz = ops.exp(-slope2) * ops.inv_pi / (self.alpha.x * self.alpha.y * m_z * ops.sqr(m_z))
        om, im = ops.abs(om), ops.abs(im)
        thinned = ops.sqr((om + eta * im) / ((eta - 1.0) * (eta + 1.0)))
        g = ops.maximum(facet_fraction(o, m) + facet_fraction(i, m) - 1.0, 0.0)
        return eta, om, im, d_mz, m_z, thinned, g, lit

    def eval(self, wo, wi, mode="radiance"):
        eta, om, im, d_mz, m_z, thinned, g, lit = self.facet(wo, wi)
        value = om * im * d_mz / m_z * g * thinned * ops.safe_div(1.0, ops.abs(wo.z))
        if not self.lossless_facets:
            r0 = ops.sqr((eta - 1.0) / (eta + 1.0))
            value = value * (1.0 - r0) * (1.0 - ops.pow(1.0 - ops.where(eta < 1.0, im, om), 5.0))
        if mode == "importance":
            value = value * ops.sqr(eta)
        return self.tint * ops.where(lit, value, 0.0)

    def pdf(self, wo, wi):
        eta, _, im, d_mz, _, thinned, _, lit = self.facet(wo, wi)
        return ops.where(lit, d_mz * im * ops.sqr(eta) * thinned, 0.0)

    def sample(self, wo, u, mode="radiance"):
        s, c = ops.sincos(2.0 * ops.pi * u.x)  # the numbers in another order
        slope = ops.safe_sqrt(-ops.log(1.0 - u.z))
        m = ops.normalize(ops.vec3(self.alpha.x * slope * c, self.alpha.y * slope * s, 1.0 + 0.0 * slope))
        m = ops.where(wo.z > 0.0, m, -m)
        o = frame.rotate(wo, self.turn)
        om = ops.dot(o, m)
        eta = ops.where(wo.z > 0.0, self.index, 1.0 / self.index)
        cos_t = fresnel.cos_transmitted(ops.abs(om), eta)
        wi = frame.rotate_back(frame.refract(o, m, cos_t, eta), self.turn)
        ok = (om > 0.0) & (cos_t > 0.0) & (wo.z * wi.z < 0.0)
        wi = ops.where(ok, wi, -wo)
        pdf = ops.where(ok, self.pdf(wo, wi), 0.0)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), eta + 0.0 * pdf)

    @property
    def transmits(self):
        return True

    @property
    def isotropic(self):
        return False


class VarnishedMatte(go.BSDF):
    """Matte paint below a smooth, colored varnish of index n: a delta reflection F, and the rest with all bounces below.

    F = r0 + (1 - r0) (1 - cos)^5 outside, mean Fe = r0 + (1 - r0) / 21; inside the varnish a matte flux is reflected by
    Fi = 1 - (1 - Fe) / n^2. f = kd (1 - F(o)) (1 - F(i)) A(o) A(i) / (pi n^2 (1 - kd Fi)), A = exp(-depth / cos_t) on the
    way in and out: symmetric. As the mean of 1 - F is 1 - Fe, the paint's power is at most (1 - F(o)) kd (1 - Fe) /
    (n^2 (1 - kd) + kd (1 - Fe)) <= 1 - F(o). Opaque, from above only.
    """

    n: go.Number = go.number(1.5, "index of the varnish", low=1.0, high=4.0)
    kd: go.Colour = go.spectrum((0.9, 0.9, 0.9), "albedo of the paint", low=0.0, high=1.0)
    depth: go.Colour = go.spectrum((0.0, 0.1, 2.0), "optical depth of the varnish", low=0.0, high=20.0)

    def r0(self):
        return ops.sqr((self.n - 1.0) / (self.n + 1.0))

    def fresnel(self, cos):
        return self.r0() + (1.0 - self.r0()) * ops.pow(1.0 - cos, 5.0)

    def colored(self, w):
        cos = ops.maximum(w.z, 0.0)
        return ops.exp(-self.depth / ops.maximum(fresnel.cos_transmitted(cos, self.n), 1e-4)) * (
            1.0 - self.fresnel(cos)
        )

    def eval(self, wo, wi, mode="radiance"):
        enters = (1.0 - self.r0()) * (20.0 / 21.0)  # 1 - Fe
        inner = self.kd / (ops.sqr(self.n) * (1.0 - self.kd) + self.kd * enters)
        f = self.colored(wo) * self.colored(wi) * inner * ops.inv_pi
        return f * ops.where((wo.z > 0.0) & (wi.z > 0.0), wi.z, 0.0)

    def mirror_chance(self, wo):
        return 0.25 + 0.5 * self.fresnel(ops.maximum(wo.z, 0.0))

    def pdf(self, wo, wi):
        density = (1.0 - self.mirror_chance(wo)) * wi.z * ops.inv_pi
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        chance = self.mirror_chance(wo)
        delta = (u.x < chance) & (wo.z > 0.0)
        wi = ops.where(delta, frame.mirror(wo), warp.square_to_cosine_hemisphere(u.y, u.z))
        density = self.pdf(wo, wi)
        pdf = ops.where(delta, chance, density)
        value = self.eval(wo, wi, mode)
        value = ops.where(delta, self.fresnel(ops.maximum(wo.z, 0.0)) + 0.0 * value, value)
        return go.Sample(wi, value * ops.safe_div(1.0, pdf), pdf, delta, 1.0 + 0.0 * pdf)

    @property
    def delta(self):
        return "maybe"


class PaperSheet(go.BSDF):
    """A sheet by Kubelka and Munk: matte reflection and matte transmission of a layer that scatters and absorbs.

    a = 1 + K / S, b = sqrt(a^2 - 1), e = exp(-b S): R = (1 - e^2) / ((a + b) - (a - b) e^2) and T = 2 b e / (same), the
    solution of the two-flux equations, with R + T <= 1. f_r = R / pi on wo's side and f_t = T / pi on the other, the
    same medium around: symmetric constants. Sampled with R's share of the mean.
    """

    S: go.Number = go.number(2.0, "scattering over the sheet's thickness", low=0.01, high=20.0)
    K: go.Colour = go.spectrum((0.001, 0.05, 1.0), "absorption over the sheet's thickness", low=0.001, high=5.0)

    def both(self):
        q = self.K / self.S
        a, b = 1.0 + q, ops.sqrt(q * (q + 2.0))
        e = ops.exp(-b * self.S)
        under = 1.0 / ((a + b) - (a - b) * e * e)
        return (1.0 - e * e) * under, 2.0 * b * e * under

    def share(self):
        R, T = self.both()
        return ops.clamp(ops.safe_div(ops.mean(R), ops.mean(R) + ops.mean(T)), 0.05, 0.95)

    def eval(self, wo, wi, mode="radiance"):
        R, T = self.both()
        sides, cos = wo.z * wi.z, ops.inv_pi * ops.abs(wi.z)
        return R * ops.where(sides > 0.0, cos, 0.0) + T * ops.where(sides < 0.0, cos, 0.0)

    def pdf(self, wo, wi):
        sides, share = wo.z * wi.z, self.share()
        return ops.where(sides > 0.0, share, ops.where(sides < 0.0, 1.0 - share, 0.0)) * ops.inv_pi * ops.abs(wi.z)

    def sample(self, wo, u, mode="radiance"):
        wi = flipped_to(warp.square_to_cosine_hemisphere(u.y, u.z), wo, u.x < self.share())
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)

    @property
    def transmits(self):
        return True


class FogSheet(go.BSDF):
    """A thin layer of fog, scattering once, and the light that passes it unscattered.

    With mu the absolute cosines, p Henyey and Greenstein's density (integral 1) of the angle from -wo to wi, depth t:
    f_r = w p (1 - exp(-t (1/mu_o + 1/mu_i))) / (mu_o + mu_i),
    f_t = w p (exp(-t / mu_o) - exp(-t / mu_i)) / (mu_o - mu_i), and a delta straight through of exp(-t / mu_o).
    Chandrasekhar's exact single scattering: symmetric, and what is scattered is at most what the beam loses.
    g may be negative, zero or positive. The delta is chosen with probability exp(-t / mu_o), else p is sampled.
    """

    t: go.Number = go.number(0.7, "optical depth", low=0.05, high=10.0)
    g: go.Number = go.number(0.6, "mean cosine", low=-0.8, high=0.8)
    w: go.Colour = go.spectrum((1.0, 0.8, 0.0), "albedo of a droplet", low=0.0, high=1.0)

    def phase(self, wo, wi):
        g = self.g
        d = ops.maximum(1.0 + g * g + 2.0 * g * ops.dot(wo, wi), 1e-4)
        return (0.25 * ops.inv_pi) * (1.0 - g * g) / (d * ops.sqrt(d))

    def unscattered(self, wo):
        return ops.exp(-self.t / ops.maximum(ops.abs(wo.z), 1e-6))

    def eval(self, wo, wi, mode="radiance"):
        o, i = ops.maximum(ops.abs(wo.z), 1e-6), ops.maximum(ops.abs(wi.z), 1e-6)
        back = (1.0 - ops.exp(-self.t * (1.0 / o + 1.0 / i))) / (o + i)
        high, low = ops.maximum(o, i), ops.minimum(o, i)
        on = ops.exp(-self.t / high) * self.t / (o * i) * exprel(-self.t * ((high - low) / (high * low)))
        sides = wo.z * wi.z
        value = ops.where(sides > 0.0, back, ops.where(sides < 0.0, on, 0.0))
        return self.w * (value * self.phase(wo, wi) * ops.abs(wi.z))

    def pdf(self, wo, wi):
        return ops.where(wo.z * wi.z != 0.0, (1.0 - self.unscattered(wo)) * self.phase(wo, wi), 0.0)

    def sample(self, wo, u, mode="radiance"):
        straight = self.unscattered(wo)
        delta = u.x < straight
        g, s = self.g, 2.0 * u.y - 1.0
        # Henyey and Greenstein's inverse, multiplied out: no division by g
        c = (s + 0.5 * g * (s * s + 3.0) + g * g * s + 0.5 * g * g * g * (s * s - 1.0)) / ops.sqr(1.0 + g * s)
        c = ops.clamp(c, -1.0, 1.0)
        around = ops.safe_sqrt(1.0 - c * c)
        sin, cos = ops.sincos(2.0 * ops.pi * u.z)
        scattered = ops.normalize(warp.to_frame(-wo, ops.vec3(around * cos, around * sin, c)))
        wi = ops.where(delta, -wo, scattered)
        density = self.pdf(wo, wi)
        value = self.eval(wo, wi, mode) * ops.safe_div(1.0, density)
        weight = ops.where(delta, 1.0 + 0.0 * value, value)
        return go.Sample(wi, weight, ops.where(delta, straight, density), delta, 1.0 + 0.0 * density)

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "maybe"


class StainedQuarters(go.BSDF):
    """Pure diffuse transmission near the horizon, colored by the quarter of the azimuth: black for steep viewers.

    f = s(wo) s(wi) / pi for opposite sides, s = 0 where |cos| >= edge, else one of two colors by the sign of x y in a
    turned frame: a product of the same function, hence symmetric; s <= 1, so the power is at most edge^2 <= 1.
    The sampler fills the ring |cos| < edge of the other side in proportion to |cos| (pdf = |cos| / (pi edge^2)), also
    for viewers who see only black (weight 0).
    """

    even: go.Colour = go.spectrum((1.0, 0.0, 0.2), "color where x y > 0", low=0.0, high=1.0)
    odd: go.Colour = go.spectrum((0.1, 0.6, 1.0), "color elsewhere", low=0.0, high=1.0)
    edge: go.Number = go.number(0.35, "cosine from which on it is black", low=0.02, high=1.0)
    turn: go.Angle = go.angle(0.2, "angle of the quarters")

    def s(self, w):
        t = frame.rotate(w, self.turn)
        return ops.where(t.x * t.y > 0.0, self.even, self.odd) * ops.where(ops.abs(w.z) < self.edge, 1.0, 0.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.s(wo) * self.s(wi) * ops.where(wo.z * wi.z < 0.0, ops.abs(wi.z) * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        inside = (wo.z * wi.z < 0.0) & (ops.abs(wi.z) < self.edge)
        return ops.where(inside, ops.abs(wi.z) * ops.inv_pi / ops.sqr(self.edge), 0.0)

    def sample(self, wo, u, mode="radiance"):
        z = self.edge * ops.sqrt(u.x)
        across = ops.safe_sqrt(1.0 - z * z)
        s, c = ops.sincos(2.0 * ops.pi * u.y)
        wi = ops.vec3(across * c, across * s, -ops.copysign(z, wo.z))
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)

    @property
    def transmits(self):
        return True

    @property
    def isotropic(self):
        return False


class TwoSidedCap(go.BSDF):
    """An opaque two-sided gloss that is constant within a cap about the mirror direction, and 0 outside.

    f = k / (Omega max(|cos_o|, |cos_i|)) where the angle between mirror(wo) and wi is below `width`, Omega = 2 pi
    (1 - cos width); that angle is the same with wo and wi exchanged. Power <= k since cos_i / max <= 1 and the cap holds
    Omega. Both from above and from below (`two_sided`). Sampled evenly in the cap; what falls below fails.
    """

    k: go.Colour = go.spectrum((0.3, 0.9, 0.0), "reflectance", low=0.0, high=1.0)
    width: go.Number = go.number(0.4, "half angle of the cap", low=0.05, high=1.5)

    def versine(self):
        return 2.0 * ops.sqr(ops.sin(0.5 * self.width))  # 1 - cos

    def pdf(self, wo, wi):
        off = wi - frame.mirror(wo)
        inside = (ops.dot(off, off) < 2.0 * self.versine()) & (wo.z * wi.z > 0.0)
        return ops.where(inside, (0.5 * ops.inv_pi) / self.versine(), 0.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.k * (self.pdf(wo, wi) * balanced(wo, wi))

    def sample(self, wo, u, mode="radiance"):
        v = u.y * self.versine()
        across = ops.safe_sqrt(v * (2.0 - v))
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        wi = ops.normalize(warp.to_frame(frame.mirror(wo), ops.vec3(across * c, across * s, 1.0 - v)))
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)

    @property
    def two_sided(self):
        return True


SOUND = [PhongWindow, FourLobes, SnellMatte, TopHatGlass, BrushedBubble, VarnishedMatte, PaperSheet, FogSheet,
         StainedQuarters, TwoSidedCap]  # fmt: skip
