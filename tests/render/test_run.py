"""Passes, their size, and every way to end a render."""

from __future__ import annotations

import json
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import FrameType, SimpleNamespace

import gonio as go
import numpy as np
import pytest
from gonio.bridge import engine
from gonio.errors import GonioError, InputError, MachineError
from gonio.pictures import denoise, images
from gonio.render.finish import render_to_file
from gonio.render.prepare import prepare
from gonio.render.request import Request, parse_size
from gonio.transport import mitsuba_render, passes

PIXELS = 300_000

SCENE = {
    "output": {"filename": "ball.exr"},
    "sampler": {"type": "independent", "xSamples": 2, "ySamples": 2},
    "camera": {
        "type": "pinhole",
        "transform": {"position": [0, 1, 4], "lookAt": [0, 0, 0], "up": [0, 1, 0]},
        "verticalFov": 40,
        "film": {"size": [24, 16]},
    },
    "integrator": {"type": "path", "maxDepth": 3},
    "scene": {
        "shapes": [
            {
                "type": "sphere",
                "center": [0, 0, 0],
                "radius": 1,
                "material": {"type": "matte", "albedo": [0.7, 0.5, 0.3]},
            }
        ],
        "lights": [{"type": "spotLight", "position": [2, 3, 4], "energy": [40, 40, 40]}],
    },
}

XML = """<scene version="3.0.0">
  <default name="alpha" value="0.2"/>
  <integrator type="path"><integer name="max_depth" value="3"/></integrator>
  <sensor type="perspective">
    <float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0,1,4" target="0,0,0" up="0,1,0"/></transform>
    <sampler type="independent"><integer name="sample_count" value="4"/></sampler>
    <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="16"/></film>
  </sensor>
  <emitter type="constant"/>
  <shape type="sphere">
    <bsdf type="gonio_conductor"><string name="preset" value="Au"/><float name="alpha" value="$alpha"/></bsdf>
  </shape>
</scene>"""


class FakeRender:
    """A render whose clock ticks as its passes say: one second for the kernel, then 5 M samples a second."""

    def __init__(self, compile_seconds: float = 1.0, rate: float = 5e6) -> None:
        self.done, self.now, self.rate, self._compile = 0, 0.0, rate, compile_seconds
        self.passes: list[int] = []
        self.times: list[float] = []

    def advance(self, count: int) -> None:
        seconds = count * PIXELS / self.rate + (self._compile if not self.passes else 0)
        self.passes.append(count)
        self.times.append(seconds)
        self.now += seconds
        self.done += count

    def image(self) -> np.ndarray:
        return np.zeros((1, 1, 3), np.float32)

    def aov(self) -> dict[str, np.ndarray]:
        return {}

    def clock(self) -> float:
        return self.now


def test_passes_settle_at_half_a_second_and_end_at_the_wanted_count() -> None:
    render = FakeRender()
    assert passes.run(render, 1000, PIXELS, clock=render.clock) == ""
    assert render.done == 1000
    assert max(render.times[2:]) <= 0.6  # at most this long until Ctrl-C is answered
    assert len(render.passes) < 1000 * PIXELS / render.rate / passes.PASS_SECONDS + 8  # and start-up costs few passes


def test_progress_tells_samples_rate_and_time_left() -> None:
    render = FakeRender()
    seen: list[passes.Progress] = []
    passes.run(render, 200, PIXELS, report=seen.append, clock=render.clock)
    assert [progress.done for progress in seen] == sorted({progress.done for progress in seen})
    assert seen[-1] == passes.Progress(200, 200, pytest.approx(5e6), 0.0)
    middle = seen[len(seen) // 2]  # the compiling of the first pass does not spoil the rate
    assert middle.rate == pytest.approx(5e6)
    assert middle.remaining == pytest.approx((200 - middle.done) * PIXELS / 5e6)


def test_an_interrupt_ends_after_the_pass() -> None:
    render = FakeRender()
    assert (
        passes.run(render, 1000, PIXELS, interrupted=lambda: len(render.passes) == 3, clock=render.clock) == "interrupt"
    )
    assert len(render.passes) == 3 and 0 < render.done < 1000


def test_the_time_limit_is_kept_to_within_one_small_pass() -> None:
    render = FakeRender()
    assert passes.run(render, 10**6, PIXELS, timeout=5, clock=render.clock) == "timeout"
    assert 5 <= render.now < 5.2


def test_a_limit_that_is_too_short_still_gives_one_pass() -> None:
    render = FakeRender()
    assert passes.run(render, 100, PIXELS, timeout=1e-6, clock=render.clock) == "timeout"
    assert render.done >= 1


def test_a_mitsuba_scene_has_passes_of_one_size() -> None:
    render = FakeRender()
    render.pass_size = 7  # type: ignore[attr-defined]
    passes.run(render, 30, PIXELS, clock=render.clock)
    assert render.passes == [7, 7, 7, 7, 2]


@pytest.mark.parametrize("text", ["640", "x", "640x", "-3x4", "6.5x4", "640x480x3", "99999999999x1"])
def test_a_bad_size_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="is not a size"):
        parse_size(text)


