"""Mitsuba plugins in Python, each with one mistake. si.wi is the viewer, wo the light."""

import gonio as go  # noqa: F401  first: it makes LLVM found
import mitsuba as mi

if mi.variant() is None:
    mi.set_variant("llvm_ad_rgb")

import drjit as dr

F = mi.BSDFFlags
PI = dr.pi


def side(w):
    return mi.Frame3f.cos_theta(w)


class _Gloss(mi.BSDF):
    """Two lobes: component 0 a matte base, component 1 a modified Phong lobe; reflectance may be a texture."""

    fault = ""
    cause = ""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.reflectance = props.get_texture("reflectance", 0.5)
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
            value += d / PI
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


class EtaLeftAtZero(_Gloss):
    fault = "sample leaves bs.eta at 0; path tracers multiply it up and roulette ends every path."
    cause = "bs.eta not set (0) for reflection"

    def describe(self, bs, gloss):
        super().describe(bs, gloss)
        bs.eta = 0.0


class CosineOfWi(_Gloss):
    fault = "The value is multiplied by the cosine of si.wi, the viewer, instead of wo's: the names of Mitsuba were swapped."
    cause = "cosine of si.wi instead of wo in eval"

    def cosine(self, si, wo):
        return side(si.wi)


class JointWithoutGloss(_Gloss):
    fault = "eval_pdf, which path tracers call for emitters, has the density of the matte lobe only; pdf is right."
    cause = "eval_pdf's density differs from pdf (lobe omitted)"

    def eval_pdf(self, ctx, si, wo, active=True):
        active = mi.Mask(active)
        lit = active & (side(si.wi) > 0) & (side(wo) > 0)
        return self.value(ctx, si, wo, active), dr.select(lit, mi.warp.square_to_cosine_hemisphere_pdf(wo), 0.0)


class JointBelowHorizon(_Gloss):
    fault = "eval_pdf takes the absolute cosine of wo and does not ask for its side: light from behind shines through; eval is right."
    cause = "eval_pdf's value leaks below the horizon; eval does not"

    def eval_pdf(self, ctx, si, wo, active=True):
        active = mi.Mask(active)
        raised = mi.Vector3f(wo.x, wo.y, dr.abs(wo.z))
        return self.value(ctx, si, raised, active), self.pdf(ctx, si, wo, active)


class InactiveLanesLit(_Gloss):
    fault = "eval and pdf do not look at `active`: masked lanes get light."
    cause = "active mask ignored"

    def eval(self, ctx, si, wo, active=True):
        return self.value(ctx, si, wo, mi.Mask(True))

    def pdf(self, ctx, si, wo, active=True):
        return self.density(ctx, si, wo, mi.Mask(True))


class MeanOfTexture(_Gloss):
    fault = "The weight of a sample has the mean colour of the texture, eval the colour at the point; on a plain colour nothing shows."
    cause = "sample uses the texture's mean instead of its value at si.uv"

    def __init__(self, props):
        super().__init__(props)
        if not props.has_property("reflectance"):
            self.reflectance = mi.load_dict({"type": "checkerboard", "color0": 0.2, "color1": 0.7})

    def sample(self, ctx, si, sample1, sample2, active=True):
        bs, weight = super().sample(ctx, si, sample1, sample2, active)
        here, there = self.reflectance.eval(si, mi.Mask(active)), self.reflectance.mean()
        value = self.value(ctx, si, bs.wo, mi.Mask(active))
        matte = dr.maximum(side(bs.wo), 0) / PI if self.enabled(ctx)[0] else mi.Float(0)
        ok = mi.Mask(active) & (bs.pdf > 0)
        return bs, dr.select(ok, (value + (there - here) * matte) / dr.select(ok, bs.pdf, 1.0), 0.0)


class ComponentForgotten(_Gloss):
    fault = "pdf and sample heed ctx.component, eval returns both lobes whatever is asked for."
    cause = "ctx.component ignored in eval"

    def eval(self, ctx, si, wo, active=True):
        return self.value(mi.BSDFContext(ctx.mode), si, wo, mi.Mask(active))


