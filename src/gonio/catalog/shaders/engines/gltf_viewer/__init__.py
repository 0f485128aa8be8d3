"""The Khronos Group's glTF-Sample-Viewer: the BRDFs under one light, from the bundle in the package."""

from __future__ import annotations

from pathlib import Path

import numpy as np

PACKAGE = "@khronosgroup/gltf-viewer"


def tables(package: Path) -> dict[str, np.ndarray]:
    """No tables, because the viewer uses tables only for environments and sheen."""
    return {}
