"""Mitsuba 3.9: `area` lights with a texture are sampled incorrectly on most shapes.

The emitter samples positions by uv, and triangles of a mesh may have the same uv: a cube is 18 % too dark. On rotated
round shapes the normal is wrong (a cylinder is up to 21 % too dark), and on shapes with flipped normals the side is.

    texture = {"type": "bitmap", "bitmap": mi.Bitmap(np.ones((2, 2, 3), np.float32)), "raw": True}
    cube = mi.load_dict({"type": "cube", "emitter": {"type": "area", "radiance": texture}})
    # the mean of sample_direction's weight over u is not the irradiance

Workaround: sample such lights uniformly by area, through the shape.
"""

from __future__ import annotations

from types import ModuleType

from ..types import Emitter


def must_sample_by_area(mi: ModuleType, emitter: Emitter) -> bool:
    """Whether the light's own sampling is incorrect."""
    shape = emitter.get_shape()
    varies = mi.has_flag(emitter.flags(), mi.EmitterFlags.SpatiallyVarying)
    textured = emitter.class_name() == "AreaLight" and shape is not None and varies
    return textured and (shape.class_name() not in ("Rectangle", "Disk") or shape.has_flipped_normals())
