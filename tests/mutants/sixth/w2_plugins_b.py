"""Plugins for Mitsuba: seven materials with textures, components and two sides."""

from typing import ClassVar

import gonio as go  # noqa: F401
import drjit as dr
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")

DR = mi.BSDFFlags.DeltaReflection
DIR = mi.BSDFFlags.DiffuseReflection
DIT = mi.BSDFFlags.DiffuseTransmission
GR = mi.BSDFFlags.GlossyReflection
FRONT = +mi.BSDFFlags.FrontSide
BOTH = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide


def rgb(r, g, b):
    return mi.load_dict({"type": "rgb", "value": [r, g, b]})


def cos(w):
    return mi.Frame3f.cos_theta(w)


def zero():
    return dr.zeros(mi.BSDFSample3f), mi.Color3f(0.0)


class _W2Single(mi.BSDF):
    """A diffuse reflection by a texture, from above."""

    sides = FRONT

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.kd = props.get("reflectance", self.default())
        self.m_components = [DIR | self.sides]
        self.m_flags = self.m_components[0]

    def default(self):
        return rgb(0.4, 0.6, 0.2)

    def lit(self, si, wo):
        return (cos(si.wi) > 0.0) & (cos(wo) > 0.0)

    def drawn(self, si, sample2):
        return mi.warp.square_to_cosine_hemisphere(sample2)

    def weight(self, ctx, si, wo, active):
        return self.kd.eval(si, active)

    def sample(self, ctx, si, sample1, sample2, active=True):
        if not ctx.is_enabled(DIR, 0):
            return zero()
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo = self.drawn(si, sample2)
        bs.eta = 1.0
        bs.sampled_type = mi.UInt32(+DIR)
        bs.sampled_component = mi.UInt32(0)
        bs.pdf = self.pdf(ctx, si, bs.wo, active)
        return bs, dr.select(bs.pdf > 0.0, self.weight(ctx, si, bs.wo, active), 0.0)

    def eval(self, ctx, si, wo, active=True):
        if not ctx.is_enabled(DIR, 0):
            return mi.Color3f(0.0)
        active = mi.Bool(active) & self.lit(si, wo)
        return dr.select(active, self.kd.eval(si, active) * (dr.abs(cos(wo)) * dr.inv_pi), 0.0)

    def pdf(self, ctx, si, wo, active=True):
        if not ctx.is_enabled(DIR, 0):
            return mi.Float(0.0)
        return dr.select(mi.Bool(active) & self.lit(si, wo), dr.abs(cos(wo)) * dr.inv_pi, 0.0)

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def traverse(self, cb):
        cb.put("reflectance", self.kd, mi.ParamFlags.Differentiable)

    def to_string(self):
        return f"{type(self).__name__}[]"


class W2PluginTextureMean(_W2Single):
    """Matte paint with a texture, by default checkers."""

    fault: ClassVar[str] = "samples are weighted by the mean of the texture, eval reads it at the point"
    cause: ClassVar[str] = "weight is not eval / pdf: texture not evaluated at the surface point in sample"

    def default(self):
        return mi.load_dict({"type": "checkerboard", "color0": 0.2, "color1": 0.8})

    def weight(self, ctx, si, wo, active):
        return mi.Color3f(self.kd.mean())


class W2PluginLeak(_W2Single):
    """Matte paint on one side of an opaque wall."""

    fault: ClassVar[str] = "light below the wall is reflected to viewers above it: only the viewer's side is tested"
    cause: ClassVar[str] = (
        "abs of the cosine: eval is not 0 below the horizon of an opaque surface, and sample never goes there"
    )

    def eval(self, ctx, si, wo, active=True):
        if not ctx.is_enabled(DIR, 0):
            return mi.Color3f(0.0)
        active = mi.Bool(active) & (cos(si.wi) > 0.0)
        return dr.select(active, self.kd.eval(si, active) * (dr.abs(cos(wo)) * dr.inv_pi), 0.0)


class W2PluginBackPair(_W2Single):
    """Matte paint on both sides of a wall."""

    sides = BOTH

    fault: ClassVar[str] = "eval_pdf returns 0 on the back side, where eval and pdf return the same as on the front"
    cause: ClassVar[str] = "eval_pdf disagrees with eval and pdf: the back side was forgotten"

    def lit(self, si, wo):
        return cos(si.wi) * cos(wo) > 0.0

    def drawn(self, si, sample2):
        w = mi.warp.square_to_cosine_hemisphere(sample2)
        return mi.Vector3f(w.x, w.y, dr.mulsign(w.z, cos(si.wi)))

    def eval_pdf(self, ctx, si, wo, active=True):
        front = mi.Bool(active) & (cos(si.wi) > 0.0)
        return self.eval(ctx, si, wo, front), self.pdf(ctx, si, wo, front)


