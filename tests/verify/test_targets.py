"""What the user may name, and what is said of what cannot be verified: clear words, never a traceback."""

from __future__ import annotations

import json
from pathlib import Path

import gonio as go
import pytest
from gonio.cli import main
from gonio.verify import targets, verify
from gonio.verify.isolation import watch

HEAD = "import gonio as go\nfrom gonio.ops import where, inv_pi\n\n\n"
GOOD = """class Good(go.BSDF):
    \"\"\"Diffuse.\"\"\"
    def eval(self, wo, wi, mode="radiance"):
        return go.ops.vec3(*[where((wo.z > 0) & (wi.z > 0), wi.z * inv_pi * 0.5, 0.0)] * 3)
"""


def file(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "mine.py"
    path.write_text(HEAD.replace("import gonio as go\n", "import gonio as go\nimport gonio.ops\n") + text)
    return path


def run(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as ended:
        main(["verify", *map(str, arguments)])
    out, err = capsys.readouterr()
    assert "Traceback" not in out + err
    return int(ended.value.code or 0), out, err


def test_a_model_by_name_with_parameters() -> None:
    (one,) = targets.resolve("conductor", ["alpha=0.1,0.4", "ndf=beckmann", "albedo=0.9,0.8,0.7"])
    assert one.model.alpha == (0.1, 0.4) and one.model.ndf == "beckmann" and one.model.albedo == (0.9, 0.8, 0.7)
    assert (
        one.command() == "gonio verify conductor --param alpha=0.1,0.4 --param ndf=beckmann --param albedo=0.9,0.8,0.7"
    )
    (gold,) = targets.resolve("conductor", ["preset=Au"])
    assert gold.model.eta == go.Conductor.preset("Au").eta


def test_a_material_in_a_material() -> None:
    (one,) = targets.resolve(
        "mix", ["a=lambert(albedo=0.1,0.2,0.3)", "b=conductor(alpha=0.2,ndf=beckmann)", "weight=0.4"]
    )
    assert one.model.a.albedo == (0.1, 0.2, 0.3) and one.model.b.ndf == "beckmann"
    (again,) = targets.resolve("mix", [text.removeprefix("--param ") for text in ["a=lambert", "b=phong"]])
    assert isinstance(again.model.b, go.Phong)


def test_a_sweep_gives_a_subject_a_value() -> None:
    cards = targets.resolve("conductor", [], "alpha=0.01..1")
    assert [round(c.model.alpha, 4) for c in cards] == [0.01, 0.0316, 0.1, 0.3162, 1.0]
    assert [c.model.alpha for c in targets.resolve("conductor", [], "alpha=0.2,0.4")] == [0.2, 0.4]


@pytest.mark.slow
def test_a_users_own_class(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = file(tmp_path, GOOD)
    code, out, _ = run(capsys, f"{path}:Good", "--quick", "--law", "reciprocity", "--law", "weight")
    assert code == 0 and "reciprocity and weight hold" in out


@pytest.mark.slow
def test_a_users_class_that_is_no_bsdf_but_has_eval(tmp_path: Path) -> None:
    path = file(tmp_path, GOOD.replace("(go.BSDF)", "").replace(', mode="radiance"', ""))
    assert verify(f"{path}:Good", quick=True, law=["reciprocity", "weight", "pdf"]).passed


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("class Mine:\n    pass\n", "Mine has no eval"),
        ("class Mine(go.BSDF):\n    pass\n", "Mine has no eval"),
        ("class Other:\n    pass\n", "did you mean"),
        ("1 / 0\n", "ZeroDivisionError"),
        ("class Mine(\n", "SyntaxError"),
    ],
)
def test_a_file_that_cannot_be_used_is_an_error_with_code_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, words: str
) -> None:
    name = "Othre" if "Other" in text else "Mine"
    code, _, err = run(capsys, f"{file(tmp_path, text)}:{name}", "--quick")
    assert code == 2 and words in err


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("        return wi.z", "eval returned shape"),
        ("        return [1, 2, 3]", "eval"),
        ("        return None", "eval"),
        ("        raise ValueError('no such thing')", "ValueError in eval: no such thing (mine.py:9)"),
    ],
)
def test_a_wrong_answer_fails_the_law_with_its_place(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], body: str, words: str
) -> None:
    text = f"class Mine(go.BSDF):\n    def eval(self, wo, wi, mode='radiance'):\n\n{body}\n"
    code, out, _ = run(capsys, f"{file(tmp_path, text)}:Mine", "--quick", "--law", "reciprocity")
    assert code == 1 and words in " ".join(out.split())


