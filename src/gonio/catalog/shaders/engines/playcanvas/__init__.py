"""PlayCanvas: the light of one lamp on its lit material, from the chunks of its GLSL."""

from __future__ import annotations

from pathlib import Path

import numpy as np

PACKAGE = "playcanvas"


def tables(package: Path) -> dict[str, np.ndarray]:
    """None: its tables serve area lights and environments."""
    return {}
