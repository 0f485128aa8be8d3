"""Eleven more wrong Mitsuba plugins."""

from typing import ClassVar

import drjit as dr
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")

INV_PI = 1.0 / dr.pi
REFLECT = (mi.BSDFFlags.DiffuseReflection, mi.BSDFFlags.GlossyReflection, mi.BSDFFlags.DeltaReflection)


def _up(wi, wo):
    return (wi.z > 0.0) & (wo.z > 0.0)


def _mirror(w):
    return mi.Vector3f(-w.x, -w.y, w.z)


def _half(wi, wo):
    h = wi + wo
    return h * dr.rsqrt(dr.maximum(dr.dot(h, h), 1e-20))


def _power(x, p):
    return dr.select(x > 0.0, dr.power(dr.maximum(x, 1e-30), p), 0.0)


def _power_draw(s, p):
    """A direction about +z with density (p + 1) / (2 pi) cos^p."""
    cos = dr.power(1.0 - s.x, 1.0 / (p + 1.0))
    sin = dr.safe_sqrt(1.0 - cos * cos)
    sn, cs = dr.sincos(dr.two_pi * s.y)
    return mi.Vector3f(sin * cs, sin * sn, cos)


def _about(axis, w):
    return mi.Frame3f(axis).to_world(w)


def _groove(wi, wo, m):
    return dr.clip(2.0 * m.z * dr.minimum(wi.z, wo.z) / dr.maximum(dr.dot(wo, m), 1e-6), 0.0, 1.0)


def _schlick(r0, cos):
    return r0 + (1.0 - r0) * _power(1.0 - dr.clip(cos, 0.0, 1.0), 5.0)


def _ggx(m, ax, ay):
    inside = dr.square(m.x / ax) + dr.square(m.y / ay) + dr.square(m.z)
    return dr.select(m.z > 0.0, 1.0 / (dr.pi * ax * ay * dr.square(dr.maximum(inside, 1e-12))), 0.0)


def _ggx_draw(s, ax, ay):
    r = dr.safe_sqrt(s.x / dr.maximum(1.0 - s.x, 1e-7))
    sn, cs = dr.sincos(dr.two_pi * s.y)
    return dr.normalize(mi.Vector3f(r * ax * cs, r * ay * sn, 1.0))


def _beckmann(m, ax, ay):
    z2 = dr.maximum(dr.square(m.z), 1e-8)
    e = (dr.square(m.x / ax) + dr.square(m.y / ay)) / z2
    return dr.select(m.z > 1e-4, dr.exp(-e) / (dr.pi * ax * ay * dr.square(z2)), 0.0)


def _beckmann_draw(s, ax, ay):
    r = dr.safe_sqrt(-dr.log(dr.maximum(1.0 - s.x, 1e-7)))
    sn, cs = dr.sincos(dr.two_pi * s.y)
    return dr.normalize(mi.Vector3f(r * ax * cs, r * ay * sn, 1.0))


def _side(w, wi):
    """w with its z mirrored where the viewer is below."""
    return mi.Vector3f(w.x, w.y, dr.select(wi.z < 0.0, -w.z, w.z))


