"""Every example shows the same picture if its scene is a thousandth or a thousand times as large, or far away."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from scaled_scenes import scaled

EXAMPLES = Path(__file__).parents[2] / "examples"
SCENES = sorted(path.parent.name for path in EXAMPLES.glob("*/scene.json"))
USUAL = ("conductor-ggx", "wine")  # shadows of a box, and media within each other
SCALES = (0.001, 1000.0)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name in USUAL else [pytest.mark.slow]) for name in SCENES]
)
def test_a_scene_of_another_scale_shows_the_same_picture(name: str, tmp_path: Path) -> None:
    folder = tmp_path / name
    shutil.copytree(EXAMPLES / name, folder)
    scene = json.loads((folder / "scene.json").read_text())

    def seen(scale: float, seed: int) -> np.ndarray:
        """Values from 0 to 1: one very bright pixel must not decide."""
        (folder / "scaled.json").write_text(json.dumps(scaled(scene, scale)))
        picture = np.asarray(go.render(folder / "scaled.json", size=(48, 32), spp=4, seed=seed), float)
        return picture / (1.0 + np.abs(picture))

    one, other = seen(1.0, 1), seen(1.0, 2)
    noise, mean_noise = np.sqrt(np.mean((one - other) ** 2)), np.std((one - other).mean(2)) / np.sqrt(48 * 32)
    for scale in SCALES:
        # the numbers are the same, so that most pictures differ by roundings only: 0.02 of the noise
        difference = seen(scale, 1) - one
        assert np.sqrt(np.mean(difference**2)) < 0.7 * noise, scale
        assert abs(difference.mean()) < 2.0 * mean_noise, scale


def _moved(scene: dict[str, Any], by: tuple[float, float, float]) -> None:
    """Move a scene in place."""
    lights = scene["scene"].get("lights", [])
    for part in (scene["camera"]["transform"], *lights):
        for key in {"position", "lookAt"} & part.keys():
            part[key] = np.add(part[key], by).tolist()
    for shape in (*scene["scene"]["shapes"], *(light["shape"] for light in lights if "shape" in light)):
        place = shape.setdefault("transform", {})
        place["translate"] = np.add(place.get("translate", (0, 0, 0)), by).tolist()


@pytest.mark.parametrize("name", ["conductor-ggx", "glass-caustic"])
def test_a_scene_far_from_the_origin_shows_the_same_picture(name: str, tmp_path: Path) -> None:
    folder = tmp_path / name
    shutil.copytree(EXAMPLES / name, folder)
    scene = json.loads((folder / "scene.json").read_text())
    near = np.asarray(go.render(folder, size=(48, 32), spp=16), float)
    _moved(scene, (1e4, -3e3, 0.0))
    (folder / "far.json").write_text(json.dumps(scene))
    far = np.asarray(go.render(folder / "far.json", size=(48, 32), spp=16), float)
    assert far.mean() == pytest.approx(near.mean(), rel=0.01)
    assert np.mean(np.abs(far - near)) < 0.03 * near.mean()
