"""A render that was stopped and goes on is the one that was never stopped, to the bit; what has changed is refused."""

from __future__ import annotations

import json
import shutil
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.bridge import engine
from gonio.catalog import notation
from gonio.errors import GonioWarning, InputError
from gonio.pictures import images
from gonio.render import checkpoints
from gonio.render.finish import render_to_file
from gonio.render.prepare import prepare
from gonio.render.request import Request
from gonio.transport import mitsuba_render, passes
from gonio.work import facts, kept

sys.path.insert(0, str(Path(__file__).parent))
from test_run import XML


@pytest.fixture(autouse=True)
def small_passes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Passes of one sample, and a checkpoint after each of them."""
    monkeypatch.setattr(passes, "FIRST_PASS", 1)
    monkeypatch.setattr(passes, "PASS_SECONDS", 1e-9)
    monkeypatch.setattr(checkpoints, "INTERVAL", 0.0)
    monkeypatch.setattr(checkpoints, "MAX_COST", 1e9)


def stopped_after(scene: Path | go.BSDF, count: int, checkpoint: Path, **options: object) -> None:
    """Render so many passes, and leave as `kill -9` does: nothing is written at the end."""

    class Killed(Exception):
        pass

    request = Request(
        Path(scene.name) if isinstance(scene, go.BSDF) else scene,
        checkpoint=checkpoint,
        material=scene if isinstance(scene, go.BSDF) else None,
        **options,  # type: ignore[arg-type]
    )
    prepared = prepare(request)
    keeper = checkpoints.Keeper(checkpoint, prepared)

    def after(progress: passes.Progress) -> None:
        keeper.after_pass(progress)
        keeper.close()
        if progress.done == count:
            raise Killed

    with pytest.raises(Killed):
        passes.run(prepared.render, prepared.spp, 24 * 16, report=after)


@pytest.mark.sample(1)
@pytest.mark.parametrize("options", [{}, {"integrator": "path"}, {"denoise": True}, {"integrator": "normal"}])
def test_a_render_that_goes_on_has_the_same_bits(scene: Path, tmp_path: Path, options: dict[str, object]) -> None:
    whole = go.render(scene, spp=7, seed=3, **options)  # type: ignore[arg-type]
    stopped_after(scene, 4, tmp_path / "c", spp=7, seed=3, **options)
    assert kept.read(tmp_path / "c").facts["done"] == 4
    with pytest.warns(GonioWarning, match="4 of 7 samples per pixel are done"):
        assert np.array_equal(go.resume(tmp_path / "c"), whole)


def test_the_same_call_again_goes_on_too(scene: Path, tmp_path: Path) -> None:
    whole = go.render(scene, spp=5)
    stopped_after(scene, 2, tmp_path / "c", spp=5)
    with pytest.warns(GonioWarning, match="2 of 5 samples"):
        assert np.array_equal(go.render(scene, spp=5, checkpoint=tmp_path / "c"), whole)


def test_a_finished_picture_goes_on_to_more_samples(scene: Path, tmp_path: Path) -> None:
    go.render(scene, spp=4, checkpoint=tmp_path / "c")
    with pytest.warns(GonioWarning, match="4 of 9 samples"):
        more = go.resume(tmp_path / "c", spp=9, output=tmp_path / "more.exr")
    assert np.array_equal(more, go.render(scene, spp=9))
    assert np.array_equal(images.read(tmp_path / "more.exr").pixels, more)
    with pytest.raises(InputError, match="has 9 samples per pixel, but 4 are requested"):
        go.resume(tmp_path / "c", spp=4)


def test_a_material_goes_on_by_its_exact_values(tmp_path: Path) -> None:
    material = go.Conductor(eta=(0.2, 0.9, 1.1), k=(3.9, 2.4, 2.2), alpha=0.123456789123)
    options = {
        "spp": 4,
        "size": (24, 16),
        "overrides": {"/scene/shapes/1/material": go.Lambert(albedo=(0.1, 0.2, 1 / 3))},
    }
    whole = go.render(material, **options)  # type: ignore[arg-type]
    stopped_after(material, 2, tmp_path / "c", **options)
    with pytest.warns(GonioWarning, match="2 of 4"):
        assert np.array_equal(go.resume(tmp_path / "c"), whole)


def test_a_newest_file_that_is_cut_short_falls_back_to_the_one_before(scene: Path, tmp_path: Path) -> None:
    whole = go.render(scene, spp=6)
    stopped_after(scene, 4, tmp_path / "c", spp=6)
    content = (tmp_path / "c").read_bytes()
    for length in (0, 10, len(content) // 2, len(content) - 1):
        (tmp_path / "c").write_bytes(content[:length])
        assert kept.read(tmp_path / "c").facts["done"] == 3
    (tmp_path / "c").write_bytes(content[:-40] + bytes([content[-40] ^ 1]) + content[-39:])
    with pytest.warns(GonioWarning, match="3 of 6"):
        assert np.array_equal(go.resume(tmp_path / "c"), whole)


def test_a_damaged_file_does_not_take_the_place_of_the_one_before(scene: Path, tmp_path: Path) -> None:
    def cut() -> None:
        (tmp_path / "c").write_bytes((tmp_path / "c").read_bytes()[:-1])

    stopped_after(scene, 4, tmp_path / "c", spp=6)
    cut()
    stopped_after(scene, 1, tmp_path / "c", spp=6)  # another process writes once, is killed, and its file damaged
    cut()
    assert kept.read(tmp_path / "c").facts["done"] == 3


def test_both_files_damaged_is_one_clear_error(scene: Path, tmp_path: Path) -> None:
    stopped_after(scene, 2, tmp_path / "c", spp=6)
    (tmp_path / "c").write_bytes((tmp_path / "c").read_bytes()[:-1])
    (tmp_path / "c.previous").unlink()
    with pytest.raises(InputError, match="damaged or was cut short"):
        go.resume(tmp_path / "c")
    (tmp_path / "picture.exr").write_bytes(b"\x76\x2f\x31\x01")
    with pytest.raises(InputError, match="not a checkpoint of Gonio"):
        go.resume(tmp_path / "picture.exr")


def test_what_has_changed_is_refused_by_name(scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = scene / "scene.json"
    raw = json.loads(file.read_text())
    raw["scene"]["shapes"][0]["material"] = {"type": "matte", "albedo": {"type": "imageTex", "file": "wood.png"}}
    file.write_text(json.dumps(raw))
    images.write(scene / "wood.png", np.full((4, 4, 3), 0.5, np.float32))
    stopped_after(scene, 2, tmp_path / "c", spp=4)

    def refused(match: str) -> None:
        with pytest.raises(InputError, match=match):
            go.resume(tmp_path / "c")

    images.write(scene / "wood.png", np.full((4, 4, 3), 0.6, np.float32))
    refused(r"file wood.png has changed")
    images.write(scene / "wood.png", np.full((4, 4, 3), 0.5, np.float32))
    raw["scene"]["lights"][0]["energy"] = [40, 40, 41]
    file.write_text(json.dumps(raw))
    refused("the scene has changed")
    raw["scene"]["lights"][0]["energy"] = [40, 40, 40]
    file.write_text(json.dumps(raw, indent=1))  # other blanks are no other scene
    with monkeypatch.context() as other:
        other.setattr(facts, "__version__", "9.9")
        refused("version: the checkpoint was made with gonio .*, this is gonio 9.9")
    with monkeypatch.context() as other:
        other.setattr(facts, "_vectors", lambda: "abacus")  # what says which processor it is,
        other.setattr(engine, "cuda_device", lambda: "abacus")  # or which GPU
        refused("device: .* abacus")
    with pytest.raises(InputError, match=r"settings: .*seed 0.*, this is .*seed 8"):
        go.render(scene, spp=4, seed=8, checkpoint=tmp_path / "c")
    with pytest.warns(GonioWarning, match="2 of 4"):
        go.resume(tmp_path / "c")
    shutil.rmtree(scene)
    refused("no such scene")


def test_a_checkpoint_runs_no_code_unasked(scene: Path, tmp_path: Path) -> None:
    source = "import gonio as go\n\nclass Flat(go.Lambert):\n    'Flat.'\n    name = 'flat-for-checkpoints'\n"
    (tmp_path / "flat.py").write_text(source)
    material = notation.named(f"{tmp_path / 'flat.py'}:Flat")[0]
    stopped_after(material, 2, tmp_path / "c", spp=4, size=(24, 16))
    with pytest.raises(InputError, match="runs Python files") as caught:
        go.resume(tmp_path / "c")
    assert "--allow-code" in caught.value.hint
    with pytest.warns(GonioWarning, match="2 of 4"):
        go.resume(tmp_path / "c", allow_code=True)
    (tmp_path / "flat.py").write_text(source + "\n# another\n")
    with pytest.raises(InputError, match=r"file .*flat\.py has changed"):
        go.resume(tmp_path / "c", allow_code=True)


def test_a_material_of_this_program_alone_is_refused_before_the_render(tmp_path: Path) -> None:
    namespace: dict[str, object] = {}
    exec("import gonio as go\nclass Mine(go.Lambert):\n    'Mine.'\n    name = 'mine-for-checkpoints'\n", namespace)
    mine = namespace["Mine"]()  # type: ignore[operator]
    with pytest.raises(InputError, match="defined only in this program"):
        go.render(mine, spp=4, size=(24, 16), checkpoint=tmp_path / "c")
    assert go.render(mine, spp=2, size=(24, 16), output=tmp_path / "a.exr").shape == (16, 24, 3)


# --- a checkpoint is an untrusted file -----------------------------------------------------------------


def rewritten(path: Path, change: Callable[[dict[str, Any], dict[str, Any]], object]) -> None:
    """Change facts and arrays of a checkpoint; its checksum is right afterwards."""
    content = kept.read(path)
    change(content.facts, content.arrays)
    kept.write(path, content.facts, content.arrays)


WRONG_FACTS = {
    "done": ["2", -1, 1.5, None, [2], 2**40, True],
    "wanted": ["4", 0, 2**31, {}],
    "size": [[24], "24x16", [24, "x"], None],
    "output": [None, 5],
    "temporary": ["no", 2],
    "identity": [[], {"version": 5}, "x"],
}
WRONG_REQUEST = {
    "scene": [5, None, ["a"], {"$material": {"type": "lambert"}}],
    "output": [5, {}],
    "spp": ["4", -1, 0, 1.5, 2**40],
    "size": [[24], [0, 0], [-1, 5], "24x16", [1e9, 1e9], [10**9, 10**9]],
    "integrator": [5, ["path"], "no-such"],
    "max_depth": [0, "x"],
    "sampler": [5],
    "seed": [-1, "x", 2**40],
    "device": [5, "abacus"],
    "spectral": ["yes", 5],
    "threads": [0, "x", 10**9],
    "denoise": [5, "x"],
    "exposure": ["bright", [], 1e400],
    "allow_outside": ["x"],
    "overrides": [5, [], {"": 5}, {"scene.shapes.0.material": {"$material": 5}}, {"/a": {"$material": {}}}],
    "material": [
        5,
        "lambert",
        {"type": "lambert"},
        {"$material": {"type": 5}},
        {"$material": {"type": "lambert", "x": 1}},
    ],
    "until_error": ["x", -1, 0],
    "gradient": ["x", [5], ["shapes.0.nothing"]],
    "unknown": [1],
}


def test_facts_of_other_types_or_ranges_are_refused(scene: Path, tmp_path: Path) -> None:
    stopped_after(scene, 2, tmp_path / "c", spp=4)
    original = (tmp_path / "c").read_bytes()
    cases = [((name,), value) for name, values in WRONG_FACTS.items() for value in values]
    cases += [(("request", name), value) for name, values in WRONG_REQUEST.items() for value in values]
    cases += [(("request",), value) for value in (5, [], {}, None)]
    for (*outer, name), value in cases:
        (tmp_path / "c").write_bytes(original)

        def change(found: dict[str, Any], arrays: dict[str, Any]) -> None:
            (found["request"] if outer else found)[name] = value  # noqa: B023 - called at once

        rewritten(tmp_path / "c", change)
        with pytest.raises(go.GonioError) as caught:
            go.resume(tmp_path / "c")
        assert caught.value.code == 2, (name, value)


@pytest.mark.parametrize("kind", ["path", "xml"])
def test_sums_of_another_shape_or_type_are_refused(
    scene: Path, tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    if kind == "xml":
        monkeypatch.setattr(mitsuba_render, "WAVEFRONT", 24 * 16 * 2)  # passes of two samples
        scene = tmp_path / "ball.xml"
        scene.write_text(XML)
    stopped_after(scene, 2 if kind == "path" else 4, tmp_path / "c", spp=5)
    original = (tmp_path / "c").read_bytes()
    for name in kept.read(tmp_path / "c").arrays:
        for make in (
            lambda a: a[:0],
            lambda a: a[None],
            lambda a: a.astype(np.uint8),
            lambda a: np.concatenate([a, a], -1),
            lambda a: a.reshape(-1)[0],
            lambda a: np.full_like(a, -1 if a.dtype.kind == "i" else 5) if a.dtype.kind == "i" else a[:1],
        ):
            (tmp_path / "c").write_bytes(original)
            rewritten(tmp_path / "c", lambda _, arrays: arrays.update({name: np.asarray(make(arrays[name]))}))  # noqa: B023
            with pytest.raises(InputError, match=r"does not fit|channels"):
                go.resume(tmp_path / "c")
    (tmp_path / "c").write_bytes(original)
    rewritten(tmp_path / "c", lambda _, arrays: arrays.clear())
    with pytest.raises(InputError, match="does not fit"):
        go.resume(tmp_path / "c")


def test_a_picture_is_written_beside_the_checkpoint_or_where_it_is_told(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "far").mkdir()
    (tmp_path / "near").mkdir()
    (tmp_path / "current").mkdir()
    monkeypatch.chdir(tmp_path / "current")
    file = tmp_path / "near" / "c"
    stopped_after(scene, 2, file, spp=4, output=tmp_path / "far" / "a.exr")
    with pytest.warns(GonioWarning, match=rf"goes to {file.parent / 'a.exr'}: the checkpoint names .*far"):
        go.resume(file, spp=4)
    assert [path.name for path in tmp_path.rglob("*.exr")] == ["a.exr"] and (tmp_path / "near" / "a.exr").is_file()
    told, notice = checkpoints.asked_again(file, Request(Path(), output=tmp_path / "far" / "b.exr"), False, writes=True)
    assert told.output == tmp_path / "far" / "b.exr" and not notice
    stopped_after(scene, 2, tmp_path / "near" / "d", spp=4)
    told, notice = checkpoints.asked_again(tmp_path / "near" / "d", Request(Path()), False, writes=True)
    assert told.output == tmp_path / "near" / "ball.png" and "current" in notice
    assert checkpoints.asked_again(tmp_path / "near" / "d", Request(Path()), False)[0].output is None
    file.rename(file.with_name("a.exr"))
    with pytest.raises(InputError, match="the checkpoint has the picture's name"):
        checkpoints.asked_again(file.with_name("a.exr"), Request(Path()), False, writes=True)


# --- a checkpoint that nobody asked for ----------------------------------------------------------------


def test_a_long_render_has_a_checkpoint_beside_it_until_it_is_done(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    output, seen = tmp_path / "a.exr", []
    monkeypatch.setattr(checkpoints, "LONG_JOB", 0.0)

    def look(progress: passes.Progress) -> None:
        time.sleep(0.05)  # the file is written by a thread of its own
        seen.append(checkpoints.default_path(output).exists())

    render_to_file(Request(scene, output, spp=6), report=look)
    assert seen[-1]
    assert [entry.name for entry in tmp_path.iterdir() if entry.is_file()] == ["a.exr"]


def test_a_short_render_has_none(scene: Path, tmp_path: Path) -> None:
    result = render_to_file(Request(scene, tmp_path / "a.exr", spp=2**20, timeout=0.2))
    assert result.stopped == "timeout"
    monkey = render_to_file(Request(scene, tmp_path / "b.exr", spp=3))
    assert (monkey.stopped, monkey.checkpoint) == ("", None)
    assert not (tmp_path / "b.exr.checkpoint").exists()


def test_a_time_limit_leaves_what_goes_on_and_the_end_removes_it(scene: Path, tmp_path: Path) -> None:
    output = tmp_path / "a.exr"
    result = render_to_file(Request(scene, output, spp=2**29, timeout=0.2))
    assert result.checkpoint == tmp_path / "a.exr.checkpoint" and result.checkpoint.is_file()
    told: list[str] = []
    change = Request(Path(), spp=result.spp + 3)
    request, notice = checkpoints.asked_again(result.checkpoint, change, False)
    assert not notice
    again = render_to_file(request, tell=told.append)
    assert (again.spp, again.stopped, again.checkpoint) == (result.spp + 3, "", None)
    assert f"{result.spp} of {result.spp + 3}" in told[0]
    assert np.array_equal(images.read(output).pixels, go.render(scene, spp=again.spp))
    assert [entry.name for entry in tmp_path.iterdir() if entry.is_file()] == ["a.exr"]


def test_one_that_does_not_fit_is_told_and_not_used(scene: Path, tmp_path: Path) -> None:
    output, told = tmp_path / "a.exr", list[str]()
    render_to_file(Request(scene, output, spp=2**29, timeout=0.2))
    result = render_to_file(Request(scene, output, spp=3, seed=9), tell=told.append)
    assert result.spp == 3 and "is not used, and removed: settings" in told[0]
    assert np.array_equal(images.read(output).pixels, go.render(scene, spp=3, seed=9))


def test_a_full_disk_costs_the_checkpoint_and_not_the_picture(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> None:
        raise go.MachineError("the disk is full", "c")

    monkeypatch.setattr(kept, "write", full)
    result = render_to_file(Request(scene, tmp_path / "a.exr", spp=4, checkpoint=tmp_path / "c"))
    assert result.warnings == ("no checkpoint was written: the disk is full",)
    assert images.read(tmp_path / "a.exr").metadata["spp"] == 4


# --- Mitsuba's scenes ----------------------------------------------------------------------------------


@pytest.mark.parametrize("integrator", [None, "path"])
def test_a_mitsuba_scene_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, integrator: str | None) -> None:
    monkeypatch.setattr(mitsuba_render, "WAVEFRONT", 24 * 16 * 2)  # passes of two samples
    xml = tmp_path / "ball.xml"
    xml.write_text(XML)
    whole = go.render(xml, spp=8, integrator=integrator)
    stopped_after(xml, 4, tmp_path / "c", spp=8, integrator=integrator)
    with pytest.warns(GonioWarning, match="4 of 8"):
        picture = go.resume(tmp_path / "c")
    if integrator:
        assert np.array_equal(picture, whole)
    np.testing.assert_allclose(picture, whole, rtol=1e-5)  # Mitsuba's film adds up with atomics, in any order
    xml.write_text(XML.replace('value="0.2"', 'value="0.3"'))
    with pytest.raises(InputError, match="the scene has changed"):
        go.resume(tmp_path / "c")