class _Lobes(mi.BSDF):
    """Any number of lobes; each has a flag, a share, a value (f times the cosine of wo), a density and a draw."""

    LOBES: ClassVar[tuple] = (mi.BSDFFlags.DiffuseReflection,)
    SIDES: ClassVar[object] = mi.BSDFFlags.FrontSide

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.setup(props)
        self.m_components = [lobe | self.SIDES for lobe in self.LOBES]
        flags = self.m_components[0]
        for more in self.m_components[1:]:
            flags = flags | more
        self.m_flags = flags

    def setup(self, props):
        pass

    def enabled(self, ctx):
        return [k for k, lobe in enumerate(self.LOBES) if ctx.is_enabled(lobe, k)]

    def shares(self, si):
        return [1.0 / len(self.LOBES)] * len(self.LOBES)

    def value(self, k, si, wi, wo):
        raise NotImplementedError

    def density(self, k, si, wi, wo):
        raise NotImplementedError

    def draw(self, k, si, wi, s):
        raise NotImplementedError

    def eval(self, ctx, si, wo, active=True):
        total = mi.Color3f(0.0)
        for k in self.enabled(ctx):
            total += self.value(k, si, si.wi, wo)
        return dr.select(active, total, 0.0)

    def mixed(self, si, wo, kept):
        q = self.shares(si)
        whole = sum((q[k] for k in kept), mi.Float(0.0))
        total = mi.Float(0.0)
        for k in kept:
            total += q[k] / whole * self.density(k, si, si.wi, wo)
        return total

    def pdf(self, ctx, si, wo, active=True):
        return dr.select(active, self.mixed(si, wo, self.enabled(ctx)), 0.0)

    def pick(self, si, kept):
        """Upper ends of the lobes' intervals of sample1."""
        q = self.shares(si)
        whole = sum((q[k] for k in kept), mi.Float(0.0))
        ends, end = [], mi.Float(0.0)
        for k in kept:
            end = end + q[k] / whole
            ends.append(end)
        return ends

    def sample(self, ctx, si, sample1, sample2, active=True):
        kept = self.enabled(ctx)
        bs = dr.zeros(mi.BSDFSample3f)
        if not kept:
            return bs, mi.Color3f(0.0)
        ends = self.pick(si, kept)
        wo, index = self.draw(kept[-1], si, si.wi, sample2), mi.UInt32(kept[-1])
        kind = mi.UInt32(int(self.LOBES[kept[-1]]))
        for k, end in reversed(list(zip(kept[:-1], ends[:-1]))):
            here = sample1 < end
            wo = dr.select(here, self.draw(k, si, si.wi, sample2), wo)
            index = dr.select(here, mi.UInt32(k), index)
            kind = dr.select(here, mi.UInt32(int(self.LOBES[k])), kind)
        bs.wo, bs.eta = wo, mi.Float(1.0)
        bs.sampled_component, bs.sampled_type = index, kind
        bs.pdf = self.pdf(ctx, si, wo, active)
        weight = self.eval(ctx, si, wo, active)
        weight = dr.select(bs.pdf > 0.0, weight / dr.maximum(bs.pdf, 1e-30), 0.0)
        return bs, weight

    def to_string(self):
        return type(self).__name__


def _cosine_density(wi, wo):
    return dr.select(_up(wi, wo), wo.z * INV_PI, 0.0)


def _cosine_value(albedo, wi, wo):
    return albedo * dr.select(_up(wi, wo), wo.z * INV_PI, 0.0)


# --------------------------------------------------------------------------- 1


