"""Which of many lamps to look at: near ones more often, all now and then, and no picture depends on it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gonio.bridge import engine
from gonio.transport.fast import light_grid
from gonio.transport.integrators import Render, Settings

mi = engine.load()
import drjit as dr  # noqa: E402  (after `load` has chosen an LLVM)

T = mi.ScalarTransform4f


@pytest.fixture(scope="module")
def scene() -> Any:
    """A floor under nine small lamps."""
    film = {"type": "hdrfilm", "width": 24, "height": 16, "rfilter": {"type": "box"}}
    eye = T().look_at([0, 4, 4], [0, 0, 0], [0, 1, 0])
    made: dict[str, Any] = {
        "type": "scene",
        "sensor": {"type": "perspective", "fov": 50, "to_world": eye, "film": film},
        "floor": {"type": "rectangle", "to_world": T().rotate([1, 0, 0], -90).scale(3), "bsdf": {"type": "diffuse"}},
    }
    for i in range(9):
        radiance = {"type": "rgb", "value": [5.0 + i, 9.0, 14.0 - i]}
        center = [i % 3 * 2.0 - 2.0, 0.5, i // 3 * 2.0 - 2.0]
        light = {"type": "area", "radiance": radiance}
        made[f"lamp{i}"] = {"type": "sphere", "center": center, "radius": 0.1, "emitter": light}
    return mi.load_dict(made)


def test_lamps_are_chosen_as_often_as_it_says(scene: Any) -> None:
    found = light_grid.LightGrid(mi, scene, scene.emitters())
    n = 1 << 14
    u = (dr.arange(mi.Float, n) + 0.5) / n
    for place in ([-2.0, 0.0, -2.0], [0.3, 0.0, 0.9], [50.0, 0.0, 0.0]):  # the last lies outside of the scene
        p = mi.Point3f(*place)
        index, left, chance = found.choose(p, u)
        often = np.bincount(np.array(index), minlength=9) / n
        told = np.array([found.probability(p, mi.UInt32(i), mi.Bool(True))[0] for i in range(9)])
        assert told.sum() == pytest.approx(1, abs=1e-5) and told.min() >= light_grid.EVEN / 9 - 1e-6
        np.testing.assert_allclose(often, told, atol=2e-4)
        np.testing.assert_allclose(np.array(chance), told[np.array(index)], rtol=1e-6)
        assert np.array(left).min() >= 0 and np.array(left).max() <= 1
        assert np.mean(np.array(left)) == pytest.approx(0.5, abs=0.01)
    corner = [found.probability(mi.Point3f(-2, 0, -2), mi.UInt32(i), mi.Bool(True))[0] for i in range(9)]
    at = [np.array(emitter.get_shape().bbox().center()).ravel() for emitter in scene.emitters()]
    nearest = int(np.argmin([np.linalg.norm(x - [-2, 0.5, -2]) for x in at]))
    assert np.argmax(corner) == nearest and max(corner) > 0.4


@pytest.mark.slow
def test_the_picture_is_that_of_lobes(scene: Any) -> None:
    def pictures(integrator: str, spp: int) -> np.ndarray:
        found = []
        for seed in range(8):
            render = Render(scene, Settings(integrator, seed=seed))
            render.advance(spp)
            found.append(render.image().reshape(4, 4, 6, 4, 3).mean((1, 3, 4)))
        return np.array(found)

    lobes = pictures("directSampleBSDF", 2048)
    for integrator, spp in (("direct", 64), ("directSampleLight", 256)):
        both = pictures(integrator, spp)
        square = both.var(0, ddof=1) / 8 + lobes.var(0, ddof=1) / 8
        z = np.abs(both.mean(0) - lobes.mean(0)) / np.sqrt(0.5 * (square + square.mean()))
        assert z.max() < 5.0
