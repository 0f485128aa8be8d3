"""Wrong rough glass, wrong diffuse transmitters and wrong thin sheets."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.optics import frame, fresnel, warp

# ------------------------------------------------------------------ rough glass, one piece wrong


class _Rough(go.Dielectric):
    """Rough glass to go wrong from."""

    alpha: go.Width = go.width(0.3, "width of the microfacet distribution; two for anisotropy")
    kind: ClassVar[str] = "transmitting"


class GlassPdfNoEta2(_Rough):
    """Rough glass whose pdf lacks eta^2 in refraction."""

    fault: ClassVar[str] = "pdf of refraction lacks the eta^2 of the Jacobian, which the sample's own pdf has"
    cause: ClassVar[str] = "eta^2 missing in the Jacobian"

    def pdf(self, wo, wi):
        p = super().pdf(wo, wi)
        return ops.where(wo.z * wi.z > 0.0, p, p / ops.sqr(self._relative_eta(wo)))


class GlassDensityNoEta2(_Rough):
    """Rough glass in which every density lacks eta^2."""

    fault: ClassVar[str] = "pdf and the sample's pdf lack eta^2 in refraction, so weights are eta^2 too large"
    cause: ClassVar[str] = "eta^2 missing in the Jacobian"

    def _density(self, facet, eta):
        return super()._density(facet, 1.0 + 0.0 * eta)


class GlassHalfVectorInverted(_Rough):
    """Rough glass whose refracting normal is along wo + wi / eta."""

    fault: ClassVar[str] = "the normal that refracts is taken along wo + wi / eta instead of wo + eta wi"
    cause: ClassVar[str] = "half vector of refraction with eta inverted"

    def _normal(self, wo, wi, eta):
        return super()._normal(wo, wi, 1.0 / eta)


class GlassNormalForDense(_Rough):
    """Rough glass whose refracting normal assumes that the inside is the denser."""

    eta: go.Number = go.number(0.75, "index inside over index outside", low=0.2, high=5.0)
    fault: ClassVar[str] = "the normal -(wo + eta wi) has the right sign only where eta > 1: a bubble refracts nothing"
    cause: ClassVar[str] = "sign of the half vector where eta < 1"

    def _normal(self, wo, wi, eta):
        same = wo.z * wi.z > 0.0
        h = ops.where(same, wo + wi, -(wo + wi * eta))
        h = h * ops.rsqrt(ops.maximum(ops.dot(h, h), frame.TINY))
        return ops.where(same & (h.z < 0.0), -h, h)


class GlassModesSwapped(_Rough):
    """Rough glass with its modes exchanged."""

    fault: ClassVar[str] = "eval and sample carry eta^2 in radiance as importance should, and the other way round"
    cause: ClassVar[str] = "modes swapped"

    def eval(self, wo, wi, mode="radiance"):
        return super().eval(wo, wi, "importance" if mode == "radiance" else "radiance")

    def sample(self, wo, u, mode="radiance"):
        return super().sample(wo, u, "importance" if mode == "radiance" else "radiance")


class GlassSqueezeAbsolute(_Rough):
    """Rough glass that squares the index inside over outside from both sides."""

    fault: ClassVar[str] = "the Jacobian's eta^2 uses the absolute eta, so from the inside it is eta^4 too large"
    cause: ClassVar[str] = "eta^2 not inverted from the inside"

    def _squeeze(self, reflects, eta):
        return ops.where(reflects, 1.0, ops.sqr(self.eta) + 0.0 * eta)


class GlassFresnelAtNormal(_Rough):
    """Rough glass with F at the surface's normal in eval and pdf."""

    fault: ClassVar[str] = "eval and pdf take F at the surface's normal, sampling takes it at the facet's"
    cause: ClassVar[str] = "F at the normal instead of the half vector"

    def _reflectance_at(self, facet, eta):
        cos = ops.abs(facet.wo.z)
        return self.reflectance(cos, fresnel.cos_transmitted(cos, eta), eta)


class GlassNoTotalReflection(_Rough):
    """Rough glass that reflects nothing where all should be reflected."""

    fault: ClassVar[str] = "F is 0 beyond the critical angle: light that cannot leave is lost"
    cause: ClassVar[str] = "no total internal reflection"

    def reflectance(self, cos_o, cos_t, eta):
        return ops.where(cos_t > 0.0, super().reflectance(cos_o, cos_t, eta), 0.0)


