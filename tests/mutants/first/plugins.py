"""Mitsuba plugins in Python: wrong ones, and three that are right. Mitsuba's wi is the viewer, its wo the light."""

import gonio.mitsuba  # noqa: F401  chooses llvm_ad_rgb
import drjit as dr
import mitsuba as mi

F = mi.BSDFFlags


class _Diffuse(mi.BSDF):
    """A matte surface seen from the front."""

    kind = "plugin"
    cause = ""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.kd = mi.Color3f(0.7, 0.5, 0.3)
        self.declare([F.DiffuseReflection | F.FrontSide])

    def declare(self, components):
        self.m_components = components
        flags = components[0]
        for component in components[1:]:
            flags = flags | component
        self.m_flags = flags

    def above(self, si, wo, active):
        return (mi.Frame3f.cos_theta(si.wi) > 0) & (mi.Frame3f.cos_theta(wo) > 0) & active

    def wanted(self, ctx, active):
        return active & ctx.is_enabled(F.DiffuseReflection, 0)

    def value(self, wi, wo):
        return self.kd * (dr.inv_pi * mi.Frame3f.cos_theta(wo))

    def density(self, wi, wo):
        return dr.inv_pi * mi.Frame3f.cos_theta(wo)

    def eval(self, ctx, si, wo, active=True):
        return dr.select(self.above(si, wo, self.wanted(ctx, active)), self.value(si.wi, wo), mi.Color3f(0))

    def pdf(self, ctx, si, wo, active=True):
        return dr.select(self.above(si, wo, self.wanted(ctx, active)), self.density(si.wi, wo), mi.Float(0))

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def choose(self, wi, sample1, sample2):
        return mi.warp.square_to_cosine_hemisphere(sample2)

    def sample(self, ctx, si, sample1, sample2, active=True):
        bs = dr.zeros(mi.BSDFSample3f, dr.width(si.wi))
        bs.wo = self.choose(si.wi, sample1, sample2)
        bs.eta = 1.0
        bs.sampled_type = mi.UInt32(+F.DiffuseReflection)
        bs.sampled_component = mi.UInt32(0)
        bs.pdf = self.pdf(ctx, si, bs.wo, active)
        value = self.eval(ctx, si, bs.wo, active)
        return bs, dr.select(bs.pdf > 0, value / dr.maximum(bs.pdf, 1e-20), mi.Color3f(0))

    def eval_diffuse_reflectance(self, si, active=True):
        return dr.select(active, self.kd, mi.Color3f(0))

    def traverse(self, cb):
        pass

    def to_string(self):
        return type(self).__name__ + "[]"


class EvalPdfBare(_Diffuse):
    """A matte surface."""

    fault = "eval_pdf, which renderers call instead of eval and pdf, forgets the cosine; eval and pdf are right"
    cause = "missing cosine in eval_pdf alone"

    def eval_pdf(self, ctx, si, wo, active=True):
        value = dr.select(self.above(si, wo, self.wanted(ctx, active)), self.kd * dr.inv_pi, mi.Color3f(0))
        return value, self.pdf(ctx, si, wo, active)


class DeadLanes(_Diffuse):
    """A matte surface."""

    fault = "`active` is ignored: lanes that are switched off get values, densities and samples"

    def above(self, si, wo, active):
        return (mi.Frame3f.cos_theta(si.wi) > 0) & (mi.Frame3f.cos_theta(wo) > 0)

    def eval_diffuse_reflectance(self, si, active=True):
        return self.kd


class FlagsDelta(_Diffuse):
    """A matte surface."""

    fault = "it declares a delta lobe, so no light source is ever sampled for it, but has a finite one"

    def __init__(self, props):
        super().__init__(props)
        self.declare([F.DeltaReflection | F.FrontSide])

    def wanted(self, ctx, active):
        return active


