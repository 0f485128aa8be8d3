"""Mitsuba plugins in Python that look odd and are right. si.wi is the viewer, wo the light."""

import gonio as go  # noqa: F401  first: it makes LLVM found
import mitsuba as mi

if mi.variant() is None:
    mi.set_variant("llvm_ad_rgb")

import drjit as dr

F = mi.BSDFFlags
PI = dr.pi


def side(w):
    return mi.Frame3f.cos_theta(w)


class CheckeredGloss(mi.BSDF):
    """Two lobes: component 0 a matte base, component 1 a modified Phong lobe; reflectance may be a texture."""

    fault = "The lobe's probability is that of the texture at the point, so densities differ over the surface; the Phong lobe is cut at the horizon and samples fail there."
    cause = ""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        board = {"type": "checkerboard", "color0": 0.1, "color1": 0.7}
        given = props.has_property("reflectance")
        self.reflectance = props.get_texture("reflectance") if given else mi.load_dict(board)
        self.specular = props.get_texture("specular", 0.2)
        self.exponent = mi.Float(props.get("exponent", 30.0))
        self.set_flags()

    def set_flags(self):
        self.m_components = [F.DiffuseReflection | F.FrontSide, F.GlossyReflection | F.FrontSide]
        self.m_flags = self.m_components[0] | self.m_components[1]

    def traverse(self, callback):
        callback.put("reflectance", self.reflectance, mi.ParamFlags.Differentiable)
        callback.put("specular", self.specular, mi.ParamFlags.Differentiable)
        callback.put("exponent", self.exponent, mi.ParamFlags.Differentiable)

    # -- pieces

    def enabled(self, ctx):
        return ctx.is_enabled(F.DiffuseReflection, 0), ctx.is_enabled(F.GlossyReflection, 1)

    def share(self, ctx, si, active):
        """Probability of the glossy lobe."""
        matte, gloss = self.enabled(ctx)
        if matte and gloss:
            s, d = self.specular.eval_1(si, active), self.reflectance.eval_1(si, active)
            return dr.select(s + d > 0, s / (s + d), 0.5)
        return mi.Float(1.0 if gloss else 0.0)

    def cos_alpha(self, si, wo):
        return dr.maximum(dr.dot(mi.reflect(si.wi), wo), 0.0)

    def power(self, c):
        return dr.select(c > 0, dr.power(dr.maximum(c, 1e-8), self.exponent), 0.0)

    def colours(self, si, active):
        return self.reflectance.eval(si, active), self.specular.eval(si, active)

    def cosine(self, si, wo):
        return side(wo)

    def value(self, ctx, si, wo, active):
        matte, gloss = self.enabled(ctx)
        d, s = self.colours(si, active)
        value = mi.Spectrum(0.0)
        if matte:
            value += d * (1 - s) / PI
        if gloss:
            value += s * (self.exponent + 2) / (2 * PI) * self.power(self.cos_alpha(si, wo))
        lit = active & (side(si.wi) > 0) & (side(wo) > 0)
        return dr.select(lit, value * self.cosine(si, wo), 0.0)

    def density(self, ctx, si, wo, active):
        share = self.share(ctx, si, active)
        gloss = (self.exponent + 1) / (2 * PI) * self.power(self.cos_alpha(si, wo))
        p = share * gloss + (1 - share) * mi.warp.square_to_cosine_hemisphere_pdf(wo)
        return dr.select(active & (side(si.wi) > 0) & (side(wo) > 0), p, 0.0)

    def draw(self, ctx, si, sample1, sample2, active):
        """A direction, and whether it is of the glossy lobe."""
        gloss = sample1 < self.share(ctx, si, active)
        matte = mi.warp.square_to_cosine_hemisphere(sample2)
        c = dr.power(dr.maximum(1 - sample2.x, 1e-12), 1 / (self.exponent + 1))
        s = dr.safe_sqrt(1 - c * c)
        sin, cos = dr.sincos(2 * PI * sample2.y)
        lobe = mi.Frame3f(mi.reflect(si.wi)).to_world(mi.Vector3f(s * cos, s * sin, c))
        return dr.select(gloss, lobe, matte), gloss

    # -- what renderers call

    def eval(self, ctx, si, wo, active=True):
        return self.value(ctx, si, wo, mi.Mask(active))

    def pdf(self, ctx, si, wo, active=True):
        return self.density(ctx, si, wo, mi.Mask(active))

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def eval_pdf_sample(self, ctx, si, wo, sample1, sample2, active=True):
        bs, weight = self.sample(ctx, si, sample1, sample2, active)
        return (*self.eval_pdf(ctx, si, wo, active), bs, weight)

    def sample(self, ctx, si, sample1, sample2, active=True):
        bs, active = mi.BSDFSample3f(), mi.Mask(active)
        matte_on, gloss_on = self.enabled(ctx)
        if not (matte_on or gloss_on):
            return dr.zeros(mi.BSDFSample3f), mi.Spectrum(0.0)
        bs.wo, gloss = self.draw(ctx, si, sample1, sample2, active)
        bs.pdf = self.density(ctx, si, bs.wo, active)
        self.describe(bs, gloss)
        ok = active & (bs.pdf > 0)
        return bs, dr.select(ok, self.value(ctx, si, bs.wo, active) / dr.select(ok, bs.pdf, 1.0), 0.0)

    def describe(self, bs, gloss):
        bs.eta = 1.0
        bs.sampled_type = dr.select(gloss, mi.UInt32(+F.GlossyReflection), mi.UInt32(+F.DiffuseReflection))
        bs.sampled_component = dr.select(gloss, mi.UInt32(1), mi.UInt32(0))

    def to_string(self):
        return type(self).__name__ + "[]"


