"""Directions toward environments: their density is what it says, and no picture depends on it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gonio.bridge import engine
from gonio.transport.integrators import Render, Settings
from gonio.transport.lights import sky

mi = engine.load()
import drjit as dr  # noqa: E402  (after `load` has chosen an LLVM)

T = mi.ScalarTransform4f


def sunny(sun: float = 300.0) -> np.ndarray:
    """A map of 32 x 64: brighter above, and a sun of a few texels."""
    y, x = np.mgrid[0:32, 0:64]
    pixels = np.stack([0.2 + 0.02 * (32 - y), 0.3 + 0.01 * (32 - y), 0.5 + 0.005 * x], -1).astype(np.float32)
    pixels[6:8, 20:23] = sun
    return pixels


def scene(pixels: np.ndarray, ball: dict[str, Any] | None = None, **rest: Any) -> Any:
    film = {"type": "hdrfilm", "width": 24, "height": 16, "rfilter": {"type": "box"}}
    eye = T().look_at([0, 1, 4], [0, 0, 0], [0, 1, 0])
    grey = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.5}}
    floor = T().translate([0, -0.5, 0]).rotate([1, 0, 0], -90).scale(4)
    turned = T().rotate([1, 2, 3], 70)
    return mi.load_dict(
        {
            "type": "scene",
            "sensor": {"type": "perspective", "fov": 40, "to_world": eye, "film": film},
            "sky": {"type": "envmap", "bitmap": mi.Bitmap(pixels), "to_world": turned},
            "ball": {"type": "sphere", "radius": 0.5, "bsdf": ball or grey},
            "floor": {"type": "rectangle", "to_world": floor, "bsdf": grey},
            **rest,
        }
    )


@pytest.mark.parametrize("compensated", [False, True])
def test_directions_are_as_dense_as_they_say(compensated: bool) -> None:
    made = scene(sunny())
    found = sky.Sky(mi, made, made.environment(), compensated)
    n = 1 << 9
    index = dr.arange(mi.UInt32, n * n)
    u = mi.Point2f((mi.Float(index % n) + 0.5) / n, (mi.Float(index // n) + 0.5) / n)
    it = dr.zeros(mi.SurfaceInteraction3f, n * n)
    direction, _, density, radiance = found.sample(it, u, mi.Bool(True))
    same = np.isclose(np.array(found.pdf(direction)), np.array(density), rtol=1e-4)
    assert same.mean() > 0.999  # rounding moves some over an edge of their cell
    # means over the sphere by these directions and by even ones: of x^2, y^2, and of the light
    z = 1 - 2 * np.array(u.x)
    sine, turn = np.sqrt(1 - z * z), 2 * np.pi * np.array(u.y)
    even = mi.Vector3f(sine * np.cos(turn), sine * np.sin(turn), z)
    si = dr.zeros(mi.SurfaceInteraction3f, n * n)
    si.wi = -even
    light = np.array(made.environment().eval(si)).reshape(3, -1)
    weight = 1 / np.array(density)
    assert np.mean(np.array(found.pdf(even))) * 4 * np.pi == pytest.approx(1, rel=0.03)
    assert np.mean(weight) / (4 * np.pi) == pytest.approx(1, rel=0.02)
    seen = np.mean(np.array(radiance).reshape(3, -1) * weight, 1) / (4 * np.pi)
    np.testing.assert_allclose(seen, light.mean(1), rtol=0.03)


def test_what_lobes_find_is_left_to_them() -> None:
    made = scene(sunny())
    up = mi.Vector3f(0, 1, 0)
    plain, left = (sky.Sky(mi, made, made.environment(), compensated) for compensated in (False, True))
    assert left.pdf(up)[0] < 0.2 * plain.pdf(up)[0]  # far from the sun


METAL = {"type": "roughconductor", "alpha": 0.2, "distribution": "ggx", "material": "Au"}
LAMP = {
    "type": "sphere",
    "center": [1, 2, 1],
    "radius": 0.2,
    "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 20.0}},
}


@pytest.mark.sample(1)
@pytest.mark.parametrize(("ball", "rest"), [(None, {}), (METAL, {"lamp": LAMP})], ids=["grey", "gold, and a lamp"])
def test_pictures_are_those_of_lobes_alone(ball: dict[str, Any] | None, rest: dict[str, Any]) -> None:
    made = scene(sunny(20.0), ball, **rest)

    def pictures(integrator: str, spp: int) -> np.ndarray:
        found = []
        for seed in range(8):
            render = Render(made, Settings(integrator, seed=seed))
            render.advance(spp)
            found.append(render.image().reshape(4, 4, 6, 4, 3).mean((1, 3, 4)))
        return np.array(found)

    both, lobes = pictures("direct", 128), pictures("directSampleBSDF", 1024)
    lights = pictures("directSampleLight", 1024)
    for other in (lobes, lights):
        square = both.var(0, ddof=1) / 8 + other.var(0, ddof=1) / 8
        z = np.abs(both.mean(0) - other.mean(0)) / np.sqrt(0.5 * (square + square.mean()))
        assert z.max() < 5.0


@pytest.mark.parametrize("odd", ["one texel", "a sun of 1e6", "a texel that is no number", "black"])
def test_odd_environments_give_finite_pictures(odd: str) -> None:
    pixels = sunny(1e6 if odd == "a sun of 1e6" else 1.0)
    if odd == "one texel":
        pixels = pixels[:2, :2].copy()
    if odd == "black":
        pixels[:] = 0
    if odd == "a texel that is no number":
        pixels[5, 5] = np.nan
    render = Render(scene(pixels), Settings("path", 3, seed=1))
    render.advance(16)
    picture = render.image()
    assert np.isfinite(picture).all() and picture.min() >= 0
    assert (picture.max() > 0) == (odd != "black")
