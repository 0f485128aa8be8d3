"""Mitsuba plugins, each with one mistake."""

from typing import ClassVar

import mitsuba as mi

mi.set_variant("llvm_ad_rgb")

import drjit as dr  # noqa: E402

F = mi.BSDFFlags


def flag(*flags):
    """The union of flags as one number."""
    total = 0
    for one in flags:
        total |= int(one)
    return total


def over(value, pdf):
    """value / pdf, 0 where pdf is 0."""
    return dr.select(pdf > 0.0, value / dr.select(pdf > 0.0, pdf, 1.0), 0.0)


class W5MiLeaf(mi.BSDF):
    """A leaf: diffuse reflection and diffuse transmission."""

    fault: ClassVar[str] = "if only reflection or only transmission is requested, eval returns both"
    cause: ClassVar[str] = (
        "eval (and the value of eval_pdf) ignores ctx: it never asks ctx.is_enabled for the two components, so a "
        "request for one type or component gets the other's value too, with density 0; pdf and sample honor it"
    )

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.rho, self.tau = mi.Color3f(0.3, 0.4, 0.1), mi.Color3f(0.2, 0.45, 0.1)
        self.through = props.get("through", 0.45)
        self.m_components = [
            flag(F.DiffuseReflection, F.FrontSide, F.BackSide),
            flag(F.DiffuseTransmission, F.FrontSide, F.BackSide),
        ]
        self.m_flags = self.m_components[0] | self.m_components[1]

    def chance(self, ctx):
        """Probability of reflection and of transmission under a context."""
        has_r, has_t = ctx.is_enabled(F.DiffuseReflection, 0), ctx.is_enabled(F.DiffuseTransmission, 1)
        if has_r and has_t:
            return 1.0 - self.through, self.through
        return float(has_r), float(has_t)

    def sample(self, ctx, si, sample1, sample2, active=True):
        p_r, p_t = self.chance(ctx)
        bs = dr.zeros(mi.BSDFSample3f, dr.width(si.wi))
        active = mi.Mask(active) & (mi.Frame3f.cos_theta(si.wi) != 0.0) & (p_r + p_t > 0.0)
        reflects = sample1 < p_r
        wo = mi.warp.square_to_cosine_hemisphere(sample2)
        wo.z = dr.mulsign(wo.z, si.wi.z)
        wo.z = dr.select(reflects, wo.z, -wo.z)
        bs.wo = wo
        bs.eta = 1.0
        bs.sampled_type = dr.select(
            reflects, mi.UInt32(int(F.DiffuseReflection)), mi.UInt32(int(F.DiffuseTransmission))
        )
        bs.sampled_component = dr.select(reflects, mi.UInt32(0), mi.UInt32(1))
        bs.pdf = self.pdf(ctx, si, wo, active)
        weight = dr.select(reflects, self.rho / max(p_r, 1e-9), self.tau / max(p_t, 1e-9))
        return bs, weight & (active & (bs.pdf > 0.0))

    def eval(self, ctx, si, wo, active=True):
        cos_i, cos_o = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
        color = dr.select(cos_i * cos_o > 0.0, self.rho, self.tau)
        return (color * (dr.abs(cos_o) * dr.inv_pi)) & (mi.Mask(active) & (cos_i * cos_o != 0.0))

    def pdf(self, ctx, si, wo, active=True):
        p_r, p_t = self.chance(ctx)
        cos_i, cos_o = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
        p = dr.select(cos_i * cos_o > 0.0, p_r, p_t)
        return dr.select(mi.Mask(active) & (cos_i * cos_o != 0.0), p * dr.abs(cos_o) * dr.inv_pi, 0.0)

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def to_string(self):
        return f"W5MiLeaf[through={self.through}]"