class SoundLacquer(mi.BSDF):
    """A smooth lacquer (component 1, delta) over a matte base (component 0)."""

    fault = "One component is a delta lobe, chosen by Fresnel at the viewer; eval and pdf answer for the matte base alone and keep its probability."
    cause = ""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.reflectance = props.get_texture("reflectance", 0.6)
        self.r0 = mi.Float(props.get("r0", 0.06))
        self.m_components = [F.DiffuseReflection | F.FrontSide, F.DeltaReflection | F.FrontSide]
        self.m_flags = self.m_components[0] | self.m_components[1]

    def traverse(self, callback):
        callback.put("reflectance", self.reflectance, mi.ParamFlags.Differentiable)
        callback.put("r0", self.r0, mi.ParamFlags.Differentiable)

    def fresnel(self, c):
        return self.r0 + (1 - self.r0) * dr.power(dr.clip(1 - c, 1e-12, 1), 5)

    def chance(self, ctx, si):
        """Probability of the mirror."""
        matte, mirror = ctx.is_enabled(F.DiffuseReflection, 0), ctx.is_enabled(F.DeltaReflection, 1)
        return self.fresnel(dr.abs(side(si.wi))) if matte and mirror else mi.Float(1.0 if mirror else 0.0)

    def eval(self, ctx, si, wo, active=True):
        if not ctx.is_enabled(F.DiffuseReflection, 0):
            return mi.Spectrum(0.0)
        i, o = side(si.wi), side(wo)
        value = self.reflectance.eval(si, mi.Mask(active)) * ((1 - self.fresnel(i)) * (1 - self.fresnel(o)) * o / PI)
        return dr.select(mi.Mask(active) & (i > 0) & (o > 0), value, 0.0)

    def pdf(self, ctx, si, wo, active=True):
        if not ctx.is_enabled(F.DiffuseReflection, 0):
            return mi.Float(0.0)
        p = mi.warp.square_to_cosine_hemisphere_pdf(wo) * (1 - self.chance(ctx, si))
        return dr.select(mi.Mask(active) & (side(si.wi) > 0) & (side(wo) > 0), p, 0.0)

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def eval_pdf_sample(self, ctx, si, wo, sample1, sample2, active=True):
        return (*self.eval_pdf(ctx, si, wo, active), *self.sample(ctx, si, sample1, sample2, active))

    def types(self, mirror):
        return dr.select(mirror, mi.UInt32(+F.DeltaReflection), mi.UInt32(+F.DiffuseReflection))

    def sample(self, ctx, si, sample1, sample2, active=True):
        bs, active = mi.BSDFSample3f(), mi.Mask(active)
        matte_on, mirror_on = ctx.is_enabled(F.DiffuseReflection, 0), ctx.is_enabled(F.DeltaReflection, 1)
        if not (matte_on or mirror_on):
            return dr.zeros(mi.BSDFSample3f), mi.Spectrum(0.0)
        chance = self.chance(ctx, si)
        mirror = sample1 < chance
        bs.wo = dr.select(mirror, mi.reflect(si.wi), mi.warp.square_to_cosine_hemisphere(sample2))
        bs.pdf = dr.select(mirror, chance, self.pdf(ctx, si, bs.wo, active))
        bs.pdf = dr.select(active & (side(si.wi) > 0), bs.pdf, 0.0)
        bs.eta = 1.0
        bs.sampled_type = self.types(mirror)
        bs.sampled_component = dr.select(mirror, mi.UInt32(1), mi.UInt32(0))
        ok = bs.pdf > 0
        value = dr.select(mirror, mi.Spectrum(self.fresnel(dr.abs(side(si.wi)))), self.eval(ctx, si, bs.wo, active))
        return bs, dr.select(ok, value / dr.select(ok, bs.pdf, 1.0), 0.0)

    def to_string(self):
        return type(self).__name__ + "[]"


