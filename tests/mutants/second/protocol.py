"""Materials with right physics that break the protocol: mode, state, batches, shapes, failed samples."""

from typing import ClassVar

import gonio as go
import drjit as dr
import numpy as np
from gonio import ops
from gonio.optics import frame, warp


class GlassEvalModeIgnored(go.Dielectric):
    """Rough glass that heeds the mode in sample alone."""

    alpha: go.Width = go.width(0.25, "width of the microfacet distribution; two for anisotropy")
    fault: ClassVar[str] = "eval answers in radiance whatever the mode is; sample heeds it"
    cause: ClassVar[str] = "mode ignored in eval"
    kind: ClassVar[str] = "transmitting"

    def eval(self, wo, wi, mode="radiance"):
        return super().eval(wo, wi, "radiance")


class GlassModeTwice(go.Dielectric):
    """Rough glass whose sample applies the radiance factor to a weight that has it."""

    alpha: go.Width = go.width(0.25, "width of the microfacet distribution; two for anisotropy")
    fault: ClassVar[str] = "a transmitted weight carries 1 / eta^2 twice in radiance"
    cause: ClassVar[str] = "1 / eta^2 twice in the weight"
    kind: ClassVar[str] = "transmitting"

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        return go.Sample(s.wi, s.weight / ops.sqr(s.eta) if mode == "radiance" else s.weight, s.pdf, s.delta, s.eta)


class GlassZeroEta(go.Dielectric):
    """Rough glass that fills in eta for refraction only."""

    alpha: go.Width = go.width(0.25, "width of the microfacet distribution; two for anisotropy")
    fault: ClassVar[str] = "a reflected sample's eta is 0, as it was initialized"
    cause: ClassVar[str] = "eta of reflection 0"
    kind: ClassVar[str] = "transmitting"

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        return go.Sample(s.wi, s.weight, s.pdf, s.delta, ops.where(wo.z * s.wi.z > 0.0, 0.0, s.eta))


class _Gloss(go.BSDF):
    """A normalized Phong lobe over a matte part, sampled by two lobes; all energy checks hold."""

    kd: go.Colour = go.spectrum((0.4, 0.3, 0.2), "share of the matte part", low=0.0, high=1.0)
    ks: go.Number = go.number(0.4, "share of light that the lobe takes", low=0.0, high=1.0)
    p: go.Number = go.number(30.0, "exponent", low=1.0, high=1000.0)
    kind: ClassVar[str] = "smooth"

    def around(self, axis, w):
        side = ops.copysign(1.0 + 0.0 * axis.z, axis.z)
        a = -1.0 / (side + axis.z)
        b = axis.x * axis.y * a
        s = ops.vec3(1.0 + side * axis.x * axis.x * a, side * b, -side * axis.x)
        t = ops.vec3(b, side + axis.y * axis.y * a, -axis.y)
        return s * w.x + t * w.y + axis * w.z

    def lobe(self, wo, wi):
        return warp.square_to_power_lobe_pdf(ops.dot(frame.mirror(wo), wi), self.p)

    def eval(self, wo, wi, mode="radiance"):
        lit = (wo.z > 0.0) & (wi.z > 0.0)
        matte = ops.where(lit, wi.z * ops.inv_pi, 0.0) * (1.0 - self.ks)
        return self.kd * matte + ops.where(lit, self.ks * self.lobe(wo, wi) * wi.z, 0.0)

    def pdf(self, wo, wi):
        density = 0.5 * wi.z * ops.inv_pi + 0.5 * self.lobe(wo, wi)
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), density, 0.0)

    def draw(self, wo, u):
        narrow = self.around(frame.mirror(wo), warp.square_to_power_lobe(u.y, u.z, self.p))
        return ops.where(u.x < 0.5, narrow, warp.square_to_cosine_hemisphere(u.y, u.z))

    def sample(self, wo, u, mode="radiance"):
        wi = self.draw(wo, u)
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class GlossAlternating(_Gloss):
    """A gloss that takes turns between its lobes."""

    turn: ClassVar[list] = [0]
    fault: ClassVar[str] = "lobes take turns from call to call (Python state) instead of being chosen by u1"
    cause: ClassVar[str] = "state between calls"

    def draw(self, wo, u):
        self.turn[0] += 1
        even = 0.25 if self.turn[0] % 2 else 0.75
        return super().draw(wo, ops.vec3(even + 0.0 * u.x, u.y, u.z))


class GlossCached(_Gloss):
    """A gloss that keeps what it worked out, for whoever comes."""

    kept: ClassVar[dict] = {}
    fault: ClassVar[str] = "kd is cached by class, not by parameters: a second one (a white twin) gets the first's"
    cause: ClassVar[str] = "cache without the parameters in its key"

    def eval(self, wo, wi, mode="radiance"):
        plain = np.broadcast_to(np.asarray(self.plain.kd, float), (3,)).tolist()
        r, g, b = self.kept.setdefault("kd", plain)
        lit = (wo.z > 0.0) & (wi.z > 0.0)
        matte = ops.where(lit, wi.z * ops.inv_pi, 0.0) * (1.0 - self.ks)
        gloss = ops.where(lit, self.ks * self.lobe(wo, wi) * wi.z, 0.0)
        return ops.vec3(r * matte, g * matte, b * matte) + gloss


