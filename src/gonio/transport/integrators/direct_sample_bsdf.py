"""Direct light by sampling the BSDF."""

from __future__ import annotations

from .direct import Direct


class DirectSampleBSDF(Direct):
    """Direct light, by sampling the BSDF only."""

    name = "directSampleBSDF"
    samples_lights = False