def test_a_size_is_width_times_height() -> None:
    assert parse_size("640x480") == (640, 480)


@pytest.mark.parametrize(
    ("option", "where"),
    [
        ({"spp": 0}, "--spp"),
        ({"size": (0, 5)}, "--size"),
        ({"size": (10**6, 10**6)}, "--size"),
        ({"max_depth": 0}, "--max-depth"),
        ({"seed": -1}, "--seed"),
        ({"threads": 0}, "--threads"),
        ({"timeout": 0.0}, "--timeout"),
        ({"until_error": 0.0}, "--until-error"),
        ({"until_error": float("nan")}, "--until-error"),
        ({"timeout": float("nan")}, "--timeout"),
        ({"exposure": float("nan")}, "--exposure"),
    ],
)
def test_options_are_checked_before_anything_is_loaded(option: dict[str, object], where: str) -> None:
    request = Request(Path("nowhere"), **option)  # type: ignore[arg-type]
    with pytest.raises(InputError) as caught:
        request.check()
    assert caught.value.where == where


def test_a_missing_denoiser_is_told_before_the_render(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(denoise, "available", lambda: "")
    with pytest.raises(MachineError):
        Request(Path("nowhere"), denoise=True).check()


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    folder = tmp_path / "ball"
    folder.mkdir()
    (folder / "scene.json").write_text(json.dumps(SCENE))
    return folder


def test_a_render_writes_the_picture_and_its_settings(scene: Path, tmp_path: Path) -> None:
    output = tmp_path / "a.exr"
    result = render_to_file(Request(scene, output, spp=8, seed=5))
    picture = images.read(output)
    assert picture.pixels.shape == (16, 24, 3) and picture.pixels.max() > 0
    assert result.spp == picture.metadata["spp"] == 8
    assert picture.metadata["seed"] == 5
    assert picture.metadata["integrator"] == "path" and picture.metadata["max_depth"] == 3
    assert picture.metadata["scene"] == str(scene)
    assert "stopped" not in picture.metadata


def test_the_picture_goes_into_the_current_folder_by_the_scenes_name(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert render_to_file(Request(scene)).output == Path("ball.exr")
    assert (tmp_path / "ball.exr").is_file()


def test_same_seed_same_bits_whatever_the_passes(scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def rendered(seed: int) -> np.ndarray:
        prepared = prepare(Request(scene, spp=13, seed=seed))
        passes.run(prepared.render, prepared.spp, 24 * 16)
        return prepared.render.image()

    whole = rendered(1)
    monkeypatch.setattr(passes, "FIRST_PASS", 1)
    monkeypatch.setattr(passes, "PASS_SECONDS", 1e-9)  # passes of one sample
    assert np.array_equal(rendered(1), whole)
    assert not np.array_equal(rendered(2), whole)


def test_a_request_passes_through_at_most_fifteen_files_before_its_first_ray(scene: Path) -> None:
    """The files of the functions that are being called where a scene is read, where it is built, where the data of its
    kernels are collected, and where its first ray is traced."""
    source = Path(go.__file__).parent
    moments = {
        (str(source / "scene/text.py"), "read_json"),
        (str(source / "scene/build.py"), "built"),
        (str(source / "transport/scene_data.py"), "__init__"),
        (str(source / "transport/surfaces.py"), "nearest"),
    }
    passed: list[str] = []
    reached = set()

    def profile(frame: FrameType | None, event: str, argument: object) -> None:
        if event != "call" or frame is None:
            return
        moment = frame.f_code.co_filename, frame.f_code.co_name
        if moment not in moments or moment in reached:
            return
        reached.add(moment)
        stack = []
        while frame is not None:
            file = Path(frame.f_code.co_filename)
            if file.is_relative_to(source):
                stack.append(file.relative_to(source).as_posix())
            frame = frame.f_back
        passed.extend(stack[::-1])

    sys.setprofile(profile)
    try:
        go.render(scene, spp=1)
    finally:
        sys.setprofile(None)
    assert reached == moments
    assert len(set(passed)) <= 15, list(dict.fromkeys(passed))


def test_another_value_compiles_no_kernel(scene: Path) -> None:
    engine.load()  # before Dr.Jit is imported, which would take any LLVM
    import drjit as dr

    def compiled(albedo: list[float]) -> int:
        prepared = prepare(Request(scene, overrides={"shapes.0.material.albedo": albedo}))
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            passes.run(prepared.render, 4, 24 * 16)
            prepared.render.image()
            return sum(not kernel.get("cache_hit", True) for kernel in dr.kernel_history())

    compiled([0.2, 0.3, 0.4])
    assert compiled([0.9, 0.1, 0.6]) == 0


def test_the_scene_is_overridden_by_options(scene: Path) -> None:
    prepared = prepare(Request(scene, size=(10, 6), integrator="normal", sampler="independent"))
    assert prepared.size == (10, 6)
    assert prepared.settings["integrator"] == "normal" and prepared.settings["sampler"] == "independent"
    assert prepared.spp == 4


def test_an_unknown_integrator_gets_a_suggestion(scene: Path) -> None:
    with pytest.raises(InputError) as caught:
        prepare(Request(scene, integrator="pth"))
    assert (caught.value.where, caught.value.hint) == ("--integrator", "did you mean 'path'?")


def test_a_depth_is_refused_where_it_has_no_effect(scene: Path) -> None:
    with pytest.raises(InputError, match="integrator 'normal' has no maximum depth") as caught:
        prepare(Request(scene, integrator="normal", max_depth=3))
    assert caught.value.where == "--max-depth" and "path" in caught.value.hint


def test_a_timeout_keeps_the_picture_and_says_so(scene: Path, tmp_path: Path) -> None:
    result = render_to_file(Request(scene, tmp_path / "a.npz", spp=2**29, timeout=0.3))
    metadata = images.read(result.output).metadata
    assert metadata["stopped"] == result.stopped == "timeout"
    assert metadata["spp"] == result.spp < metadata["wanted_spp"] == 2**29


# --- Mitsuba's scenes ----------------------------------------------------------------------------------


@pytest.fixture
def xml(tmp_path: Path) -> Path:
    path = tmp_path / "ball.xml"
    path.write_text(XML)
    return path


def test_a_mitsuba_scene_renders_with_gonio_materials(xml: Path, tmp_path: Path) -> None:
    result = render_to_file(Request(xml, tmp_path / "a.npz"))
    pixels = images.read(result.output).pixels
    assert pixels.shape == (16, 24, 3) and result.spp == 4
    ball = pixels[8, 12]
    assert ball[0] > ball[2]  # gold is not grey
    assert result.settings["integrator"] == "mitsuba:PathIntegrator"


def test_a_mitsuba_scene_has_the_same_picture_for_the_same_seed(xml: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mitsuba_render, "WAVEFRONT", 24 * 16 * 2)  # passes of two samples

    def rendered(seed: int) -> np.ndarray:
        prepared = prepare(Request(xml, spp=6, seed=seed))
        passes.run(prepared.render, prepared.spp, 24 * 16)
        assert prepared.render.done == 6
        return prepared.render.image()

    # Mitsuba's film adds up with atomics where its filter is wider than a pixel: their order, and the last bit, vary
    np.testing.assert_allclose(rendered(1), rendered(1), rtol=1e-5)
    assert not np.allclose(rendered(1), rendered(2), rtol=1e-2)


def test_both_ways_through_a_mitsuba_scene_agree(xml: Path) -> None:
    pictures = []
    for integrator in (None, "path"):
        prepared = prepare(Request(xml, spp=512, integrator=integrator, max_depth=3 if integrator else None))
        passes.run(prepared.render, prepared.spp, 24 * 16)
        pictures.append(prepared.render.image())
    # Mitsuba's default filter spreads samples over pixels, so means are compared, not pixels.
    assert pictures[0].mean() == pytest.approx(pictures[1].mean(), rel=0.01)


def test_a_mitsuba_scene_takes_size_and_parameters(xml: Path) -> None:
    prepared = prepare(Request(xml, size=(12, 20), overrides={"alpha": 0.5}))
    assert prepared.size == (12, 20)
    with pytest.raises(InputError, match="alhpa"):
        prepare(Request(xml, overrides={"alhpa": 0.5}))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("</scene>", "", "not well-formed XML"),
        ('type="sphere"', 'type="spheer"', "spheer"),
        ('name="alpha" value="0.2"', 'name="alpha" value="-1"', "-1 given"),
        ("gonio_conductor", "gonio_condutor", "gonio_condutor"),
        ("sensor", "texture", "line 4|no <sensor>"),
    ],
)
def test_a_bad_mitsuba_scene_is_one_clear_error(xml: Path, old: str, new: str, message: str) -> None:
    xml.write_text(XML.replace(old, new))
    with pytest.raises(InputError, match=message) as caught:
        prepare(Request(xml))
    assert "Traceback" not in caught.value.what and ".cpp" not in caught.value.what
    assert caught.value.where == str(xml)


def test_a_mitsuba_scene_may_not_read_outside_its_folder(tmp_path: Path) -> None:
    (tmp_path / "secret.ply").write_text("ply")
    inside = tmp_path / "scene"
    inside.mkdir()
    scene = inside / "a.xml"
    scene.write_text(
        XML.replace('<shape type="sphere">', '<shape type="ply"><string name="filename" value="../secret.ply"/>')
    )
    with pytest.raises(InputError, match="outside the scene's folder"):
        prepare(Request(scene))
    with pytest.raises(InputError) as caught:  # allowed, it is read, and found to be no mesh
        prepare(Request(scene, allow_outside=True))
    assert "outside" not in caught.value.what


def test_options_that_mitsubas_integrator_would_ignore_are_refused(xml: Path) -> None:
    with pytest.raises(InputError) as caught:
        prepare(Request(xml, max_depth=3))
    assert "--integrator" in caught.value.hint


def test_pictures_of_one_channel_become_grey() -> None:
    class Film:
        def crop_size(self) -> tuple[int, int]:
            return 2, 1

    sensor = SimpleNamespace(film=Film, sampler=lambda: SimpleNamespace(sample_count=lambda: 1))
    scene = SimpleNamespace(sensors=lambda: [sensor], integrator=lambda: None)
    mi = SimpleNamespace(render=lambda *a, **k: np.array([[[1.0], [2.0]]], np.float32))
    render = mitsuba_render.MitsubaRender(mi, scene, spp=1)  # type: ignore[arg-type]
    render.advance(1)
    assert render.image().tolist() == [[[1, 1, 1], [2, 2, 2]]]


# --- Ctrl-C --------------------------------------------------------------------------------------------


def _start(scene: Path, output: Path) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "gonio.cli", "render", str(scene), "--spp", str(2**29), "-o", str(output)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.fixture
def endless(scene: Path) -> Path:
    """A scene whose passes take their half second."""
    big = json.loads((scene / "scene.json").read_text())
    big["camera"]["film"]["size"] = [320, 200]
    (scene / "scene.json").write_text(json.dumps(big))
    return scene


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("number", "name"), [(signal.SIGINT, "Ctrl-C"), (signal.SIGTERM, "SIGTERM"), (signal.SIGHUP, "SIGHUP")]
)
def test_a_signal_keeps_the_picture_so_far(endless: Path, tmp_path: Path, number: int, name: str) -> None:
    output = tmp_path / "a.exr"
    for patience in (4, 10, 30):  # a busy machine may still be loading: then nothing is kept, and we wait longer
        process = _start(endless, output)
        time.sleep(patience)
        process.send_signal(number)
        told, warned = process.communicate(timeout=60)
        assert process.returncode == 128 + number, warned
        if "nothing was written" not in warned:
            break
        assert not output.exists()
    assert f"stopped by {name}" in told and "Traceback" not in warned
    assert images.read(output).metadata["stopped"] == "interrupt"


