"""Parts that are switched off and still show: with declared limits, and a step that needs no declaration."""

from __future__ import annotations

from typing import Any, ClassVar

import gonio as go
from gonio.material import BSDF, number, spectrum
from gonio.material.parameters import Value
from gonio.ops import inv_pi, where


class RightLayer(BSDF):
    """A colored layer over paint, which covers a fraction of it."""

    caught_by: ClassVar[str] = ""

    albedo: Value = spectrum(0.7, "albedo of the paint", low=0.0, high=1.0)
    coat_weight: Value = number(0.5, "fraction under the layer", low=0.0, high=1.0)
    coat_color: Value = spectrum((0.9, 0.5, 0.2), "transmittance of the layer", low=0.0, high=1.0)

    limits: ClassVar[tuple[go.Limit, ...]] = (
        go.Limit({"coat_weight": 0.0}, mutes=("coat_*",), equals=lambda one: go.Lambert(one.albedo)),
    )

    def tint(self) -> Any:
        return 1.0 - self.coat_weight + self.coat_weight * self.coat_color

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        return self.albedo * self.tint() * where((wo.z > 0.0) & (wi.z > 0.0), wi.z * inv_pi, 0.0)

    def pdf(self, wo: Any, wi: Any) -> Any:
        return where((wo.z > 0.0) & (wi.z > 0.0), wi.z * inv_pi, 0.0)

    def sample(self, wo: Any, u: Any, mode: Any = "radiance") -> Any:
        return self.sample_cosine(wo, u, mode)


class LayerOfNoWeightTints(RightLayer):
    """A tenth of the layer's color is applied whatever its weight."""

    caught_by = "limits"

    def tint(self) -> Any:
        share = 0.1 + 0.9 * self.coat_weight
        return 1.0 - share + share * self.coat_color


class LayerOfNoWeightDarkens(RightLayer):
    """One part in a million is lost in the layer at weight 0 too, without its color."""

    caught_by = "limits"

    def tint(self) -> Any:
        return (1.0 - 1e-6) * (1.0 - self.coat_weight + self.coat_weight * self.coat_color)


class RightUndeclared(RightLayer):
    """The layer again, without a declaration."""

    limits = ()


class LayerThatStartsWithAStep(RightUndeclared):
    """A tenth of the light is lost as soon as there is a layer."""

    caught_by = "limits"

    def tint(self) -> Any:
        color = 1.0 - self.coat_weight + self.coat_weight * self.coat_color
        return where(self.coat_weight > 0.0, 0.9, 1.0) * color


LIMITS = [v for v in vars().values() if isinstance(v, type) and issubclass(v, BSDF) and v.__module__ == __name__]
