"""Ten wrong materials whose mistakes sit in corners: mattes, Phong, Blinn, sheen, retro, fibers, tables."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.optics import frame, warp


def _up(wo, wi):
    return (wo.z > 0.0) & (wi.z > 0.0)


class _Cosine(go.BSDF):
    """A reflecting surface, sampled by the cosine."""

    def eval(self, wo, wi, mode="radiance"):
        raise NotImplementedError

    def pdf(self, wo, wi):
        return ops.where(_up(wo, wi), wi.z * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        return self.sample_cosine(wo, u, mode)


class _Lobes(go.BSDF):
    """A matte part and a highlight: eval, pdf and sample of a mixture."""

    def highlight_density(self, wo, wi):
        raise NotImplementedError

    def highlight_draw(self, wo, u):
        raise NotImplementedError

    def share(self):
        s, d = ops.mean(self.ks), ops.mean(self.kd)
        return ops.where(s + d > 0.0, s / ops.maximum(s + d, 1e-9), 0.5)

    def pdf(self, wo, wi):
        q = self.share()
        density = (1.0 - q) * wi.z * ops.inv_pi + q * self.highlight_density(wo, wi)
        return ops.where(_up(wo, wi), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        shiny = self.highlight_draw(wo, u)
        matte = warp.square_to_cosine_hemisphere(u.y, u.z)
        wi = ops.where(u.x < self.share(), shiny, matte)
        return self._weighted(wo, wi, mode)


# --------------------------------------------------------------------------- 1


class CoatedMatteBlue(_Cosine):
    """A matte base under a colored coat, which takes its part of the light on entering and on leaving."""

    fault: ClassVar[str] = (
        "in the blue channel the loss in the coat is (1 - F(o))^2 instead of (1 - F(o)) (1 - F(i)): not reciprocal in blue"
    )
    cause: ClassVar[str] = "blue channel uses the viewer's Fresnel twice"
    kd: go.Colour = go.spectrum(0.6, "albedo of the base", low=0.0, high=1.0)
    r0: go.Colour = go.spectrum(0.05, "reflectance of the coat at normal incidence", low=0.0, high=1.0)

    def left(self, cos):
        return (1.0 - self.r0) * (1.0 - ops.pow(1.0 - cos, 5.0))

    def eval(self, wo, wi, mode="radiance"):
        cos_o, cos_i = ops.maximum(wo.z, 0.0), ops.maximum(wi.z, 0.0)
        out, into = self.left(cos_o), self.left(cos_i)
        o, i = ops.channels(out), ops.channels(into)
        both = ops.of_channels(out, [o[0] * i[0], o[1] * i[1], o[2] * o[2]])
        average = self.r0 + (1.0 - self.r0) / 21.0
        value = self.kd * both / ops.maximum((1.0 - average), 1e-6)
        return value * ops.where(_up(wo, wi), wi.z * ops.inv_pi, 0.0)


# --------------------------------------------------------------------------- 2


class FoldedAzimuth(_Cosine):
    """A rough matte whose brightness falls off linearly with the difference of the azimuths."""

    fault: ClassVar[str] = (
        "the difference of the azimuths is not folded to [0, pi]: pairs on both sides of the negative x axis get a wrong "
        "value, so f changes if both directions are rotated about the normal"
    )
    cause: ClassVar[str] = "azimuth difference beyond pi is not wrapped"
    albedo: go.Colour = go.spectrum(0.7, "albedo", low=0.0, high=1.0)
    roughness: go.Number = go.number(0.6, "how strongly light returns forward", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        away = ops.abs(ops.atan2(wo.y, wo.x) - ops.atan2(wi.y, wi.x))
        sines = ops.safe_sqrt(frame.sin2(wo)) * ops.safe_sqrt(frame.sin2(wi))
        r = 0.5 * self.roughness
        shape = 1.0 - r + r * sines * (1.0 - away * ops.inv_pi)
        return self.albedo * ops.where(_up(wo, wi), shape * wi.z * ops.inv_pi, 0.0)


# --------------------------------------------------------------------------- 3


class PhongReusedNumber(_Lobes):
    """The normalized modified Phong model."""

    fault: ClassVar[str] = (
        "the number that chose the highlight (u1 < share) is used again, without rescaling, as the highlight's radial "
        "number: the tail of the lobe is never drawn although the pdf has it"
    )
    cause: ClassVar[str] = "lobe-selection number reused without rescaling"
    kd: go.Colour = go.spectrum(0.4, "albedo of the matte part", low=0.0, high=0.5)
    ks: go.Colour = go.spectrum(0.3, "albedo of the highlight", low=0.0, high=0.5)
    p: go.Number = go.number(20.0, "exponent", low=1.0, high=500.0)

    def eval(self, wo, wi, mode="radiance"):
        lobe = (self.p + 2.0) * (0.5 * ops.inv_pi) * ops.pow(ops.dot(frame.mirror(wo), wi), self.p)
        value = self.kd * ops.inv_pi + self.ks * lobe
        return value * ops.where(_up(wo, wi), wi.z, 0.0)

    def highlight_density(self, wo, wi):
        return warp.square_to_power_lobe_pdf(ops.dot(frame.mirror(wo), wi), self.p)

    def highlight_draw(self, wo, u):
        return warp.to_frame(frame.mirror(wo), warp.square_to_power_lobe(u.x, u.z, self.p))


# --------------------------------------------------------------------------- 4


class BlinnUniformRange(_Lobes):
    """Blinn's distribution with the v-groove masking; wide lobes are drawn uniformly."""

    fault: ClassVar[str] = (
        "the sampler draws the lobe uniformly over the hemisphere for p < 8, but the pdf takes it as uniform only for "
        "p < 4: for exponents between 4 and 8 the pdf is not the density of the samples"
    )
    cause: ClassVar[str] = "different exponent thresholds in sample and pdf"
    kd: go.Colour = go.spectrum(0.3, "albedo of the matte part", low=0.0, high=0.5)
    ks: go.Colour = go.spectrum(0.4, "reflectance of the facets", low=0.0, high=0.5)
    p: go.Number = go.number(32.0, "exponent", low=1.0, high=1000.0)

    def eval(self, wo, wi, mode="radiance"):
        up = _up(wo, wi)
        m = frame.half_vector(wo, wi)
        om = ops.maximum(ops.dot(wo, m), 1e-6)
        D = (self.p + 2.0) * (0.5 * ops.inv_pi) * ops.pow(m.z, self.p)
        G = ops.minimum(1.0, 2.0 * m.z * ops.minimum(wo.z, wi.z) / om)
        lobe = D * G / (4.0 * ops.where(up, wo.z, 1.0))
        return ops.where(up, self.kd * (ops.inv_pi * wi.z) + self.ks * lobe, 0.0)

    def highlight_density(self, wo, wi):
        m = frame.half_vector(wo, wi)
        narrow = warp.square_to_power_lobe_pdf(m.z, self.p) / (4.0 * ops.maximum(ops.dot(wo, m), 1e-6))
        return ops.where(self.p < 4.0, 0.5 * ops.inv_pi, narrow)

    def highlight_draw(self, wo, u):
        narrow = frame.reflect(wo, warp.square_to_power_lobe(u.y, u.z, self.p))
        return ops.where(self.p < 8.0, warp.square_to_power_lobe(u.y, u.z, 0.0 * self.p), narrow)