class Pane(mi.BSDF):
    """A smooth pane of glass over a dense medium: reflection (0) and refraction (1)."""

    fault = "Everything is delta: eval and pdf are 0; radiance is scaled by 1 / eta^2 in refraction, importance is not."
    cause = ""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.eta = mi.Float(props.get("eta", 1.5))
        both = F.FrontSide | F.BackSide | F.NonSymmetric
        self.m_components = [F.DeltaReflection | F.FrontSide | F.BackSide, F.DeltaTransmission | both]
        self.m_flags = self.m_components[0] | self.m_components[1]

    def traverse(self, callback):
        callback.put("eta", self.eta, mi.ParamFlags.Differentiable)

    def eval(self, ctx, si, wo, active=True):
        return mi.Spectrum(0.0)

    def pdf(self, ctx, si, wo, active=True):
        return mi.Float(0.0)

    def eval_pdf(self, ctx, si, wo, active=True):
        return mi.Spectrum(0.0), mi.Float(0.0)

    def eval_pdf_sample(self, ctx, si, wo, sample1, sample2, active=True):
        return (mi.Spectrum(0.0), mi.Float(0.0), *self.sample(ctx, si, sample1, sample2, active))

    def sample(self, ctx, si, sample1, sample2, active=True):
        active = mi.Mask(active)
        r, cos_t, eta_it, eta_ti = mi.fresnel(side(si.wi), self.eta)
        t = 1 - r
        reflect_on, refract_on = ctx.is_enabled(F.DeltaReflection, 0), ctx.is_enabled(F.DeltaTransmission, 1)
        if not (reflect_on or refract_on):
            return dr.zeros(mi.BSDFSample3f), mi.Spectrum(0.0)
        chance = r if reflect_on and refract_on else mi.Float(1.0 if reflect_on else 0.0)
        up = sample1 < chance
        bs = mi.BSDFSample3f()
        bs.wo = dr.select(up, mi.reflect(si.wi), mi.refract(si.wi, cos_t, eta_ti))
        bs.pdf = dr.select(active & (up | (t > 0)), dr.select(up, chance, 1 - chance), 0.0)
        bs.eta = dr.select(up, 1.0, eta_it)
        bs.sampled_type = dr.select(up, mi.UInt32(+F.DeltaReflection), mi.UInt32(+F.DeltaTransmission))
        bs.sampled_component = dr.select(up, mi.UInt32(0), mi.UInt32(1))
        value = dr.select(up, r, t)
        if ctx.mode == mi.TransportMode.Radiance:
            value = dr.select(up, value, value * dr.square(eta_ti))
        ok = bs.pdf > 0
        return bs, mi.Spectrum(dr.select(ok, value / dr.select(ok, bs.pdf, 1.0), 0.0))

    def to_string(self):
        return type(self).__name__ + "[]"