class GlassStretchedChoice(_Rough):
    """Rough glass that scales the number which chooses the lobe."""

    fault: ClassVar[str] = "u1 times .8 chooses the lobe, so reflection comes 1.25 times as often as pdf says"
    cause: ClassVar[str] = "reflection chosen 1.25 times too often"

    def sample(self, wo, u, mode="radiance"):
        return super().sample(wo, ops.vec3(u.x * 0.8, u.y, u.z), mode)


class GlassTintOnlyEval(_Rough):
    """Tinted rough glass whose transmitted samples are clear."""

    albedo: go.Colour = go.spectrum((0.9, 0.6, 0.3), "factor on everything that leaves", low=0.0, high=1.0)
    fault: ClassVar[str] = "the tint is in eval of refraction, not in the weight of refracted samples"
    cause: ClassVar[str] = "albedo missing in the weight of transmission"

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        through = wo.z * s.wi.z < 0.0
        return go.Sample(s.wi, ops.where(through, ops.safe_div(s.weight, self.albedo), s.weight), s.pdf, s.delta, s.eta)


class GlassTurnedTwice(_Rough):
    """Brushed glass whose sampled direction is turned the wrong way."""

    alpha: go.Width = go.width((0.08, 0.4), "width of the microfacet distribution; two for anisotropy")
    rotation: go.Angle = go.angle(0.6, "turn of the axes")
    kind: ClassVar[str] = "anisotropic"
    fault: ClassVar[str] = "sampled directions stay in the turned frame, while weight and pdf are of the untangled ones"
    cause: ClassVar[str] = "rotation not undone"

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        return go.Sample(frame.rotate(s.wi, self.rotation), s.weight, s.pdf, s.delta, s.eta)


class GlassIsotropicPdf(_Rough):
    """Brushed glass whose density knows one width."""

    alpha: go.Width = go.width((0.1, 0.4), "width of the microfacet distribution; two for anisotropy")
    kind: ClassVar[str] = "anisotropic"
    fault: ClassVar[str] = "pdf takes alpha_x for both widths; only an anisotropic surface shows it"
    cause: ClassVar[str] = "alpha_x in place of alpha_y in pdf"

    def _density(self, facet, eta):
        return super()._density(facet._replace(alpha=ops.vec2(facet.alpha.x, facet.alpha.x)), eta)


class GlassReflectionJacobian(_Rough):
    """Rough glass that uses the Jacobian of reflection everywhere."""

    fault: ClassVar[str] = "the density of a refracted direction is that of the normal over 4 (o.m)"
    cause: ClassVar[str] = "Jacobian of reflection in refraction"

    def _density(self, facet, eta):
        return super()._density(facet._replace(spread=0.25 + 0.0 * facet.dot_o), 1.0 + 0.0 * eta)


class GlassNotTransmitting(_Rough):
    """Rough glass that says it transmits nothing."""

    fault: ClassVar[str] = "transmits is declared False, while eval and sample reach the other side"
    cause: ClassVar[str] = "declared fact transmits"

    @property
    def transmits(self):
        return False


class GlassAbsoluteEta(_Rough):
    """Rough glass whose samples say the same eta from both sides."""

    fault: ClassVar[str] = "a transmitted sample's eta is inside over outside, also where it leaves the inside"
    cause: ClassVar[str] = "eta of the sample wrong from the inside"

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        return go.Sample(s.wi, s.weight, s.pdf, s.delta, ops.where(wo.z * s.wi.z < 0.0, self.eta, s.eta))


class GlassReflectionOnlyShare(_Rough):
    """Glass without transmission, which chooses by F all the same."""

    transmission: bool = go.flag(False, "whether refracted light goes on, or is lost")
    fault: ClassVar[str] = "with transmission off, reflection is still chosen with F and weighed with F: F twice"
    cause: ClassVar[str] = "F twice where transmission=False"

    def _share(self, f):
        return f


class GlassWiderInside(_Rough):
    """Rough glass whose lobes are wider seen from the inside."""

    fault: ClassVar[str] = "from the inside eval and pdf use 1.6 alpha: not reciprocal, and not what is sampled"
    cause: ClassVar[str] = "alpha times 1.6 from the inside"

    def _facet(self, wo, wi, eta):
        facet = super()._facet(wo, wi, eta)
        wider = ops.vec2(facet.alpha.x * 1.6, facet.alpha.y * 1.6)
        return facet._replace(alpha=ops.where(wo.z < 0.0, wider, facet.alpha))


