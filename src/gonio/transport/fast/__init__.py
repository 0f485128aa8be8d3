"""Acceleration only. Each file does faster what `transport` does without it:

    inline           rays against a few simple shapes by formulas in the kernel, without Embree
    placements       surfaces of many spheres or rectangles from one table, without a call per shape
    lamp_table       rectangles and balls among the lamps from one table, without a call per emitter
    rectangle_light  a single rectangle by its solid angle; the last ray of a path is a shadow ray
    light_grid       one of several lights by the light that it sends to the cell where one is
    by_shape         one material for thousands that differ in their numbers alone

With GONIO_FAST=0 in the environment nothing here is used: pictures are the same within their noise (of scenes with
nothing to accelerate: to the bit), and slower.
"""

from __future__ import annotations

import os


def enabled() -> bool:
    """Whether scenes that are prepared from now on use the acceleration; GONIO_FAST=0 in the environment says no."""
    return os.environ.get("GONIO_FAST", "1") != "0"
