"""Run by a Python that has Blender's module `bpy`: OSL shaders by Cycles, one draw per pixel.

    python osl_in_cycles.py FOLDER

FOLDER holds `jobs.json`, a list of {"shader": file, "width": W, "height": H}; each shader gets a plane of one unit
along x that fills the film, and its closure BSDF is rendered. Writes SHADER.npy, (H, W, 3) float32, row 0 at y = 0, or
no file for a shader that does not compile.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

import bpy
import numpy as np

# the module oslquery, by which Blender reads the interface of a shader, is in its own folder of packages
sys.path += map(str, Path(bpy.utils.resource_path("LOCAL")).glob("python/lib/*/site-packages"))


def scene_of(width: int, height: int) -> Any:
    """An empty scene whose camera sees a rectangle of one unit along x, without anything that changes values."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.shading_system = True  # OSL
    scene.cycles.samples = 1
    scene.cycles.pixel_filter_type = "BOX"  # the ray stays in its pixel
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.threads_mode, scene.render.threads = "FIXED", 2
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", max(width, height) / width
    camera.location = (0.5, 0.5 * height / width, 1.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    return scene


def rendered(folder: Path, shader: str, width: int, height: int) -> np.ndarray | None:
    """The closure of a shader, or None if it does not compile."""
    scene = scene_of(width, height)
    material = bpy.data.materials.new("material")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    script = tree.nodes.new("ShaderNodeScript")
    script.mode, script.filepath = "EXTERNAL", str(folder / shader)
    if "BSDF" not in script.outputs:
        return None
    tree.links.new(script.outputs["BSDF"], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    top = height / width
    mesh = bpy.data.meshes.new("plane")
    mesh.from_pydata([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, top, 0.0), (0.0, top, 0.0)], [], [(0, 1, 2, 3)])
    mesh.materials.append(material)
    scene.collection.objects.link(bpy.data.objects.new("plane", mesh))
    scene.render.filepath = str(folder / f"{shader}.exr")
    bpy.ops.render.render(write_still=True)
    picture = bpy.data.images.load(scene.render.filepath)
    picture.colorspace_settings.name = "Non-Color"
    return np.array(picture.pixels[:], np.float32).reshape(height, width, -1)[..., :3]


def main(folder: Path) -> None:
    os.chdir(folder)  # the tables are beside the shaders
    for job in json.loads((folder / "jobs.json").read_text()):
        values = rendered(folder, job["shader"], job["width"], job["height"])
        if values is not None:
            np.save(folder / f"{job['shader']}.npy", values)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
