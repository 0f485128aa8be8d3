"""Mitsuba 3.9: merging meshes of equal material creates a mesh without a bounding box.

    wall = {"type": "rectangle", "bsdf": mi.load_dict({"type": "diffuse"})}
    aside = mi.ScalarTransform4f().translate([3, 0, 0])
    mi.load_dict({"type": "merge", "a": wall, "b": {**wall, "to_world": aside}}).bbox().valid()      # False

The bounding box of the scene therefore does not include the mesh, and geometry outside this box does not block light
from a sky or a beam: under a distant roof, a sky contributes 0.84 instead of 0.81.

Workaround: compute the bounding box of the mesh before Gonio assembles a scene, and rebuild a Mitsuba scene that was
assembled without it, because a scene does not update its own bounding box.
"""

from __future__ import annotations

from collections.abc import Iterable
from types import ModuleType

from ..types import Scene, Shape


def compute_boxes(shapes: Iterable[Shape]) -> None:
    """Compute the bounding boxes of all meshes among the given shapes."""
    for shape in shapes:
        if shape.is_mesh():
            shape.recompute_bbox()


def with_valid_bbox(mi: ModuleType, scene: Scene) -> Scene:
    """The scene itself, or a scene rebuilt from its parts if its bounding box does not contain all of its shapes."""
    compute_boxes(scene.shapes())
    meshes = [shape for shape in scene.shapes() if shape.is_mesh()]
    box = scene.bbox()
    if all(box.contains(shape.bbox()) for shape in meshes if shape.bbox().valid()):
        return scene
    lights = [emitter for emitter in scene.emitters() if emitter.get_shape() is None]
    parts = {f"part{i}": part for i, part in enumerate([*scene.shapes(), *lights, *scene.sensors()])}
    result: Scene = mi.load_dict({"type": "scene", **parts}, parallel=False, optimize=False)
    return result
