"""Mitsuba plugins: leaves, filters, splitters, a cavity, masks, retroreflectors, twill, ground panes, opal."""

import mitsuba as mi

mi.set_variant("llvm_ad_rgb")

import drjit as dr  # noqa: E402

F = mi.BSDFFlags
BOTH = F.FrontSide | F.BackSide


def _cos(w):
    return mi.Frame3f.cos_theta(w)


class _Lobes(mi.BSDF):
    """A sum of lobes, one a component. A plugin gives, for lobe i:

    kinds          scattering flag and further flags
    chances(si)    raw probabilities, all lobes
    draw(i, ...)   a direction
    value(i, ...)  f |cos| of a density, or a delta lobe's value, in importance or radiance mode
    density(i, ..) of `draw`; not for delta lobes
    """

    kinds = ()

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.m_components = [scatters | more for scatters, more in self.kinds]
        flags = self.m_components[0]
        for one in self.m_components[1:]:
            flags = flags | one
        self.m_flags = flags

    def is_delta(self, i):
        return self.kinds[i][0] in (F.DeltaReflection, F.DeltaTransmission, F.Null)

    def ratio(self, i, si):
        return mi.Float(1.0)

    def density(self, i, si, wo):
        return mi.Float(0.0)

    def _enabled(self, ctx, si):
        """The enabled lobes, each with its probability."""
        on = [i for i, (scatters, _) in enumerate(self.kinds) if ctx.is_enabled(scatters, i)]
        raw = self.chances(si)
        total = mi.Float(0.0)
        for i in on:
            total = total + raw[i]
        some = total > 0.0
        return [(i, dr.select(some, raw[i] / dr.select(some, total, 1.0), 0.0)) for i in on]

    def _sums(self, ctx, si, wo, enabled):
        value, pdf = mi.Color3f(0.0), mi.Float(0.0)
        for i, chance in enabled:
            if not self.is_delta(i):
                value = value + self.value(i, si, wo, ctx.mode)
                pdf = pdf + chance * self.density(i, si, wo)
        return value, pdf

    def eval(self, ctx, si, wo, active=True):
        value, _ = self._sums(ctx, si, wo, self._enabled(ctx, si))
        return dr.select(active, value, 0.0)

    def pdf(self, ctx, si, wo, active=True):
        _, pdf = self._sums(ctx, si, wo, self._enabled(ctx, si))
        return dr.select(active, pdf, 0.0)

    def eval_pdf(self, ctx, si, wo, active=True):
        value, pdf = self._sums(ctx, si, wo, self._enabled(ctx, si))
        return dr.select(active, value, 0.0), dr.select(active, pdf, 0.0)

    def sample(self, ctx, si, sample1, sample2, active=True):
        bs = dr.zeros(mi.BSDFSample3f)
        bs.eta = mi.Float(1.0)
        weight = mi.Color3f(0.0)
        enabled = self._enabled(ctx, si)
        start = mi.Float(0.0)
        for i, chance in enabled:
            mine = active & (sample1 >= start) & (sample1 < start + chance)
            start = start + chance
            wo = self.draw(i, si, sample2)
            if self.is_delta(i):
                good = mine & (chance > 0.0)
                pdf, value = chance, self.value(i, si, wo, ctx.mode)
            else:
                value, pdf = self._sums(ctx, si, wo, enabled)
                good = mine & (self.density(i, si, wo) > 0.0) & (pdf > 0.0)
            bs.wo = dr.select(good, wo, bs.wo)
            bs.pdf = dr.select(good, pdf, bs.pdf)
            bs.eta = dr.select(good, self.ratio(i, si), bs.eta)
            bs.sampled_type = dr.select(good, mi.UInt32(int(self.kinds[i][0])), bs.sampled_type)
            bs.sampled_component = dr.select(good, mi.UInt32(i), bs.sampled_component)
            weight = dr.select(good, value / dr.select(good, pdf, 1.0), weight)
        return bs, weight

    def to_string(self):
        return f"{type(self).__name__}[]"


def _mirror(w):
    return mi.Vector3f(-w.x, -w.y, w.z)


def _hemisphere(si, sample2, across):
    """A cosine-distributed direction on the side of si.wi, or on the other."""
    w = mi.warp.square_to_cosine_hemisphere(sample2)
    z = dr.select((_cos(si.wi) >= 0.0) != across, w.z, -w.z)
    return mi.Vector3f(w.x, w.y, z)


def _flat(si, wo, across):
    """|cos| / pi on the side of si.wi, or on the other."""
    product = _cos(si.wi) * _cos(wo)
    return dr.select(product < 0.0 if across else product > 0.0, dr.abs(_cos(wo)) * dr.inv_pi, 0.0)


