"""What a fit, a capture or a compression wrote, and Gonio's notation in a file, stands wherever a material can."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio import cli
from gonio.catalog import documents, notation
from gonio.errors import InputError
from gonio.fitting import batch
from gonio.verify import targets

OWN = """
import gonio as go
from gonio.ops import inv_pi, where


class Own(go.BSDF):
    albedo: go.Colour = go.spectrum(0.5, "share", high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.albedo * where((wo.z > 0.0) & (wi.z > 0.0), wi.z * inv_pi, 0.0)
"""


@pytest.fixture(scope="module")
def compressed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The sample that comes with Gonio, compressed."""
    path = tmp_path_factory.mktemp("compressed") / "sample.gonio"
    go.compress("sample", path)
    return path


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """gold.json: two models fitted to the sample that comes with Gonio, as `gonio fit -o` writes it."""
    path = tmp_path_factory.mktemp("fit") / "gold.json"
    batch.write(path, batch.run(["sample"], ["lambert", "lambert+ggx"]))
    return path


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    "command",
    [
        "render {} --spp 1 --size 8x8 -o a.exr",
        "study {} --vary a.albedo=.1,.3 --spp 1 --size 8x8 -o a.png",
        "plot {} -o a.png",
        "emit {}",
        "bake {} --resolution 4 --lut E -o tables",
        "measure {} --theta-i 0,40 -o a.gonio",
        "compare {} lambert",
        "explain {}",
        "info {}",
        "convert {} -o again.json",
        "fit sample --model {} -o refined.json",
        pytest.param("verify {} --quick --law linearity", marks=pytest.mark.slow),
        pytest.param("view {} -o a.html", marks=pytest.mark.slow),
    ],
)
def test_every_verb_takes_the_result_of_a_fit(
    fitted: Path, command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert cli.run(command.format(fitted).split()) == 0, capsys.readouterr().err


def test_the_verifier_names_it_by_its_file(fitted: Path) -> None:
    subject = targets.resolve(str(fitted), ["b.alpha=.3"])[0]
    assert subject.model.b.alpha == 0.3 and subject.target == str(fitted)
    assert targets.resolve(subject.command().split()[2], ["b.alpha=.3"])[0].model == subject.model


def test_the_best_fit_is_meant_and_others_have_numbers(fitted: Path) -> None:
    found = json.loads(fitted.read_text())["fits"]
    for text, fit in ((f"{fitted}", found[0]), (f"{fitted}:1", found[0]), (f"{fitted}:2", found[1])):
        material = go.material(text)
        parameters = {name: value["value"] for name, value in fit["parameters"].items()}
        for path, value in parameters.items():  # to the last digit, not as the text rounds it
            name, _, channel = path.rpartition(".")
            held = notation.tree.value_at(material, name if channel in "rgb" else path)
            assert (held["rgb".index(channel)] if channel in "rgb" else held) == value
    with pytest.raises(InputError, match="no material '3' in this file"):
        go.material(f"{fitted}:3")


def test_a_parameter_may_be_set_beside_it(fitted: Path) -> None:
    assert notation.named(f"{fitted}(a.albedo=.25)")[0].a.albedo == 0.25  # type: ignore[attr-defined]


def entry(material: go.BSDF) -> dict[str, Any]:
    return {"material": notation.written(material), "notation": notation.for_files(material)}


GOLD = go.Conductor.preset("Au", alpha=0.2)


@pytest.mark.parametrize(
    ("content", "item", "expected"),
    [
        ({"type": "gonio-conductor", "alpha": 0.2, "eta": 0.0, "k": 1.0}, "", go.Conductor(alpha=0.2)),
        ({"type": "conductor", "preset": "Au", "alpha": 0.2}, "", GOLD),
        ({"file": "a", "fits": [entry(GOLD), entry(go.Lambert())]}, "", GOLD),
        ([{"file": "x/a.binary", "fits": [entry(GOLD)]}, {"file": "b.binary", "failed": "no"}], ":a.binary", GOLD),
        ({"fit": entry(GOLD), "pixels": {}}, "", GOLD),
        (
            {"materials": {"shapes.0.material": ""}, "notations": {"shapes.0.material": entry(GOLD)["notation"]}},
            "",
            GOLD,
        ),
        ({"path": "sample.gonio", "kind": "log"}, "", None),
        ([{"path": "x.gonio:a", "kind": "log"}, {"path": "sample.gonio", "kind": "log"}], ":sample.gonio", None),
    ],
)
def test_every_result_is_read(
    tmp_path: Path, compressed: Path, content: Any, item: str, expected: go.BSDF | None
) -> None:
    (tmp_path / "found.json").write_text(json.dumps(content))
    if expected is None:  # measured values, in a file beside it
        shutil.copyfile(compressed, tmp_path / "sample.gonio")
        expected = go.Measured(str(tmp_path / "sample.gonio"))
    assert go.material(f"{tmp_path / 'found.json'}{item}") == expected


@pytest.mark.parametrize(
    ("content", "text", "words"),
    [
        ("{", "", "is not a material"),
        ('{"scene": {}, "camera": {}}', "", "is not a material"),
        ("[1, 2]", "", "is not a material"),
        ('{"type": "conductr"}', "", "unknown material 'conductr'"),
        ('{"type": "conductor", "alhpa": 1}', "", "no parameter 'alhpa'"),
        ('{"fits": [{"material": "lambert(albedo=0.5)"}]}', "", "name the material itself: 'lambert(albedo=0.5)'"),
        ('{"type": "mix", "a": {"type": "json", "file": "found.json"}}', "", "which is in another file"),
        ('{"type": "mix", "a": {"type": "gonio-json", "file": "found.json"}}', "", "which is in another file"),
        ('{"type": "two-sided", "base": ' * 70 + '{"type": "lambert"}' + "}" * 70, "", "more than 64 nested materials"),
        ('{"fits": [{"notation": 3}]}', "", 'an object with a "type"'),
        ('[{"file": "a", "fits": [{"notation": {"type": "lambert"}}]}, {"file": "b", "fits": [{}]}]', "", "name one"),
        ('{"type": "own.py:Own", "albedo": 0.5}', "", "code that a data file may not run"),
        ('{"type": "conductor", "ndf": "own.py:Own"}', "", "code that a data file may not run"),
    ],
)
def test_what_is_no_material_is_one_clear_error(tmp_path: Path, content: str, text: str, words: str) -> None:
    (tmp_path / "own.py").write_text("raise SystemExit('it was run')")
    (tmp_path / "found.json").write_text(content)
    with pytest.raises(InputError) as caught:
        notation.named(f"{tmp_path / 'found.json'}{text}")
    assert words in str(caught.value)


@pytest.mark.slow
def test_code_that_it_names_runs_where_that_is_allowed(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(OWN)
    (tmp_path / "found.json").write_text('{"type": "own.py:Own", "albedo": 0.25}')
    with pytest.raises(InputError) as caught:
        go.render(tmp_path / "found.json", spp=1, size=(4, 4))
    text = caught.value.hint.split("'")[1]  # to be pasted
    assert notation.named(text)[0].albedo == 0.25  # type: ignore[attr-defined]
    go.render(tmp_path / "found.json", spp=1, size=(4, 4), allow_code=True)


def scene(folder: Path, material: dict[str, Any]) -> Path:
    content = {
        "output": {"filename": "a.exr"},
        "sampler": {"type": "independent", "samples": 4},
        "camera": {
            "type": "pinhole",
            "transform": {"position": [0, 0, 4], "lookAt": [0, 0, 0], "up": [0, 1, 0]},
            "verticalFov": 40,
            "film": {"size": [8, 8]},
        },
        "integrator": {"type": "directSampleLight"},
        "scene": {
            "shapes": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": material}],
            "lights": [{"type": "spotLight", "position": [2, 3, 4], "energy": [40, 40, 40]}],
        },
    }
    (folder / "scene.json").write_text(json.dumps(content))
    return folder / "scene.json"


def test_a_scene_takes_it_with_its_own_defaults(tmp_path: Path, fitted: Path) -> None:
    """The lab's `conductor` has other defaults than Gonio's: a result means Gonio's."""
    material = go.Conductor.preset("Au", alpha=0.2)
    (tmp_path / "gold.json").write_text(json.dumps({"fits": [entry(material)]}))
    picture = go.render(scene(tmp_path, {"type": "json", "file": "gold.json"}), seed=1)
    again = go.render(scene(tmp_path, {"type": "matte"}), seed=1, overrides={"shapes.0.material": material})
    assert np.array_equal(picture, again)
    (tmp_path / "best.json").write_bytes(fitted.read_bytes())
    assert go.render(scene(tmp_path, {"type": "json", "file": "best.json", "material": "2"}), seed=1).max() > 0.0
    # and what stands in the file may be pasted into a scene
    pasted = json.loads((tmp_path / "gold.json").read_text())["fits"][0]["notation"]
    assert np.array_equal(picture, go.render(scene(tmp_path, pasted), seed=1))


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ({"type": "/elsewhere/own.py:Own"}, "is code, which a scene alone does not run"),
        ({"type": "mix", "a": {"type": "own.py:Own"}, "b": {"type": "lambert"}}, "is code"),
        ({"type": "measured", "file": "../secret.binary"}, "outside the scene's folder"),
        ({"type": "measured", "file": "/etc/secret.binary"}, "outside the scene's folder"),
        ({"type": "mix", "a": {"type": "json", "file": "found.json"}}, "in another file"),
        ({"scene": {}}, "it contains no material"),
    ],
)
def test_nothing_gets_in_through_it(tmp_path: Path, content: dict[str, Any], says: str) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "secret.binary").write_bytes(b"x" * 20)
    (tmp_path / "in" / "own.py").write_text("raise SystemExit('it was run')")
    (tmp_path / "in" / "found.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match=says):
        go.render(scene(tmp_path / "in", {"type": "json", "file": "found.json"}))


def test_types_are_the_labs_or_gonios() -> None:
    plain = {"type": "mix", "a": {"type": "conductor"}, "b": {"type": "own.py:Own"}, "weight": 0.5}
    whole = documents.for_scenes(plain)
    assert whole["type"] == "gonio-mix" and whole["a"] == {"type": "gonio-conductor"}
    assert whole["b"] == {"type": "own.py:Own"} and documents.from_scenes(whole) == plain


def test_a_material_given_as_text_is_written_as_json(tmp_path: Path) -> None:
    text = "kulla-conty(base=conductor(preset=Au,alpha=0.3))"
    go.convert(text, tmp_path / "gold.json")
    assert go.material(tmp_path / "gold.json") == go.material(text)
    with pytest.raises(go.InputError, match=r"'\.gltf' is not a material format"):
        go.convert(text, tmp_path / "gold.gltf")
    assert not (tmp_path / "gold.gltf").exists()


def test_a_class_in_a_file_is_written_by_its_name(tmp_path: Path) -> None:
    (tmp_path / "matte.py").write_text("import gonio as go\nclass Matte(go.Lambert):\n    pass\n")
    go.convert(f"{tmp_path}/matte.py:Matte(albedo=0.25)", tmp_path / "matte.json")
    assert json.loads((tmp_path / "matte.json").read_text()) == {
        "type": f"{tmp_path}/matte.py:Matte",
        "albedo": 0.25,
    }
