"""Multiple scattering by a random walk among the facets (Heitz2016)."""

from __future__ import annotations

from typing import Any

from ...errors import InputError
from ...models import microfacet
from ...models.base import Value, number
from ...optics import frame
from .. import missing, walk
from ._added import _Added


class RandomWalk(_Added):
    """f_base + the light of two and more bounces, estimated by one walk a call (Heitz2016).

    The exact multiple scattering of a Smith microsurface, in the mean: `eval` and the weight are random numbers, whose
    source is a hash of both directions and `seed`. A renderer asks for new directions at each sample and need not care;
    who asks for one pair many times gives `seed` an array. Needs ndf "ggx" and masking "smith-correlated". Dear, and
    noisy: it is here to judge the others. It cannot be recorded, so there is no shader code of it.
    """

    stochastic = True
    seed: Value = number(default=0.0, doc="shifts the random numbers")

    def __post_init__(self) -> None:
        super().__post_init__()
        base: Any = self.base
        if (base.ndf, base.masking) != ("ggx", "smith-correlated"):
            what = f"{base.ndf} with {base.masking} given, ggx with smith-correlated expected"
            raise InputError(what, "RandomWalk.base", "the walk's first bounce is exactly that")

    def _extra(self, found: Any, wo: Any, wi: Any, mode: str) -> Any:
        base: Any = self.base
        alpha, smooth = microfacet.widths(base.alpha)
        wo, wi = frame.rotate(wo, base.rotation), frame.rotate(wi, base.rotation)
        rng = walk.generator(wo, wi, self.seed)
        value, _ = walk.walk(base, wo, wi, rng, alpha, mode == "importance")
        live = (wo.z * wi.z != 0.0) if base.transmits else (wo.z > 0.0) & (wi.z > 0.0)
        return missing.where(live & ~smooth, value, 0.0)
