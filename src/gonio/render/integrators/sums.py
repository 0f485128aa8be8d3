"""What the lanes of a picture add up."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from .. import engine
from ..types import Float, Mask, UInt, Whole


@dataclass
class Sums:
    """Sums in 64 bits, one entry a lane: radiance and features of first vertices, radiance of the rest of the paths.

    splats  red, green and blue that particles have brought, one entry a pixel, whole numbers; none where there are none

    A value that is not finite (a BSDF's overflow) is left out and counted, so that it does not cost the pixel.
    """

    near: list[Float]
    far: list[Float]
    invalid: UInt
    splats: list[Whole] = field(default_factory=list)

    @staticmethod
    def zeros(mi: ModuleType, lanes: int, features: int, pixels: int = 0) -> Sums:
        """`pixels`: of a picture that is splatted, else 0."""
        near = [dr.zeros(mi.Float64, lanes) for _ in range(3 + features)]
        splats = [dr.zeros(mi.Int64, pixels) for _ in range(3 if pixels else 0)]
        sums = Sums(near, [dr.zeros(mi.Float64, lanes) for _ in range(3)], dr.zeros(mi.UInt32, lanes), splats)
        dr.make_opaque(sums)  # zeros as data: else the first pass would be a kernel of its own
        return sums

    def at(self, lane: UInt) -> Sums:
        """Those of the lanes with these numbers."""
        near, far = ([dr.gather(type(s), s, lane) for s in sums] for sums in (self.near, self.far))
        return Sums(near, far, dr.gather(type(self.invalid), self.invalid, lane), self.splats)

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Each sum by its name; a view where the device is the CPU, but for splats, which are added to in place."""
        found = {f"near{i}": np.asarray(values) for i, values in enumerate(self.near)}
        found |= {f"far{i}": np.asarray(values) for i, values in enumerate(self.far)}
        found |= {f"splat{i}": np.array(values) for i, values in enumerate(self.splats)}
        return {**found, "invalid": np.asarray(self.invalid)}

    @staticmethod
    def of_arrays(mi: ModuleType, arrays: Mapping[str, NDArray[Any]], lanes: int, like: Sums) -> Sums:
        """Sums of `arrays`. Raises ValueError where they are not so many of so many lanes."""
        known = like.arrays()
        for name, values in known.items():
            entries = len(values) if name.startswith("splat") else lanes
            if name not in arrays or arrays[name].shape != (entries,) or arrays[name].dtype != values.dtype:
                raise ValueError(f"no sums '{name}' of {lanes} lanes")

        def taken(name: str) -> Float:
            kind = {"f": mi.Float64, "i": mi.Int64, "u": mi.UInt32}[arrays[name].dtype.kind]
            return engine.own(kind, arrays[name])

        near = [taken(f"near{i}") for i in range(len(like.near))]
        found = Sums(near, [taken(f"far{i}") for i in range(len(like.far))], taken("invalid"))
        found.splats = [taken(f"splat{i}") for i in range(len(like.splats))]
        return found

    def add_near(self, values: Sequence[Float]) -> Sums:
        near, invalid = self._add(self.near, values, True)
        return Sums(near, self.far, invalid, self.splats)

    def add_far(self, values: Sequence[Float], active: Mask) -> Sums:
        far, invalid = self._add(self.far, values, active)
        return Sums(self.near, far, invalid, self.splats)

    def _add(self, sums: list[Float], values: Sequence[Float], active: Mask) -> tuple[list[Float], UInt]:
        finite = dr.isfinite(sum(values))
        add = [s + type(s)(dr.select(finite & active, v, 0)) for s, v in zip(sums, values, strict=True)]
        return add, self.invalid + dr.select(finite | ~dr.mask_t(finite)(active), type(self.invalid)(0), 1)
