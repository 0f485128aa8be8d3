"""The scene in which a single material is shown: a ball on a checkered floor in a dark studio with three soft lamps."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..material import BSDF
from . import overrides as override
from .materials import MaterialPart, described
from .schema import SceneDescription

TILES = 12  # number of tiles along a side of the floor
TILE = 0.6  # side length of a tile


def of_material(material: BSDF, overrides: Mapping[str, object] | None = None) -> SceneDescription:
    """The scene with a ball of the given material; `overrides` as in `reader.read`."""
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
    # lamps outside the picture, even if it is wide: a large one on the left, a strip on the right, and one above
    key = {"type": "parallelogram", "base": [-4.6, 0.8, 1.6], "edge0": [1.6, 0, 1.6], "edge1": [0, 2.6, 0]}
    strip = {"type": "parallelogram", "base": [3.6, 0.4, -0.4], "edge0": [0, 2.8, 0], "edge1": [0.3, 0, 0.7]}
    top = {"type": "parallelogram", "base": [-1.3, 4.4, -1.2], "edge0": [2.6, 0, 0], "edge1": [0, 0, 1.6]}
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
                {"type": "areaLight", "energy": [4, 4, 4], "shape": key},
                {"type": "areaLight", "energy": [5, 5, 5], "shape": strip},
                {"type": "areaLight", "energy": [4, 4, 4], "shape": top},
                {"type": "environmentLight", "radiance": [0.05, 0.05, 0.05]},
            ],
        },
    }
