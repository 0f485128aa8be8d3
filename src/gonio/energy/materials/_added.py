"""A base and something added to it: what the compensated materials share. The broad lobes are those of a rule."""

from __future__ import annotations

from typing import Any, NamedTuple

from ... import ops
from ...models.base import BSDF, Sample, bsdf
from ...ops import safe_div, vec3, where
from .. import missing

ALMOST_ONE = 0.99999994  # the largest float32 under 1


class Parts(NamedTuple):
    """What a compensated material is the sum of, both times |cos theta_i|.

    single  the base alone: light scattered once
    multi   what is added: light scattered more than once
    """

    single: Any
    multi: Any


class AllParts(NamedTuple):
    """`Parts`, after the microfacet `Terms` of the base."""

    D: Any
    G: Any
    F: Any
    single: Any
    multi: Any


def with_terms(base: Any, wo: Any, wi: Any, single: Any, multi: Any) -> Any:
    """The parts, with D, G and F where the base has them."""
    if not hasattr(base, "terms"):
        return Parts(single, multi)
    d, g, f = base.terms(wo, wi)
    return AllParts(d, g, f, single, multi)


class _Added(BSDF):
    """base + `_extra`, sampled by a mixture of the base and of the rule's broad lobes."""

    base: BSDF = bsdf("the material to be compensated")
    _takes_glass = True  # whether the base may transmit
    _takes_any = False  # whether it may be another than a conductor or a dielectric

    def __post_init__(self) -> None:
        super().__post_init__()
        missing.check_base(self.base, f"{type(self).__name__}.base", self._takes_glass, self._takes_any)
        self.__dict__["_turned"] = missing.turned(self.base)

    @property
    def turned(self) -> bool:
        """Whether the base has two widths; known before anything runs."""
        return self.__dict__["_turned"]

    @property
    def transmits(self) -> bool:
        return self.base.transmits

    @property
    def delta(self) -> str:
        return self.base.delta

    def tint(self, wo: Any) -> Any:
        """The base's."""
        return self.base.tint(wo)

    def _rule(self) -> Any:
        return missing.rule(self.base)

    def _extra(self, found: Any, wo: Any, wi: Any, mode: str) -> Any:
        """What is added, times |cos theta_i|."""
        return self._rule().added(self, found, wo, wi, mode)

    def derive(self) -> Any:
        """What does not depend on directions."""
        return self._rule().derive(self)

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        """The base, plus what is added."""
        return self.base.eval(wo, wi, mode) + self._extra(self.derived(), wo, wi, mode)

    def terms(self, wo: Any, wi: Any) -> Any:
        """`Parts`, with D, G and F of the base where it has them."""
        extra = self._extra(self.derived(), wo, wi, "radiance")
        return with_terms(self.base, wo, wi, self.base.eval(wo, wi), extra)

    def pdf(self, wo: Any, wi: Any) -> Any:
        """The base's density and that of lobes proportional to (1 - E(mu_i)) mu_i, mixed by the energy each carries."""
        rule, found = self._rule(), self.derived()
        share = rule.share(self, found, wo)
        return self.base.pdf(wo, wi) * (1.0 - share) + rule.pdf(self, found, wo, wi) * share

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Sample:
        """u1 picks the base or the lobes, and is stretched to serve again."""
        rule, found = self._rule(), self.derived()
        share = rule.share(self, found, wo)
        broad = u.x < share
        again = where(broad, safe_div(u.x, share), safe_div(u.x - share, 1.0 - share))
        u = vec3(ops.minimum(again, ALMOST_ONE), u.y, u.z)
        s = self.base.sample(wo, u, mode)
        wi = where(broad, rule.sample(self, found, wo, u), s.wi)
        delta = s.delta & ~broad
        # what the base knows of its own sample is more exact than what its direction, once rounded, tells
        base_pdf = where(broad, self.base.pdf(wo, wi), s.pdf)
        base_value = where(broad, self.base.eval(wo, wi, mode), s.weight * s.pdf)
        density = base_pdf * (1.0 - share) + rule.pdf(self, found, wo, wi) * share
        pdf = where(broad | (s.pdf > 0.0), where(delta, s.pdf * (1.0 - share), density), 0.0)
        value = base_value + self._extra(found, wo, wi, mode)
        value = value * where((pdf > 0.0) & ~delta, safe_div(1.0, pdf), 0.0)
        eta = where(broad, rule.eta(self, wo, wi), s.eta)
        # a smooth base misses nothing: share = 0
        return Sample(wi, where(delta, s.weight * safe_div(1.0, 1.0 - share), value), pdf, delta, eta)
