"""Mitsuba plugins in Python: wrong flags, components, lanes, sides; and two that are right."""

import gonio.mitsuba  # noqa: F401  chooses llvm_ad_rgb
import drjit as dr
import mitsuba as mi

F = mi.BSDFFlags
SIDES = F.FrontSide | F.BackSide


class _Matte(mi.BSDF):
    """A matte surface, as Mitsuba's own."""

    kind = "plugin"
    fault = cause = ""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.albedo = mi.Color3f(props.get("albedo", 0.6))
        self.declare(F.DiffuseReflection | F.FrontSide)

    def declare(self, *lobes):
        self.m_components = list(lobes)
        self.m_flags = lobes[0]
        for lobe in lobes[1:]:
            self.m_flags = self.m_flags | lobe

    def traverse(self, cb):
        cb.put("albedo", self.albedo, mi.ParamFlags.Differentiable)

    def enabled(self, ctx, si, active):
        return active & ctx.is_enabled(F.DiffuseReflection, 0) & (mi.Frame3f.cos_theta(si.wi) > 0)

    def sample(self, ctx, si, sample1, sample2, active=True):
        active = self.enabled(ctx, si, active)
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo = mi.warp.square_to_cosine_hemisphere(sample2)
        bs.pdf = mi.warp.square_to_cosine_hemisphere_pdf(bs.wo)
        bs.eta = 1.0
        bs.sampled_type = mi.UInt32(+F.DiffuseReflection)
        bs.sampled_component = mi.UInt32(0)
        active &= bs.pdf > 0
        return bs, mi.Spectrum(self.albedo) & active

    def eval(self, ctx, si, wo, active=True):
        active = self.enabled(ctx, si, active) & (mi.Frame3f.cos_theta(wo) > 0)
        return mi.Spectrum(self.albedo * (mi.Frame3f.cos_theta(wo) * dr.inv_pi)) & active

    def pdf(self, ctx, si, wo, active=True):
        active = self.enabled(ctx, si, active) & (mi.Frame3f.cos_theta(wo) > 0)
        return dr.select(active, mi.warp.square_to_cosine_hemisphere_pdf(wo), 0)

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def eval_pdf_sample(self, ctx, si, wo, sample1, sample2, active=True):
        return (*self.eval_pdf(ctx, si, wo, active), *self.sample(ctx, si, sample1, sample2, active))

    def to_string(self):
        return f"{type(self).__name__}[albedo={self.albedo}]"


class DeadLanes(_Matte):
    """A matte surface that answers in dead lanes."""

    fault = "`active` is ignored: eval, pdf and weight are not 0 in lanes that are dead"
    cause = "active ignored"

    def enabled(self, ctx, si, active):
        return mi.Bool(True) & ctx.is_enabled(F.DiffuseReflection, 0) & (mi.Frame3f.cos_theta(si.wi) > 0)


class FastPath(_Matte):
    """A matte surface whose combined call was written in a hurry."""

    fault = "eval_pdf and eval_pdf_sample return f without the cosine, eval alone has it"
    cause = "cosine missing in eval_pdf and eval_pdf_sample"

    def eval_pdf(self, ctx, si, wo, active=True):
        active = self.enabled(ctx, si, active) & (mi.Frame3f.cos_theta(wo) > 0)
        return mi.Spectrum(self.albedo * dr.inv_pi) & active, self.pdf(ctx, si, wo, active)


class NoCosineWeight(_Matte):
    """A matte surface that samples the hemisphere evenly and says it was by the cosine."""

    fault = "directions are uniform on the hemisphere, pdf and weight are those of cosine sampling"
    cause = "pdf of another sampling"

    def sample(self, ctx, si, sample1, sample2, active=True):
        bs, _ = super().sample(ctx, si, sample1, sample2, active)
        bs.wo = mi.warp.square_to_uniform_hemisphere(sample2)
        bs.pdf = mi.warp.square_to_cosine_hemisphere_pdf(bs.wo)
        return bs, mi.Spectrum(self.albedo) & (self.enabled(ctx, si, active) & (bs.pdf > 0))


