"""Absorption inside glass against Beer and Lambert's law, and media that overlap against scenes without overlap."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.errors import InputError


def slab(low: float, high: float, **glass: object) -> dict[str, Any]:
    """Glass between two heights z, wide enough to have no sides."""
    return {
        "type": "cube",
        "transform": {"scale": [20, 20, (high - low) / 2], "translate": [0, 0, (high + low) / 2]},
        "material": {"type": "gonio-dielectric", "alpha": 0, **glass},
    }


def rendered(folder: Path, shapes: list[dict[str, Any]], eye: float = 6.0, **how: Any) -> np.ndarray:
    """The mean colour of a lamp behind everything, at z = -10, seen straight on."""
    scene = {
        "output": {"filename": "slab.exr"},
        "sampler": {"type": "default", "samples": 64},
        "camera": {
            "type": "pinhole",
            "transform": {"position": [0.3, 0.2, eye], "lookAt": [0.3, 0.2, -1], "up": [0, 1, 0]},
            "verticalFov": 0.5,
            "film": {"size": [16, 16]},
        },
        "integrator": {"type": "path", "maxDepth": 24},
        "scene": {
            "shapes": shapes,
            "lights": [
                {
                    "type": "areaLight",
                    "energy": 1,
                    "shape": {
                        "type": "parallelogram",
                        "base": [-9, -9, -10],
                        "edge0": [18, 0, 0],
                        "edge1": [0, 18, 0],
                        "material": {"type": "matte", "albedo": 0},
                    },
                }
            ],
        },
    }
    file = folder / "scene.json"
    file.write_text(json.dumps(scene))
    return np.asarray(go.render(file, **{"spp": 256, **how}), float).mean((0, 1))


def plate(eta: float, inner: float, lost: float) -> float:
    """What a plate lets through, all reflections inside summed: (1 - R)^2 T / (1 - R^2 T^2)."""
    r, t = ((eta - inner) / (eta + inner)) ** 2, np.exp(-lost)
    return float((1.0 - r) ** 2 * t / (1.0 - (r * t) ** 2))


@pytest.mark.sample(1)
@pytest.mark.parametrize("spectral", [False, True])
def test_a_plate_absorbs_by_beer_and_lambert(tmp_path: Path, spectral: bool) -> None:
    absorption = 0.35 if spectral else [0.1, 0.35, 2.0]
    seen = rendered(tmp_path, [slab(-1, 1, eta=1.5, absorption=absorption)], spectral=spectral, spp=1024)
    expected = [plate(1.5, 1.0, 2.0 * a) for a in np.broadcast_to(absorption, 3)]
    np.testing.assert_allclose(seen, expected, rtol=0.01)


@pytest.mark.slow
def test_colours_above_one_absorb_by_wavelength_too(tmp_path: Path) -> None:
    rgb, spectral = (
        rendered(tmp_path, [slab(-0.5, 0.5, eta=1.3, absorption=[0.2, 0.3, 0.5])], spectral=s, spp=1024)
        for s in (False, True)
    )
    np.testing.assert_allclose(spectral, rgb, rtol=0.06)


def test_a_coin_in_water_is_dimmed_on_both_ways(tmp_path: Path) -> None:
    """An opaque surface inside: the way to it and the way back are lost to the water, though it is not the water's."""
    black = {"type": "matte", "albedo": 0}
    mirror = {"type": "parallelogram", "base": [-9, -9, -1], "edge0": [18, 0, 0], "edge1": [0, 18, 0]}
    shapes = [slab(-2, 1, eta=1.0, absorption=[0.05, 0.2, 0.6]), {**mirror, "material": {"type": "mirror"}}]
    lamp = {"type": "parallelogram", "base": [-9, -9, 12], "edge0": [18, 0, 0], "edge1": [0, 18, 0], "material": black}
    picture = _lit_from(tmp_path, shapes, lamp)
    np.testing.assert_allclose(picture, np.exp(-4.0 * np.array([0.05, 0.2, 0.6])), rtol=0.01)


