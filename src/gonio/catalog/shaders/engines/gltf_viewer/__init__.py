"""glTF-Sample-Viewer of the Khronos Group: its BRDFs under one lamp, from the bundle of its package."""

from __future__ import annotations

from pathlib import Path

import numpy as np

PACKAGE = "@khronosgroup/gltf-viewer"


def tables(package: Path) -> dict[str, np.ndarray]:
    """None: its tables serve environments and sheen."""
    return {}
