"""The page's data and its one file: what is in it, and that nothing outside is asked for."""

from __future__ import annotations

import base64
import json
import math
import re
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio import cli
from gonio.errors import InputError, MachineError
from gonio.material import models
from gonio.optics import indices
from gonio.viewer import lab_scene, page, stage

import browser

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="module")
def homework() -> dict[str, Any]:
    return page.page_data(stage.homework())


# --------------------------------------------------------------------------- the homework's scene


def test_the_homework_is_two_rows_of_five_balls(homework: dict[str, Any]) -> None:
    rows = homework["scene"]["rows"]
    models_of = {m["id"]: m["variants"][0]["manifest"]["model"] for m in homework["materials"]}
    assert [models_of[row["material"]] for row in rows] == ["kulla-conty", "conductor"]
    for row, path in zip(rows, ("base.alpha", "alpha"), strict=True):
        alpha = [ball["set"][path] for ball in row["balls"]]
        assert [a[0] for a in alpha] == pytest.approx([r * r for r in (0.15, 0.35, 0.55, 0.75, 0.95)])
        assert all(a[0] == a[1] for a in alpha)
    assert [light["type"] for light in homework["scene"]["lights"]] == ["directional"]
    assert math.hypot(*homework["scene"]["lights"][0]["direction"]) == pytest.approx(1.0, abs=1e-6)


def test_a_page_of_nothing_named_opens_on_gold_in_a_studio() -> None:
    opening = stage.opening()
    assert stage.of_models([]) == opening
    base = opening.materials["m1"].bsdf
    assert base.eta == go.Conductor.preset("Au").eta  # type: ignore[attr-defined]
    (light,) = opening.lights
    assert light["type"] == "environment" and light["image"]["data"] == "studio"  # type: ignore[index]
    text = (Path(__file__).parents[2] / "web/src/studio.ts").read_text()
    assert re.findall(r"(?:width|height): (\d+)", text)[:2] == [str(light["image"][key]) for key in ("width", "height")]  # type: ignore[index]


def test_both_maskings_are_there_for_the_toggle(homework: dict[str, Any]) -> None:
    for material in homework["materials"]:
        names = [next(iter(variant["choices"].values())) for variant in material["variants"]]
        assert names == ["smith-correlated", "schlick-direct"]
        texts = [variant["text"] for variant in material["variants"]]
        assert texts[0] != texts[1]


def test_presets_have_the_exact_linear_reflectance(homework: dict[str, Any]) -> None:
    presets = {p["name"]: p for p in homework["materials"][0]["presets"]}
    assert len(presets) == len(indices.METALS) + 1
    gold = presets["gold"]
    eta, k = (np.array(gold["set"][f"base.{name}"]) for name in ("eta", "k"))
    exact = ((eta - 1) ** 2 + k**2) / ((eta + 1) ** 2 + k**2)
    assert gold["f0"] == pytest.approx(exact, abs=1e-6)
    assert presets["F = 1"]["f0"] == [1.0, 1.0, 1.0]
    assert all(set(p["set"]) == {"base.eta", "base.k"} for p in presets.values())


def test_fields_and_sets_speak_of_declared_parameters(homework: dict[str, Any]) -> None:
    for material in homework["materials"]:
        for variant in material["variants"]:
            declared = {p["path"] for p in variant["manifest"]["parameters"]}
            assert {f["path"] for f in variant["manifest"]["fields"]} <= declared
            assert set(variant["choices"]) <= declared
            for preset in material["presets"]:
                assert set(preset["set"]) <= declared


def test_tables_come_whole(homework: dict[str, Any]) -> None:
    variant = homework["materials"][0]["variants"][0]
    assert variant["manifest"]["textures"]
    for texture in variant["manifest"]["textures"]:
        values = np.frombuffer(base64.b64decode(variant["tables"][texture["uniform"]]), "<f4")
        assert values.size == math.prod(texture["size"]) * texture["channels"]
        assert np.isfinite(values).all()


