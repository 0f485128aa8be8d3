"""Materials from photographs that Gonio renders itself, with the faults that real ones have."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.errors import InputError
from gonio.fitting.parameters import Free
from gonio.instruments.capture import calibration, fitting, geometry, photographs, pixels, planning, rehearsal, run
from gonio.material import tree
from gonio.materials.combined.sum import Sum
from gonio.measure import read
from gonio.pictures import images

MIDDLE, AWAY, SIZE = np.array([0.0, 0.0, 500.0]), 400.0, 64
PAINT = Sum(go.Lambert((0.3, 0.2, 0.1)), go.Conductor(eta=1.5, k=0.0, alpha=0.2, fresnel="schlick"))
TRUTH = np.array([0.3, 0.2, 0.1, 1.5, 1.5, 1.5, 0.2])  # in the order of the fit's names
ANGLES = ((20.0, 0.0), (50.0, 100.0), (80.0, 220.0), (35.0, 300.0))  # of the lamps, from the camera and about its axis
FLAT = {"base": [-40.0, -40.0, 480.0], "edge0": [80.0, 0.0, 0.0], "edge1": [0.0, 80.0, 0.0]}

Raw = dict[str, Any]


def rig(lamps: int = 4, suffix: str = "npz", **more: Any) -> Raw:
    theta, phi = np.radians(ANGLES[:lamps]).T
    toward = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), -np.cos(theta)], -1)
    places = MIDDLE + AWAY * toward
    return {
        "camera": {"size": [SIZE, SIZE], "focal": 250.0},
        "ball": {"radius": 50.0, "center": MIDDLE.tolist()},
        "lights": {f"l{n}": {"position": p.tolist(), "intensity": AWAY**2} for n, p in enumerate(places)},
        "photographs": [{"file": f"p{n}.{suffix}", "seconds": 1.0, "light": f"l{n}"} for n in range(lamps)],
        **more,
    }


def off(raw: Raw) -> Raw:
    """The same, wrong: each lamp by 1 degree, the ball by 1 % and by half a pixel."""
    lights = {}
    for name, lamp in raw["lights"].items():
        away = np.array(lamp["position"]) - MIDDLE
        right, down = fitting.across(away)
        turned = away / AWAY + np.radians(1.0) * (0.6 * right - 0.8 * down)
        lights[name] = {**lamp, "position": (MIDDLE + AWAY * turned / np.linalg.norm(turned)).tolist()}
    return {**raw, "lights": lights, "ball": {"radius": 50.5, "center": [1.0, 0.0, 500.0]}}


@pytest.fixture(scope="module")
def taken(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four photographs of paint with 1 % noise."""
    return rehearsal.take(rig(), PAINT, tmp_path_factory.mktemp("capture") / "photographs", noise=0.01)


@pytest.fixture(scope="module")
def found(taken: Path) -> run.Capture:
    return go.capture(taken, "lambert+ggx")


def again(folder: Path, tmp_path: Path, raw: Raw) -> Path:
    """Photographs with another calibration."""
    for name in (one["file"] for one in raw["photographs"]):
        if (folder / name).exists():
            (tmp_path / name).write_bytes((folder / name).read_bytes())
    (tmp_path / "calibration.json").write_text(json.dumps(raw))
    return tmp_path


# ---------------------------------------------------------------------- fits


@pytest.mark.slow
def test_a_ball_tells_its_material(found: run.Capture) -> None:
    np.testing.assert_allclose(found.fit.values[:3], TRUTH[:3], rtol=0.01)
    np.testing.assert_allclose(found.fit.values[-1], TRUTH[-1], rtol=0.03)
    assert np.all(np.abs(found.fit.values - TRUTH) < 4.0 * found.fit.errors)
    assert found.fitted is not None and found.fitted.noise == pytest.approx(0.01, rel=0.1)
    assert sum(found.counts.values()) == sum(int((one > 0).sum()) for one in found.chosen.maps.values())
    assert found.warnings == ()


