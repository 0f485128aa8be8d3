"""Direct light by sampling the BSDF."""

from __future__ import annotations

from .transport import Transport


class DirectSampleBSDF(Transport):
    """Direct light, by sampling the BSDF only."""

    name = "directSampleBSDF"
    samples_lights = False
