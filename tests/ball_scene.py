"""A ball under a lamp: the smallest scene that tests change, write and render."""

from __future__ import annotations

from typing import Any

SCENE: dict[str, Any] = {
    "output": {"filename": "ball.png"},
    "sampler": {"type": "independent", "xSamples": 2, "ySamples": 2},
    "camera": {
        "type": "pinhole",
        "transform": {"position": [0, 1, 4], "lookAt": [0, 0, 0], "up": [0, 1, 0]},
        "verticalFov": 40,
        "film": {"size": [24, 16]},
    },
    "integrator": {"type": "directSampleLight"},
    "scene": {
        "shapes": [
            {
                "type": "sphere",
                "center": [0, 0, 0],
                "radius": 1,
                "material": {"type": "phong", "kd": [0.2, 0.2, 0.2], "ks": [0.5, 0.5, 0.5], "p": 8},
            }
        ],
        "lights": [{"type": "spotLight", "position": [2, 3, 4], "energy": [40, 40, 40]}],
    },
}