class GlossBatch(_Gloss):
    """A gloss that is scaled by the mean of its batch."""

    fault: ClassVar[str] = "the lobe is scaled by the mean cosine of the batch: the answer depends on the other rays"
    cause: ClassVar[str] = "reduction over the batch"

    def lobe(self, wo, wi):
        value = super().lobe(wo, wi)
        if not dr.is_jit_v(wi.z):
            return value
        return value * (0.5 + dr.mean(ops.abs(wi.z)))


class GlossNoisy(_Gloss):
    """A gloss with noise from NumPy, and no word of it."""

    fault: ClassVar[str] = "each call of eval has another random factor of mean 1, and stochastic is not declared"
    cause: ClassVar[str] = "undeclared randomness"

    def eval(self, wo, wi, mode="radiance"):
        return super().eval(wo, wi, mode) * float(np.random.default_rng().uniform(0.7, 1.3))


class GlossUsedTwice(_Gloss):
    """A gloss whose first number chooses the lobe and its direction too."""

    fault: ClassVar[str] = "u1 picks the lobe and serves as it is for the polar angle: each lobe is drawn by half"
    cause: ClassVar[str] = "u1 used twice"

    def draw(self, wo, u):
        return super().draw(wo, ops.vec3(u.x, u.x, u.z))


class GlossFailedWeight(_Gloss):
    """A gloss whose failed samples keep a weight."""

    fault: ClassVar[str] = "directions below the surface come with pdf 0 and with the weight of a success"
    cause: ClassVar[str] = "weight of a failed sample is not 0"

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        grey = self.kd * (1.0 - self.ks) + self.ks
        return go.Sample(s.wi, ops.where(s.pdf > 0.0, s.weight, grey * (1.0 + 0.0 * s.pdf)), s.pdf, s.delta, s.eta)


class GlossDensityOfFailures(_Gloss):
    """A gloss whose failed samples keep their density."""

    fault: ClassVar[str] = "pdf is positive below the horizon, for samples that have failed with pdf = weight = 0"
    cause: ClassVar[str] = "pdf of failed samples is not 0"

    def pdf(self, wo, wi):
        density = 0.5 * ops.maximum(wi.z, 0.0) * ops.inv_pi + 0.5 * self.lobe(wo, wi)
        return ops.where(wo.z > 0.0, density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        s = super().sample(wo, u, mode)
        up = ops.where(s.wi.z > 0.0, 1.0 + 0.0 * s.pdf, 0.0)
        return go.Sample(s.wi, s.weight * up, s.pdf * up, s.delta, s.eta)


class GlossRenormalized(_Gloss):
    """A gloss that mirrors its failed samples up again."""

    fault: ClassVar[str] = "a direction below the horizon is turned up by |z|, while pdf knows the lobe above only"
    cause: ClassVar[str] = "failed samples folded up"

    def draw(self, wo, u):
        w = super().draw(wo, u)
        return ops.vec3(w.x, w.y, ops.abs(w.z))


class GlossPdfEverywhere(_Gloss):
    """A gloss whose pdf gives the lower side what sample never does."""

    fault: ClassVar[str] = "the matte part takes |cos|, so pdf is positive below the surface, where no sample goes"
    cause: ClassVar[str] = "pdf positive where sample never goes"

    def pdf(self, wo, wi):
        density = 0.5 * ops.abs(wi.z) * ops.inv_pi + ops.where(wi.z > 0.0, 0.5 * self.lobe(wo, wi), 0.0)
        return ops.where(wo.z > 0.0, density, 0.0)


class GlossNotUnit(_Gloss):
    """A gloss that blends its two directions and forgets their length."""

    fault: ClassVar[str] = "sampled directions of the matte lobe are pushed by .15 toward the normal and not normalized"
    cause: ClassVar[str] = "sampled direction not of unit length"

    def draw(self, wo, u):
        w = super().draw(wo, u)
        return ops.where(u.x < 0.5, w, ops.vec3(w.x, w.y, w.z + 0.15))


class GreyShape(go.BSDF):
    """A grey matte surface that answers with one number a ray."""

    albedo: go.Number = go.number(0.5, "share of light that is reflected", low=0.0, high=1.0)
    fault: ClassVar[str] = "eval and weight have shape (N,), where (N, channels) is asked"
    cause: ClassVar[str] = "one channel in place of a spectrum"
    kind: ClassVar[str] = "smooth"

    def eval(self, wo, wi, mode="radiance"):
        return self.albedo * ops.where((wo.z > 0.0) & (wi.z > 0.0), wi.z * ops.inv_pi, 0.0)


class NoDirectionFlat(go.BSDF):
    """A matte surface whose failed samples are no directions."""

    albedo: go.Colour = go.spectrum(0.5, "share of light that is reflected", low=0.0, high=1.0)
    fault: ClassVar[str] = "where wo lies below, weight is 0 / 0: NaN where a failed sample has weight 0"
    cause: ClassVar[str] = "NaN weight of failed samples"
    kind: ClassVar[str] = "smooth"

    def eval(self, wo, wi, mode="radiance"):
        return self.albedo * ops.where((wo.z > 0.0) & (wi.z > 0.0), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        wi = warp.square_to_cosine_hemisphere(u.y, u.z)
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) / pdf, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


MUTANTS = [
    GlassEvalModeIgnored,
    GlassModeTwice,
    GlassZeroEta,
    GlossAlternating,
    GlossCached,
    GlossBatch,
    GlossNoisy,
    GlossUsedTwice,
    GlossFailedWeight,
    GlossDensityOfFailures,
    GlossRenormalized,
    GlossPdfEverywhere,
    GlossNotUnit,
    GreyShape,
    NoDirectionFlat,
]
SOUND = []
