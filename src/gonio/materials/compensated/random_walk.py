"""Multiple scattering by a random walk among the facets (Heitz2016)."""

from __future__ import annotations

from typing import ClassVar

from ...energy.albedo import walk
from ...energy.compensation import lobe
from ...energy.compensation.missing import missing_energy
from ...errors import InputError
from ...material import Number, method, number
from ...ops import Direction, Mode, Spectrum, where
from ...optics import frame
from ...optics.roughness import widths
from ._compensated import _Compensated, lobe_ratio
from .kulla_conty import Derived, f_add


class RandomWalk(_Compensated):
    """f_base + the light of two and more bounces, estimated by one walk a call (Heitz2016).

    The exact multiple scattering of a Smith microsurface, in the mean: `eval` and the weight are random numbers, whose
    source is a hash of both directions and `seed`. A renderer asks for new directions at each sample and need not care;
    who asks for one pair many times gives `seed` an array. Needs ndf "ggx" and masking "smith-correlated". Slow and
    noisy: it is here to judge the others. It cannot be recorded, so there is no shader code of it.
    """

    stochastic: ClassVar[bool] = True
    seed: Number = number(default=0.0, doc="shifts the random numbers")

    def __post_init__(self) -> None:
        super().__post_init__()
        surface = self.base.microsurface
        if surface is None or (surface.ndf, surface.masking) != ("ggx", "smith-correlated"):
            what = f"{surface and f'{surface.ndf} with {surface.masking}'} given, ggx with smith-correlated expected"
            raise InputError(what, "RandomWalk.base", "the walk's first bounce is exactly that")

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """The base, plus an estimate of the light of two and more bounces."""
        return self.base.eval(wo, wi, mode) + self.compensation(wo, wi, mode)

    def compensation(self, wo: Direction, wi: Direction, mode: Mode) -> Spectrum:
        """One walk's light of two and more bounces along wi, times |cos theta_i|."""
        surface = self.base.microsurface
        assert surface is not None, "checked when it was made"
        alpha, smooth = widths(surface.alpha)
        wo, wi = frame.rotate(wo, surface.rotation), frame.rotate(wi, surface.rotation)
        rng = walk.generator(wo, wi, self.seed)
        value, _ = walk.walk(self.base, wo, wi, rng, alpha, mode == "importance")
        live = (wo.z * wi.z != 0.0) if surface.transmits else lobe.above(wo, wi)
        return where(live & ~smooth, value, 0.0)

    def derive(self) -> Derived:
        """Kulla-Conty's lobe, which is what is sampled."""
        lost = missing_energy(self.base)
        color = f_add(lost, "bounce")
        return Derived(lost, color, lobe_ratio(color, lost))
