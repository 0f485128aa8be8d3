"""Wrong mirrors, wrong smooth glass, wrong thin slabs, and wrong mixtures of a delta with a smooth part."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.optics import frame, fresnel, warp

# ------------------------------------------------------------------ mirrors


class SquaredMirror(go.Mirror):
    """A tinted mirror whose tint is multiplied in twice."""

    albedo: go.Colour = go.spectrum((0.8, 0.5, 0.3), "share of light that is reflected", low=0.0, high=1.0)
    fault: ClassVar[str] = "the weight is albedo^2, while the known albedo and the parameter's meaning say albedo"
    cause: ClassVar[str] = "albedo twice in the weight"
    kind: ClassVar[str] = "delta"

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        return go.Sample(s.wi, s.weight * self.albedo, s.pdf, s.delta, s.eta)


class MirrorWithDensity(go.Mirror):
    """A mirror whose pdf answers with the discrete probability."""

    fault: ClassVar[str] = "pdf is 1 for every pair above the surface, where a delta lobe has no density"
    cause: ClassVar[str] = "pdf of a delta lobe is 1 instead of 0"
    kind: ClassVar[str] = "delta"

    def pdf(self, wo, wi):
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), 1.0 + 0.0 * wo.z, 0.0)


class MirrorNotDelta(go.Mirror):
    """A mirror that forgets to say that its sample is a delta's."""

    fault: ClassVar[str] = "samples of a perfect mirror carry delta = False with pdf 1, as if that were a density"
    cause: ClassVar[str] = "delta flag of the sample"
    kind: ClassVar[str] = "delta"

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        return go.Sample(s.wi, s.weight, s.pdf, go.never(s.pdf), s.eta)


class MirrorFromBehind(go.Mirror):
    """A mirror that reflects on its back too, though it is not declared two-sided."""

    fault: ClassVar[str] = "from below the surface it reflects everything, though it neither transmits nor is two-sided"
    cause: ClassVar[str] = "side of wo not tested"
    kind: ClassVar[str] = "delta"

    def sample(self, wo, u, mode="radiance"):
        one = 1.0 + 0.0 * wo.z
        return go.Sample(frame.mirror(wo), self.albedo * one, one, ~go.never(one), one)


class MirrorDeclaredNever(go.Mirror):
    """A mirror that declares no delta lobe."""

    fault: ClassVar[str] = "delta is declared 'never', while every sample is a delta's"
    cause: ClassVar[str] = "declared fact delta"
    kind: ClassVar[str] = "delta"

    @property
    def delta(self):
        return "never"


class MirrorInEval(go.Mirror):
    """A mirror that answers in eval too where the directions match."""

    fault: ClassVar[str] = "eval is albedo (not 0) where wi is the mirrored wo within a thousandth"
    cause: ClassVar[str] = "eval of a delta lobe is not 0"
    kind: ClassVar[str] = "delta"

    def eval(self, wo, wi, mode="radiance"):
        match = (ops.dot(frame.mirror(wo), wi) > 1.0 - 1e-6) & (wo.z > 0.0)
        return self.albedo * ops.where(match, 1.0 + 0.0 * wo.z, 0.0)


class TangentMirror(go.Mirror):
    """A mirror that turns x only."""

    fault: ClassVar[str] = "wi = (-x, y, z): one tangent axis only is turned: no mirror, and not isotropic as declared"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "delta"

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        return go.Sample(ops.vec3(-wo.x, wo.y, wo.z), s.weight, s.pdf, s.delta, s.eta)