class W5MiGlass(mi.BSDF):
    """Smooth glass."""

    fault: ClassVar[str] = "radiance grows by eta^2 on entering the glass, where it must shrink"
    cause: ClassVar[str] = (
        "sample: in radiance mode the weight of refraction is multiplied by eta_it^2 instead of eta_ti^2 = 1 / eta_it^2 "
        "(the factor of radiance is inverted); bs.eta, direction and probability are right"
    )

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.eta = props.get("eta", 1.5)
        self.m_components = [
            flag(F.DeltaReflection, F.FrontSide, F.BackSide),
            flag(F.DeltaTransmission, F.FrontSide, F.BackSide, F.NonSymmetric),
        ]
        self.m_flags = self.m_components[0] | self.m_components[1]

    def sample(self, ctx, si, sample1, sample2, active=True):
        has_r, has_t = ctx.is_enabled(F.DeltaReflection, 0), ctx.is_enabled(F.DeltaTransmission, 1)
        bs = dr.zeros(mi.BSDFSample3f, dr.width(si.wi))
        cos_i = mi.Frame3f.cos_theta(si.wi)
        active = mi.Mask(active) & (cos_i != 0.0) & (has_r or has_t)
        r, cos_t, eta_it, eta_ti = mi.fresnel(cos_i, mi.Float(self.eta))
        t = 1.0 - r
        if has_r and has_t:
            reflects, p = sample1 <= r, dr.select(sample1 <= r, r, t)
            weight = mi.Color3f(1.0)
        else:
            reflects, alone = mi.Mask(has_r), r if has_r else t
            weight, p = mi.Color3f(alone), dr.select(alone > 0.0, mi.Float(1.0), 0.0)  # 0 at total reflection
        bs.wo = dr.select(reflects, mi.reflect(si.wi), mi.refract(si.wi, cos_t, eta_ti))
        bs.pdf = dr.select(active, p, 0.0)
        bs.eta = dr.select(reflects, 1.0, eta_it)
        bs.sampled_type = dr.select(reflects, mi.UInt32(int(F.DeltaReflection)), mi.UInt32(int(F.DeltaTransmission)))
        bs.sampled_component = dr.select(reflects, mi.UInt32(0), mi.UInt32(1))
        if ctx.mode == mi.TransportMode.Radiance:
            weight = weight * dr.select(reflects, 1.0, dr.square(eta_it))
        return bs, weight & active

    def eval(self, ctx, si, wo, active=True):
        return mi.Color3f(0.0) * wo.z

    def pdf(self, ctx, si, wo, active=True):
        return mi.Float(0.0) * wo.z

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def to_string(self):
        return f"W5MiGlass[eta={self.eta}]"


class W5MiBrushed(mi.BSDF):
    """Brushed metal: anisotropic GGX, all normals sampled."""

    fault: ClassVar[str] = "samples spread along the wrong axis"
    cause: ClassVar[str] = (
        "sample: normals are drawn with the two roughnesses swapped, alpha_v along x and alpha_u along y, whereas eval "
        "and pdf have alpha_u along x: the samples do not have the density pdf"
    )

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.alpha_u, self.alpha_v = props.get("alpha_u", 0.15), props.get("alpha_v", 0.5)
        self.color = mi.Color3f(0.9, 0.85, 0.8)
        self.m_components = [flag(F.GlossyReflection, F.FrontSide, F.Anisotropic)]
        self.m_flags = self.m_components[0]

    def distribution(self, u, v):
        return mi.MicrofacetDistribution(mi.MicrofacetType.GGX, u, v, False)

    def lit(self, ctx, si, wo, active):
        on = ctx.is_enabled(F.GlossyReflection, 0)
        return mi.Mask(active) & on & (mi.Frame3f.cos_theta(si.wi) > 0.0) & (mi.Frame3f.cos_theta(wo) > 0.0)

    def sample(self, ctx, si, sample1, sample2, active=True):
        bs = dr.zeros(mi.BSDFSample3f, dr.width(si.wi))
        m, _ = self.distribution(self.alpha_v, self.alpha_u).sample(si.wi, sample2)
        bs.wo = mi.reflect(si.wi, m)
        bs.eta = 1.0
        bs.sampled_type = int(F.GlossyReflection)
        bs.sampled_component = 0
        bs.pdf = self.pdf(ctx, si, bs.wo, active)
        return bs, over(self.eval(ctx, si, bs.wo, active), bs.pdf)

    def eval(self, ctx, si, wo, active=True):
        m = dr.normalize(si.wi + wo)
        d = self.distribution(self.alpha_u, self.alpha_v)
        value = d.eval(m) * d.G(si.wi, wo, m) / (4.0 * mi.Frame3f.cos_theta(si.wi))
        return (self.color * value) & self.lit(ctx, si, wo, active)

    def pdf(self, ctx, si, wo, active=True):
        m = dr.normalize(si.wi + wo)
        d = self.distribution(self.alpha_u, self.alpha_v)
        density = d.eval(m) * mi.Frame3f.cos_theta(m) / (4.0 * dr.dot(si.wi, m))
        return dr.select(self.lit(ctx, si, wo, active), density, 0.0)

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def to_string(self):
        return f"W5MiBrushed[{self.alpha_u}, {self.alpha_v}]"


