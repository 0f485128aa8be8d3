"""Eleven wrong Mitsuba plugins."""

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


class UvMatte(_Lobes):
    """A matte surface with a texture, by default a checkerboard of four fields."""

    fault = (
        "sample reads the texture at (u, 1 - v), eval at (u, v): with a texture that varies along v the weight is not "
        "eval / pdf; with a uniform color nothing shows"
    )
    cause = "sample flips v of texture coordinates"

    def setup(self, props):
        given = props.has_property("reflectance")
        board = {
            "type": "checkerboard",
            "color0": {"type": "rgb", "value": 0.8},
            "color1": {"type": "rgb", "value": 0.2},
        }
        self.reflectance = props.get_texture("reflectance") if given else mi.load_dict(board)

    def traverse(self, cb):
        cb.put("reflectance", self.reflectance, mi.ParamFlags.Differentiable)

    def value(self, k, si, wi, wo):
        return _cosine_value(self.reflectance.eval(si), wi, wo)

    def density(self, k, si, wi, wo):
        return _cosine_density(wi, wo)

    def draw(self, k, si, wi, s):
        return mi.warp.square_to_cosine_hemisphere(s)

    def sample(self, ctx, si, sample1, sample2, active=True):
        bs, weight = _Lobes.sample(self, ctx, si, sample1, sample2, active)
        there = mi.SurfaceInteraction3f(si)
        there.uv = mi.Point2f(si.uv.x, 1.0 - si.uv.y)
        return bs, dr.select(bs.pdf > 0.0, self.reflectance.eval(there), 0.0) * (1.0 if self.enabled(ctx) else 0.0)


# --------------------------------------------------------------------------- 2


class _Phong(_Lobes):
    LOBES = (mi.BSDFFlags.DiffuseReflection, mi.BSDFFlags.GlossyReflection)

    def setup(self, props):
        self.kd = props.get_texture("diffuse_reflectance", 0.5)
        self.ks = props.get_texture("specular_reflectance", 0.25)
        self.p = mi.Float(props.get("exponent", 25.0))

    def traverse(self, cb):
        cb.put("diffuse_reflectance", self.kd, mi.ParamFlags.Differentiable)
        cb.put("specular_reflectance", self.ks, mi.ParamFlags.Differentiable)
        cb.put("exponent", self.p, mi.ParamFlags.Differentiable)

    def shares(self, si):
        return [0.6, 0.4]

    def value(self, k, si, wi, wo):
        if k == 0:
            return _cosine_value(self.kd.eval(si), wi, wo)
        lobe = (self.p + 2.0) * (0.5 * INV_PI) * _power(dr.dot(_mirror(wi), wo), self.p)
        return self.ks.eval(si) * dr.select(_up(wi, wo), lobe * wo.z, 0.0)

    def density(self, k, si, wi, wo):
        if k == 0:
            return _cosine_density(wi, wo)
        lobe = (self.p + 1.0) * (0.5 * INV_PI) * _power(dr.dot(_mirror(wi), wo), self.p)
        return dr.select(_up(wi, wo), lobe, 0.0)

    def draw(self, k, si, wi, s):
        if k == 0:
            return mi.warp.square_to_cosine_hemisphere(s)
        return _about(_mirror(wi), _power_draw(s, self.p))


class PhongComponent(_Phong):
    """Normalized modified Phong with two components."""

    fault = (
        "pdf ignores the context: asked for one component alone (component 0 or 1, or a type mask) it returns the mixture "
        "of both, while sample draws that component only and eval is its value only"
    )
    cause = "pdf ignores requested component and types"

    def pdf(self, ctx, si, wo, active=True):
        return dr.select(active, self.mixed(si, wo, [0, 1]), 0.0)


# --------------------------------------------------------------------------- 3