# --------------------------------------------------------------------------- 5


class VelvetSoftShadow(_Cosine):
    """Charlie's sheen with Ashikhmin's visibility term, under a soft terminator for sharp fibers."""

    fault: ClassVar[str] = (
        "for roughness below 0.3 the terminator's softening is a factor of the light's cosine alone, so f is not reciprocal "
        "there; at 0.3 and above all is right"
    )
    cause: ClassVar[str] = "terminator softening only from the light's cosine"
    tint_of_fibers: go.Colour = go.spectrum(0.5, "color of the fibers", low=0.0, high=0.7)
    roughness: go.Number = go.number(0.5, "roughness of the fibers", low=0.1, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        e = 1.0 / self.roughness
        D = (2.0 + e) * (0.5 * ops.inv_pi) * ops.pow(ops.safe_sqrt(frame.sin2(m)), e)
        V = 1.0 / (4.0 * ops.maximum(wo.z + wi.z - wo.z * wi.z, 1e-6))
        soft = ops.where(self.roughness < 0.3, ops.clamp(0.5 + 1.5 * wi.z, 0.0, 1.0), 1.0)
        return self.tint_of_fibers * ops.where(_up(wo, wi), D * V * soft * wi.z, 0.0)


# --------------------------------------------------------------------------- 6


class AshikhminQuadrant(_Lobes):
    """Ashikhmin and Shirley's anisotropic Phong model."""

    fault: ClassVar[str] = (
        "of the four quadrants of half vectors, the sampler puts the third (x < 0, y < 0) on the second: that one is drawn "
        "twice as often and the third never, while the pdf gives all four the same"
    )
    cause: ClassVar[str] = "third quadrant's azimuth has wrong sign"
    kd: go.Colour = go.spectrum(0.4, "albedo of the matte part", low=0.0, high=1.0)
    ks: go.Colour = go.spectrum(0.2, "reflectance at normal incidence", low=0.0, high=1.0)
    nu: go.Number = go.number(30.0, "exponent along x", low=1.0, high=1000.0)
    nv: go.Number = go.number(90.0, "exponent along y", low=1.0, high=1000.0)

    @property
    def isotropic(self):
        return False

    def D(self, m):
        e = (self.nu * ops.sqr(m.x) + self.nv * ops.sqr(m.y)) / ops.maximum(frame.sin2(m), 1e-12)
        norm = ops.sqrt((self.nu + 1.0) * (self.nv + 1.0)) * (0.5 * ops.inv_pi)
        return norm * ops.pow(m.z, e)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        om = ops.clamp(ops.dot(wo, m), 1e-6, 1.0)
        F = self.ks + (1.0 - self.ks) * ops.pow(1.0 - om, 5.0)
        lobe = self.D(m) / (4.0 * om * ops.maximum(ops.maximum(wo.z, wi.z), 1e-6))
        fo = 1.0 - ops.pow(1.0 - 0.5 * ops.maximum(wo.z, 0.0), 5.0)
        fi = 1.0 - ops.pow(1.0 - 0.5 * ops.maximum(wi.z, 0.0), 5.0)
        matte = self.kd * (1.0 - self.ks) * (28.0 / 23.0 * ops.inv_pi * fo * fi)
        return (matte + F * lobe) * ops.where(_up(wo, wi), wi.z, 0.0)

    def highlight_density(self, wo, wi):
        m = frame.half_vector(wo, wi)
        return self.D(m) / (4.0 * ops.maximum(ops.dot(wo, m), 1e-6))

    def highlight_draw(self, wo, u):
        q = ops.floor(4.0 * u.z)
        s, c = ops.sincos((0.5 * ops.pi) * (4.0 * u.z - q))
        axes = ops.normalize(ops.vec2(c * ops.sqrt(self.nv + 1.0), s * ops.sqrt(self.nu + 1.0)))
        x = ops.where((q > 0.5) & (q < 2.5), -axes.x, axes.x)
        y = ops.where(q > 2.5, -axes.y, axes.y)  # right: q > 1.5
        e = self.nu * ops.sqr(axes.x) + self.nv * ops.sqr(axes.y)
        cos = ops.exp(ops.log(ops.maximum(1.0 - u.y, 1e-9)) / (e + 1.0))
        sin = ops.safe_sqrt(1.0 - cos * cos)
        return frame.reflect(wo, ops.vec3(x * sin, y * sin, cos))


# --------------------------------------------------------------------------- 7


class ThirdLobeAlone(go.BSDF):
    """Matte, forward and retro-reflecting lobes of a road marking."""

    fault: ClassVar[str] = (
        "a sample of the third, retro-reflecting lobe reports that lobe's share of the density only and divides the whole "
        "value by it, although the other lobes also reach the direction: weights are too great"
    )
    cause: ClassVar[str] = "third lobe's samples ignore other lobes' densities"
    kd: go.Colour = go.spectrum(0.3, "albedo of the matte part", low=0.0, high=0.33)
    ks: go.Colour = go.spectrum(0.2, "albedo of the forward lobe", low=0.0, high=0.33)
    kr: go.Colour = go.spectrum(0.2, "albedo of the retro-reflecting lobe", low=0.0, high=0.33)
    p: go.Number = go.number(15.0, "exponent of both lobes", low=1.0, high=500.0)

    def eval(self, wo, wi, mode="radiance"):
        over = (self.p + 2.0) * (0.5 * ops.inv_pi)
        forward = over * ops.pow(ops.dot(frame.mirror(wo), wi), self.p)
        back = over * ops.pow(ops.dot(wo, wi), self.p)
        value = self.kd * ops.inv_pi + self.ks * forward + self.kr * back
        return value * ops.where(_up(wo, wi), wi.z, 0.0)

    def parts(self, wo, wi):
        forward = warp.square_to_power_lobe_pdf(ops.dot(frame.mirror(wo), wi), self.p)
        back = warp.square_to_power_lobe_pdf(ops.dot(wo, wi), self.p)
        up = _up(wo, wi)
        densities = (0.4 * wi.z * ops.inv_pi, 0.3 * forward, 0.3 * back)
        return tuple(ops.where(up, one, 0.0) for one in densities)

    def pdf(self, wo, wi):
        a, b, c = self.parts(wo, wi)
        return a + b + c

    def sample(self, wo, u, mode="radiance"):
        matte = warp.square_to_cosine_hemisphere(u.y, u.z)
        lobe = warp.square_to_power_lobe(u.y, u.z, self.p)
        forward, back = warp.to_frame(frame.mirror(wo), lobe), warp.to_frame(wo, lobe)
        wi = ops.where(u.x < 0.4, matte, ops.where(u.x < 0.7, forward, back))
        a, b, c = self.parts(wo, wi)
        pdf = ops.where(u.x < 0.7, a + b + c, c)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample.of_density(wi, weight, pdf)


# --------------------------------------------------------------------------- 8


class FiberHalf(_Cosine):
    """A fiber along x: bright where light and viewer lie on one cone about it."""

    fault: ClassVar[str] = (
        "the cone's width is that of the viewer's half: 30 % wider if wo.x > 0; pairs with x of opposite signs are not "
        "reciprocal, pairs with x of the same sign are right"
    )
    cause: ClassVar[str] = "lobe width depends on viewer's side only"
    albedo: go.Colour = go.spectrum(0.8, "color", low=0.0, high=1.0)
    beta: go.Number = go.number(0.35, "width of the cone", low=0.1, high=2.0)

    @property
    def isotropic(self):
        return False

    def eval(self, wo, wi, mode="radiance"):
        beta = ops.where(wo.x > 0.0, 1.3 * self.beta, self.beta)
        cone = ops.exp(-0.5 * ops.sqr((wo.x + wi.x) / beta))
        return self.albedo * ops.where(_up(wo, wi), cone * wi.z * ops.inv_pi, 0.0)


# --------------------------------------------------------------------------- 9

_TABLE = (0.30, 0.52, 0.68, 0.80, 0.90, 0.96, 1.0)


class TableNearest(_Cosine):
    """A matte surface darkened on entering and on leaving by a table of the cosine."""

    fault: ClassVar[str] = (
        "the light's factor is interpolated linearly but the viewer's is the entry below: up to 40 % too low, and f is "
        "not reciprocal"
    )
    cause: ClassVar[str] = "viewer's table lookup is not interpolated"
    albedo: go.Colour = go.spectrum(0.6, "color", low=0.0, high=1.0)

    def look(self, cos, linear):
        place = ops.clamp(cos, 0.0, 0.999999) * (len(_TABLE) - 1.0)
        cell = ops.floor(place)
        t = (place - cell) if linear else 0.0 * place
        value = 0.0 * place
        for k in range(len(_TABLE) - 1):
            here = (cell > k - 0.5) & (cell < k + 0.5)
            value = ops.where(here, _TABLE[k] + (_TABLE[k + 1] - _TABLE[k]) * t, value)
        return value

    def eval(self, wo, wi, mode="radiance"):
        factor = self.look(wo.z, False) * self.look(wi.z, True)
        return self.albedo * ops.where(_up(wo, wi), factor * wi.z * ops.inv_pi, 0.0)


# --------------------------------------------------------------------------- 10


class GlossMeanCoupling(_Lobes):
    """A Phong highlight over a matte base, which gets the light that the highlight leaves."""

    fault: ClassVar[str] = (
        "the base is dimmed by 1 - mean(ks) in all channels instead of 1 - ks per channel: with a saturated ks and a white "
        "kd one channel reflects up to 1.67 times what it receives"
    )
    cause: ClassVar[str] = "base coupling uses the highlight's mean color"
    kd: go.Colour = go.spectrum(0.5, "albedo of the base", low=0.0, high=1.0)
    ks: go.Colour = go.spectrum(0.3, "albedo of the highlight", low=0.0, high=1.0)
    p: go.Number = go.number(40.0, "exponent", low=1.0, high=1000.0)

    def eval(self, wo, wi, mode="radiance"):
        lobe = (self.p + 2.0) * (0.5 * ops.inv_pi) * ops.pow(ops.dot(frame.mirror(wo), wi), self.p)
        base = self.kd * ((1.0 - ops.mean(self.ks)) * ops.inv_pi)
        return (base + self.ks * lobe) * ops.where(_up(wo, wi), wi.z, 0.0)

    def highlight_density(self, wo, wi):
        return warp.square_to_power_lobe_pdf(ops.dot(frame.mirror(wo), wi), self.p)

    def highlight_draw(self, wo, u):
        return warp.to_frame(frame.mirror(wo), warp.square_to_power_lobe(u.y, u.z, self.p))


MUTANTS = [
    CoatedMatteBlue,
    FoldedAzimuth,
    PhongReusedNumber,
    BlinnUniformRange,
    VelvetSoftShadow,
    AshikhminQuadrant,
    ThirdLobeAlone,
    FiberHalf,
    TableNearest,
    GlossMeanCoupling,
]
