"""Whitted's ray tracing."""

from __future__ import annotations

from .base import Settings
from .path import Path

DEPTH = 10


class Whitted(Path):
    """Whitted ray tracing: mirrors and smooth glass to depth 10, and light sampling at other surfaces."""

    name = "whitted"
    takes_depth = False
    samples_lobes = False
    plays_roulette = False

    @classmethod
    def depth(cls, settings: Settings) -> int:
        return DEPTH

    def advice(self) -> str:
        return ""