def _colour(parts):
    return mi.Color3f(*parts)


class R2Foliage(_Lobes):
    """A leaf: matte with other colors from above and from below, and matte transmission."""

    kinds = ((F.DiffuseReflection, F.FrontSide), (F.DiffuseReflection, F.BackSide), (F.DiffuseTransmission, BOTH))

    def __init__(self, props):
        super().__init__(props)
        self.colours = (0.05, 0.3, 0.02), (0.3, 0.45, 0.2), (0.2, 0.5, 0.1)

    def chances(self, si):
        cos = _cos(si.wi)
        front, back, through = (sum(colour) / 3.0 for colour in self.colours)
        return [dr.select(cos > 0.0, front, 0.0), dr.select(cos < 0.0, back, 0.0), dr.select(cos != 0.0, through, 0.0)]

    def draw(self, i, si, sample2):
        return _hemisphere(si, sample2, i == 2)

    def density(self, i, si, wo):
        cos = _cos(si.wi)
        here = [cos > 0.0, cos < 0.0, cos != 0.0][i]
        return dr.select(here, _flat(si, wo, i == 2), 0.0)

    def value(self, i, si, wo, mode):
        return _colour(self.colours[i]) * self.density(i, si, wo)


class R2Gel(_Lobes):
    """A colored filter without a surface: exp(-depth / |cos|) passes."""

    kinds = ((F.Null, BOTH),)

    def __init__(self, props):
        super().__init__(props)
        self.depth = (0.02, 0.7, 3.0)

    def chances(self, si):
        return [mi.Float(1.0) + 0.0 * _cos(si.wi)]

    def draw(self, i, si, sample2):
        return -si.wi

    def value(self, i, si, wo, mode):
        return dr.exp(-_colour(self.depth) / dr.maximum(dr.abs(_cos(si.wi)), 1e-4))

    def eval_null_transmission(self, si, active=True):
        return dr.select(active, self.value(0, si, None, None), 0.0)


class R2Splitter(_Lobes):
    """A beam splitter: part of the light is mirrored, part passes straight through, and the rest is absorbed."""

    kinds = ((F.DeltaReflection, BOTH), (F.Null, BOTH))

    def __init__(self, props):
        super().__init__(props)
        self.mirrored, self.passed = (0.9, 0.3, 0.0), (0.05, 0.6, 1.0)

    def chances(self, si):
        zero = 0.0 * _cos(si.wi)
        return [sum(self.mirrored) / 3.0 + zero, sum(self.passed) / 3.0 + zero]

    def draw(self, i, si, sample2):
        return -si.wi if i else _mirror(si.wi)

    def value(self, i, si, wo, mode):
        return _colour(self.passed if i else self.mirrored)

    def eval_null_transmission(self, si, active=True):
        return dr.select(active, _colour(self.passed), 0.0)


class R2Cavity(_Lobes):
    """A smooth cavity in a denser medium: glass with an index below 1."""

    kinds = ((F.DeltaReflection, BOTH), (F.DeltaTransmission, BOTH | F.NonSymmetric))

    def __init__(self, props):
        super().__init__(props)
        self.index = float(props.get("index", 0.7))

    def _fresnel(self, si):
        return mi.fresnel(_cos(si.wi), self.index)

    def chances(self, si):
        r = self._fresnel(si)[0]
        return [r, 1.0 - r]

    def ratio(self, i, si):
        return self._fresnel(si)[2] if i else mi.Float(1.0)

    def draw(self, i, si, sample2):
        _, cos_t, _, eta_ti = self._fresnel(si)
        return mi.refract(si.wi, cos_t, eta_ti) if i else _mirror(si.wi)

    def value(self, i, si, wo, mode):
        r, _, _, eta_ti = self._fresnel(si)
        if i == 0:
            return mi.Color3f(r)
        return mi.Color3f((1.0 - r) * dr.square(eta_ti) if mode == mi.TransportMode.Radiance else 1.0 - r)


class R2Mesh(_Lobes):
    """A matte net, the same on both sides, with holes."""

    kinds = ((F.DiffuseReflection, BOTH), (F.Null, BOTH))

    def __init__(self, props):
        super().__init__(props)
        self.opacity, self.colour = float(props.get("opacity", 0.6)), (0.9, 0.0, 0.4)

    def chances(self, si):
        zero = 0.0 * _cos(si.wi)
        return [self.opacity + zero, 1.0 - self.opacity + zero]

    def draw(self, i, si, sample2):
        return -si.wi if i else _hemisphere(si, sample2, False)

    def density(self, i, si, wo):
        return _flat(si, wo, False)

    def value(self, i, si, wo, mode):
        return mi.Color3f(1.0 - self.opacity) if i else _colour(self.colour) * self.opacity * _flat(si, wo, False)

    def eval_null_transmission(self, si, active=True):
        return dr.select(active, mi.Color3f(1.0 - self.opacity), 0.0)