@pytest.mark.slow
def test_faults_that_are_stated_are_put_right(taken: Path, tmp_path: Path) -> None:
    stated = {"light": 1.0, "radius": 0.01, "center": 1.0, "intensity": 0.01, "scale": 0.005}
    got = go.capture(again(taken, tmp_path, off(rig()) | {"uncertainty": stated}), "lambert+ggx")
    np.testing.assert_allclose(got.fit.values[:3], TRUTH[:3], rtol=0.01)
    np.testing.assert_allclose(got.fit.values[-1], TRUTH[-1], rtol=0.03)
    assert np.all(np.abs(got.fit.values - TRUTH) < 4.0 * got.fit.errors)
    true = np.array([lamp["position"] for lamp in rig()["lights"].values()])
    assert np.abs(got.scene.lamps - true).max() < 0.5  # they were off by 7
    assert got.scene.ball is not None and np.abs(got.scene.ball.center - MIDDLE).max() < 0.1


@pytest.mark.slow
def test_faults_that_are_not_stated_are_noticed(taken: Path, found: run.Capture, tmp_path: Path) -> None:
    got = go.capture(again(taken, tmp_path, off(rig())), "lambert+ggx")
    assert np.any(np.abs(got.fit.values / TRUTH - 1.0) > 0.01)
    assert np.all(got.fit.errors > 3.0 * found.fit.errors)  # neighbours err alike, which counts
    assert any("errors of neighboring pixels are correlated" in text for text in got.warnings)


@pytest.mark.slow
def test_intervals_are_wider_by_what_the_calibration_leaves_open(
    taken: Path, found: run.Capture, tmp_path: Path
) -> None:
    got = go.capture(again(taken, tmp_path, rig(uncertainty={"scale": 0.02})), "lambert(albedo=.3,.2,.1)+ggx")
    assert all("albedo" not in name for name in got.fit.names)  # what a model is given stays
    got = go.capture(tmp_path, "lambert+ggx")
    assert np.all(got.fit.errors[:3] > 5.0 * found.fit.errors[:3])


@pytest.mark.slow
def test_the_outline_of_a_ball_is_found(taken: Path, tmp_path: Path) -> None:
    got = go.capture(again(taken, tmp_path, rig(ball={"radius": 50.0})), "lambert+ggx")
    assert got.scene.ball is not None
    np.testing.assert_allclose(got.scene.ball.center, MIDDLE, atol=1.0)
    np.testing.assert_allclose(got.fit.values[:3], TRUTH[:3], rtol=0.01)
    np.testing.assert_allclose(got.fit.values[-1], TRUTH[-1], rtol=0.03)


@pytest.mark.slow
def test_photographs_of_8_bits_are_enough(tmp_path: Path) -> None:
    raw = rig(suffix="png", response="srgb")
    for one in raw["photographs"]:
        one["seconds"] = 1.6
    got = go.capture(rehearsal.take(raw, PAINT, tmp_path / "p", noise=0.01, bits=8), "lambert+ggx")
    np.testing.assert_allclose(got.fit.values[:3], TRUTH[:3], rtol=0.01)
    np.testing.assert_allclose(got.fit.values[-1], TRUTH[-1], rtol=0.03)


@pytest.mark.slow
def test_a_flat_sample_is_measured_too(tmp_path: Path) -> None:
    raw = rig(flat=FLAT)
    raw["photographs"] = [{**one, "sample": "flat"} for one in raw["photographs"] if one["light"] != "l2"]  # grazing
    rough = tree.replace(PAINT, {"b.alpha": 0.4})
    got = go.capture(rehearsal.take(raw, rough, tmp_path / "p", noise=0.01), "lambert+ggx")
    assert np.all(np.abs(got.fit.values - [*TRUTH[:-1], 0.4]) < 4.0 * got.fit.errors)
    assert got.scene.ball is None


@pytest.mark.slow
def test_derivatives_are_those_of_finite_differences(found: run.Capture) -> None:
    assert found.fitted is not None
    solved = found.fitted.problem
    few = [part.at(np.arange(0, len(part), 97)) for part in solved.parts]
    faults = fitting.Faults((1.0, 1.0, 0.01), 0.01, 0.02, 0.01)
    problem = fitting.Problem(solved.material, solved.moving, solved.scene, few, faults)
    numbers = np.concatenate([TRUTH, np.zeros(len(problem.open))])
    problem.reweigh(numbers)
    rows = problem.rows(numbers)
    for number, name in enumerate([*found.fit.names, *problem.open]):
        step = np.zeros(len(numbers))
        step[number] = 2e-2 if number >= len(TRUTH) else 2e-3
        ends = [problem.rows(numbers + sign * step) for sign in (1.0, -1.0)]
        for one, high, low in zip(rows, *ends, strict=True):
            expected = (high.residual - low.residual) / (2.0 * step[number])
            got = one.slope[:, one.which.index(number)] if number in one.which else np.zeros(len(expected))
            size = max(float(np.abs(expected).max()), 0.1)
            assert np.abs(got - expected).max() < 0.02 * size, name


