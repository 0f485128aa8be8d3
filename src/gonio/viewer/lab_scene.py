"""The materials of a scene in Lab 2's format, on balls under the scene's light, for `gonio view SCENE`."""

from __future__ import annotations

import base64
import math
from collections.abc import Iterator
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import scene
from ..catalog import documents, notation
from ..errors import InputError
from ..material import BSDF, tree
from ..scene import schema, spectra, textures
from ..scene.materials import BY_TYPE, MaterialPart
from ..scene.values import ImageTexture
from .stage import CAMERA, SUN, Ball, Camera, Light, Material, Row, Stage, Value, replaced

Vector: TypeAlias = "NDArray[np.float64]"

LARGEST_IMAGE = 1024  # largest width of an environment in a page; wider environments are downsampled
BALLS = 5  # per row
ENVIRONMENT: Light = {"type": "environment", "image": None, "constant": [1.0] * 3, "rotation": 0.0, "scale": 1.0}


def stage(path: Path, allow_outside: bool = False, allow_code: bool = False) -> Stage:
    """The stage with the materials of a scene on balls, under the scene's light.

    Each distinct material is a ball; materials of one model and with the same choices share a row. Each lamp becomes a
    directional light with the lamp's direction and unoccluded irradiance at the point at which the camera looks. An
    environment, or a lamp that surrounds this point, becomes an environment. A texture cannot be represented by
    sliders, so it is replaced by its parameter's default, with a note.

    allow_outside  allow the scene to read files outside its folder
    allow_code     allow the scene to run materials in Python files
    Raises InputError for an invalid scene and for a file outside the scene's folder.
    """
    description = scene.read(path, allow_outside=allow_outside, allow_code=allow_code, names_output=False)
    parts = _materials(description)
    if not parts:
        raise InputError("the scene has no shapes", str(path), "add one, or name a model")
    notes = [f"{part.type}: its {what} is not shown" for part in parts for what in _textured(part)]
    materials, rows = _rows([_bsdf(part, description) for part in parts])
    lights, more = _lights(description)
    name = path.stem if path.stem != "scene" else path.resolve().parent.name
    if path.is_dir():
        name = path.resolve().name
    camera: Camera = {**CAMERA, "elevation": round(_axes(description.camera.transform)[1], 4)}
    return Stage(f"Materials of {name}", materials, rows, lights, camera, (*description.warnings, *notes, *more))


def _materials(description: schema.SceneDescription) -> list[MaterialPart]:
    """The distinct materials, in the order of the shapes; the default material for a shape without one."""
    distinct: list[MaterialPart] = []
    for shape in description.shapes:
        part = shape.material or BY_TYPE["matte"](type="matte")
        if part not in distinct:
            distinct.append(part)
    return distinct


def _bsdf(part: MaterialPart, description: schema.SceneDescription) -> BSDF:
    """The material with its numeric parameters, including those of named presets; textures are replaced by
    defaults."""
    return replaced(part.instance(description.locate), dict(_indices(part)))


def _indices(part: MaterialPart, path: str = "") -> Iterator[tuple[str, Value]]:
    """The values of presets, by path."""
    if part.preset is not None:
        for name, value in notation.settings(part.model.preset(part.preset)).items():
            yield tree.join(path, name), value
    for name, (value, _, _) in part.arguments().items():
        if isinstance(value, MaterialPart):
            yield from _indices(value, tree.join(path, name))


def _textured(part: MaterialPart) -> Iterator[str]:
    if part.normalmap is not None:
        yield "normal map"
    if part.bump is not None:
        yield "bump map"
    for name, (value, _, _) in part.arguments().items():
        if isinstance(value, MaterialPart):
            yield from _textured(value)
        elif any(isinstance(v, ImageTexture) for v in (value if isinstance(value, tuple | list) else (value,))):
            yield f"texture of {name}"


