"""With the acceleration switched off pictures are the same, within their noise or to the bit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gonio.bridge import adapter, engine
from gonio.transport import fast
from gonio.transport.fast.lamp_table import TabledLamps
from gonio.transport.fast.light_grid import LightGrid
from gonio.transport.fast.rectangle_light import RectangleLight
from gonio.transport.integrators import Render, Settings
from gonio.transport.lights import area_light

mi = engine.load()
adapter.register(mi)
area_light.register(mi)
T = mi.ScalarTransform4f
FLOOR = {"type": "rectangle", "to_world": T().rotate([1, 0, 0], -90).scale(4), "bsdf": {"type": "diffuse"}}
BALL = {"type": "sphere", "center": [0, 0.7, 0], "radius": 0.7, "bsdf": {"type": "gonio_conductor", "alpha": 0.3}}
SKY = {"type": "constant", "radiance": 0.3}
RUNS, BLOCK = 8, 4


def lamp(x: float) -> dict[str, Any]:
    above = T().translate([x, 2.5, 0]).rotate([1, 0, 0], 90).scale(0.5)
    radiance = {"type": "rgb", "value": [5.0, 6.0, 7.0]}
    return {
        "type": "rectangle",
        "to_world": above,
        "emitter": {"type": "gonio_area", "radiance": radiance, "tag": str(x)},
    }


BULB = {"type": "sphere", "center": [1.5, 2, 0], "radius": 0.2, "emitter": {"type": "area", "radiance": 9.0}}
SCENES = {"one rectangle": (lamp(0.0),), "several lamps and a sky": (lamp(-1.0), lamp(1.0), BULB, SKY)}


def scene(lights: tuple[dict[str, Any], ...], ball: dict[str, Any] = BALL) -> Any:
    eye = T().look_at([0, 2, 5], [0, 0.7, 0], [0, 1, 0])
    film = {"type": "hdrfilm", "width": 16, "height": 12, "rfilter": {"type": "box"}}
    sensor = {"type": "perspective", "fov": 40, "to_world": eye, "film": film}
    parts = {f"light{i}": light for i, light in enumerate(lights)}
    return mi.load_dict({"type": "scene", "sensor": sensor, "floor": FLOOR, "ball": ball, **parts}, optimize=False)


def blocks(drawn: Any, integrator: str, spp: int) -> np.ndarray:
    """Means of BLOCK x BLOCK pixels, (RUNS, blocks)."""
    found = []
    for seed in range(RUNS):
        render = Render(drawn, Settings(integrator, max_depth=4, seed=seed))
        render.advance(spp)
        assert render.invalid == 0
        found.append(render.image().reshape(12 // BLOCK, BLOCK, 16 // BLOCK, BLOCK, 3).mean((1, 3, 4)).ravel())
    return np.array(found)


@pytest.mark.sample(1)
@pytest.mark.parametrize("lights", SCENES)
@pytest.mark.parametrize("integrator", ["path", "direct"])
def test_pictures_are_the_same_without_the_acceleration(
    lights: str, integrator: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn = scene(SCENES[lights])
    quick = blocks(drawn, integrator, 64)
    monkeypatch.setenv("GONIO_FAST", "0")
    plain = blocks(drawn, integrator, 64)
    square = (quick.var(0, ddof=1) + plain.var(0, ddof=1)) / RUNS
    z = np.abs(quick.mean(0) - plain.mean(0)) / np.sqrt(0.5 * (square + square.mean()))
    assert z.max() < 5.0
    assert not np.array_equal(quick, plain), "then nothing was switched off"


def test_pictures_of_scenes_with_nothing_to_accelerate_are_the_same_to_the_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    """A cylinder, under a point."""
    cylinder = {"type": "cylinder", "p1": [0, 1, 0], "radius": 0.5, "bsdf": {"type": "diffuse"}}
    drawn = scene(({"type": "point", "position": [1, 3, 1], "intensity": 20.0},), cylinder)
    pictures = []
    for value in ("1", "0"):
        monkeypatch.setenv("GONIO_FAST", value)
        render = Render(drawn, Settings("path", seed=3))
        render.advance(4)
        pictures.append(render.image())
    assert np.array_equal(*pictures)


def test_the_switch_leaves_no_accelerated_part(monkeypatch: pytest.MonkeyPatch) -> None:
    for lights in SCENES.values():
        data = Render(scene(lights), Settings("path"))._integrator.data
        assert data.surfaces.inline is not None and data.surfaces.placements is not None
        assert isinstance(data.lights.lamps, (RectangleLight, TabledLamps))
        monkeypatch.setenv("GONIO_FAST", "0")
        assert not fast.enabled()
        data = Render(scene(lights), Settings("path"))._integrator.data
        assert data.surfaces.inline is None and data.surfaces.placements is None
        assert not isinstance(data.lights.lamps, (RectangleLight, TabledLamps)) and not data.lights.shortens_last_ray
        assert not isinstance(getattr(data.lights, "choice", None), LightGrid)
        monkeypatch.delenv("GONIO_FAST")
