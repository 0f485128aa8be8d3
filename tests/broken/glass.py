"""Mistakes in refraction."""

from __future__ import annotations

from typing import Any, ClassVar

from gonio.materials.microfacet.dielectric import Dielectric
from gonio.ops import where
from gonio.optics import fresnel
from gonio.optics.fresnel.exact import dielectric


class RightGlass(Dielectric):
    """The sound one."""

    caught_by: ClassVar[str] = ""


class WrongScaling(Dielectric):
    """The factor of radiance, (eta_o / eta_i)^2, stands in the wrong mode."""

    caught_by: ClassVar[str] = "reciprocity"

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        return super().eval(wo, wi, "importance" if mode == "radiance" else "radiance")

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Any:
        return super().sample(wo, u, "importance" if mode == "radiance" else "radiance")


class FresnelInsideOut(Dielectric):
    """Fresnel's formula is given the index of the other side: total reflection from outside."""

    caught_by: ClassVar[str] = "reciprocity"

    def reflectance(self, cos_o: Any, cos_t: Any, eta: Any) -> Any:
        inverse = 1.0 / eta
        turned = fresnel.cos_transmitted(cos_o, inverse)
        return where(cos_t > 0.0, dielectric(cos_o, turned, inverse), 1.0)


GLASS = [RightGlass, WrongScaling, FresnelInsideOut]
