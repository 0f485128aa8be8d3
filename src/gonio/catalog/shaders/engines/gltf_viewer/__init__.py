"""The Khronos Group's glTF-Sample-Viewer: its BRDFs under one light, from the bundle in its package."""

from __future__ import annotations

from pathlib import Path

import numpy as np

PACKAGE = "@khronosgroup/gltf-viewer"


def tables(package: Path) -> dict[str, np.ndarray]:
    """No tables: the viewer uses its own only for environments and sheen."""
    return {}
