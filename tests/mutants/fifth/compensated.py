"""Materials that compensate the energy lost between facets, with tables of their own, and coupled layers."""

from typing import ClassVar

import gonio as go
import numpy as np
from gonio import ops
from gonio.optics import frame, warp

N = 24


def _albedo_of_ggx(alpha, mu, n=48):
    """E of GGX with separable Smith masking and F = 1, from sampled visible normals: the mean of G1(wi)."""
    alpha, mu = np.broadcast_arrays(alpha[:, None], mu[None, :])
    alpha, mu = alpha[..., None], mu[..., None]
    k = (np.arange(n) + 0.5) / n
    u1, u2 = (a.ravel() for a in np.meshgrid(k, k, indexing="ij"))
    sin = np.sqrt(1.0 - mu**2)
    v = np.stack(np.broadcast_arrays(alpha * sin, 0.0 * mu, mu), -1)
    v = v / np.linalg.norm(v, axis=-1, keepdims=True)
    z = (1.0 - u2) * (1.0 + v[..., 2]) - v[..., 2]
    r = np.sqrt(np.maximum(1.0 - z**2, 0.0))
    h = np.stack([r * np.cos(2 * np.pi * u1) + v[..., 0], r * np.sin(2 * np.pi * u1), z + v[..., 2]], -1)
    h[..., 0] *= alpha
    h[..., 1] *= alpha
    h[..., 2] = np.maximum(h[..., 2], 1e-9)
    h /= np.linalg.norm(h, axis=-1, keepdims=True)
    wi_z = 2.0 * (h[..., 0] * sin + h[..., 2] * mu) * h[..., 2] - mu
    tan2 = (1.0 - wi_z**2) / np.maximum(wi_z, 1e-9) ** 2
    g1 = 2.0 / (1.0 + np.sqrt(1.0 + alpha**2 * tan2))
    return np.where(wi_z > 0.0, g1, 0.0).mean(-1)


_ALPHA = np.linspace(0.1, 1.0, N)
_ROOT = np.linspace(0.0, 1.0, N)  # root of the cosine
_E = _albedo_of_ggx(_ALPHA, np.maximum(_ROOT**2, 1e-4))
_fine = (np.arange(4000) + 0.5) / 4000
_AVG = np.array([np.mean(4.0 * np.interp(_fine, _ROOT, row) * _fine**3) for row in _E])  # 2 int E mu dmu
_MEAN = np.array([np.mean(2.0 * np.interp(_fine, _ROOT, row) * _fine) for row in _E])  # int E dmu
_TABLE = ops.Table("e_of_ggx", _E[..., None])
_AVERAGE = ops.Table("e_avg_of_ggx", _AVG[:, None])
_PLAIN_MEAN = ops.Table("e_mean_of_ggx", _MEAN[:, None])


class _Compensated(go.BSDF):
    """Right: GGX metal with constant F, and Kulla and Conty's lobe for the light that a facet passes on."""

    alpha: go.Number = go.number(0.5, "width of the facets' distribution", low=0.15, high=1.0)
    F: go.Colour = go.spectrum((0.95, 0.7, 0.3), "reflectance of a facet", low=0.0, high=1.0)

    def row(self):
        return (self.alpha - 0.1) / 0.9

    def place(self, x):
        return ops.inset(x, N)

    def E(self, w):
        root = ops.sqrt(ops.maximum(w.z, 0.0))
        row = self.row() + 0.0 * root
        return ops.lookup(_TABLE, self.place(row), self.place(root))[0]

    def E_avg(self, like):
        return ops.lookup(_AVERAGE, ops.inset(self.row() + 0.0 * like, N))[0]

    def F_ms(self, avg):
        return ops.sqr(self.F) * avg / ops.maximum(1.0 - self.F * (1.0 - avg), 1e-6)

    def g1_over_cos(self, w):
        return 2.0 / (w.z + ops.sqrt(ops.sqr(w.z) + ops.sqr(self.alpha) * frame.sin2(w)))

    def D(self, m):
        a2 = ops.sqr(self.alpha)
        return a2 * ops.inv_pi / ops.sqr(frame.sin2(m) + a2 * ops.sqr(m.z))

    def extra(self, wo, wi):
        avg = self.E_avg(wo.z)
        pair = (1.0 - self.E(wo)) * (1.0 - self.E(wi)) / ops.maximum(1.0 - avg, 1e-6)
        return self.F_ms(avg) * (pair * ops.inv_pi)

    def eval(self, wo, wi, mode="radiance"):
        m = frame.half_vector(wo, wi)
        single = self.F * (0.25 * self.D(m) * self.g1_over_cos(wo) * self.g1_over_cos(wi))
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), (single + self.extra(wo, wi)) * wi.z, 0.0)

    def share(self, w):
        return 0.1 + 0.8 * ops.clamp(1.0 - self.E(w), 0.0, 1.0)

    def pdf_share(self, wo, wi):
        return self.share(wo)

    def pdf(self, wo, wi):
        m = frame.half_vector(wo, wi)
        lobe = self.D(m) * m.z / ops.maximum(4.0 * ops.dot(wo, m), 1e-9)
        share = self.pdf_share(wo, wi)
        density = share * wi.z * ops.inv_pi + (1.0 - share) * lobe
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        slope = self.alpha * ops.sqrt(u.y / (1.0 - u.y))
        m = ops.normalize(ops.vec3(slope * c, slope * s, 1.0 + 0.0 * slope))
        wi = ops.where(u.x < self.share(wo), warp.square_to_cosine_hemisphere(u.y, u.z), frame.reflect(wo, m))
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample.of_density(wi, weight, pdf)


