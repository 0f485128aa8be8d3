"""The path-traced reference for the page's picture: the same balls, lights and camera, rendered by Gonio.

    >>> reference = Reference(stage)
    >>> reference.show(scene)           # a messages.Scene
    >>> while not reference.done:
    ...     reference.advance()         # more samples of every pixel, about a twentieth of a second
    >>> reference.image()               # (height, width, 4): radiance and coverage

There are two kinds of light transport:

"local"  Direct light, one bounce (depth 2). The balls are in one scene and the lights in another, so that each
         point is lit by every light without occlusion, and no ball illuminates or shadows another, as in a fragment
         shader. Light and BSDF sampling are combined by multiple importance sampling.
"path"   Balls and lights are in one scene, with shadows, interreflection and refraction.

Each pixel is averaged over a box one pixel wide. A changed value requires no compilation: parameters, lights and camera
are kernel data and are written into the existing scene. A different model, choice, number of balls or kind of light
requires a new scene.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..bridge import adapter, engine
from ..bridge.types import BSDFPlugin, OfVariant, Plugin, PluginDict, Scene, Sensor, Shape
from ..errors import InputError
from ..material import BSDF, tree
from ..scene import textures
from ..transport import foreground, integrators
from ..transport.lights import lights
from . import messages, stage
from .stage import Stage

Pixels: TypeAlias = "NDArray[np.float32]"  # (height, width, channels), row 0 on top
Structure: TypeAlias = tuple[object, ...]  # equal for scenes that share a kernel

PASS_SECONDS = 0.05  # duration of a pass, which cannot be interrupted: half of the allowed latency of a slider
MAX_PER_PASS = 64
MIN_SECONDS = PASS_SECONDS / MAX_PER_PASS  # per sample, before the first measurement

# Mitsuba's sphere has its axis along z, and u runs from x toward y; the axis of the page's sphere is y, and u runs from
# z toward x.
SPHERE_AXES = ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))


class Reference:
    """A progressively rendered picture of the page's scene.

    what    stage with the materials from which the rows of a scene are built
    device  "cpu", "cuda" or "auto"
    """

    def __init__(self, what: Stage, device: str = "cpu"):
        self.mi = engine.load(device)
        self.variant = str(self.mi.variant())
        adapter.register(self.mi)
        lights.register(self.mi)
        self.stage = what
        self.pictures: Mapping[str, Pixels] = {}
        self.scene: messages.Scene | None = None
        self._render: foreground.Foreground | None = None
        self._balls = _Balls(self.mi)
        self._lamps = _Lamps(self.mi)
        self._combined: tuple[tuple[dict[str, Plugin], dict[str, Plugin]], Scene] = (({}, {}), None)
        self._first_pass = 0.0  # seconds
        self._per_sample = MIN_SECONDS

    @property
    def device(self) -> str:
        return "cuda" if str(self.mi.variant()).startswith("cuda") else "cpu"

    @property
    def samples(self) -> int:
        """Samples per pixel so far."""
        return self._render.done if self._render is not None else 0

    @property
    def done(self) -> bool:
        return self._render is None or self.scene is None or self.samples >= self.scene.spp

    def show(self, scene: messages.Scene) -> None:
        """Start a new picture. Raises InputError for an unknown material, parameter or environment image."""
        bsdfs = [self._materials(row, f"rows/{index}") for index, row in enumerate(scene.state.rows)]
        balls = self._balls.place(bsdfs, scene.state.spacing)
        lamps = self._lamps.place(scene.state.lights, self.pictures)
        sensor = self._sensor(scene)
        if scene.transport == "path":
            settings = integrators.Settings("path", max_depth=scene.max_depth)
            combined = self._together()
            self._lamps.write(combined, scene.state.lights)
            render = foreground.Foreground(combined, settings, sensor)
        else:
            # a sampled direction never hits a light without extent, so the BSDF need not be sampled
            integrator = "direct" if self._lamps.extended else "directSampleLight"
            render = foreground.Foreground(balls, integrators.Settings(integrator), sensor, lamps)
        self.scene, self._render = scene, render

    def _materials(self, row: messages.Row, where: str) -> list[BSDF]:
        if row.material not in self.stage.materials:
            known = ", ".join(self.stage.materials)
            raise InputError(f"unknown material '{row.material}'", f"{where}/material", f"known: {known}")
        bsdf = stage.replaced(self.stage.materials[row.material].bsdf, dict(row.choices), f"{where}/choices")
        return [stage.replaced(bsdf, dict(ball), f"{where}/balls/{i}") for i, ball in enumerate(row.balls)]

    def _together(self) -> Scene:
        """Balls and lights in one scene."""
        parts = (self._balls.parts, self._lamps.parts)
        if any(a is not b for a, b in zip(self._combined[0], parts, strict=True)):
            self._combined = parts, self.mi.load_dict({"type": "scene", **parts[0], **parts[1]})
        return self._combined[1]

    def _sensor(self, scene: messages.Scene) -> Sensor:
        camera, mi = scene.state.camera, self.mi
        sin_a, cos_a = math.sin(camera.azimuth), math.cos(camera.azimuth)
        sin_e, cos_e = math.sin(camera.elevation), math.cos(camera.elevation)
        away = np.array([sin_a * cos_e, sin_e, cos_a * cos_e])
        up = [-sin_a * sin_e, cos_e, -cos_a * sin_e]  # perpendicular to the view, also from straight above
        target = np.array(camera.target)
        eye = target + camera.distance * away
        return mi.load_dict(
            {
                "type": "perspective",
                "fov": camera.fov,
                "fov_axis": "y",
                "near_clip": 1e-3,  # clip distances are literals of the kernel: other values would require a new kernel
                "far_clip": 1e8,
                "to_world": mi.ScalarTransform4f().look_at(list(eye), list(target), up),
                "film": {"type": "hdrfilm", "width": scene.width, "height": scene.height, "rfilter": {"type": "box"}},
            }
        )

    def advance(self) -> None:
        """Add samples: at first one, so that a picture is available soon; then as many as have been taken already,
        within PASS_SECONDS.

        Each pass has an overhead in Python in addition to the time of its samples. The overhead is measured in the
        first pass, which takes one sample. Without this correction, on a busy machine a single sample would appear to
        take the whole time of a pass, and the number of samples would never be increased to two.
        """
        if self.done:
            return
        render, scene = self._render, self.scene
        assert render is not None and scene is not None
        most = min(render.done, MAX_PER_PASS, scene.spp - render.done, int(PASS_SECONDS / self._per_sample))
        count = max(1, most)
        started = time.perf_counter()
        render.advance(count)
        took = time.perf_counter() - started
        if render.done == count:
            self._first_pass, self._per_sample = took, MIN_SECONDS
        elif count > 1:
            self._per_sample = max((took - self._first_pass) / (count - 1), MIN_SECONDS)
        else:  # the delay may be over, so two samples are soon tried again
            self._per_sample = max(self._per_sample / 2, MIN_SECONDS)

    def image(self) -> Pixels:
        """The picture, (height, width, 4) float32: linear radiance of the balls only, averaged over each pixel, and
        coverage."""
        if self._render is None:
            raise InputError("nothing to show yet", "Reference.image", "call show first")
        return self._render.image()


# --------------------------------------------------------------------------- balls


class _Balls:
    """The scene of the balls, which is reused as long as only values change."""

    def __init__(self, mi: ModuleType):
        self.mi = mi
        self.parts: dict[str, Shape] = {}
        self._structure: Structure = ()
        self._scene: Scene = None
        self._parameters: list[OfVariant] = []

    def place(self, rows: Sequence[Sequence[BSDF]], spacing: float) -> Scene:
        flat = [bsdf for row in rows for bsdf in row]
        structure = (spacing, *([_structure(bsdf) for bsdf in row] for row in rows))
        if structure != self._structure:
            bsdfs = [self.mi.load_dict(self._plugin(bsdf)) for bsdf in flat]
            places = [
                [(j - (len(row) - 1) / 2) * spacing, ((len(rows) - 1) / 2 - i) * spacing, 0.0]
                for i, row in enumerate(rows)
                for j in range(len(row))
            ]
            self.parts = {f"ball{n}": self._ball(p, b) for n, (p, b) in enumerate(zip(places, bsdfs, strict=True))}
            self._scene = self.mi.load_dict({"type": "scene", **self.parts})
            self._parameters = [self.mi.traverse(bsdf) for bsdf in bsdfs]
            self._structure = structure
        for parameters, bsdf in zip(self._parameters, flat, strict=True):
            for name, value in _slots(bsdf).items():
                parameters[name] = self.mi.Color3f(*value) if isinstance(value, tuple) else self.mi.Float(value)
            parameters.update()
        return self._scene

    def _ball(self, place: Sequence[float], bsdf: BSDFPlugin) -> Shape:
        to_world = np.eye(4)
        to_world[:3, :3], to_world[:3, 3] = SPHERE_AXES, place
        return self.mi.load_dict({"type": "sphere", "to_world": self.mi.ScalarTransform4f(to_world), "bsdf": bsdf})

    def _plugin(self, bsdf: BSDF) -> PluginDict:
        """A material as a plugin, whose numeric parameters have the names of their slots."""
        plugin: PluginDict = {"type": adapter.register_model(self.mi, type(bsdf))}
        for name, inner in tree.children(bsdf).items():
            plugin[name] = self._plugin(inner)
        for name, parameter in bsdf.parameters().items():
            if not parameter.numeric and not parameter.inner:
                plugin[name] = getattr(bsdf, name)
        for name, value in _slots(bsdf).items():
            if "." not in name:
                plugin[name] = {"type": "rgb", "value": list(value)} if isinstance(value, tuple) else value
        return plugin


def _slots(bsdf: BSDF) -> dict[str, float | tuple[float, ...]]:
    """The numeric parameters of a material by the adapter's names: a pair of alphas becomes alpha_x and alpha_y, and a
    rotation of 0 has no slot."""
    slots: dict[str, float | tuple[float, ...]] = {}
    for path, parameter, value, _ in tree.leaves(bsdf):
        if parameter.kind == "spectrum":
            color = np.broadcast_to(np.asarray(value, float), 3)
            slots[path] = tuple(float(x) for x in color)
        elif parameter.kind == "alpha" and isinstance(value, tuple | list):
            slots[f"{path}_x"], slots[f"{path}_y"] = float(value[0]), float(value[1])
        elif parameter.numeric and not (parameter.kind == "angle" and value == 0):
            slots[path] = float(value)
    return slots


def _structure(bsdf: BSDF) -> Structure:
    """Everything that determines a material's code: its classes, its choices, and the names of its numeric slots."""
    shape = [(path, type(inner), inner.delta) for path, inner in tree.walk(bsdf)]
    choices = [leaf.value for leaf in tree.leaves(bsdf) if not leaf.parameter.numeric]
    return shape, choices, sorted(_slots(bsdf))