class MetalWorldPdf(_Lobes):
    """GGX metal in v-grooves."""

    LOBES = (mi.BSDFFlags.GlossyReflection,)
    fault = (
        "pdf takes wo, which is local, into the shading frame once more (si.to_local): right where the shading frame is the "
        "world's, wrong for every surface that is turned"
    )
    cause = "pdf transforms local direction a second time"

    def setup(self, props):
        self.r0 = props.get_texture("specular_reflectance", 0.8)
        self.alpha = mi.Float(props.get("alpha", 0.3))

    def traverse(self, cb):
        cb.put("specular_reflectance", self.r0, mi.ParamFlags.Differentiable)
        cb.put("alpha", self.alpha, mi.ParamFlags.Differentiable)

    def value(self, k, si, wi, wo):
        m = _half(wi, wo)
        lobe = _ggx(m, self.alpha, self.alpha) * _groove(wi, wo, m) / (4.0 * dr.maximum(wi.z, 1e-6))
        return _schlick(self.r0.eval(si), dr.dot(wo, m)) * dr.select(_up(wi, wo), lobe, 0.0)

    def density(self, k, si, wi, wo):
        wo = si.to_local(wo)
        m = _half(wi, wo)
        lobe = _ggx(m, self.alpha, self.alpha) * m.z / (4.0 * dr.maximum(dr.dot(wo, m), 1e-6))
        return dr.select(_up(wi, wo), lobe, 0.0)

    def draw(self, k, si, wi, s):
        return mi.reflect(wi, mi.Normal3f(_ggx_draw(s, self.alpha, self.alpha)))


# --------------------------------------------------------------------------- 4


class BlinnEvalPdf(_Lobes):
    """A matte base and Blinn's highlight in v-grooves."""

    LOBES = (mi.BSDFFlags.DiffuseReflection, mi.BSDFFlags.GlossyReflection)
    fault = "eval_pdf returns the density of the matte lobe alone, where pdf returns that of the mixture"
    cause = "eval_pdf omits the glossy lobe's density"

    def setup(self, props):
        self.kd = props.get_texture("diffuse_reflectance", 0.4)
        self.ks = props.get_texture("specular_reflectance", 0.4)
        self.p = mi.Float(props.get("exponent", 60.0))

    def traverse(self, cb):
        cb.put("diffuse_reflectance", self.kd, mi.ParamFlags.Differentiable)
        cb.put("specular_reflectance", self.ks, mi.ParamFlags.Differentiable)
        cb.put("exponent", self.p, mi.ParamFlags.Differentiable)

    def value(self, k, si, wi, wo):
        if k == 0:
            return _cosine_value(self.kd.eval(si), wi, wo)
        m = _half(wi, wo)
        lobe = (self.p + 2.0) * (0.5 * INV_PI) * _power(m.z, self.p) * _groove(wi, wo, m)
        return self.ks.eval(si) * dr.select(_up(wi, wo), lobe / (4.0 * dr.maximum(wi.z, 1e-6)), 0.0)

    def density(self, k, si, wi, wo):
        if k == 0:
            return _cosine_density(wi, wo)
        m = _half(wi, wo)
        lobe = (self.p + 1.0) * (0.5 * INV_PI) * _power(m.z, self.p) / (4.0 * dr.maximum(dr.dot(wo, m), 1e-6))
        return dr.select(_up(wi, wo), lobe, 0.0)

    def draw(self, k, si, wi, s):
        if k == 0:
            return mi.warp.square_to_cosine_hemisphere(s)
        return mi.reflect(wi, mi.Normal3f(_power_draw(s, self.p)))

    def eval_pdf(self, ctx, si, wo, active=True):
        kept = self.enabled(ctx)
        matte = self.mixed(si, wo, [0]) if 0 in kept else self.mixed(si, wo, kept)
        share = 0.5 if len(kept) == 2 else 1.0
        return self.eval(ctx, si, wo, active), dr.select(active, share * matte, 0.0)


# --------------------------------------------------------------------------- 5


