"""Tables that bring no density of their own: they are sampled by a guide found from their values."""

from __future__ import annotations

from functools import cached_property

from ...ops import Direction, Scalar
from .. import colours
from ..guide import Floats, Guide
from .base import Measurement


class Guided(Measurement):
    """What is sampled by a `Guide` over the luminance of its own values."""

    @cached_property
    def guide(self) -> Guide:
        def luminance(wo: Floats, wi: Floats) -> Floats:
            return self.rgb(wo, wi) @ colours.LUMINANCE

        return Guide(luminance)

    def prepare(self) -> None:
        """The guide."""
        _ = self.guide

    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        return self.guide.pdf(wo, wi)

    def draw(self, wo: Direction, u: Direction) -> tuple[Direction, Scalar]:
        return self.guide.draw(wo, u)
