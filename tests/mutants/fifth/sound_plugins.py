"""Ten Mitsuba plugins in Python, with textures and several components. All take their defaults if nothing is given.

In Mitsuba's names: si.wi is given (the viewer, in radiance mode), wo is sampled, eval = f |cos wo|. A skeleton combines
the lobes: those that the context enables are chosen with their chances (fixed numbers, or functions of si alone) over
the sum of the enabled chances; the density is the sum over the enabled smooth lobes, and the weight of a smooth sample
is the sum of the enabled smooth values over it. A delta sample has its probability as pdf and value / probability as weight.
"""

import gonio as go  # noqa: F401  (before Mitsuba)
import drjit as dr
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")

F = mi.BSDFFlags
INV_PI = 1.0 / dr.pi


KINDS = (F.Null, F.DiffuseReflection, F.DiffuseTransmission, F.GlossyReflection, F.GlossyTransmission, F.DeltaReflection,
         F.DeltaTransmission)  # fmt: skip


def kind_of(flag):
    """The kind of lobe in a flag, without its sides and properties."""
    return next(kind for kind in KINDS if int(flag) & int(kind))


class Lobe:
    """One component: `value(wo)` f |cos| (or the reflectance of a delta), `density(wo)`, `draw(u)`, probability `chance`."""

    def __init__(self, flag, chance, value, draw, density=None, eta=1.0):
        self.flag, self.chance, self.value, self.draw, self.density, self.eta = flag, chance, value, draw, density, eta

    @property
    def delta(self):
        return self.density is None


class Skeleton(mi.BSDF):
    """Everything but the lobes."""

    FLAGS: tuple = ()

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.m_components = [int(flag) for flag in self.FLAGS]
        flags = 0
        for flag in self.FLAGS:
            flags |= int(flag)
        self.m_flags = flags
        self.textures, self.numbers = {}, {}
        self.setup(props)

    def texture(self, props, name, default):
        """A nested texture or a number; the default may be a number or a texture."""
        given = props.has_property(name) or isinstance(default, float)
        arguments = (default,) if isinstance(default, float) else ()
        self.textures[name] = props.get_texture(name, *arguments) if given else default

    def number(self, props, name, default, low, high):
        self.numbers[name] = mi.Float(min(max(float(props.get(name, default)), low), high))

    def color(self, name, si, active=True):
        """A texture's color, clamped to [0, 1]."""
        return dr.clip(mi.Color3f(self.textures[name].eval(si, active)), 0.0, 1.0)

    def enabled(self, ctx, si, active):
        lobes = self.lobes(ctx, si, active)
        return [(index, lobe) for index, lobe in enumerate(lobes) if ctx.is_enabled(kind_of(lobe.flag), index)]

    def eval(self, ctx, si, wo, active=True):
        total = mi.Color3f(0.0)
        for _, lobe in self.enabled(ctx, si, active):
            if not lobe.delta:
                total = total + lobe.value(wo)
        return dr.select(active, total, 0.0)

    def pdf(self, ctx, si, wo, active=True):
        total, chances = mi.Float(0.0), mi.Float(0.0)
        for _, lobe in self.enabled(ctx, si, active):
            chances = chances + lobe.chance
            if not lobe.delta:
                total = total + lobe.chance * lobe.density(wo)
        return dr.select(active & (chances > 0.0), total / dr.maximum(chances, 1e-20), 0.0)

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def sample(self, ctx, si, sample1, sample2, active=True):
        bs = dr.zeros(mi.BSDFSample3f)
        lobes = self.enabled(ctx, si, active)
        if not lobes:
            return bs, mi.Color3f(0.0)
        chances = mi.Float(0.0)
        for _, lobe in lobes:
            chances = chances + lobe.chance
        x, start = sample1 * chances, mi.Float(0.0)
        wo, eta, delta = mi.Vector3f(0.0, 0.0, 1.0), mi.Float(1.0), mi.Bool(False)
        value, chance, hit = mi.Color3f(0.0), mi.Float(0.0), mi.Bool(True)
        kind, component = mi.UInt32(0), mi.UInt32(0)
        for place, (index, lobe) in enumerate(lobes):
            picked = x >= start
            if place + 1 < len(lobes):
                picked &= x < start + lobe.chance
            start = start + lobe.chance
            drawn = lobe.draw(sample2)
            wo = dr.select(picked, drawn, wo)
            eta = dr.select(picked, lobe.eta, eta)
            kind = dr.select(picked, mi.UInt32(int(kind_of(lobe.flag))), kind)
            component = dr.select(picked, mi.UInt32(index), component)
            chance = dr.select(picked, lobe.chance, chance)
            if lobe.delta:
                delta = dr.select(picked, mi.Bool(True), delta)
                value = dr.select(picked, lobe.value(drawn), value)
            else:  # a sample that misses its own lobe fails, even if another lobe could reach it
                hit = dr.select(picked, lobe.density(drawn) > 0.0, hit)
        probability = chance / dr.maximum(chances, 1e-20)
        density = self.pdf(ctx, si, wo, active)
        smooth = self.eval(ctx, si, wo, active)
        bs.wo = wo
        bs.pdf = dr.select(active & hit, dr.select(delta, probability, density), 0.0)
        bs.eta = eta
        bs.sampled_type = kind
        bs.sampled_component = component
        ok = active & (bs.pdf > 0.0)
        weight = dr.select(delta, value, smooth) / dr.select(ok, bs.pdf, 1.0)
        return bs, dr.select(ok, weight, 0.0)

    def traverse(self, callback):
        for name, texture in self.textures.items():
            callback.put(name, texture, mi.ParamFlags.Differentiable)

    def to_string(self):
        return f"{type(self).__name__}[]"


