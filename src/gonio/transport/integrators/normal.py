"""The integrator `normal`."""

from __future__ import annotations

from ...bridge.types import Color, SurfaceInteraction, UInt
from .base import Integrator


class Normal(Integrator):
    """The shading normal as a color, (n + 1) / 2; black where nothing is hit."""

    name = "normal"

    def show(self, si: SurfaceInteraction, key: UInt, index: UInt) -> Color:
        return (si.sh_frame.n + 1) * 0.5
