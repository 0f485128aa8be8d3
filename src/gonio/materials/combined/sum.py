"""The sum of two materials."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ...errors import InputError
from ...material.bsdf import BSDF, KnownViolation
from ...material.calling import method
from ...material.parameters import bsdf
from ...material.polarization import Polarized
from ...ops import Direction, Mask, Mode, Spectrum


class Sum(BSDF):
    """a + b: the sum of two materials, which is used in fits to measurements, such as "lambert+conductor" (Ngan2005).

    The sum can reflect more light than it receives. Directions are sampled from a guide, a density tabulated from
    `eval`. A material that consists only of a delta lobe is rejected, because its `eval` is 0.
    """

    a: BSDF = bsdf("the first material")
    b: BSDF = bsdf("the second material")

    known_violations: ClassVar[Mapping[str, KnownViolation]] = {
        "energy": KnownViolation("the sum of the two materials may reflect more light than arrives", 1e3, certain=False)
    }

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, part in (("a", self.a), ("b", self.b)):
            if part.delta == "always":
                what = f"{type(part).__name__} is a delta lobe, which has no value to add"
                raise InputError(what, f"Sum.{name}", "give it a width, or use mix")

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """The sum of the two values."""
        return self.a.eval(wo, wi, mode) + self.b.eval(wo, wi, mode)

    def polarized(self, wo: Direction, wi: Direction, delta: Mask, mode: Mode = "radiance") -> tuple[Polarized, ...]:
        """The polarized parts of the two materials."""
        return (*self.a.polarized(wo, wi, delta, mode), *self.b.polarized(wo, wi, delta, mode))

    def tint(self, wo: Direction) -> Spectrum:
        """The sum of the two tints."""
        return self.a.tint(wo) + self.b.tint(wo)

    @property
    def transmits(self) -> bool:
        return self.a.transmits or self.b.transmits

    @property
    def two_sided(self) -> bool:
        return self.a.two_sided and self.b.two_sided