class MirrorCoat(mi.BSDF):
    """A matte base under a smooth clear coat: a delta lobe R(cos) and kd (1 - R(o)) (1 - R(i)) / (pi (1 - R_avg))."""

    fault = (
        "the pdf of a sample of the mirrored direction is 1 instead of the probability (0.5) with which it is chosen, while "
        "its weight is right"
    )
    cause = "delta sample's pdf omits selection probability"
    R0 = 0.04

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.kd = props.get_texture("diffuse_reflectance", 0.6)
        one = mi.BSDFFlags.DeltaReflection | mi.BSDFFlags.FrontSide
        two = mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide
        self.m_components = [one, two]
        self.m_flags = one | two

    def traverse(self, cb):
        cb.put("diffuse_reflectance", self.kd, mi.ParamFlags.Differentiable)

    def _left(self, cos):
        return 1.0 - _schlick(self.R0, cos)

    def _enabled(self, ctx):
        return ctx.is_enabled(mi.BSDFFlags.DeltaReflection, 0), ctx.is_enabled(mi.BSDFFlags.DiffuseReflection, 1)

    def eval(self, ctx, si, wo, active=True):
        if not self._enabled(ctx)[1]:
            return mi.Color3f(0.0)
        average = self.R0 + (1.0 - self.R0) / 21.0
        factor = self._left(si.wi.z) * self._left(wo.z) / (1.0 - average)
        return dr.select(active, _cosine_value(self.kd.eval(si), si.wi, wo) * factor, 0.0)

    def pdf(self, ctx, si, wo, active=True):
        has_s, has_d = self._enabled(ctx)
        if not has_d:
            return mi.Float(0.0)
        return dr.select(active, _cosine_density(si.wi, wo) * (0.5 if has_s else 1.0), 0.0)

    def sample(self, ctx, si, sample1, sample2, active=True):
        has_s, has_d = self._enabled(ctx)
        bs = dr.zeros(mi.BSDFSample3f)
        if not (has_s or has_d):
            return bs, mi.Color3f(0.0)
        chance = 0.5 if has_s and has_d else 1.0
        shiny = (sample1 < 0.5) if chance == 0.5 else mi.Bool(has_s)
        bs.wo = dr.select(shiny, _mirror(si.wi), mi.warp.square_to_cosine_hemisphere(sample2))
        bs.eta = mi.Float(1.0)
        above = si.wi.z > 0.0
        density = self.pdf(ctx, si, bs.wo, active)
        bs.pdf = dr.select(active & above, dr.select(shiny, 1.0, density), 0.0)
        matte = self.eval(ctx, si, bs.wo, active)
        matte = dr.select(density > 0.0, matte / dr.maximum(density, 1e-30), 0.0)
        weight = dr.select(shiny, mi.Color3f(_schlick(self.R0, si.wi.z) / chance), matte)
        bs.sampled_component = dr.select(shiny, mi.UInt32(0), mi.UInt32(1))
        bs.sampled_type = dr.select(
            shiny, mi.UInt32(int(mi.BSDFFlags.DeltaReflection)), mi.UInt32(int(mi.BSDFFlags.DiffuseReflection))
        )
        return bs, dr.select(active & above, weight, 0.0)

    def to_string(self):
        return type(self).__name__


# --------------------------------------------------------------------------- 2


class _Facets(_Lobes):
    LOBES = (mi.BSDFFlags.GlossyReflection,)

    def D(self, m):
        raise NotImplementedError

    def normal(self, s):
        raise NotImplementedError

    def F(self, si, wi, wo, m):
        return _schlick(self.r0.eval(si), dr.dot(wo, m))

    def value(self, k, si, wi, wo):
        m = _half(wi, wo)
        lobe = self.D(m) * _groove(wi, wo, m) / (4.0 * dr.maximum(wi.z, 1e-6))
        return self.F(si, wi, wo, m) * dr.select(_up(wi, wo), lobe, 0.0)

    def density(self, k, si, wi, wo):
        m = _half(wi, wo)
        return dr.select(_up(wi, wo), self.D(m) * m.z / (4.0 * dr.maximum(dr.dot(wo, m), 1e-6)), 0.0)

    def draw(self, k, si, wi, s):
        return mi.reflect(wi, mi.Normal3f(self.normal(s)))


class BeckmannLogZero(_Facets):
    """Beckmann's metal in v-grooves."""

    fault = (
        "the slope is sqrt(-log(u)) with u in [0, 1): at sample2.x = 0 it is infinite and the normal inf / inf = NaN, and "
        "with it wo, weight and pdf"
    )
    cause = "log of zero at sample2.x = 0"

    def setup(self, props):
        self.r0 = props.get_texture("specular_reflectance", 0.6)
        self.alpha = mi.Float(props.get("alpha", 0.3))

    def traverse(self, cb):
        cb.put("specular_reflectance", self.r0, mi.ParamFlags.Differentiable)
        cb.put("alpha", self.alpha, mi.ParamFlags.Differentiable)

    def D(self, m):
        return _beckmann(m, self.alpha, self.alpha)

    def normal(self, s):
        r = dr.sqrt(-dr.log(s.x)) * self.alpha
        sn, cs = dr.sincos(dr.two_pi * s.y)
        return dr.normalize(mi.Vector3f(r * cs, r * sn, 1.0))

    def sample(self, ctx, si, sample1, sample2, active=True):
        bs = dr.zeros(mi.BSDFSample3f)
        if not self.enabled(ctx):
            return bs, mi.Color3f(0.0)
        m = self.normal(sample2)
        om = dr.dot(si.wi, m)
        bs.wo = mi.reflect(si.wi, mi.Normal3f(m))
        bs.eta, bs.sampled_component = mi.Float(1.0), mi.UInt32(0)
        bs.sampled_type = mi.UInt32(int(mi.BSDFFlags.GlossyReflection))
        failed = (si.wi.z <= 0.0) | (bs.wo.z <= 0.0) | ~mi.Bool(active)
        bs.pdf = dr.select(failed, 0.0, self.D(m) * m.z / (4.0 * om))
        shape = _groove(si.wi, bs.wo, m) * om / (si.wi.z * m.z)
        return bs, dr.select(failed, 0.0, self.F(si, si.wi, bs.wo, m) * shape)


