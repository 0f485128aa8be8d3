"""Third examiner: unusual and sound."""

from __future__ import annotations

from typing import ClassVar

import gonio as go
import numpy as np
from gonio import ops
from gonio.optics import frame, warp


class _Odd(go.BSDF):
    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""

    def done(self, wo, wi, mode):
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


@ops.function
def around(axis, w):
    """w, given about +z, about a unit axis instead."""
    side = ops.copysign(1.0 + 0.0 * axis.z, axis.z)
    a = -1.0 / (side + axis.z)
    b = axis.x * axis.y * a
    s = ops.vec3(1.0 + side * axis.x * axis.x * a, side * b, -side * axis.x)
    t = ops.vec3(b, side + axis.y * axis.y * a, -axis.y)
    return s * w.x + t * w.y + axis * w.z


class RoadSign(_Odd):
    """A lobe about the viewer."""

    fault = "looks odd: light goes back where it came from, brightest at wo = wi; symmetric in both, and no more than it receives"
    cause = ""

    ks: go.Colour = go.spectrum((0.9, 0.8, 0.1), "share that goes back", low=0.0, high=1.0)
    p: go.Number = go.number(60.0, "exponent", low=1.0, high=1000.0)

    def lobe(self, wo, wi):
        return warp.square_to_power_lobe_pdf(ops.dot(wo, wi), self.p)

    def eval(self, wo, wi, mode="radiance"):
        up = (wo.z > 0.0) & (wi.z > 0.0)
        higher = ops.maximum(ops.maximum(wo.z, wi.z), 1e-6)
        return self.ks * ops.where(up, self.lobe(wo, wi) * wi.z / higher, 0.0)

    def pdf(self, wo, wi):
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), self.lobe(wo, wi), 0.0)

    def sample(self, wo, u, mode="radiance"):
        return self.done(wo, around(wo, warp.square_to_power_lobe(u.y, u.z, self.p)), mode)


