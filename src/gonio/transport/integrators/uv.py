"""The integrator `uv`."""

from __future__ import annotations

from ...bridge.types import Color, SurfaceInteraction, UInt
from .base import Integrator


class UV(Integrator):
    """The surface parameters as a color, (u, v, 0)."""

    name = "uv"

    def show(self, si: SurfaceInteraction, key: UInt, index: UInt) -> Color:
        return self.mi.Color3f(si.uv.x, si.uv.y, 0)
