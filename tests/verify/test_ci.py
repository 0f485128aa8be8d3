"""Reports for continuous integration: JUnit, SARIF, annotations, baselines, the schema."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as xml

import jsonschema
import pytest
from gonio.cli import main
from gonio.errors import InputError
from gonio.verify import Card, Report, Verdict, verify
from gonio.verify.ci import baseline, github, junit, places, sarif, schema
from gonio.verify.subject import Described

MINE = '''import gonio as go
from gonio.ops import where, inv_pi


class Mine(go.BSDF):
    """Diffuse; the cosine is missing."""
    def eval(self, wo, wi, mode="radiance"):
        return go.ops.vec3(*[where((wo.z > 0) & (wi.z > 0), COSINE * inv_pi * 0.3, 0.0)] * 3)
'''


def verdict(law: str, status: str, **more: Any) -> Verdict:
    return Verdict(1, law, f"{law} holds", status, meaning="light, 5 % <too much>", command=f"gonio {law}", **more)


@pytest.fixture
def report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Report:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("GITHUB_WORKSPACE", raising=False)
    (tmp_path / "mine.py").write_text(MINE)
    mine = Described(None, "mine.py:Mine", {}, "mine.py:Mine, a = 1")
    verdicts = [
        verdict("energy", "fail", figure=0.2, why=["albedo 1.2: 100 %, too\nmuch \x00"]),
        verdict("pdf", "fail", why=["KeyError in pdf: 'a' (mine.py:8)"]),
        verdict("weight", "breaks as declared", figure=0.1, notes=["declared: by nature"]),
        verdict("isotropy", "pass", figure=0.0, notes=["float32: 0"]),
        verdict("shader", "does not apply", why=["no browser"]),
    ]
    plain = Described(None, "lambert", {}, "lambert")
    return Report([Card(mine, verdicts), Card(plain, [verdict("energy", "pass", figure=0.0)])], 1, "quick", 0, 0.01)


def test_a_place_is_the_line_that_failed_else_the_class(report: Report) -> None:
    energy, pdf = report.cards[0].verdicts[:2]
    assert places.of(report.cards[0], energy) == ("mine.py", 5)
    assert places.of(report.cards[0], pdf) == ("mine.py", 8)
    assert places.of(report.cards[1]) is None


def test_junit_counts_and_names_what_failed(report: Report) -> None:
    root = xml.fromstring(junit.text(report))
    assert (root.get("tests"), root.get("failures"), root.get("skipped")) == ("6", "2", "1")
    first = root.find("testsuite/testcase")
    assert first is not None and (first.get("name"), first.get("file"), first.get("line")) == ("energy", "mine.py", "5")
    failure = first.find("failure")
    assert failure is not None and failure.text is not None
    assert "100 %" in failure.text and "consequence: light, 5 % <too much>" in failure.text


def test_annotations_are_one_line_each_and_escaped(report: Report) -> None:
    first, second = github.text(report).splitlines()
    assert first.startswith(
        "::error file=mine.py,line=5,title=mine.py%3AMine%2C a = 1%3A energy::albedo 1.2: 100 %25, too"
    )
    assert second.startswith("::error file=mine.py,line=8,") and "%0A" in second


def test_a_grade_that_biases_no_picture_is_a_warning(report: Report) -> None:
    report.cards[0].verdicts[0].grade = "noise"  # type: ignore[attr-defined,unused-ignore]
    assert github.text(report).startswith("::warning file=mine.py")


def test_sarif_has_a_rule_a_law_and_a_result_for_each_that_is_not_kept(report: Report) -> None:
    log = json.loads(sarif.text(report))
    assert log["version"] == "2.1.0" and "sarif-schema-2.1.0" in log["$schema"]
    (run,) = log["runs"]
    rules = [rule["id"] for rule in run["tool"]["driver"]["rules"]]
    assert rules == [f"gonio/{law}" for law in ("energy", "pdf", "weight", "isotropy", "shader")]
    assert [(one["ruleId"], one["level"]) for one in run["results"]] == [
        ("gonio/energy", "error"),
        ("gonio/pdf", "error"),
        ("gonio/weight", "note"),
    ]
    for one in run["results"]:
        assert one["message"]["text"] and rules[one["ruleIndex"]] == one["ruleId"]
        (location,) = one["locations"]
        assert location["logicalLocations"][0]["name"] == "mine.py:Mine, a = 1"
        assert location["physicalLocation"]["artifactLocation"]["uri"] == "mine.py"
        assert location["physicalLocation"]["region"]["startLine"] in (5, 8)
    assert run["results"][2]["suppressions"][0]["kind"] == "inSource"


def test_a_baseline_knows_what_failed_unless_it_is_worse(report: Report, tmp_path: Path) -> None:
    file = tmp_path / "known.json"
    file.write_text(baseline.text(report))
    known = baseline.read(file)
    assert known == {("mine.py:Mine, a = 1", "energy"): 0.2, ("mine.py:Mine, a = 1", "pdf"): None}
    energy, pdf = report.cards[0].verdicts[:2]
    energy.figure = 0.215
    assert baseline.apply(report, known) == [] and report.passed and report.exit_code == 0
    assert energy.status == pdf.status == "known"
    assert "known" in str(report) and "::notice file=mine.py" in github.text(report)
    assert json.loads(sarif.text(report))["runs"][0]["results"][0]["baselineState"] == "unchanged"
    # a report in which they are known is a baseline as well
    file.write_text(json.dumps(report.as_dict()))
    assert baseline.read(file)["mine.py:Mine, a = 1", "energy"] == 0.215
    energy.status, energy.figure = "fail", 0.23
    baseline.apply(report, known)
    assert energy.failed and "worse than in the baseline" in energy.notes[-1]
    energy.status = "pass"
    (mended,) = baseline.apply(report, {("mine.py:Mine, a = 1", "energy"): 0.2})
    assert mended == "mine.py:Mine, a = 1: energy no longer fails and can be removed from the baseline"


@pytest.mark.parametrize("text", ["", "[]", '{"schema": "gonio-baseline/1"}', '{"schema": "x", "cards": 3}'])
def test_what_is_no_baseline_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "known.json").write_text(text)
    with pytest.raises(InputError, match="--write-baseline"):
        baseline.read(tmp_path / "known.json")


@pytest.mark.slow
def test_the_schema_describes_every_report(report: Report) -> None:
    described = json.loads(schema.text())
    jsonschema.Draft202012Validator.check_schema(described)
    for one in (report, verify("lambert", quick=True, law=["energy", "weight", "shader"])):
        jsonschema.validate(json.loads(json.dumps(one.as_dict())), described)


def run(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as ended:
        main([*map(str, arguments)])
    out, err = capsys.readouterr()
    return int(ended.value.code or 0), out, err


@pytest.mark.slow
def test_the_command_line_fails_on_what_is_new_only(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    mine = tmp_path / "mine.py"
    mine.write_text(MINE.replace("COSINE", "1.0"))
    asked = ["verify", "mine.py:Mine", "--quick", "--law", "reciprocity", "--law", "isotropy"]
    code, out, _ = run(capsys, *asked, "--junit", "laws.xml", "--sarif", "laws.sarif")
    assert code == 1 and "::error file=mine.py,line=5," in out
    assert xml.parse("laws.xml").getroot().get("failures") == "1"
    assert len(json.loads(Path("laws.sarif").read_text())["runs"][0]["results"]) == 1
    code, out, _ = run(capsys, *asked, "--write-baseline", "known.json")
    assert code == 0 and "fails, known" in out
    code, out, err = run(capsys, *asked, "--baseline", "known.json", "--json")
    assert code == 0 and json.loads(out)["passed"] and "::notice" in err
    mine.write_text(MINE.replace("COSINE", "wi.z"))
    code, out, _ = run(capsys, *asked, "--baseline", "known.json")
    assert code == 0 and "fixed: mine.py:Mine: reciprocity no longer fails" in " ".join(out.split())


def test_files_that_cannot_be_written_are_told_of_at_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, _, err = run(capsys, "verify", "lambert", "--junit", tmp_path / "nowhere/laws.xml")
    assert code == 2 and "does not exist" in err
    code, _, err = run(capsys, "verify", "lambert", "--baseline", tmp_path / "none.json")
    assert code == 2 and "--write-baseline" in err


def test_schemas_are_printed(capsys: pytest.CaptureFixture[str]) -> None:
    main_code, out, _ = run(capsys, "schema", "report")
    assert main_code == 0 and json.loads(out)["properties"]["schema"]["const"] == "gonio-verify/1"
    code, _, err = run(capsys, "schema", "reprot")
    assert code == 2 and "did you mean 'report'" in err
