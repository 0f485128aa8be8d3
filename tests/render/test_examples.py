"""The example scenes: each renders, and the shading balls show what they are there to show."""

from __future__ import annotations

import importlib.util
import sys
import warnings
from pathlib import Path

import gonio as go
import numpy as np
import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"
SCENES = sorted(
    path.relative_to(EXAMPLES).as_posix() for path in EXAMPLES.glob("*/*.json") if path.name != "calibration.json"
)
# Their small lamps are seen through glass, and light little else by it: `path` suits them (docs/transport.md).
BY_PATH_ALL_THE_SAME = {"diamond/scene.json", "fibre/scene.json", "rainbow/scene.json"}
EIGHT_KERNELS = "openpbr-layers/scene.json"  # one for each combination of layers


@pytest.mark.sample(8)
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] if name == EIGHT_KERNELS else []) for name in SCENES]
)
def test_every_example_renders(name: str) -> None:
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        picture = go.render(EXAMPLES / name, size=(48, 32), spp=2)
    advised = any("--integrator caustics" in str(warning.message) for warning in told)
    assert advised == (name in BY_PATH_ALL_THE_SAME), "the scene names an integrator that does not suit it"
    assert picture.shape == (32, 48, 3)
    # in spectral variants the noise of wavelengths leaves the triangle of red, green and blue
    lowest = -0.05 if name.startswith("polarizer") else 0.0
    assert np.isfinite(picture).all() and picture.min() >= lowest and picture.max() > 0


@pytest.mark.slow
def test_the_compensated_row_is_the_brighter_the_rougher() -> None:
    picture = go.render(EXAMPLES / "shading-balls", size=(256, 106), spp=32)
    ratios = []
    for ball in range(5):
        x = round(256 * (0.5 + (ball - 2) * 0.1665))
        upper, lower = (picture[row - 8 : row + 8, x - 8 : x + 8].mean() for row in (31, 74))
        ratios.append(upper / lower)
    assert 0.8 < ratios[0] < 1.25  # both rows alike where the balls are smooth, but for their places
    assert ratios[2] > 1.05
    assert ratios[4] > ratios[3] > ratios[2]


@pytest.mark.slow
def test_the_compensated_row_vanishes_in_a_white_furnace() -> None:
    picture = go.render(EXAMPLES / "white-furnace", size=(256, 106), spp=64) / 0.5
    upper, lower = picture[:52], picture[54:]
    blocks = upper[:48].reshape(6, 8, 32, 8, 3).mean(axis=(1, 3))
    assert abs(upper.mean() - 1) < 5e-4
    assert np.abs(blocks - 1).max() < 0.03  # noise of 4096 paths
    assert lower[20, 214].mean() < 0.7  # the roughest plain ball keeps less than 70 %


def test_the_rainbow_is_drawn_where_one_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    spec = importlib.util.spec_from_file_location("rainbow", EXAMPLES / "rainbow/rainbow.py")
    assert spec is not None and spec.loader is not None
    program = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(program)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["rainbow.py", "20000"])
    monkeypatch.setattr(program, "angles", lambda: None)  # the proof, which writes nothing
    before = {path: path.stat().st_mtime_ns for path in (EXAMPLES / "rainbow").iterdir() if path.is_file()}
    program.main()
    assert [path.name for path in tmp_path.iterdir()] == ["sky.jpg"]
    assert {path: path.stat().st_mtime_ns for path in before} == before