# ---------------------------------------------------------------------- samples, files and plans


def test_samples_are_values_of_the_brdf(found: run.Capture) -> None:
    wo, wi = found.samples.table.pairs()
    off = found.samples.table.values / (PAINT.eval(wo, wi) / wi[:, 2:]) - 1.0
    assert np.median(np.abs(off)) < 0.01
    sure = found.samples.confidence()
    assert np.isfinite(sure).any() and np.isnan(sure).any()
    assert np.nanmedian(sure) < 0.02


def test_a_capture_becomes_a_table_and_a_report(found: run.Capture, tmp_path: Path) -> None:
    table = read(found.save(tmp_path / "paint.gonio"))
    assert table.name == "samples" and table.shape["sample"] == len(found.samples.count)
    wo, wi = found.samples.table.pairs()
    seen = np.arange(0, len(wo), 50)
    got = go.Measured(str(tmp_path / "paint.gonio")).eval(wo[seen], wi[seen])
    assert np.median(np.abs(got / PAINT.eval(wo[seen], wi[seen]) - 1.0)) < 0.05
    report = json.loads(found.save(tmp_path / "paint.json").read_text())
    assert report["fit"]["parameters"]["b.alpha"]["value"] == pytest.approx(0.2, rel=0.03)
    assert report["pixels"]["used"] == found.counts["used"]
    with pytest.raises(InputError, match="format"):
        found.save(tmp_path / "paint.doc")


@pytest.mark.slow
def test_the_next_photograph_tells_what_was_promised(found: run.Capture, tmp_path: Path) -> None:
    first, second = found.next(2)
    assert np.all(first.errors < 1.4 * found.fit.errors) and np.all(second.errors < first.errors)
    raw = rig()
    raw["lights"]["l4"] = {"position": list(first.position), "intensity": AWAY**2}
    raw["photographs"].append({"file": "p4.npz", "seconds": 1.0, "light": "l4"})
    got = go.capture(rehearsal.take(raw, PAINT, tmp_path / "p", noise=0.01), "lambert+ggx")
    np.testing.assert_allclose(got.fit.errors, first.errors, rtol=0.4)
    # a place that is no place for a lamp is not chosen: another picture from where one was taken tells less
    (same,) = found.next(1, places=[list(found.scene.lamps[0])])
    assert np.sum((same.errors / TRUTH) ** 2) > np.sum((first.errors / TRUTH) ** 2)


def test_the_first_photographs_are_planned_from_a_guess(tmp_path: Path) -> None:
    raw = rig() | {"photographs": []}
    (tmp_path / "calibration.json").write_text(json.dumps(raw))
    plan = run.plan(tmp_path / "calibration.json", "lambert+ggx", 3)
    angles = [one.angle for one in plan]
    assert max(angles) - min(angles) > 20.0  # difference angles that tell Fresnel's term
    assert np.all(plan[-1].errors < plan[0].errors)
    with pytest.raises(InputError, match="no photograph of a sample"):
        go.capture(tmp_path, "lambert+ggx")


@pytest.mark.slow
def test_one_light_is_told_to_be_too_few(taken: Path) -> None:
    got = go.capture([str(taken / "p1.npz")], "lambert+ggx")
    assert got.warnings[0].startswith("only one light, with difference angles of 2")
    assert len(got.chosen.maps) == 1


# ---------------------------------------------------------------------- exposures


def shot(tmp_path: Path, exposures: list[Raw], **more: Any) -> photographs.Photograph:
    raw = rig(1) | {"photographs": [{"exposures": exposures, "light": "l0"}], **more}
    stated = calibration.made(raw, tmp_path / "calibration.json")
    return photographs.read(stated.photographs[0], stated, tmp_path)


