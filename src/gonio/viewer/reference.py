"""The path-traced truth beside the page's picture: the same balls, lights and camera, by Gonio's own renderer.

    >>> reference = Reference(stage)
    >>> reference.show(scene)           # a messages.Scene
    >>> while not reference.done:
    ...     reference.advance()         # some more samples of every pixel, about a twentieth of a second
    >>> reference.image()               # (height, width, 4): radiance and coverage

Two kinds of light transport:

"local"  Direct light, one bounce (depth 2). The balls stand in one scene and the lights in another, so that each
         point sees every light with nothing in between and no ball lights or shadows another: what a shader
         computes that knows one point. Lights and BSDF are sampled both and weighed (multiple importance sampling).
"path"   Balls and lights in one scene, with shadows, the light between the balls, and refraction through them.

Pixels are averaged over a box one pixel wide. A changed value compiles nothing: parameters, lights and camera are data
of the kernel and are written into the scene that is there. Another model, choice, number of balls or kind of light
makes a new scene.
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
Structure: TypeAlias = tuple[object, ...]  # equal for what one kernel serves

PASS_SECONDS = 0.05  # of work before someone may interrupt: half of what a slider's change may take to be seen
MOST_PER_PASS = 64
QUICKEST = PASS_SECONDS / MOST_PER_PASS  # seconds a sample, where none was measured yet

# Mitsuba's sphere has its axis along z and u from x toward y; the page's has it along y and u from z toward x.
SPHERE_AXES = ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))


class Reference:
    """A picture in the making of what the page shows.

    what    materials by key, from which a scene's rows take theirs
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
        self._whole: tuple[tuple[dict[str, Plugin], dict[str, Plugin]], Scene] = (({}, {}), None)
        self._first_pass = 0.0  # seconds
        self._per_sample = QUICKEST

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
        """Begin a picture anew; InputError for a material, parameter or picture that is not known."""
        bsdfs = [self._materials(row, f"rows/{index}") for index, row in enumerate(scene.state.rows)]
        balls = self._balls.place(bsdfs, scene.state.spacing)
        lamps = self._lamps.place(scene.state.lights, self.pictures)
        sensor = self._sensor(scene)
        if scene.transport == "path":
            settings = integrators.Settings("path", max_depth=scene.max_depth)
            whole = self._together()
            self._lamps.write(whole, scene.state.lights)
            render = foreground.Foreground(whole, settings, sensor)
        else:
            # a light without extent is never met by a sampled direction: sampling the BSDF would be for nothing
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
        if any(a is not b for a, b in zip(self._whole[0], parts, strict=True)):
            self._whole = parts, self.mi.load_dict({"type": "scene", **parts[0], **parts[1]})
        return self._whole[1]

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
                "near_clip": 1e-3,  # the clips are literals of the kernel: values that moved would compile one
                "far_clip": 1e8,
                "to_world": mi.ScalarTransform4f().look_at(list(eye), list(target), up),
                "film": {"type": "hdrfilm", "width": scene.width, "height": scene.height, "rfilter": {"type": "box"}},
            }
        )

    def advance(self) -> None:
        """Some more samples: one at first, so that there is a picture soon; then as many again as there are, while that
        takes no more than PASS_SECONDS.

        A pass costs something by itself, in Python, besides its samples. The first pass, of one sample, tells how much;
        without it a busy machine would seem to need all its time for one sample, and never try two.
        """
        if self.done:
            return
        render, scene = self._render, self.scene
        assert render is not None and scene is not None
        most = min(render.done, MOST_PER_PASS, scene.spp - render.done, int(PASS_SECONDS / self._per_sample))
        count = max(1, most)
        started = time.perf_counter()
        render.advance(count)
        took = time.perf_counter() - started
        if render.done == count:
            self._first_pass, self._per_sample = took, QUICKEST
        elif count > 1:
            self._per_sample = max((took - self._first_pass) / (count - 1), QUICKEST)
        else:  # whatever held it up may be over: soon two are tried again
            self._per_sample = max(self._per_sample / 2, QUICKEST)

    def image(self) -> Pixels:
        """(height, width, 4) float32: linear radiance of the balls alone, averaged over the pixel, and coverage."""
        if self._render is None:
            raise InputError("nothing to show yet", "Reference.image", "call show first")
        return self._render.image()