class GlassMissingCosine(_Rough):
    """Rough glass whose spread in refraction lacks |i.m|."""

    fault: ClassVar[str] = "dm/dwi of refraction lacks |i.m|, in eval and pdf: f is not reciprocal, pdf no density"
    cause: ClassVar[str] = "|i.m| missing in the Jacobian of refraction"

    def _facet(self, wo, wi, eta):
        facet = super()._facet(wo, wi, eta)
        bare = ops.where(facet.reflects, facet.spread, ops.safe_div(facet.spread, ops.abs(facet.dot_i)))
        return facet._replace(spread=bare)


class GlassTransmittedFresnel(_Rough):
    """Rough glass that crosses its surface twice on the way out."""

    fault: ClassVar[str] = "eval weighs refraction from the inside by (1 - F)^2, as if two faces were crossed"
    cause: ClassVar[str] = "1 - F twice in refraction from the inside"

    def eval(self, wo, wi, mode="radiance"):
        eta = self._relative_eta(wo)
        f = self._reflectance_at(self._facet(wo, wi, eta), eta)
        out = (wo.z < 0.0) & (wi.z > 0.0)
        return super().eval(wo, wi, mode) * ops.where(out, 1.0 - f, 1.0)


# ------------------------------------------------------------------ diffuse transmitters


class _Leaf(go.BSDF):
    """A leaf: reflects and transmits like a matte surface, from both sides."""

    albedo: go.Colour = go.spectrum((0.7, 0.8, 0.4), "share of light that leaves", low=0.0, high=1.0)
    through: go.Number = go.number(0.4, "share of that which passes", low=0.0, high=1.0)
    kind: ClassVar[str] = "transmitting"
    transmits = True

    def split(self, wo, wi):
        return ops.where(wo.z * wi.z > 0.0, 1.0 - self.through, self.through)

    def cosine(self, wo, wi):
        return ops.abs(wi.z)

    def eval(self, wo, wi, mode="radiance"):
        value = self.split(wo, wi) * self.cosine(wo, wi) * ops.inv_pi
        return self.albedo * ops.where(wo.z * wi.z != 0.0, value, 0.0)

    def pdf(self, wo, wi):
        chance = ops.where(wo.z * wi.z > 0.0, 1.0 - self.through, self.through)
        return chance * ops.abs(wi.z) * ops.inv_pi

    def sample_eta(self, wo, wi):
        return 1.0 + 0.0 * wi.z

    def sample(self, wo, u, mode="radiance"):
        w = warp.square_to_cosine_hemisphere(u.y, u.z)
        z = ops.where(u.x < self.through, -w.z, w.z)
        wi = ops.vec3(w.x, w.y, ops.where(wo.z < 0.0, -z, z))
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), self.sample_eta(wo, wi))


class LeafDoublePdf(_Leaf):
    """A leaf whose density forgets the choice of the side."""

    through: go.Number = go.number(0.5, "share of that which passes", low=0.0, high=1.0)
    fault: ClassVar[str] = "pdf is cos / pi on each side: it integrates to 2, and the weight is half of its due"
    cause: ClassVar[str] = "probability of the side (1/2) missing in pdf"

    def pdf(self, wo, wi):
        return ops.abs(wi.z) * ops.inv_pi


class LeafWhiteBoth(_Leaf):
    """A leaf that reflects its albedo and transmits it again."""

    fault: ClassVar[str] = "reflection and transmission both carry the whole albedo: twice the light comes back"
    cause: ClassVar[str] = ""

    def split(self, wo, wi):
        return 1.0 + 0.0 * wi.z


class LeafWrongCosine(_Leaf):
    """A leaf whose transmission is weighed by the viewer's cosine."""

    fault: ClassVar[str] = "transmitted eval has |cos theta_o| in place of |cos theta_i|"
    cause: ClassVar[str] = "cosine of wo in place of wi's in transmission"

    def cosine(self, wo, wi):
        return ops.where(wo.z * wi.z > 0.0, ops.abs(wi.z), ops.abs(wo.z))