class GlassTypes(mi.BSDF):
    """Smooth clear glass."""

    fault = (
        "sampled_type and sampled_component of a refracted sample are those of the reflection, although wo lies on the other "
        "side; directions, weights and eta are right"
    )
    cause = "refracted sample labelled as delta reflection"

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.eta = mi.Float(props.get("eta", 1.5))
        both = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        one, two = (
            mi.BSDFFlags.DeltaReflection | both,
            mi.BSDFFlags.DeltaTransmission | both | mi.BSDFFlags.NonSymmetric,
        )
        self.m_components = [one, two]
        self.m_flags = one | two

    def traverse(self, cb):
        cb.put("eta", self.eta, mi.ParamFlags.Differentiable)

    def eval(self, ctx, si, wo, active=True):
        return mi.Color3f(0.0)

    def pdf(self, ctx, si, wo, active=True):
        return mi.Float(0.0)

    def sample(self, ctx, si, sample1, sample2, active=True):
        has_r = ctx.is_enabled(mi.BSDFFlags.DeltaReflection, 0)
        has_t = ctx.is_enabled(mi.BSDFFlags.DeltaTransmission, 1)
        bs = dr.zeros(mi.BSDFSample3f)
        if not (has_r or has_t):
            return bs, mi.Color3f(0.0)
        R, cos_t, eta_it, eta_ti = mi.fresnel(si.wi.z, self.eta)
        if has_r and has_t:
            reflects, probability = sample1 <= R, dr.select(sample1 <= R, R, 1.0 - R)
            weight = mi.Color3f(1.0)
        else:
            reflects, probability = mi.Bool(has_r), mi.Float(1.0)
            weight = mi.Color3f(R if has_r else 1.0 - R)
        through = mi.Vector3f(-si.wi.x * eta_ti, -si.wi.y * eta_ti, cos_t)
        bs.wo = dr.select(reflects, _mirror(si.wi), through)
        bs.eta = dr.select(reflects, 1.0, eta_it)
        bs.pdf = dr.select(active, probability, 0.0)
        bs.sampled_component = mi.UInt32(0)
        bs.sampled_type = mi.UInt32(int(mi.BSDFFlags.DeltaReflection))
        if ctx.mode == mi.TransportMode.Radiance:
            weight = weight * dr.select(reflects, 1.0, dr.square(eta_ti))
        return bs, dr.select(active, weight, 0.0)

    def to_string(self):
        return type(self).__name__


# --------------------------------------------------------------------------- 6


class PaneComponent(mi.BSDF):
    """A thin window pane; 2 R / (1 + R) is reflected, the rest goes straight on."""

    fault = (
        "asked for one component alone, sample returns weight 1 as in the mixture instead of R' or 1 - R': the two "
        "components' light adds up to twice the whole"
    )
    cause = "single component's weight lacks its reflectance"

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.eta = mi.Float(props.get("eta", 1.5))
        both = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        one, two = mi.BSDFFlags.DeltaReflection | both, mi.BSDFFlags.Null | both
        self.m_components = [one, two]
        self.m_flags = one | two

    def traverse(self, cb):
        cb.put("eta", self.eta, mi.ParamFlags.Differentiable)

    def eval(self, ctx, si, wo, active=True):
        return mi.Color3f(0.0)

    def pdf(self, ctx, si, wo, active=True):
        return mi.Float(0.0)

    def _both(self, si):
        R = mi.fresnel(dr.abs(si.wi.z), self.eta)[0]
        return 2.0 * R / (1.0 + R)

    def sample(self, ctx, si, sample1, sample2, active=True):
        has_r = ctx.is_enabled(mi.BSDFFlags.DeltaReflection, 0)
        has_t = ctx.is_enabled(mi.BSDFFlags.Null, 1)
        bs = dr.zeros(mi.BSDFSample3f)
        if not (has_r or has_t):
            return bs, mi.Color3f(0.0)
        R = self._both(si)
        if has_r and has_t:
            reflects = sample1 <= R
            probability = dr.select(reflects, R, 1.0 - R)
        else:
            reflects, probability = mi.Bool(has_r), mi.Float(1.0)
        bs.wo = dr.select(reflects, _mirror(si.wi), -si.wi)
        bs.eta, bs.pdf = mi.Float(1.0), dr.select(active, probability, 0.0)
        bs.sampled_component = dr.select(reflects, mi.UInt32(0), mi.UInt32(1))
        bs.sampled_type = dr.select(
            reflects, mi.UInt32(int(mi.BSDFFlags.DeltaReflection)), mi.UInt32(int(mi.BSDFFlags.Null))
        )
        return bs, dr.select(active, mi.Color3f(1.0), 0.0)

    def eval_null_transmission(self, si, active=True):
        return dr.select(active, mi.Color3f(1.0 - self._both(si)), 0.0)

    def to_string(self):
        return type(self).__name__


# --------------------------------------------------------------------------- 7


