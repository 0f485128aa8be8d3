"""Python and the command line say the same: one name a thing, the same options, the same defaults."""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio import cli, emit, render, verify
from gonio.errors import GonioWarning, InputError
from gonio.pictures import images

FUNCTIONS: dict[str, Callable[..., object]] = {
    "bake": go.bake,
    "capture": go.capture,
    "check": go.check,
    "compare": go.compare,
    "compensation": go.compensation,
    "compress": go.compress,
    "convert": go.convert,
    "emit": emit,
    "explain": go.explain,
    "fit": go.fit,
    "info": go.info,
    "measure": go.measure,
    "plot": go.plot,
    "render": render,
    "report": go.report,
    "study": go.study,
    "verify": verify,
}
# What only a command line needs: materials as text, and where a result goes when no variable takes it.
TEXT = {"param", "preset", "define", "adapter", "as_json"}
CREW = {"workers", "cluster"}  # in a program: with go.cluster(...)
ONLY_TYPED = {
    "verify": {"at", "github"},
    "emit": {"output", "check"},  # the pairs of directions for another program's tests are a file
    "fit": {"data", "scene", "spp", "output"},  # the scene is for go.fit_picture
    "capture": {"next_", "output"},  # methods of what is returned
    "compensation": {"model"},
    "check": {"target", "model", "reference"},  # `against`; right values are go.material(...).f(wo, wi)
}
# Typed as text there, as what it is here; and a file that the command line writes anyhow.
OTHER_DEFAULTS = {"render exposure", "study exposure", "study output", "bake output", "bake lut", "emit functions"}
OTHER_DEFAULTS |= {"bake target"}  # typed, a preset of the homework may stand without one
OTHER_DEFAULTS |= {"convert exposure", "report exposure", "capture free", "fit free", "fit model"}


@pytest.mark.parametrize("name", list(FUNCTIONS))
def test_options_have_the_same_names_and_defaults(name: str) -> None:
    typed = inspect.signature(cli.Verb.family.get(name).with_single_options()).parameters
    called = inspect.signature(FUNCTIONS[name]).parameters
    assert all(p.kind is not inspect.Parameter.VAR_KEYWORD for p in called.values())
    options = {key for key, p in typed.items() if p.default is not inspect.Parameter.empty}
    options -= TEXT | CREW | ONLY_TYPED.get(name, set())
    assert options <= set(called)
    for key in sorted(options):
        if f"{name} {key}" not in OTHER_DEFAULTS:
            assert called[key].default == typed[key].default, key


def test_all_of_it_stands_in_dir() -> None:
    assert {*FUNCTIONS, "view", "models", "Conductor", "InputError"} <= set(dir(go))
    for name in dir(go):
        assert getattr(go, name, None) is not None or name.startswith("_")


def test_docstrings_name_every_option() -> None:
    for function in FUNCTIONS.values():
        text = inspect.getdoc(function) or ""
        for key in inspect.signature(function).parameters:
            assert re.search(rf"\b{key}\b", text + (inspect.getdoc(render) or "")), f"{function.__name__}: {key}"


def test_a_picture_goes_to_a_file_and_back(tmp_path: Path, scene: Path) -> None:
    picture = go.render(scene, output=tmp_path / "a.exr", overrides={"scene.shapes.0.material.p": 4})
    assert picture.shape == (16, 24, 3) and picture.dtype == np.float32
    np.testing.assert_array_equal(images.read(tmp_path / "a.exr").pixels, picture)
    assert go.compare(tmp_path / "a.exr", picture, tolerance=0).passed
    far = go.compare(picture, picture * 1.1, metric="rmse", tolerance=1e-9)
    assert not far.passed and "<td>fails</td>" in far._repr_html_() and "&gt;" in far._repr_html_()
    with pytest.warns(GonioWarning, match="brighter than white"):
        go.render(scene, output=tmp_path / "a.png", exposure=9)


def test_a_study_is_shown_and_saved(tmp_path: Path, scene: Path) -> None:
    sheet = go.study(scene, {"scene.shapes.0.material.p": [4, 16]}, spp=1, exposure="auto")
    assert sheet.output is None and len(sheet.cells) == 2
    assert sheet._repr_png_().startswith(b"\x89PNG")
    assert go.study(scene, {"scene.shapes.0.material.p": [4]}, output=tmp_path / "a.pdf").output == tmp_path / "a.pdf"
    for vary in ({}, {"scene.shapes.0.material.p": []}):
        with pytest.raises(InputError, match="nothing is varied"):
            go.study(scene, vary)


def test_a_trial_takes_the_command_lines_options(tmp_path: Path) -> None:
    report = go.verify("lambert", quick=True, law="reciprocity", vary="albedo=0.1,0.5", output=tmp_path / "r")
    assert len(report.cards) == 2 and report.passed and (tmp_path / "r/report.html").is_file()
    assert "reciprocity" in report._repr_html_() and "<pre>" in report._repr_html_()
    with pytest.raises(InputError, match="quick and deep"):
        go.verify("lambert", quick=True, deep=True)
    with pytest.raises(InputError, match="sweep of a Python object"):
        go.verify(go.Lambert(), vary="albedo=0.1,0.5")


def test_tables_and_albedos_are_shown_in_notebooks() -> None:
    shown = go.bake("ggx", resolution=4, lut=["E"])._repr_html_()
    assert "4 roughness x 4 mu" in shown and "smith-correlated" in shown
    albedo = go.albedo(go.Lambert(0.3), mu=[0.2, 1.0])
    assert albedo._repr_html_().count("<td>0.3  0.3  0.3</td>") == 2
    value, error, method = albedo  # it still is a tuple
    assert method == "closed-form" and np.all(value == 0.3) and np.all(error == 0)


def test_tables_are_baked_without_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    baked = go.bake("ggx", resolution=4, lut=["E"])
    assert baked.arrays["E"].shape == (4, 4) and list(tmp_path.iterdir()) == []
    assert go.bake("conductor(preset=Au)", resolution=4, lut=["E"]).arrays["E"].shape == (4, 4, 3)
    for target, message in (("ggxx", "unknown distribution or material"), ("ggx(alpha=.1)", "which has no parameters")):
        with pytest.raises(InputError, match=message):
            go.bake(target)


def test_what_the_command_line_tells_is_there_in_python(tmp_path: Path) -> None:
    assert go.explain("ggx").text().startswith("ggx (")
    assert go.explain("conductor").as_dict()["name"] == "conductor" and "families" in str(go.explain()).lower()
    images.write(tmp_path / "a.exr", np.full((4, 4, 3), 4.0, np.float32))
    with pytest.warns(GonioWarning, match="clip"):
        picture = go.convert(tmp_path / "a.exr", tmp_path / "a.png")
    assert picture.as_dict() == {"output": str(tmp_path / "a.png"), "exposure": 0.0, "notice": picture.notices[0]}
    (tmp_path / "m.json").write_text('{"type": "lambert", "albedo": 0.5}')
    assert list(go.info(tmp_path / "m.json")) == ["path", "materials"]
    with pytest.raises(InputError):
        go.info(tmp_path / "a.png")


def test_a_module_that_is_not_imported_yet_says_how() -> None:
    code = "import gonio\ntry: gonio.mitsuba\nexcept AttributeError as error: print(error)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout == "module 'gonio' has no attribute 'mitsuba': write `import gonio.mitsuba`\n", done.stderr
