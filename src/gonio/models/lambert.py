"""Lambert's diffuse reflection."""

from __future__ import annotations

from typing import Any

from ..ops import abs, inv_pi, where
from .base import BSDF, Value, spectrum


class Lambert(BSDF):
    """Ideal diffuse reflection: f = albedo / pi, the same in every direction (course notes, part B).

    Energy conserving for albedo <= 1, reciprocal. Sampled by the cosine.
    """

    albedo: Value = spectrum(default=0.5, doc="share of light that is reflected", low=0.0, high=1.0, soft_high=True)

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        """albedo / pi |cos theta_i| above the surface."""
        above = (wo.z > 0.0) & (wi.z > 0.0)
        return self.albedo * where(above, abs(wi.z) * inv_pi, 0.0)

    def pdf(self, wo: Any, wi: Any) -> Any:
        """cos theta_i / pi above the surface."""
        return where((wo.z > 0.0) & (wi.z > 0.0), wi.z * inv_pi, 0.0)