class _Diffuse(mi.BSDF):
    """Shared parts of one diffuse lobe on the front; `value` is f |cos| as a color."""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.m_components = [flag(F.DiffuseReflection, F.FrontSide)]
        self.m_flags = self.m_components[0]

    def lit(self, ctx, si, wo, active):
        on = ctx.is_enabled(F.DiffuseReflection, 0)
        return mi.Mask(active) & on & (mi.Frame3f.cos_theta(si.wi) > 0.0) & (mi.Frame3f.cos_theta(wo) > 0.0)

    def draw(self, sample2):
        return mi.warp.square_to_cosine_hemisphere(sample2)

    def sample(self, ctx, si, sample1, sample2, active=True):
        bs = dr.zeros(mi.BSDFSample3f, dr.width(si.wi))
        bs.wo = self.draw(sample2)
        bs.eta = 1.0
        bs.sampled_type = int(F.DiffuseReflection)
        bs.sampled_component = 0
        active = mi.Mask(active) & (mi.Frame3f.cos_theta(si.wi) > 0.0)
        bs.pdf = self.pdf(ctx, si, bs.wo, active)
        return bs, over(self.eval(ctx, si, bs.wo, active), bs.pdf)

    def eval(self, ctx, si, wo, active=True):
        return self.value(si, wo) & self.lit(ctx, si, wo, active)

    def pdf(self, ctx, si, wo, active=True):
        density = dr.abs(mi.Frame3f.cos_theta(wo)) * dr.inv_pi
        return dr.select(self.lit(ctx, si, wo, active), density, 0.0)

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def to_string(self):
        return f"{type(self).__name__}[]"


class W5MiChalk(_Diffuse):
    """Chalk: a matte surface."""

    fault: ClassVar[str] = "samples are uniform over the hemisphere, their density claims to follow the cosine"
    cause: ClassVar[str] = (
        "sample: wo is drawn by square_to_uniform_hemisphere, whose density is 1 / (2 pi), but pdf, bs.pdf and the "
        "weight are those of the cosine-weighted hemisphere"
    )

    def draw(self, sample2):
        return mi.warp.square_to_uniform_hemisphere(sample2)

    def value(self, si, wo):
        return mi.Color3f(0.8, 0.78, 0.7) * (dr.abs(mi.Frame3f.cos_theta(wo)) * dr.inv_pi)


class W5MiTile(_Diffuse):
    """An unglazed tile, which is black from behind."""

    fault: ClassVar[str] = "eval and pdf reflect from behind too, where sample returns nothing"
    cause: ClassVar[str] = (
        "eval and pdf: the test of sides is cos_i * cos_o > 0 rather than cos_i > 0 and cos_o > 0, so two directions "
        "below the surface give a value and a density, though the component is FrontSide only and sample fails there"
    )

    def lit(self, ctx, si, wo, active):
        on = ctx.is_enabled(F.DiffuseReflection, 0)
        return mi.Mask(active) & on & (mi.Frame3f.cos_theta(si.wi) * mi.Frame3f.cos_theta(wo) > 0.0)

    def value(self, si, wo):
        return mi.Color3f(0.6, 0.3, 0.2) * (dr.abs(mi.Frame3f.cos_theta(wo)) * dr.inv_pi)