# --------------------------------------------------------------------------- 3


class RetroNormalIncidence(_Lobes):
    """A matte sheet with a lobe back to the viewer."""

    LOBES = (mi.BSDFFlags.DiffuseReflection, mi.BSDFFlags.GlossyReflection)
    fault = (
        "the frame about the viewer is built from cross(z, wi), which is 0 at normal incidence: the glossy samples are NaN "
        "for a viewer along the normal, and right for all others"
    )
    cause = "lobe frame degenerate at normal incidence"

    def setup(self, props):
        self.kd = props.get_texture("diffuse_reflectance", 0.4)
        self.kr = props.get_texture("retro_reflectance", 0.4)
        self.p = mi.Float(props.get("exponent", 40.0))

    def traverse(self, cb):
        cb.put("diffuse_reflectance", self.kd, mi.ParamFlags.Differentiable)
        cb.put("retro_reflectance", self.kr, mi.ParamFlags.Differentiable)
        cb.put("exponent", self.p, mi.ParamFlags.Differentiable)

    def value(self, k, si, wi, wo):
        if k == 0:
            return _cosine_value(self.kd.eval(si), wi, wo)
        lobe = (self.p + 2.0) * (0.5 * INV_PI) * _power(dr.dot(wi, wo), self.p)
        return self.kr.eval(si) * dr.select(_up(wi, wo), lobe * wo.z, 0.0)

    def density(self, k, si, wi, wo):
        if k == 0:
            return _cosine_density(wi, wo)
        return dr.select(_up(wi, wo), (self.p + 1.0) * (0.5 * INV_PI) * _power(dr.dot(wi, wo), self.p), 0.0)

    def draw(self, k, si, wi, s):
        if k == 0:
            return mi.warp.square_to_cosine_hemisphere(s)
        across = mi.Vector3f(-wi.y, wi.x, 0.0)
        across = across / dr.sqrt(dr.dot(across, across))
        w = _power_draw(s, self.p)
        return across * w.x + dr.cross(wi, across) * w.y + wi * w.z


# --------------------------------------------------------------------------- 4


class SheenUncoupled(_Lobes):
    """Cloth: a matte base and Charlie's sheen."""

    LOBES = (mi.BSDFFlags.DiffuseReflection, mi.BSDFFlags.GlossyReflection)
    fault = (
        "the sheen is added to a bright base that is not dimmed by what the sheen takes: toward grazing the sum reflects "
        "more light than it receives"
    )
    cause = "sheen added without dimming the base"

    def setup(self, props):
        self.kd = props.get_texture("diffuse_reflectance", 0.85)
        self.sheen = props.get_texture("sheen", 0.9)
        self.roughness = mi.Float(props.get("roughness", 0.35))

    def traverse(self, cb):
        cb.put("diffuse_reflectance", self.kd, mi.ParamFlags.Differentiable)
        cb.put("sheen", self.sheen, mi.ParamFlags.Differentiable)
        cb.put("roughness", self.roughness, mi.ParamFlags.Differentiable)

    def value(self, k, si, wi, wo):
        if k == 0:
            return _cosine_value(self.kd.eval(si), wi, wo)
        m, e = _half(wi, wo), 1.0 / self.roughness
        D = (2.0 + e) * (0.5 * INV_PI) * _power(dr.safe_sqrt(m.x * m.x + m.y * m.y), e)
        V = 1.0 / (4.0 * dr.maximum(wi.z + wo.z - wi.z * wo.z, 1e-6))
        return self.sheen.eval(si) * dr.select(_up(wi, wo), D * V * wo.z, 0.0)

    def density(self, k, si, wi, wo):
        return _cosine_density(wi, wo) if k == 0 else dr.select(_up(wi, wo), 0.5 * INV_PI, 0.0)

    def draw(self, k, si, wi, s):
        return mi.warp.square_to_cosine_hemisphere(s) if k == 0 else mi.warp.square_to_uniform_hemisphere(s)