# --------------------------------------------------------------------------- balls


class _Balls:
    """The balls' scene, kept as long as only values change."""

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
        """A material as a plugin; numbers as their slots name them."""
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
    """The numbers of a material by the adapter's names: two widths are alpha_x and alpha_y, no turn is no slot."""
    slots: dict[str, float | tuple[float, ...]] = {}
    for path, parameter, value, _ in tree.leaves(bsdf):
        if parameter.kind == "spectrum":
            colour = np.broadcast_to(np.asarray(value, float), 3)
            slots[path] = tuple(float(x) for x in colour)
        elif parameter.kind == "alpha" and isinstance(value, tuple | list):
            slots[f"{path}_x"], slots[f"{path}_y"] = float(value[0]), float(value[1])
        elif parameter.numeric and not (parameter.kind == "angle" and value == 0):
            slots[path] = float(value)
    return slots


def _structure(bsdf: BSDF) -> Structure:
    """What shapes a material's code: classes, choices, and which numbers there are."""
    shape = [(path, type(inner), inner.delta) for path, inner in tree.walk(bsdf)]
    choices = [leaf.value for leaf in tree.leaves(bsdf) if not leaf.parameter.numeric]
    return shape, choices, sorted(_slots(bsdf))


# --------------------------------------------------------------------------- lights


class _Lamps:
    """The lights' scene, kept as long as only values change."""

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
                hint = "upload it before the scene that names it"
                raise InputError(f"unknown picture '{light.image.key}'", "lights", hint)
        shown = [pictures[x.image.key] if isinstance(x, messages.Environment) and x.image else None for x in given]
        structure = tuple(light.type for light in given)
        # a key may be given to another picture: the arrays themselves are compared
        if structure != self._structure or any(a is not b for a, b in zip(shown, self._shown, strict=True)):
            self.parts = {f"light{n}": self.mi.load_dict(self._plugin(x, pictures)) for n, x in enumerate(given)}
            self._scene = self.mi.load_dict({"type": "scene", **self.parts})
            self._structure, self._shown = structure, shown
            self.extended = any(light.type in ("area", "environment") for light in given)
        self.write(self._scene, given)
        return self._scene

    def write(self, scene: Scene, given: Sequence[messages.Light]) -> None:
        """Put the lights' values into a scene that holds them; by way of the scene, which then moves its geometry."""
        parameters = self.mi.traverse(scene)
        for n, light in enumerate(given):
            for name, value in self._values(light).items():
                parameters[f"light{n}.{name}"] = value
        parameters.update()

    def _plugin(self, light: messages.Light, pictures: Mapping[str, Pixels]) -> PluginDict:
        """The kind of light; values follow by `write`."""
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
                if not picture.any():  # nothing to choose directions by; too dark for any picture will do
                    picture = np.full_like(picture, 1e-20)
                return textures.environment(self.mi, picture)
        return {"type": "constant", "radiance": white}

    def _values(self, light: messages.Light) -> dict[str, OfVariant]:
        """A light's parameters by Mitsuba's names."""
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
        # half a turn: see textures.environment
        # (modulo a turn: float32 keeps no angle of many turns)
        turn = mi.Transform4f().rotate([0, 1, 0], math.degrees(light.rotation % math.tau) + 180.0)
        return {"to_world": turn, "scale": float(light.scale)}


def _looking(toward: NDArray[np.float64]) -> NDArray[np.float64]:
    """A rotation that takes +z to a direction."""
    side = np.cross([0.0, 1.0, 0.0] if abs(toward[1]) < 0.9 else [1.0, 0.0, 0.0], toward)
    side /= np.linalg.norm(side)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([side, np.cross(toward, side), toward], 1)
    return matrix
