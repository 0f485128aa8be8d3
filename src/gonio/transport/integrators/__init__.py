"""Integrators: what a picture shows, in passes that add up to the same picture to the bit.

    >>> render = Render(mi.load_dict(scene), Settings("path", max_depth=5))
    >>> while render.done < 256:
    ...     render.advance(16)          # stop here whenever you like: render.image() is the picture so far
    >>> picture = render.image()        # (height, width, 3) float32, row 0 on top

An integrator is one file in this folder, an entry point of the group "gonio.integrators", or a class that a program
registers: see `Integrator`.
"""

from __future__ import annotations

from .base import Integrator, Settings
from .progressive import Render
from .transport import Transport

__all__ = ["Integrator", "Render", "Settings", "Transport"]