def test_a_series_of_exposures_is_merged(tmp_path: Path) -> None:
    light = np.geomspace(0.01, 8.0, SIZE * SIZE).reshape(SIZE, SIZE, 1).repeat(3, axis=2)
    for seconds in (0.1, 1.0):
        values = (np.clip(light * seconds, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)
        (tmp_path / f"{seconds}.png").write_bytes(images.png_bytes(values))
    got = shot(tmp_path, [{"file": f"{seconds}.png", "seconds": seconds} for seconds in (0.1, 1.0)])
    assert not got.saturated.any()
    assert np.abs(got.radiance / light - 1.0)[light > 0.1].max() < 0.03
    long = shot(tmp_path, [{"file": "1.0.png", "seconds": 1.0}])
    assert long.saturated.any() and np.all(light[long.saturated] > 0.98)


def test_a_response_curve_is_undone(tmp_path: Path) -> None:
    light = np.linspace(0.05, 0.9, SIZE * SIZE).reshape(SIZE, SIZE, 1).repeat(3, axis=2)
    values = (np.sqrt(light) * 255.0 + 0.5).astype(np.uint8)
    (tmp_path / "a.png").write_bytes(images.png_bytes(values))
    curve = [[float(v), float(v * v)] for v in np.linspace(0.0, 1.0, 65)]
    got = shot(tmp_path, [{"file": "a.png", "seconds": 1.0}], response=curve)
    np.testing.assert_allclose(got.radiance, light, atol=0.005)


def test_a_jpeg_tells_its_exposure_time() -> None:
    # a directory with the place of another one, which holds ExposureTime = 1/50
    first = struct.pack("<HHHII", 1, 0x8769, 4, 1, 26) + struct.pack("<I", 0)
    second = struct.pack("<HHHII", 1, 0x829A, 5, 1, 44) + struct.pack("<I", 0)
    tiff = b"II*\0" + struct.pack("<I", 8) + first + second + struct.pack("<II", 1, 50)
    assert photographs._own_seconds(b"\xff\xd8\xff\xe1\0\0Exif\0\0" + tiff) == pytest.approx(0.02)
    assert photographs._own_seconds(b"\xff\xd8\xff\xe1\0\0Exif\0\0" + tiff[:30]) is None


# ---------------------------------------------------------------------- camera, lamps, white


def test_a_lens_is_undone() -> None:
    camera = calibration.Camera(size=(300, 200), focal=35.0, pixel=0.1, principal=(140.0, 105.0), k1=-0.12, k2=0.03)
    x, y = np.random.default_rng(1).uniform(0, 200, (2, 500))
    np.testing.assert_allclose(geometry.pixels_of(camera, 7.0 * geometry.rays(camera, x, y)), np.stack([x, y], -1))
    with pytest.raises(InputError, match="fold the picture over"):
        geometry.rays(camera.model_copy(update={"k1": -9.0}), x, y)


def test_a_lamp_is_found_in_mirror_balls(tmp_path: Path) -> None:
    lamp = np.array([150.0, -180.0, 250.0])
    mirrors = [{"center": [-60.0, 50.0, 500.0], "radius": 30.0}, {"center": [60.0, 45.0, 480.0], "radius": 30.0}]
    balls = [{"type": "sphere", **one, "material": {"type": "gonio-mirror"}} for one in mirrors]
    light = {
        "type": "areaLight",
        "energy": [100] * 3,
        "shape": {"type": "sphere", "center": lamp.tolist(), "radius": 4.0},
    }
    scene = {
        "output": {"filename": "m.npz"},
        "sampler": {"type": "independent", "samples": 16},
        "camera": {
            "type": "pinhole",
            "transform": {"position": [0, 0, 0], "lookAt": [0, 0, 1], "up": [0, -1, 0]},
            "verticalFov": float(np.degrees(2.0 * np.arctan(128 / 800.0))),
            "film": {"size": [256, 256]},
        },
        "integrator": {"type": "path", "maxDepth": 4},
        "scene": {"shapes": balls, "lights": [light]},
    }
    (tmp_path / "scene.json").write_text(json.dumps(scene))
    go.render(tmp_path, output=tmp_path / "p0.npz")
    raw = rig(1) | {"camera": {"size": [256, 256], "focal": 800.0}, "mirrors": mirrors}
    stated = calibration.made(raw, tmp_path / "calibration.json")
    picture = photographs.read(stated.photographs[0], stated, tmp_path)
    placed = [geometry.placed(one, stated.camera, [picture]) for one in stated.mirrors]
    got = geometry.lamp_in_mirrors(picture, placed, stated.camera, MIDDLE, None)
    np.testing.assert_allclose(got, lamp, atol=4.0)  # .7 degrees
    distance = float(np.linalg.norm(lamp - MIDDLE))
    alone = geometry.lamp_in_mirrors(picture, placed[:1], stated.camera, MIDDLE, distance)
    np.testing.assert_allclose(alone, lamp, atol=4.0)
    with pytest.raises(InputError, match="direction"):
        geometry.lamp_in_mirrors(picture, placed[:1], stated.camera, MIDDLE, None)
    dark = photographs.Photograph("dark.png", picture.shot, 0.0 * picture.radiance, picture.step)
    with pytest.raises(InputError, match=r"dark.png: no highlight"):
        geometry.lamp_in_mirrors(dark, placed, stated.camera, MIDDLE, None)


def test_a_white_target_tells_the_lamps(tmp_path: Path) -> None:
    raw = rig(2, reference={**FLAT, "albedo": 0.98})
    raw["photographs"] += [
        {"file": f"w{n}.npz", "seconds": 2.0, "light": f"l{n}", "sample": "reference"} for n in (0, 1)
    ]
    stated = json.loads(json.dumps(raw))
    for lamp in stated["lights"].values():
        del lamp["intensity"]
    got = go.capture(rehearsal.take(raw, PAINT, tmp_path / "p", noise=0.01, stated=stated))
    np.testing.assert_allclose(got.scene.intensities, AWAY**2, rtol=0.002)
    assert got.fitted is None and not got.warnings
    with pytest.raises(InputError, match="no material was fitted"):
        _ = got.fit
    stated["photographs"] = stated["photographs"][:3]
    with pytest.raises(InputError, match="no intensity of the light 'l1'"):
        go.capture(again(tmp_path / "p", tmp_path / "p", stated))


# ---------------------------------------------------------------------- bad input


def blank(path: Path, value: float, size: int = SIZE) -> None:
    images.write(path, np.full((size, size, 3), value, np.float32))


def without_seconds(raw: Raw, folder: Path) -> None:
    del raw["photographs"][2]["seconds"]


def of_another_size(raw: Raw, folder: Path) -> None:
    blank(folder / "p2.npz", 0.1, 32)


def saturated(raw: Raw, folder: Path) -> None:
    (folder / "white.png").write_bytes(images.png_bytes(np.full((SIZE, SIZE, 3), 255, np.uint8)))
    raw["photographs"][2]["file"] = "white.png"


def empty(raw: Raw, folder: Path) -> None:
    blank(folder / "p2.npz", 0.0)


def a_grey_wall(raw: Raw, folder: Path) -> None:
    blank(folder / "p2.npz", 0.4)


def missing(raw: Raw, folder: Path) -> None:
    (folder / "p2.npz").unlink()


def no_picture(raw: Raw, folder: Path) -> None:
    (folder / "p2.png").write_bytes(b"no picture at all")
    raw["photographs"][2]["file"] = "p2.png"


@pytest.mark.parametrize(
    ("spoil", "text"),
    [
        (without_seconds, r"p2.npz: no exposure time"),
        (of_another_size, r"p2.npz: 32x32 pixels, 64x64 expected"),
        (saturated, r"white.png: saturated throughout"),
        (empty, r"p2.npz: no ball found"),
        (a_grey_wall, r"p2.npz: no ball found"),
        (missing, r"p2.npz: cannot read this photograph"),
        (no_picture, r"p2.png: no picture of a known format"),
    ],
)
@pytest.mark.parametrize("given", [True, False], ids=["a ball that is given", "a ball to be found"])
def test_a_photograph_that_cannot_be_used_is_named(
    taken: Path, tmp_path: Path, spoil: Callable[[Raw, Path], None], text: str, given: bool
) -> None:
    raw = rig() if given else rig(ball={"radius": 50.0})
    folder = again(taken, tmp_path, raw)
    spoil(raw, folder)
    (folder / "calibration.json").write_text(json.dumps(raw))
    with pytest.raises(InputError, match=text):
        go.capture(folder)


def test_pictures_without_any_ball_are_refused(taken: Path, tmp_path: Path) -> None:
    folder = again(taken, tmp_path, rig(ball={"radius": 50.0}))
    square = np.zeros((SIZE, SIZE, 3), np.float32)
    square[10:50, 12:52] = 0.5
    for n in range(4):
        images.write(folder / f"p{n}.npz", square)
    with pytest.raises(InputError, match="no ball found: the shape that stands out is not round"):
        go.capture(folder)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"camera": {"size": [64, 64]}}, "focal"),
        ({"lights": {}}, "no light 'l0'"),
        ({"ball": {"radius": 50.0, "centre": [0, 0, 1]}}, "unknown key 'centre'"),
        ({"ball": {"radius": 50.0, "center": [0, 0, 1]}}, "is inside the ball"),
        ({"response": [[0, 0], [0.5, 0.6], [0.4, 0.8], [1, 1]]}, "does not rise"),
        ({"flat": {"base": [0, 0, 1], "edge0": [1, 0, 0], "edge1": [2, 0, 0]}}, "span no plane"),
        ({"photographs": [{"light": "l0", "seconds": 1}]}, "exactly one of file and exposures"),
    ],
)
def test_a_calibration_is_held_to_its_keys(tmp_path: Path, change: Raw, text: str) -> None:
    (tmp_path / "calibration.json").write_text(json.dumps(rig() | change))
    with pytest.raises(InputError, match=text):
        go.capture(tmp_path)