class HalfSilverChannel(go.BSDF):
    """A half-silvered sheet: reflects a colour, lets the rest straight through."""

    silver: go.Colour = go.spectrum((0.7, 0.4, 0.2), "reflectance", low=0.0, high=0.999)
    fault: ClassVar[str] = "what is let through is 1 - mean(silver) in every channel: red gains, blue loses"
    cause: ClassVar[str] = "mean in place of the channel in transmission"
    kind: ClassVar[str] = "delta"
    transmits = True
    delta = "always"

    def eval(self, wo, wi, mode="radiance"):
        return self.silver * (0.0 * wo.z)

    def pdf(self, wo, wi):
        return 0.0 * wo.z

    def sample(self, wo, u, mode="radiance"):
        share = ops.clamp(ops.mean(self.silver), 0.05, 0.95)
        reflects = u.x < share
        chance = ops.where(reflects, share, 1.0 - share)
        one = 1.0 + 0.0 * wo.z
        rest = 0.0 * self.silver + (1.0 - ops.mean(self.silver)) * one
        weight = ops.where(reflects, self.silver * one, rest) / chance
        pdf = chance * one
        return go.Sample(ops.where(reflects, frame.mirror(wo), -wo), weight, pdf, ~go.never(pdf), one)


# ------------------------------------------------------------------ smooth glass, in pieces


class _SmoothGlass(go.BSDF):
    """Smooth glass whose pieces are methods."""

    eta: go.Number = go.number(1.5, "index inside over index outside", low=0.2, high=5.0)
    albedo: go.Colour = go.spectrum(1.0, "factor on all that leaves", low=0.0, high=1.0)
    kind: ClassVar[str] = "delta"
    transmits = True
    delta = "always"

    def relative(self, wo):
        return ops.where(wo.z >= 0.0, self.eta, 1.0 / self.eta)

    def reflectance(self, cos_o, cos_t, eta):
        return fresnel.kind("exact").dielectric(cos_o, cos_t, eta)

    def share(self, f):
        return f

    def refracted(self, wo, cos_t, eta):
        return ops.vec3(-wo.x / eta, -wo.y / eta, ops.where(wo.z >= 0.0, -cos_t, cos_t))

    def radiance(self, eta, mode):
        return 1.0 / ops.sqr(eta) if mode == "radiance" else 1.0 + 0.0 * eta

    def tinted(self, wo, reflects):
        return self.albedo * (1.0 + 0.0 * wo.z)

    def over_chance(self, power, chance):
        return ops.safe_div(power, chance)

    def probability(self, chance, f, reflects):
        return chance

    def sample_eta(self, reflects, eta):
        return ops.where(reflects, 1.0, eta)

    def eval(self, wo, wi, mode="radiance"):
        return self.albedo * (0.0 * wo.z)

    def pdf(self, wo, wi):
        return 0.0 * wo.z

    def sample(self, wo, u, mode="radiance"):
        eta = self.relative(wo)
        cos_o = ops.abs(wo.z)
        cos_t = fresnel.cos_transmitted(cos_o, eta)
        f = self.reflectance(cos_o, cos_t, eta)
        share = self.share(f)
        reflects = u.x < share
        wi = ops.where(reflects, frame.mirror(wo), self.refracted(wo, cos_t, eta))
        chance = ops.where(reflects, share, 1.0 - share)
        power = ops.where(reflects, f, (1.0 - f) * self.radiance(eta, mode))
        weight = self.tinted(wo, reflects) * self.over_chance(power, chance)
        pdf = self.probability(chance, f, reflects)
        return go.Sample(wi, weight, pdf, ~go.never(pdf), self.sample_eta(reflects, eta))


class GlassUnitProbability(_SmoothGlass):
    """Smooth glass that gives every delta sample the pdf 1."""

    fault: ClassVar[str] = "the pdf of both delta samples is 1, not the probability of the lobe chosen"
    cause: ClassVar[str] = "pdf 1 in place of F or 1 - F"

    def probability(self, chance, f, reflects):
        return 1.0 + 0.0 * chance


class GlassHalfLost(_SmoothGlass):
    """Smooth glass that tosses a fair coin and does not divide by it."""

    fault: ClassVar[str] = "each lobe is chosen with 1/2, the weight is F or 1 - F undivided: half the light is lost"
    cause: ClassVar[str] = "weight without 1 / probability of the lobe (factor 1/2)"

    def share(self, f):
        return 0.5 + 0.0 * f

    def over_chance(self, power, chance):
        return power