# --------------------------------------------------------------------------- lights


class _Lamps:
    """The scene of the lights, which is reused as long as only values change."""

    def __init__(self, mi: ModuleType):
        self.mi = mi
        self.parts: dict[str, Plugin] = {}
        self._shown: list[Pixels | None] = []
        self.extended = False
        self._structure: Structure | None = None
        self._scene: Scene = None

    def place(self, given: Sequence[messages.Light], pictures: Mapping[str, Pixels]) -> Scene:
        for light in given:
            if isinstance(light, messages.Environment) and light.image and light.image.key not in pictures:
                hint = "upload it before the scene that refers to it"
                raise InputError(f"unknown picture '{light.image.key}'", "lights", hint)
        shown = [pictures[x.image.key] if isinstance(x, messages.Environment) and x.image else None for x in given]
        structure = tuple(light.type for light in given)
        # a key may be reused for another picture, so the arrays themselves are compared
        if structure != self._structure or any(a is not b for a, b in zip(shown, self._shown, strict=True)):
            self.parts = {f"light{n}": self.mi.load_dict(self._plugin(x, pictures)) for n, x in enumerate(given)}
            self._scene = self.mi.load_dict({"type": "scene", **self.parts})
            self._structure, self._shown = structure, shown
            self.extended = any(light.type in ("area", "environment") for light in given)
        self.write(self._scene, given)
        return self._scene

    def write(self, scene: Scene, given: Sequence[messages.Light]) -> None:
        """Write the lights' values into a scene that contains the lights. The values are written through the scene, so
        that it updates its geometry."""
        parameters = self.mi.traverse(scene)
        for n, light in enumerate(given):
            for name, value in self._values(light).items():
                parameters[f"light{n}.{name}"] = value
        parameters.update()

    def _plugin(self, light: messages.Light, pictures: Mapping[str, Pixels]) -> PluginDict:
        """A light of the right kind; `write` sets its values."""
        white = {"type": "rgb", "value": [1.0, 1.0, 1.0]}
        match light:
            case messages.Directional():
                return {"type": "directional", "irradiance": white}
            case messages.Point():
                return {"type": "point", "intensity": white}
            case messages.Area():
                return {"type": "rectangle", "emitter": {"type": "gonio_area", "radiance": white}}
            case messages.Environment(image=messages.Image(key=key)):
                picture = pictures[key]
                if not picture.any():  # a density of 0 cannot be normalized; 1e-20 is too dark to be visible
                    picture = np.full_like(picture, 1e-20)
                return textures.environment(self.mi, picture)
        return {"type": "constant", "radiance": white}

    def _values(self, light: messages.Light) -> dict[str, OfVariant]:
        """The parameters of a light by Mitsuba's names."""
        mi = self.mi
        match light:
            case messages.Directional():
                toward = -np.array(light.direction) / np.linalg.norm(light.direction)
                turn = mi.Transform4f(_looking(toward))
                return {"to_world": turn, "irradiance.value": mi.Color3f(*light.irradiance)}
            case messages.Point():
                return {"position": mi.Point3f(*light.position), "intensity.value": mi.Color3f(*light.intensity)}
            case messages.Area():
                to_world = np.eye(4)
                normal = np.cross(light.u, light.v)
                if np.linalg.norm(normal) == 0.0:
                    raise InputError("an area light whose edges are parallel", "lights", "give two that span an area")
                to_world[:3, :3] = np.stack([light.u, light.v, normal / np.linalg.norm(normal)], 1)
                to_world[:3, 3] = light.center
                radiance = mi.Color3f(*light.radiance)
                return {"to_world": mi.Transform4f(to_world), "emitter.radiance.value": radiance}
            case messages.Environment(image=None):
                return {"radiance.value": mi.Color3f(*light.constant) * light.scale}
        # Half a turn: see textures.environment. Modulo a full turn, because float32 loses precision for large angles.
        turn = mi.Transform4f().rotate([0, 1, 0], math.degrees(light.rotation % math.tau) + 180.0)
        return {"to_world": turn, "scale": float(light.scale)}


def _looking(toward: NDArray[np.float64]) -> NDArray[np.float64]:
    """A rotation that maps +z to a direction."""
    side = np.cross([0.0, 1.0, 0.0] if abs(toward[1]) < 0.9 else [1.0, 0.0, 0.0], toward)
    side /= np.linalg.norm(side)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([side, np.cross(toward, side), toward], 1)
    return matrix