def test_the_split_sum_is_the_albedo_of_white_by_each_masking(homework: dict[str, Any]) -> None:
    """Each shader's own: a page that toggles masking showed one masking's table for both."""
    facets = {tuple(variant["facets"]) for material in homework["materials"] for variant in material["variants"]}
    assert facets == {("ggx", "smith-correlated"), ("ggx", "schlick-direct")}
    assert {tuple(table["facets"]) for table in homework["dfg"]} == facets
    for found in homework["dfg"]:
        width, height = found["size"]
        table = np.frombuffer(base64.b64decode(found["data"]), "<f4").reshape(height, width, 2)
        row, column = height // 2, width // 2
        roughness, mu = (row + 0.5) / height, (column + 0.5) / width
        white = go.Conductor(eta=0.0, k=1.0, alpha=roughness**2, masking=found["facets"][1])
        assert table[row, column].sum() == pytest.approx(float(go.albedo(white, mu).value.mean()), abs=1e-3)


# --------------------------------------------------------------------------- any models


@pytest.mark.sample(4)
@pytest.mark.parametrize("name", [name for name in models() if not models()[name].stochastic])
def test_every_model_makes_a_page(name: str) -> None:
    data = page.page_data(stage.of_targets([name]))
    json.dumps(data, allow_nan=False)
    assert data["materials"][0]["variants"][0]["manifest"]["model"] == name
    assert data["scene"]["rows"][0]["balls"]


def test_a_model_that_cannot_be_written_as_a_shader_says_so() -> None:
    with pytest.raises(InputError, match=r"random-walk|RandomWalk"):
        page.page_data(stage.of_targets(["random-walk"]))


def test_several_models_are_rows_and_given_parameters_are_fixed() -> None:
    what = stage.of_targets(["conductor", "lambert", "conductor(alpha=0.5)"], ["alpha=0.3"])
    assert [row.label for row in what.rows] == ["Conductor A", "Lambert", "Conductor C"]
    assert what.materials["m0"].bsdf.alpha == 0.3  # type: ignore[attr-defined]
    assert what.materials["m2"].bsdf.alpha == 0.5  # type: ignore[attr-defined]
    assert all("alpha" not in ball.values for row in (what.rows[0], what.rows[2]) for ball in row.balls)
    assert len(what.rows[1].balls) == 5  # over its albedo


def test_an_option_reaches_the_material_inside_too() -> None:
    """What one row has and the other silently has not would be compared as if nothing else differed."""
    what = stage.of_targets(["kulla-conty", "conductor"], ["masking=schlick-direct", "preset=Au"])
    inside, plain = what.materials["m0"].bsdf.base, what.materials["m1"].bsdf  # type: ignore[attr-defined]
    assert inside.masking == plain.masking == "schlick-direct"
    assert inside.eta == plain.eta == go.Conductor.preset("Au").eta
    assert what.notes == ()
    mixed = stage.of_targets(["mix(a=conductor,b=conductor)", "conductor"], ["masking=schlick-direct"]).materials["m0"]
    assert mixed.bsdf.a.masking == mixed.bsdf.b.masking == "schlick-direct"  # type: ignore[attr-defined]
    (path,) = stage.of_targets(["kulla-conty"], ["base.alpha=0.2"]).materials.values()
    assert path.bsdf.base.alpha == 0.2  # type: ignore[attr-defined]
    own = stage.of_targets(["kulla-conty(base=conductor(alpha=.4))"], ["alpha=.2"]).materials["m0"].bsdf
    assert own.base.alpha == 0.4  # type: ignore[attr-defined]


def test_an_option_that_does_not_reach_everything_says_so() -> None:
    what = stage.of_targets(["coat", "conductor"], ["masking=schlick-direct"])
    assert what.notes == ("masking is set on Coat itself; base.masking is unchanged",)
    what = stage.of_targets(["mix(a=conductor,b=conductor)", "conductor"], ["alpha=0.2"])
    assert what.notes[0].startswith("alpha is ambiguous for Mix, which has a.alpha and b.alpha: give one of them")
    with pytest.raises(InputError, match=r"alpha is ambiguous for Mix.*\n.*--param a\.alpha=0\.2"):
        stage.of_targets(["mix(a=conductor,b=conductor)"], ["alpha=0.2"])


