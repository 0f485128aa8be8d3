"""The film: the accumulated samples of each pixel, from which `Render.image` computes the picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from ..bridge.faults.borrowed_memory import own
from ..bridge.types import Float, Mask, UInt, Whole


@dataclass
class Sums:
    """Accumulated samples in double precision, with one entry per lane.

    The sums are those of the radiance (r, g, b, and further values of a complete sample) and of the features at the
    first hits. A value that is not finite, due to overflow in a BSDF, is skipped and counted, so the other samples of
    the pixel remain valid.

    splats  red, green and blue of particles as integers, one entry per pixel; empty for integrators without splats
    """

    radiance: list[Float]
    features: list[Float]
    invalid: UInt
    splats: list[Whole] = field(default_factory=list)

    @staticmethod
    def zeros(mi: ModuleType, lanes: int, radiance: int, features: int, pixels: int = 0) -> Sums:
        """Empty sums of the given sizes; `pixels` is 0 for pictures without splats."""
        totals, more = ([dr.zeros(mi.Float64, lanes) for _ in range(count)] for count in (radiance, features))
        splats = [dr.zeros(mi.Int64, pixels) for _ in range(3 if pixels else 0)]
        sums = Sums(totals, more, dr.zeros(mi.UInt32, lanes), splats)
        dr.make_opaque(sums)  # as kernel data, because literal zeros would cause a different kernel for the first pass
        return sums

    def at(self, lane: UInt) -> Sums:
        """The sums of the lanes with the given numbers."""
        totals, more = ([dr.gather(type(s), s, lane) for s in sums] for sums in (self.radiance, self.features))
        return Sums(totals, more, dr.gather(type(self.invalid), self.invalid, lane), self.splats)

    def arrays(self) -> dict[str, NDArray[Any]]:
        """The sums by name: views on the CPU, except splats, which are copied because they change in place."""
        totals = {f"radiance{i}": np.asarray(values) for i, values in enumerate(self.radiance)}
        totals |= {f"feature{i}": np.asarray(values) for i, values in enumerate(self.features)}
        totals |= {f"splat{i}": np.array(values) for i, values in enumerate(self.splats)}
        return {**totals, "invalid": np.asarray(self.invalid)}

    @staticmethod
    def of_arrays(mi: ModuleType, arrays: Mapping[str, NDArray[Any]], lanes: int, like: Sums) -> Sums:
        """Sums from the result of `arrays`. Raises ValueError if the number or size of the arrays does not match."""
        known = like.arrays()
        for name, values in known.items():
            entries = len(values) if name.startswith("splat") else lanes
            if name not in arrays or arrays[name].shape != (entries,) or arrays[name].dtype != values.dtype:
                raise ValueError(f"no sums '{name}' of {lanes} lanes")

        def restored(name: str) -> Float:
            kind = {"f": mi.Float64, "i": mi.Int64, "u": mi.UInt32}[arrays[name].dtype.kind]
            return own(kind, arrays[name])

        radiance = [restored(f"radiance{i}") for i in range(len(like.radiance))]
        totals = Sums(radiance, [restored(f"feature{i}") for i in range(len(like.features))], restored("invalid"))
        totals.splats = [restored(f"splat{i}") for i in range(len(like.splats))]
        return totals

    def add(self, radiance: Sequence[Float], ended: Mask, features: Sequence[Float], begun: Mask) -> Sums:
        """Add the radiance of samples that have ended, and the features of samples that have begun."""
        totals, lost = self._add(self.radiance, radiance, ended)
        more, lost_too = self._add(self.features, features, begun)
        lost = lost if lost_too is None else lost | lost_too
        return Sums(totals, more, self.invalid + dr.select(lost, type(self.invalid)(1), 0), self.splats)

    def _add(self, sums: list[Float], values: Sequence[Float], active: Mask) -> tuple[list[Float], Mask]:
        """The sums, and a mask of the lanes with values that are not finite; the mask is None if there are no sums."""
        if not sums:
            return sums, None
        finite = dr.isfinite(sum(values))
        add = [s + type(s)(dr.select(finite & active, v, 0)) for s, v in zip(sums, values, strict=True)]
        return add, ~finite & active
