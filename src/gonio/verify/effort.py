"""The cost of a trial: directions, samples, accuracy."""

from __future__ import annotations

from dataclasses import dataclass

from .cells import CELLS


@dataclass(frozen=True)
class Effort:
    """The cost of a trial.

    pairs            pairs of directions for the pointwise laws
    log_samples      binary logarithm of the samples of the chi-square test, per direction
    furnace          directions wo of the furnace
    furnace_samples  calls of `sample` in the furnace, per direction
    accuracy         requested of integrals
    widths           other widths of microfacet distributions at which sampling is tested
    cells            rows and columns of the chi-square test, per side of the surface
    full             whether the given values are tested: directions reach 89.9 degrees, and claims are checked
    places           number of other parameter values at which every law is tested, see `gonio.verify.box`
    """

    name: str
    pairs: int
    log_samples: int
    furnace: int
    furnace_samples: int
    accuracy: float
    widths: tuple[float, ...] = ()
    places: int = 0
    cells: tuple[int, int] = CELLS
    full: bool = True


EFFORTS = {
    "quick": Effort("quick", 1 << 13, 18, 12, 1 << 15, 1e-4, places=8),
    "default": Effort("default", 1 << 16, 20, 32, 1 << 17, 3e-5, (0.005, 1.0), 22),
    "deep": Effort("deep", 1 << 19, 23, 64, 1 << 20, 1e-5, (0.005, 0.02, 0.05, 0.2, 0.5, 1.0), 72),
}
# At the other parameter values, directions stop short of the horizon: a lobe of width 2e-4 at 89.9 degrees is narrower
# than the steps of float32 directions.
ELSEWHERE = {
    "quick": Effort("quick", 1 << 11, 14, 3, 1 << 12, 1e-3, cells=(30, 60), full=False),
    "default": Effort("default", 1 << 12, 16, 4, 1 << 14, 3e-4, cells=(30, 60), full=False),
    "deep": Effort("deep", 1 << 14, 18, 8, 1 << 16, 1e-4, cells=(50, 100), full=False),
}
