"""Wrong materials in the manner of Kulla and Conty, Turquin, and Fdez-Aguera."""

from typing import ClassVar

import gonio as go
import drjit as dr
from gonio import ops
from gonio.energy.compensation import missing
from gonio.material.binding import bound_copy
from gonio.materials.compensated import kulla_conty
from gonio.materials.compensated._compensated import lobe_ratio
from gonio.ops import backend
from gonio.optics import frame


def lit(wo, wi):
    """Whether both directions are above the surface."""
    return (wo.z > 0.0) & (wi.z > 0.0)


class KullaContyTimesPi(go.KullaConty):
    """Kulla's and Conty's compensation."""

    fault: ClassVar[str] = "the 1/pi of the added lobe is missing: pi times what was lost is given back"
    cause: ClassVar[str] = "pi missing in the added lobe"
    kind: ClassVar[str] = "compensated"
    base: go.BSDF = go.bsdf("the material to be compensated", go.Conductor(alpha=0.5))

    def compensation(self, wo, wi, mode):
        return super().compensation(wo, wi, mode) * ops.pi


class KullaContyViewerOnly(go.KullaConty):
    """Kulla's and Conty's compensation, with a diffuse lobe."""

    fault: ClassVar[str] = (
        "the added lobe is (1 - E(o)) / pi without the light's factor: right in energy, not reciprocal"
    )
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "compensated"
    base: go.BSDF = go.bsdf("the material to be compensated", go.Conductor(alpha=0.8))

    def compensation(self, wo, wi, mode):
        value = self.M(wo) * ops.where(lit(wo, wi), wi.z * ops.inv_pi, 0.0)
        return self.derived.f_add * value


class KullaContyPdfOfBase(go.KullaConty):
    """Kulla's and Conty's compensation."""

    fault: ClassVar[str] = "pdf is the base's alone, while sample draws from the added lobe too"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "compensated"
    base: go.BSDF = go.bsdf("the material to be compensated", go.Conductor(alpha=0.7))

    def pdf(self, wo, wi):
        return self.base.pdf(wo, wi)


class KullaContyOtherWidth(go.KullaConty):
    """Kulla's and Conty's compensation, its tables indexed by roughness."""

    fault: ClassVar[str] = "what is lost is looked up at sqrt(alpha), the artist's roughness: too much is given back"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "compensated"
    base: go.BSDF = go.bsdf("the material to be compensated", go.Conductor(alpha=0.3))

    def derive(self):
        wider = bound_copy(self.base, {"alpha": ops.sqrt(self.base.alpha)})
        lost = missing.missing_energy(wider, self.average)
        f_add = kulla_conty.f_add(lost, self.color)
        return kulla_conty.Derived(lost, f_add, lobe_ratio(f_add, lost))


class KullaContyCutGradient(go.KullaConty):
    """Kulla's and Conty's compensation; what is added is held fixed by the optimizer."""

    fault: ClassVar[str] = "the added light is detached from the gradient: derivatives by alpha miss its part"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "compensated"
    base: go.BSDF = go.bsdf("the material to be compensated", go.Conductor(alpha=0.6))

    def compensation(self, wo, wi, mode):
        value = super().compensation(wo, wi, mode)
        return dr.detach(value) if backend.is_drjit(value) else value


class KullaContyColourTwice(go.KullaConty):
    """Kulla's and Conty's compensation of a metal by the series of its bounces."""

    fault: ClassVar[str] = "the series of bounces divides by 1 - F_avg (1 - E_avg) twice: at F = 1 light is made"
    cause: ClassVar[str] = "1 - F_avg (1 - E_avg) divided by twice in the added colour"
    kind: ClassVar[str] = "compensated"
    base: go.BSDF = go.bsdf("the material to be compensated", go.Conductor(alpha=0.7))

    def derive(self):
        d = super().derive()
        twice = 1.0 / (1.0 - d.missing.F_avg * d.missing.average)
        return d._replace(f_add=d.f_add * twice)