class FlagsOfMirror(_Gloss):
    fault = "The glossy lobe is flagged DeltaReflection, component and all: the material alone is taken for a mirror, no emitter is sampled."
    cause = "flags declare a delta lobe where the lobe is smooth"

    def set_flags(self):
        self.m_components = [F.DeltaReflection | F.FrontSide, F.DeltaReflection | F.FrontSide]
        self.m_flags = F.DeltaReflection | F.FrontSide

    def enabled(self, ctx):
        return ctx.is_enabled(F.DeltaReflection, 0), ctx.is_enabled(F.DeltaReflection, 1)


class RegularizedForGood(_Gloss):
    fault = "sample widens the lobe against fireflies by a member that nobody sets back: every later eval and pdf has the wide lobe."
    cause = "state kept between calls: sample changes what eval returns"
    blur = 1.0

    @property
    def exponent(self):
        return self.sharp * self.blur

    @exponent.setter
    def exponent(self, value):
        self.sharp = value

    def traverse(self, callback):
        callback.put("reflectance", self.reflectance, mi.ParamFlags.Differentiable)
        callback.put("specular", self.specular, mi.ParamFlags.Differentiable)
        callback.put("exponent", self.sharp, mi.ParamFlags.Differentiable)

    def sample(self, ctx, si, sample1, sample2, active=True):
        drawn = super().sample(ctx, si, sample1, sample2, active)
        self.blur = 0.25
        return drawn


class SampleOneTwice(_Gloss):
    fault = "sample1 picks the lobe and, unscaled, also turns the matte direction: only a sector of azimuths is ever drawn for it."
    cause = "sample1 reused without rescaling: directions do not follow pdf"

    def draw(self, ctx, si, sample1, sample2, active):
        wo, gloss = super().draw(ctx, si, sample1, sample2, active)
        matte = mi.warp.square_to_cosine_hemisphere(sample2)
        r = dr.safe_sqrt(dr.square(matte.x) + dr.square(matte.y))
        s, c = dr.sincos(2 * PI * sample1)
        return dr.select(gloss, wo, mi.Vector3f(r * c, r * s, matte.z)), gloss


class _Lacquer(mi.BSDF):
    """A smooth lacquer (component 1, delta) over a matte base (component 0)."""

    fault = ""
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


class MirrorCalledDiffuse(_Lacquer):
    fault = "Samples of the mirror say DiffuseReflection in sampled_type: renderers take their pdf for a density and weigh them by MIS."
    cause = "sampled_type of delta samples is not delta"

    def types(self, mirror):
        return dr.select(mirror, mi.UInt32(+F.DiffuseReflection), mi.UInt32(+F.DiffuseReflection))


class ScaledForImportance(mi.BSDF):
    """A smooth pane of glass over a dense medium: reflection (0) and refraction (1)."""

    fault = "The factor 1 / eta^2 is applied for importance and left out for radiance: the test of ctx.mode is the wrong way round."
    cause = "transport mode test inverted: radiance unscaled in refraction"

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
        if ctx.mode == mi.TransportMode.Importance:
            value = dr.select(up, value, value * dr.square(eta_ti))
        ok = bs.pdf > 0
        return bs, mi.Spectrum(dr.select(ok, value / dr.select(ok, bs.pdf, 1.0), 0.0))

    def to_string(self):
        return type(self).__name__ + "[]"


MUTANTS = [
    EtaLeftAtZero, CosineOfWi, JointWithoutGloss, JointBelowHorizon, InactiveLanesLit, MeanOfTexture,
    ComponentForgotten, FlagsOfMirror, RegularizedForGood, SampleOneTwice, MirrorCalledDiffuse, ScaledForImportance,
]  # fmt: skip
SOUND = []
PLUGINS = {"fourth_" + cls.__name__.lower(): cls for cls in MUTANTS}
for _name, _cls in PLUGINS.items():
    mi.register_bsdf(_name, lambda props, cls=_cls: cls(props))
