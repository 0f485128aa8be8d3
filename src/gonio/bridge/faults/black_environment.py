"""Mitsuba 3.9: an environment map that is black all over has the sampling density 0 / 0.

    envmap = mi.load_dict({"type": "envmap", "bitmap": mi.Bitmap(np.zeros((4, 8, 3), np.float32))})
    envmap.pdf_direction(it, ds)                    # nan

Workaround: leave black environments out of the lights that are sampled.
"""

from __future__ import annotations

from types import ModuleType

import drjit as dr
import numpy as np

from ..types import Emitter


def is_black_environment(mi: ModuleType, emitter: Emitter) -> bool:
    """Whether a light is an environment map without any light."""
    if not mi.has_flag(emitter.flags(), mi.EmitterFlags.Infinite):
        return False
    pixels = dict(mi.traverse(emitter)).get("data")
    if pixels is None:
        return False
    if mi.is_spectral:  # three numbers tell a texel's color, black too, and the last one how bright it is
        return not np.any(np.asarray(pixels)[..., 3])
    return not dr.any(pixels.array != 0)
