"""Direct illumination by BSDF sampling."""

from __future__ import annotations

from .direct import Direct


class DirectSampleBSDF(Direct):
    """Direct illumination by BSDF sampling only."""

    name = "directSampleBSDF"
    samples_lights = False