class PerforatedLeaf(mi.BSDF):
    """Holes (component 2, Null), and around them diffuse reflection (0) and transmission (1)."""

    fault = "Three components, one of them Null; the probabilities are fixed numbers that do not follow the energy."
    cause = ""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.reflectance = props.get_texture("reflectance", 0.3)
        self.transmittance = props.get_texture("transmittance", 0.4)
        self.holes = props.get_texture("holes", 0.25)
        both = F.FrontSide | F.BackSide
        self.m_components = [F.DiffuseReflection | both, F.DiffuseTransmission | both, F.Null | both]
        self.m_flags = self.m_components[0] | self.m_components[1] | self.m_components[2]

    def traverse(self, callback):
        for name in ("reflectance", "transmittance", "holes"):
            callback.put(name, getattr(self, name), mi.ParamFlags.Differentiable)

    def chances(self, ctx):
        kinds = (F.DiffuseReflection, F.DiffuseTransmission, F.Null)
        chances = [p if ctx.is_enabled(kind, k) else 0.0 for k, (kind, p) in enumerate(zip(kinds, (0.4, 0.4, 0.2)))]
        total = sum(chances)
        return [p / total for p in chances] if total > 0 else None

    def eval(self, ctx, si, wo, active=True):
        chances, active = self.chances(ctx), mi.Mask(active)
        if chances is None:
            return mi.Spectrum(0.0)
        solid = 1 - self.holes.eval_1(si, active)
        r = self.reflectance.eval(si, active) if chances[0] > 0 else mi.Spectrum(0.0)
        t = mi.Spectrum(0.0)
        if chances[1] > 0:  # of what is not reflected
            t = self.transmittance.eval(si, active) * (1 - self.reflectance.eval(si, active))
        sides = side(si.wi) * side(wo)
        value = dr.select(sides > 0, r, t) * (solid * dr.abs(side(wo)) / PI)
        return dr.select(active & (sides != 0), value, 0.0)

    def pdf(self, ctx, si, wo, active=True):
        chances = self.chances(ctx)
        if chances is None:
            return mi.Float(0.0)
        sides = side(si.wi) * side(wo)
        p = dr.select(sides > 0, chances[0], chances[1]) * dr.abs(side(wo)) / PI
        return dr.select(mi.Mask(active) & (sides != 0), p, 0.0)

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def eval_pdf_sample(self, ctx, si, wo, sample1, sample2, active=True):
        return (*self.eval_pdf(ctx, si, wo, active), *self.sample(ctx, si, sample1, sample2, active))

    def eval_null_transmission(self, si, active=True):
        return mi.Spectrum(dr.select(mi.Mask(active), self.holes.eval_1(si, active), 0.0))

    def sample(self, ctx, si, sample1, sample2, active=True):
        chances, active = self.chances(ctx), mi.Mask(active)
        if chances is None:
            return dr.zeros(mi.BSDFSample3f), mi.Spectrum(0.0)
        reflects = sample1 < chances[0]
        passes = ~reflects & (sample1 < chances[0] + chances[1])
        null = ~reflects & ~passes
        local = mi.warp.square_to_cosine_hemisphere(sample2)
        local.z = dr.select(reflects == (side(si.wi) > 0), local.z, -local.z)
        bs = mi.BSDFSample3f()
        bs.wo = dr.select(null, -si.wi, local)
        bs.pdf = dr.select(active, dr.select(null, chances[2], self.pdf(ctx, si, bs.wo, active)), 0.0)
        bs.eta = 1.0
        types = dr.select(reflects, mi.UInt32(+F.DiffuseReflection), mi.UInt32(+F.DiffuseTransmission))
        bs.sampled_type = dr.select(null, mi.UInt32(+F.Null), types)
        bs.sampled_component = dr.select(null, mi.UInt32(2), dr.select(reflects, mi.UInt32(0), mi.UInt32(1)))
        value = dr.select(null, mi.Spectrum(self.holes.eval_1(si, active)), self.eval(ctx, si, bs.wo, active))
        ok = bs.pdf > 0
        return bs, dr.select(ok, value / dr.select(ok, bs.pdf, 1.0), 0.0)

    def to_string(self):
        return "PerforatedLeaf[]"


MUTANTS = []
SOUND = [CheckeredGloss, SoundLacquer, Pane, PerforatedLeaf]
PLUGINS = {"fourth_sound_" + cls.__name__.lower(): cls for cls in SOUND}
for _name, _cls in PLUGINS.items():
    mi.register_bsdf(_name, lambda props, cls=_cls: cls(props))
