"""The live reference: closed forms, additivity, and nothing compiled when a value changes."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.errors import InputError
from gonio.ops.backend import drjit
from gonio.transport import integrators
from gonio.viewer import messages, stage
from gonio.viewer.reference import Reference

dr = drjit()
SUN = {"type": "directional", "direction": [0.48, 0.6, 0.64], "irradiance": [2.0, 1.0, 0.5]}
WHITE = {"type": "environment", "constant": [1.0, 1.0, 1.0]}


def scene(what: stage.Stage, lights: list[Any], size: tuple[int, int] = (96, 54), spp: int = 64, **more: Any) -> Any:
    """A message that shows all rows of a stage; `balls` replaces their values."""
    balls = more.pop("balls", None)
    rows = [{"material": row.material, "balls": balls or [ball.values for ball in row.balls]} for row in what.rows]
    state = {"rows": rows, "lights": lights, "camera": {**what.framed(), **more.pop("camera", {})}}
    text = {"type": "scene", "id": 1, "width": size[0], "height": size[1], "state": state, "spp": spp, **more}
    return messages.parse(json.dumps(text))


def picture(reference: Reference, message: Any) -> np.ndarray:
    reference.show(message)
    while not reference.done:
        reference.advance()
    return reference.image()


def one_ball(bsdf: go.BSDF) -> stage.Stage:
    return stage.Stage("one", {"m0": stage.Material("one", bsdf)}, (stage.Row("one", "m0", (stage.Ball("one"),)),))


def normals(
    size: tuple[int, int], camera: dict[str, Any], supersampling: int = 24, centre: Any = (0.0, 0.0, 0.0)
) -> np.ndarray:
    """Normals of a ball that the rays of a supersampled pixel grid meet, (h s, w s, 3); NaN beside it.

    Camera on +z; |o + t d| = 1.
    """
    width, height = (n * supersampling for n in size)
    half = math.tan(math.radians(camera["fov"]) / 2)
    x = ((np.arange(width) + 0.5) / width * 2 - 1) * half * width / height
    y = (1 - (np.arange(height) + 0.5) / height * 2) * half
    d = np.stack([*np.broadcast_arrays(x[None, :], y[:, None]), -np.ones((height, width))], -1)
    d /= np.linalg.norm(d, axis=-1, keepdims=True)
    o = np.array([0.0, 0.0, camera["distance"]]) - centre
    b = d @ o
    with np.errstate(invalid="ignore"):
        return o + (-b - np.sqrt(b**2 - o @ o + 1.0))[..., None] * d


def boxes(values: np.ndarray, supersampling: int = 24) -> np.ndarray:
    """Means over the pixels of a supersampled grid."""
    height, width = (n // supersampling for n in values.shape[:2])
    return values.reshape(height, supersampling, width, supersampling, -1).mean((1, 3))


def test_a_lambert_ball_under_a_directional_light_is_the_closed_form() -> None:
    what = one_ball(go.Lambert(albedo=(0.8, 0.5, 0.2)))
    found = picture(Reference(what), scene(what, [SUN], spp=256))
    n = normals((96, 54), what.framed())
    on_ball = np.isfinite(n[..., :1])
    cosine = np.maximum(np.nan_to_num(n) @ np.array(SUN["direction"]), 0.0)[..., None]
    expected = boxes(np.where(on_ball, cosine / np.pi * np.array([0.8, 0.5, 0.2]) * SUN["irradiance"], 0.0))
    assert boxes(on_ball * 1.0)[..., 0] == pytest.approx(found[..., 3], abs=0.02)
    # 576 regular and 256 stratified points a pixel: the terminator and the edge of the ball are all that differs
    assert np.abs(found[..., :3] - expected).max() < 0.01
    assert found[..., :3].sum() == pytest.approx(expected.sum(), rel=1e-3)


@pytest.mark.slow
def test_the_homeworks_balls_are_their_models_eval() -> None:
    """What a shader has to draw: eval at every point of every ball, averaged over the pixel."""
    what, size, fine = stage.homework(), (96, 54), 16
    camera, light = what.framed(), what.lights[0]
    reference = picture(Reference(what), scene(what, [light], size=size, spp=1024))
    expected, whole = np.zeros((size[1], size[0], 3)), np.zeros((size[1], size[0]), bool)
    for i, row in enumerate(what.rows):
        for j, ball in enumerate(row.balls):
            centre = np.array([(j - 2) * stage.SPACING, (0.5 - i) * stage.SPACING, 0.0])
            n = normals(size, camera, fine, centre)
            on_ball = np.isfinite(n[..., 0])
            n = n[on_ball]
            tangent = np.stack([n[:, 2], 0.0 * n[:, 0], -n[:, 0]], 1)
            tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
            frame = np.stack([tangent, np.cross(n, tangent), n], 1)
            wo = np.array([0.0, 0.0, camera["distance"]]) - centre - n
            wo /= np.linalg.norm(wo, axis=1, keepdims=True)
            bsdf = stage.replaced(what.materials[row.material].bsdf, ball.values)
            value = np.zeros((*on_ball.shape, 3))
            value[on_ball] = bsdf.eval(np.einsum("nij,nj->ni", frame, wo), frame @ np.array(light["direction"]))
            expected += boxes(value, fine) * light["irradiance"]
            whole |= boxes(on_ball * 1.0, fine)[..., 0] == 1.0
    counted = whole & (reference[..., 3] == 1.0)
    assert counted.sum() > 800
    test, truth = expected[counted], reference[counted][:, :3]
    assert np.mean((test - truth) ** 2 / (truth**2 + 0.01)) < 1e-5


def test_two_balls_neither_shadow_nor_light_each_other() -> None:
    # light from the right, along the row: with shadows the left ball would be dark
    lambert = stage.Material("one", go.Lambert(albedo=1.0))
    two = stage.Stage("two", {"m0": lambert}, (stage.Row("", "m0", (stage.Ball("a"), stage.Ball("b"))),))
    side = {**SUN, "direction": [1.0, 0.0, 0.0]}
    reference = Reference(two)
    alone = picture(reference, scene(two, [side], size=(96, 48), camera={"distance": 400.0, "fov": 1.0}))
    left, right = alone[:, :48, :3].sum(), alone[:, 48:, :3].sum()
    assert left == pytest.approx(right, rel=0.01)
    shadowed = picture(reference, scene(two, [side], size=(96, 48), transport="path", max_depth=2,
                                        camera={"distance": 400.0, "fov": 1.0}))  # fmt: skip
    assert shadowed[:, :48, :3].sum() < 0.05 * left


def test_with_transport_path_it_is_the_renderers_own_picture() -> None:
    what = stage.homework()
    area = {"type": "area", "center": [0, 6, 6], "u": [2, 0, 0], "v": [0, 1.4, -1.4], "radiance": [5, 5, 5]}
    reference = Reference(what)
    found = picture(reference, scene(what, [WHITE, area], spp=16, transport="path", max_depth=5))
    own = integrators.Render(
        reference._combined[1], integrators.Settings("path", max_depth=5), reference._render.sensor
    )
    own.advance(16)
    inside = found[..., 3] == 1.0
    assert inside.sum() > 800
    assert np.array_equal(found[inside][:, :3], own.image()[inside])


def test_a_white_furnace_gives_back_the_coverage() -> None:
    compensated = go.KullaConty(base=go.Conductor(eta=0.0, k=1.0, alpha=0.5))
    what = one_ball(compensated)
    found = picture(Reference(what), scene(what, [WHITE], spp=256))
    inside = found[..., 3] == 1.0
    assert inside.sum() > 200
    assert found[inside][:, :3].mean() == pytest.approx(1.0, abs=2e-3)


def test_lights_add_up() -> None:
    what = one_ball(go.Conductor.preset("Au", alpha=0.3))
    point = {"type": "point", "position": [0.0, 3.0, 3.0], "intensity": [5.0, 5.0, 5.0]}
    area = {"type": "area", "center": [3, 0, 3], "u": [0.5, 0, -0.5], "v": [0, 1, 0], "radiance": [2.0, 2.0, 2.0]}
    reference = Reference(what)
    parts = [picture(reference, scene(what, [light], spp=512))[..., :3].mean((0, 1)) for light in (SUN, point, area)]
    together = picture(reference, scene(what, [SUN, point, area], spp=512))[..., :3].mean((0, 1))
    assert min(part.min() for part in parts) > 0.0
    assert together == pytest.approx(sum(parts), rel=0.01)


def test_an_environment_comes_from_where_the_format_says() -> None:
    what = one_ball(go.Lambert(albedo=1.0))
    reference = Reference(what)
    pixels = np.zeros((8, 16, 3), np.float32)
    pixels[3:5, 3:5] = 1.0  # around u = 1/4: p = pi/2, the direction +x
    reference.pictures["k"] = pixels
    light = {"type": "environment", "image": {"key": "k"}}
    right = picture(reference, scene(what, [light], spp=256))[..., 0]
    assert right[:, 48:].sum() > 3 * right[:, :48].sum()
    turned = picture(reference, scene(what, [{**light, "rotation": math.pi}], spp=256))[..., 0]
    assert turned[:, :48].sum() > 3 * turned[:, 48:].sum()
    bright = picture(reference, scene(what, [{**light, "scale": 2.0}], spp=256))[..., 0]
    assert bright.sum() == pytest.approx(2 * right.sum(), rel=0.02)


def test_an_environment_turns_as_far_as_one_likes() -> None:
    what = one_ball(go.Lambert(albedo=1.0))
    reference = Reference(what)
    reference.pictures["k"] = np.linspace(0.0, 1.0, 8 * 16 * 3, dtype=np.float32).reshape(8, 16, 3)
    light = {"type": "environment", "image": {"key": "k"}}
    once = picture(reference, scene(what, [{**light, "rotation": 0.7}]))
    often = picture(reference, scene(what, [{**light, "rotation": 0.7 + 100_000 * math.tau}]))
    assert often == pytest.approx(once, rel=1e-3, abs=1e-4)


def test_another_picture_under_the_same_key_is_another_light() -> None:
    what = one_ball(go.Lambert(albedo=1.0))
    reference = Reference(what)
    light = {"type": "environment", "image": {"key": "k"}}
    means = []
    for radiance in (1.0, 3.0):
        reference.pictures = {"k": np.full((4, 8, 3), radiance, np.float32)}
        means.append(picture(reference, scene(what, [light]))[..., :3].mean())
    assert means[1] == pytest.approx(3 * means[0], rel=1e-3)


def test_under_a_black_environment_a_ball_is_black_and_not_gone() -> None:
    what = one_ball(go.Conductor(alpha=0.3))
    reference = Reference(what)
    lit = picture(reference, scene(what, [SUN]))
    reference.pictures["k"] = np.zeros((4, 8, 3), np.float32)
    dark = picture(reference, scene(what, [{"type": "environment", "image": {"key": "k"}}]))
    assert not dark[..., :3].astype("f2").any()
    assert np.array_equal(dark[..., 3], lit[..., 3])


@pytest.mark.slow
@pytest.mark.parametrize(
    "light",
    [pytest.param("directional", marks=pytest.mark.slow), pytest.param("area", marks=pytest.mark.slow), "environment"],
)
def test_a_changed_value_compiles_nothing(light: str) -> None:
    command = [sys.executable, str(Path(__file__).with_name("kernels.py")), light]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == []


def test_values_reach_the_picture() -> None:
    what = one_ball(go.Lambert(albedo=0.5))
    reference = Reference(what)
    half = picture(reference, scene(what, [SUN]))
    more = picture(reference, scene(what, [SUN], balls=[{"albedo": [1.0, 0.5, 0.0]}]))
    assert more[..., 0].sum() == pytest.approx(2 * half[..., 0].sum(), rel=1e-3)
    assert more[..., 1].sum() == pytest.approx(half[..., 1].sum(), rel=1e-3)
    assert more[..., 2].sum() == 0.0


def test_a_class_of_the_users_own_is_rendered(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(
        "import gonio as go\nfrom gonio import ops\n\n"
        "class Matte(go.BSDF):\n    tint_: go.Colour = go.spectrum(default=0.25, doc='share', high=1.0)\n\n"
        "    def eval(self, wo, wi, mode='radiance'):\n"
        "        return self.tint_ * ops.where((wo.z > 0.0) & (wi.z > 0.0), wi.z * ops.inv_pi, 0.0)\n"
    )
    own = one_ball(stage.of_targets([f"{tmp_path / 'own.py'}:Matte"]).materials["m0"].bsdf)
    built_in = one_ball(go.Lambert(albedo=0.5))
    quarter = picture(Reference(own), scene(own, [SUN], balls=[{"tint_": [0.25] * 3}]))
    half = picture(Reference(built_in), scene(built_in, [SUN]))
    assert half[..., :3].sum() == pytest.approx(2 * quarter[..., :3].sum(), rel=1e-3)


def test_every_pass_is_the_same_picture_whatever_the_pauses() -> None:
    what = one_ball(go.Lambert())
    one, other = Reference(what), Reference(what)
    first = picture(one, scene(what, [SUN], spp=32))
    other.show(scene(what, [SUN], spp=32))
    while not other.done:
        other._per_sample = 1.0  # so slow that a pass is one sample
        other.advance()
    assert np.array_equal(first, other.image())


def test_passes_grow_also_where_a_pass_itself_is_slow(monkeypatch: pytest.MonkeyPatch) -> None:
    """A busy machine: 90 ms a pass whatever it does, and 1 ms a sample."""
    what = one_ball(go.Lambert())
    reference = Reference(what)
    reference.show(scene(what, [SUN], size=(8, 8), spp=1024))
    now, counts = [0.0], []
    advance = reference._render.advance

    def slow(count: int) -> None:
        counts.append(count)
        now[0] += 0.09 + 0.001 * count
        advance(count)

    monkeypatch.setattr(reference._render, "advance", slow)
    monkeypatch.setattr("gonio.viewer.reference.time.perf_counter", lambda: now[0])
    while not reference.done:
        reference.advance()
    assert counts[:6] == [1, 1, 2, 4, 8, 16]
    assert max(counts) in range(45, 65) and len(counts) < 30


@pytest.mark.parametrize(
    ("change", "what_is_wrong"),
    [
        ({"material": "m9"}, "unknown material 'm9'"),
        ({"choices": {"masking": "wrong"}}, "unknown masking 'wrong'"),
        ({"choices": {"nothing": "wrong"}}, "unknown parameter 'nothing'"),
        ({"balls": [{"alpha": -1.0}]}, ">= 0"),
        ({"balls": [{"beta": 1.0}]}, "unknown parameter 'beta'"),
    ],
)
def test_what_cannot_be_shown_is_one_clear_error(change: dict[str, Any], what_is_wrong: str) -> None:
    what = one_ball(go.Conductor())
    message = scene(what, [SUN]).model_dump()
    message["state"]["rows"][0].update(change)
    with pytest.raises(InputError, match=what_is_wrong):
        Reference(what).show(messages.parse(json.dumps(message)))