# --------------------------------------------------------------------------- 5


class FrostedFlags(_Lobes):
    """A thin frosted pane: a share of the facets' lobe is reflected, another goes through, mirrored at the pane."""

    LOBES = (mi.BSDFFlags.GlossyReflection, mi.BSDFFlags.GlossyReflection)
    SIDES = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
    fault = (
        "the component that transmits is declared and reported as glossy reflection: the plugin's flags have no "
        "transmission, although half of its light leaves on the other side, also if only reflection is asked for"
    )
    cause = "transmitting component flagged as reflection"

    def setup(self, props):
        self.r = props.get_texture("reflectance", 0.3)
        self.t = props.get_texture("transmittance", 0.6)
        self.alpha = mi.Float(props.get("alpha", 0.3))

    def traverse(self, cb):
        cb.put("reflectance", self.r, mi.ParamFlags.Differentiable)
        cb.put("transmittance", self.t, mi.ParamFlags.Differentiable)
        cb.put("alpha", self.alpha, mi.ParamFlags.Differentiable)

    def _folded(self, k, wi, wo):
        """The pair above the pane, and whether lobe k joins it."""
        there = (wi.z * wo.z > 0.0) if k == 0 else (wi.z * wo.z < 0.0)
        return mi.Vector3f(wi.x, wi.y, dr.abs(wi.z)), mi.Vector3f(wo.x, wo.y, dr.abs(wo.z)), there

    def value(self, k, si, wi, wo):
        wi, wo, there = self._folded(k, wi, wo)
        m = _half(wi, wo)
        lobe = _ggx(m, self.alpha, self.alpha) * _groove(wi, wo, m) / (4.0 * dr.maximum(wi.z, 1e-6))
        return (self.t if k else self.r).eval(si) * dr.select(there, lobe, 0.0)

    def density(self, k, si, wi, wo):
        wi, wo, there = self._folded(k, wi, wo)
        m = _half(wi, wo)
        lobe = _ggx(m, self.alpha, self.alpha) * m.z / (4.0 * dr.maximum(dr.dot(wo, m), 1e-6))
        return dr.select(there, lobe, 0.0)

    def draw(self, k, si, wi, s):
        above = mi.Vector3f(wi.x, wi.y, dr.abs(wi.z))
        w = mi.reflect(above, mi.Normal3f(_ggx_draw(s, self.alpha, self.alpha)))
        # a direction that fell below the pane fails: it is put into the pane, where no lobe has density
        z = dr.select(w.z > 0.0, w.z, 0.0)
        return dr.normalize(mi.Vector3f(w.x, w.y, dr.select((wi.z > 0.0) ^ (k == 1), z, -z)))


# --------------------------------------------------------------------------- 6


