"""Compensated metal and glass, one piece of the compensation wrong."""

from typing import ClassVar

import gonio as go
from gonio import ops

METAL = go.Conductor(eta=(0.18, 0.42, 1.37), k=(3.42, 2.35, 1.77), alpha=0.8)
GLASS = go.Dielectric(eta=1.5, alpha=0.8)


class KullaNotReciprocal(go.KullaConty):
    """Kulla and Conty's lobe of the viewer's direction alone."""

    base: go.BSDF = go.bsdf("the material to be compensated", METAL)
    fault: ClassVar[str] = "the lobe is (1 - E(mu_o))^2 / (pi (1 - E_avg)), mu_o twice: not reciprocal"
    cause: ClassVar[str] = "mu_o in place of mu_i in 1 - E"
    kind: ClassVar[str] = "compensated"

    def compensation(self, wo, wi, mode):
        return super().compensation(wo, wi, mode) * ops.safe_div(self.M(wo), self.M(wi))


class KullaNoPi(go.KullaConty):
    """Kulla and Conty's lobe without its 1 / pi."""

    base: go.BSDF = go.bsdf("the material to be compensated", METAL)
    fault: ClassVar[str] = "the lobe lacks 1 / pi and returns three times what is missing"
    cause: ClassVar[str] = "pi missing in the lobe"
    kind: ClassVar[str] = "compensated"

    def compensation(self, wo, wi, mode):
        return super().compensation(wo, wi, mode) * ops.pi


class KullaSharesSwapped(go.KullaConty):
    """Kulla and Conty's lobe, whose pdf exchanges the probabilities of its two lobes."""

    base: go.BSDF = go.bsdf("the material to be compensated", METAL)
    fault: ClassVar[str] = "pdf weighs the base's density with the lobe's share and the other way round"
    cause: ClassVar[str] = "probabilities of the lobes swapped in pdf"
    kind: ClassVar[str] = "compensated"

    def pdf(self, wo, wi):
        share = self._share(wo)
        return self.base.pdf(wo, wi) * share + self._lobe_pdf(wo, wi) * (1.0 - share)


class KullaGlassMode(go.KullaConty):
    """Compensated glass whose added lobe never carries the radiance factor."""

    base: go.BSDF = go.bsdf("the material to be compensated", GLASS)
    fault: ClassVar[str] = "the lobe that is added in transmission lacks (eta_o / eta_i)^2 in radiance"
    cause: ClassVar[str] = "mode ignored in the second lobe"
    kind: ClassVar[str] = "compensated"

    def compensation(self, wo, wi, mode):
        return super().compensation(wo, wi, "importance")


class KullaGlassBothSides(go.KullaConty):
    """Compensated glass that returns all that is missing on both sides."""

    base: go.BSDF = go.bsdf("the material to be compensated", GLASS)
    fault: ClassVar[str] = "the missing light is given back whole on each side, not split between them"
    cause: ClassVar[str] = "share of the side missing"
    kind: ClassVar[str] = "compensated"

    def compensation(self, wo, wi, mode):
        return super().compensation(wo, wi, mode) * ops.safe_div(1.0, self.derived.missing.share(wo, wi))


class TurquinOtherSide(go.Turquin):
    """Turquin's factor of wo in eval and of wi in the weight."""

    base: go.BSDF = go.bsdf("the material to be compensated; it must not transmit", METAL)
    fault: ClassVar[str] = "the weight of a sample is scaled by the factor at wi, eval by that at wo"
    cause: ClassVar[str] = "factor at wi in place of wo in the weight"
    kind: ClassVar[str] = "compensated"

    def sample(self, wo, u, mode="radiance"):
        s = self.base.sample(wo, u, mode)
        return go.Sample(s.wi, s.weight * self._factor(s.wi), s.pdf, s.delta, s.eta)


MUTANTS = [
    KullaNotReciprocal,
    KullaNoPi,
    KullaSharesSwapped,
    KullaGlassMode,
    KullaGlassBothSides,
    TurquinOtherSide,
]
SOUND = []
