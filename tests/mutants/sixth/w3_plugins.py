"""Mitsuba plugins in Python, each with a bug that was reported of a renderer or asked about in a forum."""

from typing import ClassVar

import gonio as go  # noqa: F401  (before Mitsuba)
import drjit as dr
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")


class W3PluginUnweighted(mi.BSDF):
    """A matte plugin. Imitates the plugin of Mitsuba 3's issue 1011, whose sample did not divide the value by the density."""

    fault: ClassVar[str] = "the weight of a sample is its value times the cosine, not over the density"
    cause: ClassVar[str] = "sample returns eval instead of eval / pdf"

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.reflectance = mi.Color3f(props.get("red", 0.7), props.get("green", 0.5), props.get("blue", 0.3))
        self.m_components = [mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide]
        self.m_flags = self.m_components[0]

    def sample(self, ctx, si, sample1, sample2, active=True):
        bs = mi.BSDFSample3f()
        bs.wo = mi.warp.square_to_cosine_hemisphere(sample2)
        bs.pdf = mi.warp.square_to_cosine_hemisphere_pdf(bs.wo)
        bs.eta = 1.0
        bs.sampled_type = mi.UInt32(+mi.BSDFFlags.DiffuseReflection)
        bs.sampled_component = mi.UInt32(0)
        active = active & (mi.Frame3f.cos_theta(si.wi) > 0) & (bs.pdf > 0)
        return bs, dr.select(active, self.eval(ctx, si, bs.wo, active), 0)

    def eval(self, ctx, si, wo, active=True):
        cos_i, cos_o = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
        return dr.select((cos_i > 0) & (cos_o > 0) & active, self.reflectance * (dr.inv_pi * cos_o), 0)

    def pdf(self, ctx, si, wo, active=True):
        cos_i, cos_o = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
        return dr.select((cos_i > 0) & (cos_o > 0) & active, dr.inv_pi * cos_o, 0)

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def to_string(self):
        return "W3PluginUnweighted[]"


class W3PluginAllNormals(mi.BSDF):
    """A rough metal plugin that samples all normals, not only visible ones. Imitates ports of Mitsuba's roughconductor with sample_visible = false."""

    fault: ClassVar[str] = "the weight of a sample is not value over density, by the cosine of the normal"
    cause: ClassVar[str] = "the analytic weight G (wi.m) / (cos_i cos_m) lacks cos_m in its denominator"

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.reflectance = mi.Color3f(props.get("red", 0.9), props.get("green", 0.7), props.get("blue", 0.4))
        self.alpha = props.get("alpha", 0.35)
        self.m_components = [mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide]
        self.m_flags = self.m_components[0]

    def facets(self):
        return mi.MicrofacetDistribution(mi.MicrofacetType.GGX, self.alpha, self.alpha, False)

    def sample(self, ctx, si, sample1, sample2, active=True):
        facets = self.facets()
        m, density = facets.sample(si.wi, sample2)
        bs = mi.BSDFSample3f()
        bs.wo = mi.reflect(si.wi, m)
        bs.eta = 1.0
        bs.sampled_type = mi.UInt32(+mi.BSDFFlags.GlossyReflection)
        bs.sampled_component = mi.UInt32(0)
        cos_i, cos_o = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(bs.wo)
        facing = dr.dot(si.wi, m)
        active = active & (cos_i > 0) & (cos_o > 0) & (facing > 0) & (density > 0)
        bs.pdf = dr.select(active, density / (4 * dr.dot(bs.wo, m)), 0)
        weight = facets.G(si.wi, bs.wo, m) * facing / cos_i
        return bs, dr.select(active, self.reflectance * weight, 0)

    def eval(self, ctx, si, wo, active=True):
        cos_i, cos_o = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
        active = active & (cos_i > 0) & (cos_o > 0)
        m = dr.normalize(si.wi + wo)
        facets = self.facets()
        value = facets.eval(m) * facets.G(si.wi, wo, m) / (4 * cos_i)
        return dr.select(active, self.reflectance * value, 0)

    def pdf(self, ctx, si, wo, active=True):
        cos_i, cos_o = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
        active = active & (cos_i > 0) & (cos_o > 0)
        m = dr.normalize(si.wi + wo)
        return dr.select(active, self.facets().pdf(si.wi, m) / (4 * dr.dot(wo, m)), 0)

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def to_string(self):
        return "W3PluginAllNormals[]"