def test_rows_run_over_the_same_also_where_it_is_inside() -> None:
    what = stage.of_targets(["kulla-conty(base=conductor(preset=Au))", "conductor(preset=Au)"])
    labels = [[ball.label for ball in row.balls] for row in what.rows]
    assert labels[0] == labels[1] and len(labels[0]) == 5
    fixed = stage.of_targets(['kulla-conty(base={"type": "conductor", "alpha": .2})']).rows[0]
    assert not any("base.alpha" in ball.values for ball in fixed.balls)
    labels = [
        [*ball.values.values()]
        for row in stage.of_targets(["opacity(base=lambert)", "lambert"]).rows
        for ball in row.balls
    ]
    assert labels[:5] == labels[5:]


def test_an_exported_page_has_a_shader_for_what_presets_choose() -> None:
    data = page.material_data("m0", stage.of_targets(["ashikhmin-shirley"]).materials["m0"])
    chosen = [{k: v for k, v in p["set"].items() if isinstance(v, str | bool)} for p in data["presets"]]
    assert {"fresnel": "exact"} in chosen
    assert all(any(v["choices"] == made for v in data["variants"]) for made in chosen if made)


@pytest.mark.slow
def test_other_values_than_tables_were_found_from_are_another_variant() -> None:
    """A coat over a base of another width has other tables: they were those of its default on every ball."""
    what = stage.of_targets(["coat"])
    variants = page.page_data(what)["materials"][0]["variants"][: len(what.rows[0].balls)]
    widths = [ball.values["base.alpha"][0] for ball in what.rows[0].balls]  # type: ignore[index]
    assert [v["fixed"]["base.alpha"] for v in variants] == widths
    assert len({v["key"] for v in variants}) == 5 and len({v["text"] for v in variants}) == 1
    declared = [p["value"] for v in variants for p in v["manifest"]["parameters"] if p["path"] == "base.alpha"]
    assert declared == [0.3] * 5
    with pytest.raises(InputError, match="no table depends on 'depth'"):
        page.variant_data(what.materials["m0"].bsdf, {}, (), {"depth": 2.0})


@pytest.mark.parametrize(
    ("targets", "parameters", "what"),
    [
        (["conducter"], [], "unknown material 'conducter'"),
        (["conductor"], ["beta=1"], "unknown parameter 'beta'"),
        (["conductor"], ["alpha=-1"], "-1 given"),
        (["conductor(alpha=x)"], [], "'x' given"),
        (["mitsuba:plastic"], [], "not a model of Gonio"),
    ],
)
def test_what_cannot_be_shown_is_one_clear_error(targets: list[str], parameters: list[str], what: str) -> None:
    with pytest.raises(InputError, match=re.escape(what)):
        stage.of_targets(targets, parameters)


# --------------------------------------------------------------------------- scenes


def write_scene(folder: Path, lights: list[Any], shapes: list[Any]) -> Path:
    camera = {"type": "pinhole", "transform": {"position": [0, 0, 5], "lookAt": [0, 0, 0], "up": [0, 1, 0]},
              "verticalFov": 40, "film": {"size": [8, 8]}}  # fmt: skip
    text = {"sampler": {"type": "independent", "samples": 1}, "camera": camera, "output": {"filename": "a.png"},
            "integrator": {"type": "direct"}, "scene": {"shapes": shapes, "lights": lights}}  # fmt: skip
    path = folder / "two.json"
    path.write_text(json.dumps(text))
    return path