class FlagsTransmission(_Diffuse):
    """A matte surface."""

    fault = "it declares transmission from both sides and reflects from the front only; its samples say reflection"

    def __init__(self, props):
        super().__init__(props)
        self.declare([F.DiffuseTransmission | F.FrontSide | F.BackSide])

    def wanted(self, ctx, active):
        return active


class ReflectanceOverPi(_Diffuse):
    """A matte surface."""

    fault = "eval_diffuse_reflectance divides by pi: denoisers and guides get a third of the albedo"
    cause = "1/pi too much in eval_diffuse_reflectance"

    def eval_diffuse_reflectance(self, si, active=True):
        return dr.select(active, self.kd * dr.inv_pi, mi.Color3f(0))


class LocalTwice(_Diffuse):
    """A matte surface."""

    fault = "wo, which is local already, is turned into the shading frame once more: wrong on all but level surfaces"

    def eval(self, ctx, si, wo, active=True):
        return super().eval(ctx, si, si.to_local(wo), active)

    def pdf(self, ctx, si, wo, active=True):
        return super().pdf(ctx, si, si.to_local(wo), active)


class ViewersCosine(_Diffuse):
    """A matte surface."""

    fault = "the cosine is that of si.wi, the viewer, where it is the light's: not reciprocal"
    cause = "wi and wo swapped: cosine of the viewer"

    def value(self, wi, wo):
        return self.kd * (dr.inv_pi * mi.Frame3f.cos_theta(wi))


class Leaks(_Diffuse):
    """A matte surface of both sides."""

    fault = "absolute cosines on both sides: light comes through to the back, without a flag that says so"

    def __init__(self, props):
        super().__init__(props)
        self.declare([F.DiffuseReflection | F.FrontSide | F.BackSide])

    def above(self, si, wo, active):
        return active & (dr.abs(wo.z) > 0)

    def value(self, wi, wo):
        return self.kd * (dr.inv_pi * dr.abs(wo.z))

    def density(self, wi, wo):
        return dr.inv_pi * dr.abs(wo.z)

    def choose(self, wi, sample1, sample2):
        w = mi.warp.square_to_cosine_hemisphere(sample2)
        return mi.Vector3f(w.x, w.y, dr.mulsign(w.z, wi.z))


class EtaNotSet(_Diffuse):
    """A matte surface."""

    fault = "bs.eta stays 0: Russian roulette multiplies the throughput by eta^2 and kills every path"
    cause = "eta of the sample is 0 instead of 1"

    def sample(self, ctx, si, sample1, sample2, active=True):
        bs, weight = super().sample(ctx, si, sample1, sample2, active)
        bs.eta = 0.0
        return bs, weight


class ValueForWeight(_Diffuse):
    """A matte surface."""

    fault = "sample returns the value, not value / pdf"
    cause = "weight not divided by pdf"

    def sample(self, ctx, si, sample1, sample2, active=True):
        bs, weight = super().sample(ctx, si, sample1, sample2, active)
        return bs, weight * bs.pdf