class LeakingSides(_Matte):
    """An opaque surface that takes the cosine's size on either side."""

    fault = "eval and pdf use |cos|: an opaque one-sided surface is lit from behind, and seen there"
    cause = "side of wo and wi not tested"

    def eval(self, ctx, si, wo, active=True):
        active = active & ctx.is_enabled(F.DiffuseReflection, 0)
        return mi.Spectrum(self.albedo * (dr.abs(mi.Frame3f.cos_theta(wo)) * dr.inv_pi)) & active

    def pdf(self, ctx, si, wo, active=True):
        active = active & ctx.is_enabled(F.DiffuseReflection, 0)
        return dr.select(active, dr.abs(mi.Frame3f.cos_theta(wo)) * dr.inv_pi, 0)


class ZeroEta(_Matte):
    """A matte surface that leaves eta as it was initialized."""

    fault = "bs.eta is 0 and sampled_type is empty, as dr.zeros made them; a path's eta is 0 from there on"
    cause = "eta of the sample 0"

    def sample(self, ctx, si, sample1, sample2, active=True):
        bs, weight = super().sample(ctx, si, sample1, sample2, active)
        bs.eta = mi.Float(0.0)
        bs.sampled_type = mi.UInt32(0)
        return bs, weight


class _Mirror(_Matte):
    """A perfect mirror."""

    def __init__(self, props):
        _Matte.__init__(self, props)
        self.declare(F.DeltaReflection | F.FrontSide)

    def sample(self, ctx, si, sample1, sample2, active=True):
        active = active & ctx.is_enabled(F.DeltaReflection, 0) & (mi.Frame3f.cos_theta(si.wi) > 0)
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo = mi.reflect(si.wi)
        bs.pdf = dr.select(active, mi.Float(1.0), 0.0)
        bs.eta = 1.0
        bs.sampled_type = mi.UInt32(+F.DeltaReflection)
        bs.sampled_component = mi.UInt32(0)
        return bs, mi.Spectrum(self.albedo) & active

    def eval(self, ctx, si, wo, active=True):
        return mi.Spectrum(0.0)

    def pdf(self, ctx, si, wo, active=True):
        return mi.Float(0.0)


class GlossyMirror(_Mirror):
    """A mirror that calls itself glossy."""

    fault = "flags and sampled_type of a perfect mirror say GlossyReflection, pdf 1: MIS takes it for a density"
    cause = "delta flag"

    def __init__(self, props):
        _Mirror.__init__(self, props)
        self.declare(F.GlossyReflection | F.FrontSide)

    def sample(self, ctx, si, sample1, sample2, active=True):
        active = active & ctx.is_enabled(F.GlossyReflection, 0) & (mi.Frame3f.cos_theta(si.wi) > 0)
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo = mi.reflect(si.wi)
        bs.pdf = dr.select(active, mi.Float(1.0), 0.0)
        bs.eta = 1.0
        bs.sampled_type = mi.UInt32(+F.GlossyReflection)
        bs.sampled_component = mi.UInt32(0)
        return bs, mi.Spectrum(self.albedo) & active


class _Glass(_Matte):
    """Smooth glass of index 1.5, as Mitsuba's dielectric."""

    def __init__(self, props):
        _Matte.__init__(self, props)
        self.eta = mi.Float(props.get("eta", 1.5))
        self.declare(F.DeltaReflection | SIDES, F.DeltaTransmission | SIDES | F.NonSymmetric)

    def factor(self, ctx, eta_ti):
        return dr.square(eta_ti) if ctx.mode == mi.TransportMode.Radiance else mi.Float(1.0)

    def lobes(self, ctx):
        return ctx.is_enabled(F.DeltaReflection, 0), ctx.is_enabled(F.DeltaTransmission, 1)

    def sample(self, ctx, si, sample1, sample2, active=True):
        has_r, has_t = self.lobes(ctx)
        r, cos_t, eta_it, eta_ti = mi.fresnel(mi.Frame3f.cos_theta(si.wi), self.eta)
        bs = dr.zeros(mi.BSDFSample3f)
        if has_r and has_t:
            reflects = (sample1 <= r) & active
            bs.pdf = dr.select(reflects, r, 1.0 - r)
            weight = mi.Float(1.0)
        elif has_r or has_t:
            reflects = mi.Bool(has_r) & active
            bs.pdf = mi.Float(1.0)
            weight = r if has_r else 1.0 - r
        else:
            return bs, mi.Spectrum(0.0)
        bs.wo = dr.select(reflects, mi.reflect(si.wi), mi.refract(si.wi, cos_t, eta_ti))
        bs.eta = dr.select(reflects, 1.0, eta_it)
        bs.sampled_type = dr.select(reflects, mi.UInt32(+F.DeltaReflection), mi.UInt32(+F.DeltaTransmission))
        bs.sampled_component = dr.select(reflects, mi.UInt32(0), mi.UInt32(1))
        weight = weight * dr.select(reflects, 1.0, self.factor(ctx, eta_ti))
        bs.pdf = dr.select(active, bs.pdf, 0.0)
        return bs, mi.Spectrum(weight) & active

    def eval(self, ctx, si, wo, active=True):
        return mi.Spectrum(0.0)

    def pdf(self, ctx, si, wo, active=True):
        return mi.Float(0.0)


