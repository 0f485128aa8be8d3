"""`gonio check`: each kind of work, submissions by a sheet, and work that cannot be read."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from xml.etree import ElementTree as xml

import gonio as go
import numpy as np
import pytest
from gonio import cli
from gonio.check import reference, tables
from gonio.pictures import images

from . import solutions as of
from .solutions import Average, Conductor, OrenNayar, Table

ROOT = Path(__file__).parents[2]


def _picture(path: Path, values: np.ndarray) -> Path:
    path.write_bytes(images.png_bytes(np.repeat(values[..., None], 3, axis=2)))
    return path


def _rows(path: Path, f: np.ndarray, up: str = "z", comment: str = "") -> Path:
    turned = [w[:, [1, 2, 0]] if up == "y" else w for w in (of.WO, of.WI)]
    np.savetxt(path, np.column_stack([*turned, f]), fmt="%.6g", delimiter=",", header=comment)
    return path


def _error(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    """The one line of an input error, whose exit code is 2."""
    assert cli.run(["check", *words]) == 2
    text = capsys.readouterr().err
    assert "Traceback" not in text and "Gonio failed" not in text
    return text


# --------------------------------------------------------------------------- forms


def test_rows_with_y_up_are_judged_with_that_option(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = _rows(tmp_path / "f.csv", OrenNayar()(of.WO, of.WI), up="y")
    words = ["check", str(path), "oren-nayar", "-p", "sigma=0.3"]
    assert cli.run([*words, "--up", "y"]) == 0
    assert "200 rows agree" in capsys.readouterr().out
    assert cli.run(words) == 1
    assert "give --up y" in capsys.readouterr().out


def test_one_column_of_f_and_angles_in_degrees_are_read(tmp_path: Path) -> None:
    f = OrenNayar()(of.WO, of.WI)[:, :1]
    angles = [np.degrees(one) for w in (of.WO, of.WI) for one in of.angles(w)]
    path = tmp_path / "f.txt"
    np.savetxt(path, np.column_stack([*angles, f]), fmt="%.9g")
    assert go.check(path, go.OrenNayar(sigma=0.3)).passed


def test_a_class_is_judged_with_the_parameters_that_it_has(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = "import gonio as go\n\nclass Mine(go.Conductor):\n    'A metal.'\n    overridable = True\n"
    source += "    def reflectance(self, cos_theta):\n        return self.albedo * 1.0\n"
    (tmp_path / "mine.py").write_text(source)
    words = ["check", f"{tmp_path}/mine.py:Mine", "conductor", "--preset", "Au", "-p", "alpha=0.3"]
    assert cli.run([*words, "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["cause"] == "F is missing"


def test_the_solution_is_hidden_on_request(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = _rows(tmp_path / "f.csv", OrenNayar(change="min and max")(of.WO, of.WI))
    assert cli.run(["check", str(path), "oren-nayar", "-p", "sigma=0.3", "--hide-solution"]) == 1
    text = capsys.readouterr().out
    assert "look at alpha and beta" in text and "sin" not in text and "expected" not in text


def test_another_masking_term_than_the_one_asked_for_is_named(tmp_path: Path) -> None:
    path = _picture(tmp_path / "E.png", Table(k="text").picture())
    assert go.check(path).passed
    assert "k = alpha / 2, as the homework's figures is asked for" in go.check(path, "schlick-ibl").cause


@pytest.mark.shared
def test_the_pictures_of_the_homework_are_recognized(shared: Path) -> None:
    folder = shared / "reference/kulla-conty"
    sampled = go.check(folder / "homework_E_importance_sampled.png")
    assert sampled.passed and "k = alpha / 2" in sampled.facts[0] and sampled.figures["all"] < 1.5
    noisy = go.check(folder / "homework_E_cosine_sampled.png")
    assert noisy.passed and noisy.figures["floor"] == 1e-4 and noisy.figures["wrap"] == 1.0
    assert go.check(folder / "homework_Eavg.png").passed


def test_noise_that_is_alike_everywhere_is_not_taken_for_cosine_sampling(tmp_path: Path) -> None:
    values = Table(size=64, k="text").picture() + np.random.default_rng(1).normal(0.0, 5.0, (64, 64))
    finding = go.check(_picture(tmp_path / "E.png", np.clip(values, 0, 255).astype(np.uint8)))
    assert finding.passed and "noise of random directions" in finding.facts[-1]
    assert not any("cosine" in fact for fact in finding.facts)


def test_a_table_that_no_form_explains_is_wrong_without_a_cause(tmp_path: Path) -> None:
    values = Table().picture().astype(float)
    ramp = 25.0 * np.sin(np.arange(len(values)) / 3.0)[:, None]
    finding = go.check(_picture(tmp_path / "E.png", np.clip(values + ramp, 0, 255).astype(np.uint8)))
    assert finding.status == "wrong" and not finding.cause


# --------------------------------------------------------------------------- pictures


def _ball(x: float, material: dict[str, object]) -> dict[str, object]:
    return {"type": "sphere", "center": [x, 0.2 * x, 0], "radius": 0.7, "material": material}


METAL = {"type": "gonio-phong", "kd": [0.2, 0.1, 0.06]}
SCENE = {
    "output": {"filename": "ball.png"},
    "sampler": {"type": "independent", "samples": 16},
    "camera": {
        "type": "pinhole",
        "transform": {"position": [0, 0, 4], "lookAt": [0, 0, 0], "up": [0, 1, 0]},
        "verticalFov": 45,
        "film": {"size": [96, 64]},
    },
    "integrator": {"type": "directSampleLight"},
    "scene": {
        "shapes": [_ball(-1, {"type": "matte", "albedo": [0.8, 0.3, 0.2]}), _ball(1, METAL)],
        "lights": [{"type": "directionalLight", "direction": [-1, -1, -4], "energy": 3}],
    },
}  # fmt: skip


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("ball")
    (folder / "scene.json").write_text(json.dumps(SCENE))
    return folder


@pytest.mark.parametrize("change", ["none", "a row", "exposure", "linear"])
def test_a_right_picture_passes_moved_exposed_or_without_gamma(scene: Path, tmp_path: Path, change: str) -> None:
    picture = go.render(scene, spp=8, seed=7)
    picture = np.roll(picture, 1, axis=0) if change == "a row" else picture
    picture = 0.5 * picture if change == "exposure" else picture
    if change == "linear":
        (tmp_path / "a.png").write_bytes(images.png_bytes((np.clip(picture, 0, 1) * 255).astype(np.uint8)))
    else:
        images.write(tmp_path / "a.png", picture)
    finding = go.check(tmp_path / "a.png", scene=scene)
    assert finding.passed, finding.lines()
    said = {"a row": "1 rows", "exposure": "1 / 2 times as bright", "linear": "linear", "none": ""}[change]
    assert said in " ".join(finding.facts)


def test_a_wrong_object_and_a_picture_upside_down_are_named(scene: Path, tmp_path: Path) -> None:
    images.write(
        tmp_path / "a.exr", go.render(scene, spp=8, seed=7, overrides={"shapes.0.material.albedo": [0.4, 0.15, 0.1]})
    )
    wrong = go.check(tmp_path / "a.exr", scene=scene)
    assert wrong.status == "wrong" and "object 0 (matte) is 1 / 2 times" in wrong.cause, wrong.lines()
    images.write(tmp_path / "b.exr", go.render(scene, spp=8, seed=7)[::-1])
    assert "upside down" in go.check(tmp_path / "b.exr", scene=scene).cause


# --------------------------------------------------------------------------- submissions


def test_a_class_of_folders_becomes_a_table_with_marks(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for student, change in (("ann", ""), ("bob", "cosine twice")):
        folder = tmp_path / "class" / student
        folder.mkdir(parents=True)
        own = Table(change=change)
        _picture(folder / "GGX_E_LUT.png", own.picture())
        _picture(folder / "E_avg.png", Average(table=own).picture())
        (folder / "readme.md").write_text("done")
    junit = tmp_path / "out.xml"
    words = ["check", str(tmp_path / "class"), "--sheet", "hw4", "--junit", str(junit), "--json"]
    assert cli.run(words) == 1
    ann, bob = json.loads(capsys.readouterr().out)["submissions"]
    assert ann["suggested"] == 20.0 and ann["not judged"] == ["readme.md"]
    marks = {task["task"]: task["suggested"] for task in bob["tasks"]}
    assert marks["E(mu)"] == 2.5 and marks["bonus 1: importance sampling"] == 5.0
    assert marks["E_avg"] == 5.0  # right for the wrong E that it was computed from
    suites = xml.parse(junit).getroot().findall("testsuite")
    assert [suite.get("name") for suite in suites] == ["ann", "bob"] and suites[1].get("failures") == "2"


def test_rows_in_a_folder_name_their_own_material(tmp_path: Path) -> None:
    wide = OrenNayar(sigma=0.5)(of.WO, of.WI)
    _rows(tmp_path / "oren-nayar.csv", wide, "y", "model: oren-nayar(sigma=0.5)\nup: y")
    _rows(tmp_path / "conductor-ggx.csv", Conductor(change="no G")(of.WO, of.WI))
    report = go.check(tmp_path, sheet="lab2")
    status = {mark.task: mark.finding.status for one in report.submissions for mark in one.marks}
    assert status["Oren-Nayar"] == "right" and status["conductor, GGX"] == "wrong"
    assert status["Phong"] == "not handed in" and status["report"] == "not handed in"


def test_rows_in_a_folder_run_no_code(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text("raise SystemExit('it ran')")
    _rows(tmp_path / "oren-nayar.csv", OrenNayar()(of.WO, of.WI), comment="model: own.py:Mine")
    report = go.check(tmp_path, sheet="lab2")
    finding = next(mark.finding for mark in report.submissions[0].marks if mark.task == "Oren-Nayar")
    assert finding.status == "input error" and "is not run" in finding.facts[0]


def test_work_that_cannot_be_read_leaves_the_others_judged(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    _picture(tmp_path / "E.png", Table().picture())
    (tmp_path / "E_avg.jpg").write_bytes(b"no table")
    (tmp_path / "GGX_E_LUT.png").write_bytes(b"no picture")
    assert cli.run(["check", str(tmp_path), "--sheet", "hw4"]) == 2
    lines = capsys.readouterr().out.splitlines()
    assert any("E.png" in line and " right" in line for line in lines)
    assert sum("input error" in line for line in lines) == 2


# --------------------------------------------------------------------------- bad input


def test_bad_tables_are_refused_with_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    right = Table().picture()
    _picture(tmp_path / "wide.png", right[:20])
    assert "32 x 20 pixels, a square table" in _error(capsys, str(tmp_path / "wide.png"))
    deep = np.repeat((right.astype(np.uint16) * 257)[..., None], 3, axis=2)
    (tmp_path / "deep.png").write_bytes(images.png_bytes(deep))
    assert "16-bit" in _error(capsys, str(tmp_path / "deep.png"))
    encoded = images.to_screen(np.repeat(right[..., None] / 255.0, 3, axis=2))
    (tmp_path / "gamma.png").write_bytes(images.png_bytes(encoded))
    assert "encoded as sRGB" in _error(capsys, str(tmp_path / "gamma.png"))
    noise = np.random.default_rng(1).integers(0, 255, (32, 32)).astype(np.uint8)
    assert "something else" in _error(capsys, str(_picture(tmp_path / "noise.png", noise)))
    np.savez(tmp_path / "nan.npz", np.where(np.eye(32) > 0, np.nan, 0.5 + 0.0 * right))
    assert "32 values are NaN" in _error(capsys, str(tmp_path / "nan.npz"))


def test_bad_rows_and_targets_are_refused_with_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    f = OrenNayar()(of.WO, of.WI)
    f[3, 0] = np.nan
    assert "finite number" in _error(capsys, str(_rows(tmp_path / "nan.csv", f)), "oren-nayar")
    long = _rows(tmp_path / "long.csv", OrenNayar()(of.WO, of.WI))
    long.write_text(long.read_text().replace(long.read_text().splitlines()[1].split(",")[0], "7", 1))
    assert "a unit vector expected" in _error(capsys, str(long), "oren-nayar")
    assert "no model to compare with" in _error(capsys, str(long))
    assert "a PDF" in _error(capsys, str(tmp_path / "report.pdf"))
    assert "no file" in _error(capsys, str(tmp_path / "E.png"))
    (tmp_path / "empty").mkdir()
    assert "the folder is empty" in _error(capsys, str(tmp_path / "empty"), "--sheet", "hw4")
    assert "name its sheet" in _error(capsys, str(tmp_path / "empty"))


def test_a_picture_of_something_else_or_of_another_shape_is_refused(scene: Path, tmp_path: Path) -> None:
    noise = np.random.default_rng(1).random((64, 96, 3)).astype(np.float32)
    images.write(tmp_path / "noise.exr", noise)
    with pytest.raises(go.InputError, match="something else"):
        go.check(tmp_path / "noise.exr", scene=scene)
    images.write(tmp_path / "square.exr", noise[:, :64])
    with pytest.raises(go.InputError, match="64 x 64 pixels, but the scene's film has 96 x 64"):
        go.check(tmp_path / "square.exr", scene=scene)


def test_a_table_must_not_be_empty() -> None:
    with pytest.raises(go.InputError, match="every pixel"):
        tables.check(tables.Table("E.png", np.zeros((32, 32))))


# --------------------------------------------------------------------------- reference values


def test_reference_values_pass_their_own_check(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["-p", "sigma=0.5"]
    assert cli.run(["check", "oren-nayar", *words, "--reference", str(tmp_path / "r")]) == 0
    path = capsys.readouterr().out.strip()
    assert "# model: oren-nayar(sigma=0.5)" in Path(path).read_text()
    assert cli.run(["check", path, "oren-nayar", *words]) == 0


@pytest.mark.slow
def test_reference_values_of_the_courses_are_all_right(tmp_path: Path) -> None:
    names = {path.name for path in reference.write(tmp_path)}
    assert names >= {"E-text.csv", "E_avg-figure.csv", "dielectric-ggx.csv", "kulla-conty.csv"}
    for name, model in reference.MODELS.items():
        assert go.check(tmp_path / f"{name}.csv", model).passed, name


# --------------------------------------------------------------------------- a program in C++


PROGRAM = r"""
#include <cmath>
#include <cstdio>
#include <algorithm>
float next() { static unsigned s = 1; s = s * 1664525u + 1013904223u; return (s >> 8) / 16777216.0f; }
struct Vec { float x, y, z; };
Vec direction() {
    float y = next(), p = 6.2831853f * next(), r = sqrtf(1 - y * y);
    return {r * cosf(p), y, r * sinf(p)};
}
float orenNayar(Vec o, Vec i, float sigma) {
    float to = acosf(o.y), ti = acosf(i.y), po = atan2f(o.z, o.x), pi = atan2f(i.z, i.x);
    float s2 = sigma * sigma, A = 1 - s2 / (2 * (s2 + 0.33f)), B = 0.45f * s2 / (s2 + 0.09f);
    float a = std::max(to, ti), b = std::min(to, ti);
    return 0.5f / 3.1415927f * (A + B * std::max(0.0f, cosf(pi - po)) * sinf(a) * tanf(b)) FACTOR;
}
int main() {
    for (int k = 0; k < 200; ++k) {
        Vec o = direction(), i = direction();
        printf("%g,%g,%g,%g,%g,%g,%g\n", o.x, o.y, o.z, i.x, i.y, i.z, orenNayar(o, i, 0.3f));
    }
}
"""


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("g++") is None, reason="no g++ here")
@pytest.mark.parametrize(("factor", "cause"), [("", ""), ("* i.y", "cos_i"), ("* 3.1415927f", "pi")])
def test_a_program_in_cpp_is_judged_by_its_rows(tmp_path: Path, factor: str, cause: str) -> None:
    (tmp_path / "f.cpp").write_text(PROGRAM.replace("FACTOR", factor))
    subprocess.run(["g++", "-O1", "-o", tmp_path / "f", tmp_path / "f.cpp"], check=True)
    rows = subprocess.run([tmp_path / "f"], check=True, capture_output=True, text=True).stdout
    (tmp_path / "f.csv").write_text(rows)
    finding = go.check(tmp_path / "f.csv", "oren-nayar(sigma=0.3)", up="y")
    assert finding.passed == (not cause) and cause in finding.cause, finding.lines()
