"""A rough reflecting surface with any Fresnel reflectance: the base class of `conductor` and `metal`."""

from __future__ import annotations

from ...material.calling import method
from ...material.sample import Sample
from ...ops import Direction, Mask, Mode, Pair, Scalar, Spectrum, abs, dot, ones_like, safe_div, where
from ...optics import frame, masking
from ...optics.ndf import distribution
from . import microfacet
from .microfacet import Terms


class _Reflector(microfacet._Microfacet):
    """f = F D G / (4 (n.o)(n.i)), with F at the half vector. A subclass defines `reflectance` and
    `mean_reflectance`."""

    def reflectance(self, cos_theta: Scalar) -> Spectrum:
        """`albedo` times F at the cosine of incidence on a facet."""
        raise NotImplementedError(f"{type(self).__name__} has no reflectance")

    def _facet(self, wo: Direction, wi: Direction) -> tuple[Direction, Direction, Direction, Pair, Mask]:
        """wo, wi, the normal m of the facet that mirrors one into the other, the widths, and whether a rough lobe can
        be nonzero for the pair. The directions are in the frame of the anisotropy; m is computed before the rotation,
        because wo + wi would magnify its rounding errors.
        """
        m = frame.half_vector(wo, wi)
        alpha, smooth = self._roughness()
        wo, wi, m = (frame.rotate(w, self._turn) for w in (wo, wi, m))
        return wo, wi, m, alpha, _above(wo, wi) & ~smooth

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """albedo F D G / (4 cos theta_o); 0 where the surface is a mirror."""
        wo, wi, m, alpha, lit = self._facet(wo, wi)
        return self.reflectance(abs(dot(wo, m))) * where(lit, microfacet.reflection(self, wo, wi, m, alpha), 0.0)

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """Density of the sampled normal divided by 4 (o.m) (Walter2007, eq. 14)."""
        wo, wi, m, alpha, lit = self._facet(wo, wi)
        return where(lit, 0.25 * microfacet.pdf_per_cosine(self, wo, m, alpha), 0.0)

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """wo mirrored about a sampled normal; a direction below the surface is a failed sample."""
        alpha, smooth = self._roughness()
        wo_local = frame.rotate(wo, self._turn)
        m = where(smooth, frame.normal_like(wo), microfacet.sample_normal(self, wo_local, u.y, u.z, alpha))
        wi = frame.rotate_back(frame.reflect(wo_local, m), self._turn)
        # m is recomputed from the rounded wi: the weight is eval / pdf to the last digits, however narrow the lobe
        wo_local, wi_local, m, alpha, lit = self._facet(wo, wi)
        density = 0.25 * microfacet.pdf_per_cosine(self, wo_local, m, alpha)
        facets = where(lit, safe_div(microfacet.reflection(self, wo_local, wi_local, m, alpha), density), 0.0)
        mirrors = smooth & _above(wo_local, wi_local)
        weight = self.reflectance(abs(dot(wo_local, m))) * where(mirrors, 1.0, facets)
        pdf = where(mirrors, 1.0, where(lit, density, 0.0))
        return Sample(wi, weight, pdf, mirrors, ones_like(pdf))

    @method
    def terms(self, wo: Direction, wi: Direction) -> Terms:
        """D, G and F of the pair; eval is F D G / (4 cos theta_o)."""
        wo, wi, m, alpha, _ = self._facet(wo, wi)
        ndf = distribution(self.ndf)  # type: ignore[arg-type]  # mypy mistakes an inherited field
        g = masking.masking_shadowing(self.masking, ndf, wo, wi, m, alpha)  # type: ignore[arg-type]
        return Terms(ndf.D(m, alpha), g, self.reflectance(abs(dot(wo, m))))

    def tint(self, wo: Direction) -> Spectrum:
        """F at the angle between wo and the surface normal."""
        return self.reflectance(abs(wo.z))

    def normal_reflectance(self) -> Spectrum:
        """F at normal incidence."""
        return self.reflectance(self._one())


def _above(wo: Direction, wi: Direction) -> Mask:
    return (wo.z > 0.0) & (wi.z > 0.0)