@pytest.mark.slow
def test_sampling_that_never_ends_fails_the_law(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watch, "LIMIT", 1.0)
    text = GOOD + "    def pdf(self, wo, wi):\n        return wi.z\n"
    text += "    def sample(self, wo, u, mode='radiance'):\n        while True:\n            pass\n"
    found = verify(f"{file(tmp_path, text)}:Good", quick=True, law=["weight", "shader"])
    assert "not finished after 1 s" in found["weight"].why[0] and "not finished after 1 s" in found["shader"].why[0]


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["conducter"], "did you mean 'conductor'"),
        (["conductor", "--param", "alhpa=1"], "did you mean 'alpha'"),
        (["conductor", "--param", "alpha"], "NAME=VALUE expected"),
        (["conductor", "--param", "alpha=x"], "a number expected"),
        (["conductor", "--param", "alpha=-1"], "-1 given"),
        (["conductor", "--param", "ndf=gxg"], "did you mean 'ggx'"),
        (["conductor", "--vary", "alpha=1..0"], "not an increasing range"),
        (["conductor", "--quick", "--deep"], "give one of them"),
        (["conductor", "--law", "gravity"], "unknown law 'gravity'"),
        (["conductor", "--at", "10"], "not a pair of directions"),
        (["nowhere.py:Mine"], "no file"),
        (["nowhere.json"], "no file"),
        (["conductor", "--output", "/proc/none"], "can be written to"),
        (["mitsuba:roughplastc"], "did you mean 'roughplastic'"),
        (["mitsuba:measured"], "filename"),
        (["mitsuba:roughplastic", "--param", "alhpa=1"], "alhpa"),
        (['{"type": "sphere"}'], "a BSDF expected"),
        (['{"kind": 1}'], 'an object with a "type" expected'),
    ],
)
def test_bad_input_is_one_clear_error(capsys: pytest.CaptureFixture[str], arguments: list[str], words: str) -> None:
    code, _, err = run(capsys, *arguments)
    assert code == 2 and words in err


def test_one_pair_is_printed_both_ways(capsys: pytest.CaptureFixture[str]) -> None:
    main_arguments = ["conductor", "--param", "alpha=0.3", "--at", "30,0/45,180", "--json"]
    code, out, _ = run(capsys, *main_arguments)
    pair = json.loads(out)
    assert code == 0
    assert pair["float64, wo -> wi"]["f"] == pytest.approx(pair["float64, wi -> wo"]["f"], rel=1e-12)


@pytest.mark.slow
def test_the_exit_code_tells_of_a_broken_law(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = GOOD.replace("wi.z * inv_pi", "inv_pi")
    code, out, _ = run(capsys, f"{file(tmp_path, text)}:Good", "--quick", "--json")
    report = json.loads(out)
    assert code == 1 and not report["passed"]
    assert {v["law"]: v["status"] for v in report["cards"][0]["verdicts"]}["reciprocity"] == "fail"


@pytest.mark.slow
def test_mitsubas_plugins_and_descriptions(tmp_path: Path) -> None:
    assert verify("mitsuba:diffuse", quick=True, law=["energy", "reciprocity", "weight"]).passed
    assert verify('{"type": "diffuse"}', quick=True, law=["energy"]).passed
    xml = tmp_path / "glass.xml"
    xml.write_text('<bsdf version="3.0.0" type="dielectric"/>')
    assert verify(str(xml), quick=True, law=["energy", "weight"]).passed
    own = tmp_path / "own.json"
    own.write_text(json.dumps({"type": "gonio_conductor", "alpha": 0.3, "preset": "Au"}))
    assert verify(str(own), quick=True, law=["energy", "weight"]).passed


def test_a_lobe_of_a_plugin_that_samples_the_wrong_side_has_failed() -> None:
    """Other lobes have light there, so eval and pdf are positive, and the pdf of the sample is that of all lobes."""
    target = "mitsuba:principled(spec_trans=0.9,metallic=0.5,roughness=0.6)"
    report = verify(target, quick=True, law=["weight", "reciprocity"])
    assert report.passed, str(report)


PLUGIN = """import mitsuba as mi

class MyBlack(mi.BSDF):
    def __init__(self, props=None):
        mi.BSDF.__init__(self, props)
        self.m_components = [mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide]
        self.m_flags = self.m_components[0]
    def eval(self, ctx, si, wo, active=True):
        return mi.Color3f(0.0)
"""


def test_a_class_of_a_plugin_names_it_or_says_what_to_type(tmp_path: Path) -> None:
    path = tmp_path / "black.py"
    path.write_text(PLUGIN + "mi.register_bsdf('my-black', lambda props: MyBlack(props))\n")
    assert targets.resolve(f"{path}:MyBlack")[0].model.description == {"type": "my-black"}
    other = tmp_path / "unregistered.py"
    other.write_text(PLUGIN)
    with pytest.raises(go.InputError) as caught:
        targets.resolve(f"{other}:MyBlack")
    assert "mi.register_bsdf('NAME', MyBlack)" in caught.value.hint
    with pytest.raises(go.InputError, match="MyBlack is a Mitsuba BSDF"):
        go.plot(f"{other}:MyBlack")


def test_properties_of_a_plugin_stand_in_brackets_too() -> None:
    one = targets.resolve("mitsuba:roughconductor(alpha=0.3,distribution=ggx)", ["alpha=0.2"])[0]
    assert one.model.description["alpha"] == 0.2 and one.model.description["distribution"] == "ggx"
    assert one.command().startswith("gonio verify mitsuba:roughconductor --param")


def test_a_parameter_of_a_sum_is_varied_by_its_name() -> None:
    assert [one.model.b.k for one in targets.resolve("lambert+ggx", vary="k=0,1")] == [0.0, 1.0]
