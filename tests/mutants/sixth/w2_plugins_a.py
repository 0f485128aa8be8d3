"""Plugins for Mitsuba: eight materials that transmit."""

from typing import ClassVar

import gonio as go  # noqa: F401
import drjit as dr
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")

DR = mi.BSDFFlags.DeltaReflection
DT = mi.BSDFFlags.DeltaTransmission
DIR = mi.BSDFFlags.DiffuseReflection
DIT = mi.BSDFFlags.DiffuseTransmission
GR = mi.BSDFFlags.GlossyReflection
GT = mi.BSDFFlags.GlossyTransmission
BOTH = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
ASYM = mi.BSDFFlags.NonSymmetric


class _W2Smooth(mi.BSDF):
    """A smooth dielectric: component 0 reflects, component 1 refracts."""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.eta = float(props.get("int_ior", 1.5)) / float(props.get("ext_ior", 1.0))
        self.m_components = [DR | BOTH, DT | BOTH | ASYM]
        self.m_flags = self.m_components[0] | self.m_components[1]

    def factor(self, ctx, eta_ti, cos_i):
        """Factor of refracted light: radiance shrinks by the square of the index."""
        if ctx.mode == mi.TransportMode.Radiance:
            return dr.square(eta_ti)
        return mi.Float(1.0)

    def tinted(self, cos_i, cos_t):
        return mi.Color3f(1.0)

    def stated_eta(self, eta_it, reflects):
        return dr.select(reflects, 1.0, eta_it)

    def kinds(self, reflects):
        return dr.select(reflects, mi.UInt32(+DR), mi.UInt32(+DT)), dr.select(reflects, mi.UInt32(0), mi.UInt32(1))

    def discrete(self, chance):
        return chance

    def only(self, r, has_reflection):
        """Weight of the only enabled lobe."""
        return r if has_reflection else 1.0 - r

    def sample(self, ctx, si, sample1, sample2, active=True):
        has_r, has_t = ctx.is_enabled(DR, 0), ctx.is_enabled(DT, 1)
        bs = dr.zeros(mi.BSDFSample3f)
        if not (has_r or has_t):
            return bs, mi.Color3f(0.0)
        cos_i = mi.Frame3f.cos_theta(si.wi)
        active = mi.Bool(active) & (cos_i != 0.0)
        r, cos_t, eta_it, eta_ti = mi.fresnel(cos_i, mi.Float(self.eta))
        if has_r and has_t:
            reflects = sample1 <= r
            chance = dr.select(reflects, r, 1.0 - r)
            weight = mi.Color3f(1.0)
        else:
            reflects = mi.Bool(has_r) & active
            chance = mi.Float(1.0)
            weight = mi.Color3f(self.only(r, has_r))
            active &= reflects | (r < 1.0)
        bs.wo = dr.select(reflects, mi.reflect(si.wi), mi.refract(si.wi, cos_t, eta_ti))
        bs.eta = self.stated_eta(eta_it, reflects)
        bs.pdf = dr.select(active, self.discrete(chance), 0.0)
        bs.sampled_type, bs.sampled_component = self.kinds(reflects)
        through = self.factor(ctx, eta_ti, cos_i) * self.tinted(cos_i, cos_t)
        weight = weight * dr.select(reflects, mi.Color3f(1.0), through)
        return bs, dr.select(active, weight, 0.0)

    def eval(self, ctx, si, wo, active=True):
        return mi.Color3f(0.0)

    def pdf(self, ctx, si, wo, active=True):
        return mi.Float(0.0)

    def eval_pdf(self, ctx, si, wo, active=True):
        return mi.Color3f(0.0), mi.Float(0.0)

    def to_string(self):
        return f"{type(self).__name__}[eta={self.eta}]"


class W2PluginGlassModes(_W2Smooth):
    """Smooth glass for paths from cameras and lights."""

    fault: ClassVar[str] = "the square of the index scales importance, and radiance is not scaled"
    cause: ClassVar[str] = "transport modes exchanged: 1/eta^2 applied for importance instead of radiance"

    def factor(self, ctx, eta_ti, cos_i):
        return mi.Float(1.0) if ctx.mode == mi.TransportMode.Radiance else dr.square(eta_ti)


class W2PluginGlassEta(_W2Smooth):
    """Smooth glass that states the index of its samples."""

    fault: ClassVar[str] = "bs.eta is the relative index for reflected samples too, where it must be 1"
    cause: ClassVar[str] = "eta of reflected samples is not 1"

    def stated_eta(self, eta_it, reflects):
        return eta_it