class _Leaf(_Lobes):
    LOBES = (mi.BSDFFlags.DiffuseReflection, mi.BSDFFlags.DiffuseTransmission)
    SIDES = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide

    def setup(self, props):
        self.r = props.get_texture("reflectance", 0.5)
        self.t = props.get_texture("transmittance", 0.3)

    def traverse(self, cb):
        cb.put("reflectance", self.r, mi.ParamFlags.Differentiable)
        cb.put("transmittance", self.t, mi.ParamFlags.Differentiable)

    def value(self, k, si, wi, wo):
        there = (wi.z * wo.z > 0.0) if k == 0 else (wi.z * wo.z < 0.0)
        return (self.t if k else self.r).eval(si) * dr.select(there, dr.abs(wo.z) * INV_PI, 0.0)

    def density(self, k, si, wi, wo):
        there = (wi.z * wo.z > 0.0) if k == 0 else (wi.z * wo.z < 0.0)
        return dr.select(there, dr.abs(wo.z) * INV_PI, 0.0)

    def draw(self, k, si, wi, s):
        w = mi.warp.square_to_cosine_hemisphere(s)
        return mi.Vector3f(w.x, w.y, dr.select((wi.z > 0.0) ^ (k == 1), w.z, -w.z))


class LeafMask(_Leaf):
    """A leaf that reflects and transmits diffusely."""

    fault = (
        "eval looks at ctx.component but not at ctx.type_mask: asked for reflection only it still returns what is "
        "transmitted, which pdf and sample leave out"
    )
    cause = "eval ignores the context's type mask"

    def eval(self, ctx, si, wo, active=True):
        total = mi.Color3f(0.0)
        every = 0xFFFFFFFF
        for k in (0, 1):
            if ctx.component in (every, k):
                total += self.value(k, si, si.wi, wo)
        return dr.select(active, total, 0.0)


# --------------------------------------------------------------------------- 8


class TwoSidedSheet(_Phong):
    """Painted paper, matte with a Phong highlight on both sides."""

    SIDES = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
    fault = (
        "from below, sample and pdf mirror both directions to the front, but eval mirrors the viewer's only, so its value is "
        "0 for light from the viewer's side and positive for light from the other side"
    )
    cause = "eval does not flip wo from below"

    def eval(self, ctx, si, wo, active=True):
        total = mi.Color3f(0.0)
        for k in self.enabled(ctx):
            total += self.value(k, si, _side(si.wi, si.wi), wo)
        return dr.select(active, total, 0.0)

    def density(self, k, si, wi, wo):
        return _Phong.density(self, k, si, _side(wi, wi), _side(wo, wi))

    def draw(self, k, si, wi, s):
        return _side(_Phong.draw(self, k, si, _side(wi, wi), s), wi)


# --------------------------------------------------------------------------- 9


class OrenNayarViewer(_Lobes):
    """Oren and Nayar's rough matte, in the qualitative form."""

    fault = (
        "tan(beta) is always that of the viewer's angle instead of the smaller of both angles: f is not reciprocal, and "
        "grows without bound for a grazing viewer"
    )
    cause = "beta is the viewer's angle always"

    def setup(self, props):
        self.reflectance = props.get_texture("reflectance", 0.6)
        self.sigma = mi.Float(props.get("sigma", 0.4))

    def traverse(self, cb):
        cb.put("reflectance", self.reflectance, mi.ParamFlags.Differentiable)
        cb.put("sigma", self.sigma, mi.ParamFlags.Differentiable)

    def value(self, k, si, wi, wo):
        s2 = dr.square(self.sigma)
        A, B = 1.0 - 0.5 * s2 / (s2 + 0.33), 0.45 * s2 / (s2 + 0.09)
        s = wi.x * wo.x + wi.y * wo.y  # sin sin cos(phi)
        shape = A + B * dr.maximum(s, 0.0) / dr.maximum(wi.z, 1e-4)
        return self.reflectance.eval(si) * shape * dr.select(_up(wi, wo), wo.z * INV_PI, 0.0)

    def density(self, k, si, wi, wo):
        return _cosine_density(wi, wo)

    def draw(self, k, si, wi, s):
        return mi.warp.square_to_cosine_hemisphere(s)


# --------------------------------------------------------------------------- 10


