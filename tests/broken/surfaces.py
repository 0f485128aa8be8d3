"""Mistakes around a diffuse reflection, sampled by the cosine, and in what is built on top of it."""

from __future__ import annotations

from typing import Any, ClassVar

from gonio import ops
from gonio.material import BSDF, Sample, never, number, spectrum
from gonio.material.parameters import Value
from gonio.ops import dot, inv_pi, maximum, safe_div, sqr, vec3, where
from gonio.optics import frame, warp


class RightDiffuse(BSDF):
    """The sound one: albedo / pi, sampled by the cosine."""

    caught_by: ClassVar[str] = ""

    albedo: Value = spectrum(1.0, "albedo", low=0.0, high=1.0)

    def _shape(self, wo: Any, wi: Any) -> Any:
        """eval for albedo 1 above the surface."""
        return wi.z * inv_pi

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        return self.albedo * where((wo.z > 0.0) & (wi.z > 0.0), self._shape(wo, wi), 0.0)

    def pdf(self, wo: Any, wi: Any) -> Any:
        return where((wo.z > 0.0) & (wi.z > 0.0), wi.z * inv_pi, 0.0)

    def sample(self, wo: Any, u: Any, mode: Any = "radiance") -> Any:
        return self.sample_cosine(wo, u, mode)


class NoCosine(RightDiffuse):
    """eval returns f: the cosine is missing."""

    caught_by = "reciprocity"

    def _shape(self, wo: Any, wi: Any) -> Any:
        return 0.5 * inv_pi + 0.0 * wi.z


class CosineTwice(RightDiffuse):
    """The cosine is multiplied in twice."""

    caught_by = "reciprocity"

    def _shape(self, wo: Any, wi: Any) -> Any:
        return sqr(wi.z) * inv_pi


class OnePercentMore(RightDiffuse):
    """1 % more light than comes in."""

    caught_by = "energy"

    def _shape(self, wo: Any, wi: Any) -> Any:
        return 1.01 * wi.z * inv_pi


class MoreAtGrazing(RightDiffuse):
    """Albedo 1.02, seen from less than five degrees above the surface only."""

    caught_by = "energy"

    def _shape(self, wo: Any, wi: Any) -> Any:
        return where(wo.z < 0.087, 1.02, 1.0) * wi.z * inv_pi


class OneSidedCoupling(RightDiffuse):
    """Disney's diffuse with the retro-reflection of one direction only."""

    caught_by = "reciprocity"

    def _shape(self, wo: Any, wi: Any) -> Any:
        c = 1.0 - wi.z
        return (1.0 - 0.5 * sqr(sqr(c)) * c) * wi.z * inv_pi


class NanAtTheNormal(RightDiffuse):
    """The azimuth of wo by a division, 0 / 0 at exactly normal incidence."""

    caught_by = "positivity"

    def _shape(self, wo: Any, wi: Any) -> Any:
        cos_phi = wo.x / ops.sqrt(sqr(wo.x) + sqr(wo.y))
        return (1.0 - 0.01 * sqr(cos_phi)) * wi.z * inv_pi


class NegativeLobe(RightDiffuse):
    """A lobe that is subtracted reaches below 0."""

    caught_by = "positivity"

    def _shape(self, wo: Any, wi: Any) -> Any:
        back = maximum(dot(wo, wi), 0.0)
        return (1.0 - 1.2 * sqr(sqr(back))) * wi.z * inv_pi


class RootAtZero(RightDiffuse):
    """sqrt of a product with the parameter: where the other factor is 0, the gradient is 0 / 0."""

    caught_by = "positivity"

    rim: Value = number(0.2, "brightness of the rim", low=0.01, high=0.5)

    def _shape(self, wo: Any, wi: Any) -> Any:
        sines = (sqr(wo.x) + sqr(wo.y)) * (sqr(wi.x) + sqr(wi.y))
        return (1.0 - ops.sqrt(self.rim * sines)) * wi.z * inv_pi


class AlbedoSquared(RightDiffuse):
    """The texture is decoded twice: albedo enters squared."""

    caught_by = "linearity"

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        return self.albedo * self.albedo * where((wo.z > 0.0) & (wi.z > 0.0), self._shape(wo, wi), 0.0)


class FollowsTheTangent(RightDiffuse):
    """Said to be isotropic, but brighter along x."""

    caught_by = "isotropy"

    def _shape(self, wo: Any, wi: Any) -> Any:
        return (1.0 - 0.1 * sqr(wo.y * wi.y)) * wi.z * inv_pi


class HalfTheHemisphere(RightDiffuse):
    """Sampling covers x > 0 only, and the pdf says so: light from elsewhere is never found."""

    caught_by = "pdf"

    def pdf(self, wo: Any, wi: Any) -> Any:
        return where((wo.z > 0.0) & (wi.z > 0.0) & (wi.x >= 0.0), 2.0 * wi.z * inv_pi, 0.0)

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Sample:
        w = warp.square_to_cosine_hemisphere(u.y, u.z)
        wi = vec3(ops.abs(w.x), w.y, w.z)
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi) * where(pdf > 0.0, safe_div(1.0, pdf), 0.0)
        return Sample(wi, weight, pdf, never(pdf), 1.0 + 0.0 * pdf)


