"""Path tracing."""

from __future__ import annotations

from .base import Settings
from .transport import Transport


class Path(Transport):
    """Path tracing: light and BSDF sampling combined at every vertex (max_depth - 1 shaded vertices)."""

    name = "path"
    takes_depth = True
    plays_roulette = True

    @classmethod
    def depth(cls, settings: Settings) -> int:
        return settings.max_depth