def same_side(wi, wo):
    return wi.z * wo.z > 0.0


def matte(si, flag, chance, color, side=None, through=False):
    """A Lambertian lobe of this color: on wi's side, or through to the other one; side +1, -1: only for wi there."""
    wi = si.wi
    sees = mi.Bool(True) if side is None else (wi.z * side > 0.0)
    up = dr.select(wi.z < 0.0, -1.0, 1.0) * (-1.0 if through else 1.0)

    def density(wo):
        product = wi.z * wo.z
        lit = sees & ((product < 0.0) if through else (product > 0.0))
        return dr.select(lit, dr.abs(wo.z) * INV_PI, 0.0)

    def draw(u):
        w = mi.warp.square_to_cosine_hemisphere(u)
        return mi.Vector3f(w.x, w.y, w.z * up)

    return Lobe(flag, chance, lambda wo: color * density(wo), draw, density)


class WeaveMatte(Skeleton):
    """Two matte threads, warp and weft, each with its texture; a third of the area is warp. From above only.

    f = (a / 3 + 2 b / 3) / pi with a, b in [0, 1]: constant in the directions. The warp is sampled with probability 0.9.
    """

    FLAGS = (F.DiffuseReflection | F.FrontSide, F.DiffuseReflection | F.FrontSide)

    def setup(self, props):
        self.texture(props, "warp", 0.9)
        self.texture(props, "weft", mi.load_dict({"type": "checkerboard", "color0": 0.1, "color1": 0.8}))

    def lobes(self, ctx, si, active):
        a, b = self.color("warp", si, active) * (1.0 / 3.0), self.color("weft", si, active) * (2.0 / 3.0)
        return [matte(si, self.FLAGS[0], 0.9, a, side=1.0), matte(si, self.FLAGS[1], 0.1, b, side=1.0)]


