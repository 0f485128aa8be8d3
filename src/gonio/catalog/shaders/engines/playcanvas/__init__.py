"""PlayCanvas: the lit material under one light, from the GLSL chunks of the package."""

from __future__ import annotations

from pathlib import Path

import numpy as np

PACKAGE = "playcanvas"


def tables(package: Path) -> dict[str, np.ndarray]:
    """No tables, because the engine uses tables only for area lights and environments."""
    return {}
