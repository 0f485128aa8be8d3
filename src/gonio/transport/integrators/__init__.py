"""Integrators, which determine the quantity that a picture shows. Renders run in passes; their sizes do not matter.

    >>> render = Render(mi.load_dict(scene), Settings("path", max_depth=5))
    >>> while render.done < 256:
    ...     render.advance(16)          # stop at any time: render.image() is the picture so far
    >>> picture = render.image()        # (height, width, 3) float32, row 0 on top

An integrator is one file in this folder, an entry point of the group "gonio.integrators", or a class that a program
registers: see `Integrator`. Read `direct.py` first, then `path.py`; their steps are in `light_transport.py`.
"""

from __future__ import annotations

import warnings

from .base import Integrator, Settings
from .light_transport import LightTransport
from .path import Path
from .progressive import Render

__all__ = ["Integrator", "LightTransport", "Path", "Render", "Settings"]


def __getattr__(name: str) -> object:
    if name != "Transport":
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    warnings.warn("Transport is now Path: derive from that", DeprecationWarning, stacklevel=2)
    return _Transport


class _Transport(Path):
    """The former name of the base class of integrators that follow light: paths to `depth`, without roulette."""

    name = ""
    takes_depth = False
    plays_roulette = False

    @classmethod
    def depth(cls, settings: Settings) -> int:
        return 2
