"""Wrong materials: microfacet metals, GGX with Smith's masking and Beckmann with V grooves."""

from typing import ClassVar

import gonio as go
import numpy as np
from gonio import ops
from gonio.optics import frame


class _GGXEval(go.BSDF):
    """Right: f = F D G / (4 o.z i.z), GGX, height-correlated Smith, Schlick's F; no sampler."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    r0: go.Colour = go.spectrum(0.7, "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Width = go.width((0.2, 0.5), "widths", low=0.02, high=1.0)
    rotation: go.Angle = go.angle(0.0, "rotation of the widths about the normal")

    def turn(self, w):
        return frame.rotate(w, self.rotation)

    def unturn(self, w):
        return frame.rotate_back(w, self.rotation)

    def D(self, m):
        t = ops.sqr(m.x / self.alpha.x) + ops.sqr(m.y / self.alpha.y) + ops.sqr(m.z)
        return ops.where(m.z > 0.0, 1.0 / (ops.pi * self.alpha.x * self.alpha.y * ops.sqr(t)), 0.0)

    def hidden(self, w):
        tan2 = (ops.sqr(w.x * self.alpha.x) + ops.sqr(w.y * self.alpha.y)) / ops.maximum(ops.sqr(w.z), 1e-10)
        return 0.5 * (ops.sqrt(1.0 + tan2) - 1.0)

    def G(self, wo, wi):
        return 1.0 / (1.0 + self.hidden(wo) + self.hidden(wi))

    def F(self, wo, m):
        return self.schlick(ops.dot(wo, m))

    def schlick(self, cos):
        return self.r0 + (1.0 - self.r0) * ops.pow(1.0 - cos, 5.0)

    def eval(self, wo, wi, mode="radiance"):
        wo, wi = self.turn(wo), self.turn(wi)
        m = frame.half_vector(wo, wi)
        value = self.D(m) * self.G(wo, wi) / (4.0 * ops.maximum(wo.z, 1e-6))
        return self.F(wo, m) * ops.where((wo.z > 0.0) & (wi.z > 0.0), value, 0.0)


class _GGX(_GGXEval):
    """Right: the same, sampled by visible normals."""

    def G1(self, w):
        return 1.0 / (1.0 + self.hidden(w))

    def pdf(self, wo, wi):
        wo, wi = self.turn(wo), self.turn(wi)
        m = frame.half_vector(wo, wi)
        d = self.D(m) * self.pdf_masking(wo, wi) / (4.0 * ops.maximum(wo.z, 1e-6))
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), d, 0.0)

    def pdf_masking(self, wo, wi):
        return self.G1(wo)

    def lens(self, v):
        return 0.5 * (1.0 + v.z)

    def unstretch(self, n):
        return ops.normalize(ops.vec3(n.x * self.alpha.x, n.y * self.alpha.y, ops.maximum(n.z, 1e-6)))

    def visible(self, wo, u1, u2):
        v = ops.normalize(ops.vec3(wo.x * self.alpha.x, wo.y * self.alpha.y, ops.maximum(wo.z, 1e-6)))
        length2 = ops.sqr(v.x) + ops.sqr(v.y)
        some = length2 > 1e-12
        over = ops.rsqrt(ops.where(some, length2, 1.0))
        c, s = ops.where(some, v.x * over, 1.0), ops.where(some, v.y * over, 0.0)
        r = ops.sqrt(u1)
        sin, cos = ops.sincos(2.0 * ops.pi * u2)
        t1, t2 = r * cos, r * sin
        k = self.lens(v)
        t2 = (1.0 - k) * ops.safe_sqrt(1.0 - ops.sqr(t1)) + k * t2
        t3 = ops.safe_sqrt(1.0 - ops.sqr(t1) - ops.sqr(t2))
        # axes: T1 = (-s, c, 0), T2 = v x T1, v
        a = ops.vec3(-s * t1, c * t1, 0.0 * t1)
        b = ops.vec3(-v.z * c * t2, -v.z * s * t2, (v.x * c + v.y * s) * t2)
        return self.unstretch(a + b + v * t3)

    def sample(self, wo, u, mode="radiance"):
        local = self.turn(wo)
        wi = self.unturn(frame.reflect(local, self.visible(local, u.y, u.z)))
        pdf = self.pdf(wo, wi)
        return go.Sample.of_density(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf)


class GGXFresnelAtNormal(_GGXEval):
    """A metal."""

    fault: ClassVar[str] = "Schlick's F is taken at n.o instead of o.m: f is not reciprocal, except for r0 = 1"
    cause: ClassVar[str] = "Fresnel at viewer's cosine, not half vector's"

    def F(self, wo, m):
        return self.schlick(wo.z)


class GGXStillMasking(_GGXEval):
    """A metal."""

    fault: ClassVar[str] = (
        "masking is computed from directions that are not rotated while D is: turning material and directions together changes the value (unequal widths and rotation not 0 only)"
    )
    cause: ClassVar[str] = "masking ignores the rotation"

    def G(self, wo, wi):
        wo, wi = self.unturn(wo), self.unturn(wi)
        return 1.0 / (1.0 + self.hidden(wo) + self.hidden(wi))


class GGXClockwise(_GGX):
    """A metal."""

    fault: ClassVar[str] = (
        "the widths are turned clockwise instead of counterclockwise, alike in value, pdf and sampler: turning material and directions by the same angle changes the value (unequal widths only)"
    )
    cause: ClassVar[str] = "rotation has the wrong sign"

    def turn(self, w):
        return frame.rotate_back(w, self.rotation)

    def unturn(self, w):
        return frame.rotate(w, self.rotation)


class GGXPdfOtherMasking(_GGX):
    """A metal."""

    fault: ClassVar[str] = (
        "the pdf of visible normals contains G1(wi) instead of G1(wo): wrong for wide lobes at oblique pairs"
    )
    cause: ClassVar[str] = "pdf has G1 of wrong direction"

    def pdf_masking(self, wo, wi):
        return self.G1(wi)


class GGXLens(_GGX):
    """A metal."""

    fault: ClassVar[str] = (
        "the warp of the disk of visible normals uses s = v.z instead of (1 + v.z) / 2: right at normal incidence, wrong toward grazing views"
    )
    cause: ClassVar[str] = "wrong blend factor in visible-normal disk"

    def lens(self, v):
        return v.z


class GGXUnstretch(_GGX):
    """A metal."""

    fault: ClassVar[str] = "the sampled normal is unstretched by alpha.x along both axes: right for equal widths only"
    cause: ClassVar[str] = "normal unstretched with alpha.x twice"

    def unstretch(self, n):
        return ops.normalize(ops.vec3(n.x * self.alpha.x, n.y * self.alpha.x, ops.maximum(n.z, 1e-6)))


class GGXGreyEdge(_GGX):
    """A metal."""

    fault: ClassVar[str] = (
        "Schlick's rise toward grazing is 1 - mean(r0) for all channels: F is over 1 in the strong channel of a saturated color (r0 = (1, 0, 0): 1.67), right for greys"
    )
    cause: ClassVar[str] = "Schlick's 1 - r0 averaged over channels"

    def schlick(self, cos):
        return self.r0 + (1.0 - ops.mean(self.r0)) * ops.pow(1.0 - cos, 5.0)


class EdgeTintNegative(go.BSDF):
    """A metal with a tinted edge (F82)."""

    fault: ClassVar[str] = (
        "F82-tint is not limited at 0: for a dark metal with a black edge tint (r0 and tint near 0) the reflectance at oblique angles is negative"
    )
    cause: ClassVar[str] = "tinted Fresnel not clamped at zero"
    r0: go.Colour = go.spectrum(0.6, "reflectance at normal incidence", low=0.0, high=1.0)
    tint: go.Colour = go.spectrum(0.8, "factor at 82 degrees", low=0.0, high=1.0)
    alpha: go.Number = go.number(0.3, "width", low=0.05, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        a2 = ops.sqr(self.alpha)
        d = 1.0 / (ops.pi * a2 * ops.sqr(frame.sin2(m) / a2 + ops.sqr(m.z)))
        lo = 0.5 * (ops.sqrt(1.0 + a2 * frame.sin2(wo) / ops.maximum(ops.sqr(wo.z), 1e-10)) - 1.0)
        li = 0.5 * (ops.sqrt(1.0 + a2 * frame.sin2(wi) / ops.maximum(ops.sqr(wi.z), 1e-10)) - 1.0)
        cos = ops.dot(wo, m)
        rise = ops.pow(1.0 - cos, 5.0)
        at82 = self.r0 + (1.0 - self.r0) * ((6.0 / 7.0) ** 5)
        b = at82 * (1.0 - self.tint) * (7.0 * (7.0 / 6.0) ** 6)
        f = self.r0 + (1.0 - self.r0) * rise - b * (cos * rise * (1.0 - cos))
        value = d / ((1.0 + lo + li) * 4.0 * ops.maximum(wo.z, 1e-6))
        return f * ops.where((wo.z > 0.0) & (wi.z > 0.0), value, 0.0)


def _albedo_table(widths, count):
    """Directional albedo of isotropic GGX at F = 1, nodes of mu in [0, 1], from weights of visible normals."""
    k = (np.arange(64) + 0.5) / 64
    u1, u2 = (x.ravel() for x in np.meshgrid(k, k, indexing="ij"))
    out = np.zeros((len(widths), count))
    for i, a in enumerate(widths):
        for j, mu in enumerate(np.maximum(np.linspace(0.0, 1.0, count), 1e-3)):
            sin = np.sqrt(1 - mu * mu)
            v = np.array([a * sin, 0.0, mu])
            v /= np.linalg.norm(v)
            z = (1 - u1) * (1 + v[2]) - v[2]  # spherical cap
            r = np.sqrt(np.maximum(1 - z * z, 0))
            n = np.stack(
                [a * (r * np.cos(2 * np.pi * u2) + v[0]), a * r * np.sin(2 * np.pi * u2), np.maximum(z + v[2], 1e-9)]
            )
            n /= np.linalg.norm(n, axis=0)
            iz = 2 * (n[0] * sin + n[2] * mu) * n[2] - mu
            lo = 0.5 * (np.sqrt(1 + a * a * sin * sin / mu**2) - 1)
            z2 = np.maximum(iz, 1e-6) ** 2
            li = 0.5 * (np.sqrt(1 + a * a * (1 - z2) / z2) - 1)
            out[i, j] = np.mean(np.where(iz > 0, (1 + lo) / (1 + lo + li), 0))
    return out


_WIDTHS = np.linspace(0.1, 1.0, 19)


def _mean_albedo(e):
    """2 int E mu dmu of the piecewise linear E, exactly."""
    n = e.shape[1] - 1
    t = np.arange(n) / n
    h = 1.0 / n
    a, b = e[:, :-1], e[:, 1:]
    return 2 * np.sum(h * (a * (t / 2 + h / 6) + b * (t / 2 + h / 3)), axis=1)


_E = _albedo_table(_WIDTHS, 33)
_FINE = ops.Table("mutant_albedo", _E[..., None])
_FINE_MEAN = ops.Table("mutant_mean_albedo", _mean_albedo(_E)[:, None])


class _Compensated(go.BSDF):
    """Right: isotropic GGX plus Kulla and Conty's term (1 - E_o)(1 - E_i) / (pi (1 - E_mean)) with a color factor."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    r0: go.Colour = go.spectrum(0.7, "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Number = go.number(0.8, "width", low=0.1, high=1.0)

    def place(self):
        return ops.inset((self.alpha - 0.1) / 0.9, 19)

    def E(self, mu):
        return ops.lookup(_FINE, self.place(), ops.inset(mu, 33))[0]

    def E_mean(self):
        return ops.lookup(_FINE_MEAN, self.place())[0]

    def colour(self, average, e):
        return average * average * e / (1.0 - average * (1.0 - e))

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        a2 = ops.sqr(self.alpha)
        d = 1.0 / (ops.pi * a2 * ops.sqr(frame.sin2(m) / a2 + ops.sqr(m.z)))
        lo = 0.5 * (ops.sqrt(1.0 + a2 * frame.sin2(wo) / ops.maximum(ops.sqr(wo.z), 1e-10)) - 1.0)
        li = 0.5 * (ops.sqrt(1.0 + a2 * frame.sin2(wi) / ops.maximum(ops.sqr(wi.z), 1e-10)) - 1.0)
        f = self.r0 + (1.0 - self.r0) * ops.pow(1.0 - ops.dot(wo, m), 5.0)
        single = f * (d / ((1.0 + lo + li) * 4.0 * ops.maximum(wo.z, 1e-6)))
        e = self.E_mean()
        more = (1.0 - self.E(wo.z)) * (1.0 - self.E(wi.z)) / (ops.pi * (1.0 - e)) * wi.z
        value = single + self.colour(self.r0 + (1.0 - self.r0) * (1.0 / 21.0), e) * more
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), value, 0.0)


