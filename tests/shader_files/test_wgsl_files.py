"""WGSL as a material: uniforms, textures, imports and a scene; its values against the same shader in GLSL's terms."""

import json
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio.catalog import shaders
from gonio.errors import InputError

TEXT = """
struct Material { base: vec3<f32>, roughness: f32, }
@group(0) @binding(0) var<uniform> material: Material;
@group(0) @binding(1) var<uniform> hue: vec4<f32>;
@group(0) @binding(2) var table: texture_2d<f32>;
@group(0) @binding(3) var table_sampler: sampler;
const PI = 3.141592653589793;
fn D_GGX(a2: f32, NdotH: f32) -> f32 {
    let t = 1 + (a2 - 1) * NdotH * NdotH;
    return a2 / (PI * t * t);
}
fn brdf(L: vec3f, V: vec3f, N: vec3f) -> vec3f {
    let H = normalize(L + V);
    let a = material.roughness * material.roughness;
    let f = material.base * hue.rgb;
    let scale = textureSampleLevel(table, table_sampler, vec2(N.x + 0.5, 0.5), 0.0).r;
    return f * D_GGX(a * a, dot(N, H)) * scale / 4.0;
}
"""


def directions(seed: int) -> np.ndarray:
    w = np.random.default_rng(seed).normal(size=(100, 3))
    w[:, 2] = np.abs(w[:, 2]) + 0.01
    return w / np.linalg.norm(w, axis=1, keepdims=True)


WO, WI = directions(1), directions(2)


def test_wgsl_equals_its_closed_form_before_and_after_adoption(tmp_path: Path) -> None:
    file = tmp_path / "metal.wgsl"
    file.write_text(TEXT)
    np.save(tmp_path / "table.npy", np.full((2, 2, 1), 3.0))
    adopted = shaders.adopt(file)
    assert any("L = light, V = view, N = normal" in guess for guess in adopted.guesses)
    (tmp_path / "metal.wgsl.toml").write_text(adopted.text)
    material = go.Shader(file, base=(0.2, 0.5, 0.8), roughness=0.5, hue_x=1.0, hue_y=0.5, hue_z=0.5)
    half = (WO + WI) / np.linalg.norm(WO + WI, axis=1, keepdims=True)
    a2 = 0.5**4
    density = a2 / (np.pi * (1 + (a2 - 1) * half[:, 2] ** 2) ** 2)
    expected = np.multiply.outer(density * WI[:, 2] * 0.75, [0.2, 0.25, 0.4])
    np.testing.assert_allclose(material.eval(WO, WI, precision="float64"), expected, rtol=1e-6)
    assert material.isotropic


def test_wgsl_in_a_scene_is_a_material(tmp_path: Path, scene: Path) -> None:
    (scene / "matte.wgsl").write_text("fn brdf(L: vec3f, V: vec3f, albedo: f32) -> f32 { return albedo / 3.14159265; }")
    described = json.loads((scene / "scene.json").read_text())
    described["scene"]["shapes"][0]["material"] = {"type": "shader", "file": "matte.wgsl", "albedo": 0.5}
    (scene / "scene.json").write_text(json.dumps(described))
    assert np.asarray(go.render(scene)).max() > 0.1


def test_imports_are_read_from_the_shaders_folder_and_named_ones(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "math.wgsl").write_text("#define_import_path engine::math\nconst PI: f32 = 3.1415927;\n")
    file = tmp_path / "matte.wgsl"
    file.write_text("#import engine::math::PI\nfn brdf(L: vec3f, V: vec3f, albedo: f32) -> f32 { return albedo / PI; }")
    with pytest.raises(InputError, match="named folders") as error:
        go.Shader(file)
    assert error.value.where == "matte.wgsl:1"
    (tmp_path / "matte.toml").write_text("includes = ['parts']\n")
    np.testing.assert_allclose(go.Shader(file, albedo=1.0).eval(WO, WI)[:, 0], WI[:, 2] / np.pi, rtol=1e-5)


OVERRIDES = """
override exponent: f32 = 2.0;
@id(3) override scale = 0.5;
override gain = 2.0 * scale + WIDE * 0.0;
override offset: f32;
const WIDE = 1.0;
override COUNT: i32 = HALF * 2;
override HALF: i32 = 1;
fn brdf(L: vec3f, V: vec3f) -> f32 {
    var sum = offset;
    for (var i = 0; i < COUNT; i++) { sum += gain * pow(L.z, exponent); }
    return sum;
}
"""


def test_override_of_f32_is_a_parameter(tmp_path: Path) -> None:
    file = tmp_path / "gloss.wgsl"
    file.write_text(OVERRIDES)
    material = go.Shader(file, offset=0.0)
    assert {"exponent", "scale", "offset"} == set(material.parameters())
    assert (material.exponent, material.scale) == (2.0, 0.5)
    expected = 2.0 * WI[:, 2] ** 3
    np.testing.assert_allclose(material.eval(WO, WI, precision="float64")[:, 0], expected, rtol=1e-6)
    changed = go.Shader(file, exponent=1.0, scale=1.5, offset=0.25).eval(WO, WI, precision="float64")[:, 0]
    np.testing.assert_allclose(changed, (0.25 + 2.0 * 3.0 * WI[:, 2]) * WI[:, 2], rtol=1e-6)


def test_value_of_an_override_in_the_adapter_is_a_constant(tmp_path: Path) -> None:
    file = tmp_path / "gloss.wgsl"
    file.write_text(OVERRIDES)
    (tmp_path / "gloss.wgsl.toml").write_text("defines = { scale = '1.5', gain = '3', offset = '0', COUNT = '1' }\n")
    material = go.Shader(file)
    assert set(material.parameters()) == {"exponent"}
    np.testing.assert_allclose(material.eval(WO, WI, precision="float64")[:, 0], 3.0 * WI[:, 2] ** 3, rtol=1e-6)


def test_each_override_is_computed_once(tmp_path: Path) -> None:
    lines = ["override a0: f32 = 0.25;", *(f"override a{i} = (a{i - 1} + a{i - 1}) * 0.5;" for i in range(1, 30))]
    file = tmp_path / "doubled.wgsl"
    file.write_text("\n".join([*reversed(lines), "fn brdf(L: vec3f, V: vec3f) -> f32 { return a29; }"]))
    np.testing.assert_allclose(go.Shader(file, a0=0.75).eval(WO, WI)[:, 0], 0.75 * WI[:, 2], rtol=1e-6)
    file.write_text("override a = b;\noverride b = a;\nfn brdf(L: vec3f, V: vec3f) -> f32 { return a; }")
    with pytest.raises(InputError, match="depends on itself"):
        go.Shader(file)
