"""By what values of f are judged: the task's model, the command's, and the parameters that a file names or lacks."""

from __future__ import annotations

from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio import cli
from gonio.check import Finding, reference

from . import solutions as of
from .solutions import Phong

VALUES = Path(__file__).parents[2] / "docs/course/values"
SILVER = "preset=Ag,alpha=0.25,fresnel=schlick"


def _mark(folder: Path, name: str, text: str, sheet: str = "lab2") -> tuple[Finding, float | None]:
    """The finding about one file of a submission, and the points suggested for it."""
    folder.mkdir(exist_ok=True)
    (folder / name).write_text(text)
    marks = go.check(folder, sheet=sheet).submissions[0].marks
    mark = next(mark for mark in marks if mark.finding.name == name)
    return mark.finding, mark.suggested


def _written(material: str, line: str | None = None) -> str:
    """Values of a material whose first line names it, or another."""
    text = reference.values(go.material(material))
    return text if line is None else "\n".join([f"# model: {line}" if line else "#", *text.splitlines()[1:]])


# --------------------------------------------------------------------------- a sheet


@pytest.mark.parametrize(
    ("stored", "name", "sheet", "said"),
    [
        ("lambert", "oren-nayar.csv", "lab2", "the file names lambert, but the task is oren-nayar"),
        ("conductor-beckmann", "conductor-ggx.csv", "lab2", "ndf=beckmann, but the task has ndf=ggx"),
        ("lambert", "kulla-conty.csv", "hw4", "the file names lambert, but the task is kulla-conty"),
        ("conductor-ggx", "conductor-ggx.csv", "hw4", "masking=smith-separable, but the task has masking=schlick-dir"),
        ("blinn-phong", "phong.csv", "lab2", "the file names blinn-phong, but the task is phong"),
    ],
)
def test_a_file_does_not_choose_what_it_is_judged_by(
    tmp_path: Path, stored: str, name: str, sheet: str, said: str
) -> None:
    finding, points = _mark(tmp_path / "s", name, (VALUES / f"{stored}.csv").read_text(), sheet)
    assert finding.status == "wrong" and points == 0.0 and said in finding.remark, finding.lines()


def test_values_of_the_other_distribution_are_a_mistake_where_the_line_is_silent(tmp_path: Path) -> None:
    finding, points = _mark(tmp_path / "s", "conductor-beckmann.csv", (VALUES / "conductor-ggx.csv").read_text())
    assert finding.cause == "ndf is ggx, not beckmann" and points == 3.0


@pytest.mark.parametrize(
    ("stored", "name", "sheet"),
    [
        ("oren-nayar", "oren-nayar.csv", "lab2"),
        ("conductor-beckmann", "conductor-beckmann.csv", "lab2"),
        ("conductor-ggx", "conductor-ggx.csv", "lab2"),
        ("phong", "phong.csv", "lab2"),
        ("pbr-material", "pbr.csv", "hw4"),
        ("kulla-conty", "kulla-conty.csv", "hw4"),
    ],
)
def test_the_reference_values_are_right_by_their_sheet(tmp_path: Path, stored: str, name: str, sheet: str) -> None:
    finding, _ = _mark(tmp_path / "s", name, (VALUES / f"{stored}.csv").read_text(), sheet)
    assert finding.passed, finding.lines()


def test_a_line_gives_parameters_and_the_task_gives_the_terms(tmp_path: Path) -> None:
    right = _written(f"conductor({SILVER},masking=schlick-direct)".replace("Ag", "Au").replace(".25", ".4"), "")
    gold = right.replace("#", "# model: conductor(preset=Au,alpha=0.4)", 1)
    assert _mark(tmp_path / "a", "pbr.csv", gold, "hw4")[0].passed
    metal = "metal(r0=[0.97,0.96,0.92],edge=1,alpha=0.25,masking=schlick-direct)"
    assert _mark(tmp_path / "b", "pbr.csv", _written(metal, metal), "hw4")[0].passed
    other, _ = _mark(tmp_path / "c", "pbr.csv", _written("conductor(preset=Au,alpha=0.4)"), "hw4")
    assert not other.passed  # the line is silent about Gonio's own masking term, which is not the task's


@pytest.mark.parametrize(
    ("name", "line", "sheet", "said"),
    [
        ("oren-nayar.csv", "oren-nayar(sigma=0)", "lab2", "constant, as Lambert's"),
        ("pbr.csv", "conductor(eta=0,k=1,alpha=0.3,fresnel=schlick,masking=schlick-direct)", "hw4", "F = 1"),
        ("phong.csv", "phong(ks=0)", "lab2", "constant, as Lambert's"),
    ],
)
def test_parameters_that_make_a_simpler_model_show_nothing(
    tmp_path: Path, name: str, line: str, sheet: str, said: str
) -> None:
    finding, points = _mark(tmp_path / "s", name, _written(line, line), sheet)
    assert finding.status == "input error" and points is None and said in finding.facts[0]