class R2Beacon(_Lobes):
    """A blurred retroreflector, from above: f = k (n + 1) / (2 pi) (wi.wo)^n."""

    kinds = ((F.GlossyReflection, F.FrontSide),)

    def __init__(self, props):
        super().__init__(props)
        self.n, self.k = float(props.get("exponent", 30.0)), (0.9, 0.5, 0.1)

    def chances(self, si):
        return [dr.select(_cos(si.wi) > 0.0, mi.Float(1.0), 0.0)]

    def draw(self, i, si, sample2):
        z = dr.power(1.0 - sample2.x, 1.0 / (self.n + 1.0))
        r = dr.safe_sqrt(1.0 - dr.square(z))
        s, c = dr.sincos(2.0 * dr.pi * sample2.y)
        return mi.Frame3f(si.wi).to_world(mi.Vector3f(r * c, r * s, z))

    def density(self, i, si, wo):
        cos = dr.maximum(dr.dot(si.wi, wo), 0.0)
        up = (_cos(si.wi) > 0.0) & (_cos(wo) > 0.0) & (cos > 0.0)
        return dr.select(up, (self.n + 1.0) * (0.5 * dr.inv_pi) * dr.power(cos, self.n), 0.0)

    def value(self, i, si, wo, mode):
        return _colour(self.k) * self.density(0, si, wo) * dr.abs(_cos(wo))


class R2Serge(_Lobes):
    """Serge, the same on both sides: matte, with an anisotropy that shifts light between azimuths and loses none."""

    kinds = ((F.DiffuseReflection, BOTH | F.Anisotropic),)

    def __init__(self, props):
        super().__init__(props)
        self.weave, self.colour = float(props.get("weave", 0.8)), (0.1, 0.2, 0.8)

    def chances(self, si):
        return [dr.select(_cos(si.wi) != 0.0, mi.Float(1.0), 0.0)]

    def draw(self, i, si, sample2):
        return _hemisphere(si, sample2, False)

    def density(self, i, si, wo):
        return _flat(si, wo, False)

    def value(self, i, si, wo, mode):
        a, b = si.wi, wo
        shift = (dr.square(a.x) - dr.square(a.y)) * (dr.square(b.x) - dr.square(b.y))
        return _colour(self.colour) * (dr.maximum(1.0 + self.weave * shift, 0.0) * _flat(si, wo, False))


class R2MattedPane(_Lobes):
    """A thin pane with a rough face: facets mirror light, or let it pass as if mirrored to the other side."""

    kinds = ((F.GlossyReflection, BOTH), (F.GlossyTransmission, BOTH))

    def __init__(self, props):
        super().__init__(props)
        self.alpha, self.index = float(props.get("alpha", 0.3)), float(props.get("index", 1.5))
        self.colour = (0.7, 0.9, 1.0)

    def _facets(self):
        return mi.MicrofacetDistribution(mi.MicrofacetType.GGX, self.alpha, True)

    def _reflected(self, cos):
        r = mi.fresnel(dr.abs(cos), self.index)[0]
        return 2.0 * r / (1.0 + r)

    def chances(self, si):
        r = dr.clip(self._reflected(_cos(si.wi)), 0.1, 0.9)
        some = _cos(si.wi) != 0.0
        return [dr.select(some, r, 0.0), dr.select(some, 1.0 - r, 0.0)]

    def _up(self, w):
        return mi.Vector3f(w.x, w.y, dr.abs(w.z))

    def draw(self, i, si, sample2):
        up = self._up(si.wi)
        m, _ = self._facets().sample(up, sample2)
        wo = mi.reflect(up, m)
        # a direction below the horizon is put where no lobe has a density
        side = dr.select((_cos(si.wi) >= 0.0) != (i == 1), 1.0, -1.0)
        return mi.Vector3f(wo.x, wo.y, wo.z * side)

    def _pair(self, i, si, wo):
        """(valid, both directions above, half vector) of a pair that lobe i joins."""
        sides = _cos(si.wi) * _cos(wo)
        a, b = self._up(si.wi), self._up(wo)
        return (sides < 0.0 if i else sides > 0.0), a, b, dr.normalize(a + b)

    def density(self, i, si, wo):
        valid, a, _, m = self._pair(i, si, wo)
        return dr.select(valid, self._facets().pdf(a, m) / (4.0 * dr.maximum(dr.dot(a, m), 1e-6)), 0.0)

    def value(self, i, si, wo, mode):
        valid, a, b, m = self._pair(i, si, wo)
        facets = self._facets()
        r = self._reflected(dr.dot(a, m))
        value = (1.0 - r if i else r) * facets.eval(m) * facets.G(a, b, m) / (4.0 * dr.maximum(a.z, 1e-6))
        return _colour(self.colour) * dr.select(valid, value, 0.0)