class GlassRadianceInverted(_SmoothGlass):
    """Smooth glass with the radiance factor upside down."""

    fault: ClassVar[str] = "transmitted radiance is multiplied by eta^2 in place of 1 / eta^2"
    cause: ClassVar[str] = "eta^2 upside down in radiance (factor eta^4)"

    def radiance(self, eta, mode):
        return ops.sqr(eta) if mode == "radiance" else 1.0 + 0.0 * eta


class GlassModeIgnored(_SmoothGlass):
    """Smooth glass that carries radiance whatever is asked."""

    fault: ClassVar[str] = "the factor 1 / eta^2 stands in mode importance too"
    cause: ClassVar[str] = "mode ignored"

    def radiance(self, eta, mode):
        return 1.0 / ops.sqr(eta)


class GlassNoRadiance(_SmoothGlass):
    """Smooth glass that never carries the radiance factor."""

    fault: ClassVar[str] = "transmitted radiance lacks 1 / eta^2; both modes are importance"
    cause: ClassVar[str] = "1 / eta^2 missing in radiance"

    def radiance(self, eta, mode):
        return 1.0 + 0.0 * eta


class GlassEtaInverse(_SmoothGlass):
    """Smooth glass whose sample says eta the wrong way round."""

    fault: ClassVar[str] = "the eta of a transmitted sample is wo's side over wi's side"
    cause: ClassVar[str] = "eta of the sample inverted"

    def sample_eta(self, reflects, eta):
        return ops.where(reflects, 1.0, 1.0 / eta)


class GlassEtaOnReflection(_SmoothGlass):
    """Smooth glass whose reflected samples claim to have changed the medium."""

    fault: ClassVar[str] = "a reflected sample carries the eta of a refracted one"
    cause: ClassVar[str] = "eta of the sample for reflection is not 1"

    def sample_eta(self, reflects, eta):
        return eta


class GlassSameIndexInside(_SmoothGlass):
    """Smooth glass that is entered from both sides."""

    fault: ClassVar[str] = "from the inside the index is eta, not 1 / eta: no total reflection, and not reciprocal"
    cause: ClassVar[str] = "relative index not inverted from the inside"

    def relative(self, wo):
        return self.eta + 0.0 * wo.z


class GlassSchlickInside(_SmoothGlass):
    """Smooth glass with Schlick's curve of the cosine on wo's side."""

    fault: ClassVar[str] = "from the denser side Schlick has the incident cosine: F differs both ways"
    cause: ClassVar[str] = "Schlick at the wrong cosine from inside"

    def reflectance(self, cos_o, cos_t, eta):
        r0 = ops.sqr((eta - 1.0) / (eta + 1.0))
        return ops.where(cos_t > 0.0, r0 + (1.0 - r0) * ops.pow(1.0 - cos_o, 5.0), 1.0)


class GlassTotalReflectionLost(_SmoothGlass):
    """Smooth glass that drops what cannot be refracted."""

    fault: ClassVar[str] = "beyond the critical angle F stays that of normal incidence and refracted samples fail"
    cause: ClassVar[str] = "no total internal reflection"

    def reflectance(self, cos_o, cos_t, eta):
        exact = fresnel.kind("exact").dielectric(cos_o, cos_t, eta)
        return ops.where(cos_t > 0.0, exact, ops.sqr((eta - 1.0) / (eta + 1.0)))

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        lost = (wo.z * s.wi.z >= 0.0) & (s.eta != 1.0)
        one = ops.where(lost, 0.0 * s.pdf, 1.0)
        wi = ops.where(lost, frame.mirror(wo), s.wi)
        return go.Sample(wi, s.weight * one, s.pdf * one, s.delta & ~lost, s.eta)


