"""Window panes, films and mirrors: materials of delta lobes alone."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.optics import frame, fresnel
from gonio.optics.fresnel import exact


class _W2Delta(go.BSDF):
    """A material that consists of delta lobes."""

    def eval(self, wo, wi, mode="radiance"):
        return self.tint * (0.0 * wo.z)

    def pdf(self, wo, wi):
        return 0.0 * wo.z

    def sample(self, wo, u, mode="radiance"):
        raise NotImplementedError

    @property
    def delta(self):
        return "always"


class _W2Pane(_W2Delta):
    """A thin pane: reflection, or straight on."""

    eta: go.Number = go.number(1.5, "index of the pane", low=1.05, high=3.0)
    tint: go.Colour = go.spectrum(1.0, "factor on everything reflected or transmitted", low=0.0, high=1.0)

    def face(self, wo):
        cos = ops.abs(wo.z)
        return exact.dielectric(cos, fresnel.cos_transmitted(cos, self.eta), self.eta)

    def shares(self, wo):
        """Fractions of the light that are reflected and transmitted, all bounces included."""
        r = self.face(wo)
        both = 2.0 * r / (1.0 + r)
        return both, 1.0 - both

    def color(self, wo):
        return self.tint

    def deltas(self, reflects, pdf):
        return pdf > 0.0

    def sample(self, wo, u, mode="radiance"):
        r, t = self.shares(wo)
        share = r / (r + t)
        reflects = u.x < share
        one = 1.0 + 0.0 * r
        pdf = ops.where(reflects, share, 1.0 - share)
        weight = ops.where(reflects, self.tint * one, self.color(wo) * one) * (r + t)
        return go.Sample(ops.where(reflects, frame.mirror(wo), -wo), weight, pdf, self.deltas(reflects, pdf), one)

    @property
    def transmits(self):
        return True


class W2PaneBounces(_W2Pane):
    """A pane of glass with the light that bounces between its faces."""

    fault: ClassVar[str] = (
        "reflectance and transmittance add up to more than 1, by up to 0.17 where a face reflects 0.41"
    )
    cause: ClassVar[str] = (
        "geometric series of the transmission sums all powers of R, not the even ones: energy is gained"
    )

    def shares(self, wo):
        r = self.face(wo)
        t = 1.0 - r
        return 2.0 * r / (1.0 + r), t * t / (1.0 - r + 1e-7)


class W2PaneNotDelta(_W2Pane):
    """A pane of glass that passes light straight on."""

    fault: ClassVar[str] = "light that passes straight on is not marked as a delta sample, although eval and pdf are 0"
    cause: ClassVar[str] = "delta flag missing on the transmitted samples: their pdf is a probability, no density"

    def deltas(self, reflects, pdf):
        return reflects & (pdf > 0.0)


class W2PaneOneWay(_W2Pane):
    """A pane of tinted glass."""

    dye: go.Colour = go.spectrum((0.4, 0.7, 0.6), "color of light that passes", low=0.0, high=1.0)

    fault: ClassVar[str] = "light is tinted if it is seen from above, and passes untinted if it is seen from below"
    cause: ClassVar[str] = "transmission is not reciprocal: absorption applied in one direction only"

    def color(self, wo):
        return self.tint * ops.where(wo.z > 0.0, self.dye, 1.0)


class W2FilmMean(_W2Delta):
    """A soap film in air: interference colors in reflection, the rest passes."""

    phase: go.Colour = go.spectrum((4.8, 5.6, 6.5), "optical thickness at normal incidence, in radians", low=0.0)
    eta: go.Number = go.number(1.33, "index of the film", low=1.05, high=2.5)
    tint: go.Colour = go.spectrum(1.0, "factor on everything reflected or transmitted", low=0.0, high=1.0)

    fault: ClassVar[str] = "the transmittance of each channel is 1 minus the mean reflectance of all channels"
    cause: ClassVar[str] = "energy gained in the channels that reflect more than the mean: R + T > 1 per channel"

    def reflectance(self, wo):
        cos = ops.abs(wo.z)
        cos_t = fresnel.cos_transmitted(cos, self.eta)
        swing = ops.cos(2.0 * self.phase * cos_t)
        total = 0.0 * swing
        for amplitude in exact.amplitudes(cos, cos_t, self.eta):
            r2 = ops.sqr(amplitude)
            total = total + r2 * (1.0 - swing) / (1.0 + r2 * r2 - 2.0 * r2 * swing + 1e-9)
        return total  # twice the mean of s and p, times 2 r^2 (1 - cos) / ...

    def sample(self, wo, u, mode="radiance"):
        r = self.reflectance(wo)
        share = ops.clamp(ops.mean(r), 0.0, 1.0)
        reflects = u.x < share
        one = 1.0 + 0.0 * share
        pdf = ops.where(reflects, share, 1.0 - share)
        value = ops.where(reflects, r, (1.0 - share) * (1.0 + 0.0 * r))
        weight = self.tint * value * ops.safe_div(1.0, pdf)
        return go.Sample(ops.where(reflects, frame.mirror(wo), -wo), weight, pdf, pdf > 0.0, one)

    @property
    def transmits(self):
        return True


class W2FilmPhase(_W2Delta):
    """Glass below a clear film of high index, seen from either side."""

    eta: go.Number = go.number(1.5, "index of the glass", low=1.05, high=2.0)
    eta_film: go.Number = go.number(2.2, "index of the film", low=2.0, high=3.0)
    phase: go.Colour = go.spectrum((5.0, 6.0, 7.0), "optical thickness of the film at normal incidence", low=0.0)
    tint: go.Colour = go.spectrum(1.0, "factor on everything reflected or transmitted", low=0.0, high=1.0)

    fault: ClassVar[str] = (
        "seen from inside the glass, the film's phase is that of a ray that reaches it from air at the same angle"
    )
    cause: ClassVar[str] = "film interference not reciprocal: cosine in the film from the index ratio of the other side"

    def reflectance(self, cos_o, cos_t, near, far):
        sin_o = ops.safe_sqrt(1.0 - cos_o * cos_o)
        cos_f = ops.safe_sqrt(1.0 - ops.sqr(sin_o * near / self.eta_film))
        cos_phase = ops.safe_sqrt(1.0 - ops.sqr(sin_o / self.eta_film))
        swing = ops.cos(2.0 * self.phase * cos_phase)
        total = 0.0 * swing
        for a, b, c in (
            (near * cos_o, self.eta_film * cos_f, far * cos_t),
            (cos_o / near, cos_f / self.eta_film, cos_t / far),
        ):
            r1, r2 = (a - b) / (a + b), (b - c) / (b + c)
            both = 2.0 * r1 * r2 * swing
            total = total + 0.5 * (r1 * r1 + r2 * r2 + both) / (1.0 + r1 * r1 * r2 * r2 + both + 1e-9)
        return total

    def sample(self, wo, u, mode="radiance"):
        above = wo.z >= 0.0
        eta = ops.where(above, self.eta, 1.0 / self.eta)
        cos_o = ops.abs(wo.z)
        cos_t = fresnel.cos_transmitted(cos_o, eta)
        near, far = ops.where(above, 1.0, self.eta), ops.where(above, self.eta, 1.0)
        r = ops.where(cos_t > 0.0, self.reflectance(ops.maximum(cos_o, 1e-4), cos_t, near, far), 1.0)
        share = ops.clamp(ops.mean(r), 0.0, 1.0)
        reflects = u.x < share
        one = 1.0 + 0.0 * share
        bent = ops.vec3(-wo.x / eta, -wo.y / eta, ops.where(above, -cos_t, cos_t))
        pdf = ops.where(reflects, share, 1.0 - share)
        squeeze = 1.0 / ops.sqr(eta) if mode == "radiance" else one
        weight = self.tint * ops.where(reflects, r, (1.0 - r) * squeeze) * ops.safe_div(1.0, pdf)
        wi = ops.where(reflects, frame.mirror(wo), bent)
        return go.Sample(wi, weight, pdf, pdf > 0.0, ops.where(reflects, one, eta))

    @property
    def transmits(self):
        return True


class W2MirrorBump(_W2Delta):
    """A mirror that can be seen by light sampling."""

    tint: go.Colour = go.spectrum(0.9, "reflectance", low=0.0, high=1.0)

    fault: ClassVar[str] = "eval is the reflectance for all directions within 2.6 degrees of the mirrored one"
    cause: ClassVar[str] = "eval of a delta lobe is not zero, while pdf is"

    def eval(self, wo, wi, mode="radiance"):
        near = ops.dot(frame.mirror(wo), wi) > 0.999
        return self.tint * ops.where(near & (wo.z > 0.0) & (wi.z > 0.0), 1.0, 0.0)

    def sample(self, wo, u, mode="radiance"):
        pdf = ops.where(wo.z > 0.0, 1.0, 0.0)
        return go.Sample(frame.mirror(wo), self.tint * pdf, pdf, pdf > 0.0, 1.0 + 0.0 * pdf)


class W2MirrorAbs(_W2Delta):
    """A mirror with two sides."""

    tint: go.Colour = go.spectrum(0.9, "reflectance", low=0.0, high=1.0)
    two_sided = True

    fault: ClassVar[str] = (
        "seen from below, the mirrored direction is turned to the upper side: light passes the mirror"
    )
    cause: ClassVar[str] = "abs of the cosine: samples from the back leave on the front of an opaque surface"

    def sample(self, wo, u, mode="radiance"):
        one = 1.0 + 0.0 * wo.z
        return go.Sample(ops.vec3(-wo.x, -wo.y, ops.abs(wo.z)), self.tint * one, one, one > 0.0, one)


class W2MirrorOneAxis(_W2Delta):
    """A mirror."""

    tint: go.Colour = go.spectrum(0.9, "reflectance", low=0.0, high=1.0)

    fault: ClassVar[str] = "the mirrored direction negates x and keeps y"
    cause: ClassVar[str] = (
        "reflection about the normal with a wrong sign: direction depends on the tangent, not isotropic"
    )

    def sample(self, wo, u, mode="radiance"):
        pdf = ops.where(wo.z > 0.0, 1.0, 0.0)
        return go.Sample(ops.vec3(-wo.x, wo.y, wo.z), self.tint * pdf, pdf, pdf > 0.0, 1.0 + 0.0 * pdf)


MUTANTS = [
    W2PaneBounces, W2PaneNotDelta, W2PaneOneWay, W2FilmMean, W2FilmPhase, W2MirrorBump, W2MirrorAbs, W2MirrorOneAxis,
]  # fmt: skip
SOUND = []
