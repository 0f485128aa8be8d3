"""Bevy: StandardMaterial under a directional light, from the WGSL files of a checkout."""

from __future__ import annotations

from pathlib import Path

import numpy as np

PACKAGE = "bevy"
MARK = "crates/bevy_pbr/src/render/pbr_lighting.wgsl"


def tables(package: Path) -> dict[str, np.ndarray]:
    """No tables, because without DFG_LUT the shaders approximate the split sum by a polynomial."""
    return {}