class _TwoLobes(_Diffuse):
    """A matte part and a normalized Phong lobe, components 0 and 1."""

    def __init__(self, props):
        super().__init__(props)
        self.kd, self.ks, self.n = mi.Color3f(0.3, 0.2, 0.1), mi.Color3f(0.5), 20.0
        self.declare([F.DiffuseReflection | F.FrontSide, F.GlossyReflection | F.FrontSide])

    def enabled(self, ctx):
        return bool(ctx.is_enabled(F.DiffuseReflection, 0)), bool(ctx.is_enabled(F.GlossyReflection, 1))

    def share(self, ctx):
        """Probability of the lobe among those that are asked for."""
        matte, gloss = self.enabled(ctx)
        return 0.6 if matte and gloss else 1.0 if gloss else 0.0

    def peak(self, wi, wo):
        c = dr.maximum(dr.dot(mi.Vector3f(-wi.x, -wi.y, wi.z), wo), 0.0)
        return dr.power(c, self.n) * (0.5 * dr.inv_pi)

    def parts(self, ctx):
        return self.enabled(ctx)

    def eval(self, ctx, si, wo, active=True):
        matte, gloss = self.parts(ctx)
        f = mi.Color3f(0)
        if matte:
            f = f + self.kd * dr.inv_pi
        if gloss:
            f = f + self.ks * ((self.n + 2.0) * self.peak(si.wi, wo))
        return dr.select(self.above(si, wo, active), f * wo.z, mi.Color3f(0))

    def pdf(self, ctx, si, wo, active=True):
        share = self.share(ctx)
        p = share * (self.n + 1.0) * self.peak(si.wi, wo) + (1.0 - share) * dr.inv_pi * wo.z
        return dr.select(self.above(si, wo, active) & any(self.enabled(ctx)), p, mi.Float(0))

    def stretched(self, ctx, sample1, sample2):
        return sample2

    def sample(self, ctx, si, sample1, sample2, active=True):
        share = self.share(ctx)
        gloss = mi.Float(sample1) < share
        sample2 = self.stretched(ctx, sample1, sample2)
        c = dr.power(1.0 - sample2.x, 1.0 / (self.n + 1.0))
        s, phi = dr.safe_sqrt(1.0 - c * c), 2.0 * dr.pi * sample2.y
        lobe = mi.Frame3f(mi.Vector3f(-si.wi.x, -si.wi.y, si.wi.z))
        shiny = lobe.to_world(mi.Vector3f(s * dr.cos(phi), s * dr.sin(phi), c))
        bs = dr.zeros(mi.BSDFSample3f, dr.width(si.wi))
        bs.wo = dr.select(gloss, shiny, mi.warp.square_to_cosine_hemisphere(sample2))
        bs.eta = 1.0
        bs.sampled_type = dr.select(gloss, mi.UInt32(+F.GlossyReflection), mi.UInt32(+F.DiffuseReflection))
        bs.sampled_component = dr.select(gloss, mi.UInt32(1), mi.UInt32(0))
        bs.pdf = self.pdf(ctx, si, bs.wo, active)
        value = self.eval(ctx, si, bs.wo, active)
        return bs, dr.select(bs.pdf > 0, value / dr.maximum(bs.pdf, 1e-20), mi.Color3f(0))


class MaskIgnored(_TwoLobes):
    """A matte and a glossy lobe."""

    fault = "eval returns both lobes although the context asks for one of them; pdf and sample know"

    def parts(self, ctx):
        return True, True


class ComponentZero(_TwoLobes):
    """A matte and a glossy lobe."""

    fault = "every sample says that it comes from component 0, the diffuse one, also those of the glossy lobe"

    def sample(self, ctx, si, sample1, sample2, active=True):
        bs, weight = super().sample(ctx, si, sample1, sample2, active)
        bs.sampled_type = mi.UInt32(+F.DiffuseReflection)
        bs.sampled_component = mi.UInt32(0)
        return bs, weight


class SecondSampleOnly(_TwoLobes):
    """A matte and a glossy lobe, chosen by the first component of the second sample."""

    fault = "the lobe is chosen by sample2.x, which then serves the direction without being stretched again"

    def sample(self, ctx, si, sample1, sample2, active=True):
        return super().sample(ctx, si, sample2.x, sample2, active)


class TwoLobesOnePdf(_TwoLobes):
    """A matte and a glossy lobe."""

    fault = "the sample's pdf is that of the chosen lobe, pdf() is of both; eval_pdf leaves out the glossy density"

    def sample(self, ctx, si, sample1, sample2, active=True):
        bs, weight = super().sample(ctx, si, sample1, sample2, active)
        share = self.share(ctx)
        gloss = bs.sampled_component == 1
        chosen = dr.select(gloss, share * 21.0 * self.peak(si.wi, bs.wo), (1.0 - share) * dr.inv_pi * bs.wo.z)
        weight = dr.select(chosen > 0, weight * bs.pdf / dr.maximum(chosen, 1e-20), mi.Color3f(0))
        bs.pdf = dr.select(bs.pdf > 0, chosen, 0.0)
        return bs, weight

    def eval_pdf(self, ctx, si, wo, active=True):
        share = self.share(ctx)
        p = dr.select(self.above(si, wo, active), (1.0 - share) * dr.inv_pi * wo.z, mi.Float(0))
        return self.eval(ctx, si, wo, active), p