class _W2Gloss(mi.BSDF):
    """Component 0: a Phong-like lobe about the mirrored direction; component 1: diffuse. Both from above."""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.kd = props.get("diffuse", rgb(0.4, 0.3, 0.2))
        self.ks = float(props.get("specular", 0.3))
        self.p = float(props.get("exponent", 20.0))
        self.m_components = [GR | FRONT, DIR | FRONT]
        self.m_flags = self.m_components[0] | self.m_components[1]

    def enabled(self, ctx):
        return ctx.is_enabled(GR, 0), ctx.is_enabled(DIR, 1)

    def lit(self, si, wo, active):
        return mi.Bool(active) & (cos(si.wi) > 0.0) & (cos(wo) > 0.0)

    def peak(self, si, wo):
        return dr.power(dr.maximum(dr.dot(mi.reflect(si.wi), wo), 1e-12), self.p)

    def values(self, si, wo, active):
        """Both lobes: modified Phong and Lambert, times the cosine."""
        gloss = mi.Color3f(self.ks * (self.p + 2.0) * 0.5 * dr.inv_pi * self.peak(si, wo) * cos(wo))
        return gloss, self.kd.eval(si, active) * (cos(wo) * dr.inv_pi)

    def densities(self, si, wo):
        return (self.p + 1.0) * 0.5 * dr.inv_pi * self.peak(si, wo), cos(wo) * dr.inv_pi

    def share(self, gloss, matte):
        return (0.5 if matte else 1.0) if gloss else 0.0

    def component(self, first):
        return dr.select(first, mi.UInt32(0), mi.UInt32(1))

    def sample(self, ctx, si, sample1, sample2, active=True):
        gloss, matte = self.enabled(ctx)
        if not (gloss or matte):
            return zero()
        bs = dr.zeros(mi.BSDFSample3f)
        first = sample1 < self.share(gloss, matte)
        height = dr.power(1.0 - sample2.x, 1.0 / (self.p + 1.0))
        s, c = dr.sincos(dr.two_pi * sample2.y)
        radius = dr.safe_sqrt(1.0 - height * height)
        lobe = mi.Frame3f(mi.reflect(si.wi)).to_world(mi.Vector3f(radius * c, radius * s, height))
        bs.wo = dr.select(first, lobe, mi.warp.square_to_cosine_hemisphere(sample2))
        bs.eta = 1.0
        bs.sampled_type = dr.select(first, mi.UInt32(+GR), mi.UInt32(+DIR))
        bs.sampled_component = self.component(first)
        bs.pdf = self.density(ctx, si, bs.wo, active)
        value = self.value(ctx, si, bs.wo, active)
        return bs, dr.select(bs.pdf > 0.0, value / bs.pdf, 0.0)

    def value(self, ctx, si, wo, active):
        gloss, matte = self.enabled(ctx)
        a, b = self.values(si, wo, active)
        total = (a if gloss else 0.0 * a) + (b if matte else 0.0 * b)
        return dr.select(self.lit(si, wo, active), total, 0.0)

    def density(self, ctx, si, wo, active):
        gloss, matte = self.enabled(ctx)
        if not (gloss or matte):
            return mi.Float(0.0)
        a, b = self.densities(si, wo)
        share = self.share(gloss, matte)
        return dr.select(self.lit(si, wo, active), share * a + (1.0 - share) * b, 0.0)

    def eval(self, ctx, si, wo, active=True):
        return self.value(ctx, si, wo, active)

    def pdf(self, ctx, si, wo, active=True):
        return self.density(ctx, si, wo, active)

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def traverse(self, cb):
        cb.put("diffuse", self.kd, mi.ParamFlags.Differentiable)

    def to_string(self):
        return f"{type(self).__name__}[]"


class W2PluginGlossPair(_W2Gloss):
    """Glossy paint whose value and density are computed in one call."""

    fault: ClassVar[str] = "the density of eval_pdf is the sum of both lobes' densities, without their probabilities"
    cause: ClassVar[str] = "eval_pdf disagrees with pdf: lobe probability forgotten"

    def eval_pdf(self, ctx, si, wo, active=True):
        a, b = self.densities(si, wo)
        gloss, matte = self.enabled(ctx)
        density = (a if gloss else 0.0) + (b if matte else 0.0)
        return self.eval(ctx, si, wo, active), dr.select(self.lit(si, wo, active), mi.Float(density), 0.0)


class W2PluginGlossContext(_W2Gloss):
    """Glossy paint whose components can be sampled one by one."""

    fault: ClassVar[str] = "eval and pdf return the sum of both components, whichever the context asks for"
    cause: ClassVar[str] = "context's component is ignored by eval and pdf, but not by sample"

    def eval(self, ctx, si, wo, active=True):
        return self.value(mi.BSDFContext(), si, wo, active)

    def pdf(self, ctx, si, wo, active=True):
        return self.density(mi.BSDFContext(), si, wo, active)


