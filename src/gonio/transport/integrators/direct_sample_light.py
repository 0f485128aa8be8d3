"""Direct light by sampling lights."""

from __future__ import annotations

from .direct import Direct


class DirectSampleLight(Direct):
    """Direct light, by sampling the lights only (mirrors and smooth glass are followed)."""

    name = "directSampleLight"
    samples_lobes = False
