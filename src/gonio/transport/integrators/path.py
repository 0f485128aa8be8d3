"""Path tracing."""

from __future__ import annotations

import numpy as np

from ..lights.solid_angles import is_sphere
from .base import Settings
from .transport import Transport

# A lamp that mirrors and smooth glass see under less than so many steradians is seldom met by chance behind them: in
# examples/glass-caustic it is .008.
SMALL = 0.03


class Path(Transport):
    """Path tracing: light and BSDF sampling combined at every vertex (max_depth - 1 shaded vertices)."""

    name = "path"
    takes_depth = True
    plays_roulette = True

    @classmethod
    def depth(cls, settings: Settings) -> int:
        return settings.max_depth

    def advice(self) -> str:
        """A word where the light that mirrors or smooth glass throw will hardly be found."""
        if self.merges or self.settings.max_depth <= 2 or not self.smooth:
            return ""
        mi, flags = self.mi, self.mi.EmitterFlags
        around = np.array([shape.bbox().center() for shape in self.smooth[:64]], float).reshape(-1, 3)
        for emitter in self.lights.emitters:
            shape = emitter.get_shape() if mi.has_flag(emitter.flags(), flags.Surface) else None
            if shape is not None:
                place = np.array(shape.bbox().center(), float).ravel()
                nearest = float(np.min(np.sum((around - place) ** 2, axis=1)))
                # seen from far, a ball shows a quarter of its area
                seen = float(np.max(np.array(shape.surface_area()))) * (0.25 if is_sphere(mi, shape) else 1.0)
                small = seen < SMALL * nearest
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