class W2PluginGlassOnly(_W2Smooth):
    """Smooth glass one of whose components may be asked for."""

    fault: ClassVar[str] = "if only one component is enabled, it is sampled with weight 1 instead of its reflectance"
    cause: ClassVar[str] = "context: a lone lobe is chosen with certainty, its weight lacks F or 1 - F"

    def only(self, r, has_reflection):
        return dr.select(mi.Bool(has_reflection) | (r < 1.0), mi.Float(1.0), 0.0)


class W2PluginGlassPdf(_W2Smooth):
    """Smooth glass whose pdf is that of no density."""

    fault: ClassVar[str] = "delta samples have pdf 0, not the probability with which they were chosen"
    cause: ClassVar[str] = "bs.pdf of delta samples must be the discrete probability: samples count as failed"

    def discrete(self, chance):
        return 0.0 * chance


class W2PluginGlassDye(_W2Smooth):
    """Dyed glass: light loses half of its color where it enters, half where it leaves."""

    fault: ClassVar[str] = "light seen from outside is tinted by the dye, light seen from inside by its square root"
    cause: ClassVar[str] = (
        "transmission is not reciprocal: the two directions through the interface have different tints"
    )

    def tinted(self, cos_i, cos_t):
        dye = mi.Color3f(0.3, 0.6, 0.8)
        return dr.select(cos_i > 0.0, dye, dr.sqrt(dye))


class W2PluginLeafFlags(mi.BSDF):
    """A leaf that reflects and transmits diffusely."""

    fault: ClassVar[str] = "the flags state a diffuse reflection alone, but eval, pdf and sample transmit"
    cause: ClassVar[str] = "flags wrong: no component for the transmission"

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.kr = props.get("reflectance", mi.load_dict({"type": "rgb", "value": [0.3, 0.5, 0.2]}))
        self.kt = props.get("transmittance", mi.load_dict({"type": "rgb", "value": [0.2, 0.4, 0.1]}))
        self.m_components = [DIR | BOTH]
        self.m_flags = self.m_components[0]

    def sample(self, ctx, si, sample1, sample2, active=True):
        bs = dr.zeros(mi.BSDFSample3f)
        w = mi.warp.square_to_cosine_hemisphere(sample2)
        up = mi.Frame3f.cos_theta(si.wi) > 0.0
        reflects = sample1 < 0.5
        bs.wo = mi.Vector3f(w.x, w.y, dr.select(reflects == up, w.z, -w.z))
        bs.eta = 1.0
        bs.sampled_type = mi.UInt32(+DIR)
        bs.sampled_component = mi.UInt32(0)
        bs.pdf = self.pdf(ctx, si, bs.wo, active)
        value = self.eval(ctx, si, bs.wo, active)
        return bs, dr.select(bs.pdf > 0.0, value / bs.pdf, 0.0)

    def eval(self, ctx, si, wo, active=True):
        if not ctx.is_enabled(DIR, 0):
            return mi.Color3f(0.0)
        cos = mi.Frame3f.cos_theta(wo)
        same = cos * mi.Frame3f.cos_theta(si.wi) > 0.0
        color = dr.select(same, self.kr.eval(si, active), self.kt.eval(si, active))
        return dr.select(mi.Bool(active), color * dr.abs(cos) * dr.inv_pi, 0.0)

    def pdf(self, ctx, si, wo, active=True):
        if not ctx.is_enabled(DIR, 0):
            return mi.Float(0.0)
        return dr.select(mi.Bool(active), 0.5 * dr.abs(mi.Frame3f.cos_theta(wo)) * dr.inv_pi, 0.0)

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def traverse(self, cb):
        cb.put("reflectance", self.kr, mi.ParamFlags.Differentiable)
        cb.put("transmittance", self.kt, mi.ParamFlags.Differentiable)

    def to_string(self):
        return "W2PluginLeafFlags[]"


