"""Mitsuba 3.9: the mesh that is made of rectangles of equal material has no bounding box.

    wall = {"type": "rectangle", "bsdf": mi.load_dict({"type": "diffuse"})}
    mi.load_dict({"type": "merge", "a": wall, "b": {**wall, "to_world": aside}}).bbox().valid()      # False

The scene's box then leaves it out, and beyond the scene's box nothing is in the way of a sky or a beam: under a far
roof a sky sends 0.84 in place of 0.81.

Workaround: compute the box, and load a scene that was made without it once more.
"""

from __future__ import annotations

from collections.abc import Iterable
from types import ModuleType

from ..types import Scene, Shape


def compute_boxes(shapes: Iterable[Shape]) -> None:
    """Give the meshes among shapes the boxes that they may lack."""
    for shape in shapes:
        if shape.is_mesh():
            shape.recompute_bbox()


def with_valid_bbox(mi: ModuleType, scene: Scene) -> Scene:
    """The scene, or one of the same parts, whose box holds all of its shapes."""
    compute_boxes(scene.shapes())
    meshes = [shape for shape in scene.shapes() if shape.is_mesh()]
    box = scene.bbox()
    if all(box.contains(shape.bbox()) for shape in meshes if shape.bbox().valid()):
        return scene
    lights = [emitter for emitter in scene.emitters() if emitter.get_shape() is None]
    parts = {f"part{i}": part for i, part in enumerate([*scene.shapes(), *lights, *scene.sensors()])}
    result: Scene = mi.load_dict({"type": "scene", **parts}, parallel=False, optimize=False)
    return result