class W3PluginPlastic(mi.BSDF):
    """A plastic plugin, of which only the matte part under the smooth coat is kept. Imitates a 'plastic' whose inner reflectance is that of the outer side."""

    fault: ClassVar[str] = (
        "the weight of a sample is not value over density: a bright base is up to a third darker by its values than by its samples"
    )
    cause: ClassVar[str] = (
        "eval uses Fdr(eta) of light from outside for the bounces inside, sample uses the right Fdr(1 / eta)"
    )

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.kd = mi.Color3f(props.get("red", 0.5), props.get("green", 0.7), props.get("blue", 0.3))
        self.eta = props.get("eta", 1.5)
        self.outside = float(mi.fresnel_diffuse_reflectance(mi.Float(self.eta))[0])
        self.inside = 1.0 - (1.0 - self.outside) / self.eta**2
        self.m_components = [mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide]
        self.m_flags = self.m_components[0]

    def body(self, wi, wo, bounced):
        fresnel_i = mi.fresnel(mi.Frame3f.cos_theta(wi), self.eta)[0]
        fresnel_o = mi.fresnel(mi.Frame3f.cos_theta(wo), self.eta)[0]
        return self.kd / (1 - self.kd * bounced) * ((1 - fresnel_i) * (1 - fresnel_o) / self.eta**2)

    def sample(self, ctx, si, sample1, sample2, active=True):
        bs = mi.BSDFSample3f()
        bs.wo = mi.warp.square_to_cosine_hemisphere(sample2)
        bs.pdf = mi.warp.square_to_cosine_hemisphere_pdf(bs.wo)
        bs.eta = 1.0
        bs.sampled_type = mi.UInt32(+mi.BSDFFlags.DiffuseReflection)
        bs.sampled_component = mi.UInt32(0)
        active = active & (mi.Frame3f.cos_theta(si.wi) > 0) & (bs.pdf > 0)
        return bs, dr.select(active, self.body(si.wi, bs.wo, self.inside), 0)

    def eval(self, ctx, si, wo, active=True):
        cos_i, cos_o = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
        active = active & (cos_i > 0) & (cos_o > 0)
        return dr.select(active, self.body(si.wi, wo, self.outside) * (dr.inv_pi * cos_o), 0)

    def pdf(self, ctx, si, wo, active=True):
        cos_i, cos_o = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
        return dr.select((cos_i > 0) & (cos_o > 0) & active, dr.inv_pi * cos_o, 0)

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def to_string(self):
        return "W3PluginPlastic[]"


class W3PluginBlend(mi.BSDF):
    """A blend of matte paint and rough metal. Imitates blends (blendbsdf, mixbsdf) that use one random number for two choices."""

    fault: ClassVar[str] = (
        "the metal's normals are drawn from a part of the unit square only, the density is that of all of it"
    )
    cause: ClassVar[str] = "sample2.x chooses the lobe and is then used again for the direction without being rescaled"

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.reflectance = mi.Color3f(props.get("red", 0.6), props.get("green", 0.6), props.get("blue", 0.7))
        self.alpha = props.get("alpha", 0.25)
        self.weight = props.get("weight", 0.1)  # of the matte paint
        self.m_components = [mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide]
        self.m_flags = self.m_components[0]

    def facets(self):
        return mi.MicrofacetDistribution(mi.MicrofacetType.GGX, self.alpha, self.alpha, True)

    def sample(self, ctx, si, sample1, sample2, active=True):
        m, _ = self.facets().sample(si.wi, sample2)
        matte = sample2.x < self.weight
        bs = mi.BSDFSample3f()
        bs.wo = dr.select(
            matte, mi.warp.square_to_cosine_hemisphere(mi.Point2f(sample1, sample2.y)), mi.reflect(si.wi, m)
        )
        bs.eta = 1.0
        bs.sampled_type = mi.UInt32(+mi.BSDFFlags.GlossyReflection)
        bs.sampled_component = mi.UInt32(0)
        bs.pdf = self.pdf(ctx, si, bs.wo, active)
        active = active & (bs.pdf > 0)
        return bs, dr.select(active, self.eval(ctx, si, bs.wo, active) / bs.pdf, 0)

    def eval(self, ctx, si, wo, active=True):
        cos_i, cos_o = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
        active = active & (cos_i > 0) & (cos_o > 0)
        m = dr.normalize(si.wi + wo)
        facets = self.facets()
        metal = facets.eval(m) * facets.G(si.wi, wo, m) / (4 * cos_i)
        value = (1 - self.weight) * metal + self.weight * dr.inv_pi * cos_o
        return dr.select(active, self.reflectance * value, 0)

    def pdf(self, ctx, si, wo, active=True):
        cos_i, cos_o = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
        active = active & (cos_i > 0) & (cos_o > 0)
        m = dr.normalize(si.wi + wo)
        metal = self.facets().pdf(si.wi, m) / (4 * dr.dot(wo, m))
        return dr.select(active, (1 - self.weight) * metal + self.weight * dr.inv_pi * cos_o, 0)

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def to_string(self):
        return "W3PluginBlend[]"


PLUGINS = {
    "w3-plugin-unweighted": W3PluginUnweighted,
    "w3-plugin-all-normals": W3PluginAllNormals,
    "w3-plugin-plastic": W3PluginPlastic,
    "w3-plugin-blend": W3PluginBlend,
}
mi.register_bsdf("w3-plugin-unweighted", lambda props: W3PluginUnweighted(props))
mi.register_bsdf("w3-plugin-all-normals", lambda props: W3PluginAllNormals(props))
mi.register_bsdf("w3-plugin-plastic", lambda props: W3PluginPlastic(props))
mi.register_bsdf("w3-plugin-blend", lambda props: W3PluginBlend(props))

MUTANTS = [W3PluginUnweighted, W3PluginAllNormals, W3PluginPlastic, W3PluginBlend]
SOUND = []
