"""Whitted's ray tracing."""

from __future__ import annotations

from .base import Settings
from .transport import Transport

DEPTH = 10


class Whitted(Transport):
    """Mirrors and smooth glass followed to depth 10, everything else lit by light sampling only."""

    name = "whitted"
    samples_lobes = False

    @classmethod
    def depth(cls, settings: Settings) -> int:
        return DEPTH
