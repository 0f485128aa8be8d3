"""Entries of the adapter as options, macros, and the adapter's errors; and what `gonio adopt` guesses."""

import json
import pickle
from pathlib import Path
from xml.etree import ElementTree as xml

import gonio as go
import numpy as np
import pytest
from gonio.catalog import notation, shaders
from gonio.catalog.shaders import names
from gonio.cli.app import run
from gonio.errors import InputError
from gonio.scene.materials import described
from gonio.spirv.compiler import compiler


@pytest.fixture(autouse=True)
def _needs_compiler() -> None:
    try:
        compiler()
    except Exception as error:
        pytest.skip(f"NOT TRIED: {error}")


# a shader of which no part can be guessed: N, the function, its arguments, the table
OWN = """#ifndef N
#error N is not set
#endif
#include "part.glsl"
uniform vec3 isotropic;
uniform sampler2D lut;
vec3 other(vec3 a, vec3 b) { return isotropic * scaled(float(N)) * texture(lut, vec2(a.z, b.z)).r; }
"""
PART = "float scaled(float x) { return 0.1 * x; }\n"
ENTRY = ("function=other", "arguments=light,view", "textures.lut=lut.npy", "includes=parts")
OPTIONS = ["-D", "N=2", *(f"--adapter={one}" for one in (*ENTRY, "parameters.isotropic.default=0.3"))]
WO, WI = np.array([[0.0, 0.6, 0.8]]), np.array([[0.6, 0.0, 0.8]])
EXPECTED = 0.3 * 0.2 * 0.5 * 0.8


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.glsl").write_text(OWN)
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "part.glsl").write_text(PART)
    np.save(tmp_path / "lut.npy", np.full((4, 4, 1), 0.5))
    return tmp_path / "own.glsl"


def shader(file: Path) -> go.BSDF:
    adapter = {
        "function": "other",
        "arguments": ["light", "view"],
        "textures": {"lut": {"file": "lut.npy"}},
        "includes": ["parts"],
        "parameters": {"isotropic": {"default": 0.3}},
    }
    return go.Shader(file, defines={"N": 2}, adapter=adapter)


def test_python_gives_the_adapter_and_macros(own: Path) -> None:
    material = shader(own)
    np.testing.assert_allclose(material.eval(WO, WI, precision="float64"), EXPECTED, rtol=1e-7)
    np.testing.assert_allclose(
        go.Shader(own, defines={"N": 4}, adapter=dict(ENTRIES)).eval(WO, WI), 2.0 * EXPECTED, 1e-6
    )


ENTRIES = {"function": "other", "arguments": ["light", "view"], "textures": {"lut": "lut.npy"}, "includes": ["parts"],
           "parameters": {"isotropic": {"default": 0.3}}}  # fmt: skip


def test_options_travel_with_the_name_to_other_processes_texts_json_and_scenes(own: Path) -> None:
    material = shader(own)
    for other in (
        pickle.loads(pickle.dumps(material)),
        notation.named(notation.written(material))[0],
        notation.from_json(json.loads(json.dumps(notation.as_json(material)))),
        described(material).instance(),
    ):
        np.testing.assert_allclose(other.eval(WO, WI, precision="float64"), EXPECTED, rtol=1e-7)
    inside = notation.named(f"two-sided(base={notation.written(material)})")[0]
    np.testing.assert_allclose(inside.eval(WO, WI, precision="float64"), EXPECTED, rtol=1e-7)


def test_command_line_gives_the_adapter_and_macros(own: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["verify", "own.glsl", *OPTIONS, "-p", "isotropic=0.2", "--law", "positivity", "--quick"]) == 0
    assert "isotropic_ = 0.2" in capsys.readouterr().out
    assert run(["check", "own.glsl", *OPTIONS, "--against", "lambert"]) == 1
    assert run(["emit", "own.glsl", *OPTIONS, "--functions", "eval"]) == 0
    assert "Own_eval" in capsys.readouterr().out
    assert run(["explain", "own.glsl", *OPTIONS]) == 0
    assert "The function other of own.glsl" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["-D", "N=2", "--adapter", "cosin=true"], "unknown key 'cosin'"),
        (["-D", "N=2", "--adapter", "function"], "'function' given, NAME=VALUE expected"),
        (["-D", "N=2", "--adapter", "arguments=light,vew"], "unknown meaning of an argument 'vew'"),
        (["-D", "N=2", "--adapter", "includes=parts", "--adapter", "function=f"], "no function 'f'"),
        (["--adapter", "includes=parts"], "N is not set"),
    ],
)
def test_wrong_option_is_an_error(
    options: list[str], message: str, own: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["explain", "own.glsl", *options]) == 2
    assert message in capsys.readouterr().err


