"""Tables without a sampling method of their own, which are sampled with a guide computed from their values."""

from __future__ import annotations

from functools import cached_property

from ...material import guide_search
from ...material.guide import Guide
from ...ops import Direction, Scalar, Spectrum, where
from .base import Measurement, above


class Guided(Measurement):
    """A table that is sampled with a guide (`gonio.material.guide`), computed from its values."""

    transmits = False

    def eval(self, wo: Direction, wi: Direction) -> Spectrum:
        """f cos theta_i, from which the guide is computed; 0 below the surface."""
        return where(above(wo, wi), self.value(wo, wi), 0.0)

    @cached_property
    def guide(self) -> Guide:
        return guide_search.of_values(self)

    def prepare(self) -> None:
        """Compute the guide with which directions are sampled."""
        _ = self.guide

    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        return self.guide.pdf(self, wo, wi)

    def draw(self, wo: Direction, u: Direction) -> tuple[Direction, Scalar]:
        wi = self.guide.draw(self, wo, u)
        return wi, self.guide.pdf(self, wo, wi)
