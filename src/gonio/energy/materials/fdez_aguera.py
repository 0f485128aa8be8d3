"""Compensation for image-based lighting (FdezAguera2019)."""

from __future__ import annotations

from typing import Any, ClassVar

from ... import ops
from ...models.base import Breach
from ...ops import abs, maximum, where
from ...optics.fresnel.schlick import schlick_average
from .. import missing, split_sum
from ..missing import Metal
from ._added import _Added


class FdezAguera(_Added):
    """f_base + F_ms E_ms / pi: multiple scattering as light from a diffuse surface (FdezAguera2019).

    With the split sum FssEss = F0 A(mu_o) + B(mu_o), Ess = A + B, E_ms = 1 - Ess and F_avg = F0 + (1 - F0) / 21:
    F_ms = FssEss F_avg / (1 - E_ms F_avg). Made for prefiltered lighting, FssEss * radiance + F_ms E_ms * irradiance;
    as a BSDF the second term is a diffuse lobe that sees wo alone: not reciprocal. Schlick's Fresnel is assumed in it.
    """

    breaks: ClassVar[dict[str, Breach]] = {
        "reciprocity": Breach("the diffuse part depends on the viewer's direction alone", 4.0, certain=False)
    }
    lossless = 2e-3
    _takes_glass = False

    def derive(self) -> Any:
        """What does not depend on directions."""
        f0 = missing.normal_reflectance(self.base)
        return {**Metal.derive(self), "f0": f0, "f_avg": schlick_average(f0)}

    def _extra(self, found: Any, wo: Any, wi: Any, mode: str) -> Any:
        lost = Metal.missing(self, found, wo)
        single = split_sum.reflected(self.base, found["f0"], 1.0 - lost, wo)
        series = single * found["f_avg"] / maximum(1.0 - found["f_avg"] * lost, 1e-6)
        above = (wo.z > 0.0) & (wi.z > 0.0)
        return series * where(above, lost * abs(wi.z) * ops.inv_pi, 0.0)
