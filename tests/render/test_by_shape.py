"""One material in the place of very many that differ in numbers alone: the same picture, without tracing each."""

from __future__ import annotations

import importlib
import json
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.bridge import engine
from gonio.scene import read

mi = engine.load()
build = importlib.import_module("gonio.scene.build")  # the function of that name hides it

Material = dict[str, Any]


def gold(rng: np.random.Generator) -> Material:
    colours = {name: rng.uniform(0.3, 3.0, 3).tolist() for name in ("eta", "k")}
    return {"type": "conductor", "ndf": "ggx", "alpha": float(rng.uniform(0.05, 0.6)), **colours}


def paint(rng: np.random.Generator) -> Material:
    return {"type": "lambert", "albedo": rng.uniform(0.1, 0.9, 3).tolist()}


def brushed(rng: np.random.Generator) -> Material:
    return {"type": "gonio-conductor", "preset": "Au", "alpha": rng.uniform(0.05, 0.6, 2).tolist()}


def layered(rng: np.random.Generator) -> Material:
    return {"type": "mix", "a": paint(rng), "b": gold(rng), "weight": float(rng.uniform(0.1, 0.9))}


def polished(rng: np.random.Generator) -> Material:
    return {**gold(rng), "alpha": 0.0 if rng.uniform() < 0.5 else 0.3}


def written(folder: Path, materials: list[Material]) -> Path:
    """A ball of each material, and a disk and a card that wear the first two of them too."""
    side = int(np.ceil(np.sqrt(len(materials))))
    shapes: list[dict[str, Any]] = [
        {"type": "sphere", "center": [index % side, index // side, 0], "radius": 0.45, "material": material}
        for index, material in enumerate(materials)
    ]
    disk = {"type": "disk", "radius": 2, "transform": {"translate": [-2, 2, 0]}, "material": materials[0]}
    card = {"type": "parallelogram", "base": [-4, -1, -1], "edge0": [3, 0, 0], "edge1": [0, 0, 3]}
    middle = (side - 1) / 2
    camera = {"position": [middle, middle, 9], "lookAt": [middle, middle, 0], "up": [0, 1, 0]}
    scene = {
        "output": {"filename": "many.png"},
        "sampler": {"type": "independent", "xSamples": 2, "ySamples": 2},
        "camera": {"type": "pinhole", "transform": camera, "verticalFov": 50, "film": {"size": [40, 30]}},
        "integrator": {"type": "path", "maxDepth": 4},
        "scene": {
            "shapes": [*shapes, disk, {**card, "material": materials[1]}],
            "lights": [
                {"type": "environmentLight", "radiance": [0.3, 0.4, 0.5]},
                {"type": "spotLight", "position": [2, 3, 8], "energy": [90, 80, 70]},
            ],
        },
    }
    (folder / "scene.json").write_text(json.dumps(scene))
    return folder


@pytest.mark.sample(2)
@pytest.mark.parametrize("kind", [paint, gold, brushed, layered, polished])
def test_the_picture_is_that_of_the_single_materials(
    kind: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(3)
    folder = written(tmp_path, [kind(rng) for _ in range(9)])
    monkeypatch.setattr(build, "MERGE_FROM", 100)
    single = go.render(folder, spp=4)
    monkeypatch.setattr(build, "MERGE_FROM", 4)
    loaded = build.build(read(folder), mi)
    balls = [shape for shape in loaded.shapes() if shape.class_name() == "Sphere"]
    assert len({shape.bsdf().id() or id(shape.bsdf()) for shape in balls}) < len(balls), "one stands for several"
    together = go.render(folder, spp=4)
    assert together == pytest.approx(single, rel=2e-4, abs=1e-5)
    assert np.std(single) > 0.02


def test_a_scene_of_two_structures_keeps_what_is_few(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(4)
    folder = written(tmp_path, [*(paint(rng) for _ in range(6)), *(gold(rng) for _ in range(3)), {"type": "mirror"}])
    single = go.render(folder, spp=4)
    monkeypatch.setattr(build, "MERGE_FROM", 5)
    assert go.render(folder, spp=4) == pytest.approx(single, rel=2e-4, abs=1e-5)


def test_what_light_goes_through_stays_single(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(6)
    glasses = [{"type": "dielectric", "eta": float(rng.uniform(1.2, 1.8)), "alpha": 0.2} for _ in range(6)]
    glasses[0]["absorption"] = [3.0, 0.0, 0.0]  # so that every medium is known to the path
    folder = written(tmp_path, glasses)
    single = go.render(folder, spp=2)
    monkeypatch.setattr(build, "MERGE_FROM", 4)
    assert np.array_equal(go.render(folder, spp=2), single)


def test_a_wrong_number_is_said_with_its_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(5)
    folder = written(tmp_path, [*(gold(rng) for _ in range(8)), {**gold(rng), "alpha": -0.2}])
    monkeypatch.setattr(build, "MERGE_FROM", 4)
    with pytest.raises(go.InputError, match=r"shapes/8/material"):
        go.render(folder, spp=1)


def test_derivatives_are_along_one_materials_numbers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(7)
    folder = written(tmp_path, [paint(rng) for _ in range(9)])
    monkeypatch.setattr(build, "MERGE_FROM", 4)
    _, slope = go.render(folder, spp=4, max_depth=2, gradient=["shapes.4.material.albedo"])
    moved = np.abs(slope).sum(axis=2) > 0
    assert 0 < moved.mean() < 0.1, "of a ball in the middle, lit directly"