class BlendInverted(_Lobes):
    """A blend of a wide and a narrow Phong lobe by a weight."""

    LOBES = (mi.BSDFFlags.GlossyReflection, mi.BSDFFlags.GlossyReflection)
    fault = (
        "sample picks the second lobe with probability 1 - weight, where value and pdf give it the share weight: right at "
        "0.5 only"
    )
    cause = "blend picks lobes with inverted weight"

    def setup(self, props):
        self.weight = mi.Float(props.get("weight", 0.35))
        self.color = props.get_texture("specular_reflectance", 0.8)
        self.p = (mi.Float(props.get("exponent_a", 3.0)), mi.Float(props.get("exponent_b", 60.0)))

    def traverse(self, cb):
        cb.put("weight", self.weight, mi.ParamFlags.Differentiable)
        cb.put("specular_reflectance", self.color, mi.ParamFlags.Differentiable)

    def shares(self, si):
        w = dr.clip(self.weight, 0.0, 1.0)
        return [1.0 - w, w]

    def pick(self, si, kept):
        w = dr.clip(self.weight, 0.0, 1.0)
        return [w, mi.Float(1.0)] if len(kept) == 2 else [mi.Float(1.0)]

    def value(self, k, si, wi, wo):
        p = self.p[k]
        lobe = (p + 2.0) * (0.5 * INV_PI) * _power(dr.dot(_mirror(wi), wo), p)
        return self.color.eval(si) * (self.shares(si)[k] * dr.select(_up(wi, wo), lobe * wo.z, 0.0))

    def density(self, k, si, wi, wo):
        p = self.p[k]
        return dr.select(_up(wi, wo), (p + 1.0) * (0.5 * INV_PI) * _power(dr.dot(_mirror(wi), wo), p), 0.0)

    def draw(self, k, si, wi, s):
        return _about(_mirror(wi), _power_draw(s, self.p[k]))


# --------------------------------------------------------------------------- 7


class WardSwapped(_Lobes):
    """Ward's highlight with a bounded albedo, and two widths."""

    LOBES = (mi.BSDFFlags.GlossyReflection,)
    SIDES = mi.BSDFFlags.FrontSide | mi.BSDFFlags.Anisotropic
    fault = (
        "sample draws half vectors with alpha_u along y and alpha_v along x, pdf and eval the other way round: wrong for "
        "unequal widths"
    )
    cause = "sampler swaps the two widths"

    def setup(self, props):
        self.ks = props.get_texture("specular_reflectance", 0.5)
        self.u, self.v = mi.Float(props.get("alpha_u", 0.2)), mi.Float(props.get("alpha_v", 0.3))

    def traverse(self, cb):
        cb.put("specular_reflectance", self.ks, mi.ParamFlags.Differentiable)
        cb.put("alpha_u", self.u, mi.ParamFlags.Differentiable)
        cb.put("alpha_v", self.v, mi.ParamFlags.Differentiable)

    def value(self, k, si, wi, wo):
        m = _half(wi, wo)
        om = dr.maximum(dr.dot(wo, m), 1e-6)
        lobe = _beckmann(m, self.u, self.v) / (4.0 * om * om)
        return self.ks.eval(si) * dr.select(_up(wi, wo), lobe * wo.z, 0.0)

    def density(self, k, si, wi, wo):
        m = _half(wi, wo)
        lobe = _beckmann(m, self.u, self.v) * m.z / (4.0 * dr.maximum(dr.dot(wo, m), 1e-6))
        return dr.select(_up(wi, wo), lobe, 0.0)

    def draw(self, k, si, wi, s):
        return mi.reflect(wi, mi.Normal3f(_beckmann_draw(s, self.v, self.u)))


# --------------------------------------------------------------------------- 8


