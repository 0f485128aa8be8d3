"""Normals that lean: no light is made, samples follow their density, and nothing turns black where light grazes."""

from __future__ import annotations

import json
from pathlib import Path

import gonio as go
import numpy as np
import pytest

from gltf_files import png
from sphere import random_directions, random_numbers

NORMAL_MAP, BUMP = go.model("normal-map"), go.model("bump")
WO, WI, U = random_directions(2000, 31), random_directions(2000, 32), random_numbers(2000, 33)


@pytest.mark.parametrize("base", [go.Conductor(alpha=0.3), go.Dielectric(1.5, 0.2), go.Mirror()], ids=lambda m: m.name)
def test_a_normal_that_does_not_lean_is_none(base: go.BSDF) -> None:
    mapped = NORMAL_MAP(base)
    np.testing.assert_allclose(mapped.eval(WO, WI), base.eval(WO, WI), rtol=1e-5, atol=1e-7)
    np.testing.assert_allclose(mapped.pdf(WO, WI), base.pdf(WO, WI), rtol=1e-5, atol=1e-7)
    ours, theirs = mapped.sample(WO, U), base.sample(WO, U)
    found = theirs.pdf > 0.0
    np.testing.assert_array_equal(ours.pdf > 0.0, found)
    np.testing.assert_allclose(ours.wi[found], theirs.wi[found], atol=1e-6)
    np.testing.assert_allclose(ours.weight, theirs.weight, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("lean", [(0.3, 0.1), (0.0, 1.5)])
def test_a_white_base_stays_white_from_every_view(lean: tuple[float, float]) -> None:
    found = go.albedo(NORMAL_MAP(go.Lambert(1.0), *lean), mu=[1.0, 0.5, 0.05], phi=[0.0, 2.0, 4.0])
    assert found.value[:, 0] == pytest.approx([1.0] * 3, abs=2e-3)


@pytest.mark.parametrize(("view", "back"), [(50.0, 40.0), (-30.0, 60.0), (-50.0, 50.6)])
def test_a_mirror_leaning_by_45_degrees_sends_every_view_up(view: float, back: float) -> None:
    """From 50 degrees about 45 to 40; from -30 to 120, below the surface, and up again at 60. From -50 the mirror would
    be seen from behind: it bends until its normal has a cosine of about .01 to the view."""
    theta = np.deg2rad(view)
    s = NORMAL_MAP(go.Mirror(1.0), 1.0, 0.0).sample([[np.sin(theta), 0.0, np.cos(theta)]], [[0.5] * 3])
    assert s.delta.all() and s.weight == pytest.approx(1.0) and s.pdf == pytest.approx(1.0)
    assert np.rad2deg(np.arctan2(s.wi[0, 0], s.wi[0, 2])) == pytest.approx(back, abs=0.6)


def test_matt_bumps_are_lit_as_they_lean() -> None:
    """From above, light at 30 degrees on a lean of 20: cos 10 where it leans toward the light, cos 50 away from it."""
    wo, wi = [[0.0, 0.0, 1.0]], [[0.5, 0.0, 0.75**0.5]]
    for side, angle in ((1.0, 10.0), (-1.0, 50.0)):
        bump = NORMAL_MAP(go.Lambert(1.0), side * np.tan(np.deg2rad(20.0)), 0.0)
        assert bump.eval(wo, wi)[0, 0] == pytest.approx(np.cos(np.deg2rad(angle)) / np.pi, rel=1e-5)


def test_a_bump_leans_against_its_slope() -> None:
    base = go.Conductor(alpha=0.3)
    np.testing.assert_allclose(BUMP(base, 0.3, -0.2).eval(WO, WI), NORMAL_MAP(base, -0.3, 0.2).eval(WO, WI))


# --------------------------------------------------------------------------- in scenes


def ball(folder: Path, material: dict[str, object], film: int = 48) -> np.ndarray:
    """A ball before the camera, under a constant sky."""
    content = {
        "output": {"filename": "a.exr"},
        "sampler": {"type": "independent", "samples": 64, "seed": 1},
        "camera": {
            "type": "pinhole",
            "transform": {"position": [0, 0, 4], "lookAt": [0, 0, 0], "up": [0, 1, 0]},
            "verticalFov": 30,
            "film": {"size": [film, film]},
        },
        "integrator": {"type": "path", "maxDepth": 3},
        "scene": {
            "shapes": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": material}],
            "lights": [{"type": "environmentLight", "radiance": 1}],
        },
    }
    (folder / "scene.json").write_text(json.dumps(content))
    return np.asarray(go.render(folder / "scene.json"))


@pytest.fixture
def bumps(tmp_path: Path) -> Path:
    """Waves that lean up to 50 degrees, as normals and as heights."""
    x = np.arange(64)
    height = 0.5 + 0.5 * np.sin(2 * np.pi * 16 * x / 64)[None, :] * np.cos(2 * np.pi * 8 * x / 64)[:, None]
    lean = np.dstack([np.roll(height, 1, 1) - np.roll(height, -1, 1), np.roll(height, 1, 0) - np.roll(height, -1, 0)])
    normals = np.dstack([1.2 * lean, np.ones((64, 64))])
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    (tmp_path / "normals.png").write_bytes(png(np.round(127.5 * (normals + 1.0))))
    (tmp_path / "heights.png").write_bytes(png(np.round(255.0 * np.repeat(height[..., None], 3, axis=2))))
    (tmp_path / "level.png").write_bytes(png(np.full((4, 4, 3), (128, 128, 255))))
    return tmp_path


@pytest.mark.parametrize(
    "detail", [{"normalmap": {"file": "normals.png"}}, {"bump": {"file": "heights.png", "scale": 0.1}}], ids=str
)
def test_no_pixel_of_a_bumpy_ball_is_black_to_its_edge(bumps: Path, detail: dict[str, object]) -> None:
    """A white metal in a white sky is white, but for what single scattering loses; a dark one shows its bumps."""
    metal = {"type": "gonio-metal", "r0": 1.0, "alpha": 0.1}
    plain, leaning = ball(bumps, metal)[..., 1], ball(bumps, metal | detail)[..., 1]
    assert plain.min() > 0.85
    assert leaning.min() > 0.85 and leaning.max() < 1.06  # 64 samples
    dark = {**metal, "r0": 0.1}
    assert np.abs(ball(bumps, dark, 24) - ball(bumps, dark | detail, 24)).max() > 0.05


def test_a_level_map_shows_the_bare_material(bumps: Path) -> None:
    """128 of 255 leans by .004, which no eye sees."""
    metal = {"type": "gonio-metal", "r0": 0.8, "alpha": 0.3}
    level = ball(bumps, metal | {"normalmap": {"file": "level.png"}}, film=16)
    assert level == pytest.approx(ball(bumps, metal, film=16), abs=0.02)


def test_a_bump_is_the_slope_of_its_heights_over_lengths_of_the_surface(bumps: Path) -> None:
    """Heights that rise by 1 along u of a square of side 2 lean by a half, against x."""
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    from gonio.bridge import adapter
    from gonio.scene import textures

    adapter.register(mi)
    level = {name: textures.bitmap(mi, np.full((2, 2, 1), value, np.float32), "bilinear", "repeat")
             for name, value in (("lean_x", 1.0), ("lean_y", 0.0))}  # fmt: skip
    bsdf = mi.load_dict({"type": "gonio_bump", "base": {"type": "gonio_lambert", "albedo": 1.0}, **level})
    square = mi.load_dict({"type": "rectangle"})
    ray = mi.Ray3f(mi.Point3f(0.3, 0.2, 1), mi.Vector3f(0, 0, -1))
    si = mi.load_dict({"type": "scene", "square": square}).ray_intersect(ray)
    sin, cos = 0.5 / 1.25**0.5, 1.0 / 1.25**0.5
    value = bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(-sin, 0.0, cos))
    assert np.ravel(value)[0] == pytest.approx(1.0 / np.pi, rel=1e-3)  # along the normal


def test_both_details_together_are_an_error(bumps: Path) -> None:
    both = {"normalmap": {"file": "normals.png"}, "bump": {"file": "heights.png", "scale": 0.1}}
    with pytest.raises(go.InputError, match="both 'normalmap' and 'bump'"):
        ball(bumps, {"type": "matte"} | both)