class MirrorAtGrazing(_Odd):
    """Matte near the normal, a mirror near the horizon."""

    fault = "looks odd: views below an elevation see a mirror, those above a matte surface of the same; the matte part is cut off sharply"
    cause = ""

    kd: go.Colour = go.spectrum(0.7, "share that the matte part reflects", low=0.0, high=1.0)
    ks: go.Colour = go.spectrum((0.9, 0.8, 0.7), "share that the mirror reflects", low=0.0, high=1.0)

    EDGE: ClassVar[float] = 0.4

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where((wo.z >= self.EDGE) & (wi.z >= self.EDGE), wi.z * ops.inv_pi, 0.0)

    def pdf(self, wo, wi):
        density = wi.z * (ops.inv_pi / (1.0 - self.EDGE**2))
        return ops.where((wo.z >= self.EDGE) & (wi.z >= self.EDGE), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        mirror = (wo.z > 0.0) & (wo.z < self.EDGE)
        z = ops.sqrt(self.EDGE**2 + (1.0 - self.EDGE**2) * (1.0 - u.y))
        r = ops.safe_sqrt(1.0 - z * z)
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        wi = ops.where(mirror, frame.mirror(wo), ops.vec3(r * c, r * s, z))
        smooth = self.done(wo, wi, mode)
        return go.Sample(
            wi, ops.where(mirror, self.ks, smooth.weight), ops.where(mirror, 1.0, smooth.pdf), mirror, smooth.eta
        )

    @property
    def delta(self):
        return "maybe"


class Gauze(_Odd):
    """Matte threads on both sides with holes between them."""

    fault = "looks odd: wi = -wo with a delta, the same from both sides, beside a matte part on either side"
    cause = ""

    kd: go.Colour = go.spectrum((0.8, 0.7, 0.6), "share that the threads reflect", low=0.0, high=1.0)
    opacity: go.Number = go.number(0.3, "share of the threads", low=0.05, high=0.95)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * (self.opacity * ops.where(wo.z * wi.z > 0.0, ops.abs(wi.z) * ops.inv_pi, 0.0))

    def pdf(self, wo, wi):
        return self.opacity * ops.where(wo.z * wi.z > 0.0, ops.abs(wi.z) * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        through = u.x >= self.opacity
        w = warp.square_to_cosine_hemisphere(u.y, u.z)
        wi = ops.where(through, -wo, ops.vec3(w.x, w.y, ops.copysign(w.z, wo.z)))
        smooth = self.done(wo, wi, mode)
        pdf = ops.where(through, 1.0 - self.opacity, smooth.pdf)
        return go.Sample(wi, ops.where(through, 1.0, smooth.weight), pdf, through, smooth.eta)

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "maybe"


class Pane(_Odd):
    """A thin pane of glass, without thickness."""

    fault = "looks odd: glass that refracts nothing: all orders of reflection in the pane are summed, what goes through goes straight, eta 1"
    cause = ""

    kt: go.Colour = go.spectrum((0.95, 1.0, 0.95), "share of the transmitted light that is kept", low=0.0, high=1.0)
    eta: go.Number = go.number(1.5, "index of the pane", low=1.0, high=3.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kt * (0.0 * wo.z)

    def pdf(self, wo, wi):
        return 0.0 * wo.z

    def sample(self, wo, u, mode="radiance"):
        from gonio.optics import fresnel

        cos = ops.abs(wo.z)
        f = fresnel.kind("exact").dielectric(cos, fresnel.cos_transmitted(cos, self.eta), self.eta)
        r = 2.0 * f / (1.0 + f)
        back = u.x < r
        pdf = ops.where(back, r, 1.0 - r)
        weight = ops.where(back, 1.0 + 0.0 * self.kt, self.kt)
        return go.Sample(ops.where(back, frame.mirror(wo), -wo), weight, pdf, pdf == pdf, 1.0 + 0.0 * pdf)

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "always"


class Leaf(_Odd):
    """Diffuse reflection and diffuse transmission."""

    fault = "looks odd: matte on wo's side and matte on the other, with no index: transmission without eta^2, from both sides alike"
    cause = ""

    kd: go.Colour = go.spectrum((0.3, 0.6, 0.1), "share that leaves on either side", low=0.0, high=1.0)
    through: go.Number = go.number(0.4, "share of that which goes through", low=0.0, high=1.0)

    def split(self, wo, wi):
        share = ops.where(wo.z * wi.z > 0.0, 1.0 - self.through, self.through)
        return ops.where(wo.z * wi.z == 0.0, 0.0, share * ops.abs(wi.z) * ops.inv_pi)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * self.split(wo, wi)

    def pdf(self, wo, wi):
        return self.split(wo, wi)

    def sample(self, wo, u, mode="radiance"):
        w = warp.square_to_cosine_hemisphere(u.y, u.z)
        side = ops.where(u.x < self.through, -wo.z, wo.z)
        return self.done(wo, ops.vec3(w.x, w.y, ops.copysign(w.z, side)), mode)

    @property
    def transmits(self):
        return True


class Soot(_Odd):
    """Black."""

    fault = "looks odd: eval and every weight are 0, though samples have a density; a black body absorbs all"
    cause = ""

    def eval(self, wo, wi, mode="radiance"):
        zero = 0.0 * wi.z
        return ops.vec3(zero, zero, zero)


class Checkered(_Odd):
    """Matte, and black between sectors of different parity."""

    fault = "looks odd: jumps at sixteen azimuths and a ring; wo sees wi only from a cell of its own parity, which is symmetric"
    cause = ""

    kd: go.Colour = go.spectrum((0.9, 0.5, 0.2), "share that a cell reflects", low=0.0, high=1.0)

    def parity(self, w):
        """+-1: the sign of sin(8 phi) (z - 0.7), by doubled angles"""
        r2 = frame.sin2(w)
        a, b = ops.safe_div(w.x * w.x - w.y * w.y, r2), ops.safe_div(2.0 * w.x * w.y, r2)
        c, d = a * a - b * b, 2.0 * a * b
        return ops.where(c * d * (w.z - 0.7) < 0.0, -1.0, 1.0)

    def eval(self, wo, wi, mode="radiance"):
        lit = (wo.z > 0.0) & (wi.z > 0.0) & (self.parity(wo) * self.parity(wi) > 0.0)
        return self.kd * ops.where(lit, wi.z * ops.inv_pi, 0.0)

    @property
    def isotropic(self):
        return False


class NearlyGrey(_Odd):
    """f differs by a hundredth over the hemisphere."""

    fault = "looks odd: almost a constant, with a ripple of half a per cent in the cosines; symmetric, and below 1"
    cause = ""

    kd: go.Colour = go.spectrum(0.5, "share", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        ripple = (1.0 + 0.005 * ops.cos(9.0 * wo.z)) * (1.0 + 0.005 * ops.cos(9.0 * wi.z)) * 0.99
        return self.kd * ops.where((wo.z > 0.0) & (wi.z > 0.0), ripple * wi.z * ops.inv_pi, 0.0)


class Combed(_Odd):
    """A narrow and a very wide slope, with normals in a flat-topped ellipse: a distribution of its own."""

    fault = "looks odd: normals are uniform over an ellipse of slopes thirty times as long as wide, and there are none beyond"
    cause = ""

    ks: go.Colour = go.spectrum((0.9, 0.85, 0.8), "share that a facet reflects", low=0.0, high=1.0)
    alpha: go.Width = go.width((0.6, 0.02), "greatest slopes along x and y", low=0.01, high=1.0)

    def D(self, m):
        """slopes uniform in an ellipse: 1 / (pi ax ay) within, over z^4"""
        z = ops.maximum(m.z, 1e-3)
        r2 = ops.sqr(m.x / (z * self.alpha.x)) + ops.sqr(m.y / (z * self.alpha.y))
        inside = (r2 <= 1.0) & (m.z > 1e-3)
        return ops.where(inside, 1.0 / (ops.pi * self.alpha.x * self.alpha.y * ops.sqr(ops.sqr(z))), 0.0)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        o_m = ops.dot(wo, m)
        g = ops.minimum(1.0, 2.0 * m.z * ops.safe_div(ops.minimum(wo.z, wi.z), o_m))
        value = ops.safe_div(self.D(m) * g, 4.0 * wo.z)
        return self.ks * ops.where((wo.z > 0.0) & (wi.z > 0.0), value, 0.0)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        density = ops.safe_div(self.D(m) * m.z, 4.0 * ops.dot(wo, m))
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        r = ops.sqrt(u.y) * 0.99999  # off the rim, where rounding would decide
        m = ops.normalize(ops.vec3(r * c * self.alpha.x, r * s * self.alpha.y, 1.0 + 0.0 * r))
        return self.done(wo, frame.reflect(wo, m), mode)


class CatsEyeMirror(_Odd):
    """Two delta lobes: a mirror's, and straight back."""

    fault = "looks odd: two delta lobes on the same side, one of them wi = wo; each is its own reverse"
    cause = ""

    ks: go.Colour = go.spectrum((0.9, 0.6, 0.3), "share of both", low=0.0, high=1.0)
    back: go.Number = go.number(0.25, "share that goes straight back", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.ks * (0.0 * wo.z)

    def pdf(self, wo, wi):
        return 0.0 * wo.z

    def sample(self, wo, u, mode="radiance"):
        above = wo.z > 0.0
        returns = u.x < self.back
        chance = ops.where(returns, self.back, 1.0 - self.back)
        pdf = ops.where(above, chance, 0.0)
        weight = self.ks * ops.where(above, 1.0, 0.0)
        return go.Sample(ops.where(returns, wo, frame.mirror(wo)), weight, pdf, above, 1.0 + 0.0 * pdf)

    @property
    def delta(self):
        return "always"


class Toon(_Odd):
    """Two tones, with the brightness of a cartoon."""

    fault = (
        "looks odd: a cartoon's two tones without a cosine, brighter than what it receives; both breaches are declared"
    )
    cause = ""

    kd: go.Colour = go.spectrum((0.8, 0.4, 0.3), "tone", low=0.0, high=1.0)

    known_violations = {
        "reciprocity": go.KnownViolation(
            "tones are laid on without a cosine, so f divides by cos theta_i alone",
            lambda toon: 1.0 if np.any(np.asarray(toon.kd) > 0) else 0.0,
        ),
        # 2 pi (0.2 * 0.5 + 0.5 * 0.5) - 1 = 1.2 for kd = 1
        "energy": go.KnownViolation("tones are not normalized", 2.0 * np.pi * 0.35 - 1.0 + 0.001, certain=False),
    }

    def eval(self, wo, wi, mode="radiance"):
        tone = ops.where(wi.z > 0.5, 0.5, 0.2)
        return self.kd * ops.where((wo.z > 0.0) & (wi.z > 0.0), tone, 0.0)

    def pdf(self, wo, wi):
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), 0.5 * ops.inv_pi, 0.0)

    def sample(self, wo, u, mode="radiance"):
        r = ops.safe_sqrt(1.0 - u.y * u.y)
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        return self.done(wo, ops.vec3(r * c, r * s, u.y), mode)


MUTANTS = []
SOUND = [
    RoadSign, MirrorAtGrazing, Gauze, Pane, Leaf, Soot, Checkered, NearlyGrey, Combed, CatsEyeMirror, Toon,
]  # fmt: skip