def ball(**material: Any) -> dict[str, Any]:
    return {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": material}


def test_a_scene_shows_its_materials_under_its_light(tmp_path: Path) -> None:
    lamp = {"type": "spotLight", "position": [0, 2, 0], "energy": [8, 4, 0]}
    shapes = [
        ball(type="gonio-conductor", preset="Au", alpha=0.2),
        ball(type="gonio-conductor", preset="Cu", alpha=0.4),
        ball(type="matte", albedo=[0.1, 0.2, 0.3]),
        ball(type="matte", albedo=[0.1, 0.2, 0.3]),
    ]
    what = lab_scene.stage(write_scene(tmp_path, [lamp], shapes))
    assert [(row.label, len(row.balls)) for row in what.rows] == [("Conductor", 2), ("Lambert", 1)]
    copper = what.rows[0].balls[1].values
    assert copper["alpha"] == 0.4 and copper["eta"] == list(indices.METALS["Cu"].eta)
    assert what.materials["m1"].bsdf.albedo == pytest.approx((0.1, 0.2, 0.3))  # type: ignore[attr-defined]
    (light,) = what.lights
    assert light["direction"] == pytest.approx([0, 1, 0]) and light["irradiance"] == pytest.approx([2, 1, 0])


def test_balls_share_a_shader_unless_their_formulas_differ(tmp_path: Path) -> None:
    lamp = {"type": "spotLight", "position": [0, 2, 0], "energy": [8, 4, 0]}
    gold = {"type": "gonio-conductor", "preset": "Au"}
    others = [{"alpha": 0.3}, {"alpha": [0.1, 0.4]}, {"alpha": [0.1, 0.4], "rotation": 0.5}, {"ndf": "beckmann"}]
    what = lab_scene.stage(
        write_scene(tmp_path, [lamp], [ball(**gold, alpha=0.2), *(ball(**gold, **o) for o in others)])
    )
    assert [len(row.balls) for row in what.rows] == [2, 1, 1, 1] and len(what.materials) == 4


def test_a_scene_is_turned_so_that_its_camera_looks_along_minus_z(tmp_path: Path) -> None:
    lamp = {"type": "spotLight", "position": [4, 0, 0], "energy": [16, 16, 16]}
    sky = {"type": "environmentLight", "radiance": [1, 1, 1]}
    path = write_scene(tmp_path, [lamp, sky], [ball(type="matte", albedo=0.5)])
    path.write_text(path.read_text().replace('"position": [0, 0, 5]', '"position": [3, 3, 0]'))
    what = lab_scene.stage(path)
    assert what.lights[0]["direction"] == pytest.approx([0, 0, 1], abs=1e-12)  # the lamp is behind the camera
    assert what.lights[1]["rotation"] == pytest.approx(-math.pi / 2)
    assert what.framed()["elevation"] == pytest.approx(math.pi / 4, abs=1e-4)


def test_parallel_light_stays_as_it_is(tmp_path: Path) -> None:
    sun = {"type": "directionalLight", "direction": [0, -3, 0], "energy": [2, 1, 0]}
    (light,) = lab_scene.stage(write_scene(tmp_path, [sun], [ball(type="matte", albedo=0.5)])).lights
    assert light["direction"] == pytest.approx([0, 1, 0]) and light["irradiance"] == pytest.approx([2, 1, 0])


def test_a_lamp_around_everything_is_an_environment(tmp_path: Path) -> None:
    sphere = {"type": "sphere", "center": [0, 0, 0], "radius": 9}
    lights = [{"type": "areaLight", "energy": [0.5, 0.6, 0.7], "shape": sphere},
              {"type": "environmentLight", "radiance": [3, 3, 3]}]  # fmt: skip
    what = lab_scene.stage(write_scene(tmp_path, lights, [ball(type="matte", albedo=0.5)]))
    (light,) = what.lights
    assert light["type"] == "environment" and light["constant"] == [0.5, 0.6, 0.7]


def test_a_scene_without_light_gets_the_pages_and_a_note(tmp_path: Path) -> None:
    what = lab_scene.stage(write_scene(tmp_path, [], [ball(type="matte", albedo=0.5)]))
    assert [light["type"] for light in what.lights] == ["directional"]
    assert any("no light" in note for note in what.notes)


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", ["shading-balls", "conductor-ggx", "textured", "white-furnace", "rough-dielectric"])
def test_the_examples_can_be_viewed(name: str) -> None:
    data = page.page_data(lab_scene.stage(EXAMPLES / name))
    assert data["materials"] and data["scene"]["lights"]
    assert name != "textured" or any("texture" in note for note in data["notes"])


def test_a_scene_may_not_reach_outside_its_folder(tmp_path: Path) -> None:
    (tmp_path / "inner").mkdir()
    (tmp_path / "secret.hdr").write_bytes(b"#?RADIANCE\n\n-Y 1 +X 1\n\x80\x80\x80\x80")
    sky = {"type": "environmentLight", "texture": {"type": "imageTex", "file": "../secret.hdr"}}
    path = write_scene(tmp_path / "inner", [sky], [ball(type="matte", albedo=0.5)])
    with pytest.raises(InputError, match="outside"):
        lab_scene.stage(path)


# --------------------------------------------------------------------------- the file


def test_text_of_the_data_cannot_end_its_element(monkeypatch: pytest.MonkeyPatch) -> None:
    data = {"title": "</script><script>alert(1)</script><!--", "mode": "export", "materials": []}
    monkeypatch.setattr(page, "_script", lambda: "")
    monkeypatch.setattr(page, "_style", lambda: "")
    html = page.html(data)
    inside = re.search(r'id="gonio-data">(.*?)</script>', html, re.S)
    assert inside and json.loads(inside[1])["title"] == data["title"]
    assert "<script>alert" not in html and "&lt;/script&gt;" in html


def test_the_export_holds_everything_in_one_and_a_half_megabytes(tmp_path: Path) -> None:
    path = page.export(stage.homework(), tmp_path / "page.html")
    assert list(tmp_path.iterdir()) == [path]
    assert path.stat().st_size <= 1.5e6
    text = path.read_text(encoding="utf-8")
    assert "default-src 'none'" in text
    head = re.sub(r"<script[^>]*>.*?</script>|<style>.*?</style>", "", text, flags=re.S)
    assert not re.search(r"https?:|//|\b(src|href)\s*=", head)
    assert "@import" not in page._style() and not re.search(r"url\((?!['\"]?data:)", page._style())


def test_nothing_is_written_where_it_cannot_be(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for wrong in ("page.pdf", "no/such/page.html"):
        with pytest.raises(SystemExit) as ended:
            cli.main(["view", "lambert", "--output", str(tmp_path / wrong)])
        assert ended.value.code == 2
    assert "end" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_missing_bundle_is_a_clear_error(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(page, "STATIC", tmp_path)
    page._script.cache_clear()
    try:
        with pytest.raises(MachineError, match=r"app\.js is missing"):
            page.html({"title": "x"})
    finally:
        page._script.cache_clear()


@pytest.mark.slow
def test_the_export_opens_from_disk_and_asks_for_nothing(tmp_path: Path) -> None:
    path = page.export(stage.homework(), tmp_path / "page.html")
    with browser.chromium() as chromium:
        opened = chromium.new_page(viewport={"width": 1280, "height": 720})
        requests: list[str] = []
        problems: list[str] = []
        opened.on("request", lambda request: requests.append(request.url))
        opened.on("console", lambda m: problems.append(m.text) if m.type == "error" else None)
        opened.on("pageerror", lambda error: problems.append(str(error)))
        opened.goto(path.as_uri())
        opened.wait_for_selector("canvas", timeout=30_000)
        opened.wait_for_function("window.gonio.frames > 2")  # which a program may ask in the way it is used to
        picture = opened.screenshot()
    outside = [url for url in requests if not url.startswith(("file:", "blob:", "data:"))]
    assert outside == [] and problems == []
    assert len(picture) > 20_000  # a page that shows nothing is a few kilobytes


@pytest.mark.slow
def test_the_homework_by_its_text_has_its_terms_and_says_why_it_has_a_rim() -> None:
    what = stage.homework_text()
    base = what.materials["m1"].bsdf
    assert (base.masking, base.fresnel, base.ndf) == ("schlick-direct", "schlick", "ggx")  # type: ignore[attr-defined]
    assert what.materials["m0"].bsdf.color == "sheet"  # type: ignore[attr-defined]
    assert [light["type"] for light in what.lights] == ["directional"]
    assert what.rows[0].balls[0].label == "roughness 0.95"  # to the left
    assert "false rim" in page.page_data(what)["notes"][0]


def test_the_homework_takes_no_material(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["view", "lambert", "--homework"]) == 2
    assert "--homework given with lambert" in capsys.readouterr().err