@pytest.mark.slow
def test_a_second_ctrl_c_ends_at_once_and_leaves_no_part_of_a_picture(endless: Path, tmp_path: Path) -> None:
    output = tmp_path / "out" / "a.exr"
    output.parent.mkdir()
    process = _start(endless, output)
    time.sleep(3)
    process.send_signal(signal.SIGINT)
    time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=5)
    # Python's own end where the second came before Gonio's handler stood again
    assert process.returncode in (128 + signal.SIGINT, -signal.SIGINT)
    left = {entry.name for entry in output.parent.iterdir() if "checkpoint" not in entry.name}
    assert left <= {output.name}
    if left:  # the pass ended between the two signals: the picture is complete
        picture = images.read(output)
        assert picture.metadata["stopped"] == "interrupt" and picture.pixels.shape == (200, 320, 3)


FAILS = {
    '<integrator type="path"><integer name="samples_per_pass" value="3"/></integrator>': r"must be a multiple of",
    '<integrator type="aov"><string name="aovs" value=""/></integrator>': "Mitsuba cannot render it",
}
BUMP = """<shape type="cube"><bsdf type="bumpmap"><texture type="checkerboard"/><bsdf type="diffuse"/></bsdf></shape>"""


@pytest.mark.parametrize("element", FAILS)
def test_what_mitsuba_cannot_render_is_an_error_of_the_scene(element: str, tmp_path: Path) -> None:
    path = '<integrator type="path"><integer name="max_depth" value="3"/></integrator>'
    (tmp_path / "a.xml").write_text(XML.replace(path, element))
    with pytest.raises(InputError, match=FAILS[element]) as caught:
        render_to_file(Request(tmp_path / "a.xml", tmp_path / "a.exr", spp=4))
    assert caught.value.where == str(tmp_path / "a.xml")


