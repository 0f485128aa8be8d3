"""Compensation by a factor (Turquin2019)."""

from __future__ import annotations

from typing import Any, ClassVar

from ... import ops
from ...models.base import BSDF, Breach, Sample, bsdf
from ...ops import maximum
from .. import missing
from ..missing import Metal
from ._added import with_terms


class Turquin(BSDF):
    """f_base (1 + F0 (1 - E(mu_o)) / E(mu_o)): the lobe of single scattering, scaled up (Turquin2019, eq. 16).

    E(mu) is the albedo of the base at F = 1 and F0 the reflectance at normal incidence. At F = 1 nothing is lost; the
    returned light keeps the lobe's shape, so nothing new is to be sampled. The factor sees wo alone: not reciprocal.
    """

    base: BSDF = bsdf("the material to be compensated; it must not transmit")
    breaks: ClassVar[dict[str, Breach]] = {
        "reciprocity": Breach("the factor depends on the viewer's direction alone", 4.0, certain=False)
    }
    lossless = 2e-3

    def __post_init__(self) -> None:
        super().__post_init__()
        missing.check_base(self.base, "Turquin.base", transmitting=False)
        self.__dict__["_turned"] = missing.turned(self.base)

    @property
    def turned(self) -> bool:
        """Whether the base has two widths."""
        return self.__dict__["_turned"]

    @property
    def delta(self) -> str:
        return self.base.delta

    def tint(self, wo: Any) -> Any:
        """The base's."""
        return self.base.tint(wo)

    def derive(self) -> Any:
        """What does not depend on directions."""
        found = Metal.derive(self)
        return {**found, "f0": missing.normal_reflectance(self.base)}

    def _factor(self, wo: Any) -> Any:
        found = self.derived()
        lost = ops.minimum(Metal.missing(self, found, wo), 0.95)
        return found["f0"] * (lost / maximum(1.0 - lost, 0.05)) + 1.0

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        """The base times the factor."""
        return self.base.eval(wo, wi, mode) * self._factor(wo)

    def terms(self, wo: Any, wi: Any) -> Any:
        """The base, and what the factor adds to it; D, G and F of the base."""
        single = self.base.eval(wo, wi)
        return with_terms(self.base, wo, wi, single, single * (self._factor(wo) - 1.0))

    def pdf(self, wo: Any, wi: Any) -> Any:
        """The base's."""
        return self.base.pdf(wo, wi)

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Sample:
        """The base's, with the weight times the factor."""
        s = self.base.sample(wo, u, mode)
        return Sample(s.wi, s.weight * self._factor(wo), s.pdf, s.delta, s.eta)
