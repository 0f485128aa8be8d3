"""What the camera sees of lamps by mirrors and glass alone, which `caustics` looks for twice."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gonio.render import engine
from gonio.render.integrators import Render, Settings
from gonio.render.integrators.caustics import Caustics

mi = engine.load()

T = mi.ScalarTransform4f
GLASS = {"type": "dielectric", "int_ior": 1.5}
AREA = {"type": "area", "radiance": {"type": "rgb", "value": [8, 6, 4]}}
COATED = {"type": "plastic", "diffuse_reflectance": {"type": "rgb", "value": 0.6}}
SILVER = {"type": "conductor", "material": "Ag"}


def scene(glass: dict, radius: float, size: int = 20, wall: dict | None = SILVER, **rest: Any) -> Any:
    """A ball before a wall, a ball lamp beside it."""
    film = {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}}
    eye = T().look_at([0, 0.3, 4], [0, 0, 0], [0, 1, 0])
    lamp = {"type": "sphere", "center": [1.2, 1, 1.2], "radius": radius, "emitter": AREA}
    return mi.load_dict(
        {
            "type": "scene",
            "sensor": {"type": "perspective", "fov": 30, "to_world": eye, "film": film},
            "ball": {"type": "sphere", "radius": 0.7, "bsdf": glass},
            "lamp": lamp,
            **({"wall": {"type": "rectangle", "to_world": T().translate([0.2, 0, -1]), "bsdf": wall}} if wall else {}),
            **rest,
        }
    )


def pictures(drawn: Any, integrator: str, spp: int, runs: int, depth: int = 8) -> np.ndarray:
    found = []
    for seed in range(runs):
        render = Render(drawn, Settings(integrator, depth, seed=seed))
        render.advance(spp)
        assert render.invalid == 0
        found.append(render.image())
    return np.array(found, float)


def agree(a: np.ndarray, b: np.ndarray, side: int = 5) -> None:
    """Two stacks of pictures have the same mean, and so have their blocks."""

    def blocks(images: np.ndarray) -> np.ndarray:
        n, h, w, _ = images.shape
        return images.mean(-1).reshape(n, h // side, side, w // side, side).mean((2, 4)).reshape(n, -1)

    for x, y in ((blocks(a), blocks(b)), (a.mean((1, 2)), b.mean((1, 2)))):
        error = np.sqrt(x.var(0, ddof=1) / len(x) + y.var(0, ddof=1) / len(y))
        error = np.maximum(error, error.mean())
        assert (abs(x.mean(0) - y.mean(0)) / error).max() < 5
        # and that says something
        assert error.mean() < 0.03 * y.mean()


BENT = {"type": "bumpmap", "arbitrary": {"type": "bitmap", "raw": True, "bitmap": mi.Bitmap(np.eye(4, dtype="f"))}}


COPPER = {"type": "conductor", "material": "Cu"}
MATERIALS = {
    "glass": GLASS,
    "two glasses": {"type": "blendbsdf", "weight": 0.3, "a": GLASS, "b": {"type": "dielectric", "int_ior": 1.8}},
    "copper with holes": {"type": "mask", "opacity": 0.4, "bsdf": COPPER},
    "glass with holes": {"type": "mask", "opacity": 0.6, "bsdf": GLASS},
    "a pane": {"type": "thindielectric", "int_ior": 1.8},
    "bent glass": {**BENT, "bsdf": GLASS},
    "coated": COATED,
}


@pytest.mark.parametrize(
    "name", [n if k < 3 else pytest.param(n, marks=pytest.mark.slow) for k, n in enumerate(MATERIALS)]
)
def test_second_trips_take_nothing_and_add_nothing(name: str) -> None:
    drawn = scene(MATERIALS[name], 0.5)
    agree(pictures(drawn, "caustics", 64, 6), pictures(drawn, "path", 512, 6))


def test_second_trips_find_what_first_ones_hardly_do(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = scene(GLASS, 0.3, wall=None)
    with_them = pictures(drawn, "caustics", 64, 12)
    monkeypatch.setattr(Caustics, "_both_ends", lambda self: False)
    without = pictures(drawn, "caustics", 64, 12)
    assert with_them.var(0, ddof=1).mean() < 0.5 * without.var(0, ddof=1).mean()


def test_second_trips_end_where_light_is_scattered(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = scene(GLASS, 0.5, wall=COATED)
    with_them = pictures(drawn, "caustics", 128, 6)
    monkeypatch.setattr(Caustics, "_both_ends", lambda self: False)
    agree(with_them, pictures(drawn, "caustics", 128, 6))


def test_features_are_of_first_trips() -> None:
    drawn = scene(GLASS, 0.5)
    path, caustics = (Render(drawn, Settings(name, 8), aovs=True) for name in ("path", "caustics"))
    for render in (path, caustics):
        render.advance(16)
    for name, feature in path.aov().items():
        assert np.array_equal(feature, caustics.aov()[name])


def test_a_lamp_that_mirrors_alone_show_is_seen_once() -> None:
    other = {"type": "sphere", "center": [-1, -0.7, 0.5], "radius": 0.2, "bsdf": GLASS}
    drawn = scene(SILVER, 0.5, other=other)
    agree(pictures(drawn, "caustics", 64, 6), pictures(drawn, "path", 256, 6))


def test_long_chains_keep_their_weights_finite() -> None:
    drawn = scene({"type": "dielectric", "int_ior": 1.01}, 0.5, size=8)
    found = pictures(drawn, "caustics", 2048, 1, depth=100)  # asserts that no value is left out
    assert found.mean() > 0.01
