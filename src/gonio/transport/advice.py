"""What to tell a person about the integrator that was chosen for a scene."""

from __future__ import annotations

import numpy as np

from .lights.solid_angles import is_sphere
from .scene_data import SceneData

# A lamp that mirrors and smooth glass see under less than so many steradians is seldom met by chance behind them: in
# examples/glass-caustic it is 0.008.
SMALL = 0.03


def on_small_lights(data: SceneData) -> str:
    """A word where `path` will hardly find the light that mirrors or smooth glass throw on other surfaces; else ""."""
    if not data.smooth:
        return ""
    mi, flags = data.mi, data.mi.EmitterFlags
    centers = np.array([shape.bbox().center() for shape in data.smooth[:64]], float).reshape(-1, 3)
    for emitter in data.lights.emitters:
        shape = emitter.get_shape() if mi.has_flag(emitter.flags(), flags.Surface) else None
        if shape is not None:
            place = np.array(shape.bbox().center(), float).ravel()
            nearest = float(np.min(np.sum((centers - place) ** 2, axis=1)))
            # seen from far, a ball shows a quarter of its area
            visible = float(np.max(np.array(shape.surface_area()))) * (0.25 if is_sphere(mi, shape) else 1.0)
            small = visible < SMALL * nearest
        else:
            small = mi.has_flag(emitter.flags(), flags.DeltaPosition) or mi.has_flag(
                emitter.flags(), flags.DeltaDirection
            )
        if small:
            return (
                "a small lamp and mirrors or smooth glass: path hardly finds the light that they throw, "
                "--integrator caustics does"
            )
    return ""
