"""One function says what a word of the command line names: by names, suffixes and contents, and nothing is run."""

from __future__ import annotations

import json
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio.catalog import operands
from gonio.catalog.operands import MATERIALS, Kind, kind_of, readings
from gonio.errors import InputError
from gonio.pictures import images

ALL = frozenset(Kind)
LONG = "mix(a=" * 20 + "lambert" + ",b=conductor(preset=Au,alpha=.1))" * 20  # longer than a file's name may be


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a file of every kind, the current one."""
    monkeypatch.chdir(tmp_path)
    for folder in ("scene", "phong", "tables", "photographs", "empty", "sub"):
        (tmp_path / folder).mkdir()
    scene = {"output": {"filename": "a"}, "camera": {}, "scene": {"shapes": []}}
    for folder in ("scene", "phong"):
        (tmp_path / folder / "scene.json").write_text(json.dumps(scene))
    np.savez(tmp_path / "tables" / "tables.npz", manifest=np.array("{}"))
    np.savez(tmp_path / "networks.npz", **{"gold/w": np.zeros(3)})
    np.savez(tmp_path / "picture.npz", radiance=np.zeros((2, 2, 3)))
    (tmp_path / "photographs" / "calibration.json").write_text(json.dumps({"camera": {}, "lights": {}}))
    (tmp_path / "sub" / "mine.py").write_text("raise RuntimeError('nobody runs this')\n")
    (tmp_path / "fit.json").write_text(json.dumps({"fits": [{"notation": {"type": "gonio-lambert"}}]}))
    (tmp_path / "plastic.json").write_text(json.dumps({"type": "roughplastic"}))
    (tmp_path / "broken.json").write_text("{")
    (tmp_path / "notes.txt").write_text("none")
    images.write("a.exr", np.zeros((2, 2, 3), np.float32))
    return tmp_path


@pytest.mark.sample(8)
@pytest.mark.parametrize(
    ("word", "kind"),
    [
        ("conductor", Kind.NAME),
        ("conductor(alpha=.3)", Kind.NAME),
        ("alum-bronze:low2012/lowsmooth_E2", Kind.NAME),
        ('{"type": "conductor", "alpha": .3}', Kind.NAME),
        ('{"type": "roughplastic"}', Kind.PLUGIN),
        ("lamberd", Kind.NAME),
        (LONG, Kind.NAME),
        ("sub/mine.py:Ward", Kind.CODE),
        ("sub/mine.py:Ward(alpha=.3)", Kind.CODE),
        ("gold.binary", Kind.TABLE),
        ("networks.npz", Kind.TABLE),
        ("networks.npz:gold", Kind.TABLE),
        ("sample", Kind.TABLE),
        ("chest.gltf:Wood", Kind.DOCUMENT),
        ("fit.json", Kind.DOCUMENT),
        ("fit.json:1(albedo=.3)", Kind.DOCUMENT),
        ("plastic.json", Kind.PLUGIN),
        ("ggx", Kind.DISTRIBUTION),
        ("mitsuba:roughplastic", Kind.PLUGIN),
        ("scene", Kind.SCENE),
        ("scene/scene.json", Kind.SCENE),
        ("scene.xml", Kind.SCENE),
        ("nowhere/scene", Kind.SCENE),
        ("broken.json", Kind.SCENE),
        ("tables", Kind.TABLES),
        ("tables/tables.npz", Kind.TABLES),
        ("a.exr", Kind.PICTURE),
        ("b.png", Kind.PICTURE),
        ("picture.npz", Kind.PICTURE),
        ("photographs", Kind.CALIBRATION),
        ("photographs/calibration.json", Kind.CALIBRATION),
        ("empty", Kind.FOLDER),
        ("notes.txt", Kind.FILE),
    ],
)
def test_a_word_has_one_first_reading(here: Path, word: str, kind: Kind) -> None:
    assert readings(word)[0] is kind
    assert kind_of(word, ALL, "WORD") is kind


def test_what_is_there_goes_before_what_is_a_name_alone(here: Path) -> None:
    assert kind_of("phong", {Kind.SCENE, *MATERIALS}, "SCENE") is Kind.SCENE
    assert kind_of("phong", MATERIALS, "MODEL") is Kind.NAME
    assert kind_of("phong()", {Kind.SCENE, *MATERIALS}, "SCENE") is Kind.NAME
    assert kind_of("notes.txt", {Kind.SCENE, *MATERIALS}, "SCENE") is Kind.SCENE  # which its reader judges


@pytest.mark.parametrize(
    ("word", "accepted", "words"),
    [
        ("scene", MATERIALS, ["'scene' is a scene, a material expected", "render, study and view"]),
        ("a.exr", {Kind.SCENE, *MATERIALS}, ["'a.exr' is a picture, a material or a scene expected", "compare"]),
        ("tables", {Kind.SCENE}, ["baked tables, a scene expected", "info and plot"]),
        ("ggx(alpha=0.3)", MATERIALS, ["is a distribution of normals", "as a material: conductor(ndf=ggx)"]),
        ("ggx", {Kind.SCENE}, ["is a distribution of normals, a scene expected", "bake takes distributions"]),
        ("nowhere/a", MATERIALS, ["no file or folder 'nowhere/a'", "check the path"]),
        ("broken.json", MATERIALS, ["not valid JSON: ", "broken.json"]),
        ("sub/mine.py", MATERIALS, ["names a file, but no class in it", "sub/mine.py:CLASS"]),
        ("y" * 5000, MATERIALS, ["'yyy", "...' does not name a material, and no file can have that name"]),
        ("y" * 5000 + "/scene", {Kind.SCENE}, ["no file can have that name"]),
        ("a\0b", {Kind.SCENE}, ["no file can have that name"]),
        ("a" * 300 + ".exr", {Kind.SCENE}, ["no file can have that name"]),
    ],
)
def test_what_is_not_accepted_is_told_what_it_is(
    here: Path, word: str, accepted: frozenset[Kind], words: list[str]
) -> None:
    with pytest.raises(InputError) as caught:
        kind_of(word, accepted, "WORD")
    assert all(text in str(caught.value) for text in words)
    assert len(caught.value.what) < 300


def test_python_functions_decide_alike(here: Path) -> None:
    """`go.plot`, `go.render` and `go.bake` ask the same function."""
    with pytest.raises(InputError, match="is a scene, a material"):
        go.plot("scene")
    with pytest.raises(InputError, match="is a picture, a material or a scene"):
        go.render("a.exr")
    with pytest.raises(InputError, match="is a scene, a material"):
        go.bake("scene")


def test_what_is_a_material_may_be_explained(here: Path) -> None:
    assert operands.is_material("conductor") and operands.is_material("fit.json")
    assert not operands.is_material("ggx") and not operands.is_material("scene") and not operands.is_material("lamberd")


def test_a_folder_with_a_scene_is_one_without_a_search_for_other_kinds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "scene.json").touch()
    monkeypatch.setattr(operands, "readings", lambda text: pytest.fail(f"reads {text}"))
    assert kind_of(tmp_path, {Kind.SCENE, *MATERIALS}, "SCENE") is Kind.SCENE
