"""Mitsuba 3.9: a completely black environment map has the sampling density 0 / 0.

    envmap = mi.load_dict({"type": "envmap", "bitmap": mi.Bitmap(np.zeros((4, 8, 3), np.float32))})
    point, ds = dr.zeros(mi.SurfaceInteraction3f), dr.zeros(mi.DirectionSample3f)
    ds.d = mi.Vector3f(0, 0, 1)
    envmap.pdf_direction(point, ds)                        # nan

Workaround: exclude black environments from the lights that are sampled.
"""

from __future__ import annotations

from types import ModuleType

import drjit as dr
import numpy as np

from ..types import Emitter


def is_black_environment(mi: ModuleType, emitter: Emitter) -> bool:
    """Whether an emitter is a completely black environment map."""
    if not mi.has_flag(emitter.flags(), mi.EmitterFlags.Infinite):
        return False
    pixels = dict(mi.traverse(emitter)).get("data")
    if pixels is None:
        return False
    if mi.is_spectral:  # a texel has three color coefficients, nonzero for black too, and a scale
        return not np.any(np.asarray(pixels)[..., 3])
    return not dr.any(pixels.array != 0)