class CompensatedPlainMean(_Compensated):
    fault: ClassVar[str] = (
        "The average of E is its plain mean over the cosine, without the weight 2 mu, so the compensating lobe is not normalized: a white material gains up to 6 % energy at large alpha (and loses some at small)."
    )
    cause: ClassVar[str] = "E_avg lacks weight 2 mu"

    def E_avg(self, like):
        return ops.lookup(_PLAIN_MEAN, ops.inset(self.row() + 0.0 * like, N))[0]


class CompensatedOneSided(_Compensated):
    fault: ClassVar[str] = (
        "The compensating lobe is (1 - E(wo)) / pi, without the light's factor (1 - E(wi)) / (1 - E_avg): energy is right, but the value is not reciprocal, by 10 % and more at large alpha."
    )
    cause: ClassVar[str] = "compensation depends on viewer only"

    alpha: go.Number = go.number(0.8, "width of the facets' distribution", low=0.15, high=1.0)

    def extra(self, wo, wi):
        return self.F_ms(self.E_avg(wo.z)) * ((1.0 - self.E(wo)) * ops.inv_pi)


class CompensatedSeriesInverted(_Compensated):
    fault: ClassVar[str] = (
        "The sum over further bounces divides by 1 - F E_avg instead of 1 - F (1 - E_avg): dark colors hardly change, but for F near 1 and small alpha the compensating lobe is many times too strong and energy exceeds 1."
    )
    cause: ClassVar[str] = "series with E_avg for 1 - E_avg"

    def F_ms(self, avg):
        return ops.sqr(self.F) * avg / ops.maximum(1.0 - self.F * avg, 1e-6)


class CompensatedShareOfLight(_Compensated):
    fault: ClassVar[str] = (
        "`sample` chooses the cosine lobe by 1 - E(wo), pdf weighs it by 1 - E(wi): pdf is not the density of the samples where the two cosines differ."
    )
    cause: ClassVar[str] = "lobe probability from wi in pdf"

    alpha: go.Number = go.number(0.8, "width of the facets' distribution", low=0.15, high=1.0)

    def pdf_share(self, wo, wi):
        return self.share(wi)


class CompensatedAxisFromZero(_Compensated):
    fault: ClassVar[str] = (
        "The tables begin at alpha = 0.1, but E is looked up as if they began at 0, i.e. at 0.1 + 0.9 alpha: too small an E, so that single and compensating lobe together exceed 1 by some percent for bright F; right at alpha = 1."
    )
    cause: ClassVar[str] = "table axis offset ignored in lookup"

    def row(self):
        return self.alpha


