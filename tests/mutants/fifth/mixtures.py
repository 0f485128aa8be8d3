"""Wrong materials: mixtures of lobes."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.optics import frame, warp


def _facet_value(wo, wi, alpha):
    """f cos of Beckmann facets with V grooves at F = 1."""
    m = frame.half_vector(wo, wi)
    cos = ops.maximum(ops.dot(wo, m), 1e-5)
    g = ops.minimum(1.0, 2.0 * m.z * ops.minimum(wo.z, wi.z) / cos)
    return _facet_D(m, alpha) * g / (4.0 * ops.maximum(wo.z, 1e-6))


def _facet_D(m, alpha):
    z2 = ops.maximum(ops.sqr(m.z), 1e-6)
    a2 = ops.sqr(alpha)
    return ops.exp(-frame.sin2(m) / (a2 * z2)) / (ops.pi * a2 * ops.sqr(z2))


def _facet_pdf(wo, wi, alpha):
    m = frame.half_vector(wo, wi)
    return _facet_D(m, alpha) * m.z / (4.0 * ops.maximum(ops.dot(wo, m), 1e-5))


def _facet_sample(wo, u1, u2, alpha):
    r = alpha * ops.safe_sqrt(-ops.log(1.0 - u1))
    s, c = ops.sincos(2.0 * ops.pi * u2)
    return frame.reflect(wo, ops.normalize(ops.vec3(r * c, r * s, 1.0 + 0.0 * r)))


def _above(wo, wi):
    return (wo.z > 0.0) & (wi.z > 0.0)


class _Two(go.BSDF):
    """Right: (1 - w) narrow + w wide, two rough mirrors."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    narrow: go.Colour = go.spectrum(0.8, "albedo of the narrow lobe", low=0.0, high=1.0)
    wide: go.Colour = go.spectrum(0.6, "albedo of the wide lobe", low=0.0, high=1.0)
    w: go.Number = go.number(0.5, "share of the wide lobe", low=0.05, high=0.95)

    def eval(self, wo, wi, mode="radiance"):
        value = self.narrow * ((1.0 - self.w) * _facet_value(wo, wi, 0.15)) + self.wide * (
            self.w * _facet_value(wo, wi, 0.5)
        )
        return ops.where(_above(wo, wi), value, 0.0)

    def weights(self):
        return 1.0 - self.w, self.w

    def pdf(self, wo, wi):
        a, b = self.weights()
        return ops.where(_above(wo, wi), a * _facet_pdf(wo, wi, 0.15) + b * _facet_pdf(wo, wi, 0.5), 0.0)

    def draw(self, wo, u):
        return ops.where(u.x < self.w, _facet_sample(wo, u.y, u.z, 0.5), _facet_sample(wo, u.y, u.z, 0.15))

    def sample(self, wo, u, mode="radiance"):
        wi = self.draw(wo, u)
        pdf = self.pdf(wo, wi)
        return go.Sample.of_density(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf)


class MixOwnPdf(_Two):
    """Two rough mirrors, mixed."""

    fault: ClassVar[str] = (
        "a sample divides the sum of both lobes by the selected lobe's density alone (times its probability): both lobes are counted twice where they overlap, and sample's pdf is not pdf()"
    )
    cause: ClassVar[str] = "sample uses only the selected lobe's pdf"

    def sample(self, wo, u, mode="radiance"):
        wi = self.draw(wo, u)
        one = ops.where(u.x < self.w, self.w * _facet_pdf(wo, wi, 0.5), (1.0 - self.w) * _facet_pdf(wo, wi, 0.15))
        pdf = ops.where(_above(wo, wi), one, 0.0)
        return go.Sample.of_density(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf)


class MixSwapped(_Two):
    """Two rough mirrors, mixed."""

    fault: ClassVar[str] = "the pdf mixes the densities by w and 1 - w instead of 1 - w and w: right at w = 1/2 only"
    cause: ClassVar[str] = "mixing weights swapped in the pdf"

    def weights(self):
        return self.w, 1.0 - self.w


