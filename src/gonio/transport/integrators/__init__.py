"""Integrators, which determine the quantity that a picture shows.

    >>> render = Render(mi.load_dict(scene), Settings("path", max_depth=5))
    >>> while render.done < 256:
    ...     render.advance(16)          # the picture so far is render.image()
    >>> picture = render.image()        # (height, width, 3) float32, row 0 on top

A render runs in passes, whose sizes do not affect the picture. An integrator is defined by a file in this folder, by an
entry point of the group "gonio.integrators", or by a class that a program registers, see `Integrator`. Read `direct.py`
first, then `path.py`; the steps that they combine are in `light_transport.py`.
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
    """The former base class of integrators for light transport: path tracing to `depth`, without Russian roulette."""

    name = ""
    takes_depth = False
    plays_roulette = False

    @classmethod
    def depth(cls, settings: Settings) -> int:
        return 2
