"""Optional accelerations. Each file contains a faster version of a part of `transport`:

    inline           intersects rays with a few simple shapes in the kernel, without Embree
    placements       computes hits on many spheres or rectangles from one table, without a call per shape
    lamp_table       samples rectangular and spherical lamps from one table, without a call per emitter
    rectangle_light  samples a single rectangle by solid angle; the last ray of a path is a shadow ray
    light_grid       selects one of several lights according to the light that each sends to a cell of the scene
    by_shape         replaces thousands of materials that differ only in numeric parameters by one

GONIO_FAST=0 in the environment disables all accelerations. Renders are then slower, but the pictures are equal except
for noise, or bit-identical for scenes to which no acceleration applies.
"""

from __future__ import annotations

import os


def enabled() -> bool:
    """Whether newly prepared scenes use the accelerations, which GONIO_FAST=0 in the environment disables."""
    return os.environ.get("GONIO_FAST", "1") != "0"