class GlassStraight(_SmoothGlass):
    """Glass that forgets to bend the light."""

    fault: ClassVar[str] = "transmitted light goes straight on, while eta and the radiance factor are those of glass"
    cause: ClassVar[str] = "Snell's law not applied"

    def refracted(self, wo, cos_t, eta):
        return -wo


class GlassSnellInverse(_SmoothGlass):
    """Glass that bends the light away from the normal on entering."""

    fault: ClassVar[str] = "the transmitted sine is eta sin, not sin / eta; where that passes 1 it is held there"
    cause: ClassVar[str] = "Snell's law with eta inverted"

    def refracted(self, wo, cos_t, eta):
        sin = ops.sqrt(ops.maximum(frame.sin2(wo), 1e-20))
        bent = ops.minimum(sin * eta, 0.9999)
        z = ops.safe_sqrt(1.0 - ops.sqr(bent))
        k = -bent / sin
        return ops.vec3(k * wo.x, k * wo.y, ops.where(wo.z >= 0.0, -z, z))


class GlassClampedChance(_SmoothGlass):
    """Glass that holds the probability of reflection between .1 and .9, and weighs as if it had not."""

    fault: ClassVar[str] = "reflection is chosen with clamp(F, .1, .9), weight and pdf are those of a choice by F"
    cause: ClassVar[str] = "lobe chosen by a clamped probability, weighed by the unclamped one"

    def share(self, f):
        return ops.where(f < 1.0, ops.clamp(f, 0.1, 0.9), f)

    def over_chance(self, power, chance):
        return power

    def probability(self, chance, f, reflects):
        return ops.where(reflects, f, 1.0 - f)

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        power = ops.where(wo.z * s.wi.z > 0.0, 1.0, self.radiance(self.relative(wo), mode))
        return go.Sample(s.wi, self.albedo * power, s.pdf, s.delta, s.eta)


class SidedTint(_SmoothGlass):
    """Tinted glass whose tint acts on the way in only."""

    albedo: go.Colour = go.spectrum((0.9, 0.7, 0.4), "tint of what passes", low=0.0, high=1.0)
    fault: ClassVar[str] = "light that enters is tinted, light that leaves is not: transmission is not reciprocal"
    cause: ClassVar[str] = "tint on one side only"

    def tinted(self, wo, reflects):
        return ops.where((wo.z > 0.0) & ~reflects, self.albedo, 1.0 + 0.0 * self.albedo)


# ------------------------------------------------------------------ thin slabs


class _Slab(go.BSDF):
    """A thin sheet of glass: interreflection between its faces, light goes straight on."""

    eta: go.Number = go.number(1.5, "index of the sheet", low=1.0, high=3.0)
    kind: ClassVar[str] = "delta"
    transmits = True
    delta = "always"

    def sums(self, r):
        """(reflected, transmitted)."""
        both = 2.0 * r / (1.0 + r)
        return both, 1.0 - both

    def eval(self, wo, wi, mode="radiance"):
        zero = 0.0 * wo.z
        return ops.vec3(zero, zero, zero)

    def pdf(self, wo, wi):
        return 0.0 * wo.z

    def sample(self, wo, u, mode="radiance"):
        cos = ops.abs(wo.z)
        r = fresnel.kind("exact").dielectric(cos, fresnel.cos_transmitted(cos, self.eta), self.eta)
        reflected, passed = self.sums(r)
        share = reflected / (reflected + passed)
        reflects = u.x < share
        pdf = ops.where(reflects, share, 1.0 - share)
        w = ops.safe_div(ops.where(reflects, reflected, passed), pdf)
        wi = ops.where(reflects, frame.mirror(wo), -wo)
        return go.Sample(wi, ops.vec3(w, w, w), pdf, ~go.never(pdf), 1.0 + 0.0 * pdf)