def _lit_from(folder: Path, shapes: list[dict[str, Any]], lamp: dict[str, Any], eye: float = 6.0) -> np.ndarray:
    scene = {
        "output": {"filename": "slab.exr"},
        "sampler": {"type": "default", "samples": 64},
        "camera": {
            "type": "pinhole",
            "transform": {"position": [0.3, 0.2, eye], "lookAt": [0.3, 0.2, -1], "up": [0, 1, 0]},
            "verticalFov": 0.5,
            "film": {"size": [8, 8]},
        },
        "integrator": {"type": "path", "maxDepth": 12},
        "scene": {"shapes": shapes, "lights": [{"type": "areaLight", "energy": 1, "shape": lamp}]},
    }
    file = folder / "scene.json"
    file.write_text(json.dumps(scene))
    return np.asarray(go.render(file, spp=64), float).mean((0, 1))


def test_light_that_is_sampled_inside_a_medium_is_dimmed_on_its_way(tmp_path: Path) -> None:
    """A matte floor and a lamp in the same water: shadow rays and found rays must agree."""
    floor = {"type": "parallelogram", "base": [-30, -30, -1], "edge0": [60, 0, 0], "edge1": [0, 60, 0]}
    lamp = {"type": "parallelogram", "base": [-2, -2, 2], "edge0": [4, 0, 0], "edge1": [0, 4, 0]}
    water = slab(-40, 40, eta=1.0, absorption=0.4)
    water["transform"]["scale"] = [50, 50, 40]
    found = []
    for kind in ("directSampleLight", "directSampleBSDF", "direct"):
        file = tmp_path / "scene.json"
        file.write_text(
            json.dumps(
                {
                    "output": {"filename": "a.exr"},
                    "sampler": {"type": "default", "samples": 64},
                    "camera": {
                        "type": "pinhole",
                        "transform": {"position": [0, 3, 0.5], "lookAt": [0, 0, -1], "up": [0, 0, 1]},
                        "verticalFov": 20,
                        "film": {"size": [16, 16]},
                    },
                    "integrator": {"type": kind},
                    "scene": {
                        "shapes": [water, {**floor, "material": {"type": "matte", "albedo": 0.8}}],
                        "lights": [{"type": "areaLight", "energy": 5, "shape": lamp}],
                    },
                }
            )
        )
        found.append(np.asarray(go.render(file, spp=2048), float).mean())
    assert found[1] == pytest.approx(found[0], rel=0.02) and found[2] == pytest.approx(found[0], rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("eye", [6.0, 0.0])
def test_water_that_reaches_into_its_glass_is_as_if_it_touched(tmp_path: Path, eye: float) -> None:
    """Glass from -2 to -1, water above it up to 1: modeled as water that begins inside the glass. From inside too."""
    glass = slab(-2, -1, eta=1.5, absorption=0.2, priority=2)
    water = slab(-1.4, 1, eta=1.33, absorption=[0.02, 0.1, 0.3], priority=1)
    seen = rendered(tmp_path, [glass, water], eye=eye, spp=4096)
    way = (1.0 if eye == 0.0 else 2.0) * np.array([0.02, 0.1, 0.3])
    once = np.exp(-way - 0.2)
    through = [(1.0 - ((a - b) / (a + b)) ** 2) for a, b in ((1.0, 1.33), (1.33, 1.5), (1.5, 1.0))]
    single = np.prod(through[1:] if eye == 0.0 else through) * once * (1.0 if eye > 0 else 1.33**2)
    assert np.all(np.abs(seen / single - 1.0) < 0.02), "reflections inside add a percent"


@pytest.mark.slow
def test_nested_media_disperse(tmp_path: Path) -> None:
    """By wavelength each surface has the ratio of two curves; flat on they let through what their middles do."""
    shapes = [slab(-2, -1, eta="sf11", priority=2), slab(-1.4, 1, eta="water", absorption=0.1, priority=1)]
    seen = rendered(tmp_path, shapes, spectral=True, spp=4096)
    sf11, water = (float(go.refractive_index(name).eta) for name in ("sf11", "water"))
    through = [(1.0 - ((a - b) / (a + b)) ** 2) for a, b in ((1.0, water), (water, sf11), (sf11, 1.0))]
    assert seen.mean() == pytest.approx(float(np.prod(through)) * np.exp(-0.2), rel=0.02)


@pytest.mark.slow
def test_what_a_material_derives_follows_the_index_outside(tmp_path: Path) -> None:
    """Energy compensation derives from the index: rough glass in water is the same as glass of the ratio in nothing."""
    rough = {"type": "kulla-conty", "base": {"type": "gonio-dielectric", "eta": 1.8, "alpha": 0.5, "priority": 2}}
    inner = {"type": "sphere", "center": [0.3, 0.2, 0], "radius": 3, "material": rough}
    water = slab(-8, 5, eta=1.2, priority=1)
    nested = rendered(tmp_path, [inner, water], eye=4.0, spp=2048)
    alone = {**inner, "material": {**rough, "base": {**rough["base"], "eta": 1.5, "priority": 0}}}
    plain = rendered(tmp_path, [alone], eye=4.0, spp=2048)
    # the lamp stands outside of the water, whose flat surface keeps .8 % of it; seen in the water it is 1.44 as bright
    assert nested.mean() == pytest.approx(1.44 * plain.mean(), rel=0.06)


@pytest.mark.slow
def test_the_order_of_priorities_decides_and_not_that_of_the_scene(tmp_path: Path) -> None:
    glass, water = slab(-2, 0.5, eta=1.5, priority=2), slab(-0.5, 2, eta=1.33, priority=1)
    pictures = [rendered(tmp_path, shapes, spp=1024) for shapes in ([glass, water], [water, glass])]
    np.testing.assert_allclose(pictures[0], pictures[1], rtol=0.01)
    swapped = rendered(tmp_path, [{**glass, "material": {**glass["material"], "priority": 0}}, water], spp=1024)
    np.testing.assert_allclose(swapped, pictures[0], rtol=0.02)  # the same three surfaces, one of them elsewhere


@pytest.mark.slow
def test_the_same_glass_twice_in_one_place_is_once(tmp_path: Path) -> None:
    tinted = {"eta": 1.5, "absorption": [0.1, 0.2, 0.4]}
    one = rendered(tmp_path, [slab(-2, 2, **tinted)], spp=1024)
    two = rendered(tmp_path, [slab(-2, 1, **tinted), slab(-0.5, 2, **tinted)], spp=1024)
    np.testing.assert_allclose(two, one, rtol=0.01)


@pytest.mark.parametrize(
    "glass, message",
    [
        ({"absorption": -0.1}, "out of range"),
        ({"absorption": [0.1, 0.1, -0.1]}, "out of range"),
        ({"eta": 0}, "out of range"),
        ({"eta": -1.5}, "out of range"),
    ],
)
def test_media_that_cannot_be_are_one_clear_error(tmp_path: Path, glass: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        rendered(tmp_path, [slab(-1, 1, **glass)])


def test_absorption_takes_no_texture(tmp_path: Path) -> None:
    from PIL import Image

    Image.fromarray(np.full((2, 2, 3), (128, 20, 255), np.uint8)).save(tmp_path / "flat.png")
    with pytest.raises(InputError, match="the interior has no uv coordinates"):
        rendered(tmp_path, [slab(-1, 1, absorption={"type": "imageTex", "file": "flat.png"})])


def test_more_media_than_a_path_can_count_are_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="9 transparent materials, at most 8"):
        rendered(tmp_path, [slab(-i - 0.9, -i, absorption=0.1 * (i + 1)) for i in range(9)])


def test_scenes_without_absorption_or_priorities_ask_for_no_media(tmp_path: Path) -> None:
    from gonio import scene
    from gonio.bridge import engine
    from gonio.transport.integrators import Render, Settings

    rendered(tmp_path, [slab(-1, 1)], spp=1)
    render = Render(scene.build(scene.read(tmp_path / "scene.json"), engine.load()), Settings("path"))
    assert not render._integrator.media.known
