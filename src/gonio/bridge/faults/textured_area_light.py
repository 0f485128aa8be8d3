"""Mitsuba 3.9: `area` lights with a texture are sampled wrongly on most shapes.

The emitter looks for positions by their uv, which triangles of a mesh may share: a cube is 18 % too dark. On round
shapes that are turned it mistakes the normal (a cylinder is up to 21 % too dark), and on shapes turned inside out the
side.

    texture = {"type": "bitmap", "bitmap": mi.Bitmap(np.ones((2, 2, 3), np.float32)), "raw": True}
    cube = mi.load_dict({"type": "cube", "emitter": {"type": "area", "radiance": texture}})
    # the mean of sample_direction's weight over u is not the irradiance

Workaround: sample such lights uniformly by area, through the shape.
"""

from __future__ import annotations

from types import ModuleType

from ..types import Emitter


def must_sample_by_area(mi: ModuleType, emitter: Emitter) -> bool:
    """Whether the light's own samples cannot be trusted."""
    shape = emitter.get_shape()
    varies = mi.has_flag(emitter.flags(), mi.EmitterFlags.SpatiallyVarying)
    textured = emitter.class_name() == "AreaLight" and shape is not None and varies
    return textured and (shape.class_name() not in ("Rectangle", "Disk") or shape.has_flipped_normals())