class W5MiPlaster(_Diffuse):
    """Lommel-Seeliger's law: single scattering in a deep powder, f = w / (4 pi (mu_i + mu_o))."""

    fault: ClassVar[str] = "eval_pdf returns another value than eval"
    cause: ClassVar[str] = (
        "eval_pdf: the value lacks the cosine of wo (it is f, not f |cos theta_o|), unlike that of eval; its density is right"
    )

    def single(self, si, wo):
        cos_i, cos_o = dr.abs(mi.Frame3f.cos_theta(si.wi)), dr.abs(mi.Frame3f.cos_theta(wo))
        return mi.Color3f(0.9, 0.85, 0.8) * (0.25 * dr.inv_pi / dr.maximum(cos_i + cos_o, 1e-6))

    def value(self, si, wo):
        return self.single(si, wo) * dr.abs(mi.Frame3f.cos_theta(wo))

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.single(si, wo) & self.lit(ctx, si, wo, active), self.pdf(ctx, si, wo, active)


class W5MiVeil(mi.BSDF):
    """A veil: matte threads on the front, and holes through which light passes unchanged."""

    fault: ClassVar[str] = "light through the holes is not marked as a delta sample"
    cause: ClassVar[str] = (
        "sample: sampled_type of light through the holes is GlossyTransmission instead of Null, a type that the plugin "
        "does not have and no delta type, so integrators take the discrete probability for a density"
    )

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.opacity = props.get("opacity", 0.6)
        self.color = mi.Color3f(0.5, 0.2, 0.3)
        self.m_components = [flag(F.DiffuseReflection, F.FrontSide), flag(F.Null, F.FrontSide, F.BackSide)]
        self.m_flags = self.m_components[0] | self.m_components[1]

    def chance(self, ctx):
        """Probability of the threads and of the holes."""
        has_d, has_n = ctx.is_enabled(F.DiffuseReflection, 0), ctx.is_enabled(F.Null, 1)
        if has_d and has_n:
            return self.opacity, 1.0 - self.opacity
        return float(has_d), float(has_n)

    def lit(self, ctx, si, wo, active):
        return mi.Mask(active) & (mi.Frame3f.cos_theta(si.wi) > 0.0) & (mi.Frame3f.cos_theta(wo) > 0.0)

    def sample(self, ctx, si, sample1, sample2, active=True):
        p_d, p_n = self.chance(ctx)
        bs = dr.zeros(mi.BSDFSample3f, dr.width(si.wi))
        active = mi.Mask(active) & (p_d + p_n > 0.0)
        threads = sample1 < p_d
        bs.wo = dr.select(threads, mi.warp.square_to_cosine_hemisphere(sample2), -si.wi)
        bs.eta = 1.0
        bs.pdf = dr.select(active, dr.select(threads, self.pdf(ctx, si, bs.wo, active), p_n), 0.0)
        bs.sampled_type = dr.select(threads, mi.UInt32(int(F.DiffuseReflection)), mi.UInt32(int(F.GlossyTransmission)))
        bs.sampled_component = dr.select(threads, mi.UInt32(0), mi.UInt32(1))
        hole = mi.Color3f((1.0 - self.opacity) / max(p_n, 1e-9))
        weight = dr.select(threads, over(self.eval(ctx, si, bs.wo, active), bs.pdf), hole)
        return bs, weight & (active & (bs.pdf > 0.0))

    def eval(self, ctx, si, wo, active=True):
        on = ctx.is_enabled(F.DiffuseReflection, 0)
        value = self.color * (self.opacity * dr.abs(mi.Frame3f.cos_theta(wo)) * dr.inv_pi)
        return value & (self.lit(ctx, si, wo, active) & on)

    def pdf(self, ctx, si, wo, active=True):
        density = self.chance(ctx)[0] * dr.abs(mi.Frame3f.cos_theta(wo)) * dr.inv_pi
        return dr.select(self.lit(ctx, si, wo, active), density, 0.0)

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def eval_null_transmission(self, si, active=True):
        return mi.Color3f(1.0 - self.opacity) & mi.Mask(active)

    def to_string(self):
        return f"W5MiVeil[opacity={self.opacity}]"