@pytest.mark.parametrize("integrator", [None, "path"])
def test_a_plugin_that_is_not_made_for_it_is_an_error_of_the_scene(integrator: str | None, tmp_path: Path) -> None:
    (tmp_path / "a.xml").write_text(XML.replace("<shape", f"{BUMP}<shape", 1))
    with pytest.raises(InputError, match=r"Mitsuba cannot render it: \[Texture\] .*not implemented"):
        render_to_file(Request(tmp_path / "a.xml", tmp_path / "a.exr", spp=4, integrator=integrator))


def test_an_error_that_a_notebook_remembers_does_not_come_back(scene: Path, tmp_path: Path) -> None:
    """Dr.Jit's calls go to every living BSDF: the scene that failed must be gone, though its error is not."""
    (tmp_path / "a.xml").write_text(XML.replace("<shape", f"{BUMP}<shape", 1))
    with pytest.raises(InputError, match="not implemented") as caught:
        go.render(tmp_path / "a.xml", spp=4)
    assert go.render(scene, spp=1).shape == (16, 24, 3), caught


@pytest.mark.parametrize(
    ("others", "hint"),
    [
        ([], "give a folder, a .json or a .xml"),
        (["wine.json"], "did you mean 'wine.json'?"),
        ([f"scene{i}.json" for i in range(21)], "give a folder, a .json or a .xml"),
    ],
)
def test_a_scene_that_is_missing_is_named_with_the_files_near_it(others: list[str], hint: str, tmp_path: Path) -> None:
    for name in others:
        (tmp_path / name).write_text("{}")
    with pytest.raises(InputError) as caught:
        go.render(tmp_path / "wime.json", spp=1)
    assert caught.value.hint == hint