class TurquinUndeclared(go.Turquin):
    """Turquin's compensation."""

    fault: ClassVar[str] = "the factor sees the viewer alone, and the breach of reciprocity is not declared"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "compensated"
    known_violations: ClassVar = {}
    base: go.BSDF = go.bsdf("the material to be compensated", go.Conductor(alpha=0.8))


class TurquinWeight(go.Turquin):
    """Turquin's compensation."""

    fault: ClassVar[str] = "the sample's weight is the base's: the factor is missing in it"
    cause: ClassVar[str] = "compensation's factor missing in the weight"
    kind: ClassVar[str] = "compensated"
    base: go.BSDF = go.bsdf("the material to be compensated", go.Conductor(alpha=0.8))

    def sample(self, wo, u, mode="radiance"):
        return self.base.sample(wo, u, mode)


class TurquinOtherEnd(go.Turquin):
    """Turquin's compensation."""

    fault: ClassVar[str] = "the factor is taken at the light's direction: the furnace is neither white nor below 1"
    cause: ClassVar[str] = "wi where wo belongs in the factor"
    kind: ClassVar[str] = "compensated"
    base: go.BSDF = go.bsdf("the material to be compensated", go.Conductor(alpha=0.8))

    def eval(self, wo, wi, mode="radiance"):
        return self.base.eval(wo, wi, mode) * self._factor(wi)

    def sample(self, wo, u, mode="radiance"):
        s = self.base.sample(wo, u, mode)
        return go.Sample(s.wi, s.weight * self._factor(s.wi), s.pdf, s.delta, s.eta)


class FdezAgueraWholeDiffuse(go.FdezAguera):
    """Fdez-Aguera's compensation."""

    fault: ClassVar[str] = "F_ms / pi is added without E_ms: light is made, the more the smoother the base is"
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "compensated"
    base: go.BSDF = go.bsdf("the material to be compensated", go.Conductor(alpha=0.4))

    def compensation(self, wo, wi, mode):
        value = super().compensation(wo, wi, mode)
        return value * ops.safe_div(1.0, ops.maximum(self.M(wo), 1e-3))


class HomeMadeCompensation(go.BSDF):
    """A GGX metal and a compensation by a fit of 1 - E, as found in shaders."""

    fault: ClassVar[str] = (
        "1 - E is fitted, but its average is not that of the fit: white furnaces gain or lose percents"
    )
    cause: ClassVar[str] = ""
    kind: ClassVar[str] = "compensated"
    lossless_tolerance: ClassVar[float | None] = 5e-3
    alpha: go.Number = go.number(0.6, "width of the facets", low=0.05, high=1.0)
    r0: go.Colour = go.spectrum((1.0, 0.8, 0.4), "reflectance at the normal", low=0.0, high=1.0)

    def eval(self, wo, wi):
        ggx = ops.vec2(self.alpha, self.alpha)
        m = frame.half_vector(wo, wi)
        g = 1.0 / (1.0 + GGX.Lambda(wo, ggx) + GGX.Lambda(wi, ggx))
        f = self.r0 + (1.0 - self.r0) * ops.pow(1.0 - ops.dot(wo, m), 5.0)
        single = f * ops.safe_div(GGX.D(m, ggx) * g, 4.0 * wo.z)
        lost = ops.sqr(self.alpha) * 0.55
        multi = lost * lost * (1.2 - wo.z) * (1.2 - wi.z) * wi.z / (ops.pi * 0.35)
        return ops.where(lit(wo, wi), single + self.r0 * multi, 0.0)


GGX = go.NDF.family.get("ggx")

MUTANTS = [
    KullaContyTimesPi, KullaContyViewerOnly, KullaContyPdfOfBase, KullaContyOtherWidth, KullaContyCutGradient,
    KullaContyColourTwice, TurquinUndeclared, TurquinWeight, TurquinOtherEnd, FdezAgueraWholeDiffuse,
    HomeMadeCompensation,
]  # fmt: skip
SOUND = []