class W2PluginGlossIndex(_W2Gloss):
    """Glossy paint that states which component a sample comes from."""

    fault: ClassVar[str] = (
        "sampled_component is 1 for the gloss and 0 for the base, opposite to the order of the components"
    )
    cause: ClassVar[str] = "sampled_component exchanged: it contradicts sampled_type and the context"

    def component(self, first):
        return dr.select(first, mi.UInt32(1), mi.UInt32(0))


class W2PluginVarnish(mi.BSDF):
    """Paint below a smooth varnish: component 0 is its mirror, component 1 the paint."""

    fault: ClassVar[str] = "samples of the mirror state the type GlossyReflection, though eval and pdf are 0 for them"
    cause: ClassVar[str] = "sampled_type without the delta flag: a probability is taken for a density"

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.kd = props.get("reflectance", rgb(0.6, 0.4, 0.3))
        self.m_components = [DR | FRONT, DIR | FRONT]
        self.m_flags = self.m_components[0] | self.m_components[1]

    def fresnel(self, c):
        c = dr.maximum(1.0 - dr.abs(c), 0.0)
        return 0.05 + 0.95 * dr.square(dr.square(c)) * c

    def share(self, ctx, si):
        """Probability of the mirror."""
        coat, paint = ctx.is_enabled(DR, 0), ctx.is_enabled(DIR, 1)
        if coat and paint:
            return dr.clip(self.fresnel(cos(si.wi)), 0.2, 0.8)
        return mi.Float(1.0 if coat else 0.0)

    def sample(self, ctx, si, sample1, sample2, active=True):
        if not (ctx.is_enabled(DR, 0) or ctx.is_enabled(DIR, 1)):
            return zero()
        bs = dr.zeros(mi.BSDFSample3f)
        active = mi.Bool(active) & (cos(si.wi) > 0.0)
        share = self.share(ctx, si)
        coat = sample1 < share
        bs.wo = dr.select(coat, mi.reflect(si.wi), mi.warp.square_to_cosine_hemisphere(sample2))
        bs.eta = 1.0
        bs.sampled_type = dr.select(coat, mi.UInt32(+GR), mi.UInt32(+DIR))
        bs.sampled_component = dr.select(coat, mi.UInt32(0), mi.UInt32(1))
        bs.pdf = dr.select(active, dr.select(coat, share, self.pdf(ctx, si, bs.wo, active)), 0.0)
        value = dr.select(coat, mi.Color3f(self.fresnel(cos(si.wi))), self.eval(ctx, si, bs.wo, active))
        return bs, dr.select(bs.pdf > 0.0, value / bs.pdf, 0.0)

    def eval(self, ctx, si, wo, active=True):
        if not ctx.is_enabled(DIR, 1):
            return mi.Color3f(0.0)
        lit = mi.Bool(active) & (cos(si.wi) > 0.0) & (cos(wo) > 0.0)
        left = (1.0 - self.fresnel(cos(si.wi))) * (1.0 - self.fresnel(cos(wo)))
        scale = left / (dr.pi * 0.95 * 20.0 / 21.0)
        return dr.select(lit, self.kd.eval(si, lit) * (scale * cos(wo)), 0.0)

    def pdf(self, ctx, si, wo, active=True):
        if not ctx.is_enabled(DIR, 1):
            return mi.Float(0.0)
        lit = mi.Bool(active) & (cos(si.wi) > 0.0) & (cos(wo) > 0.0)
        return dr.select(lit, (1.0 - self.share(ctx, si)) * cos(wo) * dr.inv_pi, 0.0)

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def traverse(self, cb):
        cb.put("reflectance", self.kd, mi.ParamFlags.Differentiable)

    def to_string(self):
        return "W2PluginVarnish[]"


PLUGINS = {
    "w2-plugin-texture-mean": W2PluginTextureMean,
    "w2-plugin-leak": W2PluginLeak,
    "w2-plugin-back-pair": W2PluginBackPair,
    "w2-plugin-gloss-pair": W2PluginGlossPair,
    "w2-plugin-gloss-context": W2PluginGlossContext,
    "w2-plugin-gloss-index": W2PluginGlossIndex,
    "w2-plugin-varnish": W2PluginVarnish,
}
mi.register_bsdf("w2-plugin-texture-mean", lambda props: W2PluginTextureMean(props))
mi.register_bsdf("w2-plugin-leak", lambda props: W2PluginLeak(props))
mi.register_bsdf("w2-plugin-back-pair", lambda props: W2PluginBackPair(props))
mi.register_bsdf("w2-plugin-gloss-pair", lambda props: W2PluginGlossPair(props))
mi.register_bsdf("w2-plugin-gloss-context", lambda props: W2PluginGlossContext(props))
mi.register_bsdf("w2-plugin-gloss-index", lambda props: W2PluginGlossIndex(props))
mi.register_bsdf("w2-plugin-varnish", lambda props: W2PluginVarnish(props))

MUTANTS = list(PLUGINS.values())
SOUND = []