def test_options_without_a_shader_are_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["explain", "lambert", "-D", "N=1"]) == 2
    assert "without a shader" in capsys.readouterr().err


def test_name_with_options_is_read_back() -> None:
    text = names.with_options("a b/my.glsl?x=1", [("defines.F(a)", "a + 1, b&c=%"), ("x", "2")])
    assert names.parted(text)[0] == "a b/my.glsl"
    assert names.options_in(names.parted(text)[1]) == [("x", "2"), ("defines.F(a)", "a + 1, b&c=%")]
    assert names.head_in(f"{text}(roughness=0.3)") == text
    assert notation.split(f"{text}(roughness=0.3)") == (text, "roughness=0.3")


def test_wgsl_override_is_set(tmp_path: Path) -> None:
    file = tmp_path / "scale.wgsl"
    file.write_text(
        "override N: i32 = 1;\nfn brdf(light: vec3f, view: vec3f) -> vec3f { return vec3f(f32(N) * 0.1); }\n"
    )
    np.testing.assert_allclose(go.Shader(file, defines={"N": 3}).eval(WO, WI), 0.24, rtol=1e-6)


# ---------------------------------------------------------------------- errors of the adapter

MATTE = "uniform vec3 albedo;\nuniform float gloss;\nvec3 brdf(vec3 light, vec3 view) { return albedo * gloss; }\n"
ERRORS = {
    "[parameters.gloss]\nlow = 5\ndefault = 0.4": r"matte\.glsl\.toml: parameters\.gloss: default = 0\.4",
    "arguments = [[1]]": r"matte\.glsl\.toml: arguments: unknown meaning of an argument \[1\]",
    'arguments = ["light"]': r"matte\.glsl\.toml: arguments: 1 meanings for the 2 arguments",
    'function = "f"': r"matte\.glsl\.toml: function: no function 'f'",
    "[parameters.nope]\nlow = 1": r"matte\.glsl\.toml: parameters\.nope: no uniform 'nope'",
    "includes = [1]": r"matte\.glsl\.toml: includes = \[1\]",
    "includes = ['none']": r"matte\.glsl\.toml: includes: there is no folder '.*none'",
    "[defines]\nA = [1]": r"matte\.glsl\.toml: defines\.A",
    'arguments = ["light", "derived"]': r"matte\.glsl\.toml: arguments: 'derived' given without a function",
    f"[parameters.gloss]\ndefault = 1{'0' * 400}": r"matte\.glsl\.toml: parameters\.gloss: default = 1000",
    f"[parameters.albedo]\nlow = -1{'0' * 400}": r"parameters\.albedo: low = -1000",
    "[parameters.gloss]\nhigh = nan": r"parameters\.gloss: high = nan",
    '[parameters.gloss]\nkind = "beta"': r"parameters\.gloss: unknown kind 'beta'",
}


@pytest.mark.parametrize("text", ERRORS)
def test_error_names_the_file_and_the_key(text: str, tmp_path: Path) -> None:
    (tmp_path / "matte.glsl").write_text(MATTE)
    (tmp_path / "matte.glsl.toml").write_text(text)
    with pytest.raises(InputError, match=ERRORS[text]):
        go.Shader(tmp_path / "matte.glsl")


def test_parameter_with_the_name_of_a_member_has_both_spellings(tmp_path: Path) -> None:
    file = tmp_path / "tinted.glsl"
    file.write_text("uniform float tint;\nvec3 brdf(vec3 light, vec3 view) { return vec3(tint); }\n")
    for spelling in ("tint", "tint_"):
        (tmp_path / "tinted.glsl.toml").write_text(f"[parameters.{spelling}]\ndefault = 0.25\n")
        shaders.files.forget()  # type: ignore[attr-defined]
        assert go.Shader(file).tint_ == 0.25
        assert notation.named(f"{file}({spelling}=0.4)")[0].tint_ == 0.4
        assert go.Shader(file, **{spelling: 0.4}).tint_ == 0.4


def npy(folder: Path, header: str) -> None:
    text = header.encode().ljust(117) + b"\n"
    (folder / "lut.npy").write_bytes(b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + bytes(64))