class GlassInverse(_Glass):
    """Glass with radiance's factor upside down."""

    fault = "transmitted radiance is multiplied by eta^2 where it must shrink by it"
    cause = "eta^2 upside down in radiance"

    def factor(self, ctx, eta_ti):
        return 1.0 / dr.square(eta_ti) if ctx.mode == mi.TransportMode.Radiance else mi.Float(1.0)


class GlassAllComponents(_Glass):
    """Glass that does not hear which component is asked for."""

    fault = "component and type_mask of the context are ignored: who asks for reflection gets refraction as well"
    cause = "component selection ignored"

    def lobes(self, ctx):
        return True, True


class GlassSampledType(_Glass):
    """Glass that calls every sample a reflection."""

    fault = "a refracted sample has sampled_type DeltaReflection, component 0 and eta 1"
    cause = "sampled_type and eta of transmission"

    def sample(self, ctx, si, sample1, sample2, active=True):
        bs, weight = super().sample(ctx, si, sample1, sample2, active)
        bs.sampled_type = mi.UInt32(+F.DeltaReflection)
        bs.sampled_component = mi.UInt32(0)
        bs.eta = mi.Float(1.0)
        return bs, weight


class GlassOneComponent(_Glass):
    """Glass whose lone lobes keep the weight of both."""

    fault = "asked for one component alone it samples that with pdf 1 and weight 1: F or 1 - F is missing"
    cause = "F missing where one component is asked for"

    def sample(self, ctx, si, sample1, sample2, active=True):
        bs, weight = super().sample(ctx, si, sample1, sample2, active)
        has_r, has_t = self.lobes(ctx)
        if has_r == has_t:
            return bs, weight
        r = mi.fresnel(mi.Frame3f.cos_theta(si.wi), self.eta)[0]
        return bs, weight / dr.maximum(r if has_r else 1.0 - r, 1e-6)


class _Translucent(_Matte):
    """A diffuse transmitter: .6 of the light leaves, in equal parts on both sides."""

    def __init__(self, props):
        _Matte.__init__(self, props)
        self.declare(F.DiffuseReflection | SIDES, F.DiffuseTransmission | SIDES)

    def chances(self, ctx):
        """Probabilities of (reflection, transmission) for this context."""
        r, t = ctx.is_enabled(F.DiffuseReflection, 0), ctx.is_enabled(F.DiffuseTransmission, 1)
        return (0.5, 0.5) if r and t else (1.0 if r else 0.0, 1.0 if t else 0.0)

    def sample(self, ctx, si, sample1, sample2, active=True):
        p_r, p_t = self.chances(ctx)
        bs = dr.zeros(mi.BSDFSample3f)
        if p_r + p_t == 0.0:
            return bs, mi.Spectrum(0.0)
        reflects = sample1 < p_r
        w = mi.warp.square_to_cosine_hemisphere(sample2)
        up = dr.select(reflects, 1.0, -1.0) * dr.select(si.wi.z < 0.0, -1.0, 1.0)
        bs.wo = mi.Vector3f(w.x, w.y, w.z * up)
        bs.pdf = self.pdf(ctx, si, bs.wo, active)
        bs.eta = 1.0
        bs.sampled_type = dr.select(reflects, mi.UInt32(+F.DiffuseReflection), mi.UInt32(+F.DiffuseTransmission))
        bs.sampled_component = dr.select(reflects, mi.UInt32(0), mi.UInt32(1))
        value = self.eval(ctx, si, bs.wo, active)
        return bs, dr.select(bs.pdf > 0.0, value / dr.maximum(bs.pdf, 1e-20), 0.0)

    def eval(self, ctx, si, wo, active=True):
        p_r, p_t = self.chances(ctx)
        same = si.wi.z * wo.z > 0.0
        on = dr.select(same, 1.0 if p_r > 0.0 else 0.0, 1.0 if p_t > 0.0 else 0.0)
        return mi.Spectrum(self.albedo * (0.5 * on * dr.abs(wo.z) * dr.inv_pi)) & active & (si.wi.z * wo.z != 0.0)

    def pdf(self, ctx, si, wo, active=True):
        p_r, p_t = self.chances(ctx)
        pdf = dr.select(si.wi.z * wo.z > 0.0, p_r, p_t) * dr.abs(wo.z) * dr.inv_pi
        return dr.select(active & (si.wi.z * wo.z != 0.0), pdf, 0.0)


