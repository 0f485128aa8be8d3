"""How bright the balls of a page are beside the path-traced reference: what to show, and what to compare."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from gonio.material import tree
from gonio.viewer import messages, reference, stage

SUN = dict(stage.SUN)
POINT = {"type": "point", "position": [3.0, 4.0, 5.0], "intensity": [120.0, 90.0, 60.0]}
FURNACE = {"type": "environment", "image": None, "constant": [1.0] * 3, "rotation": 0.0, "scale": 1.0}

BAR = 0.03
MOST = 40  # balls in a picture, in rows of eight
WIDE = 8

# rows of [material, choices, values of each ball], and what lights them, in the place of what the page shows
SHOW = """([rows, lights, camera]) => gonio.setState((s) => {
  s.slots = rows.map(([material, choices, balls]) => ({
    label: "", material, choices, values: {}, visible: true, balls: balls.map((set) => ({ label: "", set })),
  }));
  s.lights = lights.map((light) => ({ ...light, on: true, name: "" }));
  s.camera = camera;
  s.selection = { slot: 0, ball: 0 };
})"""
LACKING = "() => gonio.app.state.slots.reduce((sum, row) => sum + gonio.app.lacking(row).length, 0)"

Values = dict[str, Any]


class Show(NamedTuple):
    """Balls of one material to be shown together.

    label  what they are
    lamps  lights to show them in, one after the other
    """

    label: str
    choices: Values
    balls: list[Values]
    lamps: tuple[dict[str, Any], ...] = (SUN, FURNACE)


def shows(what: stage.Stage) -> Iterator[Show]:
    """All that a page of one model can be asked for: its own balls, what its choices toggle, layers, presets."""
    material = what.materials["m0"]
    own = [dict(ball.values) for ball in what.rows[0].balls]
    yield Show("own", {}, own)
    for path, names in material.choices.items():
        for name in names[1:]:
            yield Show(f"{path}={name}", {path: name}, own, (SUN,))
    layers = {leaf.path: leaf.parameter for leaf in tree.leaves(material.bsdf) if leaf.parameter.off is not None}
    ends = {path: max(p.low, p.high, key=lambda end, off=p.off: abs(end - off)) for path, p in layers.items()}
    halves = {path: (p.off + ends[path]) / 2 for path, p in layers.items()}
    for path in layers:
        yield Show(f"layer {path}", {}, [{path: halves[path]}, {path: ends[path]}], (SUN,))
    if layers:
        yield Show("all layers", {}, [halves])
    presets: dict[tuple[tuple[str, Any], ...], list[Values]] = {}
    for preset in stage.presets(material.bsdf):
        chosen = {path: value for path, value in preset["set"].items() if isinstance(value, str | bool)}
        numbers = {path: value for path, value in preset["set"].items() if path not in chosen}
        presets.setdefault(tuple(chosen.items()), []).append(numbers)
    for choices, balls in presets.items():
        for at in range(0, len(balls), MOST):
            yield Show(f"presets from {at} {dict(choices)}", dict(choices), balls[at : at + MOST], (FURNACE,))


def rows_of(show: Show) -> list[tuple[str, Values, list[Values]]]:
    return [("m0", show.choices, show.balls[at : at + WIDE]) for at in range(0, len(show.balls), WIDE)]


def framed(what: stage.Stage, rows: list[tuple[str, Values, list[Values]]]) -> Any:
    """The camera before so many balls."""
    made = tuple(stage.Row("", key, tuple(stage.Ball("", ball) for ball in balls)) for key, _, balls in rows)
    return stage.Stage("", what.materials, made).framed()


def traced(tracer: reference.Reference, rows: Any, lights: Any, camera: Any, size: tuple[int, int], spp: int) -> Any:
    """The reference's picture, (height, width, 4)."""
    width, height = size
    half = math.tan(math.radians(camera["fov"]) / 2) * max(1.0, 16 / 9 * height / width)
    state = {
        "rows": [{"material": key, "choices": choices, "balls": balls} for key, choices, balls in rows],
        "lights": lights,
        "camera": {**camera, "fov": math.degrees(2 * math.atan(half))},
        "spacing": stage.SPACING,
    }
    message = messages.parse(
        json.dumps({"type": "scene", "id": 1, "width": width, "height": height, "spp": spp, "state": state})
    )
    assert isinstance(message, messages.Scene)
    tracer.show(message)
    while not tracer.done:
        tracer.advance()
    return np.asarray(tracer.image())


def ratios(rows: Any, camera: Any, picture: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Light of each ball in the picture over that in the truth, pixels shared out by the nearest ball. Where both are
    black it is 1; what is no number is no number."""
    height, width = picture.shape[:2]
    half = math.tan(math.radians(camera["fov"]) / 2) * max(1.0, 16 / 9 * height / width)
    step = stage.SPACING * height / 2 / half / camera["distance"]
    places = [(j - (len(r[2]) - 1) / 2, i - (len(rows) - 1) / 2) for i, r in enumerate(rows) for j in range(len(r[2]))]
    y, x = np.mgrid[:height, :width] + 0.5
    away = [(x - width / 2 - step * u) ** 2 + (y - height / 2 - step * v) ** 2 for u, v in places]
    nearest = np.argmin(away, 0)
    light = [[p[nearest == k][:, :3].sum() for k in range(len(places))] for p in (picture, truth)]
    covered = np.array([truth[nearest == k][:, 3].sum() for k in range(len(places))])
    test, right = np.array(light[0]), np.array(light[1])
    dark = (right < 1e-4 * covered) & (test < 1e-4 * covered)
    return np.where(dark, 1.0, test / np.maximum(right, 1e-9))
