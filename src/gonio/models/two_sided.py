"""A material on both sides of a surface."""

from __future__ import annotations

from typing import Any

from ..errors import InputError
from ..ops import function, vec3, where
from .base import BSDF, Sample, bsdf


class TwoSided(BSDF):
    """The base material on both sides: from behind it looks as from the front. The base must not transmit."""

    base: BSDF = bsdf("the material, which must not transmit")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.base.transmits:
            raise InputError(
                f"{type(self.base).__name__} transmits, a material that only reflects expected",
                "TwoSided.base",
                "a transmitting material has two sides of its own",
            )

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        """The base's value, with both directions turned to wo's side."""
        return self.base.eval(_turned(wo, wo), _turned(wi, wo), mode)

    def pdf(self, wo: Any, wi: Any) -> Any:
        """The base's density, likewise."""
        return self.base.pdf(_turned(wo, wo), _turned(wi, wo))

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Sample:
        """The base's sample, turned back."""
        s = self.base.sample(_turned(wo, wo), u, mode)
        return Sample(_turned(s.wi, wo), s.weight, s.pdf, s.delta, s.eta)

    def tint(self, wo: Any) -> Any:
        """The base's."""
        return self.base.tint(_turned(wo, wo))

    @property
    def delta(self) -> str:
        return self.base.delta

    @property
    def ambient(self) -> Any:
        """Factor of the scene's ambient light."""
        return getattr(self.base, "ambient", 0.0)


@function
def _turned(w: Any, wo: Any) -> Any:
    """w with its z mirrored where wo is below the surface."""
    return vec3(w.x, w.y, where(wo.z < 0.0, -w.z, w.z))