class SilveredMatte(Skeleton):
    """A delta mirror over a share of the area, matte paint on the rest; both sides of an opaque sheet.

    Reflectance share + (1 - share) paint <= 1. Mirrored with probability 0.2, whatever the share is.
    """

    FLAGS = (F.DeltaReflection | F.FrontSide | F.BackSide, F.DiffuseReflection | F.FrontSide | F.BackSide)

    def setup(self, props):
        self.number(props, "share", 0.6, 0.0, 1.0)
        self.texture(props, "paint", mi.load_dict({"type": "rgb", "value": [0.9, 0.2, 0.0]}))

    def lobes(self, ctx, si, active):
        share, paint = self.numbers["share"], self.color("paint", si, active)
        mirror = Lobe(self.FLAGS[0], 0.2, lambda wo: mi.Color3f(share), lambda u: mi.reflect(si.wi))
        return [mirror, matte(si, self.FLAGS[1], 0.8, paint * (1.0 - share))]


class ToonPane(Skeleton):
    """A thin pane that reflects in steps: one color where |cos| < 0.3, another one below 0.7, nothing above; what is not
    reflected passes straight on, times a tint.

    By |cos| alone, the same for wo = -wi and the mirror direction: symmetric; R + (1 - R) tint <= 1.
    """

    FLAGS = (F.DeltaReflection | F.FrontSide | F.BackSide, F.Null | F.FrontSide | F.BackSide)

    def setup(self, props):
        self.texture(props, "low", mi.load_dict({"type": "rgb", "value": [1.0, 0.8, 0.0]}))
        self.texture(props, "middle", mi.load_dict({"type": "rgb", "value": [0.0, 0.5, 0.2]}))
        self.texture(props, "tint", 0.9)

    def lobes(self, ctx, si, active):
        cos = dr.abs(si.wi.z)
        low, middle = self.color("low", si, active), self.color("middle", si, active)
        R = dr.select(cos < 0.3, low, dr.select(cos < 0.7, middle, 0.0))
        T = (1.0 - R) * self.color("tint", si, active)
        back = Lobe(self.FLAGS[0], 0.5, lambda wo: R, lambda u: mi.reflect(si.wi))
        return [back, Lobe(self.FLAGS[1], 0.5, lambda wo: T, lambda u: -si.wi)]


class Leaf(Skeleton):
    """A leaf: another matte color on each side, and matte transmission, the same both ways.

    From above through + (1 - through) upper, from below with `lower`: at most 1. Constant in the directions; the same
    medium on both sides.
    """

    FLAGS = (F.DiffuseReflection | F.FrontSide, F.DiffuseReflection | F.BackSide,
             F.DiffuseTransmission | F.FrontSide | F.BackSide)  # fmt: skip

    def setup(self, props):
        self.texture(props, "upper", mi.load_dict({"type": "rgb", "value": [0.1, 0.5, 0.05]}))
        self.texture(props, "lower", mi.load_dict({"type": "rgb", "value": [0.5, 0.7, 0.4]}))
        self.texture(props, "through", mi.load_dict({"type": "rgb", "value": [0.2, 0.6, 0.0]}))

    def lobes(self, ctx, si, active):
        T = self.color("through", si, active)
        upper, lower = (1.0 - T) * self.color("upper", si, active), (1.0 - T) * self.color("lower", si, active)
        above = dr.select(si.wi.z > 0.0, mi.Float(1.0), 0.0)
        return [
            matte(si, self.FLAGS[0], 0.3 * above, upper, side=1.0),
            matte(si, self.FLAGS[1], 0.6 * (1.0 - above), lower, side=-1.0),
            matte(si, self.FLAGS[2], 0.5, T, through=True),
        ]


def snell(wi, index):
    """eta (far side over wi's side), its inverse, cosine of the refracted direction (0: total reflection)."""
    eta = dr.select(wi.z > 0.0, index, 1.0 / index)
    cos2 = 1.0 - (1.0 - dr.square(wi.z)) / dr.square(eta)
    return eta, dr.sqrt(dr.maximum(cos2, 0.0))


