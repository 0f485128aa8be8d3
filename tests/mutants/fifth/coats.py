"""Wrong materials: coats over a base."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.optics import frame, warp


class _CoatEval(go.BSDF):
    """Right: a GGX coat with Schlick's F over a matte base that gets the rest:
    f = F D G / (4 o.z i.z) + kd (1 - F(o)) (1 - F(i)) / pi."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    kd: go.Colour = go.spectrum(0.6, "albedo of the base", low=0.0, high=1.0)
    r0: go.Colour = go.spectrum(0.06, "reflectance of the coat at the normal", low=0.0, high=1.0)
    alpha: go.Number = go.number(0.3, "width of the coat's lobe", low=0.05, high=1.0)

    def F(self, cos):
        return self.r0 + (1.0 - self.r0) * ops.pow(1.0 - cos, 5.0)

    def D(self, m):
        a2 = ops.sqr(self.alpha)
        return 1.0 / (ops.pi * a2 * ops.sqr(frame.sin2(m) / a2 + ops.sqr(m.z)))

    def hidden(self, w):
        return 0.5 * (ops.sqrt(1.0 + ops.sqr(self.alpha) * frame.sin2(w) / ops.maximum(ops.sqr(w.z), 1e-10)) - 1.0)

    def top(self, wo, wi):
        """f cos of the coat."""
        m = frame.half_vector(wo, wi)
        g = 1.0 / (1.0 + self.hidden(wo) + self.hidden(wi))
        return self.F(ops.dot(wo, m)) * (self.D(m) * g / (4.0 * ops.maximum(wo.z, 1e-6)))

    def left(self, wo, wi):
        """The light that the coat leaves to the base."""
        return (1.0 - self.F(ops.maximum(wo.z, 0.0))) * (1.0 - self.F(ops.maximum(wi.z, 0.0)))

    def base(self, wo, wi):
        return self.kd * self.left(wo, wi) * (ops.inv_pi * wi.z)

    def eval(self, wo, wi, mode="radiance"):
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), self.top(wo, wi) + self.base(wo, wi), 0.0)


class _Coat(_CoatEval):
    """Right: the same, sampled by a mixture of D m_z and the cosine."""

    def share(self, w):
        a = ops.mean(self.F(ops.clamp(w.z, 0.0, 1.0)))
        b = ops.mean(self.kd) * (1.0 - a)
        return ops.clamp(ops.safe_div(a, a + b), 0.05, 0.9)

    def pdf_share(self, wo, wi):
        return self.share(wo)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        s = self.pdf_share(wo, wi)
        lobe = self.D(m) * m.z / (4.0 * ops.maximum(ops.dot(wo, m), 1e-5))
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), s * lobe + (1.0 - s) * ops.inv_pi * wi.z, 0.0)

    def sample_share(self, wo):
        return self.share(wo)

    def sample(self, wo, u, mode="radiance"):
        r = self.alpha * ops.sqrt(u.y / (1.0 - u.y))
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        m = ops.normalize(ops.vec3(r * c, r * s, 1.0 + 0.0 * r))
        wi = ops.where(u.x < self.sample_share(wo), frame.reflect(wo, m), warp.square_to_cosine_hemisphere(u.y, u.z))
        pdf = self.pdf(wo, wi)
        return go.Sample.of_density(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf)


class CoatOneSided(_CoatEval):
    """A coat over a matte base."""

    fault: ClassVar[str] = (
        "the base is reduced by 1 - F(cos_o) on the viewer's side only: f is not reciprocal at grazing pairs"
    )
    cause: ClassVar[str] = "base attenuated on one side only"

    def left(self, wo, wi):
        return 1.0 - self.F(ops.maximum(wo.z, 0.0)) + 0.0 * wi.z


class CoatGreyRest(_CoatEval):
    """A coat over a matte base."""

    fault: ClassVar[str] = (
        "the base gets 1 - mean(F) of the light in every channel: for a saturated coat (r0 = (1, 0, 0)) over a white base the red albedo is near 1.4; right for grey coats"
    )
    cause: ClassVar[str] = "rest for the base averaged over channels"

    def left(self, wo, wi):
        a, b = self.F(ops.maximum(wo.z, 0.0)), self.F(ops.maximum(wi.z, 0.0))
        return (1.0 - ops.mean(a)) * (1.0 - ops.mean(b))


