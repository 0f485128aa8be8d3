"""Compensation for image-based lighting (FdezAguera2019)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, NamedTuple

from ... import ops
from ...energy.compensation import lobe
from ...energy.compensation.missing import missing_energy
from ...energy.compensation.reflecting import Reflecting
from ...energy.tables import split_sum
from ...material import KnownViolation, method
from ...ops import Direction, Mode, Scalar, Spectrum, abs, function, maximum, where
from ...optics import warp
from ...optics.fresnel.schlick import schlick_average
from ...optics.roughness import widths
from ._compensated import INTERPOLATED, _Compensated, lobe_ratio
from .kulla_conty import f_add


class Derived(NamedTuple):
    """Values that do not depend on directions.

    missing  E_ms = 1 - Ess, and its mean
    f0       F0, the reflectance at normal incidence
    f_avg    F_avg of Schlick's curve
    ratio    mean color of the compensation divided by that of single scattering, for sampling
    """

    missing: Reflecting
    f0: Spectrum
    f_avg: Spectrum
    ratio: Scalar


class FdezAguera(_Compensated):
    """f = f_base + F_ms E_ms / pi: multiple scattering is approximated by a diffuse lobe (FdezAguera2019).

    A and B are the coefficients of the split sum, which are functions of mu_o = cos theta_o and alpha; F0 is the
    reflectance at normal incidence. With FssEss = F0 A + B, Ess = A + B, E_ms = 1 - Ess and F_avg = F0 + (1 - F0) / 21,
    the color of the lobe is F_ms = FssEss F_avg / (1 - E_ms F_avg). The method was designed for prefiltered lighting,
    where it computes FssEss * radiance + F_ms E_ms * irradiance. In a BSDF, the second term becomes a diffuse lobe that
    depends on wo only; the model is therefore not reciprocal. The method assumes Schlick's approximation of F.
    """

    known_violations: ClassVar[Mapping[str, KnownViolation]] = {
        "reciprocity": KnownViolation("the diffuse term depends on the view direction only", 4.0, certain=False),
        "energy": INTERPOLATED,
    }
    _takes_glass: ClassVar[bool] = False

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """f_base + F_ms E_ms / pi, times cos theta_i."""
        return self.base.eval(wo, wi, mode) + self.compensation(wo, wi, mode)

    def compensation(self, wo: Direction, wi: Direction, mode: Mode) -> Spectrum:
        """F_ms E_ms cos theta_i / pi."""
        _, f0, f_avg, _ = self.derived
        E_ms = self.M(wo)
        surface = self.base.microsurface
        assert surface is not None, "checked on construction"
        _, smooth = widths(surface.alpha)  # a mirror loses no light, but E_ms ends near 0, not at 0
        FssEss = split_sum.reflected(surface, f0, 1.0 - E_ms, wo)
        F_ms = FssEss * f_avg / maximum(1.0 - f_avg * E_ms, 1e-6)
        return F_ms * where(lobe.above(wo, wi) & ~smooth, E_ms * abs(wi.z) * ops.inv_pi, 0.0)

    def derive(self) -> Derived:
        """E_ms from its polynomial, F0 and F_avg = F0 + (1 - F0) / 21."""
        lost = missing_energy(self.base)
        f0 = self.base.normal_reflectance()
        assert isinstance(lost, Reflecting) and f0 is not None, "checked on construction"
        return Derived(lost, f0, schlick_average(f0), lobe_ratio(f_add(lost, "bounce"), lost))

    @function
    def _lobe_pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """cos theta_i / pi, the density of a diffuse lobe."""
        return warp.square_to_cosine_hemisphere_pdf(wi)

    @function
    def _lobe_sample(self, wo: Direction, u: Direction) -> Direction:
        """A direction with the density `_lobe_pdf`."""
        return warp.square_to_cosine_hemisphere(u.y, u.z)
