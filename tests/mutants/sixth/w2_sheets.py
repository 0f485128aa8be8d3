"""Leaves and translucent sheets: diffuse and glossy transmission without a change of medium."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.optics import frame, warp
from gonio.optics.ndf import distribution


class _W2Sheet(go.BSDF):
    """A thin sheet that reflects and transmits diffusely, on both sides."""

    kr: go.Colour = go.spectrum((0.3, 0.45, 0.2), "diffuse reflectance", low=0.0, high=0.5)
    kt: go.Colour = go.spectrum((0.2, 0.4, 0.1), "diffuse transmittance", low=0.0, high=0.5)

    def share(self):
        """Probability of reflection."""
        r, t = ops.mean(self.kr), ops.mean(self.kt)
        return (r + 1e-6) / (r + t + 2e-6)

    def eval(self, wo, wi, mode="radiance"):
        return ops.where(wo.z * wi.z > 0.0, self.kr, self.kt) * (ops.abs(wi.z) * ops.inv_pi)

    def pdf(self, wo, wi):
        share = self.share()
        return ops.where(wo.z * wi.z > 0.0, share, 1.0 - share) * ops.abs(wi.z) * ops.inv_pi

    def sample(self, wo, u, mode="radiance"):
        w = warp.square_to_cosine_hemisphere(u.y, u.z)
        wi = ops.vec3(w.x, w.y, ops.where((u.x < self.share()) == (wo.z >= 0.0), w.z, -w.z))
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.weight(wo, wi, mode, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)

    def weight(self, wo, wi, mode, pdf):
        return self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)

    @property
    def transmits(self):
        return True


class W2LeafUpperCosine(_W2Sheet):
    """A leaf that reflects and transmits diffusely."""

    fault: ClassVar[str] = "transmitted light is multiplied by max(cos, 0) of wi: none if the light is below the leaf"
    cause: ClassVar[str] = "signed cosine clamped in transmission: light passes in one direction only, not reciprocal"

    def eval(self, wo, wi, mode="radiance"):
        reflected = self.kr * (ops.abs(wi.z) * ops.inv_pi)
        transmitted = self.kt * (ops.maximum(wi.z, 0.0) * ops.inv_pi)
        return ops.where(wo.z * wi.z > 0.0, reflected, transmitted)


class W2LeafSides(_W2Sheet):
    """A leaf whose two sides have colors of their own."""

    kr_back: go.Colour = go.spectrum((0.4, 0.5, 0.3), "diffuse reflectance of the lower side", low=0.0, high=0.5)
    kt_back: go.Colour = go.spectrum((0.35, 0.45, 0.2), "diffuse transmittance seen from below", low=0.0, high=0.5)

    fault: ClassVar[str] = "the leaf seen from below transmits more light than the leaf seen from above"
    cause: ClassVar[str] = "transmission is not reciprocal: its two directions have different transmittances"

    def eval(self, wo, wi, mode="radiance"):
        above = wo.z > 0.0
        kr, kt = ops.where(above, self.kr, self.kr_back), ops.where(above, self.kt, self.kt_back)
        return ops.where(wo.z * wi.z > 0.0, kr, kt) * (ops.abs(wi.z) * ops.inv_pi)


class W2SheetGrey(_W2Sheet):
    """Tracing paper that reflects and transmits diffusely."""

    fault: ClassVar[str] = "the weight of samples is the mean of the channels over the pdf: sampled light has no color"
    cause: ClassVar[str] = "weight is not eval / pdf per channel"

    def weight(self, wo, wi, mode, pdf):
        value = self.eval(wo, wi, mode)
        return (ops.mean(value) + 0.0 * value) * ops.safe_div(1.0, pdf)


class W2SheetAdjoint(_W2Sheet):
    """Tracing paper that reflects and transmits diffusely, for paths from the camera and from lights."""

    fault: ClassVar[str] = "in mode importance the value is multiplied by the cosine of wo instead of that of wi"
    cause: ClassVar[str] = (
        "adjoint BSDF with the cosine of the wrong direction: both modes must be equal without refraction"
    )

    def eval(self, wo, wi, mode="radiance"):
        cos = ops.abs(wi.z) if mode == "radiance" else ops.abs(wo.z)
        return ops.where(wo.z * wi.z > 0.0, self.kr, self.kt) * (cos * ops.inv_pi)


class W2SheetFlipped(go.BSDF):
    """A sheet that scatters light forward, in a lobe about the straight direction."""

    kt: go.Colour = go.spectrum((0.8, 0.7, 0.6), "factor on the light that passes", low=0.0, high=1.0)
    p: go.Number = go.number(6.0, "exponent of the lobe", low=1.0, high=100.0)

    fault: ClassVar[str] = (
        "samples of the lobe that leave on wo's side are turned to the other side; the density ignores it"
    )
    cause: ClassVar[str] = "directions flipped into the hemisphere: pdf is not the density of sample near grazing"

    def lobe(self, wo, wi):
        """cos^p of the angle to the straight direction, on the other side."""
        return ops.where(wo.z * wi.z < 0.0, ops.pow(-ops.dot(wo, wi), self.p), 0.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kt * ((self.p + 2.0) * (0.5 * ops.inv_pi) * self.lobe(wo, wi) * ops.abs(wi.z))

    def pdf(self, wo, wi):
        return (self.p + 1.0) * (0.5 * ops.inv_pi) * self.lobe(wo, wi)

    def sample(self, wo, u, mode="radiance"):
        w = warp.to_frame(-wo, warp.square_to_power_lobe(u.y, u.z, self.p))
        wi = ops.vec3(w.x, w.y, ops.where(wo.z >= 0.0, -ops.abs(w.z), ops.abs(w.z)))
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)

    @property
    def transmits(self):
        return True


class W2LeafWax(go.BSDF):
    """A leaf with a waxy gloss on both sides."""

    kr: go.Colour = go.spectrum((0.3, 0.5, 0.2), "diffuse reflectance", low=0.0, high=0.5)
    kt: go.Colour = go.spectrum((0.2, 0.45, 0.1), "diffuse transmittance", low=0.0, high=0.5)
    alpha: go.Width = go.width(0.3, "width of the gloss", low=0.05)

    fault: ClassVar[str] = "the gloss is added to the full diffuse light: at grazing angles green exceeds 1"
    cause: ClassVar[str] = "energy is gained: the diffuse lobes are not reduced by what the gloss reflects"

    def eval(self, wo, wi, mode="radiance"):
        diffuse = ops.where(wo.z * wi.z > 0.0, self.kr, self.kt) * (ops.abs(wi.z) * ops.inv_pi)
        m = frame.half_vector(wo, wi)
        m = ops.where(m.z < 0.0, -m, m)
        ggx = distribution("ggx")
        cos = ops.abs(ops.dot(wo, m))
        f = 0.04 + 0.96 * ops.pow(1.0 - cos, 5.0)
        g = 1.0 / (1.0 + ggx.Lambda(wo, self.alpha) + ggx.Lambda(wi, self.alpha))
        gloss = f * g * ggx.D(m, self.alpha) / (4.0 * ops.maximum(ops.abs(wo.z), 1e-6))
        return diffuse + ops.where(wo.z * wi.z > 0.0, gloss, 0.0)

    @property
    def transmits(self):
        return True


MUTANTS = [W2LeafUpperCosine, W2LeafSides, W2SheetGrey, W2SheetAdjoint, W2SheetFlipped, W2LeafWax]
SOUND = []
