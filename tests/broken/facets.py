"""Mistakes in a GGX reflection: f = F D G / (4 cos_o cos_i), normals sampled by D(m) m.z."""

from __future__ import annotations

from typing import Any, ClassVar

from gonio import ops
from gonio.material import BSDF, Sample, never, spectrum, width
from gonio.material.parameters import Value
from gonio.ops import abs, dot, safe_div, sqr, where
from gonio.optics import frame
from gonio.optics.ndf.ggx import GGX

NDF = GGX()


class RightFacets(BSDF):
    """The sound one: separable Smith, Schlick's F at the half vector."""

    caught_by: ClassVar[str] = ""

    alpha: Value = width(0.4, "width")
    r0: Value = spectrum(0.4, "reflectance at normal incidence", low=0.0)

    def _widths(self) -> Any:
        return ops.vec2(ops.maximum(self.alpha.x, 1e-3), ops.maximum(self.alpha.y, 1e-3))

    def _D(self, m: Any) -> Any:
        return NDF.D(m, self._widths())

    def _G(self, wo: Any, wi: Any) -> Any:
        return NDF.G1(wo, self._widths()) * NDF.G1(wi, self._widths())

    def _F(self, wo: Any, m: Any) -> Any:
        c = 1.0 - abs(dot(wo, m))
        return self.r0 + (1.0 - self.r0) * (sqr(sqr(c)) * c)

    def _cosines(self, wo: Any, wi: Any) -> Any:
        return safe_div(1.0, 4.0 * wo.z)

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        m = frame.half_vector(wo, wi)
        value = self._D(m) * self._G(wo, wi) * self._cosines(wo, wi)
        return self._F(wo, m) * where((wo.z > 0.0) & (wi.z > 0.0), value, 0.0)

    def _jacobian(self, wo: Any, m: Any) -> Any:
        return safe_div(1.0, 4.0 * abs(dot(wo, m)))

    def pdf(self, wo: Any, wi: Any) -> Any:
        m = frame.half_vector(wo, wi)
        density = NDF.D(m, self._widths()) * m.z * self._jacobian(wo, m)
        return where((wo.z > 0.0) & (wi.z > 0.0), density, 0.0)

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Sample:
        m = NDF.sample(u.y, u.z, self._widths())
        wi = frame.reflect(wo, m)
        good = (wo.z > 0.0) & (wi.z > 0.0) & (dot(wo, m) > 0.0)
        pdf = where(good, NDF.D(m, self._widths()) * m.z * self._jacobian(wo, m), 0.0)
        return Sample(wi, self._weight(wo, wi, pdf), pdf, never(pdf), 1.0 + 0.0 * pdf)

    def _weight(self, wo: Any, wi: Any, pdf: Any) -> Any:
        return self.eval(wo, wi) * where(pdf > 0.0, safe_div(1.0, pdf), 0.0)


class NoJacobianInSample(RightFacets):
    """The weight divides by the density of the half vector: the 1 / (4 o.m) is missing in `sample` alone."""

    caught_by = "weight"

    def _weight(self, wo: Any, wi: Any, pdf: Any) -> Any:
        m = frame.half_vector(wo, wi)
        return self.eval(wo, wi) * where(pdf > 0.0, safe_div(1.0, pdf * 4.0 * abs(dot(wo, m))), 0.0)


class HalfVectorPdf(RightFacets):
    """The pdf of the half vector is used as that of wi, in `pdf` and `sample` alike."""

    caught_by = "pdf"

    def _jacobian(self, wo: Any, m: Any) -> Any:
        return 1.0 + 0.0 * m.z


class NoMasking(RightFacets):
    """G is forgotten."""

    caught_by = "energy"

    def _G(self, wo: Any, wi: Any) -> Any:
        return 1.0 + 0.0 * wo.z


class UnnormalisedD(RightFacets):
    """D lacks its 1 / pi."""

    caught_by = "energy"

    def _D(self, m: Any) -> Any:
        return NDF.D(m, self._widths()) * ops.pi


class FresnelAtTheNormal(RightFacets):
    """F at n.v in place of h.v."""

    caught_by = "reciprocity"

    def _F(self, wo: Any, m: Any) -> Any:
        return RightFacets._F(self, wo, frame.normal_like(wo))


class AlphaSquaredAgain(RightFacets):
    """`eval` squares a width that is alpha already; the weight in `sample` does not."""

    caught_by = "weight"

    def _D(self, m: Any) -> Any:
        a = self._widths()
        return NDF.D(m, ops.vec2(sqr(a.x), sqr(a.y)))

    def _weight(self, wo: Any, wi: Any, pdf: Any) -> Any:
        m = frame.half_vector(wo, wi)
        value = NDF.D(m, self._widths()) * self._G(wo, wi) * self._cosines(wo, wi)
        return self._F(wo, m) * where(pdf > 0.0, safe_div(value, pdf), 0.0)


class BelowTheHorizon(RightFacets):
    """Samples below the horizon are kept and weighed as if they were above."""

    caught_by = "weight"

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Sample:
        m = NDF.sample(u.y, u.z, self._widths())
        wi = frame.reflect(wo, m)
        o_m = dot(wo, m)
        good = (wo.z > 0.0) & (o_m > 0.0)
        pdf = where(good, NDF.D(m, self._widths()) * m.z * self._jacobian(wo, m), 0.0)
        factor = safe_div(o_m * self._G(wo, wi), wo.z * m.z)
        weight = self._F(wo, m) * where(good, factor, 0.0)
        return Sample(wi, weight, pdf, never(pdf), 1.0 + 0.0 * pdf)


class SwappedAxes(RightFacets):
    """alpha_x and alpha_y change places, in eval, pdf and sample alike."""

    caught_by = "isotropy"

    alpha: Value = width((0.15, 0.5), "width")

    def _widths(self) -> Any:
        return ops.vec2(ops.maximum(self.alpha.y, 1e-3), ops.maximum(self.alpha.x, 1e-3))


class CancellingD(RightFacets):
    """D as every homework has it, ((n.h)^2 (alpha^2 - 1) + 1)^2 below: float32 cancels at the peak of a narrow lobe."""

    caught_by = "precision"

    alpha: Value = width(0.005, "width")

    def _D(self, m: Any) -> Any:
        a2 = sqr(self._widths().x)
        return a2 / (ops.pi * sqr(sqr(m.z) * (a2 - 1.0) + 1.0))


class FloorInTheParameter(RightFacets):
    """alpha is rounded to steps on its way in: autodiff sees a constant."""

    caught_by = "gradients"

    def _D(self, m: Any) -> Any:
        import drjit as dr

        return NDF.D(m, dr.detach(self._widths()))


FACETS = [v for v in vars().values() if isinstance(v, type) and issubclass(v, RightFacets)]
