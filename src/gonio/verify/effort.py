"""The effort of a run: numbers of directions and samples, and accuracy."""

from __future__ import annotations

from dataclasses import dataclass

from .cells import CELLS


@dataclass(frozen=True)
class Effort:
    """The effort of a run.

    name             its name in `EFFORTS`
    pairs            number of pairs of directions for the pointwise laws
    log_samples      binary logarithm of the number of samples per wo in the chi-square test
    furnace          number of directions wo in the furnace
    furnace_samples  number of samples per wo in the furnace
    accuracy         accuracy that is requested of integrals
    widths           other values of alpha at which sampling is tested
    places           number of other parameter values at which every law is tested (`gonio.verify.box`)
    cells            rows and columns of the chi-square test, per side of the surface
    full             whether it is the effort for the given parameter values; directions then reach 89.9 degrees, and
                     the declared properties of the material are checked
    attempts         maximum number of attempts at an integral, each with more samples, if light is missed, as in a
                     streak that is a thousand times as long as it is wide
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
    attempts: int = 3


EFFORTS = {
    "quick": Effort("quick", 1 << 13, 18, 12, 1 << 15, 1e-4, places=8),
    "default": Effort("default", 1 << 16, 20, 32, 1 << 17, 3e-5, (0.005, 1.0), 22),
    "deep": Effort("deep", 1 << 19, 23, 64, 1 << 20, 1e-5, (0.005, 0.02, 0.05, 0.2, 0.5, 1.0), 72),
}
# At the other parameter values, directions do not reach the horizon: a lobe of width 2e-4 at 89.9 degrees is narrower
# than the spacing of float32 directions.
ELSEWHERE = {
    "quick": Effort("quick", 1 << 11, 14, 3, 1 << 12, 1e-3, cells=(30, 60), full=False, attempts=1),
    "default": Effort("default", 1 << 12, 16, 4, 1 << 14, 3e-4, cells=(30, 60), full=False),
    "deep": Effort("deep", 1 << 14, 18, 8, 1 << 16, 1e-4, cells=(50, 100), full=False),
}
