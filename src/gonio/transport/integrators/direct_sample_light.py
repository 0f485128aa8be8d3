"""Direct light by sampling lights."""

from __future__ import annotations

from .transport import Transport


class DirectSampleLight(Transport):
    """Direct light, by sampling the lights only (mirrors and smooth glass are followed)."""

    name = "directSampleLight"
    samples_lobes = False