class _Grooved(_Diffuse):
    """A matte surface, darker where light and viewer are inclined along x."""

    def value(self, wi, wo):
        return self.kd * (dr.inv_pi * wo.z * (1.0 - 0.6 * dr.square(wi.x)) * (1.0 - 0.6 * dr.square(wo.x)))


class GroovedIsotropicLie(_Grooved):
    """A grooved matte surface."""

    fault = "it depends on the azimuth and does not set BSDFFlags.Anisotropic"


class GlassModeIgnored(_Diffuse):
    """Smooth glass of index 1.5."""

    fault = "ctx.mode is ignored: radiance that is transmitted is not scaled by (eta_o / eta_i)^2"
    cause = "mode ignored: eta^2 missing in transmitted radiance"

    def __init__(self, props):
        super().__init__(props)
        sides = F.FrontSide | F.BackSide
        self.declare([F.DeltaReflection | sides, F.DeltaTransmission | sides | F.NonSymmetric])

    def eval(self, ctx, si, wo, active=True):
        return mi.Color3f(0) * wo.z

    def pdf(self, ctx, si, wo, active=True):
        return mi.Float(0) * wo.z

    def sample(self, ctx, si, sample1, sample2, active=True):
        r, cos_t, eta_it, eta_ti = mi.fresnel(si.wi.z, 1.5)
        one, two = bool(ctx.is_enabled(F.DeltaReflection, 0)), bool(ctx.is_enabled(F.DeltaTransmission, 1))
        share = r if one and two else mi.Float(1.0 if one else 0.0)
        reflects = mi.Float(sample1) < share
        active = mi.Bool(active) & (si.wi.z != 0) & (one or two)
        bs = dr.zeros(mi.BSDFSample3f, dr.width(si.wi))
        bs.wo = dr.select(reflects, mi.reflect(si.wi), mi.refract(si.wi, cos_t, eta_ti))
        bs.pdf = dr.select(active, dr.select(reflects, share, 1.0 - share), 0.0)
        bs.eta = dr.select(reflects, 1.0, eta_it)
        bs.sampled_type = dr.select(reflects, mi.UInt32(+F.DeltaReflection), mi.UInt32(+F.DeltaTransmission))
        bs.sampled_component = dr.select(reflects, mi.UInt32(0), mi.UInt32(1))
        part = dr.select(reflects, r, 1.0 - r) / dr.maximum(bs.pdf, 1e-20)
        return bs, dr.select(active & (bs.pdf > 0), mi.Color3f(part), mi.Color3f(0))


# --------------------------------------------------------------------------- right


class TwoLobesRight(_TwoLobes):
    """A matte and a glossy lobe that can be asked for one by one."""

    fault = ""
    why = "component and type masks are obeyed by eval, pdf and sample alike; samples of the lobe fail at grazing"


