"""Acceleration only. Each file is a faster version of something in `transport`:

    inline           intersects rays with a few simple shapes in the kernel, without Embree
    placements       computes hits on many spheres or rectangles from one table, without a call per shape
    lamp_table       samples rectangles and balls among the lamps from one table, without a call per emitter
    rectangle_light  samples a single rectangle by its solid angle; the last ray of a path is a shadow ray
    light_grid       chooses among several lights by the light that each sends to a cell of the scene
    by_shape         uses one material for thousands that differ in numeric parameters only

GONIO_FAST=0 in the environment disables all of it: renders are then slower, with pictures that are equal within the
noise (bit-identical for scenes with nothing to accelerate).
"""

from __future__ import annotations

import os


def enabled() -> bool:
    """Whether newly prepared scenes use the acceleration; GONIO_FAST=0 in the environment disables it."""
    return os.environ.get("GONIO_FAST", "1") != "0"
