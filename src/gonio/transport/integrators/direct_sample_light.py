"""Direct light by sampling lights."""

from __future__ import annotations

from .direct import Direct


class DirectSampleLight(Direct):
    """Direct light, by sampling the lights only, except at mirrors and smooth glass."""

    name = "directSampleLight"
    samples_lobes = False
