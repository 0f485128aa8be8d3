"""Derivatives of pictures along values of materials: they are those of finite differences."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.errors import InputError

GOLD = {"type": "gonio-conductor", "eta": [0.2, 0.9, 1.1], "k": [3.9, 2.4, 2.2], "alpha": 0.3}
GLASS = {"type": "gonio-dielectric", "eta": 1.5, "alpha": 0.3}
WHITE = {"type": "gonio-kulla-conty", "base": {**GOLD, "alpha": 0.7}}
SCENE: dict[str, Any] = {
    "output": {"filename": "a.npz"},
    "sampler": {"type": "independent", "samples": 64, "seed": 3},
    "camera": {
        "type": "pinhole",
        "transform": {"position": [0, 1.5, 5], "lookAt": [0, 0.8, 0], "up": [0, 1, 0]},
        "verticalFov": 35,
        "film": {"size": [16, 12]},
    },
    "integrator": {"type": "path", "maxDepth": 5},
    "scene": {
        "shapes": [
            {"type": "sphere", "center": [0, 1, 0], "radius": 1, "material": GOLD},
            {
                "type": "parallelogram",
                "base": [-4, 0, -4],
                "edge0": [0, 0, 8],
                "edge1": [8, 0, 0],
                "material": {"type": "gonio-lambert", "albedo": [0.6, 0.5, 0.2]},
            },
        ],
        "lights": [
            {"type": "spotLight", "position": [-3, 5, 3], "energy": [60, 60, 60]},
            {"type": "environmentLight", "radiance": [0.3, 0.35, 0.4]},
        ],
    },
}


@pytest.fixture
def written(tmp_path: Path) -> Callable[[dict[str, Any]], Path]:
    """Writes the scene with another material on its ball."""

    def write(material: dict[str, Any]) -> Path:
        raw = json.loads(json.dumps(SCENE))
        raw["scene"]["shapes"][0]["material"] = material
        (tmp_path / "scene.json").write_text(json.dumps(raw))
        return tmp_path / "scene.json"

    return write


def differences(scene: Path, path: str, values: tuple[object, object], step: float, runs: int) -> np.ndarray:
    """Of pictures at two values, over their distance: one for each seed."""
    low, high = (
        np.array([go.render(scene, spp=256, seed=seed, overrides={path: value}) for seed in range(runs)])
        for value in values
    )
    return (high - low) / step


def sigmas(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """How far two stacks of pictures are apart, in blocks of 4 x 4; the error of a block is pooled with all blocks'."""

    def blocks(pictures: np.ndarray) -> np.ndarray:
        n, h, w, _ = pictures.shape
        return pictures.reshape(n, h // 4, 4, w // 4, 4, 3).mean((2, 4))

    a, b = blocks(a), blocks(b)
    square = a.var(0, ddof=1) / len(a) + b.var(0, ddof=1) / len(b)
    return np.abs(a.mean(0) - b.mean(0)) / np.sqrt(0.5 * (square + square.mean()) + 1e-12)


@pytest.mark.parametrize(
    ("material", "path", "values", "step"),
    [
        (GOLD, "shapes.0.material.alpha", (0.29, 0.31), 0.02),
        pytest.param(
            GOLD, "shapes.1.material.albedo", ([0.58, 0.48, 0.18], [0.62, 0.52, 0.22]), 0.04, marks=pytest.mark.slow
        ),
        pytest.param(
            GOLD, "shapes.0.material.eta", ([0.18, 0.88, 1.08], [0.22, 0.92, 1.12]), 0.04, marks=pytest.mark.slow
        ),
        pytest.param(GLASS, "shapes.0.material.eta", (1.48, 1.52), 0.04, marks=pytest.mark.slow),
        pytest.param(WHITE, "shapes.0.material.base.alpha", (0.69, 0.71), 0.02, marks=pytest.mark.slow),
    ],
    ids=["alpha", "albedo", "eta of a metal", "eta of glass", "alpha inside"],
)
def test_the_derivative_is_that_of_finite_differences(
    written: Callable[[dict[str, Any]], Path], material: dict[str, Any], path: str, values: Any, step: float
) -> None:
    scene, runs = written(material), 8
    slopes = np.array([go.render(scene, spp=256, seed=100 + seed, gradient=[path])[1] for seed in range(runs)])
    z = sigmas(differences(scene, path, values, step, runs), slopes)
    assert np.abs(slopes).max() > 0.05
    assert z.max() < 4.5 and np.sqrt(np.mean(z**2)) < 1.4


def test_the_picture_beside_derivatives_is_the_picture(written: Callable[[dict[str, Any]], Path]) -> None:
    scene, path = written(GOLD), "shapes.1.material.albedo"
    found = go.render(scene, spp=16, gradient=[path, path + ".r", "shapes.0.material.alpha"])
    assert found.shape == (4, 12, 16, 3)
    np.testing.assert_allclose(found[0], go.render(scene, spp=16), rtol=1e-5)
    np.testing.assert_allclose(found[2, ..., 0], found[1, ..., 0], rtol=1e-5)
    assert not found[2, ..., 1:].any() and found[3].any()


def test_derivatives_go_on_from_a_checkpoint_to_the_same_bits(
    written: Callable[[dict[str, Any]], Path], tmp_path: Path
) -> None:
    scene, path = written(GOLD), ["shapes.0.material.alpha"]
    whole = go.render(scene, spp=9, gradient=path)
    go.render(scene, spp=4, gradient=path, checkpoint=tmp_path / "c")
    with pytest.warns(go.GonioWarning, match="continues from"):
        assert np.array_equal(go.resume(tmp_path / "c", spp=9), whole)


@pytest.mark.parametrize(
    ("path", "options", "text"),
    [
        ("ball.alpha", {}, "names no material of a shape"),
        ("shapes.7.material.alpha", {}, "no shape 7"),
        ("shapes.0.material.alfa", {}, "no parameter 'alfa'"),
        ("shapes.0.material.alpha.r", {}, "'alpha' is not a color"),
        ("shapes.0.material.rotation", {}, "has no derivative here"),
        ("shapes.0.material.alpha", {"overrides": {"shapes.0.material.alpha": 0.0}}, "mirrors and smooth glass"),
        ("shapes.0.material.alpha", {"integrator": "light"}, "light has no derivatives"),
        ("shapes.0.material.alpha", {"integrator": "normal"}, "normal has no derivatives"),
        ("shapes.0.material.alpha", {"until_error": 0.1}, "until_error and derivatives"),
        ("shapes.0.material.alpha", {"spectral": True}, "spectral and derivatives"),
    ],
)
def test_what_has_no_derivative_is_refused(
    written: Callable[[dict[str, Any]], Path], path: str, options: dict[str, Any], text: str
) -> None:
    with pytest.raises(InputError, match=text):
        go.render(written(GOLD), gradient=[path], **options)