class ThinSheetGain(_Slab):
    """A thin sheet that reflects by both faces and lets through what one face lets through."""

    fault: ClassVar[str] = "R = 2r/(1+r) but T = 1 - r: the sheet returns more than it receives"
    cause: ClassVar[str] = ""

    def sums(self, r):
        return 2.0 * r / (1.0 + r), 1.0 - r


class ThinSheetLossy(_Slab):
    """A thin sheet that claims to lose nothing."""

    lossless_tolerance: ClassVar[float] = 1e-3
    fault: ClassVar[str] = "T = (1 - r)^2 leaves out light reflected inside, though the sheet claims to be lossless"
    cause: ClassVar[str] = ""

    def sums(self, r):
        return 2.0 * r / (1.0 + r), ops.sqr(1.0 - r)


class ThinSheetRadiance(_Slab):
    """A thin sheet that carries an interface's radiance factor."""

    fault: ClassVar[str] = "radiance through a sheet with air on both sides shrinks by 1 / eta^2, and grows from below"
    cause: ClassVar[str] = "1 / eta^2 where both sides have the same index"

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        eta = ops.where(wo.z > 0.0, self.eta, 1.0 / self.eta)
        through = (wo.z * s.wi.z < 0.0) & (mode == "radiance")
        return go.Sample(s.wi, s.weight * ops.where(through, 1.0 / ops.sqr(eta), 1.0), s.pdf, s.delta, s.eta)


# ------------------------------------------------------------------ deltas beside smooth parts


class _Coated(go.BSDF):
    """A smooth clear coat over a matte base that receives what the coat leaves (as in the tutorial)."""

    kd: go.Colour = go.spectrum((0.6, 0.4, 0.2), "share of light that the base reflects", low=0.0, high=1.0)
    r0: go.Number = go.number(0.04, "reflectance of the coat at normal incidence", low=0.0, high=0.9)
    kind: ClassVar[str] = "delta"
    delta = "maybe"

    def fresnel(self, cos):
        return self.r0 + (1.0 - self.r0) * ops.pow(1.0 - cos, 5.0)

    def share(self, wo):
        f = self.fresnel(ops.abs(wo.z))
        return f / (f + (1.0 - f) * 0.5)

    def eval(self, wo, wi, mode="radiance"):
        left = (1.0 - ops.pow(1.0 - wo.z, 5.0)) * (1.0 - ops.pow(1.0 - wi.z, 5.0))
        base = ops.where((wo.z > 0.0) & (wi.z > 0.0), left * wi.z * (21.0 / 20.0 * ops.inv_pi), 0.0)
        return self.kd * (1.0 - self.r0) * base

    def pdf(self, wo, wi):
        density = (1.0 - self.share(wo)) * wi.z * ops.inv_pi
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), density, 0.0)

    def mirrored(self, f, share):
        """Weight of the coat's sample."""
        return ops.safe_div(f, share)

    def sample(self, wo, u, mode="radiance"):
        share = self.share(wo)
        above = wo.z > 0.0
        coat = (u.x < share) & above
        diffuse = warp.square_to_cosine_hemisphere(u.y, u.z)
        wi = ops.where(coat, frame.mirror(wo), diffuse)
        density = ops.where((wo.z > 0.0) & (wi.z > 0.0), (1.0 - share) * wi.z * ops.inv_pi, 0.0)
        pdf = ops.where(above, ops.where(coat, share, density), 0.0)
        smooth = self.eval(wo, diffuse, mode) * ops.safe_div(1.0, density)
        f = self.mirrored(self.fresnel(ops.abs(wo.z)), share)
        weight = ops.where(coat, ops.vec3(f, f, f), ops.where(pdf > 0.0, smooth, 0.0))
        return go.Sample(wi, weight, pdf, coat, 1.0 + 0.0 * pdf)


class CoatPdfFull(_Coated):
    """A coated base whose pdf forgets that the coat takes part of the samples."""

    fault: ClassVar[str] = "pdf of the matte lobe is cos / pi without 1 - share of the coat"
    cause: ClassVar[str] = "probability of the lobe missing in pdf"

    def pdf(self, wo, wi):
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), wi.z * ops.inv_pi, 0.0)