class _EnergyPreservingRough(go.BSDF):
    """Right for roughness > 0: rough matte by Fujii's model with its compensation (Portsmouth 2024, approximate E)."""

    rho: go.Colour = go.spectrum((0.8, 0.5, 0.3), "albedo of a facet", low=0.0, high=1.0)
    roughness: go.Number = go.number(0.5, "standard deviation of slopes, scaled", low=0.0, high=1.0)

    C1 = 0.5 - 2.0 / (3.0 * np.pi)
    C2 = 2.0 / 3.0 - 28.0 / (15.0 * np.pi)

    def E(self, mu):
        c = 1.0 - mu
        g = c * (0.0571085289 + c * (0.491881867 + c * (-0.332181442 + c * 0.0714429953)))
        return (1.0 + self.roughness * g) / (1.0 + self.C1 * self.roughness)

    def average(self):
        return (1.0 + self.C2 * self.roughness) / (1.0 + self.C1 * self.roughness)

    def pair(self, wo, wi):
        low = 1e-6
        both = ops.maximum(1.0 - self.E(wo.z), low) * ops.maximum(1.0 - self.E(wi.z), low)
        return both / ops.maximum(1.0 - self.average(), low)

    def eval(self, wo, wi, mode="radiance"):
        s = ops.dot(wo, wi) - wo.z * wi.z
        over = ops.where(s > 0.0, s / ops.maximum(ops.maximum(wo.z, wi.z), 1e-6), s)
        single = self.rho * ((1.0 + self.roughness * over) / (1.0 + self.C1 * self.roughness))
        avg = self.average()
        more = ops.sqr(self.rho) * avg / (1.0 - self.rho * ops.maximum(1.0 - avg, 0.0))
        f = (single + more * self.pair(wo, wi)) * ops.inv_pi
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), f * wi.z, 0.0)

    def pdf(self, wo, wi):
        return ops.where(wo.z > 0.0, warp.square_to_cosine_hemisphere_pdf(wi), 0.0)

    def sample(self, wo, u, mode="radiance"):
        return self._weighted(wo, warp.square_to_cosine_hemisphere(u.y, u.z), mode)


class RoughMatteSmoothLimit(_EnergyPreservingRough):
    fault: ClassVar[str] = (
        "At roughness 0, its lower limit, nothing is lost and the compensation divides 0 by 0: every value is NaN; for roughness > 0 it is right."
    )
    cause: ClassVar[str] = "0/0 in compensation at roughness 0"

    def pair(self, wo, wi):
        return (1.0 - self.E(wo.z)) * (1.0 - self.E(wi.z)) / (1.0 - self.average())


class _Cloth(go.BSDF):
    """Right: a separable sheen of albedo k (1 - mu)^4 over a matte base that gets the smaller rest of both ends."""

    kd: go.Colour = go.spectrum((0.5, 0.2, 0.2), "albedo of the base", low=0.0, high=1.0)
    sheen: go.Number = go.number(0.8, "albedo of the sheen at the horizon", low=0.0, high=1.0)

    def g(self, w):
        return ops.sqr(ops.sqr(1.0 - w.z))

    def left(self, e_o, e_i):
        return ops.minimum(1.0 - e_o, 1.0 - e_i)

    def eval(self, wo, wi, mode="radiance"):
        g_o, g_i = self.g(wo), self.g(wi)
        fuzz = self.sheen * g_o * g_i * (15.0 * ops.inv_pi)  # 2 int (1 - mu)^4 mu dmu = 1/15
        base = self.kd * (self.left(self.sheen * g_o, self.sheen * g_i) * ops.inv_pi)
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), (base + fuzz) * wi.z, 0.0)


class ClothLargerRest(_Cloth):
    fault: ClassVar[str] = (
        "The base gets the larger instead of the smaller of what the sheen leaves at both ends, so a bright base at grazing views gains energy, more than 50 % at sheen and kd near 1."
    )
    cause: ClassVar[str] = "max for min in layer's rest"

    kd: go.Colour = go.spectrum((0.9, 0.6, 0.6), "albedo of the base", low=0.0, high=1.0)

    def left(self, e_o, e_i):
        return ops.maximum(1.0 - e_o, 1.0 - e_i)


MUTANTS = [
    CompensatedPlainMean,
    CompensatedOneSided,
    CompensatedSeriesInverted,
    CompensatedShareOfLight,
    CompensatedAxisFromZero,
    RoughMatteSmoothLimit,
    ClothLargerRest,
]