class Paper(_Diffuse):
    """Thin paper: reflects .4 and lets .3 through, both diffusely, alike from both sides."""

    fault = ""
    why = "reflection and transmission are two components with both flags; no refraction, so eta = 1 and no eta^2"

    def __init__(self, props):
        super().__init__(props)
        sides = F.FrontSide | F.BackSide
        self.declare([F.DiffuseReflection | sides, F.DiffuseTransmission | sides])

    def shares(self, ctx):
        r = 0.4 if ctx.is_enabled(F.DiffuseReflection, 0) else 0.0
        t = 0.3 if ctx.is_enabled(F.DiffuseTransmission, 1) else 0.0
        return r, t

    def eval(self, ctx, si, wo, active=True):
        r, t = self.shares(ctx)
        side = si.wi.z * wo.z
        value = dr.select(side > 0, mi.Float(r), dr.select(side < 0, mi.Float(t), 0.0))
        return dr.select(active, mi.Color3f(value * dr.abs(wo.z) * dr.inv_pi), mi.Color3f(0))

    def pdf(self, ctx, si, wo, active=True):
        r, t = self.shares(ctx)
        side, both = si.wi.z * wo.z, max(r + t, 1e-9)
        value = dr.select(side > 0, mi.Float(r / both), dr.select(side < 0, mi.Float(t / both), 0.0))
        return dr.select(active, value * dr.abs(wo.z) * dr.inv_pi, mi.Float(0))

    def sample(self, ctx, si, sample1, sample2, active=True):
        r, t = self.shares(ctx)
        reflects = mi.Float(sample1) < r / max(r + t, 1e-9)
        w = mi.warp.square_to_cosine_hemisphere(sample2)
        bs = dr.zeros(mi.BSDFSample3f, dr.width(si.wi))
        bs.wo = mi.Vector3f(w.x, w.y, dr.mulsign(dr.select(reflects, w.z, -w.z), si.wi.z))
        bs.eta = 1.0
        bs.sampled_type = dr.select(reflects, mi.UInt32(+F.DiffuseReflection), mi.UInt32(+F.DiffuseTransmission))
        bs.sampled_component = dr.select(reflects, mi.UInt32(0), mi.UInt32(1))
        bs.pdf = self.pdf(ctx, si, bs.wo, active)
        value = self.eval(ctx, si, bs.wo, active)
        return bs, dr.select(bs.pdf > 0, value / dr.maximum(bs.pdf, 1e-20), mi.Color3f(0))

    def eval_diffuse_reflectance(self, si, active=True):
        return dr.select(active, mi.Color3f(0.4), mi.Color3f(0))


class GroovedRight(_Grooved):
    """A grooved matte surface, sampled uniformly."""

    fault = ""
    why = "anisotropic, and it says so by its flag; symmetric in both directions; uniform sampling is poor but right"

    def __init__(self, props):
        super().__init__(props)
        self.declare([F.DiffuseReflection | F.FrontSide | F.Anisotropic])

    def density(self, wi, wo):
        return mi.Float(0.5 * dr.inv_pi) + 0.0 * wo.z

    def choose(self, wi, sample1, sample2):
        return mi.warp.square_to_uniform_hemisphere(sample2)


PLUGINS = {
    "first_eval_pdf_bare": EvalPdfBare,
    "first_dead_lanes": DeadLanes,
    "first_flags_delta": FlagsDelta,
    "first_flags_transmission": FlagsTransmission,
    "first_reflectance_over_pi": ReflectanceOverPi,
    "first_local_twice": LocalTwice,
    "first_viewers_cosine": ViewersCosine,
    "first_leaks": Leaks,
    "first_eta_not_set": EtaNotSet,
    "first_value_for_weight": ValueForWeight,
    "first_mask_ignored": MaskIgnored,
    "first_component_zero": ComponentZero,
    "first_second_sample_only": SecondSampleOnly,
    "first_two_lobes_one_pdf": TwoLobesOnePdf,
    "first_grooved_isotropic_lie": GroovedIsotropicLie,
    "first_glass_mode_ignored": GlassModeIgnored,
    "first_two_lobes_right": TwoLobesRight,
    "first_paper": Paper,
    "first_grooved_right": GroovedRight,
}
for _name, _cls in PLUGINS.items():
    mi.register_bsdf(_name, _cls)

MUTANTS = [
    EvalPdfBare, DeadLanes, FlagsDelta, FlagsTransmission, ReflectanceOverPi, LocalTwice, ViewersCosine, Leaks,
    EtaNotSet, ValueForWeight, MaskIgnored, ComponentZero, SecondSampleOnly, TwoLobesOnePdf, GroovedIsotropicLie,
    GlassModeIgnored,
]  # fmt: skip
SOUND = [TwoLobesRight, Paper, GroovedRight]
