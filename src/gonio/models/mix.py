"""Two materials in one place."""

from __future__ import annotations

from typing import Any

from ..ops import safe_div, vec3, where
from .base import BSDF, Sample, Value, bsdf, number


class Mix(BSDF):
    """(1 - weight) a + weight b: the average of two materials' values, as of a surface finely patched with both."""

    a: BSDF = bsdf("the material at weight 0")
    b: BSDF = bsdf("the material at weight 1")
    weight: Value = number(default=0.5, doc="share of b", low=0.0, high=1.0)

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        """(1 - weight) a + weight b."""
        return self.a.eval(wo, wi, mode) * (1.0 - self.weight) + self.b.eval(wo, wi, mode) * self.weight

    def pdf(self, wo: Any, wi: Any) -> Any:
        """Mixture of the two densities."""
        return self.a.pdf(wo, wi) * (1.0 - self.weight) + self.b.pdf(wo, wi) * self.weight

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Sample:
        """u1 picks a material and is stretched to serve it again; a density sample is weighed against both."""
        w = self.weight
        pick_b = u.x < w
        again = where(pick_b, safe_div(u.x, w), safe_div(u.x - w, 1.0 - w))
        u = vec3(where(again < ALMOST_ONE, again, ALMOST_ONE), u.y, u.z)
        sa, sb = self.a.sample(wo, u, mode), self.b.sample(wo, u, mode)
        wi = where(pick_b, sb.wi, sa.wi)
        delta = where(pick_b, sb.delta, sa.delta)
        chosen_pdf = where(pick_b, sb.pdf * w, sa.pdf * (1.0 - w))
        valid = chosen_pdf > 0.0
        # the share cancels in a delta lobe's weight: w f / (w p)
        pdf = where(valid, where(delta, chosen_pdf, self.pdf(wo, wi)), 0.0)
        density_weight = self.eval(wo, wi, mode) * where(valid & ~delta, safe_div(1.0, pdf), 0.0)
        delta_weight = where(pick_b, sb.weight, sa.weight)
        return Sample(wi, where(delta, delta_weight, density_weight), pdf, delta, where(pick_b, sb.eta, sa.eta))

    def tint(self, wo: Any) -> Any:
        """The average of both."""
        return self.a.tint(wo) * (1.0 - self.weight) + self.b.tint(wo) * self.weight

    @property
    def transmits(self) -> bool:
        return self.a.transmits or self.b.transmits

    @property
    def delta(self) -> str:
        return self.a.delta if self.a.delta == self.b.delta else "maybe"

    @property
    def ambient(self) -> Any:
        """Factor of the scene's ambient light."""
        return getattr(self.a, "ambient", 0.0) * (1.0 - self.weight) + getattr(self.b, "ambient", 0.0) * self.weight


ALMOST_ONE = 0.99999994  # the largest float32 under 1
