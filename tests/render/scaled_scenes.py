"""Scenes with all lengths multiplied by a number, which show the same picture."""

from __future__ import annotations

import copy
from typing import Any

Parts = dict[str, Any]
# keys that are lengths or positions, by the type of the shape; of all others the transform grows
OF_SHAPES = {"sphere": ("center", "radius"), "parallelogram": ("base", "edge0", "edge1")}


def scaled(scene: Parts, scale: float) -> Parts:
    """A copy of a scene's JSON: `scale` times as large, with its camera, its lamps, and its absorbing media."""
    made = copy.deepcopy(scene)
    camera = made["camera"]
    for key in ("position", "lookAt"):
        camera["transform"][key] = times(camera["transform"][key], scale)
    for key in ("tNear", "tFar"):
        if key in camera:
            camera[key] *= scale
    for shape in made["scene"]["shapes"]:
        _grow(shape, scale)
    for light in made["scene"]["lights"]:
        if "shape" in light:
            _grow(light["shape"], scale)
        if "position" in light:
            light["position"] = times(light["position"], scale)
            light["energy"] = times(light["energy"], scale**2)  # of a point: irradiance is energy / distance^2
    return made


def times(value: Any, scale: float) -> Any:
    """A number, a vector, or a spectrum given by type, multiplied."""
    if isinstance(value, list):
        return [scale * number for number in value]
    if isinstance(value, dict):
        return {**value, "scale": scale * value.get("scale", 1.0)}
    return scale * value


def _grow(shape: Parts, scale: float) -> None:
    transform = shape.setdefault("transform", {})
    if "translate" in transform:
        transform["translate"] = times(transform["translate"], scale)
    for key in OF_SHAPES.get(shape["type"], ()):
        shape[key] = times(shape[key], scale)
    if shape["type"] not in OF_SHAPES:
        transform["scale"] = times(transform.get("scale", [1.0, 1.0, 1.0]), scale)
    _absorb(shape.get("material", {}), 1.0 / scale)


def _absorb(material: Any, scale: float) -> None:
    """Multiply the coefficients of absorption, whose unit is 1/length, and divide depths."""
    for key, value in material.items():
        if key == "absorption":
            material[key] = times(value, scale)
        elif key == "transmission_depth":
            material[key] = value / scale
        elif isinstance(value, dict):
            _absorb(value, scale)