class CoatDoubleNorm(_CoatEval):
    """A coat over a matte base."""

    fault: ClassVar[str] = (
        "the base's normalization divides by (1 - F_avg)^2 instead of by 1 - F_avg: coat and white base together reflect more than they receive (10 % for r0 = 0.06, 30 % for 0.3); a dark base hides it"
    )
    cause: ClassVar[str] = "normalization of the base squared"

    def base(self, wo, wi):
        average = ops.minimum(self.r0 + (1.0 - self.r0) * (1.0 / 21.0), 0.9)
        return self.kd * self.left(wo, wi) * (ops.inv_pi * wi.z / ops.sqr(1.0 - average))


class CoatShareOfLight(_Coat):
    """A coat over a matte base."""

    fault: ClassVar[str] = (
        "the pdf computes the lobe's share from F at the light's cosine, the sampler from F at the viewer's: they disagree where the two cosines differ, toward grazing"
    )
    cause: ClassVar[str] = "pdf's share uses wi, sampler's wo"

    def pdf_share(self, wo, wi):
        return self.share(wi)


class CoatMode(_Coat):
    """A coat over a matte base."""

    fault: ClassVar[str] = (
        'in mode "radiance" the base is divided by 1.5^2 as if its light left into another medium, in mode "importance" it is not: a reflection must not depend on the mode'
    )
    cause: ClassVar[str] = "eta squared applied to a reflection"

    def eval(self, wo, wi, mode="radiance"):
        scale = 1.0 / 2.25 if mode == "radiance" else 1.0
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), self.top(wo, wi) + self.base(wo, wi) * scale, 0.0)


class CoatBlackDye(_Coat):
    """A dyed coat over a matte base: the dye's transmittance is color^(depth (1 / o.z + 1 / i.z))."""

    fault: ClassVar[str] = (
        "Beer's law is exp(depth log(color) ...): for a dye with a black channel and depth = 0 this is 0 times infinity, NaN instead of 1"
    )
    cause: ClassVar[str] = "zero times log zero gives NaN"
    dye: go.Colour = go.spectrum(0.8, "transmittance of a layer of depth 1", low=0.0, high=1.0)
    depth: go.Number = go.number(0.5, "depth of the layer", low=0.0, high=4.0)

    def base(self, wo, wi):
        way = 1.0 / ops.maximum(wo.z, 1e-3) + 1.0 / ops.maximum(wi.z, 1e-3)
        passed = ops.exp(ops.log(self.dye) * (self.depth * way))
        return self.kd * self.left(wo, wi) * passed * (ops.inv_pi * wi.z)


class CoatTintLuminance(_Coat):
    """A coat whose reflectance is tinted by the hue of the base: r0 = level times tint."""

    fault: ClassVar[str] = (
        "the tint is color / luminance(color): for saturated blue it is 13.8, so r0 exceeds 1 and the base's rest 1 - F is negative; right for grey bases, moderate for red"
    )
    cause: ClassVar[str] = "division by luminance exceeds one for blue"
    level: go.Number = go.number(0.15, "mean reflectance of the coat", low=0.0, high=0.3)

    def F(self, cos):
        r, g, b = ops.channels(self.kd)
        luminance = 0.2126 * r + 0.7152 * g + 0.0722 * b
        r0 = self.kd * (self.level / ops.maximum(luminance, 1e-4))
        return r0 + (1.0 - r0) * ops.pow(1.0 - cos, 5.0)


class CoatDark(_Coat):
    """A coat over a matte base."""

    fault: ClassVar[str] = (
        "the lobe's share is r0 / (r0 + kd) without a guard: for a black coat (r0 = 0) over a black base it is 0 / 0, so the pdf is NaN"
    )
    cause: ClassVar[str] = "share is 0/0 for black on black"

    def share(self, w):
        a = ops.mean(self.r0)
        return 0.05 + 0.85 * (a / (a + ops.mean(self.kd))) + 0.0 * w.z


MUTANTS = [
    CoatOneSided,
    CoatGreyRest,
    CoatDoubleNorm,
    CoatShareOfLight,
    CoatMode,
    CoatBlackDye,
    CoatTintLuminance,
    CoatDark,
]