class W2PluginMaskNull(mi.BSDF):
    """A matte surface with holes: component 0 is the base, component 1 lets light pass."""

    fault: ClassVar[str] = "eval_null_transmission is the opacity, while samples pass with probability 1 - opacity"
    cause: ClassVar[str] = "null transmission exchanged with the opacity: shadow rays disagree with sampled paths"

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.opacity = float(props.get("opacity", 0.8))
        self.kd = props.get("reflectance", mi.load_dict({"type": "rgb", "value": [0.5, 0.6, 0.7]}))
        self.m_components = [DIR | mi.BSDFFlags.FrontSide, mi.BSDFFlags.Null | BOTH]
        self.m_flags = self.m_components[0] | self.m_components[1]

    def sample(self, ctx, si, sample1, sample2, active=True):
        bs = dr.zeros(mi.BSDFSample3f)
        has_base, has_hole = ctx.is_enabled(DIR, 0), ctx.is_enabled(mi.BSDFFlags.Null, 1)
        if not (has_base or has_hole):
            return bs, mi.Color3f(0.0)
        active = mi.Bool(active)
        share = (self.opacity if has_hole else 1.0) if has_base else 0.0
        covered = sample1 < share
        bs.wo = dr.select(covered, mi.warp.square_to_cosine_hemisphere(sample2), -si.wi)
        bs.eta = 1.0
        density = mi.warp.square_to_cosine_hemisphere_pdf(bs.wo) * share
        lit = (mi.Frame3f.cos_theta(si.wi) > 0.0) & (mi.Frame3f.cos_theta(bs.wo) > 0.0)
        bs.pdf = dr.select(active & (~covered | lit), dr.select(covered, density, 1.0 - share), 0.0)
        bs.sampled_type = dr.select(covered, mi.UInt32(+DIR), mi.UInt32(+mi.BSDFFlags.Null))
        bs.sampled_component = dr.select(covered, mi.UInt32(0), mi.UInt32(1))
        base = self.kd.eval(si, active) * (self.opacity / max(share, 1e-6))
        hole = mi.Color3f((1.0 - self.opacity) / max(1.0 - share, 1e-6))
        return bs, dr.select(bs.pdf > 0.0, dr.select(covered, base, hole), 0.0)

    def eval(self, ctx, si, wo, active=True):
        if not ctx.is_enabled(DIR, 0):
            return mi.Color3f(0.0)
        cos = mi.Frame3f.cos_theta(wo)
        lit = mi.Bool(active) & (mi.Frame3f.cos_theta(si.wi) > 0.0) & (cos > 0.0)
        return dr.select(lit, self.kd.eval(si, active) * (self.opacity * cos * dr.inv_pi), 0.0)

    def pdf(self, ctx, si, wo, active=True):
        if not ctx.is_enabled(DIR, 0):
            return mi.Float(0.0)
        share = self.opacity if ctx.is_enabled(mi.BSDFFlags.Null, 1) else 1.0
        cos = mi.Frame3f.cos_theta(wo)
        lit = mi.Bool(active) & (mi.Frame3f.cos_theta(si.wi) > 0.0) & (cos > 0.0)
        return dr.select(lit, share * cos * dr.inv_pi, 0.0)

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def eval_null_transmission(self, si, active=True):
        return dr.select(mi.Bool(active), mi.Color3f(self.opacity), 0.0)

    def traverse(self, cb):
        cb.put("reflectance", self.kd, mi.ParamFlags.Differentiable)

    def to_string(self):
        return "W2PluginMaskNull[]"


