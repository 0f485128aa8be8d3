"""Mitsuba 3.9: the thin-lens camera has a negative importance for points behind it.

    lens = mi.load_dict({"type": "thinlens", "aperture_radius": 0.1, "focus_distance": 4.0})
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.p = mi.Point3f(0, 0, -1)                            # behind the camera, which looks along +z
    lens.sample_direction(si, mi.Point2f(0.5))[1]          # below 0, 0 expected

Workaround: clamp the importance to 0.
"""

from __future__ import annotations

import drjit as dr

from ..types import Mask, Point, Radiance, Record, Sensor, SurfaceInteraction


def camera_sample(sensor: Sensor, si: SurfaceInteraction, lens: Point, active: Mask) -> tuple[Record, Radiance]:
    """A direction sample from a point to the camera, and its importance, clamped to 0."""
    ds, importance = sensor.sample_direction(si, lens, active)
    return ds, dr.maximum(importance, 0)