class LayeredViewerCosine(_Lobes):
    """A matte base under a coat, kd (1 - F(o)) (1 - F(i)) / (pi (1 - F_avg)), and GGX facets in v-grooves with F."""

    LOBES = (mi.BSDFFlags.DiffuseReflection, mi.BSDFFlags.GlossyReflection)
    R0 = 0.05
    fault = (
        "the base is multiplied by the cosine of si.wi, which is Mitsuba's viewer, instead of that of wo: its f is not "
        "reciprocal and does not vanish with the light at grazing"
    )
    cause = "foreshortening by si.wi instead of wo"

    def setup(self, props):
        self.kd = props.get_texture("diffuse_reflectance", 0.5)
        self.alpha = mi.Float(props.get("alpha", 0.2))

    def traverse(self, cb):
        cb.put("diffuse_reflectance", self.kd, mi.ParamFlags.Differentiable)
        cb.put("alpha", self.alpha, mi.ParamFlags.Differentiable)

    def value(self, k, si, wi, wo):
        up = _up(wi, wo)
        if k == 0:
            average = self.R0 + (1.0 - self.R0) / 21.0
            left = (1.0 - _schlick(self.R0, wi.z)) * (1.0 - _schlick(self.R0, wo.z)) / (1.0 - average)
            return self.kd.eval(si) * dr.select(up, left * wi.z * INV_PI, 0.0)
        m = _half(wi, wo)
        lobe = _ggx(m, self.alpha, self.alpha) * _groove(wi, wo, m) / (4.0 * dr.maximum(wi.z, 1e-6))
        return mi.Color3f(_schlick(self.R0, dr.dot(wo, m)) * dr.select(up, lobe, 0.0))

    def density(self, k, si, wi, wo):
        if k == 0:
            return _cosine_density(wi, wo)
        m = _half(wi, wo)
        lobe = _ggx(m, self.alpha, self.alpha) * m.z / (4.0 * dr.maximum(dr.dot(wo, m), 1e-6))
        return dr.select(_up(wi, wo), lobe, 0.0)

    def draw(self, k, si, wi, s):
        if k == 0:
            return mi.warp.square_to_cosine_hemisphere(s)
        return mi.reflect(wi, mi.Normal3f(_ggx_draw(s, self.alpha, self.alpha)))


# --------------------------------------------------------------------------- 9


class CopperBlueWeight(_Facets):
    """Colored metal: GGX facets in v-grooves with Schlick's reflectance; the weight is F G (o.m) / (o.n m.n)."""

    fault = (
        "in the blue channel the weight of a sample has the reflectance at the viewer's angle to the surface instead of to "
        "the facet: it is not eval / pdf in blue, most toward grazing"
    )
    cause = "blue weight uses Fresnel at surface cosine"

    def setup(self, props):
        self.r0 = mi.Color3f(props.get("red", 0.95), props.get("green", 0.6), props.get("blue", 0.3))
        self.alpha = mi.Float(props.get("alpha", 0.35))

    def traverse(self, cb):
        cb.put("r0", self.r0, mi.ParamFlags.Differentiable)
        cb.put("alpha", self.alpha, mi.ParamFlags.Differentiable)

    def D(self, m):
        return _ggx(m, self.alpha, self.alpha)

    def normal(self, s):
        return _ggx_draw(s, self.alpha, self.alpha)

    def F(self, si, wi, wo, m):
        return self._color(dr.dot(wo, m))

    def _color(self, cos):
        return self.r0 + (1.0 - self.r0) * _power(1.0 - dr.clip(cos, 0.0, 1.0), 5.0)

    def sample(self, ctx, si, sample1, sample2, active=True):
        bs, weight = _Facets.sample(self, ctx, si, sample1, sample2, active)
        if not self.enabled(ctx):
            return bs, weight
        m = _half(si.wi, bs.wo)
        F = self._color(si.wi.z)
        shape = _groove(si.wi, bs.wo, m) * dr.dot(bs.wo, m) / dr.maximum(si.wi.z * m.z, 1e-6)
        return bs, mi.Color3f(weight.x, weight.y, dr.select(bs.pdf > 0.0, F.z * shape, 0.0))


# --------------------------------------------------------------------------- 10


class BatchFlip(_Lobes):
    """Velour, the same on both sides: a matte whose brightness falls off from the mirrored direction."""

    SIDES = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
    fault = (
        "eval mirrors wi and wo of all rays if any ray of the call comes from below (dr.any instead of a select per ray): in "
        "a call with rays from both sides those from above are black; alone each ray is right"
    )
    cause = "Python if on dr.any flips all rays"

    def setup(self, props):
        self.reflectance = props.get_texture("reflectance", 0.7)

    def traverse(self, cb):
        cb.put("reflectance", self.reflectance, mi.ParamFlags.Differentiable)

    def value(self, k, si, wi, wo):
        shape = 0.75 - 0.25 * dr.dot(_mirror(wi), wo)
        return self.reflectance.eval(si) * dr.select(_up(wi, wo), shape * wo.z * INV_PI, 0.0)

    def eval(self, ctx, si, wo, active=True):
        if not self.enabled(ctx):
            return mi.Color3f(0.0)
        wi = mi.Vector3f(si.wi)
        if dr.any(wi.z < 0.0):
            wi, wo = mi.Vector3f(wi.x, wi.y, -wi.z), mi.Vector3f(wo.x, wo.y, -wo.z)
        return dr.select(active, self.value(0, si, wi, wo), 0.0)

    def density(self, k, si, wi, wo):
        return _cosine_density(_side(wi, wi), _side(wo, wi))

    def draw(self, k, si, wi, s):
        return _side(mi.warp.square_to_cosine_hemisphere(s), wi)