class SoundTranslucent(_Translucent):
    """A diffuse transmitter that heeds components, lanes and sides."""

    why = "each component may be asked for alone: its value stays, its probability becomes 1"


class TranslucentHidden(_Translucent):
    """A diffuse transmitter that declares reflection only."""

    fault = "flags and components name reflection only, while samples and values reach the other side"
    cause = "transmission missing in the flags"

    def __init__(self, props):
        _Translucent.__init__(self, props)
        self.declare(F.DiffuseReflection | F.FrontSide)

    def chances(self, ctx):
        return 0.5, 0.5


class SoundSplitter(_Matte):
    """A beam splitter: mirrors a share, lets the rest pass straight on."""

    why = "a delta reflection and a null lobe, on both sides, without a radiance factor: eta is 1 everywhere"

    def __init__(self, props):
        _Matte.__init__(self, props)
        self.silver = mi.Float(props.get("silver", 0.4))
        self.declare(F.DeltaReflection | SIDES, F.Null | SIDES)

    def traverse(self, cb):
        cb.put("silver", self.silver, mi.ParamFlags.Differentiable)

    def sample(self, ctx, si, sample1, sample2, active=True):
        has_r, has_t = ctx.is_enabled(F.DeltaReflection, 0), ctx.is_enabled(F.Null, 1)
        bs = dr.zeros(mi.BSDFSample3f)
        if not (has_r or has_t):
            return bs, mi.Spectrum(0.0)
        chance = self.silver if has_r and has_t else mi.Float(1.0 if has_r else 0.0)
        reflects = sample1 < chance
        bs.wo = dr.select(reflects, mi.reflect(si.wi), -si.wi)
        bs.pdf = dr.select(active, dr.select(reflects, chance, 1.0 - chance), 0.0)
        bs.eta = 1.0
        bs.sampled_type = dr.select(reflects, mi.UInt32(+F.DeltaReflection), mi.UInt32(+F.Null))
        bs.sampled_component = dr.select(reflects, mi.UInt32(0), mi.UInt32(1))
        weight = dr.select(reflects, self.silver, 1.0 - self.silver) / dr.select(reflects, chance, 1.0 - chance)
        return bs, mi.Spectrum(weight) & active

    def eval(self, ctx, si, wo, active=True):
        return mi.Spectrum(0.0)

    def pdf(self, ctx, si, wo, active=True):
        return mi.Float(0.0)

    def eval_null_transmission(self, si, active=True):
        return mi.Spectrum(1.0 - self.silver) & active


PLUGINS = {
    "second_dead_lanes": DeadLanes,
    "second_fast_path": FastPath,
    "second_no_cosine_weight": NoCosineWeight,
    "second_leaking_sides": LeakingSides,
    "second_zero_eta": ZeroEta,
    "second_glossy_mirror": GlossyMirror,
    "second_glass_inverse": GlassInverse,
    "second_glass_all_components": GlassAllComponents,
    "second_glass_sampled_type": GlassSampledType,
    "second_glass_one_component": GlassOneComponent,
    "second_translucent_hidden": TranslucentHidden,
    "second_sound_translucent": SoundTranslucent,
    "second_sound_splitter": SoundSplitter,
}
for _name, _cls in PLUGINS.items():
    mi.register_bsdf(_name, _cls)

SOUND = [SoundTranslucent, SoundSplitter]
MUTANTS = [cls for cls in PLUGINS.values() if cls not in SOUND]