class CompensatedWhite(_Compensated):
    """A metal with all bounces between its facets."""

    fault: ClassVar[str] = (
        "the color factor of the compensation is F^2 / (1 - F (1 - E)) without the factor E: near-white metals of large width gain energy, darker ones stay below 1"
    )
    cause: ClassVar[str] = "mean albedo missing in the compensation's color"

    def colour(self, average, e):
        return average * average / (1.0 - average * (1.0 - e))


class CompensatedAxes(_Compensated):
    """A metal with all bounces between its facets."""

    fault: ClassVar[str] = (
        "the albedo table is read with its axes exchanged (mu as the width and the width as mu): the compensation is too large for wide white metals and the albedo over 1"
    )
    cause: ClassVar[str] = "axes of the albedo table swapped"

    def E(self, mu):
        return ops.lookup(_FINE, ops.inset(mu, 19), ops.inset((self.alpha - 0.1) / 0.9, 33))[0]


class _Beckmann(go.BSDF):
    """Right: Beckmann with V grooves, sampled by D m_z; weight = F G (o.m) / (o.z m.z)."""

    fault: ClassVar[str] = ""
    cause: ClassVar[str] = ""
    r0: go.Colour = go.spectrum(0.7, "reflectance at normal incidence", low=0.0, high=1.0)
    alpha: go.Number = go.number(0.3, "width", low=0.05, high=0.8)

    def D(self, m):
        z2 = ops.maximum(ops.sqr(m.z), 1e-6)
        a2 = ops.sqr(self.alpha)
        return ops.exp(-frame.sin2(m) / (a2 * z2)) / (ops.pi * a2 * ops.sqr(z2))

    def parts(self, wo, wi, m):
        """D G / (4 o.z), the pdf, F."""
        cos = ops.maximum(ops.dot(wo, m), 1e-5)
        g = ops.minimum(1.0, 2.0 * m.z * ops.minimum(wo.z, wi.z) / cos)
        fresnel = self.r0 + (1.0 - self.r0) * ops.pow(1.0 - cos, 5.0)
        return self.D(m) * g / (4.0 * ops.maximum(wo.z, 1e-6)), self.D(m) * m.z / (4.0 * cos), fresnel

    def eval(self, wo, wi, mode="radiance"):
        value, _, fresnel = self.parts(wo, wi, frame.half_vector(wo, wi))
        return fresnel * ops.where((wo.z > 0.0) & (wi.z > 0.0), value, 0.0)

    def pdf(self, wo, wi):
        _, d, _ = self.parts(wo, wi, frame.half_vector(wo, wi))
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), d, 0.0)

    def slope(self, u1):
        return self.alpha * ops.safe_sqrt(-ops.log(1.0 - u1))

    def sample(self, wo, u, mode="radiance"):
        r = self.slope(u.y)
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        m = ops.normalize(ops.vec3(r * c, r * s, 1.0 + 0.0 * r))
        wi = frame.reflect(wo, m)
        fails = (wo.z <= 0.0) | (wi.z <= 0.0)
        value, d, fresnel = self.parts(wo, wi, m)
        d = ops.where(fails, 0.0, d)
        return go.Sample.of_density(wi, fresnel * ops.where(fails, 0.0, value / ops.where(d > 0.0, d, 1.0)), d)


class BeckmannEpsilon(_Beckmann):
    """A metal."""

    fault: ClassVar[str] = (
        "log(1 - u - 1e-6): the epsilon against log 0 has the wrong sign, so for u2 above 1 - 1e-6 the logarithm of a negative number makes direction and weight NaN"
    )
    cause: ClassVar[str] = "log of a negative near u = 1"

    def slope(self, u1):
        return self.alpha * ops.sqrt(-ops.log(1.0 - u1 - 1e-6))


class BeckmannSquared(_Beckmann):
    """A metal."""

    fault: ClassVar[str] = "the sampler treats alpha as a roughness and squares it; value and pdf do not"
    cause: ClassVar[str] = "sampler squares the width"

    def slope(self, u1):
        return ops.sqr(self.alpha) * ops.safe_sqrt(-ops.log(1.0 - u1))


MUTANTS = [
    GGXFresnelAtNormal,
    GGXStillMasking,
    GGXClockwise,
    GGXPdfOtherMasking,
    GGXLens,
    GGXUnstretch,
    GGXGreyEdge,
    EdgeTintNegative,
    CompensatedWhite,
    CompensatedAxes,
    BeckmannEpsilon,
    BeckmannSquared,
]