def test_a_photograph_that_the_calibration_does_not_list_is_refused(taken: Path) -> None:
    with pytest.raises(InputError, match=r"other.png: the calibration lists neither its exposure nor its light"):
        go.capture([str(taken / "p0.npz"), str(taken / "other.png")])
    with pytest.raises(InputError, match="no calibration file"):
        go.capture(taken.parent)


def test_grazing_pixels_are_left_out_sooner_where_the_outline_is_unsure() -> None:
    wo, wi = np.array([[np.sin(1.3), 0.0, np.cos(1.3)]]), np.array([[0.0, 0.0, 1.0]])
    assert not pixels.is_steep(wo, wi, 80.0)[0]
    assert pixels.is_steep(wo, wi, 80.0, (0.03, 0.0))[0]


def test_places_for_a_lamp_do_not_stand_in_the_way() -> None:
    scene = pixels.Scene(
        calibration.Camera(size=(64, 64), focal=250.0),
        geometry.Placed(MIDDLE, 50.0, 2.0),
        None,
        np.zeros((0, 3)),
        np.zeros((0, 3)),
        (),
    )
    toward = (planning.places(scene, "ball", AWAY) - MIDDLE) / AWAY
    np.testing.assert_allclose(np.linalg.norm(toward, axis=1), 1.0)
    angle = np.degrees(np.arccos(-toward[:, 2]))
    assert len(toward) >= 90 and angle.min() > 8.0 and angle.max() < 125.0


