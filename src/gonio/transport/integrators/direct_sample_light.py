"""Direct illumination by light sampling."""

from __future__ import annotations

from .direct import Direct


class DirectSampleLight(Direct):
    """Direct illumination by light sampling only, except at mirrors and smooth glass."""

    name = "directSampleLight"
    samples_lobes = False