# --------------------------------------------------------------------------- 11


class ThreeLobesMisordered(_Lobes):
    """Matte, forward and backward lobes, as of dusty asphalt."""

    LOBES = (mi.BSDFFlags.DiffuseReflection, mi.BSDFFlags.GlossyReflection, mi.BSDFFlags.GlossyReflection)
    fault = (
        "sample draws the forward lobe with the probability of the backward one (0.1) and vice versa (0.3); the matte lobe "
        "and any lobe alone are right"
    )
    cause = "probabilities of two lobes interchanged in sample"

    def setup(self, props):
        self.kd = props.get_texture("diffuse_reflectance", 0.4)
        self.ks = props.get_texture("specular_reflectance", 0.25)
        self.kr = props.get_texture("retro_reflectance", 0.1)
        self.p = mi.Float(props.get("exponent", 12.0))

    def traverse(self, cb):
        cb.put("diffuse_reflectance", self.kd, mi.ParamFlags.Differentiable)
        cb.put("specular_reflectance", self.ks, mi.ParamFlags.Differentiable)
        cb.put("retro_reflectance", self.kr, mi.ParamFlags.Differentiable)
        cb.put("exponent", self.p, mi.ParamFlags.Differentiable)

    def shares(self, si):
        return [mi.Float(0.6), mi.Float(0.3), mi.Float(0.1)]

    def pick(self, si, kept):
        return [mi.Float(0.6), mi.Float(0.7), mi.Float(1.0)] if len(kept) == 3 else _Lobes.pick(self, si, kept)

    def _axis(self, k, wi):
        return _mirror(wi) if k == 1 else mi.Vector3f(wi)

    def value(self, k, si, wi, wo):
        if k == 0:
            return _cosine_value(self.kd.eval(si), wi, wo)
        lobe = (self.p + 2.0) * (0.5 * INV_PI) * _power(dr.dot(self._axis(k, wi), wo), self.p)
        return (self.ks if k == 1 else self.kr).eval(si) * dr.select(_up(wi, wo), lobe * wo.z, 0.0)

    def density(self, k, si, wi, wo):
        if k == 0:
            return _cosine_density(wi, wo)
        lobe = (self.p + 1.0) * (0.5 * INV_PI) * _power(dr.dot(self._axis(k, wi), wo), self.p)
        return dr.select(_up(wi, wo), lobe, 0.0)

    def draw(self, k, si, wi, s):
        if k == 0:
            return mi.warp.square_to_cosine_hemisphere(s)
        return _about(self._axis(k, wi), _power_draw(s, self.p))


PLUGINS = {
    "w3_mirror_coat": MirrorCoat,
    "w3_beckmann_log_zero": BeckmannLogZero,
    "w3_retro_normal_incidence": RetroNormalIncidence,
    "w3_sheen_uncoupled": SheenUncoupled,
    "w3_frosted_flags": FrostedFlags,
    "w3_blend_inverted": BlendInverted,
    "w3_ward_swapped": WardSwapped,
    "w3_layered_viewer_cosine": LayeredViewerCosine,
    "w3_copper_blue_weight": CopperBlueWeight,
    "w3_batch_flip": BatchFlip,
    "w3_three_lobes_misordered": ThreeLobesMisordered,
}
for _name, _cls in PLUGINS.items():
    mi.register_bsdf(_name, lambda props, _cls=_cls: _cls(props))
MUTANTS = list(PLUGINS.values())
