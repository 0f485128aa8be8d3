"""Slang is read by its own compiler, where the wheel slangpy is installed."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio.errors import InputError, MachineError
from gonio.spirv import compile_text, slang

HAS_SLANG = importlib.util.find_spec("slangpy") is not None
needs_slang = pytest.mark.skipif(not HAS_SLANG, reason="SLANG was NOT TRIED: no slangpy here (pip: slangpy)")

# an interface, a generic function and a method, which HLSL lacks; a function that nothing calls, without a result
TEXT = """
interface IFresnel { float3 eval(float3 f0, float u); }
struct Schlick : IFresnel {
    float3 eval(float3 f0, float u) { float m = 1 - u; return f0 + (1 - f0) * m * m * m * m * m; }
}
uniform float roughness;
uniform float3 f0;
float D<T : IFresnel>(T fresnel, float nh, float a) {
    float d = nh * nh * (a * a - 1) + 1;
    return a * a / (PI * d * d);
}
void twice(float3 v, out float3 doubled) { doubled = 2 * v; }
float3 brdf(float3 L, float3 V, float3 N)
{
    float3 H = normalize(L + V);
    Schlick fresnel;
    return fresnel.eval(f0, dot(L, H)) * D(fresnel, dot(N, H), roughness * roughness);
}
"""


def written(folder: Path, text: str = TEXT) -> Path:
    (folder / "pi.slang").write_text("static const float PI = 3.14159265;\n")
    file = folder / "my.slang"
    file.write_text(f'#include "pi.slang"\n{text}')
    Path(f"{file}.toml").write_text('function = "brdf"\narguments = ["light", "view", "normal"]\nincludes = ["."]\n')
    return file


@needs_slang
def test_generics_interfaces_and_includes_are_read(tmp_path: Path) -> None:
    material = go.Shader(written(tmp_path), roughness=0.5, f0=(0.9, 0.6, 0.3))
    wo, wi = np.array([[0.48, 0.0, 0.877268], [0.0, 0.0, 1.0]]), np.array([[-0.3, 0.4, 0.866025], [0.6, 0.0, 0.8]])
    h = (wo + wi) / np.linalg.norm(wo + wi, axis=1, keepdims=True)
    u = np.sum(wi * h, axis=1)[:, None]
    d = 0.0625 / np.pi / (h[:, 2:] ** 2 * (0.0625 - 1.0) + 1.0) ** 2
    f0 = np.array([0.9, 0.6, 0.3])
    expected = (f0 + (1.0 - f0) * (1.0 - u) ** 5) * d * wi[:, 2:]
    np.testing.assert_allclose(material.eval(wo, wi, precision="float64"), expected, rtol=1e-6)


@needs_slang
def test_emitted_slang_is_read_back(tmp_path: Path) -> None:
    gold = go.Conductor.preset("Au", alpha=0.3)
    file = tmp_path / "gold.slang"
    file.write_text(go.emit(gold, "slang"))
    values = {name: getattr(gold, name) for name in ("eta", "k")}
    read = go.Shader(file, **values, alpha_x=0.3, alpha_y=0.3, albedo=1.0)
    w = np.random.default_rng(3).normal(size=(2, 200, 3))
    w[..., 2] = np.abs(w[..., 2])
    wo, wi = w / np.linalg.norm(w, axis=-1, keepdims=True)
    expected = gold.eval(wo, wi, precision="float64")
    np.testing.assert_allclose(read.eval(wo, wi, precision="float64"), expected, rtol=1e-5, atol=1e-9)


@needs_slang
def test_functions_of_every_form_leave_the_brdf_readable(tmp_path: Path) -> None:
    """Modifiers, attributes, default values, arrays, structs, namespaces and old generics, which nothing calls."""
    others = """
    struct Pair { float3 a; float b; };
    Pair both(Pair given, float scale = 2.0) { given.b *= scale; return given; }
    void fill(out float values[3], inout Pair pair) { values[0] = 1; values[1] = 2; values[2] = 3; pair.b = 1; }
    namespace other { float half_of(float x) { return 0.5 * x; } }
    __generic<T : __BuiltinFloatingPointType>
    T twice(T x) { return x + x; }
    [ForceInline] float one() { return 1; }
    func three(x : float, y : float = 1.0) -> float { return x + 2 * y; }
    func nothing() { }
    """
    file = written(
        tmp_path, others + TEXT.replace("void twice(", "void doubled(").replace("float3 brdf", "public float3 brdf")
    )
    assert np.isfinite(go.Shader(file).eval([0.0, 0.0, 1.0], [0.6, 0.0, 0.8])).all()


@needs_slang
def test_func_is_read(tmp_path: Path) -> None:
    (file := tmp_path / "flat.slang").write_text(
        "uniform float rough;\nfunc half_of(x : float) -> float { return 0.5 * x; }\n"
        "public func brdf(L : float3, V : float3, N : float3) -> float3 { return float3(half_of(rough), 0.1, 0.2); }\n"
    )
    value = go.Shader(file, rough=0.6).eval([0.0, 0.0, 1.0], [0.6, 0.0, 0.8], precision="float64")
    np.testing.assert_allclose(value, [[0.24, 0.08, 0.16]], rtol=1e-6)


@needs_slang
def test_a_mistake_is_told_with_file_and_line(tmp_path: Path) -> None:
    file = written(tmp_path, TEXT.replace("roughness * roughness", "roughnes * roughness"))
    with pytest.raises(InputError, match="undefined identifier 'roughnes'") as refused:
        go.Shader(file)
    assert refused.value.where == "my.slang:18"


@pytest.mark.parametrize(
    "line",
    ["import core;", 'int a; import "/etc/passwd";', '#/* */include "/etc/passwd"', '#\\\ninclude "x"', "__include x;"],
)
def test_the_compiler_itself_reads_no_other_file(line: str) -> None:
    with pytest.raises(InputError, match="is not supported"):
        slang.program(f"{line}\nfloat f() {{ return 1; }}", [], "my.slang")
    harmless = slang.program(f"// {line.partition(chr(10))[0]}\nfloat f() {{ return 1; }}", [], "my.slang")
    assert "gonio_entry" in harmless


def test_without_the_compiler_it_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(MachineError, match="the Slang compiler slangpy is not installed") as refused:
        compile_text("float f() { return 1; }", "my.slang", language="slang")
    assert "slangpy" in refused.value.hint


@needs_slang
@pytest.mark.parametrize(
    ("line", "what"),
    [
        ("double d = double(L.x) * 0.5;", "doubles and 16-bit types"),
        ("float d = WaveActiveSum(L.x);", "a subgroup operation"),
        ("c[0] = 1.0; float d = 0.0;", "a write to the buffer 'c'"),
    ],
)
def test_what_is_rejected_has_file_and_line(tmp_path: Path, line: str, what: str) -> None:
    body = f"{{\n  {line}\n  return float3(d); }}"
    text = f"RWStructuredBuffer<float> c;\nfloat3 brdf(float3 L, float3 V, float3 N) {body}"
    with pytest.raises(InputError, match=what) as refused:
        go.Shader(written(tmp_path, text))
    assert refused.value.where == "my.slang:4"  # `written` adds a line
