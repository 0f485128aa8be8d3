"""Multiple scattering by a random walk on the facets (Heitz2016)."""

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
    """f_base plus light that bounces twice or more, estimated by one random walk per call (Heitz2016).

    `eval` and the sample weight are random estimates whose expectation is the exact multiple scattering of a Smith
    microsurface. The random numbers are generated from a hash of the two directions and `seed`. A renderer uses new
    directions for each sample and needs no seed; for independent estimates at the same pair of directions, pass an
    array as `seed`. The base must have the ndf "ggx" and the masking term "smith-correlated". The method is slow and
    noisy and is intended as a reference. The walk cannot be recorded, so no shader code is available.
    """

    stochastic: ClassVar[bool] = True
    _loss: ClassVar[float | None] = None
    seed: Number = number(default=0.0, doc="seed of the random numbers")

    def __post_init__(self) -> None:
        super().__post_init__()
        surface = self.base.microsurface
        if surface is None or (surface.ndf, surface.masking) != ("ggx", "smith-correlated"):
            what = f"{surface and f'{surface.ndf} with {surface.masking}'} given, ggx with smith-correlated expected"
            raise InputError(what, "RandomWalk.base", "the first bounce of the walk is exactly this material")

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """The base, plus an estimate of the light that bounces twice or more."""
        return self.base.eval(wo, wi, mode) + self.compensation(wo, wi, mode)

    def compensation(self, wo: Direction, wi: Direction, mode: Mode) -> Spectrum:
        """The light that one walk scatters along wi after two or more bounces, times |cos theta_i|."""
        surface = self.base.microsurface
        assert surface is not None, "checked on construction"
        alpha, smooth = widths(surface.alpha)
        wo, wi = frame.rotate(wo, surface.rotation), frame.rotate(wi, surface.rotation)
        rng = walk.generator(wo, wi, self.seed)
        value, _ = walk.walk(self.base, wo, wi, rng, alpha, mode == "importance")
        live = (wo.z * wi.z != 0.0) if surface.transmits else lobe.above(wo, wi)
        return where(live & ~smooth, value, 0.0)

    def derive(self) -> Derived:
        """The Kulla-Conty lobe, which is used for sampling."""
        lost = missing_energy(self.base)
        color = f_add(lost, "bounce")
        return Derived(lost, color, lobe_ratio(color, lost))