class PaleGlass(Skeleton):
    """Smooth glass of index 0.8 (a bubble) by Schlick's polynomial at the cosine in the thinner medium, which is the same
    both ways; 1 in total reflection. Power tint_r F + tint_t (1 - F) <= 1; radiance is scaled by 1 / eta^2.

    Chances 0.1 + 0.8 F, and the rest for refraction, 0 in total reflection.
    """

    FLAGS = (F.DeltaReflection | F.FrontSide | F.BackSide,
             F.DeltaTransmission | F.FrontSide | F.BackSide | F.NonSymmetric)  # fmt: skip

    def setup(self, props):
        self.number(props, "index", 0.8, 0.3, 4.0)
        self.texture(props, "tint_r", 1.0)
        self.texture(props, "tint_t", mi.load_dict({"type": "rgb", "value": [0.3, 1.0, 0.8]}))

    def lobes(self, ctx, si, active):
        eta, cos_t = snell(si.wi, self.numbers["index"])
        thin = dr.select(eta < 1.0, cos_t, dr.abs(si.wi.z))
        r0 = dr.square((eta - 1.0) / (eta + 1.0))
        f = r0 + (1.0 - r0) * dr.power(dr.maximum(1.0 - thin, 0.0), 5)
        total = cos_t <= 0.0
        f = dr.select(total, 1.0, f)
        chance = dr.select(total, 1.0, 0.1 + 0.8 * f)
        scale = 1.0 / dr.square(eta) if ctx.mode == mi.TransportMode.Radiance else mi.Float(1.0)
        R = self.color("tint_r", si, active) * f
        T = self.color("tint_t", si, active) * (1.0 - f) * scale
        bent = mi.Vector3f(-si.wi.x / eta, -si.wi.y / eta, dr.select(si.wi.z > 0.0, -cos_t, cos_t))
        bent = dr.select(total, -si.wi, bent)
        return [
            Lobe(self.FLAGS[0], chance, lambda wo: R, lambda u: mi.reflect(si.wi)),
            Lobe(self.FLAGS[1], 1.0 - chance, lambda wo: T, lambda u: bent, eta=eta),
        ]


def groove(v, m):
    """G1 of V-grooves."""
    return dr.minimum(1.0, 2.0 * m.z * dr.abs(v.z) / dr.maximum(dr.abs(dr.dot(v, m)), 1e-8))