class _Plastic(mi.BSDF):
    """Shared parts of a matte lobe (0) and a GGX lobe (1), without coupling: colors whose sum is below 1."""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.alpha = props.get("alpha", 0.25)
        self.matte, self.gloss = mi.Color3f(0.5, 0.3, 0.2), mi.Color3f(0.3)
        self.share = 0.4  # of samples that go to the gloss
        self.m_components = [flag(F.DiffuseReflection, F.FrontSide), flag(F.GlossyReflection, F.FrontSide)]
        self.m_flags = self.m_components[0] | self.m_components[1]

    def distribution(self):
        return mi.MicrofacetDistribution(mi.MicrofacetType.GGX, self.alpha, self.alpha, True)

    def asked(self, ctx):
        return ctx.is_enabled(F.DiffuseReflection, 0), ctx.is_enabled(F.GlossyReflection, 1)

    def chance(self, ctx):
        """Probability of each lobe when sampling."""
        has_d, has_g = self.asked(ctx)
        if has_d and has_g:
            return 1.0 - self.share, self.share
        return float(has_d), float(has_g)

    def density_chance(self, ctx):
        """Probability of each lobe in the density."""
        return self.chance(ctx)

    def component(self, glossy):
        return dr.select(glossy, mi.UInt32(1), mi.UInt32(0))

    def lit(self, si, wo, active):
        return mi.Mask(active) & (mi.Frame3f.cos_theta(si.wi) > 0.0) & (mi.Frame3f.cos_theta(wo) > 0.0)

    def sample(self, ctx, si, sample1, sample2, active=True):
        p_d, p_g = self.chance(ctx)
        bs = dr.zeros(mi.BSDFSample3f, dr.width(si.wi))
        active = mi.Mask(active) & (mi.Frame3f.cos_theta(si.wi) > 0.0) & (p_d + p_g > 0.0)
        glossy = sample1 < p_g
        m, _ = self.distribution().sample(si.wi, sample2)
        bs.wo = dr.select(glossy, mi.reflect(si.wi, m), mi.warp.square_to_cosine_hemisphere(sample2))
        bs.eta = 1.0
        bs.sampled_type = dr.select(glossy, mi.UInt32(int(F.GlossyReflection)), mi.UInt32(int(F.DiffuseReflection)))
        bs.sampled_component = self.component(glossy)
        bs.pdf = self.pdf(ctx, si, bs.wo, active)
        return bs, over(self.eval(ctx, si, bs.wo, active), bs.pdf)

    def eval(self, ctx, si, wo, active=True):
        has_d, has_g = self.asked(ctx)
        m, d = dr.normalize(si.wi + wo), self.distribution()
        highlight = d.eval(m) * d.G(si.wi, wo, m) / (4.0 * mi.Frame3f.cos_theta(si.wi))
        value = mi.Color3f(0.0)
        if has_d:
            value += self.matte * (mi.Frame3f.cos_theta(wo) * dr.inv_pi)
        if has_g:
            value += self.gloss * highlight
        return value & self.lit(si, wo, active)

    def pdf(self, ctx, si, wo, active=True):
        p_d, p_g = self.density_chance(ctx)
        m = dr.normalize(si.wi + wo)
        density = p_d * mi.Frame3f.cos_theta(wo) * dr.inv_pi
        if p_g > 0.0:
            density = density + p_g * self.distribution().pdf(si.wi, m) / (4.0 * dr.dot(wo, m))
        return dr.select(self.lit(si, wo, active), density, 0.0)

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def to_string(self):
        return f"{type(self).__name__}[alpha={self.alpha}]"


class W5MiTwoLayer(_Plastic):
    """Plastic: a matte lobe below a gloss."""

    fault: ClassVar[str] = "samples name the wrong component"
    cause: ClassVar[str] = (
        "sample: sampled_component is swapped: 0 for the gloss and 1 for the matte lobe, whereas in m_components and in "
        "every ctx.is_enabled the matte lobe is 0 and the gloss 1; sampled_type is right"
    )

    def component(self, glossy):
        return dr.select(glossy, mi.UInt32(0), mi.UInt32(1))