class LeafPdfAbove(_Leaf):
    """A leaf whose pdf knows no other side."""

    fault: ClassVar[str] = "pdf is 0 on the other side, where sample goes, with a pdf of its own"
    cause: ClassVar[str] = "transmission missing in pdf"

    def pdf(self, wo, wi):
        return ops.where(wo.z * wi.z > 0.0, (1.0 - self.through) * ops.abs(wi.z) * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        chance = ops.where(wo.z * s.wi.z > 0.0, 1.0 - self.through, self.through)
        pdf = chance * ops.abs(s.wi.z) * ops.inv_pi
        return go.Sample(s.wi, self.eval(wo, s.wi, mode) * ops.safe_div(1.0, pdf), pdf, s.delta, s.eta)


class LeafEta(_Leaf):
    """A leaf in air that claims to lead into glass."""

    fault: ClassVar[str] = "transmitted samples carry eta 1.5, though no radiance factor is in eval: air on both sides"
    cause: ClassVar[str] = "eta of the sample is not 1 for a thin sheet"

    def sample_eta(self, wo, wi):
        return ops.where(wo.z * wi.z < 0.0, 1.5, 1.0 + 0.0 * wi.z)


class LeafOneWay(_Leaf):
    """A leaf that lets light through from above only."""

    fault: ClassVar[str] = "seen from below nothing passes in eval: transmission is not reciprocal"
    cause: ClassVar[str] = "transmission from one side only"

    def split(self, wo, wi):
        return ops.where(wo.z * wi.z > 0.0, 1.0 - self.through, ops.where(wo.z > 0.0, self.through, 0.0 * wo.z))


class LeafFlip(_Leaf):
    """A leaf whose sampled sides are exchanged."""

    through: go.Number = go.number(0.2, "share of that which passes", low=0.0, high=1.0)
    fault: ClassVar[str] = "sample passes with probability 1 - through, pdf says through"
    cause: ClassVar[str] = "sides swapped in sample"

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        wi = ops.vec3(s.wi.x, s.wi.y, -s.wi.z)
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, s.delta, s.eta)


class FrostedSame(go.BSDF):
    """A matte boundary of air and glass: from both sides the same share passes."""

    eta: go.Number = go.number(1.5, "index inside over index outside", low=1.0, high=3.0)
    through: go.Number = go.number(0.6, "share that enters", low=0.0, high=1.0)
    fault: ClassVar[str] = "as much leaves as enters, while reciprocity asks for 1 / eta^2 of that"
    cause: ClassVar[str] = "eta^2 of reciprocity in transmission"
    kind: ClassVar[str] = "transmitting"
    transmits = True

    def _eta(self, wo):
        return ops.where(wo.z > 0.0, self.eta, 1.0 / self.eta)

    def _share(self, wo, wi):
        return ops.where(wo.z * wi.z > 0.0, 1.0 - self.through, self.through)

    def eval(self, wo, wi, mode="radiance"):
        radiance = 1.0 / ops.sqr(self._eta(wo)) if mode == "radiance" else 1.0 + 0.0 * wo.z
        value = self.pdf(wo, wi) * ops.where(wo.z * wi.z > 0.0, 1.0, radiance)
        return ops.vec3(value, value, value)

    def pdf(self, wo, wi):
        return self._share(wo, wi) * ops.abs(wi.z) * ops.inv_pi

    def sample(self, wo, u, mode="radiance"):
        w = warp.square_to_cosine_hemisphere(u.y, u.z)
        z = ops.where(u.x < self.through, -w.z, w.z)
        wi = ops.vec3(w.x, w.y, ops.where(wo.z > 0.0, z, -z))
        pdf = self.pdf(wo, wi)
        through = wo.z * wi.z < 0.0
        eta = ops.where(through, self._eta(wo), 1.0)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), eta)


MUTANTS = [
    GlassPdfNoEta2,
    GlassDensityNoEta2,
    GlassHalfVectorInverted,
    GlassNormalForDense,
    GlassModesSwapped,
    GlassSqueezeAbsolute,
    GlassFresnelAtNormal,
    GlassNoTotalReflection,
    GlassStretchedChoice,
    GlassTintOnlyEval,
    GlassTurnedTwice,
    GlassIsotropicPdf,
    GlassReflectionJacobian,
    GlassNotTransmitting,
    GlassAbsoluteEta,
    GlassReflectionOnlyShare,
    GlassWiderInside,
    GlassMissingCosine,
    GlassTransmittedFresnel,
    LeafDoublePdf,
    LeafWhiteBoth,
    LeafWrongCosine,
    LeafPdfAbove,
    LeafEta,
    LeafOneWay,
    LeafFlip,
    FrostedSame,
]
SOUND = []