class GrooveGlass(Skeleton):
    """Rough glass of index 1.8 by Walter2007 with Beckmann's D and V-grooves, sampled poorly: reflection and refraction
    with probability 0.5 each, whatever F is.

    G = min(G1(i), G1(o)), or max(0, G1(i) + G1(o) - 1) in refraction, symmetric and at most G1(i); the visible facets
    integrate to 1 and are split by the exact F. Normals by D m_z, so weights are at most 2 F / 0.5.
    """

    FLAGS = (F.GlossyReflection | F.FrontSide | F.BackSide,
             F.GlossyTransmission | F.FrontSide | F.BackSide | F.NonSymmetric)  # fmt: skip

    def setup(self, props):
        self.number(props, "index", 1.8, 1.1, 3.0)
        self.number(props, "alpha", 0.3, 0.05, 0.8)
        self.texture(props, "tint", mi.load_dict({"type": "rgb", "value": [1.0, 0.9, 0.5]}))

    def lobes(self, ctx, si, active):
        wi, index, alpha = si.wi, self.numbers["index"], self.numbers["alpha"]
        tint = self.color("tint", si, active)
        eta = dr.select(wi.z > 0.0, index, 1.0 / index)

        def facet(wo, back):
            h = wi + wo if back else wi + wo * eta
            h = h * dr.rsqrt(dr.maximum(dr.squared_norm(h), 1e-12))
            m = dr.select(h.z < 0.0, -h, h)
            a, b = dr.dot(wi, m), dr.dot(wo, m)
            sides = wi.z * wo.z
            lit = ((sides > 0.0) if back else (sides < 0.0)) & (a * wi.z > 0.0) & (b * wo.z > 0.0) & (m.z > 0.02)
            m_z = dr.maximum(m.z, 0.02)
            tan2 = (dr.square(m.x) + dr.square(m.y)) / dr.square(m_z)
            slope2 = tan2 / dr.square(alpha)
            lit &= slope2 < 60.0
            d_mz = dr.exp(-slope2) * INV_PI / (dr.square(alpha) * m_z * dr.square(m_z))
            return m, dr.abs(a), dr.abs(b), m_z, d_mz, lit

        def fresnel(c, t):
            """The mean of s and p at cosines c (wi's side) and t; 1 for t = 0."""
            s = (c - eta * t) / dr.maximum(c + eta * t, 1e-8)
            p = (eta * c - t) / dr.maximum(eta * c + t, 1e-8)
            return dr.minimum(0.5 * (s * s + p * p), 1.0)

        def density(wo, back):
            m, a, b, m_z, d_mz, lit = facet(wo, back)
            if back:
                return dr.select(lit, d_mz / dr.maximum(4.0 * a, 1e-8), 0.0)
            thinned = dr.square((a + eta * b) / ((eta - 1.0) * (eta + 1.0)))
            return dr.select(lit, d_mz * b * dr.square(eta) * thinned, 0.0)

        def value(wo, back):
            m, a, b, m_z, d_mz, lit = facet(wo, back)
            g_i, g_o = groove(wi, m), groove(wo, m)
            over = d_mz / (m_z * dr.maximum(dr.abs(wi.z), 1e-12))
            if back:
                t = dr.sqrt(dr.maximum(1.0 - (1.0 - a * a) / dr.square(eta), 0.0))
                result = 0.25 * fresnel(a, t) * dr.minimum(g_i, g_o) * over
            else:
                thinned = dr.square((a + eta * b) / ((eta - 1.0) * (eta + 1.0)))
                result = a * b * (1.0 - fresnel(a, b)) * dr.maximum(g_i + g_o - 1.0, 0.0) * over * thinned
                if ctx.mode != mi.TransportMode.Radiance:
                    result = result * dr.square(eta)
            return tint * dr.select(lit, result, 0.0)

        def draw(u, back):
            slope = alpha * dr.sqrt(-dr.log(1.0 - u.x))
            s, c = dr.sincos(2.0 * dr.pi * u.y)
            m = dr.normalize(mi.Vector3f(slope * c, slope * s, 1.0))
            m = dr.select(wi.z < 0.0, -m, m)
            a = dr.dot(wi, m)
            if back:
                return dr.select(a > 0.0, 2.0 * a * m - wi, -wi)
            cos2 = 1.0 - (1.0 - a * a) / dr.square(eta)
            bent = m * (a / eta - dr.sqrt(dr.maximum(cos2, 0.0))) - wi / eta
            # a failed sample is put on the wrong side, where this lobe's density is 0
            return dr.select((a > 0.0) & (cos2 > 0.0), dr.normalize(bent), mi.reflect(wi))

        def lobe(back):
            return Lobe(
                self.FLAGS[0 if back else 1], 0.5,
                lambda wo: value(wo, back), lambda u: draw(u, back), lambda wo: density(wo, back),
                eta=1.0 if back else eta,
            )  # fmt: skip

        return [lobe(True), lobe(False)]