# --------------------------------------------------------------------------- parameters that nobody names


@pytest.mark.slow
def test_parameters_that_a_file_does_not_name_are_found(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = _written("phong(kd=0.25,ks=0.6,p=16)", "")
    finding, points = _mark(tmp_path / "s", "phong.csv", text)
    assert points == 5.0 and "kd=0.25, ks=0.6, p=16, found from the values" in finding.remark, finding.lines()
    assert cli.run(["check", str(tmp_path / "s/phong.csv"), "phong"]) == 0
    assert "kd=0.25, ks=0.6, p=16, found" in capsys.readouterr().out
    assert cli.run(["check", str(tmp_path / "s/phong.csv"), "phong", "-p", "p=16"]) == 1  # these were named


@pytest.mark.slow
def test_wrong_values_without_parameters_name_the_defaults(tmp_path: Path) -> None:
    text = _written("blinn-phong(kd=0.25,ks=0.6,p=16)", "")
    finding, points = _mark(tmp_path / "s", "phong.csv", text)
    assert points == 0.0 or finding.mistake is not None
    assert not finding.passed and "kd=0.5, ks=0.3, p=32" in finding.remark, finding.lines()
    lambert, _ = _mark(tmp_path / "l", "oren-nayar.csv", _written("lambert(albedo=0.7)", ""))
    assert not lambert.passed and "sigma=0.3" in lambert.remark, lambert.lines()


def test_a_constant_that_is_another_parameter_is_no_mistake(tmp_path: Path) -> None:
    for text in ("oren-nayar(sigma=0.3,albedo=0.6)", "lambert(albedo=0.6)"):  # sigma is the default
        path = tmp_path / "f.csv"
        path.write_text(_written(text, ""))
        finding = go.check(path, text.partition("(")[0])
        assert finding.passed and "albedo=0.6, found from the values" in finding.remark, finding.lines()


@pytest.mark.slow
def test_a_known_mistake_at_the_defaults_prevails_over_other_parameters(tmp_path: Path) -> None:
    f = Phong(change="kd over pi")(of.WO, of.WI)
    np.savetxt(tmp_path / "phong.csv", np.column_stack([of.WO, of.WI, f]), fmt="%.6g", delimiter=",")
    finding = go.check(tmp_path / "phong.csv", "phong")
    assert "kd / pi" in finding.cause and "explains the values as well" in finding.remark, finding.lines()


# --------------------------------------------------------------------------- the command line and the file's line


@pytest.mark.parametrize("model", [["conductor"], []])
def test_the_line_of_a_file_gives_what_the_command_leaves_out(
    model: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    path = str(VALUES / "conductor-ggx.csv")
    assert cli.run(["check", path, *model]) == 0
    assert "file's line" in capsys.readouterr().out


@pytest.mark.slow
def test_the_command_prevails_over_the_line(capsys: pytest.CaptureFixture[str]) -> None:
    path = str(VALUES / "conductor-ggx.csv")
    assert cli.run(["check", path, "conductor", "--preset", "Au"]) == 1
    assert cli.run(["check", path, "conductor", "-p", "alpha=0.3"]) == 1
    assert cli.run(["check", path, "lambert"]) == 1
    assert "the file's line names conductor(" in capsys.readouterr().out


def test_code_and_nonsense_in_a_line_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "f.csv"
    for line, said in (("own.py:Mine", "is code, which is not run"), ("my own", "its line '# model:' cannot be used")):
        path.write_text(_written("lambert", line))
        assert cli.run(["check", str(path)]) == 2
        assert said in capsys.readouterr().err
        assert cli.run(["check", str(path), "lambert"]) == 0


# --------------------------------------------------------------------------- Phong with its cosine, and the horizon


def test_wrong_values_with_their_cosine_are_compared_with_it(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "f.csv", np.column_stack([of.WO, of.WI, Phong(p=17)(of.WO, of.WI)]), delimiter=",")
    finding = go.check(tmp_path / "f.csv", "phong(kd=0.5,ks=0.3,p=16)")
    assert finding.cause == "the exponent is p + 1, not p", finding.lines()
    assert any("f cos theta_i" in fact for fact in finding.facts)
    assert finding.figures["largest"] < 0.6  # against f alone: 0.9 and more at grazing light


def test_rows_at_the_horizon_are_counted(tmp_path: Path) -> None:
    text = _written("lambert", "lambert").rstrip() + "\n0,0,1,1,0,0.0001,0,0,0\n"
    (tmp_path / "f.csv").write_text(text)
    assert "1 row at the horizon left out" in go.check(tmp_path / "f.csv").facts[0]