class W2PluginFrosted(mi.BSDF):
    """Frosted glass with visible normals: component 0 reflects, component 1 refracts."""

    fault: ClassVar[str] = "samples draw visible normals, pdf is the density of all normals"
    cause: ClassVar[str] = "pdf is not the density of sample: D cos against the visible normals' density"

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.eta = float(props.get("int_ior", 1.5)) / float(props.get("ext_ior", 1.0))
        self.alpha = float(props.get("alpha", 0.3))
        self.m_components = [GR | BOTH, GT | BOTH | ASYM]
        self.m_flags = self.m_components[0] | self.m_components[1]

    def normals(self, visible):
        return mi.MicrofacetDistribution(mi.MicrofacetType.GGX, self.alpha, visible)

    def _facet(self, si, wo):
        """The half vector (m.z >= 0), relative index, cosines, and whether the pair reflects."""
        cos_i, cos_o = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
        eta = dr.select(cos_i > 0.0, mi.Float(self.eta), mi.Float(1.0 / self.eta))
        reflects = cos_i * cos_o > 0.0
        m = dr.normalize(si.wi + wo * dr.select(reflects, 1.0, eta))
        m = dr.mulsign(m, mi.Frame3f.cos_theta(m))
        i, o = dr.dot(si.wi, m), dr.dot(wo, m)
        lit = (cos_i != 0.0) & (i * cos_i > 0.0) & (o * cos_o > 0.0)
        return m, eta, i, o, reflects, lit

    def sample(self, ctx, si, sample1, sample2, active=True):
        bs = dr.zeros(mi.BSDFSample3f)
        has_r, has_t = ctx.is_enabled(GR, 0), ctx.is_enabled(GT, 1)
        if not (has_r or has_t):
            return bs, mi.Color3f(0.0)
        cos_i = mi.Frame3f.cos_theta(si.wi)
        m, _ = self.normals(True).sample(dr.mulsign(si.wi, cos_i), sample2)
        r, cos_t, eta_it, eta_ti = mi.fresnel(dr.dot(si.wi, m), mi.Float(self.eta))
        if has_r and has_t:
            reflects = sample1 <= r
        else:
            reflects = dr.full(mi.Float, 1.0 if has_r else 0.0, dr.width(r)) > 0.5
        bs.wo = dr.select(reflects, mi.reflect(si.wi, m), mi.refract(si.wi, m, cos_t, eta_ti))
        bs.eta = dr.select(reflects, 1.0, eta_it)
        bs.sampled_type = dr.select(reflects, mi.UInt32(+GR), mi.UInt32(+GT))
        bs.sampled_component = dr.select(reflects, mi.UInt32(0), mi.UInt32(1))
        side = cos_i * mi.Frame3f.cos_theta(bs.wo)
        right = mi.Bool(active) & dr.select(reflects, side > 0.0, side < 0.0)
        bs.pdf = dr.select(right, self.pdf(ctx, si, bs.wo, active), 0.0)
        value = self.eval(ctx, si, bs.wo, active)
        return bs, dr.select(bs.pdf > 0.0, value / bs.pdf, 0.0)

    def eval(self, ctx, si, wo, active=True):
        m, eta, i, o, reflects, lit = self._facet(si, wo)
        distribution = self.normals(True)
        f = mi.fresnel(i, mi.Float(self.eta))[0]
        dg = distribution.eval(m) * distribution.G(si.wi, wo, m)
        reflected = f * dg / (4.0 * dr.abs(mi.Frame3f.cos_theta(si.wi)))
        spread = dr.abs(i * o / mi.Frame3f.cos_theta(si.wi)) / dr.square(i + eta * o)
        transmitted = (1.0 - f) * dg * spread
        if ctx.mode != mi.TransportMode.Radiance:
            transmitted = transmitted * dr.square(eta)
        if not ctx.is_enabled(GR, 0):
            reflected = 0.0 * reflected
        if not ctx.is_enabled(GT, 1):
            transmitted = 0.0 * transmitted
        return mi.Color3f(dr.select(mi.Bool(active) & lit, dr.select(reflects, reflected, transmitted), 0.0))

    def pdf(self, ctx, si, wo, active=True):
        has_r, has_t = ctx.is_enabled(GR, 0), ctx.is_enabled(GT, 1)
        m, eta, i, o, reflects, lit = self._facet(si, wo)
        toward = dr.mulsign(si.wi, mi.Frame3f.cos_theta(si.wi))
        normals = self.normals(False).pdf(toward, m)
        f = mi.fresnel(i, mi.Float(self.eta))[0]
        jacobian = dr.select(reflects, dr.rcp(4.0 * dr.abs(o)), dr.square(eta) * dr.abs(o) / dr.square(i + eta * o))
        if has_r and has_t:
            chance = dr.select(reflects, f, 1.0 - f)
        else:
            chance = dr.select(reflects, 1.0 if has_r else 0.0, 1.0 if has_t else 0.0)
        return dr.select(mi.Bool(active) & lit, chance * normals * jacobian, 0.0)

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def to_string(self):
        return f"W2PluginFrosted[alpha={self.alpha}, eta={self.eta}]"


PLUGINS = {
    "w2-plugin-glass-modes": W2PluginGlassModes,
    "w2-plugin-glass-eta": W2PluginGlassEta,
    "w2-plugin-glass-only": W2PluginGlassOnly,
    "w2-plugin-glass-pdf": W2PluginGlassPdf,
    "w2-plugin-glass-dye": W2PluginGlassDye,
    "w2-plugin-leaf-flags": W2PluginLeafFlags,
    "w2-plugin-mask-null": W2PluginMaskNull,
    "w2-plugin-frosted": W2PluginFrosted,
}
mi.register_bsdf("w2-plugin-glass-modes", lambda props: W2PluginGlassModes(props))
mi.register_bsdf("w2-plugin-glass-eta", lambda props: W2PluginGlassEta(props))
mi.register_bsdf("w2-plugin-glass-only", lambda props: W2PluginGlassOnly(props))
mi.register_bsdf("w2-plugin-glass-pdf", lambda props: W2PluginGlassPdf(props))
mi.register_bsdf("w2-plugin-glass-dye", lambda props: W2PluginGlassDye(props))
mi.register_bsdf("w2-plugin-leaf-flags", lambda props: W2PluginLeafFlags(props))
mi.register_bsdf("w2-plugin-mask-null", lambda props: W2PluginMaskNull(props))
mi.register_bsdf("w2-plugin-frosted", lambda props: W2PluginFrosted(props))

MUTANTS = list(PLUGINS.values())
SOUND = []