class CatsEye(Skeleton):
    """A retro-reflecting cosine power and a mirroring one, on both sides of an opaque sheet.

    f = color (n + 1) / (2 pi) max(axis.wo, 0)^n / max(|cos_i|, |cos_o|) with axis wi or its mirror image: symmetric, at
    most color each; colors share tint and (1 - share) tint. Zero where the power is below 1e-30.
    """

    FLAGS = (F.GlossyReflection | F.FrontSide | F.BackSide, F.GlossyReflection | F.FrontSide | F.BackSide)

    def setup(self, props):
        self.number(props, "share", 0.7, 0.0, 1.0)
        self.number(props, "n_back", 80.0, 1.0, 1000.0)
        self.number(props, "n_mirror", 6.0, 1.0, 1000.0)
        self.texture(props, "tint", mi.load_dict({"type": "rgb", "value": [0.9, 0.9, 0.1]}))

    def power(self, si, axis, n, color, flag, chance):
        wi = si.wi

        def density(wo):
            p = dr.power(dr.clip(dr.dot(axis, wo), 1e-30, 1.0), n)
            return dr.select(same_side(wi, wo) & (p > 1e-30), (n + 1.0) * (0.5 * INV_PI) * p, 0.0)

        def value(wo):
            return color * (density(wo) * dr.abs(wo.z) / dr.maximum(dr.maximum(dr.abs(wi.z), dr.abs(wo.z)), 1e-20))

        def draw(u):
            cos = dr.power(1.0 - u.x, 1.0 / (n + 1.0))
            sin = dr.sqrt(dr.maximum(1.0 - cos * cos, 0.0))
            s, c = dr.sincos(2.0 * dr.pi * u.y)
            return dr.normalize(mi.Frame3f(axis).to_world(mi.Vector3f(sin * c, sin * s, cos)))

        return Lobe(flag, chance, value, draw, density)

    def lobes(self, ctx, si, active):
        share, tint, n = self.numbers["share"], self.color("tint", si, active), self.numbers
        return [
            self.power(si, si.wi, n["n_back"], tint * share, self.FLAGS[0], 0.25),
            self.power(si, mi.reflect(si.wi), n["n_mirror"], tint * (1.0 - share), self.FLAGS[1], 0.75),
        ]


class RuledPaper(Skeleton):
    """Matte paper with fringes by the sum of both tangential components along a turned axis; anisotropic, from above.

    f = paper (1 + depth cos(2 pi lines (t.wi + t.wo))) / (2 pi), t the axis: symmetric, and at most paper / pi.
    """

    FLAGS = (F.DiffuseReflection | F.FrontSide | F.Anisotropic,)

    def setup(self, props):
        self.number(props, "lines", 3.0, 0.0, 20.0)
        self.number(props, "depth", 1.0, -1.0, 1.0)
        self.number(props, "angle", 0.5, -10.0, 10.0)
        self.texture(props, "paper", mi.load_dict({"type": "rgb", "value": [0.95, 0.95, 0.4]}))

    def lobes(self, ctx, si, active):
        s, c = dr.sincos(self.numbers["angle"])
        base = matte(si, self.FLAGS[0], 1.0, self.color("paper", si, active), side=1.0)

        def value(wo):
            along = c * (si.wi.x + wo.x) + s * (si.wi.y + wo.y)
            fringe = 0.5 + 0.5 * self.numbers["depth"] * dr.cos(2.0 * dr.pi * self.numbers["lines"] * along)
            return self.color("paper", si, active) * (base.density(wo) * fringe)

        return [Lobe(self.FLAGS[0], 1.0, value, base.draw, base.density)]


class BackPaint(Skeleton):
    """Black from above; from below matte paint within a hard ring of cosines, for both directions.

    f = paint r(wi) r(wo) / pi below, r = 1 where 0.2 < |cos| < 0.9: a product of the same function, at most paint / pi.
    Sampled by the cosine, also outside of the ring (weight 0).
    """

    FLAGS = (F.DiffuseReflection | F.BackSide,)

    def setup(self, props):
        self.texture(props, "paint", mi.load_dict({"type": "rgb", "value": [0.0, 0.8, 0.9]}))

    def lobes(self, ctx, si, active):
        base = matte(si, self.FLAGS[0], 1.0, self.color("paint", si, active), side=-1.0)

        def ring(w):
            return dr.select((dr.abs(w.z) > 0.2) & (dr.abs(w.z) < 0.9), mi.Float(1.0), 0.0)

        return [Lobe(self.FLAGS[0], 1.0, lambda wo: base.value(wo) * (ring(si.wi) * ring(wo)), base.draw, base.density)]


