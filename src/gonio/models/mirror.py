"""The ideal mirror."""

from __future__ import annotations

from typing import Any

from ..ops import where
from ..optics import frame
from .base import BSDF, Sample, Value, spectrum


class Mirror(BSDF):
    """Ideal reflection: all light leaves at theta_o = theta_i, phi_o = phi_i + pi: a delta lobe (course notes, B)."""

    albedo: Value = spectrum(default=1.0, doc="share of light that is reflected", low=0.0, high=1.0, soft_high=True)

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        """0: a delta lobe has no finite value."""
        return self.albedo * (0.0 * wo.z)

    def pdf(self, wo: Any, wi: Any) -> Any:
        """0: a delta lobe has no density."""
        return 0.0 * wo.z

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Sample:
        """wo mirrored at the normal."""
        above = wo.z > 0.0
        one = where(above, 1.0 + 0.0 * wo.z, 0.0)
        return Sample(frame.mirror(wo), self.albedo * one, one, above, 1.0 + 0.0 * wo.z)

    @property
    def delta(self) -> str:
        return "always"