def _rows(bsdfs: list[BSDF]) -> tuple[dict[str, Material], tuple[Row, ...]]:
    """Materials with the same code (model, choices, number of alphas) share rows; each ball has its own values."""
    groups: dict[tuple[object, ...], list[BSDF]] = {}
    for bsdf in bsdfs:
        groups.setdefault(_code(bsdf), []).append(bsdf)
    materials, rows = {}, []
    for index, members in enumerate(groups.values()):
        key, first = f"m{index}", members[0]
        title = type(first).__name__
        materials[key] = Material(title, first)
        balls = _balls(members, title)
        rows += [Row(title, key, balls[start : start + BALLS]) for start in range(0, len(balls), BALLS)]
    return materials, tuple(rows[:8])


def _code(bsdf: BSDF) -> tuple[object, ...]:
    """Everything that determines a material's shader."""
    facts: list[object] = [(path, type(inner)) for path, inner in tree.walk(bsdf)]
    for path, parameter, value, _ in tree.leaves(bsdf):
        if not parameter.numeric:
            facts.append((path, value))
        elif parameter.kind == "alpha":
            facts.append((path, isinstance(value, tuple)))
        elif parameter.kind == "angle":
            facts.append((path, value == 0))
    return tuple(facts)


def _balls(members: list[BSDF], title: str) -> tuple[Ball, ...]:
    """One ball per material, labeled with its distinguishing values. It stores the values that differ from those of the
    first material."""
    values = [
        {leaf.path: _listed(leaf.value) for leaf in tree.leaves(member) if leaf.parameter.numeric} for member in members
    ]
    paths = list(values[0])
    telling = [path for path in paths if any(v[path] != values[0][path] for v in values)]
    numbers = [path for path in telling if not isinstance(values[0][path], list)]
    balls = []
    for mine in values:
        label = ", ".join(f"{path.rpartition('.')[2]} {_text(mine[path])}" for path in (numbers or telling)[:2])
        different = {path: mine[path] for path in telling if mine[path] != values[0][path]}
        balls.append(Ball(label or title, different))
    return tuple(balls)


def _text(value: float | list[float]) -> str:
    return " ".join(f"{v:.3g}" for v in (value if isinstance(value, list) else [value]))


def _listed(value: ArrayLike) -> float | list[float]:
    array = np.asarray(value, float)
    return [float(v) for v in array] if array.ndim else float(array)


# --------------------------------------------------------------------------- lights


def _lights(description: schema.SceneDescription) -> tuple[tuple[Light, ...], list[str]]:
    """The scene's lights in the page's format, and notes about those that are changed."""
    placed = description.camera.transform
    target = np.array(placed.look_at, float)
    axes, _ = _axes(placed)
    lights: list[Light] = []
    notes: list[str] = []
    for light in description.lights:
        if isinstance(light, schema.AreaLight) and _surrounds(light, target):  # it blocks all other lights
            return ({**ENVIRONMENT, "constant": [float(x) for x in spectra.colour(light.energy)]},), []
    for light in description.lights:
        if isinstance(light, schema.EnvironmentLight):
            lights.append(_environment(description, light, axes))
            continue
        if isinstance(light, schema.SpotLight):
            away = np.array(light.position, float) - target
            irradiance = np.array(spectra.colour(light.energy)) / max(float(away @ away), 1e-12)
        elif isinstance(light, schema.DirectionalLight):
            away = -light.unit()
            irradiance = np.array(spectra.colour(light.energy))
        else:
            away, irradiance = _area(light, target)
        distance = float(np.linalg.norm(away))
        if distance == 0.0:
            notes.append("a lamp at the camera's target is omitted")
            continue
        direction = [float(axis @ away) / distance for axis in axes]
        lights.append({"type": "directional", "direction": direction, "irradiance": [float(x) for x in irradiance]})
    if not lights:
        notes.append("the scene has no light; the page uses its default light")
        return (SUN,), notes
    return tuple(lights), notes


def _surrounds(light: schema.AreaLight, target: Vector) -> bool:
    """Whether a lamp is a sphere that encloses the point."""
    if not isinstance(light.shape, schema.Sphere):
        return False
    center = (light.shape.transform.matrix() @ [*light.shape.center, 1.0])[:3]
    return float(np.linalg.norm(center - target)) < light.shape.radius


