"""Thin sheets: diffuse transmission, slabs that scatter, thin rough panes, cutouts, frosted glass."""

from typing import ClassVar

import gonio as go
from gonio import ops
from gonio.optics import frame, warp


class _Sheet(go.BSDF):
    """Right: a matte sheet that reflects r, and transmits t of the rest, diffusely."""

    r: go.Colour = go.spectrum((0.5, 0.4, 0.2), "share of light that is reflected", low=0.0, high=1.0)
    t: go.Colour = go.spectrum((0.3, 0.6, 0.4), "share of the rest that is transmitted", low=0.0, high=1.0)

    @property
    def transmits(self):
        return True

    def passed(self):
        return self.t * (1.0 - self.r)

    def share(self, wo):
        r, t = ops.mean(self.r), ops.mean(self.passed())
        return 0.05 + 0.9 * (r / ops.maximum(r + t, 1e-6)) + 0.0 * wo.z

    def parts(self, wo):
        return self.r, self.passed()

    def eval(self, wo, wi, mode="radiance"):
        back, through = self.parts(wo)
        return ops.where(wo.z * wi.z > 0.0, back, through) * (ops.abs(wi.z) * ops.inv_pi)

    def pdf(self, wo, wi):
        share = self.share(wo)
        return ops.where(wo.z * wi.z > 0.0, share, 1.0 - share) * (ops.abs(wi.z) * ops.inv_pi)

    def sample(self, wo, u, mode="radiance"):
        w = warp.square_to_cosine_hemisphere(u.y, u.z)
        same = u.x < self.share(wo)
        above = ops.where(wo.z >= 0.0, same, ~same)
        wi = ops.vec3(w.x, w.y, ops.where(above, w.z, -w.z))
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class SheetGrayRest(_Sheet):
    fault: ClassVar[str] = (
        "The transmitted share is t times 1 - the mean of r, not 1 - r per channel: for a saturated r, e.g. (1, 0, 0) with t = 1, red gains 67 % energy; gray sheets are right."
    )
    cause: ClassVar[str] = "mean of color where channel is due"

    def passed(self):
        return self.t * (1.0 - ops.mean(self.r))


class SheetOneShare(_Sheet):
    fault: ClassVar[str] = (
        "The pdf multiplies both sides' cosine by the probability of reflection; for the transmitted side it must be 1 minus this. The density integrates to twice the share."
    )
    cause: ClassVar[str] = "pdf lacks complement for transmission"

    def pdf(self, wo, wi):
        return self.share(wo) * (ops.abs(wi.z) * ops.inv_pi)


class SheetBlackNan(_Sheet):
    fault: ClassVar[str] = (
        "If both colors are 0 the probability of reflection is 0/0, so pdf is NaN and no side is chosen properly; for other colors it is right."
    )
    cause: ClassVar[str] = "0/0 for black colors"

    def share(self, wo):
        r, t = ops.mean(self.r), ops.mean(self.passed())
        return 0.05 + 0.9 * (r / (r + t)) + 0.0 * wo.z


class SheetPartsSwappedBelow(_Sheet):
    fault: ClassVar[str] = (
        "For a viewer below, reflected and transmitted color are exchanged, so light through the sheet has another color in each direction: not reciprocal."
    )
    cause: ClassVar[str] = "colors swapped for viewer below"

    def parts(self, wo):
        return ops.where(wo.z > 0.0, self.r, self.passed()), ops.where(wo.z > 0.0, self.passed(), self.r)


