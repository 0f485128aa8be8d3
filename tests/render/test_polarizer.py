"""A polarizer over the lens: what it lets through, against the Fresnel equations and Malus's law."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import gonio as go
import mitsuba as mi
import numpy as np
import pytest
from gonio import scene
from gonio.bridge import engine
from gonio.errors import InputError
from gonio.render.prepare import prepare
from gonio.render.request import Request

ETA = 1.5
SIZE = (24, 16)
POSITION = np.array([0.0, 1.0, 1.5])  # looks down at 56.3 degrees from the normal: Brewster's angle of glass


def description(roll: float = 0.0, material: dict[str, Any] | None = None, **camera: Any) -> dict[str, Any]:
    """A floor under a sky that is the same everywhere; the camera is turned about its axis, degrees clockwise."""
    forward = -POSITION / np.linalg.norm(POSITION)
    right = np.array([1.0, 0.0, 0.0])
    up = np.cross(right, forward)
    turned = np.cos(np.radians(roll)) * up + np.sin(np.radians(roll)) * right
    floor = {
        "type": "parallelogram",
        "base": [-50, 0, -50],
        "edge0": [0, 0, 100],
        "edge1": [100, 0, 0],
        "material": material or {"type": "gonio-dielectric", "eta": ETA, "alpha": 0, "transmission": False},
    }
    transform = {"position": POSITION.tolist(), "lookAt": [0, 0, 0], "up": turned.tolist()}
    return {
        "output": {"filename": "a.exr"},
        "sampler": {"type": "independent", "samples": 4},
        "camera": {
            "type": "pinhole",
            "transform": transform,
            "verticalFov": 30,
            "film": {"size": [*SIZE]},
            **camera,
        },
        "integrator": {"type": "path", "maxDepth": 3},
        "scene": {"shapes": [floor], "lights": [{"type": "environmentLight", "radiance": [1, 1, 1]}]},
    }


def rendered(path: Path, spp: int = 64, **more: Any) -> np.ndarray:
    file = path / "scene.json"
    file.write_text(json.dumps(description(**more)))
    return go.render(file, spp=spp)


def expected(degrees: float, roll: float) -> np.ndarray:
    """The closed form at the middles of the pixels: (R_s cos^2 + R_p sin^2) / 2 about the direction of s there."""
    width, height = SIZE
    tan = np.tan(np.radians(15.0))
    x = (2 * (np.arange(width) + 0.5) / width - 1) * tan * width / height
    y = (1 - 2 * (np.arange(height) + 0.5) / height) * tan
    forward = -POSITION / np.linalg.norm(POSITION)
    right = np.array([1.0, 0.0, 0.0])
    up = np.cross(right, forward)
    angle = np.radians(roll)
    right, up = np.cos(angle) * right - np.sin(angle) * up, np.cos(angle) * up + np.sin(angle) * right
    ray = forward + x[None, :, None] * right + y[:, None, None] * up
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    at = go.fresnel(np.arccos(-ray[..., 1]), ETA)
    s = np.cross([0.0, 1.0, 0.0], ray)
    # where s stands between the picture's horizontal and its vertical, both put across the ray
    horizontal = np.cross(ray, up)
    vertical = np.cross(horizontal, ray)
    at_s = np.arctan2((s * vertical).sum(-1), (s * horizontal).sum(-1))
    turn = np.radians(degrees) - at_s
    found: np.ndarray = 0.5 * (at.R_s * np.cos(turn) ** 2 + at.R_p * np.sin(turn) ** 2)
    return found


@pytest.mark.sample(1)
@pytest.mark.parametrize("degrees", [0.0, 30.0, 90.0, 135.0])
@pytest.mark.parametrize("roll", [0.0, 25.0])
def test_it_lets_through_what_fresnels_equations_leave_in_its_direction(
    tmp_path: Path, degrees: float, roll: float
) -> None:
    picture = rendered(tmp_path, spp=256, roll=roll, polarizer=degrees)
    # white is Y = 1 in spectral variants too; pixels are means over their area
    luminance = picture @ np.array([0.2126, 0.7152, 0.0722])
    right = expected(degrees, roll)
    assert np.abs(luminance - right).max() < 0.01 * expected(0.0, roll).max()


def test_at_brewsters_angle_the_reflection_goes_out(tmp_path: Path) -> None:
    through, across = (rendered(tmp_path, polarizer=p)[8, 12].mean() for p in (0, 90))
    plain = rendered(tmp_path)[8, 12].mean()
    assert through == pytest.approx(plain, rel=0.02)  # s alone is reflected: a half of (R_s + 0), as without
    assert across < 0.01 * through


@pytest.mark.slow
def test_light_that_is_not_polarized_loses_a_half(tmp_path: Path) -> None:
    matte = {"type": "gonio-lambert", "albedo": 0.5}
    for degrees in (0, 77):
        assert rendered(tmp_path, material=matte, polarizer=degrees).mean() == pytest.approx(0.25, rel=0.01)


def test_the_variant_is_as_it_was_afterwards(tmp_path: Path) -> None:
    engine.load("cpu")
    rendered(tmp_path, spp=1, polarizer=0)
    assert mi.variant() == "llvm_ad_rgb"


def test_a_render_goes_on_from_its_checkpoint(tmp_path: Path) -> None:
    file = tmp_path / "scene.json"
    file.write_text(json.dumps(description(polarizer=45)))
    render = prepare(Request(file, spp=4)).render
    render.advance(4)
    state, picture = render.state(), render.image()
    again = prepare(Request(file, spp=4)).render
    again.restore(4, state)
    np.testing.assert_array_equal(again.image(), picture)
    with pytest.raises(ValueError, match="Stokes"):
        again.restore(4, {**state, "sum": state["sum"][..., :3]})


def test_a_polarizer_in_an_unpolarized_variant_is_an_error(tmp_path: Path) -> None:
    file = tmp_path / "scene.json"
    file.write_text(json.dumps(description(polarizer=45)))
    with pytest.raises(InputError, match="polarized variant, which llvm_ad_rgb is not"):
        scene.build(scene.read(file), engine.load("cpu"))


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"integrator": {"type": "normal"}}, "a polarizer, but 'normal' does not trace polarized light"),
        ({"integrator": {"type": "whitted"}}, "'whitted' does not trace polarized light"),
        ({"ambient": [0.1, 0.1, 0.1]}, "ambient light, which has no polarization"),
    ],
)
def test_what_cannot_be_seen_through_a_polarizer_is_an_error(tmp_path: Path, change: dict[str, Any], text: str) -> None:
    file = tmp_path / "scene.json"
    file.write_text(json.dumps({**description(polarizer=0), **change}))
    with pytest.raises(InputError, match=text):
        go.render(file)
    file.write_text(json.dumps(description(polarizer="45")))
    with pytest.raises(InputError, match=r"expected a number|without quotes"):
        go.render(file)