class PdfOfTheSphere(RightDiffuse):
    """Uniform sampling of the hemisphere with the pdf of the whole sphere, 1 / (4 pi)."""

    caught_by = "pdf"

    def pdf(self, wo: Any, wi: Any) -> Any:
        return where((wo.z > 0.0) & (wi.z > 0.0), 0.25 * inv_pi, 0.0)

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Sample:
        r = ops.safe_sqrt(1.0 - sqr(u.y))
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        wi = vec3(r * c, r * s, u.y)
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi) * where(pdf > 0.0, safe_div(1.0, pdf), 0.0)
        return Sample(wi, weight, pdf, never(pdf), 1.0 + 0.0 * pdf)


class RightLobes(BSDF):
    """The sound one: half diffuse, half a cos^20 lobe about the normal; both lobes sampled as often as the pdf says."""

    caught_by: ClassVar[str] = ""
    share: ClassVar[float] = 0.5

    albedo: Value = spectrum(0.8, "albedo", low=0.0, high=1.0)

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        return self.albedo * where((wo.z > 0.0) & (wi.z > 0.0), wi.z * inv_pi, 0.0)

    def pdf(self, wo: Any, wi: Any) -> Any:
        both = 0.5 * wi.z * inv_pi + 0.5 * warp.square_to_power_lobe_pdf(wi.z, 20.0)
        return where((wo.z > 0.0) & (wi.z > 0.0), both, 0.0)

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Sample:
        wide, narrow = warp.square_to_cosine_hemisphere(u.y, u.z), warp.square_to_power_lobe(u.y, u.z, 20.0)
        wi = where(u.x < self.share, narrow, wide)
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi) * where(pdf > 0.0, safe_div(1.0, pdf), 0.0)
        return Sample(wi, weight, pdf, never(pdf), 1.0 + 0.0 * pdf)


class OtherLobeWeights(RightLobes):
    """`sample` picks the narrow lobe in 45 of 100 cases, `pdf` says 50."""

    caught_by = "pdf"
    share = 0.45


class NoLobeProbability(RightLobes):
    """The weight is that of the lobe that was picked, not divided by how often it is picked."""

    caught_by = "weight"

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Sample:
        s = RightLobes.sample(self, wo, u)
        wide, narrow = s.wi.z * inv_pi, warp.square_to_power_lobe_pdf(s.wi.z, 20.0)
        mine = where(u.x < self.share, narrow, wide)
        weight = self.eval(wo, s.wi) * where(s.pdf > 0.0, safe_div(1.0, mine), 0.0)
        return s._replace(weight=weight)


class RightCompensation(BSDF):
    """The sound one: a base that loses light, f = mu_o mu_i / pi with E = 2/3 mu, and Kulla and Conty's term on top."""

    caught_by: ClassVar[str] = ""
    lossless_tolerance: ClassVar[float | None] = 1e-3
    average: ClassVar[float] = 4.0 / 9.0  # 2 int 2/3 mu mu dmu

    albedo: Value = spectrum(1.0, "albedo", low=0.0, high=1.0)

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        missing = (1.0 - wo.z * (2.0 / 3.0)) * (1.0 - wi.z * (2.0 / 3.0)) / (1.0 - self.average)
        return self.albedo * where((wo.z > 0.0) & (wi.z > 0.0), (wo.z * wi.z + missing) * wi.z * inv_pi, 0.0)


class RowAverage(RightCompensation):
    """E_avg is the plain mean of a row of the table, int E dmu, without the weight 2 mu."""

    caught_by = "energy"
    average = 1.0 / 3.0


class RightMirror(BSDF):
    """The sound one: a delta lobe."""

    caught_by: ClassVar[str] = ""

    albedo: Value = spectrum(0.9, "albedo", low=0.0, high=1.0)

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        return self.albedo * (0.0 * wi.z)

    def pdf(self, wo: Any, wi: Any) -> Any:
        return 0.0 * wi.z

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Sample:
        above = wo.z > 0.0
        one = where(above, 1.0 + 0.0 * wo.z, 0.0)
        return Sample(frame.mirror(wo), self.albedo * one, one, above, 1.0 + 0.0 * wo.z)

    @property
    def delta(self) -> str:
        return "always"


class DeltaWithPdf(RightMirror):
    """`pdf` is 1 for the mirrored direction, as if a delta lobe had a density."""

    caught_by = "weight"

    def pdf(self, wo: Any, wi: Any) -> Any:
        return where((wo.z > 0.0) & (dot(frame.mirror(wo), wi) > 0.9999), 1.0, 0.0)


SURFACES = [v for v in vars().values() if isinstance(v, type) and issubclass(v, BSDF) and v.__module__ == __name__]