class _Slab(go.BSDF):
    """Right: light scattered once, isotropically, in a slab of optical depth tau (Chandrasekhar)."""

    albedo: go.Colour = go.spectrum((0.9, 0.8, 0.5), "albedo of single scattering", low=0.0, high=1.0)
    tau: go.Number = go.number(1.0, "optical depth", low=0.1, high=10.0)

    @property
    def transmits(self):
        return True

    def through(self, o, i):
        """(exp(-tau/i) - exp(-tau/o)) / (i - o), by sinh x / x: nothing cancels."""
        eo, ei = 1.0 / o, 1.0 / i
        x = 0.5 * self.tau * ops.abs(eo - ei)
        low = ops.minimum(eo, ei)
        # (exp(-tau low) (1 - exp(-2x))) / |i - o|, |i - o| = 2 x o i / tau
        small = x < 1e-2
        ratio = ops.where(
            small, 1.0 - x + x * x * (2.0 / 3.0), (1.0 - ops.exp(-2.0 * x)) / ops.where(small, 1.0, 2.0 * x)
        )
        return ops.exp(-self.tau * low) * ratio * self.tau * eo * ei

    def eval(self, wo, wi, mode="radiance"):
        o = ops.maximum(ops.abs(wo.z), 1e-6)
        i = ops.maximum(ops.abs(wi.z), 1e-6)
        back = (1.0 - ops.exp(-self.tau * (1.0 / o + 1.0 / i))) / (o + i)
        value = ops.where(wo.z * wi.z > 0.0, back, self.through(o, i))
        return self.albedo * (0.25 * ops.inv_pi * ops.abs(wi.z) * value)

    def pdf(self, wo, wi):
        return 0.5 * ops.inv_pi * ops.abs(wi.z)

    def sample(self, wo, u, mode="radiance"):
        w = warp.square_to_cosine_hemisphere(u.y, u.z)
        wi = ops.vec3(w.x, w.y, ops.where(u.x < 0.5, w.z, -w.z))
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class SlabEqualCosines(_Slab):
    fault: ClassVar[str] = (
        "The transmitted light is a quotient of two differences, 0/0 where both cosines are equal, e.g. straight through (wi = -wo) and for both along the normal: NaN there."
    )
    cause: ClassVar[str] = "0/0 at equal cosines in transmission"

    def through(self, o, i):
        return (ops.exp(-self.tau / i) - ops.exp(-self.tau / o)) / (i - o)


class _ThinRough(go.BSDF):
    """Right: a thin rough pane; a GGX lobe about the mirrored viewer, and the same lobe mirrored to the other side."""

    alpha: go.Number = go.number(0.25, "width of both lobes", low=0.05, high=1.0)
    r: go.Number = go.number(0.2, "share of light in the reflected lobe", low=0.0, high=1.0)
    colour: go.Colour = go.spectrum((0.9, 0.7, 0.4), "tint of the transmitted lobe", low=0.0, high=1.0)

    @property
    def transmits(self):
        return True

    def up(self, w):
        return ops.vec3(w.x, w.y, ops.abs(w.z))

    def D(self, m):
        a2 = ops.sqr(self.alpha)
        return a2 * ops.inv_pi / ops.sqr(frame.sin2(m) + a2 * ops.sqr(m.z))

    def g1_over_cos(self, w):
        return 2.0 / (w.z + ops.sqrt(ops.sqr(w.z) + ops.sqr(self.alpha) * frame.sin2(w)))

    def eval(self, wo, wi, mode="radiance"):
        o, i = self.up(wo), self.up(wi)
        m = frame.half_vector(o, i)
        lobe = 0.25 * self.D(m) * self.g1_over_cos(o) * self.g1_over_cos(i) * i.z
        return ops.where(wo.z * wi.z > 0.0, self.r + 0.0 * self.colour, self.colour * (1.0 - self.r)) * lobe

    def share(self):
        return 0.1 + 0.8 * self.r

    def pdf(self, wo, wi):
        o, i = self.up(wo), self.up(wi)
        m = frame.half_vector(o, i)
        density = self.D(m) * m.z / ops.maximum(4.0 * ops.dot(o, m), 1e-9)
        share = self.share()
        return ops.where(wo.z * wi.z > 0.0, share, 1.0 - share) * density

    def transmitted(self, mirrored):
        return ops.vec3(mirrored.x, mirrored.y, -mirrored.z)

    def sample(self, wo, u, mode="radiance"):
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        slope = self.alpha * ops.sqrt(u.y / (1.0 - u.y))
        m = ops.normalize(ops.vec3(slope * c, slope * s, 1.0 + 0.0 * slope))
        w = frame.reflect(self.up(wo), m)
        good = w.z > 0.0
        w = ops.where(u.x < self.share(), w, self.transmitted(w))
        wi = ops.vec3(w.x, w.y, ops.where(wo.z < 0.0, -w.z, w.z))
        pdf = ops.where(good, self.pdf(wo, wi), 0.0)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


class ThinRoughNegated(_ThinRough):
    fault: ClassVar[str] = (
        "A transmitted sample is the reflected direction negated, -w, where eval and pdf mirror it in the surface (only z): samples of an oblique view leave on the wrong azimuth, where pdf is small."
    )
    cause: ClassVar[str] = "negated instead of mirrored at surface"

    def transmitted(self, mirrored):
        return -mirrored