class SteppedGloss(Skeleton):
    """Toon gloss: the half vector's cosine decides between three steps; and matte paint below, of what the steps leave.

    f = (step gloss + (1 - step) paint) / pi with step 1, 0.5 or 0 by m.z > 0.98, > 0.8: symmetric, since the half vector
    is, and between 0 and 1 / pi. The gloss (component 0) is sampled by a power lobe about the normal mixed with the
    cosine, the paint by the cosine.
    """

    FLAGS = (F.GlossyReflection | F.FrontSide, F.DiffuseReflection | F.FrontSide)

    def setup(self, props):
        self.texture(props, "gloss", 1.0)
        self.texture(props, "paint", mi.load_dict({"type": "checkerboard", "color0": {"type": "rgb", "value": [0.8, 0.0, 0.1]},
                                                   "color1": {"type": "rgb", "value": [0.0, 0.2, 0.8]}}))  # fmt: skip

    def lobes(self, ctx, si, active):
        gloss, paint = self.color("gloss", si, active), self.color("paint", si, active)
        base = matte(si, self.FLAGS[1], 0.6, paint, side=1.0)

        def step(wo):
            h = si.wi + wo
            z = h.z * dr.rsqrt(dr.maximum(dr.squared_norm(h), 1e-12))
            return dr.select(z > 0.98, mi.Float(1.0), dr.select(z > 0.8, 0.5, 0.0))

        def density(wo):
            lit = (si.wi.z > 0.0) & (wo.z > 0.0)
            p = 6.0 * dr.power(dr.clip(wo.z, 1e-6, 1.0), 5.0)  # exponent 5, integral 1 with 1 / (2 pi)
            return dr.select(lit, 0.5 * p * (0.5 * INV_PI), 0.0) + 0.5 * base.density(wo)

        def draw(u):
            narrow = u.y < 0.5
            y = dr.select(narrow, 2.0 * u.y, 2.0 * u.y - 1.0)
            cos = dr.select(narrow, dr.power(1.0 - u.x, 1.0 / 6.0), dr.sqrt(1.0 - u.x))
            sin = dr.sqrt(dr.maximum(1.0 - cos * cos, 0.0))
            s, c = dr.sincos(2.0 * dr.pi * y)
            return mi.Vector3f(sin * c, sin * s, cos)

        return [
            Lobe(self.FLAGS[0], 0.4, lambda wo: gloss * (base.density(wo) * step(wo)), draw, density),
            Lobe(self.FLAGS[1], 0.6, lambda wo: base.value(wo) * (1.0 - step(wo)), base.draw, base.density),
        ]


PLUGINS = {
    "r2_weave_matte": WeaveMatte,
    "r2_silvered_matte": SilveredMatte,
    "r2_toon_pane": ToonPane,
    "r2_leaf": Leaf,
    "r2_pale_glass": PaleGlass,
    "r2_groove_glass": GrooveGlass,
    "r2_cats_eye": CatsEye,
    "r2_ruled_paper": RuledPaper,
    "r2_back_paint": BackPaint,
    "r2_stepped_gloss": SteppedGloss,
}

mi.register_bsdf("r2_weave_matte", lambda p: WeaveMatte(p))
mi.register_bsdf("r2_silvered_matte", lambda p: SilveredMatte(p))
mi.register_bsdf("r2_toon_pane", lambda p: ToonPane(p))
mi.register_bsdf("r2_leaf", lambda p: Leaf(p))
mi.register_bsdf("r2_pale_glass", lambda p: PaleGlass(p))
mi.register_bsdf("r2_groove_glass", lambda p: GrooveGlass(p))
mi.register_bsdf("r2_cats_eye", lambda p: CatsEye(p))
mi.register_bsdf("r2_ruled_paper", lambda p: RuledPaper(p))
mi.register_bsdf("r2_back_paint", lambda p: BackPaint(p))
mi.register_bsdf("r2_stepped_gloss", lambda p: SteppedGloss(p))

SOUND = list(PLUGINS.values())
