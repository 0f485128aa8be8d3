"""A shader's functions are recorded as functions: emitted text keeps them, and a tree of calls is no tree of text."""

from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio.shaders import bundle

SHADER = """
uniform float roughness;
float scale;
float lobe(float c, float a) { float t = c * c * (a * a - 1.0) + 1.0; return a * a / (3.14159265 * t * t); }
vec3 fresnel(float c, vec3 f0) { return f0 + (1.0 - f0) * (1.0 - c); }
void split(vec3 h, out float up, inout float sum) { up = h.z; sum = sum + h.x + h.y; scale = 2.0 * roughness; }
float count(int n) { float s = 0.0; for (int i = 0; i < n; i++) s += 0.25; return s; }
vec3 brdf(vec3 light, vec3 view, vec3 normal) {
    vec3 h = normalize(light + view);
    float up;
    float sum = 0.5;
    if (light.x > view.x) split(h, up, sum);
    else { up = h.z; scale = 1.0; }
    float w = lobe(up, roughness * roughness) * scale + count(3) * sum;
    return w * fresnel(dot(light, h), vec3(0.9, 0.5, 0.1));
}
"""


def directions(seed: int) -> np.ndarray:
    x = np.random.default_rng(seed).normal(size=(200, 3))
    x[:, 2] = np.abs(x[:, 2]) + 0.05
    return x / np.linalg.norm(x, axis=1, keepdims=True)


def expected(wo: np.ndarray, wi: np.ndarray, roughness: float) -> np.ndarray:
    h = (wo + wi) / np.linalg.norm(wo + wi, axis=1, keepdims=True)
    mask, a2 = wi[:, 0] > wo[:, 0], roughness**4
    scale, total = np.where(mask, 2.0 * roughness, 1.0), np.where(mask, 0.5 + h[:, 0] + h[:, 1], 0.5)
    t = h[:, 2] ** 2 * (a2 - 1.0) + 1.0
    w = a2 / (3.14159265 * t * t) * scale + 0.75 * total
    f0 = np.array([0.9, 0.5, 0.1])
    return w[:, None] * (f0 + (1.0 - f0) * (1.0 - np.sum(wi * h, axis=1)[:, None])) * wi[:, 2:]


@pytest.fixture
def shader(tmp_path: Path) -> go.BSDF:
    (tmp_path / "mine.glsl").write_text(SHADER)
    return go.Shader(tmp_path / "mine.glsl", roughness=0.6)


def test_values_with_out_arguments_globals_and_masks(shader: go.BSDF) -> None:
    wo, wi = directions(1), directions(2)
    np.testing.assert_allclose(shader.eval(wo, wi, precision="float64"), expected(wo, wi, 0.6), rtol=1e-5, atol=1e-12)


@pytest.mark.parametrize("language", ["glsl", "wgsl", "hlsl", "numpy"])
def test_emitted_text_keeps_functions_and_names(shader: go.BSDF, language: str) -> None:
    text = bundle(shader, language, ["eval"]).text
    for name in ("lobe", "fresnel", "split"):
        assert f" {name}(" in text, name
    assert "roughness" in text and " h_z" in text


def test_a_tree_of_calls_is_recorded_once_a_function(tmp_path: Path) -> None:
    lines = ["float f0(float x) { return x * 0.5; }"]
    lines += [f"float f{i}(float x) {{ return f{i - 1}(x) + f{i - 1}(0.5 * x) * 0.25; }}" for i in range(1, 11)]
    lines += ["vec3 brdf(vec3 light, vec3 view, vec3 normal) { return vec3(f10(light.z)); }"]
    (tmp_path / "tree.glsl").write_text("\n".join(lines))
    text = bundle(go.Shader(tmp_path / "tree.glsl"), "glsl", ["eval"]).text
    assert text.count("float f10(float x)") == 1 and len(text) < 20_000  # 1,024 calls of f0


def test_numbers_that_functions_return_may_bound_loops(tmp_path: Path) -> None:
    (tmp_path / "bounds.glsl").write_text("""
int steps(float x) { return 3; }
void both(float x, out int n, out float y) { n = 4; y = 2.0 * x; }
vec3 brdf(vec3 light, vec3 view, vec3 normal) {
    int n; float y; float s = 0.0;
    both(light.z, n, y);
    for (int i = 0; i < n; i++) for (int j = 0; j < steps(light.x); j++) s += y;
    return vec3(s);
}
""")
    wo, wi = directions(1), directions(2)
    values = go.Shader(tmp_path / "bounds.glsl").eval(wo, wi, precision="float64")
    np.testing.assert_allclose(values[:, 0], 24.0 * wi[:, 2] ** 2, rtol=1e-12)


def test_bits_go_into_functions_and_come_out(tmp_path: Path) -> None:
    (tmp_path / "bits.glsl").write_text("""
uint word(float x) { return floatBitsToUint(x); }
float exponent(uint bits, float scale) { return scale * float(int(bits >> 23) - 127); }
void parts(float x, out uint sign, out uint size) { uint w = word(x); sign = w & 0x80000000u; size = w & 0x7FFFFFFFu; }
vec3 brdf(vec3 light, vec3 view, vec3 normal) {
    uint sign; uint size;
    parts(light.x, sign, size);
    float back = uintBitsToFloat(sign | size);
    return vec3(exponent(word(light.z), 0.5), back, exponent(word(view.z), 0.5));
}
""")
    wo, wi = directions(5), directions(6)
    values = go.Shader(tmp_path / "bits.glsl").eval(wo, wi, precision="float64")
    levels = [0.5 * np.floor(np.log2(w[:, 2])) for w in (wi, wo)]
    np.testing.assert_allclose(values, np.stack([levels[0], wi[:, 0], levels[1]], axis=1) * wi[:, 2:], rtol=1e-12)


def test_a_function_of_a_texture_is_recorded_once(tmp_path: Path) -> None:
    np.save(tmp_path / "table.npy", np.linspace(0.0, 1.0, 16).reshape(4, 4, 1))
    (tmp_path / "mine.toml").write_text('[textures]\ntable = "table.npy"\n')
    (tmp_path / "mine.glsl").write_text("""
uniform sampler2D table;
float look(sampler2D t, float u) { return texture(t, vec2(u, u * u)).x; }
vec3 brdf(vec3 light, vec3 view, vec3 normal) { return vec3(look(table, light.z) + look(table, view.z)); }
""")
    text = bundle(go.Shader(tmp_path / "mine.glsl"), "glsl", ["eval"]).text
    assert text.count("float look(") == 1


def test_a_varying_integer_changes_its_sign_type(tmp_path: Path) -> None:
    (tmp_path / "cells.glsl").write_text("""
vec3 brdf(vec3 light, vec3 view, vec3 normal) {
    int cell = int(floor(8.0 * light.x));
    uint word = uint(cell);
    return vec3(word < 4u ? 1.0 : 0.0, float(int(word)), float(int(uint(view.z * 100.0))));
}
""")
    wo, wi = directions(5), directions(6)
    cell = np.floor(8.0 * wi[:, 0])
    expected = np.stack([(cell >= 0) & (cell < 4), cell, np.floor(wo[:, 2] * 100.0)], axis=1) * wi[:, 2:]
    values = go.Shader(tmp_path / "cells.glsl").eval(wo, wi, precision="float64")
    np.testing.assert_allclose(values, expected, rtol=1e-9)