def test_table_whose_header_lies_is_refused_before_memory_is_taken(own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(np, "load", lambda *_, **__: pytest.fail("memory is taken"))
    npy(own.parent, "{'descr': '<f8', 'fortran_order': False, 'shape': (100000, 100000, 1), }")
    with pytest.raises(
        InputError, match=r"textures\.lut: 'lut\.npy' is not a table: its header claims 10000000000 numbers"
    ):
        shader(own)


def test_complex_table_is_refused(own: Path) -> None:
    np.save(own.parent / "lut.npy", np.full((4, 4, 1), 1.0j))
    with pytest.raises(InputError, match="complex128, real numbers expected"):
        shader(own)


def test_raw_table_is_read_by_its_shape(own: Path) -> None:
    np.full(16, 0.5, "<f4").tofile(own.parent / "lut.f32")
    adapter = {**ENTRIES, "textures": {"lut": {"file": "lut.f32", "shape": [4, 4, 1]}}}
    np.testing.assert_allclose(go.Shader(own, defines={"N": 2}, adapter=adapter).eval(WO, WI), EXPECTED, 1e-6)
    for wrong in ({"file": "lut.f32", "shape": [4, 5, 1]}, {"file": "lut.f32"}):
        with pytest.raises(InputError, match=r"textures\.lut"):
            go.Shader(own, defines={"N": 2}, adapter={**ENTRIES, "textures": {"lut": wrong}})


# ---------------------------------------------------------------------- gonio adopt


def test_adoption_names_equal_candidates_and_writes_short_numbers(tmp_path: Path) -> None:
    file = tmp_path / "two.wgsl"
    file.write_text(
        "override gloss: f32 = 0.8;\n"
        "fn brdfA(light: vec3f, view: vec3f) -> vec3f { return vec3f(gloss); }\n"
        "fn brdfB(light: vec3f, view: vec3f) -> vec3f { return vec3f(gloss); }\n"
    )
    adopted = shaders.adopt(file)
    assert 'function = "brdfA"' in adopted.text and "default = 0.8\n" in adopted.text
    assert any("other candidates: brdfB" in one for one in adopted.guesses)


def test_function_that_writes_its_color_is_a_brdf(tmp_path: Path) -> None:
    file = tmp_path / "out.glsl"
    file.write_text(
        "void brdf(vec3 L, vec3 V, float gloss, out vec3 color, out float hit) {"
        " hit = 1.0; color.r = gloss; color.gb = vec2(0.5); }\n"
        "vec3 second(vec3 L, vec3 V, out float hit) { hit = 1.0; return vec3(0.5); }\n"
    )
    assert 'arguments = ["light", "view", "parameter", "result", "ignored"]' in shaders.adopt(file).text
    material = go.Shader(file, gloss=0.2)
    assert list(material.parameters()) == ["gloss"]
    np.testing.assert_allclose(material.eval(WO, WI), [[0.16, 0.4, 0.4]], rtol=1e-6)
    assert not go.Shader(file, adapter={"function": "second"}).parameters()


def test_adoption_writes_the_options(own: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["adopt", "own.glsl", *OPTIONS]) == 0
    np.testing.assert_allclose(go.Shader(own).eval(WO, WI, precision="float64"), EXPECTED, rtol=1e-7)


def test_adoption_of_no_file_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["adopt", "nope.glsl"]) == 2
    assert "'nope.glsl' does not exist" in capsys.readouterr().err


# ---------------------------------------------------------------------- several, of which one cannot be read


@pytest.mark.slow
def test_others_are_judged_where_one_shader_cannot_be_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("GITHUB_WORKSPACE", raising=False)
    (tmp_path / "good.glsl").write_text("vec3 brdf(vec3 light, vec3 view) { return vec3(0.2); }\n")
    (tmp_path / "bad.glsl").write_text("\nvec3 brdf(vec3 light, vec3 view) { return oops; }\n")
    options = ["--law", "positivity", "--quick", "--junit", "j.xml", "--sarif", "s.json", "--github"]
    assert run(["verify", "bad.glsl", "good.glsl", *options]) == 2
    out = capsys.readouterr().out
    assert "::error file=bad.glsl,line=2,title=bad.glsl%3A not read::" in out and "1 not read, positivity holds" in out
    root = xml.parse("j.xml").getroot()
    assert (root.get("tests"), root.get("errors"), root.get("failures")) == ("2", "1", "0")
    assert root.find(".//error") is not None
    results = json.loads(Path("s.json").read_text())["runs"][0]["results"]
    assert [one["ruleId"] for one in results] == ["gonio/read"]
    assert run(["verify", "bad.glsl", "bad.glsl", "--law", "positivity", "--quick"]) == 2
    assert "undeclared identifier" in capsys.readouterr().err