def _axes(placed: schema.CameraTransform) -> tuple[Vector, float]:
    """The page's x, y and z axes in the scene, and the elevation of the camera. The scene is rotated so that its camera
    looks along -z.

    If the scene's up direction is +y, it is preserved, and the camera keeps its elevation. Otherwise, the camera's own
    axes are used.
    """
    back = np.array(placed.position, float) - np.array(placed.look_at, float)
    back /= np.linalg.norm(back)
    up = np.array(placed.up, float) / np.linalg.norm(placed.up)
    if up[1] > 0.9 and abs(back[1]) < 0.999:
        z = np.array([back[0], 0.0, back[2]]) / math.hypot(back[0], back[2])
        return np.array([[z[2], 0.0, -z[0]], [0.0, 1.0, 0.0], z]), math.asin(float(back[1]))
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(back, right), back]), 0.0


def _area(light: schema.AreaLight, target: Vector) -> tuple[Vector, Vector]:
    """The vector to the lamp's center, and the irradiance on a surface that faces the lamp: L A cos / r^2, as for a
    distant lamp."""
    shape, radiance = light.shape, np.array(spectra.colour(light.energy))
    matrix = shape.transform.matrix()
    if isinstance(shape, schema.Parallelogram):
        edge0, edge1 = (matrix[:3, :3] @ np.array(edge, float) for edge in (shape.edge0, shape.edge1))
        center = (matrix @ [*shape.base, 1.0])[:3] + (edge0 + edge1) / 2
        area_vector = np.cross(edge0, edge1)
        away = center - target
        projected = abs(float(area_vector @ away)) / max(float(np.linalg.norm(away)), 1e-12)
    elif isinstance(shape, schema.Sphere):
        away = (matrix @ [*shape.center, 1.0])[:3] - target
        projected = math.pi * shape.radius**2
    else:
        away = matrix[:3, 3] - target
        projected = float(abs(np.linalg.det(matrix[:3, :3]))) ** (2 / 3) * math.pi
    return away, radiance * projected / max(float(away @ away), 1e-12)


def _environment(description: schema.SceneDescription, light: schema.EnvironmentLight, axes: Vector) -> Light:
    source = light.texture if light.texture is not None else light.radiance
    data = {**ENVIRONMENT, "rotation": -math.atan2(axes[2][0], axes[2][2])}
    assert source is not None  # the reader has checked that one is given
    if not isinstance(source, ImageTexture):
        return {**data, "constant": [float(x) for x in spectra.colour(source)]}
    location = description.where("/scene/lights")
    path, inside = description.locate(source.file, location), documents.inside(source.file)[1]
    srgb = source.color_space == "srgb"
    pixels = textures.load_image(path, location, srgb=srgb, channel=source.channel, inside=inside)
    pixels = pixels * np.asarray(source.factor, np.float32)
    pixels = _smaller(np.broadcast_to(pixels, (*pixels.shape[:2], 3)))
    halves = np.ones((*pixels.shape[:2], 4), "<f2")
    halves[..., :3] = np.clip(pixels, 0.0, np.finfo(np.float16).max)
    encoded = base64.b64encode(halves.tobytes()).decode()
    return {**data, "image": {"width": pixels.shape[1], "height": pixels.shape[0], "data": encoded}}


def _smaller(pixels: np.ndarray) -> np.ndarray:
    """The pixels, averaged over blocks so that the picture is at most LARGEST_IMAGE wide."""
    factor = -(-pixels.shape[1] // LARGEST_IMAGE)
    if factor == 1:
        return pixels
    height, width = (n // factor * factor for n in pixels.shape[:2])
    blocks = pixels[:height, :width].reshape(height // factor, factor, width // factor, factor, 3)
    return blocks.mean((1, 3), dtype=np.float64).astype(np.float32)


__all__ = ["stage"]