class CoatWeightUnshared(_Coated):
    """A coated base whose highlight is not divided by the chance of being chosen."""

    fault: ClassVar[str] = "the coat's delta sample weighs F, not F over the probability of choosing it"
    cause: ClassVar[str] = "weight of the delta lobe without 1 / probability"

    def mirrored(self, f, share):
        return f


class CoatAllDelta(_Coated):
    """A coated base whose matte samples are called deltas as well."""

    fault: ClassVar[str] = "samples of the matte lobe carry delta = True"
    cause: ClassVar[str] = "delta flag of the smooth lobe"

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        return go.Sample(s.wi, s.weight, s.pdf, s.pdf > 0.0, s.eta)


class MixUnstretched(go.Mix):
    """A mixture that hands the number that chose the material on to the material."""

    a: go.BSDF = go.bsdf("the material at weight 0", go.Dielectric(alpha=0.0))
    b: go.BSDF = go.bsdf("the material at weight 1", go.Lambert(albedo=0.6))
    fault: ClassVar[str] = "u1 is not stretched: glass that is chosen where u1 > 1/2 hardly ever reflects"
    cause: ClassVar[str] = "u1 used twice"
    kind: ClassVar[str] = "delta"

    def sample(self, wo, u, mode="radiance"):
        w = self.weight
        pick_b = u.x < w
        sa, sb = self.a.sample(wo, u, mode), self.b.sample(wo, u, mode)
        delta = ops.where(pick_b, sb.delta, sa.delta)
        wi = ops.where(pick_b, sb.wi, sa.wi)
        chosen = ops.where(pick_b, sb.pdf * w, sa.pdf * (1.0 - w))
        pdf = ops.where(chosen > 0.0, ops.where(delta, chosen, self.pdf(wo, wi)), 0.0)
        smooth = self.eval(wo, wi, mode) * ops.where((chosen > 0.0) & ~delta, ops.safe_div(1.0, pdf), 0.0)
        weight = ops.where(delta, ops.where(pick_b, sb.weight, sa.weight), smooth)
        return go.Sample(wi, weight, pdf, delta, ops.where(pick_b, sb.eta, sa.eta))


class MixDeltaDensity(go.Mix):
    """A mixture that adds the smooth part's density to the probability of a delta sample."""

    a: go.BSDF = go.bsdf("the material at weight 0", go.Mirror())
    b: go.BSDF = go.bsdf("the material at weight 1", go.Lambert(albedo=0.6))
    fault: ClassVar[str] = "a delta sample has its probability plus the diffuse density as pdf; the weight goes along"
    cause: ClassVar[str] = "density added to a discrete probability"
    kind: ClassVar[str] = "delta"

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        pdf = s.pdf + ops.where(s.delta, self.pdf(wo, s.wi), 0.0)
        return go.Sample(s.wi, s.weight * ops.safe_div(s.pdf, pdf), pdf, s.delta, s.eta)


MUTANTS = [
    SquaredMirror,
    MirrorWithDensity,
    MirrorNotDelta,
    MirrorFromBehind,
    MirrorDeclaredNever,
    MirrorInEval,
    TangentMirror,
    HalfSilverChannel,
    GlassUnitProbability,
    GlassHalfLost,
    GlassRadianceInverted,
    GlassModeIgnored,
    GlassNoRadiance,
    GlassEtaInverse,
    GlassEtaOnReflection,
    GlassSameIndexInside,
    GlassSchlickInside,
    GlassTotalReflectionLost,
    GlassStraight,
    GlassSnellInverse,
    GlassClampedChance,
    SidedTint,
    ThinSheetGain,
    ThinSheetLossy,
    ThinSheetRadiance,
    CoatPdfFull,
    CoatWeightUnshared,
    CoatAllDelta,
    MixUnstretched,
    MixDeltaDensity,
]
SOUND = []