class W5MiGloss(_Plastic):
    """Painted metal: a gloss over a matte lobe."""

    fault: ClassVar[str] = "if one lobe alone is requested, the density integrates to that lobe's share, not to 1"
    cause: ClassVar[str] = (
        "pdf (and the weight, which divides by it): if ctx enables one component only, the density keeps that lobe's "
        "selection probability, whereas sample then always chooses it: the probability must become 1"
    )

    def density_chance(self, ctx):
        has_d, has_g = self.asked(ctx)
        return (1.0 - self.share) * has_d, self.share * has_g


class W5MiEnamel(mi.BSDF):
    """Colored metallic enamel: one GGX lobe with Schlick's Fresnel color."""

    fault: ClassVar[str] = "sampled light is gray"
    cause: ClassVar[str] = (
        "sample: the weight is the mean of eval's channels over pdf, in all channels, so it lacks the color: it is not "
        "eval / pdf per channel"
    )

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.alpha = props.get("alpha", 0.3)
        self.r0 = mi.Color3f(0.9, 0.5, 0.2)
        self.m_components = [flag(F.GlossyReflection, F.FrontSide)]
        self.m_flags = self.m_components[0]

    def distribution(self):
        return mi.MicrofacetDistribution(mi.MicrofacetType.GGX, self.alpha, self.alpha, True)

    def lit(self, ctx, si, wo, active):
        on = ctx.is_enabled(F.GlossyReflection, 0)
        return mi.Mask(active) & on & (mi.Frame3f.cos_theta(si.wi) > 0.0) & (mi.Frame3f.cos_theta(wo) > 0.0)

    def sample(self, ctx, si, sample1, sample2, active=True):
        bs = dr.zeros(mi.BSDFSample3f, dr.width(si.wi))
        active = mi.Mask(active) & (mi.Frame3f.cos_theta(si.wi) > 0.0)
        m, _ = self.distribution().sample(si.wi, sample2)
        bs.wo = mi.reflect(si.wi, m)
        bs.eta = 1.0
        bs.sampled_type = int(F.GlossyReflection)
        bs.sampled_component = 0
        bs.pdf = self.pdf(ctx, si, bs.wo, active)
        value = self.eval(ctx, si, bs.wo, active)
        return bs, mi.Color3f(over((value.x + value.y + value.z) / 3.0, bs.pdf))

    def eval(self, ctx, si, wo, active=True):
        m, d = dr.normalize(si.wi + wo), self.distribution()
        fresnel = self.r0 + (1.0 - self.r0) * dr.power(dr.maximum(1.0 - dr.dot(wo, m), 0.0), 5)
        value = fresnel * (d.eval(m) * d.G(si.wi, wo, m) / (4.0 * mi.Frame3f.cos_theta(si.wi)))
        return value & self.lit(ctx, si, wo, active)

    def pdf(self, ctx, si, wo, active=True):
        m = dr.normalize(si.wi + wo)
        density = self.distribution().pdf(si.wi, m) / (4.0 * dr.dot(wo, m))
        return dr.select(self.lit(ctx, si, wo, active), density, 0.0)

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def to_string(self):
        return f"W5MiEnamel[alpha={self.alpha}]"


PLUGINS = {
    "w5-mi-leaf": W5MiLeaf,
    "w5-mi-glass": W5MiGlass,
    "w5-mi-brushed": W5MiBrushed,
    "w5-mi-chalk": W5MiChalk,
    "w5-mi-tile": W5MiTile,
    "w5-mi-plaster": W5MiPlaster,
    "w5-mi-veil": W5MiVeil,
    "w5-mi-two-layer": W5MiTwoLayer,
    "w5-mi-gloss": W5MiGloss,
    "w5-mi-enamel": W5MiEnamel,
}
for _name, _plugin in PLUGINS.items():
    mi.register_bsdf(_name, lambda props, kind=_plugin: kind(props))

MUTANTS = list(PLUGINS.values())
SOUND = []
