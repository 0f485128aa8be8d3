"""Mitsuba 3.9: `area` lights with a texture are sampled incorrectly on most shapes.

The emitter samples positions by their uv coordinates, but several triangles of a mesh may have the same uv coordinates:
the light from a cube is 18 % too dark. On rotated round shapes, the normal is wrong: the light from a cylinder is up to
21 % too dark. On shapes with flipped normals, the wrong side emits.

    texture = {"type": "bitmap", "bitmap": mi.Bitmap(np.ones((2, 2, 3), np.float32)), "raw": True}
    cube = mi.load_dict({"type": "cube", "emitter": {"type": "area", "radiance": texture}})
    # the mean of the weight of sample_direction over u is not the irradiance

Workaround: sample these lights uniformly by area, with the method of the shape.
"""

from __future__ import annotations

from types import ModuleType

from ..types import Emitter


def must_sample_by_area(mi: ModuleType, emitter: Emitter) -> bool:
    """Whether the emitter's own sampling method is incorrect."""
    shape = emitter.get_shape()
    varies = mi.has_flag(emitter.flags(), mi.EmitterFlags.SpatiallyVarying)
    textured = emitter.class_name() == "AreaLight" and shape is not None and varies
    return textured and (shape.class_name() not in ("Rectangle", "Disk") or shape.has_flipped_normals())