class _Frosted(go.BSDF):
    """Right: ground glass that transmits diffusely into a medium of index eta: T from outside, T / eta^2 from inside."""

    eta: go.Number = go.number(1.5, "index inside over index outside", low=1.0, high=2.5)
    T: go.Colour = go.spectrum((0.9, 0.8, 0.6), "share of light from outside that is transmitted", low=0.0, high=1.0)

    @property
    def transmits(self):
        return True

    def passed(self, wo):
        """Share of power that is transmitted."""
        return self.T * ops.where(wo.z > 0.0, 1.0, 1.0 / ops.sqr(self.eta))

    def relative(self, wo):
        return ops.where(wo.z > 0.0, self.eta, 1.0 / self.eta)

    def eval(self, wo, wi, mode="radiance"):
        through = self.passed(wo)
        back = 1.0 - through
        if mode != "importance":
            through = through / ops.sqr(self.relative(wo))
        return ops.where(wo.z * wi.z > 0.0, back, through) * (ops.abs(wi.z) * ops.inv_pi)

    def pdf(self, wo, wi):
        return 0.5 * ops.inv_pi * ops.abs(wi.z)

    def sample(self, wo, u, mode="radiance"):
        w = warp.square_to_cosine_hemisphere(u.y, u.z)
        wi = ops.vec3(w.x, w.y, ops.where(u.x < 0.5, w.z, -w.z))
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), ops.where(wo.z * wi.z > 0.0, 1.0, self.relative(wo)))


class FrostedModesSwapped(_Frosted):
    fault: ClassVar[str] = (
        "The condition on `mode` is inverted: importance gets the factor 1/eta^2, radiance none, so transmission of power is not that of the material and radiance is not reciprocal; for eta = 1 it is right."
    )
    cause: ClassVar[str] = "radiance and importance exchanged"

    def eval(self, wo, wi, mode="radiance"):
        return super().eval(wo, wi, "radiance" if mode == "importance" else "importance")


class FrostedSameShareInside(_Frosted):
    fault: ClassVar[str] = (
        "The transmitted share is T also from inside, where total reflection leaves T / eta^2: transmission between the two media is not reciprocal, by eta^2."
    )
    cause: ClassVar[str] = "same transmittance from both media"

    def passed(self, wo):
        return self.T * (1.0 + 0.0 * wo.z)


class _Cutout(go.BSDF):
    """Right: a surface with holes (a delta lobe straight on); the rest is matte with a Phong-like lobe, from above."""

    opacity: go.Number = go.number(0.6, "share of the surface that is covered", low=0.05, high=1.0)
    kd: go.Colour = go.spectrum((0.4, 0.3, 0.1), "matte albedo", low=0.0, high=0.5)
    ks: go.Number = go.number(0.4, "albedo of the lobe", low=0.0, high=0.5)
    p: go.Number = go.number(20.0, "exponent of the lobe", low=1.0, high=1000.0)

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "maybe"

    def lobe_share(self):
        return 0.5

    def eval(self, wo, wi, mode="radiance"):
        lobe = self.ks * (self.p + 2.0) * 0.5 * ops.inv_pi * ops.pow(ops.dot(frame.mirror(wo), wi), self.p)
        value = (self.kd * ops.inv_pi + lobe) * (self.opacity * wi.z)
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), value, 0.0)

    def pdf(self, wo, wi):
        lobe = warp.square_to_power_lobe_pdf(ops.dot(frame.mirror(wo), wi), self.p)
        inner = 0.5 * lobe + 0.5 * wi.z * ops.inv_pi
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), inner * self.opacity, 0.0)

    def inner_u(self, u):
        return u.x / self.opacity

    def sample(self, wo, u, mode="radiance"):
        covered = u.x < self.opacity
        lobe = warp.to_frame(frame.mirror(wo), warp.square_to_power_lobe(u.y, u.z, self.p))
        on = ops.where(self.inner_u(u) < 0.5, lobe, warp.square_to_cosine_hemisphere(u.y, u.z))
        density = ops.where((wo.z > 0.0) & (on.z > 0.0), self.pdf(wo, on), 0.0)
        weight = self.eval(wo, on, mode) * ops.safe_div(1.0, density)
        white = 1.0 + 0.0 * self.kd
        pdf = ops.where(covered, density, 1.0 - self.opacity)
        return go.Sample(
            ops.where(covered, on, -wo), ops.where(covered, weight, white), pdf, ~covered, 1.0 + 0.0 * density
        )


class CutoutRandomNumberKept(_Cutout):
    fault: ClassVar[str] = (
        "u.x, which has chosen between hole and surface, is used again for the surface's two lobes without being rescaled by the opacity: below opacity 0.5 only the glossy lobe is sampled, at 0.6 five times of six."
    )
    cause: ClassVar[str] = "random number reused without rescaling"

    def inner_u(self, u):
        return u.x


MUTANTS = [
    SheetGrayRest,
    SheetOneShare,
    SheetBlackNan,
    SheetPartsSwappedBelow,
    SlabEqualCosines,
    ThinRoughNegated,
    FrostedModesSwapped,
    FrostedSameShareInside,
    CutoutRandomNumberKept,
]
