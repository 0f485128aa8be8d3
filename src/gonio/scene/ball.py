"""The scene that shows a single material: a ball on a checkered floor, with two lamps and a dim sky."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..material import BSDF
from . import overrides as override
from .materials import MaterialPart, described
from .schema import SceneDescription

TILES = 12  # along a side of the floor
TILE = 0.6


def of_material(material: BSDF, overrides: Mapping[str, object] | None = None) -> SceneDescription:
    """The scene of a ball of that material, with `overrides` as in `reader.read`."""
    raw = _raw(material.name or type(material).__name__, described(material))
    if overrides:
        override.apply(raw, overrides)
    description = SceneDescription.model_validate(raw)
    description._path = Path(f"{material.name}.json")
    description._raw = raw
    return description


def _raw(name: str, material: MaterialPart) -> dict[str, Any]:
    floor = [
        {
            "type": "parallelogram",
            "base": [(x - TILES / 2) * TILE, 0, (z - TILES / 2) * TILE],
            "edge0": [0, 0, TILE],
            "edge1": [TILE, 0, 0],
            "material": {"type": "matte", "albedo": [0.45] * 3 if (x + z) % 2 else [0.16] * 3},
        }
        for x in range(TILES)
        for z in range(TILES)
    ]
    side_lamp = {"type": "parallelogram", "base": [-3.5, 4.5, 1.0], "edge0": [1.4, 0, 1.4], "edge1": [0, 1.2, 0]}
    rear_lamp = {"type": "parallelogram", "base": [2.2, 2.0, -3.5], "edge0": [1.5, 0, 0], "edge1": [0, 1.5, 0]}
    return {
        "output": {"filename": f"{name}.png"},
        "sampler": {"type": "independent", "samples": 64},
        "camera": {
            "type": "pinhole",
            "transform": {"position": [0, 2.1, 5.0], "lookAt": [0, 0.92, 0], "up": [0, 1, 0]},
            "verticalFov": 30,
            "film": {"size": [400, 400]},
        },
        "integrator": {"type": "path", "maxDepth": 8},
        "scene": {
            "shapes": [{"type": "sphere", "center": [0, 1, 0], "radius": 1, "material": material}, *floor],
            "lights": [
                {"type": "areaLight", "energy": [14, 14, 14], "shape": side_lamp},
                {"type": "areaLight", "energy": [7, 7.4, 8], "shape": rear_lamp},
                {"type": "environmentLight", "radiance": [0.35, 0.38, 0.42]},
            ],
        },
    }