class MixLuminance(go.BSDF):
    """The mean of a matte, a narrow and a wide lobe of different colors."""

    fault: ClassVar[str] = (
        "the sampler selects lobes by the luminance of their colors, the pdf weights them by the mean of the channels: they agree for greys and disagree for saturated colors"
    )
    cause: ClassVar[str] = "luminance in sampler, mean in pdf"
    matte: go.Colour = go.spectrum(0.5, "albedo of the matte lobe", low=0.0, high=1.0)
    narrow: go.Colour = go.spectrum(0.8, "albedo of the narrow lobe", low=0.0, high=1.0)
    wide: go.Colour = go.spectrum(0.6, "albedo of the wide lobe", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        value = (
            self.matte * (ops.inv_pi * wi.z)
            + self.narrow * _facet_value(wo, wi, 0.15)
            + self.wide * _facet_value(wo, wi, 0.5)
        )
        return ops.where(_above(wo, wi), value * (1.0 / 3.0), 0.0)

    def shares(self, size):
        a, b, c = (0.03 + size(x) for x in (self.matte, self.narrow, self.wide))
        total = a + b + c
        return a / total, b / total, c / total

    def luminance(self, colour):
        r, g, b = ops.channels(colour)
        return 0.2126 * r + 0.7152 * g + 0.0722 * b

    def pdf(self, wo, wi):
        a, b, c = self.shares(ops.mean)
        d = a * ops.inv_pi * wi.z + b * _facet_pdf(wo, wi, 0.15) + c * _facet_pdf(wo, wi, 0.5)
        return ops.where(_above(wo, wi), d, 0.0)

    def sample(self, wo, u, mode="radiance"):
        a, b, _ = self.shares(self.luminance)
        narrow, wide = _facet_sample(wo, u.y, u.z, 0.15), _facet_sample(wo, u.y, u.z, 0.5)
        wi = ops.where(u.x < a, warp.square_to_cosine_hemisphere(u.y, u.z), ops.where(u.x < a + b, narrow, wide))
        pdf = self.pdf(wo, wi)
        return go.Sample.of_density(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf)


class ChannelLobes(go.BSDF):
    """A highlight with another width in each channel, on top of nothing: a chromatic Phong lobe."""

    fault: ClassVar[str] = (
        "the sampler selects a channel with probability 1/3, the pdf weights the channels' densities by their albedos: right for grey albedos only, up to a factor of 3 for one channel alone"
    )
    cause: ClassVar[str] = "channels drawn uniformly, weighted by color"
    ks: go.Colour = go.spectrum(0.7, "albedo of the lobe", low=0.0, high=1.0)
    p: go.Colour = go.spectrum((12.0, 24.0, 60.0), "exponent in each channel", low=2.0, high=400.0)

    def eval(self, wo, wi, mode="radiance"):
        cos = ops.maximum(ops.dot(frame.mirror(wo), wi), 0.0)
        lit = _above(wo, wi) & (cos > 0.0)
        f = [(p + 2.0) * (0.5 * ops.inv_pi) * ops.pow(cos, p) * wi.z for p in ops.channels(self.p)]
        return ops.where(lit, self.ks * ops.of_channels(self.ks, f), 0.0)

    def pdf(self, wo, wi):
        cos = ops.maximum(ops.dot(frame.mirror(wo), wi), 0.0)
        k = [x + 0.02 for x in ops.channels(self.ks)]
        p = ops.channels(self.p)
        q = [a * warp.square_to_power_lobe_pdf(cos, b) for a, b in zip(k, p)]
        d = (q[0] + q[1] + q[2]) / (k[0] + k[1] + k[2])
        return ops.where(_above(wo, wi), d, 0.0)

    def sample(self, wo, u, mode="radiance"):
        r, g, b = ops.channels(self.p)
        p = ops.where(u.x < 1.0 / 3.0, r, ops.where(u.x < 2.0 / 3.0, g, b))
        wi = warp.to_frame(frame.mirror(wo), warp.square_to_power_lobe(u.y, u.z, p))
        pdf = self.pdf(wo, wi)
        return go.Sample.of_density(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf)


MUTANTS = [MixOwnPdf, MixSwapped, MixLuminance, ChannelLobes]