class BeckmannTexturedWidth(_Lobes):
    """Beckmann's metal in v-grooves, with a texture for its width."""

    LOBES = (mi.BSDFFlags.GlossyReflection,)
    fault = (
        "sample and eval read alpha from the texture at si.uv, pdf takes the texture's mean: wrong wherever the texture "
        "differs from its mean (the default is a checkerboard of 0.1 and 0.4)"
    )
    cause = "pdf uses the mean of alpha texture"

    def setup(self, props):
        given = props.has_property("alpha")
        board = {
            "type": "checkerboard",
            "color0": {"type": "rgb", "value": 0.1},
            "color1": {"type": "rgb", "value": 0.4},
        }
        self.alpha = props.get_texture("alpha") if given else mi.load_dict(board)
        self.r0 = props.get_texture("specular_reflectance", 0.7)

    def traverse(self, cb):
        cb.put("alpha", self.alpha, mi.ParamFlags.Differentiable)
        cb.put("specular_reflectance", self.r0, mi.ParamFlags.Differentiable)

    def _width(self, si):
        return dr.clip(self.alpha.eval(si).x, 0.02, 1.0)

    def value(self, k, si, wi, wo):
        m, a = _half(wi, wo), self._width(si)
        lobe = _beckmann(m, a, a) * _groove(wi, wo, m) / (4.0 * dr.maximum(wi.z, 1e-6))
        return _schlick(self.r0.eval(si), dr.dot(wo, m)) * dr.select(_up(wi, wo), lobe, 0.0)

    def density(self, k, si, wi, wo):
        m, a = _half(wi, wo), dr.clip(mi.Float(self.alpha.mean()), 0.02, 1.0)
        lobe = _beckmann(m, a, a) * m.z / (4.0 * dr.maximum(dr.dot(wo, m), 1e-6))
        return dr.select(_up(wi, wo), lobe, 0.0)

    def draw(self, k, si, wi, s):
        a = self._width(si)
        return mi.reflect(wi, mi.Normal3f(_beckmann_draw(s, a, a)))


# --------------------------------------------------------------------------- 11


class StalePlastic(_Lobes):
    """A matte base and GGX facets; the share of the facets follows their strength."""

    LOBES = (mi.BSDFFlags.DiffuseReflection, mi.BSDFFlags.GlossyReflection)
    fault = (
        "the share by which sample chooses a lobe is computed in the constructor and not updated in parameters_changed, while "
        "pdf computes it anew: after a change of 'specular' by traverse they differ"
    )
    cause = "cached lobe share not updated after traverse"

    def setup(self, props):
        self.kd = props.get_texture("diffuse_reflectance", 0.5)
        self.specular = mi.Float(props.get("specular", 0.2))
        self.alpha = mi.Float(props.get("alpha", 0.25))
        self.cached = self._share()

    def traverse(self, cb):
        cb.put("diffuse_reflectance", self.kd, mi.ParamFlags.Differentiable)
        cb.put("specular", self.specular, mi.ParamFlags.Differentiable)
        cb.put("alpha", self.alpha, mi.ParamFlags.Differentiable)

    def parameters_changed(self, keys=[]):
        pass

    def _share(self):
        return mi.Float(self.specular / (self.specular + 0.5))

    def shares(self, si):
        q = self._share()
        return [1.0 - q, q]

    def pick(self, si, kept):
        return [1.0 - self.cached, mi.Float(1.0)] if len(kept) == 2 else [mi.Float(1.0)]

    def value(self, k, si, wi, wo):
        if k == 0:
            return (1.0 - self.specular) * _cosine_value(self.kd.eval(si), wi, wo)
        m = _half(wi, wo)
        lobe = _ggx(m, self.alpha, self.alpha) * _groove(wi, wo, m) / (4.0 * dr.maximum(wi.z, 1e-6))
        return mi.Color3f(self.specular * dr.select(_up(wi, wo), lobe, 0.0))

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


PLUGINS = {
    "w3_uv_matte": UvMatte,
    "w3_phong_component": PhongComponent,
    "w3_metal_world_pdf": MetalWorldPdf,
    "w3_blinn_eval_pdf": BlinnEvalPdf,
    "w3_glass_types": GlassTypes,
    "w3_pane_component": PaneComponent,
    "w3_leaf_mask": LeafMask,
    "w3_two_sided_sheet": TwoSidedSheet,
    "w3_oren_nayar_viewer": OrenNayarViewer,
    "w3_beckmann_textured_width": BeckmannTexturedWidth,
    "w3_stale_plastic": StalePlastic,
}
for _name, _cls in PLUGINS.items():
    mi.register_bsdf(_name, lambda props, _cls=_cls: _cls(props))
MUTANTS = list(PLUGINS.values())