class R2Janus(_Lobes):
    """Opaque: a mirror above, matte below."""

    kinds = ((F.DeltaReflection, F.FrontSide), (F.DiffuseReflection, F.BackSide))

    def __init__(self, props):
        super().__init__(props)
        self.gold, self.red = (1.0, 0.8, 0.3), (1.0, 0.0, 0.0)

    def chances(self, si):
        cos = _cos(si.wi)
        return [dr.select(cos > 0.0, mi.Float(1.0), 0.0), dr.select(cos < 0.0, mi.Float(1.0), 0.0)]

    def draw(self, i, si, sample2):
        return _hemisphere(si, sample2, False) if i else _mirror(si.wi)

    def density(self, i, si, wo):
        return dr.select(_cos(si.wi) < 0.0, _flat(si, wo, False), 0.0)

    def value(self, i, si, wo, mode):
        return _colour(self.red) * self.density(1, si, wo) if i else _colour(self.gold)


class R2OpalBlock(_Lobes):
    """The matte face of a dense block: light crosses it by a cosine law, and radiance is scaled as at any interface."""

    kinds = ((F.DiffuseReflection, BOTH), (F.DiffuseTransmission, BOTH | F.NonSymmetric))

    def __init__(self, props):
        super().__init__(props)
        self.index, self.enters = float(props.get("index", 1.4)), float(props.get("enters", 0.8))
        self.colour = (0.95, 0.9, 0.8)

    def ratio(self, i, si):
        return dr.select(_cos(si.wi) >= 0.0, self.index, 1.0 / self.index) if i else mi.Float(1.0)

    def _crossing(self, si):
        return self.enters * dr.minimum(dr.square(self.ratio(1, si)), 1.0)

    def chances(self, si):
        some = _cos(si.wi) != 0.0
        crossing = self._crossing(si)
        return [dr.select(some, 1.0 - crossing, 0.0), dr.select(some, crossing, 0.0)]

    def draw(self, i, si, sample2):
        return _hemisphere(si, sample2, i == 1)

    def density(self, i, si, wo):
        return _flat(si, wo, i == 1)

    def value(self, i, si, wo, mode):
        crossing = self._crossing(si)
        share = crossing if i else 1.0 - crossing
        if i and mode == mi.TransportMode.Radiance:
            share = share / dr.square(self.ratio(1, si))
        return _colour(self.colour) * (share * _flat(si, wo, i == 1))


PLUGINS = {
    "r2-foliage": R2Foliage,
    "r2-gel": R2Gel,
    "r2-splitter": R2Splitter,
    "r2-cavity": R2Cavity,
    "r2-mesh": R2Mesh,
    "r2-beacon": R2Beacon,
    "r2-serge": R2Serge,
    "r2-matted-pane": R2MattedPane,
    "r2-janus": R2Janus,
    "r2-opal-block": R2OpalBlock,
}
mi.register_bsdf("r2-foliage", lambda props: R2Foliage(props))
mi.register_bsdf("r2-gel", lambda props: R2Gel(props))
mi.register_bsdf("r2-splitter", lambda props: R2Splitter(props))
mi.register_bsdf("r2-cavity", lambda props: R2Cavity(props))
mi.register_bsdf("r2-mesh", lambda props: R2Mesh(props))
mi.register_bsdf("r2-beacon", lambda props: R2Beacon(props))
mi.register_bsdf("r2-serge", lambda props: R2Serge(props))
mi.register_bsdf("r2-matted-pane", lambda props: R2MattedPane(props))
mi.register_bsdf("r2-janus", lambda props: R2Janus(props))
mi.register_bsdf("r2-opal-block", lambda props: R2OpalBlock(props))

SOUND = [R2Foliage, R2Gel, R2Splitter, R2Cavity, R2Mesh, R2Beacon, R2Serge, R2MattedPane, R2Janus, R2OpalBlock]
MUTANTS = []
