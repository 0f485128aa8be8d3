"""PlayCanvas: its lit material under one light, from its GLSL chunks."""

from __future__ import annotations

from pathlib import Path

import numpy as np

PACKAGE = "playcanvas"


def tables(package: Path) -> dict[str, np.ndarray]:
    """No tables: the engine uses its own only for area lights and environments."""
    return {}
