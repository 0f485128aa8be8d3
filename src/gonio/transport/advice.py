"""Advice to the user about the choice of an integrator for a scene."""

from __future__ import annotations

import numpy as np

from .lights.solid_angles import is_sphere
from .scene_data import SceneData

# Solid angle in steradians. Paths that leave mirrors and smooth glass rarely hit a lamp with a smaller solid angle.
# That of the lamp in examples/glass-caustic is 0.008 sr.
SMALL = 0.03


def on_small_lights(data: SceneData) -> str:
    """A hint if `path` rarely samples the light that mirrors or smooth glass cast on other surfaces, or ""."""
    if not data.smooth:
        return ""
    mi, flags = data.mi, data.mi.EmitterFlags
    centers = np.array([shape.bbox().center() for shape in data.smooth[:64]], float).reshape(-1, 3)
    for emitter in data.lights.emitters:
        shape = emitter.get_shape() if mi.has_flag(emitter.flags(), flags.Surface) else None
        if shape is not None:
            place = np.array(shape.bbox().center(), float).ravel()
            nearest = float(np.min(np.sum((centers - place) ** 2, axis=1)))
            # the projected area of a sphere is a quarter of its surface
            visible = float(np.max(np.array(shape.surface_area()))) * (0.25 if is_sphere(mi, shape) else 1.0)
            small = visible < SMALL * nearest
        else:
            small = mi.has_flag(emitter.flags(), flags.DeltaPosition) or mi.has_flag(
                emitter.flags(), flags.DeltaDirection
            )
        if small:
            return (
                "small lamps with mirrors or smooth glass: path rarely finds the light that they cast; "
                "use --integrator caustics"
            )
    return ""