# --- a finished picture is never lost ------------------------------------------------------------------


def kept_at(error: GonioError) -> Path:
    """Where the error says that the picture is."""
    found = re.search(r"it is kept as (.*): move it from there", error.hint)
    assert found is not None, error.hint
    return Path(found[1])


@pytest.mark.parametrize("suffix", images.SUFFIXES)
def test_a_folder_that_is_removed_while_it_renders_costs_no_picture(
    suffix: str, scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "current").mkdir()
    monkeypatch.chdir(tmp_path / "current")
    with pytest.raises(InputError, match="does not exist") as caught:
        render_to_file(
            Request(scene, tmp_path / "out" / f"a{suffix}", spp=2),
            report=lambda progress: shutil.rmtree(tmp_path / "out", ignore_errors=True),
        )
    assert images.read(kept_at(caught.value)).pixels.shape == (16, 24, 3)


def test_a_current_folder_that_is_deleted_while_it_renders_costs_no_picture(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "current").mkdir()
    monkeypatch.chdir(tmp_path / "current")
    with pytest.raises(MachineError, match="cannot write") as caught:
        render_to_file(
            Request(scene, Path("a.exr"), spp=2),
            report=lambda progress: shutil.rmtree(tmp_path / "current", ignore_errors=True),
        )
    assert images.read(kept_at(caught.value)).pixels.shape == (16, 24, 3)


def test_a_denoiser_that_fails_costs_no_picture(scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(*_: object) -> None:
        raise MemoryError

    monkeypatch.setattr(denoise, "denoise", failing)
    with pytest.raises(MachineError, match="not denoised: MemoryError") as caught:
        render_to_file(Request(scene, tmp_path / "a.exr", spp=2, denoise=True))
    assert caught.value.where == str(tmp_path / "a.exr")
    assert images.read(tmp_path / "a.exr").pixels.shape == (16, 24, 3)