def test_a_place_is_chosen_for_relative_errors_and_not_for_a_volume(monkeypatch: pytest.MonkeyPatch) -> None:
    """One place tells very much of what is known well (the larger determinant), the other of what is not."""
    told = [np.diag([1e8, 1.0]), np.diag([1.0, 1e4])]
    monkeypatch.setattr(planning, "_told", lambda setting, lamps: (told, 2))
    free = [Free(name, "float", 0.0, 1.0, False) for name in ("specular", "exponent")]
    monkeypatch.setattr(planning, "start_of", lambda material, moving: np.array([0.5, 0.5]))
    scene = pixels.Scene(
        calibration.Camera(size=(64, 64), focal=250.0),
        geometry.Placed(MIDDLE, 50.0, 2.0),
        None,
        np.zeros((0, 3)),
        np.zeros((0, 3)),
        (),
    )
    setting = planning.Setting(scene, "ball", PAINT, free, fitting.Faults(), np.ones(3))
    lamps = np.array([[0.0, -400.0, 300.0], [0.0, 400.0, 300.0]])
    known = np.diag([1e4, 10.0])
    best = planning.propose(setting, lamps, 1, known)[0]
    assert best.position == (0.0, 400.0, 300.0)
    assert best.errors == pytest.approx([1 / np.sqrt(1e4 + 2), 1 / np.sqrt(1e4 + 11)])
